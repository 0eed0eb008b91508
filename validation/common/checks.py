"""Checks that cases and planted faults share: differences of a built model from the equations and from invariants.

Each check takes ``build_model``, a function (assembly, settings) -> model, so that it can judge an engine without
(``engine("mujoco")``) and with a planted fault. The difference of a refused or failed run is infinite.
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

ModelBuilder = Callable[[Assembly, Settings], Model]
SEED = 20
"""Seed of the random states."""
STATE_HALF_WIDTHS = np.array([0.5, 0.5, 0.5, 0.6, 3.0, 3.0, 3.0, 3.0])
"""Half-widths of the random states (m, rad, m/s, rad/s), uniform about 0: pitch up to 34 degrees, more than on any
road."""


def engine(engine_name: str) -> ModelBuilder:
    """Returns a function (assembly, settings) -> model that builds in the named engine, without a planted fault."""
    return partial(build, engine_name)


def random_states(state_count: int = 100) -> np.ndarray:
    """Random states (state_count, 8) at which accelerations are compared; the same at every call."""
    return np.random.default_rng(SEED).uniform(-1, 1, (state_count, 8)) * STATE_HALF_WIDTHS


def accelerations(build_model: ModelBuilder, assembly: Assembly, settings: Settings, states: np.ndarray) -> np.ndarray:
    """Accelerations (n, 4) of a model at states (n, 8) and at times spread over the run's steps."""
    model = build_model(assembly, settings)
    steps = np.rint(np.linspace(0.05, 0.95, len(states)) * settings.steps)
    return np.array(
        [model.acceleration(i * settings.step, *np.split(y, 2)) for i, y in zip(steps, states, strict=True)]
    )


def acceleration_gap(
    build_model: ModelBuilder, assembly: Assembly, settings: Settings, state_count: int = 100
) -> float:
    """Largest difference between a model's accelerations and those of the paper's equations at random states, divided
    by the largest acceleration."""
    states = random_states(state_count)
    hand = accelerations(engine("reference"), assembly, reference_settings(settings), states)
    return relative_difference(accelerations(build_model, assembly, settings, states), hand)


def relative_difference(computed_values: np.ndarray, expected_values: np.ndarray) -> float:
    """Largest difference between computed and expected values, divided by the largest expected magnitude."""
    return float(np.abs(computed_values - expected_values).max() / np.abs(expected_values).max())


def run(build_model: ModelBuilder, assembly: Assembly, settings: Settings) -> Trajectory | None:
    """Trajectory of a model's run; None where the run was refused or failed."""
    try:
        return build_model(assembly, settings).run()
    except (InputError, RunFailed):
        return None


def trajectory_gap(build_model: ModelBuilder, assembly: Assembly, settings: Settings) -> float:
    """Largest difference of any state (m, rad, m/s, rad/s) from the reference's run with the same step.

    The reference integrates with RK4, so this is a check to rounding for engines that do the same.
    """
    hand = engine("reference")(assembly, reference_settings(settings)).run()
    return state_gap(run(build_model, assembly, settings), hand)


def state_gap(trajectory: Trajectory | None, fine_trajectory: Trajectory) -> float:
    """Largest difference of any state (m, rad, m/s, rad/s) between two trajectories at common times; the step of
    ``fine_trajectory`` may be smaller by an integer factor."""
    if trajectory is None:
        return float("inf")
    stride = (len(fine_trajectory.times) - 1) // (len(trajectory.times) - 1)
    return float(np.abs(trajectory.states - fine_trajectory.states[::stride]).max())


def order_gap(
    build_model: ModelBuilder, assembly: Assembly, settings: Settings, reference_trajectory: Trajectory
) -> float:
    """Difference between observed and declared order of convergence, from runs at the settings' step and at half of it.

    reference_trajectory : path of the reference over the same time, with a step smaller by an integer factor.
    """
    name = settings.integrator
    declared = next(entries[name].order for entries in CATALOGUE.values() if name in entries)
    return abs(observed_order(build_model, assembly, settings, reference_trajectory) - declared)


def observed_order(
    build_model: ModelBuilder, assembly: Assembly, settings: Settings, reference_trajectory: Trajectory
) -> float:
    """Observed order of convergence: log2 of the largest state error at the settings' step divided by the error at half
    of it."""
    halved = replace(settings, step=settings.step / 2)
    coarse, fine = (
        state_gap(run(build_model, assembly, run_settings), reference_trajectory) for run_settings in (settings, halved)
    )
    return float(np.log2(coarse / fine)) if np.isfinite([coarse, fine]).all() and fine > 0 else float("-inf")


def equilibrium_gap(build_model: ModelBuilder, assembly: Assembly, settings: Settings) -> float:
    """Largest difference of any state from the static equilibrium (closed form) during a run on a flat road.

    assembly : the vehicle on its tyres without excitation.
    """
    trajectory = run(build_model, assembly, settings)
    if trajectory is None:
        return float("inf")
    rest_state = pitch_plane.equilibrium(assembly.parameters, assembly.vehicle.geometry)
    return float(np.abs(trajectory.states - rest_state).max())


def momentum_gap(build_model: ModelBuilder, assembly: Assembly, settings: Settings) -> float:
    """Error of the vertical momentum balance divided by weight times duration: change of momentum against the integral
    of weight minus wheel forces.

    The balance holds for any vehicle under prescribed wheel forces, whatever its suspension; with RK4 it is exact for
    forces that are constant or linear over each step. It needs no second implementation.
    """
    trajectory = run(build_model, assembly, settings)
    if trajectory is None:
        return float("inf")
    p = assembly.parameters
    masses = np.array([p.m1, p.m2, p.m3])
    momentum = trajectory.states[:, 4:7] @ masses
    weight = masses.sum() * p.g
    expected = weight * trajectory.times - _force_impulse(assembly, settings)
    return float(np.abs(momentum - momentum[0] - expected).max() / (weight * settings.duration))


def _force_impulse(assembly: Assembly, settings: Settings) -> np.ndarray:
    """Time integral (n + 1,) in N s of the sum of both wheel forces from 0 to the end of each of n steps."""
    signal, h, n = assembly.input, settings.step, settings.steps
    assert signal is not None
    force = signal.sample(0.0, h, n + 1)[:, :2].sum(axis=1)
    mean_force = force[:-1] if signal.held else 0.5 * (force[:-1] + force[1:])
    return np.concatenate(([0.0], np.cumsum(h * mean_force)))


def enforced_gap(build_model: ModelBuilder, assembly: Assembly, settings: Settings) -> float:
    """Rms difference of the enforced moment (or force, whichever is worse) from the reference's, which eliminates the
    prescribed coordinate, divided by the reference's rms."""
    path = run(build_model, assembly, settings)
    if path is None or path.enforced is None:
        return float("inf")
    hand = engine("reference")(assembly, reference_settings(settings)).run().enforced
    assert hand is not None
    return float(np.sqrt(np.mean((path.enforced - hand) ** 2, axis=0) / np.mean(hand**2, axis=0)).max())


def reference_settings(settings: Settings) -> Settings:
    """The settings with the reference's integrator, the classical Runge-Kutta method; step and duration are
    unchanged."""
    return replace(settings, integrator=RECOMMENDED["reference"])


def largest_relative_difference(computed_values: Any, expected_values: Any) -> float:
    """Largest difference divided by the largest expected magnitude."""
    return float(np.abs(np.asarray(computed_values) - expected_values).max() / np.abs(expected_values).max())
