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
    BodyTree,
    MovingVehicle,
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
    add_body_force,
    add_body_moment,
    add_three,
    cross,
    dot,
    gather_forces_inwards,
    locate_points,
    move_outwards,
    plus,
    put_three,
    three_from,
    times,
    vector_in_carrier_axes,
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
def control_value_and_rate(parameter_table, first_index, control_index, knot_count, t):
    """Value and rate (per s) of a steering, brake, drive or push control at a time (s). Its rate is 0 at every knot;
    between knots it follows the smoothest polynomial of degree 5."""
    knots = parameter_table[first_index + 2 * control_index * knot_count :]
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
def road_height_and_slopes(road_waves, wave_count, x, y):
    """Height (m) of the road at x, y (m), and its slopes along x and y: a sum of plane waves."""
    z = along = across = 0.0
    for i in range(0, 4 * wave_count, 4):
        phase = road_waves[i] * x + road_waves[i + 1] * y
        cosine, sine = math.cos(phase), math.sin(phase)
        z += road_waves[i + 2] * cosine + road_waves[i + 3] * sine
        slope = road_waves[i + 3] * cosine - road_waves[i + 2] * sine
        along += road_waves[i] * slope
        across += road_waves[i + 1] * slope
    return z, along, across


@lean
def _axle_vector(steer_angle, wheel_inclination):
    """Unit vector along the axle, to the left, of a wheel at steer angle ``steer_angle`` and inclination
    ``wheel_inclination`` (rad)."""
    cosine, sine, level, lean_of = 1.0, 0.0, 1.0, 0.0
    if steer_angle != 0.0:
        cosine, sine = math.cos(steer_angle), math.sin(steer_angle)
    if wheel_inclination != 0.0:
        level, lean_of = math.cos(wheel_inclination), math.sin(wheel_inclination)
    return -sine * level, cosine * level, lean_of


@lean
def _axle_of_towed_wheel(carrier_link, axle):
    """Axle of a towed body's wheel, rotated in the road's plane from the carrier's heading to the heading of the x axis
    of ``carrier_link``."""
    x, y, _ = three_from(carrier_link, TURNED)
    level = math.sqrt(x * x + y * y)
    return (x * axle[0] - y * axle[1]) / level, (y * axle[0] + x * axle[1]) / level, axle[2]


@lean
def _road_under(road_waves, wave_count, moving_frame, position):
    """Height (m) of the road, and its upward normal (-dz/dx, -dz/dy, 1), under a position (m) given in the carrier's
    axes."""
    x, y = ground_position(moving_frame, position)
    zeta, dx, dy = road_height_and_slopes(road_waves, wave_count, x, y)
    return zeta, (
        -(moving_frame.cosine * dx + moving_frame.sine * dy),
        moving_frame.sine * dx - moving_frame.cosine * dy,
        1.0,
    )


@lean
def _tyre_load(tyre_row, deflection, rising_speed, energy_ledger):
    """Vertical load (N) of a tyre at a deflection (m) from rest whose centre rises from the road at ``rising_speed``
    (m/s). Adds its energy and power to the ledger."""
    elastic = max(tyre_row[STATIC] + tyre_row[VERTICAL] * deflection, 0.0)
    load = max(elastic - tyre_row[VISCOUS] * rising_speed, 0.0) if elastic > 0.0 else 0.0
    energy_ledger[POTENTIAL] += 0.5 * elastic * elastic / tyre_row[VERTICAL]
    energy_ledger[DISSIPATED] += (load - elastic) * rising_speed
    return load


