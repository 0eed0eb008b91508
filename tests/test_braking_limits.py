"""Where braking ends: wheels that lift, what rolls over or folds, valves that apply slowly, input beyond physics."""

import numpy as np
import pytest

from models.brake.controller import SLOW, Command, Sample
from models.brake.plane_step import redistribute_negative_loads
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.port.ask import STATES_WITH_SLOW_APPLY, ControllerFailed, usable_command
from models.brake.quarter import QuarterVehicle
from models.brake.trailer import CHOSEN_TRAILER, plane_of_train
from models.core.errors import InputError, RunFailed
from models.systems.braking.procedures import vehicle_and_start_state
from models.systems.braking.run import run
from models.systems.braking.scene import build
from validation.braking.random_stops import random_stop
from validation.cases import braking_limits as rows

GIVEN = Sample(3, 16_500_000, np.ones(4), True, 6.0, 10.0)


def scene(**tables):
    return build({"title": "t", "system": "braking", "procedures": {"stop": {"speed": 2.0}}, **tables}, "t.toml")


@pytest.mark.parametrize("loads", [(9e3, 24e3, -4e3, 26e3), (-1.0, 30e3, 8e3, 17e3), (20e3, 25e3, -2e3, 12e3)])
@pytest.mark.grounds("closed form")
def test_three_wheels_that_stay_hold_weight_and_moments(loads):
    place, shared = plane_of_truck(PAPER_TRUCK).place, np.array(loads)
    redistribute_negative_loads(shared, place)
    assert shared.min() >= 0.0 and shared.sum() == pytest.approx(sum(loads), rel=1e-12)
    assert shared @ place == pytest.approx(np.array(loads) @ place, rel=1e-9)


@pytest.mark.parametrize(("loads", "side"), [((-3e3, 30e3, -4e3, 26e3), (0, 2)), ((30e3, 25e3, -4e3, -2e3), (2, 3))])
@pytest.mark.grounds("closed form")
def test_beyond_balance_two_wheels_bear_nothing(loads, side):
    shared = np.array(loads)
    redistribute_negative_loads(shared, plane_of_truck(PAPER_TRUCK).place)
    assert (shared[list(side)] == 0.0).all() and shared.sum() == pytest.approx(sum(loads))


def test_a_stop_at_the_edge_of_locking_finishes():
    steered = {"stop": {"kind": "j_turn", "speed": 15.0, "steer": 0.02}}
    path = run(
        scene(
            load_transfer={"front": 0.3},
            brakes={"supply": 5.0},
            road={"stretches": [{"left": "dry"}]},
            procedures=steered,
        )
    ).detail
    assert path.ended_at_rest and path.times[-1] == pytest.approx(2.301, abs=0.01)


def test_random_stops_are_the_same_for_the_same_numbers_and_are_built():
    assert random_stop(1, 2) == random_stop(1, 2) != random_stop(1, 3)
    for number in range(20):
        build(random_stop(5, number))


def test_rows_of_limits_hold():
    found = [
        rows._jackknife_row(),
        *rows._rollover_rows(),
        rows._slow_pressure_rise_row(),
        rows._limit_cycle_row(),
        rows._split_friction_yaw_row(1.0),
    ]
    assert [row.id for row in found if row.status != "passed"] == []


def test_valves_apply_slowly_only_where_the_scene_has_them():
    with pytest.raises(ControllerFailed, match=r"2 is none of -1, 0, 1$|2 is none of -1, 0, 1 "):
        usable_command(Command(valves=np.full(4, SLOW)), GIVEN)
    assert (usable_command(Command(valves=np.full(4, SLOW)), GIVEN, STATES_WITH_SLOW_APPLY).valves == SLOW).all()
    phases = {"kind": "acceleration_phases", "parameters": {"slow": True}}
    with pytest.raises(InputError, match=r"controller.parameters.slow.*pressure.slow"):
        run(scene(controller=phases))
    with pytest.raises(InputError, match=r"pressure.slow = 0.01: must be at least fill, 0.15 s"):
        scene(pressure={"slow": 0.01})
    fast, slow = (
        run(
            scene(
                controller=phases | {"parameters": {"slow": value, "cut_off": 0.0}},
                pressure={"slow": 2.0},
                procedures={"stop": {"speed": 11.0}},
                run={"duration": 2.0},
            )
        ).detail
        for value in (False, True)
    )
    assert not np.array_equal(fast.pressures, slow.pressures)


def test_what_cannot_be_is_refused_with_its_value():
    with pytest.raises(ControllerFailed, match="too high: a pressure of 299 bar, above the 6 bar"):
        usable_command(Command(pressures=np.full(4, 299.0)), GIVEN, maximum_pressure=6.0)
    with pytest.raises(ControllerFailed, match="wrong frame: complex"):
        usable_command(Command(pressures=np.full(4, 1j)), GIVEN)
    with pytest.raises(InputError, match=r"mass = 0.1: must be above 322.8 kg"):
        vehicle_and_start_state(scene(vehicle={"override": {"mass": 0.1}}), "stop")
    with pytest.raises(InputError, match=r"mass = 200.0: must be above"):
        plane_of_train(PAPER_TRUCK, CHOSEN_TRAILER.model_copy(update={"mass": 100.0, "drawbar_mass": 100.0}))
    with pytest.raises(ValueError, match="J / r"):
        QuarterVehicle(mass=50.0, radius=0.5, spin_inertia=13.35)
    with pytest.raises(InputError, match=r"brakes.supply = 10000.0: must be at most 300 bar"):
        scene(brakes={"supply": 1e4})
    with pytest.raises(InputError, match=r"brakes.rear.gradient = 1000000000.0: must be at most"):
        scene(brakes={"rear": {"gradient": 1e9}})


def test_a_train_that_folds_ends_with_its_angle_and_keeps_its_path():
    with pytest.raises(RunFailed, match=r"jackknifes: the drawbar against the truck at -?\d+\.\d deg, limit") as told:
        run(
            scene(
                trailer=CHOSEN_TRAILER.model_copy(update={"fold": 0.02}).model_dump(),
                run={"duration": 6.0},
                brakes={"supply": 2.0},
                procedures={"stop": {"kind": "j_turn", "speed": 8.0, "steer": 0.1}},
            )
        )
    assert len(told.value.partial.times) > 3


def test_a_stop_within_one_sample_says_why_it_has_no_figures(twinrig, capsys, tmp_path):
    (tmp_path / "still.toml").write_text('title = "t"\nsystem = "braking"\n[procedures.p]\nspeed = 1e-6\n')
    assert twinrig("run", str(tmp_path / "still.toml"), "--out", str(tmp_path / "out")) == 0
    assert "p: stands within two samples of 0.0055 s" in capsys.readouterr().out
