"""Quantities of a simulation run as numbers by which two runs can be compared, and the cost of the run."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from models.core.errors import InputError

CaseValues = tuple[np.ndarray, ...]
"""One quantity in every case of a scene (procedure, manoeuvre, speed, creepage): its time history (n,), or a single
number (1,).
"""
SMALLEST_CASE_SHARE = 1e-3
"""Smallest size of a case as a share of the largest case's: changes of smaller cases are divided by this size."""
ROUNDING_SHARE, ABSOLUTE_ROUNDING = 1e-10, 1e-15
"""Rounding limits: a share of the largest value in the same unit, and a value in SI units. Smaller changes are only
rounding.
"""
SCALAR_OF_TIME_HISTORY = {"rms": lambda path: np.sqrt(np.mean(path**2)), "max": lambda path: np.abs(path).max()}
"""Functions that make one number of a time history, by the word that asks for them, as in "rms f1"."""


@dataclass(frozen=True)
class Quantity:
    """A quantity's unit, and its values in every case of the run (procedure, manoeuvre, speed, creepage).

    is_mean_of_samples : each case holds mean squares (m,) of independent samples; the quantity is the root of their
    mean.
    """

    unit: str
    case_values: CaseValues
    is_mean_of_samples: bool = False

    @property
    def reference_sizes(self) -> np.ndarray:
        """Reference sizes of the quantity, one for each case; changes are divided by them."""
        return (
            np.sqrt([case.mean() for case in self.case_values])
            if self.is_mean_of_samples
            else reference_sizes_of_cases(self.case_values)
        )


@dataclass(frozen=True)
class RunQuantities:
    """Quantities of a run by name, CPU seconds of the time integration alone, and counts that repeat exactly: "steps",
    "calls" of the right-hand side, "states", and "terms", where a call evaluates further terms (cells of contact
    patches, waves of roads).
    """

    quantities: dict[str, Quantity]
    counts: dict[str, int]
    seconds: float = field(compare=False)

    def quantity(self, quantity_name: str, scene_path: str = "") -> Quantity:
        """A quantity by its name, or the "rms" or "max" of one; InputError for an unknown name."""
        if quantity_name in self.quantities:
            return self.quantities[quantity_name]
        word, _, base_name = quantity_name.partition(" ")
        path = self.quantities.get(base_name)
        if word in SCALAR_OF_TIME_HISTORY and path is not None and not path.is_mean_of_samples:
            return Quantity(
                path.unit, tuple(np.array([SCALAR_OF_TIME_HISTORY[word](case)]) for case in path.case_values)
            )
        allowed = (
            "no such quantity in this scene, whose own are, each also with 'rms' or 'max' before it if it is a path"
        )
        raise InputError(scene_path, "quantities", quantity_name, allowed, tuple(self.quantities))


def reference_sizes_of_cases(case_values: Sequence[np.ndarray]) -> np.ndarray:
    """Reference sizes by which changes are divided, one for each case: the standard deviation of a time history, the
    magnitude of a single number.

    A case that hardly moves compared with the others has at least the size SMALLEST_CASE_SHARE times the largest one.
    """
    amounts = np.array([np.std(case) if len(case) > 1 else abs(float(case[0])) for case in case_values])
    return np.maximum(amounts, SMALLEST_CASE_SHARE * amounts.max(initial=0.0))


def rounding_floor(run_quantities: RunQuantities, unit: str) -> float:
    """Size below which changes of quantities with this unit are only rounding."""
    sizes = [
        np.sqrt(case.max()) if quantity.is_mean_of_samples else abs(case).max(initial=0.0)
        for quantity in run_quantities.quantities.values()
        if quantity.unit == unit
        for case in quantity.case_values
    ]
    return max(ABSOLUTE_ROUNDING, ROUNDING_SHARE * float(max(sizes, default=0.0)))


CONFIDENCE_PROBABILITY = 0.9985
"""One-sided probability of Student's t for statistical errors: on either side, chance adds more than the stated error
in 0.15 % of the cases.
"""


def sampled_change_and_error(differences: CaseValues, full_scene_values: CaseValues) -> tuple[float, float]:
    """Largest relative change among the cases of a quantity that is a root mean square of samples, and the statistical
    error of this change.

    The ratio of two means over m samples that met the same roads, and its standard error by what each sample differs
    from it, times Student's t for m - 1.
    """
    worst = 0.0, 0.0
    for difference, unmoved in zip(differences, full_scene_values, strict=True):
        ratio = 1.0 + difference.mean() / unmoved.mean()
        if not ratio > 0.0:  # nothing is left, or no mean square at all
            return (1.0, 0.0) if not (difference + unmoved).any() else (np.inf, np.inf)
        residual, m = difference - (ratio - 1.0) * unmoved, len(unmoved)
        error = (
            float(stdtrit(m - 1, CONFIDENCE_PROBABILITY))
            * residual.std(ddof=1)
            / (np.sqrt(m) * unmoved.mean())
            / (2.0 * np.sqrt(ratio))
        )
        worst = max(worst, (float(abs(np.sqrt(ratio) - 1.0)), float(error)), key=sum)
    return worst


def difference_of_runs(changed_run_values: CaseValues, full_scene_values: CaseValues) -> CaseValues:
    """Differences of two runs, case by case, at the output times of the run with longer steps.

    Raises InputError where the runs have no common times, as those that end by themselves.
    """
    for shorter_run, longer_run in (
        sorted(map(len, pair)) for pair in zip(changed_run_values, full_scene_values, strict=True)
    ):
        if shorter_run != longer_run and (shorter_run < 2 or (longer_run - 1) % (shorter_run - 1)):
            raise InputError(
                "",
                "quantities",
                None,
                "paths of runs that end by themselves cannot be compared: ask for "
                "'rms' or 'max' of them, or for another number",
            )
    return tuple(
        np.subtract(*_at_common_times(*pair)) for pair in zip(changed_run_values, full_scene_values, strict=True)
    )


def _at_common_times(*time_histories: np.ndarray) -> list[np.ndarray]:
    """Time histories thinned to the output times that all of them have."""
    row_count = min(map(len, time_histories))
    return [path[:: (len(path) - 1) // max(row_count - 1, 1) or 1] for path in time_histories]


def sum_of_differences(*differences: CaseValues) -> CaseValues:
    """Sum of several differences of runs, case by case, at the output times that all of them have."""
    return tuple(np.sum(_at_common_times(*parts), axis=0) for parts in zip(*differences, strict=True))


def largest_relative_change(differences: CaseValues, reference_sizes: np.ndarray) -> float:
    """Largest relative change among the cases: the rms difference of a time history, or the difference of a single
    number, divided by the case's reference size.
    """
    largest_differences = np.array([float(np.sqrt(np.mean(difference**2))) for difference in differences])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(
            reference_sizes > 0.0,
            largest_differences / reference_sizes,
            np.where(largest_differences > 0.0, np.inf, 0.0),
        )
    return float(share.max()) if np.isfinite(largest_differences).all() else np.inf
