"""Systems (kinds of scenes, such as wheelset or braking): the folders of ``models/systems``, listed automatically.

A system's folder is a package with

- ``ENGINES`` in its ``__init__``: the implementations among which ``--engine`` chooses, none if no engine computes it;
  ``ON_REQUEST`` beside it, if there are any that are so slow that they run only where they are named;
- ``scene``: ``build(table, file, folder)``, the checked scene of nested tables;
- ``plan``: ``check(scene, engines)``, which refuses what cannot be run, and ``describe(scene)``, the plan as text;
- ``effects``: a package that holds effects, where scenes of the system may name any.

Its name in scenes is that of its folder, with a hyphen for each underscore.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from models.core.errors import InputError

DEFAULT_SYSTEM = "pitch-plane"
"""System of a scene that does not name its system."""


@dataclass(frozen=True)
class System:
    """One system (kind of scene), identified by the name of its package and its folder."""

    package: str
    folder: Path

    @property
    def scene(self) -> str:
        """Module that defines the scenes of this system."""
        return f"{self.package}.scene"

    @property
    def plan(self) -> str:
        """Module that checks and describes the scenes of this system."""
        return f"{self.package}.plan"

    @property
    def effects(self) -> str:
        """Package of the system's effects; "" if its scenes have none."""
        return f"{self.package}.effects" if (self.folder / "effects").is_dir() else ""

    @property
    def engines(self) -> tuple[str, ...]:
        """Implementations among which ``--engine`` chooses."""
        engines: tuple[str, ...] = import_module(self.package).ENGINES
        return engines

    @property
    def on_request(self) -> tuple[str, ...]:
        """Further implementations that run only if ``--engine`` names them, not with all."""
        engines: tuple[str, ...] = getattr(import_module(self.package), "ON_REQUEST", ())
        return engines


def systems_in_folder(systems_folder: Path, package_name: str) -> dict[str, System]:
    """Systems by their names: all subpackages of ``systems_folder`` (of the package ``package_name``) that have
    scenes."""
    system_folders = sorted(path.parent for path in systems_folder.glob("*/scene.py"))
    systems = {
        system_folder.name.replace("_", "-"): System(f"{package_name}.{system_folder.name}", system_folder)
        for system_folder in system_folders
    }
    return dict(sorted(systems.items(), key=lambda entry: entry[0] != DEFAULT_SYSTEM))


SYSTEMS = systems_in_folder(Path(__file__).parents[1] / "systems", "models.systems")
"""All systems of this project, by their names in scenes."""


def modules_of(package_name: str) -> dict[str, str]:
    """Full names of the modules in a package, by system name, without importing them."""
    names = [module.name for module in iter_modules(import_module(package_name).__path__)]
    return {name.replace("_", "-"): f"{package_name}.{name}" for name in names}


def load(scene_path: Path, changes: Iterable[str] = (), known_systems: Mapping[str, System] = SYSTEMS) -> Any:
    """The scene in a file of any system, with ``--set`` changes of the form KEY.KEY=VALUE applied on top."""
    from models.core.scene_file import changed_tables

    changes = list(changes)
    file = scene_path.name + (" with --set" if changes else "")
    return scene_of_table(changed_tables(scene_path, changes), file, scene_path.parent, known_systems)


def scene_of_table(
    scene_table: Mapping[str, Any], scene_path: str, scene_folder: Path, known_systems: Mapping[str, System] = SYSTEMS
) -> Any:
    """The checked scene of any system, built from nested tables. ``scene_path`` is named in messages; ``scene_folder``
    holds the files that the scene names."""
    name = scene_table.get("system", DEFAULT_SYSTEM)
    if not isinstance(name, str) or name not in known_systems:
        raise InputError(scene_path, "system", name, "no such system", tuple(known_systems))
    return import_module(known_systems[name].scene).build(scene_table, scene_path, scene_folder)
