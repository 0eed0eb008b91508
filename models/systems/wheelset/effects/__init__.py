"""Effects of wheelset scenes: contact damping, FASTSIM, flanges, suspension, profiles (see
``models.core.scene_effects``).

Counts are those of a wheelset in an implementation: its springs and dampers, tables of profiles, calls of FASTSIM.
"""

from collections.abc import Callable
from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _parameter_effect(
    description: str, parameter_keys: tuple[str, ...], cost: str, work_counts: dict[str, int], **entry_fields: Any
) -> EffectEntry:
    """Returns an effect that is present where any of some wheelset parameters is above zero. Its usual values are the
    parameters of CHOSEN_WHEELSET.
    """

    def is_present(scene: Any) -> bool:
        from models.systems.wheelset.of_scene import wheelset_of

        wheelset = wheelset_of(scene)
        excluded = "profiles" in entry_fields.get("excludes", ()) and wheelset.profiles is not None
        return not excluded and any(getattr(wheelset, key) > 0.0 for key in parameter_keys)

    def overriding(value_of_parameter: Callable[[str], float]) -> Callable[[Table, Any], None]:
        def change(scene_tables: Table, scene: Any) -> None:
            override = scene_tables.setdefault("wheelset", {}).setdefault("override", {})
            override.update({key: value_of_parameter(key) for key in parameter_keys})

        return change

    def usual(parameter_key: str) -> float:
        from models.rail.wheelset import CHOSEN_WHEELSET

        return float(getattr(CHOSEN_WHEELSET, parameter_key))

    return EffectEntry(
        description,
        f"wheelset.override.{parameter_keys[0]}",
        cost,
        work_counts,
        is_present=is_present,
        leave_out=overriding(lambda key: 0.0),
        put_in=overriding(usual),
        **entry_fields,
    )


def _has_profiles(scene: Any) -> bool:
    from models.systems.wheelset.of_scene import wheelset_of

    return wheelset_of(scene).profiles is not None


def _without_profiles(scene_tables: Table, scene: Any) -> None:
    """Replace the scene's profiles by cones on rail heads of one radius, with springs as flanges. Raises InputError
    where the profiles belong to the wheelset's parameter file.
    """
    if scene.profiles is None:
        raise InputError(
            scene.file, "wheelset.parameters", scene.wheelset.parameters, "has profiles: name a file without them"
        )
    del scene_tables["profiles"]


def _with_profiles(scene_tables: Table, scene: Any) -> None:
    """Add the profiles S1002 on UIC60 to a scene, and drop the flange springs of its cones."""
    scene_tables["profiles"] = {}
    scene_tables.get("wheelset", {}).get("override", {}).pop("flange_stiffness", None)


COST_TEXT = "a product per direction; actuators in MuJoCo, spring-dampers in Exudyn"
ENGINE_COUNTS = {"exudyn": {"spring-dampers": 2}, "mujoco": {"actuators": 4}}
TABLE = {
    "contact_damping": _parameter_effect(
        "Normal forces that grow with the speed of approach",
        ("contact_damping",),
        "one product per wheel and call",
        {"contact damping": 1},
    ),
    "fastsim": EffectEntry(
        "Creep forces that friction bounds, by FASTSIM",
        "contact.law",
        "a net of cells per strip and call, about 20 microseconds",
        {"creep nets": 1},
        is_present=lambda scene: scene.contact.law == "fastsim",
        leave_out=lambda table, scene: table.update(contact={"law": "linear"}),
        put_in=lambda table, scene: table.update(contact={"law": "fastsim"}),
    ),
    "flange": _parameter_effect(
        "A flange that touches its rail beyond a clearance",
        ("flange_stiffness",),
        "one comparison per wheel and call",
        {"flanges": 1},
        excludes=("profiles",),
        why="which have flanges of their own",
    ),
    "primary_dampers": _parameter_effect(
        "Dampers that hold the axle to its frame",
        ("damping_x", "damping_y", "damping_z"),
        COST_TEXT,
        {"dampers": 3},
        in_engines=ENGINE_COUNTS,
    ),
    "primary_springs": _parameter_effect(
        "Springs that hold the axle to its frame",
        ("stiffness_x", "stiffness_y", "stiffness_z"),
        COST_TEXT,
        {"springs": 3},
        in_engines=ENGINE_COUNTS,
    ),
    "profiles": EffectEntry(
        "Measured cross-sections in place of cones on round heads",
        "profiles",
        "tables of contact places by lateral displacement, made once",
        {"profiles": 1},
        is_present=_has_profiles,
        leave_out=_without_profiles,
        put_in=_with_profiles,
    ),
}
