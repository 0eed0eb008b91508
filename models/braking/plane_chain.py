"""Units in the plane, each hinged to the one before it: a truck alone, or a truck, a drawbar and a trailer's body.

Coordinates (n = 2 + U): X, Y of the first unit's centre of mass, then the heading of each unit. The centre of unit k
is at (X, Y) + sum_j reach[k, j] e(psi_j) with e(psi) = (cos psi, sin psi). If the first point is a hook whose motion is
prescribed, only the headings are free.
"""

import math

from models.compiled import lean


@lean
def point(k, x, y, positions, rates, reach):
    """Velocity (2) in the ground's axes of the point (x, y) of unit k, in that unit's axes."""
    vx, vy = rates[0], rates[1]
    for j in range(reach.shape[1]):
        way = reach[k, j] + (x if j == k else 0.0)
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        side = y if j == k else 0.0
        vx += rates[2 + j] * (-way * s - side * c)
        vy += rates[2 + j] * (way * c - side * s)
    return vx, vy


@lean
def place_of(k, x, y, positions, reach):
    """Place (2) on the ground of the point (x, y) of unit k."""
    px, py = positions[0], positions[1]
    for j in range(reach.shape[1]):
        way = reach[k, j] + (x if j == k else 0.0)
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        side = y if j == k else 0.0
        px += way * c - side * s
        py += way * s + side * c
    return px, py


@lean
def rows(k, x, y, heading, positions, rates, reach, along, across):
    """Fill the two rows (n,) that give the velocity of the point (x, y) of unit k in axes of a ``heading``.

    Its acceleration is the rows times those of the coordinates, plus the two terms returned (m/s^2); a force in these
    axes acts on the coordinates by the rows' transposes.
    """
    along[0], along[1] = math.cos(heading), math.sin(heading)
    across[0], across[1] = -along[1], along[0]
    ahead, aside = 0.0, 0.0
    for j in range(reach.shape[1]):
        way, side = reach[k, j], 0.0
        if j == k:
            way, side = way + x, y
        c, s = math.cos(heading - positions[2 + j]), math.sin(heading - positions[2 + j])
        along[2 + j], across[2 + j] = way * s - side * c, way * c + side * s
        ahead -= across[2 + j] * rates[2 + j] ** 2
        aside += along[2 + j] * rates[2 + j] ** 2
    return ahead, aside


@lean
def inertia(positions, rates, masses, inertias, reach, mass, right, along, across):
    """Fill the mass matrix (n, n) and what its product with the accelerations has besides the forces (n,).

    along, across (n,) : room to work in.
    """
    mass[:], right[:] = 0.0, 0.0
    for k in range(masses.size):
        ahead, aside = rows(k, 0.0, 0.0, 0.0, positions, rates, reach, along, across)
        for a in range(right.size):
            right[a] -= masses[k] * (along[a] * ahead + across[a] * aside)
            for b in range(right.size):
                mass[a, b] += masses[k] * (along[a] * along[b] + across[a] * across[b])
        mass[2 + k, 2 + k] += inertias[k]


@lean
def factor(mass, first):
    """Cholesky's factor of the mass matrix from row ``first`` on, in place of its lower triangle."""
    for a in range(first, mass.shape[0]):
        for b in range(first, a + 1):
            rest = mass[a, b]
            for c in range(first, b):
                rest -= mass[a, c] * mass[b, c]
            mass[a, b] = math.sqrt(rest) if a == b else rest / mass[b, b]


@lean
def solve(mass, first, right):
    """Forces (n,) to accelerations from row ``first`` on, in place, by ``factor``'s."""
    for a in range(first, right.size):
        for b in range(first, a):
            right[a] -= mass[a, b] * right[b]
        right[a] /= mass[a, a]
    for a in range(right.size - 1, first - 1, -1):
        for b in range(a + 1, right.size):
            right[a] -= mass[b, a] * right[b]
        right[a] /= mass[a, a]
