"""Kinematics and mass matrix of bodies on joints in space, compiled, with the accelerations that remain when q'' = 0.

Row j + 1 of ``links`` describes what is behind joint j, row 0 the ground: rotation (rows), place of its origin, axis of
the joint, angular velocity, and of acceleration and angular acceleration what is there without any q''. Jourdain's
principle, with axes and anchors of joints as the columns of its rows. Vectors are tuples of space's axes.
"""

import math

from models.machine.compiled import lean
from models.machine.stack import array, doubles
from models.multibody.tree import add_three, cross, dot, plus, put_three, three_from, times

PARENT, ROTATES, AXIS, OFFSET, PER_JOINT = 0, 1, 2, 3, 6
"""Indices of the numbers of a joint: its parent joint (-1: the ground), whether it rotates, its axis, its position on
the parent body."""
LAST, MASS, ARM, INERTIA, PER_BODY = 0, 1, 2, 5, 14
"""Indices of the numbers of a body: the joint that carries it, mass (kg), position of its centre (m) from that joint,
inertia about its centre (kg m^2)."""
ROTATION, POSITION, JOINT_AXIS, OMEGA, BIAS, ANGULAR_BIAS, PER_MOTION = 0, 9, 12, 15, 18, 21, 24
"""Indices of the numbers in a row of ``links``: rotation matrix, first as ``rotated_vector`` reads it there, position,
joint axis, angular velocity, and linear and angular acceleration without the q'' terms."""


@lean
def rotated_vector(matrix, vector):
    """Product of a matrix (3, 3) and a vector (3,); the matrix is the first nine numbers of ``matrix``, row by row.

    With a row of ``links`` it turns a vector from the body's axes to those of space.
    """
    return dot(three_from(matrix, 0), vector), dot(three_from(matrix, 3), vector), dot(three_from(matrix, 6), vector)


@lean
def move_bodies(joints, q, v, body_motions):
    """Fill ``body_motions`` (n + 1, PER_MOTION) with the motion of the body behind each joint, from joint coordinates
    and rates (n,)."""
    body_motions[0, :] = 0.0
    body_motions[0, ROTATION] = body_motions[0, ROTATION + 4] = body_motions[0, ROTATION + 8] = 1.0
    for j in range(len(joints)):
        joint, link = joints[j], body_motions[j + 1]
        below, k = body_motions[int(joint[PARENT]) + 1], int(joint[AXIS])
        for i in range(PER_MOTION):
            link[i] = below[i]
        arm, along, omega = (
            rotated_vector(below, three_from(joint, OFFSET)),
            (below[k], below[3 + k], below[6 + k]),
            three_from(link, OMEGA),
        )
        slides = joint[ROTATES] == 0.0
        if slides:
            arm = plus(arm, times(along, q[j]))
        put_three(link, JOINT_AXIS, along)
        add_three(link, POSITION, arm)
        add_three(link, BIAS, cross(omega, cross(omega, arm)))
        add_three(link, BIAS, cross(three_from(below, ANGULAR_BIAS), arm))
        if slides:
            add_three(link, BIAS, times(cross(omega, along), 2.0 * v[j]))
        else:
            add_three(link, ANGULAR_BIAS, times(cross(omega, along), v[j]))
            _rotate_body(link, below, k, q[j], times(along, v[j]))


@lean
def _rotate_body(body_motion, parent_motion, axis_index, angle, angular_rate):
    """Rotate the row ``body_motion`` of ``links`` about axis k of the row ``parent_motion`` by an angle (rad); add the
    angular velocity ``angular_rate`` (rad/s, a vector)."""
    c, s, a, b = math.cos(angle), math.sin(angle), (axis_index + 1) % 3, (axis_index + 2) % 3
    add_three(body_motion, OMEGA, angular_rate)
    for i in range(0, 9, 3):
        body_motion[a + i] = c * parent_motion[a + i] + s * parent_motion[b + i]
        body_motion[b + i] = c * parent_motion[b + i] - s * parent_motion[a + i]


@lean
def point_position(body_motion, numbers, arm_index):
    """Position in space of a point given by its arm from the origin of a row of ``links``, in that row's axes."""
    return plus(rotated_vector(body_motion, three_from(numbers, arm_index)), three_from(body_motion, POSITION))


