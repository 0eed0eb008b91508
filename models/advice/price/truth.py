"""The true value of a scene's quantity: a reference refined until it no longer matters, and how well it is known."""

import time
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from models.advice.price import PricedRun, PricedScene, SettingLadder
from models.advice.price.problem import Setting
from models.core.assumptions import BrokenAssumption, collected_breaches
from models.core.errors import InputError, RunFailed
from models.ensemble.runner import block_results

AGREEMENT_FACTOR = 4.0
"""A solver of another family differs by less than this part of the tolerance."""
ROW_TIME_ROUNDING = 1e-3
"""Of a row's spacing: times so near to a row are its own, to the rounding of times."""
MOST_ROWS = 4_000_000
"""Rows of a reference: beyond, it takes gigabytes."""


@dataclass(frozen=True)
class ReferenceTruth:
    """Answer of the reference, taken as the truth. uncertainty : in the unit of the quantity; origin : text on its
    origin;
    rung : of the reference's ladder; kink_period : s between kinks of the quantity, 0 where there are none; seconds :
    of the processor that it took, a guide to how long to wait and no price; broken_assumptions : assumptions that the
    reference breaks, as every correct setting does.
    """

    answer: PricedRun
    uncertainty: float
    origin: str
    rung: int
    kink_period: float = 0.0
    seconds: float = 0.0
    broken_assumptions: tuple[BrokenAssumption, ...] = ()

    def beside(self, broken: Mapping[str, BrokenAssumption]) -> list[BrokenAssumption]:
        """Those of the broken assumptions that the reference keeps."""
        known = {assumption.name for assumption in self.broken_assumptions}
        return [assumption for name, assumption in broken.items() if name not in known]

    def error(self, other_answer: PricedRun) -> float:
        """Largest difference of another answer from the truth, at the other answer's times; infinite if that answer is
        not finite.
        """
        if not np.isfinite(other_answer.values).all():
            return float("inf")
        return float(np.abs(other_answer.values - values_at(self.answer, other_answer.times, self.kink_period)).max())

    @property
    def size(self) -> float:
        """Largest magnitude of the quantity over the run."""
        return float(np.abs(self.answer.values).max())


def values_at(answer: PricedRun, times: np.ndarray, kink_period: float = 0.0) -> np.ndarray:
    """Values (m, k) of an answer at ``times`` (m,) in s: its rows where they coincide, else cubic interpolation in four
    rows within one kink period.
    """
    last = len(answer.times) - 1
    step = float(answer.times[-1]) / last
    place = times / step
    index = np.rint(place).astype(int)
    if np.abs(place - index).max() < ROW_TIME_ROUNDING:
        return answer.values[np.minimum(index, last)]
    rows = max(3, round(kink_period / step)) if kink_period else last
    first = np.minimum((place + ROW_TIME_ROUNDING) // rows * rows, last - 3).astype(int)
    left = np.clip(np.floor(place).astype(int) - 1, first, np.minimum(first + rows, last) - 3)
    s = place - left
    weights = (
        -(s - 1) * (s - 2) * (s - 3) / 6,
        s * (s - 2) * (s - 3) / 2,
        -s * (s - 1) * (s - 3) / 2,
        s * (s - 1) * (s - 2) / 6,
    )
    return sum((w[:, None] * answer.values[left + i] for i, w in enumerate(weights)), np.zeros((1, 1)))


def reference_truth(
    scene: PricedScene,
    tolerance: float,
    duration: float,
    rung: int = 0,
    second_method: bool = True,
    executor: Executor | None = None,
) -> ReferenceTruth:
    """The truth of a scene's quantity over ``duration`` (s), to within a twentieth of ``tolerance``;
    ``second_method`` : whether another family of methods must confirm it.

    executor : computes the first two settings of the reference at the same time, since fewer are never enough.

    InputError where this uncertainty cannot be reached, RunFailed where two families of solvers differ or no run
    ends.
    """
    ladder = scene.reference()
    settled, rung, change, seconds, broken = _settled_answer(scene, ladder, tolerance, duration, rung, executor)
    said = _setting_text(ladder.setting(rung))
    other = scene.second(ladder.setting(rung)) if second_method else None
    finer = "half the cells and a longer step change it by" if ladder.cells else "halving its step changes"
    finer = ladder.said or finer
    alone = ReferenceTruth(
        settled, change, f"{said}; {finer}", rung, scene.kink_period, seconds, tuple(broken.values())
    )
    if other is None:
        return alone
    differs = alone.error(scene.answer(scene.solve(other, duration)))
    both = f"{said} and {_setting_text(other)}"
    if differs > tolerance / AGREEMENT_FACTOR:
        raise RunFailed("reference", f"{both} differ by {differs:.3g} {scene.unit}: the tolerance cannot be judged")
    return replace(alone, uncertainty=max(change, differs), origin=f"{both}, which differ by")


def _change_by_halving(scene: PricedScene, coarse: PricedRun, fine: PricedRun) -> float:
    """Largest difference between an answer and that with half the step, at the rows of both; the coarser answer is
    interpolated between its rows.
    """
    both = ((fine, coarse), (coarse, fine))
    return max(ReferenceTruth(run, 0.0, "", 0, scene.kink_period).error(other) for run, other in both)


def _setting_text(setting: Setting) -> str:
    return f"{setting.engine} {setting.method} at {setting.label()}"


class _Rung(NamedTuple):
    """Outcome of the reference on one rung: its answer, None where it failed; the reason for that; processor seconds;
    assumptions that it broke.
    """

    answer: PricedRun | None
    failure: str
    seconds: float
    broken_assumptions: dict[str, BrokenAssumption]


def _reference_on_rung(scene: PricedScene, duration: float, setting: Setting) -> _Rung:
    begun = time.process_time()
    with collected_breaches() as broken:
        try:
            answer = scene.answer(scene.solve(setting, duration))
        except (InputError, RunFailed) as error:
            return _Rung(None, str(error), 0.0, broken)
    return _Rung(answer, "", time.process_time() - begun, broken)


def _settled_answer(
    scene: PricedScene, ladder: SettingLadder, tolerance: float, duration: float, rung: int, executor: Executor | None
) -> tuple[PricedRun, int, float, float, dict[str, BrokenAssumption]]:
    """The first answer of the reference that the next finer rung changed by no more than a fraction of the tolerance;
    with its rung, the change, the processor seconds and the assumptions that it broke.
    """
    before: PricedRun | None = None
    change, failure = float("inf"), ""
    rungs = [i for i in range(rung, len(ladder.values)) if duration / ladder.values[i] <= MOST_ROWS]
    job = partial(_reference_on_rung, scene, duration)
    together = [ladder.setting(i) for i in rungs[:2]] if executor is not None else []
    ready = dict(zip(rungs, block_results(job, together, executor), strict=False))
    for i in rungs:
        now, failed, seconds, broken = ready.pop(i, None) or job(ladder.setting(i))
        if now is None:
            before, failure = None, failed
            continue
        if before is not None:
            last, change = change, _change_by_halving(scene, before, now)
            if change <= tolerance / ladder.confirmation_divisor:
                return now, i, change, seconds, broken
            if change > 0.7 * last and change < 1e-6 * float(np.abs(now.values).max()):
                break  # rounding: finer steps no longer help
        before = now
    if before is None:
        raise RunFailed("reference", failure or "no step is fine enough")
    least = f"{ladder.confirmation_divisor * change:.2g} {scene.unit}"
    allowed = f"is finer than the scene's own reference can be known here: at least {least}"
    raise InputError("--tolerance", "", tolerance, allowed)
