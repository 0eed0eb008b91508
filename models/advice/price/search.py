"""Search for the coarsest setting of every method that meets a tolerance, without running settings that cannot be the
cheapest.
"""

import time
from bisect import bisect_left
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import attrgetter

from models.advice.price import PricedScene, SettingLadder
from models.advice.price.problem import Setting
from models.advice.price.runner import PointStatus
from models.advice.price.truth import ReferenceSolution
from models.core.assumptions import collected_broken_assumptions
from models.core.errors import InputError, RunFailed

FIRST_TRIED_STEP = 2e-3
"""Step (s) that is tried first; an engine's default method begins with its default step."""
FIRST_TRIED_CELL_SHARE = 1 / 11
"""Ratio of a cell's length to that of the contact that is tried first."""
FIRST_TRIED_TOLERANCE = 1e-3
"""Relative tolerance that is tried first with an adaptive method."""
GIVEN_UP_COST_RATIO = 2.0
"""Ratio to the seconds and the force calls of its engine's best setting above which a method is given up."""
REFINED_RUN_DURATION = 0.05
"""Duration (s) of a run up to which an engine's default method is refined, or that of the engine's fastest setting that
has met the tolerance, if it is longer.
"""
LONGEST_RUN_SECONDS = 10.0
"""Duration (s) above which a run is not made if another engine meets the tolerance in half of it, or less."""
LARGEST_RELATIVE_ERROR = 10.0
"""Ratio of an error to the quantity's size above which the run counts as a wrong result."""


@dataclass(frozen=True)
class TriedSetting:
    """Outcome of one setting: error in the quantity's unit, calls (or cells), and processor seconds of one run. It is
    "flagged" where it breaks an assumption that the reference keeps.
    """

    setting: Setting
    status: PointStatus
    reason: str = ""
    error: float = float("inf")
    calls: int = 0
    seconds: float = 0.0


