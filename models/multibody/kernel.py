"""Compiled forces on every coordinate of a free vehicle: springs, bars, tyres, drag and the torques on its wheels.

Weights and inertia are the engine's. A vehicle's numbers are one table of doubles, as ``numbers`` packs them: head,
coordinates, points, spring-dampers and bars, tyres, controls, waves of the road, net of the patch, curves. What is
worked out on the way lies on the stack: no array is made.
"""

import math

from models.machine.compiled import lean
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody.forces import (
    AXLE,
    BRAKE,
    CELLS,
    CHASSIS,
    COUNT,
    DISSIPATED,
    DRAG,
    DRAG_X,
    DRIVE,
    FIRST_PUSH,
    HEADER,
    JOINTS,
    KNOTS,
    LEDGER,
    MIDDLE,
    OF_CELLS,
    OF_KNOTS,
    OF_PARTS,
    OF_POINTS,
    OF_STRIPS,
    OF_TYRES,
    OF_WAVES,
    PARTS,
    PER_PUSH,
    PER_TYRE,
    POINTS,
    POTENTIAL,
    PUSH_AXIS,
    PUSHED_AT,
    PUSHED_BY,
    REPORTED,
    STEER,
    STEER_MOMENT,
    STEER_POWER,
    STEERED,
    STRIPS,
    TO_FRONT,
    TO_LEFT,
    TYRES,
    WAVES,
    WAY,
    YAWING,
    creep,
    touch,
    turn_wheel,
)
from models.multibody.inputs import control
from models.multibody.parts import press
from models.multibody.tree import (
    GROUND,
    PER_LINK,
    PER_SPOT,
    PLACE,
    SPEED,
    TURNING,
    cross,
    dot,
    inwards,
    locate,
    out,
    outwards,
    plus,
    push,
    three,
    times,
)
from models.tyre.bristles import tyre_forces


@lean
def room(head):
    """How many doubles of room a vehicle's tree needs."""
    return PER_LINK * int(head[JOINTS]) + PER_SPOT * int(head[POINTS]) + GROUND


@lean
def enter(numbers, q, v, f, room, ledger):
    """Add the forces of all parts to ``f`` or to the tree. Returns the carrier's frame and the tree, in the ``room``.

    numbers : array; q, v, f (n,) and ledger (LEDGER,) : arrays; room : pointer to as many doubles as needed.
    """
    n, points, table = int(numbers[JOINTS]), int(numbers[POINTS]), start(numbers)
    spots = beyond(room, PER_LINK * n)
    ground = array(beyond(spots, PER_SPOT * points), (GROUND,))
    ground[0] = ground[1] = ground[2] = 0.0
    outwards(beyond(table, HEADER), n, q, v, room)
    locate(beyond(table, int(numbers[OF_POINTS])), points, room, spots)
    for i in range(LEDGER):
        ledger[i] = 0.0
    ledger[POTENTIAL], ledger[DISSIPATED] = press(table, int(numbers[OF_PARTS]), int(numbers[PARTS]), spots, q, v, f)
    cosine, sine = math.cos(q[2]), math.sin(q[2])
    frame = cosine, sine, q[0], q[1], cosine * v[0] + sine * v[1], cosine * v[1] - sine * v[0], v[2]
    return frame, (room, spots, ground)


@lean
def leave(numbers, frame, tree, f, ledger):
    """Drag, and all that was gathered in the tree, added to ``f`` and ledger."""
    table = start(numbers)
    if numbers[DRAG] != 0.0:
        _drag(numbers, frame, tree, ledger)
    inwards(
        beyond(table, HEADER),
        int(numbers[JOINTS]),
        beyond(table, int(numbers[OF_POINTS])),
        int(numbers[POINTS]),
        tree,
        f,
    )
    ahead, aside, turn = tree[2]
    f[0] += frame[0] * ahead - frame[1] * aside
    f[1] += frame[1] * ahead + frame[0] * aside
    f[2] += turn


@lean
def _drag(numbers, frame, tree, ledger):
    """Drag at the chassis' centre, against its motion along the vehicle."""
    own = row(tree[0], PER_LINK, int(numbers[CHASSIS]))
    place = plus(three(own, PLACE), out(own, numbers, DRAG_X))
    ahead = (plus(three(own, SPEED), cross(three(own, TURNING), place)))[0] + frame[4] - frame[6] * place[1]
    force = -numbers[DRAG] * abs(ahead) * ahead
    ledger[DISSIPATED] += force * ahead
    push(own, tree[2], (force, 0.0, 0.0), place)


