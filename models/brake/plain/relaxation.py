"""Lagging slip angles of tyres with a relaxation length, in plain code: the reference of ``models.brake.relaxation``.

The lag solves a linear equation of constant coefficients, whose solution is an exponential of a matrix.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

GRAVITY = 9.81
FADING_SPEED, DAMPING, SLOWEST_SPEED = 1.0, 0.7, 1e-9
"""Speed (m/s) below which the damper fades in, its damping ratio at rest, and speed (m/s) that counts as rest."""


def advance_slip_tangents(
    slip_tangents: np.ndarray,
    wheel_speeds: np.ndarray,
    duration: float,
    relaxation_length: np.ndarray,
    cornering_coefficient: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of the lagging slip angles (W,) after a time (s), without and with the damper's part.

    slip_tangents (W,) : before, NaN where it is to begin as in steady motion; wheel_speeds (2, W) : along and across
    (m/s); relaxation_length
    (W,) : m; cornering_coefficient : largest cornering coefficient (1/rad).
    """
    (u, v), stiffness = wheel_speeds, np.sqrt(max(cornering_coefficient, SLOWEST_SPEED) * GRAVITY * relaxation_length)
    slips_before = np.where(np.isnan(slip_tangents), v / np.maximum(np.abs(u), SLOWEST_SPEED), slip_tangents)
    lagging_slips = np.array(
        [_lagging_slip(*wheel, duration) for wheel in zip(slips_before, np.abs(u), v, relaxation_length, strict=True)]
    )
    fade = np.clip(1.0 - np.abs(u) / FADING_SPEED, 0.0, 1.0)
    return lagging_slips, lagging_slips + fade**2 * v * 2.0 * DAMPING / stiffness


def _lagging_slip(
    lagging_slip: float, speed_along: float, speed_across: float, relaxation_length: float, duration: float
) -> float:
    """Solution of sigma a' = v - |u| a after a time (s), for the lagging slip a and the relaxation length sigma (m)."""
    rates = np.array([[-speed_along, speed_across], [0.0, 0.0]]) * (duration / relaxation_length)
    return float((expm(rates) @ (lagging_slip, 1.0))[0])


@dataclass(eq=False)
class LaggingTyres:
    """Tyres with relaxation: lengths (W,) in m, slope (1/rad), tangents of the lagging slip angles (W,), and the time
    (s) by which these lie behind the motion. ``slips_for_forces`` holds the tangents of the slip angles that forces
    use, with the damper's part.
    """

    length: np.ndarray
    slope: float
    angle: np.ndarray
    time_behind: float = 0.0
    slips_for_forces: np.ndarray | None = None

    def reach(self, wheel_speeds: np.ndarray, half_step: float) -> None:
        """Advance the lagging slip angles to half a step (s) after the motion with speeds (2, W) along and across the
        wheels (m/s).
        """
        self.angle, self.slips_for_forces = advance_slip_tangents(
            self.angle, wheel_speeds, self.time_behind + half_step, self.length, self.slope
        )
        self.time_behind = half_step

    def across(self, wheel_index: int, speed_along: float) -> float:
        """Speed (m/s) across wheel i that corresponds to its lagging slip angle at the speed ``speed_along`` (m/s)
        along it.
        """
        assert self.slips_for_forces is not None
        return float(self.slips_for_forces[wheel_index]) * speed_along
