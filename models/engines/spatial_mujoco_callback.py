"""The compiled MuJoCo callback of a vehicle in space: forces between points of bodies that may all turn.

MuJoCo's own site actuators are wrong between two turning bodies, so every force is summed here from the axes and
anchors of the joints that move its points. All numbers lie in the model's numeric data, as ``spatial_mujoco`` packs
them: the header; for every joint whether it turns and the joint below it (-1: none); the elements; the road. So one
compiled function serves every model in the process, and holds no address that could go stale in numba's cache.
"""

import numpy as np
from numba import carray, cfunc, types
from numba.extending import register_jitable

from models.engines.mujoco_callback import _array_at, _double_at
from models.engines.mujoco_layout import offset

PER_TIME, ROWS, TYRES, JOINTS, BODIES, ELEMENTS, ROAD, COUNT, HEADER = range(9)
"""Header: road rows per second, their number, tyres, joints, bodies, elements, where the road begins, count of all."""
(LENGTH, STIFFNESS, DAMPING, HELD, FRICTION, FRICTION_RATE, TYRE, OWN, OWN_GAIN, REST, FIRST, FIRST_GAIN, SECOND,
 SECOND_GAIN, POINTS, ON_TRAVEL, ON_RATE, FIXED) = range(18)  # fmt: skip
"""Numbers of an element: how many there are, its law, the tyre whose road it sees, a coordinate that adds to its
travel, its value at rest, two coordinates that add to its force, and the counts of what follows them."""
BODY, LAST, PLACE, AXIS, PER_POINT = 0, 1, 2, 5, 8
"""Numbers of a point: its body, the last joint that moves it, where it is on the body, the axis of its motion."""


@register_jitable
def _column(joint, turns, axis, place, anchors, axes):
    """How fast ``place`` moves along ``axis`` by one joint's rate."""
    x, y, z = axes[joint, 0], axes[joint, 1], axes[joint, 2]
    if not turns:
        return axis[0] * x + axis[1] * y + axis[2] * z
    a, b, c = place[0] - anchors[joint, 0], place[1] - anchors[joint, 1], place[2] - anchors[joint, 2]
    return axis[0] * (y * c - z * b) + axis[1] * (z * a - x * c) + axis[2] * (x * b - y * a)


@register_jitable
def _locate(point, centres, turned, place):
    """Write down where a point of a body is."""
    body = int(point[BODY])
    for k in range(3):
        place[k] = centres[body, k]
        for i in range(3):
            place[k] += turned[body, 3 * k + i] * point[PLACE + i]


@register_jitable
def _on_curve(pairs, argument):
    """Force on a curve given as (argument, force, ...); the outer pieces go on."""
    i = 0
    while i < len(pairs) - 4 and argument >= pairs[i + 2]:
        i += 2
    return pairs[i + 1] + (pairs[i + 3] - pairs[i + 1]) / (pairs[i + 2] - pairs[i]) * (argument - pairs[i])


@register_jitable
def _force(e, travel, rate, q):
    """Force of an element, against its travel."""
    force = e[HELD] + e[STIFFNESS] * travel + e[DAMPING] * rate
    if e[FRICTION] != 0.0:
        force += e[FRICTION] * np.tanh(rate / e[FRICTION_RATE])
    if e[FIRST] >= 0.0:
        force += e[FIRST_GAIN] * q[int(e[FIRST])]
    if e[SECOND] >= 0.0:
        force += e[SECOND_GAIN] * q[int(e[SECOND])]
    first = FIXED + PER_POINT * int(e[POINTS])
    middle = first + 2 * int(e[ON_TRAVEL])
    if middle > first:
        force += _on_curve(e[first:middle], travel)
    if len(e) > middle:
        force += _on_curve(e[middle:], rate)
    return force


def _compile(numeric, passive, time, position, velocity, xpos, xmat, xanchor, xaxis):
    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, data):
        header = carray(_array_at(model, numeric), (HEADER,))
        numbers = carray(_array_at(model, numeric), (int(header[COUNT]),))
        joints, bodies, tyres = int(header[JOINTS]), int(header[BODIES]), int(header[TYRES])
        row = int(np.rint(carray(_double_at(data, time), (1,))[0] * header[PER_TIME]))
        road = numbers[int(header[ROAD]) + 2 * tyres * min(max(row, 0), int(header[ROWS]) - 1) :]
        q, v = carray(_array_at(data, position), (joints,)), carray(_array_at(data, velocity), (joints,))
        forces, tree = carray(_array_at(data, passive), (joints,)), numbers[HEADER:]
        centres, turned = carray(_array_at(data, xpos), (bodies, 3)), carray(_array_at(data, xmat), (bodies, 9))
        anchors, axes = carray(_array_at(data, xanchor), (joints, 3)), carray(_array_at(data, xaxis), (joints, 3))
        row_of, place = np.empty(joints), np.empty(3)
        at = HEADER + 2 * joints
        for _ in range(int(header[ELEMENTS])):
            e = numbers[at : at + int(numbers[at])]
            at += len(e)
            row_of[:] = 0.0
            travel = -e[REST]
            if e[OWN] >= 0.0:
                row_of[int(e[OWN])] = e[OWN_GAIN]
                travel += e[OWN_GAIN] * q[int(e[OWN])]
            for i in range(int(e[POINTS])):
                point = e[FIXED + PER_POINT * i : FIXED + PER_POINT * (i + 1)]
                _locate(point, centres, turned, place)
                axis, joint = point[AXIS:], int(point[LAST])
                travel += axis[0] * place[0] + axis[1] * place[1] + axis[2] * place[2]
                while joint >= 0:
                    row_of[joint] += _column(joint, tree[2 * joint] > 0.0, axis, place, anchors, axes)
                    joint = int(tree[2 * joint + 1])
            rate = 0.0
            for i in range(joints):
                rate += row_of[i] * v[i]
            if e[TYRE] >= 0.0:
                travel -= road[int(e[TYRE])]
                rate -= road[tyres + int(e[TYRE])]
            force = _force(e, travel, rate, q)
            for i in range(joints):
                forces[i] -= force * row_of[i]

    return law


_COMPILED: dict[str, object] = {}


def spatial_law():
    """The callback, compiled when first asked for."""
    if "law" not in _COMPILED:
        fields = ("qfrc_passive", "time", "qpos", "qvel", "xpos", "xmat", "xanchor", "xaxis")
        places = [offset("mjModel", "numeric_data"), *(offset("mjData", field) for field in fields)]
        _COMPILED["law"] = _compile(*places)
    return _COMPILED["law"]
