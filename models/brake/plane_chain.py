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
def chain_point_velocity(chain_point, coordinate_positions, coordinate_rates, arm_lengths):
    """Velocity (2) in m/s of a ``ChainPoint``, in the ground's axes."""
    k, x, y = chain_point
    vx, vy = coordinate_rates[0], coordinate_rates[1]
    for j in range(arm_lengths.shape[1]):
        arm = arm_lengths[k, j] + (x if j == k else 0.0)
        c, s = math.cos(coordinate_positions[2 + j]), math.sin(coordinate_positions[2 + j])
        side = y if j == k else 0.0
        vx += coordinate_rates[2 + j] * (-arm * s - side * c)
        vy += coordinate_rates[2 + j] * (arm * c - side * s)
    return vx, vy


@lean
def chain_point_position(chain_point, coordinate_positions, arm_lengths):
    """Position (2) in m of a ``ChainPoint`` on the ground."""
    k, x, y = chain_point
    px, py = coordinate_positions[0], coordinate_positions[1]
    for j in range(arm_lengths.shape[1]):
        arm = arm_lengths[k, j] + (x if j == k else 0.0)
        c, s = math.cos(coordinate_positions[2 + j]), math.sin(coordinate_positions[2 + j])
        side = y if j == k else 0.0
        px += arm * c - side * s
        py += arm * s + side * c
    return px, py


@inlined
def count_of_coordinates(plane_vehicle):
    """Number of coordinates of a ``PlaneVehicle``; for a single unit a constant that compiled functions know
    beforehand.
    """
    return 2 + len(plane_vehicle.units)


@inlined
def count_of_prescribed(plane_vehicle):
    """Number of coordinates with a prescribed motion, which are the first ones: two at a prescribed hook, else none."""
    return 0 if len(plane_vehicle.units) == 1 else 2 * plane_vehicle.has_prescribed_hook


@inlined
def fill_headings(coordinate_positions, heading_vectors):
    """Fill the cosine and the sine of the heading of every unit (U, 2), from ``coordinate_positions`` (n,)."""
    for j in range(heading_vectors.shape[0]):
        heading_vectors[j, 0], heading_vectors[j, 1] = (
            math.cos(coordinate_positions[2 + j]),
            math.sin(coordinate_positions[2 + j]),
        )


@inlined
def fill_velocity_rows(chain_point, direction, heading_vectors, coordinate_rates, plane_vehicle, row_along, row_across):
    """Fill the two rows (n,) that map the coordinates' rates to the velocity of a ``ChainPoint`` along a ``Direction``
    and to the left of it; ``heading_vectors`` : see ``fill_headings``.

    The point's acceleration is the rows times the coordinates' accelerations, plus the two terms returned (m/s^2). A
    force in these axes gives generalised forces by the transposed rows.
    """
    c, s = direction.cosine, direction.sine
    row_along[0], row_along[1], row_across[0], row_across[1] = c, s, -s, c
    bias_along, bias_across = 0.0, 0.0
    for j in range(len(plane_vehicle.units)):
        arm, side = plane_vehicle.arm_lengths[chain_point.unit, j], 0.0
        if j == chain_point.unit:
            arm, side = arm + chain_point.x, chain_point.y
        cosine_between, aslant = (
            c * heading_vectors[j, 0] + s * heading_vectors[j, 1],
            s * heading_vectors[j, 0] - c * heading_vectors[j, 1],
        )
        row_along[2 + j], row_across[2 + j] = arm * aslant - side * cosine_between, arm * cosine_between + side * aslant
        bias_along -= row_across[2 + j] * coordinate_rates[2 + j] ** 2
        bias_across += row_along[2 + j] * coordinate_rates[2 + j] ** 2
    return bias_along, bias_across


@inlined
def fill_mass_matrix(heading_vectors, coordinate_rates, plane_vehicle, mass_matrix, right_side, row_along, row_across):
    """Fill the mass matrix (n, n), and ``right_side`` (n,) with the centrifugal terms of the equations of motion.

    heading_vectors : see ``fill_headings``; row_along, row_across (n,) : room to work in.
    """
    size = count_of_coordinates(plane_vehicle)
    mass_matrix[:], right_side[:] = 0.0, 0.0
    for k in range(len(plane_vehicle.units)):
        bias_along, bias_across = fill_velocity_rows(
            ChainPoint(k, 0.0, 0.0), ALONG_X, heading_vectors, coordinate_rates, plane_vehicle, row_along, row_across
        )
        for a in range(size):
            right_side[a] -= plane_vehicle.masses[k] * (row_along[a] * bias_along + row_across[a] * bias_across)
            for b in range(size):
                mass_matrix[a, b] += plane_vehicle.masses[k] * (
                    row_along[a] * row_along[b] + row_across[a] * row_across[b]
                )
        mass_matrix[2 + k, 2 + k] += plane_vehicle.inertias[k]


@inlined
def factorise_mass(mass_matrix, plane_vehicle):
    """Replace the lower triangle of the mass matrix of the free coordinates by its Cholesky factor. A single unit's
    matrix is diagonal and stays unchanged.
    """
    if len(plane_vehicle.units) == 1:
        return
    first = count_of_prescribed(plane_vehicle)
    for a in range(first, mass_matrix.shape[0]):
        for b in range(first, a + 1):
            element = mass_matrix[a, b]
            for c in range(first, b):
                element -= mass_matrix[a, c] * mass_matrix[b, c]
            mass_matrix[a, b] = math.sqrt(element) if a == b else element / mass_matrix[b, b]


@inlined
def solve_accelerations(mass_matrix, plane_vehicle, right_side):
    """Turn the forces (n,) in ``right_side`` into accelerations of the free coordinates, in place, with the matrix from
    ``factorise_mass``.
    """
    size, first = count_of_coordinates(plane_vehicle), count_of_prescribed(plane_vehicle)
    if len(plane_vehicle.units) == 1:
        for a in range(size):
            right_side[a] /= mass_matrix[a, a]
        return
    for a in range(first, size):
        for b in range(first, a):
            right_side[a] -= mass_matrix[a, b] * right_side[b]
        right_side[a] /= mass_matrix[a, a]
    for a in range(size - 1, first - 1, -1):
        for b in range(a + 1, size):
            right_side[a] -= mass_matrix[b, a] * right_side[b]
        right_side[a] /= mass_matrix[a, a]
