"""A wheelset on rails in both engines: accelerations, paths, linearisation and limit cycle of the written equations."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from models.engines.wheelset import ExudynWheelset, MujocoWheelset
from models.rail import equations as eq
from models.rail.eigenvalues import hunting_wavelength, largest_growth_rate
from models.rail.equations import WheelsetEquations
from models.rail.joint_forces import joint_forces, joints_from_states, states_from_joints
from models.rail.limit_cycle import attained_limit_cycle, refined_orbit, solved_orbit
from models.rail.linear import critical_speed
from models.rail.wheelset import CHOSEN_WHEELSET

ENGINES = (MujocoWheelset, ExudynWheelset)
LIVELY = np.array([6e-3, 5e-5, 2e-3, 2e-2, 3.0, 0.3, 0.05, 1.0, 1.0, 10.0])
"""Spread of random states: flanges touch, wheels lift off, creep forces saturate."""
both = pytest.mark.parametrize("engine", ENGINES)


@pytest.mark.grounds("plain counterpart")
@both
@pytest.mark.parametrize("law", ["linear", "fastsim"])
def test_accelerations_are_those_of_the_equations(engine, law):
    written, built = WheelsetEquations(CHOSEN_WHEELSET, 60.0, law), engine(CHOSEN_WHEELSET, 60.0, law)
    draw = np.random.default_rng(1)
    states = written.rest + LIVELY * draw.normal(size=(100, eq.STATE_COUNT))
    expected = np.array([written.rates(state) for state in states])
    loads = [written.run(state, 1e-9, 1e-9).contacts["load"][0] for state in states]
    assert 5 < np.sum(np.array(loads) == 0.0) < 195  # wheels in the air and on the rail are among them
    found = [built.rates(state) for state in states]
    # Both wheels in the air leave a spin without moment: rounding of 1e-14 rad/s^2 beside zero.
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-13)


def test_paths_over_a_second():
    written = WheelsetEquations(CHOSEN_WHEELSET, 60.0)
    start = written.displaced_state(5e-3)
    paths = [one.run(start, 1.0, 5e-4) for one in (written, *(engine(CHOSEN_WHEELSET, 60.0) for engine in ENGINES))]
    reference, mujoco, exudyn = (path.states for path in paths)
    assert np.ptp(reference[:, eq.Y]) > 5e-3
    # 4e-12 seen, of spin: the engines' fifth rate is that against the axes, which RK4 rounds off elsewhere.
    assert np.abs(mujoco - reference).max() < 1e-10
    assert np.abs(exudyn - reference).max() < 1e-10
    assert np.abs(exudyn - mujoco).max() < 1e-10
    for path in paths[1:]:
        for name in path.contacts.dtype.names:
            np.testing.assert_allclose(path.contacts[name], paths[0].contacts[name], rtol=1e-6, atol=1e-6)
        assert path.times == pytest.approx(paths[0].times)
        assert (path.contacts["power"] <= 0.0).all()


@pytest.mark.grounds("plain counterpart")
@both
def test_klingels_wave_and_critical_speed(engine):
    assert hunting_wavelength(engine, CHOSEN_WHEELSET) == pytest.approx(
        hunting_wavelength(WheelsetEquations, CHOSEN_WHEELSET), rel=1e-6
    )  # 4e-11 seen
    speed = critical_speed(CHOSEN_WHEELSET, partial(largest_growth_rate, WheelsetEquations))
    assert critical_speed(CHOSEN_WHEELSET, partial(largest_growth_rate, engine)) == pytest.approx(
        speed, rel=1e-6
    )  # 2e-10 seen
    assert (
        critical_speed(CHOSEN_WHEELSET.changed(stiffness_x=2.5e5), partial(largest_growth_rate, WheelsetEquations))
        > 1.01 * speed
    )


@both
def test_wheels_that_lift_off_come_back_as_in_the_equations(engine):
    written = WheelsetEquations(CHOSEN_WHEELSET, 40.0, cells=11)
    start = written.rest - 2e-4 * np.eye(eq.STATE_COUNT)[eq.Z]
    path, expected = (one.run(start, 0.1, 2e-4, 5) for one in (engine(CHOSEN_WHEELSET, 40.0, cells=11), written))
    assert (path.contacts["load"][0] == 0.0).all()
    assert (path.contacts["load"][-1] > 0.0).all()
    np.testing.assert_allclose(path.states, expected.states, rtol=0.0, atol=1e-10)
    assert path.times == pytest.approx(expected.times)


def test_threads_agree_to_the_last_bit():
    built = MujocoWheelset(CHOSEN_WHEELSET, 60.0, cells=11)
    model = built.model.model
    model.opt.timestep = 5e-4
    starts = np.array([joints_from_states(built.displaced_state(shift)) for shift in (1e-3, 3e-3, 5e-3)])
    with installed_callback(kernel_law(joint_forces)):
        one, two = (Marcher(model, threads).run(starts, 50) for threads in (1, 2))
    assert one.tobytes() == two.tobytes()


@pytest.mark.grounds("closed form")
def test_joints_and_states():
    states = LIVELY * np.random.default_rng(2).normal(size=(4, eq.STATE_COUNT))
    assert states_from_joints(joints_from_states(states)) == pytest.approx(states, abs=1e-15)


@both
def test_what_cannot_be_is_refused(engine):
    built = engine(CHOSEN_WHEELSET, 50.0, cells=11)
    with pytest.raises(InputError, match="at most"):
        built.run(built.rest, 1.0, 5e-3)
    start = built.rest.copy()
    start[eq.YAW_RATE] = 50.0
    with pytest.raises(RunFailed, match=built.ENGINE):
        built.run(start, 0.2, 5e-4)


@both
def test_limit_cycle(engine):
    expected = attained_limit_cycle(WheelsetEquations(CHOSEN_WHEELSET, 75.0, cells=11))
    slower = solved_orbit(replace(expected, equations=WheelsetEquations(CHOSEN_WHEELSET, 74.5, cells=11)), "amplitude")
    guess = replace(slower, equations=engine(CHOSEN_WHEELSET, 75.0, cells=11))
    found = refined_orbit(solved_orbit(guess, "amplitude", is_precise=False), "amplitude")
    half = refined_orbit(expected, "amplitude")
    assert found.amplitude - slower.amplitude > 1e-5
    assert abs(found.amplitude - half.amplitude) <= half.error < 1e-2 * half.amplitude
    assert abs(found.frequency - half.frequency) <= half.frequency_error < 1e-2 * half.frequency
