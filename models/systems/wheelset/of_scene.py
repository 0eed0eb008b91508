"""The wheelset of a scene, and its equations of motion in the reference, in Exudyn and in MuJoCo."""

from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects
from models.core.scene_file import existing_file, parse_toml
from models.rail.equations import YAW, WheelsetEquations
from models.rail.linear import critical_speed_or_reason
from models.rail.wheelset import CHOSEN_WHEELSET, Wheelset
from models.systems.wheelset.scene import WheelsetScene

PARAMETER_SETS = {"chosen": CHOSEN_WHEELSET}
IMPLEMENTATION_MODULES = {
    "reference": "models.rail.equations.WheelsetEquations",
    "exudyn": "models.engines.wheelset.ExudynWheelset",
    "mujoco": "models.engines.wheelset.MujocoWheelset",
}
FLANGE_KEY = "flange_stiffness"
"""Parameter that has no effect beside profiles, which have flanges themselves. The cones' other parameters still
describe small motions.
"""
SPEED_SHARES = (0.9, 1.1)
"""Ratios of the paths' speeds to the critical speed, where the scene names no speeds."""


def wheelset_of(scene: WheelsetScene) -> Wheelset:
    """Returns the scene's wheelset: its parameter set with overrides, profiles and effects. An InputError names the
    file from which the wrong value comes.
    """
    name, override = scene.wheelset.parameters, scene.wheelset.override
    base = PARAMETER_SETS.get(name)
    if base is None and not name.endswith(".toml"):
        allowed = "must be a TOML file with all parameters, or a parameter set"
        raise InputError(scene.file, "wheelset.parameters", name, allowed, tuple(PARAMETER_SETS))
    if base is None:
        path = existing_file(name, Path(scene.folder), scene.file, "wheelset.parameters")
        base = _checked_wheelset(parse_toml(path), path.name, "")
    profiles = base.profiles if scene.profiles is None else scene.profiles.with_full_paths(scene)
    if profiles is not None and FLANGE_KEY in override:
        raise InputError(
            scene.file,
            f"wheelset.override.{FLANGE_KEY}",
            override[FLANGE_KEY],
            "has no meaning beside profiles, which have flanges of their own: drop one of them",
        )
    values = {key: getattr(base, key) for key in Wheelset.model_fields} | {"profiles": profiles}
    return extended_by_effects(_checked_wheelset(values | override, scene.file, "wheelset.override"), scene)


def _checked_wheelset(parameter_values: dict[str, Any], named_file: str, named_table: str) -> Wheelset:
    """Build a wheelset from its parameters by name. An InputError names the file and the table of the wrong value."""
    try:
        return Wheelset(**parameter_values)
    except InputError as error:
        key_path = ".".join(key for key in (named_table, error.place.partition(".")[2]) if key)
        raise InputError(named_file, key_path, error.value, error.allowed) from None


def equations_class(engine: str) -> type[WheelsetEquations]:
    """Returns the class of the equations of motion in "reference", "exudyn" or "mujoco"; no other engine is
    imported.
    """
    module, _, name = IMPLEMENTATION_MODULES[engine].rpartition(".")
    return getattr(import_module(module), name)


def equations_of(scene: WheelsetScene, engine: str, speed: float) -> WheelsetEquations:
    """Equations of motion of the scene's wheelset, with its law of creep, at a speed (m/s)."""
    return equations_class(engine)(wheelset_of(scene), speed, scene.contact.law, scene.contact.cells)


@lru_cache(32)
def _equations_and_state(
    engine: str, wheelset: Wheelset, speed: float, creep_law: Any, cell_count: int, lateral_shift: float, yaw: float
) -> tuple[WheelsetEquations, np.ndarray]:
    """Equations of motion in an engine, and the state (10,) at rest on the rails with a lateral displacement (m) and a
    yaw (rad).
    """
    equations = equations_class(engine)(wheelset, speed, creep_law, cell_count)
    state = equations.displaced_state(lateral_shift)
    state[YAW] = yaw
    return equations, state


def equations_and_start(scene: WheelsetScene, engine: str, speed: float) -> tuple[WheelsetEquations, np.ndarray]:
    """Returns the equations of motion at a speed (m/s), and the state (10,) in which the scene's paths begin. Both are
    cached for further paths.
    """
    contact, run = scene.contact, scene.run
    return _equations_and_state(
        engine, wheelset_of(scene), speed, contact.law, contact.cells, run.displacement, run.yaw
    )


def path_speeds(scene: WheelsetScene) -> list[float]:
    """Speeds (m/s) of the simulated motions: those of [run], else 0.9 and 1.1 of the critical speed, or the last of
    [speeds] where there is no critical speed.
    """
    if scene.run.speeds:
        return list(scene.run.speeds)
    critical, _ = critical_speed_or_reason(wheelset_of(scene))
    return [round(share * critical, 2) for share in SPEED_SHARES] if critical else [float(scene.speeds.all()[-1])]
