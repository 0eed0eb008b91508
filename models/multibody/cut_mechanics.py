"""Kinematics and mass matrix of bodies on joints in space, compiled, with the accelerations that remain when q'' = 0.

Row j + 1 of ``links`` describes what is behind joint j, row 0 the ground: rotation (rows), place of its origin, axis of
the joint, angular velocity, and of acceleration and angular acceleration what is there without any q''. Jourdain's
principle, with axes and anchors of joints as the columns of its rows. Vectors are tuples of space's axes.
"""

import math

from models.machine.compiled import lean
from models.machine.stack import array, doubles
from models.multibody.tree import add, cross, dot, plus, put, three, times

PARENT, ROTATES, AXIS, OFFSET, PER_JOINT = 0, 1, 2, 3, 6
"""Indices of the numbers of a joint: its parent joint (-1: the ground), whether it rotates, its axis, its position on
the parent body."""
LAST, MASS, ARM, INERTIA, PER_BODY = 0, 1, 2, 5, 14
"""Indices of the numbers of a body: the joint that carries it, mass (kg), position of its centre (m) from that joint,
inertia about its centre (kg m^2)."""
ROTATION, POSITION, JOINT_AXIS, OMEGA, BIAS, ANGULAR_BIAS, PER_MOTION = 0, 9, 12, 15, 18, 21, 24
"""Indices of the numbers in a row of ``links``: rotation matrix, first as ``rotated`` reads it there, position, joint
axis, angular velocity, and linear and angular acceleration without the q'' terms."""


@lean
def rotated(matrix, vector):
    """Product of a matrix (3, 3) and a vector (3,); the matrix is the first nine numbers of ``matrix``, row by row.

    With a row of ``links`` it turns a vector from the body's axes to those of space.
    """
    return dot(three(matrix, 0), vector), dot(three(matrix, 3), vector), dot(three(matrix, 6), vector)


@lean
def move(joints, q, v, links):
    """Fill ``links`` (n + 1, PER_MOTION) with the motion of the body behind each joint, from joint coordinates and
    rates (n,)."""
    links[0, :] = 0.0
    links[0, ROTATION] = links[0, ROTATION + 4] = links[0, ROTATION + 8] = 1.0
    for j in range(len(joints)):
        joint, link = joints[j], links[j + 1]
        below, k = links[int(joint[PARENT]) + 1], int(joint[AXIS])
        for i in range(PER_MOTION):
            link[i] = below[i]
        arm, along, omega = (
            rotated(below, three(joint, OFFSET)),
            (below[k], below[3 + k], below[6 + k]),
            three(link, OMEGA),
        )
        slides = joint[ROTATES] == 0.0
        if slides:
            arm = plus(arm, times(along, q[j]))
        put(link, JOINT_AXIS, along)
        add(link, POSITION, arm)
        add(link, BIAS, cross(omega, cross(omega, arm)))
        add(link, BIAS, cross(three(below, ANGULAR_BIAS), arm))
        if slides:
            add(link, BIAS, times(cross(omega, along), 2.0 * v[j]))
        else:
            add(link, ANGULAR_BIAS, times(cross(omega, along), v[j]))
            _turn(link, below, k, q[j], times(along, v[j]))


@lean
def _turn(link, below, k, angle, rate):
    """Rotate the row ``link`` of ``links`` about axis k of the row ``below`` by an angle (rad); add the angular
    velocity ``rate`` (rad/s, a vector)."""
    c, s, a, b = math.cos(angle), math.sin(angle), (k + 1) % 3, (k + 2) % 3
    add(link, OMEGA, rate)
    for i in range(0, 9, 3):
        link[a + i] = c * below[a + i] + s * below[b + i]
        link[b + i] = c * below[b + i] - s * below[a + i]


@lean
def locate(link, arms, i):
    """Position in space of a point given by its arm from the origin of a row of ``links``, in that row's axes."""
    return plus(rotated(link, three(arms, i)), three(link, POSITION))


