"""Results of any scene as numbers by which two runs can be compared, and the cost of the run."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from models.core.errors import InputError

Cases = tuple[np.ndarray, ...]
"""One quantity in every case of a scene (procedure, manoeuvre, speed, creepage): its path (n,), or one number (1,)."""
SMALLEST_CASE_SHARE = 1e-3
"""Of the largest case: changes of a smaller one are relative to this share."""
ROUNDING_SHARE, ABSOLUTE_ROUNDING = 1e-10, 1e-15
"""Of the largest value in a unit, and in SI units: what moves less does not move at all, but for rounding."""
SCALAR_OF_PATH = {"rms": lambda path: np.sqrt(np.mean(path**2)), "max": lambda path: np.abs(path).max()}
"""Words that make a number of a path, as in "rms f1"."""


@dataclass(frozen=True)
class Quantity:
    """A quantity's unit, and its values in every case (a run, or a part of it).

    sampled : each case holds mean squares (m,) of independent samples; the quantity is the root of their mean.
    """

    unit: str
    cases: Cases
    sampled: bool = False

    @property
    def sizes(self) -> np.ndarray:
        """Sizes by which changes of the quantity are divided, one for each case."""
        return np.sqrt([case.mean() for case in self.cases]) if self.sampled else scale_of_cases(self.cases)


@dataclass(frozen=True)
class RunQuantities:
    """Quantities of a run by name, CPU seconds of the march alone, and counts that repeat exactly: "steps", "calls" of
    the right-hand side, "states", and "terms", where a call evaluates any besides these (cells of contact patches,
    waves of roads).
    """

    quantities: dict[str, Quantity]
    counts: dict[str, int]
    seconds: float = field(compare=False)

    def of(self, name: str, file: str = "") -> Quantity:
        """A quantity by its name, or the "rms" or "max" of one; InputError for an unknown name."""
        if name in self.quantities:
            return self.quantities[name]
        word, _, base_name = name.partition(" ")
        path = self.quantities.get(base_name)
        if word in SCALAR_OF_PATH and path is not None and not path.sampled:
            return Quantity(path.unit, tuple(np.array([SCALAR_OF_PATH[word](case)]) for case in path.cases))
        allowed = (
            "no such quantity in this scene, whose own are, each also with 'rms' or 'max' before it if it is a path"
        )
        raise InputError(file, "quantities", name, allowed, tuple(self.quantities))


def scale_of_cases(full_results: Sequence[np.ndarray]) -> np.ndarray:
    """Sizes by which changes are divided, one for each case: the standard deviation of a path, the magnitude of a
    number.

    A case that hardly moves compared with the others has at least the size SMALLEST_CASE_SHARE times the largest one.
    """
    amounts = np.array([np.std(case) if len(case) > 1 else abs(float(case[0])) for case in full_results])
    return np.maximum(amounts, SMALLEST_CASE_SHARE * amounts.max(initial=0.0))


def rounding_floor(run_quantities: RunQuantities, unit: str) -> float:
    """Size below which changes of quantities with this unit are only rounding."""
    sizes = [
        np.sqrt(case.max()) if quantity.sampled else abs(case).max(initial=0.0)
        for quantity in run_quantities.quantities.values()
        if quantity.unit == unit
        for case in quantity.cases
    ]
    return max(ABSOLUTE_ROUNDING, ROUNDING_SHARE * float(max(sizes, default=0.0)))


CONFIDENCE_PROBABILITY = 0.9985
"""Probability that chance adds no more to either side than is said of it."""


def by_chance(differences: Cases, full_results: Cases) -> tuple[float, float]:
    """Largest relative change of a sampled quantity, and the statistical error of this change.

    The ratio of two means over m samples that met the same roads, and its standard error by what each sample differs
    from it, times Student's t for m - 1.
    """
    worst = 0.0, 0.0
    for difference, unmoved in zip(differences, full_results, strict=True):
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


def difference_of_runs(run: Cases, full_results: Cases) -> Cases:
    """Differences of two runs at the times that both have, which are those of the run with longer steps.

    Raises InputError where the runs have no common times, as those that end by themselves.
    """
    for shorter_run, longer_run in (sorted(map(len, pair)) for pair in zip(run, full_results, strict=True)):
        if shorter_run != longer_run and (shorter_run < 2 or (longer_run - 1) % (shorter_run - 1)):
            raise InputError(
                "",
                "quantities",
                None,
                "paths of runs that end by themselves cannot be compared: ask for "
                "'rms' or 'max' of them, or for another number",
            )
    return tuple(np.subtract(*_at_common_times(*pair)) for pair in zip(run, full_results, strict=True))


def _at_common_times(*paths: np.ndarray) -> list[np.ndarray]:
    """The paths at those times that all of them have."""
    row_count = min(map(len, paths))
    return [path[:: (len(path) - 1) // max(row_count - 1, 1) or 1] for path in paths]


def sum_of_differences(*changes: Cases) -> Cases:
    """Sum of several differences, at those times that all of them have."""
    return tuple(np.sum(_at_common_times(*parts), axis=0) for parts in zip(*changes, strict=True))


def largest_relative_change(differences: Cases, full_size: np.ndarray) -> float:
    """Largest relative change among the cases: the rms difference of a path, or the difference of a number, divided by
    its size.
    """
    largest_differences = np.array([float(np.sqrt(np.mean(difference**2))) for difference in differences])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(
            full_size > 0.0, largest_differences / full_size, np.where(largest_differences > 0.0, np.inf, 0.0)
        )
    return float(share.max()) if np.isfinite(largest_differences).all() else np.inf
