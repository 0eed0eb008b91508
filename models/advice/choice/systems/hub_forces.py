"""A vehicle cut at its wheels: quantities are the chassis' motion under its hub forces, and every element's force."""

import time
from typing import Any

from models.advice.choice.answer import Answer, Quantity
from models.engines.cut_vehicle import build
from models.systems.hub_forces.of_scene import measured
from models.systems.hub_forces.scene import HubScene
from models.systems.hub_forces.stabilised import Stabilised
from models.vehicles.cut_vehicle import ANGLES, X, Y, Z

ENGINE, WINDOWED = "mujoco", True


def answer(scene: HubScene, engine: str) -> Answer:
    """Measure, and run as the scene holds roll and pitch."""
    vehicle, own = scene.cut_vehicle(), scene.run
    _, forces, angles = measured(scene, vehicle, engine)
    stabilised = Stabilised(scene, vehicle, forces, angles)
    drive = stabilised.drive(scene.stabilise.method, own.step, steps(scene))
    model = build(engine, vehicle, drive, own.step, own.duration)
    begun = time.process_time()
    run = model.run(stabilised.start(drive))
    seconds = time.process_time() - begun
    places = {name: (i, "rad") for name, i in ANGLES.items()} | {"x": (X, "m"), "y": (Y, "m"), "z": (Z, "m")}
    found = {name: Quantity(unit, (run.states[:, i],)) for name, (i, unit) in places.items()}
    found |= {element.name: Quantity("N", (run.elements[:, i],)) for i, element in enumerate(vehicle.elements)}
    count = len(run.times) - 1
    return Answer(found, {"steps": count, "calls": 4 * count, "states": run.states.shape[1]}, seconds)


def steps(scene: HubScene) -> int:
    """Steps of a run."""
    return round(scene.run.duration / scene.run.step)


parts = steps


def shorten(table: dict[str, Any], scene: HubScene, steps: int) -> None:
    """So many steps of the scene's own."""
    table.setdefault("run", {})["duration"] = steps * scene.run.step


def coarsen(table: dict[str, Any], scene: HubScene, times: int) -> None:
    """Steps so many times as long."""
    table.setdefault("run", {})["step"] = times * scene.run.step
