"""Parts of the computing time of a step: the engine, the bridge to the compiled forces, and the force kernel.

Three runs differ in the callback alone: an empty one gives the engine's part; a cheap one, which is handed all
positions and rates and returns a damper's forces, adds the bridge; and the real one adds the kernel.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import carray

from models.drawing.figures import LABELS
from models.engines.assembly import Settings
from models.engines.contact_bridge import RailWheels, forces
from models.engines.contact_bridge_exudyn import RailWheelSystem, WheelForceFunctions, list_forces
from models.engines.contact_bridge_mujoco import empty_law, rail_wheel_model
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from models.engines.reference import compiled_derivative
from models.machine.compiled import njit
from models.machine.stack import at, beyond
from models.machine.timing import bootstrap_median, interleave
from models.systems.pitch_plane.scene import assembly_of_scene
from validation.common.rows import Observed, Row, Saved, System, Table
from validation.price.compiled_forces import CompiledForces, force_callback
from validation.price.instructions_run import exudyn_marches
from validation.price.problems import road_excited, wheelset
from validation.price.problems.road_excited import STAGES_OF_METHOD

SYSTEM: System = "cost"
FORCE_VARIANTS = ("empty", "cheap", "real")
STEPS = {"road": 1000, "wheel-20": 400}
"""Number of steps of a run, by the problem's key."""
STEP = {"road": 1e-3, "wheel-20": 2.5e-4}
"""Step (s) of a run, by the problem's key."""
WEAK_DAMPING = 1e-3
"""Damping (N s/m) of the cheap force law, which hardly changes the motion."""
METHODS = {"exudyn": "RK44", "mujoco": "RK4"}


@njit(cache=True, error_model="numpy")
def add_weak_damper(damper_parameters, t, q, v, force_pointer):
    """Add the forces of a weak damper on four coordinates to ``force_pointer``; all arguments but the time ``t`` are
    pointers to doubles."""
    rate, force = carray(v, (4,)), carray(force_pointer, (4,))
    for i in range(4):
        force[i] -= WEAK_DAMPING * rate[i]


@njit(cache=True, error_model="numpy")
def weak_damper_in_block(block_address, t, coordinate_count):
    """Compute the forces of the weak damper in a block of doubles at an address: forces, coordinates and rates, (n,)
    each."""
    f = at(block_address)
    carray(f, (coordinate_count,))[:] = 0.0
    add_weak_damper(f, t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)


ZERO_FORCES = [0.0] * 4


def zero_forces(positions: Any, rates: Any) -> Any:
    """Force function that returns zero forces at every state."""
    return ZERO_FORCES


Runs = list[Callable[[], Any]]


def _road_runs_in_exudyn() -> Runs:
    """Runs of the pitch-plane vehicle in Exudyn with empty, cheap and real forces; the real ones are computed by the
    right-hand side of the reference implementation."""
    assembly = assembly_of_scene(road_excited.scene())
    p, y, road = assembly.parameters.array(), np.empty(8), np.zeros(4)
    masses = [assembly.parameters.m1, assembly.parameters.m2, assembly.parameters.m3, assembly.parameters.I]
    derivative, scale = compiled_derivative("road", assembly.vehicle.geometry), np.array(masses)

    def forces_of(positions: Any, rates: Any) -> list[float]:
        y[:4], y[4:] = positions, rates
        return (scale * derivative(y, road, p)[4:]).tolist()

    return [
        partial(exudyn_marches(masses, law, [METHODS["exudyn"]])[0], STEPS["road"])
        for law in (zero_forces, list_forces(4, np.zeros(0), weak_damper_in_block), forces_of)
    ]


def _road_runs_in_mujoco() -> Runs:
    settings = Settings(METHODS["mujoco"], STEP["road"], STEPS["road"] * STEP["road"])
    compiled = CompiledForces(assembly_of_scene(road_excited.scene()), settings)
    return [
        partial(_run_with_callback, counted, compiled.run_with_installed_callback)
        for counted in (empty_law(), kernel_law(add_weak_damper), force_callback())
    ]


def _wheel_runs_in_exudyn() -> Runs:
    wheels, steps, step = _wheels_steps_and_step()
    return [
        partial(RailWheelSystem(wheels, force_function).run, *wheels.state(), steps, step, METHODS["exudyn"])
        for force_function in (
            zero_forces,
            list_forces(4, np.zeros(0), weak_damper_in_block),
            WheelForceFunctions(wheels).of,
        )
    ]


