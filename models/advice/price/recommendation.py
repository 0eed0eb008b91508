"""Which solver setting to take: the cheapest that meets a tolerance, timed beside the engines' defaults, and confirmed.

Counts are the same in every run, so the least count wins. Seconds wander: they are those of the processor, in rounds in
which the rivals take turns, and an engine's default method that meets the tolerance is recommended unless the 95 %
interval of its ratio to the fastest lies above SLOWER_SECONDS_RATIO. So what is recommended in its place is faster
beyond doubt, and what is recommended beside it is never slower than it by more than that.

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
from models.advice.price.search import SettingSearch, TriedSetting
from models.advice.price.truth import ReferenceSolution, refined_reference
from models.core.errors import InputError, RunFailed
from models.core.systems import SYSTEMS, modules_of
from models.ensemble.runner import block_results
from models.ensemble.workers import Crew, folders_for_workers
from models.machine.timing import interleave, paired_ratio

TIMED_SECONDS_RATIO = 2.0
"""Ratio to the least seconds in one run up to which settings are timed in interleaved rounds."""
TIMED_DEFAULT_SECONDS_RATIO = 8.0
"""Ratio as TIMED_SECONDS_RATIO for an engine's default, which must not be given up for one disturbed run."""
TIMING_ROUNDS, SHORTEST_TURN = 9, 0.002
"""Number of interleaved timing rounds, and the time (s) until which a short run is repeated in its turn."""
FEWEST_ROUNDS, LONG_ROUNDS_SECONDS = 3, 5.0
"""Least number of timing rounds, and the total time (s) that limits the number of rounds of slow runs."""
DROPPED_SECONDS_RATIO, DEFAULT_DROPPED_RATIO = 1.5, 3.0
"""Ratios to the engine's least seconds above which a setting, or a default, leaves after the first rounds."""
SLOWER_SECONDS_RATIO = 1.05
"""Ratio of seconds above which the 95 % interval must lie for a setting to count as slower."""
CONFIRMATION_LIMIT = 6
"""Largest number of settings that are tried over the whole run in search of one that meets the tolerance."""
RESOLVED_ERROR_RATIO = 3.0
"""Ratio of errors to the uncertainty of the truth below which a finer truth is computed, if there is time."""
UNTIMED_RUNS_AT_ONCE = 8
"""Number of untimed runs at the same time, about: two settings of a reference, or two for each engine."""
REFINEMENT_SECONDS_RATIO = 8.0
"""Ratio of the seconds of a finer reference to those of the last one, at most: twice the cells, half the step."""


@dataclass(frozen=True)
class SettingChoice:
    """A solver setting with its cost. error : in the quantity's unit, at least the uncertainty of the truth; calls : of
    forces; seconds : median; confirmed : whether over the whole run; rounds : seconds in the rounds in which it was
    timed alternately with others.
    """

    tried: TriedSetting
    error: float
    calls: float
    seconds: float
    confirmed: bool
    rounds: tuple[float, ...] = ()


CheapestChoices = dict[tuple[str, str], SettingChoice]
"""Cheapest settings by engine ("" for all engines) and by kind of cost ("calls" or "seconds")."""


@dataclass(frozen=True)
class EngineDefault:
    """Error and cost of an engine's default method. as_it_is : outcome of its default setting, with a ``reason`` if it
    gave no result; refined : the setting that meets the tolerance; extrapolated : whether by the declared order,
    because no step that was tried is fine enough.
    """

    as_it_is: TriedSetting
    refined: SettingChoice | None
    extrapolated: bool


@dataclass(frozen=True)
class Recommendation:
    """Result of a search for solver settings: winners by engine and cost ("" for all engines), defaults by engine, all
    settings that were tried, and the truth over the searched part and over the whole run.
    """

    scene: PricedScene
    tolerance: float
    search_truth: ReferenceSolution
    truth: ReferenceSolution
    winners: CheapestChoices
    defaults: dict[str, EngineDefault]
    tried: tuple[TriedSetting, ...]

    @property
    def searched_whole_run(self) -> bool:
        """Whether settings were searched over the full duration of the run, not only over its first part."""
        return self.scene.full_duration <= self.scene.searched_duration * (1 + 1e-9)


