"""Tractions and displacements of half-spaces, by the exact theory."""

from typing import Any

PLACE = "method.name"
NEEDS = ("saturation",)
EXCLUDES = ("falling_friction",)
WHY = "which FASTSIM alone computes"
COST = "a system of equations as large as the area has cells, hundreds of times FASTSIM"
COUNTS = {"all": {"half-spaces": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.method.name == "exact")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """FASTSIM on an ellipse, the simplified theory on profiles."""
    kept = {key: value for key, value in table["method"].items() if key == "cells"}
    table["method"] = kept | {"name": "fastsim" if scene.profiles is None else "simplified"}


def put_in(table: dict[str, Any], scene: Any) -> None:
    """On the same contact."""
    table["method"] = {"name": "exact"}