@lean
def find_contact(tyre_row, road_waves, wave_count, steer_angle, steer_rate, moving_vehicle, wheel_contact):
    """Contact of a tyre with a road of ``wave_count`` waves: fills load, position and sliding velocity in the
    ``WheelContact``.

    steer_angle, steer_rate : the wheel's angle (rad) and its rate; moving_vehicle : ``MovingVehicle``.
    """
    frame, tree, patch, slip = moving_vehicle.frame, moving_vehicle.tree, wheel_contact.patch, wheel_contact.slip
    way, report = wheel_contact.way, wheel_contact.report
    spot, knuckle = row(tree.spots, PER_SPOT, int(tyre_row[POINT])), row(tree.links, PER_LINK, int(tyre_row[KNUCKLE]))
    p, turning, axle = (
        three_from(spot, WHERE),
        three_from(knuckle, TURNING),
        _axle_vector(steer_angle, tyre_row[INCLINED]),
    )
    carrying = row(tree.links, PER_LINK, int(tyre_row[CARRYING]))
    if tyre_row[TOWED] != 0.0:
        axle = _axle_of_towed_wheel(carrying, axle)
    passing = plus(three_from(spot, RATE), carried_velocity(frame, p))
    zeta, upwards = _road_under(road_waves, wave_count, frame, p)
    load = _tyre_load(tyre_row, zeta - (p[2] - tyre_row[HEIGHT]), dot(passing, upwards), moving_vehicle.ledger)
    long = math.sqrt(dot(upwards, upwards))
    normal = times(upwards, 1.0 / long)
    along = cross(axle, normal)
    flat = math.sqrt(dot(along, along))
    along = times(along, 1.0 / flat)
    radius = max(p[2] - zeta, 0.0) / (long * flat)
    down = times(plus(times(axle, dot(axle, normal)), times(normal, -1.0)), radius / flat)
    across, rotor = cross(normal, along), int(tyre_row[ROTOR])
    spin = moving_vehicle.rates[rotor] if rotor >= 0 else dot(three_from(carrying, TURNING), axle) - dot(turning, axle)
    whole = plus(plus(turning, times(axle, spin)), (0.0, 0.0, frame.yaw_rate + steer_rate))
    sliding = plus(passing, cross(whole, down))
    slip[0], slip[1], slip[2] = dot(sliding, along), dot(sliding, across), dot(whole, normal)
    slip[3] = -spin * dot(cross(axle, down), along)
    pressing = load * long
    patch[A], patch[B] = math.sqrt(tyre_row[RADIUS] * pressing / tyre_row[VERTICAL]), tyre_row[HALF_WIDTH]
    patch[LOAD], patch[MU] = pressing, tyre_row[GRIP]
    patch[FIRST_FLEXIBILITY] = patch[FIRST_FLEXIBILITY + 1] = patch[FIRST_FLEXIBILITY + 2] = 1.0 / tyre_row[BRISTLES]
    report[PRESS], report[ANGLE] = pressing, steer_angle
    report[SLIP_X], report[SLIP_Y], report[TURN], report[TREAD] = slip[0], slip[1], slip[2], slip[3]
    put_three(way, CENTRE, p)
    put_three(way, DOWN, down)
    put_three(way, ROLLING, along)
    put_three(way, ACROSS, across)
    put_three(way, NORMAL, normal)
    put_three(way, AXLE, axle)
    put_three(way, LOADING, times(upwards, load))
    put_three(way, PASSING, passing)


@lean
def add_creep_forces(tyre_row, creep_forces, moving_vehicle, wheel_contact):
    """Add a tyre's load, creep forces and creep moment (3,) to its wheel; the moment about the axle accelerates the
    spin."""
    way, report, ground = wheel_contact.way, wheel_contact.report, moving_vehicle.tree.ground
    knuckle, rotor, axle = (
        row(moving_vehicle.tree.links, PER_LINK, int(tyre_row[KNUCKLE])),
        int(tyre_row[ROTOR]),
        three_from(way, AXLE),
    )
    force = plus(times(three_from(way, ROLLING), creep_forces[0]), times(three_from(way, ACROSS), creep_forces[1]))
    turning = times(three_from(way, NORMAL), creep_forces[2])
    moment = plus(cross(three_from(way, DOWN), force), turning)
    add_body_force(knuckle, ground, plus(force, three_from(way, LOADING)), three_from(way, CENTRE))
    add_body_moment(knuckle, ground, moment)
    torque = dot(axle, moment)
    if rotor >= 0:
        moving_vehicle.forces[rotor] += torque
    else:
        _transfer_torque(torque, axle, knuckle, row(moving_vehicle.tree.links, PER_LINK, int(tyre_row[CARRYING])))
    report[FX], report[FY], report[MZ], report[STEER_MOMENT] = (
        creep_forces[0],
        creep_forces[1],
        creep_forces[2],
        moment[2],
    )
    report[POWER] = creep_forces[0] * report[SLIP_X] + creep_forces[1] * report[SLIP_Y] + creep_forces[2] * report[TURN]


@lean
def add_wheel_torque(tyre_row, brake_torque, drive_torque, moving_vehicle, wheel_contact):
    """Add the torque (N m) of brake and drive to a wheel's spin, and the opposite torque to the body that carries the
    wheel."""
    rotor, axle, report = int(tyre_row[ROTOR]), three_from(wheel_contact.way, AXLE), wheel_contact.report
    report[SPIN_TORQUE] = 0.0
    if rotor < 0 or (brake_torque == 0.0 and drive_torque == 0.0):
        return
    knuckle = row(moving_vehicle.tree.links, PER_LINK, int(tyre_row[KNUCKLE]))
    carrying = row(moving_vehicle.tree.links, PER_LINK, int(tyre_row[CARRYING]))
    spin = (
        moving_vehicle.rates[rotor] + dot(three_from(knuckle, TURNING), axle) - dot(three_from(carrying, TURNING), axle)
    )
    report[SPIN_TORQUE] = tyre_row[DRIVEN] * drive_torque
    if brake_torque != 0.0:
        report[SPIN_TORQUE] -= tyre_row[BRAKED] * brake_torque * math.tanh(spin / tyre_row[BRAKE_RATE])
    moving_vehicle.forces[rotor] += report[SPIN_TORQUE]
    moving_vehicle.ledger[TORQUE_POWER] += report[SPIN_TORQUE] * spin
    _transfer_torque(-report[SPIN_TORQUE], axle, knuckle, carrying)


