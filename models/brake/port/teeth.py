"""Wheel speed counted from a toothed wheel with a timer: measurement of the period between tooth edges.

Between two samples a wheel's speed is taken to be linear in time, so that the instant of each tooth's edge is the root
of a quadratic. A timer of ticks tells that instant, rounded down. A sample's speed is the way of the edges that came
since the last one seen before it, over the time between these two edges; with no edge since then it stays, but is at
most one tooth over the time that has passed without. Way is that of ``teeth`` equal teeth, also if one is missing.
"""

import math
from collections.abc import Callable

import numpy as np
from pydantic import Field

from models.brake.controller import Sample
from models.core.strict import Strict, quantity

IsToothMissing = Callable[[int, int, float], bool]


class ToothedWheel(Strict):
    """A toothed wheel with its timer."""

    teeth: int = Field(default=100, ge=1, le=10000, description="of one turn")
    tick: float = quantity("s", "of the timer", default=1e-6)


class ToothCounter:
    """Speed signals from the teeth of W wheels, from sample 0 on. radius (W,): m; missing(wheel, tooth, time in s):
    whether a tooth is missing.
    """

    def __init__(
        self, toothed_wheel: ToothedWheel, wheel_radii: np.ndarray, is_tooth_missing: IsToothMissing | None = None
    ) -> None:
        self._teeth, self._missing = toothed_wheel, is_tooth_missing
        self._way = (2.0 * math.pi / toothed_wheel.teeth * wheel_radii).tolist()
        self._wheels: list[_ToothedWheelState] = []
        self._before = 0.0

    def __call__(self, sample: Sample) -> np.ndarray:
        """Speed signals (W,) in m/s at a sample."""
        speeds, sample_time = np.abs(sample.wheels).tolist(), 1e-9 * sample.time
        if not self._wheels:
            self._wheels = [_ToothedWheelState(speed) for speed in speeds]
        elif sample_time > self._before:
            for i, (wheel, speed) in enumerate(zip(self._wheels, speeds, strict=True)):
                self._advance_counter(i, wheel, speed, sample_time)
        self._before = sample_time
        return np.array([wheel.shown for wheel in self._wheels])

    def _advance_counter(self, wheel_index: int, wheel: "_ToothedWheelState", wheel_speed: float, time: float) -> None:
        """Advance the tooth counter of wheel i from the last sample to ``time`` (s)."""
        tooth_pitch, step = self._way[wheel_index], time - self._before
        turned_teeth = wheel.turned + 0.5 * (wheel.speed + wheel_speed) * step / tooth_pitch
        edges = [
            k
            for k in range(math.floor(wheel.turned) + 1, math.floor(turned_teeth) + 1)
            if self._missing is None or not self._missing(wheel_index, k % self._teeth.teeth, time)
        ]
        if edges:
            edge_time = self._before + _time_of_distance(
                (edges[-1] - wheel.turned) * tooth_pitch, wheel.speed, wheel_speed, step
            )
            edge_time = math.floor(edge_time / self._teeth.tick) * self._teeth.tick
            if wheel.edge is not None and edge_time > wheel.edge:
                wheel.shown = len(edges) * tooth_pitch / (edge_time - wheel.edge)
            wheel.edge = edge_time
        elif wheel.edge is not None:
            wheel.shown = min(wheel.shown, tooth_pitch / (time - wheel.edge))
        wheel.turned, wheel.speed = turned_teeth, wheel_speed


class _ToothedWheelState:
    """State of a toothed wheel's sensor: angle in teeth since the start, true and measured speed (m/s), and time of the
    last edge (s).
    """

    def __init__(self, wheel_speed: float) -> None:
        self.turned, self.speed, self.shown = 0.5, wheel_speed, wheel_speed
        self.edge: float | None = None


def _time_of_distance(distance: float, speed_before: float, speed_after: float, time_step: float) -> float:
    """Time (s) in which a distance (m) is covered, while speed changes linearly between two values over a step (s)."""
    slope = (speed_after - speed_before) / time_step
    root = math.sqrt(max(speed_before * speed_before + 2.0 * slope * distance, 0.0))
    return min(2.0 * distance / (speed_before + root), time_step)
