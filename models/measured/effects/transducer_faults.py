"""What virtual transducers add to the truth: noise, offsets, late samples, steps of a converter, gaps."""

from typing import Any

PLACE = "virtual.faults"
NEEDS = ("virtual_measurement",)
WHY = "for files have the faults that they have"
COST = "a random number per sample and channel before the run, no more in it"
COUNTS = {"all": {"faulty channels": 24}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.virtual is not None and any(value for _, value in scene.virtual.faults)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Transducers tell the truth."""
    table["virtual"].pop("faults")


def put_in(table: dict[str, Any], scene: Any) -> None:
    """White noise of usual size on every force and moment."""
    table["virtual"]["faults"] = {"noise": {"force": 8.0, "moment": 1.0}}
