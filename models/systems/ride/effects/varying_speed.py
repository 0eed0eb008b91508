"""A speed that varies along the road."""

from typing import Any

PLACE = "drive"
COST = "a covariance that is marched, in place of one that is solved"
COUNTS = {"all": {"drives": 1}}
MODULES = ("models.ride.varying_speed",)


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.drive is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """The mean of its speeds, held."""
    drive = table.pop("drive")
    times, speeds = drive["time"], drive["speed"]
    way = sum((b - a) * (v + w) / 2.0 for a, b, v, w in zip(times, times[1:], speeds, speeds[1:], strict=False))
    table["speeds"] = {"values": [way / (times[-1] - times[0])]}
