"""A road under the wheels (eq. 38), from a formula, an ISO 8608 class, or a measured file."""

from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.core.assumptions import Assumption, Watched
from models.core.errors import InputError
from models.core.result import Result
from models.core.strict import Strict, quantity
from models.engines.assembly import Assembly
from models.systems.pitch_plane.assumptions import STEEPEST_PITCH

EXCLUDES = ("wheel_forces", "prescribed_pitch", "contact_points")
COST = "height and slope under each wheel, read from a table of half steps"
EXAMPLE = {"source": "study", "speed": 20.0}
COUNTS = {"exudyn": {"native items": 4, "callbacks": 4}, "mujoco": {"callbacks": 1}, "all": {"channels": 2}}

KEYS_OF_SOURCE = {
    "study": ("gd", "grade"),
    "hills": ("grade",),
    "iso8608": ("road_class", "seed", "level", "grade"),
    "opencrg": ("file", "track", "offset", "beyond_end", "run_in"),
    "csv": ("file", "track", "beyond_end", "run_in"),
}
"""Keys of [effects.road] that each source of the road takes; the grade of a measured road cannot be changed."""
REQUIRED_KEYS = {"iso8608": ("road_class",), "opencrg": ("file", "beyond_end"), "csv": ("file", "beyond_end")}


