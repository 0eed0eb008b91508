"""What is felt inside a cut vehicle along a run, compiled: springs, guides of bodies, hubs, points.

A row of answers, in this order: force and travel of every element; position, heading, pitch, roll of the chassis and
its angular velocity in its own axes; the stabiliser's moments; force and moment that each guide exerts on its body;
those at the hubs; accelerations of points. Guides follow from Newton and Euler: what moves the bodies behind them as
they move, less what else acts there.
"""

import numpy as np

from models.machine.compiled import njit
from models.multibody.cut_kernel import (
    ARM,
    AXIS,
    CHASSIS,
    DESIGN,
    GRAVITY,
    LAST,
    ONE,
    PER_TIME,
    TWO,
    WRENCH,
    forces,
    frame,
    into,
    parts,
)
from models.multibody.cut_mechanics import (
    ALONG,
    MASS,
    OMEGA,
    PARENT,
    PER_MOTION,
    PLACE,
    REST,
    TURN_REST,
    TURNS,
    add_cross,
    column,
    inertia,
    locate,
    resting,
    solve,
    turned,
)
from models.vehicles.cut_vehicle import ROLL

ELEMENT, CHASSIS_ROW, MOMENTS, POINT = 2, 9, 2, 3
"""Numbers of an element, the chassis, the stabiliser and a point in a row of answers; a guide and a hub have WRENCH."""
JOINT, POINT_ARM, WEIGHT, PER_POINT = 0, 1, 4, 5
"""Of a point: the joint that carries it, where it is from there (m), how much of gravity is felt."""


@njit(cache=True, error_model="numpy")
def _accelerate(joints, m, last, qdd, place, a, turning):
    """Add to the acceleration of a point at ``place``, carried by joint ``last``, and to the turning what q'' makes."""
    j, by = last, np.empty(3)
    while j >= 0:
        turns = joints[j, TURNS]
        column(turns != 0.0, m[j + 1], place, 0, by, 0)
        for k in range(3):
            a[k] += by[k] * qdd[j]
            turning[k] += turns * m[j + 1, ALONG + k] * qdd[j]
        j = int(joints[j, PARENT])


@njit(cache=True, error_model="numpy")
def _move_bodies(joints, bodies, m, gravity, qdd, acting):
    """Write place, force and moment about it (9 each) that move every body as it does, its weight held."""
    tensor, arm, turning = np.empty(9), np.empty(3), np.empty(3)
    for b in range(len(bodies)):
        body, row = bodies[b], acting[b]
        own = m[int(body[LAST]) + 1]
        resting(own, body, gravity, tensor, arm, row[3:6], row[6:])
        for k in range(3):
            row[k], turning[k] = own[PLACE + k] + arm[k], 0.0
        _accelerate(joints, m, int(body[LAST]), qdd, row, row[3:6], turning)
        for k in range(3):
            row[3 + k] *= body[MASS]
            row[6 + k] += tensor[3 * k] * turning[0] + tensor[3 * k + 1] * turning[1] + tensor[3 * k + 2] * turning[2]


@njit(cache=True, error_model="numpy")
def _load_hubs(head, hubs, m, wrenches, acting):
    """Write place, force and moment of every hub, negative: they act from outside."""
    for i in range(len(hubs)):
        hub, row, own = hubs[i], acting[i], m[frame(head, hubs[i])]
        locate(m[int(hub[LAST]) + 1], hub, ARM, row, 0)
        turned(own, wrenches[i], 0, row, 3)
        turned(own, wrenches[i], 3, row, 6)
        for k in range(6):
            row[3 + k] = -row[3 + k]


@njit(cache=True, error_model="numpy")
def _load_elements(elements, m, chassis, inside, acting, travels):
    """Write places and forces at both ends of every element, negative, and its travel."""
    axis = np.empty(3)
    for i in range(len(elements)):
        e = elements[i]
        turned(m[chassis + 1], e, AXIS, axis, 0)
        travels[i] = -e[DESIGN]
        for side in range(2):
            row, sign, first = acting[2 * i + side], 2.0 * side - 1.0, TWO * side + 1
            locate(m[int(e[ONE + TWO * side]) + 1], e, first, row, 0)
            for k in range(3):
                travels[i] += sign * axis[k] * row[k]
                row[3 + k], row[6 + k] = sign * inside[i] * axis[k], 0.0


