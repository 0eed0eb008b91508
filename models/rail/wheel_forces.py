"""Compiled forces of both rails on a wheelset: kinematics to creepages, normal force, creep forces, flanges.

Normal force
    Hertz' theory at the penetration, times 1 + ``contact_damping`` times the speed of approach, and never below zero:
    it begins and ends without a jump and never pulls. The semi-axes are those of the elastic force. The curvature of
    the cone is that in the plane square to its generator; that the generator is a little askew to the rail under yaw
    is left out of the curvatures, and of nothing else. Profiles have several patches on a wheel, each with a
    penetration of its own (``profile_contact``).
Creepage
    Velocity of the wheel relative to the rail by the speed of travel V, or by REGULAR where |V| is less; there the
    forces of rolling forwards and backwards are mixed as V goes from REGULAR to -REGULAR, so that nothing jumps.
    Both have no power, nor has a mixture of them.
Creep law
    LINEAR (Kalker, without bound) or FASTSIM.
Flange
    Of cones only: beyond its clearance a spring pushes the wheelset back at the wheel's place of contact, without
    friction.
"""

import math
from typing import NamedTuple

import numpy as np

from models.contact.fastsim import KINDS, MARCHES
from models.contact.fastsim_grid import grid, strips_of
from models.contact.fastsim_many import forces
from models.contact.fastsim_records import CONTACT, FORCES, cells_in, strips_in
from models.contact.inputs import Array
from models.contact.linear_theory import coefficient_at, flexibilities_at
from models.core.errors import InputError
from models.machine.compiled import inlined, lean, njit
from models.rail.contact_point import LEFT, RIGHT, cone_on_rail
from models.rail.laid_profiles import profile_numbers
from models.rail.profile_contact import ACROSS, ALONG, N_Y, N_Z, TOUCH, X_, Y_, Z_, ZONES, pressed, profile_on_rail
from models.rail.profile_contact import DEPTH as DEEP
from models.rail.wheelset import Wheelset

REGULAR = 0.1
"""Speed (m/s) below which creepage is no longer relative to the speed of travel."""
LINEAR, FASTSIM = 0, 1
LAWS = {"linear": LINEAR, "fastsim": FASTSIM}
RADIUS, HALF_GAUGE, CONICITY, HEAD, MODULUS, SHEAR, POISSON, FRICTION, DAMPING, CLEARANCE, FLANGE, NUMBERS = range(12)
"""Numbers of the contact, as ``numbers`` gives them (SI): modulus is E*, flange its spring's stiffness; then those of
the profiles, if the wheelset has some."""
(
    LOAD,
    FX,
    FY,
    MZ,
    XI_1,
    XI_2,
    XI_3,
    A,
    B,
    DEPTH,
    POWER,
    ANGLE,
    PLACE_X,
    PLACE_Y,
    PLACE_Z,
    FLANGE_FORCE,
    ELASTIC_POWER,
    DAMPING_POWER,
    REPORTED,
) = range(19)
"""Columns of what a patch reports: normal force, creep forces and moment on the wheel in its own axes, creepages and
spin, semi-axes, penetration, power of the creep forces (W), angle of the rail's surface (rad), place from the
wheelset's centre in the track's axes (m), lateral force of a cone's flange (N), powers of the elastic normal force and
flange and of the contact's damping (W)."""
VX, ASIDE, TURN, RATE, VY, ELASTIC, PUSH, PATCH, MOVED = range(9)
"""Columns of a patch's motion: slip along, across (m/s) and about the normal (1/s); speed of approach and velocity
across the track (m/s), elastic normal force (N), lateral force of a cone's flange (N), number of the patch."""
BLEND, ORDER = KINDS["blended"], MARCHES["second-order"]


class Rails(NamedTuple):
    """What wheels roll on, and by which law: ``numbers`` of the contact; strips, cells and middle of FASTSIM's ``net``;
    law : LINEAR or FASTSIM."""

    numbers: Array
    strips: Array
    cells: Array
    middle: float
    law: int


class Room(NamedTuple):
    """Arrays that are written over in every call: to make one costs as much as a wheel's kinematics.

    vectors (4, 3): of ``equations.set_rates``; of ``wheel_forces``: touches (patches, TOUCH), and of those in contact,
    first to last, contacts (CONTACT), motion (patches, MOVED), creep forces found (FORCES) and other ones.
    """

    vectors: Array
    touches: Array
    contacts: Array
    motion: Array
    other: Array
    found: Array


