"""The source of a module with one function spoiled: what it returns, yields or writes into its arguments.

Numbers that it puts into an argument, or into a part of one, are spoiled as they are put there. An array that functions
which it calls write into is spoiled as a whole instead, where it ends; behind a pointer, whose length nobody knows, the
numbers are that those functions are given.
"""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SPOILED, SCALED, PUT = "_spoiled_by_audit", "_scaled_by_audit", "_put_by_audit"
Function = ast.FunctionDef | ast.AsyncFunctionDef
VIEWS = ("array_at", "double_at", "row", "array", "beyond", "start", "at", "records", "reshape", "ravel")
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
def tree(module: str) -> ast.Module:
    """The parsed source of a module of the project."""
    return ast.parse(text(module))


def function_of(parsed: ast.AST, name: str) -> Function:
    """The definition with this qualified name; raises NoSuchFunction."""
    place: ast.AST = parsed
    for part in name.replace(".<locals>", "").split("."):
        inner = [each for each in _inside(place) if isinstance(each, Function | ast.ClassDef) and each.name == part]
        if not inner:
            raise NoSuchFunction(name)
        place = inner[-1]
    if not isinstance(place, Function):
        raise NoSuchFunction(name)
    return place


def _inside(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a block, without those in functions and classes inside it."""
    for child in ast.iter_child_nodes(node):
        yield child
        if not isinstance(child, Function | ast.ClassDef | ast.Lambda):
            yield from _inside(child)


def parameters(function: Function) -> list[str]:
    """Names of a function's arguments, without the object of a method."""
    given = [each.arg for each in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return [name for name in given if name not in ("self", "cls")]


def roots(function: Function) -> dict[str, str]:
    """Names that stand for an argument or a part of it, and that argument."""
    known = {name: name for name in parameters(function)}
    for node in _inside(function):
        if isinstance(node, ast.Assign):
            for target, value in _pairs(node):
                root = root_of(value, known)
                if isinstance(target, ast.Name) and root and not isinstance(value, ast.BinOp):
                    known.setdefault(target.id, root)
    return known


def _pairs(node: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    for target in node.targets:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from zip(target.elts, node.value.elts, strict=False)
        else:
            yield target, node.value


def root_of(node: ast.expr, known: dict[str, str]) -> str:
    """The argument that an expression is a part of; "" for none."""
    while isinstance(node, ast.Subscript | ast.Attribute | ast.Call):
        if isinstance(node, ast.Call):
            inner = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if inner not in VIEWS:
                return ""
            node = node.args[0] if isinstance(node.func, ast.Name) and node.args else node.func
        else:
            node = node.value
    return known.get(node.id, "") if isinstance(node, ast.Name) else ""


def _stores(node: ast.AST, known: dict[str, str]) -> set[str]:
    """Arguments that an assignment writes into."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AugAssign) else []
    parts = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return {root_of(part, known) for part in parts if isinstance(part, ast.Subscript | ast.Attribute)} - {""}


def _imported(module: str, name: str) -> tuple[str, str] | None:
    """Where a name that a module uses is defined: module and name; None outside of the project."""
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("models"):
            for each in node.names:
                if (each.asname or each.name) == name:
                    return node.module, each.name
    return module, name


@cache
def written(module: str, name: str) -> frozenset[str]:
    """Arguments that the functions which this one calls write into."""
    try:
        function = function_of(tree(module), name)
    except (NoSuchFunction, OSError):
        return frozenset()
    known, touched = roots(function), set[str]()
    for node in _inside(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            touched |= handed((module, name), node, known)
    return frozenset(touched)


def handed(caller: tuple[str, str], call: ast.Call, known: dict[str, str]) -> set[str]:
    """Arguments of the caller (module, name) that a call hands to a function which writes into them."""
    place = _imported(caller[0], getattr(call.func, "id", ""))
    if place is None or place == caller:
        return set()
    try:
        callee = function_of(tree(place[0]), place[1])
    except (NoSuchFunction, OSError):
        return set()
    inner = roots(callee)
    touched = set().union(*(_stores(node, inner) for node in _inside(callee))) | written(*place)
    pairs = zip(call.args, parameters(callee), strict=False)
    return {root_of(given, known) for given, parameter in pairs if parameter in touched} - {""}


class _Spoil(ast.NodeTransformer):
    def __init__(self, caller: tuple[str, str], known: dict[str, str], last: list[str]) -> None:
        self.caller, self.known, self.last = caller, known, last

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        return node

    visit_Lambda = visit_ClassDef = visit_AsyncFunctionDef = visit_FunctionDef  # type: ignore[assignment]

    def visit_Return(self, node: ast.Return) -> list[ast.stmt]:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            return [*endings(self.last), node]
        if not self.last:
            return [ast.Return(_call(SPOILED, node.value))]
        held = ast.Assign([ast.Name("_given_by_audit", ast.Store())], _call(SPOILED, node.value))
        return [held, *endings(self.last), ast.Return(ast.Name("_given_by_audit", ast.Load()))]

    def visit_Yield(self, node: ast.Yield) -> ast.Yield:
        return ast.Yield(_call(SPOILED, node.value)) if node.value else node

    def visit_Expr(self, node: ast.Expr) -> ast.Expr:
        """What a call hands over to be written behind a pointer is spoiled before; an array is at the end."""
        if isinstance(node.value, ast.Call):
            for root in sorted(handed(self.caller, node.value, self.known))[:1]:
                given = [each if root_of(each, self.known) else _put(each, root) for each in node.value.args]
                node.value.args = given
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        return self._put(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AugAssign:
        return self._put(node)

    def _put(self, node: Any) -> Any:
        """The assignment with what it puts into an argument spoiled, unless that is spoiled as a whole."""
        into = sorted(_stores(node, self.known))
        if into and not set(into) & set(self.last):
            node.value = _call(SPOILED, node.value)
        elif into:
            whole = next(name for name in into if name in self.last)
            node.value = _put(node.value, whole)
        return node


def _call(name: str, value: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), [value], [])


def _put(value: ast.expr, place: str) -> ast.Call:
    return ast.Call(ast.Name(PUT, ast.Load()), [value, ast.Name(place, ast.Load())], [])


def endings(names: list[str]) -> list[ast.stmt]:
    """Statements that spoil arguments as a whole."""
    return [ast.Expr(_call(SCALED, ast.Name(name, ast.Load()))) for name in names]


def rewritten(source: str, module: str, name: str) -> ast.Module:
    """The module's tree with the function spoiled; raises NoSuchFunction."""
    parsed = ast.parse(source)
    function = function_of(parsed, name)
    known = roots(function)
    last = sorted(written(module, name))
    spoil = _Spoil((module, name), known, last)
    body: list[ast.stmt] = []
    for statement in function.body:
        new = spoil.visit(statement)
        body += new if isinstance(new, list) else [new]
    function.body = body if isinstance(body[-1], ast.Return) else [*body, *endings(last)]
    names = [ast.alias("spoiled", SPOILED), ast.alias("scaled", SCALED), ast.alias("put", PUT)]
    helper = ast.ImportFrom("validation.blind_spots.spoiling", names, 0)
    docstring = isinstance(parsed.body[0], ast.Expr) and isinstance(parsed.body[0].value, ast.Constant)
    parsed.body.insert(1 if docstring else 0, ast.copy_location(helper, parsed.body[0]))
    return ast.fix_missing_locations(parsed)


def can_be_spoiled(module: str, name: str) -> bool:
    """Whether rewriting finds anything that a function gives back or writes."""
    function = function_of(rewritten(text(module), module, name), name)
    named = {
        node.func.id for node in ast.walk(function) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    return bool(named & {SPOILED, SCALED, PUT})
