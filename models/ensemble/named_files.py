"""Files that a scene names, however deep, with their checksums: what a run depends on beside the scene's own keys."""

import hashlib
import os
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any


def named_files(value: Any, folder: Path) -> dict[str, str]:
    """Checksum of each file by the text that names it, from ``folder`` or from where the command runs.

    value : texts, and lists and tables of these. Files that a TOML file names count from its own folder; of code
    named ``file.py:Name`` or ``module:Name`` it is the file, without what that imports.
    """
    found: dict[str, str] = {}
    _collect(value, folder, found, set())
    return found


def _collect(value: Any, folder: Path, found: dict[str, str], seen: set[Path]) -> None:
    if isinstance(value, dict | list | tuple):
        for inner in value.values() if isinstance(value, dict) else value:
            _collect(inner, folder, found, seen)
    elif isinstance(value, str) and (path := _file(value, folder)) and path.resolve() not in seen:
        seen.add(path.resolve())
        content = path.read_bytes()
        found[value] = found.get(value, "") + hashlib.sha256(content).hexdigest()[:16]
        if path.suffix == ".toml":
            _collect(_table(content), path.parent, found, seen)


def _file(text: str, folder: Path) -> Path | None:
    """The file that a text names, if it names one."""
    before, _, _ = text.rpartition(":")
    for path in (folder / text, Path(text), folder / before, Path(before)):
        if text and os.path.isfile(path):
            return path
    return _of_module(before)


def _of_module(name: str) -> Path | None:
    if not name or not all(part.isidentifier() for part in name.split(".")):
        return None
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):
        return None
    return Path(spec.origin) if spec and spec.origin and os.path.isfile(spec.origin) else None


def _table(content: bytes) -> Any:
    """Contents of a TOML file; nothing if it is none, which reading the scene says."""
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except ValueError:
        return None
