"""Handling scenes, a car on rolling tyres, for a choice of effects: quantities are its motion, loads and forces, one
case per manoeuvre.
"""

from typing import Any

import numpy as np

from models.advice.choice.answer import Quantity, RunQuantities
from models.systems.handling.run import TYRE_CHANNELS, run
from models.systems.handling.scene import HandlingScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "mujoco", True
MOTION_CHANNELS = {"speed": (0, "m/s"), "side speed": (1, "m/s"), "yaw rate": (2, "rad/s")}
TYRE_QUANTITIES = ("load", "fx", "fy", "mz")
"""Channels of the tyres that are compared, with a case for each tyre."""


def computed_quantities(scene: HandlingScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Simulate every manoeuvre and collect the vehicle's motion and its tyres' loads and forces."""
    runs = [run(scene, engine, name, with_error_estimate) for name in scene.manoeuvres]
    drives = [handling_run.detail for handling_run in runs]
    speeds = [drive.velocity() for drive in drives]
    quantities = {
        name: Quantity(unit, tuple(speed[:, i] for speed in speeds)) for name, (i, unit) in MOTION_CHANNELS.items()
    }
    quantities["lateral acceleration"] = Quantity("m/s^2", tuple(drive.lateral_acceleration() for drive in drives))
    for name in TYRE_QUANTITIES:
        columns = tuple(np.ascontiguousarray(column) for drive in drives for column in drive[name].T)
        quantities[name] = Quantity(TYRE_CHANNELS[name][1], columns)
    steps, handling = sum(handling_run.counts()["steps"] for handling_run in runs), drives[-1].handling
    counts = {
        "steps": steps,
        "calls": 4 * steps,
        "states": 2 * len(handling.vehicle.coordinates()),
        "terms": len(handling.waves) * len(handling.vehicle.tyres),
    }
    return RunQuantities(quantities, counts, sum(handling_run.seconds for handling_run in runs))


def step_count(scene: HandlingScene) -> int:
    """Number of steps of the shortest manoeuvre."""
    return min(round(manoeuvre.duration / scene.run.step) for manoeuvre in scene.manoeuvres.values())


divisible_step_count = step_count


def shorten_run(scene_table: dict[str, Any], scene: HandlingScene, step_limit: int) -> None:
    """Edit ``scene_table`` to shorten every manoeuvre to at most ``step_limit`` of the scene's time steps."""
    for name, manoeuvre in scene_table["manoeuvres"].items():
        manoeuvre["duration"] = min(scene.manoeuvres[name].duration, step_limit * scene.run.step)


def lengthen_steps(scene_table: dict[str, Any], scene: HandlingScene, step_factor: int) -> None:
    """Edit ``scene_table`` to multiply the step by ``step_factor``."""
    scene_table.setdefault("run", {})["step"] = step_factor * scene.run.step
