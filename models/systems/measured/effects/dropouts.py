"""Virtual transducers that fall silent for a while."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.dropouts"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "gaps to be bridged or left to the filter before the run, no more in it"
COUNTS = {"all": {"faulty channels": 29, "silent channels": 29}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "dropouts")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Every sample is there."""
    transducers.drop(table, "dropouts")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Each transducer every ten seconds for 10 ms, on the mean."""
    transducers.add(table, scene.file, "dropouts", {"rate": 0.1, "length": 0.01})
