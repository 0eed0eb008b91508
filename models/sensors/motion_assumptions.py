"""Assumptions behind a motion recovered from accelerometers."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.sensors.rigid_body_motion import NOISE_FACTOR, UNEXPLAINED_SHARE_LIMIT, RecoveredMotion, RigidFitQuality

LARGEST_UPRIGHT_PITCH = 1.4
"""Largest pitch (rad; 80 degrees) at which roll and yaw can be told apart well; at a right angle they cannot."""
LARGEST_TURN_PER_SAMPLE = 0.2
"""Largest rotation (rad) per sample: cubics through four samples then err by some 1e-5 of a rotation in each step."""
LARGEST_LEVEL_TILT = 0.05
"""Largest tilt (rad) of a start that counts as level: a larger tilt turns 0.5 m/s^2 of gravity into a false motion."""


@dataclass(frozen=True)
class AccelerometerRecord:
    """Accelerometer readings (n, sensors, 3) in m/s^2 every ``period`` (s), the quality of their rigid-body fit, and
    whether the motion was assumed to begin at rest and level, with gravity in the readings."""

    quality: RigidFitQuality
    readings: np.ndarray
    period: float
    starts_at_rest_and_level: bool


def assumptions_of_motion(accelerometer_record: AccelerometerRecord, recovered: RecoveredMotion) -> list[Assumption]:
    """Assumptions behind a motion (n samples) recovered from a record."""
    pitch, turning_angles = (
        cardan_pitch(recovered),
        np.linalg.norm(recovered.rates, axis=1) * accelerometer_record.period,
    )
    listed = [
        Assumption(
            "away from gimbal lock",
            "the pitch is so small that roll, pitch and yaw are told apart",
            "no angles tell this attitude: read the orientation itself",
            partial(_watched_values, {"body": pitch}),
            "rad",
            -LARGEST_UPRIGHT_PITCH,
            LARGEST_UPRIGHT_PITCH,
        ),
        Assumption(
            "fine samples",
            "the samples are fine enough for the turning",
            "sample faster (sampling_rate)",
            partial(_watched_values, {"body": turning_angles}),
            "rad per sample",
            upper_limit=LARGEST_TURN_PER_SAMPLE,
        ),
    ]
    if accelerometer_record.quality.rigid is not None and not accelerometer_record.quality.suspect_sensor:
        listed.append(_rigid_body_assumption(accelerometer_record.quality))
    if accelerometer_record.starts_at_rest_and_level:
        says, remedy = "the record begins at rest and level", "begin it where the body stands level"
        tilt = _tilt_from_gravity(accelerometer_record.readings[0].mean(axis=0))
        listed.append(
            Assumption(
                "level start",
                says,
                remedy,
                partial(_watched_values, {"body": tilt}),
                "rad",
                upper_limit=LARGEST_LEVEL_TILT,
            )
        )
    return listed


def cardan_pitch(recovered: RecoveredMotion) -> np.ndarray:
    """Pitch angle (n,) in rad of a recovered motion; it is defined at every attitude."""
    w, x, y, z = recovered.orientation.T
    return np.arcsin(np.clip(2.0 * (w * y - x * z) / np.sum(recovered.orientation**2, axis=1), -1.0, 1.0))


def _rigid_body_assumption(quality: RigidFitQuality) -> Assumption:
    """Assumption that the sensors move with a single rigid body. A single sensor that does not is left out, without an
    assumption about it."""
    size = (
        float(np.sqrt(np.mean(quality.unexplained_rms**2))) / quality.unexplained_share
        if quality.unexplained_share > 0.0
        else 1.0
    )
    return Assumption(
        "rigid body",
        "the sensors stand still on a rigid body",
        "mount them stiffer, leave out the one that gives way, or state their noise (deviation)",
        partial(_watched_values, {"misfit": np.array([quality.unexplained_share])}),
        "",
        upper_limit=max(UNEXPLAINED_SHARE_LIMIT, NOISE_FACTOR * quality.expected_misfit / size),
    )


def _tilt_from_gravity(first_specific_force: np.ndarray) -> np.ndarray:
    """Angle (1,) in rad between a specific force (3,) and the upward vertical."""
    return np.array([np.arctan2(np.hypot(first_specific_force[0], first_specific_force[1]), -first_specific_force[2])])


def _watched_values(watched: dict[str, np.ndarray], _unused_run: Result) -> Watched:
    return watched
