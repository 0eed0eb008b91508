"""A car that tows on its suspension: loads, steady turns, energy, engines, absence, and what is refused."""

import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.core.scene_effects import named_effects, scene_without
from models.engines.free_vehicle import free_model, native_elements_and_joints
from models.engines.towed_springs import shared_numbers, towed_division
from models.multibody import forces as at
from models.multibody.numbers import Controls, Handling, TyreParameters
from models.systems.handling.energy import drive_energy, unaccounted_energy
from models.systems.handling.plan import describe
from models.systems.handling.run import build_in_engine as build_model
from models.systems.handling.run import drive_run, driven_model, run
from models.systems.handling.scene import build
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import SHIPPED_FOLDER, build_vehicle, load_vehicle
from validation.common.checks import largest_relative_difference
from validation.spatial.towing import give_towed_wheels_car_heading, static_load_error, towed_turn
from validation.spatial.trains import BOX, WHEELS, caravan, train
from validation.spatial.written_equations import TURN_CONTROLS, rolling_acceleration_difference, rolling_cars

BOUND = 3e-3
"""Of the closed form of a settled turn: what is left of its settling after 3 s."""


def scene(**changes: Any) -> Any:
    table = {
        "title": "t",
        "system": "handling",
        "vehicle": {"file": "r19_caravan"},
        "manoeuvres": {"turn": {"speed": 20.0, "duration": 0.01, "steer": [[0.0, 0.0], [0.01, 0.02]]}},
    }
    return build({**table, **changes}, "s.toml")


def file_with(**changes: Any) -> dict[str, Any]:
    """Tables of the shipped caravan's file, with other values of its body."""
    table = tomllib.loads((SHIPPED_FOLDER / "r19_caravan.toml").read_text())
    body = next(body for body in table["bodies"] if body["name"] == "caravan")
    body.update(changes)
    for key in [key for key, value in changes.items() if value is None]:
        del body[key]
    return table


@pytest.mark.grounds("closed form")
def test_loads_on_ball_and_axles_are_those_of_levers():
    assert static_load_error() < 1e-9


@pytest.mark.grounds("closed form")
def test_a_steady_turn_is_that_of_the_closed_form_and_wheels_that_keep_to_the_car_are_seen():
    right, wrong = (
        towed_turn(caravan(), 10.0, None, 3.0),
        towed_turn(caravan(), 10.0, give_towed_wheels_car_heading, 1.5),
    )
    assert abs(right.yaw_rate) < BOUND and np.abs(right.towed_headings).max() < BOUND
    assert np.abs(wrong.towed_headings).max() > 0.1


def test_energy_is_accounted_for():
    drive = drive_run("mujoco", Handling(train(), controls=TURN_CONTROLS), 20.0, 0.04)
    assert np.abs(unaccounted_energy(drive)).max() < 1e-7 * drive_energy(drive)[0]


def test_wheels_of_a_trailer_are_not_driven_nor_steered_and_brake_with_those_behind_the_first_axle():
    car = rolling_cars()["train"]
    rows = [car.tyre_numbers(i) for i in range(len(car.vehicle.tyres))]
    driving, steered = (sum(row[column] for row in rows) for column in (at.DRIVEN, at.STEERED))
    assert driving == pytest.approx(1.0) and steered == 2.0
    assert [row[at.BRAKED] for row in rows[-len(WHEELS) :]] == pytest.approx([0.35 / 3.0 / 2.0] * 4)
    assert not any(row[at.DRIVEN] for row in rows[-len(WHEELS) :])


def test_a_scene_names_its_trailer_and_runs_in_both_engines():
    towing = scene()
    assert "trailer" in named_effects(towing) and "trailer" not in named_effects(scene_without(towing, "trailer"))
    assert "caravan, towed by body at (-2.4, 0, 0.43) m, turns rx ry rz; 582 N on it" in describe(towing)
    ours, theirs = (run(towing, engine) for engine in ("mujoco", "exudyn"))
    assert np.abs(ours["positions"] - theirs["positions"]).max() < 1e-12


def test_a_file_of_ones_own_keeps_its_trailer(tmp_path):
    (tmp_path / "mine.toml").write_text((SHIPPED_FOLDER / "r19_caravan.toml").read_text())
    towing = scene(vehicle={"file": str(tmp_path / "mine.toml")})
    assert "trailer" in named_effects(towing)
    with pytest.raises(InputError, match=r"vehicle\.file = .*: has bodies with a hitch: name a vehicle file"):
        scene_without(towing, "trailer")


