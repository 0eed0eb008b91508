"""A truck that brakes in a turn on one surface, written out for that alone: what a bare scene of braking comes to.

One rigid body on four wheels whose loads stay, brakes that are all applied from the start and whose torques follow at
once, front wheels held at one angle. No trailer, load transfer, second surface, brake dynamics, hysteresis, controller
or engine, and no way to have them. The method is that of ``models.brake.plane_step``; how a wheel goes through a step
and what a tyre's table says are the tyre's.
"""

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from models.brake.plane_records import REPORT_SIZE, Report, report_of
from models.brake.wheel_step import Grip, StepInput, Wheel, wheel_step
from models.machine.compiled import inlined, lean, njit
from models.machine.timing import interleave, paired_ratio
from models.systems.braking.march import BrakingPath
from models.systems.braking.procedures import controller_of, vehicle_and_start
from models.tyre.tyre_table import TableCell, Tables, cell_and_share, lateral_adhesion
from validation.absence.braking import STOP
from validation.absence.of_systems import bare_scene

ACCELERATION_TOLERANCE, LOCKING_SLIP, ANDERSON_ROUNDS = 1e-7, 0.98, 12
MOST_PARTS = 64


class Truck(NamedTuple):
    """A truck with four wheels: their positions (m), loads (N), radii (m) and inertias (kg m^2); mass (kg), yaw inertia
    (kg m^2), tyre tables; cosine and sine of the front wheels' steer angle."""

    x: np.ndarray
    y: np.ndarray
    load: np.ndarray
    radius: np.ndarray
    spin: np.ndarray
    mass: float
    inertia: float
    tables: Tables
    cosine: float
    sine: float


class Step(NamedTuple):
    """Length of a step (s), and the speed (m/s) below which slip angles are computed as at this speed."""

    time: float
    regular: float


class TruckState(NamedTuple):
    """Present state of the truck: x, y, heading and their rates (6,); accelerations (3,); angular velocities of the
    wheels (4,). Reports (7, 4) of the wheels for a step, and their sums over the parts of a step."""

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


class Known(NamedTuple):
    """Workspace of a step. Arrays (4,) hold each wheel's state (see ``models.brake.plane_records.Wheels``), its
    heading, and lever arms about the centre of mass. last, off (3,): accelerations of an iteration and their error;
    first (6,): initial state; middle (4,): torques at mid-step; ends (2, 4): torques at the ends of a substep."""

    start: np.ndarray
    rate: np.ndarray
    along: np.ndarray
    aside: np.ndarray
    angle: np.ndarray
    cell: np.ndarray
    share: np.ndarray
    east: np.ndarray
    north: np.ndarray
    arm: np.ndarray
    side: np.ndarray
    last: np.ndarray
    off: np.ndarray
    first: np.ndarray
    middle: np.ndarray
    ends: np.ndarray


def step_workspace() -> Known:
    """Zeroed arrays in which a step keeps its intermediate values."""
    wheels = {name: np.zeros(4) for name in Known._fields}
    others = {"last": np.zeros(3), "off": np.zeros(3), "first": np.zeros(6), "ends": np.zeros((2, 4))}
    return Known(**{**wheels, **others, "cell": np.zeros(4, dtype=np.int64)})


@inlined
def settle(now, regular, starts, truck, known):
    """Compute each wheel's velocity, slip angle, heading and lever arms from the truck's state, and store them in
    ``known``."""
    x, y, angles = truck.x, truck.y, truck.tables.angles
    vx, vy, r = now.state[3], now.state[4], now.state[5]
    c, s = truck.cosine, truck.sine
    ahead, aslant = math.cos(now.state[2]), math.sin(now.state[2])
    e, f = ahead * c - aslant * s, aslant * c + ahead * s
    for i in range(4):
        if i == 2:
            c, s, e, f = 1.0, 0.0, ahead, aslant
        arm, side = x[i] * s - y[i] * c, x[i] * c + y[i] * s
        u, v = e * vx + f * vy + arm * r, e * vy - f * vx + side * r
        if starts:
            known.start[i] = u
        forwards = u if known.start[i] >= 0.0 else -u
        angle = math.atan2(abs(v), max(forwards, regular))
        known.rate[i], known.along[i], known.aside[i] = (v - side * r) * r, max(forwards, 0.0), v
        known.angle[i] = angle
        known.cell[i], known.share[i] = cell_and_share(angles, angle)
        known.east[i], known.north[i], known.arm[i], known.side[i] = e, f, arm, side


