"""From a scene to its wheelset, and to the equations of motion of each implementation."""

from importlib import import_module
from pathlib import Path
from typing import Any

from models.contact.standard_profiles import RAILS, WHEELS
from models.core.errors import InputError
from models.core.scene_effects import extended
from models.core.scene_file import existing, parse
from models.rail.equations import Equations
from models.rail.laid_profiles import Profiles
from models.rail.linear import NoCriticalSpeed, critical_speed
from models.rail.wheelset import CHOSEN, Wheelset
from models.systems.wheelset.scene import WheelsetScene

BUILT_IN = {"wheel": WHEELS, "rail": RAILS}
SETS = {"chosen": CHOSEN}
IMPLEMENTATIONS = {
    "reference": "models.rail.equations.Equations",
    "exudyn": "models.engines.wheelset_exudyn.ExudynWheelset",
    "mujoco": "models.engines.wheelset_mujoco.MujocoWheelset",
}
FLANGE = "flange_stiffness"
"""The only parameter that profiles leave nothing to do: cones stand for them where motions are small."""
BESIDE = (0.9, 1.1)
"""Speeds of the paths by the critical one, where the scene names none."""


def wheelset_of(scene: WheelsetScene) -> Wheelset:
    """The wheelset with the scene's overrides; each value is judged under its own file's name."""
    name, override = scene.wheelset.parameters, scene.wheelset.override
    base = SETS.get(name)
    if base is None and not name.endswith(".toml"):
        allowed = "must be a TOML file with all parameters, or a parameter set"
        raise InputError(scene.file, "wheelset.parameters", name, allowed, tuple(SETS))
    if base is None:
        path = existing(name, Path(scene.folder), scene.file, "wheelset.parameters")
        base = _judged(parse(path), path.name, "")
    profiles = _profiles(scene, base)
    if profiles is not None and FLANGE in override:
        raise InputError(
            scene.file,
            f"wheelset.override.{FLANGE}",
            override[FLANGE],
            "has no meaning beside profiles, which have flanges of their own: drop one of them",
        )
    values = {key: getattr(base, key) for key in Wheelset.model_fields} | {"profiles": profiles}
    return extended(_judged(values | override, scene.file, "wheelset.override"), scene)


def _profiles(scene: WheelsetScene, base: Wheelset) -> Profiles | None:
    """Profiles of the scene, with the paths of their files, or else the parameter set's own."""
    if scene.profiles is None:
        return base.profiles
    found = scene.profiles
    for kind in ("wheel", "rail"):
        name = getattr(found, kind)
        if Path(name).suffix:
            found = found.model_copy(update={kind: str(scene.path(name, f"profiles.{kind}"))})
        elif name not in BUILT_IN[kind]:
            allowed = "must be a file or built in"
            raise InputError(scene.file, f"profiles.{kind}", name, allowed, tuple(BUILT_IN[kind]))
    return found


def any_of(scene: WheelsetScene, *keys: str) -> bool:
    """Whether any of these parameters of the scene's wheelset is above zero."""
    wheelset = wheelset_of(scene)
    return any(getattr(wheelset, key) > 0.0 for key in keys)


def override(table: dict[str, Any], values: dict[str, float]) -> None:
    """Put parameters into a scene's table in place of its set's own."""
    table.setdefault("wheelset", {}).setdefault("override", {}).update(values)


def usual(*keys: str) -> dict[str, float]:
    """Parameters of the chosen wheelset."""
    return {key: getattr(CHOSEN, key) for key in keys}


def _judged(values: dict[str, Any], file: str, table: str) -> Wheelset:
    """The wheelset of these values; a fault is told by file and table."""
    try:
        return Wheelset(**values)
    except InputError as error:
        place = ".".join(part for part in (table, error.place.partition(".")[2]) if part)
        raise InputError(file, place, error.value, error.allowed) from None


def implementation(engine: str) -> type[Equations]:
    """The equations of motion of an implementation; its engine is imported here and not before."""
    module, _, name = IMPLEMENTATIONS[engine].rpartition(".")
    return getattr(import_module(module), name)


def equations_of(scene: WheelsetScene, engine: str, speed: float) -> Equations:
    """The scene's wheelset with its law of creep at a speed (m/s)."""
    return implementation(engine)(wheelset_of(scene), speed, scene.contact.law, scene.contact.cells)


def path_speeds(scene: WheelsetScene) -> list[float]:
    """Speeds (m/s) of the paths: the scene's, or around the critical one, or the last speed where there is none."""
    if scene.run.speeds:
        return list(scene.run.speeds)
    try:
        critical = critical_speed(wheelset_of(scene))
    except NoCriticalSpeed:
        return [float(scene.speeds.all()[-1])]
    return [round(share * critical, 2) for share in BESIDE]
