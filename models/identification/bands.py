"""Bands of 95 % around a prediction, from the uncertainty of the parameters and the error of the model."""

from dataclasses import dataclass

import numpy as np

from models.identification.problem import IdentificationProblem
from models.identification.uncertainty import NORMAL_QUANTILE, Uncertainty

SHARE_INSIDE_BAND = 0.95
"""Share of the residuals that lie inside the bands where these were fitted."""


@dataclass(frozen=True)
class ErrorModel:
    """Model of a prediction's error: sqrt(constant_error^2 + (prediction_share x prediction)^2) times ``band_factor``
    contains SHARE_INSIDE_BAND of the residuals."""

    constant_error: float
    prediction_share: float
    band_factor: float

    def half_width(self, predicted: np.ndarray) -> np.ndarray:
        """Half-widths (n,) of the error band around predictions (n,)."""
        return self.band_factor * np.sqrt(self.constant_error**2 + (self.prediction_share * predicted) ** 2)


def error_model(residuals: np.ndarray, predicted: np.ndarray) -> ErrorModel:
    """Error model fitted to residuals (n,) of predictions (n,), preferably from stretches that were not used in the
    fit. Squared residuals are regressed on squared predictions, with both coefficients at least 0."""
    from scipy.optimize import nnls

    squares = np.column_stack([np.ones(len(predicted)), predicted**2])
    sizes = np.abs(squares).mean(axis=0)
    (base, share), _ = nnls(squares / sizes, residuals**2)
    model = ErrorModel(float(np.sqrt(base / sizes[0])), float(np.sqrt(share / sizes[1])), 1.0)
    size = model.half_width(predicted)
    floor = 1e-12 * float(np.abs(residuals).max() or 1.0)
    return ErrorModel(
        model.constant_error,
        model.prediction_share,
        float(np.quantile(np.abs(residuals) / np.maximum(size, floor), SHARE_INSIDE_BAND)),
    )


@dataclass(frozen=True, eq=False)
class ErrorBands:
    """Predictions with error bands: predicted and half_width (channels, n), at the times of the problem's clock."""

    problem: IdentificationProblem
    predicted: np.ndarray
    half_width: np.ndarray

    def share_inside(self) -> np.ndarray:
        """Share (channels,) of the measured samples that lie inside the band."""
        return self._mean_over_samples(np.abs(self._error()) <= self.half_width)

    def error_rms(self) -> np.ndarray:
        """Root mean square (channels,) of the prediction error."""
        return np.sqrt(self._mean_over_samples(self._error() ** 2))

    def relative_error(self) -> np.ndarray:
        """Ratio (channels,) of the rms prediction error to the root mean square of the measurement."""
        return self.error_rms() / np.array([channel.size for channel in self.problem.channels])

    def relative_width(self) -> np.ndarray:
        """Ratio (channels,) of the band's mean half-width to the rms prediction error."""
        return self._mean_over_samples(self.half_width) / self.error_rms()

    def _error(self) -> np.ndarray:
        """Prediction less measurement (channels, n)."""
        return self.predicted - np.array([channel.values for channel in self.problem.channels])

    def _mean_over_samples(self, sample_values: np.ndarray) -> np.ndarray:
        """Means (channels,) over the measured samples that count."""
        used = [channel.is_used for channel in self.problem.channels]
        return np.array(
            [row[counts_in_channel].mean() for row, counts_in_channel in zip(sample_values, used, strict=True)]
        )


def error_bands(
    identification_problem: IdentificationProblem, uncertainty: Uncertainty, error_models: list[ErrorModel]
) -> ErrorBands:
    """Error bands for a stretch of measurement; ``identification_problem`` is the fit's problem with the inputs and the
    measurement of that stretch."""
    values = uncertainty.fit.values
    predicted = identification_problem.predicted(values)
    slopes = identification_problem.jacobian(values, identification_problem.predicted)
    variance = np.einsum("cnp,pq,cnq->cn", slopes, uncertainty.covariance, slopes)
    model_half_widths = np.array([model.half_width(row) for model, row in zip(error_models, predicted, strict=True)])
    return ErrorBands(
        identification_problem,
        predicted,
        np.sqrt(model_half_widths**2 + NORMAL_QUANTILE**2 * np.clip(variance, 0.0, None)),
    )
