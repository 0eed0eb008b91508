"""Compiled forces of both rails on a wheelset: creepages, normal forces, creep forces and flange forces.

Normal force
    Hertz' theory at the penetration, times 1 + ``contact_damping`` times the speed of approach, and never below zero:
    it begins and ends without a jump and never pulls. The semi-axes are those of the elastic force. The curvature of
    the cone is that in the plane square to its generator; that the generator is a little askew to the rail under yaw
    is left out of the curvatures, and of nothing else. Profiles have several patches on a wheel, each with a
    penetration of its own (``profile_contact``).
Creepage
    Velocity of the wheel relative to the rail by the speed of travel V, or by REGULARISED_SPEED where |V| is less;
    there the forces of rolling forwards and backwards are mixed as V goes from REGULARISED_SPEED to its opposite, so
    that nothing jumps. Both have no power, nor has a mixture of them.
Creep law
    LINEAR (Kalker, without bound) or FASTSIM.
Flange
    Of cones only: beyond its clearance a spring pushes the wheelset back at the wheel's place of contact, without
    friction.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from models.contact.fastsim import FLEXIBILITY_KINDS, MARCH_KINDS
from models.contact.fastsim_grid import count_of_strips, ellipse_grid
from models.contact.fastsim_many import fill_contact_forces
from models.contact.fastsim_records import CONTACT, FORCES, cells_in, strips_in
from models.contact.inputs import Array
from models.contact.linear_theory import coefficient_at, flexibilities_at
from models.core.errors import InputError
from models.machine.compiled import inlined, lean, njit
from models.machine.records import record
from models.machine.stack import array, doubles
from models.rail.contact_point import LEFT, RIGHT, ConicalWheel, cone_on_rail
from models.rail.laid_profiles import empty_profile, laid_profile
from models.rail.profile_contact import TOUCH_RECORD, LaidProfile, WheelPose, normal_force_and_axes, profile_on_rail
from models.rail.wheelset import Wheelset

REGULARISED_SPEED = 0.1
"""Speed of travel (m/s) below which creepage is taken relative to this speed instead."""
LINEAR, FASTSIM = 0, 1
LAW_NUMBERS = {"linear": LINEAR, "fastsim": FASTSIM}
LEAST_CELLS, MOST_CELLS = 3, 200
WHEELS_RECORD = record(
    "radius", "half_gauge", "conicity", "head", "modulus", "shear", "nu", "friction", "damping", "clearance", "flange"
)
"""Numbers of both wheel-rail contacts (SI): those of ``ConicalWheel``; modulus is E*, shear is G, flange is the
stiffness of the flange's spring.
"""
REPORT_RECORD = record(
    "load",
    "fx",
    "fy",
    "mz",
    "xi_x",
    "xi_y",
    "spin",
    "a",
    "b",
    "depth",
    "power",
    "angle",
    "x",
    "y",
    "z",
    "flange_force",
    "elastic_power",
    "damping_power",
)
"""Report of a contact patch: normal force (N), creep forces (N) and moment (N m) on the wheel in the patch's axes,
creepages and spin (1/m), semi-axes (m), penetration (m), power of the creep forces (W), angle of the rail's surface
(rad), position from the wheelset's centre in the track's axes (m), lateral force of a cone's flange (N), powers of the
elastic normal force and flange and of the contact's damping (W)."""
MOTION_RECORD = record("vx", "vy", "aside", "turn", "rate", "elastic", "push", "patch")
"""Motion of a patch in contact: that of ``PatchMotion``, elastic normal force (N), lateral force of a cone's flange
(N), index of the patch."""
WHEELSET_RECORD = np.dtype(
    (np.record, np.dtype([(name, np.float64, (3,)) for name in ("velocity", "turning", "force", "moment")], align=True))
)
"""Motion and resultant of a wheelset in the track's axes: velocity of its centre, the speed of travel included (m/s);
angular velocity, spin about the axle included (rad/s); force (N) and moment about the centre (N m) on it."""
BLENDED_BRISTLES, SECOND_ORDER_MARCH = FLEXIBILITY_KINDS["blended"], MARCH_KINDS["second-order"]


