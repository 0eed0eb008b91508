"""Orientation of a rigid body: unit quaternions, their exact integration from angular rates, and Cardan angles.

S (3, 3) turns local (body) components into global ones: x_global = S x_local (eq. 21). A quaternion
q = (q1, q2, q3, q4) has its scalar first; q and -q are the same orientation. Rates are **local** and in rad/s:
S' = S skew(w), q' = q (0, w) / 2 (eq. 22). Axes as everywhere: x forward, y right, z down.
"""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from models.core.errors import InputError
from models.machine.compiled import njit

IntegrationRule = Literal["held", "mean", "cubic"]
"""How an angular rate runs between its samples: constant ("held"), at the mean of both, or along a cubic; order 1, 2, 4
of the orientation in the sampling period."""
HALF_TURN_ANGLE = np.pi
"""Rotation (rad) from sample to sample beyond which its direction cannot be told; the series of Magnus ends there."""
UNIT_NORM_TOLERANCE = 1e-6
"""Largest difference of a quaternion's norm from 1."""
GIMBAL_LOCK_COSINE = 1e-6
"""Cosine of pitch below which roll and yaw turn about the same axis: their errors grow as 1 / cosine, so that rounding
alone would reach 1e-10 rad and a sensor's 1e-3 rad any angle at all."""
ORTHOGONALITY_TOLERANCE = 1e-6
"""Largest departure of S^T S from the identity that still counts as a rotation."""


class GimbalLock(InputError):
    """Cardan angles were requested where roll and yaw cannot be distinguished; quaternions are not affected.

    sample : index of the first such orientation; pitch : its pitch (rad).
    """

    def __init__(self, sample_index: int, pitch: float) -> None:
        self.sample, self.pitch = sample_index, pitch
        super().__init__(
            "",
            f"orientation, sample {sample_index}",
            None,
            "gimbal lock: at a pitch of "
            f"{np.degrees(pitch):.6g} degrees roll and yaw turn about the same axis; use the quaternion "
            "or the matrix",
        )


def skew_matrix(v: np.ndarray) -> np.ndarray:
    """Skew matrices (..., 3, 3) of the vector product, skew(v) x = v x x, eq. (19); v (..., 3)."""
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0] = np.moveaxis(v, -1, 0)
    return matrix - np.swapaxes(matrix, -1, -2)


def quaternion_product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Quaternion product p q (..., 4), the rotation q followed by p: S(p q) = S(p) S(q)."""
    scalar = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    vector = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def conjugate_quaternion(q: np.ndarray) -> np.ndarray:
    """Conjugate quaternions (..., 4), which are those of the inverse rotations."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def quaternion_of_rotation_vector(rotation_vectors: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) in rad; exact to rounding and regular at all angles."""
    half = 0.5 * np.linalg.norm(rotation_vectors, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * rotation_vectors], axis=-1)


