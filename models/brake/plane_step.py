"""One time step of a braked vehicle in the plane: exact wheel rotation, mean wheel forces on the vehicle, loads found
by iteration.

A half step gives the state in the middle, and the whole step takes its slip angles, loads and friction there: order
two. Loads follow from accelerations and these from the tyres' forces under the loads; the whole step finds the fixed
point to ``ACCELERATION_TOLERANCE``. Below ``regular``, the speed at which cornering stiffness is as fast as the step,
slip angles are those of that speed.
"""

import math

from models.brake.plane_chain import (
    ChainPoint,
    Direction,
    count_of_coordinates,
    count_of_prescribed,
    factorise_mass,
    fill_headings,
    fill_mass_matrix,
    fill_velocity_rows,
    solve_accelerations,
)
from models.brake.plane_records import WHEEL_QUANTITY_COUNT, StepWorkspace, report_of, wheels_of
from models.brake.wheel_step import BrakedWheel, TyreGrip, WheelStepInput, wheel_step
from models.machine.compiled import inlined, lean
from models.machine.stack import array, doubles
from models.tyre.tyre_table import TableCell, cell_and_share, lateral_adhesion

ACCELERATION_TOLERANCE = 1e-7
"""Remaining error of the accelerations (m/s^2, and rad/s^2 times 1 m) at which the iteration of the loads ends."""
HALF_ROUNDS, ANDERSON_ROUNDS, ROUNDS_PER_WINDOW, MOST_WINDOWS = 1, 12, 16, 1000
"""Numbers of iterations: in a half step, which starts from the last step's accelerations, near enough for order two;
before Anderson's method gives way to means; between two checks of progress; and the number of such checks before giving
up.
"""
JUMP_WIDTH = 1e-3
"""Width (m/s^2, and rad/s^2 times 1 m) of the interval to which a jump of the accelerations is narrowed down where
loads have only a mean solution: some newtons of the load of a truck's wheel.
"""
LOCKING_SLIP = 0.98
"""Slip above which the direction of the force passes continuously to that of a locked tyre; a jump would leave some
loads without a solution.
"""


@inlined
def scalar_product(row, vector):
    """Scalar product of a row and a vector."""
    total = 0.0
    for a in range(row.size):
        total += row[a] * vector[a]
    return total


@inlined
def copy_row(source_row, target_row):
    """Copy the row's values into ``target_row``; array assignment would allocate a temporary array."""
    for a in range(source_row.size):
        target_row[a] = source_row[a]


@inlined
def fill_state_quantities(vehicle_motion, steer_angles, regularising_speed, at_step_start, vehicle, workspace):
    """Fill wheel quantities and equations of motion that follow from the state. With ``at_step_start``, the state is
    that at the start of the step, and the wheels' steer angles and speeds along them are stored.
    """
    plane, angles, wheels, units = vehicle.plane, vehicle.tables.angles, workspace.wheels, workspace.heading_vectors
    positions, rates, still = vehicle_motion.state[0], vehicle_motion.state[1], workspace.wheels.static_load
    fill_headings(positions, units)
    for i in range(plane.unit.size):
        row_along, row_across, g, k = (
            workspace.rows_along[i],
            workspace.rows_across[i],
            plane.load_unit[i],
            plane.unit[i],
        )
        still[i] = plane.static_loads[i]
        if plane.load_per_x_acceleration[i] != 0.0 or plane.load_per_y_acceleration[i] != 0.0:
            heading = Direction(units[g, 0], units[g, 1])
            bias_along, bias_across = fill_velocity_rows(
                ChainPoint(g, 0.0, 0.0), heading, units, rates, plane, row_along, row_across
            )
            for a in range(count_of_coordinates(plane)):
                workspace.load_rows[i, a] = (
                    plane.load_per_x_acceleration[i] * row_along[a] + plane.load_per_y_acceleration[i] * row_across[a]
                )
            still[i] += plane.load_per_x_acceleration[i] * bias_along + plane.load_per_y_acceleration[i] * bias_across
        if at_step_start:
            same_steer = i > 0 and steer_angles[i] == steer_angles[i - 1]
            wheels.cosine[i] = wheels.cosine[i - 1] if same_steer else math.cos(steer_angles[i])
            wheels.sine[i] = wheels.sine[i - 1] if same_steer else math.sin(steer_angles[i])
        c = units[k, 0] * wheels.cosine[i] - units[k, 1] * wheels.sine[i]
        s = units[k, 1] * wheels.cosine[i] + units[k, 0] * wheels.sine[i]
        centre = ChainPoint(k, plane.place[i, 0], plane.place[i, 1])
        bias_along, _ = fill_velocity_rows(centre, Direction(c, s), units, rates, plane, row_along, row_across)
        u, v = scalar_product(row_along, rates), scalar_product(row_across, rates)
        if at_step_start:
            wheels.start[i] = u
        wheels.rate[i] = bias_along + v * rates[2 + k]
        set_slip_angle(i, u, v, regularising_speed, workspace.surfaces.lag, angles, wheels)
    fill_mass_matrix(
        units, rates, plane, workspace.mass_matrix, workspace.right_side, workspace.response, workspace.response_before
    )
    for a in range(count_of_prescribed(plane), count_of_coordinates(plane)):
        for b in range(count_of_prescribed(plane)):
            workspace.right_side[a] -= workspace.mass_matrix[a, b] * vehicle_motion.accelerations[b]
    factorise_mass(workspace.mass_matrix, plane)


