"""A truck that brakes in a turn on one surface, written out for that alone: what a bare scene of braking comes to.

One rigid body on four wheels whose loads stay, brakes that are all applied from the start and whose torques follow at
once, front wheels held at one angle. No trailer, load transfer, second surface, brake dynamics, hysteresis, controller
or engine, and no way to have them. The method is that of ``models.brake.plane_step``; how a wheel goes through a step
and what a tyre's table says are the tyre's.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from models.brake.wheel_step import wheel_step
from models.machine.compiled import inlined, lean, njit
from models.machine.timing import interleave, paired_ratio
from models.systems.braking.march import Path
from models.systems.braking.procedures import controller_of, ready
from models.tyre.tyre_table import across, place
from validation.absence.braking import STOP
from validation.absence.of_systems import bare

CLOSE, NEARLY, PATIENCE = 1e-7, 0.98, 12
START, RATE, ALONG, ASIDE, ANGLE, CELL, PART, EAST, NORTH, ARM, SIDE = range(11)
"""Columns of what a step knows of each wheel: see ``models.brake.plane_step``; where it heads, and arms of its forces
about the centre of mass."""
COLUMNS, LOCKED = 7, 5
MOST_PARTS = 64


@inlined
def settle(now, course, regular, starts, truck, angles, known):
    """Fill what is known (4, 11) of the wheels at a state ``now`` (6,): x, y, heading and their rates."""
    x, y = truck[:2]
    vx, vy, r = now[3], now[4], now[5]
    c, s = course
    ahead, aslant = math.cos(now[2]), math.sin(now[2])
    e, f = ahead * c - aslant * s, aslant * c + ahead * s
    for i in range(4):
        if i == 2:
            c, s, e, f = 1.0, 0.0, ahead, aslant
        arm, side = x[i] * s - y[i] * c, x[i] * c + y[i] * s
        u, v = e * vx + f * vy + arm * r, e * vy - f * vx + side * r
        if starts:
            known[i, START] = u
        forwards = u if known[i, START] >= 0.0 else -u
        angle = math.atan2(abs(v), max(forwards, regular))
        known[i, RATE], known[i, ALONG], known[i, ASIDE] = (v - side * r) * r, max(forwards, 0.0), v
        known[i, ANGLE] = angle
        known[i, CELL], known[i, PART] = place(angles, angle)
        known[i, EAST], known[i, NORTH], known[i, ARM], known[i, SIDE] = e, f, arm, side


@inlined
def tyre(know, rate, w0, torque0, torque1, step, load, radius, spin, tables, report):
    """Fill the report (7,) of a wheel whose centre's speed along it changes at a ``rate``."""
    _, slips, _, mu_x, g, h = tables
    u0, v, sign, c, p = know[START], know[ASIDE], 1.0 if know[START] >= 0.0 else -1.0, int(know[CELL]), know[PART]
    w, force, slip, locked = wheel_step(
        sign * u0,
        sign * (u0 + step * rate),
        sign * w0,
        torque0,
        torque1,
        step,
        radius,
        spin,
        (0, 0, 0.0, c, p, 0, 0.0, load),
        slips,
        mu_x,
    )
    k, part = place(slips, abs(slip))
    side = load * across(0, c, p, 0, 0.0, k, part, g, h)
    if slip > NEARLY and (know[ALONG] > 0.0 or v != 0.0):
        total, speed = math.hypot(force, side), math.hypot(know[ALONG], v)
        part = min((slip - NEARLY) / (1.0 - NEARLY), 1.0)
        force += part * (total * know[ALONG] / speed - force)
        side += part * (total * abs(v) / speed - side)
    report[0], report[1], report[2] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0, load
    report[3], report[4], report[5], report[6] = slip, math.copysign(know[ANGLE], v), locked, sign * w


