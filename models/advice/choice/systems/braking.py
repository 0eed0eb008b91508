"""Braking scenes for a choice of effects: quantities are the figures of a stop and of its wheels, with one case per
procedure.
"""

import time
from collections import defaultdict
from typing import Any

import numpy as np

from models.advice.choice.answer import Quantity, RunQuantities
from models.core.errors import RunFailed
from models.systems.braking.procedures import engines_of
from models.systems.braking.run import run
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import StopHistory

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "reference", False


def computed_quantities(scene: BrakingScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Simulate every braking procedure and collect its quantities. A quantity that is not finite, as where the vehicle
    does not stop, is left out.
    """
    numbers, steps, states, seconds = defaultdict[str, list[np.ndarray]](list), 0, 0, 0.0
    (engine,) = engines_of(scene, (engine,)) or (engine,)
    for name in scene.procedures:
        start_time = time.process_time()
        drive = run(scene, engine, procedure=name, error=with_error_estimate)
        seconds += time.process_time() - start_time
        path, stop = drive.detail, StopHistory(drive.detail)
        if len(path.times) < 3:
            raise RunFailed("braking", f"{name} ends before it has begun", float(path.times[-1]))
        for key, value in {**stop.vehicle_results(), **stop.wheel_results()}.items():
            numbers[key] += [*np.atleast_1d(np.asarray(value, float))[:, None]]
        steps += drive.counts()["steps"]
        states = path.states[0].size + path.turning.shape[1] + (scene.pressure is not None) * path.pressures.shape[1]
    return RunQuantities(
        {
            name: Quantity(name.partition("[")[2].rstrip("]"), tuple(cases))
            for name, cases in numbers.items()
            if np.isfinite(cases).all()
        },
        {"steps": steps, "calls": steps, "states": states},
        seconds,
    )


def step_count(scene: BrakingScene) -> int:
    """Number of steps of a braking procedure that lasts for the longest duration that the scene allows."""
    return round(scene.run.duration / scene.run.sample) * scene.run.substeps


def divisible_step_count(scene: BrakingScene) -> int:
    """Number of time steps within a controller sample, which a longer step must divide: only these steps may become
    longer, the controller's samples stay.
    """
    return scene.run.substeps


def shorten_run(scene_table: dict[str, Any], scene: BrakingScene, step_limit: int) -> None:
    """Edit ``scene_table`` to run only the first samples of every procedure."""
    scene_table.setdefault("run", {})["duration"] = max(2, step_limit // scene.run.substeps) * scene.run.sample


def lengthen_steps(scene_table: dict[str, Any], scene: BrakingScene, step_factor: int) -> None:
    """Edit ``scene_table`` to take fewer steps within a sample."""
    scene_table.setdefault("run", {})["substeps"] = scene.run.substeps // step_factor