@inlined
def set_slip_angle(wheel_index, speed_along, speed_across, regularising_speed, lagging_slips, table_angles, wheels):
    """Set the slip angle of wheel i from the speeds (m/s) of its centre along it and of its tyre across it.
    Where ``lagging_slips`` (W,) of ``WheelSurfaces`` is a number, it gives the slip angle in place of v.
    """
    i = wheel_index
    forwards = speed_along if wheels.start[i] >= 0.0 else -speed_along
    if not math.isnan(lagging_slips[i]):
        speed_across = lagging_slips[i] * max(forwards, regularising_speed)
    angle = math.atan2(abs(speed_across), max(forwards, regularising_speed))
    wheels.along[i], wheels.aside[i], wheels.angle[i] = max(forwards, 0.0), speed_across, angle
    wheels.cell[i], wheels.share[i] = cell_and_share(table_angles, angle)


@inlined
def fill_tyre_report(wheel_index, step_input, wheel, tyre_tables, wheels, surfaces, report):
    """Fill the report of wheel i, whose slip angle and load are known, from a ``WheelStepInput`` with the speeds along
    the wheel.
    """
    i = wheel_index
    v, speed_along, load, angle = wheels.aside[i], wheels.along[i], wheels.load[i], wheels.angle[i]
    first, second, share = int(surfaces.first[i]), int(surfaces.second[i]), surfaces.share[i]
    sign = 1.0 if wheels.start[i] >= 0.0 else -1.0
    j, q = cell_and_share(tyre_tables.loads, load)
    cells = TableCell(int(wheels.cell[i]), wheels.share[i], j, q)
    w, force, slip, locked = wheel_step(
        WheelStepInput(
            sign * step_input.speed0, sign * step_input.speed1, step_input.torque0, step_input.torque1, step_input.step
        ),
        BrakedWheel(wheel.radius, wheel.inertia, sign * wheel.turning),
        TyreGrip(first, second, share, cells, load, tyre_tables.slips, tyre_tables.mu_x),
    )
    k, cell_share = cell_and_share(tyre_tables.slips, abs(slip))
    side = lateral_adhesion(first, cells, k, cell_share, tyre_tables.g, tyre_tables.h)
    if share > 0.0:
        side += share * (lateral_adhesion(second, cells, k, cell_share, tyre_tables.g, tyre_tables.h) - side)
    side *= load
    if slip > LOCKING_SLIP and (speed_along > 0.0 or v != 0.0):  # a locked tyre's force is against the way it slides
        total, speed = math.hypot(force, side), math.hypot(speed_along, v)
        cell_share = min((slip - LOCKING_SLIP) / (1.0 - LOCKING_SLIP), 1.0)
        force += cell_share * (total * speed_along / speed - force)
        side += cell_share * (total * abs(v) / speed - side)
    report.force_x[i], report.force_y[i] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report.load[i], report.slip[i], report.slip_angle[i] = load, slip, math.copysign(angle, v)
    report.locked[i], report.turning[i] = locked, sign * w


