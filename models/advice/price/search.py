"""The coarsest setting of every method that meets a tolerance, found without running what cannot win."""

import time
from bisect import bisect_left
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import attrgetter

from models.advice.price import PricedScene, SettingLadder
from models.advice.price.problem import Setting
from models.advice.price.runner import Status
from models.advice.price.truth import ReferenceTruth
from models.core.assumptions import collected_breaches
from models.core.errors import InputError, RunFailed

FIRST_STEP = 2e-3
"""s: the step that is tried first; an engine's default method begins with its default step."""
FIRST_CELLS_SHARE = 1 / 11
"""Of a contact: the cells that are tried first."""
FIRST_TOLERANCE = 1e-3
"""The tolerance that an adaptive method is tried with first."""
GIVEN_UP_RATIO = 2.0
"""A method is given up once it takes this many times the seconds and the force calls of its engine's best."""
REFINED_SECONDS = 0.05
"""s: an engine's default method is refined for as long as a run takes no longer than this, or than the engine's best
that has met the tolerance, if one has.
"""
TOO_LONG = 10.0
"""s: a run that would take longer is not made where another engine meets the tolerance in half of that, or less."""
LARGEST_RELATIVE_ERROR = 10.0
"""An error of so many times the quantity's own size is no answer any more."""


@dataclass(frozen=True)
class TriedSetting:
    """Outcome of one setting: error in the quantity's unit, calls (or cells), and processor seconds of one run, without
    other work on the machine. It is "flagged" where it breaks an assumption that the reference keeps.
    """

    setting: Setting
    status: Status
    reason: str = ""
    error: float = float("inf")
    calls: int = 0
    seconds: float = 0.0


