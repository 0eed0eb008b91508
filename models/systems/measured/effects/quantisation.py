"""Samples of virtual transducers rounded to the steps of a converter."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.quantisation"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "a rounding per sample and channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 29}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "quantisation")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Samples are real numbers."""
    transducers.drop(table, "quantisation")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """A converter of 12 bits for every channel."""
    transducers.add(table, scene.file, "quantisation", {"bits": 12})
