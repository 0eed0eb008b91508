"""Compiled generalised forces of a free vehicle: springs, bars, tyres, drag and the torques on its wheels.

Weights and inertia are the engine's. A vehicle's numbers are one table of doubles, as ``numbers`` packs them: head,
coordinates, points, spring-dampers and bars, tyres, controls, waves of the road, net of the patch, curves. What is
worked out on the way lies on the stack: no array is made.

The road is a height zeta(x, y) that stands still in space; with h how far a tyre's point has risen, a tyre's elastic
force F0 + k_z (zeta - h) and its damping press along the road's normal, at the wheel's centre, as -dV/dq of the energy
of their spring does: a road that is smooth to the tread does no work. They never pull.

The wheel is a disc of the radius at which its centre is above the road. Where it touches, its velocity on the road is
that of the disc, whose axle turns with the steering; creep forces act there. What holds a wheel's spin, the torque of
its brake, its drive or of the lock that fixes it, holds on to the chassis, or to the towed body that carries it.
"""

import math

from models.contact.fastsim_many import LOAD, MU, A, B
from models.machine.compiled import lean
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody.moving_vehicle import (
    MovingVehicle,
    Tree,
    WheelContact,
    carried_velocity,
    carrier_frame,
    ground_position,
)
from models.multibody.parts import add_part_forces
from models.multibody.tree import (
    GROUND,
    PER_LINK,
    PER_SPOT,
    PLACE,
    RATE,
    SPEED,
    TURNED,
    TURNING,
    TWISTED,
    WHERE,
    add,
    cross,
    dot,
    inwards,
    locate,
    out,
    outwards,
    plus,
    push,
    put,
    three,
    times,
    twist,
)
from models.tyre.bristles import FIRST_FLEXIBILITY, tyre_forces

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
"""Indices in the head of the table: count of all numbers; counts of coordinates, points, springs and bars, tyres, knots
of each control, road waves; the chassis' last coordinate; drag (N s^2/m^2) and its point of action from
there; cells, strips and middle of the tyre patch's grid; where each section begins."""
STEER, BRAKE, DRIVE, FIRST_PUSH = range(4)
PUSHED_BY, PUSHED_AT, PUSH_AXIS, PER_PUSH = 0, 1, 4, 7
"""Indices of the numbers of an external push: the last coordinate of the pushed body, the point of action from there
(m), the direction in the axes of the carrier. The rows of all pushes, and then their count, stand before the controls,
the last of which are their forces (N)."""
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
    CARRYING,
    TOWED,
    PER_TYRE,
) = range(19)
"""Indices of the numbers of a tyre: coordinates of its wheel and of its spin (-1: fixed); its point; height of that at
rest (m); F0 (N), k_z, c_z; R, b (m), k (N/m^3), mu; shares of steering, brake and drive; inclination (rad); spin
(rad/s) at which the brake's torque is fully developed; last coordinate of the chassis or towed body that carries the
wheel, and whether that is a towed body: then the wheel keeps to the heading of that body's x axis, else to the
carrier's."""
(PRESS, FX, FY, MZ, SLIP_X, SLIP_Y, TREAD, TURN, POWER, STEER_MOMENT, ANGLE, SPIN_TORQUE, REPORTED) = range(13)
"""Columns of a tyre's report: load (N), creep forces and moment on it in its own axes, slip velocities along and across
(m/s), speed of the tread (m/s), rate of turning (1/s), power of the creep forces (W), moment about the steering axis (N
m), steer angle (rad), torque on the wheel by brake and drive (N m)."""
POTENTIAL, DISSIPATED, TORQUE_POWER, STEER_POWER, LEDGER = range(5)
"""Columns of the energy ledger: energy of springs and tyres (J); power (W) of dampers, friction, tyres' dampers, drag
and pushes; of brakes and drive on wheels; of the steering on the wheels."""
CENTRE, DOWN, ROLLING, ACROSS, NORMAL, AXLE, LOADING, PASSING, WAY = *range(0, 24, 3), 24
"""Indices of the geometry of a wheel's contact: its centre, the arm from there to the contact, axes along, across and
normal to the road, axle, force of its load, velocity of its centre (3 each)."""


