"""One step of a braked vehicle in the plane: wheels exact, their mean forces to the vehicle, loads solved.

A half step gives the state in the middle, and the whole step takes its slip angles, loads and friction there: order
two. In both, loads follow from accelerations and these from the tyres' forces under the loads; the fixed point is found
to ``CLOSE``. Below ``regular``, the speed at which the tyres' cornering stiffness is as fast as the step, slip angles
are those of that speed.
"""

import math

import numpy as np

from models.braking.plane_chain import accelerations, centre_acceleration, load_on, point
from models.braking.tyre_table import across, place
from models.braking.wheel_step import wheel_step
from models.compiled import njit

CLOSE = 1e-10
"""Change of the accelerations (m/s^2, and rad/s^2 times 1 m) at which the loads are taken to be found."""
MOST_ROUNDS = 100
FORCE_X, FORCE_Y, LOAD, SLIP, SLIP_ANGLE, LOCKED, TURNING = range(7)
"""Columns of what each wheel reports: mean forces on it (N) in its own axes, load (N), mean slip, slip angle (rad),
time locked (s), speed of turning at the end (rad/s)."""
REPORTED = 7


@njit(cache=True, error_model="numpy")
def own_speeds(i, plane, positions, rates, steer):
    """Speeds (m/s) of the centre of wheel i along and across the wheel, and its heading (rad)."""
    k = plane.unit[i]
    vx, vy = point(k, plane.place[i, 0], plane.place[i, 1], positions, rates, plane.reach)
    heading = positions[2 + k] + steer[i]
    c, s = math.cos(heading), math.sin(heading)
    return c * vx + s * vy, c * vy - s * vx, heading


@njit(cache=True, error_model="numpy")
def tyre(i, start, middle, end, load, turning, torque0, torque1, step, plane, surface, regular, tables, report):
    """Fill the report of wheel i; start, middle, end: its speeds along and, in the middle, across (u, v)."""
    angles, slips, loads, mu_x, g, h = tables
    sign = 1.0 if start >= 0.0 else -1.0
    u, v = max(sign * middle[0], 0.0), middle[1]
    angle = math.atan2(abs(v), max(u, regular))
    first, second, share = surface[i, 0], surface[i, 1], surface[i, 2]
    p, q = place(angles, angle), place(loads, load)
    grip = (int(first), int(second), share, p[0], p[1], q[0], q[1], load)
    w, force, slip, locked = wheel_step(sign * start, sign * end, sign * turning[i], torque0[i], torque1[i], step,
                                        plane.radius[i], plane.spin[i], grip, slips, mu_x)  # fmt: skip
    size = min(max(abs(slip), 0.0), 1.0)
    side = across(int(first), angle, load, size, angles, slips, loads, g, h)
    if share > 0.0:
        side += share * (across(int(second), angle, load, size, angles, slips, loads, g, h) - side)
    side *= load
    if locked >= step * (1.0 - 1e-12):
        total, speed = math.hypot(force, side), math.hypot(u, v)
        if speed > 0.0:
            force, side = total * u / speed, total * abs(v) / speed
    report[i, FORCE_X], report[i, FORCE_Y] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report[i, LOAD], report[i, SLIP], report[i, SLIP_ANGLE] = load, slip, math.copysign(angle, v)
    report[i, LOCKED], report[i, TURNING] = locked, sign * w


@njit(cache=True, error_model="numpy")
def given_loads(positions, rates, found, plane, loads):
    """Fill the wheels' loads (N) under accelerations (2 + U); a wheel that would lift bears none."""
    for i in range(plane.unit.size):
        k = plane.group[i]
        ax, ay = centre_acceleration(k, positions, rates, found, plane.reach)
        c, s = math.cos(positions[2 + k]), math.sin(positions[2 + k])
        loads[i] = max(plane.static[i] + plane.by_x[i] * (c * ax + s * ay) + plane.by_y[i] * (c * ay - s * ax), 0.0)


