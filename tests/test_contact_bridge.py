"""Creep forces as a callback of both engines: the same numbers by every bridge, nothing silent, threads that agree."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_approach
from models.contact.undeformed_distance import from_function
from models.core.errors import InputError, Refused, RunFailed
from models.engines.contact_bridge import RailWheels, add_forces, force_slopes_by_differences, forces
from models.engines.contact_bridge_exudyn import ROUTES, RailWheelSystem, WheelForceFunctions
from models.engines.contact_bridge_mujoco import empty_law, python_law, rail_wheel_model
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from validation.cases.contact_bridges import contact_law_of_library

STEP, STEPS = 1e-4, 60


def exudyn(wheels: RailWheels, of, route=ROUTES[0], solver="RK44") -> np.ndarray:
    return RailWheelSystem(wheels, of, route).run(*wheels.state(), STEPS, STEP, solver)


def native(wheels: RailWheels, states: np.ndarray, integrator="RK4", threads=1) -> np.ndarray:
    with installed_callback(kernel_law(forces)):
        return Marcher(rail_wheel_model(wheels, STEP, integrator), threads).run(states, STEPS)


@pytest.mark.grounds("plain counterpart")
def test_forces_are_those_of_the_package():
    wheels = RailWheels(2, cells=11)
    (q, v), f = wheels.state(), np.zeros(8)
    add_forces(wheels.numbers, q, v, f)
    for k in (0, 4):
        hertz = by_approach(*wheels.curvatures, wheels.sunk + q[k + 2], wheels.pair)
        motion = v[k] / wheels.speed, v[k + 1] / wheels.speed - q[k + 3], v[k + 3] / wheels.speed
        creep = fastsim(RollingEllipse(hertz.a, hertz.b, hertz.load, wheels.mu, *motion), wheels.pair, cells=11)
        expected = [creep.fx, creep.fy, wheels.load - hertz.load, creep.mz]
        np.testing.assert_allclose(f[k : k + 4], expected, rtol=1e-11, atol=1e-7)


@pytest.mark.parametrize(
    ("count", "theory", "cells"), [(1, "fastsim", 7), (4, "fastsim", 21), (8, "linear", 21), (1, "simplified", 7)]
)
def test_both_engines_give_one_path(count, theory, cells):
    wheels = RailWheels(count, theory, cells)
    path = native(wheels, np.concatenate(wheels.state())[None])[0, -1]
    # one kernel and one method; rates are of 0.1 m/s and rad/s
    np.testing.assert_allclose(path, exudyn(wheels, WheelForceFunctions(wheels).of), rtol=0.0, atol=1e-14)


@pytest.mark.grounds("plain counterpart")
def test_every_bridge_gives_one_path():
    wheels = RailWheels(2, cells=11)
    start, built = np.concatenate(wheels.state())[None], rail_wheel_model(wheels, STEP, "RK4")
    expected = native(wheels, start)[0, -1]
    for law, close in ((add_forces, 0.0), (contact_law_of_library(wheels), 1e-12)):
        mujoco.set_mjcb_passive(python_law(law))
        try:
            found = Marcher(built).run(start, STEPS)[0, -1]
        finally:
            mujoco.set_mjcb_passive(None)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=close)
    for of, route in (
        (WheelForceFunctions(wheels).of, "loads"),
        (WheelForceFunctions(wheels, contact_law_of_library(wheels)).of, ROUTES[0]),
    ):
        np.testing.assert_allclose(exudyn(wheels, of, route), expected, rtol=0.0, atol=1e-12)
    held = exudyn(wheels, WheelForceFunctions(wheels).of, "before each step", "ExplicitEuler")
    # explicit Euler sees the start of a step only, so that holding its forces is no error
    np.testing.assert_allclose(
        held, exudyn(wheels, WheelForceFunctions(wheels).of, solver="ExplicitEuler"), rtol=0.0, atol=1e-14
    )


def test_threads_agree_to_the_last_bit():
    wheels = RailWheels()
    states = np.array([np.concatenate(wheels.state(seed)) for seed in range(6)])
    assert native(wheels, states, threads=2).tobytes() == native(wheels, states).tobytes()


def test_an_empty_callback_changes_nothing():
    wheels = RailWheels(1, "none")
    start, built = np.concatenate(wheels.state())[None], rail_wheel_model(wheels, STEP)
    alone = Marcher(built).run(start, STEPS)
    with installed_callback(empty_law()):
        assert np.array_equal(Marcher(built).run(start, STEPS), alone)


def test_wheels_that_lift_off_feel_their_weight_alone():
    wheels, f = RailWheels(1), np.zeros(4)
    add_forces(wheels.numbers, np.array([0.0, 0.0, -1.0, 0.0]), np.full(4, 0.1), f)
    assert f.tolist() == [0.0, 0.0, wheels.load, 0.0]


def test_what_no_kernel_can_answer_is_no_path():
    wheels = RailWheels(1)
    q, v = np.array([0.0, 0.0, 0.06, 0.0]), np.zeros(4)  # an approach beyond 50 mm
    with pytest.raises(RunFailed, match="mujoco"):
        native(wheels, np.concatenate((q, v))[None])
    with pytest.raises(RunFailed, match="exudyn"):
        RailWheelSystem(wheels, WheelForceFunctions(wheels).of).run(q, v, 5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"count": 0},
        {"count": 1.5},
        {"speed": float("inf")},
        {"load": float("nan")},
        {"cells": 2},
        {"theory": "hertz"},
        {"theory": "simplified", "cells": 2},
    ],
)
def test_wheels_that_are_none(wrong):
    with pytest.raises(InputError):
        _ = RailWheels(**wrong).numbers


@pytest.mark.grounds("closed form")
def test_slopes_are_those_of_the_linear_theory_where_nothing_slips():
    wheels, found = RailWheels(2, "linear"), np.zeros((8, 8))
    q, v = np.zeros(8), np.zeros(8)
    add_forces(wheels.numbers, q, v, base := np.zeros(8))
    for by_q, by_v in ((1.0, 0.0), (0.0, 1.0), (3.0, -2.0)):
        force_slopes_by_differences(wheels.numbers, q, v, by_q, by_v, found)
        for column in range(8):
            if column % 4 == 2:  # along z all creep forces stay zero here, and the load is Hertz's
                continue
            moved = np.zeros(8)
            add_forces(wheels.numbers, q + by_q * np.eye(8)[column] * 1e-3, v + by_v * np.eye(8)[column] * 1e-3, moved)
            # linear forces: a difference over any step is the derivative
            np.testing.assert_allclose(found[:, column], 1e3 * (moved - base), rtol=1e-7, atol=1e-3)


def test_implicit_steps_need_fewer_calls_with_slopes_and_end_alike():
    wheels, ends, calls = RailWheels(2, cells=11), [], []
    for slope in (None, WheelForceFunctions(wheels).slopes):
        forces, count = WheelForceFunctions(wheels), []
        rolling = RailWheelSystem(wheels, lambda q, v, f=forces, n=count: n.append(1) or f.of(q, v), force_slopes=slope)
        ends.append(rolling.run(*wheels.state(), 20, 1e-3, "GeneralizedAlpha"))
        calls.append(len(count))
    # Newton's method ends at its own tolerance, whatever matrix it takes
    np.testing.assert_allclose(ends[1], ends[0], rtol=0.0, atol=1e-8)
    assert calls[1] < calls[0]


def test_low_speed_forces_no_tiny_steps():
    # creepages are rates by speed: at 1 m/s wheels damp at 1e4 1/s, of which an explicit step is less than 2.8
    wheels, start = RailWheels(1, cells=7, speed=1.0), (np.array([1e-4, 1e-4, 0.0, 1e-4]), np.zeros(4))
    forces, refused = WheelForceFunctions(wheels), pytest.raises(Refused, match="stability limit of RK44")
    with refused as told:
        RailWheelSystem(wheels, forces.of).run(*start, 50, 4e-3, "RK44")
    stable = float(re.search(r"RK44, (\S+) s,", str(told.value))[1])
    true = RailWheelSystem(wheels, forces.of).run(*start, 2000, 1e-4, "RK44")
    assert 1e-4 < stable < 4e-3 / 20.0
    for solver in ("GeneralizedAlpha", "TrapezoidalIndex2"):
        end = RailWheelSystem(wheels, forces.of, force_slopes=forces.slopes).run(*start, 50, 4e-3, solver)
        # second order in a step that is 1/17 of the suspension's shortest period: below 0.1 % of what is left
        assert np.abs(end - true)[:4].max() < 1e-3 * np.abs(true[:4]).max()


@pytest.mark.parametrize("speed", [0.0, 0.05, -0.05])
def test_crawling_and_standing_wheels(speed):
    wheels = RailWheels(1, cells=7, speed=speed)
    q, v = wheels.state()
    forces = WheelForceFunctions(wheels)
    end = RailWheelSystem(wheels, forces.of, force_slopes=forces.slopes).run(q, v / 200.0, 20, 1e-3, "GeneralizedAlpha")
    assert np.abs(end[:4]).max() < np.abs(q).max()
    with pytest.raises(RunFailed, match="exudyn"):  # Newton's method by differences leaps from slip to slip
        RailWheelSystem(wheels, forces.of).run(q, v / 200.0, 20, 1e-3, "GeneralizedAlpha")


def force(speed: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    add_forces(RailWheels(1, cells=7, speed=speed).numbers, q, v, found := np.zeros(4))
    return found


def test_forces_through_zero_speed():
    q, v = np.array([0.0, 0.0, 1e-5, 2e-3]), np.array([2e-4, -1e-4, 0.0, 1e-2])
    speeds = np.linspace(-0.2, 0.2, 401)
    found = np.array([force(speed, q, v) for speed in speeds])
    # continuous: no change over 1 mm/s is more than ten times the even share of the whole change
    assert (np.abs(np.diff(found, axis=0)).max(axis=0) <= 10.0 / 400.0 * np.ptp(found, axis=0) + 1e-6).all()
    mirror = np.array([-1.0, 1.0, 1.0, -1.0])
    for k in (0, 60, 150, 200):  # rolling backwards is the mirror image of rolling forwards, slip and all
        np.testing.assert_allclose(force(-speeds[k], mirror * q, mirror * v), mirror * found[k], rtol=1e-10, atol=1e-6)
    slips = np.column_stack((np.full(401, v[0]), v[1] - speeds * q[3], np.zeros(401), np.full(401, v[3])))
    assert (np.sum(found * slips, axis=1) < 0.0).all()


def test_simplified_theory_is_near_to_fastsim():
    # the same ellipse by two theories: about a tenth of mu N between them
    wheels, found = RailWheels(4), []
    for theory in ("fastsim", "simplified"):
        add_forces(replace(wheels, theory=theory).numbers, *wheels.state(), f := np.zeros(16))
        found.append(f.reshape(4, 4))
    off = np.abs(found[1] - found[0])[:, :2].max() / (0.3 * wheels.load)
    assert 1e-4 < off < 0.1


def test_a_distance_that_rolls_one_way_only():
    leaning = from_function(lambda x, y: (x**2 + y**2) * (1.3 + 10.0 * x), (-0.03, 0.03), (-0.03, 0.03), 61)
    assert np.isfinite(force_of(RailWheels(1, "simplified", 7, distance=leaning)))
    with pytest.raises(InputError, match="mirror image"):
        RailWheels(1, "simplified", 7, distance=leaning, speed=0.0)


def force_of(wheels: RailWheels) -> float:
    add_forces(wheels.numbers, np.zeros(4), np.full(4, 1e-3), f := np.zeros(4))
    return float(f.sum())


def test_a_step_too_long_is_refused_by_both_engines():
    with pytest.raises(Refused, match=r"mujoco.*stability limit of RK4,"):
        rail_wheel_model(RailWheels(1), 2e-3, "RK4")
    assert rail_wheel_model(RailWheels(1), 2e-4, "RK4").opt.timestep == 2e-4
