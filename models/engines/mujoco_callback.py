"""Compiled MuJoCo callbacks, which add to the passive forces at every stage of a step.

``kernel_law`` is that of every system whose forces are one compiled kernel. The others are those of the pitch plane,
where the engine has all but an input table and what goes slack. The table lives in the model's own numeric data, behind
a header: rows per second, columns, rows, place of the wheels' motors among the controls (-1: no held forces), the two
wheels' arms, and how many numbers of pitch springs with a dead band follow (stiffness, damping and band of each); of
tyres that only push stiffness and damping come behind those, and the table is their road. So one compiled function
serves every model in the process, adds nothing to a model without a table, survives copies of the model, and holds no
address that could go stale in numba's cache.
"""

from functools import cache
from types import FunctionType
from typing import Any

import numpy as np
from numba import cfunc, types
from numba.extending import register_jitable

from models.engines.mujoco_layout import offsets
from models.machine.compiled import callback, closure_with_unique_name
from models.machine.stack import array_at, double_at

HEADER, PER_ROAD = 7, 4
"""Numbers of the table's header before those of the pitch springs; numbers per row of the road: two heights, two rates
(and of two tyres: stiffness and damping each)."""
CALLBACK = types.void(types.voidptr, types.voidptr)
"""Signature of MuJoCo's callbacks: bare pointers to model and data."""
FIELDS = ("numeric_data", "qfrc_passive", "time", "qpos", "qvel")
"""Fields of MuJoCo's model and data that the callbacks read or write."""


forces: Any = None
"""Stands here for the kernel that ``kernel_law`` puts in its place: were it a cell of the closure, no other process
would know the machine code again."""


@cache
def kernel_law(force_kernel: Any) -> Any:
    """MuJoCo callback that passes MuJoCo's data to a compiled kernel of (numbers, time, positions, rates, forces).

    All but the time (s) are pointers to doubles, the numbers those of the model. It is kept on disk if the kernel is.
    """
    numbers, passive, time, position, rate = offsets(*FIELDS)

    def law(model, data):
        forces(
            array_at(model, numbers),
            double_at(data, time)[0],
            array_at(data, position),
            array_at(data, rate),
            array_at(data, passive),
        )

    of_kernel = FunctionType(law.__code__, globals() | {"forces": force_kernel}, "law", None, law.__closure__)
    if force_kernel.stats.cache_path is None:
        return cfunc(CALLBACK)(of_kernel)
    return callback(
        closure_with_unique_name(of_kernel, force_kernel.__module__.replace(".", "_"), force_kernel.__name__), CALLBACK
    )


@register_jitable
def _springs(table_header, pitch_forces, pitch, pitch_rate):
    """Add the moments (N m) of the pitch springs whose dead band the pitch exceeds."""
    for i in range(HEADER, HEADER + int(table_header[6]), 3):
        beyond = abs(pitch[3]) - table_header[i + 2]
        if beyond >= 0.0:
            pitch_forces[3] -= table_header[i] * np.copysign(beyond, pitch[3]) + table_header[i + 1] * pitch_rate[3]


@cache
def table_law() -> Any:
    """MuJoCo callback that adds the table's row at the stage's time to the first passive forces, and the moments of
    pitch springs with a dead band."""
    numeric, passive, time, position, velocity = offsets(*FIELDS)

    @cfunc(CALLBACK, cache=True)
    def law(model, data):
        numbers, force = array_at(model, numeric), array_at(data, passive)
        columns, rows, first = int(numbers[1]), int(numbers[2]), HEADER + int(numbers[6])
        row = int(np.rint(double_at(data, time)[0] * numbers[0]))
        if 0 <= row < rows:
            for i in range(columns):
                force[i] += numbers[first + row * columns + i]
        _springs(numbers, force, array_at(data, position), array_at(data, velocity))

    return law


@cache
def pushing_law() -> Any:
    """MuJoCo callback for tyres that only push, and for pitch springs with a dead band.

    The road under the tyres is the table's or, where that has one row, of this height for ever.
    """
    numeric, passive, time, position, velocity = offsets(*FIELDS)

    @cfunc(CALLBACK, cache=True)
    def law(model, data):
        numbers, force = array_at(model, numeric), array_at(data, passive)
        place, speed = array_at(data, position), array_at(data, velocity)
        rows, first = int(numbers[2]), HEADER + int(numbers[6])
        row = int(np.rint(double_at(data, time)[0] * numbers[0]))
        road = first + PER_ROAD * (1 + min(max(row, 0), rows - 1))
        for i in range(2):
            pressed = numbers[first + 2 * i] * (place[i] - numbers[road + i])
            whole = pressed + numbers[first + 2 * i + 1] * (speed[i] - numbers[road + 2 + i])
            force[i] -= max(min(whole, 2.0 * pressed), 0.0)
        _springs(numbers, force, place, speed)

    return law


@cache
def body_fixed_law() -> Any:
    """MuJoCo callback for wheel forces along the chassis' vertical axis, read from the table or, if held over a step,
    from the controls.

    A column of the table beyond those of the forces is a moment on the chassis.
    """
    numeric, passive, time, position, velocity, control = offsets(*FIELDS, "ctrl")

    @cfunc(CALLBACK, cache=True)
    def law(model, data):
        numbers, controls, pitch = array_at(model, numeric), array_at(data, control), array_at(data, position)
        columns, rows, motors, springs = int(numbers[1]), int(numbers[2]), int(numbers[3]), int(numbers[6])
        row = int(np.rint(double_at(data, time)[0] * numbers[0]))
        if columns > 0 and not 0 <= row < rows:
            return
        force = array_at(data, passive)
        sine, cosine = np.sin(pitch[3]), np.cos(pitch[3])
        first, forces = HEADER + springs + columns * row, 2 if motors < 0 else 0
        for i in range(2):
            f = controls[motors + i] if motors >= 0 else numbers[first + i]
            force[i] -= f * cosine
            force[3] += numbers[4 + i] * f * sine * sine
        if columns > forces:
            force[3] += numbers[first + forces]
        _springs(numbers, force, pitch, array_at(data, velocity))

    return law
