"""Errors that results state: Richardson's estimate on signals whose error is known, warnings and refusals."""

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from models.core.discretisation import (
    REFUSED_SHARE,
    WARNED_SHARE,
    RunSeries,
    error_estimate,
    error_estimates_of,
    error_lines,
    finite_rms,
    nearest_rows,
    not_estimated,
    root_mean_square,
    sampling_error,
    with_estimated_errors,
    with_sampling_error,
    with_stated_errors,
)
from models.core.errors import RunFailed
from models.core.result import Channel, Result, result

STEP, DURATION = 0.01, 4.0


@dataclass(frozen=True)
class Scene:
    """What a result asks of a scene."""

    title = "a sine"
    file = "sine.toml"
    system = "sine"

    def table(self):
        """No scene's table."""
        return {}


def marched(step: float, order: int, size: float, share: float = 1.0) -> RunSeries:
    """A sine with an error of ``size`` times the steps' power, that grows along the run."""
    times = step * np.arange(round(share * DURATION / step) + 1)
    return RunSeries(times, {"heave": np.sin(5.0 * times) + size * step**order * np.cos(7.0 * times)})


def run_of(series: RunSeries) -> Result:
    channels = {name: Channel("time", values, "m") for name, values in series.channels.items()}
    return result(Scene(), channels, {"time": Channel("time", series.times, "s")}, engine="reference")


def told(order: int, size: float, declared: int, step: float = STEP) -> Result:
    fine = marched(step, order, size)
    return with_estimated_errors(
        run_of(fine), fine, lambda factor, share: marched(factor * step, order, size, share), declared, step
    )


@pytest.mark.parametrize(("order", "declared"), [(4, 4), (2, 4), (1, 4), (2, 2)])
def test_the_error_is_told_at_the_order_that_is_seen(order, declared):
    size = 1e-3 / STEP**order
    (told_error,) = error_estimates_of(told(order, size, declared)).values()
    true = 1e-3 * math.sqrt(np.mean(np.cos(7.0 * marched(STEP, order, size).times) ** 2))
    assert told_error.error == pytest.approx(true, rel=0.1) and told_error.order == pytest.approx(order, abs=0.1)
    assert told_error.share == pytest.approx(true / np.std(np.sin(5.0 * np.arange(0, 4, 0.01))), rel=0.1)


def test_an_order_that_is_taken_for_granted_would_be_caught():
    """Planted fault: a rough road lowers the order, and who does not observe it tells a twentieth of the error."""
    fine, coarse = (marched(factor * STEP, 1, 1.0).channels["heave"] for factor in (1, 2))
    rows = nearest_rows(marched(STEP, 1, 1.0).times, marched(2 * STEP, 1, 1.0).times)
    blind = error_estimate(fine[rows], coarse, 4.0, STEP)
    assert blind.error < 0.2 * error_estimates_of(told(1, 1.0, 4))["heave"].error


def test_a_large_error_is_a_warning_with_the_step_that_cures_it():
    size = 0.05 / STEP**2
    run = told(2, size, 2)
    (line,) = error_lines(run)
    advised = error_estimates_of(run)["heave"].step
    assert (
        "WARNING, use at most" in line
        and f"{advised:g} s" in line
        and error_estimates_of(run)["heave"].share > WARNED_SHARE
    )
    assert error_estimates_of(told(2, size, 2, advised))["heave"].share < WARNED_SHARE


def test_what_is_no_answer_is_refused_with_the_step_to_use():
    size = 2.0 / STEP**2
    with pytest.raises(RunFailed, match=r"this is no answer: heave errs by .* use at most") as refusal:
        told(2, size, 2)
    partial = error_estimates_of(refusal.value.partial)["heave"]
    assert (
        partial.share > REFUSED_SHARE
        and error_estimates_of(told(2, size, 2, partial.step))["heave"].share < WARNED_SHARE
    )


def test_where_no_longer_step_can_be_half_of_it_tells():
    def only_shorter(factor: float, share: float) -> RunSeries:
        if factor > 1.0:
            raise RunFailed("reference", "unstable")
        return marched(factor * STEP, 2, 1.0, share)

    fine = marched(STEP, 2, 1.0)
    (one,) = error_estimates_of(with_estimated_errors(run_of(fine), fine, only_shorter, 2, STEP)).values()
    assert one.error == pytest.approx(STEP**2 * math.sqrt(0.5), rel=0.15)


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 5, 7])
def test_longer_steps_that_outlast_a_run_tell_nothing(steps):
    """A rerun of at least one step, as engines make it, lies beyond a run of one: half the step tells instead."""

    def heave(factor: float, share: float) -> RunSeries:
        times = factor * STEP * np.arange(max(1, math.floor(share * steps / factor + 1e-9)) + 1)
        return RunSeries(times, {"heave": (1.0 + times + STEP**2 * factor**2 * times)[:, None]})

    fine = heave(1.0, 1.0)
    channels = {"heave": Channel(("time", "place"), fine.channels["heave"], "m")}
    made = result(Scene(), channels, {"time": Channel("time", fine.times, "s")}, engine="reference")
    (one,) = error_estimates_of(with_estimated_errors(made, fine, heave, 2, STEP)).values()
    assert one.error == pytest.approx(STEP**2 * math.sqrt(np.mean(fine.times**2)), rel=0.5)


def test_what_rests_has_no_error_and_no_warning():
    def rests(factor: float, share: float) -> RunSeries:
        times = factor * STEP * np.arange(round(share * DURATION / (factor * STEP)) + 1)
        return RunSeries(times, {"heave": np.zeros(len(times))})

    (one,) = error_estimates_of(
        with_estimated_errors(run_of(rests(1.0, 1.0)), rests(1.0, 1.0), rests, 4, STEP)
    ).values()
    assert one.share == 0.0 and not one.warned


def test_a_run_in_which_nothing_changes_says_so():
    run = run_of(marched(STEP, 4, 0.0))
    assert error_lines(with_stated_errors(run, {}, "runs in longer steps")) == [
        "error not estimated: none of its channels changes"
    ]


def test_reasons_and_chance_are_told():
    run = run_of(marched(STEP, 4, 0.0))
    not_estimated(run, "the switches of the controller do not repeat")
    assert error_lines(run) == ["error not estimated: the switches of the controller do not repeat"]
    with_sampling_error(run, {"heave": sampling_error(0.1, 1.0, "m", 100)}, 100)
    assert error_lines(run)[1] == "standard error of 100 paths at most 10 % (heave: 0.1 m)"
    assert json.loads(run.data.attrs["error"])["chance"]["channels"]["heave"]["step"] == 2500


def test_a_root_mean_square_of_nothing_is_zero_and_that_of_finite_values_leaves_out_others():
    assert root_mean_square(np.array([[3.0], [-4.0]])) == finite_rms(np.array([3.0, np.nan, -4.0, np.inf])) == 12.5**0.5
    assert root_mean_square(np.empty(0)) == finite_rms(np.full(2, np.nan)) == 0.0
