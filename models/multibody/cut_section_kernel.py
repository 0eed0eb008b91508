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
    DESIGN_TRAVEL,
    FIRST_BODY,
    GRAVITY,
    LAST,
    ROWS_PER_SECOND,
    SECOND_BODY,
    WRENCH,
    ForceReport,
    forces,
    span_vector,
    table_views,
    wrench_axes_row,
)
from models.multibody.cut_mechanics import (
    JOINT_AXIS,
    MASS,
    OMEGA,
    PARENT,
    PER_MOTION,
    POSITION,
    ROTATES,
    add_inertia,
    bias_acceleration,
    body_inertia_terms,
    joint_velocity,
    point_position,
    rotated_vector,
    solve_in_place,
)
from models.multibody.tree import cross, plus, put_three, three_from, times
from models.multibody.tree import vector_in_carrier_axes as into
from models.vehicles.cut_vehicle import ROLL

ELEMENT, CHASSIS_ROW, MOMENTS, POINT = 2, 9, 2, 3
"""Count of numbers that each element, the chassis, the stabiliser and each point has in a row of section results; a
guide and a hub have WRENCH."""
JOINT, POINT_ARM, WEIGHT, PER_POINT = 0, 1, 4, 5
"""Indices of the numbers of a point: the joint that carries it, its position from there (m), the share of gravity that
a sensor there measures."""


class SectionPlaces(NamedTuple):
    """Guided bodies, hubs and points of a vehicle (b bodies, h hubs, e elements) at which section forces or
    accelerations are evaluated.

    guide_joints (g,) : last joint of each guided body; carried_loads (g, b + h + 3 e) : whether a load (of bodies,
    hubs, both ends and the frame of elements) acts behind that joint; points (p, PER_POINT)."""

    guide_joints: np.ndarray
    carried_loads: np.ndarray
    points: np.ndarray


@lean
def _point_acceleration(joints, body_motions, last_joint, qdd, position, acceleration):
    """Acceleration of a point at ``position`` on the body of joint ``last_joint``, and that body's angular
    acceleration. ``acceleration`` is the point's acceleration without the q'' terms."""
    j, turning = last_joint, (0.0, 0.0, 0.0)
    while j >= 0:
        link, turns = body_motions[j + 1], joints[j, ROTATES]
        acceleration = plus(acceleration, times(joint_velocity(turns, link, position), qdd[j]))
        turning = plus(turning, times(times(three_from(link, JOINT_AXIS), turns), qdd[j]))
        j = int(joints[j, PARENT])
    return acceleration, turning


@lean
def _write_body_loads(joints, bodies, body_motions, gravity, qdd, loads):
    """Write, for each body, the force and moment that accelerate it and carry its weight (9 numbers in all).

    These are the point of action, the force, and the moment about that point.
    """
    tensor = array(doubles(9), (9,))
    for b in range(len(bodies)):
        body, row, last = bodies[b], loads[b], int(bodies[b, LAST])
        arm, a, t = body_inertia_terms(body_motions[last + 1], body, gravity, tensor)
        place = plus(three_from(body_motions[last + 1], POSITION), arm)
        a, turning = _point_acceleration(joints, body_motions, last, qdd, place, a)
        put_three(row, 0, place)
        put_three(row, 3, times(a, body[MASS]))
        put_three(row, 6, plus(t, rotated_vector(tensor, turning)))


@lean
def _write_hub_loads(table_head, hubs, body_motions, wrenches, loads):
    """Write position, force and moment of each hub's load, with negative sign because the load acts from outside."""
    for i in range(len(hubs)):
        hub, row, body_frame = hubs[i], loads[i], body_motions[wrench_axes_row(table_head, hubs[i])]
        put_three(row, 0, point_position(body_motions[int(hub[LAST]) + 1], hub, ARM))
        put_three(row, 3, times(rotated_vector(body_frame, three_from(wrenches[i], 0)), -1.0))
        put_three(row, 6, times(rotated_vector(body_frame, three_from(wrenches[i], 3)), -1.0))


@lean
def _write_element_loads(elements, body_motions, element_forces, loads, travels):
    """Write for every element the positions and forces at both ends, and the couple on the body in which its axis is
    fixed, all with negative sign. Also writes its travel."""
    for i in range(len(elements)):
        e = elements[i]
        axis = rotated_vector(body_motions[int(e[AXIS_JOINT]) + 1], three_from(e, AXIS))
        travels[i] = -e[DESIGN_TRAVEL]
        for side in range(2):
            row, sign = loads[3 * i + side], 2.0 * side - 1.0
            place = point_position(body_motions[int(e[FIRST_BODY + SECOND_BODY * side]) + 1], e, SECOND_BODY * side + 1)
            for k in range(3):
                travels[i] += sign * axis[k] * place[k]
            put_three(row, 0, place)
            put_three(row, 3, times(axis, sign * element_forces[i]))
            put_three(row, 6, (0.0, 0.0, 0.0))
        put_three(loads[3 * i + 2], 0, (0.0, 0.0, 0.0))
        put_three(loads[3 * i + 2], 3, (0.0, 0.0, 0.0))
        put_three(loads[3 * i + 2], 6, times(cross(axis, span_vector(e, body_motions)), element_forces[i]))