def price(scene: Any, tolerance: float, quantity: str | None, engines: tuple[str, ...]) -> Recommendation:
    """The cheapest solver settings of a scene that meet a tolerance. InputError for impossible requests, RunFailed
    where no truth can be computed.

    The scene's crew computes what is not timed.
    """
    plain_number = isinstance(tolerance, Real) and not isinstance(tolerance, bool)
    if not (plain_number and math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError("--tolerance", "", tolerance, "must be a finite number above 0, in the quantity's unit")
    to_price = priced_scene(scene, quantity, engines)
    with Crew.of(scene, default_workers=1).at_work(UNTIMED_RUNS_AT_ONCE, *folders_for_workers(scene)) as pool:
        return recommend(to_price, tolerance, pool)


def priced_scene(scene: Any, quantity: str | None, engines: tuple[str, ...]) -> PricedScene:
    """The scene in the form of the price search, made by its system's module; InputError where there is none."""
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
    """The cheapest settings: searched over the first part of the run, timed, and confirmed over the whole run.

    executor : computes what is not timed.
    """
    searched = known = refined_reference(scene, tolerance, scene.searched_duration, executor=executor)
    search = SettingSearch(scene, searched, tolerance, scene.searched_duration).search_all_ladders()
    timed = _timed_settings(search)
    engines = ("", *dict.fromkeys(ladder.engine for ladder in scene.setting_ladders()))
    winners = _cheapest_by_key(timed, [(engine, kind) for engine in engines for kind in ("seconds", "calls")])
    if scene.full_duration > scene.searched_duration * (1 + 1e-9) and winners:
        known, timed, winners = _confirmed_over_whole_run(search, timed, winners, executor)
    known, timed, winners = _with_finer_reference(scene, known, timed, winners, executor)
    defaults = {
        ladder.engine: settings
        for ladder in scene.setting_ladders()
        if ladder.default and (settings := _default_cost(search, ladder, timed)) is not None
    }
    return Recommendation(scene, tolerance, searched, known, winners, defaults, tuple(search.tried))


def _timed_settings(search: SettingSearch) -> list[SettingChoice]:
    """The coarsest setting of every method that meets the tolerance; the fastest ones are timed in several rounds."""
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
        search.scene.full_duration / search.duration,
    )
    seconds = [
        tuple(longer * seconds_by_setting.get(attempt.setting, np.array([attempt.seconds]))) for attempt in attempts
    ]
    return [
        SettingChoice(attempt, attempt.error, longer * attempt.calls, float(np.median(took)), False, took)
        for attempt, took in zip(attempts, seconds, strict=True)
    ]


def _fastest_candidates(tried_settings: list[TriedSetting]) -> list[TriedSetting]:
    """Settings that may be the fastest of an engine or of all; none where there is only one candidate."""
    rivals = dict[TriedSetting, None]()
    for engine in ("", *dict.fromkeys(attempt.setting.engine for attempt in tried_settings)):
        attempts_of_engine = [attempt for attempt in tried_settings if attempt.setting.engine.startswith(engine)]
        least_seconds = min(attempt.seconds for attempt in attempts_of_engine)
        near = [
            attempt
            for attempt in attempts_of_engine
            if attempt.seconds
            <= (TIMED_DEFAULT_SECONDS_RATIO if attempt.setting.default else TIMED_SECONDS_RATIO) * least_seconds
        ]
        rivals |= dict.fromkeys(near if len(near) > 1 else [])
    return list(rivals)


def _interleaved_seconds(search: SettingSearch, rivals: list[TriedSetting]) -> dict[Setting, np.ndarray]:
    """Seconds of each setting in a few rounds, and in more rounds for those not far behind the fastest."""
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


def _seconds_by_round(search: SettingSearch, rivals: list[TriedSetting], round_count: int) -> dict[Setting, np.ndarray]:
    """Processor seconds of each setting in every one of ``round_count`` interleaved rounds."""
    jobs = [partial(search.scene.solve, attempt.setting, search.duration) for attempt in rivals]
    lasted = [attempt.seconds for attempt in rivals]
    seconds_by_setting = interleave(jobs, round_count, SHORTEST_TURN, warm_up_times=lasted, clock=time.process_time)
    return dict(zip((attempt.setting for attempt in rivals), seconds_by_setting, strict=True))


