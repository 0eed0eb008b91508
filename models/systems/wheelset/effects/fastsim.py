"""Creep forces that friction bounds, by FASTSIM."""

from typing import Any

PLACE = "contact.law"
COST = "a net of cells per strip and call, about 20 microseconds"
COUNTS = {"all": {"creep nets": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.contact.law == "fastsim")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The linear law, without bound."""
    table["contact"] = {"law": "linear"}


def put_in(table: dict[str, Any], scene: Any) -> None:
    """On the usual net."""
    table["contact"] = {"law": "fastsim"}
