"""Which setting to take: the cheapest that meets a tolerance, timed beside the engines' defaults, and confirmed.

Counts are the same in every run, so the least count wins. Seconds wander: they are those of the processor, in rounds in
which the rivals take turns, and an engine's default method that meets the tolerance is recommended unless the 95 %
interval of its ratio to the fastest lies above SLOWER_RATIO. So what is recommended in its place is faster beyond
doubt, and what is recommended beside it is never slower than it by more than that.

Whatever is timed runs in this process, with nothing beside it. What is not may be shared among workers: the first two
settings of a reference, the runs that confirm the winners, and those whose errors are told against a finer truth.
"""

import math
import time
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from numbers import Real
from typing import Any

import numpy as np

from models.advice.price import PricedRun, PricedScene, SettingLadder
from models.advice.price.problem import Setting
from models.advice.price.search import Search, TriedSetting
from models.advice.price.truth import ReferenceTruth, reference_truth
from models.core.errors import InputError, RunFailed
from models.core.systems import SYSTEMS, modules_of
from models.ensemble.runner import block_results
from models.ensemble.workers import Crew, folders_for_workers
from models.machine.timing import interleave, paired_ratio

CLOSE_SECONDS_RATIO = 2.0
"""Settings that took up to so many times the least seconds in one run are timed beside one another."""
DEFAULT_SECONDS_RATIO = 8.0
"""The same for a default: it must never be given up because one run of it was disturbed."""
TIMING_ROUNDS, SHORTEST_TURN = 9, 0.002
"""Interleaved rounds of timing; a short run is repeated until its turn lasts this long (s)."""
FEWEST_ROUNDS, LONG_ROUNDS_SECONDS = 3, 5.0
"""Of slow runs there are fewer rounds, for they take no longer together than this (s), yet at least so many."""
DROPPED_SECONDS_RATIO, DEFAULT_DROPPED_RATIO = 1.5, 3.0
"""What took so many times the seconds of its engine's best in the first rounds is out of the race; a default later."""
SLOWER_RATIO = 1.05
"""A ratio of seconds whose 95 % interval lies above this is slower beyond doubt."""
MOST_CONFIRMATIONS = 6
"""Settings that are confirmed over the whole run, at most, for one recommendation."""
RESOLUTION_FACTOR = 3.0
"""An error is told against a truth which is known that many times better, where one can be had within
LONG_ROUNDS_SECONDS."""
UNTIMED_RUNS_AT_ONCE = 8
"""Runs at once that are not timed, about: two settings of a reference, or two for each engine."""
REFINEMENT_COST = 8.0
"""A finer reference takes at most about so many times the seconds: twice the cells, half the step."""


@dataclass(frozen=True)
class SettingChoice:
    """A setting with its cost. error : in the quantity's unit, at least the uncertainty of the truth; calls : of
    forces; seconds : median; confirmed : whether over the whole run; rounds : seconds in the rounds in which it was
    timed alternately with others.
    """

    tried: TriedSetting
    error: float
    calls: float
    seconds: float
    confirmed: bool
    rounds: tuple[float, ...] = ()


Winners = dict[tuple[str, str], SettingChoice]
"""By engine, "" for all, and by what is counted, "calls" or "seconds"."""


@dataclass(frozen=True)
class Default:
    """An engine's default method. as_it_is : outcome of its default setting, with a ``reason`` if it gave no answer;
    refined : the setting that meets the tolerance; extrapolated : whether by the declared order, because no step that
    was tried is fine enough.
    """

    as_it_is: TriedSetting
    refined: SettingChoice | None
    extrapolated: bool


@dataclass(frozen=True)
class Recommendation:
    """Result of a search for settings: winners by engine and cost ("" for all engines), defaults by engine, all
    settings that were tried, and the truth over the searched part and over the whole run.
    """

    scene: PricedScene
    tolerance: float
    search_truth: ReferenceTruth
    truth: ReferenceTruth
    winners: Winners
    defaults: dict[str, Default]
    tried: tuple[TriedSetting, ...]

    @property
    def whole(self) -> bool:
        """Whether settings were searched over the full duration of the run, not its first part alone."""
        return self.scene.whole <= self.scene.first * (1 + 1e-9)