def _cheapest_by_key(timed_choices: list[SettingChoice], cost_keys: Iterable[tuple[str, str]]) -> CheapestChoices:
    """The cheapest setting for each (engine, kind of cost) of ``cost_keys``; keys without one are left out."""
    return {key: best for key in cost_keys if (best := _cheapest(timed_choices, *key)) is not None}


def _cheapest(timed_choices: list[SettingChoice], engine: str, cost_kind: str) -> SettingChoice | None:
    """The setting of an engine with the least cost of a kind. By seconds, which scatter, a default method is preferred
    unless it is clearly slower.
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


def _is_slower(choice: SettingChoice, best_choice: SettingChoice) -> bool:
    """Whether a setting takes longer than another: significantly so, where both were timed in the same rounds."""
    common_rounds = min(len(choice.rounds), len(best_choice.rounds))
    if common_rounds < FEWEST_ROUNDS:
        return choice.seconds > best_choice.seconds
    return paired_ratio(choice.rounds[:common_rounds], best_choice.rounds[:common_rounds])[1] > SLOWER_SECONDS_RATIO


ReferenceAndChoices = tuple[ReferenceSolution, list[SettingChoice], CheapestChoices]


def _confirmed_over_whole_run(
    search: SettingSearch, timed_choices: list[SettingChoice], cheapest: CheapestChoices, executor: Executor | None
) -> ReferenceAndChoices:
    """The winners and defaults that meet the tolerance over the whole run, refined if necessary; with the truth."""
    scene = search.scene
    rung = max(0, search.reference_solution.rung - 1)
    known = refined_reference(scene, search.tolerance, scene.full_duration, rung, False, executor)
    ladders = {f"{choice.engine} {choice.method}": choice for choice in scene.setting_ladders()}
    able = {choice.tried.setting: choice for choice in _winners_and_defaults(timed_choices, cheapest)}
    full_search = SettingSearch(scene, known, search.tolerance, scene.full_duration)
    blocks = [(ladders[setting.curve], choice) for setting, choice in able.items()]
    confirmed = block_results(partial(_valid_over_run, full_search), blocks, executor)
    confirmed_choices = [confirmation.choice for confirmation in confirmed if confirmation.choice is not None]
    search.tried += [attempt for confirmation in confirmed for attempt in confirmation.failed]
    return known, confirmed_choices, _cheapest_by_key(confirmed_choices, cheapest)


def _winners_and_defaults(timed_choices: list[SettingChoice], cheapest: CheapestChoices) -> list[SettingChoice]:
    """The winners and the settings of default methods, without repetition."""
    return list(
        dict.fromkeys([*cheapest.values(), *(choice for choice in timed_choices if choice.tried.setting.default)])
    )


@dataclass(frozen=True)
class _ConfirmedSetting:
    """A setting that meets the tolerance over the whole run, None where there is none, and the attempts that failed for
    another reason than their error.
    """

    choice: SettingChoice | None
    failed: list[TriedSetting] = field(default_factory=list)


def _valid_over_run(search: SettingSearch, ladder_and_choice: tuple[SettingLadder, SettingChoice]) -> _ConfirmedSetting:
    """A setting that meets the tolerance over the whole run: that of the block, or a finer one of its method.

    The seconds of all attempts are scaled from the rounds in which the first one was timed.
    """
    (ladder, choice), failed = ladder_and_choice, list[TriedSetting]()
    i, first = ladder.values.index(choice.tried.setting.value), choice.tried
    for _ in range(CONFIRMATION_LIMIT):
        ratio = ladder.work(first.setting.value, ladder.values[i])
        tried = search.try_setting(ladder.setting(i))
        tried = replace(tried, seconds=ratio * choice.seconds) if tried.seconds else tried
        failed += [tried] if tried.status != "ok" else []
        if search.meets_tolerance(tried):
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


def _with_finer_reference(
    scene: PricedScene,
    reference: ReferenceSolution,
    timed_choices: list[SettingChoice],
    cheapest: CheapestChoices,
    executor: Executor | None,
) -> ReferenceAndChoices:
    """A more exact truth where the errors are close to its uncertainty, and the winners and defaults with their errors
    from it: a setting may be far better than its tolerance asks, and as good as the reference that it was compared
    with.
    """
    shown = _winners_and_defaults(timed_choices, cheapest)
    errors = {choice.tried.setting: choice.error for choice in shown}
    if _needs_finer_reference(reference, errors):
        runs = dict(zip(errors, block_results(partial(_run_over_whole_scene, scene), errors, executor), strict=True))
        reference, errors = _finer_reference(scene, reference, runs, executor)
    choices_with_errors = {
        choice.tried.setting: replace(choice, error=max(errors[choice.tried.setting], reference.uncertainty))
        for choice in shown
    }
    return (
        reference,
        [choices_with_errors.get(choice.tried.setting, choice) for choice in timed_choices],
        {key: choices_with_errors[choice.tried.setting] for key, choice in cheapest.items()},
    )


def _run_over_whole_scene(scene: PricedScene, setting: Setting) -> PricedRun:
    """The quantity along the whole run with a setting."""
    return scene.priced_run(scene.solve(setting, scene.full_duration))


def _needs_finer_reference(reference: ReferenceSolution, errors: dict[Setting, float]) -> bool:
    """Whether errors are too close to the uncertainty of the truth, while a better truth would take only seconds."""
    return (
        min(errors.values(), default=np.inf) < RESOLVED_ERROR_RATIO * reference.uncertainty
        and REFINEMENT_SECONDS_RATIO * reference.seconds < LONG_ROUNDS_SECONDS
    )


def _finer_reference(
    scene: PricedScene, reference: ReferenceSolution, priced_runs: dict[Setting, PricedRun], executor: Executor | None
) -> tuple[ReferenceSolution, dict[Setting, float]]:
    """A truth that is exact enough for the errors of all runs, or the best that time allows, with these errors."""
    errors = {setting: reference.error(answer) for setting, answer in priced_runs.items()}
    while _needs_finer_reference(reference, errors):
        try:
            tolerance = scene.reference_ladder().confirmation_divisor * reference.uncertainty
            finer = refined_reference(
                scene, tolerance, scene.full_duration, reference.rung, second_method=False, executor=executor
            )
        except (InputError, RunFailed):
            break  # as well known as rounding and the reference's finest step let it be
        if not finer.uncertainty < reference.uncertainty:
            break
        reference, errors = finer, {setting: finer.error(answer) for setting, answer in priced_runs.items()}
    return reference, errors


def _default_cost(
    search: SettingSearch, ladder: SettingLadder, timed_choices: list[SettingChoice]
) -> EngineDefault | None:
    """Error and cost of an engine's default setting, and the cost at which its method meets the tolerance."""
    curve = f"{ladder.engine} {ladder.method}"
    tried = [attempt for attempt in search.tried if attempt.setting.curve == curve]
    if not tried:
        return None
    as_it_is = min(tried, key=lambda attempt: abs(np.log(attempt.setting.value / ladder.default)))
    met = next((attempt for attempt in timed_choices if attempt.tried.setting.curve == curve), None)
    clear = [attempt for attempt in tried if attempt.status == "ok"]
    if met is not None or not clear:
        return EngineDefault(as_it_is, met, False)
    finest = min(clear, key=lambda attempt: attempt.setting.value)
    if search.meets_tolerance(finest):  # over the part that was searched, and not over the whole run
        return EngineDefault(as_it_is, None, False)
    finer = (finest.error / search.tolerance) ** (1 / (ladder.order or 1))
    setting = replace(finest.setting, value=finest.setting.value / finer)
    longer = ladder.work(finest.setting.value, setting.value) * search.scene.full_duration / search.duration
    guess = TriedSetting(setting, "ok", "", search.tolerance)
    refined = SettingChoice(guess, search.tolerance, longer * finest.calls, longer * finest.seconds, False)
    return EngineDefault(as_it_is, refined, True)