class Place(NamedTuple):
    """Normal into the rail, and place from the wheelset's centre in the track's axes (m)."""

    n_y: float
    n_z: float
    x: float
    y: float
    z: float


class Motion(NamedTuple):
    """Of a patch: slip along, velocity across the track, slip across (m/s), turning about the normal (1/s), speed of
    approach (m/s)."""

    vx: float
    vy: float
    aside: float
    turn: float
    rate: float


class Pressed(NamedTuple):
    """Penetration and semi-axes of a patch (m); elastic normal force, the same with damping, and lateral force of a
    cone's flange (N)."""

    depth: float
    a: float
    b: float
    elastic: float
    load: float
    push: float


def numbers(wheelset: Wheelset) -> Array:
    """The contact's numbers, in the order above: (11,), or more for profiles."""
    w, pair = wheelset, wheelset.pair
    shape = [w.radius, w.half_gauge, w.conicity, w.head_radius, pair.modulus, pair.G, pair.nu]
    forces = [w.friction, w.contact_damping, w.flange_clearance, w.flange_stiffness]
    return np.concatenate((shape, forces, profile_numbers(w.profiles, w.radius) if w.profiles else []))


def rails_of(wheelset: Wheelset, law: str, cells: int) -> Rails:
    """The rails under a wheelset, with FASTSIM's net for its ellipse at rest (see ``fastsim_grid``)."""
    if isinstance(cells, bool) or not isinstance(cells, int) or not 3 <= cells <= 200:
        raise InputError("", "cells", cells, "must be a whole number from 3 to 200")
    ellipse = wheelset.ellipse
    net = grid(cells, int(strips_of(np.asarray(ellipse.a / ellipse.b), cells)), "intermediate")
    return Rails(numbers(wheelset), net.strips, net.cells, net.middle, LAWS[law])


@lean
def patches(p):
    """How many contacts both wheels together can have: one each of cones, one for each zone of profiles."""
    return 2 if p.size == NUMBERS else 2 * int(p[NUMBERS + ZONES])


@njit(cache=True, error_model="numpy")
def room_for(p):
    """``Room`` for the contacts of these numbers."""
    n = patches(p)
    return Room(
        np.empty((4, 3)),
        np.empty((n, TOUCH)),
        np.empty(n, CONTACT),
        np.empty((n, MOVED)),
        np.empty(n, FORCES),
        np.empty(n, FORCES),
    )


@inlined
def contact_points(y, z, roll, yaw, p, touches):
    """Fill ``touches`` (patches, TOUCH), the right wheel's first; without a normal where nothing is near."""
    each = len(touches) // 2
    for k in range(2):
        side, wheel = RIGHT if k == 0 else LEFT, touches[k * each : (k + 1) * each]
        if p.size > NUMBERS:
            profile_on_rail(side, y, z, roll, yaw, p[NUMBERS:], p[MODULUS], wheel)
            continue
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(
            side, y, z, roll, yaw, p[RADIUS], p[HALF_GAUGE], p[CONICITY], p[HEAD]
        )
        touch = wheel[0]
        touch[DEEP], touch[N_Y], touch[N_Z], touch[X_], touch[Y_], touch[Z_] = depth, n_y, n_z, cx, cy, cz
        touch[ALONG], touch[ACROSS] = _along(rolling, p[CONICITY]), 0.5 / p[HEAD]


@njit(cache=True, error_model="numpy")
def carries(z, p):
    """Vertical part (N) of the elastic normal forces with the wheelset's centre at a height z (m) over the middle."""
    touches, whole = np.zeros((patches(p), TOUCH)), 0.0
    contact_points(0.0, z, 0.0, 0.0, p, touches)
    for touch in touches:
        whole += touch[N_Z] * pressed(touch[DEEP], touch[ALONG], touch[ACROSS], p[MODULUS])[0]
    return whole


@inlined
def _linear(a, b, x, y, spin, shear, poisson):
    """Creep forces and moment of one patch by Kalker's coefficients."""
    if a <= 0.0:
        a, b, x, y, spin = 1.0, 1.0, 0.0, 0.0, 0.0
    area, ratio = a * b, a / b
    turn = area**1.5 * coefficient_at(2, ratio, poisson)
    fx = -shear * area * coefficient_at(0, ratio, poisson) * x
    fy = -shear * (area * coefficient_at(1, ratio, poisson) * y + turn * spin)
    return fx, fy, shear * (turn * y - area**2 * coefficient_at(3, ratio, poisson) * spin)


