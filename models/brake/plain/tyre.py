"""Friction of a tyre from its tables, and the forces on one wheel over a step, in plain code.

Each table is linear in every variable between its nodes and constant beyond: a sum over the nodes, each with a weight
that is 1 there and 0 at the next. See ``models.tyre.tyre_table`` and ``models.brake.plane_step`` for the laws.
"""

import math
from dataclasses import dataclass

import numpy as np

from models.brake.plain.wheel import TyreForceCurve, WheelStepData, wheel_step
from models.tyre.tyre_table import StackedTyreTables

LOCKING_SLIP = 0.98
"""Slip above which the force turns to that of a locked tyre, against the direction of sliding."""


def interpolation_weights(nodes: np.ndarray, position: float) -> np.ndarray:
    """Interpolation weight (n,) of each node at a value; beyond the nodes, the end node alone counts."""
    clipped = float(np.clip(position, nodes[0], nodes[-1]))
    high = min(max(int(np.searchsorted(nodes, clipped)), 1), nodes.size - 1)
    weights_at = np.zeros(nodes.size)
    if nodes.size == 1:
        weights_at[0] = 1.0
        return weights_at
    weights_at[high] = (clipped - nodes[high - 1]) / (nodes[high] - nodes[high - 1])
    weights_at[high - 1] = 1.0 - weights_at[high]
    return weights_at


@dataclass(frozen=True)
class WheelSurface:
    """Surface under a wheel: indices of two friction tables, and the share of the second one in the mixture."""

    first: int
    second: int
    share: float


@dataclass(frozen=True, eq=False)
class TyreFriction:
    """Friction of a tyre at one slip angle (rad, from 0) and load (N) on a surface."""

    tables: StackedTyreTables
    surface: WheelSurface
    angle: float
    load: float

    def mixed_values(self, table_values: np.ndarray) -> np.ndarray:
        """Values on the wheel's surface, a mixture of two tables' values out of ``table_values`` (t, ...) of all
        tables.
        """
        share = self.surface.share
        mixed: np.ndarray = (1.0 - share) * table_values[self.surface.first] + share * table_values[self.surface.second]
        return mixed

    def force_along(self) -> TyreForceCurve:
        """Force (N) along the wheel as a function of slip."""
        t = self.tables
        mu = np.einsum(
            "a,f,tafs->ts",
            interpolation_weights(t.angles, self.angle),
            interpolation_weights(t.loads, self.load),
            t.mu_x,
        )
        return TyreForceCurve(t.slips, self.load * self.mixed_values(mu))

    def side_force(self, slip: float) -> float:
        """Magnitude (N) of the force across the wheel at a slip."""
        t, by_angle = self.tables, interpolation_weights(self.tables.angles, self.angle)
        g = np.einsum("a,s,tas->t", by_angle, interpolation_weights(t.slips, abs(slip)), t.g)
        h = np.einsum("a,f,taf->t", by_angle, interpolation_weights(t.loads, self.load), t.h)
        return self.load * float(self.mixed_values(g * h))


@dataclass(frozen=True)
class WheelMotion:
    """Motion of a wheel's centre: speed along the wheel at the start of a step and its mean rate of change (m/s,
    m/s^2), speeds along and across from which the slip angle is computed (m/s), and the speed ``least_speed`` (m/s)
    that replaces lower ones.
    """

    start: float
    rate: float
    along: float
    across: float
    least_speed: float

    @property
    def direction(self) -> float:
        """Direction of the wheel's motion at the step's start: 1 forwards, -1 backwards."""
        return 1.0 if self.start >= 0.0 else -1.0

    @property
    def forward_speed(self) -> float:
        """Speed (m/s) in the direction in which the wheel started, at least 0."""
        return max(self.direction * self.along, 0.0)

    @property
    def angle(self) -> float:
        """Magnitude (rad) of the wheel's slip angle."""
        return math.atan2(abs(self.across), max(self.forward_speed, self.least_speed))


@dataclass(frozen=True)
class BrakedStep:
    """Braking of a wheel over a step: torques of its brake (N m) at both ends, the step (s), radius (m), inertia (kg
    m^2), and the rotational speed at the start (rad/s).
    """

    torques: tuple[float, float]
    step: float
    radius: float
    inertia: float
    turning: float


def tyre_report(
    tyre_tables: StackedTyreTables,
    surface: WheelSurface,
    wheel_motion: WheelMotion,
    load: float,
    braked_step: BrakedStep,
) -> np.ndarray:
    """Report of a tyre over a step (7,), in the columns of ``plane_step``: mean forces along and across (N), load (N),
    mean slip, slip angle (rad), time locked (s), rotational speed (rad/s) at the end.
    """
    friction, sense = TyreFriction(tyre_tables, surface, wheel_motion.angle, load), wheel_motion.direction
    speeds = sense * wheel_motion.start, sense * (wheel_motion.start + braked_step.step * wheel_motion.rate)
    wheel = WheelStepData(speeds, braked_step.torques, braked_step.step, braked_step.radius, braked_step.inertia)
    turning, force_along, slip, locked = wheel_step(wheel, sense * braked_step.turning, friction.force_along())
    forces = _turned_to_sliding(np.array([force_along, friction.side_force(slip)]), slip, wheel_motion)
    side = -math.copysign(forces[1], wheel_motion.across) if wheel_motion.across else 0.0
    angle = math.copysign(wheel_motion.angle, wheel_motion.across)
    return np.array([-sense * forces[0], side, load, slip, angle, locked, sense * turning])


def _turned_to_sliding(force_magnitudes: np.ndarray, slip: float, wheel_motion: WheelMotion) -> np.ndarray:
    """Magnitudes (2,) of the forces along and across the wheel (N), turned towards its sliding direction as the wheel
    comes near to locking.
    """
    sliding = np.array([wheel_motion.forward_speed, abs(wheel_motion.across)])
    speed = float(np.hypot(*sliding))
    if slip <= LOCKING_SLIP or speed == 0.0:
        return force_magnitudes
    share = min((slip - LOCKING_SLIP) / (1.0 - LOCKING_SLIP), 1.0)
    turned_forces: np.ndarray = (1.0 - share) * force_magnitudes + share * float(
        np.hypot(*force_magnitudes)
    ) * sliding / speed
    return turned_forces
