"""Which suspects measured weave eigenvalues call for: every subset fitted, judged by an information criterion.

The least squares are those of the means over windows. The weave's two parts err with the covariance of single windows:
more of them do not help, for they share what the fitted shape does wrong (a trend beside the constant moves all of a
speed by more than they scatter). The speed sensor errs by what a line through its means leaves. The criterion is that
of quasi-likelihood (Burnham and Anderson, Model selection, 2002, ch. 2.5): the sum of squares by the inflation that the
fullest subset leaves, c = chi^2 / degrees of freedom, at least 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f as f_distribution

from models.bicycle.weave import Observation
from models.bicycle.whipple import Control, Whipple
from models.core.errors import InputError

NEUTRAL = {
    "friction": 0.0,
    "dry_friction": 0.0,
    "torque_gain": 1.0,
    "encoder_gain": 1.0,
    "speed_gain": 1.0,
    "speed_bias": 0.0,
}
"""Value of each suspect where it is absent."""
SCALE = {"friction": 0.1, "dry_friction": 0.1}
"""Steps of the fit; 0.1 for all."""
FRICTIONS = ("friction", "dry_friction")
UNITS = {"friction": "N m s/rad", "dry_friction": "N m", "speed_bias": "m/s"}
NO_WEAVE = -20.0 + 0.0j
"""Stands for a weave (1/s) that does not swing at all."""
PARTS = 3
"""Of each observation: real and imaginary part of the weave, measured speed."""
BLIND = 1e-6
"""Share of the largest singular value of the fit's sensitivities below which a combination is not determined."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Suspects (k,) of a subset with their values and covariance (k, k), chi^2 and how many numbers were fitted.

    undetermined : of those that the data do not tell: names of suspects that no number depends on, or sums of them.
    """

    names: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray
    chi2: float
    count: int
    undetermined: tuple[str, ...]

    @property
    def rank(self) -> int:
        """How many parameters the data determine."""
        return len(self.names) - len(self.undetermined)

    @property
    def freedoms(self) -> int:
        """Numbers less parameters that they determine."""
        return self.count - self.rank

    def control(self, base: Control) -> Control:
        """The control with these values."""
        return base.model_copy(update=dict(zip(self.names, self.values.tolist(), strict=True)))

    def criterion(self, inflation: float) -> float:
        """Quasi-likelihood information criterion with the correction for few numbers."""
        k = self.rank + 1
        return self.chi2 / inflation + 2.0 * k + 2.0 * k * (k + 1) / max(self.count - k - 1, 1)


@dataclass(frozen=True, eq=False)
class Choice:
    """All subsets by rising criterion, their weights (probabilities among them), the inflation c of chi^2.

    calls : of each suspect (F, p) of leaving it out of the fullest subset that can be told apart; blind : suspects on
    which no measured number depends.
    """

    fits: list[Fit]
    criteria: np.ndarray
    weights: np.ndarray
    inflation: float
    calls: dict[str, tuple[float, float]]
    blind: tuple[str, ...]

    @property
    def best(self) -> Fit:
        """The subset of the least criterion."""
        return self.fits[0]

    def importance(self, name: str) -> float:
        """Summed weight of all subsets that have the suspect."""
        return float(sum(w for fit, w in zip(self.fits, self.weights, strict=True) if name in fit.names))


def predicted(bicycle: Whipple, control: Control, seen: Observation) -> np.ndarray:
    """(3,): real and imaginary part of the weave (1/s) and measured speed (m/s) of a model at a speed."""
    weave = bicycle.weave(seen.speed, control.viscous(float(seen.slowness.mean())))
    weave = weave if np.isfinite(weave) else NO_WEAVE
    return np.array([weave.real, weave.imag, control.speed_gain * seen.speed + control.speed_bias])


def fitted(bicycle: Whipple, base: Control, seen: Sequence[Observation], names: tuple[str, ...]) -> Fit:
    """The suspects ``names`` fitted to observations, all others as in ``base``."""
    sensor = _sensor_error(seen)
    weights = [_whitener(observation, sensor) for observation in seen]

    def left(values: np.ndarray) -> np.ndarray:
        control = base.model_copy(update=dict(zip(names, values.tolist(), strict=True)))
        return np.concatenate(
            [w @ (o.mean - predicted(bicycle, control, o)) for w, o in zip(weights, seen, strict=True)]
        )

    start = np.array([NEUTRAL[name] for name in names])
    if not names:
        return Fit((), start, np.empty((0, 0)), float(np.sum(left(start) ** 2)), PARTS * len(seen), ())
    lower = [0.0 if name in SCALE else -np.inf for name in names]
    scale = np.array([SCALE.get(name, 0.1) for name in names])
    start = np.maximum(start, [SCALE.get(name, -np.inf) for name in names])
    fit = least_squares(left, start, bounds=(lower, np.inf), x_scale=scale, diff_step=1e-5, method="dogbox")
    _, sizes, rows = np.linalg.svd(fit.jac * scale)
    told = sizes > BLIND * max(sizes.max(initial=0.0), 1e-300)
    covariance = (rows[: len(sizes)][told].T / sizes[told] ** 2) @ rows[: len(sizes)][told] * np.outer(scale, scale)
    undetermined = tuple(_combination(names, row) for row in rows[np.count_nonzero(told) :])
    return Fit(names, fit.x, covariance, float(np.sum(fit.fun**2)), PARTS * len(seen), undetermined)


def chosen(
    bicycle: Whipple, base: Control, seen: Sequence[Observation], suspects: Sequence[str] = tuple(NEUTRAL)
) -> Choice:
    """Every subset of the suspects fitted and judged; InputError for fewer than two speeds, or a name that is none."""
    for name in suspects:
        if name not in NEUTRAL:
            raise InputError("", "suspects", name, "no such suspect", tuple(NEUTRAL))
    if len(seen) < 2:
        raise InputError("", "speeds", len(seen), "a choice of suspects needs two speeds or more")
    everything = fitted(bicycle, base, seen, tuple(suspects))
    blind = tuple(name for name in suspects if name in everything.undetermined)
    told = [name for name in suspects if name not in blind]
    subsets = [names for size in range(len(told) + 1) for names in combinations(told, size)]
    fits = [fitted(bicycle, base, seen, names) for names in subsets]
    determined = [fit for fit in fits if not fit.undetermined and fit.freedoms > 0]
    fullest = max(determined, key=lambda fit: (len(fit.names), -fit.chi2))
    inflation = max(fullest.chi2 / fullest.freedoms, 1.0)
    kept = sorted(determined, key=lambda fit: fit.criterion(inflation))
    criteria = np.array([fit.criterion(inflation) for fit in kept])
    weights = np.exp(-0.5 * (criteria - criteria[0]))
    return Choice(kept, criteria, weights / weights.sum(), inflation, _calls(fits, fullest, inflation), blind)


def _calls(fits: list[Fit], fullest: Fit, inflation: float) -> dict[str, tuple[float, float]]:
    """F and p of leaving each suspect out of the fullest subset, and both kinds of friction together."""
    by_names = {fit.names: fit for fit in fits}
    leaving: dict[str, tuple[str, ...]] = {name: (name,) for name in fullest.names}
    if {*FRICTIONS} <= {*fullest.names}:
        leaving["friction of either kind"] = FRICTIONS
    calls = {}
    for said, gone in leaving.items():
        less = by_names[tuple(name for name in fullest.names if name not in gone)]
        ratio = max(less.chi2 - fullest.chi2, 0.0) / inflation / len(gone)
        calls[said] = (ratio, float(f_distribution.sf(ratio, len(gone), fullest.freedoms)))
    return calls


def _sensor_error(seen: Sequence[Observation]) -> float:
    """Standard deviation (m/s) of the speed sensor's means about their line; 0 for two speeds, which tell none."""
    if len(seen) < 3:
        return 0.0
    speeds, means = np.array([(o.speed, o.mean[2]) for o in seen]).T
    left = means - np.polyval(np.polyfit(speeds, means, 1), speeds)
    return float(np.sqrt(np.sum(left**2) / (len(seen) - 2)))


