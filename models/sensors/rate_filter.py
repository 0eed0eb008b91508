"""Angular velocity from accelerometers without drift, by an extended Kalman filter that measures products of the rates.

Integration alone lets the rates drift as the square root of time. The symmetric part w w^T - |w|^2 I needs no
integration and holds the size of the rates for ever; the sign comes from the integration (filterpy's extended
Kalman filter, state w, quadratic measurement). It sees nothing while the body does not turn, and an error that
outgrows the rates themselves can settle on the wrong sign.
"""

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from models.core.errors import InputError
from models.sensors.rigid_body_motion import BodyRotation, array_angular_acceleration

SYMMETRIC_ENTRY_INDICES = ((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))
"""Index pairs of the entries of a symmetric (3, 3) matrix; for sensors in a plane only the first three are known."""
UNIT_MATRIX = np.eye(3)


class _RateFilter(ExtendedKalmanFilter):
    """Kalman filter for the angular rates whose prediction integrates the angular acceleration instead of using a
    matrix."""

    def predict_x(self, u: np.ndarray) -> None:
        """Advance the angular rates w (rad/s) by their increment ``u`` over a period."""
        self.x += u


def filter_rates(
    rotation: BodyRotation,
    sample_period: float,
    start_rates: np.ndarray,
    reading_deviation: float,
    start_deviation: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Local angular rates (n, 3) in rad/s and their stated standard deviations (n, 3), by the Kalman filter.

    start_rates : (3,) rad/s at the first sample, known to ``start_deviation`` (rad/s); reading_deviation : standard
    deviation of each reading (m/s^2), white. The same readings make the prediction and the measurement, two
    correlations that the filter leaves out: between neighbouring predictions, and between a prediction and the
    measurement after it.
    """
    if not reading_deviation > 0:
        allowed = (
            "the standard deviation of the readings must be above 0 (m/s^2): it weighs integration against measurement"
        )
        raise InputError("", "noise", reading_deviation, allowed)
    frame, planar = rotation.sensors.principal_axes, rotation.sensors.is_planar
    pairs = SYMMETRIC_ENTRY_INDICES[: 3 if planar else 6]
    indices = tuple(np.array(pairs).T)
    filter_ = _RateFilter(3, len(pairs))
    filter_.x, filter_.P = np.asarray(start_rates) @ frame, start_deviation**2 * UNIT_MATRIX
    filter_.Q = np.diag((sample_period * reading_deviation * rotation.sensors.array_noise_gains(planar)) ** 2)
    squares = rotation.sensors.inverse_squares
    spreads = [float(np.sqrt(squares[i] if i == j else (squares[i] + squares[j]) / 4)) for i, j in pairs]
    filter_.R = np.diag(
        [(reading_deviation * spread) ** 2 for spread in spreads]
    )  # noise of each entry per unit of the readings'
    values = np.column_stack([0.5 * (rotation.rate_matrix[:, i, j] + rotation.rate_matrix[:, j, i]) for i, j in pairs])
    known, rows = array_angular_acceleration(rotation, np.zeros((1, 3))), [(filter_.x.copy(), filter_.P)]
    for i in range(1, len(values)):
        _predict_rates(filter_, 0.5 * (known[i - 1] + known[i]), sample_period, planar)
        filter_.update(values[i], _rate_product_jacobian, _skew_squared_entries, args=indices, hx_args=indices)
        rows.append((filter_.x.copy(), filter_.P))
    rates, covariances = (np.array(column) for column in zip(*rows, strict=True))
    return rates @ frame.T, np.sqrt(np.einsum("ij,njk,ik->ni", frame, covariances, frame))


def _predict_rates(rate_filter: _RateFilter, alpha: np.ndarray, sample_period: float, is_planar: bool) -> None:
    """Predict the rates over a period with the mean angular acceleration; with sensors in a plane, w1 and w2 also turn
    about the normal."""
    slope, change = np.zeros((3, 3)), alpha
    if is_planar:
        w = rate_filter.x + 0.5 * sample_period * alpha  # the middle of the period
        slope = np.array([[0.0, -w[2], -w[1]], [w[2], 0.0, w[0]], [0.0, 0.0, 0.0]])
        change = alpha + np.array([-w[1] * w[2], w[0] * w[2], 0.0])
    rate_filter.F = UNIT_MATRIX + sample_period * slope
    rate_filter.predict(sample_period * change)


def _skew_squared_entries(w: np.ndarray, first_axis: np.ndarray, second_axis: np.ndarray) -> np.ndarray:
    """Entries of skew(w)^2 = w w^T - |w|^2 I at pairs of axes, for the angular rate w (rad/s)."""
    return w[first_axis] * w[second_axis] - (first_axis == second_axis) * (w @ w)


def _rate_product_jacobian(w: np.ndarray, first_axis: np.ndarray, second_axis: np.ndarray) -> np.ndarray:
    """Derivatives (entries, 3) of the measured rate products by the angular rate w."""
    return (
        w[first_axis, None] * UNIT_MATRIX[second_axis]
        + w[second_axis, None] * UNIT_MATRIX[first_axis]
        - 2 * (first_axis == second_axis)[:, None] * w
    )
