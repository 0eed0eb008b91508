"""How the state of a ride system moves within a step of a drive, and what it has of noise met within the step."""

from functools import lru_cache

import numpy as np
from scipy.linalg import expm

from models.ride.noise_cells import POINTS, WEIGHTS
from models.ride.road_in_path import RoadInPath
from models.ride.speed_profile import SpeedProfile

TERMS = 24
"""Of exponential series within a step, where rate times time is about 1: 1.5^24 / 24! = 3e-20."""


class Responses:
    """Transitions of the state (y, f) of a form along a drive, exact in time and in path.

    Between the points of the profile only: on a step the path must be a polynomial of time.
    """

    def __init__(self, form: RoadInPath, profile: SpeedProfile) -> None:
        F, G = form.excitation.F, form.excitation.G
        self.form, self.profile, self.path = form, profile, profile.path
        self.n, self.axles, self.m = form.inputs.shape
        self.decay, self.noise = series(F, np.eye(self.m)), series(F, G)
        self.motion = [series(form.A, form.inputs[:, axle]) for axle in range(self.axles)]
        self.of_length = lru_cache(maxsize=64)(self._of_length)

    def transition(self, start: float, end: float) -> np.ndarray:
        """E (n + a m, n + a m) over a step from start to end (s)."""
        motion, inputs = self.of_length(round(end - start, 14))
        driven = self.path(start + (end - start) * np.append(POINTS, 1.0)) - self.path(start)
        decay = (powers(driven, TERMS) @ self.decay).reshape(-1, self.m)
        E = np.zeros((self.n + self.axles * self.m,) * 2)
        E[: self.n, : self.n] = motion
        E[: self.n, self.n :] = (inputs @ decay[: -self.m]).reshape(self.n, -1)
        for first in range(self.n, len(E), self.m):
            E[first : first + self.m, first : first + self.m] = decay[-self.m :]
        return E

    def _of_length(self, length: float) -> tuple[np.ndarray, np.ndarray]:
        """e^(A h) and what e^(A (h - u)) makes of inputs at the points of the step: (n a, g m)."""
        left = np.stack([expm(self.form.A * length * (1.0 - point)) for point in POINTS])
        inputs = np.einsum("g,gij,jam->iagm", WEIGHTS * length, left, self.form.inputs, optimize=True)
        return expm(self.form.A * length), inputs.reshape(self.n * self.axles, -1)

    def to_noise(self, axle: int, met: np.ndarray, end: np.ndarray) -> np.ndarray:
        """States (n + a m, L, k) at ``end`` (L,) after a unit of noise that the axle has met at ``met`` (L,), s.

        Each pair of times lies in one step.
        """
        left = (end - met)[:, None]
        driven = self.path(met[:, None] + left * POINTS) - self.path(met)[:, None]
        k = self.noise.shape[1] // self.m
        road = (powers(driven, TERMS) @ self.noise) * (left * WEIGHTS)[..., None]
        weighted = np.swapaxes(powers(left * (1.0 - POINTS), TERMS), 1, 2) @ road
        out = np.zeros((self.n + self.axles * self.m, len(met), k))
        columns = weighted.reshape(-1, TERMS, self.m, k).transpose(1, 2, 0, 3).reshape(TERMS * self.m, -1)
        motion = self.motion[axle].reshape(TERMS, self.n, self.m).transpose(1, 0, 2).reshape(self.n, -1)
        out[: self.n] = (motion @ columns).reshape(self.n, -1, k)
        now = powers(self.path(end) - self.path(met), TERMS) @ self.noise
        own = slice(self.n + axle * self.m, self.n + (axle + 1) * self.m)
        out[own] = now.reshape(-1, self.m, k).transpose(1, 0, 2)
        return out


def series(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A^j B, flat, in row j: e^(A t) B = powers(t) @ series."""
    rows = [B]
    for _ in range(TERMS - 1):
        rows.append(A @ rows[-1])
    return np.stack([row.ravel() for row in rows])


def powers(t: np.ndarray, count: int) -> np.ndarray:
    """t^j / j! along a new last axis, j = 0 to count - 1."""
    out = np.ones((*np.shape(t), count))
    out[..., 1:] = np.asarray(t)[..., None] / np.arange(1, count)
    return np.cumprod(out, axis=-1, out=out)