def _whitener(seen: Observation, sensor: float) -> np.ndarray:
    """(3, 3) that makes deviations into standard normal ones; the speed sensor errs by itself."""
    covariance, count = np.zeros((PARTS, PARTS)), len(seen.weave)
    covariance[:2, :2] = np.cov(seen.parts[:, :2].T)
    covariance[2, 2] = seen.deviation[2] ** 2 / count + sensor**2
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _combination(names: tuple[str, ...], row: np.ndarray) -> str:
    """A combination of suspects in words, those that take part by more than a hundredth."""
    return " with ".join(name for name, part in zip(names, row, strict=True) if abs(part) > 1e-2)


def forecast(bicycle: Whipple, base: Control, choice: Choice, seen: Observation) -> tuple[np.ndarray, np.ndarray]:
    """Damping and frequency (2,) that all subsets predict by their weights, and their standard deviations (2,).

    The variance is that within the subsets and that among them (Burnham and Anderson, ch. 4.3).
    """
    each = [_forecast(bicycle, base, fit, seen) for fit in choice.fits]
    means, variances = (np.array(part) for part in zip(*each, strict=True))
    mean = choice.weights @ means
    variance = choice.weights @ (choice.inflation * variances + (means - mean) ** 2)
    return mean, np.sqrt(variance)


def deviations(bicycle: Whipple, base: Control, choice: Choice, seen: Observation) -> np.ndarray:
    """(2,): forecast less measured damping and frequency in standard deviations, of windows and of the forecast."""
    mean, deviation = forecast(bicycle, base, choice, seen)
    return np.asarray((mean - seen.mean[:2]) / np.hypot(seen.deviation[:2], deviation))


def _forecast(bicycle: Whipple, base: Control, fit: Fit, seen: Observation) -> tuple[np.ndarray, np.ndarray]:
    """Weave (2,) by the values of one subset, and its variances (2,)."""
    here, slopes = predicted(bicycle, fit.control(base), seen)[:2], np.zeros((2, len(fit.names)))
    for i, name in enumerate(fit.names):
        step = 1e-4 * max(abs(fit.values[i]), 0.1)
        moved = fit.control(base).model_copy(update={name: fit.values[i] + step})
        slopes[:, i] = (predicted(bicycle, moved, seen)[:2] - here) / step
    return here, np.einsum("ij,jk,ik->i", slopes, fit.covariance, slopes)