@inlined
def rounds(turning, torque0, torque1, step, most, truck, tables, known, found, last, report):
    """Accelerations ``found`` (3,) that the tyres' forces give back; ``last`` (2, 3) is room. False if none."""
    _, _, load, radius, spin, mass, inertia = truck
    left, before = math.inf, 0.0
    for n in range(most):
        ax, ay, turn = 0.0, 0.0, 0.0
        for i in range(4):
            know = known[i]
            rate = know[RATE] + know[EAST] * found[0] + know[NORTH] * found[1] + know[ARM] * found[2]
            tyre(know, rate, turning[i], torque0[i], torque1[i], step, load[i], radius[i], spin[i], tables, report[i])
            fx, fy = report[i, 0], report[i, 1]
            ax, ay = ax + know[EAST] * fx - know[NORTH] * fy, ay + know[NORTH] * fx + know[EAST] * fy
            turn += know[ARM] * fx + know[SIDE] * fy
        out, change, product, square = (ax / mass, ay / mass, turn / inertia), 0.0, 0.0, 0.0
        for a in range(3):
            off = out[a] - found[a]
            change = max(change, abs(off))
            product += off * (off - last[1, a])
            square += (off - last[1, a]) ** 2
        left = change * min(change / before, 1.0) if before > 0.0 else change
        done, before = not left > CLOSE or n == most - 1, change
        mix = min(max(product / square, -2.0), 0.75) if n > 0 and square > 0.0 and not done else 0.0
        for a in range(3):
            last[1, a] = out[a] - found[a]
            found[a] = out[a] - mix * (out[a] - last[0, a])
            last[0, a] = out[a]
        if done:
            break
    return left <= CLOSE or most == 1


@inlined
def rests(now, turning, found, step, mass, inertia):
    """Time within the step at which the truck stands, or -1 if it does not."""
    speed = mass * (now[3] * now[3] + now[4] * now[4]) + inertia * now[5] * now[5]
    if speed == 0.0 and not turning.any():
        return 0.0
    both = mass * (now[3] * found[0] + now[4] * found[1]) + inertia * now[5] * found[2]
    rate = mass * (found[0] * found[0] + found[1] * found[1]) + inertia * found[2] * found[2]
    if rate == 0.0 or both >= 0.0 or -both > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -both / rate


@lean
def go(now, turning, torque0, torque1, step, course, regular, truck, tables, room, report):
    """One step; how long the truck still moves in it, -1 if no accelerations were found."""
    known, found, last, first, middle = room
    for a in range(6):
        first[a] = now[a]
    for i in range(4):
        middle[i] = 0.5 * (torque0[i] + torque1[i])
    for half in (True, False):
        settle(now, course, regular, half, truck, tables[0], known)
        time, end = (0.5 * step, middle) if half else (step, torque1)
        if not rounds(turning, torque0, end, time, 1 if half else PATIENCE, truck, tables, known, found, last, report):
            return -1.0
        rest = rests(first, turning, found, step, truck[5], truck[6]) if half else -1.0
        if rest >= 0.0:
            time = rest
        for a in range(3):
            now[3 + a] = first[3 + a] + time * found[a]
            now[a] = first[a] + 0.5 * time * (first[3 + a] + now[3 + a])
        if rest >= 0.0:
            now[3:], turning[:] = 0.0, 0.0
            return rest
    for i in range(4):
        turning[i] = report[i, 6]
    return step


@lean
def in_parts(parts, now, turning, torque0, torque1, step, course, regular, truck, tables, room, ends, sums, report):
    """``go`` in equal parts of a step; the report is their mean, and of times locked the sum."""
    piece, time = step / parts, 0.0
    sums[:] = 0.0
    for k in range(parts):
        for i in range(4):
            for side in range(2):
                ends[side, i] = torque0[i] + (torque1[i] - torque0[i]) * (k + side) / parts
        used = go(now, turning, ends[0], ends[1], piece, course, regular / parts, truck, tables, room, report)
        if used < 0.0:
            return used
        time += used
        for i in range(4):
            for c in range(COLUMNS - 1):
                sums[i, c] += report[i, c]
        if used < piece:
            return time
    for i in range(4):
        for c in range(COLUMNS - 1):
            report[i, c] = sums[i, c] if c == LOCKED else sums[i, c] / parts
    return step


