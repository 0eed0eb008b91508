"""White noise on every sample of virtual transducers."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.noise"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "a random number per sample and channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 29}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "noise")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Samples are exact."""
    transducers.drop(table, "noise")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Of usual size on every force, moment, angle and rate."""
    transducers.add(table, scene.file, "noise", {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3})
