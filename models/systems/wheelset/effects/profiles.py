"""Measured cross-sections in place of cones on round heads."""

from typing import Any

from models.core.errors import InputError
from models.systems.wheelset.of_scene import wheelset_of

PLACE = "profiles"
COST = "tables of contact places by lateral displacement, made once"
COUNTS = {"all": {"profiles": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return wheelset_of(scene).profiles is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Cones, heads of one radius, and flanges that are springs; InputError where the parameters have profiles."""
    if scene.profiles is None:
        raise InputError(
            scene.file, "wheelset.parameters", scene.wheelset.parameters, "has profiles: name a file without them"
        )
    del table["profiles"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """S1002 on UIC60, in place of the flanges of cones."""
    table["profiles"] = {}
    table.get("wheelset", {}).get("override", {}).pop("flange_stiffness", None)
