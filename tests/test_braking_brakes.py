"""Brakes, chambers and supply: loops in closed form, order within a step, delay, reservoir, measured pressures."""

import numpy as np
import pytest

from models.brake.brake import Brake, brake_torque, brakes_of_wheels
from models.brake.controller import APPLY, HOLD, RELEASE, SAMPLING_PERIOD
from models.brake.pressure import AirState, BrakeChambers, advance_by_pressures, advance_by_valves, air_at_rest
from models.core.errors import InputError

BRAKE = Brake(push_out=0.75, release=0.5, rising=1500.0, falling=1800.0)
BRAKES = brakes_of_wheels(BRAKE)


def along(pressures, start=0.0):
    torques = [start]
    for p in pressures:
        torques.append(brake_torque(0, p, torques[-1], BRAKES))
    return np.array(torques[1:])


def area(pressures, torques):
    return np.trapezoid(torques, pressures)


def test_whole_loop():
    """Friction's work per loop: the area between the two lines, cut at the top by the held torque."""
    top = 5.0
    p = np.concatenate((np.linspace(0, top, 2001), np.linspace(top, 0, 2001)))
    t = along(p)
    up = 0.5 * 1500.0 * (top - 0.75) ** 2
    highest = 1500.0 * (top - 0.75)
    corner = 0.5 + highest / 1800.0
    down = highest * (top - corner) + 0.5 * highest * (corner - 0.5)
    assert -area(p, t) == pytest.approx(down - up, rel=1e-5)
    assert not t[p[:] <= 0.5][:1].any() and not t[:2001][p[:2001] <= 0.75].any()
    assert t.min() >= 0.0 and t[-1] == 0.0


def test_partial_loop_is_closed_and_has_the_parallelogram_s_area():
    """Between two pressures p1 < p2 within the loop: four corners, of which two lie on each line."""
    p1, p2 = 2.5, 4.0
    once = np.concatenate((np.linspace(p2, p1, 1001), np.linspace(p1, p2, 1001)))
    t = along(np.concatenate((np.linspace(0, p2, 101), once)))[101:]
    high, low = 1500.0 * (p2 - 0.75), 1800.0 * (p1 - 0.5)
    a, b = 0.5 + high / 1800.0, 0.75 + low / 1500.0
    closed = high * (p2 - a) + 0.5 * (high + low) * (a - p1) - low * (b - p1) - 0.5 * (low + high) * (p2 - b)
    assert t[-1] == pytest.approx(high, abs=1e-9)
    assert -area(once, t) == pytest.approx(closed, rel=1e-5)


def test_sense_is_never_reversed():
    """At one pressure the torque of a fall is at least that of a rise, whatever came before."""
    random = np.random.default_rng(11)
    p = np.abs(np.cumsum(random.normal(0.0, 0.3, 1500)))
    t = along(p)
    steps, moves = np.diff(t), np.diff(p)
    assert (steps * moves >= 0.0).all()
    up = 1500.0 * np.maximum(p - 0.75, 0.0)
    down = 1800.0 * np.maximum(p - 0.5, 0.0)
    assert (t >= up - 1e-9).all() and (t <= down + 1e-9).all()


def chambers(**more):
    return BrakeChambers(np.array([0.15]), np.array([0.1]), 6.0, **more)


def test_valves_are_exact_whatever_the_steps():
    for steps in (1, 7):
        own, air = chambers(), air_at_rest(chambers(), SAMPLING_PERIOD)
        torques = np.zeros((steps + 1, 1))
        for valve in (APPLY, APPLY, HOLD, RELEASE):
            advance_by_valves(np.array([valve]), SAMPLING_PERIOD, air, own, BRAKES, torques)
        full = 6.0 * (1.0 - np.exp(-2.0 * SAMPLING_PERIOD / 0.15))
        assert air.pressure[0] == pytest.approx(full * np.exp(-SAMPLING_PERIOD / 0.1), rel=1e-13)


def test_delay_between_samples_turns_pressure_within_a_step():
    """Delay of 1.4 samples: the torque goes through the top of the pressure, not from end to end."""
    own = chambers(delay=1.4 * SAMPLING_PERIOD)
    air, torques = air_at_rest(own, SAMPLING_PERIOD), np.zeros((2, 1))
    air.pressure[0] = 3.0
    air.torque[0] = brake_torque(0, 3.0, 0.0, BRAKES)
    air.commands[:] = APPLY
    advance_by_valves(np.array([RELEASE]), SAMPLING_PERIOD, air, own, BRAKES, torques)
    before = air.pressure[0]
    advance_by_valves(np.array([RELEASE]), SAMPLING_PERIOD, air, own, BRAKES, torques)
    top = 6.0 + (before - 6.0) * np.exp(-0.4 * SAMPLING_PERIOD / 0.15)
    assert air.pressure[0] == pytest.approx(top * np.exp(-0.6 * SAMPLING_PERIOD / 0.1), rel=1e-12)
    assert torques[1, 0] == pytest.approx(1500.0 * (top - 0.75), rel=1e-12)  # held on the way down from the top


def test_strokes_from_a_reservoir():
    """A supply cut off: every full stroke leaves V / (V + v) of its pressure; all that is taken is in the chambers."""
    own = chambers(volumes=np.array([1.2]), reservoir=30.0)
    air, torques = air_at_rest(own, SAMPLING_PERIOD), np.zeros((5, 1))
    for stroke in range(1, 5):
        for _ in range(600):
            advance_by_valves(np.array([APPLY]), SAMPLING_PERIOD, air, own, BRAKES, torques)
        assert air.supply[0] == pytest.approx(6.0 * (30.0 / 31.2) ** stroke, rel=1e-9)
        assert air.pressure[0] == pytest.approx(air.supply[0], rel=1e-9)
        for _ in range(600):
            advance_by_valves(np.array([RELEASE]), SAMPLING_PERIOD, air, own, BRAKES, torques)


def test_reservoir_asks_for_volumes():
    with pytest.raises(InputError, match="volumes"):
        air_at_rest(chambers(reservoir=30.0), SAMPLING_PERIOD)


def test_commanded_pressures_are_there_at_once():
    air = AirState(np.zeros(1), np.zeros(1), np.array([6.0]), np.zeros((2, 1), dtype=np.int64))
    torques = np.full((4, 1), np.nan)
    advance_by_pressures(np.array([2.75]), air, BRAKES, torques)
    assert (torques == 3000.0).all() and air.pressure[0] == 2.75