@lean
def _transfer_torque(torque, axle, knuckle_link, carrier_link):
    """Transfer a torque (N m) about the axle from the link of a wheel's knuckle to the link that carries the wheel."""
    add_three(knuckle_link, TWISTED, times(axle, -torque))
    add_three(carrier_link, TWISTED, times(axle, torque))


@lean
def workspace_size(table_head):
    """Number of doubles that the workspace for a vehicle's motion and forces needs."""
    return PER_LINK * int(table_head[JOINTS]) + PER_SPOT * int(table_head[POINTS]) + GROUND


@lean
def start_forces(parameter_table, q, v, generalised_forces, workspace, energy_ledger):
    """Add the forces of all springs, dampers and bars. Returns the ``MovingVehicle``, whose tree lies in ``workspace``.

    parameter_table : array; q, v, generalised_forces (n,) and energy_ledger (LEDGER,) : arrays; workspace : pointer to
    as many doubles as needed."""
    n, points, table = int(parameter_table[JOINTS]), int(parameter_table[POINTS]), start(parameter_table)
    spots = beyond(workspace, PER_LINK * n)
    ground = array(beyond(spots, PER_SPOT * points), (GROUND,))
    ground[0] = ground[1] = ground[2] = 0.0
    move_outwards(beyond(table, HEADER), n, q, v, workspace)
    locate_points(beyond(table, int(parameter_table[OF_POINTS])), points, workspace, spots)
    for i in range(LEDGER):
        energy_ledger[i] = 0.0
    energy_ledger[POTENTIAL], energy_ledger[DISSIPATED] = add_part_forces(
        table, int(parameter_table[OF_PARTS]), int(parameter_table[PARTS]), workspace, spots, q, v, generalised_forces
    )
    chassis = row(workspace, PER_LINK, int(parameter_table[CHASSIS]))
    return MovingVehicle(
        v, generalised_forces, energy_ledger, carrier_frame(q, v), BodyTree(workspace, spots, ground), chassis
    )


@lean
def finish_forces(parameter_table, moving_vehicle):
    """Add drag, and all forces gathered on bodies and points, to the vehicle's generalised forces. The power of drag
    goes into the ledger."""
    table, frame, f = start(parameter_table), moving_vehicle.frame, moving_vehicle.forces
    if parameter_table[DRAG] != 0.0:
        _add_drag(parameter_table, moving_vehicle)
    gather_forces_inwards(
        beyond(table, HEADER),
        int(parameter_table[JOINTS]),
        beyond(table, int(parameter_table[OF_POINTS])),
        int(parameter_table[POINTS]),
        moving_vehicle.tree,
        f,
    )
    ahead, aside, turn = moving_vehicle.tree.ground
    f[0] += frame.cosine * ahead - frame.sine * aside
    f[1] += frame.sine * ahead + frame.cosine * aside
    f[2] += turn


@lean
def _add_drag(parameter_table, moving_vehicle):
    """Add aerodynamic drag (N) at the chassis' centre, against its forward motion."""
    chassis, frame = moving_vehicle.chassis, moving_vehicle.frame
    place = plus(three_from(chassis, PLACE), vector_in_carrier_axes(chassis, parameter_table, DRAG_X))
    speed = plus(three_from(chassis, SPEED), cross(three_from(chassis, TURNING), place))
    ahead = speed[0] + frame.forward_speed - frame.yaw_rate * place[1]
    force = -parameter_table[DRAG] * abs(ahead) * ahead
    moving_vehicle.ledger[DISSIPATED] += force * ahead
    add_body_force(chassis, moving_vehicle.tree.ground, (force, 0.0, 0.0), place)


