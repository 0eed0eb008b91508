"""Dampers that hold the axle to its frame."""

from typing import Any

PLACE = "wheelset.override.damping_x"
NEEDS: tuple[str, ...] = ()
EXCLUDES: tuple[str, ...] = ()
COST = "a product per direction; actuators in MuJoCo, spring-dampers in Exudyn"
COUNTS = {"all": {"dampers": 3}, "exudyn": {"spring-dampers": 2}, "mujoco": {"actuators": 4}}
KEYS = ("damping_x", "damping_y", "damping_z")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    from models.rail.of_scene import wheelset_of

    return any(getattr(wheelset_of(scene), key) > 0.0 for key in KEYS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The axle is free but for its springs."""
    table.setdefault("wheelset", {}).setdefault("override", {}).update(dict.fromkeys(KEYS, 0.0))


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Those of the chosen wheelset."""
    from models.rail.wheelset import CHOSEN

    table.setdefault("wheelset", {}).setdefault("override", {}).update({key: getattr(CHOSEN, key) for key in KEYS})