@inlined
def tyre(i, given, now, truck, known):
    """Compute the forces, slip and angular velocity of wheel i at the end of a step, and store them in the report."""
    report, tables, load, u0, v = report_of(now.report), truck.tables, truck.load[i], known.start[i], known.aside[i]
    sign, cells = 1.0 if u0 >= 0.0 else -1.0, TableCell(known.cell[i], known.share[i], 0, 0.0)
    w, force, slip, locked = wheel_step(
        StepInput(sign * given.speed0, sign * given.speed1, given.torque0, given.torque1, given.step),
        Wheel(truck.radius[i], truck.spin[i], sign * now.turning[i]),
        Grip(0, 0, 0.0, cells, load, tables.slips, tables.mu_x),
    )
    k, part = cell_and_share(tables.slips, abs(slip))
    side = load * lateral_adhesion(0, cells, k, part, tables.g, tables.h)
    if slip > LOCKING_SLIP and (known.along[i] > 0.0 or v != 0.0):
        total, speed = math.hypot(force, side), math.hypot(known.along[i], v)
        part = min((slip - LOCKING_SLIP) / (1.0 - LOCKING_SLIP), 1.0)
        force += part * (total * known.along[i] / speed - force)
        side += part * (total * abs(v) / speed - side)
    report.force_x[i], report.force_y[i] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report.load[i], report.slip[i], report.slip_angle[i] = load, slip, math.copysign(known.angle[i], v)
    report.locked[i], report.turning[i] = locked, sign * w


@inlined
def respond(now, before, after, step, truck, known):
    """Accelerations that the tyre forces cause over a step (s) in which the torques go from ``before`` to ``after``,
    with wheel speeds extrapolated by the present accelerations."""
    accelerations, report = now.accelerations, report_of(now.report)
    ax, ay, turn = 0.0, 0.0, 0.0
    for i in range(4):
        rate = (
            known.rate[i]
            + known.east[i] * accelerations[0]
            + known.north[i] * accelerations[1]
            + known.arm[i] * accelerations[2]
        )
        given = StepInput(known.start[i], known.start[i] + step * rate, before[i], after[i], step)
        tyre(i, given, now, truck, known)
        fx, fy, e, f = report.force_x[i], report.force_y[i], known.east[i], known.north[i]
        ax, ay = ax + e * fx - f * fy, ay + f * fx + e * fy
        turn += known.arm[i] * fx + known.side[i] * fy
    return ax / truck.mass, ay / truck.mass, turn / truck.inertia


@inlined
def iterate_accelerations(now, torques, step, truck, known):
    """Iterate until the accelerations agree with those that the tyre forces cause; returns whether this converged."""
    accelerations, last, off = now.accelerations, known.last, known.off
    left, before = math.inf, 0.0
    for n in range(ANDERSON_ROUNDS):
        out, change, product, square = respond(now, torques[0], torques[1], step, truck, known), 0.0, 0.0, 0.0
        for a in range(3):
            gap = out[a] - accelerations[a]
            change = max(change, abs(gap))
            product += gap * (gap - off[a])
            square += (gap - off[a]) ** 2
        left = change * min(change / before, 1.0) if before > 0.0 else change
        done, before = not left > ACCELERATION_TOLERANCE or n == ANDERSON_ROUNDS - 1, change
        mix = min(max(product / square, -2.0), 0.75) if n > 0 and square > 0.0 and not done else 0.0
        for a in range(3):
            off[a] = out[a] - accelerations[a]
            accelerations[a] = out[a] - mix * (out[a] - last[a])
            last[a] = out[a]
        if done:
            break
    return left <= ACCELERATION_TOLERANCE


