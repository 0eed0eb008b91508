"""The Kalman filter of the pitch by filterpy itself, step by step: what the compiled one must be equal to."""

import math
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from models.drift import pitch_filter
from models.drift.kalman_recursion import STATES, Trace, blank
from models.drift.pitch_filter import Measurement
from models.drift.pitch_step import PitchStep


class FilterpyFilter(ExtendedKalmanFilter):
    """The vehicle over one step after the other; ``x`` (7,), ``P`` (7, 7) as filterpy names them."""

    def __init__(self, step: PitchStep, x: np.ndarray, covariance: np.ndarray, intensity: float,
                 measured: Measurement) -> None:  # fmt: skip
        """x (7,), covariance (7, 7); intensity: variance (N^2) of a force sample, per step of the filter."""
        super().__init__(dim_x=STATES, dim_z=1)
        self.step, self.intensity, self.measured = step, intensity, measured
        self.x, self.P = x.copy(), covariance.copy()
        self.late = np.zeros((STATES, 2))

    def predict_x(self, u: Any = 0) -> None:
        """State and Jacobians over step number ``u``; the late part of a force sample joins a step later."""
        self.x, self.F, early, late = self.step.advance(self.x, u)
        push = early + self.F @ self.late
        self.Q, self.late = self.intensity * (push @ push.T), late

    def measure(self, number: int) -> tuple[int, float]:
        """Take in what is a number in a row of the measurement: how many, and the normalised innovation squared."""
        values = self.measured.values[number]
        there = np.flatnonzero(np.isfinite(values))
        if not len(there):
            return 0, math.nan
        rows = self._I[[self.measured.columns[i] for i in there]]
        late, noise = rows @ self.late, np.diag(np.square(self.measured.deviations)[there])
        self.update(values[there], lambda x: rows, rows.dot, R=noise + self.intensity * (late @ late.T))
        return len(there), float(self.y @ self.SI @ self.y)


def march(step: PitchStep, x: np.ndarray, covariance: np.ndarray, intensity: float,
          measured: Measurement) -> Trace:  # fmt: skip
    """What ``models.drift.pitch_filter.march`` gives, by filterpy."""
    own, trace = FilterpyFilter(step, x, covariance, intensity, measured), blank(step.count + 1)
    every = round(measured.period / step.period)
    for i in range(step.count + 1):
        if i:
            own.predict(i - 1)
            trace.transitions[i], trace.noises[i] = own.F, own.Q
        trace.predictions[i] = own.x
        if i % every == 0 and i // every < len(measured.values):
            trace.used[i], trace.surprises[i] = own.measure(i // every)
        trace.states[i], trace.covariances[i], trace.pending[i] = own.x, own.P, own.late
    return trace


def difference(step: PitchStep, x: np.ndarray, covariance: np.ndarray, intensity: float,
               measured: Measurement) -> float:  # fmt: skip
    """Largest difference of states, covariances and innovations between the two, by the stated deviations."""
    ours, theirs = (one(step, x, covariance, intensity, measured) for one in (pitch_filter.march, march))
    size = np.sqrt(np.einsum("nii->ni", theirs.covariances))
    assert np.array_equal(ours.used, theirs.used)
    seen = theirs.used > 0
    return float(max(np.abs((ours.states - theirs.states) / size).max(),
                     np.abs((ours.covariances - theirs.covariances) / (size[:, :, None] * size[:, None])).max(),
                     np.abs(ours.surprises - theirs.surprises)[seen].max()))  # fmt: skip
