"""Planted faults in compiled functions: factors are read from memory at run time, so that a new fault needs no
compilation."""

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


def _pointer(llvm_builder: Any, memory_row: int, function_number: Any) -> Any:
    """Address of a function's entry in a row of the shared memory (0: faults, 1: functions that ran, 2: functions that
    gave numbers)."""
    double = ir.DoubleType()
    rows = llvm_builder.module.globals.get(ADDRESS_SYMBOL)
    rows = rows or ir.GlobalVariable(llvm_builder.module, ir.ArrayType(double, 3 * MOST_FUNCTIONS), ADDRESS_SYMBOL)
    whole = ir.IntType(64)
    return llvm_builder.gep(rows, [whole(0), llvm_builder.add(function_number, whole(memory_row * MOST_FUNCTIONS))])


@_intrinsic
def mark_as_run(typingctx: Any, function_number: Any) -> Any:
    """In compiled code, record that a function without numeric result ran."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(ir.DoubleType()(1.0), _pointer(builder, 1, arguments[0]))
        return context.get_dummy_value()

    return types.void(types.int64), generate


@_intrinsic
def fault_factor(typingctx: Any, function_number: Any) -> Any:
    """In compiled code, record that a function ran and gave a number. Returns the factor of its planted fault, 1
    without a fault."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        double = ir.DoubleType()
        for row in (1, 2):
            builder.store(double(1.0), _pointer(builder, row, arguments[0]))
        fault = builder.load(_pointer(builder, 0, arguments[0]))
        fault.set_metadata("invariant.load", builder.module.add_metadata([]))
        return builder.fadd(double(1.0), fault)

    return types.float64(types.int64), generate


def _unchanged(value, function_number):
    mark_as_run(function_number)
    return value


def _faulty_number(value, function_number):
    return value * fault_factor(function_number)


def _faulty_array(value, function_number):
    """The array times the fault's factor. Without a fault the same array is returned, as the caller may write into
    it."""
    by = fault_factor(function_number)
    return value if by == 1.0 else value * by


def _is_number(numba_type: Any) -> bool:
    return numba_type == types.float64 or isinstance(numba_type, types.Complex)


@overload(spoiled)
def _compiled_spoiled(value, function_number):
    """Returns the compiled function that plants the fault in a value of this type. An array stays unchanged where the
    function being compiled may not allocate memory (``lean``)."""
    if _is_number(value):
        return _faulty_number
    if isinstance(value, types.BaseTuple) and any(
        _is_number(part) or _is_copyable_array(part) for part in _element_types(value)
    ):
        return _faulty_tuple_function(value)
    return _faulty_array if _is_copyable_array(value) else _unchanged


def _element_types(numba_type: Any) -> list[Any]:
    """Types of all elements of a tuple type, including the elements of nested tuples."""
    return [
        inner
        for part in numba_type
        for inner in (_element_types(part) if isinstance(part, types.BaseTuple) else [part])
    ]


def _is_copyable_array(numba_type: Any) -> bool:
    """Whether a type is an array of numbers and the function being compiled may allocate a copy."""
    flags = ConfigStack.top_or_none()
    is_array = isinstance(numba_type, types.Array) and _is_number(numba_type.dtype)
    return is_array and flags is not None and bool(flags.nrt)


def _faulty_tuple_function(numba_type: Any) -> Any:
    """Returns a compiled function that plants the fault in each element of a tuple of this type."""
    parts = ", ".join(f"spoiled(value[{i}], function_number)" for i in range(len(numba_type)))
    made = f"cls({parts})" if isinstance(numba_type, types.BaseNamedTuple) else f"({parts},)"
    names = {"spoiled": spoiled, "cls": getattr(numba_type, "instance_class", tuple)}
    exec(f"def with_fault(value, function_number):\n    return {made}\n", names)
    return names["with_fault"]


@overload(scaled)
def _compiled_scaled(values, function_number):
    if not isinstance(values, types.Array) or not values.mutable:
        return lambda values, function_number: mark_as_run(function_number)
    if isinstance(values.dtype, types.Record):
        return _record_scaler(values.dtype)
    if not _is_number(values.dtype):
        return lambda values, function_number: mark_as_run(function_number)

    def with_fault(values, function_number):
        by = fault_factor(function_number)
        if by != 1.0:
            for each in np.ndindex(values.shape):
                values[each] *= by

    return with_fault


def _record_scaler(numba_type: types.Record) -> Any:
    """Returns a compiled function that multiplies all fields of an array of records by the fault's factor."""
    lines = "".join(f"            record.{name} = by * record.{name}\n" for name in numba_type.fields)
    names = {"np": np, "fault_factor": fault_factor}
    loop = "        for each in np.ndindex(values.shape):\n            record = values[each]\n"
    factor = "    by = fault_factor(function_number)\n    if by != 1.0:\n"
    exec(f"def with_fault(values, function_number):\n{factor}{loop}{lines}", names)
    return names["with_fault"]


@overload(put)
def _compiled_put(value, target_argument, function_number):
    if isinstance(target_argument, types.Array) or not isinstance(value, types.Float | types.BaseTuple):
        return lambda value, target_argument, function_number: value
    return lambda value, target_argument, function_number: spoiled(value, function_number)
