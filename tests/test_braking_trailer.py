"""A car that brakes with a trailer on their suspensions: closed forms, plain code, control, scenes, and refusals."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from models.brake.plane_vehicle import plane_of_truck
from models.brake.sprung import suspended_vehicle
from models.core.errors import InputError, RunFailed
from models.core.scene_effects import named_effects, scene_without
from models.engines.braking_sprung import driven_vehicle
from models.engines.free_vehicle import native_elements_and_joints
from models.multibody.forces import PARTS
from models.systems.braking.march import StartState
from models.systems.braking.of_scene import plane_of
from models.systems.braking.plan import check, describe
from models.systems.braking.procedures import vehicle_and_start_state
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.systems.braking.stop_report import StopHistory, wheel_names
from models.tyre.magic_formula import table_of_surface
from models.vehicles.spatial import hitch_of
from models.vehicles.vehicle_file import SHIPPED_FOLDER
from validation.braking import plain_sprung as whole
from validation.braking import sprung_train as closed
from validation.braking.sprung_box import braked_vehicle, car, remaining_speed, steady_torques
from validation.spatial.towing import give_towed_wheels_car_heading, static_loads
from validation.spatial.trains import caravan, train


def scene(**tables: Any) -> Any:
    """The caravan's scene of a stop on wet road, with what ``tables`` change."""
    return build(
        {
            "title": "train",
            "system": "braking",
            "vehicle": {"file": "r19_caravan", "spin_inertia": 1.7},
            "road": {"stretches": [{"left": "wet"}]},
            "brakes": {
                "front": {"gradient": 300.0},
                "rear": {"gradient": 100.0},
                "trailer": {"gradient": 150.0},
                "supply": 2.0,
            },
            "procedures": {"straight": {"speed": 3.0}, "turn": {"kind": "turn", "speed": 6.0, "radius": 40.0}},
            **tables,
        },
        "scene.toml",
    )


def test_loads_are_those_of_levers_and_a_locked_train_stops_by_friction_alone():
    train_of_two = whole.towing_car()
    front, rear, axle, _ = static_loads(train_of_two.handling)
    assert train_of_two.in_plane().static_loads.reshape(3, 2).sum(axis=1) == pytest.approx(
        [front, rear, axle], rel=1e-9
    )
    way, wanted = closed.locked_stop_and_closed_form()
    assert way == pytest.approx(wanted, rel=1e-3)  # the car leans ahead by less than a millimetre


@pytest.mark.grounds("closed form")
def test_a_caravan_that_brakes_alone_pulls_as_its_levers_say_and_brakes_that_hold_on_to_the_car_are_seen():
    errors = closed.caravan_errors()
    assert max(abs(error) for error in (errors.deceleration, errors.axle_load, errors.ball_force)) < 1e-3
    wrong = closed.relative_difference(
        closed.caravan_run(closed.plant_brakes_on_car, 2.5), closed.caravan_closed_form()
    )
    assert abs(wrong.axle_load) > 5e-3


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize("name", list(whole.TRAINS))
def test_accelerations_are_those_of_plain_code_and_wheels_that_keep_to_the_car_are_seen(name):
    plain = whole.plain_accelerations(name, 5)
    for engine in ("mujoco", "exudyn"):
        assert whole.relative_difference(whole.accelerations(whole.TRAINS[name](), engine, 5), plain) < 1e-12
    wrong = whole.TRAINS[name].__wrapped__()
    give_towed_wheels_car_heading(wrong.handling)
    assert whole.relative_difference(whole.accelerations(wrong, "exudyn", 5), plain) > 1e-6


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize(("name", "lags"), [("train", False), ("caravan", True)])
def test_a_piece_of_a_stop_is_that_of_plain_code(name, lags):
    compiled = whole.run(whole.TRAINS[name](), "mujoco", 0.03, with_lags=lags)
    assert whole.path_difference(compiled, whole.plain_run(name, 0.03, with_lags=lags)) < 1e-11


def test_springs_of_a_trailer_are_the_engines_own_and_the_table_has_no_more_of_them():
    for engine in ("mujoco", "exudyn"):
        native, compiled = (
            driven_vehicle(vehicle(), engine) for vehicle in (whole.asymmetric_train, whole.train_with_compiled_springs)
        )
        names, _ = native_elements_and_joints(engine, replace(native, kernel=None))
        of_trailer = {s.name for s in train().springs if s.frame in train().towed} | {"trailer's bar"}
        assert set(names) == of_trailer and not compiled.parts
        assert native.numbers[PARTS] < compiled.numbers[PARTS]


