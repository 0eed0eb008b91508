"""Scenes of the pitch-plane vehicle, and their assembly: the vehicle with its input and the scene's effects."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.scene_effects import check_combination, effect_of, read_tables
from models.core.scene_file import SceneFile, checked, existing_file, parse_toml
from models.core.steps import MOST_STEPS, dividing_step, step_divides
from models.core.strict import Query, Strict, accepted_queries_field, quantity, read
from models.core.systems import DEFAULT_SYSTEM
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, RECOMMENDED, UNAVAILABLE_INTEGRATORS
from models.vehicles import pitch_plane
from models.vehicles.description import Geometry
from models.vehicles.pitch_plane import STATE_NAMES

PARAMETER_SET_FOLDER = Path(pitch_plane.__file__).with_name("parameters")
"""Folder of the published parameter sets of vehicles."""


def parameter_sets() -> tuple[str, ...]:
    """Names of the published parameter sets of vehicles."""
    return tuple(sorted(path.stem for path in PARAMETER_SET_FOLDER.glob("*.py") if path.stem != "__init__"))


class PitchPlaneVehicleTable(Strict):
    """[vehicle]: a published parameter set or the user's parameter file, and values that replace some parameters."""

    parameters: str = Field(default="itwm_drift", description="a parameter set, or a TOML file with one")
    geometry: Geometry = Field(default="exact", description="sin and cos of pitch, or linearised")
    override: dict[str, float] = Field(default_factory=dict, description="parameters that differ from the set")
    accept: list[Query] = accepted_queries_field()


class PitchPlaneRunTable(Strict):
    """[run]: duration, time step, and spacing of the saved rows."""

    duration: float = quantity("s", "length of the run")
    step: float = quantity("s", "step of fixed-step integrators", default=2.5e-4)
    output_step: float | None = quantity("s", "spacing of the saved results, a multiple of the step", default=None)


class EngineTable(Strict):
    """[engines.NAME]: time integration settings of an engine, where they differ from the recommended ones."""

    integrator: str | None = Field(default=None, description="name of an integrator of this engine")
    step: float | None = quantity("s", "step for this engine alone", default=None)
    tolerance: float = quantity("", "relative tolerance of adaptive integrators", default=1e-9)
    spectral_radius: float = Field(default=0.6, ge=0, le=1, description="of generalised-alpha at infinite frequency")


class Scene(SceneFile):
    """A scene of the pitch-plane vehicle: all tables of its scene file. The modules of the effects
    check their tables.
    """

    system: Literal["pitch-plane"] = "pitch-plane"
    study: str = Field(default="single_run", description="the study that runs the scene")
    vehicle: PitchPlaneVehicleTable = PitchPlaneVehicleTable()
    run: PitchPlaneRunTable = Field(description="table with at least the duration")
    start: dict[str, float] = Field(default_factory=dict, description="initial states beside the static equilibrium")
    effects: dict[str, Any] = Field(default_factory=dict, description="the effects of the scene, a table each")
    engines: dict[str, EngineTable] = Field(default_factory=dict)

    def vehicle_parameters(self) -> pitch_plane.PitchPlaneParameters:
        """Returns the vehicle's parameters with the scene's overrides. An InputError names the file
        of the wrong value.
        """
        base = parameter_set(self.vehicle.parameters, self.file, Path(self.folder))
        values = {**base.model_dump(), **self.vehicle.override}
        p = read(pitch_plane.PitchPlaneParameters, values, self.file, "vehicle.override")
        _check_rest(p, self)
        return p

    def table(self) -> dict[str, Any]:
        """Returns the scene as nested tables of plain values, defaults included, from which it can be run again."""
        plain = self.model_dump(exclude={"effects", "engines"}, exclude_none=True)
        return plain | {
            "effects": {name: values.model_dump(exclude_none=True) for name, values in self.effects.items()},
            "engines": {name: values.model_dump(exclude_unset=True) for name, values in self.engines.items()},
        }

    def settings(self, engine: str) -> EngineTable:
        """Returns the time integration settings of an engine, with recommended values where the scene has none."""
        named = self.engines.get(engine, EngineTable())
        guided = not {"prescribed_pitch", "prescribed_heave_and_pitch"}.isdisjoint(self.effects)
        usual = "GeneralizedAlpha" if guided and engine == "exudyn" else RECOMMENDED[engine]
        return named.model_copy(update={"integrator": named.integrator or usual, "step": named.step or self.run.step})


