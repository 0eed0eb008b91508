"""Cross-sections of wheel and rail, whose patches are looked for."""

from typing import Any

from models.core.errors import InputError

PLACE = "profiles"
NEEDS = ("saturation",)
EXCLUDES = ("falling_friction",)
WHY = "which FASTSIM alone computes"
COST = "a search of where both touch, once, and one contact per patch"
COUNTS = {"all": {"searches": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.profiles is not None


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """InputError: an ellipse must take their place."""
    raise InputError(scene.file, "profiles", None, "can only give way to an ellipse: name ellipse, curvatures or radii")
