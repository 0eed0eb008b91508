"""Virtual transducers whose factor is wrong."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.gain"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "a product per sample and channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 12}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "gain")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Factors are right."""
    transducers.drop(table, "gain")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Forces 1 % too large."""
    transducers.add(table, scene.file, "gain", {"force": 0.01})
