"""Limit cycle of the five-phase brake controller in closed form from node to node of the tyre table, without time
steps.

In a cell of the table the force is F0 + c s, torque is T + m t, and J v s' = r (T + m t) - r^2 (F0 + c s) is solved by
s = a + b t + (s0 - a) exp(-k t), k = r^2 c / (J v). Its rate is monotone, so that r w' = -v s' meets a threshold at a
logarithm, s turns back at most once, and a node is met at a root between two times that enclose it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from models.brake.controllers.five_phase import FivePhase, phase_end_threshold, pressure_rate_of_phase
from models.brake.controllers.five_phase_cycle import WheelAtConstantSpeed


@dataclass(frozen=True)
class ExactWheel:
    """A braked wheel at constant vehicle speed (m/s): radius (m), inertia (kg m^2); slips and forces (N) at the nodes
    of its tyre table."""

    speed: float
    radius: float
    inertia: float
    slips: np.ndarray
    forces: np.ndarray


class CellSolution:
    """Exact slip over time within cell i of the tyre table. It starts at slip s0 with a brake torque (N m) that changes
    at a constant rate (N m/s)."""

    def __init__(
        self, wheel: ExactWheel, cell_index: int, initial_slip: float, initial_torque: float, torque_rate: float
    ) -> None:
        cell_width = wheel.slips[cell_index + 1] - wheel.slips[cell_index]
        c = (wheel.forces[cell_index + 1] - wheel.forces[cell_index]) / cell_width
        f0 = wheel.forces[cell_index] - c * wheel.slips[cell_index]
        per = wheel.radius / (wheel.inertia * wheel.speed)
        self.s0, self.v, self.k = initial_slip, wheel.speed, per * wheel.radius * c
        self.alpha, self.beta = per * (initial_torque - wheel.radius * f0), per * torque_rate
        self.is_flat = abs(self.k) < 1e-9
        self.b = 0.0 if self.is_flat else self.beta / self.k
        self.a = 0.0 if self.is_flat else (self.alpha - self.b) / self.k
        self.force = (f0, c)

    def slip(self, t: float) -> float:
        """Slip at a time t (s) after the start in this cell."""
        if self.is_flat:
            return self.s0 + self.alpha * t + 0.5 * self.beta * t * t
        return self.a + self.b * t + (self.s0 - self.a) * math.exp(-self.k * t)

    def rim_acceleration(self, t: float) -> float:
        """Circumferential acceleration of the wheel's rim, r w' (m/s^2), at a time t (s)."""
        if self.is_flat:
            return -self.v * (self.alpha + self.beta * t)
        return -self.v * (self.b - self.k * (self.s0 - self.a) * math.exp(-self.k * t))

    def impulse(self, t: float) -> float:
        """Time integral (N s) of the tyre's force up to a time t (s)."""
        if self.is_flat:
            area = self.s0 * t + self.alpha * t * t / 2.0 + self.beta * t**3 / 6.0
        else:
            area = self.a * t + self.b * t * t / 2.0 - (self.s0 - self.a) * math.expm1(-self.k * t) / self.k
        return self.force[0] * t + self.force[1] * area

    def time_at_acceleration(self, acceleration_level: float) -> float:
        """Time (s) at which the rim's acceleration r w' (m/s^2) reaches a level; infinite if it never does."""
        if self.is_flat:
            time = (-acceleration_level / self.v - self.alpha) / self.beta if self.beta else math.inf
        else:
            share = (
                (self.b + acceleration_level / self.v) / (self.k * (self.s0 - self.a)) if self.s0 != self.a else -1.0
            )
            time = -math.log(share) / self.k if share > 0.0 else math.inf
        return time if time > 0.0 else math.inf

    def leaving_time(self, lower_slip: float, upper_slip: float, end_time: float) -> tuple[float, int]:
        """First time (s) before ``end_time`` at which the slip leaves its cell, and through which node: -1 lower, 1
        upper. Returns ``end_time`` and 0 if the slip stays within the cell."""
        turn = min(self.time_at_acceleration(0.0), end_time)
        for start, end in ((0.0, turn), (turn, end_time)):
            for node, side in ((lower_slip, -1), (upper_slip, 1)):
                if end > start and side * (self.slip(end) - node) > 0.0:
                    if side * (self.slip(start) - node) >= 0.0:
                        return start, side
                    return _root_between(lambda t, node=node: self.slip(t) - node, start, end), side  # type: ignore[misc]
        return end_time, 0


