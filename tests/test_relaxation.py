"""Tyres whose slip angles lag: the law exact, nothing of it where it is absent, at rest in the end."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from models.brake.controller import NoAntiLock
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.relaxation import DAMPING, TyreLag, advance_all_lagging_slips, lagging_slip, longest_stable_step
from models.brake.surfaces import UNIFORM_ROAD, VehicleOnRoad
from models.systems.braking.procedures import vehicle_and_start_state
from models.systems.braking.run import vehicle_in_engine
from models.systems.braking.scene import build
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import stacked_tables
from validation.braking import plain_sprung as whole
from validation.cases import braking_relaxation as case


def test_the_law_is_exact_whatever_the_step():
    a, u, v, length = 0.02, 8.0, 0.6, 0.5
    once = lagging_slip(a, u, v, 0.1, length)
    assert once == pytest.approx(v / u + (a - v / u) * np.exp(-u * 0.1 / length), rel=1e-14)
    assert lagging_slip(lagging_slip(a, u, v, 0.03, length), u, v, 0.07, length) == pytest.approx(once, rel=1e-14)
    assert lagging_slip(a, -u, v, 0.1, length) == once  # backwards it relaxes as well
    assert lagging_slip(a, 0.0, v, 0.1, length) == a + v * 0.1 / length  # at rest it is a spring
    assert lagging_slip(a, u, v, 9.0, length) == pytest.approx(v / u, rel=1e-14)


def stop(length=None, steer=0.03, substeps=4, duration=20.0, engine="reference"):
    scene = build(
        {
            "title": "t",
            "system": "braking",
            "road": {"stretches": [{"left": "snow"}]},
            "brakes": {"supply": 0.8},
            "pressure": {},
            "run": {"substeps": substeps},
            "procedures": {"j": {"kind": "j_turn", "speed": 9.0, "steer": steer}},
        }
    )
    vehicle, start = vehicle_and_start_state(scene, "j")
    if length is not None:
        vehicle = replace(vehicle, relaxation=np.full(4, length))
    return vehicle_in_engine(vehicle, engine).run(NoAntiLock(4), start, duration)


def test_a_j_turn_with_lag_tends_to_the_one_without_and_mirrors():
    without, little, much = stop(), stop(0.01), stop(0.8)
    y = [path.states[-1, 0, 1] for path in (without, little, much)]
    assert all(
        path.ended_at_rest and not path.states[-1, 1].any() for path in (without, little, much)
    )  # at rest, exactly
    # of 3 m, 1 cm of lag changes 0.2 mm and 80 cm 14 mm
    assert y[1] == pytest.approx(y[0], abs=5e-4) and 0.005 < abs(y[2] - y[0]) < 0.05
    assert abs(much.states[9, 1, 2]) < 0.9 * abs(without.states[9, 1, 2])  # yaw rate builds up later
    assert stop(0.8, -0.03).states[-1, 0, 1] == pytest.approx(-y[2], rel=1e-12)


def test_the_step_is_of_second_order():
    fine = stop(0.5, substeps=16, duration=0.6).states[100, 0]
    errors = [np.abs(stop(0.5, substeps=n, duration=0.6).states[100, 0] - fine).max() for n in (1, 2)]
    assert errors[1] < 0.3 * errors[0] < 1e-5  # a quarter, in m


def test_it_damps_at_rest():
    # a wheel's share of a mass on its tyre alone, at rest along it and pushed aside at 0.3 m/s
    plane, slope, step = plane_of_truck(PAPER_TRUCK), table_of_surface("ice").cornering, 5.5e-3
    lag, lagging, state = (
        TyreLag(np.full(4, 0.3), np.zeros(4)),
        np.zeros(4),
        np.array([[0.0, 0.0, 0.0], [0.0, 0.3, 0.0]]),
    )
    vehicle, way = (
        VehicleOnRoad(plane, np.zeros(4, dtype=int), slope, stacked_tables([table_of_surface("ice")]), UNIFORM_ROAD),
        0.0,
    )
    for _ in range(round(2.0 / step)):
        for half in (True, False):
            advance_all_lagging_slips(state, 0.5 * step, np.zeros(4), vehicle, lag, lagging)
            if half:
                state[1, 1] -= step * 9.81 * slope * lagging.mean()
                way += step * state[1, 1]
    assert abs(state[1, 1]) < 1e-3 and abs(way) < 0.02  # without the damper it keeps rocking at 0.3 m/s


def test_a_run_without_it_imports_nothing_of_it():
    parts = "models.systems.braking.run, models.engines.braking_sprung, models.engines.braking_sprung_plain"
    code = f"import sys, {parts}; sys.exit(any('relaxation' in name for name in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("lively", [9.81, 25.0])
def test_a_vehicle_at_rest_rocks_up_in_longer_steps_than_the_longest_and_in_no_shorter_ones(lively):
    slope, length = 20.0, 0.3
    rate, damped = slope * lively / length, 2.0 * DAMPING * slope * lively / np.sqrt(slope * 9.81 * length)
    for factor, grows in ((0.99, False), (1.01, True)):
        step = factor * longest_stable_step(slope, lively, length)
        # y' = y + h v, then v' = v - h (w^2 y' + c v): way and speed across
        across = np.array([[1.0, step], [-step * rate, 1.0 - step * damped - step**2 * rate]])
        assert (np.abs(np.linalg.eigvals(across)).max() > 1.0) == grows


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_chassis_in_the_plane_that_an_engine_carries_lags_as_by_its_own_steps(engine):
    alone, in_engine = (stop(0.5, duration=0.5, engine=name).states[-1, 0] for name in ("reference", engine))
    without = stop(duration=0.5).states[-1, 0]
    assert in_engine == pytest.approx(alone, abs=1e-5) and abs(without[1] - alone[1]) > 1e-3


def test_slip_angles_on_a_suspension_rise_by_the_way_and_tend_to_those_without_lag():
    assert case.slip_rise_error("exudyn") < 2e-6 and case.relaxation_shift_ratio("exudyn") == pytest.approx(
        2.0, abs=0.05
    )


@pytest.mark.grounds("plain counterpart")
def test_a_stop_on_a_suspension_is_that_of_plain_code():
    found = whole.run(whole.car(), "exudyn", 0.05, with_lags=True)
    plain = whole.plain_run("car", 0.05, with_lags=True)
    assert whole.path_difference(found, plain) < 1e-10
    assert whole.path_difference(found, whole.run(whole.car(), "exudyn", 0.05)) > 1e-3
