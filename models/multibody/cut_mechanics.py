"""Bodies on joints in space, compiled: where they are, their mass matrix and what they lack for free motion.

Row j + 1 of ``m`` describes what is behind joint j, row 0 the ground: place of its origin, rotation (rows), axis of
the joint, angular velocity, and of acceleration and angular acceleration what is there without any q''. Jourdain's
principle, with axes and anchors of joints as the columns of its rows.
"""

import math

from models.machine.compiled import lean
from models.machine.stack import array, doubles

PARENT, TURNS, AXIS, OFFSET, PER_JOINT = 0, 1, 2, 3, 6
"""Numbers of a joint: the one below it (-1: the ground), whether it turns, its axis, where it is on what is below."""
LAST, MASS, ARM, INERTIA, PER_BODY = 0, 1, 2, 5, 14
"""Numbers of a body: the joint that carries it, kg, its centre (m) from there, its inertia about that (kg m^2)."""
PLACE, TURNED, ALONG, OMEGA, REST, TURN_REST, PER_MOTION = 0, 3, 12, 15, 18, 21, 24


@lean
def add_cross(out, o, a, i, b, j, factor):
    """Add factor a x b to ``out``; vectors begin at o, i and j within the rows that are given."""
    out[o] += factor * (a[i + 1] * b[j + 2] - a[i + 2] * b[j + 1])
    out[o + 1] += factor * (a[i + 2] * b[j] - a[i] * b[j + 2])
    out[o + 2] += factor * (a[i] * b[j + 1] - a[i + 1] * b[j])


@lean
def turned(own, vector, i, out, o):
    """Write a vector of the frame of a row of ``m`` in the axes of space."""
    for k in range(3):
        r = TURNED + 3 * k
        out[o + k] = own[r] * vector[i] + own[r + 1] * vector[i + 1] + own[r + 2] * vector[i + 2]


@lean
def move(joints, q, v, m):
    """Fill ``m`` (n + 1, PER_MOTION) from coordinates and rates (n,)."""
    r = array(doubles(6), (6,))
    m[0, :] = 0.0
    m[0, TURNED] = m[0, TURNED + 4] = m[0, TURNED + 8] = 1.0
    for j in range(len(joints)):
        joint, own = joints[j], m[j + 1]
        below, k = m[int(joint[PARENT]) + 1], int(joint[AXIS])
        for i in range(PER_MOTION):
            own[i] = below[i]
        turned(below, joint, OFFSET, r, 0)
        slides = joint[TURNS] == 0.0
        for i in range(3):
            own[ALONG + i] = below[TURNED + 3 * i + k]
            if slides:
                r[i] += own[ALONG + i] * q[j]
            own[PLACE + i] += r[i]
            r[3 + i] = 0.0
        add_cross(r, 3, below, OMEGA, r, 0, 1.0)
        add_cross(own, REST, below, OMEGA, r, 3, 1.0)
        add_cross(own, REST, below, TURN_REST, r, 0, 1.0)
        if slides:
            add_cross(own, REST, below, OMEGA, own, ALONG, 2.0 * v[j])
        else:
            add_cross(own, TURN_REST, below, OMEGA, own, ALONG, v[j])
            _turn(own, below, k, q[j], v[j])


@lean
def _turn(own, below, k, angle, rate):
    """Turn a row of ``m`` about axis k of the row below by an angle (rad) and its rate (rad/s)."""
    c, s, a, b = math.cos(angle), math.sin(angle), TURNED + (k + 1) % 3, TURNED + (k + 2) % 3
    for i in range(3):
        own[OMEGA + i] += own[ALONG + i] * rate
        one, two = below[a + 3 * i], below[b + 3 * i]
        own[a + 3 * i] = c * one + s * two
        own[b + 3 * i] = c * two - s * one


@lean
def locate(own, arms, i, place, o):
    """Write where a point is that lies at an arm from the origin of a row of ``m``, in its axes."""
    turned(own, arms, i, place, o)
    for k in range(3):
        place[o + k] += own[PLACE + k]


@lean
def column(turns, own, place, i, out, o):
    """Write how a point at ``place`` moves by the rate of the joint of a row of ``m``, which carries it."""
    for k in range(3):
        out[o + k] = 0.0 if turns else own[ALONG + k]
    if turns:
        add_cross(out, o, own, ALONG, place, i, 1.0)
        add_cross(out, o, own, ALONG, own, PLACE, -1.0)


