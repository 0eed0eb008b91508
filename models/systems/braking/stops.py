"""Ensembles of stops with scattered initial speeds, their statistics and tests, as anti-lock stops on ice do not
repeat.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from models.core.discretisation import Estimate, sampling_error
from models.core.errors import RunFailed
from models.core.noise import SPEED, normal_samples
from models.ensemble.runner import PathFailed
from models.systems.braking.run import run
from models.systems.braking.scene import BrakingScene, build
from models.systems.braking.stop_report import StopHistory

SAVED_QUANTITIES = {
    "distance": "stopping distance [m]",
    "time": "stopping time [s]",
    "deceleration": "v0/T [m/s^2]",
    "aside": "y [m]",
    "yaw": "final yaw [deg]",
}
"""Quantities of every stop that an ensemble stores: array name -> name in ``Stop.vehicle_results``."""
COURSE_REFERENCE_SIZES = {"aside": 1.0, "yaw": 5.0}
"""Least size (m, deg) by which the standard error of a mean deviation from the course is divided."""


@dataclass(frozen=True)
class StopEnsemble:
    """Ensemble of stops of a procedure: stop i begins at the procedure's speed times (1 + spread e_i), where e_i is
    standard normal and depends on the seed and i alone. ``table`` : the scene's tables.
    """

    table: Mapping[str, Any]
    file: str
    folder: str
    procedure: str
    spread: float
    seed: int

    def __call__(self, paths: range) -> dict[str, np.ndarray]:
        """Runs the stops with these numbers. Returns SAVED_QUANTITIES and the initial speed (m/s) as arrays
        (len(paths),) by name.
        """
        scene = build(self.table, self.file, Path(self.folder))
        rows = [self._quantities_of_stop(scene, number) for number in paths]
        kept_keys = {**SAVED_QUANTITIES, "speed": "initial speed [m/s]"}
        return {name: np.array([row[key] for row in rows]) for name, key in kept_keys.items()}

    def facts(self) -> dict[str, Any]:
        """Returns everything on which the ensemble's results depend."""
        return {
            "scene": str(sorted(self.table.items())),
            "procedure": self.procedure,
            "spread": self.spread,
            "seed": self.seed,
        }

    def _quantities_of_stop(self, scene: BrakingScene, stop_number: int) -> dict[str, float]:
        procedure = scene.procedures[self.procedure]
        drawn = float(normal_samples(self.seed, stop_number, 1, 1, noise_source=SPEED)[0, 0])
        changed = procedure.model_copy(update={"speed": procedure.speed * (1.0 + self.spread * drawn)})
        scene = scene.model_copy(update={"procedures": {**scene.procedures, self.procedure: changed}})
        try:
            path = run(scene, procedure=self.procedure).detail
        except RunFailed as error:
            raise PathFailed(stop_number, str(error)) from None
        if not path.ended_at_rest:
            raise PathFailed(stop_number, f"does not stand after {scene.run.duration:g} s")
        return StopHistory(path).vehicle_results()


@dataclass(frozen=True)
class SampleScatter:
    """Number, mean and standard deviation of a sample of values."""

    count: int
    mean: float
    deviation: float

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        return self.deviation / sqrt(self.count)


def scatter_of(sample_values: np.ndarray) -> SampleScatter:
    """Count, mean and standard deviation of values (n,), n at least 2."""
    return SampleScatter(sample_values.size, float(sample_values.mean()), float(sample_values.std(ddof=1)))


def statistical_errors(scatters: Mapping[str, SampleScatter]) -> dict[str, Estimate]:
    """Statistical errors of the means of an ensemble, by quantity. Relative errors refer to the mean, or to
    COURSE_REFERENCE_SIZES where the mean is smaller.
    """
    units = {key: label.partition("[")[2][:-1] for key, label in SAVED_QUANTITIES.items()}
    return {
        key: sampling_error(
            scatter.error, max(abs(scatter.mean), COURSE_REFERENCE_SIZES.get(key, 0.0)), units[key], scatter.count
        )
        for key, scatter in scatters.items()
        if key in units
    }


@dataclass(frozen=True)
class WelchResult:
    """Result of Welch's test: difference of two means (second less first), half width of its 95 % interval, statistic
    t, degrees of freedom, two-sided p.
    """

    difference: float
    half_width: float
    t: float
    freedoms: float
    p_value: float


def welch_test(first_scatter: SampleScatter, second_scatter: SampleScatter) -> WelchResult:
    """Welch's test for the difference of two means with different variances; B. L. Welch, Biometrika 34 (1947)."""
    from scipy.stats import t as student

    a, b = first_scatter.error**2, second_scatter.error**2
    gap, error = second_scatter.mean - first_scatter.mean, sqrt(a + b)
    if error == 0.0:
        return WelchResult(gap, 0.0, 0.0 if gap == 0.0 else np.copysign(np.inf, gap), np.inf, float(gap == 0.0))
    freedoms = (a + b) ** 2 / (a**2 / (first_scatter.count - 1) + b**2 / (second_scatter.count - 1))
    t = gap / error
    half, p = student.ppf(0.975, freedoms) * error, 2.0 * student.sf(abs(t), freedoms)
    return WelchResult(gap, float(half), t, freedoms, float(p))
