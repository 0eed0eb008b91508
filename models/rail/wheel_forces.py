"""Compiled forces of both rails on a wheelset: kinematics to creepages, normal force, creep forces, flanges.

Normal force
    Hertz' theory at the penetration, times 1 + ``contact_damping`` times the speed of approach, and never below zero:
    it begins and ends without a jump and never pulls. The semi-axes are those of the elastic force. The curvature of
    the cone is that in the plane square to its generator; that the generator is a little askew to the rail under yaw
    is left out of the curvatures, and of nothing else.
Creepage
    Velocity of the wheel relative to the rail by the speed of travel V, or by REGULAR where |V| is less; there the
    forces of rolling forwards and backwards are mixed as V goes from REGULAR to -REGULAR, so that nothing jumps.
    Both have no power, nor has a mixture of them.
Creep law
    LINEAR (Kalker, without bound) or FASTSIM.
Flange
    Beyond its clearance a spring pushes the wheelset back at the wheel's place of contact, without friction.
"""

import math

import numpy as np

from models.compiled import njit
from models.contact.fastsim import KINDS, MARCHES
from models.contact.fastsim_grid import grid, strips_of
from models.contact.fastsim_many import SPIN, XI_X, forces
from models.contact.hertz import aspect
from models.contact.linear_theory import coefficient_at, flexibilities_at
from models.errors import InputError
from models.rail.contact_point import LEFT, RIGHT, cone_on_rail
from models.rail.wheelset import Wheelset

REGULAR = 0.1
"""Speed (m/s) below which creepage is no longer relative to the speed of travel."""
LINEAR, FASTSIM = 0, 1
LAWS = {"linear": LINEAR, "fastsim": FASTSIM}
RADIUS, HALF_GAUGE, CONICITY, HEAD, MODULUS, SHEAR, POISSON, FRICTION, DAMPING, CLEARANCE, FLANGE = range(11)
"""Numbers of the contact, as ``numbers`` gives them (SI): modulus is E*, flange its spring's stiffness."""
LOAD, FX, FY, MZ, XI_1, XI_2, XI_3, A, B, DEPTH, POWER, ANGLE = range(12)
"""Columns of what a wheel's contact reports: normal force, creep forces and moment on the wheel in its own axes,
creepages and spin, semi-axes, penetration, power of the creep forces (W), angle of the rail's surface (rad)."""
REPORTED = 12
BLEND, ORDER = KINDS["blended"], MARCHES["second-order"]


def numbers(wheelset: Wheelset) -> np.ndarray:
    """The contact's numbers (11,), in the order above."""
    w, pair = wheelset, wheelset.pair
    return np.array([w.radius, w.half_gauge, w.conicity, w.head_radius, pair.modulus, pair.G, pair.nu, w.friction,
                     w.contact_damping, w.flange_clearance, w.flange_stiffness])  # fmt: skip


def net(wheelset: Wheelset, cells: int = 21) -> tuple[np.ndarray, np.ndarray, float]:
    """FASTSIM's net for the ellipse of the wheelset at rest: strips, cells, middle (see ``fastsim_grid``)."""
    if isinstance(cells, bool) or not isinstance(cells, int) or not 3 <= cells <= 200:
        raise InputError("", "cells", cells, "must be a whole number from 3 to 200")
    ellipse = wheelset.ellipse
    found = grid(cells, int(strips_of(np.asarray(ellipse.a / ellipse.b), cells)), "intermediate")
    return found.strips, found.cells, found.middle