class RailsAndWheels(NamedTuple):
    """Rails under the wheels and their creep law: WHEELS (1,); profiles, without a node for cones; tables of FASTSIM's
    grid (``FastsimGrid``); law : LINEAR or FASTSIM."""

    wheels: Array
    profile: LaidProfile
    strips: Array
    cells: Array
    middle: float
    law: int


class WheelForcesWorkspace(NamedTuple):
    """Arrays for intermediate values, overwritten in every call, because allocating one takes as long as a wheel's
    kinematics.

    wheelset : WHEELSET (1,); touches : TOUCH (patches,); of those in contact, first to last, contacts : CONTACT,
    motion : MOTION, creep forces of one rolling direction, and the creep forces that act : FORCES.
    """

    wheelset: Array
    touches: Array
    contacts: Array
    motion: Array
    directed: Array
    forces: Array


class PatchPoint(NamedTuple):
    """Position of a contact patch: normal into the rail, and coordinates from the wheelset's centre in the track's axes
    (m)."""

    n_y: float
    n_z: float
    x: float
    y: float
    z: float


class PatchMotion(NamedTuple):
    """Motion of a contact patch: sliding velocity along, velocity across the track, sliding velocity across (m/s),
    rotation about the normal (1/s), velocity of approach (m/s)."""

    vx: float
    vy: float
    aside: float
    turn: float
    rate: float


class PatchNormalForce(NamedTuple):
    """Normal contact of a patch: penetration and semi-axes (m); elastic normal force, normal force with damping, and
    lateral force of a cone's flange (N)."""

    depth: float
    a: float
    b: float
    elastic: float
    load: float
    push: float


def rails_of(wheelset: Wheelset, creep_law: str = "linear", cell_count: int = LEAST_CELLS) -> RailsAndWheels:
    """Rails under a wheelset, with FASTSIM's grid for its contact ellipse at rest (see ``fastsim_grid``)."""
    if isinstance(cell_count, bool) or not isinstance(cell_count, int) or not LEAST_CELLS <= cell_count <= MOST_CELLS:
        raise InputError("", "cells", cell_count, f"must be a whole number from {LEAST_CELLS} to {MOST_CELLS}")
    w, pair, ellipse = wheelset, wheelset.material_pair, wheelset.ellipse
    shape = w.radius, w.half_gauge, w.conicity, w.head_radius, pair.modulus, pair.G, pair.nu
    wheels = np.array([(*shape, w.friction, w.contact_damping, w.flange_clearance, w.flange_stiffness)], WHEELS_RECORD)
    profile = laid_profile(w.profiles, w.radius) if w.profiles else empty_profile()
    net = ellipse_grid(cell_count, int(count_of_strips(np.asarray(ellipse.a / ellipse.b), cell_count)), "intermediate")
    laid = LaidProfile(*(values.copy() for values in profile))  # of one type for numba, kept and made at a pointer
    return RailsAndWheels(wheels, laid, net.strips, net.cells, net.middle, LAW_NUMBERS[creep_law])


def plain_rails(rails_and_wheels: RailsAndWheels) -> tuple[Any, ...]:
    """``RailsAndWheels`` as plain tuples, which Python passes to compiled functions faster."""
    return tuple(
        tuple(rail_part) if isinstance(rail_part, LaidProfile) else rail_part for rail_part in rails_and_wheels
    )


@inlined
def rails_from_tuples(plain_tuples):
    """``RailsAndWheels`` made from the plain tuples of ``plain_rails``."""
    wheels, (head, nodes, knots), strips, cells, middle, law = plain_tuples
    return RailsAndWheels(wheels, LaidProfile(head, nodes, knots), strips, cells, middle, law)


