"""Rewriting of a module so that faults can be planted in what its functions return, yield or write into arguments.

A number that a function assigns into an argument, or into an element of an argument, is multiplied by the fault's
factor as it is assigned. An array argument that the functions which it calls write into is multiplied as a whole, at
the function's end; so is an array that it creates over a pointer. Where it creates none, the array's length is unknown,
and the numbers passed to the called functions are multiplied instead.
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
"""Function of ``spoiling`` that plants a fault -> its name in a rewritten module."""
COMPILER_PATTERN = re.compile(r"\bnumba\b|machine\.compiled")
"""Pattern in the source of a module that compiles functions with numba."""
Function = ast.FunctionDef | ast.AsyncFunctionDef
VIEW_FUNCTIONS = (
    "array_at",
    "double_at",
    "row",
    "array",
    "beyond",
    "start",
    "at",
    "records_at_pointer",
    "reshape",
    "ravel",
)
"""Functions of ``models.machine`` and numpy that return a view of their first argument."""


class NoSuchFunction(Exception):
    """A module has no function of this name."""


@cache
def source_text(module_name: str) -> str:
    """Source text of a module of the project."""
    path = ROOT.joinpath(*module_name.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return file.read_text(encoding="utf-8")


@cache
def module_tree(module_name: str) -> ast.Module:
    """Syntax tree of a module of the project."""
    return ast.parse(source_text(module_name))


def function_definition(syntax_tree: ast.AST, function_name: str) -> Function:
    """Syntax tree of the function with a qualified name. Raises NoSuchFunction where there is none."""
    scope: ast.AST = syntax_tree
    for part in function_name.replace(".<locals>", "").split("."):
        inner = [
            each for each in _nodes_of_block(scope) if isinstance(each, Function | ast.ClassDef) and each.name == part
        ]
        if not inner:
            raise NoSuchFunction(function_name)
        scope = inner[-1]
    if not isinstance(scope, Function):
        raise NoSuchFunction(function_name)
    return scope


def _nodes_of_block(block_node: ast.AST) -> Iterator[ast.AST]:
    """Syntax nodes of a function's block, without nodes inside nested functions and classes."""
    for child in ast.iter_child_nodes(block_node):
        yield child
        if not isinstance(child, Function | ast.ClassDef | ast.Lambda):
            yield from _nodes_of_block(child)


def argument_names(function_node: Function) -> list[str]:
    """Names of a function's arguments, without ``self`` and ``cls``."""
    given = [
        each.arg for each in (*function_node.args.posonlyargs, *function_node.args.args, *function_node.args.kwonlyargs)
    ]
    return [name for name in given if name not in ("self", "cls")]


def argument_of_names(function_node: Function) -> dict[str, str]:
    """Name in a function -> name of the argument that it refers to or is a view of."""
    argument_of = {name: name for name in argument_names(function_node)}
    for node in _nodes_of_block(function_node):
        if isinstance(node, ast.Assign):
            for target, value in _assigned_pairs(node):
                root = root_argument(value, argument_of)
                if isinstance(target, ast.Name) and root and not isinstance(value, ast.BinOp):
                    argument_of.setdefault(target.id, root)
    return argument_of


def _assigned_pairs(assignment: ast.Assign) -> Iterator[tuple[ast.expr, ast.expr]]:
    for target in assignment.targets:
        if isinstance(target, ast.Tuple) and isinstance(assignment.value, ast.Tuple):
            yield from zip(target.elts, assignment.value.elts, strict=False)
        else:
            yield target, assignment.value


def root_argument(expression: ast.expr, argument_of_name: dict[str, str]) -> str:
    """Name of the argument that an expression is an element, attribute or view of; "" for none."""
    while isinstance(expression, ast.Subscript | ast.Attribute | ast.Call):
        if isinstance(expression, ast.Call):
            inner = (
                expression.func.attr
                if isinstance(expression.func, ast.Attribute)
                else getattr(expression.func, "id", "")
            )
            if inner not in VIEW_FUNCTIONS:
                return ""
            expression = (
                expression.args[0] if isinstance(expression.func, ast.Name) and expression.args else expression.func
            )
        else:
            expression = expression.value
    return argument_of_name.get(expression.id, "") if isinstance(expression, ast.Name) else ""


