"""The compiled MuJoCo callback of a vehicle in space: forces between points of bodies that may all turn.

MuJoCo's own site actuators are wrong between two turning bodies, so every force is summed here. A point of a body that
never turns is moved by its joints' constant shares. Every other body that counts has a twist, its turning and the
velocity that it gives the origin of space, and gathers a wrench, force and moment about that origin, so that its joints
are gone through twice in a call, however many points it has. All numbers lie in the model's numeric data, as
``spatial_mujoco`` packs them: the header; the bodies, parents first; the elements; the road. So one compiled function
serves every model in the process, and holds no address that could go stale in numba's cache.
"""

import numpy as np
from numba import cfunc, types
from numba.extending import register_jitable

from models.engines.mujoco_callback import _array_at, _double_at
from models.engines.mujoco_layout import offset
from models.machine.stack import beyond, doubles

PER_TIME, ROWS, TYRES, BODIES, ELEMENTS, POINTS, ROAD, HEADER = range(8)
"""Header: road rows per second; counts of rows, tyres, bodies that may turn or carry such, elements and points; where
the road begins."""
PARENT, NUMBER, FIRST, TURNING, LAST, POINT, BEYOND, PER_BODY = range(8)
"""Numbers of a body: its parent in this list (-1: none), MuJoCo's number, the first joint, the first one that turns,
the one after its last, its first point and the one after its last."""
ELEMENT, PLACE, AXIS, PER_POINT = 0, 1, 4, 7
"""Numbers of a point: the element whose travel it moves, where it is on the body, the axis of its motion."""
LENGTH, STIFFNESS, DAMPING, HELD, TYRE, REST, ONE_SIDED, MORE, SHARES = range(9)
"""Numbers of an element: how many there are, its law, the tyre whose road it sees, its points' travel at rest, whether
it only pushes, where it has more of a law than a line, 0 if nowhere, and its shares up to there or to its end."""
JOINT, SHARE, PER_SHARE = range(3)
"""Numbers of a share: a joint, and what its coordinate adds to the travel."""
FRICTION, FRICTION_RATE, ONE, ONE_GAIN, TWO, TWO_GAIN, ON_TRAVEL, ON_RATE, CURVES = range(9)
"""More of a law: dry friction, two coordinates (-1: none) that add to the force, points of the curves, these."""
TURNS, SHIFTS, MOMENTS, FORCES, OF_BODY = 0, 3, 6, 9, 12
"""Of a body while the callback runs: turning, velocity at the origin of space, moment about it, force."""
TRAVEL, RATE, OF_ELEMENT = range(3)
"""Of an element: what its points move it by, and how fast; then its force in their place."""
OF_POINT = 3
"""Of a point: the moment of a force of 1 along its axis about the origin of space."""


@register_jitable
def _three(p, i):
    return p[i], p[i + 1], p[i + 2]


@register_jitable
def _put(p, i, a):
    p[i], p[i + 1], p[i + 2] = a