@lean
def redistribute_negative_loads(wheel_loads, positions):
    """Correct loads (W,) in N of two-axle vehicles in place where a wheel's load is negative: the wheel gets none, and
    the other wheels keep the static equilibrium. positions (W, 2) : of the wheels in their units' axes, m.

    The other wheel of its axle bears the axle's load, and the other axle what this one cannot take of the roll moment.
    An axle that would lift leaves all its load to the other one. Beyond balance, both wheels of a side bear none.
    """
    for first in range(0, wheel_loads.size - 3, 4):
        front, rear = wheel_loads[first : first + 2], wheel_loads[first + 2 : first + 4]
        width, behind = positions[first, 1] - positions[first + 1, 1], positions[first + 2, 1] - positions[first + 3, 1]
        front_load, back, front_difference, moved_back = (
            front[0] + front[1],
            rear[0] + rear[1],
            front[1] - front[0],
            rear[1] - rear[0],
        )
        front_load, back = max(front_load + min(back, 0.0), 0.0), max(back + min(front_load, 0.0), 0.0)
        kept_front, kept_back = min(max(front_difference, -front_load), front_load), min(max(moved_back, -back), back)
        added_front, more_back = (
            (moved_back - kept_back) * behind / width,
            (front_difference - kept_front) * width / behind,
        )
        kept_front, kept_back = (
            min(max(kept_front + added_front, -front_load), front_load),
            min(max(kept_back + more_back, -back), back),
        )
        front[0], front[1] = 0.5 * (front_load - kept_front), 0.5 * (front_load + kept_front)
        rear[0], rear[1] = 0.5 * (back - kept_back), 0.5 * (back + kept_back)


@lean
def fill_response(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace):
    """Fill ``frame.response`` with the accelerations that the tyres' forces cause when the vehicle has the
    accelerations of ``vehicle_motion``. A step's solution is a fixed point of this map. torques_before, torques_after
    (W,) : brake torques (N m) at the ends of the step.
    """
    plane, tables, wheels, surfaces, report = (
        vehicle.plane,
        vehicle.tables,
        workspace.wheels,
        workspace.surfaces,
        workspace.report,
    )
    accelerations, response, rows_along, rows_across, right = (
        vehicle_motion.accelerations,
        workspace.response,
        workspace.rows_along,
        workspace.rows_across,
        workspace.right_side,
    )
    load, still, rate, start = wheels.load, wheels.static_load, wheels.rate, wheels.start
    size, free, lifts = count_of_coordinates(plane), count_of_prescribed(plane), False
    for a in range(size):
        response[a] = accelerations[a] if a < free else right[a]
    for i in range(load.size):
        load[i] = still[i] + scalar_product(workspace.load_rows[i], accelerations)
        lifts = lifts or load[i] < 0.0
    if lifts:
        redistribute_negative_loads(load, plane.place)
    for i in range(load.size):
        speed1 = start[i] + time_step * (rate[i] + scalar_product(rows_along[i], accelerations))
        step_input = WheelStepInput(start[i], speed1, torques_before[i], torques_after[i], time_step)
        wheel = BrakedWheel(plane.radius[i], plane.spin_inertia[i], vehicle_motion.turning[i])
        fill_tyre_report(i, step_input, wheel, tables, wheels, surfaces, report)
        for a in range(free, size):
            response[a] += rows_along[i, a] * report.force_x[i] + rows_across[i, a] * report.force_y[i]
    solve_accelerations(workspace.mass_matrix, plane, response)


