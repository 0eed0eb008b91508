"""The compiled MuJoCo callback of a spatial vehicle and its table of numbers: forces between points of bodies that may
turn.

MuJoCo's own site actuators are wrong between two turning bodies, so every force is summed here. A point of a body that
never turns is moved by its joints' constant shares. Every other body that counts has a twist, its turning and the
velocity that it gives the origin of space, and gathers a wrench, force and moment about that origin, so that its joints
are gone through twice in a call, however many points it has. All numbers lie in the model's numeric data, as
``packed_numbers`` gives them: the header; the bodies, parents first; the elements; the road. So one compiled function
serves every model in the process, and holds no address that could go stale in numba's cache.
"""

from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import cfunc
from numba.extending import register_jitable

from models.engines.mujoco_callback import CALLBACK
from models.engines.mujoco_layout import offsets
from models.engines.mujoco_tree import AXES, MujocoIndices
from models.machine.stack import array_at, beyond, double_at, doubles
from models.vehicles.spatial import Curve, SpatialVehicle, Vector
from models.vehicles.spatial_linear import static_preloads

PER_TIME, ROWS, TYRES, BODIES, ELEMENTS, POINTS, ROAD, HEADER = range(8)
"""Indices in the table's header: road rows per second; counts of rows, tyres, bodies that may turn or carry such,
elements and points; first number of the road."""
PARENT, NUMBER, FIRST, TURNING, LAST, POINT, BEYOND, PER_BODY = range(8)
"""Numbers of a body: its parent in the table (-1: none), MuJoCo's number, the first joint, the first joint that turns,
the index after the last joint, the first point, the index after the last point."""
ELEMENT, PLACE, AXIS, PER_POINT = 0, 1, 4, 7
"""Numbers of a point: the element to whose travel it contributes, its position (m) on the body, the axis of its
contribution."""
LENGTH, STIFFNESS, DAMPING, HELD, TYRE, REST, ONE_SIDED, MORE, SHARES = range(9)
"""Numbers of an element: their count; stiffness, damping and preload; the tyre whose road enters; the points' travel at
rest; whether it only pushes; the first number of the law's nonlinear terms (0 if none); then its shares."""
JOINT, SHARE, PER_SHARE = range(3)
"""Numbers of a share: a joint, and the factor of its coordinate in the travel."""
FRICTION, FRICTION_RATE, FIRST_COORDINATE, FIRST_GAIN, SECOND_COORDINATE, SECOND_GAIN, ON_TRAVEL, ON_RATE, CURVES = (
    range(9)
)
"""Numbers of the law's nonlinear terms: dry friction, two coordinates (-1: none) that add to the force, numbers of
points of the curves over travel and rate, and these points."""
TURNS, SHIFTS, MOMENTS, FORCES, OF_BODY = 0, 3, 6, 9, 12
"""Results of a body during a call: angular velocity, velocity at the origin of space, moment about the origin,
force."""
TRAVEL, RATE, OF_ELEMENT = range(3)
"""Results of an element during a call: the travel from its points, replaced by its force later, and the rate of
travel."""
OF_POINT = 3
"""Results of a point during a call: the moment about the origin of space of a unit force along its axis."""
UP: Vector = (0.0, 0.0, 1.0)
ActingPoint = tuple[str | None, Vector, Vector]
"""A point at which an element acts: body, point (m) and axis."""


class ForceLayout(NamedTuple):
    """Layout of a vehicle's bodies, points and elements in MuJoCo's numeric data: counts, and pointers to doubles."""

    body_count: int
    bodies: Any
    points: Any
    element_count: int
    elements: Any


class MujocoState(NamedTuple):
    """MuJoCo's kinematic state as pointers to doubles: coordinates and rates of the joints; centre and rotation (rows)
    of each body; anchor and axis in space of each joint."""

    positions: Any
    rates: Any
    centres: Any
    rotations: Any
    anchors: Any
    axes: Any


class CallbackWorkspace(NamedTuple):
    """Pointers to arrays for results within a call. bodies : twist and wrench of each body (OF_BODY); elements : travel
    and rate, then force, of each element (OF_ELEMENT); levers : lever of each point (OF_POINT)."""

    bodies: Any
    elements: Any
    levers: Any


