"""White noise on every sample of roll, pitch and their rates."""

from typing import Any

PLACE = "angles.noise"
NEEDS = ("virtual_measurement",)
WHY = "for files have the noise that they have"
COST = "four random numbers per sample before the run; only a stabiliser reads them"
COUNTS = {"all": {"noisy angles": 4}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.road is not None and bool(scene.angles.noise == "white")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Gyros and angles tell the truth; the filter is told the same deviations as before."""
    table.setdefault("angles", {})["noise"] = "none"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """As large as the scene states."""
    table.setdefault("angles", {})["noise"] = "white"
