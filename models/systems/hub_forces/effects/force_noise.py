"""White noise on every sample of the hub forces."""

from typing import Any

PLACE = "forces.noise"
NEEDS = ("virtual_measurement",)
WHY = "for files have the noise that they have"
COST = "a random number per component and sample before the run, no more in it"
COUNTS = {"all": {"noisy forces": 24}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.road is not None and bool(scene.forces.noise == "white")


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Transducers tell the truth; the filter is told the same deviations as before."""
    table.setdefault("forces", {})["noise"] = "none"


def put_in(table: dict[str, Any], scene: Any) -> None:
    """As large as the scene states."""
    table.setdefault("forces", {})["noise"] = "white"
