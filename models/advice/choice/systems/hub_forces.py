"""Scenes of a vehicle cut at its wheel hubs, for a choice of effects: quantities are the chassis motion under measured
hub forces, and the force of every element.
"""

from typing import Any

from models.advice.choice.answer import Quantity, RunQuantities
from models.systems.hub_forces.run import MOTION_CHANNELS, run
from models.systems.hub_forces.scene import HubScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "mujoco", True


def computed_quantities(scene: HubScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Measure hub forces, run the vehicle with roll and pitch held as in the scene, and collect the chassis motion and
    the element forces.
    """
    path = run(scene, engine, error=with_error_estimate)
    quantities = {name: Quantity(unit, (path[name],)) for name, (_, unit) in MOTION_CHANNELS.items()}
    names = path.data["element"].values
    quantities |= {str(name): Quantity("N", (path["section_force"][:, i],)) for i, name in enumerate(names)}
    counts = path.counts()
    return RunQuantities(
        quantities, {"steps": counts["steps"], "calls": counts["force calls"], "states": counts["states"]}, path.seconds
    )


def step_count(scene: HubScene) -> int:
    """Number of steps of a run."""
    return scene.step_count


divisible_step_count = step_count


def shorten_run(scene_table: dict[str, Any], scene: HubScene, step_limit: int) -> None:
    """Edit ``scene_table`` to shorten the run to ``step_limit`` time steps of the scene's own length."""
    scene_table.setdefault("run", {})["duration"] = step_limit * scene.run.step


def lengthen_steps(scene_table: dict[str, Any], scene: HubScene, step_factor: int) -> None:
    """Edit ``scene_table`` to multiply the step by ``step_factor``."""
    scene_table.setdefault("run", {})["step"] = step_factor * scene.run.step