@inlined
def time_of_rest(now, first, step, truck):
    """Time within the step at which the truck comes to rest, or -1 if it still moves at the end."""
    accelerations, mass, inertia = now.accelerations, truck.mass, truck.inertia
    speed = mass * (first[3] * first[3] + first[4] * first[4]) + inertia * first[5] * first[5]
    if speed == 0.0 and not now.turning.any():
        return 0.0
    both = mass * (first[3] * accelerations[0] + first[4] * accelerations[1]) + inertia * first[5] * accelerations[2]
    rate = (
        mass * (accelerations[0] * accelerations[0] + accelerations[1] * accelerations[1])
        + inertia * accelerations[2] * accelerations[2]
    )
    if rate == 0.0 or both >= 0.0 or -both > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -both / rate


@inlined
def moved_state(now, time, known):
    """Advance the state by a time (s) from the start of the step."""
    state, first, accelerations = now.state, known.first, now.accelerations
    for a in range(3):
        state[3 + a] = first[3 + a] + time * accelerations[a]
        state[a] = first[a] + 0.5 * time * (first[3 + a] + state[3 + a])


@lean
def go(now, torques, step, truck, known):
    """Advance the truck by one ``Step`` with torques (2, 4) at its ends. Returns for how long the truck moved, or -1 if
    the accelerations did not converge."""
    first, middle = known.first, known.middle
    for a in range(6):
        first[a] = now.state[a]
    for i in range(4):
        middle[i] = 0.5 * (torques[0, i] + torques[1, i])
    settle(now, step.regular, True, truck, known)
    accelerations = respond(now, torques[0], middle, 0.5 * step.time, truck, known)
    now.accelerations[0], now.accelerations[1], now.accelerations[2] = accelerations
    rest = time_of_rest(now, first, step.time, truck)
    if rest >= 0.0:
        moved_state(now, rest, known)
        now.state[3:], now.turning[:] = 0.0, 0.0
        return rest
    moved_state(now, 0.5 * step.time, known)
    settle(now, step.regular, False, truck, known)
    if not iterate_accelerations(now, torques, step.time, truck, known):
        return -1.0
    moved_state(now, step.time, known)
    turning = report_of(now.report).turning
    for i in range(4):
        now.turning[i] = turning[i]
    return step.time


@lean
def in_parts(parts, now, torques, step, truck, known):
    """Advance by a ``Step`` in equal substeps with ``go``. The report is the mean over the substeps; times of locking
    are added."""
    rows, sums, part, time = now.report, now.weighted_sums, Step(step.time / parts, step.regular / parts), 0.0
    sums[:] = 0.0
    for k in range(parts):
        for i in range(4):
            for side in range(2):
                known.ends[side, i] = torques[0, i] + (torques[1, i] - torques[0, i]) * (k + side) / parts
        used = go(now, known.ends, part, truck, known)
        if used < 0.0:
            return used
        time += used
        for c in range(REPORT_SIZE):
            for i in range(4):
                sums[c, i] += rows[c, i]
        if used < part.time:
            return time
    report, locked = report_of(rows), report_of(sums).locked
    for c in range(REPORT_SIZE):
        for i in range(4):
            rows[c, i] = sums[c, i] / parts
    for i in range(4):
        report.locked[i], report.turning[i] = locked[i], now.turning[i]
    return step.time


@njit(cache=True, error_model="numpy")
def march(now, torque, steps, step, truck, known, stop):
    """Fill a ``Stop`` sample by sample, with ``steps`` steps per sample. torque (4,) acts fully from the end of the
    first step on. Returns the number of samples, or 0 if the accelerations did not converge."""
    torques = np.zeros((2, 4))
    torques[1] = torque
    stop.times[0], stop.states[0], stop.turning[0] = 0.0, now.state, now.turning
    for n in range(1, stop.times.size):
        used = 0.0
        for _ in range(steps):
            parts = int(min(math.ceil(step.regular / math.hypot(now.state[3], now.state[4])), MOST_PARTS))
            if parts <= 1:
                part = go(now, torques, step, truck, known)
            else:
                part = in_parts(parts, now, torques, step, truck, known)
            torques[0] = torque
            used += part
            if part < step.time:
                break
        stop.times[n], stop.states[n], stop.turning[n] = stop.times[n - 1] + used, now.state, now.turning
        stop.reports[n] = now.report
        if part < step.time:
            return n + 1 if part >= 0.0 else 0
    return stop.times.size