@njit(cache=True, error_model="numpy")
def under(found, start, middle, turning, torque0, torque1, step, steer, surface, regular, plane, tables, out, report):
    """Fill ``out`` (2 + U) with the accelerations by the tyres' forces if they were ``found``: the map whose fixed
    point is wanted. start, middle : positions and rates (2, 2 + U) at the start and where slip angles are taken."""
    wheels, size = plane.unit.size, out.size
    loads, total, end = np.empty(wheels), np.zeros(size), np.empty((2, size))
    end[1] = start[1] + step * found
    end[0] = start[0] + 0.5 * step * (start[1] + end[1])
    given_loads(middle[0], middle[1], found, plane, loads)
    for i in range(wheels):
        before, _, _ = own_speeds(i, plane, start[0], start[1], steer)
        u, v, heading = own_speeds(i, plane, middle[0], middle[1], steer)
        after, _, _ = own_speeds(i, plane, end[0], end[1], steer)
        tyre(i, before, (u, v), after, loads[i], turning, torque0, torque1, step, plane, surface, regular, tables,
             report)  # fmt: skip
        c, s = math.cos(heading), math.sin(heading)
        fx, fy = report[i, FORCE_X], report[i, FORCE_Y]
        load_on(plane.unit[i], plane.place[i, 0], plane.place[i, 1], c * fx - s * fy, s * fx + c * fy, middle[0],
                plane.reach, total)  # fmt: skip
    out[:] = found
    accelerations(middle[0], middle[1], total, plane.masses, plane.inertias, plane.reach, plane.hooked, out)


@njit(cache=True, error_model="numpy")
def stage(start, middle, turning, torque0, torque1, step, steer, surface, regular, plane, tables, found, report):
    """Mean accelerations over a step, into ``found`` (2 + U): what stands there is where the search begins.

    Anderson's method of depth one. Returns the rounds that it took; MOST_ROUNDS if the loads were not found.
    """
    size = found.size
    out, off, off0, out0 = np.empty(size), np.empty(size), np.zeros(size), np.zeros(size)
    for rounds in range(1, MOST_ROUNDS + 1):
        under(found, start, middle, turning, torque0, torque1, step, steer, surface, regular, plane, tables, out,
              report)  # fmt: skip
        off[:] = out - found
        if not np.abs(off).max() > CLOSE:
            found[:] = out
            return rounds
        mix = 0.0
        if rounds > 1:
            change = off - off0
            mix = (off * change).sum() / (change * change).sum()
            mix = min(max(mix, -2.0), 0.75) if math.isfinite(mix) else 0.0
        found[:] = out - mix * (out - out0)
        off0[:], out0[:] = off, out
    return MOST_ROUNDS


@njit(cache=True, error_model="numpy")
def comes_to_rest(rates, found, step, plane):
    """Time (s) within the step at which the vehicle stands, or -1 if it does not.

    Friction takes speed away until there is none, and only the time grid would let it turn round: it stands where its
    kinetic energy along the step is least, if it was about to lose all of its speed in that step anyhow.
    """
    speed, both, rate = 0.0, 0.0, 0.0
    for a in range(rates.size):
        weight = plane.masses.sum() if a < 2 else plane.inertias[a - 2]
        speed += weight * rates[a] ** 2
        both += weight * rates[a] * found[a]
        rate += weight * found[a] ** 2
    if rate == 0.0 or both >= 0.0 or -both > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -both / rate


@njit(cache=True, error_model="numpy")
def step_on(state, turning, torque0, torque1, step, steer, surface, regular, plane, tables, found, report):
    """One step of ``state`` (2, 2 + U), positions and rates, and ``turning`` (W,): speeds of the wheels (rad/s).

    torque0, torque1 : of the brakes (W,) at the step's ends; steer (W,) : angles of the wheels in their units (rad);
    surface (W, 3) : tables of each wheel and the share of the second; regular : m/s; found (2 + U,) : accelerations,
    those of the step before on entry. Returns the time (s) of the step at which the vehicle comes to rest, ``step``
    if it does not, -1 if the loads were not found.
    """
    start, middle = state.copy(), state.copy()
    torque = 0.5 * (torque0 + torque1)
    if stage(start, start, turning, torque0, torque, 0.5 * step, steer, surface, regular, plane, tables, found,
             report) == MOST_ROUNDS:  # fmt: skip
        return -1.0
    rest = -1.0 if plane.hooked else comes_to_rest(start[1], found, step, plane)
    if rest >= 0.0:
        state[0] = start[0] + rest * start[1] + 0.5 * rest * rest * found
        state[1] = 0.0
        turning[:] = 0.0
        return rest
    middle[1] = start[1] + 0.5 * step * found
    middle[0] = start[0] + 0.25 * step * (start[1] + middle[1])
    if stage(start, middle, turning, torque0, torque1, step, steer, surface, regular, plane, tables, found,
             report) == MOST_ROUNDS:  # fmt: skip
        return -1.0
    state[1] = start[1] + step * found
    state[0] = start[0] + 0.5 * step * (start[1] + state[1])
    turning[:] = report[:, TURNING]
    return step
