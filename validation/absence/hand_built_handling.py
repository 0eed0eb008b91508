"""The car of the handling scenes rolling freely on a flat road, written by hand for MuJoCo: struts and bushes,
anti-roll bars, an engine on three mounts, two seats, drag, brush tyres.

No steering, brakes, drive, rough road, leaning wheels, curves or friction in its suspension, and no way to have them.
Forces act along axes that only yaw with the car, as in ``models.vehicles.free_vehicle``. Positions are relative to S,
the point of the car on the road about which its chassis rolls and pitches. The tyres' brush model is twinrig's.
"""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from models.contact.fastsim_many import fill_contact_forces_in_place
from models.contact.fastsim_records import BLOCK, CONTACT, FORCES, SLIP, MarchWorkspace, cells_in, strips_in
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_quiet import installed_callback
from models.engines.mujoco_tree import principal_inertias
from models.machine.compiled import lean
from models.machine.records import records_at_pointer, size_of, stack_records
from models.machine.stack import array, beyond, doubles, row
from models.multibody.numbers import Handling
from models.multibody.tree import cross, dot, plus, three_from, times
from models.tyre.bristles import SECOND_ORDER_MARCH, THREE_BRISTLES, cornering_stiffness_factor, patch_grid
from models.vehicles.free_vehicle import ROTOR_MASS

COORDINATE_COUNT, CELLS = 23, 21
GENERAL_NUMBERS, WHEEL_NUMBERS, MOUNT_NUMBERS, SEAT_NUMBERS = 14, 18, 15, 6
"""Lengths of the sections of ``parameter_table``: general parameters, and parameters of each wheel, engine mount and
seat."""
CONTACT_NUMBERS = size_of(CONTACT)


@lean
def add_car_forces(parameter_table, t, q, v, forces_out):
    """Add the generalised forces of the hand-written car to ``forces_out`` (23,). All arguments but the time t are
    pointers to doubles: the parameter table, coordinates q, rates v and forces.
    """
    head, q, v, forces_out = (
        array(parameter_table, (GENERAL_NUMBERS,)),
        array(q, (COORDINATE_COUNT,)),
        array(v, (COORDINATE_COUNT,)),
        array(forces_out, (COORDINATE_COUNT,)),
    )
    wheels, mounts = (
        beyond(parameter_table, GENERAL_NUMBERS),
        beyond(parameter_table, GENERAL_NUMBERS + 4 * WHEEL_NUMBERS),
    )
    cells = beyond(mounts, 3 * MOUNT_NUMBERS + 2 * SEAT_NUMBERS)
    c_yaw, s_yaw, c_roll, s_roll = math.cos(q[2]), math.sin(q[2]), math.cos(q[4]), math.sin(q[4])
    c_pitch, s_pitch = math.cos(q[5]), math.sin(q[5])
    x, y = (c_pitch, s_roll * s_pitch, -c_roll * s_pitch), (0.0, c_roll, s_roll)
    z = s_pitch, -s_roll * c_pitch, c_roll * c_pitch
    turning = v[4], c_roll * v[5], s_roll * v[5]
    frame, speed_forward, speed_leftward = (x, y, z, turning), c_yaw * v[0] + s_yaw * v[1], c_yaw * v[1] - s_yaw * v[0]
    passing = speed_forward, speed_leftward, head[0]
    contacts, forces = doubles(4 * CONTACT_NUMBERS), stack_records(4, FORCES)
    wheel_positions, pushes = doubles(12), doubles(12)
    left = wheel_positions, pushes, contacts
    moment = plus(
        _add_engine_forces(mounts, head, frame, q, v, forces_out),
        _add_seat_forces(beyond(mounts, 3 * MOUNT_NUMBERS), frame, q, v, forces_out),
    )
    for i in range(4):
        moment = plus(moment, _wheel_forces(row(wheels, WHEEL_NUMBERS, i), frame, passing, q, v, i, left))
    _add_bar_forces((head[6], head[7], head[8]), 0, left, q, forces_out)
    _add_bar_forces((head[9], head[10], head[11]), 2, left, q, forces_out)
    fill_contact_forces_in_place(
        records_at_pointer(contacts, 4, CONTACT),
        strips_in(array(beyond(cells, 5 * CELLS), (4, int(head[12])))),
        cells_in(array(cells, (5, CELLS)), head[13]),
        THREE_BRISTLES,
        SECOND_ORDER_MARCH,
        MarchWorkspace(stack_records(4, SLIP), stack_records(1, BLOCK)),
        forces,
    )
    force_along, across, turn, lift = 0.0, 0.0, 0.0, 0.0
    for i in range(4):
        wheel_position, push, creep, k = row(wheel_positions, 3, i), row(pushes, 3, i), forces[i], 9 + 3 * i
        force, radius = (push[0] + creep.fx, push[1] + creep.fy, push[2]), q[3] + wheel_position[2]
        forces_out[k] += dot(x, force)
        forces_out[k + 1] += dot(z, force)
        forces_out[k + 2] -= radius * creep.fx
        moment = plus(
            moment, plus(cross(three_from(wheel_position, 0), force), (radius * creep.fy, -radius * creep.fx, creep.mz))
        )
        force_along, across, lift = (
            force_along + creep.fx,
            across + creep.fy,
            lift + row(contacts, CONTACT_NUMBERS, i)[2],
        )
        turn += (head[0] + wheel_position[0]) * creep.fy - wheel_position[1] * creep.fx + creep.mz
    middle = times(z, head[2])
    speed = speed_forward + turning[1] * middle[2] - turning[2] * middle[1] - v[2] * middle[1]
    drag = -head[1] * abs(speed) * speed
    moment = plus(moment, cross(middle, (drag, 0.0, 0.0)))
    force_along, turn = force_along + drag, turn - middle[1] * drag
    forces_out[0] += c_yaw * force_along - s_yaw * across
    forces_out[1] += s_yaw * force_along + c_yaw * across
    forces_out[2] += turn
    forces_out[3] += lift
    forces_out[4] += moment[0]
    forces_out[5] += dot(y, moment)


