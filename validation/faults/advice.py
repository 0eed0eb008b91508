"""Faults planted in the recommendation of engine, method and step, and the checks that see them.

The test problem has a closed form, y' = y cos t, y = exp(sin t), so that the error of each setting is known without a
search.
"""

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np

from models.advice.price import PricedRun, SettingLadder, recommendation, search, truth
from models.advice.price.problem import Setting
from models.advice.price.recommendation import Recommendation, SettingChoice
from models.advice.price.truth import ReferenceSolution, values_at
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch

STEPS_TRIED = tuple(0.2 / n for n in (1, 2, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 32, 40, 64, 100, 160, 250))
METHOD_STAGES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "Euler": ((0.0,), (1.0,)),
    "midpoint": ((0.0, 0.5), (0.0, 1.0)),
    "RK4": ((0.0, 0.5, 0.5, 1.0), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}
"""Integrator -> times of its stages within a step (divided by the step), and weights of the stages. Each stage uses the
slope of the previous one."""
LOOSE_TOLERANCE, TIGHT_TOLERANCE = 0.03, 6e-7
"""Tolerance that the default setting meets with the fewest force calls, and tolerance that another method does."""
CALL_SECONDS = 1e-6
"""Duration (s) of a force call by the simulated clock of these checks."""


class _Clock:
    """Simulated clock that advances with force calls only, so that the setting recommended by computing time is the
    same on any machine."""

    def __init__(self) -> None:
        self.now = 0.0

    def process_time(self) -> float:
        """Simulated time (s)."""
        return self.now

    perf_counter = process_time


CLOCK = _Clock()


@dataclass(frozen=True)
class Swing:
    """Test problem y' = y cos t in the form of ``models.advice.price.PricedScene``. Its error keeps growing after the
    part of the run in which settings are searched."""

    title, quantity, unit, kink_period, note, work_count_name = "y' = y cos t", "y", "", 0.0, "", "force calls"
    full_duration, searched_duration = 8.0, 2.0

    def setting_ladders(self) -> list[SettingLadder]:
        """Settings (step sizes) of four methods of an engine: the default has order 2, and the method "broken" gives
        NaN."""
        return [
            SettingLadder("mujoco", "RK4", STEPS_TRIED, 4),
            SettingLadder("mujoco", "midpoint", STEPS_TRIED, 2, default=STEPS_TRIED[0]),
            SettingLadder("mujoco", "Euler", STEPS_TRIED, 1),
            SettingLadder("mujoco", "broken", STEPS_TRIED, 1),
        ]

    def reference_ladder(self) -> SettingLadder:
        """Settings of the reference: RK4 with successively halved steps. The coarsest is no more accurate than some
        settings to be judged."""
        return SettingLadder("reference", "RK4", tuple(0.1 / 2**k for k in range(8)), 4)

    def second_setting(self, reference_setting: Setting) -> None:
        """Returns no second reference method, as the checks know the closed form."""

    def solve(self, setting: Setting, duration: float) -> tuple[np.ndarray, np.ndarray, int]:
        """Times (s) and values y of the solution with a setting, and number of force calls."""
        n = round(duration / setting.value)
        stage_positions, weights = METHOD_STAGES.get(setting.method, METHOD_STAGES["Euler"])
        values = [1.0]
        for i in range(n):
            values.append(_step(i * setting.value, values[-1], setting.value, stage_positions, weights))
        CLOCK.now += CALL_SECONDS * len(stage_positions) * n
        sample_times = setting.value * np.arange(n + 1)
        swing = (
            np.where(sample_times < 0.1, np.exp(np.sin(sample_times)), np.nan) if setting.method == "broken" else values
        )
        return sample_times, np.array(swing), len(stage_positions) * n

    def priced_run(self, solution: tuple[np.ndarray, np.ndarray, int]) -> PricedRun:
        """A solution as a priced run: times, values y and number of force calls."""
        times, values, calls = solution
        return PricedRun(times, values[:, None], {"force calls": calls})

    def scene_file_lines(self, setting: Setting) -> list[str]:
        """Lines of a scene file that select a setting; here its label."""
        return [setting.label()]


def _step(
    time: float, y: float, time_step: float, stage_positions: tuple[float, ...], stage_weights: tuple[float, ...]
) -> float:
    slope = total = 0.0
    for stage_position, weight in zip(stage_positions, stage_weights, strict=True):
        slope = (y + stage_position * time_step * slope) * math.cos(time + stage_position * time_step)
        total += weight * slope
    return y + time_step * total


@cache
def _error(integration_setting: Setting) -> float:
    """Largest true error of a setting over the complete run; infinite if a value is not finite."""
    sample_times, values, _ = Swing().solve(integration_setting, Swing.full_duration)
    worst = float(np.abs(values - np.exp(np.sin(sample_times))).max())
    return worst if math.isfinite(worst) else math.inf


@cache
def _fewest_calls(tolerance: float) -> int:
    """Fewest force calls with which a setting keeps the tolerance, by running all settings."""
    swing = Swing()
    return min(
        swing.solve(setting, swing.full_duration)[2]
        for ladder in swing.setting_ladders()
        for setting in map(ladder.setting, range(len(STEPS_TRIED)))
        if _error(setting) <= tolerance
    )


def _choice_for(tolerance: float) -> Recommendation:
    with ExitStack() as patched:
        for module in (recommendation, search, truth):
            patched.enter_context(patch.object(module, "time", CLOCK))
        patched.enter_context(patch.object(recommendation, "SHORTEST_TURN", 0.0))  # a turn is a run
        return recommendation.recommend(Swing(), tolerance)


