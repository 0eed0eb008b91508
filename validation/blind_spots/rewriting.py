"""The source of a module whose functions can be spoiled: what they return, yield or write into their arguments.

Numbers that one puts into an argument, or into a part of one, are spoiled as they are put there. An array that
functions which it calls write into is spoiled as a whole instead, where it ends; so is an array that it sees behind a
pointer. Where it sees none, nobody knows the length, and the numbers are that those functions are given.
"""

import ast
import copy
import re
from collections.abc import Iterator
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SPOILED, SCALED, PUT = "_spoiled_by_audit", "_scaled_by_audit", "_put_by_audit"
HELPERS = {"spoiled": SPOILED, "scaled": SCALED, "put": PUT}
"""Functions of ``spoiling``, and their names in a rewritten module."""
COMPILER_PATTERN = re.compile(r"\bnumba\b|machine\.compiled")
"""What the source of a module names that compiles functions."""
Function = ast.FunctionDef | ast.AsyncFunctionDef
VIEW_FUNCTIONS = ("array_at", "double_at", "row", "array", "beyond", "start", "at", "records", "reshape", "ravel")
"""Functions that give a view of their first argument: those of ``models.machine``, and numpy's."""


class NoSuchFunction(Exception):
    """A module has no function of this name."""


@cache
def text(module: str) -> str:
    """The source of a module of the project."""
    path = ROOT.joinpath(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return file.read_text(encoding="utf-8")


@cache
def module_tree(module: str) -> ast.Module:
    """The parsed source of a module of the project."""
    return ast.parse(text(module))


def function_of(parsed: ast.AST, name: str) -> Function:
    """The definition with this qualified name; raises NoSuchFunction."""
    place: ast.AST = parsed
    for part in name.replace(".<locals>", "").split("."):
        inner = [
            each for each in _nodes_of_block(place) if isinstance(each, Function | ast.ClassDef) and each.name == part
        ]
        if not inner:
            raise NoSuchFunction(name)
        place = inner[-1]
    if not isinstance(place, Function):
        raise NoSuchFunction(name)
    return place


def _nodes_of_block(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a function's block, except those inside nested functions and classes."""
    for child in ast.iter_child_nodes(node):
        yield child
        if not isinstance(child, Function | ast.ClassDef | ast.Lambda):
            yield from _nodes_of_block(child)


def parameters(function: Function) -> list[str]:
    """Names of a function's arguments, without the object of a method."""
    given = [each.arg for each in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return [name for name in given if name not in ("self", "cls")]


def roots_of_names(function: Function) -> dict[str, str]:
    """Names that refer to an argument of the function or to a view of it, each with the argument's name."""
    known = {name: name for name in parameters(function)}
    for node in _nodes_of_block(function):
        if isinstance(node, ast.Assign):
            for target, value in _assigned_pairs(node):
                root = root_of(value, known)
                if isinstance(target, ast.Name) and root and not isinstance(value, ast.BinOp):
                    known.setdefault(target.id, root)
    return known


def _assigned_pairs(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    for target in node.targets:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from zip(target.elts, node.value.elts, strict=False)
        else:
            yield target, node.value


def root_of(node: ast.expr, known: dict[str, str]) -> str:
    """Name of the argument of which an expression is an element, attribute or view; "" for none."""
    while isinstance(node, ast.Subscript | ast.Attribute | ast.Call):
        if isinstance(node, ast.Call):
            inner = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if inner not in VIEW_FUNCTIONS:
                return ""
            node = node.args[0] if isinstance(node.func, ast.Name) and node.args else node.func
        else:
            node = node.value
    return known.get(node.id, "") if isinstance(node, ast.Name) else ""


def _written_arguments(node: ast.AST, known: dict[str, str]) -> set[str]:
    """Names of the arguments that an assignment writes into."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AugAssign) else []
    parts = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return {root_of(part, known) for part in parts if isinstance(part, ast.Subscript | ast.Attribute)} - {""}


def _defining_module(module: str, name: str) -> tuple[str, str] | None:
    """Module and name where a name used in a module is defined; None for names from outside the project."""
    for node in ast.walk(module_tree(module)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("models"):
            for each in node.names:
                if (each.asname or each.name) == name:
                    return node.module, each.name
    return module, name


@cache
def original_definition(module: str, name: str) -> Function | None:
    """Definition of a function in the unchanged sources; None if there is none."""
    try:
        return function_of(module_tree(module), name)
    except (NoSuchFunction, OSError):
        return None


@cache
def written_arguments(module: str, name: str) -> frozenset[str]:
    """Arguments of a function that it passes to other functions which write into them. A function that is being
    examined already, in a recursion, counts as writing nothing."""
    function = original_definition(module, name)
    if function is None or (module, name) in _functions_asked:
        return frozenset()
    _functions_asked.add((module, name))
    known, touched = roots_of_names(function), set[str]()
    for node in _nodes_of_block(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            touched |= arguments_handed_on((module, name), node, known)
    _functions_asked.remove((module, name))
    return frozenset(touched)


_functions_asked: set[tuple[str, str]] = set()


def arguments_handed_on(caller: tuple[str, str], call: ast.Call, known: dict[str, str]) -> set[str]:
    """Names of the caller's arguments that a call passes to a function which writes into them; caller: module and
    name."""
    place = _defining_module(caller[0], getattr(call.func, "id", ""))
    if place is None or place == caller:
        return set()
    callee = original_definition(*place)
    if callee is None:
        return set()
    inner = roots_of_names(callee)
    touched = set().union(*(_written_arguments(node, inner) for node in _nodes_of_block(callee))) | written_arguments(
        *place
    )
    pairs = zip(call.args, parameters(callee), strict=False)
    return {root_of(given, known) for given, parameter in pairs if parameter in touched} - {""}


def arrays_behind(function: Function, known: dict[str, str], roots: set[str]) -> dict[str, list[ast.Call]]:
    """Arrays that a function creates over pointers with ``array(pointer, shape)``, by the pointer's argument. Only
    calls count whose names are arguments or occur in assignments at the function's top level."""
    outermost = {*parameters(function)}
    for statement in function.body:
        if isinstance(statement, ast.Assign):
            outermost |= {each.id for each in ast.walk(statement) if isinstance(each, ast.Name)}
    behind = dict[str, list[ast.Call]]()
    for node in _nodes_of_block(function):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "array":
            pointer, names = node.args[0], {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
            root = known.get(pointer.id, "") if isinstance(pointer, ast.Name) else ""
            if root in roots and names <= outermost | {"array"}:
                behind.setdefault(root, []).append(node)
    return {root: list({ast.unparse(each): each for each in calls}.values()) for root, calls in behind.items()}


class _Spoil(ast.NodeTransformer):
    """Rewrites one function so that its results carry the fault. caller: its module and name; last: arguments that are
    scaled when the function ends; behind: arrays over those of them that are pointers, see ``arrays_behind``."""

    def __init__(self, caller: tuple[str, str], function: Function, last: list[str], place: int) -> None:
        self.caller, self.known, self.last, self.place = caller, roots_of_names(function), last, place
        self.behind = {
            root: [copy.deepcopy(each) for each in calls]
            for root, calls in arrays_behind(function, self.known, {*last}).items()
        }

    def body(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        """The rewritten statements of the function's body."""
        made: list[ast.stmt] = []
        for statement in statements:
            new = self.visit(statement)
            made += new if isinstance(new, list) else [new]
        return made if isinstance(made[-1], ast.Return) else [*made, *self._endings()]

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        return node

    visit_Lambda = visit_ClassDef = visit_AsyncFunctionDef = visit_FunctionDef  # type: ignore[assignment]

    def visit_Return(self, node: ast.Return) -> list[ast.stmt]:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            return [*self._endings(), node]
        if not self.last:
            return [ast.Return(self._spoiled(node.value))]
        held = ast.Assign([ast.Name("_given_by_audit", ast.Store())], self._spoiled(node.value))
        return [held, *self._endings(), ast.Return(ast.Name("_given_by_audit", ast.Load()))]

    def visit_Yield(self, node: ast.Yield) -> ast.Yield:
        return ast.Yield(self._spoiled(node.value)) if node.value else node

    def visit_Expr(self, node: ast.Expr) -> ast.Expr:
        """Spoil the value that a call writes behind a pointer before the call; an array is spoiled at the end."""
        if isinstance(node.value, ast.Call):
            for root in sorted(arguments_handed_on(self.caller, node.value, self.known) - {*self.behind})[:1]:
                given = [each if root_of(each, self.known) else self._into(each, root) for each in node.value.args]
                node.value.args = given
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        return self._put(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AugAssign:
        return self._put(node)

    def _put(self, node: Any) -> Any:
        """Rewrite an assignment into an argument so that the assigned value carries the fault. If the whole argument is
        scaled at the end, the value is only changed where the argument is no array."""
        into = sorted(_written_arguments(node, self.known))
        if into and not set(into) & set(self.last):
            node.value = self._spoiled(node.value)
        elif into:
            whole = next(name for name in into if name in self.last)
            node.value = self._into(node.value, whole)
        return node

    def _spoiled(self, value: ast.expr) -> ast.Call:
        return self._call(SPOILED, value)

    def _into(self, value: ast.expr, argument: str) -> ast.Call:
        return self._call(PUT, value, ast.Name(argument, ast.Load()))

    def _endings(self) -> list[ast.stmt]:
        """Statements at the function's end that scale whole arguments."""
        wholes = [whole for name in self.last for whole in self.behind.get(name, [ast.Name(name, ast.Load())])]
        return [ast.Expr(self._call(SCALED, whole)) for whole in wholes]

    def _call(self, name: str, *arguments: ast.expr) -> ast.Call:
        return ast.Call(ast.Name(name, ast.Load()), [*arguments, ast.Constant(self.place)], [])


def rewritten(source: str, module: str, names: dict[str, int]) -> ast.Module:
    """Syntax tree of the module with some functions rewritten; names: the number of each function's fault. Raises
    NoSuchFunction."""
    parsed = ast.parse(source)
    for name, place in names.items():
        function = function_of(parsed, name)
        last = sorted(written_arguments(module, name))
        function.body = _Spoil((module, name), function, last, place).body(function.body)
    helpers: list[ast.stmt] = [ast.ImportFrom("validation.blind_spots.spoiling", [*map(_as_helper, HELPERS)], 0)]
    if COMPILER_PATTERN.search(source):
        helpers += [ast.Import([ast.alias("validation.blind_spots.compiled_spoiling", "_compiled_by_audit")])]
    first = sum(1 for _ in takewhile(_stands_first, parsed.body))
    parsed.body[first:first] = helpers
    return ast.fix_missing_locations(parsed)


def _as_helper(name: str) -> ast.alias:
    return ast.alias(name, HELPERS[name])


def _stands_first(statement: ast.stmt) -> bool:
    """Whether a statement must stay at the head of a module: the docstring or an import from ``__future__``."""
    is_docstring = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return is_docstring or (isinstance(statement, ast.ImportFrom) and statement.module == "__future__")


def can_be_spoiled(module: str, name: str) -> bool:
    """Whether the function returns or writes a value into which a fault can be planted."""
    function = function_of(rewritten(text(module), module, {name: 0}), name)
    named = {
        node.func.id for node in ast.walk(function) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    return bool(named & {SPOILED, SCALED, PUT})
