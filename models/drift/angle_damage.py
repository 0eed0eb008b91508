"""Fatigue damage caused by a wrong pitch: error paths of a gyro's angle, and damage averaged over such an error.

A vehicle that is guided by a gyro's pitch stands wrong by its angle error, and a slow angle turns the section forces
and changes nothing else: the component along the chassis is f3 sin(pitch + error). So the damage of a run, driven again
and again, is counted once for each of some constant errors, and averaged over the error's path.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from models.core.errors import InputError
from models.core.noise import GYRO, normal_samples
from models.core.result import Result
from models.drift.score import SECTION_FORCE_CHANNELS, section_forces
from models.fatigue.damage import pseudo_damage
from models.sensors.inertial_unit import bias_path

ANGLE_ERROR_COUNT = 41
"""Number of constant angle errors at which damage is counted; odd, so that one of them is zero."""
EVEN_SPACING_ANGLE = 1e-3
"""Angle error (rad) below which the nodes are evenly spaced; above it their spacing grows with the angle."""

UnitErrorPaths = tuple[np.ndarray, np.ndarray]
"""Angle error paths (paths, seconds + 1) with a value per second: of a random walk of 1 rad per sqrt(s), and of a
gyro bias of 1 rad/s."""


def unit_angle_error_paths(
    path_count: int, sampling_rate: int, duration: int, correlation_time: float, seed: int
) -> UnitErrorPaths:
    """Random angle error paths of a gyro of unit grade, two arrays (path_count, length + 1) with a value per second: by
    white noise and by bias. They sum ``sampling_rate`` noise samples per second over ``duration`` (s); the bias has a
    correlation time (s).

    Every grade of gyro is a multiple of the same paths, so that grades are compared without scatter between them.
    """
    walks, drifts = list[np.ndarray](), list[np.ndarray]()
    for path in range(path_count):
        noise = normal_samples(seed, path, sampling_rate * duration, 1, noise_source=GYRO)[:, 0] / sampling_rate**0.5
        wander = (
            bias_path(sampling_rate * duration, 1 / sampling_rate, 0.0, 1.0, correlation_time, seed, path)
            / sampling_rate
        )
        for paths, samples_of_paths in ((walks, noise), (drifts, wander)):
            paths.append(
                np.concatenate([[0.0], samples_of_paths.reshape(duration, sampling_rate).sum(axis=1).cumsum()])
            )
    return np.array(walks), np.array(drifts)


def damage_at_angle_errors(run_result: Result, pitch_error: float) -> list[float]:
    """Pseudo-damage of each section force of a run whose pitch is wrong by a constant error (rad)."""
    forces = section_forces(run_result["f3"], run_result["f4"], run_result["pitch"] + pitch_error)
    return [pseudo_damage(load_rotated_to_maximum(forces[name])) for name in SECTION_FORCE_CHANNELS]


def log_damage_over_pitch_error(run_result: Result, largest_pitch_error: float, scene_path: str = "") -> CubicSpline:
    """Spline of the logarithm of damage divided by true damage for each section force, over a constant pitch error
    (rad).

    Raises InputError, which names the scene's file, for a run without damage.
    """
    widest = np.arcsinh(largest_pitch_error / EVEN_SPACING_ANGLE)
    angles = EVEN_SPACING_ANGLE * np.sinh(np.linspace(-widest, widest, ANGLE_ERROR_COUNT))
    damage = np.array([damage_at_angle_errors(run_result, angle) for angle in angles])
    true = damage[ANGLE_ERROR_COUNT // 2]
    if not (true > 0).all():
        allowed = "leaves no damage in the section forces to compare with: use a road that moves the vehicle"
        raise InputError(scene_path, "effects.road", None, allowed)
    return CubicSpline(angles, np.log(damage / true))


def load_rotated_to_maximum(load: np.ndarray) -> np.ndarray:
    """The load history (n,) rotated so that it begins and ends at its largest value, as in a block of many repetitions
    (ASTM E1049-85, 5.4.5).

    Cut elsewhere, the largest cycle of all would stay open and count one half.
    """
    top = int(np.argmax(load))
    return np.concatenate([load[top:], load[: top + 1]])


def damage_errors(log_damage_curve: CubicSpline, angle_error_paths: np.ndarray) -> np.ndarray:
    """Relative error (paths, 4) of the damage of each section force, averaged over angle error paths (paths, n) in
    rad; ``log_damage_curve`` is from ``log_damage_over_pitch_error``."""
    reach = log_damage_curve.x[-1]
    return np.expm1(log_damage_curve(np.clip(angle_error_paths, -reach, reach))).mean(axis=1)
