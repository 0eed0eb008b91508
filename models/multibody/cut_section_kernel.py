"""Section forces and accelerations inside a vehicle loaded at its wheel hubs, evaluated along a run, compiled.

A row of answers, in this order: force and travel of every element; position, heading, pitch, roll of the chassis and
its angular velocity in its own axes; the stabiliser's moments; force and moment that each guide exerts on its body;
those at the hubs; accelerations of points. Guides follow from Newton and Euler: what moves the bodies behind them as
they move, less what else acts there.
"""

from typing import NamedTuple

import numpy as np

from models.machine.compiled import lean, njit
from models.machine.stack import array, doubles
from models.multibody.cut_kernel import (
    ARM,
    AXIS,
    AXIS_JOINT,
    CHASSIS,
    DESIGN,
    FIRST_BODY,
    GRAVITY,
    LAST,
    PER_TIME,
    SECOND_BODY,
    WRENCH,
    ForceReport,
    ends_apart,
    forces,
    frame,
    parts,
)
from models.multibody.cut_mechanics import (
    ALONG,
    MASS,
    OMEGA,
    PARENT,
    PER_MOTION,
    PLACE,
    TURNS,
    accelerated,
    column,
    inertia,
    locate,
    resting,
    solve,
    turned,
)
from models.multibody.tree import cross, plus, put, three, times
from models.multibody.tree import out as into
from models.vehicles.cut_vehicle import ROLL

ELEMENT, CHASSIS_ROW, MOMENTS, POINT = 2, 9, 2, 3
"""Count of numbers that each element, the chassis, the stabiliser and each point has in a row of section results; a
guide and a hub have WRENCH."""
JOINT, POINT_ARM, WEIGHT, PER_POINT = 0, 1, 4, 5
"""Indices of the numbers of a point: the joint that carries it, its position from there (m), the share of gravity that
a sensor there measures."""


class FeltPlaces(NamedTuple):
    """Guided bodies, hubs and points of a vehicle (b bodies, h hubs, e elements) at which section forces or
    accelerations are evaluated.

    guides (g,) : last joint of each guided body; carried (g, b + h + 3 e) : whether what acts on bodies, hubs, both
    ends and the frame of elements acts behind it; points (p, PER_POINT).
    """

    guides: np.ndarray
    carried: np.ndarray
    points: np.ndarray


@lean
def _accelerate(joints, m, last, qdd, place, a):
    """Acceleration of a point at ``place`` on the body of joint ``last``, and that body's angular acceleration. ``a``
    is the point's acceleration without the q'' terms."""
    j, turning = last, (0.0, 0.0, 0.0)
    while j >= 0:
        link, turns = m[j + 1], joints[j, TURNS]
        a = plus(a, times(column(turns, link, place), qdd[j]))
        turning = plus(turning, times(times(three(link, ALONG), turns), qdd[j]))
        j = int(joints[j, PARENT])
    return a, turning


@lean
def _move_bodies(joints, bodies, m, gravity, qdd, acting):
    """Write, for each body, the force and moment that accelerate it and carry its weight (9 numbers in all).

    These are the point of action, the force, and the moment about that point.
    """
    tensor = array(doubles(9), (9,))
    for b in range(len(bodies)):
        body, row, last = bodies[b], acting[b], int(bodies[b, LAST])
        arm, a, t = resting(m[last + 1], body, gravity, tensor)
        place = plus(three(m[last + 1], PLACE), arm)
        a, turning = _accelerate(joints, m, last, qdd, place, a)
        put(row, 0, place)
        put(row, 3, times(a, body[MASS]))
        put(row, 6, plus(t, turned(tensor, turning)))


@lean
def _load_hubs(head, hubs, m, wrenches, acting):
    """Write position, force and moment of each hub's load, with negative sign because the load acts from outside."""
    for i in range(len(hubs)):
        hub, row, body_frame = hubs[i], acting[i], m[frame(head, hubs[i])]
        put(row, 0, locate(m[int(hub[LAST]) + 1], hub, ARM))
        put(row, 3, times(turned(body_frame, three(wrenches[i], 0)), -1.0))
        put(row, 6, times(turned(body_frame, three(wrenches[i], 3)), -1.0))


