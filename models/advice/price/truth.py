"""The true value of a scene's quantity: a reference that is refined until the change is small beside the tolerance,
with its uncertainty.
"""

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from models.advice.price import PricedRun, PricedScene, SettingLadder
from models.advice.price.problem import Setting
from models.core.assumptions import BrokenAssumption, collected_broken_assumptions
from models.core.errors import InputError, RunFailed
from models.ensemble.runner import block_results

AGREEMENT_TOLERANCE_DIVISOR = 4.0
"""Divisor of the tolerance that gives the largest difference allowed between the reference and a solver of another
family.
"""
ROW_TIME_ROUNDING = 1e-3
"""Distance from an output time, as a share of the output step, up to which a time counts as this output time."""
OUTPUT_ROW_LIMIT = 4_000_000
"""Largest number of output rows of a reference run; more would take gigabytes."""


@dataclass(frozen=True)
class ReferenceSolution:
    """The quantity along the reference run, taken as the truth. uncertainty : in the unit of the quantity; origin :
    text on its origin; rung : of the reference's ladder; kink_period : s between kinks of the quantity, 0 where there
    are none; seconds : of the processor that it took, a guide to how long to wait and no price; broken_assumptions :
    assumptions that the reference breaks, as every correct setting does.
    """

    run: PricedRun
    uncertainty: float
    origin: str
    rung: int
    kink_period: float = 0.0
    seconds: float = 0.0
    broken_assumptions: tuple[BrokenAssumption, ...] = ()

    def newly_broken(self, broken: Mapping[str, BrokenAssumption]) -> list[BrokenAssumption]:
        """Assumptions among ``broken`` that the reference keeps."""
        known = {assumption.name for assumption in self.broken_assumptions}
        return [assumption for name, assumption in broken.items() if name not in known]

    def error(self, other_run: PricedRun) -> float:
        """Largest difference of a run from the truth, at the run's output times; infinite if the run is not finite."""
        if not np.isfinite(other_run.values).all():
            return float("inf")
        return float(np.abs(other_run.values - values_at(self.run, other_run.times, self.kink_period)).max())

    @property
    def size(self) -> float:
        """Largest magnitude of the quantity over the reference run."""
        return float(np.abs(self.run.values).max())


