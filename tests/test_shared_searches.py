"""Fits, branches of cycles, choices and prices are the same bits by one process and by workers, refusals too."""

from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
import pytest

from models.advice.choice.choose import EffectChoice, EffectChooser
from models.advice.choice.variants import Variants
from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.advice.price.recommendation import SettingChoice, _valid_over_run, recommend
from models.advice.price.search import SettingSearch, TriedSetting
from models.advice.price.truth import ReferenceSolution, refined_reference
from models.core.errors import InputError, RunFailed
from models.ensemble.runner import block_results
from models.ensemble.workers import process_pool
from models.identification.fit import fit
from models.identification.problem import (
    FAILED_RESIDUAL,
    FitClock,
    IdentificationProblem,
    IdentifiedParameter,
    measured_channel,
)
from models.identification.uncertainty import uncertainty
from models.rail.equations import WheelsetEquations
from models.rail.limit_cycle import branch_of_orbits, orbit_of_small_amplitude, refined_orbit
from models.rail.wheelset import CHOSEN_WHEELSET
from models.systems.pitch_plane.scene import build

CREWS = pytest.mark.parametrize("pool", [2, pytest.param(5, marks=pytest.mark.full)], indirect=True)


@pytest.fixture(scope="module")
def pool(request):
    with process_pool(request.param) as executor:
        yield executor


def halved(number):
    """Half of an even number; the others are refused, 7 as a run that failed."""
    if number == 7:
        raise RunFailed("halves", "seven", 0.5)
    if number % 2:
        raise InputError("numbers.toml", "number", number, "must be even")
    return number // 2


@CREWS
def test_errors_of_workers_are_those_of_this_process(pool):
    assert block_results(halved, range(0, 40, 2), pool) == list(range(20)) and block_results(halved, [], pool) == []
    for numbers, kind in (([2, 3, 7, 5], InputError), ([2, 4, 7, 3], RunFailed)):
        told = []
        for executor in (None, pool):
            with pytest.raises(kind) as error:
                block_results(halved, numbers, executor)
            told.append((str(error.value), vars(error.value)))
        assert told[0] == told[1] and ("= 3" in told[0][0] or "seven" in told[0][0])


def bent(values):
    """A model that bends in its second parameter, and cannot be run beyond a first of 1.5."""
    if values[0] > 1.5:
        raise RunFailed("bent", "too much of it")
    times = np.linspace(0.0, 1.0, 200)
    return {"y": (times, values[0] * np.exp(values[1] * times) + values[2] * times)}


def bent_problem():
    times, random = np.linspace(0.0, 1.0, 200), np.random.default_rng(5)
    clock = FitClock(times)
    values = np.exp(-2.0 * times) + 0.3 * times + 0.02 * random.standard_normal(200)
    parameters = [
        IdentifiedParameter("a", 0.7),
        IdentifiedParameter("b", -1.0, upper_bound=-0.1),
        IdentifiedParameter("c", 0.1),
    ]
    return IdentificationProblem(bent, parameters, [measured_channel("y", "-", (times, values), clock)], clock)


@CREWS
def test_a_fit_is_the_same_by_workers(pool):
    alone, shared = (fit(bent_problem(), executor=executor) for executor in (None, pool))
    assert np.array_equal(alone.values, shared.values) and alone.cost == shared.cost and alone.converged
    assert np.array_equal(uncertainty(alone).covariance, uncertainty(shared, pool).covariance)
    assert alone.values == pytest.approx([1.0, -2.0, 0.3], abs=0.15)


@CREWS
def test_columns_of_a_jacobian_go_backward_where_the_model_fails_or_a_bound_lies(pool):
    problem = bent_problem()
    values = np.array([1.5, -0.1, 0.2])  # forward the first fails, and the second has a bound
    columns = problem.jacobian(values, executor=pool)
    assert np.array_equal(columns, problem.jacobian(values)) and np.abs(columns).max() < FAILED_RESIDUAL
    times, weights = np.linspace(0.0, 1.0, 200), problem.weights[0]
    slopes = [np.exp(-0.1 * times), 1.5 * times * np.exp(-0.1 * times), times]
    exact = np.stack([slope * each.scale for slope, each in zip(slopes, problem.parameters, strict=True)], axis=-1)
    np.testing.assert_allclose(columns[0], exact * weights[:, None], atol=1e-3)  # half a step of 1e-4 by the bend


def test_a_branch_of_cycles_is_the_same_by_workers():
    with process_pool(2) as pool:
        runs = []
        for executor in (None, pool):
            first = orbit_of_small_amplitude(WheelsetEquations(CHOSEN_WHEELSET, 60.0, cells=5), 1e-3, 1e-3, executor)
            runs.append(
                [
                    first,
                    *(refined_orbit(orbit, "speed", executor) for orbit in branch_of_orbits(first, [5e-3], executor)),
                ]
            )
    for alone, shared in zip(*runs, strict=True):
        assert np.array_equal(alone.return_slopes, shared.return_slopes) and np.array_equal(alone.state, shared.state)
        assert (alone.speed, alone.period, alone.multiplier) == (shared.speed, shared.period, shared.multiplier)
    assert runs[0][0].speed != runs[0][1].speed and runs[0][1].error > 0.0


