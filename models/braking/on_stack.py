"""Room on the stack of a compiled function, for ``carray``: arrays of a loop that must make none."""

from typing import Any

import llvmlite.ir as ir
from numba import types
from numba.extending import intrinsic

_intrinsic: Any = intrinsic


@_intrinsic
def doubles(typing_context, count):
    """Pointer to so many doubles; they last until the function returns, and hold anything at first.

    Ask outside of loops: every asking takes more of the stack. (``contact.stack`` has room of a size written out.)
    """

    def generate(context, builder, signature, arguments):
        return builder.alloca(ir.DoubleType(), size=arguments[0])

    return types.CPointer(types.float64)(types.intp), generate