@lean
def control(numbers, table_index, control_index, knot_count, t):
    """Value and rate (per s) of a steering, brake, drive or push control at a time (s). Its rate is 0 at every knot;
    between knots it follows the smoothest polynomial of degree 5."""
    knots = numbers[table_index + 2 * control_index * knot_count :]
    if t <= knots[0]:
        return knots[knot_count], 0.0
    for i in range(1, knot_count):
        if t < knots[i]:
            span, rise = knots[i] - knots[i - 1], knots[knot_count + i] - knots[knot_count + i - 1]
            u = (t - knots[i - 1]) / span
            grown = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
            return knots[knot_count + i - 1] + rise * grown, rise * 30.0 * (u * (1.0 - u)) ** 2 / span
    return knots[2 * knot_count - 1], 0.0


@lean
def height(waves, wave_count, x, y):
    """Height (m) of the road at x, y (m), and its slopes along x and y: a sum of plane waves."""
    z = along = across = 0.0
    for i in range(0, 4 * wave_count, 4):
        phase = waves[i] * x + waves[i + 1] * y
        cosine, sine = math.cos(phase), math.sin(phase)
        z += waves[i + 2] * cosine + waves[i + 3] * sine
        slope = waves[i + 3] * cosine - waves[i + 2] * sine
        along += waves[i] * slope
        across += waves[i + 1] * slope
    return z, along, across


@lean
def _axle(steer, inclination):
    """Unit vector along the axle, to the left, of a wheel at steer angle ``steer`` and inclination ``inclination``
    (rad)."""
    cosine, sine, level, lean_of = 1.0, 0.0, 1.0, 0.0
    if steer != 0.0:
        cosine, sine = math.cos(steer), math.sin(steer)
    if inclination != 0.0:
        level, lean_of = math.cos(inclination), math.sin(inclination)
    return -sine * level, cosine * level, lean_of


@lean
def _axle_of_towed_wheel(link, axle):
    """Axle of a towed body's wheel, rotated in the road's plane from the carrier's heading to the heading of the x axis
    of ``link``."""
    x, y, _ = three(link, TURNED)
    level = math.sqrt(x * x + y * y)
    return (x * axle[0] - y * axle[1]) / level, (y * axle[0] + x * axle[1]) / level, axle[2]


@lean
def _road_under(waves, wave_count, frame, position):
    """Height (m) of the road, and its upward normal (-dz/dx, -dz/dy, 1), under a position (m) given in the carrier's
    axes."""
    x, y = ground_position(frame, position)
    zeta, dx, dy = height(waves, wave_count, x, y)
    return zeta, (-(frame.cosine * dx + frame.sine * dy), frame.sine * dx - frame.cosine * dy, 1.0)


@lean
def _load(tyre, deflection, rising_speed, ledger):
    """Vertical load (N) of a tyre at a deflection (m) from rest whose centre rises from the road at ``rising_speed``
    (m/s). Adds its energy and power to the ledger."""
    elastic = max(tyre[STATIC] + tyre[VERTICAL] * deflection, 0.0)
    load = max(elastic - tyre[VISCOUS] * rising_speed, 0.0) if elastic > 0.0 else 0.0
    ledger[POTENTIAL] += 0.5 * elastic * elastic / tyre[VERTICAL]
    ledger[DISSIPATED] += (load - elastic) * rising_speed
    return load


