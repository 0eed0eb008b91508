"""Names of modules that have moved: who imports an old one is told the new one."""

import sys
import tomllib
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from pathlib import Path
from types import ModuleType

MOVED_MODULES: dict[str, str] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
"""Old names, of modules or of whole packages, and where their content is now."""


class OldModuleFinder(MetaPathFinder):
    """Import finder that recognises old module names; Python asks it after all other finders."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raise ModuleNotFoundError with the new name for an old one."""
        if name in MOVED_MODULES:
            raise ModuleNotFoundError(f"{name} is now {MOVED_MODULES[name]}: change the import", name=name)


def tell_new_names() -> None:
    """Register the finder of old module names, once per process."""
    if not any(isinstance(finder, OldModuleFinder) for finder in sys.meta_path):
        sys.meta_path.append(OldModuleFinder())