def _written_arguments(assignment: ast.AST, argument_of_name: dict[str, str]) -> set[str]:
    """Names of the arguments that an assignment statement writes into."""
    targets = (
        assignment.targets
        if isinstance(assignment, ast.Assign)
        else [assignment.target]
        if isinstance(assignment, ast.AugAssign)
        else []
    )
    parts = [part for target in targets for part in (target.elts if isinstance(target, ast.Tuple) else [target])]
    return {
        root_argument(part, argument_of_name) for part in parts if isinstance(part, ast.Subscript | ast.Attribute)
    } - {""}


def _defining_module(module_name: str, used_name: str) -> tuple[str, str] | None:
    """Module and original name of a name that a module uses; its import from ``models`` is followed."""
    for node in ast.walk(module_tree(module_name)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("models"):
            for each in node.names:
                if (each.asname or each.name) == used_name:
                    return node.module, each.name
    return module_name, used_name


@cache
def original_definition(module_name: str, function_name: str) -> Function | None:
    """Syntax tree of a function in the unchanged source; None if there is no such function."""
    try:
        return function_definition(module_tree(module_name), function_name)
    except (NoSuchFunction, OSError):
        return None


@cache
def arguments_written_by_callees(module_name: str, function_name: str) -> frozenset[str]:
    """Names of a function's arguments that it passes to other functions which write into them. In a recursion, a
    function already being examined counts as writing nothing."""
    function = original_definition(module_name, function_name)
    if function is None or (module_name, function_name) in _functions_in_progress:
        return frozenset()
    _functions_in_progress.add((module_name, function_name))
    argument_of, touched = argument_of_names(function), set[str]()
    for node in _nodes_of_block(function):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            touched |= arguments_written_by_call((module_name, function_name), node, argument_of)
    _functions_in_progress.remove((module_name, function_name))
    return frozenset(touched)


_functions_in_progress: set[tuple[str, str]] = set()


def arguments_written_by_call(
    calling_function: tuple[str, str], call_node: ast.Call, argument_of_name: dict[str, str]
) -> set[str]:
    """Names of the caller's arguments that a call passes to a function which writes into them. calling_function: module
    and name of the calling function."""
    definition = _defining_module(calling_function[0], getattr(call_node.func, "id", ""))
    if definition is None or definition == calling_function:
        return set()
    callee = original_definition(*definition)
    if callee is None:
        return set()
    inner = argument_of_names(callee)
    touched = set().union(
        *(_written_arguments(node, inner) for node in _nodes_of_block(callee))
    ) | arguments_written_by_callees(*definition)
    pairs = zip(call_node.args, argument_names(callee), strict=False)
    return {root_argument(given, argument_of_name) for given, parameter in pairs if parameter in touched} - {""}


def arrays_over_pointers(
    function_node: Function, argument_of_name: dict[str, str], root_names: set[str]
) -> dict[str, list[ast.Call]]:
    """Pointer argument of a function -> calls ``array(pointer, shape)`` that create arrays over it. Only calls count
    whose names are arguments or occur in assignments at the function's top level."""
    outermost = {*argument_names(function_node)}
    for statement in function_node.body:
        if isinstance(statement, ast.Assign):
            outermost |= {each.id for each in ast.walk(statement) if isinstance(each, ast.Name)}
    arrays = dict[str, list[ast.Call]]()
    for node in _nodes_of_block(function_node):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "array":
            pointer, names = node.args[0], {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
            root = argument_of_name.get(pointer.id, "") if isinstance(pointer, ast.Name) else ""
            if root in root_names and names <= outermost | {"array"}:
                arrays.setdefault(root, []).append(node)
    return {root: list({ast.unparse(each): each for each in calls}.values()) for root, calls in arrays.items()}


class _FaultRewriter(ast.NodeTransformer):
    """Rewriter of a function whose results are to be multiplied by the fault's factor. caller: the function's module
    and name; scaled_arguments: arguments that are multiplied when the function ends; number: of the function."""

    def __init__(
        self,
        module_and_function: tuple[str, str],
        function_node: Function,
        scaled_arguments: list[str],
        function_number: int,
    ) -> None:
        self.caller, self.argument_of, self.scaled_arguments, self.number = (
            module_and_function,
            argument_of_names(function_node),
            scaled_arguments,
            function_number,
        )
        self.arrays = {
            root: [copy.deepcopy(each) for each in calls]
            for root, calls in arrays_over_pointers(function_node, self.argument_of, {*scaled_arguments}).items()
        }

    def body(self, body_statements: list[ast.stmt]) -> list[ast.stmt]:
        """Rewritten statements of the function's body."""
        made: list[ast.stmt] = []
        for statement in body_statements:
            new = self.visit(statement)
            made += new if isinstance(new, list) else [new]
        return made if isinstance(made[-1], ast.Return) else [*made, *self._endings()]

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        return node

    visit_Lambda = visit_ClassDef = visit_AsyncFunctionDef = visit_FunctionDef  # type: ignore[assignment]

    def visit_Return(self, node: ast.Return) -> list[ast.stmt]:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            return [*self._endings(), node]
        if not self.scaled_arguments:
            return [ast.Return(self._spoiled(node.value))]
        held = ast.Assign([ast.Name("_given_by_audit", ast.Store())], self._spoiled(node.value))
        return [held, *self._endings(), ast.Return(ast.Name("_given_by_audit", ast.Load()))]

    def visit_Yield(self, node: ast.Yield) -> ast.Yield:
        return ast.Yield(self._spoiled(node.value)) if node.value else node

    def visit_Expr(self, node: ast.Expr) -> ast.Expr:
        """Rewrite a call that writes behind a pointer, so that the numbers passed to it carry the fault; arrays are
        multiplied at the function's end."""
        if isinstance(node.value, ast.Call):
            for root in sorted(arguments_written_by_call(self.caller, node.value, self.argument_of) - {*self.arrays})[
                :1
            ]:
                given = [
                    each if root_argument(each, self.argument_of) else self._into(each, root)
                    for each in node.value.args
                ]
                node.value.args = given
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        return self._put(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AugAssign:
        return self._put(node)

    def _put(self, assignment: Any) -> Any:
        """Rewrite an assignment into an argument so that the assigned value carries the fault. If the whole argument is
        multiplied at the end, the value is only changed where the argument is not an array."""
        into = sorted(_written_arguments(assignment, self.argument_of))
        if into and not set(into) & set(self.scaled_arguments):
            assignment.value = self._spoiled(assignment.value)
        elif into:
            whole = next(name for name in into if name in self.scaled_arguments)
            assignment.value = self._into(assignment.value, whole)
        return assignment

    def _spoiled(self, value_node: ast.expr) -> ast.Call:
        return self._call(SPOILED, value_node)

    def _into(self, value_node: ast.expr, argument_name: str) -> ast.Call:
        return self._call(PUT, value_node, ast.Name(argument_name, ast.Load()))

    def _endings(self) -> list[ast.stmt]:
        """Statements for the function's end that multiply whole array arguments by the fault's factor."""
        wholes = [
            whole for name in self.scaled_arguments for whole in self.arrays.get(name, [ast.Name(name, ast.Load())])
        ]
        return [ast.Expr(self._call(SCALED, whole)) for whole in wholes]

    def _call(self, helper_name: str, *argument_nodes: ast.expr) -> ast.Call:
        return ast.Call(ast.Name(helper_name, ast.Load()), [*argument_nodes, ast.Constant(self.number)], [])


def rewritten_module(source_code: str, module_name: str, function_numbers: dict[str, int]) -> ast.Module:
    """Syntax tree of a module with some of its functions rewritten. function_numbers: name -> number of the function.
    Raises NoSuchFunction where a name is not defined."""
    parsed = ast.parse(source_code)
    for name, number in function_numbers.items():
        function = function_definition(parsed, name)
        scaled_arguments = sorted(arguments_written_by_callees(module_name, name))
        function.body = _FaultRewriter((module_name, name), function, scaled_arguments, number).body(function.body)
    helpers: list[ast.stmt] = [ast.ImportFrom("validation.blind_spots.spoiling", [*map(_as_helper, HELPERS)], 0)]
    if COMPILER_PATTERN.search(source_code):
        helpers += [ast.Import([ast.alias("validation.blind_spots.compiled_spoiling", "_compiled_by_audit")])]
    first = sum(1 for _ in takewhile(_is_module_head, parsed.body))
    parsed.body[first:first] = helpers
    return ast.fix_missing_locations(parsed)


def _as_helper(helper_name: str) -> ast.alias:
    return ast.alias(helper_name, HELPERS[helper_name])


def _is_module_head(statement: ast.stmt) -> bool:
    """Whether a statement must stay at the head of a module: the docstring or an import from ``__future__``."""
    is_docstring = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return is_docstring or (isinstance(statement, ast.ImportFrom) and statement.module == "__future__")


def can_be_spoiled(module_name: str, function_name: str) -> bool:
    """Whether a function returns or writes a value in which a fault can be planted."""
    function = function_definition(
        rewritten_module(source_text(module_name), module_name, {function_name: 0}), function_name
    )
    named = {
        node.func.id for node in ast.walk(function) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    return bool(named & {SPOILED, SCALED, PUT})
