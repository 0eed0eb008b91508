"""Error messages with the new module name for code that imports an old one."""

import sys
import tomllib
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from pathlib import Path
from types import ModuleType

MOVED_MODULES: dict[str, str] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
"""Old names of modules or packages, with their new names."""


class OldModuleFinder(MetaPathFinder):
    """Import finder that recognises old module names; Python asks it after all other finders."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raise ModuleNotFoundError with the new name of a module if ``name`` is an old one; else do nothing."""
        if name in MOVED_MODULES:
            raise ModuleNotFoundError(f"{name} is now {MOVED_MODULES[name]}: change the import", name=name)


def register_old_module_finder() -> None:
    """Register the finder of old module names, once per process."""
    if not any(isinstance(finder, OldModuleFinder) for finder in sys.meta_path):
        sys.meta_path.append(OldModuleFinder())
