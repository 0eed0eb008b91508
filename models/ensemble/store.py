"""Finished blocks of an ensemble in a folder, and the note beside them that says whose they are."""

import hashlib
import io
import json
import os
import zipfile
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from models.errors import InputError
from models.result import PACKAGES

Arrays = dict[str, np.ndarray]
JOB = "job.json"
"""What the blocks of a folder belong to."""


@dataclass(frozen=True)
class Store:
    """Blocks in ``folder``, one file each, written whole or not at all."""

    folder: Path

    def claim(self, facts: dict[str, Any]) -> None:
        """Note down whose blocks these are; raises InputError if the folder belongs to another job."""
        own, file = fingerprint(facts), self.folder / JOB
        self.folder.mkdir(parents=True, exist_ok=True)
        if not file.exists():
            _write(file, json.dumps(own, indent=1).encode())
            return
        kept = _read_note(file)
        for key in (*own, *kept):
            if own.get(key) != kept.get(key):
                raise InputError(file, key, kept.get(key), f"this folder belongs to another job: {own.get(key)!r} is "
                                 "asked for here; resume with what it was begun with, or begin in a new folder")

    def path(self, block: int) -> Path:
        """File of a block."""
        return self.folder / f"block {block:06d}.npz"

    def has(self, block: int) -> bool:
        """Whether a block is finished."""
        return self.path(block).exists()

    def save(self, block: int, arrays: Arrays) -> None:
        """Keep a block: on the disk, under its name, or not there."""
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, **arrays)
        _write(self.path(block), content.getvalue())

    def load(self, block: int) -> Arrays:
        """A finished block; raises InputError if its file is damaged (zip checks every byte)."""
        try:
            with np.load(self.path(block), allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(self.path(block), "", None, f"is damaged ({error}): delete it and resume") from None


def _write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all, even if the machine stops."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def _read_note(file: Path) -> dict[str, Any]:
    try:
        kept = json.loads(file.read_text())
    except (OSError, ValueError) as error:
        raise InputError(file, "", None, f"is not the note of an ensemble: {error}") from None
    return kept if isinstance(kept, dict) else {}


def fingerprint(facts: dict[str, Any]) -> dict[str, Any]:
    """What names a job: its facts as dotted keys, arrays by their checksum, the code and the packages.

    Bits depend on all of these (and on the processor's own rounding of sines, which is left out).
    """
    versions = {name: version(name) for name in PACKAGES}
    return dict(_flat("", {**facts, "code of models": _code(), "versions": versions}))


def _flat(place: str, value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        return [pair for key, inner in value.items() for pair in _flat(f"{place}.{key}" if place else str(key), inner)]
    if isinstance(value, np.ndarray):
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()[:16]
        return [(place, f"{value.dtype} {list(value.shape)} {digest}")]
    return [(place, list(value) if isinstance(value, tuple) else value)]


@cache
def _code() -> str:
    """Checksum of every source file of ``models``."""
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]
