"""Motion of a rigid body recovered from the readings of tri-axial accelerometers on it (eqs 15 to 23).

A reading is specific force in the body's axes, f = S^T (x'' - g e) with e pointing down (z): at rest and level it
is -g along z. Relative readings A follow from relative positions R by A = M R with M = skew(alpha) + skew(w)^2, so
M = A R^+ (18). Its skew part is the angular acceleration, its symmetric part w w^T - |w|^2 I (20), which no
integration enters. Both are taken relative to their mean instead of the last sensor, so that all count alike.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError
from models.sensors.rotations import (
    cardan_angles,
    cubic_integrals,
    integrate_attitude,
    quaternion_from_cardan,
    rotation_matrix,
    skew_matrix,
)
from models.sensors.sensor_array import SensorArray, sensor_array

UNEXPLAINED_SHARE_LIMIT = 0.05
"""Largest share of the relative accelerations that a rigid body may leave unexplained: a mount at 10 times the
frequency of the motion moves by 1 % of it, one at twice by a third."""
GRAVITY = 9.81
"""Acceleration of gravity (m/s^2), acting down."""
NOISE_FACTOR = 1.5
"""Ratio of the misfit to the one expected from the readings' noise up to which a body counts as rigid."""


@dataclass(frozen=True)
class BodyRotation:
    """Rotation of the body in the accelerometers' readings at each instant, in the array's axes e1, e2, n: the matrix M
    of angular rates, and the relative accelerations.

    rate_matrix : (n, 3, 3) in 1/s^2, M of eq. (18); for sensors in a plane (n, 3, 2), without its column along n
    relative_acceleration : (n, 3, sensors) in m/s^2, readings less their mean
    """

    sensors: SensorArray
    rate_matrix: np.ndarray
    relative_acceleration: np.ndarray


@dataclass(frozen=True)
class RigidFitQuality:
    """Quality of a rigid-body fit to accelerometer readings.

    unexplained_rms : (n,) in m/s^2, rms over all sensors and axes of what no rigid motion explains, at each sample
    unexplained_share : its rms over the record divided by that of the relative accelerations
    expected_misfit : what the stated noise of the readings alone would leave (m/s^2)
    redundancy : equations per sample behind it; 0 means that nothing can be said
    suspect_sensor : the sensor without which the body is rigid; "" if there is no single one
    """

    unexplained_rms: np.ndarray
    unexplained_share: float
    expected_misfit: float
    redundancy: int
    suspect_sensor: str = ""

    @property
    def rigid(self) -> bool | None:
        """Whether the readings agree with a rigid body; None if no redundant equation can check it."""
        if self.redundancy == 0:
            return None
        return (
            self.unexplained_share <= UNEXPLAINED_SHARE_LIMIT
            or float(np.sqrt(np.mean(self.unexplained_rms**2))) <= NOISE_FACTOR * self.expected_misfit
        )


@dataclass(frozen=True)
class BodyStartState:
    """State of the body at the first sample: local rates (rad/s), quaternion, velocity (m/s) and position (m),
    global."""

    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @staticmethod
    def pitched(pitch: float, rate: float = 0.0, heave: float = 0.0, heave_rate: float = 0.0) -> "BodyStartState":
        """Start of a body that pitches (rad, rad/s, nose up) and heaves (m, m/s, down) alone."""
        level = tuple(quaternion_from_cardan(0.0, pitch, 0.0).tolist())
        return BodyStartState((0.0, rate, 0.0), level, (0.0, 0.0, heave_rate), (0.0, 0.0, heave))


@dataclass(frozen=True)
class CutOffFrequencies:
    """Cut-off frequencies (Hz) of high-pass filters against drift; None means no filter.

    rotation : of the rates and again of the angles, which takes true grades away, too; position : of velocity and of
    position.
    """

    rotation: float | None = None
    position: float | None = None