@dataclass
class SettingSearch:
    """Search for settings of a scene that meet a tolerance; they are run over ``duration`` (s) and compared with the
    scene's truth.
    """

    scene: PricedScene
    reference_solution: ReferenceSolution
    tolerance: float
    duration: float
    tried: list[TriedSetting] = field(default_factory=list)

    @property
    def largest_allowed_error(self) -> float:
        """Largest error that a setting may show: the tolerance less the uncertainty of the truth."""
        return self.tolerance - self.reference_solution.uncertainty

    def search_all_ladders(self) -> "SettingSearch":
        """Search every ladder of settings, methods of high order first: their cost decides where other ladders are
        given up. Returns the search.
        """
        for ladder in {any_ladder.engine: any_ladder for any_ladder in self.scene.setting_ladders()}.values():
            self._warm_up(ladder)
        for ladder in sorted(
            self.scene.setting_ladders(), key=lambda any_ladder: (any_ladder.adaptive, -any_ladder.order)
        ):
            self.search_ladder(ladder)
        return self

    def try_setting(self, setting: Setting) -> TriedSetting:
        """Run the scene with a setting and record the outcome, which is returned."""
        start_time = time.process_time()
        try:
            with collected_broken_assumptions() as broken:
                solution = self.scene.solve(setting, self.duration)
                seconds, answer = time.process_time() - start_time, self.scene.priced_run(solution)
        except InputError as error:
            attempt = TriedSetting(setting, "refused", getattr(error, "why", "") or error.allowed)
        except RunFailed as error:
            attempt = TriedSetting(setting, "raised", str(error))
        else:
            error_of, calls = self.reference_solution.error(answer), answer.counts.get(self.scene.work_count_name, 0)
            attempt = TriedSetting(setting, "ok", "", error_of, calls, seconds)
            if not error_of <= LARGEST_RELATIVE_ERROR * max(self.reference_solution.size, self.tolerance):
                why = f"an error of {error_of:.3g} {self.scene.unit} came back as a result"
                attempt = replace(attempt, status="SILENT", reason=why)
            elif broken_by_setting := self.reference_solution.newly_broken(broken):
                attempt = replace(
                    attempt, status="flagged", reason="; ".join(assumption.brief() for assumption in broken_by_setting)
                )
        self.tried.append(attempt)
        return attempt

    def _warm_up(self, ladder: SettingLadder) -> None:
        """Run a ladder's first setting once without timing, since the first run of an engine imports and compiles."""
        with suppress(InputError, RunFailed):
            self.scene.solve(
                ladder.setting(_next_rung(ladder, 0, len(ladder.values), None, self.tolerance)), self.duration
            )

    def search_ladder(self, ladder: SettingLadder) -> None:
        """Find a ladder's coarsest setting that meets the tolerance, nearly by bisection. The declared order, or
        another engine with the same method, predicts which rung to try next.
        """
        low, high, last_tried, same_method_value = 0, len(ladder.values), None, self._value_in_another_engine(ladder)
        while low < high:
            i = _next_rung(ladder, low, high, last_tried, self.tolerance)
            if same_method_value and (last_tried is not None or not ladder.default):
                i, same_method_value = _rung_for_target(ladder, same_method_value, low, high), 0.0
            if ladder.default and last_tried is not None and self.settings_that_meet(ladder.engine):
                i = min(i, self._finest_affordable_rung(ladder, last_tried))
            if i < low or self._is_hopeless(ladder, i, last_tried) or self._is_too_long(ladder, i, last_tried):
                return
            last_tried = self.try_setting(ladder.setting(i))
            if self.meets_tolerance(last_tried):
                high = i
            elif ladder.cells and last_tried.status in ("refused", "raised"):
                return  # its step is too long, however many cells there are
            else:
                low = i + 1

    def settings_that_meet(self, engine: str = "") -> list[TriedSetting]:
        """Outcomes of the tried settings that meet the tolerance, of one engine or of all engines ("")."""
        return [
            attempt
            for attempt in self.tried
            if self.meets_tolerance(attempt) and attempt.setting.engine.startswith(engine)
        ]

    def meets_tolerance(self, tried_setting: TriedSetting) -> bool:
        """Whether a setting meets the tolerance and keeps the assumptions that the reference keeps."""
        return tried_setting.status == "ok" and tried_setting.error <= self.largest_allowed_error

    def _value_in_another_engine(self, ladder: SettingLadder) -> float:
        """The coarsest value of the setting with which the same method meets the tolerance in another engine, 0 where
        there is none.
        """
        values_of_method = [
            attempt.setting.value for attempt in self.settings_that_meet() if attempt.setting.method == ladder.method
        ]
        return max((value for value in values_of_method if value in ladder.values), default=0.0)

    def _finest_affordable_rung(self, ladder: SettingLadder, last_tried: TriedSetting) -> int:
        """The finest rung whose run is expected to take no longer than REFINED_RUN_DURATION, or than the engine's
        fastest setting that meets the tolerance.
        """
        best = min(attempt.seconds for attempt in self.settings_that_meet(ladder.engine))
        largest_work = max(REFINED_RUN_DURATION, best) / max(last_tried.seconds, 1e-9)
        work = [ladder.work(last_tried.setting.value, value) for value in ladder.values]
        return max(i for i, work_ratio in enumerate(work) if i == 0 or work_ratio <= largest_work)

    def _is_hopeless(self, ladder: SettingLadder, rung_index: int, last_tried: TriedSetting | None) -> bool:
        """Whether rung ``rung_index`` would cost far more than another setting of its engine that meets the
        tolerance.
        """
        best = self.settings_that_meet(ladder.engine)
        if last_tried is None or not last_tried.seconds or ladder.default or not best:
            return False
        finer = ladder.work(last_tried.setting.value, ladder.values[rung_index])
        return all(
            finer * cost(last_tried) > GIVEN_UP_COST_RATIO * min(map(cost, best)) for cost in (_seconds_of, _calls_of)
        )

    def _is_too_long(self, ladder: SettingLadder, rung_index: int, last_tried: TriedSetting | None) -> bool:
        """Whether rung ``rung_index`` would take very long although another engine has met the tolerance much faster;
        if so, this is recorded as refused.
        """
        best = min((attempt.seconds for attempt in self.settings_that_meet()), default=float("inf"))
        seconds = (
            0.0
            if last_tried is None
            else ladder.work(last_tried.setting.value, ladder.values[rung_index]) * last_tried.seconds
        )
        if seconds <= max(LONGEST_RUN_SECONDS, GIVEN_UP_COST_RATIO * best):
            return False
        why = f"not run: it would take about {seconds:.0f} s, and the tolerance is met in {best:.2g} s"
        self.tried.append(TriedSetting(ladder.setting(rung_index), "refused", why))
        return True


_seconds_of, _calls_of = attrgetter("seconds"), attrgetter("calls")


def _next_rung(
    ladder: SettingLadder, lower_rung: int, upper_rung: int, last_tried: TriedSetting | None, tolerance: float
) -> int:
    """The rung to try next: predicted from the last outcome by the declared order, or the middle rung if that is
    impossible.
    """
    if last_tried is None:
        wanted = (
            FIRST_TRIED_TOLERANCE
            if ladder.adaptive
            else ladder.default or (FIRST_TRIED_CELL_SHARE if ladder.cells else FIRST_TRIED_STEP)
        )
    elif last_tried.status == "ok" and last_tried.error > 0.0:
        wanted = last_tried.setting.value * (tolerance / last_tried.error) ** (
            1 / (1 if ladder.adaptive else ladder.order or 2)
        )
    else:
        return (lower_rung + upper_rung) // 2
    return _rung_for_target(ladder, wanted, lower_rung, upper_rung)


def _rung_for_target(ladder: SettingLadder, target_value: float, lower_rung: int, upper_rung: int) -> int:
    """The coarsest of the remaining rungs whose value is at most ``target_value``."""
    i = bisect_left(ladder.values, -target_value * (1 + 1e-9), key=lambda value: -value)
    return min(max(i, lower_rung), upper_rung - 1)
