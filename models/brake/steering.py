"""The driver's steering over time, and how fast the vehicle's yaw rate responds to it."""

from dataclasses import dataclass

import numpy as np

from models.brake.figures_of_merit import crossing_time

REACHED_SHARE, HALF_SHARE = 0.9, 0.5
"""Share of the steady yaw rate at which the response time ends, and share of the final steer angle at which it
begins.
"""
STEADY_YAW_RATE_RANGE = 0.05
"""Largest ratio of a yaw rate's range to its mean at which it counts as steady."""


@dataclass(frozen=True, eq=False)
class Steering:
    """Steer angles (n,) in rad of the wheels marked by ``steered`` (W,), at times (n,) in s: linear between the times,
    constant outside.
    """

    times: np.ndarray
    angles: np.ndarray
    steered: np.ndarray

    def __call__(self, time: float) -> np.ndarray:
        """Steer angles (W,) at a time (s)."""
        return self.steered * np.interp(time, self.times, self.angles)

    @property
    def half(self) -> float:
        """Time (s) at which the steer angle first reaches half of its final value."""
        goal, final_sign = HALF_SHARE * abs(self.angles[-1]), np.sign(self.angles[-1])
        reached = final_sign * self.angles >= goal
        i = int(np.argmax(reached))
        if i == 0:
            return float(self.times[0])
        return float(np.interp(goal, final_sign * self.angles[i - 1 : i + 1], self.times[i - 1 : i + 1]))


@dataclass(frozen=True)
class YawResponse:
    """Response of the yaw rate to a step of steering. time : s, from half of the final steer angle to 90 % of the
    steady yaw rate; overshoot : ratio of the peak above the steady yaw rate to the latter; steady_rate : yaw rate,
    rad/s.
    """

    time: float
    overshoot: float
    steady_rate: float


def yaw_response(times: np.ndarray, yaw_rates: np.ndarray, half_angle_time: float) -> YawResponse | None:
    """Response to a step of steering, from yaw rates (n,) in rad/s at times (n,) in s; None if the last second is not
    steady.

    half_angle_time : time (s) at which the steering reaches half of its last angle. Source: ISO 7401 (cars), ISO 14793
    (heavy vehicles); not checked against the text of the standard.
    """
    end = yaw_rates[times >= times[-1] - 1.0]
    steady = float(end.mean())
    if np.ptp(end) > STEADY_YAW_RATE_RANGE * abs(steady) or steady == 0.0:
        return None
    share = yaw_rates / steady
    return YawResponse(
        crossing_time(times, -share, -REACHED_SHARE) - half_angle_time, float(max(share.max() - 1.0, 0.0)), steady
    )
