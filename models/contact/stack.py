"""Doubles on the stack of a compiled function, for callers that must not allocate: callbacks of engines, and C."""

from typing import Any

import llvmlite.ir as ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

DOUBLES = types.CPointer(types.float64)
_intrinsic: Any = intrinsic


@_intrinsic(prefer_literal=True)
def doubles(typing_context, count):
    """Pointer to ``count`` doubles, a number written out; they last until the function returns, and hold anything."""
    size = count.literal_value

    def generate(context, builder, signature, arguments):
        return cgutils.alloca_once(builder, ir.DoubleType(), size=size)

    return DOUBLES(count), generate


@_intrinsic
def beyond(typing_context, pointer, count):
    """Pointer to the double that lies ``count`` doubles after ``pointer``."""

    def generate(context, builder, signature, arguments):
        return builder.gep(arguments[0], [arguments[1]])

    return DOUBLES(DOUBLES, types.intp), generate