@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_springs_of_a_trailer_are_the_engines_own_and_bear_it(engine):
    car = rolling_cars()["train"]
    division = towed_division(car, engine)
    driven_by_both = replace(driven_model(car), numbers=shared_numbers(car, division), parts=division.native)
    names, _ = native_elements_and_joints(engine, driven_by_both)
    wanted = {spring.name for spring in car.given.springs if spring.frame in car.given.towed} | {"trailer's bar"}
    assert set(names) == wanted
    assert all("friction" in why for why in division.reasons.values()) and len(division.reasons) == 4
    assert (
        rolling_acceleration_difference(car, engine, 3) < 1e-12
        and rolling_acceleration_difference(car.changed(forces="compiled"), engine, 3) < 1e-12
    )
    q, v = car.straight(20.0)
    without = free_model(engine, replace(driven_by_both, parts=division.native[:-1])).acceleration(0.0, q + 0.01, v)
    assert largest_relative_difference(without, build_model(engine, car).acceleration(0.0, q + 0.01, v)) > 1e-6


def test_a_train_that_jackknifes_is_no_result():
    """A caravan that is backed up folds."""
    car = Handling(caravan(), TyreParameters(friction=1.2), Controls(steer=((0.0, 0.1), (0.1, 0.12))))
    with pytest.raises(RunFailed, match=r"jackknifes: a trailer turns by more than 1\.57 rad .* 'caravan'"):
        drive_run("mujoco", car, -4.0, 3.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parent": None}, r"bodies\[caravan\]\.hitch = \[-2\.4, 0\.0, 0\.43\]: nothing tows it: name the body"),
        ({"freedoms": ["z", "rz"]}, r"bodies\[caravan\]\.freedoms = \['z', 'rz'\]: a towed body turns about its hitch"),
        ({"freedoms": ["rx", "ry"]}, r"bodies\[caravan\]\.freedoms = \['rx', 'ry'\]: a towed body turns about"),
        ({"mass": -800.0}, r"bodies\[caravan\]\.mass = -800\.0: must be above 0"),
        ({"hitch": [1.0]}, r"bodies\[caravan\]\.hitch"),
    ],
)
def test_a_trailer_that_cannot_be_is_told(changes, message):
    with pytest.raises(InputError, match=message):
        build_vehicle(file_with(**changes), "mine.toml")


def test_a_trailer_without_wheels_is_told():
    table = file_with()
    gone = {"cl", "cr", "caravan left", "caravan right"}
    for key in ("bodies", "tyres", "springs"):
        table[key] = [entry for entry in table[key] if entry["name"] not in gone]
    table["axles"] = [axle for axle in table["axles"] if axle["name"] != "caravan"]
    table["outputs"] = table["outputs"][:1]
    with pytest.raises(InputError, match=r"bodies\[caravan\]"):
        build_vehicle(table, "mine.toml")
    table["springs"].append({"name": "rope", "bodies": ["caravan", "body"], "point": [-2, 0, 1], "stiffness": 1e3})
    with pytest.raises(InputError, match=r"bodies\[caravan\]\.hitch: is towed without wheels"):
        build_vehicle(table, "mine.toml")


@pytest.mark.grounds("closed form")
def test_small_side_forces_of_a_towed_body_see_its_own_heading():
    """A caravan that is turned beside the car by an angle is pushed back by C times that, over its axle's arm."""
    car = replace(caravan(), gravity=9.81)
    stiffness, places = linearise(car, 20.0).stiffness, car.coordinates()
    yaw, side = places.index(("caravan hitch", "rz")), places.index(("body", "y"))
    assert stiffness[yaw, yaw] == pytest.approx(2 * 50e3 * 3.1) and stiffness[side, yaw] == pytest.approx(-2 * 50e3)


def test_systems_that_cannot_tow_say_so():
    with pytest.raises(InputError, match=r"vehicle\.file = 'r19_caravan': tows 'caravan' by a hitch"):
        load_vehicle("r19_caravan", scene_path="s.toml", key_path="vehicle.file")


def test_springs_of_a_trailer_keep_to_its_own_axes():
    frames = {spring.name: spring.frame for spring in caravan().springs}
    assert frames["caravan left"] == frames["caravan right"] == "caravan" and frames["front left"] is None
    other = replace(
        train(), springs=tuple(replace(s, frame="dl") if s.name == "bush bl" else s for s in train().springs)
    )
    with pytest.raises(InputError, match=rf"springs\[bush bl\]\.frame = 'dl': must be left out.*{BOX}"):
        Handling(other)
