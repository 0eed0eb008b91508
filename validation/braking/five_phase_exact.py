"""The five-phase limit cycle in closed form from node to node of the tyre table: no step, and none of its code.

In a cell of the table the force is F0 + c s, torque is T + m t, and J v s' = r (T + m t) - r^2 (F0 + c s) is solved by
s = a + b t + (s0 - a) exp(-k t), k = r^2 c / (J v). Its rate is monotone, so that r w' = -v s' meets a threshold at a
logarithm, s turns back at most once, and a node is met at a root between two times that enclose it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from models.brake.controllers.five_phase import FivePhase, end_of_phase, rate_of_phase
from models.brake.controllers.five_phase_cycle import WheelAtSpeed


@dataclass(frozen=True)
class ExactWheel:
    """speed (m/s), radius (m), inertia (kg m^2); slips and forces (N) at the nodes of the table."""

    speed: float
    radius: float
    inertia: float
    slips: np.ndarray
    forces: np.ndarray


class Piece:
    """Exact slip over time within cell i of the friction table. It starts at slip s0 with a torque (N m) that changes
    at a constant rate (N m/s)."""

    def __init__(self, wheel: ExactWheel, i: int, s0: float, torque: float, rate: float) -> None:
        cell_width = wheel.slips[i + 1] - wheel.slips[i]
        c = (wheel.forces[i + 1] - wheel.forces[i]) / cell_width
        f0 = wheel.forces[i] - c * wheel.slips[i]
        per = wheel.radius / (wheel.inertia * wheel.speed)
        self.s0, self.v, self.k = s0, wheel.speed, per * wheel.radius * c
        self.alpha, self.beta = per * (torque - wheel.radius * f0), per * rate
        self.flat = abs(self.k) < 1e-9
        self.b = 0.0 if self.flat else self.beta / self.k
        self.a = 0.0 if self.flat else (self.alpha - self.b) / self.k
        self.force = (f0, c)

    def slip(self, t: float) -> float:
        """Slip at a time t (s)."""
        if self.flat:
            return self.s0 + self.alpha * t + 0.5 * self.beta * t * t
        return self.a + self.b * t + (self.s0 - self.a) * math.exp(-self.k * t)

    def rim(self, t: float) -> float:
        """Circumferential acceleration of the rim, r w' (m/s^2), at a time t (s)."""
        if self.flat:
            return -self.v * (self.alpha + self.beta * t)
        return -self.v * (self.b - self.k * (self.s0 - self.a) * math.exp(-self.k * t))

    def impulse(self, t: float) -> float:
        """Time integral (N s) of the tyre's force up to a time t (s)."""
        if self.flat:
            area = self.s0 * t + self.alpha * t * t / 2.0 + self.beta * t**3 / 6.0
        else:
            area = self.a * t + self.b * t * t / 2.0 - (self.s0 - self.a) * math.expm1(-self.k * t) / self.k
        return self.force[0] * t + self.force[1] * area

    def meets(self, acceleration_level: float) -> float:
        """Time (s) at which the rim's acceleration r w' (m/s^2) reaches a level; infinite if it never does."""
        if self.flat:
            time = (-acceleration_level / self.v - self.alpha) / self.beta if self.beta else math.inf
        else:
            share = (
                (self.b + acceleration_level / self.v) / (self.k * (self.s0 - self.a)) if self.s0 != self.a else -1.0
            )
            time = -math.log(share) / self.k if share > 0.0 else math.inf
        return time if time > 0.0 else math.inf

    def leaves(self, low: float, high: float, end_time: float) -> tuple[float, int]:
        """First time before ``end_time`` at which the slip leaves its cell, and through which node: -1 lower, 1 upper.
        Returns ``end_time`` and 0 if it stays."""
        turn = min(self.meets(0.0), end_time)
        for start, end in ((0.0, turn), (turn, end_time)):
            for node, side in ((low, -1), (high, 1)):
                if end > start and side * (self.slip(end) - node) > 0.0:
                    if side * (self.slip(start) - node) >= 0.0:
                        return start, side
                    return _root_in_piece(lambda t, node=node: self.slip(t) - node, start, end), side  # type: ignore[misc]
        return end_time, 0


def _root_in_piece(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-16, rtol=1e-14))


def advance_phase(wheel: ExactWheel, state: list[float], rate: float, sign: float, acceleration_level: float) -> None:
    """Advance ``state`` (slip, torque, time, impulse) to the end of a phase in which the torque changes at a constant
    rate (N m/s). The phase ends when the rim's acceleration reaches ``acceleration_level``."""
    i = min(int(np.searchsorted(wheel.slips, state[0], side="right")) - 1, wheel.slips.size - 2)
    for _ in range(100_000):
        piece = Piece(wheel, i, state[0], state[1], rate)
        if sign * (piece.rim(0.0) - acceleration_level) >= 0.0:
            return
        met = min(piece.meets(acceleration_level), 0.1)
        time, side = piece.leaves(wheel.slips[i], wheel.slips[i + 1], met)
        ended = side == 0 and met < 0.1
        state[:] = [piece.slip(time), state[1] + rate * time, state[2] + time, state[3] + piece.impulse(time)]
        if ended:
            return
        if side != 0:
            state[0], i = float(wheel.slips[i + (side > 0)]), i + side
    raise ArithmeticError("a phase that does not end")


def exact_cycle(wheel_at_speed: WheelAtSpeed, controller: FivePhase, begun: float | None = None) -> tuple[float, float]:
    """Period and mean force, as ``last_cycle`` gives them, of a wheel at constant vehicle speed whose brake torque is
    linear in the pressure. begun: rate of pressure (bar/s) in the first application."""
    rates = [rate_of_phase(k, controller) for k in range(6)]
    rates[0] = rates[0] if begun is None else begun
    phases = [(wheel_at_speed.brake.rising * speed, *end_of_phase(k, controller)) for k, speed in enumerate(rates)]
    forces = wheel_at_speed.load * wheel_at_speed.tyre.mu_x[0, 0]
    return last_cycle(
        ExactWheel(
            wheel_at_speed.speed, wheel_at_speed.radius, wheel_at_speed.inertia, wheel_at_speed.tyre.slips, forces
        ),
        phases,
        12,
    )


def last_cycle(wheel: ExactWheel, phases: list[tuple[float, float, float]], cycles: int = 40) -> tuple[float, float]:
    """Period (s) of the last of several control cycles, and ratio of its mean force to the largest tyre force.

    phases : rate of torque (N m/s), sign and level of the end, of the beginning and of phases 1 to 5.
    """
    wheel_state = [0.0, 0.0, 0.0, 0.0]
    advance_phase(wheel, wheel_state, *phases[0])
    for _ in range(cycles):
        wheel_state[2:] = [0.0, 0.0]
        for later in phases[1:]:
            advance_phase(wheel, wheel_state, *later)
    return wheel_state[2], wheel_state[3] / wheel_state[2] / float(wheel.forces.max())
