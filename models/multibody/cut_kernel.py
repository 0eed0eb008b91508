"""Compiled joint forces of a vehicle without its wheels, loaded at its wheel hubs; both engines call them as their one
callback.

Springs, mounts and bars inside; at every hub the six measured components, or, in the virtual measurement, the tyre on
its road; and what stabilises roll and pitch. All numbers lie in one table, see ``table``: a head, joints, bodies,
elements, hubs, then the inputs of every half step, and curves.
"""

import math
from typing import NamedTuple

import numpy as np

from models.machine.compiled import lean, njit
from models.machine.stack import array, at, beyond, doubles, start
from models.multibody.cut_mechanics import (
    JOINT_AXIS,
    PARENT,
    PER_BODY,
    PER_JOINT,
    PER_MOTION,
    ROTATES,
    add_inertia,
    add_wrench,
    joint_velocity,
    move_bodies,
    point_position,
    rotated_vector,
    solve_in_place,
)
from models.multibody.parts import curve_force
from models.multibody.tree import cross, dot, plus, put_three, three_from, times
from models.multibody.tree import vector_in_carrier_axes as into
from models.vehicles.cut_vehicle import HEADING, PITCH, ROLL

(
    JOINTS,
    BODIES,
    ELEMENTS,
    HUBS,
    ROAD,
    FRAME,
    STABILISER,
    ROWS_PER_SECOND,
    ROWS,
    COLUMNS,
    GRAVITY,
    CHASSIS,
    SPEED,
    ROLL_STIFFNESS,
    ROLL_DAMPING,
    PITCH_STIFFNESS,
    PITCH_DAMPING,
    ENFORCING_RATE,
    TABLE_SIZE,
    ANY_TIME,
    HEADER,
) = range(21)
"""Indices in the head of the table. Counts of joints, bodies, elements and hubs; whether tyres on a road act; frame of
the hub forces; kind of stabiliser; rows of inputs per second, rows, columns; gravity (m/s^2); the chassis' last joint;
speed (m/s); stiffness (N m/rad) and damping (N m s/rad) that pull roll and pitch; rate (1/s) at which an enforced angle
comes back to its file; count of all numbers; whether inputs are read at any time, or at half steps alone."""
FRAMES = ("hub", "body", "inertial")
NONE, PULLED, ENFORCED = range(3)
"""Kinds of stabiliser of roll and pitch: none; a moment towards a given angle and its rate; a moment that enforces the
given angular acceleration."""
FIRST_BODY, FIRST_POINT, SECOND_BODY, SECOND_POINT, AXIS, DESIGN_TRAVEL, PRELOAD, STIFFNESS, DAMPING = (
    0,
    1,
    4,
    5,
    8,
    11,
    12,
    13,
    14,
)
"""Indices of the numbers of a spring, mount or bar: last joint and point (m, from there) of both ends, axis, travel at
rest (m), preload (N), stiffness (N/m) and damping (N s/m)."""
AXIS_JOINT, FRICTION, FRICTION_RATE, TRAVEL_CURVE, RATE_CURVE, PER_ELEMENT = range(15, 21)
"""Further indices of the numbers of a spring, mount or bar: the last joint of the body in which its axis is fixed,
friction force (N), friction speed (m/s), and where the table has its curves of force over travel and over rate (0:
nowhere)."""
LAST, ARM, HEIGHT, LOAD, TYRE, TYRE_DAMPING, CORNERING, ROLL_STEER, ONE_SIDED, PER_HUB = 0, 1, 4, 5, 6, 7, 8, 9, 10, 11
"""Indices of the numbers of a hub: last joint, point (m, from there), and of its former tyre: height of the point at
rest (m), static load (N), stiffness (N/m), damping (N s/m), cornering stiffness (N/rad), roll steer (-), whether it
only pushes."""
WRENCH, GUIDE_COLUMNS = 6, 6
"""Number of columns of the inputs: force (N) and moment (N m) of each hub; roll, pitch, their rates and their
accelerations."""


