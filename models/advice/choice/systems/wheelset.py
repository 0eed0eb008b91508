"""Scenes of a wheelset on straight track, for a choice of effects: quantities are its states and contacts, one case per
speed.
"""

from typing import Any

import numpy as np

from models.advice.choice.answer import Quantity, RunQuantities
from models.rail.equations import STATE_COUNT
from models.systems.wheelset.of_scene import path_speeds
from models.systems.wheelset.run import run
from models.systems.wheelset.scene import WheelsetScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "reference", True


def computed_quantities(scene: WheelsetScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Compute the path at every speed and collect its states and contact quantities. A quantity of contact patches has
    all times of the first patch, then all times of the next one.
    """
    paths = [run(scene, engine, speed, error=with_error_estimate) for speed in path_speeds(scene)]
    quantities = {
        str(name): Quantity(
            channel.attrs["units"], tuple(case for path in paths for case in np.atleast_2d(path[str(name)].T))
        )
        for name, channel in paths[0].data.data_vars.items()
    }
    counts = {key: sum(path.counts()[key] for path in paths) for key in ("steps", "force calls")}
    cells = 2 * scene.contact.cells**2 if scene.contact.law == "fastsim" else 0  # of FASTSIM's nets under both wheels
    return RunQuantities(
        quantities,
        {"steps": counts["steps"], "calls": counts["force calls"], "states": STATE_COUNT, "terms": cells},
        sum(path.seconds for path in paths),
    )


def step_count(scene: WheelsetScene) -> int:
    """Number of time steps of the path at every speed."""
    return round(scene.run.duration / scene.run.step)


divisible_step_count = step_count


def shorten_run(scene_table: dict[str, Any], scene: WheelsetScene, step_limit: int) -> None:
    """Edit ``scene_table`` to shorten the paths to ``step_limit`` time steps of the scene's own length, at the speeds
    of the whole scene.
    """
    scene_table.setdefault("run", {}).update(duration=step_limit * scene.run.step, speeds=path_speeds(scene))


def lengthen_steps(scene_table: dict[str, Any], scene: WheelsetScene, step_factor: int) -> None:
    """Edit ``scene_table`` to multiply the step by ``step_factor``."""
    scene_table.setdefault("run", {})["step"] = step_factor * scene.run.step