@lean
def count_of_patches(profile):
    """Largest number of contacts of both wheels together: one per cone, or one per zone of the profiles."""
    return 2 if profile.nodes.size == 0 else 2 * int(profile.head[0].zones)


@njit(cache=True, error_model="numpy")
def workspace_for(profile):
    """``WheelForcesWorkspace`` for the contacts of a wheelset on these profiles (or cones)."""
    n = count_of_patches(profile)
    return WheelForcesWorkspace(
        np.empty(1, WHEELSET_RECORD),
        np.empty(n, TOUCH_RECORD),
        np.empty(n, CONTACT),
        np.empty(n, MOTION_RECORD),
        np.empty(n, FORCES),
        np.empty(n, FORCES),
    )


@lean
def contact_points(wheelset_pose, rails_and_wheels, zone_touches):
    """Fill the contact patches ``zone_touches``, TOUCH (patches,), the right wheel's first; patches far from contact
    get no normal.
    """
    per_wheel, wheels = len(zone_touches) // 2, rails_and_wheels.wheels[0]
    for k in range(2):
        side, of_side = RIGHT if k == 0 else LEFT, zone_touches[k * per_wheel : (k + 1) * per_wheel]
        if rails_and_wheels.profile.nodes.size > 0:
            profile_on_rail(side, wheelset_pose, rails_and_wheels.profile, wheels.modulus, of_side)
            continue
        cone = ConicalWheel(wheels.radius, wheels.half_gauge, wheels.conicity, wheels.head)
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(side, wheelset_pose, cone)
        touch = of_side[0]
        touch.depth, touch.n_y, touch.n_z, touch.x, touch.y, touch.z = depth, n_y, n_z, cx, cy, cz
        touch.along, touch.across = _longitudinal_curvature(rolling, wheels.conicity), 0.5 / wheels.head


@njit(cache=True, error_model="numpy")
def supported_force(fall, rails_and_wheels):
    """Vertical part (N) of the elastic normal forces, with the wheelset's centre at height z (m) in the middle of the
    track."""
    touches, force_sum = np.zeros(count_of_patches(rails_and_wheels.profile), TOUCH_RECORD), 0.0
    contact_points(WheelPose(0.0, fall, 0.0, 0.0), rails_and_wheels, touches)
    for k in range(len(touches)):
        touch = touches[k]
        force_sum += (
            touch.n_z
            * normal_force_and_axes(touch.depth, touch.along, touch.across, rails_and_wheels.wheels[0].modulus)[0]
        )
    return force_sum


@inlined
def _linear_forces(a, b, creep_motion, shear_modulus, poisson_ratio):
    """Creep forces (N) and moment (N m) of one patch by Kalker's coefficients, for creepages and spin given as
    ``creep_motion``."""
    x, y, spin = creep_motion
    if a <= 0.0:
        a, b, x, y, spin = 1.0, 1.0, 0.0, 0.0, 0.0
    area, ratio = a * b, a / b
    c = array(doubles(4), (4,))
    for kind in range(4):  # a loop, as numba compiles one function for each number that is written out
        c[kind] = coefficient_at(kind, ratio, poisson_ratio)
    turn = area**1.5 * c[2]
    fx = -shear_modulus * area * c[0] * x
    fy = -shear_modulus * (area * c[1] * y + turn * spin)
    return fx, fy, shear_modulus * (turn * y - area**2 * c[3] * spin)