@lean
def _load_elements(elements, m, inside, acting, travels):
    """Write for every element the positions and forces at both ends, and the couple on the body in which its axis is
    fixed, all with negative sign. Also writes its travel."""
    for i in range(len(elements)):
        e = elements[i]
        axis = turned(m[int(e[AXIS_JOINT]) + 1], three(e, AXIS))
        travels[i] = -e[DESIGN]
        for side in range(2):
            row, sign = acting[3 * i + side], 2.0 * side - 1.0
            place = locate(m[int(e[FIRST_BODY + SECOND_BODY * side]) + 1], e, SECOND_BODY * side + 1)
            for k in range(3):
                travels[i] += sign * axis[k] * place[k]
            put(row, 0, place)
            put(row, 3, times(axis, sign * inside[i]))
            put(row, 6, (0.0, 0.0, 0.0))
        put(acting[3 * i + 2], 0, (0.0, 0.0, 0.0))
        put(acting[3 * i + 2], 3, (0.0, 0.0, 0.0))
        put(acting[3 * i + 2], 6, times(cross(axis, ends_apart(e, m)), inside[i]))


@lean
def _sum_up(acting, carried, point):
    """Resultant force, and moment about ``point``, of all loads on the bodies behind a guide (nonzero in
    ``carried``)."""
    force = moment = 0.0, 0.0, 0.0
    for i in range(len(acting)):
        if carried[i] != 0.0:
            row = acting[i]
            arm = plus(three(row, 0), times(point, -1.0))
            force, moment = plus(force, three(row, 3)), plus(moment, three(row, 6))
            moment = plus(moment, cross(arm, three(row, 3)))
    return force, moment


@lean
def _feel_point(joints, m, point, gravity, qdd):
    """Acceleration (3,) that an accelerometer at a point measures, in the axes of the body that carries the point."""
    last = int(point[JOINT])
    link = m[last + 1]
    arm = turned(link, three(point, POINT_ARM))
    a = accelerated(link, arm, gravity * point[WEIGHT])
    return into(link, _accelerate(joints, m, last, qdd, plus(three(link, PLACE), arm), a)[0], 0)


@njit(cache=True, error_model="numpy", nogil=True)
def section_answers(numbers, every, states, places, own_axes, out):
    """Write the section results (n, all) of states (n, 2 c) that are ``every`` half steps apart from time 0 on.

    places : ``FeltPlaces``; own_axes : whether guides and hubs are given in the axes of what they carry instead of the
    chassis'.
    """
    guides, points = places.guides, places.points
    head, joints, bodies, elements, hubs, _ = parts(numbers)
    n, b, e, h, chassis = len(joints), len(bodies), len(elements), len(hubs), int(head[CHASSIS])
    m, mass, sides = np.empty((n + 1, PER_MOTION)), np.empty((n, n)), np.empty((1, n))
    inside, travels, wrenches, moments = np.empty(e), np.empty(e), np.empty((h, WRENCH)), np.empty(2)
    told = ForceReport(inside, wrenches, moments)
    acting, per_time, gravity = np.empty((b + h + 3 * e, 9)), head[PER_TIME], head[GRAVITY]
    for i in range(len(states)):
        q, v, row = states[i, :n], states[i, n:], out[i]
        sides[:] = 0.0
        forces(numbers, i * every / per_time, q, v, m, sides[0], told)
        inertia(joints, bodies, m, gravity, mass, sides[0])
        solve(mass, sides)
        _move_bodies(joints, bodies, m, gravity, sides[0], acting[:b])
        _load_hubs(head, hubs, m, wrenches, acting[b : b + h])
        _load_elements(elements, m, inside, acting[b + h :], travels)
        row[:e], row[e : 2 * e] = inside, travels
        at = 2 * e
        for k in range(6):
            row[at + k] = q[k]
        put(row, at + 6, into(m[ROLL + 1], m[ROLL + 1], OMEGA))
        row[at + 9 : at + 11] = moments
        at += CHASSIS_ROW + MOMENTS
        for g in range(len(guides)):
            last = int(guides[g])
            force, moment = _sum_up(acting, places.carried[g], three(m[last + 1], PLACE))
            at = _written(m[last + 1 if own_axes else chassis + 1], force, moment, row, at)
        for g in range(h):
            force, moment = times(three(acting[b + g], 3), -1.0), times(three(acting[b + g], 6), -1.0)
            at = _written(m[int(hubs[g, LAST]) + 1 if own_axes else chassis + 1], force, moment, row, at)
        for g in range(len(points)):
            put(row, at, _feel_point(joints, m, points[g], gravity, sides[0]))
            at += POINT


@lean
def _written(frame, force, moment, row, at):
    """Write force and moment, given in space, in the axes of a row of ``m``. Returns the index after them."""
    put(row, at, into(frame, force, 0))
    put(row, at + 3, into(frame, moment, 0))
    return at + WRENCH
