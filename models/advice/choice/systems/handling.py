"""A car on rolling tyres: quantities are its motion, loads and forces, a case per manoeuvre."""

import time
from typing import Any

import numpy as np

from models.advice.choice.answer import Answer, Quantity
from models.multibody import forces as at
from models.systems.handling.in_engines import build, read
from models.systems.handling.scene import HandlingScene

ENGINE, WINDOWED = "mujoco", True
MOTION = {"speed": (0, "m/s"), "side speed": (1, "m/s"), "yaw rate": (2, "rad/s")}
TYRES = {"load": (at.PRESS, "N"), "fx": (at.FX, "N"), "fy": (at.FY, "N"), "mz": (at.MZ, "N m")}
"""Of every tyre, a case each."""


def answer(scene: HandlingScene, engine: str) -> Answer:
    """Drive every manoeuvre."""
    drives, seconds = [], 0.0
    for name, own in scene.manoeuvres.items():
        handling = scene.handling(name)
        model = build(engine, handling)
        begun = time.process_time()
        run = model.run(*handling.straight(own.speed), own.duration, scene.run.step)
        seconds += time.process_time() - begun
        drives.append(read(handling, run, engine))
    speeds = [drive.velocity() for drive in drives]
    found = {name: Quantity(unit, tuple(speed[:, i] for speed in speeds)) for name, (i, unit) in MOTION.items()}
    found["lateral acceleration"] = Quantity("m/s^2", tuple(drive.lateral_acceleration() for drive in drives))
    found |= {
        name: Quantity(
            unit, tuple(np.ascontiguousarray(column) for drive in drives for column in drive.tyres[:, :, k].T)
        )
        for name, (k, unit) in TYRES.items()
    }
    steps = sum(len(drive.run.times) - 1 for drive in drives)
    counts = {
        "steps": steps,
        "calls": 4 * steps,
        "states": 2 * drives[0].run.positions.shape[1],
        "terms": len(handling.waves) * len(handling.vehicle.tyres),
    }
    return Answer(found, counts, seconds)


def steps(scene: HandlingScene) -> int:
    """Steps of the shortest manoeuvre."""
    return min(round(own.duration / scene.run.step) for own in scene.manoeuvres.values())


parts = steps


def shorten(table: dict[str, Any], scene: HandlingScene, steps: int) -> None:
    """At most so many steps of the scene's own in every manoeuvre."""
    for name, own in table["manoeuvres"].items():
        own["duration"] = min(scene.manoeuvres[name].duration, steps * scene.run.step)


def coarsen(table: dict[str, Any], scene: HandlingScene, times: int) -> None:
    """Steps so many times as long."""
    table.setdefault("run", {})["step"] = times * scene.run.step
