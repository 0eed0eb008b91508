"""Kinematics of units in the plane, each hinged to the previous one: a truck alone, or a truck, a drawbar and a
trailer's body.

Coordinates (n = 2 + U): X, Y of the first unit's centre of mass, then the heading of each unit. The centre of unit k
is at (X, Y) + sum_j reach[k, j] e(psi_j) with e(psi) = (cos psi, sin psi). If the first point is a hook whose motion is
prescribed, only the headings are free.
"""

import math
from typing import NamedTuple

from models.machine.compiled import inlined, lean


class ChainPoint(NamedTuple):
    """A point fixed to a unit of the train: the unit's index, and the point's coordinates (m) in the unit's axes."""

    unit: int
    x: float
    y: float


class Direction(NamedTuple):
    """A direction on the ground, given by the cosine and the sine of its heading angle."""

    cosine: float
    sine: float


ALONG_X = Direction(1.0, 0.0)


@lean
def velocity(point, positions, rates, arm_lengths):
    """Velocity (2) in m/s of a ``ChainPoint``, in the ground's axes."""
    k, x, y = point
    vx, vy = rates[0], rates[1]
    for j in range(arm_lengths.shape[1]):
        arm = arm_lengths[k, j] + (x if j == k else 0.0)
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        side = y if j == k else 0.0
        vx += rates[2 + j] * (-arm * s - side * c)
        vy += rates[2 + j] * (arm * c - side * s)
    return vx, vy


@lean
def chain_point_place(point, positions, arm_lengths):
    """Position (2) in m of a ``ChainPoint`` on the ground."""
    k, x, y = point
    px, py = positions[0], positions[1]
    for j in range(arm_lengths.shape[1]):
        arm = arm_lengths[k, j] + (x if j == k else 0.0)
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        side = y if j == k else 0.0
        px += arm * c - side * s
        py += arm * s + side * c
    return px, py


@inlined
def coordinates(plane):
    """Number of coordinates of a ``Plane``; for a single unit a constant that compiled functions know beforehand."""
    return 2 + len(plane.units)


@inlined
def count_of_prescribed(plane):
    """Number of coordinates with a prescribed motion, which are the first ones: two at a prescribed hook, else none."""
    return 0 if len(plane.units) == 1 else 2 * plane.has_prescribed_hook


@inlined
def fill_headings(positions, units):
    """Fill the cosine and the sine of the heading of every unit (U, 2), from ``positions`` (n,)."""
    for j in range(units.shape[0]):
        units[j, 0], units[j, 1] = math.cos(positions[2 + j]), math.sin(positions[2 + j])


@inlined
def fill_velocity_rows(point, direction, units, rates, plane, row_along, row_across):
    """Fill the two rows (n,) that map the coordinates' rates to the velocity of a ``ChainPoint`` along a ``Direction``
    and to the left of it; ``units`` : see ``fill_headings``.

    The point's acceleration is the rows times the coordinates' accelerations, plus the two terms returned (m/s^2). A
    force in these axes gives generalised forces by the transposed rows.
    """
    c, s = direction.cosine, direction.sine
    row_along[0], row_along[1], row_across[0], row_across[1] = c, s, -s, c
    bias_along, bias_across = 0.0, 0.0
    for j in range(len(plane.units)):
        arm, side = plane.reach[point.unit, j], 0.0
        if j == point.unit:
            arm, side = arm + point.x, point.y
        cosine_between, aslant = c * units[j, 0] + s * units[j, 1], s * units[j, 0] - c * units[j, 1]
        row_along[2 + j], row_across[2 + j] = arm * aslant - side * cosine_between, arm * cosine_between + side * aslant
        bias_along -= row_across[2 + j] * rates[2 + j] ** 2
        bias_across += row_along[2 + j] * rates[2 + j] ** 2
    return bias_along, bias_across


@inlined
def inertia(units, rates, plane, mass, right_side, row_along, row_across):
    """Fill the mass matrix (n, n), and ``right_side`` (n,) with the centrifugal terms of the equations of motion.

    units : see ``fill_headings``; row_along, row_across (n,) : room to work in.
    """
    size = coordinates(plane)
    mass[:], right_side[:] = 0.0, 0.0
    for k in range(len(plane.units)):
        bias_along, bias_across = fill_velocity_rows(
            ChainPoint(k, 0.0, 0.0), ALONG_X, units, rates, plane, row_along, row_across
        )
        for a in range(size):
            right_side[a] -= plane.masses[k] * (row_along[a] * bias_along + row_across[a] * bias_across)
            for b in range(size):
                mass[a, b] += plane.masses[k] * (row_along[a] * row_along[b] + row_across[a] * row_across[b])
        mass[2 + k, 2 + k] += plane.inertias[k]


@inlined
def factorise_mass(mass, plane):
    """Replace the lower triangle of the mass matrix of the free coordinates by its Cholesky factor. A single unit's
    matrix is diagonal and stays unchanged.
    """
    if len(plane.units) == 1:
        return
    first = count_of_prescribed(plane)
    for a in range(first, mass.shape[0]):
        for b in range(first, a + 1):
            element = mass[a, b]
            for c in range(first, b):
                element -= mass[a, c] * mass[b, c]
            mass[a, b] = math.sqrt(element) if a == b else element / mass[b, b]


@inlined
def solve(mass, plane, right_side):
    """Turn the forces (n,) in ``right_side`` into accelerations of the free coordinates, in place, with the matrix from
    ``factorise_mass``.
    """
    size, first = coordinates(plane), count_of_prescribed(plane)
    if len(plane.units) == 1:
        for a in range(size):
            right_side[a] /= mass[a, a]
        return
    for a in range(first, size):
        for b in range(first, a):
            right_side[a] -= mass[a, b] * right_side[b]
        right_side[a] /= mass[a, a]
    for a in range(size - 1, first - 1, -1):
        for b in range(a + 1, size):
            right_side[a] -= mass[b, a] * right_side[b]
        right_side[a] /= mass[a, a]
