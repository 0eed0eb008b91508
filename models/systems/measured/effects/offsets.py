"""Virtual transducers that do not read nought at nought."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.bias"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "a sum per sample and channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 12}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "bias")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Nought is read as nought."""
    transducers.drop(table, "bias")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """20 N on every force."""
    transducers.add(table, scene.file, "bias", {"force": 20.0})