@lean
def find_contact(tyre, waves, wave_count, steer, steer_rate, vehicle, wheel):
    """Contact of a tyre with a road of ``wave_count`` waves: fills load, position and sliding velocity in the
    ``WheelContact``.

    steer, steer_rate : the wheel's angle (rad) and its rate; vehicle : ``MovingVehicle``.
    """
    frame, tree, patch, slip = vehicle.frame, vehicle.tree, wheel.patch, wheel.slip
    way, report = wheel.way, wheel.report
    spot, knuckle = row(tree.spots, PER_SPOT, int(tyre[POINT])), row(tree.links, PER_LINK, int(tyre[KNUCKLE]))
    p, turning, axle = three(spot, WHERE), three(knuckle, TURNING), _axle(steer, tyre[INCLINED])
    carrying = row(tree.links, PER_LINK, int(tyre[CARRYING]))
    if tyre[TOWED] != 0.0:
        axle = _axle_of_towed_wheel(carrying, axle)
    passing = plus(three(spot, RATE), carried_velocity(frame, p))
    zeta, upwards = _road_under(waves, wave_count, frame, p)
    load = _load(tyre, zeta - (p[2] - tyre[HEIGHT]), dot(passing, upwards), vehicle.ledger)
    long = math.sqrt(dot(upwards, upwards))
    normal = times(upwards, 1.0 / long)
    along = cross(axle, normal)
    flat = math.sqrt(dot(along, along))
    along = times(along, 1.0 / flat)
    radius = max(p[2] - zeta, 0.0) / (long * flat)
    down = times(plus(times(axle, dot(axle, normal)), times(normal, -1.0)), radius / flat)
    across, rotor = cross(normal, along), int(tyre[ROTOR])
    spin = vehicle.rates[rotor] if rotor >= 0 else dot(three(carrying, TURNING), axle) - dot(turning, axle)
    whole = plus(plus(turning, times(axle, spin)), (0.0, 0.0, frame.yaw_rate + steer_rate))
    sliding = plus(passing, cross(whole, down))
    slip[0], slip[1], slip[2] = dot(sliding, along), dot(sliding, across), dot(whole, normal)
    slip[3] = -spin * dot(cross(axle, down), along)
    pressing = load * long
    patch[A], patch[B] = math.sqrt(tyre[RADIUS] * pressing / tyre[VERTICAL]), tyre[HALF_WIDTH]
    patch[LOAD], patch[MU] = pressing, tyre[GRIP]
    patch[FIRST_FLEXIBILITY] = patch[FIRST_FLEXIBILITY + 1] = patch[FIRST_FLEXIBILITY + 2] = 1.0 / tyre[BRISTLES]
    report[PRESS], report[ANGLE] = pressing, steer
    report[SLIP_X], report[SLIP_Y], report[TURN], report[TREAD] = slip[0], slip[1], slip[2], slip[3]
    put(way, CENTRE, p)
    put(way, DOWN, down)
    put(way, ROLLING, along)
    put(way, ACROSS, across)
    put(way, NORMAL, normal)
    put(way, AXLE, axle)
    put(way, LOADING, times(upwards, load))
    put(way, PASSING, passing)


@lean
def add_creep_forces(tyre, creeping, vehicle, wheel):
    """Add a tyre's load, creep forces and creep moment (3,) to its wheel; the moment about the axle accelerates the
    spin."""
    way, report, ground = wheel.way, wheel.report, vehicle.tree.ground
    knuckle, rotor, axle = row(vehicle.tree.links, PER_LINK, int(tyre[KNUCKLE])), int(tyre[ROTOR]), three(way, AXLE)
    force = plus(times(three(way, ROLLING), creeping[0]), times(three(way, ACROSS), creeping[1]))
    turning = times(three(way, NORMAL), creeping[2])
    moment = plus(cross(three(way, DOWN), force), turning)
    push(knuckle, ground, plus(force, three(way, LOADING)), three(way, CENTRE))
    twist(knuckle, ground, moment)
    torque = dot(axle, moment)
    if rotor >= 0:
        vehicle.forces[rotor] += torque
    else:
        _transfer_torque(torque, axle, knuckle, row(vehicle.tree.links, PER_LINK, int(tyre[CARRYING])))
    report[FX], report[FY], report[MZ], report[STEER_MOMENT] = creeping[0], creeping[1], creeping[2], moment[2]
    report[POWER] = creeping[0] * report[SLIP_X] + creeping[1] * report[SLIP_Y] + creeping[2] * report[TURN]


@lean
def add_wheel_torque(tyre, braking, driving, vehicle, wheel):
    """Add the torque (N m) of brake and drive to a wheel's spin, and the opposite torque to the body that carries the
    wheel."""
    rotor, axle, report = int(tyre[ROTOR]), three(wheel.way, AXLE), wheel.report
    report[SPIN_TORQUE] = 0.0
    if rotor < 0 or (braking == 0.0 and driving == 0.0):
        return
    knuckle = row(vehicle.tree.links, PER_LINK, int(tyre[KNUCKLE]))
    carrying = row(vehicle.tree.links, PER_LINK, int(tyre[CARRYING]))
    spin = vehicle.rates[rotor] + dot(three(knuckle, TURNING), axle) - dot(three(carrying, TURNING), axle)
    report[SPIN_TORQUE] = tyre[DRIVEN] * driving
    if braking != 0.0:
        report[SPIN_TORQUE] -= tyre[BRAKED] * braking * math.tanh(spin / tyre[BRAKE_RATE])
    vehicle.forces[rotor] += report[SPIN_TORQUE]
    vehicle.ledger[TORQUE_POWER] += report[SPIN_TORQUE] * spin
    _transfer_torque(-report[SPIN_TORQUE], axle, knuckle, carrying)


