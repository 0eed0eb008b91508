"""One step of a braked vehicle in the plane: wheels exact, their mean forces to the vehicle, loads solved.

A half step gives the state in the middle, and the whole step takes its slip angles, loads and friction there: order
two. Loads follow from accelerations and these from the tyres' forces under the loads; the whole step finds the fixed
point to ``ACCELERATION_TOLERANCE``. Below ``regular``, the speed at which cornering stiffness is as fast as the step,
slip angles are those of that speed.
"""

import math

from models.brake.plane_chain import (
    ChainPoint,
    Direction,
    coordinates,
    count_of_prescribed,
    factorise_mass,
    fill_headings,
    fill_velocity_rows,
    inertia,
    solve,
)
from models.brake.plane_records import KNOWN, Frame, report_of, wheels_of
from models.brake.wheel_step import Grip, StepInput, Wheel, wheel_step
from models.machine.compiled import inlined, lean
from models.machine.stack import array, doubles
from models.tyre.tyre_table import TableCell, cell_and_share, lateral_adhesion

ACCELERATION_TOLERANCE = 1e-7
"""What is left of the accelerations' error (m/s^2, and rad/s^2 times 1 m) when the loads are taken to be found."""
HALF_ROUNDS, ANDERSON_ROUNDS, ROUNDS_PER_WINDOW, MOST_WINDOWS = 1, 12, 16, 1000
"""Rounds of a half step, to whose loads those of the step before are close enough for order two; rounds after which
Anderson's method gives way to means; rounds between two looks at their progress; such windows without an answer."""
JUMP_WIDTH = 1e-3
"""Width (m/s^2, and rad/s^2 times 1 m) to which a jump is closed in where loads have an answer only as a mean: some
newtons of the load of a truck's wheel."""
LOCKING_SLIP = 0.98
"""Slip from which on the direction of the force goes over to that of a locked tyre: without a jump, which would leave
some loads without an answer."""


@inlined
def scalar_product(row, vector):
    """Scalar product of a row and a vector."""
    total = 0.0
    for a in range(row.size):
        total += row[a] * vector[a]
    return total


@inlined
def moved_to(row, place):
    """Copy the row's numbers into ``place``; array assignment would allocate a temporary array."""
    for a in range(row.size):
        place[a] = row[a]


@inlined
def settle(motion, steer, regular, starts, vehicle, frame):
    """Fill wheel quantities and equations of motion that follow from the state. With ``starts``, the state is that at
    the start of the step, and the wheels' steer angles and speeds along them are stored."""
    plane, angles, wheels, units = vehicle.plane, vehicle.tables.angles, frame.wheels, frame.units
    positions, rates, still = motion.state[0], motion.state[1], frame.wheels.static_load
    fill_headings(positions, units)
    for i in range(plane.unit.size):
        along, aside, g, k = frame.along[i], frame.across[i], plane.group[i], plane.unit[i]
        still[i] = plane.static[i]
        if plane.by_x[i] != 0.0 or plane.by_y[i] != 0.0:
            heading = Direction(units[g, 0], units[g, 1])
            ahead, left = fill_velocity_rows(ChainPoint(g, 0.0, 0.0), heading, units, rates, plane, along, aside)
            for a in range(coordinates(plane)):
                frame.press[i, a] = plane.by_x[i] * along[a] + plane.by_y[i] * aside[a]
            still[i] += plane.by_x[i] * ahead + plane.by_y[i] * left
        if starts:
            same = i > 0 and steer[i] == steer[i - 1]
            wheels.cosine[i] = wheels.cosine[i - 1] if same else math.cos(steer[i])
            wheels.sine[i] = wheels.sine[i - 1] if same else math.sin(steer[i])
        c = units[k, 0] * wheels.cosine[i] - units[k, 1] * wheels.sine[i]
        s = units[k, 1] * wheels.cosine[i] + units[k, 0] * wheels.sine[i]
        centre = ChainPoint(k, plane.place[i, 0], plane.place[i, 1])
        ahead, _ = fill_velocity_rows(centre, Direction(c, s), units, rates, plane, along, aside)
        u, v = scalar_product(along, rates), scalar_product(aside, rates)
        if starts:
            wheels.start[i] = u
        wheels.rate[i] = ahead + v * rates[2 + k]
        slide(i, u, v, regular, frame.surfaces.lag, angles, wheels)
    inertia(units, rates, plane, frame.mass, frame.right, frame.out, frame.out_before)
    for a in range(count_of_prescribed(plane), coordinates(plane)):
        for b in range(count_of_prescribed(plane)):
            frame.right[a] -= frame.mass[a, b] * motion.accelerations[b]
    factorise_mass(frame.mass, plane)