@register_jitable
def _vector_at(pointer, vector_index):
    """The vector (three doubles) at index i of a pointer."""
    return pointer[vector_index], pointer[vector_index + 1], pointer[vector_index + 2]


@register_jitable
def _put_vector(pointer, vector_index, vector):
    """Write the vector ``vector`` (three doubles) to index i of a pointer."""
    pointer[vector_index], pointer[vector_index + 1], pointer[vector_index + 2] = vector


@register_jitable
def _scaled_sum(a, factor, b):
    """The vector a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@register_jitable
def _cross(a, b):
    """The vector product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@register_jitable
def _dot(a, b):
    """The scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@register_jitable
def _compute_twists_and_travels(parts, mujoco_state, workspace):
    """Compute the twists of the bodies, clear their wrenches, and add the contributions of the points to the travels
    and rates of the elements."""
    for b in range(parts.body_count):
        body, state = beyond(parts.bodies, PER_BODY * b), beyond(workspace.bodies, OF_BODY * b)
        turn, shift = _body_twist(body, mujoco_state, workspace.bodies)
        _put_vector(state, TURNS, turn)
        _put_vector(state, SHIFTS, shift)
        _put_vector(state, MOMENTS, (0.0, 0.0, 0.0))
        _put_vector(state, FORCES, (0.0, 0.0, 0.0))
        number = int(body[NUMBER])
        centre, rows = _vector_at(mujoco_state.centres, 3 * number), beyond(mujoco_state.rotations, 9 * number)
        x, y, z = _vector_at(rows, 0), _vector_at(rows, 3), _vector_at(rows, 6)
        for i in range(int(body[POINT]), int(body[BEYOND])):
            point = beyond(parts.points, PER_POINT * i)
            element, axis = beyond(workspace.elements, OF_ELEMENT * int(point[ELEMENT])), _vector_at(point, AXIS)
            at = _vector_at(point, PLACE)
            place = centre[0] + _dot(x, at), centre[1] + _dot(y, at), centre[2] + _dot(z, at)
            lever = _cross(place, axis)
            element[TRAVEL] += _dot(axis, place)
            element[RATE] += _dot(axis, shift) + _dot(turn, lever)
            _put_vector(workspace.levers, OF_POINT * i, lever)


@register_jitable
def _body_twist(body, motion, states):
    """Angular velocity of a body, and the velocity of its point at the origin of space: the parent's twist plus the
    contributions of the body's joints."""
    turn, shift, parent, turning = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), int(body[PARENT]), int(body[TURNING])
    if parent >= 0:
        turn, shift = _vector_at(states, OF_BODY * parent + TURNS), _vector_at(states, OF_BODY * parent + SHIFTS)
    for j in range(int(body[FIRST]), turning):
        shift = _scaled_sum(shift, motion.rates[j], _vector_at(motion.axes, 3 * j))
    for j in range(turning, int(body[LAST])):
        axis, rate = _vector_at(motion.axes, 3 * j), motion.rates[j]
        turn = _scaled_sum(turn, rate, axis)
        shift = _scaled_sum(shift, rate, _cross(_vector_at(motion.anchors, 3 * j), axis))
    return turn, shift


@register_jitable
def _transfer_forces_to_joints(parts, mujoco_state, workspace, joint_forces):
    """Transfer the elements' forces from the bodies to the joints, carried bodies before their carriers."""
    for b in range(parts.body_count - 1, -1, -1):
        body, state = beyond(parts.bodies, PER_BODY * b), beyond(workspace.bodies, OF_BODY * b)
        moment, force, parent = _vector_at(state, MOMENTS), _vector_at(state, FORCES), int(body[PARENT])
        for i in range(int(body[POINT]), int(body[BEYOND])):
            point = beyond(parts.points, PER_POINT * i)
            pressed = -workspace.elements[OF_ELEMENT * int(point[ELEMENT])]
            moment = _scaled_sum(moment, pressed, _vector_at(workspace.levers, OF_POINT * i))
            force = _scaled_sum(force, pressed, _vector_at(point, AXIS))
        turning = int(body[TURNING])
        for j in range(int(body[FIRST]), turning):
            joint_forces[j] += _dot(_vector_at(mujoco_state.axes, 3 * j), force)
        for j in range(turning, int(body[LAST])):
            about = _scaled_sum(moment, -1.0, _cross(_vector_at(mujoco_state.anchors, 3 * j), force))
            joint_forces[j] += _dot(_vector_at(mujoco_state.axes, 3 * j), about)
        if parent >= 0:
            below = beyond(workspace.bodies, OF_BODY * parent)
            _put_vector(below, MOMENTS, _scaled_sum(moment, 1.0, _vector_at(below, MOMENTS)))
            _put_vector(below, FORCES, _scaled_sum(force, 1.0, _vector_at(below, FORCES)))


