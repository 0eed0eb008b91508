"""Units in the plane, each hinged to the one before it: a truck alone, or a truck, a drawbar and a trailer's body.

Coordinates (2 + U): X, Y of the first unit's centre of mass, then the heading of each unit. The centre of unit k is at
(X, Y) + sum_j reach[k, j] e(psi_j) with e(psi) = (cos psi, sin psi), so that with n = de / dpsi the mass matrix and
the quadratic terms of the velocities follow from sums over units. If the first point is a hook whose motion is
prescribed, only the headings are free.
"""

import math

import numpy as np

from models.compiled import njit


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def load_on(k, x, y, fx, fy, positions, reach, total):
    """Add a force (fx, fy), in the ground's axes, at the point (x, y) of unit k to the generalised ones (2 + U)."""
    total[0] += fx
    total[1] += fy
    for j in range(reach.shape[1]):
        way = reach[k, j] + (x if j == k else 0.0)
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        side = y if j == k else 0.0
        total[2 + j] += fx * (-way * s - side * c) + fy * (way * c - side * s)


@njit(cache=True, error_model="numpy")
def accelerations(positions, rates, forces, masses, inertias, reach, hooked, found):
    """Fill ``found`` (2 + U) with the accelerations under generalised forces (2 + U).

    hooked : the first two are prescribed and stand in ``found`` already.
    """
    units = masses.size
    m, right = np.zeros((2 + units, 2 + units)), forces.copy()
    for k in range(units):
        jx, jy = np.zeros(2 + units), np.zeros(2 + units)
        jx[0], jy[1] = 1.0, 1.0
        turn_x, turn_y = 0.0, 0.0
        for j in range(units):
            c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
            jx[2 + j], jy[2 + j] = -reach[k, j] * s, reach[k, j] * c
            turn_x -= reach[k, j] * c * rates[2 + j] ** 2
            turn_y -= reach[k, j] * s * rates[2 + j] ** 2
        for a in range(2 + units):
            right[a] -= masses[k] * (jx[a] * turn_x + jy[a] * turn_y)
            for b in range(2 + units):
                m[a, b] += masses[k] * (jx[a] * jx[b] + jy[a] * jy[b])
        m[2 + k, 2 + k] += inertias[k]
    first = 2 if hooked else 0
    for a in range(first, 2 + units):
        for b in range(first):
            right[a] -= m[a, b] * found[b]
    _solve(m, right, first, found)


@njit(cache=True, error_model="numpy")
def _solve(m, right, first, found):
    """Cholesky of the free part of a mass matrix, in place."""
    size = right.size
    for a in range(first, size):
        for b in range(first, a + 1):
            total = m[a, b]
            for c in range(first, b):
                total -= m[a, c] * m[b, c]
            m[a, b] = math.sqrt(total) if a == b else total / m[b, b]
    for a in range(first, size):
        total = right[a]
        for b in range(first, a):
            total -= m[a, b] * right[b]
        right[a] = total / m[a, a]
    for a in range(size - 1, first - 1, -1):
        total = right[a]
        for b in range(a + 1, size):
            total -= m[b, a] * right[b]
        right[a] = total / m[a, a]
        found[a] = right[a]


@njit(cache=True, error_model="numpy")
def centre_acceleration(k, positions, rates, given, reach):
    """Acceleration (2) of the centre of unit k, in the ground's axes, from those (2 + U) of the coordinates."""
    ax, ay = given[0], given[1]
    for j in range(reach.shape[1]):
        c, s = math.cos(positions[2 + j]), math.sin(positions[2 + j])
        ax += reach[k, j] * (-s * given[2 + j] - c * rates[2 + j] ** 2)
        ay += reach[k, j] * (c * given[2 + j] - s * rates[2 + j] ** 2)
    return ax, ay
