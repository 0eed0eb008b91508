"""What the table of a free vehicle holds, and compiled forces on its wheels: tyres, and the torques on their spin.

The road is a height zeta(x, y) that stands still in space; with h how far a tyre's point has risen, a tyre's elastic
force F0 + k_z (zeta - h) and its damping press along the road's normal, at the wheel's centre, as -dV/dq of the energy
of their spring does: a road that is smooth to the tread does no work. They never pull.

The wheel is a disc of the radius at which its centre is above the road. Where it touches, its velocity on the road is
that of the disc, whose axle turns with the steering; creep forces act there. What holds a wheel's spin, the torque of
its brake, its drive or of the lock that fixes it, holds on to the chassis.
"""

import math

from models.contact.fastsim_many import LOAD, MU, A, B
from models.machine.compiled import lean
from models.machine.stack import row
from models.multibody.inputs import height
from models.multibody.tree import (
    PER_LINK,
    PER_SPOT,
    RATE,
    TURNING,
    TWISTED,
    WHERE,
    add,
    cross,
    dot,
    plus,
    push,
    put,
    three,
    times,
    twist,
)
from models.tyre.bristles import FIRST

(
    COUNT,
    JOINTS,
    POINTS,
    PARTS,
    TYRES,
    KNOTS,
    WAVES,
    CHASSIS,
    DRAG,
    DRAG_X,
    DRAG_Y,
    DRAG_Z,
    CELLS,
    STRIPS,
    MIDDLE,
    OF_POINTS,
    OF_PARTS,
    OF_TYRES,
    OF_KNOTS,
    OF_WAVES,
    OF_CELLS,
    OF_STRIPS,
    HEADER,
) = range(23)
"""Head: count of all numbers; how many coordinates, points, parts, tyres, knots of a control (three), waves; the
chassis' last coordinate; drag (N s^2/m^2) and its place from there; cells, strips and middle of the net; where each
begins."""
STEER, BRAKE, DRIVE, FIRST_PUSH = range(4)
PUSHED_BY, PUSHED_AT, PUSH_AXIS, PER_PUSH = 0, 1, 4, 7
"""Of a push from outside: the coordinate that moves its body last, its place from there (m), its axis in the frame of
the carrier. These rows, and then their count, stand before the controls, the last of which are their forces (N)."""
(
    KNUCKLE,
    ROTOR,
    POINT,
    HEIGHT,
    STATIC,
    VERTICAL,
    VISCOUS,
    RADIUS,
    HALF_WIDTH,
    BRISTLES,
    GRIP,
    STEERED,
    BRAKED,
    DRIVEN,
    INCLINED,
    BRAKE_RATE,
    PER_TYRE,
) = range(17)
"""Numbers of a tyre: coordinates of its wheel and of its spin (-1: fixed); its point; height of that at rest (m); F0
(N), k_z, c_z; R, b (m), k (N/m^3), mu; shares of steering, brake and drive; inclination (rad); spin (rad/s) at which
the brake's torque is whole."""
(PRESS, FX, FY, MZ, SLIP_X, SLIP_Y, TREAD, TURN, POWER, STEER_MOMENT, ANGLE, SPIN_TORQUE, REPORTED) = range(13)
"""Columns of a tyre's report: load (N), creep forces and moment on it in its own axes, slip velocities along and
across (m/s), speed of the tread (m/s), turning (1/s), their power (W), moment about the steering axis (N m), steer
angle (rad), torque on the wheel by brake and drive (N m)."""
POTENTIAL, DISSIPATED, TORQUE_POWER, STEER_POWER, LEDGER = range(5)
"""Columns of the ledger: energy of springs and tyres (J); power (W) of dampers, friction, tyres' dampers, drag and
pushes; of brakes and drive on wheels; of the steering on the wheels."""
CENTRE, DOWN, ROLLING, ACROSS, NORMAL, AXLE, LOADING, PASSING, WAY = *range(0, 24, 3), 24
"""Of a wheel's way: its centre, the arm from there to the contact, axes along, across and normal to the road, axle,
force of its load, velocity of its centre (3 each)."""
COSINE, SINE, X, Y, TO_FRONT, TO_LEFT, YAWING = range(7)
"""Of the carrier's frame: direction and place in space, its velocity along its own axes (m/s), its turning (rad/s)."""


@lean
def _axle(steer, inclined):
    """Axis of a wheel that is steered and leans, to its left."""
    cosine, sine, level, lean_of = 1.0, 0.0, 1.0, 0.0
    if steer != 0.0:
        cosine, sine = math.cos(steer), math.sin(steer)
    if inclined != 0.0:
        level, lean_of = math.cos(inclined), math.sin(inclined)
    return -sine * level, cosine * level, lean_of


