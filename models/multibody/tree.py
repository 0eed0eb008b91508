"""Tree of a free vehicle's bodies, walked outwards for positions and velocities and inwards for forces, compiled.

All is in the axes of the carrier (see ``models.vehicles.free_vehicle``), the first three coordinates. A link is a row
of numbers for each coordinate, whole for the last one of a body only: others have no more than their axis. A spot is
one for each point where something acts. Both lie in a room that the caller has on its stack, together with what pushes
the carrier from outside. Nothing here makes an array.
"""

import math

from models.machine.compiled import lean
from models.machine.stack import row

KIND, BELOW, ARM, COUNT, PER_JOINT = 0, 1, 2, 5, 6
"""Indices of the numbers of a coordinate in the table, as ``joints`` has it, and the number of coordinates of its body;
``LOOSE``: the kind of a rotation that is alone on a body that carries no point."""
LOOSE = 6.0
JOINT, LOCAL, PER_POINT = 0, 1, 4
"""Indices of the numbers of a point in the table: the last coordinate that moves it, its position from there (m)."""
TURNED, PLACE, AXIS, SPEED, TURNING, PUSHED, TWISTED, PER_LINK = 0, 9, 12, 15, 18, 21, 24, 27
"""Indices of the numbers of a link (a body in motion): rotation, by axes; joint position; joint axis; velocity of the
body's material point at the carrier's origin, relative to the carrier, and angular velocity; force gathered on the
body, and its moment about the carrier's origin."""
WHERE, RATE, PUSH, PER_SPOT = 0, 3, 6, 9
"""Indices of the numbers of a spot, a point where forces act: its position, its velocity relative to the carrier, the
force there."""
AHEAD, ASIDE, TURN, GROUND = 0, 1, 2, 3
"""Indices of the forces along x and y and of the moment about z on the carrier."""


@lean
def three_from(array, first_index):
    """Three successive numbers of an array as a tuple."""
    return array[first_index], array[first_index + 1], array[first_index + 2]


@lean
def dot(a, b):
    """Scalar product a . b of tuples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@lean
def cross(a, b):
    """Vector product a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@lean
def times(vector, factor):
    """Product of a tuple and a number."""
    return vector[0] * factor, vector[1] * factor, vector[2] * factor