@register_jitable
def _plus(a, factor, b):
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@register_jitable
def _across(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@register_jitable
def _along(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@register_jitable
def _move(bodies, count, points, v, centres, turned, anchors, axes, room, moved, levers):
    """Twists of the bodies, with no wrench on any, and what their points move the elements by."""
    for b in range(count):
        body, own, parent = beyond(bodies, PER_BODY * b), beyond(room, OF_BODY * b), int(bodies[PER_BODY * b + PARENT])
        turn, shift = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if parent >= 0:
            turn, shift = _three(room, OF_BODY * parent + TURNS), _three(room, OF_BODY * parent + SHIFTS)
        turning = int(body[TURNING])
        for j in range(int(body[FIRST]), turning):
            shift = _plus(shift, v[j], _three(axes, 3 * j))
        for j in range(turning, int(body[LAST])):
            axis = _three(axes, 3 * j)
            turn, shift = _plus(turn, v[j], axis), _plus(shift, v[j], _across(_three(anchors, 3 * j), axis))
        _put(own, TURNS, turn)
        _put(own, SHIFTS, shift)
        _put(own, MOMENTS, (0.0, 0.0, 0.0))
        _put(own, FORCES, (0.0, 0.0, 0.0))
        centre, rows = _three(centres, 3 * int(body[NUMBER])), beyond(turned, 9 * int(body[NUMBER]))
        x, y, z = _three(rows, 0), _three(rows, 3), _three(rows, 6)
        for i in range(int(body[POINT]), int(body[BEYOND])):
            point = beyond(points, PER_POINT * i)
            element, axis = beyond(moved, OF_ELEMENT * int(point[ELEMENT])), _three(point, AXIS)
            at = _three(point, PLACE)
            place = centre[0] + _along(x, at), centre[1] + _along(y, at), centre[2] + _along(z, at)
            lever = _across(place, axis)
            element[TRAVEL] += _along(axis, place)
            element[RATE] += _along(axis, shift) + _along(turn, lever)
            _put(levers, OF_POINT * i, lever)


@register_jitable
def _press(bodies, count, points, moved, levers, anchors, axes, room, forces):
    """Bring the elements' forces onto the bodies' joints, riders first."""
    for b in range(count - 1, -1, -1):
        body, own, parent = beyond(bodies, PER_BODY * b), beyond(room, OF_BODY * b), int(bodies[PER_BODY * b + PARENT])
        moment, force = _three(own, MOMENTS), _three(own, FORCES)
        for i in range(int(body[POINT]), int(body[BEYOND])):
            point = beyond(points, PER_POINT * i)
            pressed = -moved[OF_ELEMENT * int(point[ELEMENT])]
            moment = _plus(moment, pressed, _three(levers, OF_POINT * i))
            force = _plus(force, pressed, _three(point, AXIS))
        turning = int(body[TURNING])
        for j in range(int(body[FIRST]), turning):
            forces[j] += _along(_three(axes, 3 * j), force)
        for j in range(turning, int(body[LAST])):
            about = _plus(moment, -1.0, _across(_three(anchors, 3 * j), force))
            forces[j] += _along(_three(axes, 3 * j), about)
        if parent >= 0:
            below = beyond(room, OF_BODY * parent)
            _put(below, MOMENTS, _plus(moment, 1.0, _three(below, MOMENTS)))
            _put(below, FORCES, _plus(force, 1.0, _three(below, FORCES)))


@register_jitable
def _on_curve(pairs, size, argument):
    """Force on a curve given as (argument, force, ...); the outer pieces go on."""
    i = 0
    while i < size - 4 and argument >= pairs[i + 2]:
        i += 2
    return pairs[i + 1] + (pairs[i + 3] - pairs[i + 1]) / (pairs[i + 2] - pairs[i]) * (argument - pairs[i])


@register_jitable
def _more(law, travel, rate, q):
    """What of a force is no line."""
    force = 0.0
    if law[FRICTION] != 0.0:
        force += law[FRICTION] * np.tanh(rate / law[FRICTION_RATE])
    if law[ONE] >= 0.0:
        force += law[ONE_GAIN] * q[int(law[ONE])]
    if law[TWO] >= 0.0:
        force += law[TWO_GAIN] * q[int(law[TWO])]
    over_travel, over_rate = 2 * int(law[ON_TRAVEL]), 2 * int(law[ON_RATE])
    if over_travel > 0:
        force += _on_curve(beyond(law, CURVES), over_travel, travel)
    if over_rate > 0:
        force += _on_curve(beyond(law, CURVES + over_travel), over_rate, rate)
    return force


@register_jitable
def _act(e, count, road, tyres, q, v, moved, forces):
    """Forces of the elements, in place of their travels, and on the joints that move their steady points."""
    for i in range(count):
        travel, rate = moved[OF_ELEMENT * i] - e[REST], moved[OF_ELEMENT * i + RATE]
        length, more = int(e[LENGTH]), int(e[MORE])
        shares = more if more > 0 else length
        for k in range(SHARES, shares, PER_SHARE):
            travel += e[k + SHARE] * q[int(e[k])]
            rate += e[k + SHARE] * v[int(e[k])]
        if e[TYRE] >= 0.0:
            travel -= road[int(e[TYRE])]
            rate -= road[tyres + int(e[TYRE])]
        elastic = e[HELD] + e[STIFFNESS] * travel
        force = elastic + e[DAMPING] * rate
        if e[ONE_SIDED] != 0.0:
            force = min(max(force, 2.0 * elastic), 0.0)
        if more > 0:
            force += _more(beyond(e, more), travel, rate, q)
        for k in range(SHARES, shares, PER_SHARE):
            forces[int(e[k])] -= force * e[k + SHARE]
        moved[OF_ELEMENT * i] = force
        e = beyond(e, length)


def _compile(numeric, passive, time, position, velocity, xpos, xmat, xanchor, xaxis):
    @cfunc(types.void(types.voidptr, types.voidptr), cache=True, error_model="numpy")
    def law(model, data):
        numbers = _array_at(model, numeric)
        count, elements, tyres = int(numbers[BODIES]), int(numbers[ELEMENTS]), int(numbers[TYRES])
        row = int(np.rint(_double_at(data, time)[0] * numbers[PER_TIME]))
        road = beyond(numbers, int(numbers[ROAD]) + 2 * tyres * min(max(row, 0), int(numbers[ROWS]) - 1))
        v, forces = _array_at(data, velocity), _array_at(data, passive)
        anchors, axes = _array_at(data, xanchor), _array_at(data, xaxis)
        bodies = beyond(numbers, HEADER)
        points = beyond(bodies, PER_BODY * count)
        laws = beyond(points, PER_POINT * int(numbers[POINTS]))
        room, moved = doubles(OF_BODY * count), doubles(OF_ELEMENT * elements)
        levers = doubles(OF_POINT * int(numbers[POINTS]))
        for i in range(OF_ELEMENT * elements):
            moved[i] = 0.0
        centres, turned = _array_at(data, xpos), _array_at(data, xmat)
        _move(bodies, count, points, v, centres, turned, anchors, axes, room, moved, levers)
        _act(laws, elements, road, tyres, _array_at(data, position), v, moved, forces)
        _press(bodies, count, points, moved, levers, anchors, axes, room, forces)

    return law


_COMPILED: dict[str, object] = {}


def spatial_law():
    """The callback, compiled when first asked for."""
    if "law" not in _COMPILED:
        fields = ("qfrc_passive", "time", "qpos", "qvel", "xpos", "xmat", "xanchor", "xaxis")
        places = [offset("mjModel", "numeric_data"), *(offset("mjData", field) for field in fields)]
        _COMPILED["law"] = _compile(*places)
    return _COMPILED["law"]
