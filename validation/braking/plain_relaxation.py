"""Slip angles that lag behind, once more in plain code: see ``models.brake.relaxation`` for the law.

The lag solves a linear equation of constant coefficients, whose solution is an exponential of a matrix.
"""

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

from models.brake.brake import Brake, of_wheels
from models.brake.plane_vehicle import PAPER, truck
from models.brake.pressure import Chambers
from models.systems.braking.march import on_tyres
from models.tyre.magic_formula import surface
from validation.braking.sprung_box import GRADIENT, steady
from validation.braking.truck_equations import turned

GRAVITY = 9.81
SLOW, DAMPING, SLOWEST = 1.0, 0.7, 1e-9
"""Speed (m/s) below which the damper fades in, its damping ratio at rest, speed (m/s) that counts as rest."""
SPEED, UNTIL, STEER = 11.11, 9.0, 0.03
"""Speeds (m/s) from which and to which the truck turns, and its steer angle (rad)."""


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


def turn_apart(length: float, substeps: int = 4) -> float:
    """How far (m) a braked turn of the truck on tyres that relax over a length (m) ends from its written equations."""
    tyre, torques = surface("ice"), (300.0, 200.0)
    end = turned(PAPER, tyre, STEER, torques, SPEED, UNTIL, length)
    path = on_tyres(
        truck(PAPER),
        [tyre],
        of_wheels(*4 * (Brake(push_out=0.0, release=0.0, rising=GRADIENT, falling=GRADIENT),)),
        Chambers(np.zeros(4), np.zeros(4), 6.0),
        steer=np.array([STEER, STEER, 0.0, 0.0]),
        substeps=substeps,
        relaxation=np.full(4, length),
    ).run(steady(*np.repeat(torques, 2)), SPEED, end.time)
    places = CubicHermiteSpline(path.times, path.states[:, 0, :2], path.states[:, 1, :2])
    return float(np.hypot(*(places(end.time) - (end.x, end.y))))
