"""Checks that cases and planted faults share: how far a built model is from the equations and from invariants.

Each takes ``make``, a function (assembly, settings) -> model, so that the same check judges an engine as
it is (``engine("mujoco")``) and one with a fault in it. A run that is refused or fails is infinitely far.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, RECOMMENDED
from models.engines.model import Model
from models.engines.protocol import build
from models.vehicles import pitch_plane

Make = Callable[[Assembly, Settings], Model]
SEED = 20
"""Of the random states."""
STATE_HALF_WIDTHS = np.array([0.5, 0.5, 0.5, 0.6, 3.0, 3.0, 3.0, 3.0])
"""Half-width of the random states (m, rad, m/s, rad/s): pitch up to 34 degrees, far beyond any road."""


def engine(name: str) -> Make:
    """Return a function that builds an assembly in the engine of this name, without any planted fault."""
    return partial(build, name)


def random_states(state_count: int = 100) -> np.ndarray:
    """The random states (state_count, 8) at which accelerations are compared; the same at every call."""
    return np.random.default_rng(SEED).uniform(-1, 1, (state_count, 8)) * STATE_HALF_WIDTHS


def accelerations(make_engine: Make, assembly: Assembly, settings: Settings, states: np.ndarray) -> np.ndarray:
    """Accelerations (n, 4) at states (n, 8), at times spread over the run's steps."""
    model = make_engine(assembly, settings)
    steps = np.rint(np.linspace(0.05, 0.95, len(states)) * settings.steps)
    return np.array(
        [model.acceleration(i * settings.step, *np.split(y, 2)) for i, y in zip(steps, states, strict=True)]
    )


def acceleration_gap(make_engine: Make, assembly: Assembly, settings: Settings, state_count: int = 100) -> float:
    """Largest difference from the accelerations of the paper's equations, relative to the largest acceleration."""
    states = random_states(state_count)
    hand = accelerations(engine("reference"), assembly, by_hand(settings), states)
    return relative_difference(accelerations(make_engine, assembly, settings, states), hand)


def relative_difference(computed_values: np.ndarray, hand: np.ndarray) -> float:
    """Largest difference divided by the largest expected magnitude."""
    return float(np.abs(computed_values - hand).max() / np.abs(hand).max())


def run(make_engine: Make, assembly: Assembly, settings: Settings) -> Trajectory | None:
    """The trajectory, None where the run was refused or failed."""
    try:
        return make_engine(assembly, settings).run()
    except (InputError, RunFailed):
        return None


def trajectory_gap(make_engine: Make, assembly: Assembly, settings: Settings) -> float:
    """Largest difference of any state (m, rad, m/s, rad/s) to the reference with the same tableau and step.

    The reference integrates with RK4, so this is a check to rounding for engines that do the same.
    """
    hand = engine("reference")(assembly, by_hand(settings)).run()
    return state_gap(run(make_engine, assembly, settings), hand)


def state_gap(path: Trajectory | None, other_trajectory: Trajectory) -> float:
    """Largest difference of any state at common times; ``other_trajectory`` may have a time step smaller by an integer
    factor."""
    if path is None:
        return float("inf")
    stride = (len(other_trajectory.times) - 1) // (len(path.times) - 1)
    return float(np.abs(path.states - other_trajectory.states[::stride]).max())


def order_gap(make_engine: Make, assembly: Assembly, settings: Settings, truth: Trajectory) -> float:
    """Difference between observed and declared order of convergence, from runs at the settings' step and at half of it.

    ``truth`` is a path of the reference over the same time at a step finer by a whole factor.
    """
    name = settings.integrator
    declared = next(entries[name].order for entries in CATALOGUE.values() if name in entries)
    return abs(observed_order(make_engine, assembly, settings, truth) - declared)


def observed_order(make_engine: Make, assembly: Assembly, settings: Settings, truth: Trajectory) -> float:
    """log2 of the ratio of the largest state errors at the settings' step and its half."""
    halved = replace(settings, step=settings.step / 2)
    coarse, fine = (state_gap(run(make_engine, assembly, run_settings), truth) for run_settings in (settings, halved))
    return float(np.log2(coarse / fine)) if np.isfinite([coarse, fine]).all() and fine > 0 else float("-inf")


def equilibrium_gap(make_engine: Make, assembly: Assembly, settings: Settings) -> float:
    """Largest distance that any state moves away from the static equilibrium (closed form) on a flat road.

    ``assembly`` is the vehicle on its tyres with nothing that drives it.
    """
    trajectory = run(make_engine, assembly, settings)
    if trajectory is None:
        return float("inf")
    rest_state = pitch_plane.equilibrium(assembly.parameters, assembly.vehicle.geometry)
    return float(np.abs(trajectory.states - rest_state).max())


def momentum_gap(make_engine: Make, assembly: Assembly, settings: Settings) -> float:
    """Error of the vertical momentum balance, relative to weight times time: change of momentum compared with the
    integral of weight minus wheel forces.

    An invariant of any vehicle under prescribed wheel forces, whatever its suspension does; exact under
    RK4 for forces that are constant or linear over each step. Needs no second implementation.
    """
    trajectory = run(make_engine, assembly, settings)
    if trajectory is None:
        return float("inf")
    p = assembly.parameters
    masses = np.array([p.m1, p.m2, p.m3])
    momentum = trajectory.states[:, 4:7] @ masses
    weight = masses.sum() * p.g
    expected = weight * trajectory.times - _force_impulse(assembly, settings)
    return float(np.abs(momentum - momentum[0] - expected).max() / (weight * settings.duration))


def _force_impulse(assembly: Assembly, settings: Settings) -> np.ndarray:
    """Integral of both wheel forces from 0 to each step's end, shape (n + 1,), N s."""
    signal, h, n = assembly.input, settings.step, settings.steps
    assert signal is not None
    force = signal.sample(0.0, h, n + 1)[:, :2].sum(axis=1)
    mean_force = force[:-1] if signal.held else 0.5 * (force[:-1] + force[1:])
    return np.concatenate(([0.0], np.cumsum(h * mean_force)))


def enforced_gap(make_engine: Make, assembly: Assembly, settings: Settings) -> float:
    """Rms difference of the enforced moment (or force, if worse) to the eliminated form, relative to its rms."""
    path = run(make_engine, assembly, settings)
    if path is None or path.enforced is None:
        return float("inf")
    hand = engine("reference")(assembly, by_hand(settings)).run().enforced
    assert hand is not None
    return float(np.sqrt(np.mean((path.enforced - hand) ** 2, axis=0) / np.mean(hand**2, axis=0)).max())


def by_hand(settings: Settings) -> Settings:
    """Settings for the reference's classical Runge-Kutta method with the step and duration of the given ones."""
    return replace(settings, integrator=RECOMMENDED["reference"])


def largest_relative_difference(computed_values: Any, expected: Any) -> float:
    """Largest difference divided by the largest expected magnitude."""
    return float(np.abs(np.asarray(computed_values) - expected).max() / np.abs(expected).max())
