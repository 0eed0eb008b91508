"""Contact areas of any shape, by the simplified theory of 1983."""

from typing import Any

from models.core.errors import InputError

PLACE = "method.name"
NEEDS = ("saturation",)
EXCLUDES = ("falling_friction",)
WHY = "which FASTSIM alone computes"
COST = "an area that is found cell by cell"
COUNTS = {"all": {"areas of any shape": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.method.name == "simplified")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """FASTSIM on the ellipse; InputError where there is none."""
    if scene.profiles is not None:
        raise InputError(scene.file, "method.name", "simplified", "is the cheapest theory of profiles: leave it in")
    table["method"] = {key: value for key, value in table["method"].items() if key == "cells"}


def put_in(table: dict[str, Any], scene: Any) -> None:
    """On the same contact."""
    table["method"] = {"name": "simplified"}