@dataclass(frozen=True)
class RecoveredMotion:
    """Motion of a body recovered from accelerometers: angular acceleration (rad/s^2) and rates (rad/s) local,
    quaternions, and the reference point's acceleration (m/s^2), velocity (m/s) and position (m) in global axes, all (n,
    3) but quaternions (n, 4)."""

    angular_acceleration: np.ndarray
    rates: np.ndarray
    orientation: np.ndarray
    acceleration: np.ndarray
    velocity: np.ndarray
    position: np.ndarray

    def angles(self) -> np.ndarray:
        """Roll, pitch, yaw (n, 3) in rad of the body. Raises GimbalLock where they are not defined."""
        return cardan_angles(self.orientation)

    def point(self, local_position: np.ndarray) -> np.ndarray:
        """Global positions (n, 3) in m of a point of the body at local position (3,) in m, eq. (15)."""
        return self.position + rotation_matrix(self.orientation) @ np.asarray(local_position)


def body_rotation_from_readings(sensors: SensorArray, readings: np.ndarray) -> BodyRotation:
    """``BodyRotation`` from the accelerometers' readings (n, sensors, 3) in m/s^2; gravity cancels at any attitude.

    Raises InputError for a reading that is not a finite number, and for a wrong number of sensors.
    """
    if readings.ndim != 3 or readings.shape[1:] != sensors.positions.shape:
        raise InputError("", "readings", str(readings.shape), f"must have the shape (n, {len(sensors.names)}, 3)")
    if not np.isfinite(readings).all():
        sample, sensor, axis = np.argwhere(~np.isfinite(readings))[0]
        raise InputError(
            "",
            f"sensor {sensors.names[sensor]}, sample {sample} along {'xyz'[axis]}",
            float(readings[sample, sensor, axis]),
            "must be a finite number: repair it or leave the sensor out",
        )
    local = readings - readings.mean(axis=1, keepdims=True)
    relative = np.einsum("ji,nsj->nis", sensors.principal_axes, local)
    return BodyRotation(sensors, relative @ sensors.position_weights, relative)


def angular_acceleration(rotation: BodyRotation, rates: np.ndarray) -> np.ndarray:
    """Local angular acceleration (n, 3) of the body in rad/s^2, eq. (20); rates (n, 3) in rad/s, local.

    The rates are read by the formula for a plane alone: alpha_1 = n.M e2 - w2 w3, alpha_2 = -n.M e1 + w1 w3.
    """
    return (
        array_angular_acceleration(rotation, rates @ rotation.sensors.principal_axes)
        @ rotation.sensors.principal_axes.T
    )


def array_angular_acceleration(rotation: BodyRotation, w: np.ndarray) -> np.ndarray:
    """Angular acceleration (n, 3) in rad/s^2 in the array's axes from the ``BodyRotation`` of the readings; w (n, 3),
    rad/s, in the same axes."""
    m = rotation.rate_matrix
    about_normal = 0.5 * (m[:, 1, 0] - m[:, 0, 1])
    if rotation.sensors.is_planar:
        about_first, about_second = m[:, 2, 1] - w[:, 1] * w[:, 2], -m[:, 2, 0] + w[:, 0] * w[:, 2]
    else:
        about_first, about_second = 0.5 * (m[:, 2, 1] - m[:, 1, 2]), 0.5 * (m[:, 0, 2] - m[:, 2, 0])
    return np.column_stack([about_first, about_second, about_normal])


def rates_up_to_sign(rotation: BodyRotation) -> np.ndarray:
    """Local angular rates (n, 3) in rad/s from the symmetric part of M alone: no integration, no drift, but no sign.

    w w^T = M+ - (tr M+ / 2) I, of which the nearest matrix of rank one is taken. For sensors in a plane the part
    along the normal has a sign of its own, apart from that of the other two.
    """
    unsigned = _unsigned_rates_in_plane if rotation.sensors.is_planar else _unsigned_rates_in_space
    return unsigned(rotation.rate_matrix) @ rotation.sensors.principal_axes.T


