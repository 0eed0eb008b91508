"""Torque of the brakes."""

from typing import Any

PLACE = "manoeuvres.NAME.brake"
COST = "a look into a table of times per call"
COUNTS = {"all": {"controls": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(value for own in scene.manoeuvres.values() for _, value in own.brake)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """None in any manoeuvre."""
    for own in table["manoeuvres"].values():
        own.pop("brake", None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """The same in every manoeuvre."""
    for own in table["manoeuvres"].values():
        own["brake"] = [[1.0, 0.0], [1.2, 1000.0]]
