"""A rough road under all tyres, of plane waves."""

from typing import Any

PLACE = "manoeuvres.NAME.rough"
COST = "a cosine per wave, tyre and call"
COUNTS = {"all": {"waves": 48}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any(own.rough for own in scene.manoeuvres.values())


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The flat road."""
    for own in table["manoeuvres"].values():
        own.pop("rough", None)


def put_in(table: dict[str, Any], scene: Any) -> None:
    """In every manoeuvre."""
    for own in table["manoeuvres"].values():
        own["rough"] = True
