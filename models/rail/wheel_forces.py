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

import numpy as np

from models.compiled import njit
from models.contact.fastsim import KINDS, MARCHES
from models.contact.fastsim_grid import grid, strips_of
from models.contact.fastsim_many import SPIN, XI_X, forces
from models.contact.linear_theory import coefficient_at, flexibilities_at
from models.errors import InputError
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
(LOAD, FX, FY, MZ, XI_1, XI_2, XI_3, A, B, DEPTH, POWER, ANGLE, PLACE_X, PLACE_Y, PLACE_Z, FLANGE_FORCE, ELASTIC_POWER,
 DAMPING_POWER, REPORTED) = range(19)  # fmt: skip
"""Columns of what a patch reports: normal force, creep forces and moment on the wheel in its own axes, creepages and
spin, semi-axes, penetration, power of the creep forces (W), angle of the rail's surface (rad), place from the
wheelset's centre in the track's axes (m), lateral force of a cone's flange (N), powers of the elastic normal force and
flange and of the contact's damping (W)."""
BLEND, ORDER = KINDS["blended"], MARCHES["second-order"]


def numbers(wheelset: Wheelset) -> np.ndarray:
    """The contact's numbers, in the order above: (11,), or more for profiles."""
    w, pair = wheelset, wheelset.pair
    found = [w.radius, w.half_gauge, w.conicity, w.head_radius, pair.modulus, pair.G, pair.nu, w.friction,
             w.contact_damping, w.flange_clearance, w.flange_stiffness]  # fmt: skip
    return np.concatenate((found, profile_numbers(w.profiles, w.radius))) if w.profiles else np.array(found)


def net(wheelset: Wheelset, cells: int = 21) -> tuple[np.ndarray, np.ndarray, float]:
    """FASTSIM's net for the ellipse of the wheelset at rest: strips, cells, middle (see ``fastsim_grid``)."""
    if isinstance(cells, bool) or not isinstance(cells, int) or not 3 <= cells <= 200:
        raise InputError("", "cells", cells, "must be a whole number from 3 to 200")
    ellipse = wheelset.ellipse
    found = grid(cells, int(strips_of(np.asarray(ellipse.a / ellipse.b), cells)), "intermediate")
    return found.strips, found.cells, found.middle


@njit(cache=True, error_model="numpy")
def patches(p):
    """How many contacts both wheels together can have: one each of cones, one for each zone of profiles."""
    return 2 if p.size == NUMBERS else 2 * int(p[NUMBERS + ZONES])


@njit(cache=True, error_model="numpy")
def contact_points(y, z, roll, yaw, p, touches):
    """Fill ``touches`` (patches, TOUCH), the right wheel's first; without a normal where nothing is near."""
    each = len(touches) // 2
    for k in range(2):
        side, own = RIGHT if k == 0 else LEFT, touches[k * each : (k + 1) * each]
        if p.size > NUMBERS:
            profile_on_rail(side, y, z, roll, yaw, p[NUMBERS:], p[MODULUS], own)
            continue
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(side, y, z, roll, yaw, p[RADIUS], p[HALF_GAUGE],
                                                            p[CONICITY], p[HEAD])  # fmt: skip
        touch = own[0]
        touch[DEEP], touch[N_Y], touch[N_Z], touch[X_], touch[Y_], touch[Z_] = depth, n_y, n_z, cx, cy, cz
        touch[ALONG] = 0.5 / (rolling * math.sqrt(1.0 + p[CONICITY] * p[CONICITY]))
        touch[ACROSS] = 0.5 / p[HEAD]


@njit(cache=True, error_model="numpy")
def carried(z, p):
    """Vertical part (N) of the elastic normal forces with the wheelset's centre at a height z (m) over the middle."""
    touches, whole = np.zeros((patches(p), TOUCH)), 0.0
    contact_points(0.0, z, 0.0, 0.0, p, touches)
    for touch in touches:
        whole += touch[N_Z] * pressed(touch[DEEP], touch[ALONG], touch[ACROSS], p[MODULUS])[0]
    return whole


@njit(cache=True, error_model="numpy")
def linear_creep(contacts, p, found):
    """Fill fx, fy, mz by Kalker's coefficients."""
    for k in range(len(contacts)):
        a, b = contacts[k, 0], contacts[k, 1]
        found[k] = 0.0
        if a > 0.0:
            area, x, y, spin = a * b, contacts[k, XI_X], contacts[k, XI_X + 1], contacts[k, SPIN]
            turn = area**1.5 * coefficient_at(2, a / b, p[POISSON])
            found[k, 0] = -p[SHEAR] * area * coefficient_at(0, a / b, p[POISSON]) * x
            found[k, 1] = -p[SHEAR] * (area * coefficient_at(1, a / b, p[POISSON]) * y + turn * spin)
            found[k, 2] = p[SHEAR] * (turn * y - area**2 * coefficient_at(3, a / b, p[POISSON]) * spin)