@inlined
def slide(i, u, v, regular, lag, angles, wheels):
    """Set the slip angle of wheel i from the speeds (m/s) of its centre along it, u, and of its tyre across it, v.
    Where ``lag`` (W,) of ``Surfaces`` is a number, it gives the slip angle in place of v."""
    forwards = u if wheels.start[i] >= 0.0 else -u
    if not math.isnan(lag[i]):
        v = lag[i] * max(forwards, regular)
    angle = math.atan2(abs(v), max(forwards, regular))
    wheels.along[i], wheels.aside[i], wheels.angle[i] = max(forwards, 0.0), v, angle
    wheels.cell[i], wheels.share[i] = cell_and_share(angles, angle)


@inlined
def tyre(i, step_input, wheel, tables, wheels, surfaces, report):
    """Fill the report of wheel i, whose slip angle and load are known, from a ``StepInput`` with the speeds along the
    wheel."""
    v, along, load, angle = wheels.aside[i], wheels.along[i], wheels.load[i], wheels.angle[i]
    first, second, share = int(surfaces.first[i]), int(surfaces.second[i]), surfaces.share[i]
    sign = 1.0 if wheels.start[i] >= 0.0 else -1.0
    j, q = cell_and_share(tables.loads, load)
    cells = TableCell(int(wheels.cell[i]), wheels.share[i], j, q)
    w, force, slip, locked = wheel_step(
        StepInput(
            sign * step_input.speed0, sign * step_input.speed1, step_input.torque0, step_input.torque1, step_input.step
        ),
        Wheel(wheel.radius, wheel.inertia, sign * wheel.turning),
        Grip(first, second, share, cells, load, tables.slips, tables.mu_x),
    )
    k, part = cell_and_share(tables.slips, abs(slip))
    side = lateral_adhesion(first, cells, k, part, tables.g, tables.h)
    if share > 0.0:
        side += share * (lateral_adhesion(second, cells, k, part, tables.g, tables.h) - side)
    side *= load
    if slip > LOCKING_SLIP and (along > 0.0 or v != 0.0):  # a locked tyre's force is against the way it slides
        total, speed = math.hypot(force, side), math.hypot(along, v)
        part = min((slip - LOCKING_SLIP) / (1.0 - LOCKING_SLIP), 1.0)
        force += part * (total * along / speed - force)
        side += part * (total * abs(v) / speed - side)
    report.force_x[i], report.force_y[i] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report.load[i], report.slip[i], report.slip_angle[i] = load, slip, math.copysign(angle, v)
    report.locked[i], report.turning[i] = locked, sign * w


@lean
def share_out(loads, places):
    """Correct loads (W,) of two-axle vehicles in place where a wheel's load is negative: the wheel gets none, and the
    other wheels keep the static equilibrium. places (W, 2) : positions of the wheels in their units' axes, m.

    The other wheel of its axle bears the axle's load, and the other axle what this one cannot take of the roll moment.
    An axle that would lift leaves all its load to the other one. Beyond balance, both wheels of a side bear none.
    """
    for first in range(0, loads.size - 3, 4):
        front, rear = loads[first : first + 2], loads[first + 2 : first + 4]
        width, behind = places[first, 1] - places[first + 1, 1], places[first + 2, 1] - places[first + 3, 1]
        ahead, back, moved, moved_back = front[0] + front[1], rear[0] + rear[1], front[1] - front[0], rear[1] - rear[0]
        ahead, back = max(ahead + min(back, 0.0), 0.0), max(back + min(ahead, 0.0), 0.0)
        kept, kept_back = min(max(moved, -ahead), ahead), min(max(moved_back, -back), back)
        more, more_back = (moved_back - kept_back) * behind / width, (moved - kept) * width / behind
        kept, kept_back = min(max(kept + more, -ahead), ahead), min(max(kept_back + more_back, -back), back)
        front[0], front[1] = 0.5 * (ahead - kept), 0.5 * (ahead + kept)
        rear[0], rear[1] = 0.5 * (back - kept_back), 0.5 * (back + kept_back)


