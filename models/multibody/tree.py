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
def three(numbers, first):
    """Three successive numbers of an array as a tuple."""
    return numbers[first], numbers[first + 1], numbers[first + 2]


@lean
def dot(a, b):
    """Scalar product a . b of tuples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@lean
def cross(a, b):
    """Vector product a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@lean
def times(a, factor):
    """Product of a tuple and a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@lean
def plus(a, b):
    """Sum of tuples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@lean
def put(numbers, first, a):
    """Write a tuple into an array from index ``first`` on."""
    numbers[first], numbers[first + 1], numbers[first + 2] = a


@lean
def add(numbers, first, a):
    """Add a tuple to three numbers of an array from index ``first`` on."""
    numbers[first] += a[0]
    numbers[first + 1] += a[1]
    numbers[first + 2] += a[2]


@lean
def outwards(joints, n, q, v, links):
    """Fill the links (motion of the bodies), body by body, from the table rows of ``joints``; their forces are set to
    zero. joints, links : pointers."""
    carrier = row(links, PER_LINK, 2)
    for k in range(PER_LINK):
        carrier[k] = 0.0
    carrier[TURNED] = carrier[TURNED + 4] = carrier[TURNED + 8] = 1.0
    j = 3
    while j < n:
        of = row(joints, PER_JOINT, j)
        count = int(of[COUNT])
        if of[KIND] != LOOSE:
            _fill_link(joints, j, j + count, row(links, PER_LINK, int(of[BELOW])), q, v, links)
        j += count


@lean
def _fill_link(joints, first, end, below, q, v, links):
    """Fill a body's link from its parent's link, and the axes of its coordinates, translations first."""
    x, y, z = three(below, TURNED), three(below, TURNED + 3), three(below, TURNED + 6)
    place, speed = plus(three(below, PLACE), out(below, row(joints, PER_JOINT, first), ARM)), three(below, SPEED)
    turning = three(below, TURNING)
    for j in range(first, end):
        kind = row(joints, PER_JOINT, j)[KIND]
        along = kind if kind < 3.0 else kind - 3.0
        axis = x if along == 0.0 else (y if along == 1.0 else z)
        put(row(links, PER_LINK, j), AXIS, axis)
        if kind < 3.0:
            place, speed = plus(place, times(axis, q[j])), plus(speed, times(axis, v[j]))
        else:
            turning, speed = plus(turning, times(axis, v[j])), plus(speed, times(cross(place, axis), v[j]))
            x, y, z = _rotated_axes(along, x, y, z, math.cos(q[j]), math.sin(q[j]))
    link = row(links, PER_LINK, end - 1)
    put(link, TURNED, x)
    put(link, TURNED + 3, y)
    put(link, TURNED + 6, z)
    put(link, PLACE, place)
    put(link, SPEED, speed)
    put(link, TURNING, turning)
    put(link, PUSHED, (0.0, 0.0, 0.0))
    put(link, TWISTED, (0.0, 0.0, 0.0))


@lean
def _rotated_axes(along, x, y, z, cosine, sine):
    """Three axes x, y, z after a rotation about the axis with index ``along``."""
    if along == 0.0:
        return x, plus(times(y, cosine), times(z, sine)), plus(times(z, cosine), times(y, -sine))
    if along == 1.0:
        return plus(times(x, cosine), times(z, -sine)), y, plus(times(z, cosine), times(x, sine))
    return plus(times(x, cosine), times(y, sine)), plus(times(y, cosine), times(x, -sine)), z


@lean
def out(link, local, first):
    """Vector in the carrier's axes, from three components along a link's axes."""
    return plus(
        plus(times(three(link, TURNED), local[first]), times(three(link, TURNED + 3), local[first + 1])),
        times(three(link, TURNED + 6), local[first + 2]),
    )


@lean
def locate(points, count, links, spots):
    """Fill the positions and velocities of all force points from the table rows of ``points``; their forces are set to
    zero. points, links, spots : pointers."""
    for i in range(count):
        of, spot = row(points, PER_POINT, i), row(spots, PER_SPOT, i)
        link = row(links, PER_LINK, int(of[JOINT]))
        place = plus(three(link, PLACE), out(link, of, LOCAL))
        put(spot, WHERE, place)
        put(spot, RATE, plus(three(link, SPEED), cross(three(link, TURNING), place)))
        put(spot, PUSH, (0.0, 0.0, 0.0))


@lean
def push(link, ground, force, place):
    """Add an external force (N) at a position (m) to the body of a link, and to the carrier."""
    twist(link, ground, cross(place, force))
    add(link, PUSHED, force)
    ground[AHEAD] += force[0]
    ground[ASIDE] += force[1]


@lean
def twist(link, ground, moment):
    """Add an external moment (N m) to the body of a link, and to the carrier."""
    add(link, TWISTED, moment)
    ground[TURN] += moment[2]


@lean
def inwards(joints, n, points, count, tree, f):
    """Transfer forces at points and on bodies from the leaves of the tree to the carrier; adds the generalised force of
    each coordinate to ``f``.

    What acts between the vehicle's parts does not push the carrier: it feels what comes from outside, in its axes.
    """
    links, spots = tree.links, tree.spots
    for i in range(count):
        spot, link = row(spots, PER_SPOT, i), row(links, PER_LINK, int(row(points, PER_POINT, i)[JOINT]))
        force = three(spot, PUSH)
        add(link, PUSHED, force)
        add(link, TWISTED, cross(three(spot, WHERE), force))
    j = n - 1
    while j > 2:
        of, link = row(joints, PER_JOINT, j), row(links, PER_LINK, j)
        first = j + 1 - int(of[COUNT])
        if of[KIND] != LOOSE:
            pushed, twisted = three(link, PUSHED), three(link, TWISTED)
            moment = plus(twisted, cross(pushed, three(link, PLACE)))
            for k in range(first, j + 1):
                turns = row(joints, PER_JOINT, k)[KIND] >= 3.0
                f[k] += dot(three(row(links, PER_LINK, k), AXIS), moment if turns else pushed)
            below = row(links, PER_LINK, int(row(joints, PER_JOINT, first)[BELOW]))
            add(below, PUSHED, pushed)
            add(below, TWISTED, twisted)
        j = first - 1