@lean
def _fill_one_direction(direction_sign, patch_contacts, creep_slips, speed, rails_and_wheels, wheel_forces):
    """Fill the creep forces fx, fy, mz for wheels that roll forwards (sign 1), or for mirror images of wheels that roll
    backwards (sign -1)."""
    reference_speed = max(abs(speed), REGULARISED_SPEED)
    for k in range(len(patch_contacts)):
        contact = patch_contacts[k]
        contact.xi_x, contact.xi_y = (
            direction_sign * creep_slips[k].vx / reference_speed,
            creep_slips[k].aside / reference_speed,
        )
        contact.spin = direction_sign * creep_slips[k].turn / reference_speed
    if rails_and_wheels.law == FASTSIM:
        fill_contact_forces(
            patch_contacts,
            strips_in(rails_and_wheels.strips),
            cells_in(rails_and_wheels.cells, rails_and_wheels.middle),
            BLENDED_BRISTLES,
            SECOND_ORDER_MARCH,
            wheel_forces,
        )
    else:
        shear, poisson = rails_and_wheels.wheels[0].shear, rails_and_wheels.wheels[0].nu
        for k in range(len(patch_contacts)):
            c, force = patch_contacts[k], wheel_forces[k]
            force.fx, force.fy, force.mz = _linear_forces(c.a, c.b, (c.xi_x, c.xi_y, c.spin), shear, poisson)


@inlined
def fill_creep_forces(patch_contacts, creep_slips, speed, rails_and_wheels, contact_workspace):
    """Fill the creep forces fx, fy, mz in ``contact_workspace`` for contacts (CONTACT) from their sliding motion
    (MOTION).

    Near standstill they are a mixture of forward and backward rolling. The creepages are written into the contacts; for
    a wheel that rolls backwards those of its mirror image.
    """
    answers, directed = contact_workspace.forces, contact_workspace.directed[: len(patch_contacts)]
    for k in range(len(patch_contacts)):
        contact, answer = patch_contacts[k], answers[k]
        answer.fx = answer.fy = answer.mz = 0.0
        if rails_and_wheels.law == FASTSIM:
            contact.l1, contact.l2, contact.l3 = flexibilities_at(
                contact.a, contact.b, rails_and_wheels.wheels[0].shear, rails_and_wheels.wheels[0].nu
            )
    forwards = min(1.0, max(0.0, 0.5 + 0.5 * speed / REGULARISED_SPEED))
    first, last = 0 if forwards > 0.0 else 1, 1 if forwards < 1.0 else 0
    for way in range(first, last + 1):  # one call for both ways, or callers are compiled with two copies of the law
        sign, share = (1.0, forwards) if way == 0 else (-1.0, 1.0 - forwards)
        _fill_one_direction(sign, patch_contacts, creep_slips, speed, rails_and_wheels, directed)
        for k in range(len(patch_contacts)):
            answers[k].fx += share * sign * directed[k].fx
            answers[k].fy += share * directed[k].fy
            answers[k].mz += share * sign * directed[k].mz


@inlined
def fill_wheel_forces(wheelset_pose, rails_and_wheels, contact_report, contact_workspace):
    """Add the forces and moments of both rails on the wheelset to its resultants.

    wheelset_pose : ``WheelPose``; contact_report : REPORT (patches,), filled, or of no rows where nobody asks;
    contact_workspace : ``WheelForcesWorkspace``, its wheelset given in, all else written over.
    """
    if (
        rails_and_wheels.law == LINEAR
        and rails_and_wheels.profile.nodes.size == 0
        and contact_workspace.wheelset[0].velocity[0] >= REGULARISED_SPEED
    ):
        _fill_linear_forces_of_cones(
            wheelset_pose, rails_and_wheels.wheels[0], contact_workspace.wheelset[0], contact_report
        )
    else:
        fill_forces_patch_by_patch(wheelset_pose, rails_and_wheels, contact_report, contact_workspace)