def values_at(priced_run: PricedRun, times: np.ndarray, kink_period: float = 0.0) -> np.ndarray:
    """Values (m, k) of a run at ``times`` (m,) in s: its output rows where the times coincide, else cubic interpolation
    in four rows within one kink period.
    """
    last_row = len(priced_run.times) - 1
    step = float(priced_run.times[-1]) / last_row
    row_position = times / step
    index = np.rint(row_position).astype(int)
    if np.abs(row_position - index).max() < ROW_TIME_ROUNDING:
        return priced_run.values[np.minimum(index, last_row)]
    rows = max(3, round(kink_period / step)) if kink_period else last_row
    first_row = np.minimum((row_position + ROW_TIME_ROUNDING) // rows * rows, last_row - 3).astype(int)
    left = np.clip(np.floor(row_position).astype(int) - 1, first_row, np.minimum(first_row + rows, last_row) - 3)
    s = row_position - left
    weights = (
        -(s - 1) * (s - 2) * (s - 3) / 6,
        s * (s - 2) * (s - 3) / 2,
        -s * (s - 1) * (s - 3) / 2,
        s * (s - 1) * (s - 2) / 6,
    )
    return sum((w[:, None] * priced_run.values[left + i] for i, w in enumerate(weights)), np.zeros((1, 1)))


def refined_reference(
    scene: PricedScene,
    tolerance: float,
    duration: float,
    first_rung: int = 0,
    second_method: bool = True,
    executor: Executor | None = None,
) -> ReferenceSolution:
    """The truth of a scene's quantity over ``duration`` (s), as exact as the ladder's divisor of ``tolerance`` asks;
    ``second_method`` : whether another family of methods must confirm it.

    executor : computes the first two settings of the reference at the same time, since fewer are never enough.

    InputError where this uncertainty cannot be reached, RunFailed where two families of solvers differ or no run
    ends.
    """
    ladder = scene.reference_ladder()
    settled, first_rung, change, seconds, broken = _settled_answer(
        scene, ladder, tolerance, duration, first_rung, executor
    )
    change_text = _setting_text(ladder.setting(first_rung))
    second_setting = scene.second_setting(ladder.setting(first_rung)) if second_method else None
    finer = "half the cells and a longer step change it by" if ladder.cells else "halving its step changes"
    finer = ladder.change_text or finer
    truth_of_halving = ReferenceSolution(
        settled, change, f"{change_text}; {finer}", first_rung, scene.kink_period, seconds, tuple(broken.values())
    )
    if second_setting is None:
        return truth_of_halving
    differs = truth_of_halving.error(scene.priced_run(scene.solve(second_setting, duration)))
    both_settings = f"{change_text} and {_setting_text(second_setting)}"
    if differs > tolerance / AGREEMENT_TOLERANCE_DIVISOR:
        raise RunFailed(
            "reference", f"{both_settings} differ by {differs:.3g} {scene.unit}: the tolerance cannot be judged"
        )
    return replace(truth_of_halving, uncertainty=max(change, differs), origin=f"{both_settings}, which differ by")


def _change_by_halving(scene: PricedScene, coarser_run: PricedRun, finer_run: PricedRun) -> float:
    """Largest difference between two runs, the second with half the step, at the output rows of both; the coarser run
    is interpolated between its rows.
    """
    run_pairs = ((finer_run, coarser_run), (coarser_run, finer_run))
    return max(ReferenceSolution(run, 0.0, "", 0, scene.kink_period).error(other_run) for run, other_run in run_pairs)


def _setting_text(setting: Setting) -> str:
    return f"{setting.engine} {setting.method} at {setting.label()}"


class _RungOutcome(NamedTuple):
    """Outcome of the reference on one rung of its ladder: the run, None where it failed; the reason for that; processor
    seconds; assumptions that it broke.
    """

    run: PricedRun | None
    failure: str
    seconds: float
    broken_assumptions: dict[str, BrokenAssumption]


def _reference_on_rung(scene: PricedScene, duration: float, setting: Setting) -> _RungOutcome:
    """Run the reference with one setting over ``duration`` (s); a failure is part of the outcome."""
    start_time = time.process_time()
    with collected_broken_assumptions() as broken:
        try:
            run = scene.priced_run(scene.solve(setting, duration))
        except (InputError, RunFailed) as error:
            return _RungOutcome(None, str(error), 0.0, broken)
    return _RungOutcome(run, "", time.process_time() - start_time, broken)


def _settled_answer(
    scene: PricedScene,
    ladder: SettingLadder,
    tolerance: float,
    duration: float,
    first_rung: int,
    executor: Executor | None,
) -> tuple[PricedRun, int, float, float, dict[str, BrokenAssumption]]:
    """The first reference run that changes from the previous rung by no more than a fraction of the tolerance; with its
    rung, the change, the processor seconds and the assumptions that it broke.
    """
    coarser_run: PricedRun | None = None
    change, failure = float("inf"), ""
    rungs = [i for i in range(first_rung, len(ladder.values)) if duration / ladder.values[i] <= OUTPUT_ROW_LIMIT]
    job = partial(_reference_on_rung, scene, duration)
    together = [ladder.setting(i) for i in rungs[:2]] if executor is not None else []
    ready = dict(zip(rungs, block_results(job, together, executor), strict=False))
    for i in rungs:
        finer_run, failed, seconds, broken = ready.pop(i, None) or job(ladder.setting(i))
        if finer_run is None:
            coarser_run, failure = None, failed
            continue
        if coarser_run is not None:
            last_change, change = change, _change_by_halving(scene, coarser_run, finer_run)
            if change <= tolerance / ladder.confirmation_divisor:
                return finer_run, i, change, seconds, broken
            if change > 0.7 * last_change and change < 1e-6 * float(np.abs(finer_run.values).max()):
                break  # rounding: finer steps no longer help
        coarser_run = finer_run
    if coarser_run is None:
        raise RunFailed("reference", failure or "no step is fine enough")
    least_tolerance = f"{ladder.confirmation_divisor * change:.2g} {scene.unit}"
    allowed = f"is finer than the scene's own reference can be known here: at least {least_tolerance}"
    raise InputError("--tolerance", "", tolerance, allowed)
