"""A road that is fitted to a measured one."""

from typing import Any

PLACE = "road.file"
COST = "a fit before all, no more in the runs"
COUNTS = {"all": {"fits": 1}}
MODULES = ("models.road.fitted",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.road.file is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The paper's road."""
    for key in ("file", "track_width", "first", "last"):
        table["road"].pop(key, None)
