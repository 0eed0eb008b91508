"""Front wheels that the driver turns."""

from typing import Any

PLACE = "manoeuvres.NAME.steer"
COST = "a look into a table of times per call"
COUNTS = {"all": {"controls": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(value for own in scene.manoeuvres.values() for _, value in own.steer)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """None in any manoeuvre."""
    for own in table["manoeuvres"].values():
        own.pop("steer", None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The same in every manoeuvre."""
    for own in table["manoeuvres"].values():
        own["steer"] = [[0.5, 0.0], [0.8, 0.02]]
