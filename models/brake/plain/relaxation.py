"""Lagging slip angles of tyres with a relaxation length, in plain code: the reference of ``models.brake.relaxation``.

The lag solves a linear equation of constant coefficients, whose solution is an exponential of a matrix.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

GRAVITY = 9.81
FADING_SPEED, DAMPING, SLOWEST_SPEED = 1.0, 0.7, 1e-9
"""Speed (m/s) below which the damper fades in, its damping ratio at rest, and speed (m/s) that counts as rest."""


def lag_on(
    angle: np.ndarray, speeds: np.ndarray, time: float, length: np.ndarray, slope: float
) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of the lagging slip angles (W,) after a time (s), without and with the damper's part.

    angle (W,) : before, NaN where it is to begin as in steady motion; speeds (2, W) : along and across (m/s); length
    (W,) : m; slope : largest cornering coefficient (1/rad).
    """
    (u, v), stiffness = speeds, np.sqrt(max(slope, SLOWEST_SPEED) * GRAVITY * length)
    slips_before = np.where(np.isnan(angle), v / np.maximum(np.abs(u), SLOWEST_SPEED), angle)
    lagging_slips = np.array(
        [_lagging_slip(*wheel, time) for wheel in zip(slips_before, np.abs(u), v, length, strict=True)]
    )
    fade = np.clip(1.0 - np.abs(u) / FADING_SPEED, 0.0, 1.0)
    return lagging_slips, lagging_slips + fade**2 * v * 2.0 * DAMPING / stiffness


def _lagging_slip(angle: float, speed: float, speed_across: float, length: float, time: float) -> float:
    """Solution of sigma a' = v - |u| a after a time (s), for the lagging slip a and the relaxation length sigma (m)."""
    rates = np.array([[-speed, speed_across], [0.0, 0.0]]) * (time / length)
    return float((expm(rates) @ (angle, 1.0))[0])


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

    def reach(self, speeds: np.ndarray, half: float) -> None:
        """Advance the lagging slip angles to half a step (s) after the motion with speeds (2, W) along and across the
        wheels (m/s).
        """
        self.angle, self.slips_for_forces = lag_on(self.angle, speeds, self.time_behind + half, self.length, self.slope)
        self.time_behind = half

    def across(self, i: int, forwards: float) -> float:
        """Speed (m/s) across wheel i that corresponds to its lagging slip angle at the speed ``forwards`` (m/s) along
        it.
        """
        assert self.slips_for_forces is not None
        return float(self.slips_for_forces[i]) * forwards
