"""The user's file: read strictly, before anything is imported that a run would need."""

import tomllib
from collections.abc import Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from models.engines.catalogue import CATALOGUE, RECOMMENDED
from models.errors import InputError
from models.strict import Strict, quantity, read
from models.vehicles import pitch_plane
from models.vehicles.description import Geometry

FOLDER = Path(__file__).parent


def _names(folder: str) -> tuple[str, ...]:
    """Files of a folder of models, without suffix: the names that a scene may use."""
    return tuple(sorted(path.stem for path in (FOLDER / folder).glob("*.py") if path.stem != "__init__"))


def effect_names() -> tuple[str, ...]:
    """Names of all effects that a scene may call for."""
    return _names("effects")


class VehicleTable(Strict):
    """[vehicle]: a published parameter set or the user's own file, with overrides."""

    parameters: str = Field("itwm_drift", description="a parameter set, or a TOML file with one")
    geometry: Geometry = Field("exact", description="sin and cos of pitch, or linearised")
    override: dict[str, float] = Field(default_factory=dict, description="parameters that differ from the set")


class RunTable(Strict):
    """[run]: how long, and how finely."""

    duration: float = quantity("s", "length of the run")
    step: float = quantity("s", "step of fixed-step integrators", default=1e-3)
    output_step: float | None = quantity("s", "spacing of the saved results, a multiple of the step", default=None)


class EngineTable(Strict):
    """[engines.NAME]: settings that differ from the recommended ones."""

    integrator: str | None = Field(None, description="name of an integrator of this engine")
    step: float | None = quantity("s", "step for this engine alone", default=None)
    tolerance: float = quantity("", "relative tolerance of adaptive integrators", default=1e-9)
    spectral_radius: float = quantity("", "of generalised-alpha at infinite frequency", default=0.6, zero=True)


class Scene(Strict):
    """One scene file. ``effects`` and ``options`` are checked by the files that own them."""

    title: str = Field(description="what the scene shows")
    system: Literal["pitch-plane"] = "pitch-plane"
    study: str = Field("single_run", description="the study that runs the scene")
    vehicle: VehicleTable = VehicleTable()
    run: RunTable
    start: dict[str, float] = Field(default_factory=dict, description="initial states beside the static equilibrium")
    effects: dict[str, Any] = Field(default_factory=dict, description="the effects of the scene, a table each")
    engines: dict[str, EngineTable] = Field(default_factory=dict)
    options: dict[str, Any] = Field(default_factory=dict, description="options of the study")
    file: str = ""
    folder: str = "."

    def vehicle_parameters(self) -> pitch_plane.Parameters:
        """The parameter set with the scene's overrides."""
        values = _parameter_set(self.vehicle.parameters, self.file, Path(self.folder))
        merged = {**values, **self.vehicle.override}
        return read(pitch_plane.Parameters, merged, self.file, "vehicle.override")

    def path(self, name: str) -> Path:
        """A file that the scene names, relative to the scene's own folder."""
        return Path(self.folder) / name

    def settings(self, engine: str) -> EngineTable:
        """Settings of one engine, with recommended values where the scene says nothing."""
        given = self.engines.get(engine, EngineTable())
        name = given.integrator or ("GeneralizedAlpha" if self._constrained(engine) else RECOMMENDED[engine])
        return given.model_copy(update={"integrator": name, "step": given.step or self.run.step})

    def _constrained(self, engine: str) -> bool:
        return engine == "exudyn" and "prescribed_pitch" in self.effects


def _parameter_set(name: str, file: str, folder: Path) -> dict[str, Any]:
    if name.endswith(".toml"):
        return parse(folder / name)
    if name not in _names("parameters"):
        raise InputError(file, "vehicle.parameters", name, "no such parameter set", _names("parameters"))
    return import_module(f"models.parameters.{name}").PARAMETERS.model_dump()


def parse(path: Path) -> dict[str, Any]:
    """A TOML file as nested tables; raises InputError where it cannot be read."""
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise InputError(path, "", None, "no such file") from None
    except OSError as error:
        raise InputError(path, "", None, f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", None, "not UTF-8 text") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(path, "", None, f"not valid TOML: {error}") from None


def load(path: Path, changes: Iterable[str] = ()) -> Scene:
    """Read a scene file, with ``--set`` changes of the form KEY.KEY=VALUE applied on top."""
    table = parse(path)
    for change in changes:
        _apply(table, change)
    return build(table, path.name, path.parent)


def build(table: Mapping[str, Any], file: str = "", folder: Path = Path()) -> Scene:
    """A checked scene from nested tables; raises InputError for anything that is not understood."""
    for key in ("file", "folder"):
        if key in table:
            raise InputError(file, key, table[key], "unknown key", tuple(set(Scene.model_fields) - {"file", "folder"}))
    scene = read(Scene, {**table, "file": file, "folder": str(folder)}, file)
    effects = {name: _effect(name, values, file) for name, values in scene.effects.items()}
    for name, settings in scene.engines.items():
        _check_engine(name, settings, file)
    return scene.model_copy(update={"effects": effects})




def _effect(name: str, values: Any, file: str) -> Any:
    if name not in effect_names():
        raise InputError(file, f"effects.{name}", None, "no such effect", effect_names())
    return read(import_module(f"models.effects.{name}").Parameters, values, file, f"effects.{name}")


def _check_engine(name: str, settings: EngineTable, file: str) -> None:
    if name not in CATALOGUE:
        raise InputError(file, f"engines.{name}", None, "no such engine", tuple(CATALOGUE))
    if settings.integrator is not None and settings.integrator not in CATALOGUE[name]:
        place = f"engines.{name}.integrator"
        raise InputError(file, place, settings.integrator, "no such integrator", tuple(CATALOGUE[name]))
    if settings.spectral_radius > 1:
        place = f"engines.{name}.spectral_radius"
        raise InputError(file, place, settings.spectral_radius, "must be between 0 and 1")


def _apply(table: dict[str, Any], change: str) -> None:
    """Set one nested key from KEY.KEY=VALUE; the value is read as TOML, or as text if it is not."""
    key, equals, text = change.partition("=")
    if not equals or not key.strip():
        raise InputError("--set", "", change, "must read KEY=VALUE, for example run.step=5e-4")
    try:
        value = tomllib.loads(f"x = {text}")["x"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    *parents, last = key.strip().split(".")
    for parent in parents:
        table = table.setdefault(parent, {})
        if not isinstance(table, dict):
            raise InputError("--set", key.strip(), text, f"{parent!r} is a value, not a table")
    table[last] = value