def _unsigned_rates_in_space(rate_matrix: np.ndarray) -> np.ndarray:
    """Angular rates (n, 3) in rad/s, except for a common sign, from the largest eigenvalue of w w^T and its
    eigenvector."""
    symmetric = 0.5 * (rate_matrix + np.swapaxes(rate_matrix, 1, 2))
    half = 0.5 * np.trace(symmetric, axis1=1, axis2=2)[:, None, None]
    sizes, directions = np.linalg.eigh(symmetric - half * np.eye(3))
    return np.sqrt(np.maximum(sizes[:, 2:], 0.0)) * directions[:, :, 2]


def _unsigned_rates_in_plane(rate_matrix: np.ndarray) -> np.ndarray:
    """Angular rates (n, 3) in rad/s up to two signs, of w3 and of (w1, w2) together, from sensors in a plane (axes e1,
    e2), whose matrix is (w.w) I - (w1, w2) (w1, w2)^T with w3^2 as its smaller eigenvalue."""
    flat = rate_matrix[:, :2, :2]
    sizes, directions = np.linalg.eigh(-0.5 * (flat + np.swapaxes(flat, 1, 2)))
    about_normal = np.sqrt(np.maximum(sizes[:, :1], 0.0))
    within = np.sqrt(np.maximum(sizes[:, 1:], 0.0) - about_normal**2) * directions[:, :, 0]
    return np.hstack([within, about_normal])


def unexplained_accelerations(rotation: BodyRotation) -> np.ndarray:
    """Relative accelerations (n, 3, sensors) in m/s^2 that no rigid motion explains, in the array's axes.

    Of the rates that space and plane offer, with each sign about the normal, those that leave least at each sample.
    """
    flat = _unsigned_rates_in_plane(rotation.rate_matrix)
    offers = [flat, flat * [1.0, 1.0, -1.0]]
    offers += [] if rotation.sensors.lies_in_plane else [_unsigned_rates_in_space(rotation.rate_matrix)]
    left = np.stack([rotation.relative_acceleration - _nearest_rigid_accelerations(rotation, w) for w in offers])
    sensor_with_least = np.argmin(np.sum(left**2, axis=(2, 3)), axis=0)
    return left[sensor_with_least, np.arange(len(sensor_with_least))]


def _nearest_rigid_accelerations(rotation: BodyRotation, w: np.ndarray) -> np.ndarray:
    """Relative accelerations (n, 3, sensors) in m/s^2 of a rigid body with rates w and the angular acceleration that
    fits best.

    By least squares: each pair of entries counts with the squared spreads of the sensors that it comes from.
    """
    array, square = rotation.sensors, skew_matrix(w) @ skew_matrix(w)
    weights = np.where(np.arange(3) < array.position_weights.shape[1], array.spreads, 0.0) ** 2
    rate_products = np.zeros_like(square)
    rate_products[:, :, : array.position_weights.shape[1]] = rotation.rate_matrix
    moment = weights * (rate_products - square)
    angular_part = (moment - np.swapaxes(moment, 1, 2)) / (weights[:, None] + weights + np.eye(3))  # no 0 / 0
    return (angular_part + square) @ ((array.positions - array.positions.mean(axis=0)) @ array.principal_axes).T


def fit_quality(sensors: SensorArray, readings: np.ndarray, reading_deviation: float = 0.0) -> RigidFitQuality:
    """Quality of the rigid-body fit to readings (n, sensors, 3) in m/s^2; ``reading_deviation`` is their standard
    deviation.

    Where it does not pass and sensors are left over, each is left out in turn to find the one that does not belong.
    """
    full_quality = _quality_of(sensors, readings, reading_deviation)
    if full_quality.rigid is not False:
        return full_quality
    without = {name: _quality_without(sensors, readings, name, reading_deviation) for name in sensors.names}
    shares = {
        name: other_quality.unexplained_share
        for name, other_quality in without.items()
        if other_quality is not None and other_quality.rigid
    }
    return replace(full_quality, suspect_sensor=min(shares, key=lambda name: shares[name])) if shares else full_quality