@njit(cache=True, error_model="numpy")
def normal_contact(penetration, rate, rolling, p):
    """Normal force (N) and semi-axes (m) at a penetration (m) that grows at a rate (m/s); zeros where there is none."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    along = 0.5 / (rolling * math.sqrt(1.0 + p[CONICITY] * p[CONICITY]))
    across = 0.5 / p[HEAD]
    g, cosine, sine = aspect(min(along, across) / max(along, across))
    short = math.sqrt(penetration * cosine / (max(along, across) * (cosine + sine)))
    load = 2.0 / 3.0 * math.pi * p[MODULUS] * penetration * short / (g * (cosine + sine))
    load *= max(0.0, 1.0 + p[DAMPING] * rate)
    if along <= across:
        return load, short / g, short
    return load, short, short / g


@njit(cache=True, error_model="numpy")
def linear_creep(contacts, p, found):
    """Fill fx, fy, mz by Kalker's coefficients."""
    c = np.empty(4)
    for k in range(len(contacts)):
        a, b = contacts[k, 0], contacts[k, 1]
        found[k] = 0.0
        if a > 0.0:
            for kind in range(4):
                c[kind] = coefficient_at(kind, a / b, p[POISSON])
            area, x, y, spin = a * b, contacts[k, XI_X], contacts[k, XI_X + 1], contacts[k, SPIN]
            turn = area**1.5 * c[2]
            found[k, 0] = -p[SHEAR] * area * c[0] * x
            found[k, 1] = -p[SHEAR] * (area * c[1] * y + turn * spin)
            found[k, 2] = p[SHEAR] * (turn * y - area**2 * c[3] * spin)


@njit(cache=True, error_model="numpy")
def creep(contacts, slip, speed, p, strips, cells, middle, law, found):
    """Fill fx, fy, mz of contacts (n, 10) from their slip (n, 3): velocities along x, along y (m/s), turning (1/s).

    The creepages are written into the contacts; for a wheel that rolls backwards those of its mirror image.
    """
    forwards = min(1.0, max(0.0, 0.5 + 0.5 * speed / REGULAR))
    found[:] = 0.0
    some = np.empty((len(contacts), 4))
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
    p : ``numbers``; strips, cells, middle : ``net``; law : LINEAR or FASTSIM; report (2, REPORTED) is filled.
    """
    contacts, slip, found = np.zeros((2, 10)), np.empty((2, 3)), np.empty((2, 4))
    place = np.empty((2, 5))
    for k in range(2):
        side = RIGHT if k == 0 else LEFT
        depth, rolling, n_y, n_z, cx, cy, cz = cone_on_rail(side, y, z, roll, yaw, p[RADIUS], p[HALF_GAUGE],
                                                            p[CONICITY], p[HEAD])  # fmt: skip
        place[k, 0], place[k, 1], place[k, 2], place[k, 3], place[k, 4] = n_y, n_z, cx, cy, cz
        vx = velocity[0] + turning[1] * cz - turning[2] * cy
        vy = velocity[1] + turning[2] * cx - turning[0] * cz
        vz = velocity[2] + turning[0] * cy - turning[1] * cx
        slip[k, 0], slip[k, 1] = vx, n_z * vy - n_y * vz
        slip[k, 2] = turning[1] * n_y + turning[2] * n_z
        load, a, b = normal_contact(depth, n_y * vy + n_z * vz, rolling, p)
        contacts[k, 0], contacts[k, 1], contacts[k, 2], contacts[k, 3] = a, b, load, p[FRICTION]
        l1, l2, l3 = flexibilities_at(a, b, p[SHEAR], p[POISSON])
        contacts[k, 7], contacts[k, 8], contacts[k, 9] = l1, l2, l3
        report[k, LOAD], report[k, A], report[k, B], report[k, DEPTH] = load, a, b, depth
        report[k, ANGLE] = math.atan2(-n_y, n_z)
    creep(contacts, slip, velocity[0], p, strips, cells, middle, law, found)
    for k in range(2):
        fx, fy, mz = found[k, 0], found[k, 1], found[k, 2]
        n_y, n_z, cx, cy, cz = place[k]
        side = RIGHT if k == 0 else LEFT
        flange = -side * p[FLANGE] * max(0.0, side * y - p[CLEARANCE])
        across = n_z * fy - n_y * report[k, LOAD] + flange
        down = -n_y * fy - n_z * report[k, LOAD]
        force[0] += fx
        force[1] += across
        force[2] += down
        moment[0] += cy * down - cz * across
        moment[1] += cz * fx - cx * down + n_y * mz
        moment[2] += cx * across - cy * fx + n_z * mz
        report[k, FX], report[k, FY], report[k, MZ] = fx, fy, mz
        for i in range(3):
            report[k, XI_1 + i] = slip[k, i] / max(abs(velocity[0]), REGULAR)
        report[k, POWER] = fx * slip[k, 0] + fy * slip[k, 1] + mz * slip[k, 2]
