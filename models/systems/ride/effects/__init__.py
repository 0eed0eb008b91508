"""Effects of ride scenes (see ``models.core.scene_effects``); ``omissions`` lists those that a choice may leave out."""

from collections.abc import Callable
from typing import Any

from models.core.errors import InputError
from models.core.scene_effects import EffectEntry, Table


def _vehicle_effect(description: str, cost: str, is_present: Callable[[Any], bool]) -> EffectEntry:
    """Returns an effect that belongs to the vehicle file, so that only another vehicle file leaves it out."""
    return EffectEntry(description, "vehicle.file", cost, is_present=is_present, leave_out=_keep_vehicle)


def _keep_vehicle(scene_tables: Table, scene: Any) -> None:
    """Raise InputError, as the effect can be left out only if another vehicle file is named."""
    allowed = 'has it: name a file without it, or let effects = "auto" leave it out'
    raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)


def _has_omissions_of_kind(effect_kind: str) -> Callable[[Any], bool]:
    """Returns a function of a scene: whether its vehicle or road has effects of a kind that can be left out."""

    def is_present(scene: Any) -> bool:
        from models.systems.ride.omissions import has_omissions

        return has_omissions(scene, effect_kind)

    return is_present


def _vehicle_of_scene(scene: Any) -> Any:
    from models.systems.ride.of_scene import vehicle_of

    return vehicle_of(scene)


def _equal_heights_edit(road_key: str) -> Callable[[Table, Any], None]:
    """Returns a function that edits a scene: it sets a key of [road] so that wheels meet equal heights."""

    def leave_out(scene_tables: Table, scene: Any) -> None:
        scene_tables.setdefault("road", {})[road_key] = "equal"

    return leave_out


def _straighten_curves(scene_tables: Table, scene: Any) -> None:
    """Edit a scene so that springs have their slopes at rest instead of curves."""
    scene_tables["vehicle"]["small_motion"] = True


def _take_papers_road(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: remove the measured road, so that the road has the published spectrum."""
    for key in ("file", "track_width", "first", "last"):
        scene_tables["road"].pop(key, None)


def _hold_mean_speed(scene_tables: Table, scene: Any) -> None:
    """Edit a scene: replace the drive by its mean speed, constant."""
    drive = scene_tables.pop("drive")
    drive_times, speeds = drive["time"], drive["speed"]
    driven_distance = sum(
        (b - a) * (v + w) / 2.0 for a, b, v, w in zip(drive_times, drive_times[1:], speeds, speeds[1:], strict=False)
    )
    scene_tables["speeds"] = {"values": [driven_distance / (drive_times[-1] - drive_times[0])]}


def _weight_first_output(scene_tables: Table, scene: Any) -> None:
    """Edit a scene so that its first acceleration output is weighted by Wk (ISO 2631-1)."""
    name = next(output.name for output in _vehicle_of_scene(scene).outputs if output.kind == "acceleration")
    scene_tables["weighting"] = {name: "Wk"}


COST_PER_SPEED = "a linear vehicle of its own at every speed"
TABLE = {
    "anti_roll_bars": _vehicle_effect(
        "Anti-roll bars, one by one", "a product per bar", _has_omissions_of_kind("anti_roll_bars")
    ),
    "body_mass": _vehicle_effect(
        "Mass of the wheels, of one axle or of all, and of every other light body: what moves then follows its springs",
        "two states per freedom of a light body",
        _has_omissions_of_kind("body_mass"),
    ),
    "bushings": _vehicle_effect(
        "Bushings of the wheels: the stiffer springs between wheels and what they carry, rigid along their direction",
        "a product per bushing, and the fastest modes of the vehicle",
        _has_omissions_of_kind("bushings"),
    ),
    "curves": EffectEntry(
        "Curves and friction of springs and dampers, beyond their slopes at rest",
        "vehicle.small_motion",
        "runs in time by an engine in place of one covariance",
        {"bent springs": 1},
        modules=("models.ride.statistical_linearisation",),
        is_present=_has_omissions_of_kind("curves"),
        leave_out=_straighten_curves,
    ),
    "delay": EffectEntry(
        "The delay from front to rear: every axle meets at once what the first one meets",
        "road.front_rear",
        "a filter of the road per axle",
        {"delays": 1},
        usual_value="delayed",
        is_present=_has_omissions_of_kind("delay"),
        leave_out=_equal_heights_edit("front_rear"),
    ),
    "drag": _vehicle_effect(
        "Drag of the air, which loads the axles by the speed",
        COST_PER_SPEED,
        lambda scene: bool(_vehicle_of_scene(scene).drags),
    ),
    "freedoms": _vehicle_effect(
        "Single freedoms of bodies: locked. Wheels keep their up and down; their other freedoms are locked together",
        "two states per freedom",
        _has_omissions_of_kind("freedoms"),
    ),
    "gravity_and_preload": EffectEntry(
        "Gravity, and the preload of the springs that carry the bodies",
        "vehicle.operating_point",
        "a stiffness per preloaded spring",
        {"preloads": 1},
        usual_value="loaded",
        is_present=lambda scene: scene.vehicle.operating_point == "loaded",
    ),
    "measured_road": EffectEntry(
        "A road that is fitted to a measured one",
        "road.file",
        "a fit before all, no more in the runs",
        {"fits": 1},
        modules=("models.road.fitted",),
        leave_out=_take_papers_road,
    ),
    "mounts": _vehicle_effect(
        "Mounts and seats: a body that carries no tyre sits rigidly on the one that its springs join it to",
        "a product per mount, and the freedoms of what it carries",
        _has_omissions_of_kind("mounts"),
    ),
    "second_corner": EffectEntry(
        "The road's second corner: its filters of second order become those of first order",
        "road.cutoff",
        "a state more per filter of the road",
        {"states": 4},
        usual_value=20.0,
    ),
    "second_track": EffectEntry(
        "The second track: left and right wheels of an axle meet the same height",
        "road.left_right",
        "a second filter of the road per axle",
        {"heights": 2},
        usual_value="modelled",
        is_present=_has_omissions_of_kind("second_track"),
        leave_out=_equal_heights_edit("left_right"),
    ),
    "side_forces": _vehicle_effect(
        "Side forces of tyres, by slip angle", COST_PER_SPEED, lambda scene: bool(_vehicle_of_scene(scene).side_forces)
    ),
    "tyre_damping": _vehicle_effect(
        "Damping of the tyres: nothing but their springs is left",
        "a product per tyre; without a second corner white noise at the outputs",
        _has_omissions_of_kind("tyre_damping"),
    ),
    "varying_speed": EffectEntry(
        "A speed that varies along the road",
        "drive",
        "a covariance integrated in time instead of the stationary solution",
        {"drives": 1},
        modules=("models.ride.varying_speed",),
        leave_out=_hold_mean_speed,
    ),
    "weighting": EffectEntry(
        "Outputs weighted for people, by ISO 2631-1",
        "weighting",
        "eight states per weighted output by Wk, six by Wd",
        {"states": 8},
        is_present=lambda scene: bool(scene.weighting),
        put_in=_weight_first_output,
    ),
}
"""Usual values: the road's second corner is at 20 rad/m, a wavelength of a third of a metre."""
