"""Shape filter that turns white noise over the path into a one-dimensional random process, from which roads are
made."""

import math
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError


@dataclass(frozen=True)
class ShapeFilter:
    """Shape filter of first order: f' = -corner f + w, w white noise of ``intensity`` q (unit of f squared per metre),
    ' = d/ds.

    With a ``cutoff`` (rad/m, above the corner) the noise first passes u' = -cutoff u + cutoff w: second order, so
    that f has a rate of finite variance, as outputs need which see the road's rate (tyre damping).

    corner : rad/m, 0 or more; 0 is a random walk, whose variance is infinite
    """

    corner: float
    intensity: float
    cutoff: float | None = None

    def __post_init__(self) -> None:
        """Raise InputError for parameters that do not define a filter."""
        if not (math.isfinite(self.corner) and self.corner >= 0.0):
            raise InputError("", "corner", self.corner, "must be 0 or more, in rad/m")
        if not (math.isfinite(self.intensity) and self.intensity >= 0.0):
            raise InputError("", "intensity", self.intensity, "must be a finite intensity of white noise, 0 or more")
        if self.cutoff is not None and not (math.isfinite(self.cutoff) and self.cutoff > self.corner):
            raise InputError("", "cutoff", self.cutoff, f"must be above the corner, {self.corner:g} rad/m")

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State-space matrices F (m, m), G (m, 1), H (1, m) of x' = F x + G w with unit noise w per metre and f = H x;
        m = 1 or 2."""
        noise = math.sqrt(self.intensity)
        if self.cutoff is None:
            return np.array([[-self.corner]]), np.array([[noise]]), np.ones((1, 1))
        F = np.array([[-self.corner, 1.0], [0.0, -self.cutoff]])
        return F, np.array([[0.0], [self.cutoff * noise]]), np.array([[1.0, 0.0]])

    def spectrum(self, wavenumber: np.ndarray) -> np.ndarray:
        """Two-sided spectral density of the filtered process over the wavenumber in rad/m."""
        square = np.square(wavenumber)
        low_pass = 1.0 if self.cutoff is None else self.cutoff**2 / (self.cutoff**2 + square)
        return self.intensity / (2.0 * math.pi) / (self.corner**2 + square) * low_pass

    def covariance(self, distance: np.ndarray) -> np.ndarray:
        """Covariance E[f(s) f(s + distance)] of the filtered process f, distance in m; infinite for a random walk."""
        gap = np.abs(distance)
        if self.corner == 0.0:
            return np.full(np.shape(gap), math.inf if self.intensity else 0.0)
        first = np.exp(-self.corner * gap) / (2.0 * self.corner)
        if self.cutoff is None:
            return self.intensity * first
        second = np.exp(-self.cutoff * gap) / (2.0 * self.cutoff)
        return self.intensity * (first - second) / (1.0 - (self.corner / self.cutoff) ** 2)
