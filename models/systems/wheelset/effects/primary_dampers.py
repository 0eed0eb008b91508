"""Dampers that hold the axle to its frame."""

from typing import Any

from models.systems.wheelset.of_scene import any_of, override, usual

PLACE = "wheelset.override.damping_x"
COST = "a product per direction; actuators in MuJoCo, spring-dampers in Exudyn"
COUNTS = {"all": {"dampers": 3}, "exudyn": {"spring-dampers": 2}, "mujoco": {"actuators": 4}}
KEYS = ("damping_x", "damping_y", "damping_z")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any_of(scene, *KEYS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The axle is free but for its springs."""
    override(table, dict.fromkeys(KEYS, 0.0))


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Those of the chosen wheelset."""
    override(table, usual(*KEYS))
