"""Compiled forces on every coordinate of a free vehicle: springs, bars, tyres, drag and the torques on its wheels.

All is computed in the axes of the carrier (see ``models.vehicles.free_vehicle``) by two walks through the tree of
coordinates: outwards for places and velocities, inwards for the forces that were gathered on the way. Weights and
inertia are the engine's. The road is a height zeta(x, y) that stands still in space; with h how far a tyre's point has
risen, a tyre's elastic force F0 + k_z (zeta - h) and its damping press along the road's normal, at the wheel's centre,
as -dV/dq of the energy of their spring does: a road that is smooth to the tread does no work. They never pull.

The wheel is a disc of the radius at which its centre is above the road. Where it touches, its velocity on the road is
that of the disc, whose axle turns with the steering; creep forces act there. What holds a wheel's spin, the torque of
its brake, its drive or of the lock that fixes it, holds on to the chassis.

The numbers of a vehicle are one table of doubles, as ``table`` packs them: head, coordinates, spring-dampers and bars,
tyres, controls, waves of the road, net of the patch.
"""

import math

import numpy as np
from numba import carray

from models.compiled import njit
from models.contact.fastsim_many import LOAD, MU, A, B
from models.contact.stack import at, beyond
from models.handling.inputs import control, height
from models.handling.tyre import FIRST, tyre_forces

(COUNT, JOINTS, PARTS, TYRES, KNOTS, WAVES, CHASSIS, DRAG, DRAG_X, DRAG_Y, DRAG_Z, CELLS, STRIPS, MIDDLE, OF_PARTS,
 OF_TYRES, OF_KNOTS, OF_WAVES, OF_CELLS, OF_STRIPS, HEADER) = range(21)  # fmt: skip
"""Head: count of all numbers; how many coordinates, parts, tyres, knots of a control (three), waves; the chassis' last
coordinate; drag (N s^2/m^2) and its place from there; cells, strips and middle of the net; where each begins."""
KIND, BELOW, ARM, PER_JOINT = 0, 1, 2, 5
(STIFFNESS, DAMPING, HELD, FRICTION, FRICTION_RATE, REST, OWN, OWN_GAIN, POINTS, LENGTH, ON_TRAVEL, ON_RATE,
 FIRST_POINT) = range(13)  # fmt: skip
"""Numbers of a part, as ``SpringDamper`` has them; value of its travel at rest, a coordinate that adds to it; counts of
points, of all numbers, of the hinges of two curves. Then points, and curves: offset, slope, corners and bends."""
JOINT, PLACE, AXIS, PER_POINT = 0, 1, 4, 7
"""A point: the coordinate that moves it last, its place from there, the axis along which it counts."""
(KNUCKLE, ROTOR, AT, HEIGHT, STATIC, VERTICAL, VISCOUS, RADIUS, HALF_WIDTH, BRISTLES, GRIP, STEERED, BRAKED, DRIVEN,
 INCLINED, BRAKE_RATE, PER_TYRE) = (0, 1, 2, *range(5, 19))  # fmt: skip
"""Numbers of a tyre: coordinates of its wheel and of its spin (-1: fixed); place; height of its point at rest (m); F0
(N), k_z, c_z; R, b (m), k (N/m^3), mu; shares of steering, brake and drive; inclination (rad); spin (rad/s) at which
the brake's torque is whole."""
STEER, BRAKE, DRIVE = range(3)
(PRESS, FX, FY, MZ, SLIP_X, SLIP_Y, TREAD, TURN, POWER, STEER_MOMENT, ANGLE, SPIN_TORQUE, REPORTED) = range(13)
"""Columns of a tyre's report: load (N), creep forces and moment on it in its own axes, slip velocities along and
across (m/s), speed of the tread (m/s), turning (1/s), their power (W), moment about the steering axis (N m), steer
angle (rad), torque on the wheel by brake and drive (N m)."""
POTENTIAL, DISSIPATED, TORQUE_POWER, STEER_POWER, LEDGER = range(5)
"""Columns of the ledger: energy of springs and tyres (J); power (W) of dampers, friction, tyres' dampers and drag; of
brakes and drive on wheels; of the steering on the wheels."""