@lean
def plus(a, b):
    """Sum of tuples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@lean
def put_three(array, first_index, added):
    """Write a tuple into an array from index ``first_index`` on."""
    array[first_index], array[first_index + 1], array[first_index + 2] = added


@lean
def add_three(array, first_index, added):
    """Add a tuple to three numbers of an array from index ``first_index`` on."""
    array[first_index] += added[0]
    array[first_index + 1] += added[1]
    array[first_index + 2] += added[2]


@lean
def move_outwards(joint_table, coordinate_count, q, v, links):
    """Fill the links (motion of the bodies), body by body, from the table rows of ``joint_table``; their forces are set
    to zero. joint_table, links : pointers."""
    carrier = row(links, PER_LINK, 2)
    for k in range(PER_LINK):
        carrier[k] = 0.0
    carrier[TURNED] = carrier[TURNED + 4] = carrier[TURNED + 8] = 1.0
    j = 3
    while j < coordinate_count:
        of = row(joint_table, PER_JOINT, j)
        count = int(of[COUNT])
        if of[KIND] != LOOSE:
            _fill_link(joint_table, j, j + count, row(links, PER_LINK, int(of[BELOW])), q, v, links)
        j += count


@lean
def _fill_link(joint_table, first_joint, end_joint, parent_link, q, v, links):
    """Fill a body's link from its parent's link, and the axes of its coordinates, translations first."""
    x, y, z = three_from(parent_link, TURNED), three_from(parent_link, TURNED + 3), three_from(parent_link, TURNED + 6)
    place, speed = (
        plus(
            three_from(parent_link, PLACE),
            vector_in_carrier_axes(parent_link, row(joint_table, PER_JOINT, first_joint), ARM),
        ),
        three_from(parent_link, SPEED),
    )
    turning = three_from(parent_link, TURNING)
    for j in range(first_joint, end_joint):
        kind = row(joint_table, PER_JOINT, j)[KIND]
        along = kind if kind < 3.0 else kind - 3.0
        axis = x if along == 0.0 else (y if along == 1.0 else z)
        put_three(row(links, PER_LINK, j), AXIS, axis)
        if kind < 3.0:
            place, speed = plus(place, times(axis, q[j])), plus(speed, times(axis, v[j]))
        else:
            turning, speed = plus(turning, times(axis, v[j])), plus(speed, times(cross(place, axis), v[j]))
            x, y, z = _rotated_axes(along, x, y, z, math.cos(q[j]), math.sin(q[j]))
    link = row(links, PER_LINK, end_joint - 1)
    put_three(link, TURNED, x)
    put_three(link, TURNED + 3, y)
    put_three(link, TURNED + 6, z)
    put_three(link, PLACE, place)
    put_three(link, SPEED, speed)
    put_three(link, TURNING, turning)
    put_three(link, PUSHED, (0.0, 0.0, 0.0))
    put_three(link, TWISTED, (0.0, 0.0, 0.0))


@lean
def _rotated_axes(axis_index, x, y, z, cosine, sine):
    """Three axes x, y, z after a rotation about the axis with index ``axis_index``."""
    if axis_index == 0.0:
        return x, plus(times(y, cosine), times(z, sine)), plus(times(z, cosine), times(y, -sine))
    if axis_index == 1.0:
        return plus(times(x, cosine), times(z, -sine)), y, plus(times(z, cosine), times(x, sine))
    return plus(times(x, cosine), times(y, sine)), plus(times(y, cosine), times(x, -sine)), z


@lean
def vector_in_carrier_axes(link, first_component, first):
    """Vector in the carrier's axes, from three components along a link's axes."""
    return plus(
        plus(
            times(three_from(link, TURNED), first_component[first]),
            times(three_from(link, TURNED + 3), first_component[first + 1]),
        ),
        times(three_from(link, TURNED + 6), first_component[first + 2]),
    )


@lean
def locate_points(point_table, point_count, links, force_points):
    """Fill the positions and velocities of all force points from the table rows of ``point_table``; their forces are
    set to zero. point_table, links, force_points : pointers."""
    for i in range(point_count):
        of, spot = row(point_table, PER_POINT, i), row(force_points, PER_SPOT, i)
        link = row(links, PER_LINK, int(of[JOINT]))
        place = plus(three_from(link, PLACE), vector_in_carrier_axes(link, of, LOCAL))
        put_three(spot, WHERE, place)
        put_three(spot, RATE, plus(three_from(link, SPEED), cross(three_from(link, TURNING), place)))
        put_three(spot, PUSH, (0.0, 0.0, 0.0))


@lean
def add_body_force(link, carrier_wrench, force, position):
    """Add an external force (N) at a position (m) to the body of a link, and to the carrier."""
    add_body_moment(link, carrier_wrench, cross(position, force))
    add_three(link, PUSHED, force)
    carrier_wrench[AHEAD] += force[0]
    carrier_wrench[ASIDE] += force[1]


@lean
def add_body_moment(link, carrier_wrench, moment):
    """Add an external moment (N m) to the body of a link, and to the carrier."""
    add_three(link, TWISTED, moment)
    carrier_wrench[TURN] += moment[2]


@lean
def gather_forces_inwards(joint_table, coordinate_count, point_table, point_count, body_tree, generalised_forces):
    """Transfer forces at points and on bodies from the leaves of the tree to the carrier; adds the generalised force of
    each coordinate to ``generalised_forces``.

    What acts between the vehicle's parts does not push the carrier: it feels what comes from outside, in its axes.
    """
    links, spots = body_tree.links, body_tree.spots
    for i in range(point_count):
        spot, link = row(spots, PER_SPOT, i), row(links, PER_LINK, int(row(point_table, PER_POINT, i)[JOINT]))
        force = three_from(spot, PUSH)
        add_three(link, PUSHED, force)
        add_three(link, TWISTED, cross(three_from(spot, WHERE), force))
    j = coordinate_count - 1
    while j > 2:
        of, link = row(joint_table, PER_JOINT, j), row(links, PER_LINK, j)
        first = j + 1 - int(of[COUNT])
        if of[KIND] != LOOSE:
            pushed, twisted = three_from(link, PUSHED), three_from(link, TWISTED)
            moment = plus(twisted, cross(pushed, three_from(link, PLACE)))
            for k in range(first, j + 1):
                turns = row(joint_table, PER_JOINT, k)[KIND] >= 3.0
                generalised_forces[k] += dot(three_from(row(links, PER_LINK, k), AXIS), moment if turns else pushed)
            below = row(links, PER_LINK, int(row(joint_table, PER_JOINT, first)[BELOW]))
            add_three(below, PUSHED, pushed)
            add_three(below, TWISTED, twisted)
        j = first - 1