@dataclass
class Search:
    """Settings of a scene that are tried over ``duration`` (s), and compared with the scene's truth."""

    scene: PricedScene
    truth: ReferenceTruth
    tolerance: float
    duration: float
    tried: list[TriedSetting] = field(default_factory=list)

    @property
    def largest_allowed_error(self) -> float:
        """Largest error that a setting may show: the tolerance less the uncertainty of the truth."""
        return self.tolerance - self.truth.uncertainty

    def search_all_ladders(self) -> "Search":
        """Search every ladder, methods of high order first. Their cost decides where other ladders are given up."""
        for ladder in {any_ladder.engine: any_ladder for any_ladder in self.scene.ladders()}.values():
            self._warm_up(ladder)
        for ladder in sorted(self.scene.ladders(), key=lambda any_ladder: (any_ladder.adaptive, -any_ladder.order)):
            self.search_ladder(ladder)
        return self

    def attempt(self, setting: Setting) -> TriedSetting:
        """Try a setting and record its outcome."""
        start_time = time.process_time()
        try:
            with collected_breaches() as broken:
                solution = self.scene.solve(setting, self.duration)
                seconds, answer = time.process_time() - start_time, self.scene.answer(solution)
        except InputError as error:
            attempt = TriedSetting(setting, "refused", getattr(error, "why", "") or error.allowed)
        except RunFailed as error:
            attempt = TriedSetting(setting, "raised", str(error))
        else:
            error_of, calls = self.truth.error(answer), answer.counts.get(self.scene.counted, 0)
            attempt = TriedSetting(setting, "ok", "", error_of, calls, seconds)
            if not error_of <= LARGEST_RELATIVE_ERROR * max(self.truth.size, self.tolerance):
                why = f"an error of {error_of:.3g} {self.scene.unit} came back as a result"
                attempt = replace(attempt, status="SILENT", reason=why)
            elif broken_by_setting := self.truth.beside(broken):
                attempt = replace(
                    attempt, status="flagged", reason="; ".join(assumption.brief() for assumption in broken_by_setting)
                )
        self.tried.append(attempt)
        return attempt

    def _warm_up(self, ladder: SettingLadder) -> None:
        """Run once without timing, since the first run of an engine imports and compiles."""
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
            if i < low or self._is_hopeless(ladder, i, last_tried) or self._too_long(ladder, i, last_tried):
                return
            last_tried = self.attempt(ladder.setting(i))
            if self.meets(last_tried):
                high = i
            elif ladder.cells and last_tried.status in ("refused", "raised"):
                return  # its step is too long, however many cells there are
            else:
                low = i + 1

    def settings_that_meet(self, engine: str = "") -> list[TriedSetting]:
        """Outcomes of the settings, of one engine or of all, that meet the tolerance."""
        return [attempt for attempt in self.tried if self.meets(attempt) and attempt.setting.engine.startswith(engine)]

    def meets(self, attempt: TriedSetting) -> bool:
        """Whether a setting meets the tolerance and keeps the assumptions that the reference keeps."""
        return attempt.status == "ok" and attempt.error <= self.largest_allowed_error

    def _value_in_another_engine(self, ladder: SettingLadder) -> float:
        """The setting's value that the same method needs in another engine, 0 where none has it."""
        values_of_method = [
            attempt.setting.value for attempt in self.settings_that_meet() if attempt.setting.method == ladder.method
        ]
        return max((value for value in values_of_method if value in ladder.values), default=0.0)

    def _finest_affordable_rung(self, ladder: SettingLadder, last_tried: TriedSetting) -> int:
        """The finest rung whose run takes no longer than REFINED_SECONDS, or than the engine's fastest setting that
        meets the tolerance.
        """
        best = min(attempt.seconds for attempt in self.settings_that_meet(ladder.engine))
        largest_work = max(REFINED_SECONDS, best) / max(last_tried.seconds, 1e-9)
        work = [ladder.work(last_tried.setting.value, value) for value in ladder.values]
        return max(i for i, work_ratio in enumerate(work) if i == 0 or work_ratio <= largest_work)

    def _is_hopeless(self, ladder: SettingLadder, i: int, last_tried: TriedSetting | None) -> bool:
        """Whether a rung would cost far more than another setting of its engine that meets the tolerance."""
        best = self.settings_that_meet(ladder.engine)
        if last_tried is None or not last_tried.seconds or ladder.default or not best:
            return False
        finer = ladder.work(last_tried.setting.value, ladder.values[i])
        return all(
            finer * cost(last_tried) > GIVEN_UP_RATIO * min(map(cost, best)) for cost in (_seconds_of, _calls_of)
        )

    def _too_long(self, ladder: SettingLadder, i: int, last_tried: TriedSetting | None) -> bool:
        """Whether a rung would take minutes although another engine has met the tolerance much faster; if so, this is
        recorded as refused.
        """
        best = min((attempt.seconds for attempt in self.settings_that_meet()), default=float("inf"))
        seconds = (
            0.0 if last_tried is None else ladder.work(last_tried.setting.value, ladder.values[i]) * last_tried.seconds
        )
        if seconds <= max(TOO_LONG, GIVEN_UP_RATIO * best):
            return False
        why = f"not run: it would take about {seconds:.0f} s, and the tolerance is met in {best:.2g} s"
        self.tried.append(TriedSetting(ladder.setting(i), "refused", why))
        return True


_seconds_of, _calls_of = attrgetter("seconds"), attrgetter("calls")


def _next_rung(ladder: SettingLadder, low: int, high: int, last_tried: TriedSetting | None, tolerance: float) -> int:
    """The rung to try next: predicted from the last one by the declared order, or the middle rung if that is
    impossible.
    """
    if last_tried is None:
        wanted = (
            FIRST_TOLERANCE
            if ladder.adaptive
            else ladder.default or (FIRST_CELLS_SHARE if ladder.cells else FIRST_STEP)
        )
    elif last_tried.status == "ok" and last_tried.error > 0.0:
        wanted = last_tried.setting.value * (tolerance / last_tried.error) ** (
            1 / (1 if ladder.adaptive else ladder.order or 2)
        )
    else:
        return (low + high) // 2
    return _rung_for_target(ladder, wanted, low, high)


def _rung_for_target(ladder: SettingLadder, target_value: float, low: int, high: int) -> int:
    """The coarsest of the remaining rungs that is no coarser than ``target_value``."""
    i = bisect_left(ladder.values, -target_value * (1 + 1e-9), key=lambda value: -value)
    return min(max(i, low), high - 1)