class JointMotion(NamedTuple):
    """Joint table of a cut vehicle, with its coordinates, rates and the motion of its bodies.

    joints (n, PER_JOINT) : as in the table; q, v (n,) : coordinates and rates; links (n + 1, PER_MOTION) :
    motion of the body behind each joint, see ``cut_mechanics``.
    """

    joints: np.ndarray
    q: np.ndarray
    v: np.ndarray
    links: np.ndarray


class ForceReport(NamedTuple):
    """Forces of a cut vehicle at one state: forces of the elements (e,), N or N m; wrenches (hubs, WRENCH) in the
    declared frame; moments (2,) of the stabiliser on roll and pitch (N m)."""

    elements: np.ndarray
    wrenches: np.ndarray
    moments: np.ndarray


@lean
def _element_force(element_row, parameter_table, joint_motion, chassis_joint, travel_gradient):
    """Force of a spring, mount or bar, N or N m. Fills ``travel_gradient`` (n,) with the derivatives of its travel with
    respect to the joint coordinates behind the chassis."""
    joints, links = joint_motion.joints, joint_motion.links
    axis, travel, rate = (
        rotated_vector(links[int(element_row[AXIS_JOINT]) + 1], three_from(element_row, AXIS)),
        -element_row[DESIGN_TRAVEL],
        0.0,
    )
    travel_gradient[:] = 0.0
    for side in range(2):
        sign, j = 2.0 * side - 1.0, int(element_row[SECOND_BODY * side])
        end = point_position(links[j + 1], element_row, SECOND_BODY * side + 1)
        for k in range(3):
            travel += sign * axis[k] * end[k]
        while j > chassis_joint:
            along = dot(axis, joint_velocity(joints[j, ROTATES], links[j + 1], end))
            travel_gradient[j] += sign * along
            rate += sign * along * joint_motion.v[j]
            j = int(joints[j, PARENT])
    if element_row[AXIS_JOINT] > chassis_joint:
        rate += _add_axis_rotation(element_row, joint_motion, chassis_joint, axis, travel_gradient)
    force = element_row[PRELOAD] + element_row[STIFFNESS] * travel + element_row[DAMPING] * rate
    if element_row[FRICTION] != 0.0:
        force += element_row[FRICTION] * math.tanh(rate / element_row[FRICTION_RATE])
    if element_row[TRAVEL_CURVE] != 0.0:
        force += curve_force(beyond(start(parameter_table), int(element_row[TRAVEL_CURVE])), travel)
    if element_row[RATE_CURVE] != 0.0:
        force += curve_force(beyond(start(parameter_table), int(element_row[RATE_CURVE])), rate)
    return force


