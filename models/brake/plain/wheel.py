"""Rotation of one braked wheel over one step, in plain code: the reference of ``models.brake.wheel_step``.

The slip s obeys s' = g(s) = kappa (T / r - F(s)) + (1 - s) u' / u with kappa = r^2 / (J u), u at its mean. F is linear
between nodes, and so is g: it never changes its sign on the way, a way from s0 to s1 takes (s1 - s0) over the
logarithmic mean of g(s0) and g(s1), and the slip moves by t g(s0) phi_1(g' t), phi_1(z) = (exp(z) - 1) / z.
"""

import math
from dataclasses import dataclass

import numpy as np

SLOWEST_SPEED = 1e-9
"""Speed (m/s) that replaces lower speeds of a wheel's centre."""
SERIES_LIMIT = 1e-3
"""Argument below which a difference quotient is summed as a series, exact to rounding."""
LOCKED_SLIP = 1.0
"""Slip of a locked wheel."""


@dataclass(frozen=True, eq=False)
class TyreForceCurve:
    """Tyre force as a function of slip: slips (s,) from 0 to 1, and the forces (s,) in N at these; the force is odd in
    the slip.
    """

    slips: np.ndarray
    forces: np.ndarray

    @property
    def locked_force(self) -> float:
        """Force (N) of the tyre at slip 1."""
        return float(self.forces[-1])

    def both_ways(self) -> tuple[np.ndarray, np.ndarray]:
        """Slips from -1 to 1 and the tyre forces (N) at these."""
        return np.concatenate((-self.slips[:0:-1], self.slips)), np.concatenate((-self.forces[:0:-1], self.forces))


@dataclass(frozen=True)
class WheelStepData:
    """Data of a wheel over a step: at both ends, speeds of its centre (m/s) and torques of its brake (N m), both linear
    in time and not negative; step (s), radius (m), inertia (kg m^2).
    """

    speeds: tuple[float, float]
    torques: tuple[float, float]
    step: float
    radius: float
    inertia: float

    def speed(self, time_in_step: float) -> float:
        """Speed (m/s) of the wheel's centre at a time (s) within the step."""
        u0, u1 = max(self.speeds[0], SLOWEST_SPEED), max(self.speeds[1], 0.0)
        return u0 + (u1 - u0) * time_in_step / self.step

    def torque(self, time_in_step: float) -> float:
        """Brake torque (N m) at a time (s) within the step."""
        return self.torques[0] + (self.torques[1] - self.torques[0]) * time_in_step / self.step

    def mean_torque(self, time_in_step: float) -> float:
        """Mean brake torque (N m) from a time (s) to the end of the step."""
        return 0.5 * (self.torque(time_in_step) + self.torques[1])

    @property
    def mean_speed(self) -> float:
        """Mean speed (m/s) of the wheel's centre over the step, above 0."""
        return max(0.5 * (self.speed(0.0) + self.speed(self.step)), SLOWEST_SPEED)

    @property
    def gain(self) -> float:
        """Acceleration of the wheel's centre (m/s^2), constant over the step."""
        return (self.speed(self.step) - self.speed(0.0)) / self.step


@dataclass
class WheelProgress:
    """Progress of a wheel within a time step: time (s), slip, impulse of the road on the vehicle (N s), integral of the
    slip (s), time locked (s), and whether it has just been freed.
    """

    time: float
    slip: float
    impulse: float = 0.0
    slip_integral: float = 0.0
    locked: float = 0.0
    has_been_freed: bool = False


