"""Effects of handling scenes: braking, driving, steering, rough road, measured drive, inclined wheels, trailer (see
``models.core.scene_effects``).

Counts are those of all manoeuvres: coordinates, wheels and towed bodies of the vehicle, waves of the road, wheels that
lean, controls that act, external forces.
"""

from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _manoeuvre_effect(
    manoeuvre_key: str, description: str, cost: str, work_counts: dict[str, int], usual_value: Any
) -> EffectEntry:
    """Returns an effect that is present where a key of any manoeuvre has a value; it is left out of all manoeuvres, or
    put into all.
    """

    def is_present(scene: Any) -> bool:
        values = [getattr(manoeuvre, manoeuvre_key) for manoeuvre in scene.manoeuvres.values()]
        acts = any(value if isinstance(value, bool) else any(size for _, size in value) for value in values)
        return acts or (manoeuvre_key in MEASURED_CONTROLS and _is_measured_drive(scene))

    def leave_out(scene_tables: dict[str, Any], scene: Any) -> None:
        if manoeuvre_key in MEASURED_CONTROLS and _is_measured_drive(scene):
            raise InputError(
                scene.file, manoeuvre_key, None, "belongs to the measured drive: leave out manoeuvres.NAME.measured"
            )
        for manoeuvre in scene_tables["manoeuvres"].values():
            manoeuvre.pop(manoeuvre_key, None)

    def put_in(scene_tables: dict[str, Any], scene: Any) -> None:
        for manoeuvre in scene_tables["manoeuvres"].values():
            manoeuvre[manoeuvre_key] = usual_value

    key_path = f"manoeuvres.NAME.{manoeuvre_key}"
    return EffectEntry(
        description, key_path, cost, work_counts, is_present=is_present, leave_out=leave_out, put_in=put_in
    )


CAR_ALONE, CAR_WITH_CARAVAN = "r19_free", "r19_caravan"
"""Names of two shipped vehicles: a car, and the same car with a caravan."""


def without_trailer(scene_tables: Table, scene: Any) -> None:
    """Replace the shipped car with caravan by the shipped car alone. Raises InputError for another vehicle file, which
    its user must change.
    """
    if scene.vehicle.file != CAR_WITH_CARAVAN:
        allowed = "has bodies with a hitch: name a vehicle file without them"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    scene_tables["vehicle"]["file"] = CAR_ALONE


def with_trailer(scene_tables: Table, scene: Any) -> None:
    """Replace the shipped car by the shipped car with caravan. Raises InputError for another vehicle file."""
    if scene.vehicle.file != CAR_ALONE:
        allowed = "has no trailer: add a body with a hitch, and its wheels, to that file"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    scene_tables.setdefault("vehicle", {})["file"] = CAR_WITH_CARAVAN


MEASURED_CONTROLS = ("steer", "brake", "drive")
"""Controls that a measured drive determines."""


def _is_measured_drive(scene: Any) -> bool:
    """Whether any manoeuvre of the scene is a measured drive."""
    return any(manoeuvre.measured for manoeuvre in scene.manoeuvres.values())


def _without_measured_drive(scene_tables: dict[str, Any], scene: Any) -> None:
    """Replace measured drives by rolling straight ahead from the same speed for the same time."""
    for manoeuvre in scene_tables["manoeuvres"].values():
        manoeuvre.pop("measured", None)
        manoeuvre.pop("stretch", None)


TABLE_LOOKUP_COST = "a look into a table of times per call"
TABLE = {
    "braking": _manoeuvre_effect(
        "brake", "Torque of the brakes", TABLE_LOOKUP_COST, {"controls": 1}, [[1.0, 0.0], [1.2, 1000.0]]
    ),
    "driving": _manoeuvre_effect(
        "drive", "Torque of the driven wheels", TABLE_LOOKUP_COST, {"controls": 1}, [[1.0, 0.0], [1.2, 300.0]]
    ),
    "steering": _manoeuvre_effect(
        "steer", "Front wheels that the driver turns", TABLE_LOOKUP_COST, {"controls": 1}, [[0.5, 0.0], [0.8, 0.02]]
    ),
    "rough_road": _manoeuvre_effect(
        "rough", "A rough road under all tyres, of plane waves", "a cosine per wave, tyre and call", {"waves": 48}, True
    ),
    "measured_drive": EffectEntry(
        "The steer angle and the speed of a measured drive, with the torques that this speed takes",
        "manoeuvres.NAME.measured",
        "about four marches of the manoeuvre in MuJoCo, once, that seek the torques",
        is_present=_is_measured_drive,
        leave_out=_without_measured_drive,
        modules=("models.measured.drive", "models.systems.handling.following"),
    ),
    "inclined_wheels": EffectEntry(
        "Wheels that lean, left and right ones mirrored",
        "tyres.inclination",
        "nothing: the same forces at an angle, with spin",
        {"leaning wheels": 4},
        usual_value=0.02,
    ),
    "trailer": EffectEntry(
        "Bodies that the vehicle tows by a hitch, on springs and wheels of their own",
        "vehicle.file",
        "the coordinates of its hitch, wheels and spins, and a tyre per wheel",
        {"coordinates": 7, "towed bodies": 1, "wheels": 2},
        is_present=lambda scene: bool(scene.file_vehicle().towed),
        leave_out=without_trailer,
        put_in=with_trailer,
    ),
}
