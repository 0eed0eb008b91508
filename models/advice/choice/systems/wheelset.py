"""A wheelset on straight track: quantities are its states and contacts, a case per speed of a path."""

import time
from typing import Any

import numpy as np

from models.advice.choice.answer import Answer, Quantity
from models.rail import wheel_forces as wf
from models.rail.equations import ROLL, SPIN, STATES, YAW, Y, Z
from models.systems.wheelset.of_scene import equations_of, path_speeds
from models.systems.wheelset.scene import WheelsetScene

ENGINE, WINDOWED = "reference", True
PLACES = {"y": (Y, "m"), "z": (Z, "m"), "roll": (ROLL, "rad"), "yaw": (YAW, "rad"), "spin": (SPIN, "rad/s")}
CONTACTS = {
    "normal": (wf.LOAD, "N"),
    "fx": (wf.FX, "N"),
    "fy": (wf.FY, "N"),
    "mz": (wf.MZ, "N m"),
    "power": (wf.POWER, "W"),
}
"""Of every patch: a path begins with the first patch, all its times one after the other."""


def answer(scene: WheelsetScene, engine: str) -> Answer:
    """Run every path."""
    paths, seconds, own = [], 0.0, scene.run
    for speed in path_speeds(scene):
        equations = equations_of(scene, engine, speed)
        start = equations.displaced(own.displacement)
        start[YAW] = own.yaw
        begun = time.process_time()
        paths.append(equations.run(start, own.duration, own.step))
        seconds += time.process_time() - begun
    found = {name: Quantity(unit, tuple(path.states[:, k] for path in paths)) for name, (k, unit) in PLACES.items()}
    patches = range(paths[0].contacts.shape[1])
    found |= {
        name: Quantity(unit, tuple(path.contacts[:, i, k] for path in paths for i in patches))
        for name, (k, unit) in CONTACTS.items()
    }
    count = int(np.sum([len(path.times) - 1 for path in paths]))
    return Answer(found, {"steps": count, "calls": 4 * count, "states": STATES, "terms": _cells(scene)}, seconds)


def _cells(scene: WheelsetScene) -> int:
    """Of FASTSIM's nets under both wheels."""
    return 2 * scene.contact.cells**2 if scene.contact.law == "fastsim" else 0


def steps(scene: WheelsetScene) -> int:
    """Steps of every path."""
    return round(scene.run.duration / scene.run.step)


parts = steps


def shorten(table: dict[str, Any], scene: WheelsetScene, steps: int) -> None:
    """So many steps of the scene's own, at the speeds of the whole scene."""
    table.setdefault("run", {}).update(duration=steps * scene.run.step, speeds=path_speeds(scene))


def coarsen(table: dict[str, Any], scene: WheelsetScene, times: int) -> None:
    """Steps so many times as long."""
    table.setdefault("run", {})["step"] = times * scene.run.step