def _largest_over_recommended(
    size_of_choice: Callable[[SettingChoice, float], float],
    cost_kind_prefix: str = "",
    tolerances: tuple[float, ...] = (TIGHT_TOLERANCE,),
) -> float:
    """Largest ``size_of_choice`` over tolerances and the settings recommended for a kind of cost ("calls" or
    "seconds"); infinite where none is recommended.
    """
    return max(
        max(
            (
                size_of_choice(choice, tolerance)
                for (_, cost_kind), choice in _choice_for(tolerance).winners.items()
                if cost_kind.startswith(cost_kind_prefix)
            ),
            default=math.inf,
        )
        for tolerance in tolerances
    )


def _error_by_tolerance(setting_choice: SettingChoice, tolerance: float) -> float:
    return _error(setting_choice.tried.setting) / tolerance


def _log_error_ratio(setting_choice: SettingChoice, tolerance: float) -> float:
    return abs(math.log(max(setting_choice.error, 1e-300) / min(_error(setting_choice.tried.setting), 1e300)))


def _excess_calls(setting_choice: SettingChoice, tolerance: float) -> float:
    return setting_choice.calls / _fewest_calls(tolerance) - 1.0


CHECKS = {
    "held": Check("true error by the tolerance", "", 1.0, lambda: _largest_over_recommended(_error_by_tolerance)),
    "told": Check(
        "logarithm of predicted by true error",
        "",
        0.1,
        lambda: _largest_over_recommended(_log_error_ratio, "", (LOOSE_TOLERANCE, TIGHT_TOLERANCE)),
    ),
    "calls": Check(
        "force calls beyond the fewest that hold the tolerance",
        "",
        1e-12,
        lambda: _largest_over_recommended(_excess_calls, "calls", (LOOSE_TOLERANCE, TIGHT_TOLERANCE)),
    ),
    "seconds": Check(
        "the same of the setting recommended by seconds, where a call costs the same in all",
        "",
        recommendation.SLOWER_SECONDS_RATIO - 1.0,
        lambda: _largest_over_recommended(_excess_calls, "seconds"),
    ),
}


def _advice_patch(
    function_name: str, change_function: Callable[[Any], Any], module_name: str = "recommendation"
) -> Patch:
    return attribute_patch(f"models.advice.price.{module_name}:{function_name}", change_function)


def _tenfold_smaller_errors(original_function: Any) -> Any:
    """Fault: errors of the recommended settings are reported ten times too small."""

    def planted(*arguments: Any) -> Any:
        known, timed, winners = original_function(*arguments)
        return known, timed, {key: replace(choice, error=choice.error / 10.0) for key, choice in winners.items()}

    return planted


def _most_accurate_choice(timed_choices: list[SettingChoice], engine: str, cost_kind: str) -> SettingChoice | None:
    return min(timed_choices, key=lambda choice: choice.error, default=None)


def _dearest_choice(timed_choices: list[SettingChoice], engine: str, cost_kind: str) -> SettingChoice | None:
    return max(timed_choices, key=lambda choice: choice.calls, default=None)


def _mean_error(self: ReferenceSolution, compared_run: PricedRun) -> float:
    exact = values_at(self.run, compared_run.times, self.kink_period)
    return float(np.abs(compared_run.values - exact).mean()) if np.isfinite(compared_run.values).all() else np.inf


def _error_without_nan(self: ReferenceSolution, compared_run: PricedRun) -> float:
    exact = values_at(self.run, compared_run.times, self.kink_period)
    return float(np.nanmax(np.abs(compared_run.values - exact)))


def _coarsest_reference(
    scene: Any, setting_ladder: SettingLadder, tolerance: float, duration: float, first_rung: int, executor: object
) -> Any:
    return scene.priced_run(scene.solve(setting_ladder.setting(0), duration)), 0, 0.0, 0.0, {}


FAULTS = (
    CampaignFault(
        "predicted error a tenth of what was measured",
        "recommendation",
        _advice_patch("_with_finer_reference", _tenfold_smaller_errors),
    ),
    CampaignFault(
        "the most accurate setting wins, not the cheapest",
        "recommendation",
        _advice_patch("_cheapest", lambda _: _most_accurate_choice),
    ),
    CampaignFault("the dearest setting wins", "recommendation", _advice_patch("_cheapest", lambda _: _dearest_choice)),
    CampaignFault(
        "the engine's default dropped from the race",
        "recommendation",
        _advice_patch(
            "_timed_settings",
            lambda real: lambda search: [timed for timed in real(search) if not timed.tried.setting.default],
        ),
    ),
    CampaignFault(
        "the default kept whatever it costs",
        "recommendation",
        _advice_patch("_is_slower", lambda _: lambda rival, best: False),
    ),
    CampaignFault(
        "judged over the part that is searched alone",
        "recommendation",
        _advice_patch(
            "_confirmed_over_whole_run",
            lambda _: lambda search, timed, winners, _executor: (search.reference_solution, timed, winners),
        ),
    ),
    CampaignFault(
        "mean difference for the largest",
        "truth",
        _advice_patch("ReferenceSolution.error", lambda _: _mean_error, "truth"),
    ),
    CampaignFault(
        "what is no number left out of the error",
        "truth",
        _advice_patch("ReferenceSolution.error", lambda _: _error_without_nan, "truth"),
    ),
    CampaignFault(
        "the reference's first step taken for the truth",
        "truth",
        _advice_patch("_settled_answer", lambda _: _coarsest_reference, "truth"),
    ),
    CampaignFault(
        "a tolerance three times too wide",
        "search",
        _advice_patch(
            "SettingSearch.largest_allowed_error", lambda _: property(lambda self: 3.0 * self.tolerance), "search"
        ),
    ),
)

CAMPAIGN = Campaign("planted.advice", "the recommendation of a setting", "cost", CHECKS, FAULTS)
