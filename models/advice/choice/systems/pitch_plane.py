"""Scenes of the pitch-plane vehicle, for a choice of effects: quantities are the channels of its result."""

import time
from typing import Any

from models.advice.choice.answer import Quantity, RunQuantities
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, assembly_of_scene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "reference", True
FORCE_CALLS_PER_STEP = {"RK4": 4, "RK44": 4, "Euler": 1}
"""Right-hand side calls in a step of the methods that do not count them."""


def computed_quantities(scene: Scene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Run the pitch-plane scene and collect the channels of its result."""
    assembly = assembly_of_scene(scene)
    start_time = time.process_time()
    result = run(scene, engine, assembly=assembly, error=with_error_estimate)
    seconds = time.process_time() - start_time
    run_counts, states = result.counts(), result.detail.states
    counts = {"steps": run_counts.get("steps", len(states) - 1), "states": states.shape[1]}
    counts["calls"] = run_counts.get(
        "force calls", FORCE_CALLS_PER_STEP.get(result.data.attrs["integrator"], 1) * counts["steps"]
    )
    quantities = {
        str(name): Quantity(channel.attrs["units"], (channel.values,))
        for name, channel in result.data.data_vars.items()
    }
    return RunQuantities(quantities, counts, seconds)


def step_count(scene: Scene) -> int:
    """Number of steps of the run."""
    return round(scene.run.duration / scene.run.step)


divisible_step_count = step_count


def shorten_run(scene_table: dict[str, Any], scene: Scene, step_limit: int) -> None:
    """Edit ``scene_table`` to shorten the run to ``step_limit`` time steps of the scene's own length."""
    scene_table["run"] |= {"duration": step_limit * scene.run.step}
    scene_table["run"].pop("output_step", None)


def lengthen_steps(scene_table: dict[str, Any], scene: Scene, step_factor: int) -> None:
    """Edit ``scene_table`` to multiply the steps of all engines by ``step_factor``; every step becomes a saved row."""
    scene_table["run"] |= {"step": step_factor * scene.run.step}
    scene_table["run"].pop("output_step", None)
    for engine_table in scene_table.get("engines", {}).values():
        if "step" in engine_table:
            engine_table["step"] *= step_factor
