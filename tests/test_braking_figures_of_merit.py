"""Formulas of braking held to numbers made by hand."""

import numpy as np
import pytest

from models.brake import figures_of_merit as merit
from models.core.errors import InputError
from models.systems.braking.stops import SampleScatter, scatter_of, welch_test

PAPER = merit.AxleLoads(front=33_600.0, rear=21_800.0, wheelbase=3.61, height=1.2)


def uniform(speed=20.0, deceleration=5.0, step=0.0055):
    """A stop with one deceleration: times, way, speeds."""
    times = np.append(np.arange(0.0, speed / deceleration, step), speed / deceleration)
    return times, speed * times - 0.5 * deceleration * times**2, speed - deceleration * times


def test_the_constants_of_the_regulation_follow_from_its_speeds():
    assert merit.braking_rate(
        40 * merit.METRES_PER_SECOND_OF_KMH, 20 * merit.METRES_PER_SECOND_OF_KMH, 1.0
    ) == pytest.approx(0.566, abs=5e-4)
    assert merit.braking_rate(
        45 * merit.METRES_PER_SECOND_OF_KMH, 15 * merit.METRES_PER_SECOND_OF_KMH, 1.0
    ) == pytest.approx(0.849, abs=5e-4)


def test_a_uniform_stop_has_its_deceleration_by_every_definition():
    times, way, speeds = uniform()
    assert merit.mean_fully_developed_deceleration(times, way, speeds) == pytest.approx(5.0, rel=1e-12)
    assert merit.equivalent_deceleration(20.0, way[-1]) == pytest.approx(5.0, rel=1e-12)
    assert merit.crossing_time(times, speeds, 10.0) == pytest.approx(2.0, rel=1e-12)


def test_mean_fully_developed_leaves_out_build_up_and_creep():
    # 1 s without brakes before a stop at 5 m/s^2: speeds from 0.8 to 0.1 v0 are braked alone
    times, way, speeds = uniform()
    late = np.concatenate(([0.0], times + 1.0)), np.concatenate(([0.0], way + 20.0)), np.concatenate(([20.0], speeds))
    assert merit.mean_fully_developed_deceleration(*late) == pytest.approx(5.0, rel=1e-12)
    assert np.isnan(merit.mean_fully_developed_deceleration(times[:100], way[:100], speeds[:100]))


def test_one_friction_on_both_axles_gives_itself_back_and_is_wholly_used():
    # front alone: z P = k (F1 + h/E z P) + 0.015 F2, solved for z; the rear one likewise
    k, lift = 0.3, PAPER.height / PAPER.wheelbase
    front = (k * PAPER.front + 0.015 * PAPER.rear) / (1.0 - k * lift) / PAPER.weight
    rear = (k * PAPER.rear + 0.010 * PAPER.front) / (1.0 + k * lift) / PAPER.weight
    assert merit.adhesion_front(front, PAPER) == k and merit.adhesion_rear(rear, PAPER) == k
    assert merit.adhesion_of_vehicle(k, k, k, PAPER) == pytest.approx(k, rel=1e-12)
    assert sum(PAPER.dynamic_loads(0.4)) == pytest.approx(PAPER.weight, rel=1e-12)


def test_split_friction_asks_for_the_larger_of_both():
    assert merit.least_braking_rate_on_split(0.2, 0.8) == pytest.approx(0.75 * 1.6 / 5.0)
    assert merit.least_braking_rate_on_split(0.3, 0.35) == 0.3


def test_the_mean_takes_at_most_three_runs_within_five_per_cent():
    assert merit.mean_of_shortest_times(np.array([2.2, 2.0, 2.05, 2.09, 2.08])) == pytest.approx(
        (2.0 + 2.05 + 2.08) / 3
    )
    assert merit.mean_of_shortest_times(np.array([2.0, np.nan, 9.0])) == 2.0
    with pytest.raises(InputError):
        merit.mean_of_shortest_times(np.array([np.nan]))


def test_a_circle_has_yaw_ratio_one():
    assert merit.yaw_rate_ratio(10.0 / 80.0, 10.0, 80.0) == 1.0


def test_locks_are_told_by_wheel_above_a_speed_alone():
    locked = np.array([[1, 0], [1, 1], [0, 1], [1, 1], [1, 1]], bool)
    table = merit.wheel_lock_times(np.full(5, 0.1), locked, np.array([9.0, 8.0, 7.0, 6.0, 1.0]))
    assert table.time == pytest.approx([0.3, 0.3]) and table.share == pytest.approx([0.75, 0.75])
    assert table.longest_lock == pytest.approx([0.2, 0.3])


def test_welch_is_that_of_a_worked_example():
    # means 5 and 7, variances 4 and 9, 10 and 12 values: t = 2 / sqrt(0.4 + 0.75), freedoms 1.3225 / 0.0689
    found = welch_test(SampleScatter(10, 5.0, 2.0), SampleScatter(12, 7.0, 3.0))
    assert found.t == pytest.approx(2.0 / np.sqrt(1.15)) and found.freedoms == pytest.approx(19.19, abs=0.01)
    from scipy.stats import ttest_ind_from_stats

    assert found.p_value == pytest.approx(ttest_ind_from_stats(5.0, 2.0, 10, 7.0, 3.0, 12, equal_var=False).pvalue)
    assert scatter_of(np.array([1.0, 3.0])).deviation == pytest.approx(np.sqrt(2.0))
