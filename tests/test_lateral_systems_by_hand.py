"""Runs of bicycles, wheelsets and rides, from the scene to the labelled result: energies of rolling, places and loads
at the start, and variances by the direct route in place of the modal one."""

import math
from pathlib import Path

import numpy as np
import pytest

from models.bicycle.four_bodies import BicycleRide
from models.bicycle.rolling_tyres import RollingBicycle
from models.bicycle.whipple import load_bicycle
from models.core.systems import scene_of_table
from models.rail.flange_climbing import nadal_limit, shares_of_bounds
from models.rail.wheelset import CHOSEN_WHEELSET
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.systems import run
from models.systems.ride.of_scene import excitation_of
from models.vehicles.spatial_linear import linearise, wheels
from models.vehicles.vehicle_file import load_vehicle

B = load_bicycle("benchmark")
LEANING = 80.81722
"""kg m^2: inertia of the benchmark about the line of its contacts. Source: Meijaard et al., Proc. R. Soc. A 463 (2007),
M_phiphi."""
ENGINES = ("reference", "exudyn", "mujoco")


def bicycle_run(engine, speed, lean_rate):
    table = {"title": "t", "system": "bicycle", "bicycle": {"parameters": "benchmark"}}
    ridden = {"speed": speed, "lean_rate": lean_rate, "duration": 0.04, "step": 2e-4}
    return run(scene_of_table({**table, "run": ridden, "control": {"encoder_gain": 0.85}}, "s.toml", Path()), engine)


@pytest.mark.grounds("published")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_bicycle_begins_with_the_energy_of_its_rolling_and_its_lean(engine):
    slow, fast = bicycle_run(engine, 2.3, 0.5), bicycle_run(engine, 4.6, 0.0)
    parts = (B.rear_wheel, B.body, B.front_frame, B.front_wheel)
    rolling = sum(part.mass for part in parts)
    rolling += sum(wheel.Iyy / wheel.radius**2 for wheel in (B.rear_wheel, B.front_wheel))
    gained = 0.5 * rolling * (4.6**2 - 2.3**2) - 0.5 * LEANING * 0.5**2
    assert fast["energy"][0] - slow["energy"][0] == pytest.approx(gained, rel=1e-6)
    still = bicycle_run(engine, 2.3, 0.0)
    assert slow["energy"][0] - still["energy"][0] == pytest.approx(0.5 * LEANING * 0.5**2, rel=1e-5)
    assert slow["lean_rate"][0] == pytest.approx(0.5, rel=1e-12) and slow["x_rate"][0] == pytest.approx(2.3, rel=1e-9)
    assert fast["x"][-1] == pytest.approx(4.6 * fast.times[-1], rel=1e-6)
    assert fast["rear_angle_rate"][-1] == pytest.approx(4.6 / B.rear_wheel.radius, rel=1e-5)
    assert slow["encoder"] == pytest.approx(0.85 * slow["steer"], rel=1e-12) and np.abs(slow["steer"]).max() > 1e-4
    assert fast.times[-1] == pytest.approx(0.04, rel=1e-9)


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_tyres_of_a_rolling_bicycle_go_on_bearing_its_weight(engine):
    result = bicycle_run(engine, 4.6, 0.0)
    front = 9.81 * (B.body.mass * B.body.x + B.front_frame.mass * B.front_frame.x) / B.wheelbase
    front += 9.81 * B.front_wheel.mass
    assert result["load"][:, 1] == pytest.approx(front, rel=1e-4)
    assert RollingBicycle(B).driven.gravity.tolist() == [0.0, 0.0, -B.gravity]


@pytest.mark.grounds("closed form")
def test_energy_that_is_not_accounted_for_is_told_by_that_of_the_start():
    none = np.zeros((3, 9))
    ride = BicycleRide(np.arange(3.0), none, none, np.array([10.0, 9.0, 8.5]), np.array([0.0, -1.5, -1.25]), 2)
    assert ride.unaccounted() == pytest.approx(0.05, rel=1e-12)


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_wheelset_begins_where_its_scene_says_and_its_rails_carry_the_load(engine):
    table = {"title": "t", "system": "wheelset", "speeds": {"values": [20.5]}, "contact": {"law": "linear"}}
    moving = {"duration": 0.01, "step": 5e-4, "displacement": 1.5e-4}
    result = run(scene_of_table({**table, "run": moving}, "s.toml", Path()), engine, speed=20.5)
    assert result["y"][0] == pytest.approx(1.5e-4, rel=1e-12) and result["yaw"][0] == 0.0
    assert result["spin"][0] == pytest.approx(-20.5 / CHOSEN_WHEELSET.radius, rel=1e-4)
    assert result["normal"][0].sum() * math.cos(CHOSEN_WHEELSET.conicity) == pytest.approx(
        CHOSEN_WHEELSET.load, rel=3e-3
    )
    assert result.times == pytest.approx(5e-4 * np.arange(21), abs=1e-12)


@pytest.mark.grounds("published")
def test_nadal_s_limit_and_shares_of_a_bound():
    """70 degrees and a friction of 0.3: (tan - mu) / (1 + mu tan) = 1.34. Source: M. J. Nadal (1908)."""
    assert nadal_limit(0.3, math.radians(70.0)) == pytest.approx((2.7474774 - 0.3) / (1.0 + 0.3 * 2.7474774), rel=1e-7)
    shares = shares_of_bounds(np.array([-3.0, 0.0, 2.0]), np.array([4.0, 0.0, 0.0]))
    assert shares.tolist() == [0.75, 0.0, math.inf]


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_ride_has_the_variances_of_the_direct_route(engine):
    """Lyapunov's equation of the whole system at each speed, of the linear vehicle by its written matrices."""
    table = {"title": "t", "system": "ride", "vehicle": {"file": "r19_ride"}, "road": {"level": 1.6e-5}}
    scene = scene_of_table({**table, "speeds": {"values": [12.5, 25.5]}}, "s.toml", Path())
    result, vehicle = run(scene, engine), load_vehicle("r19_ride")
    road = excitation_of(scene, wheels(vehicle))
    for row, speed in enumerate((12.5, 25.5)):
        direct = np.sqrt(stationary_covariance(vehicle_with_road(linearise(vehicle, speed), road, speed)).variance)
        names = [output.name for output in linearise(vehicle, speed).outputs]
        found = dict(zip(result.data["output"].values.tolist(), result["deviation"][0, row], strict=True))
        told = direct > 1e-9 * direct.max()
        assert np.array([found[name] for name in names])[told] == pytest.approx(direct[told], rel=1e-5)
    assert result.data["speed"].values.tolist() == [12.5, 25.5]