@lean
def _wheel_forces(wheel_parameters, chassis_frame, chassis_velocities, q, v, wheel_index, wheel_records):
    """Compute spring forces, load and creepages of a wheel. Returns the moment of the springs on the chassis about S.

    chassis_velocities : forward and lateral speed of S, and its distance ahead of the origin. wheel_records : arrays
    that receive positions, forces and contact inputs of all wheels.
    """
    (x, y, z, turning), (speed_forward, speed_leftward, s_x), k = chassis_frame, chassis_velocities, 9 + 3 * wheel_index
    wheel_position, push, contact = (
        row(wheel_records[0], 3, wheel_index),
        row(wheel_records[1], 3, wheel_index),
        row(wheel_records[2], CONTACT_NUMBERS, wheel_index),
    )
    arm = plus(plus(times(x, wheel_parameters[0]), times(y, wheel_parameters[1])), times(z, wheel_parameters[2]))
    displacement, sliding = plus(times(x, q[k]), times(z, q[k + 1])), plus(times(x, v[k]), times(z, v[k + 1]))
    rate = plus(sliding, cross(turning, displacement))
    strut = (
        wheel_parameters[7]
        + wheel_parameters[5] * (wheel_parameters[3] * displacement[0] + wheel_parameters[4] * displacement[2])
        + wheel_parameters[6] * (wheel_parameters[3] * rate[0] + wheel_parameters[4] * rate[2])
    )
    bush = (
        wheel_parameters[10]
        + wheel_parameters[8] * (wheel_parameters[4] * displacement[0] - wheel_parameters[3] * displacement[2])
        + wheel_parameters[9] * (wheel_parameters[4] * rate[0] - wheel_parameters[3] * rate[2])
    )
    force_along, force_up = (
        -strut * wheel_parameters[3] - bush * wheel_parameters[4],
        bush * wheel_parameters[3] - strut * wheel_parameters[4],
    )
    wheel_position[0], wheel_position[1], wheel_position[2] = plus(arm, displacement)
    u, radius = plus(sliding, cross(turning, three_from(wheel_position, 0))), q[3] + wheel_position[2]
    load, tread = (
        max(wheel_parameters[11] - wheel_parameters[12] * (radius - wheel_parameters[13]), 0.0),
        radius * v[k + 2],
    )
    push[0], push[1], push[2] = force_along, 0.0, force_up + load
    contact[0], contact[1], contact[2], contact[3] = (
        math.sqrt(wheel_parameters[14] * load / wheel_parameters[12]),
        wheel_parameters[15],
        load,
        wheel_parameters[17],
    )
    contact[4] = (u[0] + speed_forward - v[2] * wheel_position[1] - radius * (turning[1] + v[k + 2])) / tread
    contact[5] = (u[1] + speed_leftward + v[2] * (s_x + wheel_position[0]) + radius * turning[0]) / tread
    contact[6] = (turning[2] + v[2]) / tread
    contact[7] = contact[8] = contact[9] = wheel_parameters[16]
    return cross((force_along, 0.0, force_up), arm)


@lean
def _add_bar_forces(bar_parameters, left_wheel_index, wheel_records, q, forces_out):
    """Add the forces of an anti-roll bar on the chassis' roll and on a left wheel and the right wheel after it.
    ``bar_parameters``: stiffness, moment at rest, 1 / track."""
    (stiffness, moment_at_rest, inverse_track), (wheel_positions, pushes, _) = bar_parameters, wheel_records
    twist = moment_at_rest + stiffness * (
        q[4]
        - (row(wheel_positions, 3, left_wheel_index)[2] - row(wheel_positions, 3, left_wheel_index + 1)[2])
        * inverse_track
    )
    forces_out[4] -= twist
    row(pushes, 3, left_wheel_index)[2] += twist * inverse_track
    row(pushes, 3, left_wheel_index + 1)[2] -= twist * inverse_track