def test_a_vehicle_that_tows_nothing_has_the_units_and_wheels_of_before():
    alone, plane = car(), plane_of_truck(car().plane)
    assert all(np.array_equal(ours, theirs) for ours, theirs in zip(alone.in_plane(), plane, strict=True))
    assert alone.turns.size == 0 and alone.leans.tolist() == [4, 5]
    assert whole.towing_car().size == alone.size + 5 and whole.towing_car().in_plane().wheels == 6


def test_mirrored_steering_gives_a_mirrored_stop_of_a_controlled_train_that_stays():
    torques, wet = steady_torques(500.0, 500.0, 200.0, 200.0, 300.0, 300.0), table_of_surface("wet")
    left, right = (braked_vehicle(whole.towing_car(), wet, steer=steer).run(torques, 4.0) for steer in (0.1, -0.1))
    names = list(left.coordinates)
    same = [names.index(name) for name in ("carrier x", "sway z", "sway ry", "caravan hitch ry")]
    turned = [names.index(name) for name in ("carrier y", "carrier rz", "sway rx", "caravan hitch rx")]
    yaw = names.index("caravan hitch rz")
    ours, theirs = left.states[-1, 0], right.states[-1, 0]
    assert abs(ours[yaw]) > 1e-3 and ours[same] == pytest.approx(theirs[same], abs=1e-8)
    assert ours[[*turned, yaw]] == pytest.approx(-theirs[[*turned, yaw]], abs=1e-8)
    assert left.ended_at_rest and remaining_speed(braked_vehicle(whole.towing_car(), wet, steer=0.1), left, 0.2) == 0.0


def test_a_train_whose_car_alone_brakes_jackknifes_and_says_so():
    vehicle = braked_vehicle(whole.towing_car(), table_of_surface("ice"))
    start = vehicle.rolling(15.0)
    start.state[0, whole.towing_car().turns] = 0.3
    with pytest.raises(RunFailed, match=r"jackknifes: a hitch yaws by more than 1\.57 rad"):
        vehicle.run(steady_torques(3e3, 3e3, 3e3, 3e3, 0.0, 0.0), StartState(*start), 20.0)


def test_a_scene_brakes_and_controls_the_wheels_of_its_trailer():
    towing = scene(controller={"kind": "slip_bang_bang"}, run={"duration": 0.2})
    assert {"towed", "suspension"} <= set(named_effects(towing)) and plane_of(towing).wheels == 6
    result = drive(towing, procedure="straight")
    assert result.data["wheel"].values.tolist() == list(wheel_names(6))
    assert (result["torque"][-1, 4:] > 0.0).all()
    assert "caravan, towed by body" in describe(towing) and "582 N on it" in describe(towing)
    check(towing, ("reference", "exudyn", "mujoco"))
    assert (
        result.detail.coordinates[19] == "caravan hitch rz"
        and "largest hitch angle [deg]" in StopHistory(result.detail).hitch_results()
    )


def test_a_steady_circle_tows_the_caravan_inwards():
    vehicle, start = vehicle_and_start_state(scene(), "turn")
    path = vehicle.run(steady_torques(*6 * (0.0,)), start, 0.1)
    yaw = vehicle.sprung.turns[0]
    assert start.state[0, yaw] < -0.05 and abs(path.states[-1, 0, yaw] - start.state[0, yaw]) < 1e-5


def test_what_is_left_out_is_the_trailer_alone():
    alone = scene_without(scene(), "towed")
    assert (
        alone.vehicle.file == "r19_free"
        and "towed" not in named_effects(alone)
        and "suspension" in named_effects(alone)
    )


def test_a_train_that_cannot_brake_is_told(tmp_path):
    (tmp_path / "mine.toml").write_text((SHIPPED_FOLDER / "r19_caravan.toml").read_text())
    own = scene(vehicle={"file": str(tmp_path / "mine.toml"), "spin_inertia": 1.7})
    with pytest.raises(InputError, match=r"vehicle\.file = .*: has bodies with a hitch: name a vehicle file"):
        scene_without(own, "towed")
    with pytest.raises(InputError, match=r"run\.forces = 'compiled': has no meaning without vehicle\.file"):
        scene(vehicle={}, run={"forces": "compiled"})
    whole_train = caravan()
    three = tuple(tyre for tyre in whole_train.tyres if tyre.name != "cr")
    with pytest.raises(InputError, match=r"tyres = .*: must be two of each of two axles, and of each axle behind them"):
        suspended_vehicle(replace(whole_train, tyres=three), 1.7)
    stiff = tuple(
        replace(body, freedoms=("rx", "ry")) if body.name == hitch_of("caravan") else body
        for body in whole_train.bodies
    )
    with pytest.raises(InputError, match=r"bodies\[caravan\]\.freedoms = \['rx', 'ry'\]: must have rz"):
        suspended_vehicle(replace(whole_train, bodies=stiff), 1.7)
