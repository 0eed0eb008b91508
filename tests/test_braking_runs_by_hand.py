"""Stops of whole scenes, from the scene's table to the labelled result, by closed forms: torques by pressure, wheels
that roll or are locked, chambers that fill, surfaces one behind the other, steering by its knots."""

import numpy as np
import pytest

from models.brake.controller import ConstantPressures
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.systems.braking.procedures import steer_angles, vehicle_and_start_state
from models.systems.braking.run import run
from models.systems.braking.scene import build
from models.tyre.tyre_source import table_of_named_tyre

pytestmark = pytest.mark.grounds("closed form")
ENGINES = ("reference", "exudyn", "mujoco")
PLANE = plane_of_truck(PAPER_TRUCK)
LOCKING = {"front": {"gradient": 1500.0}, "rear": {"gradient": 1500.0}, "supply": 9.0}
"""Brakes that lock every wheel on ice and on snow."""


def scene(speed, duration, **tables):
    procedure = {"speed": speed, **tables.pop("procedure", {})}
    base = {"title": "t", "system": "braking", "run": {"duration": duration}}
    return build({**base, "procedures": {"stop": procedure}, **tables}, "t.toml")


def locked_friction(surface):
    """Of a locked wheel of the truck, by wheel."""
    return np.array(
        [table_of_named_tyre(surface).characteristic_values(float(load))["locked"] for load in PLANE.static_loads]
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_wheels_that_roll_slow_the_truck_by_the_torques_of_their_brakes(engine):
    brakes = {
        "front": {"gradient": 1500.0, "push_out": 0.25},
        "rear": {"gradient": 1200.0, "push_out": 0.5},
        "supply": 1.5,
    }
    result = run(scene(12.3, 0.6, brakes=brakes, road={"stretches": [{"left": "dry"}]}), engine)
    torque = np.array([1875.0, 1875.0, 1200.0, 1200.0])
    assert result["torque"][-1] == pytest.approx(torque, rel=1e-12)
    assert result["pressure"][-1] == pytest.approx([1.5] * 4, rel=1e-12)
    wanted = (torque / PLANE.radius).sum() / (PAPER_TRUCK.mass + (PLANE.spin_inertia / PLANE.radius**2).sum())
    speeds, times = result["rates"][:, 0], result.times
    assert speeds[0] == pytest.approx(12.3, rel=1e-12)
    assert result["turning"][0] == pytest.approx(12.3 / PLANE.radius, rel=1e-12)
    late = times > 0.3  # the slip has come to stay
    slowing = -np.polyfit(times[late], speeds[late], 1)[0]
    assert slowing == pytest.approx(wanted, rel=3e-3)  # what rolls slips by less than 1 %, and turns by as much less
    assert result["turning"][-1] * PLANE.radius == pytest.approx([speeds[-1]] * 4, rel=2e-2)
    assert np.trapezoid(speeds, times) == pytest.approx(result["positions"][-1, 0], rel=1e-5)


@pytest.mark.parametrize("engine", ENGINES)
def test_locked_wheels_stop_the_truck_by_their_friction_as_the_scene_scales_it(engine):
    result = run(scene(6.0, 20.0, brakes=LOCKING, tyres={"scale": {"ice": 0.75}}), engine)
    mu = 0.75 * locked_friction("ice")
    late = slice(len(result.times) // 3, -2)
    assert not result["turning"][late].any()
    assert -result["force_x"][late] / result["load"][late] == pytest.approx(np.tile(mu, (len(result.times[late]), 1)))
    assert result["load"][late] == pytest.approx(np.tile(PLANE.static_loads, (len(result.times[late]), 1)), rel=1e-9)
    slowing = (mu * PLANE.static_loads).sum() / PAPER_TRUCK.mass
    assert -np.diff(result["rates"][late, 0]) / np.diff(result.times[late]) == pytest.approx(slowing, rel=1e-6)
    assert result.data.attrs["stands"] == 1 and result["rates"][-1, 0] == pytest.approx(0.0, abs=1e-9)


def test_a_wheel_feels_the_next_surface_where_it_comes_to_it():
    road = {"stretches": [{"x": 0.0, "left": "ice"}, {"x": 7.3, "left": "dry"}]}
    result = run(scene(8.0, 3.0, brakes=LOCKING, road=road, run={"sample": 2e-3, "substeps": 2, "duration": 3.0}))
    ratio = -result["force_x"] / result["load"]
    ice, dry = locked_friction("ice"), locked_friction("dry")
    for wheel in (0, 2):
        there = result["positions"][:, 0] + PLANE.place[wheel, 0]
        beyond = int(np.argmax(ratio[:, wheel] > 0.5 * (ice + dry)[wheel]))
        assert there[beyond - 2] < 7.3 < there[beyond] + 1e-9  # 16 mm are passed within a sample


def test_chambers_fill_with_their_time_constant():
    result = run(scene(10.0, 0.4, brakes=LOCKING, pressure={"fill": 0.12, "empty": 0.3}))
    filling = 9.0 * (1.0 - np.exp(-result.times / 0.12))
    assert result["pressure"] == pytest.approx(np.tile(filling, (4, 1)).T, rel=1e-9, abs=1e-12)


def test_wheels_have_the_pressures_that_they_are_told():
    vehicle, start = vehicle_and_start_state(scene(10.5, 1.0, brakes=LOCKING), "stop")
    asked = np.array([1.3, 1.7, 0.4, 2.1])
    path = vehicle.run(ConstantPressures(asked), start, 0.05)
    assert path.pressures[-1] == pytest.approx(asked, rel=1e-12)
    assert path.torques[-1] == pytest.approx(1500.0 * asked, rel=1e-12)


def test_only_front_wheels_are_steered_by_the_knots_of_the_procedure():
    knots = [[0.5, 0.01], [1.5, 0.05]]
    vehicle, start = vehicle_and_start_state(scene(10.5, 1.0, procedure={"kind": "j_turn", "steering": knots}), "stop")
    for time, angle in ((0.0, 0.01), (1.0, 0.03), (4.0, 0.05)):
        assert vehicle.steering(time) == pytest.approx([angle, angle, 0.0, 0.0], rel=1e-12)
    fixed, _ = vehicle_and_start_state(scene(10.5, 1.0, procedure={"kind": "j_turn", "steer": -0.02}), "stop")
    assert fixed.steer == pytest.approx([-0.02, -0.02, 0.0, 0.0], rel=1e-12)
    assert steer_angles(vehicle, 0.3) == pytest.approx([0.3, 0.3, 0.0, 0.0], rel=1e-12)
    assert start.state[1, 0] == 10.5 and start.turning == pytest.approx(10.5 / PLANE.radius, rel=1e-12)