class Parameters(Strict):
    """[effects.road]: source of the road and speed of the vehicle; the other keys depend on the source."""

    source: Literal["study", "hills", "iso8608", "opencrg", "csv"] = Field(description="where the road comes from")
    speed: float = quantity("m/s", "constant speed of the vehicle")
    gd: float | None = quantity("m^3", "study: one-sided roughness at 0.1 1/m", default=None)
    grade: float | None = Field(
        None,
        gt=-STEEPEST_PITCH,
        lt=STEEPEST_PITCH,
        json_schema_extra={"unit": "rad"},
        description="study, hills, iso8608: slope angle that the road comes to after its fade-in, positive uphill",
    )
    road_class: Literal["A", "B", "C", "D", "E", "F", "G", "H"] | None = Field(None, description="iso8608: class")
    seed: int | None = Field(None, ge=0, lt=2**128, description="iso8608: seed of the phases")
    level: Literal["one-sided", "two-sided"] | None = Field(None, description="iso8608: how the class's level is read")
    file: str | None = Field(None, description="opencrg, csv: the measured road")
    track: Literal["left", "right", "mean", "centre"] | None = Field(None, description="opencrg, csv: which track")
    offset: float | None = quantity("m", "opencrg: lateral place of the vehicle", default=None, signed=True)
    beyond_end: Literal["mirrored", "refused"] | None = Field(None, description="opencrg, csv: how the road goes on")
    run_in: float | None = quantity("m", "opencrg, csv: length over which the road rises from the flat", default=None)


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with the road as its input."""
    from models.road.signal import RoadUnderWheels

    _check_keys(vehicle_assembly.scene.file, parameters)
    distance = parameters.speed * vehicle_assembly.scene.run.duration
    profile, kinks = _road_profile(vehicle_assembly.scene, parameters, distance)
    wheelbase = vehicle_assembly.parameters.a + vehicle_assembly.parameters.b
    driven = vehicle_assembly.with_input("road", RoadUnderWheels(profile, parameters.speed, wheelbase, kinks))
    says = "the road is so even that a tyre touches it in one point below its wheel"
    remedy = "smooth the road over what a tyre's patch feels, some 0.2 m, or take a gentler one"
    slope = Assumption(
        "even road",
        says,
        remedy,
        partial(_slopes_under_wheels, parameters.speed),
        "rad",
        -STEEPEST_PITCH,
        STEEPEST_PITCH,
    )
    return replace(driven, assumptions=(*driven.assumptions, slope))


def _slopes_under_wheels(speed: float, run_result: Result) -> Watched:
    """Slope angle (n,) in rad of the road under each wheel over a run at a speed (m/s), positive uphill."""
    metres = speed * run_result.times
    slopes = {
        f"{axle} wheel": -np.gradient(run_result[f"zeta{i + 1}"], metres) for i, axle in enumerate(("front", "rear"))
    }
    return {name: np.arctan(slope) for name, slope in slopes.items()}


def _check_keys(scene_path: str, road_parameters: Parameters) -> None:
    keys = {name: value for name, value in road_parameters if name not in ("source", "speed") and value is not None}
    for name, value in keys.items():
        if name not in KEYS_OF_SOURCE[road_parameters.source]:
            accepted_keys = ", ".join(("speed", *KEYS_OF_SOURCE[road_parameters.source]))
            allowed = f"has no meaning for source = {road_parameters.source!r}, which takes {accepted_keys}"
            raise InputError(scene_path, f"effects.road.{name}", value, allowed)
    for name in REQUIRED_KEYS.get(road_parameters.source, ()):
        if name not in keys:
            meaning = str(type(road_parameters).model_fields[name].description).partition(": ")[2]
            allowed = f"is missing: source = {road_parameters.source!r} needs it ({meaning})"
            raise InputError(scene_path, f"effects.road.{name}", None, allowed)


def _road_profile(scene: Any, road_parameters: Parameters, driven_distance: float) -> tuple[Any, tuple[float, ...]]:
    """Returns the road profile, and the stations (m) at which it is only twice continuously differentiable."""
    if road_parameters.source in ("opencrg", "csv"):
        profile = _measured_road(scene, road_parameters, driven_distance)
        return profile, (profile.start, profile.start + profile.window_length)
    if road_parameters.source == "iso8608":
        from models.road.iso8608 import iso8608_road

        assert road_parameters.road_class is not None
        profile = iso8608_road(
            road_parameters.road_class,
            0 if road_parameters.seed is None else road_parameters.seed,
            level_convention=road_parameters.level or "one-sided",
        )
    else:
        from models.road.study import STUDY_GD, hills_road, study_road

        profile = (
            hills_road()
            if road_parameters.source == "hills"
            else study_road(STUDY_GD if road_parameters.gd is None else road_parameters.gd)
        )
    faded_in = profile.window_length
    if road_parameters.grade is None:
        return profile, (0.0, faded_in)
    from models.road.grade import TRANSITION_LENGTH, GradedRoad

    return GradedRoad(profile, road_parameters.grade, faded_in), (0.0, faded_in, faded_in + TRANSITION_LENGTH)


def _measured_road(scene: Any, road_parameters: Parameters, driven_distance: float) -> Any:
    from models.road.continuation import RUN_IN_LENGTH, continued_road, road_with_run_in

    path, track = scene.path(road_parameters.file, "effects.road.file"), road_parameters.track or "mean"
    length = RUN_IN_LENGTH if road_parameters.run_in is None else road_parameters.run_in
    if road_parameters.source == "opencrg":
        from models.road.opencrg import read_opencrg

        raw = read_opencrg(
            path, track, lateral_offset=0.0 if road_parameters.offset is None else road_parameters.offset
        )
    else:
        from models.road.csv_road import read_csv_road

        raw = read_csv_road(path, track)
    _check_length(scene, road_parameters, raw, driven_distance, length)
    longer = continued_road(raw, str(road_parameters.beyond_end), driven_distance, path)
    assert isinstance(longer, type(raw))
    return road_with_run_in(longer, length)


def _check_length(
    scene: Any, road_parameters: Parameters, measured_profile: Any, driven_distance: float, run_in_length: float
) -> None:
    """Raise InputError for a road file that is too short for the run-in (m) or for the driven distance (m)."""
    total = measured_profile.end - measured_profile.start
    if run_in_length > total:
        raise InputError(
            scene.file,
            "effects.road.run_in",
            run_in_length,
            f"the road {road_parameters.file} is only {total:g} m long",
        )
    if road_parameters.beyond_end == "refused" and driven_distance > total * (1 + 1e-9):
        allowed = (
            f"the road {road_parameters.file} ends at {total:g} m and the run needs {driven_distance:g} m: shorten "
            "run.duration, lower effects.road.speed or set this to 'mirrored'"
        )
        raise InputError(scene.file, "effects.road.beyond_end", "refused", allowed)