@lean
def respond(motion, before, after, step, vehicle, frame):
    """Fill ``frame.out`` with the accelerations that the tyres' forces cause when the vehicle has the accelerations of
    ``motion``. A step's solution is a fixed point of this map. before, after (W,) : torques at the ends of the step."""
    plane, tables, wheels, surfaces, report = vehicle.plane, vehicle.tables, frame.wheels, frame.surfaces, frame.report
    accelerations, out, along, across, right = motion.accelerations, frame.out, frame.along, frame.across, frame.right
    load, still, rate, start = wheels.load, wheels.static_load, wheels.rate, wheels.start
    size, free, lifts = coordinates(plane), count_of_prescribed(plane), False
    for a in range(size):
        out[a] = accelerations[a] if a < free else right[a]
    for i in range(load.size):
        load[i] = still[i] + scalar_product(frame.press[i], accelerations)
        lifts = lifts or load[i] < 0.0
    if lifts:
        share_out(load, plane.place)
    for i in range(load.size):
        speed1 = start[i] + step * (rate[i] + scalar_product(along[i], accelerations))
        given = StepInput(start[i], speed1, before[i], after[i], step)
        wheel = Wheel(plane.radius[i], plane.spin[i], motion.turning[i])
        tyre(i, given, wheel, tables, wheels, surfaces, report)
        for a in range(free, size):
            out[a] += along[i, a] * report.force_x[i] + across[i, a] * report.force_y[i]
    solve(frame.mass, plane, out)


@inlined
def stage(motion, before, after, step, most, vehicle, frame):
    """Search the mean accelerations over a step, and write them into ``motion``; its last ones are the first guess.

    Anderson's method of depth one runs for at most ``most`` rounds. If they have not converged and were
    ``ANDERSON_ROUNDS`` or more, ``by_means`` takes over. Returns the estimated remaining error, from the last change
    and the ratio of the last two.
    """
    accelerations, out, out0, off0 = motion.accelerations, frame.out, frame.out_before, frame.off
    size, left, last = coordinates(vehicle.plane), math.inf, 0.0
    for rounds in range(most):
        respond(motion, before, after, step, vehicle, frame)
        change, product, square = 0.0, 0.0, 0.0
        for a in range(size):
            off = out[a] - accelerations[a]
            change = max(change, abs(off))
            product += off * (off - off0[a])
            square += (off - off0[a]) ** 2
        left = change * min(change / last, 1.0) if last > 0.0 else change
        done, last = not left > ACCELERATION_TOLERANCE or rounds == most - 1, change
        mix = min(max(product / square, -2.0), 0.75) if rounds > 0 and square > 0.0 and not done else 0.0
        for a in range(size):
            off0[a] = out[a] - accelerations[a]
            accelerations[a] = out[a] - mix * (out[a] - out0[a])
            out0[a] = out[a]
        if done:
            break
    return (
        left
        if left <= ACCELERATION_TOLERANCE or most < ANDERSON_ROUNDS
        else by_means(motion, before, after, step, vehicle, frame)
    )


@lean
def by_means(motion, before, after, step, vehicle, frame):
    """Accelerations as from ``stage``, for steps in which wheel loads jump between two solutions, so that only a mean
    of both is in equilibrium.

    So it is of a slow wheel at the edge of locking: a little less load, and it locks at once; a little more, and it
    rolls within a fraction of the step. Each round moves the accelerations by a share of their change, and the means of
    all reports with them, so that forces and accelerations stay in balance. The share is halved where rounds go to and
    fro, or are thrown back from an edge that they approached, and never grows: forces that fall steeply with load would
    send them to and fro again. The limit is Filippov's solution: the edge itself, locked for a part of the step.
    Source: A. F. Filippov, Differential equations with discontinuous righthand sides (1988); W. R. Mann, Proc. AMS 4
    (1953) 506-510; recalled, not checked.
    """
    accelerations, out, report = motion.accelerations, frame.out, motion.report
    size, share, last = coordinates(vehicle.plane), 0.5, math.inf
    means = array(doubles(report.size), report.shape)
    begun = array(doubles(accelerations.size), accelerations.shape)
    respond(motion, before, after, step, vehicle, frame)
    moved_to(out, accelerations)
    for c in range(report.shape[0]):
        moved_to(report[c], means[c])
    for _ in range(MOST_WINDOWS):
        way, net, most, change = 0.0, 0.0, 0.0, 0.0
        moved_to(accelerations, begun)
        for _ in range(ROUNDS_PER_WINDOW):
            respond(motion, before, after, step, vehicle, frame)
            change = 0.0
            for a in range(size):
                change = max(change, abs(out[a] - accelerations[a]))
                way += share * abs(out[a] - accelerations[a])
            if not change > ACCELERATION_TOLERANCE:
                moved_to(out, accelerations)
                return change
            most = max(most, change)
            for a in range(size):
                accelerations[a] += share * (out[a] - accelerations[a])
            for c in range(report.shape[0]):
                for i in range(report.shape[1]):
                    means[c, i] += share * (report[c, i] - means[c, i])
        for a in range(size):
            net += abs(accelerations[a] - begun[a])
        turns, thrown = net < 0.5 * way, change > last
        if (turns and share * change <= JUMP_WIDTH) or (thrown and share * most <= JUMP_WIDTH):
            for c in range(report.shape[0]):
                moved_to(means[c], report[c])
            return 0.0
        share, last = 0.5 * share if turns or thrown else share, change
    return math.inf


