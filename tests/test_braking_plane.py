"""The braked vehicle in the plane: loads, symmetries, the end at rest, engines, the trailer."""

import numpy as np
import pytest

from models.brake.advance import AT_REST, advance
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, plane_of_truck
from models.brake.trailer import CHOSEN_TRAILER, plane_of_trailer, trailer_behind_hook
from models.engines.braking import EngineChassis
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables
from validation.braking.braked_truck import (
    ICE_TABLE,
    RollingTruck,
    constant_friction,
    lateral_displacement_when_locked,
    transfer_errors,
    truck_on_tables,
)
from validation.braking.truck_equations import braked_turn

LOCKING, ROLLING = np.full(4, 1e5), np.array([900.0, 900.0, 600.0, 600.0])


def turning(speed, yaw=0.0, side=0.0):
    """The truck on ice, steered a little, at rates of its y and its heading."""
    moving = RollingTruck(truck_on_tables(), speed, steer=0.03)
    moving.state[1, 1:] = side, yaw
    return moving


@pytest.mark.grounds("closed form")
def test_locked_wheels_stop_in_the_closed_form():
    for step in (1e-4, 5.5e-3, 2e-2):
        state = RollingTruck(truck_on_tables(constant_friction(0.4)), 10.0).braked(LOCKING, step).state
        # the wheels' own stop, v / r in J v / (r T) = 0.3 ms, gives back less force than a locked wheel has
        assert state[0, 0] == pytest.approx(100.0 / (2.0 * 0.4 * GRAVITY), rel=2e-3)
        assert not state[1].any()
    state = _locked_from_the_start(constant_friction(0.4)).state
    assert state[0, 0] == pytest.approx(100.0 / (2.0 * 0.4 * GRAVITY), rel=1e-9)


def _locked_from_the_start(tables):
    plane = plane_of_truck(PAPER_TRUCK)
    still = plane._replace(radius=plane.radius * 1e9)  # wheels that turn at next to no speed: locked at once
    return RollingTruck(truck_on_tables(tables, still), 10.0).braked(LOCKING * 1e9)


@pytest.mark.grounds("closed form")
def test_load_transfer_of_all_and_of_single_axles():
    assert max(transfer_errors().values()) < 1e-6  # of the loads at rest; the wheels' inertia is made 1e-9 kg m^2


def test_equal_friction_gives_no_yaw_at_all_and_mirrored_steering_a_mirrored_path():
    straight = RollingTruck(truck_on_tables(), 10.0).braked(ROLLING).state
    assert straight[0, 1] == 0.0 and straight[0, 2] == 0.0
    left, right = (
        RollingTruck(truck_on_tables(), 10.0, steer=s).braked(ROLLING, duration=3.0).state for s in (0.03, -0.03)
    )
    assert left[0, 1] > 0.5
    assert np.abs(left * [1.0, -1.0, -1.0] - right).max() < 1e-10


def test_locked_front_wheels_do_not_steer():
    assert abs(lateral_displacement_when_locked()) < 1e-3


@pytest.mark.parametrize("step", [pytest.param(1e-4, marks=pytest.mark.full), 5.5e-3, 2e-2])
def test_every_end_is_at_rest_and_stays(step):
    for torque in (0.0, 30.0, 700.0, 1e5):
        for yaw, side in ((0.0, 0.0), (2.0, -3.0), (0.0, 0.6)):
            torques = np.array([torque, torque, 0.5 * torque, 0.0])
            moved = turning(0.5, yaw, side).braked(torques, step, duration=min(2.0, 5e3 * step))
            assert np.isfinite(moved.state).all() and np.isfinite(moved.turning).all()
    end = turning(1.0, 2.0, 1.0).braked(np.full(4, 5e3), step)
    assert not end.state[1].any() and not end.turning.any()
    again = end.state.copy()
    status, _ = end.on(np.full((3, 4), 5e3), step)
    assert status == AT_REST and np.array_equal(again, end.state)


def test_backwards_is_forwards_seen_from_behind():
    ahead, back = (RollingTruck(truck_on_tables(), v).braked(ROLLING, duration=1.0).state for v in (8.0, -8.0))
    # loads move to the other axle, which has the same friction: the way is the same
    assert back[0, 0] == pytest.approx(-ahead[0, 0], rel=1e-3)


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_engines_carry_the_chassis_as_the_compiled_step_does(engine):
    own, carried = (
        RollingTruck(truck_on_tables(), 10.0, steer=0.03, advance_step=go).braked(ROLLING, 1e-3, duration=0.5).state
        for go in (advance, EngineChassis(engine, plane_of_truck(PAPER_TRUCK)).advance)
    )
    assert own[0, 1] > 0.05
    assert carried == pytest.approx(own, abs=1e-6)  # both are of order two


@pytest.mark.full
def test_the_truck_written_out_turns_as_the_compiled_one():
    where = braked_turn(PAPER_TRUCK, ICE_TABLE, 0.03, (900.0, 600.0), 11.11, 6.0)
    state = RollingTruck(truck_on_tables(), 11.11, steer=0.03).braked(ROLLING, 1e-3, duration=where.time).state
    assert state[0] == pytest.approx([where.x, where.y, where.heading], abs=2e-3)


def rolling(slope: float) -> StackedTyreTables:
    """Friction across the wheel alone, as steep as ``slope`` (1/rad)."""
    mu = np.array([[0.0], [0.01 * slope], [0.01 * slope]])
    nodes = np.array([0.0, 0.01, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    return stacked_tables([TyreTable(*nodes, np.zeros((3, 1, 3)), np.ones((3, 3)), mu)])


@pytest.mark.full
def test_trailer_on_a_straight_pull():
    v, step, n = 0.2, 5e-4, 8000
    state = np.array([[0.0, 0.0, 0.5, 0.5], [v, 0.0, -v * np.sin(0.5) / CHOSEN_TRAILER.drawbar, 0.0]])
    hook = np.tile([v, 0.0], (n + 1, 1))
    states, forces = trailer_behind_hook(
        plane_of_trailer(CHOSEN_TRAILER), rolling(100.0), state, hook, step, 100.0, np.zeros(4)
    )
    angle = 2.0 * np.arctan(np.tan(0.25) * np.exp(-v * n * step / CHOSEN_TRAILER.drawbar))
    assert states[-1, 0, 2] == pytest.approx(angle, rel=1e-4)
    assert np.hypot(*forces[-1]) < 50.0  # it only rolls
