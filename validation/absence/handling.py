"""Handling: a bare manoeuvre, what its table of numbers holds, and its path in both engines."""

from typing import Any

from models.systems.handling.run import run
from models.systems.handling.scene import HandlingScene

ENGINES = ("mujoco", "exudyn")
ROLLING = "rolling"
BARE: dict[str, Any] = {
    "title": "bare",
    "system": "handling",
    "manoeuvres": {ROLLING: {"speed": 15.0, "duration": 0.01}},
}


def seen(scene: HandlingScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of a manoeuvre as both engines are handed it, and its path."""
    path = run(scene, engine)
    handling = path.detail.handling
    controls = (handling.controls.steer, handling.controls.brake, handling.controls.drive)
    counts = {
        "waves": len(handling.waves),
        "controls": sum(any(value for _, value in knots) for knots in controls),
        "pushes": len(handling.pushes),
        "leaning wheels": len(handling.vehicle.tyres) * (handling.tyres.inclination != 0.0),
    }
    return counts, path["positions"].tobytes()