def _quality_of(sensors: SensorArray, readings: np.ndarray, reading_deviation: float) -> RigidFitQuality:
    spins = body_rotation_from_readings(sensors, readings)
    left = unexplained_accelerations(spins)
    count = 3 * len(sensors.names)
    size = float(np.sqrt(np.mean(spins.relative_acceleration**2)))
    misfit = np.sqrt(np.sum(left**2, axis=(1, 2)) / count)
    share = float(np.sqrt(np.mean(misfit**2))) / size if size > 0 else 0.0
    return RigidFitQuality(
        misfit, share, reading_deviation * float(np.sqrt(sensors.redundancy / count)), sensors.redundancy
    )


def _quality_without(
    sensors: SensorArray, readings: np.ndarray, sensor_name: str, reading_deviation: float
) -> RigidFitQuality | None:
    """Quality of the fit without the sensor ``sensor_name``; None if the remaining sensors do not make an array."""
    keep = [i for i, other_name in enumerate(sensors.names) if other_name != sensor_name]
    try:
        remaining_array = sensor_array({sensors.names[i]: sensors.positions[i].tolist() for i in keep})
    except InputError:
        return None
    return _quality_of(remaining_array, readings[:, keep], reading_deviation)


def time_integral(samples: np.ndarray, sample_period: float, start_values: np.ndarray) -> np.ndarray:
    """Sum of ``start_values`` and the time integral of values (n, ...), by cubics through four neighbouring samples:
    order 4 in the period.
    """
    return start_values + np.concatenate(
        [np.zeros_like(samples[:1]), np.cumsum(cubic_integrals(samples, sample_period), axis=0)]
    )


def integrate_rates(rotation: BodyRotation, sample_period: float, start_rates: np.ndarray) -> np.ndarray:
    """Local rates (n, 3) in rad/s by integration (20), from (3,) at the first sample; they drift with every error.

    In a plane alpha_1 and alpha_2 depend on the rates: c = w1 + i w2 obeys c' = mu + i w3 c with
    mu = n.M e2 - i n.M e1, which w3 solves by quadratures alone.
    """
    if len(rotation.rate_matrix) < 4:
        raise InputError(
            "", "readings", len(rotation.rate_matrix), "at least four samples are needed to integrate them"
        )
    first = np.asarray(start_rates) @ rotation.sensors.principal_axes
    if not rotation.sensors.is_planar:
        return (
            time_integral(array_angular_acceleration(rotation, np.zeros((1, 3))), sample_period, first)
            @ rotation.sensors.principal_axes.T
        )
    m = rotation.rate_matrix
    w3 = time_integral(0.5 * (m[:, 1, 0] - m[:, 0, 1]), sample_period, first[2])
    turn = np.exp(1j * time_integral(w3, sample_period, np.array(0.0)))
    c = turn * time_integral((m[:, 2, 1] - 1j * m[:, 2, 0]) / turn, sample_period, first[0] + 1j * first[1])
    return np.column_stack([c.real, c.imag, w3]) @ rotation.sensors.principal_axes.T


def recovered_motion(
    sensors: SensorArray,
    readings: np.ndarray,
    sample_period: float,
    start_state: BodyStartState | None = None,
    gravity_corrected: bool = False,
    rates: np.ndarray | None = None,
    cut_offs: CutOffFrequencies | None = None,
) -> RecoveredMotion:
    """Motion of the body's reference point and axes from accelerometer readings, steps 1 to 6 of the paper.

    readings : (n, sensors, 3) in m/s^2, local; specific force, or with ``gravity_corrected`` set to zero at rest on
    level ground, as sensors with a correction for gravity give it (17); sample_period : s
    rates : (n, 3) in rad/s, local, from a gyro or a filter, in the place of the integrated ones
    Raises InputError for unusable readings, GimbalLock if angles are filtered where they are not defined.
    """
    start_state, cut_offs = start_state or BodyStartState(), cut_offs or CutOffFrequencies()
    spins = body_rotation_from_readings(sensors, readings)
    w = integrate_rates(spins, sample_period, np.array(start_state.rates)) if rates is None else rates
    w = _high_passed(w, sample_period, cut_offs.rotation)
    orientation = integrate_attitude(w, sample_period, np.array(start_state.orientation))
    if cut_offs.rotation is not None:
        orientation = quaternion_from_cardan(
            *high_pass(np.unwrap(cardan_angles(orientation), axis=0), sample_period, cut_offs.rotation).T
        )
    alpha = angular_acceleration(spins, w)
    gravity_vector = np.array([0.0, 0.0, GRAVITY])
    acceleration = reference_acceleration(
        sensors, readings - gravity_vector if gravity_corrected else readings, orientation, alpha, w, gravity_vector
    )
    velocity = _high_passed(
        time_integral(acceleration, sample_period, np.array(start_state.velocity)), sample_period, cut_offs.position
    )
    position = _high_passed(
        time_integral(velocity, sample_period, np.array(start_state.position)), sample_period, cut_offs.position
    )
    return RecoveredMotion(alpha, w, orientation, acceleration, velocity, position)