@njit(cache=True, error_model="numpy")
def march(speed, course, torque, sample, steps, slope, truck, tables, times, states, turned, reports):
    """The whole stop: fills times (n,), states (n, 6), turning (n, 4) and reports (n, 4, 7) of the steps' ends, sample
    by sample, of which it returns the number, 0 if no accelerations were found; torque (4,) is there from the first
    step's end on."""
    now, turning, none, step = np.zeros(6), speed / truck[3], np.zeros(4), sample / steps
    room = np.empty((4, 11)), np.zeros(3), np.zeros((2, 3)), np.empty(6), np.empty(4)
    ends, sums, regular = np.empty((2, 4)), np.empty((4, COLUMNS)), slope * 9.81 * step
    now[3], states[0], turned[0], times[0] = speed, 0.0, turning, 0.0
    states[0, 3] = speed
    for n in range(1, times.size):
        used = 0.0
        for k in range(steps):
            first = none if n == 1 and k == 0 else torque
            parts = int(min(math.ceil(regular / math.hypot(now[3], now[4])), MOST_PARTS))
            if parts <= 1:
                part = go(now, turning, first, torque, step, course, regular, truck, tables, room, reports[n])
            else:
                part = in_parts(
                    parts,
                    now,
                    turning,
                    first,
                    torque,
                    step,
                    course,
                    regular,
                    truck,
                    tables,
                    room,
                    ends,
                    sums,
                    reports[n],
                )
            used += part
            if part < step:
                break
        times[n], states[n], turned[n] = times[n - 1] + used, now, turning
        if part < step:
            return n + 1 if part >= 0.0 else 0
    return times.size


def run(vehicle: Any, speed: float, steer: float, samples: int) -> Callable[[], Path]:
    """One stop from a speed (m/s) with the front wheels at an angle (rad) of the numbers of a bare vehicle
    (``models.systems.braking.run.Braked``), in at most so many samples, the start included."""
    p, tyres, pressure = vehicle.plane, vehicle.tables.packed, vehicle.chambers.supply
    truck = (p.place[:, 0].copy(), p.place[:, 1].copy(), p.static, p.radius, p.spin, p.masses[0], p.inertias[0])
    course, torque = (math.cos(steer), math.sin(steer)), vehicle.brakes.rising * pressure

    def marched() -> Path:
        times, states, turned, reports = (np.empty((samples, *shape)) for shape in ((), (6,), (4,), (4, COLUMNS)))
        n = march(
            speed,
            course,
            torque,
            vehicle.sample,
            vehicle.substeps,
            vehicle.slope,
            truck,
            tyres,
            times,
            states,
            turned,
            reports,
        )
        applied = (np.arange(n) > 0.0)[:, None]
        return Path(
            times[:n],
            states[:n].reshape(n, 2, 3),
            turned[:n],
            pressure * applied * np.ones(4),
            torque * applied,
            reports[1:n],
            True,
            ("x", "y", "heading_0"),
        )

    return marched


STEER, SUPPLY = 0.02, 0.5
"""Angle of the front wheels (rad); pressure of the brakes (bar): all wheels roll down to walking pace, so that their
whole motion takes part."""
Job = Callable[[], Path]


def stops(speed: float) -> tuple[Job, Job]:
    """Stops of a bare vehicle from a speed (m/s), built beforehand, and of the written one."""
    scene = bare(
        "braking", brakes={"supply": SUPPLY}, procedures={STOP: {"kind": "j_turn", "speed": speed, "steer": STEER}}
    )
    vehicle, start = ready(scene, STOP)

    def ours() -> Path:
        return vehicle.run(controller_of(scene, vehicle.plane.wheels, STOP), start, scene.run.duration)

    return ours, run(vehicle, speed, STEER, len(ours().times))


def gap(ours: Path, theirs: Path) -> float:
    """Largest difference of states (m, rad, m/s, rad/s), of the wheels' turning (rad/s), of the tyres' forces by the
    largest one, and of pressures and torques by theirs."""
    shares = [
        np.abs(one - other).max() / np.abs(other).max()
        for one, other in (
            (ours.reports[..., :2], theirs.reports[..., :2]),
            (ours.pressures, theirs.pressures),
            (ours.torques, theirs.torques),
        )
    ]
    return float(max(np.abs(ours.states - theirs.states).max(), np.abs(ours.turning - theirs.turning).max(), *shares))


def ratio_of_stops(speed: float, rounds: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of a stop from a speed (m/s), see ``gap``, and the ratio of seconds with its interval."""
    jobs = stops(speed)
    return gap(*(job() for job in jobs)), paired_ratio(*interleave(jobs, rounds, clock=time.process_time))
