"""Scenes of a wheelset on straight track: parameters, law of creep, speeds, initial displacement, equivalent
conicity.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from models.core.errors import InputError
from models.core.scene_effects import with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.speeds import Speeds, check_speeds
from models.core.steps import MOST_STEPS, dividing_step, step_divides
from models.core.strict import Strict, quantity
from models.rail.laid_profiles import CrossSections

HIGHEST_SPEED = 200.0
"""Highest speed (m/s) that a scene may have."""
LARGEST_SHIFT, LARGEST_YAW = 0.02, 0.05
"""Largest lateral displacement (m) and yaw (rad) at the start: beyond, a wheelset does not stand on its rails."""
WHEELS_OF_SCENE = {"reach", "spacing", "right_radius", "left_radius", "left_wheel", "left_rail"}
"""Keys of [conicity] that describe the wheels and rails, which a table of rolling radius differences replaces."""
LARGEST_DISPLACEMENT_COUNT = 1000
"""Most lateral displacements on one side at which profiles are put on their rails; each takes some hundredths of a
second.
"""
RADIUS_RANGE = (0.1, 1.5)
"""Smallest and largest rolling radius (m) that a scene may have, wider than that of railway wheels."""
LARGEST_CELL_COUNT = 200
"""Most cells of FASTSIM along each strip of the contact patch."""


class WheelsetTable(Strict):
    """[wheelset]: a parameter set or the user's parameter file, and values that replace some of its parameters."""

    parameters: str = Field(default="chosen", description="a parameter set, or a TOML file with every parameter")
    override: dict[str, float] = Field(default_factory=dict, description="parameters that differ from the set")


class CreepLawTable(Strict):
    """[contact]: the law of creep forces in simulated motions; eigenvalues and critical speed use the linear law."""

    law: Literal["linear", "fastsim"] = Field(default="fastsim", description="Kalker's linear theory, or FASTSIM")
    cells: int = Field(default=11, ge=3, le=LARGEST_CELL_COUNT, description="of FASTSIM, along each strip")


class WheelsetRunTable(Strict):
    """[run]: initial displacement and yaw, duration, time step and speeds of the simulated motions."""

    duration: float = quantity("s", "length of a path", default=2.0)
    step: float = quantity("s", "step of RK4 in every implementation", default=5e-4)
    displacement: float = quantity("m", "lateral, at the beginning, to the right", default=5e-3, signed=True)
    yaw: float = quantity("rad", "at the beginning, to the right", default=0.0, signed=True)
    speeds: list[float] = Field(
        default_factory=list, description="of the paths, m/s; 0.9 and 1.1 of the critical one if not given"
    )


class ConicityTable(Strict):
    """[conicity]: amplitudes at which the equivalent conicity is computed, and the profiles of the wheels.

    A table of rolling radius differences replaces the scene's cones or profiles. Without a table both wheels have
    the scene's shape and radius, except a radius of either wheel, or a left wheel or rail, that is named here.
    """

    amplitudes: list[float] = Field(
        default=[0.003], min_length=1, description="half of peak to peak, m; the standard names 0.003"
    )
    table: str | None = Field(
        default=None, description="CSV file with y and dr: displacement to the right, radius of the right less the left"
    )
    near: float | None = quantity(
        "m", "where the wave's centre is looked for if there are several", default=None, signed=True
    )
    reach: float = quantity("m", "largest displacement at which profiles are put on their rails", default=0.01)
    spacing: float = quantity("m", "between these displacements", default=1e-4)
    right_radius: float | None = quantity("m", "rolling radius of the right wheel, if not the scene's", default=None)
    left_radius: float | None = quantity("m", "of the left wheel", default=None)
    left_wheel: str | None = Field(default=None, description="profile of the left wheel, built in or a file")
    left_rail: str | None = Field(default=None, description="profile of the left rail, built in or a file")