def run(vehicle: Any, speed: float, steer: float, samples: int) -> Callable[[], BrakingPath]:
    """A hand-written stop from a speed (m/s) with steered front wheels (rad), built from the parameters of a bare
    vehicle (``models.systems.braking.march.BrakedVehicle``). It has at most ``samples`` samples, the start included."""
    plane, pressure, step = vehicle.plane, vehicle.chambers.supply, vehicle.sample / vehicle.substeps
    truck = Truck(
        plane.place[:, 0].copy(),
        plane.place[:, 1].copy(),
        plane.static,
        plane.radius,
        plane.spin,
        plane.masses[0],
        plane.inertias[0],
        vehicle.tables,
        math.cos(steer),
        math.sin(steer),
    )
    torque, grid = vehicle.brakes.rising * pressure, Step(step, vehicle.slope * 9.81 * step)

    def marched() -> BrakingPath:
        now = TruckState(np.zeros(6), np.zeros(3), speed / truck.radius, *np.zeros((2, REPORT_SIZE, 4)))
        now.state[3] = speed
        stop = Stop(*(np.empty((samples, *shape)) for shape in ((), (6,), (4,), (REPORT_SIZE, 4))))
        n = march(now, torque, vehicle.substeps, grid, truck, step_workspace(), stop)
        applied = (np.arange(n) > 0.0)[:, None]
        return BrakingPath(
            stop.times[:n],
            stop.states[:n].reshape(n, 2, 3),
            stop.turning[:n],
            pressure * applied * np.ones(4),
            torque * applied,
            Report(*np.moveaxis(stop.reports[1:n], 1, 0)),
            True,
            ("x", "y", "heading_0"),
        )

    return marched


STEER_ANGLE, SUPPLY_PRESSURE = 0.02, 0.5
"""Angle of the front wheels (rad); pressure of the brakes (bar): all wheels roll down to walking pace, so that their
whole motion takes part."""
Job = Callable[[], BrakingPath]


def bare_stops(speed: float) -> tuple[Job, Job]:
    """Two stops of the bare vehicle from a speed (m/s), ready to run: by twinrig and by the hand-written code."""
    scene = bare_scene(
        "braking",
        brakes={"supply": SUPPLY_PRESSURE},
        procedures={STOP: {"kind": "j_turn", "speed": speed, "steer": STEER_ANGLE}},
    )
    vehicle, start = vehicle_and_start(scene, STOP)

    def ours() -> BrakingPath:
        return vehicle.run(controller_of(scene, vehicle.plane.wheels, STOP), start, scene.run.duration)

    return ours, run(vehicle, speed, STEER_ANGLE, len(ours().times))


def forces(path: BrakingPath) -> np.ndarray:
    """Longitudinal and lateral forces (2, n - 1, W) in N of the W tyres, in the wheels' axes."""
    return np.stack((path.reports.force_x, path.reports.force_y))


def largest_difference(ours: BrakingPath, theirs: BrakingPath) -> float:
    """Largest difference between two stops: of states (m, rad, m/s, rad/s) and wheel speeds (rad/s), and of tyre
    forces, pressures and torques, these divided by their largest values."""
    shares = [
        np.abs(states - other).max() / np.abs(other).max()
        for states, other in (
            (forces(ours), forces(theirs)),
            (ours.pressures, theirs.pressures),
            (ours.torques, theirs.torques),
        )
    ]
    return float(max(np.abs(ours.states - theirs.states).max(), np.abs(ours.turning - theirs.turning).max(), *shares))


def ratio_of_stops(speed: float, rounds: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference between twinrig's stop from a speed (m/s) and the hand-written one (see
    ``largest_difference``), and the ratio of computing times with its confidence interval."""
    jobs = bare_stops(speed)
    return largest_difference(*(job() for job in jobs)), paired_ratio(
        *interleave(jobs, rounds, clock=time.process_time)
    )
