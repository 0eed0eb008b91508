"""Handling scene without effects, for the absence checks: its tables, counts of its model's components, its path."""

from typing import Any

from models.multibody.forces import INCLINED
from models.systems.handling.run import run
from models.systems.handling.scene import HandlingScene

ENGINES = ("mujoco", "exudyn")
ROLLING = "rolling"
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "handling",
    "manoeuvres": {ROLLING: {"speed": 15.0, "duration": 0.01}},
}


def counts_and_path(scene: HandlingScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the components in the model of a manoeuvre (wheels, road waves, controls, ...), and the coordinates of
    a run as bytes."""
    path = run(scene, engine)
    handling = path.detail.handling
    controls = (handling.controls.steer, handling.controls.brake, handling.controls.drive)
    tyres, vehicle = handling.vehicle.tyres, handling.vehicle
    counts = {
        "coordinates": len(vehicle.coordinates()),
        "wheels": len(tyres),
        "towed bodies": len(vehicle.towed),
        "waves": len(handling.waves),
        "controls": sum(any(value for _, value in knots) for knots in controls),
        "pushes": len(handling.pushes),
        "leaning wheels": sum(bool(numbers[INCLINED]) for numbers in map(handling.tyre_numbers, range(len(tyres)))),
    }
    return counts, path["positions"].tobytes()