@inlined
def comes_to_rest(rates, turning, accelerations, step, plane):
    """Time (s) within the step at which the vehicle comes to rest, or -1 if it does not.

    Friction takes speed away until there is none, and only the time grid would let it turn round: it stands where its
    kinetic energy along the step is least, if it was about to lose all of its speed in that step anyhow.
    """
    speed, both, rate, mass = 0.0, 0.0, 0.0, 0.0
    for k in range(rates.size - 2):
        mass += plane.masses[k]
    for a in range(rates.size):
        weight = mass if a < 2 else plane.inertias[a - 2]
        speed += weight * rates[a] ** 2
        both += weight * rates[a] * accelerations[a]
        rate += weight * accelerations[a] ** 2
    if speed == 0.0 and not turning.any():
        return 0.0
    if rate == 0.0 or both >= 0.0 or -both > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -both / rate


@lean
def step_on(motion, torques, step, steer, regular, vehicle, surfaces):
    """One step of a ``Motion`` whose wheels are on ``Surfaces``.

    torques (2, W) : of the brakes at the step's ends; steer (W,) : angles of the wheels in their units (rad); regular :
    m/s. Returns the time (s) of the step at which the vehicle comes to rest, ``step`` if it does not, -1 if the loads
    were not found.
    """
    plane, state, turning, accelerations = vehicle.plane, motion.state, motion.turning, motion.accelerations
    count, size = turning.size, coordinates(plane)
    ways = array(doubles(3 * count * size), (3, count, size))
    some, middle = array(doubles(6 * size), (6, size)), array(doubles(count), (count,))
    frame = Frame(
        wheels_of(array(doubles(KNOWN * count), (KNOWN, count))),
        surfaces,
        report_of(motion.report),
        ways[0],
        ways[1],
        ways[2],
        array(doubles(2 * size), (size - 2, 2)),
        array(doubles(size * size), (size, size)),
        some[0],
        some[1],
        some[2],
        some[3],
    )
    frame.press[:] = 0.0
    place0, rate0 = some[4], some[5]
    for a in range(size):
        place0[a], rate0[a] = state[0, a], state[1, a]
    for i in range(count):
        middle[i] = 0.5 * (torques[0, i] + torques[1, i])
    for half in (True, False):
        settle(motion, steer, regular, half, vehicle, frame)
        time, last = (0.5 * step, middle) if half else (step, torques[1])
        most = HALF_ROUNDS if half else ANDERSON_ROUNDS
        if not stage(motion, torques[0], last, time, most, vehicle, frame) <= (
            math.inf if half else ACCELERATION_TOLERANCE
        ):
            return -1.0
        rest = (
            comes_to_rest(rate0, turning, accelerations, step, plane)
            if half and not plane.has_prescribed_hook
            else -1.0
        )
        if rest >= 0.0:
            time = rest
        for a in range(size):
            state[1, a] = rate0[a] + time * accelerations[a]
            state[0, a] = place0[a] + 0.5 * time * (rate0[a] + state[1, a])
        if rest >= 0.0:
            state[1], turning[:] = 0.0, 0.0
            return rest
    for i in range(count):
        turning[i] = frame.report.turning[i]
    return step
