"""A truck that brakes in a turn on one surface, written by hand for this case alone: the braking scene without effects.

One rigid body on four wheels with constant loads, brakes that are all applied from the start and whose torques follow
at once, front wheels at a fixed steer angle. No trailer, load transfer, second surface, brake dynamics, hysteresis,
controller or engine, and no way to have them. The method of integration is the one of ``models.brake.plane_step``; the
step of a wheel and the tyre table are shared with twinrig.
"""

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from models.brake.plane_records import REPORT_SIZE, WheelReport, report_of
from models.brake.wheel_step import BrakedWheel, TyreGrip, WheelStepInput, wheel_step
from models.machine.compiled import inlined, lean, njit
from models.machine.timing import interleave, paired_ratio
from models.systems.braking.march import BrakingPath
from models.systems.braking.procedures import controller_of, vehicle_and_start_state
from models.tyre.tyre_table import StackedTyreTables, TableCell, cell_and_share, lateral_adhesion
from validation.absence.braking import STOP
from validation.absence.of_systems import bare_scene

ACCELERATION_TOLERANCE, LOCKING_SLIP, ANDERSON_ROUNDS = 1e-7, 0.98, 12
MOST_SUBSTEPS = 64


class Truck(NamedTuple):
    """A truck with four wheels: their positions (m), loads (N), radii (m) and inertias (kg m^2); mass (kg), yaw inertia
    (kg m^2), tyre tables; cosine and sine of the front wheels' steer angle."""

    x: np.ndarray
    y: np.ndarray
    load: np.ndarray
    radius: np.ndarray
    spin_inertia: np.ndarray
    mass: float
    yaw_inertia: float
    tables: StackedTyreTables
    cosine: float
    sine: float


class Step(NamedTuple):
    """Length of a time step (s), and the speed (m/s) below which slip angles are computed as at this speed."""

    duration: float
    regularising_speed: float


class TruckState(NamedTuple):
    """Present state of the truck: x, y, heading and their rates (6,); accelerations (3,); angular velocities of the
    wheels (4,). Reports (7, 4) of the wheels (force, load, slip, ...) for a step, and their sums over the substeps."""

    state: np.ndarray
    accelerations: np.ndarray
    turning: np.ndarray
    report: np.ndarray
    weighted_sums: np.ndarray


class Stop(NamedTuple):
    """Recorded stop at the sample ends: times (n,), states (n, 6), wheels' angular velocities (n, 4), reports (n, 7,
    4)."""

    times: np.ndarray
    states: np.ndarray
    turning: np.ndarray
    reports: np.ndarray


class StepWorkspace(NamedTuple):
    """Workspace of a time step. Arrays (4,) contain each wheel's speeds, slip angle, place in the tyre table, heading
    (east, north), and lever arms about the centre of mass. previous_response, residual (3,): accelerations of the
    previous iteration and their error; torques at mid-step (4,) and at the ends of a substep (2, 4)."""

    initial_speed: np.ndarray
    speed_rate: np.ndarray
    forward_speed: np.ndarray
    lateral_speed: np.ndarray
    angle: np.ndarray
    cell: np.ndarray
    share: np.ndarray
    east: np.ndarray
    north: np.ndarray
    arm: np.ndarray
    side: np.ndarray
    previous_response: np.ndarray
    residual: np.ndarray
    initial_state: np.ndarray
    mid_torques: np.ndarray
    end_torques: np.ndarray


def step_workspace() -> StepWorkspace:
    """Returns zeroed arrays for the intermediate values of a time step."""
    wheels = {name: np.zeros(4) for name in StepWorkspace._fields}
    vectors = {"previous_response": np.zeros(3), "residual": np.zeros(3), "initial_state": np.zeros(6)}
    cells, torques = np.zeros(4, dtype=np.int64), np.zeros((2, 4))
    return StepWorkspace(**{**wheels, **vectors, "cell": cells, "end_torques": torques})