def parameter_set(set_name: str, scene_path: str, scene_folder: Path) -> pitch_plane.PitchPlaneParameters:
    """A published parameter set by its name, or the user's own from a TOML file."""
    if set_name.endswith(".toml"):
        return read(
            pitch_plane.PitchPlaneParameters,
            parse_toml(existing_file(set_name, scene_folder, scene_path, "vehicle.parameters")),
            set_name,
        )
    if set_name not in parameter_sets():
        allowed = "must be a TOML file with all parameters, or a published set"
        raise InputError(scene_path, "vehicle.parameters", set_name, allowed, parameter_sets())
    return import_module(f"models.vehicles.parameters.{set_name}").PARAMETERS


SMALLEST_PARAMETER = 1e-9
"""Smallest positive value of a vehicle's parameter in SI units."""


def _check_rest(vehicle_parameters: pitch_plane.PitchPlaneParameters, scene: Scene) -> None:
    """Raise InputError for parameters without a static equilibrium, in which every run begins, and for tiny
    parameters.
    """
    for name, value in vehicle_parameters:
        if 0 < value < SMALLEST_PARAMETER:
            allowed = f"too small for a vehicle: at least {SMALLEST_PARAMETER:g}"
            raise InputError(scene.file, f"vehicle.override.{name}", value, allowed)
    try:
        rest_state = pitch_plane.equilibrium(vehicle_parameters, scene.vehicle.geometry)
    except (ValueError, ArithmeticError):  # the sine of the pitch beyond 1
        rest_state = np.full(8, np.nan)
    if not np.isfinite(rest_state).all():
        raise InputError(
            scene.file,
            "vehicle",
            None,
            "no static equilibrium with these parameters: the springs k1 to k4 are too soft for the weight",
        )


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> Scene:
    """Build a checked pitch-plane scene from the nested tables of a scene file. Raises InputError for unknown keys and
    for values outside their ranges.
    """
    scene = checked(Scene, scene_tables, scene_path, scene_folder)
    effects = read_tables(scene.effects, DEFAULT_SYSTEM, scene_path)
    for name in scene.engines:
        _check_engine(name, scene)
    _check_times(scene)
    return scene.model_copy(update={"effects": effects})


def changed_scene(scene: Scene, **changed_tables: Mapping[str, Any]) -> Scene:
    """Returns the scene with some keys changed; ``changed_tables`` : new values of keys by the names of their
    tables.
    """
    table = scene.table()
    tables_now = {name: {**table.get(name, {}), **values} for name, values in changed_tables.items()}
    return build({**table, **tables_now}, scene.file, Path(scene.folder))


def _check_engine(engine: str, scene: Scene) -> None:
    """Raise InputError for unknown engines and integrators, and for settings that the integrator does not have."""
    if engine not in CATALOGUE:
        raise InputError(scene.file, f"engines.{engine}", None, "no such engine", tuple(CATALOGUE))
    engine_settings, key_path = scene.engines[engine], f"engines.{engine}"
    integrator = str(scene.settings(engine).integrator)
    if integrator not in CATALOGUE[engine]:
        names = tuple(key for key in CATALOGUE[engine] if (engine, key) not in UNAVAILABLE_INTEGRATORS)
        raise InputError(scene.file, f"{key_path}.integrator", integrator, "no such integrator", names)
    if "spectral_radius" in engine_settings.model_fields_set and integrator != "GeneralizedAlpha":
        allowed = f"has no meaning for {integrator}: it belongs to exudyn's GeneralizedAlpha"
        raise InputError(scene.file, f"{key_path}.spectral_radius", engine_settings.spectral_radius, allowed)
    if "tolerance" in engine_settings.model_fields_set and not CATALOGUE[engine][integrator].adaptive:
        adaptive = (
            " or ".join(
                key
                for key, value in CATALOGUE[engine].items()
                if value.adaptive and (engine, key) not in UNAVAILABLE_INTEGRATORS
            )
            or "other engines"
        )
        allowed = f"has no meaning for {integrator}, which takes steps of fixed length: it belongs to {adaptive}"
        raise InputError(scene.file, f"{key_path}.tolerance", engine_settings.tolerance, allowed)


