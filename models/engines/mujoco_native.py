"""MuJoCo's own functions called by compiled code: a model's accelerations and steps without Python.

Whoever reads the list of a kernel's signatures imports the classes in them, those of other engines' runs included. So
this file imports MuJoCo only where a model is at hand.
"""

import ctypes
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import llvmlite.ir as ir
import numpy as np
from numba import types
from numba.extending import intrinsic

from models.machine.compiled import lean

if TYPE_CHECKING:
    import mujoco

_intrinsic: Any = intrinsic


class NativeMujoco(NamedTuple):
    """A MuJoCo model for compiled functions: views of MuJoCo's own arrays, and addresses as integers.

    place, rate, acceleration (n,) : of the coordinates; time (1,) : s; forward, step, model, data : addresses.
    """

    place: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    time: np.ndarray
    forward: int
    step: int
    model: int
    data: int


@_intrinsic
def _call(typing_context, function, model, data):
    """Call the C function void(mjModel*, mjData*) at an address."""

    def generate(context, builder, signature, arguments):
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer, pointer]).as_pointer()
        pointers = [builder.inttoptr(argument, pointer) for argument in arguments[1:]]
        builder.call(builder.inttoptr(arguments[0], kind), pointers)
        return context.get_dummy_value()

    return types.void(types.intp, types.intp, types.intp), generate


@cache
def _library() -> ctypes.CDLL:
    """The MuJoCo library that this process has loaded."""
    import mujoco

    return ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco*"))))


def native_mujoco(mujoco_model: "mujoco.MjModel", mujoco_data: "mujoco.MjData") -> NativeMujoco:
    """``NativeMujoco`` of a MuJoCo model and its data, for compiled functions; both must outlive the result."""
    from models.engines.mujoco_layout import offset

    time = ctypes.c_double.from_address(mujoco_data._address + offset("mjData", "time"))
    forward, step = (
        ctypes.cast(getattr(_library(), name), ctypes.c_void_p).value or 0 for name in ("mj_forward", "mj_step")
    )
    return NativeMujoco(
        mujoco_data.qpos,
        mujoco_data.qvel,
        mujoco_data.qacc,
        np.ctypeslib.as_array(ctypes.pointer(time), (1,)),
        forward,
        step,
        mujoco_model._address,
        mujoco_data._address,
    )


@lean
def accelerate(native_model, q, v, accelerations):
    """Fill ``accelerations`` (n,) with the accelerations at positions q and rates v (n,)."""
    for i in range(q.size):
        native_model.place[i], native_model.rate[i] = q[i], v[i]
    _call(native_model.forward, native_model.model, native_model.data)
    for i in range(q.size):
        accelerations[i] = native_model.acceleration[i]


@lean
def march(native_model, q, v):
    """Advance positions q and rates v (n,), in place, by one step of the MuJoCo model; returns False where MuJoCo
    resets itself to time zero."""
    for i in range(q.size):
        native_model.place[i], native_model.rate[i] = q[i], v[i]
    native_model.time[0] = 1.0
    _call(native_model.step, native_model.model, native_model.data)
    for i in range(q.size):
        q[i], v[i] = native_model.place[i], native_model.rate[i]
    return native_model.time[0] > 1.0