@lean
def _fill_linear_forces_of_cones(wheelset_pose, wheels, wheelset, contact_report):
    """Add the forces of cones with the linear creep law that roll forwards, as ``fill_forces_patch_by_patch`` does but
    without storing intermediate values.
    """
    cone = ConicalWheel(wheels.radius, wheels.half_gauge, wheels.conicity, wheels.head)  # read once, as what follows
    speed, modulus, shear, poisson = wheelset.velocity[0], wheels.modulus, wheels.shear, wheels.nu
    damping, velocity, turning = wheels.damping, wheelset.velocity, wheelset.turning
    for side in (RIGHT, LEFT):
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(side, wheelset_pose, cone)
        patch_point = PatchPoint(n_y, n_z, cx, cy, cz)
        motion = _patch_motion(patch_point, velocity, turning)
        elastic, a, b = normal_force_and_axes(
            depth, _longitudinal_curvature(rolling, cone.conicity), 0.5 / cone.head, modulus
        )
        slip = motion.vx / speed, motion.aside / speed, motion.turn / speed
        creeping = _linear_forces(a, b, slip, shear, poisson)
        load = elastic * max(0.0, 1.0 + damping * motion.rate)
        press = PatchNormalForce(depth, a, b, elastic, load, _flange_force(side, wheelset_pose.y, wheels))
        _add_patch_forces(patch_point, press, creeping, wheelset.force, wheelset.moment)
        if len(contact_report) > 0:
            _fill_report(patch_point, motion, press, creeping, speed, contact_report[0 if side == RIGHT else 1])


@lean
def fill_forces_patch_by_patch(wheelset_pose, rails_and_wheels, contact_report, contact_workspace):
    """Add the forces of both rails for all kinds of patches, creep laws and directions of rolling; see
    ``fill_wheel_forces``."""
    touches, wheels, wheelset, n, count = (
        contact_workspace.touches,
        rails_and_wheels.wheels[0],
        contact_workspace.wheelset[0],
        len(contact_workspace.touches),
        0,
    )
    velocity, on_cones = wheelset.velocity, rails_and_wheels.profile.nodes.size == 0
    contact_points(wheelset_pose, rails_and_wheels, touches)
    for k in range(n):
        if touches[k].n_z != 0.0 or touches[k].n_y != 0.0:
            push = _flange_force(RIGHT if 2 * k < n else LEFT, wheelset_pose.y, wheels) if on_cones else 0.0
            _fill_contact(
                touches[k], wheelset, wheels, push, contact_workspace.contacts[count], contact_workspace.motion[count]
            )
            contact_workspace.motion[count].patch, count = k, count + 1
    fill_creep_forces(
        contact_workspace.contacts[:count],
        contact_workspace.motion[:count],
        velocity[0],
        rails_and_wheels,
        contact_workspace,
    )
    for k in range(len(contact_report)):
        _clear_report(contact_report[k])
    for i in range(count):
        contact, m, answer = contact_workspace.contacts[i], contact_workspace.motion[i], contact_workspace.forces[i]
        touch = touches[int(m.patch)]
        press = PatchNormalForce(touch.depth, contact.a, contact.b, m.elastic, contact.load, m.push)
        creeping = answer.fx, answer.fy, answer.mz
        _add_patch_forces(_patch_point_of_touch(touch), press, creeping, wheelset.force, wheelset.moment)
        if len(contact_report) > 0:
            motion = PatchMotion(m.vx, m.vy, m.aside, m.turn, m.rate)
            _fill_report(
                _patch_point_of_touch(touch), motion, press, creeping, velocity[0], contact_report[int(m.patch)]
            )


@inlined
def _longitudinal_curvature(rolling_radius, conicity):
    """Curvature (1/m) of a cone along the track, from its rolling radius and conicity."""
    return 0.5 / (rolling_radius * math.sqrt(1.0 + conicity * conicity))


@inlined
def _flange_force(wheel_side, lateral_position, wheels):
    """Lateral force (N) of a cone's flange at a lateral displacement y (m)."""
    return -wheel_side * wheels.flange * max(0.0, wheel_side * lateral_position - wheels.clearance)


@inlined
def _patch_point_of_touch(zone_touch):
    """``PatchPoint`` of a touching point."""
    return PatchPoint(zone_touch.n_y, zone_touch.n_z, zone_touch.x, zone_touch.y, zone_touch.z)


