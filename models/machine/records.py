"""Records of doubles for compiled functions: numbers by name, in an array, at a pointer or on the stack.

A record lies in memory as its doubles follow, so that a table of doubles is read by name at no cost. Arrays of records
go to compiled functions as one argument, however many fields they have.
"""

from typing import Any

import llvmlite.ir as ir
import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from models.machine.stack import DOUBLES, REGISTER

_intrinsic: Any = intrinsic


def record(*field_names: str) -> np.dtype:
    """Type of a record with one double per name; in Python the doubles are attributes, too."""
    return np.dtype((np.record, np.dtype([(name, np.float64) for name in field_names], align=True)))


def size_of(record_type: np.dtype) -> int:
    """Number of doubles in a record of this type."""
    return record_type.itemsize // 8


@_intrinsic
def records_at_pointer(typing_context, pointer, count, kind):
    """Array (count,) of records of a type that begins at a pointer to doubles, whose memory must outlive the array."""
    made: Any = types.Array(kind.dtype, 1, "C")

    def generate(context, builder, signature, arguments):
        return _array(context, builder, made, arguments[0], arguments[1])

    return made(DOUBLES, types.intp, kind), generate


@_intrinsic(prefer_literal=True)
def stack_records(typing_context, count, kind):
    """Array (count,) of records on the stack, valid until the calling function returns; its initial contents are
    arbitrary.

    As ``stack.doubles``: ask for a number that is not written out outside of loops.
    """
    made: Any = types.Array(kind.dtype, 1, "C")

    def generate(context, builder, signature, arguments):
        doubles, double = made.dtype.size // 8, ir.DoubleType()
        if isinstance(count, types.IntegerLiteral):
            length = context.get_constant(types.intp, count.literal_value)
            room = cgutils.alloca_once(builder, double, size=doubles * count.literal_value)
        else:
            length = arguments[0]
            room = builder.alloca(double, size=builder.mul(length, context.get_constant(types.intp, doubles)))
        room.align = REGISTER
        return _array(context, builder, made, room, length)

    return made(count if isinstance(count, types.IntegerLiteral) else types.intp, kind), generate


def _array(context: Any, builder: Any, array_type: Any, pointer: Any, count: Any) -> Any:
    """Array of ``count`` records that starts at a pointer."""
    array, size = make_array(array_type)(context, builder), context.get_constant(types.intp, array_type.dtype.size)
    place = builder.bitcast(pointer, array.data.type)
    populate_array(array, place, [count], [size], size, None, None)
    return array._getvalue()