@njit(cache=True, error_model="numpy")
def _outwards(rows, n, q, v, turned, place, axes, speed, turning):
    """Places and rotations of all joints, their axes, and velocities, in the carrier's axes and beside it.

    ``speed`` (n, 3) is the velocity of the body behind a joint where it would pass the carrier's origin. All that is
    filled in must be zeros before.
    """
    for j in range(n):
        row = rows[PER_JOINT * j : PER_JOINT * (j + 1)]
        kind, below = int(row[KIND]), int(row[BELOW])
        if j < 3:  # the carrier's own: zeros but for
            for k in range(3):
                turned[j, k, k] = 1.0
            axes[j, kind % 3] = 1.0
            continue
        for k in range(3):
            axes[j, k] = turned[below, k, kind % 3]
            place[j, k] = place[below, k] + (turned[below, k, 0] * row[ARM] + turned[below, k, 1] * row[ARM + 1]
                                             + turned[below, k, 2] * row[ARM + 2])  # fmt: skip
            turning[j, k], speed[j, k] = turning[below, k], speed[below, k]
            for i in range(3):
                turned[j, k, i] = turned[below, k, i]
        if kind < 3:
            for k in range(3):
                place[j, k] += axes[j, k] * q[j]
                speed[j, k] += axes[j, k] * v[j]
            continue
        one, two = (kind + 1) % 3, (kind + 2) % 3
        cosine, sine = math.cos(q[j]), math.sin(q[j])
        for k in range(3):
            first, second = turned[below, k, one], turned[below, k, two]
            turned[j, k, one], turned[j, k, two] = cosine * first + sine * second, cosine * second - sine * first
            turning[j, k] += axes[j, k] * v[j]
            speed[j, k] += (place[j, (k + 1) % 3] * axes[j, (k + 2) % 3]
                            - place[j, (k + 2) % 3] * axes[j, (k + 1) % 3]) * v[j]  # fmt: skip