def price(scene: Any, tolerance: float, quantity: str | None, engines: tuple[str, ...]) -> Recommendation:
    """The cheapest settings of a scene that meet a tolerance. InputError for impossible requests, RunFailed where no
    truth can be computed.

    The scene's crew computes what is not timed.
    """
    plain_number = isinstance(tolerance, Real) and not isinstance(tolerance, bool)
    if not (plain_number and math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError("--tolerance", "", tolerance, "must be a finite number above 0, in the quantity's unit")
    to_price = priced_scene(scene, quantity, engines)
    with Crew.of(scene, default_workers=1).at_work(UNTIMED_RUNS_AT_ONCE, *folders_for_workers(scene)) as pool:
        return recommend(to_price, tolerance, pool)


def priced_scene(scene: Any, quantity: str | None, engines: tuple[str, ...]) -> PricedScene:
    """A scene in the form that the search needs, made by its system's module; InputError where there is none."""
    files = modules_of("models.advice.price.systems")
    if scene.system in files:
        priceable: PricedScene = import_module(files[scene.system]).priced_scene(scene, quantity, engines)
        return priceable
    package = import_module(SYSTEMS[scene.system].package) if scene.system in SYSTEMS else None
    why = getattr(package, "NO_PRICE", "has no steps to choose")
    raise InputError(
        scene.file, "system", scene.system, f"{why}; accuracy is priced in scenes of other systems", tuple(files)
    )


def recommend(scene: PricedScene, tolerance: float, executor: Executor | None = None) -> Recommendation:
    """Search settings over the first part of the run, time those near the best, and confirm them over the whole run.

    executor : computes what is not timed.
    """
    searched = known = reference_truth(scene, tolerance, scene.first, executor=executor)
    search = Search(scene, searched, tolerance, scene.first).search_all_ladders()
    timed = _timed_settings(search)
    engines = ("", *dict.fromkeys(ladder.engine for ladder in scene.ladders()))
    winners = _cheapest_by_key(timed, [(engine, kind) for engine in engines for kind in ("seconds", "calls")])
    if scene.whole > scene.first * (1 + 1e-9) and winners:
        known, timed, winners = _confirmed_over_whole_run(search, timed, winners, executor)
    known, timed, winners = _with_finer_truth(scene, known, timed, winners, executor)
    defaults = {
        ladder.engine: settings
        for ladder in scene.ladders()
        if ladder.default and (settings := _default_cost(search, ladder, timed)) is not None
    }
    return Recommendation(scene, tolerance, searched, known, winners, defaults, tuple(search.tried))


def _timed_settings(search: Search) -> list[SettingChoice]:
    """The coarsest setting of every method that meets the tolerance; those that may be the fastest are timed in several
    rounds.
    """
    curves: dict[str, TriedSetting] = {}
    for attempt in search.settings_that_meet():
        coarsest = curves.setdefault(attempt.setting.curve, attempt)
        if attempt.setting.value > coarsest.setting.value:
            curves[attempt.setting.curve] = attempt
    if not curves:
        return []
    attempts = list(curves.values())
    seconds_by_setting, longer = (
        _interleaved_seconds(search, _fastest_candidates(attempts)),
        search.scene.whole / search.duration,
    )
    seconds = [
        tuple(longer * seconds_by_setting.get(attempt.setting, np.array([attempt.seconds]))) for attempt in attempts
    ]
    return [
        SettingChoice(attempt, attempt.error, longer * attempt.calls, float(np.median(took)), False, took)
        for attempt, took in zip(attempts, seconds, strict=True)
    ]


def _fastest_candidates(attempts: list[TriedSetting]) -> list[TriedSetting]:
    """Settings that may be an engine's fastest, or the fastest of all; none where there is only one candidate."""
    rivals = dict[TriedSetting, None]()
    for engine in ("", *dict.fromkeys(attempt.setting.engine for attempt in attempts)):
        attempts_of_engine = [attempt for attempt in attempts if attempt.setting.engine.startswith(engine)]
        least_seconds = min(attempt.seconds for attempt in attempts_of_engine)
        near = [
            attempt
            for attempt in attempts_of_engine
            if attempt.seconds
            <= (DEFAULT_SECONDS_RATIO if attempt.setting.default else CLOSE_SECONDS_RATIO) * least_seconds
        ]
        rivals |= dict.fromkeys(near if len(near) > 1 else [])
    return list(rivals)


def _interleaved_seconds(search: Search, rivals: list[TriedSetting]) -> dict[Setting, np.ndarray]:
    """Seconds of each setting in a few rounds, and in more rounds for those that are not far behind the fastest."""
    seconds = _seconds_by_round(search, rivals, FEWEST_ROUNDS)
    middle = {attempt.setting: float(np.median(seconds[attempt.setting])) for attempt in rivals}
    least_by_engine: dict[str, float] = {}
    for setting, took in middle.items():
        least_by_engine[setting.engine] = min(took, least_by_engine.get(setting.engine, took))
    left = [
        attempt
        for attempt in rivals
        if middle[attempt.setting]
        <= (DEFAULT_DROPPED_RATIO if attempt.setting.default else DROPPED_SECONDS_RATIO)
        * least_by_engine[attempt.setting.engine]
    ]
    further_rounds = (
        min(TIMING_ROUNDS, int(LONG_ROUNDS_SECONDS / max(sum(middle[attempt.setting] for attempt in left), 1e-9)))
        - FEWEST_ROUNDS
    )
    further = _seconds_by_round(search, left, further_rounds) if further_rounds > 0 and len(left) > 1 else {}
    return seconds | {
        setting: np.concatenate((seconds[setting], seconds_again)) for setting, seconds_again in further.items()
    }


def _seconds_by_round(search: Search, rivals: list[TriedSetting], round_count: int) -> dict[Setting, np.ndarray]:
    jobs = [partial(search.scene.solve, attempt.setting, search.duration) for attempt in rivals]
    lasted = [attempt.seconds for attempt in rivals]
    seconds_by_setting = interleave(jobs, round_count, SHORTEST_TURN, lasted=lasted, clock=time.process_time)
    return dict(zip((attempt.setting for attempt in rivals), seconds_by_setting, strict=True))


def _cheapest_by_key(timed_choices: list[SettingChoice], keys: Iterable[tuple[str, str]]) -> Winners:
    """The cheapest setting for every pair of engine and cost in ``keys`` that has any."""
    return {key: best for key in keys if (best := _cheapest(timed_choices, *key)) is not None}


def _cheapest(timed_choices: list[SettingChoice], engine: str, cost_kind: str) -> SettingChoice | None:
    """The setting of an engine with the least cost. By seconds, which scatter, a default method is preferred unless it
    is clearly slower.
    """
    able = [choice for choice in timed_choices if choice.tried.setting.engine.startswith(engine)]
    if not able:
        return None
    best = min(able, key=lambda choice: getattr(choice, cost_kind))
    usual = [
        choice
        for choice in able
        if choice.tried.setting.default and cost_kind == "seconds" and not _is_slower(choice, best)
    ]
    return min(usual, key=lambda choice: choice.seconds) if usual else best


def _is_slower(choice: SettingChoice, best: SettingChoice) -> bool:
    """Whether a setting takes longer than another: significantly so, where both were timed in the same rounds."""
    common_rounds = min(len(choice.rounds), len(best.rounds))
    if common_rounds < FEWEST_ROUNDS:
        return choice.seconds > best.seconds
    return paired_ratio(choice.rounds[:common_rounds], best.rounds[:common_rounds])[1] > SLOWER_RATIO


TruthAndOutcomes = tuple[ReferenceTruth, list[SettingChoice], Winners]


def _confirmed_over_whole_run(
    search: Search, timed_choices: list[SettingChoice], winners: Winners, executor: Executor | None
) -> TruthAndOutcomes:
    """The winners and defaults after runs over the whole scene, refined until they meet the tolerance there; with the
    truth.
    """
    scene = search.scene
    rung = max(0, search.truth.rung - 1)
    known = reference_truth(scene, search.tolerance, scene.whole, rung, second_method=False, executor=executor)
    ladders = {f"{choice.engine} {choice.method}": choice for choice in scene.ladders()}
    able = {choice.tried.setting: choice for choice in _winners_and_defaults(timed_choices, winners)}
    full_search = Search(scene, known, search.tolerance, scene.whole)
    blocks = [(ladders[setting.curve], choice) for setting, choice in able.items()]
    confirmed = block_results(partial(_valid_over_run, full_search), blocks, executor)
    confirmed_choices = [confirmation.choice for confirmation in confirmed if confirmation.choice is not None]
    search.tried += [attempt for confirmation in confirmed for attempt in confirmation.failed]
    return known, confirmed_choices, _cheapest_by_key(confirmed_choices, winners)


def _winners_and_defaults(timed_choices: list[SettingChoice], winners: Winners) -> list[SettingChoice]:
    """The winners and the settings of default methods, each once."""
    return list(
        dict.fromkeys([*winners.values(), *(choice for choice in timed_choices if choice.tried.setting.default)])
    )


@dataclass(frozen=True)
class _ConfirmedSetting:
    """A setting that meets the tolerance over the whole run, None where there is none, and attempts that failed for
    other reasons than their error.
    """

    choice: SettingChoice | None
    failed: list[TriedSetting] = field(default_factory=list)


def _valid_over_run(search: Search, block: tuple[SettingLadder, SettingChoice]) -> _ConfirmedSetting:
    """The setting, or the next finer one of its method, that meets the tolerance over the whole run.

    The seconds of all attempts are scaled from the rounds in which the first one was timed.
    """
    (ladder, choice), failed = block, list[TriedSetting]()
    i, first = ladder.values.index(choice.tried.setting.value), choice.tried
    for _ in range(MOST_CONFIRMATIONS):
        ratio = ladder.work(first.setting.value, ladder.values[i])
        tried = search.attempt(ladder.setting(i))
        tried = replace(tried, seconds=ratio * choice.seconds) if tried.seconds else tried
        failed += [tried] if tried.status != "ok" else []
        if search.meets(tried):
            rounds = tuple(ratio * s for s in choice.rounds)
            return _ConfirmedSetting(
                SettingChoice(tried, tried.error, tried.calls, tried.seconds, True, rounds), failed
            )
        finer = (tried.error / search.tolerance) ** (1 / (ladder.order or 1)) if np.isfinite(tried.error) else 2.0
        wanted = ladder.values[i] / finer
        i = next((k for k in range(i + 1, len(ladder.values)) if ladder.values[k] <= wanted * (1 + 1e-9)), -1)
        if i < 0:
            break
    return _ConfirmedSetting(None, failed)


def _with_finer_truth(
    scene: PricedScene,
    truth: ReferenceTruth,
    timed_choices: list[SettingChoice],
    winners: Winners,
    executor: Executor | None,
) -> TruthAndOutcomes:
    """A truth that is more exact than the winners and the defaults, and these with their errors from it: a setting may
    be far better than its tolerance asks, and as good as the reference that it was compared with.
    """
    shown = _winners_and_defaults(timed_choices, winners)
    errors = {choice.tried.setting: choice.error for choice in shown}
    if _is_blurred(truth, errors):
        answers = dict(zip(errors, block_results(partial(_whole_answer, scene), errors, executor), strict=True))
        truth, errors = _finer_truth(scene, truth, answers, executor)
    choices_with_errors = {
        choice.tried.setting: replace(choice, error=max(errors[choice.tried.setting], truth.uncertainty))
        for choice in shown
    }
    return (
        truth,
        [choices_with_errors.get(choice.tried.setting, choice) for choice in timed_choices],
        {key: choices_with_errors[choice.tried.setting] for key, choice in winners.items()},
    )


def _whole_answer(scene: PricedScene, setting: Setting) -> PricedRun:
    return scene.answer(scene.solve(setting, scene.whole))


def _is_blurred(truth: ReferenceTruth, errors: dict[Setting, float]) -> bool:
    """Whether the smallest error is too close to the uncertainty of the truth, and a better truth would take seconds,
    not minutes.
    """
    return (
        min(errors.values(), default=np.inf) < RESOLUTION_FACTOR * truth.uncertainty
        and REFINEMENT_COST * truth.seconds < LONG_ROUNDS_SECONDS
    )


def _finer_truth(
    scene: PricedScene, truth: ReferenceTruth, priced_runs: dict[Setting, PricedRun], executor: Executor | None
) -> tuple[ReferenceTruth, dict[Setting, float]]:
    """A truth that is exact enough for the errors of all answers, or the best that time allows, and these errors."""
    errors = {setting: truth.error(answer) for setting, answer in priced_runs.items()}
    while _is_blurred(truth, errors):
        try:
            tolerance = scene.reference().confirmation_divisor * truth.uncertainty
            finer = reference_truth(scene, tolerance, scene.whole, truth.rung, second_method=False, executor=executor)
        except (InputError, RunFailed):
            break  # as well known as rounding and the reference's finest step let it be
        if not finer.uncertainty < truth.uncertainty:
            break
        truth, errors = finer, {setting: finer.error(answer) for setting, answer in priced_runs.items()}
    return truth, errors


def _default_cost(search: Search, ladder: SettingLadder, timed_choices: list[SettingChoice]) -> Default | None:
    """Error and cost of an engine's default settings, and the cost at which they meet the tolerance."""
    curve = f"{ladder.engine} {ladder.method}"
    tried = [attempt for attempt in search.tried if attempt.setting.curve == curve]
    if not tried:
        return None
    as_it_is = min(tried, key=lambda attempt: abs(np.log(attempt.setting.value / ladder.default)))
    met = next((attempt for attempt in timed_choices if attempt.tried.setting.curve == curve), None)
    clear = [attempt for attempt in tried if attempt.status == "ok"]
    if met is not None or not clear:
        return Default(as_it_is, met, False)
    finest = min(clear, key=lambda attempt: attempt.setting.value)
    if search.meets(finest):  # over the part that was searched, and not over the whole run
        return Default(as_it_is, None, False)
    finer = (finest.error / search.tolerance) ** (1 / (ladder.order or 1))
    setting = replace(finest.setting, value=finest.setting.value / finer)
    longer = ladder.work(finest.setting.value, setting.value) * search.scene.whole / search.duration
    guess = TriedSetting(setting, "ok", "", search.tolerance)
    refined = SettingChoice(guess, search.tolerance, longer * finest.calls, longer * finest.seconds, False)
    return Default(as_it_is, refined, True)