@inlined
def _one_way(sign, contacts, slip, speed, rails, found):
    """Fill fx, fy, mz of wheels that roll forwards (sign 1), or of the mirror image of those that roll backwards."""
    by = max(abs(speed), REGULAR)
    for k in range(len(contacts)):
        contact = contacts[k]
        contact.xi_x, contact.xi_y = sign * slip[k, VX] / by, slip[k, ASIDE] / by
        contact.spin = sign * slip[k, TURN] / by
    if rails.law == FASTSIM:
        forces(contacts, strips_in(rails.strips), cells_in(rails.cells, rails.middle), BLEND, ORDER, found)
    else:
        shear, poisson = rails.numbers[SHEAR], rails.numbers[POISSON]
        for k in range(len(contacts)):
            c, force = contacts[k], found[k]
            force.fx, force.fy, force.mz = _linear(c.a, c.b, c.xi_x, c.xi_y, c.spin, shear, poisson)


@lean
def _both_ways(forwards, contacts, slip, speed, rails, some, found):
    """Fill fx, fy, mz of wheels that roll forwards by a share, with ``some`` as room."""
    for k in range(len(contacts)):
        found[k].fx = found[k].fy = found[k].mz = 0.0
    for sign in (1.0, -1.0):
        share = forwards if sign > 0.0 else 1.0 - forwards
        if share > 0.0:
            _one_way(sign, contacts, slip, speed, rails, some)
            for k in range(len(contacts)):
                found[k].fx += share * sign * some[k].fx
                found[k].fy += share * some[k].fy
                found[k].mz += share * sign * some[k].mz


@inlined
def creep(contacts, slip, speed, rails, some, found):
    """Fill fx, fy, mz of contacts (CONTACT) from their slip, the first columns of their motion (n, MOVED).

    The creepages are written into the contacts; for a wheel that rolls backwards those of its mirror image. ``some``,
    FORCES as ``found``, is written over.
    """
    if rails.law == FASTSIM:
        shear, poisson = rails.numbers[SHEAR], rails.numbers[POISSON]
        for k in range(len(contacts)):
            c = contacts[k]
            c.l1, c.l2, c.l3 = flexibilities_at(c.a, c.b, shear, poisson)
    if speed >= REGULAR:
        _one_way(1.0, contacts, slip, speed, rails, found)
    else:
        _both_ways(max(0.0, 0.5 + 0.5 * speed / REGULAR), contacts, slip, speed, rails, some, found)


@inlined
def wheel_forces(y, z, roll, yaw, velocity, turning, rails, force, moment, report, room):
    """Add what both rails do to the wheelset to ``force`` and ``moment`` (3,), about its centre, in the track's axes.

    y, z : of the wheelset's centre (m), roll, yaw : rad; velocity (3,) : of the centre in the track, the speed of
    travel first (m/s); turning (3,) : angular velocity, spin about the axle included, in the track's axes (rad/s);
    report (patches, REPORTED) is filled, or has no rows where nobody asks; room : written over.
    """
    if rails.law == LINEAR and rails.numbers.size == NUMBERS and velocity[0] >= REGULAR:
        _linear_cones(y, z, roll, yaw, velocity, turning, rails.numbers, force, moment, report)
    else:
        patch_by_patch(y, z, roll, yaw, velocity, turning, rails, force, moment, report, room)


@inlined
def _linear_cones(y, z, roll, yaw, velocity, turning, p, force, moment, report):
    """``patch_by_patch`` of cones with the linear law, rolling forwards: nothing is written down in between."""
    speed, radius, gauge, cone, head = velocity[0], p[RADIUS], p[HALF_GAUGE], p[CONICITY], p[HEAD]  # read once
    modulus, shear, poisson, damping = p[MODULUS], p[SHEAR], p[POISSON], p[DAMPING]
    for side in (RIGHT, LEFT):
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(side, y, z, roll, yaw, radius, gauge, cone, head)
        place = Place(n_y, n_z, cx, cy, cz)
        motion = _moving(place, velocity, turning)
        elastic, a, b = pressed(depth, _along(rolling, cone), 0.5 / head, modulus)
        creeping = _linear(a, b, motion.vx / speed, motion.aside / speed, motion.turn / speed, shear, poisson)
        load = elastic * max(0.0, 1.0 + damping * motion.rate)
        press = Pressed(depth, a, b, elastic, load, _flange(side, y, p))
        _act(place, press, creeping, force, moment)
        if len(report) > 0:
            _tell(place, motion, press, creeping, speed, report[0 if side == RIGHT else 1])


