"""Compiled MuJoCo callbacks: input tables added to the passive forces at every stage of a step.

The table lives in the model's own numeric data, behind a header: rows per second, columns, rows, place of
the wheels' motors among the controls (-1: no held forces), the two wheels' arms, and how many numbers of
pitch springs with a dead band follow (stiffness, damping and band of each); of tyres that only push stiffness and
damping come behind those, and the table is their road. So one compiled function serves
every model in the process, adds nothing to a model without a table, survives copies of the model, and holds
no address that could go stale in numba's cache.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.ir as ir
import mujoco
import numpy as np
from numba import carray, cfunc, types
from numba.extending import intrinsic, register_jitable

from models.engines.mujoco_layout import offset
from models.engines.mujoco_quiet import quiet

HEADER, PER_ROAD = 7, 4
"""Numbers before those of the springs; of a row of the road (two heights, two rates), and of two tyres."""
DOUBLES = types.CPointer(types.float64)
_intrinsic: Any = intrinsic


@_intrinsic
def _double_at(typing_context, base, shift):
    """Pointer to the double that lies ``shift`` bytes after ``base``."""

    def generate(context, builder, signature, arguments):
        start = builder.ptrtoint(arguments[0], ir.IntType(64))
        return builder.inttoptr(builder.add(start, arguments[1]), context.get_value_type(DOUBLES))

    return DOUBLES(types.voidptr, types.intp), generate


@_intrinsic
def _array_at(typing_context, base, shift):
    """The double pointer that is stored ``shift`` bytes after ``base``."""

    def generate(context, builder, signature, arguments):
        start = builder.ptrtoint(arguments[0], ir.IntType(64))
        kind = ir.PointerType(context.get_value_type(DOUBLES))
        return builder.load(builder.inttoptr(builder.add(start, arguments[1]), kind))

    return DOUBLES(types.voidptr, types.intp), generate


@register_jitable
def _springs(header, force, pitch, rate):
    """Add the moments of the springs whose dead band the pitch has left."""
    for i in range(HEADER, HEADER + int(header[6]), 3):
        beyond = abs(pitch[3]) - header[i + 2]
        if beyond >= 0.0:
            force[3] -= header[i] * np.copysign(beyond, pitch[3]) + header[i + 1] * rate[3]


def _compile_table(numeric, passive, time, position, velocity):
    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, data):
        header = carray(_array_at(model, numeric), (HEADER,))
        columns, rows, springs = int(header[1]), int(header[2]), int(header[6])
        numbers = carray(_array_at(model, numeric), (HEADER + springs + columns * rows,))
        force = carray(_array_at(data, passive), (4,))
        row = int(np.rint(carray(_double_at(data, time), (1,))[0] * header[0]))
        if 0 <= row < rows:
            for i in range(columns):
                force[i] += numbers[HEADER + springs + row * columns + i]
        _springs(numbers, force, carray(_array_at(data, position), (4,)), carray(_array_at(data, velocity), (4,)))

    return law


def _compile_pushing(numeric, passive, time, position, velocity):
    """Tyres that only push, on the road of the table or, where that has one row, on this height for ever."""

    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, data):
        header = carray(_array_at(model, numeric), (HEADER,))
        rows, first = int(header[2]), HEADER + int(header[6])
        numbers = carray(_array_at(model, numeric), (first + PER_ROAD * (1 + rows),))
        force, place = carray(_array_at(data, passive), (4,)), carray(_array_at(data, position), (4,))
        speed = carray(_array_at(data, velocity), (4,))
        row = int(np.rint(carray(_double_at(data, time), (1,))[0] * header[0]))
        road = first + PER_ROAD * (1 + min(max(row, 0), rows - 1))
        for i in range(2):
            pressed = numbers[first + 2 * i] * (place[i] - numbers[road + i])
            whole = pressed + numbers[first + 2 * i + 1] * (speed[i] - numbers[road + 2 + i])
            force[i] -= max(min(whole, 2.0 * pressed), 0.0)
        _springs(numbers, force, place, speed)

    return law


def _compile_body_fixed(numeric, passive, time, position, velocity, control):
    """Forces along the chassis' vertical axis, from the table or, where they are held, from the controls.

    A column of the table beyond those of the forces is a moment on the chassis.
    """

    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, data):
        header = carray(_array_at(model, numeric), (HEADER,))
        columns, rows, motors, springs = int(header[1]), int(header[2]), int(header[3]), int(header[6])
        row = int(np.rint(carray(_double_at(data, time), (1,))[0] * header[0]))
        if columns > 0 and not 0 <= row < rows:
            return
        numbers = carray(_array_at(model, numeric), (HEADER + springs + columns * rows,))
        controls = carray(_array_at(data, control), (max(motors, 0) + 2,))
        pitch = carray(_array_at(data, position), (4,))
        force = carray(_array_at(data, passive), (4,))
        sine, cosine = np.sin(pitch[3]), np.cos(pitch[3])
        first, forces = HEADER + springs + columns * row, 2 if motors < 0 else 0
        for i in range(2):
            f = controls[motors + i] if motors >= 0 else numbers[first + i]
            force[i] -= f * cosine
            force[3] += header[4 + i] * f * sine * sine
        if columns > forces:
            force[3] += numbers[first + forces]
        _springs(numbers, force, pitch, carray(_array_at(data, velocity), (4,)))

    return law


_COMPILED: dict[str, object] = {}


def table_law():
    """Callback that adds the table's row at the stage's time to the first passive forces, and the springs."""
    if "table" not in _COMPILED:
        _COMPILED["table"] = _compile_table(*_offsets("numeric_data", "qfrc_passive", "time", "qpos", "qvel"))
    return _COMPILED["table"]


def pushing_law():
    """Callback for tyres that only push, with the road under them, and the springs."""
    if "pushing" not in _COMPILED:
        _COMPILED["pushing"] = _compile_pushing(*_offsets("numeric_data", "qfrc_passive", "time", "qpos", "qvel"))
    return _COMPILED["pushing"]


def body_fixed_law():
    """Callback for wheel forces that turn with the chassis: from the table or the controls."""
    if "body" not in _COMPILED:
        fields = ("numeric_data", "qfrc_passive", "time", "qpos", "qvel", "ctrl")
        _COMPILED["body"] = _compile_body_fixed(*_offsets(*fields))
    return _COMPILED["body"]


def _offsets(*fields: str) -> list[int]:
    return [offset("mjModel" if field == "numeric_data" else "mjData", field) for field in fields]


@contextmanager
def installed(law) -> Iterator[None]:
    """Install a compiled callback for the block only: MuJoCo's callbacks are global to the process.

    Meanwhile MuJoCo is quiet: what it would warn of is raised by whoever runs it.
    """
    if law is None:
        yield
        return
    if mujoco.get_mjcb_passive() is not None:
        raise RuntimeError("another MuJoCo callback is installed in this process")
    mujoco.set_mjcb_passive(law.ctypes)
    try:
        with quiet():
            yield
    finally:
        mujoco.set_mjcb_passive(None)