def _check_times(scene: Scene) -> None:
    """Raise InputError for a duration, or a spacing of saved rows, that is not a whole number of
    steps in every engine.
    """
    for name in CATALOGUE:
        stated = name in scene.engines and scene.engines[name].step is not None
        _check_step(scene, f"engines.{name}.step" if stated else "run.step", float(scene.settings(name).step or 0))
    wanted = scene.run.output_step
    if wanted is None:
        return
    name = str(scene.settings("exudyn").integrator)
    if "exudyn" in scene.engines and CATALOGUE["exudyn"][name].adaptive:
        allowed = f"has no meaning for exudyn's {name}, whose rows lie where its own steps end: drop one of the two"
        raise InputError(scene.file, "run.output_step", wanted, allowed)
    if wanted > scene.run.duration * (1 + 1e-9):
        allowed = f"must be at most run.duration = {scene.run.duration:g} s"
        raise InputError(scene.file, "run.output_step", wanted, allowed)


def _check_step(scene: Scene, key_path: str, time_step: float) -> None:
    length, wanted = scene.run.duration, scene.run.output_step
    if length / time_step > MOST_STEPS:
        allowed = (
            f"needs {length / time_step:.3g} steps of {key_path} = {time_step:g} s; at most {MOST_STEPS:,} are possible"
        )
        raise InputError(scene.file, "run.duration", length, allowed)
    if not step_divides(time_step, length):
        allowed = f"must divide run.duration = {length:g} s; use for example {dividing_step(time_step, length)}"
        raise InputError(scene.file, key_path, time_step, allowed)
    if wanted is not None and not step_divides(time_step, wanted):
        allowed = f"must be a multiple of {key_path} = {time_step:g} s"
        raise InputError(scene.file, "run.output_step", wanted, allowed)


def settings_of(scene: Scene, engine: str) -> Settings:
    """Returns the time integration settings of a scene for an engine: integrator, step, duration, tolerance."""
    settings = scene.settings(engine)
    assert settings.integrator is not None and settings.step is not None
    return Settings(
        settings.integrator, settings.step, scene.run.duration, settings.tolerance, settings.spectral_radius
    )


def assembly_of_scene(scene: Scene) -> Assembly:
    """Assemble the scene's vehicle with its input and the effects that the scene names. Only the modules of these
    effects are imported.
    """
    p = scene.vehicle_parameters()
    vehicle = pitch_plane.pitch_plane_vehicle(p, scene.vehicle.geometry)
    assembly = Assembly(scene, vehicle, p, "free", None, _initial_state(scene, p))
    for name in effects_in_order(scene):
        assembly = effect_of(DEFAULT_SYSTEM, name).extend(assembly, scene.effects[name])
    return assembly


def _initial_state(scene: Scene, vehicle_parameters: pitch_plane.PitchPlaneParameters) -> np.ndarray:
    """Initial state (8,) of a scene: the static equilibrium, except for the states in [start]."""
    state = pitch_plane.equilibrium(vehicle_parameters, scene.vehicle.geometry)
    for name, value in scene.start.items():
        if name not in STATE_NAMES:
            raise InputError(scene.file, f"start.{name}", value, "not a state", STATE_NAMES)
        state[STATE_NAMES.index(name)] = value
    return state


def effects_in_order(scene: Scene) -> list[str]:
    """Returns the names of the scene's effects, each after the effects that it needs. Raises InputError for effects
    that exclude one another.
    """
    modules = {name: effect_of(DEFAULT_SYSTEM, name) for name in scene.effects}
    check_combination(modules, scene)
    ordered_effects: list[str] = []
    waiting = list(modules)
    while waiting:
        ready = [
            n
            for n in waiting
            if all(m in ordered_effects for m in (*modules[n].NEEDS, *modules[n].AFTER) if m in modules)
        ]
        ordered_effects += ready
        waiting = [n for n in waiting if n not in ready]
    return ordered_effects
