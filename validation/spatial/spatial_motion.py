"""A rigid-body motion in space in closed form, and the readings of accelerometers on it; without vehicle or engine."""

from dataclasses import dataclass

import numpy as np

from models.sensors.rigid_body_motion import BodyStartState
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix, skew_matrix

GRAVITY = np.array([0.0, 0.0, 9.81])
SensorPositions = dict[str, tuple[float, float, float]]


@dataclass(frozen=True)
class RigidBodyMotion:
    """Sampled motion of a rigid body. alpha, rates (n, 3): angular acceleration and velocity, local; orientation (n,
    4); acceleration, position (n, 3) of the reference point, global; start; period (s)."""

    alpha: np.ndarray
    rates: np.ndarray
    orientation: np.ndarray
    acceleration: np.ndarray
    position: np.ndarray
    start: BodyStartState
    period: float


def rigid_body_motion(sample_count: int = 2001, sample_period: float = 1e-3) -> RigidBodyMotion:
    """Motion of a rigid body with roll, pitch and yaw of some tenths of a radian at different frequencies, and a moving
    reference point.

    Rates follow from the Cardan angles by the closed form w = E(roll, pitch) (roll', pitch', yaw'), and alpha by its
    derivative: nothing of the algorithm under test is used.
    """
    t = sample_period * np.arange(sample_count)
    angles, speeds, changes = _sine_waves(t, np.array([[0.3, 1.7, 0.2], [0.25, 2.3, 0.9], [0.6, 0.8, 0.4]]))
    (roll, pitch, yaw), (droll, dpitch, _) = angles.T, speeds.T
    ones, zeros = np.ones_like(t), np.zeros_like(t)
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    turn = np.moveaxis(np.array([[ones, zeros, -sp], [zeros, cr, sr * cp], [zeros, -sr, cr * cp]]), 2, 0)
    change = np.moveaxis(
        np.array(
            [
                [zeros, zeros, -cp * dpitch],
                [zeros, -sr * droll, cr * cp * droll - sr * sp * dpitch],
                [zeros, -cr * droll, -sr * cp * droll - cr * sp * dpitch],
            ]
        ),
        2,
        0,
    )
    rates = np.einsum("nij,nj->ni", turn, speeds)
    alpha = np.einsum("nij,nj->ni", change, speeds) + np.einsum("nij,nj->ni", turn, changes)
    orientation = quaternion_from_cardan(roll, pitch, yaw)
    positions, velocities, accelerations = _sine_waves(t, np.array([[1.0, 1.1, 0.0], [0.5, 1.9, 0.7], [0.1, 5.0, 0.3]]))
    rows = (tuple(values[0].tolist()) for values in (rates, orientation, velocities, positions))
    return RigidBodyMotion(alpha, rates, orientation, accelerations, positions, BodyStartState(*rows), sample_period)


def _sine_waves(times: np.ndarray, wave_shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three sine waves (n, 3) at times (n,) in s and their first two derivatives; wave_shapes (3, 3) : rows of
    amplitude, angular frequency (rad/s) and phase (rad)."""
    size, speed, phase = wave_shapes.T
    angle = np.outer(times, speed) + phase
    return size * np.sin(angle), size * speed * np.cos(angle), -size * speed**2 * np.sin(angle)


PATH = rigid_body_motion()


def sensor_readings(sensor_positions: np.ndarray, body_motion: RigidBodyMotion = PATH) -> np.ndarray:
    """Specific forces (n, sensors, 3) in m/s^2 that accelerometers at local positions (sensors, 3) in m read, by eqs
    (16) and (17)."""
    lever = skew_matrix(body_motion.alpha) + skew_matrix(body_motion.rates) @ skew_matrix(body_motion.rates)
    felt = np.einsum("nji,nj->ni", rotation_matrix(body_motion.orientation), body_motion.acceleration - GRAVITY)
    return felt[:, None] + np.einsum("nij,sj->nsi", lever, np.asarray(sensor_positions))


def tilted_sensors(top_sensor_height: float, floor_rotation: np.ndarray) -> SensorPositions:
    """Positions (m) of five accelerometers, rotated: four at the corners of a floor of 2 m by 1.2 m, and one
    ``top_sensor_height`` m above its middle."""
    floor = np.array([[1, 0.6, 0], [1, -0.6, 0], [-1, 0.6, 0], [-1, -0.6, 0], [0, 0, -top_sensor_height]])
    return {f"s{i + 1}": (float(x), float(y), float(z)) for i, (x, y, z) in enumerate(floor @ floor_rotation.T)}


TILT_ROTATION = rotation_matrix(quaternion_from_cardan(0.3, 0.4, 0.5))
SENSOR_ARRANGEMENTS: dict[str, SensorPositions] = {
    "4": {"s1": (1, 0.6, 0), "s2": (1, -0.6, 0.5), "s3": (-1, 0.6, 0), "s4": (-1, -0.6, -0.5)},
    "5, one 1 m up": tilted_sensors(1.0, np.eye(3)),
    "5 in a plane": tilted_sensors(0.0, np.eye(3)),
    "5 in a tilted plane": tilted_sensors(0.0, TILT_ROTATION),
    "5, one 3 cm up": tilted_sensors(0.03, np.eye(3)),
    "3": {"s1": (1.1, 0, -0.2), "s2": (-0.9, 0.6, -0.2), "s3": (-0.9, -0.6, 0.3)},
}
"""Positions (m) of the accelerometers in each arrangement that rows and tests use, by name."""