@njit(cache=True, error_model="numpy")
def cross(a, b, out):
    """a x b, all (3,)."""
    out[0], out[1], out[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def _point(joint, local, turned, place, speed, turning, p, u):
    """Where a point behind a joint is, and its velocity beside the carrier."""
    for k in range(3):
        p[k] = place[joint, k] + (turned[joint, k, 0] * local[0] + turned[joint, k, 1] * local[1]
                                  + turned[joint, k, 2] * local[2])  # fmt: skip
    cross(turning[joint], p, u)
    for k in range(3):
        u[k] += speed[joint, k]


@njit(cache=True, error_model="numpy")
def _push(joint, force, p, pushed, twisted):
    """A force at a point on the body behind a joint: gathered as force, and as moment about the carrier's origin."""
    for k in range(3):
        pushed[joint, k] += force[k]
        twisted[joint, k] += p[(k + 1) % 3] * force[(k + 2) % 3] - p[(k + 2) % 3] * force[(k + 1) % 3]


@njit(cache=True, error_model="numpy")
def _curve(hinges, count, argument):
    """Force on a curve: offset, slope, then corners and bends."""
    force = hinges[0] + hinges[1] * argument
    for i in range(2, count, 2):
        force += hinges[i + 1] * max(argument - hinges[i], 0.0)
    return force


@njit(cache=True, error_model="numpy")
def _parts(numbers, q, v, f, tree, pushed, twisted, ledger):
    """All spring-dampers and bars."""
    turned, place, _, speed, turning = tree
    p, u, first = np.empty(3), np.empty(3), int(numbers[OF_PARTS])
    push = np.empty(3)
    for _ in range(int(numbers[PARTS])):
        e = numbers[first : first + int(numbers[first + LENGTH])]
        first += len(e)
        own, points = int(e[OWN]), int(e[POINTS])
        travel, rate = -e[REST], 0.0
        if own >= 0:
            travel, rate = travel + e[OWN_GAIN] * q[own], e[OWN_GAIN] * v[own]
        for i in range(points):
            point = e[FIRST_POINT + PER_POINT * i : FIRST_POINT + PER_POINT * (i + 1)]
            _point(int(point[JOINT]), point[PLACE:], turned, place, speed, turning, p, u)
            for k in range(3):
                travel += point[AXIS + k] * p[k]
                rate += point[AXIS + k] * u[k]
        spring = e[HELD] + e[STIFFNESS] * travel
        other = e[DAMPING] * rate
        if e[FRICTION] != 0.0:
            other += e[FRICTION] * math.tanh(rate / e[FRICTION_RATE])
        bent = FIRST_POINT + PER_POINT * points
        if e[ON_TRAVEL] > 0.0:
            other += _curve(e[bent:], int(e[ON_TRAVEL]), travel)
        if e[ON_RATE] > 0.0:
            other += _curve(e[bent + int(e[ON_TRAVEL]) :], int(e[ON_RATE]), rate)
        ledger[POTENTIAL] += (e[HELD] + 0.5 * e[STIFFNESS] * travel) * travel
        ledger[DISSIPATED] -= other * rate
        force = spring + other
        if own >= 0:
            f[own] -= force * e[OWN_GAIN]
        for i in range(points):
            point = e[FIRST_POINT + PER_POINT * i : FIRST_POINT + PER_POINT * (i + 1)]
            joint = int(point[JOINT])
            for k in range(3):
                push[k] = -force * point[AXIS + k]
                p[k] = place[joint, k] + (turned[joint, k, 0] * point[PLACE] + turned[joint, k, 1] * point[PLACE + 1]
                                          + turned[joint, k, 2] * point[PLACE + 2])  # fmt: skip
            _push(joint, push, p, pushed, twisted)


@njit(cache=True, error_model="numpy")
def _touch(numbers, tyre, steer, steering, v, chassis, frame, tree, contact, slide, way, ledger, report):
    """Load of one tyre, and where and how it slides; fills contact, slide and ``way``: wheel's centre, arm to the
    contact, axes along, across and normal, axle, push along the normal, and room for three more (3 each)."""
    turned, place, _, speed, turning = tree
    cosine, sine, x, y, ahead, aside, yawing = frame
    p, c, m, e, u, whole, rim = way[0], way[1], way[4], way[5], way[7], way[8], way[9]
    joint = int(tyre[KNUCKLE])
    _point(joint, tyre[AT:], turned, place, speed, turning, p, u)
    u[0] += ahead - yawing * p[1]
    u[1] += aside + yawing * p[0]
    road = numbers[int(numbers[OF_WAVES]) :]
    zeta, dx, dy = height(road, int(numbers[WAVES]), x + cosine * p[0] - sine * p[1], y + sine * p[0] + cosine * p[1])
    m[0], m[1], m[2] = -(cosine * dx + sine * dy), sine * dx - cosine * dy, 1.0
    elastic = max(tyre[STATIC] + tyre[VERTICAL] * (zeta - (p[2] - tyre[HEIGHT])), 0.0)
    rising = u[0] * m[0] + u[1] * m[1] + u[2]
    load = max(elastic - tyre[VISCOUS] * rising, 0.0) if elastic > 0.0 else 0.0
    ledger[POTENTIAL] += 0.5 * elastic * elastic / tyre[VERTICAL]
    ledger[DISSIPATED] += (load - elastic) * rising
    long = math.sqrt(m[0] * m[0] + m[1] * m[1] + 1.0)
    lean = tyre[INCLINED]
    e[0], e[1], e[2] = -math.sin(steer) * math.cos(lean), math.cos(steer) * math.cos(lean), math.sin(lean)
    for k in range(3):
        way[6, k] = load * m[k]
        m[k] /= long
    cross(e, m, way[2])
    flat = math.sqrt(way[2, 0] ** 2 + way[2, 1] ** 2 + way[2, 2] ** 2)
    upright = e[0] * m[0] + e[1] * m[1] + e[2] * m[2]
    radius = max(p[2] - zeta, 0.0) / (long * flat)
    for k in range(3):
        way[2, k] /= flat
        c[k] = -radius * (m[k] - upright * e[k]) / flat
    cross(m, way[2], way[3])
    rotor = int(tyre[ROTOR])
    spin = v[rotor] if rotor >= 0 else sum_of(turning[chassis], e) - sum_of(turning[joint], e)
    for k in range(3):
        whole[k] = turning[joint, k] + spin * e[k]
    whole[2] += yawing + steering
    cross(whole, c, rim)
    for i in range(2):
        slide[i] = sum_of(u, way[2 + i]) + sum_of(rim, way[2 + i])
    slide[2] = sum_of(whole, m)
    cross(e, c, rim)
    slide[3] = -spin * sum_of(rim, way[2])
    pressing = load * long
    contact[A], contact[B], contact[LOAD], contact[MU] = (
        math.sqrt(tyre[RADIUS] * pressing / tyre[VERTICAL]), tyre[HALF_WIDTH], pressing, tyre[GRIP])  # fmt: skip
    for i in range(3):
        contact[FIRST + i] = 1.0 / tyre[BRISTLES]
    report[PRESS], report[ANGLE] = pressing, steer
    report[SLIP_X], report[SLIP_Y], report[TURN], report[TREAD] = slide[0], slide[1], slide[2], slide[3]


@njit(cache=True, error_model="numpy")
def _copied(numbers, first, table):
    """A table out of the numbers."""
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            table[i, j] = numbers[first + i * table.shape[1] + j]


@njit(cache=True, error_model="numpy")
def sum_of(a, b):
    """a . b, both (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def _creep(tyre, found, way, chassis, f, tree, pushed, twisted, report):
    """Forces of one tyre's contact, and its load, onto its wheel; the moment about the axle onto its spin."""
    joint, rotor = int(tyre[KNUCKLE]), int(tyre[ROTOR])
    p, c, m, e, force, arm, moment = way[0], way[1], way[4], way[5], way[7], way[8], way[9]
    for k in range(3):
        force[k] = found[0] * way[2, k] + found[1] * way[3, k]
        arm[k] = p[k] + c[k]
    cross(c, force, moment)
    for k in range(3):
        moment[k] += found[2] * m[k]
        twisted[joint, k] += found[2] * m[k]
    _push(joint, force, arm, pushed, twisted)
    _push(joint, way[6], p, pushed, twisted)
    torque = sum_of(e, moment)
    if rotor >= 0:
        f[rotor] += torque
    else:
        _hold(torque, e, joint, chassis, twisted)
    report[FX], report[FY], report[MZ], report[STEER_MOMENT] = found[0], found[1], found[2], moment[2]
    report[POWER] = found[0] * report[SLIP_X] + found[1] * report[SLIP_Y] + found[2] * report[TURN]


@njit(cache=True, error_model="numpy")
def _torque(tyre, braking, driving, v, e, chassis, f, turning, twisted, ledger, report):
    """Torque of brake and drive on one wheel, and against it on the chassis."""
    rotor = int(tyre[ROTOR])
    report[SPIN_TORQUE] = 0.0
    if rotor < 0:
        return
    joint = int(tyre[KNUCKLE])
    spin = v[rotor] + sum_of(turning[joint], e) - sum_of(turning[chassis], e)
    report[SPIN_TORQUE] = tyre[DRIVEN] * driving
    if braking != 0.0:
        report[SPIN_TORQUE] -= tyre[BRAKED] * braking * math.tanh(spin / tyre[BRAKE_RATE])
    f[rotor] += report[SPIN_TORQUE]
    ledger[TORQUE_POWER] += report[SPIN_TORQUE] * spin
    _hold(-report[SPIN_TORQUE], e, joint, chassis, twisted)


@njit(cache=True, error_model="numpy")
def _hold(torque, e, joint, chassis, twisted):
    """A torque about the axle from what carries the wheel to the chassis."""
    for k in range(3):
        twisted[joint, k] -= torque * e[k]
        twisted[chassis, k] += torque * e[k]


@njit(cache=True, error_model="numpy")
def enter(numbers, q, v, f, ledger):
    """Add the forces of all parts to ``f``. Returns the carrier's frame, the tree, its forces and moments: none."""
    n = int(numbers[JOINTS])
    turned, place, axes, speed = np.zeros((n, 3, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    turning, pushed, twisted = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    tree = (turned, place, axes, speed, turning)
    rows = numbers[HEADER : HEADER + PER_JOINT * n]
    _outwards(rows, n, q, v, turned, place, axes, speed, turning)
    for i in range(LEDGER):
        ledger[i] = 0.0
    _parts(numbers, q, v, f, tree, pushed, twisted, ledger)
    _inwards(rows, n, place, axes, pushed, twisted, f)
    for k in range(3):  # what acts between the vehicle's parts does not push the carrier
        pushed[2, k] = twisted[2, k] = 0.0
    cosine, sine = math.cos(q[2]), math.sin(q[2])
    frame = (cosine, sine, q[0], q[1], cosine * v[0] + sine * v[1], cosine * v[1] - sine * v[0], v[2])
    return frame, tree, pushed, twisted


@njit(cache=True, error_model="numpy")
def leave(numbers, frame, tree, pushed, twisted, f, ledger):
    """Drag, and what tyres and drag push and twist, added to ``f`` and ledger."""
    n = int(numbers[JOINTS])
    _drag(numbers, int(numbers[CHASSIS]), frame, tree, pushed, twisted, ledger)
    _inwards(numbers[HEADER : HEADER + PER_JOINT * n], n, tree[1], tree[2], pushed, twisted, f)
    f[0] += frame[0] * pushed[2, 0] - frame[1] * pushed[2, 1]
    f[1] += frame[1] * pushed[2, 0] + frame[0] * pushed[2, 1]
    f[2] += twisted[2, 2]


@njit(cache=True, error_model="numpy")
def all_forces(numbers, t, q, v, f, report, ledger):
    """Add the forces (N, N m) on all coordinates to ``f``; all are arrays, report (tyres, REPORTED), ledger (LEDGER,).

    t : s; q, v : positions and rates of the coordinates (m, rad; m/s, rad/s) in the vehicle's order.
    """
    w, chassis, knots = int(numbers[TYRES]), int(numbers[CHASSIS]), int(numbers[KNOTS])
    frame, tree, pushed, twisted = enter(numbers, q, v, f, ledger)
    steer, steering = control(numbers, int(numbers[OF_KNOTS]), STEER, knots, t)
    braking = control(numbers, int(numbers[OF_KNOTS]), BRAKE, knots, t)[0]
    driving = control(numbers, int(numbers[OF_KNOTS]), DRIVE, knots, t)[0]
    contacts, slides, found, ways = np.empty((w, 10)), np.empty((w, 4)), np.empty((w, 4)), np.empty((w, 10, 3))
    tyres = numbers[int(numbers[OF_TYRES]) :]
    for i in range(w):
        tyre = tyres[PER_TYRE * i :]
        _touch(numbers, tyre, tyre[STEERED] * steer, tyre[STEERED] * steering, v, chassis, frame, tree,
               contacts[i], slides[i], ways[i], ledger, report[i])  # fmt: skip
    cells, strips = np.empty((5, int(numbers[CELLS]))), np.empty((4, int(numbers[STRIPS])))
    _copied(numbers, int(numbers[OF_CELLS]), cells)
    _copied(numbers, int(numbers[OF_STRIPS]), strips)
    tyre_forces(contacts, slides, strips, cells, numbers[MIDDLE], found)
    for i in range(w):
        tyre = tyres[PER_TYRE * i :]
        _creep(tyre, found[i], ways[i], chassis, f, tree, pushed, twisted, report[i])
        _torque(tyre, braking, driving, v, ways[i, 5], chassis, f, tree[4], twisted, ledger, report[i])
        ledger[STEER_POWER] -= tyre[STEERED] * steering * report[i, STEER_MOMENT]
    leave(numbers, frame, tree, pushed, twisted, f, ledger)


@njit(cache=True, error_model="numpy")
def _inwards(rows, n, place, axes, pushed, twisted, f):
    """What was gathered on the bodies, from the leaves to the carrier: each coordinate takes its share.

    Nothing is left on the bodies but on the carrier.
    """
    moment = np.empty(3)
    for j in range(n - 1, 2, -1):
        below = int(rows[PER_JOINT * j + BELOW])
        if rows[PER_JOINT * j + KIND] < 3.0:
            f[j] += sum_of(axes[j], pushed[j])
        else:
            cross(place[j], pushed[j], moment)
            f[j] += sum_of(axes[j], twisted[j]) - sum_of(axes[j], moment)
        for k in range(3):
            pushed[below, k] += pushed[j, k]
            twisted[below, k] += twisted[j, k]
            pushed[j, k] = twisted[j, k] = 0.0


@njit(cache=True, error_model="numpy")
def _drag(numbers, chassis, frame, tree, pushed, twisted, ledger):
    """Drag at the chassis' centre, against its motion along the vehicle."""
    turned, place, _, speed, turning = tree
    p, u, force = np.empty(3), np.empty(3), np.zeros(3)
    _point(chassis, numbers[DRAG_X:], turned, place, speed, turning, p, u)
    ahead = u[0] + frame[4] - frame[6] * p[1]
    force[0] = -numbers[DRAG] * abs(ahead) * ahead
    ledger[DISSIPATED] += force[0] * ahead
    _push(chassis, force, p, pushed, twisted)


@njit(cache=True, error_model="numpy")
def forces(numbers, t, q, v, f):
    """Add the forces to ``f``, for callbacks: all but the time (s) are pointers to doubles."""
    head = carray(numbers, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    report, ledger = np.empty((w, REPORTED)), np.empty(LEDGER)
    all_forces(carray(numbers, (int(head[COUNT]),)), t, carray(q, (n,)), carray(v, (n,)), carray(f, (n,)), report,
               ledger)  # fmt: skip


@njit(cache=True, error_model="numpy")
def set_forces(block, t, n):
    """``forces`` in one block of doubles at an address: f, q and v (n,), and the table; f is cleared before."""
    f = at(block)
    carray(f, (n,))[:] = 0.0
    forces(beyond(f, 3 * n), t, beyond(f, n), beyond(f, 2 * n), f)


@njit(cache=True, error_model="numpy")
def reports(numbers, times, q, v, found, ledgers):
    """Fill reports (m, tyres, REPORTED) and ledgers (m, LEDGER) of states (m, n) at ``times`` (m,)."""
    f = np.zeros(q.shape[1])
    for i in range(len(times)):
        all_forces(numbers, times[i], q[i], v[i], f, found[i], ledgers[i])