@lean
def joint_velocity(rotates, link, position):
    """Velocity of a point at ``position`` per unit rate of a joint below it; ``link`` is the joint's row of
    ``links``."""
    along = three(link, JOINT_AXIS)
    if rotates == 0.0:
        return along
    return plus(cross(along, position), times(cross(along, three(link, POSITION)), -1.0))


@lean
def add_wrench(joints, links, last_joint, position, force, moment, out):
    """Add to the joint forces ``out`` (n,) a force (N) at ``position`` and a moment (N m) that act on the body behind
    joint ``last_joint``."""
    j = last_joint
    while j >= 0:
        link, turns = links[j + 1], joints[j, ROTATES]
        by, about = joint_velocity(turns, link, position), times(three(link, JOINT_AXIS), turns)
        for k in range(3):
            out[j] += by[k] * force[k] + about[k] * moment[k]
        j = int(joints[j, PARENT])


@lean
def bias_acceleration(link, arm, gravity):
    """Acceleration of a body's point without the q'' terms, minus that of free fall; ``arm`` : from the origin of a row
    of ``links``."""
    omega, rest = three(link, OMEGA), (link[BIAS], link[BIAS + 1], link[BIAS + 2] + gravity)
    return plus(plus(rest, cross(omega, cross(omega, arm))), cross(three(link, ANGULAR_BIAS), arm))


@lean
def body_inertia_terms(link, body, gravity, tensor):
    """Arm to a body's centre in space, and the centre's acceleration and the rate of angular momentum, both without the
    q'' terms. Writes the body's inertia in space to ``tensor``."""
    for i in range(3):
        for j in range(3):
            tensor[3 * i + j] = 0.0  # R T R^T
            for k in range(9):
                tensor[3 * i + j] += link[3 * i + k // 3] * body[INERTIA + k] * link[3 * j + k % 3]
    arm, omega = rotated(link, three(body, ARM)), three(link, OMEGA)
    momentum = plus(rotated(tensor, three(link, ANGULAR_BIAS)), cross(omega, rotated(tensor, omega)))
    return arm, bias_acceleration(link, arm, gravity), momentum


@lean
def add_inertia(joints, bodies, links, gravity, mass, force):
    """Write the mass matrix (n, n), and add weights, and inertia forces without the q'' terms, to ``force`` (n,)."""
    n = len(joints)
    mass[:] = 0.0
    chain, rows, tensor = array(doubles(n), (n,)), array(doubles(9 * n), (n, 9)), array(doubles(9), (9,))
    for b in range(len(bodies)):
        body = bodies[b]
        j, kg, count = int(body[LAST]), body[MASS], 0
        arm, a, t = body_inertia_terms(links[j + 1], body, gravity, tensor)
        place = plus(arm, three(links[j + 1], POSITION))
        while j >= 0:
            row, link, turns = rows[count], links[j + 1], joints[j, ROTATES]
            chain[count] = j
            by, about = joint_velocity(turns, link, place), times(three(link, JOINT_AXIS), turns)
            for k in range(3):
                force[j] -= kg * by[k] * a[k] + about[k] * t[k]
            put(row, 0, by)
            put(row, 3, about)
            put(row, 6, rotated(tensor, about))
            count, j = count + 1, int(joints[j, PARENT])
        for i in range(count):
            for two in range(count):
                both = 0.0
                for k in range(3):
                    both += kg * rows[i, k] * rows[two, k] + rows[i, 6 + k] * rows[two, 3 + k]
                mass[int(chain[i]), int(chain[two])] += both


@lean
def solve(matrix, right_sides):
    """Solve the linear system in place for each right-hand side, a row of ``right_sides`` (k, n). The positive definite
    matrix is replaced by its Cholesky factor."""
    n = len(matrix)
    for i in range(n):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = math.sqrt(rest) if i == j else rest / matrix[j, j]
    for row in range(len(right_sides)):
        x = right_sides[row]
        for i in range(n):
            for k in range(i):
                x[i] -= matrix[i, k] * x[k]
            x[i] /= matrix[i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                x[i] -= matrix[k, i] * x[k]
            x[i] /= matrix[i, i]