@njit(cache=True, error_model="numpy")
def creep(contacts, slip, speed, p, strips, cells, middle, law, found):
    """Fill fx, fy, mz of contacts (n, 10) from their slip (n, 3): velocities along x, along y (m/s), turning (1/s).

    The creepages are written into the contacts; for a wheel that rolls backwards those of its mirror image.
    """
    forwards = min(1.0, max(0.0, 0.5 + 0.5 * speed / REGULAR))
    found[:] = 0.0
    some = np.empty((len(contacts), 4))
    if law == FASTSIM:
        for contact in contacts:
            contact[7], contact[8], contact[9] = flexibilities_at(contact[0], contact[1], p[SHEAR], p[POISSON])
    for sign in (1.0, -1.0):
        share = forwards if sign > 0.0 else 1.0 - forwards
        if share == 0.0:
            continue
        for k in range(len(contacts)):
            for i in range(3):
                mirrored = sign if i != 1 else 1.0
                contacts[k, XI_X + i] = mirrored * slip[k, i] / max(abs(speed), REGULAR)
        if law == FASTSIM:
            forces(contacts, strips, cells, middle, BLEND, ORDER, some)
        else:
            linear_creep(contacts, p, some)
        for k in range(len(contacts)):
            found[k, 0] += share * sign * some[k, 0]
            found[k, 1] += share * some[k, 1]
            found[k, 2] += share * sign * some[k, 2]


@njit(cache=True, error_model="numpy")
def wheel_forces(y, z, roll, yaw, velocity, turning, p, strips, cells, middle, law, force, moment, report):
    """Add what both rails do to the wheelset to ``force`` and ``moment`` (3,), about its centre, in the track's axes.

    y, z : of the wheelset's centre (m), roll, yaw : rad; velocity (3,) : of the centre in the track, the speed of
    travel first (m/s); turning (3,) : angular velocity, spin about the axle included, in the track's axes (rad/s);
    p : ``numbers``; strips, cells, middle : ``net``; law : LINEAR or FASTSIM; report (patches, REPORTED) is filled.
    """
    n = patches(p)
    work, some = np.zeros((TOUCH + 18) * n), 0  # one array: to make it costs as much as a wheel's kinematics
    touches, contacts = work[: TOUCH * n].reshape(n, TOUCH), work[TOUCH * n : (TOUCH + 10) * n].reshape(n, 10)
    slip, found = work[(TOUCH + 10) * n : -5 * n].reshape(n, 3), work[-5 * n : -n].reshape(n, 4)
    row = work[-n:]
    contact_points(y, z, roll, yaw, p, touches)
    for k in range(n):
        report[k] = 0.0
        if touches[k, N_Z] == 0.0 and touches[k, N_Y] == 0.0:
            continue
        side = RIGHT if 2 * k < n else LEFT
        if p.size == NUMBERS:
            report[k, FLANGE_FORCE] = -side * p[FLANGE] * max(0.0, side * y - p[CLEARANCE])
        _press(touches[k], velocity, turning, p, contacts[some], slip[some], report[k])
        row[some], some = k, some + 1
    creep(contacts[:some], slip[:some], velocity[0], p, strips, cells, middle, law, found[:some])
    for i in range(some):
        k = int(row[i])
        _act(touches[k], slip[i], found[i], velocity[0], force, moment, report[k])


@njit(cache=True, error_model="numpy")
def _press(touch, velocity, turning, p, contact, slip, report):
    """Kinematics and normal force of one patch: its contact (10,) for the creep law, its slip (3,), its report."""
    n_y, n_z, cx, cy, cz = touch[N_Y], touch[N_Z], touch[X_], touch[Y_], touch[Z_]
    vx = velocity[0] + turning[1] * cz - turning[2] * cy
    vy = velocity[1] + turning[2] * cx - turning[0] * cz
    vz = velocity[2] + turning[0] * cy - turning[1] * cx
    slip[0], slip[1] = vx, n_z * vy - n_y * vz
    slip[2] = turning[1] * n_y + turning[2] * n_z
    rate = n_y * vy + n_z * vz
    elastic, a, b = pressed(touch[DEEP], touch[ALONG], touch[ACROSS], p[MODULUS])
    load = elastic * max(0.0, 1.0 + p[DAMPING] * rate)
    contact[0], contact[1], contact[2], contact[3] = a, b, load, p[FRICTION]
    report[LOAD], report[A], report[B], report[DEPTH] = load, a, b, touch[DEEP]
    report[ANGLE] = math.atan2(-n_y, n_z)
    report[PLACE_X], report[PLACE_Y], report[PLACE_Z] = cx, cy, cz
    report[ELASTIC_POWER] = report[FLANGE_FORCE] * vy - elastic * rate
    report[DAMPING_POWER] = (elastic - load) * rate


@njit(cache=True, error_model="numpy")
def _act(touch, slip, found, speed, force, moment, report):
    """Add one patch's forces to force and moment; the rest of its report."""
    n_y, n_z, cx, cy, cz = touch[N_Y], touch[N_Z], touch[X_], touch[Y_], touch[Z_]
    fx, fy, mz = found[0], found[1], found[2]
    across = n_z * fy - n_y * report[LOAD] + report[FLANGE_FORCE]
    down = -n_y * fy - n_z * report[LOAD]
    force[0] += fx
    force[1] += across
    force[2] += down
    moment[0] += cy * down - cz * across
    moment[1] += cz * fx - cx * down + n_y * mz
    moment[2] += cx * across - cy * fx + n_z * mz
    report[FX], report[FY], report[MZ] = fx, fy, mz
    for i in range(3):
        report[XI_1 + i] = slip[i] / max(abs(speed), REGULAR)
    report[POWER] = fx * slip[0] + fy * slip[1] + mz * slip[2]