@inlined
def store_wheel_kinematics(truck_state, regularising_speed, at_step_start, truck, workspace):
    """Compute each wheel's velocity, slip angle, heading and lever arms from the truck's state, and store them in
    ``workspace``."""
    x, y, angles = truck.x, truck.y, truck.tables.angles
    vx, vy, r = truck_state.state[3], truck_state.state[4], truck_state.state[5]
    c, s = truck.cosine, truck.sine
    cosine, aslant = math.cos(truck_state.state[2]), math.sin(truck_state.state[2])
    e, f = cosine * c - aslant * s, aslant * c + cosine * s
    for i in range(4):
        if i == 2:
            c, s, e, f = 1.0, 0.0, cosine, aslant
        arm, side = x[i] * s - y[i] * c, x[i] * c + y[i] * s
        u, v = e * vx + f * vy + arm * r, e * vy - f * vx + side * r
        if at_step_start:
            workspace.initial_speed[i] = u
        forwards = u if workspace.initial_speed[i] >= 0.0 else -u
        angle = math.atan2(abs(v), max(forwards, regularising_speed))
        workspace.speed_rate[i], workspace.angle[i] = (v - side * r) * r, angle
        workspace.forward_speed[i], workspace.lateral_speed[i] = max(forwards, 0.0), v
        workspace.cell[i], workspace.share[i] = cell_and_share(angles, angle)
        workspace.east[i], workspace.north[i], workspace.arm[i], workspace.side[i] = e, f, arm, side


@inlined
def store_tyre_forces(i, step_input, truck_state, truck, workspace):
    """Compute the forces, slip and angular velocity of a wheel at the end of a step, and store them in the report."""
    report, tables, load, u0, v = (
        report_of(truck_state.report),
        truck.tables,
        truck.load[i],
        workspace.initial_speed[i],
        workspace.lateral_speed[i],
    )
    sign, cells = 1.0 if u0 >= 0.0 else -1.0, TableCell(workspace.cell[i], workspace.share[i], 0, 0.0)
    w, force, slip, locked = wheel_step(
        WheelStepInput(
            sign * step_input.speed0, sign * step_input.speed1, step_input.torque0, step_input.torque1, step_input.step
        ),
        BrakedWheel(truck.radius[i], truck.spin_inertia[i], sign * truck_state.turning[i]),
        TyreGrip(0, 0, 0.0, cells, load, tables.slips, tables.mu_x),
    )
    k, cell_share = cell_and_share(tables.slips, abs(slip))
    side = load * lateral_adhesion(0, cells, k, cell_share, tables.g, tables.h)
    if slip > LOCKING_SLIP and (workspace.forward_speed[i] > 0.0 or v != 0.0):
        total, speed = math.hypot(force, side), math.hypot(workspace.forward_speed[i], v)
        cell_share = min((slip - LOCKING_SLIP) / (1.0 - LOCKING_SLIP), 1.0)
        force += cell_share * (total * workspace.forward_speed[i] / speed - force)
        side += cell_share * (total * abs(v) / speed - side)
    report.force_x[i], report.force_y[i] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report.load[i], report.slip[i], report.slip_angle[i] = load, slip, math.copysign(workspace.angle[i], v)
    report.locked[i], report.turning[i] = locked, sign * w