def _root_between(function: Callable[[float], float], lower_bound: float, upper_bound: float) -> float:
    return float(brentq(function, lower_bound, upper_bound, xtol=1e-16, rtol=1e-14))


def advance_phase(
    wheel: ExactWheel, phase_state: list[float], torque_rate: float, crossing_sign: float, acceleration_level: float
) -> None:
    """Advance ``phase_state`` (slip, torque, time, impulse) to the end of a controller phase in which the brake torque
    changes at a constant rate (N m/s). It ends when the rim's acceleration (m/s^2) reaches ``acceleration_level``, from
    below with sign 1, from above with -1."""
    i = min(int(np.searchsorted(wheel.slips, phase_state[0], side="right")) - 1, wheel.slips.size - 2)
    for _ in range(100_000):
        piece = CellSolution(wheel, i, phase_state[0], phase_state[1], torque_rate)
        if crossing_sign * (piece.rim_acceleration(0.0) - acceleration_level) >= 0.0:
            return
        met = min(piece.time_at_acceleration(acceleration_level), 0.1)
        time, side = piece.leaving_time(wheel.slips[i], wheel.slips[i + 1], met)
        ended = side == 0 and met < 0.1
        phase_state[:] = [
            piece.slip(time),
            phase_state[1] + torque_rate * time,
            phase_state[2] + time,
            phase_state[3] + piece.impulse(time),
        ]
        if ended:
            return
        if side != 0:
            phase_state[0], i = float(wheel.slips[i + (side > 0)]), i + side
    raise ArithmeticError("a phase that does not end")


def exact_cycle(
    wheel_at_speed: WheelAtConstantSpeed, controller: FivePhase, initial_torque_rate: float | None = None
) -> tuple[float, float]:
    """Period (s) and mean force (divided by the largest tyre force) of the five-phase limit cycle of a wheel at
    constant vehicle speed. initial_torque_rate: rate of pressure (bar/s) in the first application."""
    rates = [pressure_rate_of_phase(k, controller) for k in range(6)]
    rates[0] = rates[0] if initial_torque_rate is None else initial_torque_rate
    phases = [
        (wheel_at_speed.brake.rising * speed, *phase_end_threshold(k, controller)) for k, speed in enumerate(rates)
    ]
    forces = wheel_at_speed.load * wheel_at_speed.tyre.mu_x[0, 0]
    return last_control_cycle(
        ExactWheel(
            wheel_at_speed.speed, wheel_at_speed.radius, wheel_at_speed.inertia, wheel_at_speed.tyre.slips, forces
        ),
        phases,
        12,
    )


def last_control_cycle(
    wheel: ExactWheel, controller_phases: list[tuple[float, float, float]], cycle_count: int = 40
) -> tuple[float, float]:
    """Period (s) of the last of several control cycles, and its mean force divided by the largest tyre force.

    controller_phases : rate of torque (N m/s), sign and acceleration level (m/s^2) at the end, for the first
    application and for phases 1 to 5.
    """
    wheel_state = [0.0, 0.0, 0.0, 0.0]
    advance_phase(wheel, wheel_state, *controller_phases[0])
    for _ in range(cycle_count):
        wheel_state[2:] = [0.0, 0.0]
        for later in controller_phases[1:]:
            advance_phase(wheel, wheel_state, *later)
    return wheel_state[2], wheel_state[3] / wheel_state[2] / float(wheel.forces.max())
