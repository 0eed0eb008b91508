"""Slip: creep forces that friction bounds, by FASTSIM where no other theory is named."""

from typing import Any

from models.core.errors import InputError

PLACE = "method.name"
COST = "some microseconds per contact, where the linear theory multiplies by a matrix"
COUNTS = {"all": {"bounded": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return bool(scene.method.name != "linear")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The linear theory, without slip; InputError where there is no ellipse for it."""
    if scene.profiles is not None:
        raise InputError(
            scene.file,
            "method.name",
            scene.method.name,
            "cannot be left out on profiles: the linear theory needs an ellipse",
        )
    table["method"] = {"name": "linear"}


def put_in(table: dict[str, Any], scene: Any) -> None:
    """FASTSIM."""
    table["method"] = {"name": "fastsim"}