def wheel_step(
    wheel_step_data: WheelStepData, rim_turning: float, tyre_force: TyreForceCurve
) -> tuple[float, float, float, float]:
    """Rotational speed (rad/s) at the end of a step, mean force (N), mean slip and time locked (s) of a braked wheel.

    rim_turning : at the start (rad/s), below 0 where it is against the direction of the speeds.
    """
    slip = 1.0 - wheel_step_data.radius * rim_turning / wheel_step_data.speed(0.0)
    progress = WheelProgress(0.0, slip)
    if slip > LOCKED_SLIP:
        stopping = tyre_force.locked_force * wheel_step_data.radius + wheel_step_data.mean_torque(0.0)
        if stopping * wheel_step_data.step <= -wheel_step_data.inertia * rim_turning:
            return (
                rim_turning + stopping * wheel_step_data.step / wheel_step_data.inertia,
                tyre_force.locked_force,
                slip,
                0.0,
            )
        _advance_at_slip(
            progress, -wheel_step_data.inertia * rim_turning / stopping, tyre_force.locked_force, LOCKED_SLIP
        )
    while progress.time < wheel_step_data.step:
        if _stays_locked(wheel_step_data, progress, tyre_force):
            _advance_locked(wheel_step_data, progress, tyre_force)
        elif _is_spinning(wheel_step_data, progress, tyre_force):
            turning_speed = _advance_spinning(wheel_step_data, progress, tyre_force)
            if progress.time >= wheel_step_data.step:
                return (
                    turning_speed,
                    progress.impulse / wheel_step_data.step,
                    progress.slip_integral / wheel_step_data.step,
                    progress.locked,
                )
        else:
            _roll(wheel_step_data, progress, tyre_force)
    return (
        wheel_step_data.speed(wheel_step_data.step) * (1.0 - progress.slip) / wheel_step_data.radius,
        progress.impulse / wheel_step_data.step,
        progress.slip_integral / wheel_step_data.step,
        progress.locked,
    )


def _advance_at_slip(wheel_progress: WheelProgress, duration: float, tyre_force: float, slip: float) -> None:
    """Advance the wheel's progress by a time (s) at a constant force (N) and slip."""
    wheel_progress.time, wheel_progress.slip = wheel_progress.time + duration, slip
    wheel_progress.impulse, wheel_progress.slip_integral = (
        wheel_progress.impulse + tyre_force * duration,
        wheel_progress.slip_integral + slip * duration,
    )


def _stays_locked(wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve) -> bool:
    """Whether the brake holds a locked wheel, by its torque now or by its mean torque over the remaining step."""
    holds = (
        max(wheel_step_data.torque(wheel_progress.time), wheel_step_data.mean_torque(wheel_progress.time))
        / wheel_step_data.radius
        >= tyre_force.locked_force
    )
    return wheel_progress.slip >= LOCKED_SLIP and not wheel_progress.has_been_freed and holds


def _advance_locked(wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve) -> None:
    """Advance a locked wheel until the brake torque falls below the torque of the sliding force, or the step ends."""
    needed, time = tyre_force.locked_force * wheel_step_data.radius, wheel_step_data.step - wheel_progress.time
    if wheel_step_data.torques[1] < needed:
        time = (
            (needed - wheel_step_data.torque(wheel_progress.time))
            * wheel_step_data.step
            / (wheel_step_data.torques[1] - wheel_step_data.torques[0])
        )
    _advance_at_slip(wheel_progress, time, tyre_force.locked_force, LOCKED_SLIP)
    wheel_progress.locked, wheel_progress.has_been_freed = wheel_progress.locked + time, True


def _excess_rate(wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve) -> float:
    """Rate (m/s^2) of the rim speed less twice the centre's speed, while the wheel slides at slip -1."""
    return (
        -wheel_step_data.radius
        * (wheel_step_data.radius * tyre_force.locked_force + wheel_step_data.mean_torque(wheel_progress.time))
        / wheel_step_data.inertia
        - 2.0 * wheel_step_data.gain
    )


def _is_spinning(wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve) -> bool:
    """Whether the rim's speed is above twice the centre's speed and stays there."""
    return wheel_progress.slip < -1.0 or (
        wheel_progress.slip == -1.0 and _excess_rate(wheel_step_data, wheel_progress, tyre_force) > 0.0
    )


def _advance_spinning(
    wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve
) -> float:
    """Advance a wheel that spins at a slip counted as -1, until the step ends or that slip is reached; returns its
    rotation (rad/s)."""
    turning, excess = (
        wheel_step_data.speed(wheel_progress.time) * (1.0 - wheel_progress.slip) / wheel_step_data.radius,
        _excess_rate(wheel_step_data, wheel_progress, tyre_force),
    )
    overspeed, time = (
        wheel_step_data.radius * turning - 2.0 * wheel_step_data.speed(wheel_progress.time),
        wheel_step_data.step - wheel_progress.time,
    )
    slowing = (
        wheel_step_data.radius * tyre_force.locked_force + wheel_step_data.mean_torque(wheel_progress.time)
    ) / wheel_step_data.inertia
    if excess < 0.0:
        time = min(time, -overspeed / excess)
    _advance_at_slip(wheel_progress, time, -tyre_force.locked_force, -1.0)
    wheel_progress.has_been_freed = False
    return turning - slowing * time