@lean
def _add_external_pushes(parameter_table, t, moving_vehicle):
    """Add the forces of all external pushes, whose directions turn with the vehicle's heading, and their power to the
    ledger."""
    controls, knots, table = int(parameter_table[OF_KNOTS]), int(parameter_table[KNOTS]), start(parameter_table)
    count = int(parameter_table[controls - 1])
    for i in range(count):
        of = row(beyond(table, controls - 1 - PER_PUSH * count), PER_PUSH, i)
        link = row(moving_vehicle.tree.links, PER_LINK, int(of[PUSHED_BY]))
        force = times(
            three_from(of, PUSH_AXIS), control_value_and_rate(parameter_table, controls, FIRST_PUSH + i, knots, t)[0]
        )
        place = plus(three_from(link, PLACE), vector_in_carrier_axes(link, of, PUSHED_AT))
        speed = plus(
            plus(three_from(link, SPEED), cross(three_from(link, TURNING), place)),
            carried_velocity(moving_vehicle.frame, place),
        )
        moving_vehicle.ledger[DISSIPATED] += dot(force, speed)
        add_body_force(link, moving_vehicle.tree.ground, force, place)


@lean
def all_forces(parameter_table, t, q, v, generalised_forces, tyre_report, energy_ledger):
    """Add a vehicle's generalised forces (N, N m) to ``generalised_forces``, and fill the tyres' report (tyres,
    REPORTED) and the ledger (LEDGER,).

    t : s; q, v : positions and rates of the coordinates (m, rad; m/s, rad/s) in the vehicle's order.
    """
    w, controls, knots, table = (
        int(parameter_table[TYRES]),
        int(parameter_table[OF_KNOTS]),
        int(parameter_table[KNOTS]),
        start(parameter_table),
    )
    vehicle = start_forces(
        parameter_table, q, v, generalised_forces, doubles(workspace_size(parameter_table)), energy_ledger
    )
    steer, steering = control_value_and_rate(parameter_table, controls, STEER, knots, t)
    braking, driving = (
        control_value_and_rate(parameter_table, controls, BRAKE, knots, t)[0],
        control_value_and_rate(parameter_table, controls, DRIVE, knots, t)[0],
    )
    patches, ways = array(doubles(10 * w), (w, 10)), doubles(WAY * w)
    slips, creeping = array(doubles(4 * w), (w, 4)), array(doubles(4 * w), (w, 4))
    tyres, waves = beyond(table, int(parameter_table[OF_TYRES])), parameter_table[int(parameter_table[OF_WAVES]) :]
    for i in range(w):
        tyre, wheel = row(tyres, PER_TYRE, i), WheelContact(patches[i], slips[i], row(ways, WAY, i), tyre_report[i])
        find_contact(
            tyre, waves, int(parameter_table[WAVES]), tyre[STEERED] * steer, tyre[STEERED] * steering, vehicle, wheel
        )
    cells = array(beyond(table, int(parameter_table[OF_CELLS])), (5, int(parameter_table[CELLS])))
    strips = array(beyond(table, int(parameter_table[OF_STRIPS])), (4, int(parameter_table[STRIPS])))
    tyre_forces(patches, slips, strips, cells, parameter_table[MIDDLE], creeping)
    for i in range(w):
        tyre, wheel = row(tyres, PER_TYRE, i), WheelContact(patches[i], slips[i], row(ways, WAY, i), tyre_report[i])
        add_creep_forces(tyre, creeping[i], vehicle, wheel)
        add_wheel_torque(tyre, braking, driving, vehicle, wheel)
        energy_ledger[STEER_POWER] -= tyre[STEERED] * steering * tyre_report[i, STEER_MOMENT]
    _add_external_pushes(parameter_table, t, vehicle)
    finish_forces(parameter_table, vehicle)


@lean
def forces(parameter_table, t, q, v, generalised_forces):
    """Add the generalised forces of a vehicle on its tyres to ``generalised_forces``. For callbacks: all arguments but
    the time (s) are pointers to doubles."""
    head = array(parameter_table, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    report, ledger = array(doubles(REPORTED * w), (w, REPORTED)), array(doubles(LEDGER), (LEDGER,))
    all_forces(
        array(parameter_table, (int(head[COUNT]),)),
        t,
        array(q, (n,)),
        array(v, (n,)),
        array(generalised_forces, (n,)),
        report,
        ledger,
    )


@lean
def set_forces(block_address, t, coordinate_count):
    """Set the forces f to those of ``forces``. All data lie in one block of doubles at a memory address: f, q and v
    (n,), then the table."""
    f = at(block_address)
    array(f, (coordinate_count,))[:] = 0.0
    forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)


@lean
def fill_reports(parameter_table, times, q, v, tyre_reports, energy_ledgers):
    """Fill the tyres' reports (m, tyres, REPORTED) and energy ledgers (m, LEDGER) of states (m, n) at ``times``
    (m,)."""
    f = array(doubles(q.shape[1]), (q.shape[1],))
    f[:] = 0.0
    for i in range(len(times)):
        all_forces(parameter_table, times[i], q[i], v[i], f, tyre_reports[i], energy_ledgers[i])