@njit(cache=True, error_model="numpy")
def _sum_up(acting, carried, point, wrench):
    """Write force and moment about a point of all that acts on what is carried."""
    arm = np.empty(3)
    wrench[:] = 0.0
    for i in range(len(acting)):
        if carried[i] != 0.0:
            row = acting[i]
            for k in range(3):
                arm[k] = row[k] - point[k]
                wrench[k] += row[3 + k]
                wrench[3 + k] += row[6 + k]
            add_cross(wrench, 3, arm, 0, row, 3, 1.0)


@njit(cache=True, error_model="numpy")
def _feel_point(joints, m, point, gravity, qdd, out):
    """Write the acceleration of a point in the axes of what carries it."""
    last, place, h, a, turning = int(point[JOINT]), np.empty(6), np.zeros(3), np.empty(3), np.zeros(3)
    own = m[last + 1]
    turned(own, point, POINT_ARM, place, 3)
    for k in range(3):
        place[k], a[k] = own[PLACE + k] + place[3 + k], own[REST + k]
    a[2] += gravity * point[WEIGHT]
    add_cross(h, 0, own, OMEGA, place, 3, 1.0)
    add_cross(a, 0, own, OMEGA, h, 0, 1.0)
    add_cross(a, 0, own, TURN_REST, place, 3, 1.0)
    _accelerate(joints, m, last, qdd, place, a, turning)
    into(own, a, 0, out, 0)


@njit(cache=True, error_model="numpy", nogil=True)
def felt(numbers, every, states, guides, carried, points, own_axes, out):
    """Write answers (n, all) of states (n, 2 c), ``every`` half steps apart from time 0 on.

    guides (g,) : last joint of each body; carried (g, b + h + 2 e) : whether what acts on bodies, hubs and ends of
    elements acts behind it; points (p, PER_POINT); own_axes : whether guides and hubs are given in the axes of what
    they carry instead of the chassis'.
    """
    head, joints, bodies, elements, hubs, _ = parts(numbers)
    n, b, e, h, chassis = len(joints), len(bodies), len(elements), len(hubs), int(head[CHASSIS])
    m, mass, sides, inside, travels = (
        np.empty((n + 1, PER_MOTION)),
        np.empty((n, n)),
        np.empty((1, n)),
        np.empty(e),
        np.empty(e),
    )
    wrenches, moments, acting, wrench = np.empty((h, WRENCH)), np.empty(2), np.empty((b + h + 2 * e, 9)), np.empty(6)
    per_time = head[PER_TIME]
    for i in range(len(states)):
        q, v, row = states[i, :n], states[i, n:], out[i]
        sides[:] = 0.0
        forces(numbers, i * every / per_time, q, v, m, sides[0], inside, wrenches, moments)
        inertia(joints, bodies, m, head[GRAVITY], mass, sides[0])
        solve(mass, sides)
        _move_bodies(joints, bodies, m, head[GRAVITY], sides[0], acting[:b])
        _load_hubs(head, hubs, m, wrenches, acting[b : b + h])
        _load_elements(elements, m, chassis, inside, acting[b + h :], travels)
        row[:e], row[e : 2 * e] = inside, travels
        at = 2 * e
        for k in range(6):
            row[at + k] = q[k]
        into(m[ROLL + 1], m[ROLL + 1], OMEGA, row, at + 6)
        row[at + 9 : at + 11] = moments
        at += CHASSIS_ROW + MOMENTS
        for g in range(len(guides)):
            last = int(guides[g])
            _sum_up(acting, carried[g], m[last + 1, PLACE:], wrench)
            at = _written(m[last + 1 if own_axes else chassis + 1], wrench, row, at)
        for g in range(h):
            for k in range(6):
                wrench[k] = -acting[b + g, 3 + k]
            at = _written(m[int(hubs[g, LAST]) + 1 if own_axes else chassis + 1], wrench, row, at)
        for g in range(len(points)):
            _feel_point(joints, m, points[g], head[GRAVITY], sides[0], row[at:])
            at += POINT


@njit(cache=True, error_model="numpy")
def _written(own, wrench, row, at):
    """Write force and moment of space in the axes of a row of ``m``; where the next ones go."""
    into(own, wrench, 0, row, at)
    into(own, wrench, 3, row, at + 3)
    return at + WRENCH
