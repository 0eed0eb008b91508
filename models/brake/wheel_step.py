"""Rotation of one braked wheel over one step: exact between the nodes of its tyre table, with an explicit locked state.

With the speed u of its centre changing at a constant rate over the step, J w' = r F(s) - T and s = (u - r w) / u give

    s' = -(r^2 / (J u)) (F(s) - T / r) + (1 - s) u' / u

of which F is linear in s from node to node: with u in the denominators at its mean, each piece is an exponential and
the time of its end a logarithm. The force that the vehicle takes over the step is the mean one,

    F = (J (w1 - w0) / h + T) / r,

so that no momentum is lost. The paper's scheme (exact wheel, start-of-step force on the vehicle) is up to 58 % off in
the stopping distance of light braking. A wheel that has stopped stays so while T >= r F(1).
"""

import math
from typing import NamedTuple

import numpy as np

from models.machine.compiled import lean
from models.tyre.tyre_table import TableCell, cell_and_share, longitudinal_adhesion

SLOWEST_SPEED = 1e-9
"""Speed (m/s) that replaces lower speeds of a wheel's centre: slip has no meaning at rest."""
PIECE_LIMIT = 100_000


class BrakedWheel(NamedTuple):
    """A rotating wheel: radius (m), inertia about its axle (kg m^2), and rotational speed at the start of a step
    (rad/s), negative if against the direction of the wheel's centre.
    """

    radius: float
    inertia: float
    turning: float


class TyreGrip(NamedTuple):
    """Longitudinal tyre force as a function of slip, at a constant slip angle and load.

    first, second : its two tables; share : of the second; cells : of the slip angle and the load in both; load : N;
    slips (s,), mu_x (t, a, f, s) : see ``models.tyre.tyre_table.StackedTyreTables``.
    """

    first: int
    second: int
    share: float
    cells: TableCell
    load: float
    slips: np.ndarray
    mu_x: np.ndarray


class WheelStepInput(NamedTuple):
    """Input of a wheel over a step (s): speed of its centre along it (m/s) and torque of its brake (N m, not negative),
    both at the step's two ends and linear in time between.
    """

    speed0: float
    speed1: float
    torque0: float
    torque1: float
    step: float


class WheelStepResult(NamedTuple):
    """A wheel after a step: rotational speed at the end (rad/s), mean force (N, positive if it brakes the vehicle),
    mean slip, for which slips below -1 count as -1, and the time (s) for which the wheel was locked.
    """

    turning: float
    force: float
    slip: float
    locked: float


@lean
def phi_1(z):
    """The quotient (exp(z) - 1) / z, also for z near 0."""
    return math.expm1(z) / z if abs(z) > 1e-5 else 1.0 + z / 2.0 + z * z / 6.0


@lean
def distance_integral(end_distance, rate, decay_rate, duration):
    """Integral over a time (s) of the distance covered at a rate that decays as exp(-decay t), ``end_distance`` being
    its end value.

    With z = decay t it is t distance (1 / (1 - exp(-z)) - 1 / z). The series 1/2 + z/12 - z^3/720 for small z has an
    error of z^5/30240. Each branch loses at most 1e-13 of the value: the other one by cancellation.
    """
    z = decay_rate * duration
    return (
        duration * end_distance * (0.5 + z / 12.0 - z**3 / 720.0)
        if abs(z) < 0.01
        else (rate * duration - end_distance) / decay_rate
    )


@lean
def slip_at_table_node(node_index, table_slips):
    """Slip at node k of a tyre table; for a negative k, minus the slip at node -k."""
    return table_slips[node_index] if node_index >= 0 else -table_slips[-node_index]


@lean
def node_force(node_index, tyre_grip):
    """Force (N) of a ``TyreGrip`` at slip node k; for a negative k, minus the force at node -k."""
    mu = longitudinal_adhesion(tyre_grip.first, tyre_grip.cells, abs(node_index), tyre_grip.mu_x)
    if tyre_grip.share > 0.0:
        mu += tyre_grip.share * (
            longitudinal_adhesion(tyre_grip.second, tyre_grip.cells, abs(node_index), tyre_grip.mu_x) - mu
        )
    return tyre_grip.load * mu if node_index >= 0 else -tyre_grip.load * mu