@inlined
def find_accelerations(vehicle_motion, torques_before, torques_after, time_step, round_limit, vehicle, workspace):
    """Find the mean accelerations over a step by iteration, from the last ones on, and write them into
    ``vehicle_motion``.

    Anderson's method of depth one runs for at most ``round_limit`` rounds. If they have not converged and were
    ``ANDERSON_ROUNDS`` or more, ``find_mean_accelerations`` takes over. Returns the estimated remaining error, from the
    last change and the ratio of the last two.
    """
    accelerations, response, out0, off0 = (
        vehicle_motion.accelerations,
        workspace.response,
        workspace.response_before,
        workspace.residual_before,
    )
    size, remaining_error, last_change = count_of_coordinates(vehicle.plane), math.inf, 0.0
    for rounds in range(round_limit):
        fill_response(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace)
        change, product, square = 0.0, 0.0, 0.0
        for a in range(size):
            residual = response[a] - accelerations[a]
            change = max(change, abs(residual))
            product += residual * (residual - off0[a])
            square += (residual - off0[a]) ** 2
        remaining_error = change * min(change / last_change, 1.0) if last_change > 0.0 else change
        is_done, last_change = not remaining_error > ACCELERATION_TOLERANCE or rounds == round_limit - 1, change
        mix = min(max(product / square, -2.0), 0.75) if rounds > 0 and square > 0.0 and not is_done else 0.0
        for a in range(size):
            off0[a] = response[a] - accelerations[a]
            accelerations[a] = response[a] - mix * (response[a] - out0[a])
            out0[a] = response[a]
        if is_done:
            break
    return (
        remaining_error
        if remaining_error <= ACCELERATION_TOLERANCE or round_limit < ANDERSON_ROUNDS
        else find_mean_accelerations(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace)
    )


@lean
def find_mean_accelerations(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace):
    """Accelerations as from ``find_accelerations``, for steps in which wheel loads jump between two solutions, so that
    only a mean of both is in equilibrium; returns the remaining error.

    So it is of a slow wheel at the edge of locking: a little less load, and it locks at once; a little more, and it
    rolls within a fraction of the step. Each round moves the accelerations by a share of their change, and the means of
    all reports with them, so that forces and accelerations stay in balance. The share is halved where rounds go to and
    fro, or are thrown back from an edge that they approached, and never grows: forces that fall steeply with load would
    send them to and fro again. The limit is Filippov's solution: the edge itself, locked for a part of the step.
    Source: A. F. Filippov, Differential equations with discontinuous righthand sides (1988); W. R. Mann, Proc. AMS 4
    (1953) 506-510; recalled, not checked.
    """
    accelerations, response, report = vehicle_motion.accelerations, workspace.response, vehicle_motion.report
    size, share, last_change = count_of_coordinates(vehicle.plane), 0.5, math.inf
    means = array(doubles(report.size), report.shape)
    start_accelerations = array(doubles(accelerations.size), accelerations.shape)
    fill_response(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace)
    copy_row(response, accelerations)
    for c in range(report.shape[0]):
        copy_row(report[c], means[c])
    for _ in range(MOST_WINDOWS):
        total_change, net, largest_change, change = 0.0, 0.0, 0.0, 0.0
        copy_row(accelerations, start_accelerations)
        for _ in range(ROUNDS_PER_WINDOW):
            fill_response(vehicle_motion, torques_before, torques_after, time_step, vehicle, workspace)
            change = 0.0
            for a in range(size):
                change = max(change, abs(response[a] - accelerations[a]))
                total_change += share * abs(response[a] - accelerations[a])
            if not change > ACCELERATION_TOLERANCE:
                copy_row(response, accelerations)
                return change
            largest_change = max(largest_change, change)
            for a in range(size):
                accelerations[a] += share * (response[a] - accelerations[a])
            for c in range(report.shape[0]):
                for i in range(report.shape[1]):
                    means[c, i] += share * (report[c, i] - means[c, i])
        for a in range(size):
            net += abs(accelerations[a] - start_accelerations[a])
        turns, thrown = net < 0.5 * total_change, change > last_change
        if (turns and share * change <= JUMP_WIDTH) or (thrown and share * largest_change <= JUMP_WIDTH):
            for c in range(report.shape[0]):
                copy_row(means[c], report[c])
            return 0.0
        share, last_change = 0.5 * share if turns or thrown else share, change
    return math.inf