@register_jitable
def _curve_force(pairs, number_count, argument):
    """Force on a curve given as pairs (argument, force, ...); beyond its ends the outer straight pieces continue."""
    i = 0
    while i < number_count - 4 and argument >= pairs[i + 2]:
        i += 2
    return pairs[i + 1] + (pairs[i + 3] - pairs[i + 1]) / (pairs[i + 2] - pairs[i]) * (argument - pairs[i])


@register_jitable
def _nonlinear_force(force_law, travel, rate, q):
    """Nonlinear terms of an element's force law (N, or N m) at a travel, its rate and the joint coordinates q: the
    force less that of the law's straight line."""
    force = 0.0
    if force_law[FRICTION] != 0.0:
        force += force_law[FRICTION] * np.tanh(rate / force_law[FRICTION_RATE])
    if force_law[FIRST_COORDINATE] >= 0.0:
        force += force_law[FIRST_GAIN] * q[int(force_law[FIRST_COORDINATE])]
    if force_law[SECOND_COORDINATE] >= 0.0:
        force += force_law[SECOND_GAIN] * q[int(force_law[SECOND_COORDINATE])]
    over_travel, over_rate = 2 * int(force_law[ON_TRAVEL]), 2 * int(force_law[ON_RATE])
    if over_travel > 0:
        force += _curve_force(beyond(force_law, CURVES), over_travel, travel)
    if over_rate > 0:
        force += _curve_force(beyond(force_law, CURVES + over_travel), over_rate, rate)
    return force


@register_jitable
def _add_element_forces(parts, road_row, tyre_count, mujoco_state, element_travels, joint_forces):
    """Compute the forces of the elements, store them in place of the travels, and add them to the joints that move
    points of bodies which never turn.

    road_row : pointer to the heights (m) under ``tyre_count`` tyres, followed by their rates (m/s).
    """
    e, q, v = parts.elements, mujoco_state.positions, mujoco_state.rates
    for i in range(parts.element_count):
        travel, rate = element_travels[OF_ELEMENT * i] - e[REST], element_travels[OF_ELEMENT * i + RATE]
        length, more = int(e[LENGTH]), int(e[MORE])
        shares = more if more > 0 else length
        for k in range(SHARES, shares, PER_SHARE):
            travel += e[k + SHARE] * q[int(e[k])]
            rate += e[k + SHARE] * v[int(e[k])]
        if e[TYRE] >= 0.0:
            travel -= road_row[int(e[TYRE])]
            rate -= road_row[tyre_count + int(e[TYRE])]
        elastic = e[HELD] + e[STIFFNESS] * travel
        force = elastic + e[DAMPING] * rate
        if e[ONE_SIDED] != 0.0:
            force = min(max(force, 2.0 * elastic), 0.0)
        if more > 0:
            force += _nonlinear_force(beyond(e, more), travel, rate, q)
        for k in range(SHARES, shares, PER_SHARE):
            joint_forces[int(e[k])] -= force * e[k + SHARE]
        element_travels[OF_ELEMENT * i] = force
        e = beyond(e, length)


