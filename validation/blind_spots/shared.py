"""Functions that more than one side of a comparison (Exudyn, MuJoCo, the reference) shares, derived from the imports.

An engine's side is every module that imports the engine, and all that these import. ``systems`` are the third side:
they run every engine and read what it gives. A module belongs to one engine alone where it imports that engine, or
where only that engine's side imports it. Every other module is shared: both engines call it, or it works on the runs of
both, or it is found by listing a folder, where no import names it.

Of a shared module every compiled function counts, by its decorator. A function of Python counts where ``sides`` has
seen at least two engines call it for numbers, unless it is in a folder of ``MACHINERY_FOLDERS``; all other folders of
``models`` count, new ones too.
"""

import ast
import re
from collections.abc import Collection, Iterable, Iterator
from functools import cache

from validation.blind_spots.rewriting import COMPILER_PATTERN, ROOT, Function, module_tree, source_text

ENGINES = ("exudyn", "mujoco")
SYSTEMS_PREFIX = "models.systems."
MACHINERY_FOLDERS = ("advice", "core", "drawing", "ensemble", "machine")
"""Folders of ``models`` without physical laws of a vehicle: scene files, results, prices, workers, pictures."""
IMPORT_PATTERN = re.compile(
    r"^ *(?:import (\S.*)|from ((?:models|exudyn|mujoco)[.\w]*) import (?:\(([^)]*)\)|(.*)))", re.MULTILINE
)
COMPILING_DECORATORS = ("njit", "compiled", "lean", "inlined", "register_jitable", "cfunc")
"""Decorators of functions that numba compiles."""


@cache
def all_modules() -> frozenset[str]:
    """Names of all modules of ``models``."""
    paths = (path.relative_to(ROOT).with_suffix("") for path in sorted((ROOT / "models").rglob("*.py")))
    return frozenset(".".join(path.parts).removesuffix(".__init__") for path in paths)


@cache
def imported_modules(module_name: str) -> frozenset[str]:
    """Names of the modules of ``models`` and of the engines that a module imports, anywhere in its source."""
    names = set[str]()
    for whole, package, inside, line in IMPORT_PATTERN.findall(source_text(module_name)):
        parts = (part.split()[0] for part in (inside or line).split(",") if part.strip())
        names |= {whole.split()[0]} if whole else {package, *(f"{package}.{part}" for part in parts)}
    return frozenset((names & all_modules()) | ({name.partition(".")[0] for name in names} & set(ENGINES)))


def modules_of_side(start_modules: Iterable[str], excluded_modules: frozenset[str] = frozenset()) -> set[str]:
    """The start modules and all modules that they import, directly or indirectly, without imports through excluded
    modules."""
    reached, left = set[str](), [name for name in start_modules if name not in excluded_modules]
    while left:
        name = left.pop()
        if name not in reached:
            reached.add(name)
            left += [each for each in imported_modules(name) if each not in ENGINES and each not in excluded_modules]
    return reached


@cache
def shared_modules() -> tuple[str, ...]:
    """Sorted names of the modules that more than one implementation (Exudyn, MuJoCo or the reference) uses."""
    of = [{name for name in all_modules() if engine in imported_modules(name)} for engine in ENGINES]
    engines = frozenset[str]().union(*of)
    first, second = (modules_of_side(names) for names in of)
    systems = modules_of_side((name for name in all_modules() if name.startswith(SYSTEMS_PREFIX)), engines)
    alone = (first ^ second) - systems
    return tuple(sorted(all_modules() - engines - alone - {"models"}))


def function_definitions(module_name: str) -> Iterator[tuple[str, Function]]:
    """Qualified name and syntax tree of each function of a module."""

    def inside(syntax_node: ast.AST, name_prefix: str) -> Iterator[tuple[str, Function]]:
        for child in (*getattr(syntax_node, "body", ()), *getattr(syntax_node, "orelse", ())):
            if isinstance(child, Function):
                yield name_prefix + child.name, child
                yield from inside(child, f"{name_prefix}{child.name}.<locals>.")
            elif isinstance(child, ast.stmt):
                yield from inside(
                    child, f"{name_prefix}{child.name}." if isinstance(child, ast.ClassDef) else name_prefix
                )

    return inside(module_tree(module_name), "")


def is_compiled(function_node: Function) -> bool:
    """Whether numba compiles a function, by its decorators."""
    names = (ast.unparse(each).partition("(")[0].rpartition(".")[2] for each in function_node.decorator_list)
    return any(name in COMPILING_DECORATORS for name in names)


@cache
def compiled_functions() -> list[str]:
    """``module:name`` of every compiled function of the shared modules."""
    compiling = [module for module in shared_modules() if COMPILER_PATTERN.search(source_text(module))]
    return [
        f"{module}:{name}" for module in compiling for name, each in function_definitions(module) if is_compiled(each)
    ]


@cache
def law_functions() -> list[str]:
    """``module:name`` of every function, compiled or not, of the shared modules with physical laws."""
    laws = [module for module in shared_modules() if module.split(".")[1] not in MACHINERY_FOLDERS]
    return [f"{module}:{name}" for module in laws for name, _ in function_definitions(module)]


def candidate_functions() -> list[str]:
    """``module:name`` of all functions that the audit may examine, compiled functions first."""
    return list(dict.fromkeys((*compiled_functions(), *law_functions())))


def shared_functions(python_functions: Collection[str]) -> list[str]:
    """``module:name`` of all shared functions, compiled functions first. python_functions: Python functions that at
    least two engines call."""
    compiled = set(compiled_functions())
    return [name for name in candidate_functions() if name in compiled or name in python_functions]