@inlined
def time_of_rest(coordinate_rates, wheel_turning, accelerations, time_step, plane_vehicle):
    """Time (s) within the step at which the vehicle comes to rest, or -1 if it does not.

    Friction takes speed away until there is none, and only the time grid would let it turn round: it stands where its
    kinetic energy along the step is least, if it was about to lose all of its speed in that step anyhow.
    """
    speed, power, rate, mass = 0.0, 0.0, 0.0, 0.0
    for k in range(coordinate_rates.size - 2):
        mass += plane_vehicle.masses[k]
    for a in range(coordinate_rates.size):
        weight = mass if a < 2 else plane_vehicle.inertias[a - 2]
        speed += weight * coordinate_rates[a] ** 2
        power += weight * coordinate_rates[a] * accelerations[a]
        rate += weight * accelerations[a] ** 2
    if speed == 0.0 and not wheel_turning.any():
        return 0.0
    if rate == 0.0 or power >= 0.0 or -power > time_step * rate or speed > 2.25 * time_step * time_step * rate:
        return -1.0
    return -power / rate


@lean
def advance_one_step(vehicle_motion, brake_torques, time_step, steer_angles, regularising_speed, vehicle, surfaces):
    """Advance a ``PlaneMotion`` whose wheels are on ``WheelSurfaces`` by one step (s).

    brake_torques (2, W) : of the brakes at the step's ends; steer_angles (W,) : angles of the wheels in their units
    (rad);
    regularising_speed : m/s. Returns the time (s) of the step at which the vehicle comes to rest, ``time_step`` if it
    does not, -1 if the loads were not found.
    """
    plane, state, turning, accelerations = (
        vehicle.plane,
        vehicle_motion.state,
        vehicle_motion.turning,
        vehicle_motion.accelerations,
    )
    count, size = turning.size, count_of_coordinates(plane)
    state_rows = array(doubles(3 * count * size), (3, count, size))
    plane_rows, middle = array(doubles(6 * size), (6, size)), array(doubles(count), (count,))
    frame = StepWorkspace(
        wheels_of(array(doubles(WHEEL_QUANTITY_COUNT * count), (WHEEL_QUANTITY_COUNT, count))),
        surfaces,
        report_of(vehicle_motion.report),
        state_rows[0],
        state_rows[1],
        state_rows[2],
        array(doubles(2 * size), (size - 2, 2)),
        array(doubles(size * size), (size, size)),
        plane_rows[0],
        plane_rows[1],
        plane_rows[2],
        plane_rows[3],
    )
    frame.load_rows[:] = 0.0
    place0, rate0 = plane_rows[4], plane_rows[5]
    for a in range(size):
        place0[a], rate0[a] = state[0, a], state[1, a]
    for i in range(count):
        middle[i] = 0.5 * (brake_torques[0, i] + brake_torques[1, i])
    for half in (True, False):
        fill_state_quantities(vehicle_motion, steer_angles, regularising_speed, half, vehicle, frame)
        time, end_torques = (0.5 * time_step, middle) if half else (time_step, brake_torques[1])
        most_rounds = HALF_ROUNDS if half else ANDERSON_ROUNDS
        if not find_accelerations(vehicle_motion, brake_torques[0], end_torques, time, most_rounds, vehicle, frame) <= (
            math.inf if half else ACCELERATION_TOLERANCE
        ):
            return -1.0
        rest_time = (
            time_of_rest(rate0, turning, accelerations, time_step, plane)
            if half and not plane.has_prescribed_hook
            else -1.0
        )
        if rest_time >= 0.0:
            time = rest_time
        for a in range(size):
            state[1, a] = rate0[a] + time * accelerations[a]
            state[0, a] = place0[a] + 0.5 * time * (rate0[a] + state[1, a])
        if rest_time >= 0.0:
            state[1], turning[:] = 0.0, 0.0
            return rest_time
    for i in range(count):
        turning[i] = frame.report.turning[i]
    return time_step