@cache
def spatial_law() -> Any:
    """The compiled MuJoCo callback of a spatial vehicle, compiled at the first request."""
    numeric, passive, time, position, velocity, xpos, xmat, xanchor, xaxis = offsets(
        "numeric_data", "qfrc_passive", "time", "qpos", "qvel", "xpos", "xmat", "xanchor", "xaxis"
    )

    @cfunc(CALLBACK, cache=True, error_model="numpy")
    def law(model, data):
        numbers = array_at(model, numeric)
        count, elements, tyres = int(numbers[BODIES]), int(numbers[ELEMENTS]), int(numbers[TYRES])
        row = int(np.rint(double_at(data, time)[0] * numbers[PER_TIME]))
        road = beyond(numbers, int(numbers[ROAD]) + 2 * tyres * min(max(row, 0), int(numbers[ROWS]) - 1))
        bodies = beyond(numbers, HEADER)
        points = beyond(bodies, PER_BODY * count)
        parts = ForceLayout(count, bodies, points, elements, beyond(points, PER_POINT * int(numbers[POINTS])))
        work = CallbackWorkspace(
            doubles(OF_BODY * count), doubles(OF_ELEMENT * elements), doubles(OF_POINT * int(numbers[POINTS]))
        )
        for i in range(OF_ELEMENT * elements):
            work.elements[i] = 0.0
        motion = MujocoState(
            array_at(data, position),
            array_at(data, velocity),
            array_at(data, xpos),
            array_at(data, xmat),
            array_at(data, xanchor),
            array_at(data, xaxis),
        )
        forces = array_at(data, passive)
        _compute_twists_and_travels(parts, motion, work)
        _add_element_forces(parts, road, tyres, motion, work.elements, forces)
        _transfer_forces_to_joints(parts, motion, work, forces)

    return law


@dataclass(frozen=True)
class ForceElement:
    """A force F along a travel s = added coordinate + sum of axis . point - value at rest, less the road's height under
    its tyre.

    F = held + stiffness s + damping s' + curves + friction + sum of gain * coordinate (``steered``): what acts on
    every coordinate q is -F ds/dq. A tyre that only pushes is ``one_sided``: F is negative where it does.
    """

    points: tuple[ActingPoint, ...]
    stiffness: float = 0.0
    damping: float = 0.0
    held: float = 0.0
    friction: tuple[float, float] = (0.0, 1.0)
    tyre: int = -1
    added_coordinate: tuple[str, str] | None = None
    steered: tuple[tuple[tuple[str, str], float], ...] = ()
    on_travel: Curve | None = None
    on_rate: Curve | None = None
    one_sided: bool = False


def force_elements(vehicle: SpatialVehicle, speed: float | None) -> list[ForceElement]:
    """All force elements of a vehicle: springs, anti-roll bars, tyres, side forces and drags."""
    held, v, acting = static_preloads(vehicle), float(speed or 0.0), list[ForceElement]()
    for s in vehicle.springs:
        points = ((s.second_body, s.second_point, s.axis), (s.first_body, s.first_point, _scaled(s.axis, -1.0)))
        law = (s.stiffness, s.damping, held.parts[s.name], (s.friction, s.friction_rate))
        acting.append(ForceElement(points, *law, on_travel=s.travel_force, on_rate=s.rate_force))
    for bar in vehicle.bars:
        down, up = (_scaled(UP, sign / bar.track) for sign in (-1.0, 1.0))
        points = ((bar.left, bar.point_left, down), (bar.right, bar.point_right, up))
        acting.append(
            ForceElement(points, bar.stiffness, bar.damping, held.parts[bar.name], added_coordinate=(bar.body, "rx"))
        )
    for i, tyre in enumerate(vehicle.tyres):
        gains = (tyre.stiffness, tyre.damping, -held.tyres[tyre.name])
        acting.append(ForceElement(((tyre.body, tyre.point, UP),), *gains, tyre=i, one_sided=tyre.pushes_only))
    for f in vehicle.side_forces:
        steered = (((f.chassis, "rx"), -f.stiffness * f.roll_steer), ((f.chassis, "rz"), -f.stiffness))
        acting.append(ForceElement(((f.body, f.point, (0.0, 1.0, 0.0)),), damping=f.stiffness / v, steered=steered))
    for drag in vehicle.drags:
        centre = vehicle.body(drag.body).position
        acting.append(ForceElement(((drag.body, centre, (1.0, 0.0, 0.0)),), damping=drag.coefficient * v))
    return acting


