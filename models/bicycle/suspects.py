"""Which suspected parameters of a bicycle's control explain measured weave eigenvalues, by a choice of subsets
(``identification.subsets``).

The least squares are those of the means over windows. The weave's two parts err with the covariance of single windows:
more of them do not help, for they share what the fitted shape does wrong (a trend beside the constant moves all of a
speed by more than they scatter). The speed sensor errs by what a line through its means leaves.
"""

from collections.abc import Sequence

import numpy as np

from models.bicycle.weave import WeaveObservation
from models.bicycle.whipple import SteeringControl, Whipple
from models.core.errors import InputError
from models.identification.subsets import CandidateParameter, SubsetChoice
from models.identification.subsets import ranked_subsets as chosen_of

SUSPECTED_PARAMETERS = {
    "friction": CandidateParameter(0.1, lower_bound=0.0),
    "dry_friction": CandidateParameter(0.1, lower_bound=0.0),
    "torque_gain": CandidateParameter(1.0),
    "encoder_gain": CandidateParameter(1.0),
    "speed_gain": CandidateParameter(1.0),
    "speed_bias": CandidateParameter(0.0),
}
"""Parameters of a bicycle's control that may explain a deviation from measurement, keys of ``SteeringControl``."""
FRICTION_SETS = {"friction of either kind": ("friction", "dry_friction")}
UNIT_OF_SUSPECT = {"friction": "N m s/rad", "dry_friction": "N m", "speed_bias": "m/s"}
EIGENVALUE_WITHOUT_WEAVE = -20.0 + 0.0j
"""Eigenvalue (1/s) that replaces the weave of a model whose weave does not oscillate."""


def predicted_weave(bicycle: Whipple, control: SteeringControl, observation: WeaveObservation) -> np.ndarray:
    """Prediction (3,) of a bicycle model at a measured speed: real and imaginary part of the weave eigenvalue (1/s),
    and measured speed (m/s).
    """
    weave = bicycle.weave(observation.speed, control.viscous(float(observation.inverse_steer_rate.mean())))
    weave = weave if np.isfinite(weave) else EIGENVALUE_WITHOUT_WEAVE
    return np.array([weave.real, weave.imag, control.speed_gain * observation.speed + control.speed_bias])


def ranked_suspects(
    bicycle: Whipple,
    base_control: SteeringControl,
    observations: Sequence[WeaveObservation],
    parameter_names: Sequence[str] = tuple(SUSPECTED_PARAMETERS),
) -> SubsetChoice:
    """Fits of every subset of the suspected control parameters, ranked; InputError for fewer than two speeds, or an
    unknown name.
    """
    for name in parameter_names:
        if name not in SUSPECTED_PARAMETERS:
            raise InputError("", "suspects", name, "no such suspect", tuple(SUSPECTED_PARAMETERS))
    if len(observations) < 2:
        raise InputError("", "speeds", len(observations), "a choice of suspects needs two speeds or more")
    sensor = _sensor_error(observations)
    weights = [_whitening_matrix(observation, sensor) for observation in observations]

    def left(parameter_values: dict[str, float]) -> np.ndarray:
        control = base_control.model_copy(update=parameter_values)
        return np.concatenate(
            [w @ (o.mean - predicted_weave(bicycle, control, o)) for w, o in zip(weights, observations, strict=True)]
        )

    return chosen_of(left, {name: SUSPECTED_PARAMETERS[name] for name in parameter_names}, FRICTION_SETS)


def averaged_weave(
    bicycle: Whipple, base_control: SteeringControl, subset_choice: SubsetChoice, observation: WeaveObservation
) -> tuple[np.ndarray, np.ndarray]:
    """Real and imaginary part (2,) of the weave eigenvalue (1/s), averaged over all subsets of parameters with their
    weights, and their standard deviations (2,).
    """
    return subset_choice.forecast(
        lambda values: predicted_weave(bicycle, base_control.model_copy(update=values), observation)[:2]
    )


def forecast_deviations(
    bicycle: Whipple, base_control: SteeringControl, subset_choice: SubsetChoice, observation: WeaveObservation
) -> np.ndarray:
    """Forecast less measured real and imaginary part of the weave (2,), divided by the standard deviation of
    measurement and forecast together.
    """
    mean, deviation = averaged_weave(bicycle, base_control, subset_choice, observation)
    return np.asarray((mean - observation.mean[:2]) / np.hypot(observation.deviation[:2], deviation))


def _sensor_error(observations: Sequence[WeaveObservation]) -> float:
    """Standard deviation (m/s) of the speed sensor's means about a fitted line; 0 for two speeds, which any line
    fits.
    """
    if len(observations) < 3:
        return 0.0
    speeds, means = np.array([(o.speed, o.mean[2]) for o in observations]).T
    left = means - np.polyval(np.polyfit(speeds, means, 1), speeds)
    return float(np.sqrt(np.sum(left**2) / (len(observations) - 2)))


def _whitening_matrix(observation: WeaveObservation, sensor_error: float) -> np.ndarray:
    """Matrix (3, 3) that maps deviations from the prediction to independent standard normal ones; the error of the
    speed sensor counts as independent.
    """
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.cov(observation.parts[:, :2].T)
    covariance[2, 2] = observation.deviation[2] ** 2 / len(observation.weave) + sensor_error**2
    return np.linalg.inv(np.linalg.cholesky(covariance))