@inlined
def accelerations_by_tyres(truck_state, torques_before, torques_after, step, truck, workspace):
    """Accelerations (x, y, yaw; m/s^2, rad/s^2) that the tyre forces cause over a step (s) in which the brake torques
    go from ``torques_before`` to ``torques_after``. Wheel speeds are extrapolated by the present accelerations.
    """
    accelerations, report = truck_state.accelerations, report_of(truck_state.report)
    ax, ay, turn = 0.0, 0.0, 0.0
    for i in range(4):
        rate = (
            workspace.speed_rate[i]
            + workspace.east[i] * accelerations[0]
            + workspace.north[i] * accelerations[1]
            + workspace.arm[i] * accelerations[2]
        )
        speed = workspace.initial_speed[i]
        step_input = WheelStepInput(speed, speed + step * rate, torques_before[i], torques_after[i], step)
        store_tyre_forces(i, step_input, truck_state, truck, workspace)
        fx, fy, e, f = report.force_x[i], report.force_y[i], workspace.east[i], workspace.north[i]
        ax, ay = ax + e * fx - f * fy, ay + f * fx + e * fy
        turn += workspace.arm[i] * fx + workspace.side[i] * fy
    return ax / truck.mass, ay / truck.mass, turn / truck.yaw_inertia


@inlined
def iterate_accelerations(truck_state, torques, step, truck, workspace):
    """Iterate the truck's accelerations until they agree with the accelerations that the tyre forces cause. Returns
    whether this converged."""
    accelerations, last_residual = truck_state.accelerations, workspace.residual
    response_before = workspace.previous_response
    left, last_change = math.inf, 0.0
    for n in range(ANDERSON_ROUNDS):
        response, change, product, square = (
            accelerations_by_tyres(truck_state, torques[0], torques[1], step, truck, workspace),
            0.0,
            0.0,
            0.0,
        )
        for a in range(3):
            gap = response[a] - accelerations[a]
            change = max(change, abs(gap))
            product += gap * (gap - last_residual[a])
            square += (gap - last_residual[a]) ** 2
        left = change * min(change / last_change, 1.0) if last_change > 0.0 else change
        is_done, last_change = not left > ACCELERATION_TOLERANCE or n == ANDERSON_ROUNDS - 1, change
        mix = min(max(product / square, -2.0), 0.75) if n > 0 and square > 0.0 and not is_done else 0.0
        for a in range(3):
            last_residual[a] = response[a] - accelerations[a]
            accelerations[a] = response[a] - mix * (response[a] - response_before[a])
            response_before[a] = response[a]
        if is_done:
            break
    return left <= ACCELERATION_TOLERANCE


@inlined
def time_of_rest(truck_state, start, step, truck):
    """Time (s) within the step at which the truck comes to rest, or -1 if it still moves at the end."""
    accelerations, mass, inertia = truck_state.accelerations, truck.mass, truck.yaw_inertia
    speed = mass * (start[3] * start[3] + start[4] * start[4]) + inertia * start[5] * start[5]
    if speed == 0.0 and not truck_state.turning.any():
        return 0.0
    power = mass * (start[3] * accelerations[0] + start[4] * accelerations[1]) + inertia * start[5] * accelerations[2]
    rate = (
        mass * (accelerations[0] * accelerations[0] + accelerations[1] * accelerations[1])
        + inertia * accelerations[2] * accelerations[2]
    )
    if rate == 0.0 or power >= 0.0 or -power > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -power / rate


@inlined
def advance_state(truck_state, time_in_step, workspace):
    """Set the truck's state to the one a time (s) after the start of the step, at the present accelerations."""
    state, first, accelerations = truck_state.state, workspace.initial_state, truck_state.accelerations
    for a in range(3):
        state[3 + a] = first[3 + a] + time_in_step * accelerations[a]
        state[a] = first[a] + 0.5 * time_in_step * (first[3 + a] + state[3 + a])


