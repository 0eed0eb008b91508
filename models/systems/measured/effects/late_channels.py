"""Channels of virtual transducers that are late."""

from typing import Any

from models.systems.measured.effects import _of_transducers as transducers

PLACE = "virtual.faults.delay"
NEEDS, WHY = transducers.NEEDS, transducers.WHY
COST = "a spline through each late channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 12}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return transducers.has(scene, "delay")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """All channels tell the same time."""
    transducers.drop(table, "delay")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Forces 2 ms after all else."""
    transducers.add(table, scene.file, "delay", {"force": 2e-3})
