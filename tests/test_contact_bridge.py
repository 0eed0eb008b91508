"""Creep forces as a callback of both engines: the same numbers by every bridge, nothing silent, threads that agree."""

import mujoco
import numpy as np
import pytest

from models.contact.fastsim import fastsim
from models.contact.hertz import by_approach
from models.engines.contact_bridge import SUNK, Wheels, add_forces, slopes
from models.engines.contact_bridge_exudyn import ROUTES, Forces, Rolling
from models.engines.contact_bridge_mujoco import Marcher, empty_law, model, native_law, python_law
from models.engines.mujoco_callback import installed
from models.errors import InputError, RunFailed
from validation.cases.contact_bridges import plain

STEP, STEPS = 1e-4, 60


def exudyn(wheels: Wheels, of, route=ROUTES[0], solver="RK44") -> np.ndarray:
    return Rolling(wheels, of, route).run(*wheels.state(), STEPS, STEP, solver)


def native(wheels: Wheels, states: np.ndarray, integrator="RK4", threads=1) -> np.ndarray:
    with installed(native_law()):
        return Marcher(model(wheels, STEP, integrator), threads).run(states, STEPS)


def test_forces_are_those_of_the_package():
    wheels = Wheels(2, 11)
    (q, v), f = wheels.state(), np.zeros(8)
    add_forces(wheels.numbers, q, v, f)
    for k in (0, 4):
        hertz = by_approach(*wheels.curvatures, wheels.numbers[SUNK] + q[k + 2], wheels.pair)
        motion = v[k] / wheels.speed, v[k + 1] / wheels.speed - q[k + 3], v[k + 3] / wheels.speed
        creep = fastsim(hertz.a, hertz.b, hertz.load, wheels.mu, *motion, wheels.pair, cells=11)
        expected = [creep.fx, creep.fy, wheels.load - hertz.load, creep.mz]
        np.testing.assert_allclose(f[k : k + 4], expected, rtol=1e-11, atol=1e-7)


@pytest.mark.parametrize(("count", "cells"), [(1, 7), (4, 21), (8, 0)])
def test_both_engines_give_one_path(count, cells):
    wheels = Wheels(count, cells)
    path = native(wheels, np.concatenate(wheels.state())[None])[0, -1]
    # one kernel and one method; rates are of 0.1 m/s and rad/s
    np.testing.assert_allclose(path, exudyn(wheels, Forces(wheels).of), rtol=0.0, atol=1e-14)


def test_every_bridge_gives_one_path():
    wheels = Wheels(2, 11)
    start, built = np.concatenate(wheels.state())[None], model(wheels, STEP, "RK4")
    expected = native(wheels, start)[0, -1]
    for law, close in ((add_forces, 0.0), (plain(wheels), 1e-12)):
        mujoco.set_mjcb_passive(python_law(law))
        try:
            found = Marcher(built).run(start, STEPS)[0, -1]
        finally:
            mujoco.set_mjcb_passive(None)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=close)
    for of, route in ((Forces(wheels).of, "loads"), (Forces(wheels, plain(wheels)).of, ROUTES[0])):
        np.testing.assert_allclose(exudyn(wheels, of, route), expected, rtol=0.0, atol=1e-12)
    held = exudyn(wheels, Forces(wheels).of, "before each step", "ExplicitEuler")
    # explicit Euler sees the start of a step only, so that holding its forces is no error
    np.testing.assert_allclose(held, exudyn(wheels, Forces(wheels).of, solver="ExplicitEuler"), rtol=0.0, atol=1e-14)


def test_threads_agree_to_the_last_bit():
    wheels = Wheels()
    states = np.array([np.concatenate(wheels.state(seed)) for seed in range(6)])
    assert native(wheels, states, threads=2).tobytes() == native(wheels, states).tobytes()


def test_an_empty_callback_changes_nothing():
    wheels = Wheels(1, None)
    start, built = np.concatenate(wheels.state())[None], model(wheels, STEP)
    alone = Marcher(built).run(start, STEPS)
    with installed(empty_law()):
        assert np.array_equal(Marcher(built).run(start, STEPS), alone)


def test_wheels_that_lift_off_feel_their_weight_alone():
    wheels, f = Wheels(1), np.zeros(4)
    add_forces(wheels.numbers, np.array([0.0, 0.0, -1.0, 0.0]), np.full(4, 0.1), f)
    assert f.tolist() == [0.0, 0.0, wheels.load, 0.0]


def test_what_no_kernel_can_answer_is_no_path():
    wheels = Wheels(1)
    q, v = np.array([0.0, 0.0, 0.06, 0.0]), np.zeros(4)  # an approach beyond 50 mm
    with pytest.raises(RunFailed, match="mujoco"):
        native(wheels, np.concatenate((q, v))[None])
    with pytest.raises(RunFailed, match="exudyn"):
        Rolling(wheels, Forces(wheels).of).run(q, v, 5)


@pytest.mark.parametrize("wrong", [{"count": 0}, {"count": 1.5}, {"speed": 0.0}, {"load": float("nan")}, {"cells": 2}])
def test_wheels_that_are_none(wrong):
    with pytest.raises(InputError):
        _ = Wheels(**wrong).numbers


def test_slopes_are_those_of_the_linear_theory_where_nothing_slips():
    wheels, found = Wheels(2, 0), np.zeros((8, 8))
    q, v = np.zeros(8), np.zeros(8)
    add_forces(wheels.numbers, q, v, base := np.zeros(8))
    for by_q, by_v in ((1.0, 0.0), (0.0, 1.0), (3.0, -2.0)):
        slopes(wheels.numbers, q, v, by_q, by_v, found)
        for column in range(8):
            if column % 4 == 2:  # along z all creep forces stay zero here, and the load is Hertz's
                continue
            moved = np.zeros(8)
            add_forces(wheels.numbers, q + by_q * np.eye(8)[column] * 1e-3, v + by_v * np.eye(8)[column] * 1e-3, moved)
            # linear forces: a difference over any step is the derivative
            np.testing.assert_allclose(found[:, column], 1e3 * (moved - base), rtol=1e-7, atol=1e-3)


def test_implicit_steps_need_fewer_calls_with_slopes_and_end_alike():
    wheels, ends, calls = Wheels(2, 11), [], []
    for slope in (None, Forces(wheels).slopes):
        forces, count = Forces(wheels), []
        rolling = Rolling(wheels, lambda q, v, f=forces, n=count: n.append(1) or f.of(q, v), slopes=slope)
        ends.append(rolling.run(*wheels.state(), 20, 1e-3, "GeneralizedAlpha"))
        calls.append(len(count))
    # Newton's method ends at its own tolerance, whatever matrix it takes
    np.testing.assert_allclose(ends[1], ends[0], rtol=0.0, atol=1e-8)
    assert calls[1] < calls[0]


def test_low_speed_forces_no_tiny_steps():
    # creepages are rates by speed: at 0.1 m/s wheels damp at 1e5 1/s, where an explicit step of 1 ms is lost
    wheels = Wheels(1, 11, speed=0.1)
    q, v = wheels.state()
    forces = Forces(wheels)
    end = Rolling(wheels, forces.of, slopes=forces.slopes).run(q, v / 200.0, 20, 1e-3, "GeneralizedAlpha")
    assert np.abs(end[:4]).max() < np.abs(q).max()
    with pytest.raises(RunFailed):
        Rolling(wheels, forces.of).run(q, v / 200.0, 20, 1e-3, "GeneralizedAlpha")