@lean
def add_wrench(joints, m, last, place, wrench, out):
    """Add a force (N) at ``place`` and a moment (N m), ``wrench`` (6,) in space, on what a joint carries."""
    j, by = last, array(doubles(3), (3,))
    while j >= 0:
        turns = joints[j, TURNS]
        column(turns != 0.0, m[j + 1], place, 0, by, 0)
        for k in range(3):
            out[j] += by[k] * wrench[k] + turns * m[j + 1, ALONG + k] * wrench[3 + k]
        j = int(joints[j, PARENT])


@lean
def _times(tensor, vector, i, out):
    for k in range(3):
        out[k] = tensor[3 * k] * vector[i] + tensor[3 * k + 1] * vector[i + 1] + tensor[3 * k + 2] * vector[i + 2]


@lean
def _turned_tensor(own, body, out):
    """Write R T R^T (9,) of the inertia of a body and the rotation of a row of ``m``."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = 0.0
            for k in range(9):
                out[3 * i + j] += own[TURNED + 3 * i + k // 3] * body[INERTIA + k] * own[TURNED + 3 * j + k % 3]


@lean
def resting(own, body, gravity, tensor, arm, a, t):
    """Write a body's inertia and arm in space, and its acceleration and moment of momentum's rate without q''."""
    h = array(doubles(3), (3,))
    h[0] = h[1] = h[2] = 0.0
    _turned_tensor(own, body, tensor)
    turned(own, body, ARM, arm, 0)
    add_cross(h, 0, own, OMEGA, arm, 0, 1.0)
    for k in range(3):
        a[k] = own[REST + k]
    a[2] += gravity
    add_cross(a, 0, own, OMEGA, h, 0, 1.0)
    add_cross(a, 0, own, TURN_REST, arm, 0, 1.0)
    _times(tensor, own, OMEGA, h)
    _times(tensor, own, TURN_REST, t)
    add_cross(t, 0, own, OMEGA, h, 0, 1.0)


@lean
def inertia(joints, bodies, m, gravity, mass, force):
    """Write the mass matrix (n, n), and add weights and inertia forces without q'' to ``force`` (n,)."""
    n = len(joints)
    mass[:] = 0.0
    chain, rows, tensor = array(doubles(n), (n,)), array(doubles(9 * n), (n, 9)), array(doubles(9), (9,))
    place, a, t = array(doubles(3), (3,)), array(doubles(3), (3,)), array(doubles(3), (3,))
    for b in range(len(bodies)):
        body = bodies[b]
        last, kg, count = int(body[LAST]), body[MASS], 0
        resting(m[last + 1], body, gravity, tensor, place, a, t)
        for k in range(3):
            place[k] += m[last + 1, PLACE + k]
        j = last
        while j >= 0:
            row = rows[count]
            chain[count] = j
            column(joints[j, TURNS] != 0.0, m[j + 1], place, 0, row, 0)
            for k in range(3):
                row[3 + k] = m[j + 1, ALONG + k] * joints[j, TURNS]
                force[j] -= kg * row[k] * a[k] + row[3 + k] * t[k]
            for k in range(3):
                row[6 + k] = tensor[3 * k] * row[3] + tensor[3 * k + 1] * row[4] + tensor[3 * k + 2] * row[5]
            count, j = count + 1, int(joints[j, PARENT])
        for one in range(count):
            for two in range(count):
                both = 0.0
                for k in range(3):
                    both += kg * rows[one, k] * rows[two, k] + rows[one, 6 + k] * rows[two, 3 + k]
                mass[int(chain[one]), int(chain[two])] += both


@lean
def solve(matrix, sides):
    """Solve for the rows of ``sides`` (k, n) in place; the matrix, positive, becomes its root (Cholesky)."""
    n = len(matrix)
    for i in range(n):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(rest) if i == j else rest / matrix[j, j]
    for row in range(len(sides)):
        x = sides[row]
        for i in range(n):
            for k in range(i):
                x[i] -= matrix[i, k] * x[k]
            x[i] /= matrix[i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                x[i] -= matrix[k, i] * x[k]
            x[i] /= matrix[i, i]