def rotation_vector(q: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) in rad, of length 0 to pi, of unit quaternions (..., 4)."""
    near = np.where(q[..., :1] < 0, -q, q)  # the shorter way round
    size = np.linalg.norm(near[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(size, near[..., :1])
    return near[..., 1:] * np.divide(angle, size, out=np.full_like(size, 2.0), where=size > 0)


def turns_between_samples(
    rates: np.ndarray, sample_period: float, integration_rule: IntegrationRule = "cubic"
) -> np.ndarray:
    """Rotation vectors (n - 1, ..., 3) in rad from each sample of local angular rates (n, ..., 3) in rad/s to the next.

    "held" : the rate of the sample before, h w0, which is exact for rates that are constant over a period;
    "mean" : the mean of both neighbours; "cubic" : the integral of the cubic through four neighbours and the
    second Magnus term h^2/12 (w0 x w1), the part of the turning that comes from a turning axis. Needs 2 samples,
    for "cubic" 4. Raises ValueError for fewer, for a rate that is not finite, and InputError for a period or a rule
    that is none and for rates that turn a body farther than HALF_TURN_ANGLE from one sample to the next, unless they
    are held."""
    if not 0.0 < sample_period < np.inf:
        raise InputError("", "period", sample_period, "must be above 0, in s")
    if integration_rule not in get_args(IntegrationRule):
        raise InputError("", "rule", integration_rule, "is not known", get_args(IntegrationRule))
    if len(rates) < (needed := 4 if integration_rule == "cubic" else 2):
        raise ValueError(
            f"{len(rates)} samples of the angular velocity: the rule {integration_rule!r} needs at least {needed}"
        )
    if not np.isfinite(rates).all():
        bad_sample = np.argwhere(~np.isfinite(rates))[0]
        raise ValueError(f"sample {bad_sample[0]} of the angular velocity is not a finite number")
    earlier_rates, later_rates = rates[:-1], rates[1:]
    if integration_rule == "held":
        return sample_period * earlier_rates
    _check_turned(rates, sample_period)
    if integration_rule == "mean":
        return 0.5 * sample_period * (earlier_rates + later_rates)
    return cubic_integrals(rates, sample_period) + sample_period**2 / 12 * np.cross(earlier_rates, later_rates)


def _check_turned(rates: np.ndarray, sample_period: float) -> None:
    """Raise InputError for angular rates that rotate the body too far between two samples."""
    fastest = float(np.linalg.norm(rates, axis=-1).max())
    if fastest * sample_period > HALF_TURN_ANGLE:
        samples = f"for samples every {sample_period:g} s, half a turn from one to the next: are they in degrees?"
        raise InputError("", "rates", fastest, f"must be at most {HALF_TURN_ANGLE / sample_period:.4g} rad/s {samples}")


def cubic_integrals(samples: np.ndarray, sample_period: float) -> np.ndarray:
    """Integrals (n - 1, ...) over each period of the cubics through four neighbouring samples (n, ...), n >= 4."""
    inner = -samples[:-3] + 13 * samples[1:-2] + 13 * samples[2:-1] - samples[3:]
    first_integral = 9 * samples[0] + 19 * samples[1] - 5 * samples[2] + samples[3]
    last_integral = 9 * samples[-1] + 19 * samples[-2] - 5 * samples[-3] + samples[-4]
    return sample_period / 24 * np.concatenate([first_integral[None], inner, last_integral[None]])


def integrate_attitude(
    rates: np.ndarray, sample_period: float, start_attitude: np.ndarray, integration_rule: IntegrationRule = "cubic"
) -> np.ndarray:
    """Quaternions (n, ..., 4) of the orientation at the samples of local angular rates (n, ..., 3) in rad/s, eq. (22);
    start_attitude (..., 4).

    Each step is the exact exponential of its rotation vector (``turns_between_samples``), and each result is divided by
    its norm, which therefore stays 1 within rounding for ever. Several bodies stand side by side in the middle axes.
    Raises InputError for a start that is no unit quaternion, and as ``turns_between_samples`` does.
    """
    if not np.abs(np.linalg.norm(np.asarray(start_attitude, dtype=float), axis=-1) - 1.0).max() <= UNIT_NORM_TOLERANCE:
        raise InputError("", "start", start_attitude, "must be unit quaternions")
    steps = quaternion_of_rotation_vector(turns_between_samples(rates, sample_period, integration_rule))
    count, middle = len(steps), steps.shape[1:-1]
    first = np.broadcast_to(np.asarray(start_attitude, dtype=float), (*middle, 4)).reshape(-1, 4)
    flat = np.ascontiguousarray(steps.reshape(count, -1, 4))
    return _chained_rotations(np.ascontiguousarray(first), flat).reshape(count + 1, *middle, 4)


@njit(cache=True)
def _chained_rotations(start_attitude, rotation_steps):
    """Normalised running products of quaternions, start, start steps[0], start steps[0] steps[1] ...: from shapes (m,
    4) and (n, m, 4) to (n + 1, m, 4)."""
    attitudes = np.empty((rotation_steps.shape[0] + 1, rotation_steps.shape[1], 4))
    for j in range(rotation_steps.shape[1]):
        a, b, c, d = start_attitude[j]
        attitudes[0, j] = start_attitude[j]
        for i in range(rotation_steps.shape[0]):
            e, f, g, h = rotation_steps[i, j]
            a, b, c, d = (
                a * e - b * f - c * g - d * h,
                a * f + b * e + c * h - d * g,
                a * g - b * h + c * e + d * f,
                a * h + b * g - c * f + d * e,
            )
            size = np.sqrt(a * a + b * b + c * c + d * d)
            a, b, c, d = a / size, b / size, c / size, d / size
            attitudes[i + 1, j, 0], attitudes[i + 1, j, 1], attitudes[i + 1, j, 2], attitudes[i + 1, j, 3] = a, b, c, d
    return attitudes


def rotation_matrix(q: np.ndarray) -> np.ndarray:
    """Rotation matrices S (..., 3, 3), local to global, of unit quaternions (..., 4), eq. (21)."""
    a, v = q[..., 0, None, None], q[..., 1:]
    outer = v[..., :, None] * v[..., None, :]
    square = np.trace(outer, axis1=-2, axis2=-1)[..., None, None]
    return (a * a - square) * np.eye(3) + 2 * outer + 2 * a * skew_matrix(v)


def quaternion_from_matrix(rotation_matrices: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4), scalar 0 or more, of rotation matrices (..., 3, 3). Raises ValueError if one is no
    rotation."""
    departure = np.abs(np.swapaxes(rotation_matrices, -1, -2) @ rotation_matrices - np.eye(3)).max()
    if not departure < ORTHOGONALITY_TOLERANCE or not (np.linalg.det(rotation_matrices) > 0).all():
        raise ValueError(
            f"not a rotation: S^T S departs from the identity by {departure:.3g}, or S turns left into right"
        )
    return Rotation.from_matrix(rotation_matrices).as_quat(canonical=True, scalar_first=True)


def quaternion_from_cardan(roll: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> np.ndarray:
    """Unit quaternions (..., 4) of the rotation S = Rz(yaw) Ry(pitch) Rx(roll) by Cardan angles, all in rad."""
    axes = np.eye(3)
    parts = [
        quaternion_of_rotation_vector(np.asarray(angle, dtype=float)[..., None] * axes[i])
        for i, angle in enumerate((roll, pitch, yaw))
    ]
    return quaternion_product(quaternion_product(parts[2], parts[1]), parts[0])


def cardan_angles(q: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw (..., 3) in rad of unit quaternions (..., 4): the sequence z-y'-x'' of vehicles (ISO 8855).

    S = Rz(yaw) Ry(pitch) Rx(roll); pitch lies within +-pi/2 and is positive nose up, roll and yaw within +-pi.
    Raises GimbalLock where cos(pitch) < GIMBAL_LOCK_COSINE.
    """
    s = rotation_matrix(q)
    cosine = np.hypot(s[..., 0, 0], s[..., 1, 0])
    pitch = np.arctan2(-s[..., 2, 0], cosine)
    locked = np.flatnonzero(cosine < GIMBAL_LOCK_COSINE)
    if len(locked):
        raise GimbalLock(int(locked[0]), float(pitch.ravel()[locked[0]]))
    roll, yaw = np.arctan2(s[..., 2, 1], s[..., 2, 2]), np.arctan2(s[..., 1, 0], s[..., 0, 0])
    return np.stack([roll, pitch, yaw], axis=-1)