@lean
def joint_velocity(is_rotation, body_motion, position):
    """Velocity of a point at ``position`` per unit rate of a joint below it; ``body_motion`` is the joint's row of
    ``links``."""
    along = three_from(body_motion, JOINT_AXIS)
    if is_rotation == 0.0:
        return along
    return plus(cross(along, position), times(cross(along, three_from(body_motion, POSITION)), -1.0))


@lean
def add_wrench(joints, body_motions, last_joint, position, force, moment, generalised_forces):
    """Add to the joint forces ``generalised_forces`` (n,) a force (N) at ``position`` and a moment (N m) that act on
    the body behind joint ``last_joint``."""
    j = last_joint
    while j >= 0:
        link, turns = body_motions[j + 1], joints[j, ROTATES]
        by, about = joint_velocity(turns, link, position), times(three_from(link, JOINT_AXIS), turns)
        for k in range(3):
            generalised_forces[j] += by[k] * force[k] + about[k] * moment[k]
        j = int(joints[j, PARENT])


@lean
def bias_acceleration(body_motion, arm, gravity):
    """Acceleration of a body's point without the q'' terms, minus that of free fall; ``arm`` : from the origin of a row
    of ``links``."""
    omega, rest = (
        three_from(body_motion, OMEGA),
        (body_motion[BIAS], body_motion[BIAS + 1], body_motion[BIAS + 2] + gravity),
    )
    return plus(plus(rest, cross(omega, cross(omega, arm))), cross(three_from(body_motion, ANGULAR_BIAS), arm))


@lean
def body_inertia_terms(body_motion, body_row, gravity, inertia_tensor):
    """Arm to a body's centre in space, and the centre's acceleration and the rate of angular momentum, both without the
    q'' terms. Writes the body's inertia in space to ``inertia_tensor``."""
    for i in range(3):
        for j in range(3):
            inertia_tensor[3 * i + j] = 0.0  # R T R^T
            for k in range(9):
                inertia_tensor[3 * i + j] += (
                    body_motion[3 * i + k // 3] * body_row[INERTIA + k] * body_motion[3 * j + k % 3]
                )
    arm, omega = rotated_vector(body_motion, three_from(body_row, ARM)), three_from(body_motion, OMEGA)
    momentum = plus(
        rotated_vector(inertia_tensor, three_from(body_motion, ANGULAR_BIAS)),
        cross(omega, rotated_vector(inertia_tensor, omega)),
    )
    return arm, bias_acceleration(body_motion, arm, gravity), momentum


@lean
def add_inertia(joints, bodies, body_motions, gravity, mass_matrix, generalised_forces):
    """Write the mass matrix (n, n), and add weights, and inertia forces without the q'' terms, to
    ``generalised_forces`` (n,)."""
    n = len(joints)
    mass_matrix[:] = 0.0
    chain, rows, tensor = array(doubles(n), (n,)), array(doubles(9 * n), (n, 9)), array(doubles(9), (9,))
    for b in range(len(bodies)):
        body = bodies[b]
        j, kg, count = int(body[LAST]), body[MASS], 0
        arm, a, t = body_inertia_terms(body_motions[j + 1], body, gravity, tensor)
        place = plus(arm, three_from(body_motions[j + 1], POSITION))
        while j >= 0:
            row, link, turns = rows[count], body_motions[j + 1], joints[j, ROTATES]
            chain[count] = j
            by, about = joint_velocity(turns, link, place), times(three_from(link, JOINT_AXIS), turns)
            for k in range(3):
                generalised_forces[j] -= kg * by[k] * a[k] + about[k] * t[k]
            put_three(row, 0, by)
            put_three(row, 3, about)
            put_three(row, 6, rotated_vector(tensor, about))
            count, j = count + 1, int(joints[j, PARENT])
        for i in range(count):
            for two in range(count):
                both = 0.0
                for k in range(3):
                    both += kg * rows[i, k] * rows[two, k] + rows[i, 6 + k] * rows[two, 3 + k]
                mass_matrix[int(chain[i]), int(chain[two])] += both


@lean
def solve_in_place(matrix, right_sides):
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
