"""The braked vehicle in the plane: loads, symmetries, the end at rest, engines, the trailer."""

import numpy as np
import pytest

from models.brake.advance import AT_REST, advance
from models.brake.plane_vehicle import GRAVITY, PAPER, truck
from models.brake.surfaces import Stretch, road
from models.brake.trailer import CHOSEN, follow, hooked
from models.engines.braking import Carried
from models.tyre.tyre_table import Tables, TyreTable, stacked
from validation.braking.braked_truck import ICE, braked, constant, sideways_with_locked_front_wheels, transfer_errors
from validation.braking.truck_equations import turned

LOCKING = np.full(4, 1e5)


def test_locked_wheels_stop_in_the_closed_form():
    for step in (1e-4, 5.5e-3, 2e-2):
        state = braked(LOCKING, tables=constant(0.4), step=step, speed=10.0).state
        # the wheels' own stop, v / r in J v / (r T) = 0.3 ms, gives back less force than a locked wheel has
        assert state[0, 0] == pytest.approx(100.0 / (2.0 * 0.4 * GRAVITY), rel=2e-3)
        assert not state[1].any()
    state = _locked_from_the_start(constant(0.4)).state
    assert state[0, 0] == pytest.approx(100.0 / (2.0 * 0.4 * GRAVITY), rel=1e-9)


def _locked_from_the_start(tables):
    plane = truck(PAPER)
    still = plane._replace(radius=plane.radius * 1e9)  # wheels that turn at next to no speed: locked at once
    return braked(LOCKING * 1e9, tables=tables, plane=still)


def test_load_transfer_of_all_and_of_single_axles():
    assert max(transfer_errors().values()) < 1e-6  # of the loads at rest; the wheels' inertia is made 1e-9 kg m^2


def test_equal_friction_gives_no_yaw_at_all_and_mirrored_steering_a_mirrored_path():
    straight = braked(np.array([900.0, 900.0, 600.0, 600.0])).state
    assert straight[0, 1] == 0.0 and straight[0, 2] == 0.0
    left, right = (braked(np.array([900.0, 900.0, 600.0, 600.0]), steer=s, duration=3.0).state for s in (0.03, -0.03))
    assert left[0, 1] > 0.5
    assert np.abs(left * [1.0, -1.0, -1.0] - right).max() < 1e-10


def test_locked_front_wheels_do_not_steer():
    assert abs(sideways_with_locked_front_wheels()) < 1e-3


@pytest.mark.parametrize("step", [pytest.param(1e-4, marks=pytest.mark.full), 5.5e-3, 2e-2])
def test_every_end_is_at_rest_and_stays(step):
    for torque in (0.0, 30.0, 700.0, 1e5):
        for yaw, side in ((0.0, 0.0), (2.0, -3.0), (0.0, 0.6)):
            torques = np.array([torque, torque, 0.5 * torque, 0.0])
            moved = braked(torques, steer=0.03, speed=0.5, yaw=yaw, side=side, step=step, duration=min(2.0, 5e3 * step))
            assert np.isfinite(moved.state).all() and np.isfinite(moved.turning).all()
    end = braked(np.full(4, 5e3), steer=0.03, speed=1.0, yaw=2.0, side=1.0, step=step)
    assert not end.state[1].any() and not end.turning.any()
    again = end.state.copy()
    status, _ = advance(
        again,
        end.turning,
        np.full((3, 4), 5e3),
        step,
        np.zeros(4),
        ICE.cornering,
        truck(PAPER),
        np.zeros(4, dtype=int),
        road([Stretch(0.0, 0, 0)]),
        stacked([ICE]).packed,
        np.zeros(3),
        end.report,
    )
    assert status == AT_REST and np.array_equal(again, end.state)


def test_backwards_is_forwards_seen_from_behind():
    torques = np.array([900.0, 900.0, 600.0, 600.0])
    ahead, back = (braked(torques, speed=v, duration=1.0).state for v in (8.0, -8.0))
    # loads move to the other axle, which has the same friction: the way is the same
    assert back[0, 0] == pytest.approx(-ahead[0, 0], rel=1e-3)


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_engines_carry_the_chassis_as_the_compiled_step_does(engine):
    torques, plane = np.array([900.0, 900.0, 600.0, 600.0]), truck(PAPER)
    own = braked(torques, steer=0.03, step=1e-3, duration=0.5).state
    carried = braked(torques, steer=0.03, step=1e-3, duration=0.5, go=Carried(engine, plane).advance).state
    assert own[0, 1] > 0.05
    assert carried == pytest.approx(own, abs=1e-6)  # both are of order two


@pytest.mark.full
def test_the_truck_written_out_turns_as_the_compiled_one():
    where = turned(PAPER, ICE, 0.03, (900.0, 600.0), 11.11, 6.0)
    torques = np.array([900.0, 900.0, 600.0, 600.0])
    state = braked(torques, steer=0.03, speed=11.11, step=1e-3, duration=where.time).state
    assert state[0] == pytest.approx([where.x, where.y, where.heading], abs=2e-3)


def rolling(slope: float) -> Tables:
    """Friction across the wheel alone, as steep as ``slope`` (1/rad)."""
    mu = np.array([[0.0], [0.01 * slope], [0.01 * slope]])
    nodes = np.array([0.0, 0.01, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    return stacked([TyreTable(*nodes, np.zeros((3, 1, 3)), np.ones((3, 3)), mu)])


@pytest.mark.full
def test_trailer_on_a_straight_pull():
    v, step, n = 0.2, 5e-4, 8000
    state = np.array([[0.0, 0.0, 0.5, 0.5], [v, 0.0, -v * np.sin(0.5) / CHOSEN.drawbar, 0.0]])
    hook = np.tile([v, 0.0], (n + 1, 1))
    states, forces = follow(hooked(CHOSEN), rolling(100.0), state, hook, step, 100.0, np.zeros(4))
    angle = 2.0 * np.arctan(np.tan(0.25) * np.exp(-v * n * step / CHOSEN.drawbar))
    assert states[-1, 0, 2] == pytest.approx(angle, rel=1e-4)
    assert np.hypot(*forces[-1]) < 50.0  # it only rolls