@lean
def _read_inputs(table_head, input_table, t, input_row):
    """Fill ``input_row`` with the inputs at a time (s): those of the nearest half step or, for methods with variable
    steps, of a parabola through the three rows of a step."""
    last, place = len(input_table) - 1, t * table_head[ROWS_PER_SECOND]
    if table_head[ANY_TIME] == 0.0:
        nearest = min(max(int(np.rint(place)), 0), last)
        for k in range(len(input_row)):
            input_row[k] = input_table[nearest, k]
        return
    first = 2 * min(max(int(place / 2.0), 0), (last - 2) // 2)
    part = min(max(place - first, 0.0), 2.0)
    begin, middle, end = 0.5 * (part - 1.0) * (part - 2.0), part * (2.0 - part), 0.5 * part * (part - 1.0)
    for k in range(len(input_row)):
        input_row[k] = (
            begin * input_table[first, k] + middle * input_table[first + 1, k] + end * input_table[first + 2, k]
        )


@lean
def span_vector(element_row, body_motions):
    """Vector (m, in space) from the first to the second attachment point of a spring, mount or bar."""
    return plus(
        point_position(body_motions[int(element_row[SECOND_BODY]) + 1], element_row, SECOND_POINT),
        times(point_position(body_motions[int(element_row[FIRST_BODY]) + 1], element_row, FIRST_POINT), -1.0),
    )


@lean
def _add_axis_rotation(element_row, joint_motion, chassis_joint, axis, travel_gradient):
    """Add to ``travel_gradient`` the derivatives of an element's travel that come from the rotation of its axis
    relative to the chassis. Returns this part of the rate of travel."""
    joints, links = joint_motion.joints, joint_motion.links
    moved, rate, j = cross(axis, span_vector(element_row, links)), 0.0, int(element_row[AXIS_JOINT])
    while j > chassis_joint:
        along = joints[j, ROTATES] * dot(moved, three_from(links[j + 1], JOINT_AXIS))
        travel_gradient[j] += along
        rate += along * joint_motion.v[j]
        j = int(joints[j, PARENT])
    return rate


@lean
def _tyre_wrench(hub_row, joint_motion, hub_position, road_height_and_rate, speed):
    """Force (N) and moment (N m), in space, on a wheel hub at ``hub_position`` from its tyre on a road with height (m)
    and vertical velocity (m/s).

    The side force of a tyre that only pushes goes with its load: in the air it has none.
    """
    height, rate = road_height_and_rate
    joints, links, v = joint_motion.joints, joint_motion.links, joint_motion.v
    down, j = rotated_vector(links[ROLL + 1], (0.0, 0.0, -hub_row[HEIGHT])), int(hub_row[LAST])
    risen = sideways = 0.0
    point = plus(hub_position, down)
    while j >= 0:
        risen += joint_velocity(joints[j, ROTATES], links[j + 1], hub_position)[2] * v[j]
        sideways += joint_velocity(joints[j, ROTATES], links[j + 1], point)[1] * v[j]
        j = int(joints[j, PARENT])
    elastic, grip = hub_row[LOAD] + hub_row[TYRE] * (height - hub_position[2] + hub_row[HEIGHT]), 1.0
    load = elastic + hub_row[TYRE_DAMPING] * (rate - risen)
    if hub_row[ONE_SIDED] != 0.0:
        load = max(min(load, 2.0 * elastic), 0.0)
        grip = load / hub_row[LOAD]
    side = (
        grip
        * hub_row[CORNERING]
        * (hub_row[ROLL_STEER] * joint_motion.q[ROLL] + joint_motion.q[HEADING] - sideways / speed)
    )
    return (-load * rate / speed, side, load), (-down[2] * side, 0.0, down[0] * side)


@lean
def wrench_axes_row(table_head, hub_row):
    """Index of the row of ``links`` in whose axes the force and moment of a hub are given."""
    return (
        0 if table_head[FRAME] == 2.0 else int(table_head[CHASSIS] if table_head[FRAME] == 1.0 else hub_row[LAST]) + 1
    )


@lean
def _enforce_roll_and_pitch(table_head, wanted_roll_and_pitch, bodies, joint_motion, generalised_forces, moments):
    """Write the moments (roll, pitch), N m, that make the roll and pitch accelerations follow the given motion."""
    n, w, q, v = len(joint_motion.joints), table_head[ENFORCING_RATE], joint_motion.q, joint_motion.v
    mass, sides = array(doubles(n * n), (n, n)), array(doubles(3 * n), (3, n))
    sides[:] = 0.0
    for j in range(n):
        sides[0, j] = generalised_forces[j]
    sides[1, ROLL] = sides[2, PITCH] = 1.0
    add_inertia(joint_motion.joints, bodies, joint_motion.links, table_head[GRAVITY], mass, sides[0])
    solve_in_place(mass, sides)
    roll = (
        wanted_roll_and_pitch[4]
        + 2.0 * w * (wanted_roll_and_pitch[2] - v[ROLL])
        + w * w * (wanted_roll_and_pitch[0] - q[ROLL])
        - sides[0, ROLL]
    )
    pitch = (
        wanted_roll_and_pitch[5]
        + 2.0 * w * (wanted_roll_and_pitch[3] - v[PITCH])
        + w * w * (wanted_roll_and_pitch[1] - q[PITCH])
        - sides[0, PITCH]
    )
    a, b, c, d = sides[1, ROLL], sides[2, ROLL], sides[1, PITCH], sides[2, PITCH]
    moments[0] = (d * roll - b * pitch) / (a * d - b * c)
    moments[1] = (a * pitch - c * roll) / (a * d - b * c)


@njit(cache=True, error_model="numpy")
def table_views(parameter_table):
    """Views of the sections of the table of numbers: head, joints, bodies, elements, hubs, inputs."""
    head = parameter_table[:HEADER]
    n, b, e, h = int(head[JOINTS]), int(head[BODIES]), int(head[ELEMENTS]), int(head[HUBS])
    joints_end = HEADER + PER_JOINT * n
    two = joints_end + PER_BODY * b
    three = two + PER_ELEMENT * e
    four = three + PER_HUB * h
    return (
        head,
        parameter_table[HEADER:joints_end].reshape(n, PER_JOINT),
        parameter_table[joints_end:two].reshape(b, PER_BODY),
        parameter_table[two:three].reshape(e, PER_ELEMENT),
        parameter_table[three:four].reshape(h, PER_HUB),
        parameter_table[four : four + int(head[ROWS]) * int(head[COLUMNS])].reshape(
            int(head[ROWS]), int(head[COLUMNS])
        ),
    )


@njit(cache=True, error_model="numpy")
def forces(parameter_table, t, q, v, body_motions, generalised_forces, force_report):
    """Add the forces of all elements, hubs and stabilisers to the joint forces ``generalised_forces`` (n,) at a time
    (s), coordinates and rates (n,).

    Also fills ``body_motions`` and the ``ForceReport``.
    """
    head, joints, bodies, elements, hubs, inputs = table_views(parameter_table)
    columns = int(head[COLUMNS])
    row = array(doubles(columns), (columns,))
    _read_inputs(head, inputs, t, row)
    chassis, count, motion, moments = (
        int(head[CHASSIS]),
        len(hubs),
        JointMotion(joints, q, v, body_motions),
        force_report.moments,
    )
    travel = array(doubles(len(joints)), (len(joints),))
    move_bodies(joints, q, v, body_motions)
    for i in range(len(elements)):
        force_report.elements[i] = _element_force(elements[i], parameter_table, motion, chassis, travel)
        for j in range(chassis + 1, len(joints)):
            generalised_forces[j] -= force_report.elements[i] * travel[j]
    for i in range(count):
        hub, known, axes = hubs[i], force_report.wrenches[i], body_motions[wrench_axes_row(head, hubs[i])]
        place = point_position(body_motions[int(hub[LAST]) + 1], hub, ARM)
        if head[ROAD] != 0.0:
            force, moment = _tyre_wrench(hub, motion, place, (row[i], row[count + i]), head[SPEED])
            put_three(known, 0, into(axes, force, 0))
            put_three(known, 3, into(axes, moment, 0))
        else:
            for k in range(WRENCH):
                known[k] = row[WRENCH * i + k]
            force, moment = rotated_vector(axes, three_from(known, 0)), rotated_vector(axes, three_from(known, 3))
        add_wrench(joints, body_motions, int(hub[LAST]), place, force, moment, generalised_forces)
    moments[0] = moments[1] = 0.0
    wanted = row[len(row) - GUIDE_COLUMNS :]
    if head[STABILISER] == PULLED:
        moments[0] = head[ROLL_STIFFNESS] * (wanted[0] - q[ROLL]) + head[ROLL_DAMPING] * (wanted[2] - v[ROLL])
        moments[1] = head[PITCH_STIFFNESS] * (wanted[1] - q[PITCH]) + head[PITCH_DAMPING] * (wanted[3] - v[PITCH])
    elif head[STABILISER] == ENFORCED:
        _enforce_roll_and_pitch(head, wanted, bodies, motion, generalised_forces, moments)
    generalised_forces[ROLL] += moments[0]
    generalised_forces[PITCH] += moments[1]


@njit(cache=True, error_model="numpy")
def report_forces(parameter_table, times, states, element_forces, wrenches, moments):
    """Fill the arrays of a ``ForceReport`` for states (m, 2 n) at times (m,), one row per state."""
    n = states.shape[1] // 2
    links, out = array(doubles(PER_MOTION * (n + 1)), (n + 1, PER_MOTION)), array(doubles(n), (n,))
    for i in range(len(times)):
        out[:] = 0.0  # what enforces an angle is found from all joint forces of this state
        force_report = ForceReport(element_forces[i], wrenches[i], moments[i])
        forces(parameter_table, times[i], states[i, :n], states[i, n:], links, out, force_report)


@njit(cache=True, error_model="numpy")
def accelerate(parameter_table, t, q, v, accelerations):
    """Write the accelerations (n,) from the hand-written equations of motion at a time (s), coordinates and rates
    (n,)."""
    head, joints, bodies, elements, hubs, _ = table_views(parameter_table)
    n, e, h = len(joints), len(elements), len(hubs)
    links, mass = array(doubles(PER_MOTION * (n + 1)), (n + 1, PER_MOTION)), array(doubles(n * n), (n, n))
    force_report = ForceReport(
        array(doubles(e), (e,)), array(doubles(WRENCH * h), (h, WRENCH)), array(doubles(2), (2,))
    )
    accelerations[:] = 0.0
    forces(parameter_table, t, q, v, links, accelerations, force_report)
    add_inertia(joints, bodies, links, head[GRAVITY], mass, accelerations)
    solve_in_place(mass, array(start(accelerations), (1, n)))


@njit(cache=True, error_model="numpy")
def march(parameter_table, states, time_step):
    """Integrate the equations of motion from the first row of the states (m, 2 n), by the classical Runge-Kutta method
    with a fixed step (s)."""
    size = states.shape[1]
    n = size // 2
    rate, total, here = array(doubles(size), (size,)), array(doubles(size), (size,)), array(doubles(size), (size,))
    for i in range(len(states) - 1):
        total[:] = 0.0
        for stage in range(4):
            ahead = 0.0 if stage == 0 else time_step if stage == 3 else 0.5 * time_step
            for k in range(size):
                here[k] = states[i, k] + (ahead * rate[k] if stage > 0 else 0.0)
            rate[:n] = here[n:]
            accelerate(parameter_table, i * time_step + ahead, here[:n], here[n:], rate[n:])
            for k in range(size):
                total[k] += rate[k] if stage in (0, 3) else 2.0 * rate[k]
        for k in range(size):
            states[i + 1, k] = states[i, k] + time_step / 6.0 * total[k]


@njit(cache=True, error_model="numpy")
def joint_forces(parameter_table, t, q, v, generalised_forces):
    """Add the forces on all joints of a cut vehicle to ``generalised_forces``. For callbacks: all arguments but the
    time (s) are pointers to doubles."""
    head = array(parameter_table, (HEADER,))
    n, e, h = int(head[JOINTS]), int(head[ELEMENTS]), int(head[HUBS])
    links = array(doubles(PER_MOTION * (n + 1)), (n + 1, PER_MOTION))
    force_report = ForceReport(
        array(doubles(e), (e,)), array(doubles(WRENCH * h), (h, WRENCH)), array(doubles(2), (2,))
    )
    forces(
        array(parameter_table, (int(head[TABLE_SIZE]),)),
        t,
        array(q, (n,)),
        array(v, (n,)),
        links,
        array(generalised_forces, (n,)),
        force_report,
    )


@njit(cache=True, error_model="numpy")
def set_joint_forces(block_address, t, coordinate_count):
    """Set the forces f to those of ``joint_forces``. All data lie in one block of doubles at a memory address: f, q and
    v (n,), then the table."""
    f = at(block_address)
    array(f, (coordinate_count,))[:] = 0.0
    joint_forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)
