"""The single-track vehicle on saturating tyres by closed forms: its axle's law, its loads, its steady turn."""

import math

import numpy as np
import pytest

from models.systems.single_track.equations import (
    GRAVITY,
    AxleTyres,
    SingleTrackCar,
    axle_force,
    forces,
    march,
    motion_rates,
    motion_reports,
)

pytestmark = pytest.mark.grounds("closed form")
CAR = SingleTrackCar(
    mass=1200.0,
    front_arm=1.1,
    rear_arm=1.6,
    inertia=1900.0,
    height=0.55,
    drag=0.4,
    front_braking_share=0.7,
    front_driving_share=0.2,
)
BASE, WEIGHT = CAR.front_arm + CAR.rear_arm, CAR.mass * GRAVITY
ENDLESS = 1e6
"""Friction so high that side forces are linear to 1e-12."""
ROUNDING = 1e-11


def axle(stiffness=12.0, friction=0.9, sharpness=2.0, side=0.0, lift=0.0, rise=0.0):
    return AxleTyres(stiffness, friction, sharpness, side, lift, rise)


@pytest.mark.parametrize("angle", [-1.2, -0.3, 0.4, 1.4])
def test_an_axle_whose_bend_is_a_quadratic_mean_is_the_sine_of_an_angle(angle):
    """x = tan(angle) and n = 2 give x / sqrt(1 + x^2) = sin(angle); a forward force mu N sin(ahead) leaves mu N
    cos(ahead) to the side."""
    load, ahead = 5000.0, 0.6
    largest = 0.9 * load * math.cos(ahead)
    slip = largest * math.tan(angle) / (12.0 * load)
    force = axle_force(axle(), load, 0.9 * load * math.sin(ahead), slip)
    assert force == pytest.approx(-largest * math.sin(angle), rel=ROUNDING)


def test_friction_of_left_and_right_turns_and_what_rises_beyond_the_bend():
    """At large slip the bend gives all friction, 1 - e of it where a share e rises on; friction is larger by the share
    ``side`` in left turns, whose slip angles are negative."""
    load, slip = 5000.0, 0.8
    for turn in (-1.0, 1.0):
        grip, linear = 0.9 * load * (1.0 - turn * 0.2), 12.0 * load * slip
        steep = axle(stiffness=12.0, sharpness=60.0, side=0.2, rise=0.25)
        assert axle_force(steep, load, 0.0, turn * slip) == pytest.approx(
            -turn * (0.75 * grip + 0.25 * linear), rel=1e-9
        )


def test_loads_and_forward_forces_balance_the_car():
    """Moments about either contact: weight, lift at the axles, and mass times rate at the height of the centre."""
    speed, front, rear = 20.0, axle(lift=0.3), axle(lift=-0.2)
    for rate, share in ((-3.0, CAR.front_braking_share), (1.5, CAR.front_driving_share)):
        answer = forces(CAR, front, rear, (0.5, 0.1), (0.05, speed, rate))
        side, moment, load_f, load_r, side_f, side_r, angle_f, angle_r = answer
        behind = WEIGHT * CAR.front_arm + CAR.mass * rate * CAR.height + 0.2 * speed**2 * BASE
        before = WEIGHT * CAR.rear_arm - CAR.mass * rate * CAR.height - 0.3 * speed**2 * BASE
        assert (load_f, load_r) == pytest.approx((before / BASE, behind / BASE), rel=ROUNDING)
        ahead = share * (CAR.mass * rate + CAR.drag * speed**2)
        turned = side_f + ahead * 0.05
        assert (side, moment) == pytest.approx(
            (turned + side_r, CAR.front_arm * turned - CAR.rear_arm * side_r), rel=ROUNDING
        )
        assert (angle_f, angle_r) == pytest.approx(
            ((0.5 + CAR.front_arm * 0.1) / speed - 0.05, (0.5 - CAR.rear_arm * 0.1) / speed), rel=ROUNDING
        )


def steady(stiffness_front, stiffness_rear, steer, speed):
    """Lateral velocity and yaw rate in a steady turn on linear tyres: the steer angle is L / R + (1/c_f - 1/c_r) v^2 /
    (g R), with stiffnesses c by load."""
    yawing = speed * steer / (BASE + (1.0 / stiffness_front - 1.0 / stiffness_rear) * speed**2 / GRAVITY)
    return CAR.rear_arm * yawing - speed**2 * yawing / (stiffness_rear * GRAVITY), yawing


def test_a_steady_turn_on_linear_tyres_lasts_and_is_reported():
    coasting, steer, speed = CAR._replace(drag=0.0), 0.02, 25.0
    front, rear = (axle(stiffness, ENDLESS) for stiffness in (11.0, 14.0))
    motion = steady(11.0, 14.0, steer, speed)
    given = np.tile([steer, speed, 0.0], (400, 1))
    path = march(coasting, front, rear, given, 0.01, motion)
    assert path == pytest.approx(np.tile(motion, (400, 1)), rel=1e-9)
    across = speed * motion[1]
    loads = WEIGHT * CAR.rear_arm / BASE, WEIGHT * CAR.front_arm / BASE
    sides = [load * across / GRAVITY for load in loads]
    slips = [-across / (GRAVITY * stiffness) for stiffness in (11.0, 14.0)]
    told = motion_reports(coasting, front, rear, given, path)[-1]
    assert told == pytest.approx([across, *loads, *sides, *slips], rel=1e-9)


def test_rates_beside_a_steady_turn_are_those_of_the_linear_equations():
    """m w' = -(C_f + C_r) dw / v and J r' = -(a C_f - b C_r) dw / v, with stiffnesses C in N/rad."""
    coasting, speed, aside = CAR._replace(drag=0.0), 25.0, 0.3
    front, rear = (axle(stiffness, ENDLESS) for stiffness in (11.0, 14.0))
    lateral, yawing = steady(11.0, 14.0, 0.02, speed)
    in_front, behind = 11.0 * WEIGHT * CAR.rear_arm / BASE, 14.0 * WEIGHT * CAR.front_arm / BASE
    told = motion_rates(coasting, front, rear, (lateral + aside, yawing), (0.02, speed, 0.0))
    expected = (
        -(in_front + behind) * aside / (CAR.mass * speed),
        -(CAR.front_arm * in_front - CAR.rear_arm * behind) * aside / (CAR.inertia * speed),
    )
    assert told == pytest.approx(expected, rel=1e-9)