def reference_acceleration(
    sensors: SensorArray,
    readings: np.ndarray,
    orientation: np.ndarray,
    alpha: np.ndarray,
    rates: np.ndarray,
    down_axis: np.ndarray,
) -> np.ndarray:
    """Global acceleration (n, 3) in m/s^2 of the body's reference point: the mean over all sensors, eq. (23)."""
    lever = (skew_matrix(alpha) + skew_matrix(rates) @ skew_matrix(rates)) @ sensors.positions.mean(axis=0)
    return np.einsum("nij,nj->ni", rotation_matrix(orientation), readings.mean(axis=1) - lever) + down_axis


def _high_passed(samples: np.ndarray, sample_period: float, cut_off: float | None) -> np.ndarray:
    return samples if cut_off is None else high_pass(samples, sample_period, cut_off)


def tilt_displacement(tilt_error: float, times: np.ndarray, gravity: float = GRAVITY) -> np.ndarray:
    """False horizontal displacement (n,) in m that gravity causes with a constant tilt error (rad): g sin(tilt) t^2 /
    2."""
    return 0.5 * gravity * np.sin(tilt_error) * times**2


BUTTERWORTH_ORDER = 2
"""Order of the Butterworth filter, which runs forwards and backwards: no phase, half the amplitude at the cut-off."""


def check_cut_off(
    sample_count: int, sample_period: float, cut_off: float, scene_path: str = "", key_path: str = "high-pass"
) -> None:
    """Raise InputError for a cut-off frequency (Hz) that does not suit ``sample_count`` samples every ``sample_period``
    (s)."""
    if not 0 < cut_off < 0.5 / sample_period:
        raise InputError(
            scene_path, key_path, cut_off, f"the cut-off must lie between 0 and {0.5 / sample_period:g} Hz"
        )
    if sample_count <= round(1 / (cut_off * sample_period)):
        raise InputError(
            scene_path,
            key_path,
            cut_off,
            f"a record of {(sample_count - 1) * sample_period:g} s is shorter than one period of "
            f"the cut-off, {1 / cut_off:g} s: raise the cut-off",
        )


def high_pass(samples: np.ndarray, sample_period: float, cut_off: float) -> np.ndarray:
    """Values (n, ...), sampled every ``sample_period`` (s), after a high-pass filter that removes frequencies below
    ``cut_off`` (Hz).

    A Butterworth filter of order BUTTERWORTH_ORDER run forwards and backwards, so that the amplitude falls by 1 / (1 +
    (fc/f)^4) and nothing is delayed; the ends are extended by their mirror image, which
    keeps the mean that is taken out. Raises InputError as ``check_cut_off`` does.
    """
    from scipy.signal import butter, sosfiltfilt

    check_cut_off(len(samples), sample_period, cut_off)
    sections = butter(BUTTERWORTH_ORDER, cut_off, "highpass", fs=1 / sample_period, output="sos")
    return sosfiltfilt(sections, samples, axis=0, padtype="even", padlen=round(1 / (cut_off * sample_period)))
