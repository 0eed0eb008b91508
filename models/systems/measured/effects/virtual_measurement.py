"""A virtual measurement in place of files."""

from typing import Any

from models.core.errors import InputError

PLACE = "virtual"
COST = "a run of the whole vehicle on its tyres, written as a file and read again"
COUNTS = {"all": {"runs on tyres": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.virtual is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """InputError: files must take its place."""
    raise InputError(scene.file, "virtual", None, "can only give way to [[files]] that were measured: name them")