@lean
def patch_by_patch(y, z, roll, yaw, velocity, turning, rails, force, moment, report, room):
    """``wheel_forces`` of all patches, laws and directions."""
    touches, contacts, motions, n, some = room.touches, room.contacts, room.motion, len(room.touches), 0
    p = rails.numbers
    contact_points(y, z, roll, yaw, p, touches)
    for k in range(n):
        if touches[k, N_Z] != 0.0 or touches[k, N_Y] != 0.0:
            push = _flange(RIGHT if 2 * k < n else LEFT, y, p) if p.size == NUMBERS else 0.0
            _press(touches[k], velocity, turning, p, push, contacts[some], motions[some])
            motions[some, PATCH], some = k, some + 1
    creep(contacts[:some], motions[:some], velocity[0], rails, room.other[:some], room.found[:some])
    report[:] = 0.0
    for i in range(some):
        k, contact, m = int(motions[i, PATCH]), contacts[i], motions[i]
        place, depth = _place(touches[k]), touches[k, DEEP]
        press = Pressed(depth, contact.a, contact.b, m[ELASTIC], contact.load, m[PUSH])
        creeping = room.found[i].fx, room.found[i].fy, room.found[i].mz
        _act(place, press, creeping, force, moment)
        if len(report) > 0:
            motion = Motion(m[VX], m[VY], m[ASIDE], m[TURN], m[RATE])
            _tell(place, motion, press, creeping, velocity[0], report[k])


@inlined
def _along(rolling, conicity):
    """Curvature (1/m) of a cone along the track."""
    return 0.5 / (rolling * math.sqrt(1.0 + conicity * conicity))


@inlined
def _flange(side, y, p):
    """Lateral force (N) of a cone's flange."""
    return -side * p[FLANGE] * max(0.0, side * y - p[CLEARANCE])


@inlined
def _place(touch):
    """``Place`` of a touch (TOUCH,)."""
    return Place(touch[N_Y], touch[N_Z], touch[X_], touch[Y_], touch[Z_])


@inlined
def _moving(place, velocity, turning):
    """``Motion`` of a patch."""
    n_y, n_z, cx, cy, cz = place
    vx = velocity[0] + turning[1] * cz - turning[2] * cy
    vy = velocity[1] + turning[2] * cx - turning[0] * cz
    vz = velocity[2] + turning[0] * cy - turning[1] * cx
    return Motion(vx, vy, n_z * vy - n_y * vz, turning[1] * n_y + turning[2] * n_z, n_y * vy + n_z * vz)


@inlined
def _press(touch, velocity, turning, p, push, contact, motion):
    """Kinematics and normal force of one patch: its contact for the creep law, its motion (MOVED,)."""
    moving = _moving(_place(touch), velocity, turning)
    elastic, a, b = pressed(touch[DEEP], touch[ALONG], touch[ACROSS], p[MODULUS])
    motion[VX], motion[VY], motion[ASIDE], motion[TURN], motion[RATE] = moving
    motion[ELASTIC], motion[PUSH] = elastic, push
    contact.a, contact.b, contact.mu = a, b, p[FRICTION]
    contact.load = elastic * max(0.0, 1.0 + p[DAMPING] * moving.rate)


@inlined
def _act(place, press, creeping, force, moment):
    """Add one patch's forces to force and moment."""
    n_y, n_z, cx, cy, cz = place
    fx, fy, mz = creeping
    across, down = n_z * fy - n_y * press.load + press.push, -n_y * fy - n_z * press.load
    force[0] += fx
    force[1] += across
    force[2] += down
    moment[0] += cy * down - cz * across
    moment[1] += cz * fx - cx * down + n_y * mz
    moment[2] += cx * across - cy * fx + n_z * mz


@lean
def _tell(place, motion, press, creeping, speed, report):
    """Fill one patch's report."""
    fx, fy, mz = creeping
    vx, vy, aside, turn, rate = motion
    report[LOAD], report[FX], report[FY], report[MZ] = press.load, fx, fy, mz
    by = max(abs(speed), REGULAR)
    report[XI_1], report[XI_2], report[XI_3] = vx / by, aside / by, turn / by
    report[A], report[B], report[DEPTH] = press.a, press.b, press.depth
    report[ANGLE] = math.atan2(-place.n_y, place.n_z)
    report[POWER] = fx * vx + fy * aside + mz * turn
    report[PLACE_X], report[PLACE_Y], report[PLACE_Z], report[FLANGE_FORCE] = place.x, place.y, place.z, press.push
    report[ELASTIC_POWER] = press.push * vy - press.elastic * rate
    report[DAMPING_POWER] = (press.elastic - press.load) * rate
