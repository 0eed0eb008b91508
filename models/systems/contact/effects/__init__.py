"""Effects of contact scenes: saturation, shape of the area, half-spaces, profiles, falling friction, spin (see
``models.core.scene_effects``).

Effects decide the theory: without any effect it is the linear one, with saturation alone FASTSIM. Counts are those of
bounded forces, areas of any shape, half-spaces, laws of friction, and motions with spin.
"""

from collections.abc import Callable
from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _theory_effect(
    description: str,
    theory_name: str,
    cost: str,
    counted_item: str,
    method_without_theory: Callable[[Any], dict[str, str]],
) -> EffectEntry:
    """Returns the effect of a theory beyond FASTSIM. ``method_without_theory`` returns the scene's [method] without
    this theory, except the key cells.
    """

    def leave_out(scene_tables: Table, scene: Any) -> None:
        cells = {key: value for key, value in scene_tables["method"].items() if key == "cells"}
        scene_tables["method"] = cells | method_without_theory(scene)

    return EffectEntry(
        description,
        "method.name",
        cost,
        {counted_item: 1},
        **BOUND_BY_CONSTANT_FRICTION,
        is_present=lambda scene: scene.method.name == theory_name,
        leave_out=leave_out,
        put_in=_naming_theory(theory_name),
    )


def _method_without_shape(scene: Any) -> dict[str, str]:
    """[method] of a scene without the shape of its contact; raises InputError for profiles, which have no cheaper
    theory.
    """
    if scene.profiles is not None:
        raise InputError(scene.file, "method.name", "simplified", "is the cheapest theory of profiles: leave it in")
    return {}


def _method_without_half_space(scene: Any) -> dict[str, str]:
    """[method] of the cheapest theory that is no half-space: FASTSIM on an ellipse, the simplified theory on
    profiles.
    """
    return {"name": "fastsim" if scene.profiles is None else "simplified"}


def _naming_theory(theory_name: str) -> Callable[[Table, Any], None]:
    """Returns a function that edits a scene so that its [method] names the theory."""

    def put_in(scene_tables: Table, scene: Any) -> None:
        scene_tables["method"] = {"name": theory_name}

    return put_in


def _without_slip(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: use the linear theory, which has no slip. Raises InputError for profiles."""
    if scene.profiles is not None:
        allowed = "cannot be left out on profiles: the linear theory needs an ellipse"
        raise InputError(scene.file, "method.name", scene.method.name, allowed)
    scene_tables["method"] = {"name": "linear"}


def _without_profiles(scene_tables: Table, scene: Any) -> None:
    """Raise InputError: profiles can only give way to an ellipse, which the user must describe."""
    allowed = "can only give way to an ellipse: name ellipse, curvatures or radii"
    raise InputError(scene.file, "profiles", None, allowed)


def _spin_is_swept(scene: Any) -> bool:
    """Whether the scene's [sweep] varies the spin."""
    return scene.sweep is not None and scene.sweep.of == "spin"


def _without_spin(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: remove the spin. Raises InputError where the sweep varies it."""
    if _spin_is_swept(scene):
        allowed = "is what this scene asks for: sweep another creepage to leave it out"
        raise InputError(scene.file, "sweep.of", "spin", allowed)
    scene_tables["creepage"].pop("spin")


NEEDS_SATURATION = ("saturation",)
BOUND_BY_CONSTANT_FRICTION: dict[str, Any] = {
    "needs": NEEDS_SATURATION,
    "excludes": ("falling_friction",),
    "why": "which FASTSIM alone computes",
}
TABLE = {
    "saturation": EffectEntry(
        "Slip: creep forces that friction bounds, by FASTSIM where no other theory is named",
        "method.name",
        "some microseconds per contact, where the linear theory multiplies by a matrix",
        {"bounded": 1},
        is_present=lambda scene: scene.method.name != "linear",
        leave_out=_without_slip,
        put_in=_naming_theory("fastsim"),
    ),
    "any_shape": _theory_effect(
        "Contact areas of any shape, by the simplified theory of 1983",
        "simplified",
        "an area that is found cell by cell",
        "areas of any shape",
        _method_without_shape,
    ),
    "half_space": _theory_effect(
        "Tractions and displacements of half-spaces, by the exact theory",
        "exact",
        "a system of equations as large as the area has cells, hundreds of times FASTSIM",
        "half-spaces",
        _method_without_half_space,
    ),
    "profiles": EffectEntry(
        "Cross-sections of wheel and rail, whose patches are looked for",
        "profiles",
        "a search for the contact points, once, and a contact computation per patch",
        {"searches": 1},
        **BOUND_BY_CONSTANT_FRICTION,
        leave_out=_without_profiles,
    ),
    "falling_friction": EffectEntry(
        "Friction that falls with the speed of slip",
        "falling_friction",
        "an exponential per cell, and a march of its own",
        {"laws of friction": 1},
        NEEDS_SATURATION,
        modules=("models.contact.fastsim_falling",),
        usual_value={"floor": 0.4, "decay": 0.6, "speed": 20.0},  # of the size of measured values
    ),
    "spin": EffectEntry(
        "Spin of the wheel about the contact's normal",
        "creepage.spin",
        "nothing: the third column of the same creepages",
        {"motions with spin": 1},
        usual_value=0.3,  # 1/m, as of a wheel of usual conicity
        is_present=lambda scene: bool(scene.creepage.spin) or _spin_is_swept(scene),
        leave_out=_without_spin,
    ),
}
