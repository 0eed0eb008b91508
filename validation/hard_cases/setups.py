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
    parameters: str = "itwm_drift",
    geometry: str = "exact",
    initial: np.ndarray | None = None,
    effects: dict[str, Any] | None = None,
    **override: float,
) -> Assembly:
    """The pitch-plane vehicle on a flat road, at rest or in an initial state (8,)."""
    scene = build_scene(
        {
            "title": "hard case",
            "vehicle": {"parameters": parameters, "geometry": geometry, "override": override},
            "run": {"duration": 1.0},
            "effects": effects or {},
        }
    )
    assembly = assembly_of_scene(scene)
    return assembly if initial is None else replace(assembly, initial=np.array(initial, dtype=float))


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
    noise: float = 0.0,
    seed: int = 1,
) -> SampledSignal:
    """Wheel forces (sample_count, 2) in N that carry the vehicle, with independent noise of a standard deviation (N) on
    each sample."""
    p, z = base_assembly.parameters, base_assembly.initial
    carried = np.array([p.k1 * z[0], p.k2 * z[1]])
    return SampledSignal(
        carried + noise * np.random.default_rng(seed).standard_normal((sample_count, 2)), sample_period, is_held
    )


def settings(engine: str, step: float, duration: float, integrator: str = "", **options: float) -> Settings:
    """Settings of a run in an engine; the recommended integrator is the default; step and duration in s."""
    return Settings(integrator or RECOMMENDED[engine], step, duration, **options)


def run(
    engine: str, assembly: Assembly, step: float, duration: float, integrator: str = "", **options: float
) -> Trajectory:
    """Trajectory of a run with all checks that a user's run has, so that it may be refused."""
    return build(engine, assembly, settings(engine, step, duration, integrator, **options)).run()


def unchecked_run(
    engine: str, assembly: Assembly, step: float, duration: float, integrator: str = "", **options: float
) -> Trajectory:
    """Trajectory of a run without the checks before it; only the guard after the run is active."""
    engine_settings = settings(engine, step, duration, integrator, **options)
    return build_unchecked(engine, assembly, engine_settings).run()


def tight_solution(assembly: Assembly, step: float, duration: float) -> Trajectory:
    """Independent trajectory by the paper's equations with order 8 at a relative tolerance of 1e-12, with rows every
    ``step`` (s)."""
    return run("reference", assembly, step, duration, "DOP853", tolerance=1e-12)


def exact_states(assembly: Assembly, step: float, step_count: int, forces: np.ndarray | None = None) -> np.ndarray:
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
    transition = expm(block * step)
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


def largest_magnitude(difference: np.ndarray) -> float:
    """Largest magnitude of an array's entries."""
    return float(np.abs(difference).max())


def root_mean_square(values: np.ndarray) -> float:
    """Root mean square of an array's entries."""
    return float(np.sqrt(np.mean(np.square(values))))