@inlined
def _patch_motion(patch_point, velocity, angular_velocity):
    """``PatchMotion`` of a patch, from velocity (m/s) and angular velocity (rad/s) of the wheelset."""
    n_y, n_z, cx, cy, cz = patch_point
    vx = velocity[0] + angular_velocity[1] * cz - angular_velocity[2] * cy
    vy = velocity[1] + angular_velocity[2] * cx - angular_velocity[0] * cz
    vz = velocity[2] + angular_velocity[0] * cy - angular_velocity[1] * cx
    return PatchMotion(
        vx, vy, n_z * vy - n_y * vz, angular_velocity[1] * n_y + angular_velocity[2] * n_z, n_y * vy + n_z * vz
    )


@inlined
def _fill_contact(zone_touch, wheelset, wheels, flange_push, patch_contact, patch_motion):
    """Fill the contact of one patch for the creep law and its patch_motion: kinematics and normal force."""
    moving = _patch_motion(_patch_point_of_touch(zone_touch), wheelset.velocity, wheelset.turning)
    elastic, a, b = normal_force_and_axes(zone_touch.depth, zone_touch.along, zone_touch.across, wheels.modulus)
    patch_motion.vx, patch_motion.vy, patch_motion.aside, patch_motion.turn, patch_motion.rate = moving
    patch_motion.elastic, patch_motion.push = elastic, flange_push
    patch_contact.a, patch_contact.b, patch_contact.mu = a, b, wheels.friction
    patch_contact.load = elastic * max(0.0, 1.0 + wheels.damping * moving.rate)


@inlined
def _add_patch_forces(patch_point, normal_force, creep_forces, force, moment):
    """Add the forces of one patch to the wheelset's force and moment."""
    n_y, n_z, cx, cy, cz = patch_point
    fx, fy, mz = creep_forces
    across, force_down = n_z * fy - n_y * normal_force.load + normal_force.push, -n_y * fy - n_z * normal_force.load
    force[0] += fx
    force[1] += across
    force[2] += force_down
    moment[0] += cy * force_down - cz * across
    moment[1] += cz * fx - cx * force_down + n_y * mz
    moment[2] += cx * across - cy * fx + n_z * mz


@lean
def _clear_report(contact_report):
    """Fill the report of a patch without contact with zeros."""
    contact_report.load = contact_report.fx = contact_report.fy = contact_report.mz = contact_report.xi_x = (
        contact_report.xi_y
    ) = contact_report.spin = 0.0
    contact_report.a = contact_report.b = contact_report.depth = contact_report.power = contact_report.angle = (
        contact_report.x
    ) = contact_report.y = contact_report.z = 0.0
    contact_report.flange_force = contact_report.elastic_power = contact_report.damping_power = 0.0


@lean
def _fill_report(patch_point, patch_motion, normal_force, creep_forces, speed, contact_report):
    """Fill the report of a patch from its position, motion, normal contact and creep forces."""
    fx, fy, mz = creep_forces
    vx, vy, side_speed, turn, rate = patch_motion
    contact_report.load, contact_report.fx, contact_report.fy, contact_report.mz = normal_force.load, fx, fy, mz
    reference_speed = max(abs(speed), REGULARISED_SPEED)
    contact_report.xi_x, contact_report.xi_y, contact_report.spin = (
        vx / reference_speed,
        side_speed / reference_speed,
        turn / reference_speed,
    )
    contact_report.a, contact_report.b, contact_report.depth = normal_force.a, normal_force.b, normal_force.depth
    contact_report.angle = math.atan2(-patch_point.n_y, patch_point.n_z)
    contact_report.power = fx * vx + fy * side_speed + mz * turn
    contact_report.x, contact_report.y, contact_report.z, contact_report.flange_force = (
        patch_point.x,
        patch_point.y,
        patch_point.z,
        normal_force.push,
    )
    contact_report.elastic_power = normal_force.push * vy - normal_force.elastic * rate
    contact_report.damping_power = (normal_force.elastic - normal_force.load) * rate