def _scaled(axis: Vector, factor: float) -> Vector:
    """The axis times a factor."""
    return (factor * axis[0], factor * axis[1], factor * axis[2])


def packed_numbers(
    vehicle: SpatialVehicle, elements: list[ForceElement], mujoco_model: mujoco.MjModel, mujoco_indices: MujocoIndices
) -> tuple[tuple[int, int, int], list[float]]:
    """Counts of bodies, elements and points, and the list of all their numbers in the callback's table."""
    carrying = {name for body in vehicle.bodies if vehicle.turns(body.name) for name in vehicle.chain(body.name)}
    moving = [body.name for body in vehicle.bodies if body.name in carrying]
    bodies, points = list[list[float]](), list[list[float]]()
    for name in moving:
        before = len(points)
        points += _points_of(elements, vehicle, name)
        bodies.append([*_body_numbers(vehicle, name, moving, mujoco_model, mujoco_indices), before, len(points)])
    laws = [_element_numbers(element, vehicle, mujoco_indices) for element in elements]
    return (len(bodies), len(laws), len(points)), [float(value) for value in chain(*bodies, *points, *laws)]


def _body_numbers(
    vehicle: SpatialVehicle, body_name: str, bodies: list[str], mujoco_model: mujoco.MjModel, indices: MujocoIndices
) -> list[float]:
    """Numbers, in the callback's table, of a body that may turn, or that carries one that may."""
    body, number = vehicle.body(body_name), indices.bodies[body_name]
    first, count = max(int(mujoco_model.body_jntadr[number]), 0), len(body.freedoms)
    sliding = sum(not freedom.startswith("r") for freedom in body.freedoms)
    parent = bodies.index(body.parent) if body.parent else -1
    return [parent, number, first, first + sliding, first + count]


def _points_of(elements: list[ForceElement], vehicle: SpatialVehicle, body_name: str) -> list[list[float]]:
    """Numbers, in the callback's table, of the points at which elements act on a body that may turn."""
    centre = vehicle.body(body_name).position
    return [
        [i, *np.subtract(point, centre), *axis]
        for i, element in enumerate(elements)
        for body, point, axis in element.points
        if body == body_name and vehicle.turns(body_name)
    ]


def _element_numbers(element: ForceElement, vehicle: SpatialVehicle, mujoco_indices: MujocoIndices) -> list[float]:
    """Numbers of an element in the callback's table: its linear law, the factors of coordinates in its travel, and the
    nonlinear terms of its law."""
    shares, rest = dict[int, float](), 0.0
    if element.added_coordinate in mujoco_indices.joints:
        shares[mujoco_indices.joints[element.added_coordinate]] = 1.0
    for name, point, axis in element.points:
        if vehicle.turns(name):
            rest += float(np.dot(point, axis))
            continue
        for place in ((body, freedom) for body in vehicle.chain(name) for freedom in vehicle.body(body).freedoms):
            joint = mujoco_indices.joints[place]
            shares[joint] = shares.get(joint, 0.0) + float(np.dot(axis, AXES[place[1]]))
    flat = [value for pair in shares.items() if pair[1] for value in pair]
    more = _nonlinear_numbers(element, mujoco_indices)
    law = [element.stiffness, element.damping, element.held, element.tyre, rest, element.one_sided]
    begins = SHARES + len(flat)
    return [begins + len(more), *law, begins if more else 0, *flat, *more]


def _nonlinear_numbers(element: ForceElement, mujoco_indices: MujocoIndices) -> list[float]:
    """Numbers of the nonlinear terms of an element's law in the callback's table; none where the law is linear."""
    steered = [value for place, gain in element.steered for value in (mujoco_indices.joints.get(place, -1), gain)]
    curves = [element.on_travel, element.on_rate]
    if not (element.friction[0] or steered or any(curves)):
        return []
    tables = [list(zip(curve.arguments, curve.forces, strict=True)) if curve else [] for curve in curves]
    return [*element.friction, *(steered or [-1, 0.0, -1, 0.0]), *map(len, tables), *chain(*chain(*tables))]