@lean
def advance_truck(truck_state, torques, step, truck, workspace):
    """Advance the truck by one time step with brake torques (2, 4) at its ends. Returns how long (s) the truck moved
    within the step, or -1 if the accelerations did not converge."""
    first, middle = workspace.initial_state, workspace.mid_torques
    for a in range(6):
        first[a] = truck_state.state[a]
    for i in range(4):
        middle[i] = 0.5 * (torques[0, i] + torques[1, i])
    store_wheel_kinematics(truck_state, step.regularising_speed, True, truck, workspace)
    accelerations = accelerations_by_tyres(truck_state, torques[0], middle, 0.5 * step.duration, truck, workspace)
    truck_state.accelerations[0], truck_state.accelerations[1], truck_state.accelerations[2] = accelerations
    rest_time = time_of_rest(truck_state, first, step.duration, truck)
    if rest_time >= 0.0:
        advance_state(truck_state, rest_time, workspace)
        truck_state.state[3:], truck_state.turning[:] = 0.0, 0.0
        return rest_time
    advance_state(truck_state, 0.5 * step.duration, workspace)
    store_wheel_kinematics(truck_state, step.regularising_speed, False, truck, workspace)
    if not iterate_accelerations(truck_state, torques, step.duration, truck, workspace):
        return -1.0
    advance_state(truck_state, step.duration, workspace)
    turning = report_of(truck_state.report).turning
    for i in range(4):
        truck_state.turning[i] = turning[i]
    return step.duration


@lean
def advance_in_substeps(substep_count, truck_state, torques, step, truck, workspace):
    """Advance the truck by one time step in equal substeps. Returns how long (s) it moved, or -1 if the accelerations
    did not converge. The wheels' report becomes the mean over the substeps; locked times are added."""
    rows, sums, ends, time = truck_state.report, truck_state.weighted_sums, workspace.end_torques, 0.0
    step_part = Step(step.duration / substep_count, step.regularising_speed / substep_count)
    sums[:] = 0.0
    for k in range(substep_count):
        for i in range(4):
            for side in range(2):
                ends[side, i] = torques[0, i] + (torques[1, i] - torques[0, i]) * (k + side) / substep_count
        used = advance_truck(truck_state, ends, step_part, truck, workspace)
        if used < 0.0:
            return used
        time += used
        for c in range(REPORT_SIZE):
            for i in range(4):
                sums[c, i] += rows[c, i]
        if used < step_part.duration:
            return time
    report, locked = report_of(rows), report_of(sums).locked
    for c in range(REPORT_SIZE):
        for i in range(4):
            rows[c, i] = sums[c, i] / substep_count
    for i in range(4):
        report.locked[i], report.turning[i] = locked[i], truck_state.turning[i]
    return step.duration


@njit(cache=True, error_model="numpy")
def march(truck_state, brake_torques, steps_per_sample, step, truck, workspace, record):
    """Simulate a stop and fill ``record`` sample by sample. The brake torques (4,) act fully from the end of the
    first step on. Returns the number of samples, or 0 if the accelerations did not converge."""
    torques = np.zeros((2, 4))
    torques[1] = brake_torques
    record.times[0], record.states[0], record.turning[0] = 0.0, truck_state.state, truck_state.turning
    for n in range(1, record.times.size):
        used = 0.0
        for _ in range(steps_per_sample):
            speed = math.hypot(truck_state.state[3], truck_state.state[4])
            parts = int(min(math.ceil(step.regularising_speed / speed), MOST_SUBSTEPS))
            if parts <= 1:
                time_moved = advance_truck(truck_state, torques, step, truck, workspace)
            else:
                time_moved = advance_in_substeps(parts, truck_state, torques, step, truck, workspace)
            torques[0] = brake_torques
            used += time_moved
            if time_moved < step.duration:
                break
        record.times[n], record.states[n], record.turning[n] = (
            record.times[n - 1] + used,
            truck_state.state,
            truck_state.turning,
        )
        record.reports[n] = truck_state.report
        if time_moved < step.duration:
            return n + 1 if time_moved >= 0.0 else 0
    return record.times.size