@lean
def _add_engine_forces(mount_parameters, car_parameters, chassis_frame, q, v, forces_out):
    """Add the forces of the engine mounts on the engine's three coordinates. Returns their moment on the chassis about
    S."""
    x, y, z, turning = chassis_frame
    c_roll, s_roll, c_pitch, s_pitch = math.cos(q[7]), math.sin(q[7]), math.cos(q[8]), math.sin(q[8])
    lateral_axis = plus(times(y, c_roll), times(z, s_roll))
    vertical_axis = plus(times(z, c_roll), times(y, -s_roll))
    forward_axis, high = (
        plus(times(x, c_pitch), times(vertical_axis, -s_pitch)),
        plus(times(x, s_pitch), times(vertical_axis, c_pitch)),
    )
    joint = plus(times(x, car_parameters[4]), times(z, car_parameters[5] + q[6]))
    turning_wheel = plus(plus(turning, times(x, v[7])), times(lateral_axis, v[8]))
    passing, total, twist = plus(cross(turning, joint), times(z, v[6])), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    moment = 0.0, 0.0, 0.0
    for i in range(3):
        m = row(mount_parameters, MOUNT_NUMBERS, i)
        mount_point = plus(plus(times(x, m[0]), times(y, m[1])), times(z, m[2]))
        arm = plus(plus(times(forward_axis, m[3]), times(lateral_axis, m[4])), times(high, m[5]))
        gap = plus(mount_point, times(plus(joint, arm), -1.0))
        rate = plus(cross(turning, mount_point), times(plus(passing, cross(turning_wheel, arm)), -1.0))
        force = (
            m[12] + m[6] * gap[0] + m[9] * rate[0],
            m[13] + m[7] * gap[1] + m[10] * rate[1],
            m[14] + m[8] * gap[2] + m[11] * rate[2],
        )
        total, twist = plus(total, force), plus(twist, cross(arm, force))
        moment = plus(moment, cross(force, gap))
    forces_out[6] += dot(z, total)
    forces_out[7] += dot(x, twist)
    forces_out[8] += dot(lateral_axis, twist)
    return moment


@lean
def _add_seat_forces(seat_parameters, chassis_frame, q, v, forces_out):
    """Add the spring and damper forces of both seats on the seats' coordinates. Returns their moment on the chassis
    about S."""
    _, _, z, turning = chassis_frame
    moment = 0.0, 0.0, 0.0
    for i in range(2):
        s, k = row(seat_parameters, SEAT_NUMBERS, i), 21 + i
        displacement = times(z, q[k])
        force = s[5] - s[3] * displacement[2] - s[4] * (v[k] * z[2] + cross(turning, displacement)[2])
        forces_out[k] += force * z[2]
        moment = plus(moment, cross(displacement, (0.0, 0.0, force)))
    return moment


def parameter_table(handling_car: Handling) -> np.ndarray:
    """The car's parameters as one array: general ones, then parameters of the wheels, the engine mounts, the seats and
    the grid of the contact patch."""
    car, contact_net, preload_of = handling_car.vehicle, patch_grid(CELLS), handling_car.held.parts
    springs, s, joint = {p.name: p for p in car.springs}, car.body("sway").position, car.body("engine").position
    bars = [number for bar in car.bars for number in (bar.stiffness, preload_of[bar.name], 1.0 / bar.track)]
    head = [
        s[0],
        handling_car.given.drags[0].coefficient / 2.0,
        car.body("body").position[2],
        0.0,
        joint[0] - s[0],
        joint[2],
        *bars,
        len(contact_net.strips[0]),
        contact_net.middle,
    ]

    def stiffness_damping_preload(spring_name: str) -> list[float]:
        return [springs[spring_name].stiffness, springs[spring_name].damping, preload_of[spring_name]]

    wheels = []
    for tyre, corner in zip(car.tyres, CORNER_NAMES, strict=True):
        strut, load, width = springs[corner].axis, handling_car.held.tyres[tyre.name], handling_car.tyres.half_width
        sunk = load / tyre.stiffness
        radius = tyre.point[2] + sunk
        side = next(force.stiffness for force in handling_car.given.side_forces if force.name == tyre.name)
        wheels += [
            *np.subtract(tyre.point, s),
            strut[0],
            strut[2],
            *stiffness_damping_preload(corner),
            *stiffness_damping_preload(f"{corner} bush"),
            load,
            tyre.stiffness,
            tyre.point[2],
            radius,
            width,
            cornering_stiffness_factor(CELLS) * radius * sunk * width / side,
            handling_car.tyres.friction,
        ]
    mounts = [
        np.r_[
            np.subtract(springs[f"{name} mount.x"].first_point, s),
            np.subtract(springs[f"{name} mount.x"].first_point, joint),
            np.array([stiffness_damping_preload(f"{name} mount.{axis}") for axis in "xyz"]).T.ravel(),
        ]
        for name in ("left", "right", "rear")
    ]
    seats = [
        [*np.subtract(springs[name].first_point, s), *stiffness_damping_preload(name)]
        for name in ("left seat", "right seat")
    ]
    return np.concatenate(
        [head, wheels, np.ravel(mounts), np.ravel(seats), contact_net.cells.ravel(), contact_net.strips.ravel()]
    )