@lean
def _resultant(body_loads, is_carried, reference_point):
    """Resultant force, and moment about ``reference_point``, of all loads on the bodies behind a guide (nonzero in
    ``is_carried``)."""
    force = moment = 0.0, 0.0, 0.0
    for i in range(len(body_loads)):
        if is_carried[i] != 0.0:
            row = body_loads[i]
            arm = plus(three_from(row, 0), times(reference_point, -1.0))
            force, moment = plus(force, three_from(row, 3)), plus(moment, three_from(row, 6))
            moment = plus(moment, cross(arm, three_from(row, 3)))
    return force, moment


@lean
def _measured_acceleration(joints, body_motions, point, gravity, qdd):
    """Acceleration (3,) that an accelerometer at a point measures, in the axes of the body that carries the point."""
    last = int(point[JOINT])
    link = body_motions[last + 1]
    arm = rotated_vector(link, three_from(point, POINT_ARM))
    a = bias_acceleration(link, arm, gravity * point[WEIGHT])
    return into(
        link, _point_acceleration(joints, body_motions, last, qdd, plus(three_from(link, POSITION), arm), a)[0], 0
    )


@njit(cache=True, error_model="numpy", nogil=True)
def section_results(parameter_table, half_steps_between, states, section_places, in_body_axes, section_values):
    """Write the section results (n, all) of states (n, 2 c) that are ``half_steps_between`` half steps apart from time
    0 on.

    section_places : ``SectionPlaces``; in_body_axes : whether guides and hubs are given in the axes of what they carry
    instead of the chassis'."""
    guides, points = section_places.guide_joints, section_places.points
    head, joints, bodies, elements, hubs, _ = table_views(parameter_table)
    n, b, e, h, chassis = len(joints), len(bodies), len(elements), len(hubs), int(head[CHASSIS])
    links, mass, sides = np.empty((n + 1, PER_MOTION)), np.empty((n, n)), np.empty((1, n))
    inside, travels, wrenches, moments = np.empty(e), np.empty(e), np.empty((h, WRENCH)), np.empty(2)
    told = ForceReport(inside, wrenches, moments)
    loads, per_time, gravity = np.empty((b + h + 3 * e, 9)), head[ROWS_PER_SECOND], head[GRAVITY]
    for i in range(len(states)):
        q, v, row = states[i, :n], states[i, n:], section_values[i]
        sides[:] = 0.0
        forces(parameter_table, i * half_steps_between / per_time, q, v, links, sides[0], told)
        add_inertia(joints, bodies, links, gravity, mass, sides[0])
        solve_in_place(mass, sides)
        _write_body_loads(joints, bodies, links, gravity, sides[0], loads[:b])
        _write_hub_loads(head, hubs, links, wrenches, loads[b : b + h])
        _write_element_loads(elements, links, inside, loads[b + h :], travels)
        row[:e], row[e : 2 * e] = inside, travels
        at = 2 * e
        for k in range(6):
            row[at + k] = q[k]
        put_three(row, at + 6, into(links[ROLL + 1], links[ROLL + 1], OMEGA))
        row[at + 9 : at + 11] = moments
        at += CHASSIS_ROW + MOMENTS
        for g in range(len(guides)):
            last = int(guides[g])
            force, moment = _resultant(loads, section_places.carried_loads[g], three_from(links[last + 1], POSITION))
            at = _write_wrench(links[last + 1 if in_body_axes else chassis + 1], force, moment, row, at)
        for g in range(h):
            force, moment = times(three_from(loads[b + g], 3), -1.0), times(three_from(loads[b + g], 6), -1.0)
            at = _write_wrench(links[int(hubs[g, LAST]) + 1 if in_body_axes else chassis + 1], force, moment, row, at)
        for g in range(len(points)):
            put_three(row, at, _measured_acceleration(joints, links, points[g], gravity, sides[0]))
            at += POINT


@lean
def _write_wrench(body_motion, force, moment, result_row, first_index):
    """Write force and moment, given in space, in the axes of a row of ``links``. Returns the index after them."""
    put_three(result_row, first_index, into(body_motion, force, 0))
    put_three(result_row, first_index + 3, into(body_motion, moment, 0))
    return first_index + WRENCH
