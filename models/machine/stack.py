"""Pointers to doubles for compiled functions: on the stack or into arrays, for callers that must not allocate
memory."""

from typing import Any

import llvmlite.ir as ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import get_cfarray_intrinsic, make_array, populate_array

DOUBLES = types.CPointer(types.float64)
REGISTER = 64
"""Size (bytes) of the longest vector register."""
_intrinsic: Any = intrinsic
array = get_cfarray_intrinsic("C", None)
"""The array of a given shape at a pointer: numba's ``carray``, also for functions that are ``lean``."""


@_intrinsic(prefer_literal=True)
def doubles(typing_context, count):
    """Pointer to ``count`` doubles on the stack, aligned for vector registers; they are valid until the function
    returns, and their initial contents are arbitrary.

    A literal ``count`` reserves its room once per call. Request any other count outside of loops, because every request
    takes more of the stack.
    """

    def generate(context, builder, signature, arguments):
        if isinstance(count, types.IntegerLiteral):
            room = cgutils.alloca_once(builder, ir.DoubleType(), size=count.literal_value)
        else:
            room = builder.alloca(ir.DoubleType(), size=arguments[0])
        room.align = REGISTER
        return room

    return DOUBLES(count), generate


@_intrinsic
def beyond(typing_context, pointer, count):
    """Pointer to the double that lies ``count`` doubles after ``pointer``."""

    def generate(context, builder, signature, arguments):
        return builder.gep(arguments[0], [arguments[1]])

    return DOUBLES(DOUBLES, types.intp), generate


@_intrinsic
def row(typing_context, pointer, size, i):
    """Row number i, as an array (size,), of a table with rows of ``size`` doubles that starts at a pointer."""
    kind = types.Array(types.float64, 1, "C")

    def generate(context, builder, signature, arguments):
        first, size, i = arguments
        array = make_array(kind)(context, builder)
        populate_array(
            array,
            builder.gep(first, [builder.mul(size, i)]),
            [size],
            [ir.Constant(size.type, 8)],
            ir.Constant(size.type, 8),
            None,
            None,
        )
        return array._getvalue()

    return kind(DOUBLES, types.intp, types.intp), generate


@_intrinsic
def start(typing_context, array):
    """Pointer to the first double of a contiguous array of doubles; the array must outlive the pointer."""

    if array.dtype != types.float64 or array.layout != "C":
        return None

    def generate(context, builder, signature, arguments):
        return cgutils.create_struct_proxy(signature.args[0])(context, builder, value=arguments[0]).data

    return DOUBLES(array), generate


@_intrinsic
def at(typing_context, address):
    """Pointer to doubles at an address that is given as a whole number."""

    def generate(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(DOUBLES))

    return DOUBLES(types.intp), generate


@_intrinsic
def call_at_address(typing_context, address, inputs, table, outputs):
    """Result of calling the compiled function int32(DOUBLES, DOUBLES, DOUBLES) at an address that is given as a whole
    number."""

    def generate(context, builder, signature, arguments):
        pointer = context.get_value_type(DOUBLES)
        kind = ir.FunctionType(ir.IntType(32), [pointer] * 3)
        return builder.call(builder.inttoptr(arguments[0], kind.as_pointer()), arguments[1:])

    return types.int32(types.intp, DOUBLES, DOUBLES, DOUBLES), generate


@_intrinsic
def double_at(typing_context, base, shift):
    """Pointer to the double that lies ``shift`` bytes after ``base``, a bare pointer as C callbacks receive."""

    def generate(context, builder, signature, arguments):
        place = builder.add(builder.ptrtoint(arguments[0], ir.IntType(64)), arguments[1])
        return builder.inttoptr(place, context.get_value_type(DOUBLES))

    return DOUBLES(types.voidptr, types.intp), generate


@_intrinsic
def array_at(typing_context, base, shift):
    """The pointer to doubles that is stored ``shift`` bytes after ``base``, a bare pointer as C callbacks receive."""

    def generate(context, builder, signature, arguments):
        place = builder.add(builder.ptrtoint(arguments[0], ir.IntType(64)), arguments[1])
        return builder.load(builder.inttoptr(place, context.get_value_type(DOUBLES).as_pointer()))

    return DOUBLES(types.voidptr, types.intp), generate