def model_of(handling_car: Handling, time_step: float) -> mujoco.MjModel:
    """The car's model in MuJoCo, with the parameter table in its numeric data. Inertias are set after the XML is
    compiled."""
    car, table = handling_car.vehicle, parameter_table(handling_car)
    chassis = car.body("body")
    bodies = "".join(
        BODY_TEXT.format(
            name=name,
            joints="".join(JOINT_TEXTS[kind] for kind in kinds),
            mass=car.body(name).mass + ROTOR_MASS * (kinds == WHEELED_FREEDOMS),
            pos=_text(np.subtract(car.body(name).position, chassis.position)),
        )
        for name, kinds in BODIES_ON_CHASSIS.items()
    )
    inertias, axes = principal_inertias(chassis)
    built = mujoco.MjModel.from_xml_string(
        MJCF.format(
            step=repr(time_step),
            gravity=_text(handling_car.gravity),
            size=table.size,
            bodies=bodies,
            pos=_text(chassis.position),
            mass=chassis.mass,
            axes=_text(axes),
            height=-chassis.position[2],
            x=-chassis.position[0],
        )
    )
    built.body_inertia[1] = inertias
    for name, kinds in BODIES_ON_CHASSIS.items():
        spin = (
            [0.0, handling_car.tyres.spin_inertia, 0.0]
            if kinds == WHEELED_FREEDOMS
            else np.diagonal(car.body(name).inertia)
        )
        built.body_inertia[built.body(name).id] = spin
    mujoco.mj_setConst(built, mujoco.MjData(built))
    built.numeric_data[:] = table
    return built


def run(
    handling_car: Handling, q: np.ndarray, v: np.ndarray, time_step: float, step_count: int
) -> Callable[[], np.ndarray]:
    """Returns a function that simulates the car from coordinates q and rates v (23,) in MuJoCo; it returns states
    (step_count + 1, 46)."""
    built = model_of(handling_car, time_step)
    data, state, callback = mujoco.MjData(built), np.concatenate(([0.0], q, v)), kernel_law(add_car_forces)

    def run_car() -> np.ndarray:
        with installed_callback(callback):
            path, _ = rollout.rollout(built, data, state[None, :], nstep=step_count)
        return np.vstack([state[1:], path[0, :, 1 : 1 + 2 * COORDINATE_COUNT]])

    return run_car


def _text(values: Any) -> str:
    return " ".join(repr(float(number)) for number in values)


CORNER_NAMES = ("front left", "front right", "rear left", "rear right")
WHEELED_FREEDOMS = "xzP"
BODIES_ON_CHASSIS = {
    "engine": "zRP",
    **dict.fromkeys(("fl", "fr", "rl", "rr"), WHEELED_FREEDOMS),
    "left seat": "z",
    "right seat": "z",
}
"""Body on the chassis -> its joints: x, z translations; R, P rotations in roll and pitch."""
JOINT_TEXTS = {
    "x": '<joint type="slide" axis="1 0 0"/>',
    "z": '<joint type="slide" axis="0 0 1"/>',
    "R": '<joint type="hinge" axis="1 0 0"/>',
    "P": '<joint type="hinge" axis="0 1 0"/>',
}
BODY_TEXT = """
      <body name="{name}" pos="{pos}">
        {joints}
        <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
      </body>"""
MJCF = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" gravity="{gravity}" integrator="RK4">
    <flag autoreset="disable" contact="disable" constraint="disable"/>
  </option>
  <custom>
    <numeric name="car" size="{size}" data="0"/>
  </custom>
  <worldbody>
    <body pos="{pos}">
      <inertial pos="0 0 0" mass="{mass!r}" quat="{axes}" diaginertia="1 1 1"/>
      <joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1" pos="{x!r} 0 0"/>
      <joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="1 0 0" pos="0 0 {height!r}"/>
      <joint type="hinge" axis="0 1 0" pos="0 0 {height!r}"/>{bodies}
    </body>
  </worldbody>
</mujoco>
"""
