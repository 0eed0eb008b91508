"""Slip angles that lag behind, once more in plain code: see ``models.brake.relaxation`` for the law.

The lag solves a linear equation of constant coefficients, whose solution is an exponential of a matrix.
"""

import numpy as np
from scipy.linalg import expm

GRAVITY = 9.81
SLOW, DAMPING, SLOWEST = 1.0, 0.7, 1e-9
"""Speed (m/s) below which the damper fades in, its damping ratio at rest, speed (m/s) that counts as rest."""


def lag_on(
    state: np.ndarray,
    time: float,
    steer: np.ndarray,
    places: np.ndarray,
    slope: float,
    length: np.ndarray,
    lag: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """The lagging tan of the slip angles (W,) after a time (s), and with the damper's part (W,).

    state (2, 3) : x, y, heading and their rates; places (W, 2) : of the wheels (m); lag (W,) : before, NaN where it is
    to begin as in steady motion; slope : largest cornering coefficient (1/rad); length (W,) : m.
    """
    velocity, turning = state[1, :2], state[1, 2]
    centres = velocity + turning * (places @ rotation(state[0, 2] + 0.5 * np.pi).T)
    u, v = np.array([rotation(state[0, 2] + own).T @ centre for own, centre in zip(steer, centres, strict=True)]).T
    speed = np.abs(u)
    before = np.where(np.isnan(lag), v / np.maximum(speed, SLOWEST), lag)
    after = np.array([_taken_up(*own, time) for own in zip(before, speed, v, length, strict=True)])
    stiffness = np.sqrt(max(slope, SLOWEST) * GRAVITY * length)
    fade = np.clip(1.0 - speed / SLOW, 0.0, 1.0)
    return after, after + fade**2 * v * 2.0 * DAMPING / stiffness


def _taken_up(lag: float, speed: float, across: float, length: float, time: float) -> float:
    """sigma a' = v - |u| a over a time (s)."""
    rates = np.array([[-speed, across], [0.0, 0.0]]) * (time / length)
    return float((expm(rates) @ (lag, 1.0))[0])


def rotation(angle: float) -> np.ndarray:
    """(2, 2) turning by an angle (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