@lean
def advance_at_rolling_slip(slip, time_limit, slip_sensitivity, relative_speed_rate, brake_force, tyre_grip):
    """Advance a wheel with a slip from -1 to 1 for at most ``time_limit`` seconds, or until the slip leaves this range.

    slip_sensitivity : r^2 / (J u) in 1/(N s); relative_speed_rate : u' / u in 1/s; brake_force : T / r in N. Returns
    the time used, slip then and integral of the slip (s).
    """
    slips = tyre_grip.slips
    last_cell, used, area, last_turn = slips.size - 1, 0.0, 0.0, 0
    cell = cell_and_share(slips, abs(slip))[0]
    if slip < 0.0:
        cell = -cell - 1
    low, high = node_force(cell, tyre_grip), node_force(cell + 1, tyre_grip)
    for _ in range(PIECE_LIMIT):
        bottom, top = slip_at_table_node(cell, slips), slip_at_table_node(cell + 1, slips)
        slope = (high - low) / (top - bottom)
        rate = slip_sensitivity * (brake_force - high - slope * (slip - top)) + (1.0 - slip) * relative_speed_rate
        target, turn = (top, 1) if rate > 0.0 else (bottom, -1)
        if rate != 0.0 and target == slip:
            if last_turn == -turn:  # either cell sends it into the other one: by rounding, it rests on their node
                return time_limit, slip, area + slip * (time_limit - used)
            cell, last_turn = cell + turn, turn
            if cell == last_cell or cell < -last_cell:
                return used, slip, area
            if turn > 0:
                low, high = high, node_force(cell + 1, tyre_grip)
            else:
                low, high = node_force(cell, tyre_grip), low
            continue
        decay = slip_sensitivity * slope + relative_speed_rate
        time = _time_of_distance(decay, rate, target - slip)
        if used + time >= time_limit:
            time_left = time_limit - used
            slip_change = rate * time_left * phi_1(-decay * time_left)
            end = (
                min(slip + slip_change, target) if turn > 0 else max(slip + slip_change, target)
            )  # not beyond it by rounding
            return time_limit, end, area + time_left * slip + distance_integral(slip_change, rate, decay, time_left)
        area += time * slip + distance_integral(target - slip, rate, decay, time)
        used, slip, last_turn = used + time, target, 0
    return used, math.nan, area


@lean
def _time_of_distance(decay_rate, rate, distance):
    """Time in which ``distance`` is covered at a rate that decays as exp(-decay t); infinite if it is never reached."""
    if rate == 0.0:
        return math.inf
    share = decay_rate * distance / rate
    if share >= 1.0:
        return math.inf
    if abs(share) < 1e-9:
        return distance / rate * (1.0 + 0.5 * share)
    return -math.log1p(-share) / decay_rate


@lean
def wheel_step(step_input, rotating_wheel, tyre_grip):
    """Advance a ``BrakedWheel`` over a ``WheelStepInput``, whose speeds are 0 or more, on a ``TyreGrip``; returns a
    ``WheelStepResult``.
    """
    torque0, torque1, step = step_input.torque0, step_input.torque1, step_input.step
    radius, inertia, w0 = rotating_wheel.radius, rotating_wheel.inertia, rotating_wheel.turning
    u0, u1 = max(step_input.speed0, SLOWEST_SPEED), max(step_input.speed1, 0.0)
    mean = max(0.5 * (u0 + u1), SLOWEST_SPEED)
    kappa, fade, last_node = radius * radius / (inertia * mean), (u1 - u0) / (step * mean), tyre_grip.slips.size - 1
    sliding = node_force(last_node, tyre_grip)
    gain, rest_time, impulse, area, locked = (torque1 - torque0) / step, 0.0, 0.0, 0.0, 0.0
    slip = 1.0 - radius * w0 / u0
    if slip > 1.0:  # it turns backwards: road and brake both stop that
        stops = sliding * radius + 0.5 * (torque0 + torque1)
        if stops * step <= -inertia * w0:
            return WheelStepResult(w0 + stops * step / inertia, sliding, slip, 0.0)
        rest_time = -inertia * w0 / stops
        impulse, area, slip = sliding * rest_time, rest_time, 1.0
    freed = False
    while rest_time < step:
        left, torque = step - rest_time, torque0 + gain * rest_time
        end_force = 0.5 * (torque + torque1) / radius
        if slip >= 1.0 and not freed and max(torque / radius, end_force) >= sliding:
            free = rest_time + (radius * sliding - torque) / gain if torque1 < radius * sliding else step
            impulse += sliding * (free - rest_time)
            area += free - rest_time
            locked += free - rest_time
            rest_time, slip, freed = free, 1.0, True
            continue
        u = u0 + (u1 - u0) * rest_time / step
        start = u * (1.0 - slip) / radius
        overspeed, gain_on = radius * start - 2.0 * u, -radius * (radius * sliding + end_force * radius) / inertia
        gain_on -= 2.0 * (u1 - u0) / step
        if slip < -1.0 or (slip == -1.0 and gain_on > 0.0):  # it turns twice as fast as it rolls: friction is steady
            used = min(left, -overspeed / gain_on) if gain_on < 0.0 else left
            rest_time += used
            impulse -= sliding * used
            area -= used
            if rest_time >= step:
                turning_end = start - radius * (sliding + end_force) * used / inertia
                return WheelStepResult(turning_end, impulse / step, area / step, locked)
            slip, freed = -1.0, False
            continue
        used, slip, slip_integral = advance_at_rolling_slip(min(slip, 1.0), left, kappa, fade, end_force, tyre_grip)
        if used == 0.0:  # by rounding alone: neither what lies beyond nor this takes it
            used = left
        rest_time += used
        end = (u0 + (u1 - u0) * rest_time / step) * (1.0 - slip) / radius
        impulse += inertia * (end - start) / radius + end_force * used
        area += slip_integral
        freed = False
        if not slip <= 1.0:
            return WheelStepResult(math.nan, math.nan, math.nan, math.nan)
    return WheelStepResult(u1 * (1.0 - slip) / radius, impulse / step, area / step, locked)