def _roll(wheel_step_data: WheelStepData, wheel_progress: WheelProgress, tyre_force: TyreForceCurve) -> None:
    """Advance a wheel with a slip between -1 and 1 until the step ends or the slip reaches one of them. The mean force
    follows from the wheel's momentum.
    """
    start_time, mean, slip = (
        wheel_progress.time,
        wheel_step_data.mean_torque(wheel_progress.time),
        min(wheel_progress.slip, LOCKED_SLIP),
    )
    nodes, forces = tyre_force.both_ways()
    kappa = wheel_step_data.radius**2 / (wheel_step_data.inertia * wheel_step_data.mean_speed)
    rates = (
        kappa * (mean / wheel_step_data.radius - forces)
        + (1.0 - nodes) * wheel_step_data.gain / wheel_step_data.mean_speed
    )
    time, wheel_progress.slip, area = advance_slip_along_nodes(slip, nodes, rates, wheel_step_data.step - start_time)
    if time == 0.0:  # by rounding it stands on the edge, where neither state takes it
        time = wheel_step_data.step - start_time
    wheel_progress.time, wheel_progress.has_been_freed = start_time + time, False
    if math.isclose(wheel_progress.time, wheel_step_data.step, rel_tol=1e-15):
        wheel_progress.time = wheel_step_data.step
    turning = [
        wheel_step_data.speed(t) * (1.0 - s) / wheel_step_data.radius
        for t, s in ((start_time, slip), (wheel_progress.time, wheel_progress.slip))
    ]
    wheel_progress.impulse += (
        wheel_step_data.inertia * (turning[1] - turning[0]) / wheel_step_data.radius
        + mean / wheel_step_data.radius * time
    )
    wheel_progress.slip_integral += area


def advance_slip_along_nodes(
    start_slip: float, slip_nodes: np.ndarray, slip_rates: np.ndarray, time_limit: float
) -> tuple[float, float, float]:
    """Time (s) that passes, slip at its end and integral of slip (s), over ``time_limit`` seconds or until the last
    node is reached.

    slip_nodes, slip_rates (k,) : the rate (1/s) of the slip is linear between the nodes.
    """
    rate, time, area = float(np.interp(start_slip, slip_nodes, slip_rates)), 0.0, 0.0
    if rate == 0.0:
        return time_limit, start_slip, start_slip * time_limit
    nodes_passed = (
        np.flatnonzero(slip_nodes > start_slip) if rate > 0.0 else np.flatnonzero(slip_nodes < start_slip)[::-1]
    )
    for k in nodes_passed:
        slip_to_node, ratio = float(slip_nodes[k]) - start_slip, float(slip_rates[k]) / rate
        grows = (ratio - 1.0) * rate / slip_to_node
        needed = slip_to_node / rate * _log_quotient(ratio - 1.0) if ratio > 0.0 else math.inf
        if time + needed >= time_limit:
            remaining_time = time_limit - time
            z = grows * remaining_time
            end_slip = start_slip + remaining_time * rate * _phi_function(1, z)
            return (
                time_limit,
                end_slip,
                area + start_slip * remaining_time + rate * remaining_time**2 * _phi_function(2, z),
            )
        area += start_slip * needed + rate * needed**2 * _phi_function(2, grows * needed)
        time, start_slip, rate = time + needed, float(slip_nodes[k]), float(slip_rates[k])
    return time, start_slip, area


def _log_quotient(x: float) -> float:
    """The quotient log(1 + x) / x, also for x near 0."""
    return math.log1p(x) / x if abs(x) > SERIES_LIMIT else math.fsum((-x) ** k / (k + 1) for k in range(6))


def _phi_function(order: int, z: float) -> float:
    """phi_1(z) = (exp(z) - 1) / z or phi_2(z) = (exp(z) - 1 - z) / z^2, also for z near 0."""
    if abs(z) <= SERIES_LIMIT:
        return math.fsum(z**k / math.factorial(k + order) for k in range(6))
    return math.expm1(z) / z if order == 1 else (math.expm1(z) - z) / z**2