@lean
def touch(tyre, waves, count, steer, steering, v, chassis, frame, tree, contact, slide, way, ledger, report):
    """How a tyre presses on a road of ``count`` waves, and where and how it slides.

    steer, steering : the wheel's angle (rad) and its rate; contact (10,), slide (4,), way (WAY,), report are filled.
    """
    spot, own = row(tree[1], PER_SPOT, int(tyre[POINT])), row(tree[0], PER_LINK, int(tyre[KNUCKLE]))
    p, turning, axle = three(spot, WHERE), three(own, TURNING), _axle(steer, tyre[INCLINED])
    passing = plus(
        three(spot, RATE), (frame[TO_FRONT] - frame[YAWING] * p[1], frame[TO_LEFT] + frame[YAWING] * p[0], 0.0)
    )
    zeta, dx, dy = height(
        waves,
        count,
        frame[X] + frame[COSINE] * p[0] - frame[SINE] * p[1],
        frame[Y] + frame[SINE] * p[0] + frame[COSINE] * p[1],
    )
    upwards = -(frame[COSINE] * dx + frame[SINE] * dy), frame[SINE] * dx - frame[COSINE] * dy, 1.0
    elastic, rising = max(tyre[STATIC] + tyre[VERTICAL] * (zeta - (p[2] - tyre[HEIGHT])), 0.0), dot(passing, upwards)
    load = max(elastic - tyre[VISCOUS] * rising, 0.0) if elastic > 0.0 else 0.0
    ledger[POTENTIAL] += 0.5 * elastic * elastic / tyre[VERTICAL]
    ledger[DISSIPATED] += (load - elastic) * rising
    long = math.sqrt(dot(upwards, upwards))
    normal = times(upwards, 1.0 / long)
    along = cross(axle, normal)
    flat = math.sqrt(dot(along, along))
    along = times(along, 1.0 / flat)
    radius = max(p[2] - zeta, 0.0) / (long * flat)
    down = times(plus(times(axle, dot(axle, normal)), times(normal, -1.0)), radius / flat)
    across, rotor = cross(normal, along), int(tyre[ROTOR])
    spin = v[rotor] if rotor >= 0 else dot(three(row(tree[0], PER_LINK, chassis), TURNING), axle) - dot(turning, axle)
    whole = plus(plus(turning, times(axle, spin)), (0.0, 0.0, frame[YAWING] + steering))
    sliding = plus(passing, cross(whole, down))
    slide[0], slide[1], slide[2] = dot(sliding, along), dot(sliding, across), dot(whole, normal)
    slide[3] = -spin * dot(cross(axle, down), along)
    pressing = load * long
    contact[A], contact[B], contact[LOAD], contact[MU] = (
        math.sqrt(tyre[RADIUS] * pressing / tyre[VERTICAL]),
        tyre[HALF_WIDTH],
        pressing,
        tyre[GRIP],
    )
    contact[FIRST] = contact[FIRST + 1] = contact[FIRST + 2] = 1.0 / tyre[BRISTLES]
    report[PRESS], report[ANGLE] = pressing, steer
    report[SLIP_X], report[SLIP_Y], report[TURN], report[TREAD] = slide[0], slide[1], slide[2], slide[3]
    put(way, CENTRE, p)
    put(way, DOWN, down)
    put(way, ROLLING, along)
    put(way, ACROSS, across)
    put(way, NORMAL, normal)
    put(way, AXLE, axle)
    put(way, LOADING, times(upwards, load))
    put(way, PASSING, passing)


@lean
def creep(tyre, found, way, chassis, f, tree, report):
    """Forces ``found`` of one tyre's contact, and its load, onto its wheel; the moment about the axle onto its spin."""
    own, rotor, ground, centre, axle = (
        row(tree[0], PER_LINK, int(tyre[KNUCKLE])),
        int(tyre[ROTOR]),
        tree[2],
        three(way, CENTRE),
        three(way, AXLE),
    )
    force = plus(times(three(way, ROLLING), found[0]), times(three(way, ACROSS), found[1]))
    turning = times(three(way, NORMAL), found[2])
    moment = plus(cross(three(way, DOWN), force), turning)
    push(own, ground, plus(force, three(way, LOADING)), centre)
    twist(own, ground, moment)
    torque = dot(axle, moment)
    if rotor >= 0:
        f[rotor] += torque
    else:
        _hold(torque, axle, own, row(tree[0], PER_LINK, chassis))
    report[FX], report[FY], report[MZ], report[STEER_MOMENT] = found[0], found[1], found[2], moment[2]
    report[POWER] = found[0] * report[SLIP_X] + found[1] * report[SLIP_Y] + found[2] * report[TURN]


@lean
def turn_wheel(tyre, braking, driving, v, axle, chassis, f, tree, ledger, report):
    """Torque of brake and drive on one wheel, and against it on the chassis."""
    rotor = int(tyre[ROTOR])
    report[SPIN_TORQUE] = 0.0
    if rotor < 0 or (braking == 0.0 and driving == 0.0):
        return
    own, carrying = row(tree[0], PER_LINK, int(tyre[KNUCKLE])), row(tree[0], PER_LINK, chassis)
    spin = v[rotor] + dot(three(own, TURNING), axle) - dot(three(carrying, TURNING), axle)
    report[SPIN_TORQUE] = tyre[DRIVEN] * driving
    if braking != 0.0:
        report[SPIN_TORQUE] -= tyre[BRAKED] * braking * math.tanh(spin / tyre[BRAKE_RATE])
    f[rotor] += report[SPIN_TORQUE]
    ledger[TORQUE_POWER] += report[SPIN_TORQUE] * spin
    _hold(-report[SPIN_TORQUE], axle, own, carrying)


@lean
def _hold(torque, axle, own, carrying):
    """A torque about the axle from what carries the wheel to the chassis."""
    add(own, TWISTED, times(axle, -torque))
    add(carrying, TWISTED, times(axle, torque))