def run(vehicle: Any, speed: float, steer: float, sample_limit: int) -> Callable[[], BrakingPath]:
    """Returns a function that simulates a stop with the hand-written code, from a speed (m/s) with steered front wheels
    (rad) and the parameters of a vehicle without effects (``models.systems.braking.march.BrakedVehicle``). The path has
    at most ``sample_limit`` samples, the start included."""
    plane, pressure, step = vehicle.plane, vehicle.chambers.supply, vehicle.sample / vehicle.substeps
    truck = Truck(
        plane.place[:, 0].copy(),
        plane.place[:, 1].copy(),
        plane.static_loads,
        plane.radius,
        plane.spin_inertia,
        plane.masses[0],
        plane.inertias[0],
        vehicle.tables,
        math.cos(steer),
        math.sin(steer),
    )
    torque, grid = vehicle.brakes.rising * pressure, Step(step, vehicle.slope * 9.81 * step)

    def run_stop() -> BrakingPath:
        truck_state = TruckState(np.zeros(6), np.zeros(3), speed / truck.radius, *np.zeros((2, REPORT_SIZE, 4)))
        truck_state.state[3] = speed
        stop = Stop(*(np.empty((sample_limit, *shape)) for shape in ((), (6,), (4,), (REPORT_SIZE, 4))))
        n = march(truck_state, torque, vehicle.substeps, grid, truck, step_workspace(), stop)
        applied = (np.arange(n) > 0.0)[:, None]
        return BrakingPath(
            stop.times[:n],
            stop.states[:n].reshape(n, 2, 3),
            stop.turning[:n],
            pressure * applied * np.ones(4),
            torque * applied,
            WheelReport(*np.moveaxis(stop.reports[1:n], 1, 0)),
            True,
            ("x", "y", "heading_0"),
        )

    return run_stop


STEER_ANGLE, SUPPLY_PRESSURE = 0.02, 0.5
"""Steer angle of the front wheels (rad); supply pressure of the brakes (bar), so low that all wheels still roll at
walking pace."""
Job = Callable[[], BrakingPath]


def bare_stops(speed: float) -> tuple[Job, Job]:
    """Two functions that simulate the same stop of a vehicle without effects from a speed (m/s): by twinrig and by the
    hand-written code."""
    scene = bare_scene(
        "braking",
        brakes={"supply": SUPPLY_PRESSURE},
        procedures={STOP: {"kind": "j_turn", "speed": speed, "steer": STEER_ANGLE}},
    )
    vehicle, start = vehicle_and_start_state(scene, STOP)

    def run_twinrig() -> BrakingPath:
        return vehicle.run(controller_of(scene, vehicle.plane.wheels, STOP), start, scene.run.duration)

    return run_twinrig, run(vehicle, speed, STEER_ANGLE, len(run_twinrig().times))


def tyre_forces(stop_path: BrakingPath) -> np.ndarray:
    """Longitudinal and lateral tyre forces (N), shape (2, number of samples - 1, number of wheels), in wheel axes."""
    return np.stack((stop_path.reports.force_x, stop_path.reports.force_y))


def largest_difference(twinrig: BrakingPath, by_hand: BrakingPath) -> float:
    """Largest difference between two stops among states (m, rad, m/s, rad/s), wheel speeds (rad/s), and tyre forces,
    pressures and torques. Forces, pressures and torques are divided by their largest values in the hand-written
    stop."""
    shares = [
        np.abs(values - other_values).max() / np.abs(other_values).max()
        for values, other_values in (
            (tyre_forces(twinrig), tyre_forces(by_hand)),
            (twinrig.pressures, by_hand.pressures),
            (twinrig.torques, by_hand.torques),
        )
    ]
    states, turning = np.abs(twinrig.states - by_hand.states).max(), np.abs(twinrig.turning - by_hand.turning).max()
    return float(max(states, turning, *shares))


def ratio_of_stops(speed: float, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference between twinrig's stop from a speed (m/s) and the hand-written one (see
    ``largest_difference``), and the ratio of computing times with its confidence interval."""
    jobs = bare_stops(speed)
    return largest_difference(*(job() for job in jobs)), paired_ratio(
        *interleave(jobs, round_count, clock=time.process_time)
    )
