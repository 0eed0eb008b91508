"""The systems that a scene can be of, and where the code of each is."""

from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from models.errors import InputError
from models.scene_file import changed

DEFAULT = "pitch-plane"
"""System of a scene that names none."""


@dataclass(frozen=True)
class System:
    """Modules of one system, and the implementations among which ``--engine`` chooses.

    ``scene`` has build(table, file, folder) -> scene; ``plan`` has check(scene, engines), which refuses what cannot
    be run, and describe(scene) -> text. ``effects`` is the package that holds an effect in every file.
    """

    scene: str
    plan: str
    engines: tuple[str, ...] = ()
    effects: str = ""


SYSTEMS = {
    DEFAULT: System("models.scene", "models.plan", ("reference", "exudyn", "mujoco"), "models.effects"),
    "ride": System("models.ride.scene", "models.ride.plan", ("reference", "exudyn", "mujoco"), "models.ride.effects"),
    "wheelset": System(
        "models.rail.scene", "models.rail.plan", ("reference", "exudyn", "mujoco"), "models.rail.effects"
    ),
    "contact": System("models.contact.scene", "models.contact.plan", effects="models.contact.effects"),
    "handling": System(
        "models.handling.scene", "models.handling.plan", ("exudyn", "mujoco"), "models.handling.effects"
    ),
    "hub-forces": System(
        "models.hub_forces.scene",
        "models.hub_forces.plan",
        ("reference", "exudyn", "mujoco"),
        "models.hub_forces.effects",
    ),
    "braking": System(
        "models.braking.scene", "models.braking.plan", ("reference", "exudyn", "mujoco"), "models.braking.effects"
    ),
    "measured": System(
        "models.measured.scene", "models.measured.plan", ("reference", "exudyn", "mujoco"), "models.measured.effects"
    ),
    "pictures": System("studies.pictures.scene", "studies.pictures.plan", ("exudyn", "mujoco")),
    "wheel-rail": System("models.rail.benchmark_scene", "models.rail.benchmark_plan"),
}


def load(path: Path, changes: Iterable[str] = ()) -> Any:
    """Read a scene file of any system, with ``--set`` changes of the form KEY.KEY=VALUE applied on top."""
    changes = list(changes)
    table = changed(path, changes)
    file = path.name + (" with --set" if changes else "")
    name = table.get("system", DEFAULT)
    if not isinstance(name, str) or name not in SYSTEMS:
        raise InputError(file, "system", name, "no such system", tuple(SYSTEMS))
    return import_module(SYSTEMS[name].scene).build(table, file, path.parent)