@lean
def _push_from_outside(numbers, t, frame, tree, ledger):
    """Pushes, which keep to where the vehicle heads."""
    controls, knots, table = int(numbers[OF_KNOTS]), int(numbers[KNOTS]), start(numbers)
    count = int(numbers[controls - 1])
    for i in range(count):
        of = row(beyond(table, controls - 1 - PER_PUSH * count), PER_PUSH, i)
        own = row(tree[0], PER_LINK, int(of[PUSHED_BY]))
        force = times(three(of, PUSH_AXIS), control(numbers, controls, FIRST_PUSH + i, knots, t)[0])
        place = plus(three(own, PLACE), out(own, of, PUSHED_AT))
        passing = (frame[TO_FRONT] - frame[YAWING] * place[1], frame[TO_LEFT] + frame[YAWING] * place[0], 0.0)
        speed = plus(plus(three(own, SPEED), cross(three(own, TURNING), place)), passing)
        ledger[DISSIPATED] += dot(force, speed)
        push(own, tree[2], force, place)


@lean
def all_forces(numbers, t, q, v, f, report, ledger):
    """Add the forces (N, N m) on all coordinates to ``f``; all are arrays, report (tyres, REPORTED), ledger (LEDGER,).

    t : s; q, v : positions and rates of the coordinates (m, rad; m/s, rad/s) in the vehicle's order.
    """
    w, chassis, knots, table = int(numbers[TYRES]), int(numbers[CHASSIS]), int(numbers[KNOTS]), start(numbers)
    frame, tree = enter(numbers, q, v, f, doubles(room(numbers)), ledger)
    steer, steering = control(numbers, int(numbers[OF_KNOTS]), STEER, knots, t)
    braking = control(numbers, int(numbers[OF_KNOTS]), BRAKE, knots, t)[0]
    driving = control(numbers, int(numbers[OF_KNOTS]), DRIVE, knots, t)[0]
    contacts, slides, found, ways = (
        array(doubles(10 * w), (w, 10)),
        array(doubles(4 * w), (w, 4)),
        array(doubles(4 * w), (w, 4)),
        doubles(WAY * w),
    )
    tyres, waves = beyond(table, int(numbers[OF_TYRES])), numbers[int(numbers[OF_WAVES]) :]
    for i in range(w):
        tyre = row(tyres, PER_TYRE, i)
        touch(
            tyre,
            waves,
            int(numbers[WAVES]),
            tyre[STEERED] * steer,
            tyre[STEERED] * steering,
            v,
            chassis,
            frame,
            tree,
            contacts[i],
            slides[i],
            row(ways, WAY, i),
            ledger,
            report[i],
        )
    cells = array(beyond(table, int(numbers[OF_CELLS])), (5, int(numbers[CELLS])))
    strips = array(beyond(table, int(numbers[OF_STRIPS])), (4, int(numbers[STRIPS])))
    tyre_forces(contacts, slides, strips, cells, numbers[MIDDLE], found)
    for i in range(w):
        tyre, way = row(tyres, PER_TYRE, i), row(ways, WAY, i)
        creep(tyre, found[i], way, chassis, f, tree, report[i])
        turn_wheel(tyre, braking, driving, v, three(way, AXLE), chassis, f, tree, ledger, report[i])
        ledger[STEER_POWER] -= tyre[STEERED] * steering * report[i, STEER_MOMENT]
    _push_from_outside(numbers, t, frame, tree, ledger)
    leave(numbers, frame, tree, f, ledger)


@lean
def forces(numbers, t, q, v, f):
    """Add the forces to ``f``, for callbacks: all but the time (s) are pointers to doubles."""
    head = array(numbers, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    report, ledger = array(doubles(REPORTED * w), (w, REPORTED)), array(doubles(LEDGER), (LEDGER,))
    all_forces(array(numbers, (int(head[COUNT]),)), t, array(q, (n,)), array(v, (n,)), array(f, (n,)), report, ledger)


@lean
def set_forces(block, t, n):
    """``forces`` in one block of doubles at an address: f, q and v (n,), and the table; f is cleared before."""
    f = at(block)
    array(f, (n,))[:] = 0.0
    forces(beyond(f, 3 * n), t, beyond(f, n), beyond(f, 2 * n), f)


@lean
def reports(numbers, times, q, v, found, ledgers):
    """Fill reports (m, tyres, REPORTED) and ledgers (m, LEDGER) of states (m, n) at ``times`` (m,)."""
    f = array(doubles(q.shape[1]), (q.shape[1],))
    f[:] = 0.0
    for i in range(len(times)):
        all_forces(numbers, times[i], q[i], v[i], f, found[i], ledgers[i])