@lean
def _transfer_torque(torque, axle, link, carrier_link):
    """Transfer a torque (N m) about the axle from the link of a wheel's knuckle to the link that carries the wheel."""
    add(link, TWISTED, times(axle, -torque))
    add(carrier_link, TWISTED, times(axle, torque))


@lean
def workspace_size(head):
    """Number of doubles that the workspace for a vehicle's motion and forces needs."""
    return PER_LINK * int(head[JOINTS]) + PER_SPOT * int(head[POINTS]) + GROUND


@lean
def start_forces(numbers, q, v, f, workspace, ledger):
    """Add the forces of all springs, dampers and bars. Returns the ``MovingVehicle``, whose tree lies in ``workspace``.

    numbers : array; q, v, f (n,) and ledger (LEDGER,) : arrays; workspace : pointer to as many doubles as needed.
    """
    n, points, table = int(numbers[JOINTS]), int(numbers[POINTS]), start(numbers)
    spots = beyond(workspace, PER_LINK * n)
    ground = array(beyond(spots, PER_SPOT * points), (GROUND,))
    ground[0] = ground[1] = ground[2] = 0.0
    outwards(beyond(table, HEADER), n, q, v, workspace)
    locate(beyond(table, int(numbers[OF_POINTS])), points, workspace, spots)
    for i in range(LEDGER):
        ledger[i] = 0.0
    ledger[POTENTIAL], ledger[DISSIPATED] = add_part_forces(
        table, int(numbers[OF_PARTS]), int(numbers[PARTS]), workspace, spots, q, v, f
    )
    chassis = row(workspace, PER_LINK, int(numbers[CHASSIS]))
    return MovingVehicle(v, f, ledger, carrier_frame(q, v), Tree(workspace, spots, ground), chassis)


@lean
def finish_forces(numbers, vehicle):
    """Add drag, and all forces gathered on bodies and points, to the vehicle's generalised forces. The power of drag
    goes into the ledger."""
    table, frame, f = start(numbers), vehicle.frame, vehicle.forces
    if numbers[DRAG] != 0.0:
        _drag(numbers, vehicle)
    inwards(
        beyond(table, HEADER),
        int(numbers[JOINTS]),
        beyond(table, int(numbers[OF_POINTS])),
        int(numbers[POINTS]),
        vehicle.tree,
        f,
    )
    ahead, aside, turn = vehicle.tree.ground
    f[0] += frame.cosine * ahead - frame.sine * aside
    f[1] += frame.sine * ahead + frame.cosine * aside
    f[2] += turn


@lean
def _drag(numbers, vehicle):
    """Add aerodynamic drag (N) at the chassis' centre, against its forward motion."""
    chassis, frame = vehicle.chassis, vehicle.frame
    place = plus(three(chassis, PLACE), out(chassis, numbers, DRAG_X))
    speed = plus(three(chassis, SPEED), cross(three(chassis, TURNING), place))
    ahead = speed[0] + frame.forward_speed - frame.yaw_rate * place[1]
    force = -numbers[DRAG] * abs(ahead) * ahead
    vehicle.ledger[DISSIPATED] += force * ahead
    push(chassis, vehicle.tree.ground, (force, 0.0, 0.0), place)


