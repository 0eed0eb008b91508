"""Springs that hold the axle to its frame."""

from typing import Any

from models.systems.wheelset.of_scene import any_of, override, usual

PLACE = "wheelset.override.stiffness_x"
COST = "a product per direction; actuators in MuJoCo, spring-dampers in Exudyn"
COUNTS = {"all": {"springs": 3}, "exudyn": {"spring-dampers": 2}, "mujoco": {"actuators": 4}}
KEYS = ("stiffness_x", "stiffness_y", "stiffness_z")


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return any_of(scene, *KEYS)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The axle is free but for its dampers."""
    override(table, dict.fromkeys(KEYS, 0.0))


def put_in(table: dict[str, Any], scene: Any) -> None:
    """Those of the chosen wheelset."""
    override(table, usual(*KEYS))
