"""Steering by time, and the response to it: closed forms of the linear single-track vehicle."""

import numpy as np
import pytest
from scipy.signal import lti, step

from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK
from models.brake.steering import Steering, yaw_response
from models.core.errors import InputError
from models.systems.braking.procedures import step_steer_response, vehicle_and_start_state
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.tyre.magic_formula import table_of_surface

STEPS = np.linspace(0.0, 8.0, 80_001)


def scene(**procedure):
    own = {"kind": "j_turn", "speed": 10.0, **procedure}
    return build(
        {
            "title": "t",
            "system": "braking",
            "road": {"stretches": [{"left": "dry"}]},
            "procedures": {"j": own},
            "run": {"duration": 0.3},
        },
        "s.toml",
    )


def test_response_of_first_and_second_order():
    lag = yaw_response(STEPS, -0.2 * (1.0 - np.exp(-STEPS / 0.5)), 0.1)
    assert lag.time == pytest.approx(0.5 * np.log(10.0) - 0.1, abs=1e-4) and lag.overshoot < 1e-6
    damping, rate = 0.4, 4.0
    _, rises = step(lti([rate**2], [1.0, 2.0 * damping * rate, rate**2]), T=STEPS)
    assert yaw_response(STEPS, rises, 0.0).overshoot == pytest.approx(
        np.exp(-np.pi * 0.4 / np.sqrt(1 - 0.16)), abs=1e-4
    )


def test_a_yaw_rate_that_does_not_settle_has_no_response():
    assert yaw_response(STEPS, STEPS, 0.0) is None and yaw_response(STEPS, 0.0 * STEPS, 0.0) is None


def test_half_of_the_steering():
    front = np.array([1.0, 1.0, 0.0, 0.0])
    ramp = Steering(np.array([0.2, 0.6]), np.array([0.0, -0.04]), front)
    assert ramp.half == pytest.approx(0.4) and ramp(0.3) == pytest.approx(-0.01 * front) and not ramp(0.1).any()
    assert Steering(np.array([0.0]), np.array([0.04]), front).half == 0.0


def test_the_response_of_a_vehicle_is_that_of_the_linear_one():
    speed, angle, ramp = 10.0, 2e-4, 0.1
    found = step_steer_response(scene(steering=[[0.0, 0.0], [ramp, angle]], speed=speed), "j")
    a, b, mass = PAPER_TRUCK.front.x, -PAPER_TRUCK.rear.x, PAPER_TRUCK.mass
    rolling = sum(
        2.0 * axle.spin_inertia * (axle.track / 2.0 / axle.radius) ** 2
        for axle in (PAPER_TRUCK.front, PAPER_TRUCK.rear)
    )
    inertia = PAPER_TRUCK.yaw_inertia + rolling  # wheels that roll turn faster outside, slower inside
    each = table_of_surface("dry").cornering * mass * GRAVITY
    front, rear = each * b / (a + b), each * a / (a + b)
    turned, damped = a * front - b * rear, a * a * front + b * b * rear
    system = np.array(
        [
            [-(front + rear) / (mass * speed), -speed - turned / (mass * speed)],
            [-turned / (inertia * speed), -damped / (inertia * speed)],
        ]
    )
    given = lti(system, np.array([[front / mass], [a * front / inertia]]), np.array([[0.0, 1.0]]), 0.0)
    _, rates, _ = given.output(np.interp(STEPS, [0.0, ramp], [0.0, angle]), STEPS)
    wanted = yaw_response(STEPS, rates, ramp / 2.0)
    assert found.time == pytest.approx(wanted.time, abs=1e-4)  # by linear crossing within samples of 5.5 ms
    assert found.steady_rate == pytest.approx(wanted.steady_rate, rel=1e-6)


def test_a_ramp_turns_less_than_a_step_and_a_step_of_one_knot_the_same():
    ways = ({"steer": 0.03}, {"steering": [[0.0, 0.03]]}, {"steering": [[0.0, 0.0], [0.2, 0.03]]})
    one, knot, ramp = (drive(scene(**own)).detail.states[-1, 0, 2] for own in ways)
    assert one == knot > 1.3 * ramp > 0.0


def test_a_ramp_begins_with_straight_wheels():
    assert not vehicle_and_start_state(scene(steering=[[0.0, 0.0], [0.2, 0.03]]), "j")[0].steer.any()


@pytest.mark.parametrize(
    ("own", "place", "said"),
    [
        ({}, "steer", "steer or steering"),
        ({"steer": 0.1, "steering": [[0.0, 0.1]]}, "steering", "beside steer"),
        ({"steering": [[0.0, 0.0], [0.0, 0.1]]}, "steering", "rise from knot to knot"),
        ({"steering": [[-1.0, 0.0], [0.0, 0.1]]}, "steering", "from 0 on"),
        ({"steering": [[0.0, 3.0]]}, "steering", "1 rad"),
        ({"steering": [[0.0, 0.0, 1.0]]}, "steering.0", "at most 2"),
        ({"kind": "straight", "steering": [[0.0, 0.1]]}, "steering", "no meaning for straight"),
    ],
)
def test_steering_that_a_procedure_cannot_have(own, place, said):
    with pytest.raises(InputError, match=said) as error:
        scene(**own)
    assert error.value.place == f"procedures.j.{place}"
