"""``spoiling`` in compiled code, whose factors are read from memory as it runs: a new fault compiles nothing."""

from typing import Any

import llvmlite.binding
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.targetconfig import ConfigStack
from numba.extending import intrinsic, overload

from validation.blind_spots.memory import ADDRESS, ADDRESS_SYMBOL, MOST_FUNCTIONS
from validation.blind_spots.spoiling import put, scaled, spoiled

_intrinsic: Any = intrinsic
llvmlite.binding.add_symbol(ADDRESS_SYMBOL, ADDRESS)


def _pointer(builder: Any, row: int, place: Any) -> Any:
    """Address of a function's entry in a row of ``memory`` (faults, functions that ran, functions that gave
    numbers)."""
    double = ir.DoubleType()
    rows = builder.module.globals.get(ADDRESS_SYMBOL)
    rows = rows or ir.GlobalVariable(builder.module, ir.ArrayType(double, 3 * MOST_FUNCTIONS), ADDRESS_SYMBOL)
    whole = ir.IntType(64)
    return builder.gep(rows, [whole(0), builder.add(place, whole(row * MOST_FUNCTIONS))])


@_intrinsic
def ran(typingctx: Any, place: Any) -> Any:
    """Compiled marker: record that a function ran which returns no number."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(ir.DoubleType()(1.0), _pointer(builder, 1, arguments[0]))
        return context.get_dummy_value()

    return types.void(types.int64), generate


@_intrinsic
def factor(typingctx: Any, place: Any) -> Any:
    """Compiled marker: record that a function ran and gave a number. Returns the factor of its planted fault, 1 without
    a fault."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        double = ir.DoubleType()
        for row in (1, 2):
            builder.store(double(1.0), _pointer(builder, row, arguments[0]))
        fault = builder.load(_pointer(builder, 0, arguments[0]))
        fault.set_metadata("invariant.load", builder.module.add_metadata([]))
        return builder.fadd(double(1.0), fault)

    return types.float64(types.int64), generate


def _same(value, place):
    ran(place)
    return value


def _product(value, place):
    return value * factor(place)


def _product_if_off(value, place):
    """The value times the fault's factor. Without a fault it is the same array, because the caller may write into
    it."""
    by = factor(place)
    return value if by == 1.0 else value * by


def _is_number(kind: Any) -> bool:
    return kind == types.float64 or isinstance(kind, types.Complex)


@overload(spoiled)
def _spoiled(value, place):
    """Choose the compiled function that plants the fault in a value of this type. An array stays unchanged where the
    compiled function may not allocate another one (``lean``)."""
    if _is_number(value):
        return _product
    if isinstance(value, types.BaseTuple) and any(_is_number(part) or _makes_arrays(part) for part in _parts(value)):
        return _tuple(value)
    return _product_if_off if _makes_arrays(value) else _same


def _parts(kind: Any) -> list[Any]:
    """Types of all elements of a tuple type, those of nested tuples included."""
    return [inner for part in kind for inner in (_parts(part) if isinstance(part, types.BaseTuple) else [part])]


def _makes_arrays(kind: Any) -> bool:
    """Whether the type is an array of numbers, and the function being compiled may allocate arrays."""
    flags = ConfigStack.top_or_none()
    is_array = isinstance(kind, types.Array) and _is_number(kind.dtype)
    return is_array and flags is not None and bool(flags.nrt)


def _tuple(kind: Any) -> Any:
    """A compiled function that plants the fault in each element of a tuple of this type."""
    parts = ", ".join(f"spoiled(value[{i}], place)" for i in range(len(kind)))
    made = f"cls({parts})" if isinstance(kind, types.BaseNamedTuple) else f"({parts},)"
    names = {"spoiled": spoiled, "cls": getattr(kind, "instance_class", tuple)}
    exec(f"def whole(value, place):\n    return {made}\n", names)
    return names["whole"]


@overload(scaled)
def _scaled(values, place):
    if not isinstance(values, types.Array) or not values.mutable:
        return lambda values, place: ran(place)
    if isinstance(values.dtype, types.Record):
        return _records(values.dtype)
    if not _is_number(values.dtype):
        return lambda values, place: ran(place)

    def whole(values, place):
        by = factor(place)
        if by != 1.0:
            for each in np.ndindex(values.shape):
                values[each] *= by

    return whole


def _records(kind: types.Record) -> Any:
    """A compiled function that multiplies all fields of an array of such records by the fault's factor."""
    lines = "".join(f"            record.{name} = by * record.{name}\n" for name in kind.fields)
    names = {"np": np, "factor": factor}
    loop = "        for each in np.ndindex(values.shape):\n            record = values[each]\n"
    exec(f"def whole(values, place):\n    by = factor(place)\n    if by != 1.0:\n{loop}{lines}", names)
    return names["whole"]


@overload(put)
def _put(value, into, place):
    if isinstance(into, types.Array) or not isinstance(value, types.Float | types.BaseTuple):
        return lambda value, into, place: value
    return lambda value, into, place: spoiled(value, place)
