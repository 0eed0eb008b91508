"""Vehicles, inputs and exact solutions that the hard cases share."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.linalg import expm

from models.core.signals import SampledSignal, Signal, Smooth, StackedSignal
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Mode, Settings
from models.engines.catalogue import RECOMMENDED
from models.engines.protocol import build
from models.engines.protocol import build_unchecked as build_unchecked
from models.engines.stability import first_order, linearised_matrices
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from validation.hard_cases.case import IMPLEMENTATIONS, OutcomeWord

IMPLICIT_INTEGRATORS = {"reference": "Radau", "exudyn": "GeneralizedAlpha", "mujoco": "discrete"}
"""Implementation -> integrator that is stable at every step."""
CONSTRAINED_INTEGRATORS = {"reference": "RK4", "exudyn": "GeneralizedAlpha", "mujoco": "RK4"}
REFUSED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "refused")
RAISED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "raised")
"""Expected outcomes: refused, or raised, in every implementation."""


def vehicle(
    parameter_set: str = "itwm_drift",
    geometry: str = "exact",
    start_state: np.ndarray | None = None,
    effects: dict[str, Any] | None = None,
    **parameter_changes: float,
) -> Assembly:
    """The pitch-plane vehicle on a flat road, at rest or in an initial state (8,)."""
    scene = build_scene(
        {
            "title": "hard case",
            "vehicle": {"parameters": parameter_set, "geometry": geometry, "override": parameter_changes},
            "run": {"duration": 1.0},
            "effects": effects or {},
        }
    )
    assembly = assembly_of_scene(scene)
    return assembly if start_state is None else replace(assembly, initial=np.array(start_state, dtype=float))


def driven_by_forces(base_assembly: Assembly, forces: Signal, drive_mode: Mode = "force") -> Assembly:
    """The vehicle without its road, under two wheel forces (N)."""
    return base_assembly.without_tyres().with_input(drive_mode, forces)


def guided_vehicle(base_assembly: Assembly, forces: Signal, pitch: Signal) -> Assembly:
    """The vehicle under wheel forces, with a prescribed pitch signal that has two derivatives; its initial state is
    consistent."""
    start = base_assembly.initial.copy()
    start[[3, 7]] = pitch.at(0.0)[:2]
    return replace(base_assembly.without_tyres().with_input("pitch", StackedSignal((forces, pitch))), initial=start)


def smooth_pitch(angles: np.ndarray, sample_period: float) -> Smooth:
    """Pitch samples (rad) as the signal that a scene makes of them: a quintic spline with two derivatives."""
    return Smooth(angles[:, None], sample_period, derivatives=2, degree=5)


def static_forces(
    base_assembly: Assembly,
    sample_count: int,
    sample_period: float,
    is_held: bool = True,
    noise_deviation: float = 0.0,
    seed: int = 1,
) -> SampledSignal:
    """Wheel forces (sample_count, 2) in N that carry the vehicle, with independent noise of a standard deviation (N) on
    each sample."""
    p, z = base_assembly.parameters, base_assembly.initial
    carried = np.array([p.k1 * z[0], p.k2 * z[1]])
    return SampledSignal(
        carried + noise_deviation * np.random.default_rng(seed).standard_normal((sample_count, 2)),
        sample_period,
        is_held,
    )


def run_settings(
    engine_name: str, time_step: float, duration: float, integrator: str = "", **solver_options: float
) -> Settings:
    """Settings of a run in an engine; the recommended integrator is the default; step and duration in s."""
    return Settings(integrator or RECOMMENDED[engine_name], time_step, duration, **solver_options)


def run(
    engine_name: str,
    assembly: Assembly,
    time_step: float,
    duration: float,
    integrator: str = "",
    **solver_options: float,
) -> Trajectory:
    """Trajectory of a run with all checks that a user's run has, so that it may be refused."""
    return build(
        engine_name, assembly, run_settings(engine_name, time_step, duration, integrator, **solver_options)
    ).run()


def unchecked_run(
    engine_name: str,
    assembly: Assembly,
    time_step: float,
    duration: float,
    integrator: str = "",
    **solver_options: float,
) -> Trajectory:
    """Trajectory of a run without the checks before it; only the guard after the run is active."""
    engine_settings = run_settings(engine_name, time_step, duration, integrator, **solver_options)
    return build_unchecked(engine_name, assembly, engine_settings).run()


def tight_solution(assembly: Assembly, time_step: float, duration: float) -> Trajectory:
    """Independent trajectory by the paper's equations with order 8 at a relative tolerance of 1e-12, with rows every
    ``time_step`` (s)."""
    return run("reference", assembly, time_step, duration, "DOP853", tolerance=1e-12)


def exact_states(assembly: Assembly, time_step: float, step_count: int, forces: np.ndarray | None = None) -> np.ndarray:
    """Exact states (step_count + 1, 8) of the linearised vehicle, by the matrix exponential.

    forces (step_count, 2) in N are held over each step; None is the vehicle on the flat road.
    """
    linear = linearised_matrices(assembly.vehicle)
    push = np.zeros((step_count, 4))
    push[:, :3] = [body.mass * assembly.vehicle.gravity for body in assembly.vehicle.bodies]
    if forces is not None:
        push[:, :2] -= forces
    block = np.zeros((16, 16))
    block[:8, :8], block[:8, 8:] = first_order(linear), np.eye(8)
    transition = expm(block * time_step)
    states = [assembly.initial]
    for row in push:
        rate = np.concatenate((np.zeros(4), row / linear[0].diagonal()))
        states.append(transition[:8, :8] @ states[-1] + transition[:8, 8:] @ rate)
    return np.array(states)


def exact_decay(assembly: Assembly, times: np.ndarray) -> np.ndarray:
    """Exact states (n, 8) of the linearised vehicle on a flat road, at any times (n,) in s."""
    poles, shapes = np.linalg.eig(first_order(linearised_matrices(assembly.vehicle)))
    rest_state = vehicle(geometry="linear").initial
    shares = np.linalg.solve(shapes, assembly.initial - rest_state)
    return rest_state + ((np.exp(np.outer(times, poles)) * shares) @ shapes.T).real


def largest_magnitude(values: np.ndarray) -> float:
    """Largest magnitude of an array's entries."""
    return float(np.abs(values).max())


def root_mean_square(values: np.ndarray) -> float:
    """Root mean square of an array's entries."""
    return float(np.sqrt(np.mean(np.square(values))))