def _wheel_runs_in_mujoco() -> Runs:
    wheels, steps, step = _wheels_steps_and_step()
    marcher, start = Marcher(rail_wheel_model(wheels, step, METHODS["mujoco"])), np.concatenate(wheels.state())[None]
    return [
        partial(_run_with_callback, law, partial(marcher.run, start, steps))
        for law in (empty_law(), kernel_law(add_weak_damper), kernel_law(forces))
    ]


def _wheels_steps_and_step() -> tuple[RailWheels, int, float]:
    return RailWheels(1, cells=wheelset.CONTACT_CELLS, speed=20.0), STEPS["wheel-20"], STEP["wheel-20"]


def _run_with_callback(force_callback: Any, run_model: Callable[[], Any]) -> None:
    with installed_callback(force_callback):
        run_model()


MARCHES_OF_PROBLEM = {
    ("road", "exudyn"): _road_runs_in_exudyn,
    ("road", "mujoco"): _road_runs_in_mujoco,
    ("wheel-20", "exudyn"): _wheel_runs_in_exudyn,
    ("wheel-20", "mujoco"): _wheel_runs_in_mujoco,
}
"""Function that makes the three runs with empty, cheap and real forces, by problem and engine."""


def measure(round_count: int, minimum_seconds: float) -> list[Saved]:
    """Times (s) of the three runs with empty, cheap and real forces in every round, by problem and engine."""
    seconds = interleave([job for make in MARCHES_OF_PROBLEM.values() for job in make()], round_count, minimum_seconds)
    return [
        {"problem": problem, "engine": engine, "seconds": dict(zip(FORCE_VARIANTS, rows.tolist(), strict=True))}
        for (problem, engine), rows in zip(
            MARCHES_OF_PROBLEM, seconds.reshape(len(MARCHES_OF_PROBLEM), 3, -1), strict=True
        )
    ]


def step_parts(timed_march: Saved) -> np.ndarray:
    """Times per step (3,) in microseconds of engine, bridge and force kernel, from the medians of the rounds."""
    empty, cheap, real = (
        1e6 * float(np.median(timed_march["seconds"][run])) / STEPS[timed_march["problem"]] for run in FORCE_VARIANTS
    )
    return np.array([empty, cheap - empty, real - cheap])


def bridge_share(timed_march: Saved) -> tuple[float, float, float]:
    """Share of the bridge between engine and forces in the time of a step, in %, with its 95 % interval (share, low,
    high)."""
    empty, cheap, real = (np.array(timed_march["seconds"][run]) for run in FORCE_VARIANTS)
    return bootstrap_median(100.0 * (cheap - empty) / real)


def rows(case_data: list[Saved]) -> list[Row]:
    """Rows on the share of the bridge in the time of a step, which are not judged."""
    return [
        Observed(
            f"price.{saved['problem']}.split.{saved['engine']}",
            SYSTEM,
            f"share of the bridge in a step, {_engine_text(saved)}, {saved['problem']}",
            middle,
            "%",
        ).beside(f"95 % interval {low:.0f} to {high:.0f}", "seconds are reported and never gated", "none")
        for saved in case_data
        for middle, low, high in [bridge_share(saved)]
    ]


def _engine_text(timed_march: Saved) -> str:
    return f"{LABELS[timed_march['engine']]} {METHODS[timed_march['engine']]}"


def table(case_data: list[Saved], problem_name: str) -> list[Table]:
    """Table of the parts of a step's time for a problem, in a list; an empty list if the step was not split."""
    lines = []
    for saved in case_data:
        if saved["problem"] == problem_name:
            _, low, high = bridge_share(saved)
            values = (f"{value:.2f}" for value in step_parts(saved))
            lines.append(
                (
                    _engine_text(saved),
                    str(STAGES_OF_METHOD[METHODS[saved["engine"]]]),
                    *values,
                    f"{low:.0f} to {high:.0f}",
                )
            )
    note = (
        f"Microseconds a step, median of all rounds, over {STEPS.get(problem_name, 0):,} steps; all forces in one "
        "callback, compiled in MuJoCo, from Python in Exudyn. Engine: with an empty callback; bridge: what one "
        "costs that is handed the state and hands back a damper's forces; kernel: what the real forces cost beyond "
        "that."
    )
    heads = ("method", "calls a step", "engine", "bridge", "kernel", "bridge's share, 95 % interval [%]")
    return [Table("What a step is made of", note, heads, tuple(lines))] if lines else []