class WheelsetScene(SceneFile):
    """A scene of a wheelset on straight track: all tables of its scene file."""

    system: Literal["wheelset"] = "wheelset"
    study: str = Field(default="wheelset", description="the study that runs the scene")
    wheelset: WheelsetTable = WheelsetTable()
    profiles: CrossSections | None = Field(default=None, description="cross-sections in place of cones and round heads")
    contact: CreepLawTable = CreepLawTable()
    speeds: Speeds = Field(description="table with a range of speeds, or a list of them")
    run: WheelsetRunTable = WheelsetRunTable()
    conicity: ConicityTable | None = Field(default=None, description="equivalent conicity, of these wheels")
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> WheelsetScene:
    """Build a checked wheelset scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(WheelsetScene, scene_tables, scene_path, scene_folder)
    _check_speeds(scene)
    _check_run(scene)
    _check_conicity(scene)
    if scene.contact.law == "linear" and "cells" in scene.contact.model_fields_set:
        raise InputError(scene_path, "contact.cells", scene.contact.cells, "has no meaning for the linear law: drop it")
    return with_effect_tables(scene)


def _check_speeds(scene: WheelsetScene) -> None:
    check_speeds(scene.file, scene.speeds)
    start, stop = scene.speeds.start, scene.speeds.stop
    if start is not None and stop is not None and start >= stop:
        raise InputError(
            scene.file,
            "speeds.stop",
            stop,
            f"must be above speeds.start = {start:g} m/s; for one speed write speeds.values = [{start:g}]",
        )
    listed = {f"speeds.values.{i}": speed for i, speed in enumerate(scene.speeds.values)}
    listed |= {"speeds.stop": stop or 0.0} | {f"run.speeds.{i}": speed for i, speed in enumerate(scene.run.speeds)}
    for key_path, speed in listed.items():
        if not speed <= HIGHEST_SPEED:
            raise InputError(scene.file, key_path, speed, f"must be at most {HIGHEST_SPEED:g} m/s")
        if key_path.startswith("run") and not speed > 0.0:
            raise InputError(scene.file, key_path, speed, "must be above 0, in m/s")


def _check_conicity(scene: WheelsetScene) -> None:
    conicity_table = scene.conicity
    if conicity_table is None:
        return
    for i, amplitude in enumerate(conicity_table.amplitudes):
        if not 0.0 < amplitude <= LARGEST_SHIFT:
            allowed = f"must be above 0 and at most {LARGEST_SHIFT:g} m: half of peak to peak"
            raise InputError(scene.file, f"conicity.amplitudes.{i}", amplitude, allowed)
    if conicity_table.table is not None:
        for key in sorted(conicity_table.model_fields_set & WHEELS_OF_SCENE):
            allowed = "is not read beside a table, which has both wheels in it: drop one of them"
            raise InputError(scene.file, f"conicity.{key}", getattr(conicity_table, key), allowed)
        return
    if scene.profiles is None:
        for key in sorted(conicity_table.model_fields_set & {"left_wheel", "left_rail", "spacing"}):
            allowed = "needs [profiles]: without them both wheels are cones"
            raise InputError(scene.file, f"conicity.{key}", getattr(conicity_table, key), allowed)
    if not (
        conicity_table.reach <= LARGEST_SHIFT
        and conicity_table.reach / LARGEST_DISPLACEMENT_COUNT <= conicity_table.spacing <= conicity_table.reach / 4.0
    ):
        allowed = f"must be from 1/{LARGEST_DISPLACEMENT_COUNT} to 1/4 of reach, and reach at most {LARGEST_SHIFT:g} m"
        raise InputError(scene.file, "conicity.spacing", conicity_table.spacing, allowed)
    for key in ("right_radius", "left_radius"):
        radius = getattr(conicity_table, key)
        if radius is not None and not RADIUS_RANGE[0] <= radius <= RADIUS_RANGE[1]:
            raise InputError(
                scene.file, f"conicity.{key}", radius, f"must be from {RADIUS_RANGE[0]:g} to {RADIUS_RANGE[1]:g} m"
            )


def _check_run(scene: WheelsetScene) -> None:
    run = scene.run
    for key, largest, unit in (("displacement", LARGEST_SHIFT, "m"), ("yaw", LARGEST_YAW, "rad")):
        if abs(getattr(run, key)) > largest:
            allowed = f"must be at most {largest:g} {unit}, of either sign: beyond, it does not stand on its rails"
            raise InputError(scene.file, f"run.{key}", getattr(run, key), allowed)
    if run.duration / run.step > MOST_STEPS:
        raise InputError(scene.file, "run.duration", run.duration, f"needs more than {MOST_STEPS:,} steps")
    if not step_divides(run.step, run.duration):
        allowed = (
            f"must divide run.duration = {run.duration:g} s; use for example {dividing_step(run.step, run.duration)}"
        )
        raise InputError(scene.file, "run.step", run.step, allowed)