@lean
def _push_from_outside(numbers, t, vehicle):
    """Add the forces of all external pushes, whose directions turn with the vehicle's heading, and their power to the
    ledger."""
    controls, knots, table = int(numbers[OF_KNOTS]), int(numbers[KNOTS]), start(numbers)
    count = int(numbers[controls - 1])
    for i in range(count):
        of = row(beyond(table, controls - 1 - PER_PUSH * count), PER_PUSH, i)
        link = row(vehicle.tree.links, PER_LINK, int(of[PUSHED_BY]))
        force = times(three(of, PUSH_AXIS), control(numbers, controls, FIRST_PUSH + i, knots, t)[0])
        place = plus(three(link, PLACE), out(link, of, PUSHED_AT))
        speed = plus(
            plus(three(link, SPEED), cross(three(link, TURNING), place)), carried_velocity(vehicle.frame, place)
        )
        vehicle.ledger[DISSIPATED] += dot(force, speed)
        push(link, vehicle.tree.ground, force, place)


@lean
def all_forces(numbers, t, q, v, f, report, ledger):
    """Add a vehicle's generalised forces (N, N m) to ``f``, and fill the tyres' report (tyres, REPORTED) and the ledger
    (LEDGER,).

    t : s; q, v : positions and rates of the coordinates (m, rad; m/s, rad/s) in the vehicle's order.
    """
    w, controls, knots, table = int(numbers[TYRES]), int(numbers[OF_KNOTS]), int(numbers[KNOTS]), start(numbers)
    vehicle = start_forces(numbers, q, v, f, doubles(workspace_size(numbers)), ledger)
    steer, steering = control(numbers, controls, STEER, knots, t)
    braking, driving = control(numbers, controls, BRAKE, knots, t)[0], control(numbers, controls, DRIVE, knots, t)[0]
    patches, ways = array(doubles(10 * w), (w, 10)), doubles(WAY * w)
    slips, creeping = array(doubles(4 * w), (w, 4)), array(doubles(4 * w), (w, 4))
    tyres, waves = beyond(table, int(numbers[OF_TYRES])), numbers[int(numbers[OF_WAVES]) :]
    for i in range(w):
        tyre, wheel = row(tyres, PER_TYRE, i), WheelContact(patches[i], slips[i], row(ways, WAY, i), report[i])
        find_contact(tyre, waves, int(numbers[WAVES]), tyre[STEERED] * steer, tyre[STEERED] * steering, vehicle, wheel)
    cells = array(beyond(table, int(numbers[OF_CELLS])), (5, int(numbers[CELLS])))
    strips = array(beyond(table, int(numbers[OF_STRIPS])), (4, int(numbers[STRIPS])))
    tyre_forces(patches, slips, strips, cells, numbers[MIDDLE], creeping)
    for i in range(w):
        tyre, wheel = row(tyres, PER_TYRE, i), WheelContact(patches[i], slips[i], row(ways, WAY, i), report[i])
        add_creep_forces(tyre, creeping[i], vehicle, wheel)
        add_wheel_torque(tyre, braking, driving, vehicle, wheel)
        ledger[STEER_POWER] -= tyre[STEERED] * steering * report[i, STEER_MOMENT]
    _push_from_outside(numbers, t, vehicle)
    finish_forces(numbers, vehicle)


@lean
def forces(numbers, t, q, v, f):
    """Add the generalised forces of a vehicle on its tyres to ``f``. For callbacks: all arguments but the time (s) are
    pointers to doubles."""
    head = array(numbers, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    report, ledger = array(doubles(REPORTED * w), (w, REPORTED)), array(doubles(LEDGER), (LEDGER,))
    all_forces(array(numbers, (int(head[COUNT]),)), t, array(q, (n,)), array(v, (n,)), array(f, (n,)), report, ledger)


@lean
def set_forces(block, t, n):
    """Set ``f`` to the forces of ``forces``. All data lie in one block of doubles at a memory address: f, q and v (n,),
    then the table."""
    f = at(block)
    array(f, (n,))[:] = 0.0
    forces(beyond(f, 3 * n), t, beyond(f, n), beyond(f, 2 * n), f)


@lean
def reports(numbers, times, q, v, tyre_reports, ledgers):
    """Fill the tyres' reports (m, tyres, REPORTED) and energy ledgers (m, LEDGER) of states (m, n) at ``times``
    (m,)."""
    f = array(doubles(q.shape[1]), (q.shape[1],))
    f[:] = 0.0
    for i in range(len(times)):
        all_forces(numbers, times[i], q[i], v[i], f, tyre_reports[i], ledgers[i])
