"""A braked vehicle on its suspension: closed forms, symmetry, engines, scenes that name a vehicle file."""

from dataclasses import replace

import numpy as np
import pytest

from models.brake.plane_vehicle import GRAVITY, plane_of_truck
from models.brake.sprung import PITCH, ROLL, suspended_vehicle
from models.brake.trailer import CHOSEN_TRAILER
from models.core.errors import InputError, Refused, RunFailed
from models.multibody.numbers import Handling
from models.systems.braking.plan import check, describe
from models.systems.braking.procedures import engines_of, vehicle_and_start_state
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.systems.braking.stop_report import StopHistory
from models.tyre.magic_formula import table_of_surface
from models.vehicles.vehicle_file import load_vehicle
from validation.braking.sprung_box import (
    LOCKING_TORQUE,
    box,
    braked_vehicle,
    car,
    constant_friction,
    pitch_and_transfer,
    remaining_speed,
    steady_torques,
)

TORQUES = steady_torques(600.0, 600.0, 200.0, 200.0)


def scene(**tables):
    """The car on wet road, with what ``tables`` change."""
    return build(
        {
            "title": "car",
            "system": "braking",
            "vehicle": {"file": "r19_free", "spin_inertia": 1.7},
            "road": {"stretches": [{"left": "wet"}]},
            "brakes": {"front": {"gradient": 300.0}, "rear": {"gradient": 100.0}, "supply": 2.0},
            "procedures": {"straight": {"speed": 3.0}, "turn": {"kind": "turn", "speed": 6.0, "radius": 40.0}},
            **tables,
        },
        "scene.toml",
    )


def test_locked_wheels_pitch_and_load_the_box_as_springs_in_series_do():
    mu, speed = 0.05, 1.5
    vehicle = braked_vehicle(box(), constant_friction(mu))
    path = vehicle.run(steady_torques(*4 * (LOCKING_TORQUE,)), speed)
    pitch, transfer = pitch_and_transfer(mu * GRAVITY)
    late = -len(path.times) // 8
    assert path.states[late, 0, PITCH] == pytest.approx(pitch, rel=2e-3)  # to first order in 1.6 mrad
    gained = path.reports.load[late, :2].sum() - path.reports.load[0, :2].sum()
    assert gained == pytest.approx(transfer, rel=2e-3)
    # wheels lock within v / r in J v / (r T) and less, the centre of mass leans ahead by 0.9 mm
    assert path.states[-1, 0, 0] == pytest.approx(speed**2 / (2.0 * mu * GRAVITY), rel=1e-3)
    assert path.ended_at_rest and remaining_speed(vehicle, path) == 0.0


def test_static_loads_are_those_of_levers():
    for own in (box(), car()):
        path = braked_vehicle(own, constant_friction(0.1)).run(steady_torques(0.0, 0.0, 0.0, 0.0), 2.0, 0.05)
        assert path.reports.load[-1] == pytest.approx(
            plane_of_truck(own.plane).static_loads, rel=1e-9
        )  # no drag, no brakes


def test_mirrored_steering_gives_a_mirrored_stop_and_none_gives_no_yaw():
    wet = table_of_surface("wet")
    left, right, none = (
        braked_vehicle(car(), wet, steer=steer).run(TORQUES, 4.0).states[-1, 0] for steer in (0.1, -0.1, 0.0)
    )
    assert left[1] > 0.05 and left[:6] == pytest.approx(right[:6] * [1, -1, -1, 1, -1, 1], abs=1e-9)
    assert np.abs(none[[1, 2, ROLL]]).max() < 1e-12


def test_engines_agree():
    ends = [
        braked_vehicle(car(), table_of_surface("wet"), engine, 0.05, 1e-3).run(TORQUES, 4.0, 0.2).states[-1]
        for engine in ("mujoco", "exudyn")
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)  # the same forces and Runge-Kutta method


def test_a_run_repeats_to_the_last_bit():
    vehicle = braked_vehicle(car(), table_of_surface("wet"), steer=0.05)
    one, two = (vehicle.run(TORQUES, 3.0, 0.2) for _ in range(2))
    assert np.array_equal(one.states, two.states)


def test_a_car_that_turns_over_is_told():
    grip = table_of_surface("dry").scaled(2.0)
    with pytest.raises(RunFailed, match="turns over") as told:
        braked_vehicle(car(), grip, steer=0.3).run(steady_torques(0.0, 0.0, 0.0, 0.0), 25.0, 5.0)
    assert len(told.value.partial.times) > 10


def test_a_step_that_stiff_springs_cannot_take_is_refused_before_the_run():
    stiff = braked_vehicle(
        box(100.0), constant_friction(0.1)
    )  # 880 rad/s of a wheel on its tyre: Runge and Kutta end at 2.8
    with pytest.raises(Refused, match=r"at a step of 0\.0055 s RK4 lets .* grow; use at most 0\.00"):
        stiff.run(TORQUES, 2.0)


def test_a_scene_is_marched_by_an_engine_with_its_steady_turn_and_reports_the_body():
    own = scene()
    vehicle, start = vehicle_and_start_state(own, "turn")
    path = vehicle.run(steady_torques(0.0, 0.0, 0.0, 0.0), start, 0.1)
    assert np.abs(path.states[-1, 0, 3:] - start.state[0, 3:]).max() < 1e-5  # springs are settled; drag slows it down
    assert start.state[0, ROLL] > 5e-3
    stop = StopHistory(drive(own, procedure="straight").detail)
    assert stop.path.ended_at_rest and stop.vehicle_results()["largest pitch [deg]"] > 0.5
    assert "suspension, roll and pitch" in describe(own)
    check(own, ("reference", "exudyn", "mujoco"))
    assert engines_of(own, ("reference", "exudyn")) == ("exudyn",) and engines_of(own, ("reference",)) == ("reference",)


def test_what_a_vehicle_file_has_no_place_for_is_refused():
    for place, tables in (
        ("load_transfer", {"load_transfer": {}}),
        ("vehicle.spin_inertia", {"vehicle": {"file": "r19_free"}}),
        ("vehicle.override", {"vehicle": {"file": "r19_free", "spin_inertia": 1.0, "override": {"mass": 1.0}}}),
        ("vehicle.spin_inertia", {"vehicle": {"spin_inertia": 1.0}}),
    ):
        with pytest.raises(InputError) as told:
            scene(**tables)
        assert told.value.place == place
    with pytest.raises(InputError, match="two of each of two axles"):
        suspended_vehicle(load_vehicle("three_axle_truck"), 1.0)
    with pytest.raises(InputError, match="trailer: cannot stand beside 'suspension'"):
        scene(trailer=CHOSEN_TRAILER.model_dump())


def test_tyres_behind_a_hitch_are_refused_and_do_not_silently_keep_to_the_heading_of_the_chassis():
    car = load_vehicle("r19_free")
    bodies = tuple(
        replace(body, freedoms=("x", "z", "rz"), parent="body") if body.name == "rl" else body for body in car.bodies
    )
    hitched = replace(car, bodies=bodies)
    for build_one in (lambda: suspended_vehicle(hitched, 1.0), lambda: Handling(hitched).vehicle):
        with pytest.raises(InputError, match=r"bodies\[rl\]\.freedoms .* keep to the heading of 'body'"):
            build_one()
    assert suspended_vehicle(car, 1.0).size == len(car.coordinates())
