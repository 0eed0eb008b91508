"""The tree of a free vehicle's coordinates, walked outwards for places and velocities and inwards for forces, compiled.

All is in the axes of the carrier (see ``models.vehicles.free_vehicle``), the first three coordinates. A link is a row
of numbers for each coordinate, a spot one for each point where something acts; both lie in a room that the caller has
on its stack, together with what pushes the carrier from outside. Nothing here makes an array.
"""

import math

from models.compiled import lean
from models.contact.stack import row

KIND, BELOW, ARM, PER_JOINT = 0, 1, 2, 5
"""Of a coordinate in the table, as ``joints`` has it; ``LOOSE``: a kind that turns, and carries no point."""
LOOSE = 6.0
JOINT, LOCAL, PER_POINT = 0, 1, 4
"""Of a point in the table: the coordinate that moves it last, its place from there (m)."""
TURNED, PLACE, AXIS, SPEED, TURNING, PUSHED, TWISTED, PER_LINK = 0, 9, 12, 15, 18, 21, 24, 27
"""Of a link: rotation, row by row; joint; its axis; velocity of the body behind it where that would pass the carrier's
origin, beside the carrier, and its turning; force that was gathered there, and its moment about the carrier's origin.
"""
WHERE, RATE, PUSH, PER_SPOT = 0, 3, 6, 9
"""Of a spot: its place, its velocity beside the carrier, the force there."""
AHEAD, ASIDE, TURN, GROUND = 0, 1, 2, 3
"""Forces and moment on the carrier."""


@lean
def three(numbers, first):
    """Three of an array, as a tuple."""
    return numbers[first], numbers[first + 1], numbers[first + 2]


@lean
def dot(a, b):
    """a . b of tuples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@lean
def cross(a, b):
    """a x b of tuples."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@lean
def times(a, factor):
    """A tuple by a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


@lean
def plus(a, b):
    """Sum of tuples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@lean
def put(numbers, first, a):
    """Write a tuple into an array."""
    numbers[first], numbers[first + 1], numbers[first + 2] = a


@lean
def add(numbers, first, a):
    """Add a tuple to three of an array."""
    numbers[first] += a[0]
    numbers[first + 1] += a[1]
    numbers[first + 2] += a[2]


@lean
def outwards(joints, n, q, v, links):
    """Fill all links of ``joints``, the table's rows at a pointer; no forces yet."""
    for j in range(n):
        of, own = row(joints, PER_JOINT, j), row(links, PER_LINK, j)
        if j < 3:
            _begin(own, int(of[KIND]) % 3)
        elif of[KIND] != LOOSE:
            _follow(of, row(links, PER_LINK, int(of[BELOW])), q[j], v[j], own)


@lean
def _begin(own, axis):
    """The carrier's own: zeros but for directions."""
    for k in range(PER_LINK):
        own[k] = 0.0
    own[TURNED], own[TURNED + 4], own[TURNED + 8] = 1.0, 1.0, 1.0
    own[AXIS + axis] = 1.0


@lean
def _follow(of, below, position, rate, own):
    """A link, from that below it."""
    kind = int(of[KIND])
    along = kind if kind < 3 else kind - 3
    axis = below[TURNED + along], below[TURNED + 3 + along], below[TURNED + 6 + along]
    place, speed, turning = plus(three(below, PLACE), out(below, of, ARM)), three(below, SPEED), three(below, TURNING)
    for k in range(9):
        own[TURNED + k] = below[TURNED + k]
    if kind < 3:
        place, speed = plus(place, times(axis, position)), plus(speed, times(axis, rate))
    else:
        _turn(own, along, position)
        turning, speed = plus(turning, times(axis, rate)), plus(speed, times(cross(place, axis), rate))
    put(own, PLACE, place)
    put(own, AXIS, axis)
    put(own, SPEED, speed)
    put(own, TURNING, turning)
    put(own, PUSHED, (0.0, 0.0, 0.0))
    put(own, TWISTED, (0.0, 0.0, 0.0))


@lean
def out(own, local, first):
    """Three numbers along a link's axes as a vector of the carrier's."""
    x, y, z = three(local, first)
    return (own[TURNED] * x + own[TURNED + 1] * y + own[TURNED + 2] * z,
            own[TURNED + 3] * x + own[TURNED + 4] * y + own[TURNED + 5] * z,
            own[TURNED + 6] * x + own[TURNED + 7] * y + own[TURNED + 8] * z)  # fmt: skip


@lean
def _turn(own, axis, angle):
    """Turn a link's axes about one of them."""
    one, two = TURNED + (axis + 1 if axis < 2 else 0), TURNED + (axis + 2 if axis < 1 else axis - 1)
    cosine, sine = math.cos(angle), math.sin(angle)
    for k in range(0, 9, 3):
        first, second = own[one + k], own[two + k]
        own[one + k], own[two + k] = cosine * first + sine * second, cosine * second - sine * first


@lean
def locate(points, count, links, spots):
    """Fill all spots of ``points``, the table's rows at a pointer; no forces yet."""
    for i in range(count):
        of, spot = row(points, PER_POINT, i), row(spots, PER_SPOT, i)
        own = row(links, PER_LINK, int(of[JOINT]))
        place = plus(three(own, PLACE), out(own, of, LOCAL))
        put(spot, WHERE, place)
        put(spot, RATE, plus(three(own, SPEED), cross(three(own, TURNING), place)))
        put(spot, PUSH, (0.0, 0.0, 0.0))


@lean
def push(own, ground, force, place):
    """A force from outside at a place on the body behind a link."""
    twist(own, ground, cross(place, force))
    add(own, PUSHED, force)
    ground[AHEAD] += force[0]
    ground[ASIDE] += force[1]


@lean
def twist(own, ground, moment):
    """A moment from outside on the body behind a link."""
    add(own, TWISTED, moment)
    ground[TURN] += moment[2]


@lean
def inwards(joints, n, points, count, tree, f):
    """Forces at spots and on links, from the leaves to the carrier: each coordinate adds its share to ``f``.

    What acts between the vehicle's parts does not push the carrier: it feels what comes from outside, in its axes.
    """
    links, spots, _ = tree
    for i in range(count):
        spot, own = row(spots, PER_SPOT, i), row(links, PER_LINK, int(row(points, PER_POINT, i)[JOINT]))
        force = three(spot, PUSH)
        add(own, PUSHED, force)
        add(own, TWISTED, cross(three(spot, WHERE), force))
    for j in range(n - 1, 2, -1):
        of, own = row(joints, PER_JOINT, j), row(links, PER_LINK, j)
        if of[KIND] == LOOSE:
            continue
        pushed, twisted = three(own, PUSHED), three(own, TWISTED)
        if of[KIND] < 3.0:
            f[j] += dot(three(own, AXIS), pushed)
        else:
            f[j] += dot(three(own, AXIS), twisted) - dot(three(own, AXIS), cross(three(own, PLACE), pushed))
        below = row(links, PER_LINK, int(of[BELOW]))
        add(below, PUSHED, pushed)
        add(below, TWISTED, twisted)