def half_car():
    road = {"source": "study", "speed": 20.0}
    table = {
        "title": "t",
        "run": {"duration": 0.96, "step": 1e-3},
        "effects": {
            "road": road,
            "lift_off": {},
            "pitch_spring": {"stiffness": 100.0},
            "gyro": {"deviation": 1e-3, "sampling_rate": 100.0},
        },
    }
    return build(table, "t")


def told(choice: EffectChoice):
    """All of a choice but its seconds."""
    return {name: str(value) for name, value in asdict(replace(choice, seconds=())).items()}


def test_a_choice_is_the_same_by_workers_and_runs_ahead_that_nobody_asks_for_do_not_count():
    with process_pool(2) as pool:
        choosers = [
            EffectChooser(half_car(), "reference", ["pitch", "rms f1"], 0.02, executor=executor)
            for executor in (None, pool)
        ]
        alone, shared = (chooser.choose() for chooser in choosers)
        assert told(alone) == told(shared) and alone.left_out and alone.calls_of_search > 0
        variants = Variants(half_car(), "reference", pool)
        variants.compute_in_advance((frozenset([name]), 1) for name in variants.effects)
        assert len(variants._computed_in_advance) == len(variants.effects) > 3 and variants.calls == 0
        first = variants.quantities_of_run(["gyro"])
    assert len(variants._computed_in_advance) == len(variants.effects) - 1 and variants.calls == first.counts["calls"]
    here = Variants(half_car(), "reference").quantities_of_run(["gyro"])
    assert first.counts == here.counts and first.quantities.keys() == here.quantities.keys()
    for name, quantity in here.quantities.items():
        assert all(map(np.array_equal, quantity.case_values, first.quantities[name].case_values)), name


STEPS = tuple(0.1 / 2**k for k in range(10))


@dataclass(frozen=True)
class Planted:
    """y = t^2 sin 5t with an error of 40 h^2, more of it in the second half; the reference errs as its steps say."""

    title, quantity, unit, kink_period, note, work_count_name = "planted", "y", "N", 0.0, "", "force calls"
    full_duration: float = 2.0
    searched_duration: float = 1.0

    def setting_ladders(self):
        return [SettingLadder("exudyn", "second", STEPS, 2), SettingLadder("exudyn", "first", STEPS, 1, default=0.05)]

    def reference_ladder(self):
        return SettingLadder("reference", "fine", tuple(2e-2 / 2**k for k in range(9)), 4)

    def second_setting(self, last):
        return None

    def solve(self, setting, duration):
        if setting.value > 0.06:
            raise RunFailed("exudyn", "unstable", 0.5)
        return setting, duration

    def priced_run(self, solution):
        setting, duration = solution
        times = np.linspace(0.0, duration, round(duration / setting.value) + 1)
        size = {"second": 40.0, "first": 1.0, "fine": 1e4}[setting.method]
        values = times**2 * np.sin(5 * times) + size * setting.value**setting.order * (1.0 + 5.0 * (times > 1.5))
        return PricedRun(times, values[:, None], {"steps": len(times) - 1, "force calls": 4 * (len(times) - 1)})

    def scene_file_lines(self, setting):
        return [setting.label()]


def same(alone: ReferenceSolution, shared: ReferenceSolution):
    keys = ("uncertainty", "origin", "rung", "broken_assumptions")
    equal = np.array_equal(alone.run.values, shared.run.values)
    return equal and all(getattr(alone, key) == getattr(shared, key) for key in keys)


@CREWS
def test_what_a_price_does_not_time_is_the_same_by_workers(pool):
    alone, shared = (refined_reference(Planted(), 1e-2, 2.0, executor=executor) for executor in (None, pool))
    assert same(alone, shared) and alone.rung > 0
    over, blocks = SettingSearch(Planted(), alone, 1e-2, 2.0), []
    for ladder, i in zip(Planted().setting_ladders(), (2, 4), strict=True):
        tried = TriedSetting(ladder.setting(i), "ok", seconds=0.5, calls=10)
        blocks.append((ladder, SettingChoice(tried, 0.0, 10, 0.5, False, (0.4, 0.5, 0.6))))
    here, there = (block_results(partial(_valid_over_run, over), blocks, executor) for executor in (None, pool))
    assert here == there and all(each.choice.confirmed and each.choice.error < 1e-2 for each in here)
    assert here[0].choice.seconds == 0.5 * STEPS[2] / here[0].choice.tried.setting.value > 0.5


def test_a_price_by_workers_names_the_settings_of_one_process():
    with process_pool(2) as pool:
        alone, shared = (recommend(Planted(), 1e-2, executor) for executor in (None, pool))
    assert same(alone.truth, shared.truth) and same(alone.search_truth, shared.search_truth)
    for engine in ("", "exudyn"):
        by_itself, by_workers = (each.winners[engine, "calls"] for each in (alone, shared))
        assert _facts(by_itself) == _facts(by_workers)
        assert by_itself.confirmed and by_itself.error <= 1e-2 and isinstance(by_itself.tried.setting, Setting)


def _facts(choice):
    """What must be the same bits of a choice of settings."""
    return choice.tried.setting, choice.error, choice.calls
