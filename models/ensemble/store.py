"""Finished blocks of an ensemble in a folder, with a file that identifies their job."""

import hashlib
import io
import json
import os
import tomllib
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.result import RECORDED_PACKAGES
from models.core.whole_files import remove_partial_files, write_whole

ArraysByName = dict[str, np.ndarray]
"""Arrays by name: the results of a block."""
JOB_FILE = "job.json"
"""Name of the file that identifies the job to which the blocks of a folder belong."""
LOCK_FILE = ".lock"
"""Name of the file that the process working in a folder locks."""


@dataclass(frozen=True)
class BlockStore:
    """Store of finished blocks in ``folder``, one file each; a file is either complete or absent."""

    folder: Path

    @contextmanager
    def reserved_folder(self, job_facts: dict[str, Any]) -> Iterator[None]:
        """Context in which the folder is reserved for this job and process.

        Raises InputError if it belongs to another job, or if another process is at work in it.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with exclusive_folder(self.folder):
            remove_partial_files(self.folder)
            self._write_job(fingerprint(job_facts))
            yield

    def _write_job(self, job_facts: dict[str, Any]) -> None:
        """Write into the folder to which job its blocks belong; raises InputError if the folder belongs to another
        job."""
        file = self.folder / JOB_FILE
        if not file.exists():
            write_whole(file, json.dumps(job_facts, indent=1).encode())
            return
        stored_job = _read_job_file(file)
        for key in (*job_facts, *stored_job):
            if job_facts.get(key) != stored_job.get(key):
                allowed = (
                    f"this folder belongs to another job: {job_facts.get(key)!r} is asked for here; "
                    "resume with what it was "
                    "begun with, or begin in a new folder"
                )
                raise InputError(file, key, stored_job.get(key), allowed)

    def path(self, block_number: int) -> Path:
        """Path of a block's file."""
        return self.folder / f"block {block_number:06d}.npz"

    def has(self, block_number: int) -> bool:
        """Whether a block is finished."""
        return self.path(block_number).exists()

    def save(self, block_number: int, arrays: ArraysByName) -> None:
        """Save a block to disk; its file appears only when it is complete."""
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, **arrays)
        write_whole(self.path(block_number), content.getvalue())

    def load(self, block_number: int) -> ArraysByName:
        """A finished block; raises InputError if its file is damaged (zip checks every byte)."""
        try:
            with np.load(self.path(block_number), allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(self.path(block_number), "", None, f"is damaged ({error}): delete it and resume") from None


@contextmanager
def exclusive_folder(store_folder: Path) -> Iterator[None]:
    """Context with exclusive use of the folder; InputError if another process uses it. The lock ends with its
    process."""
    try:
        from fcntl import LOCK_EX, LOCK_NB, flock
    except ImportError:  # not a system that has such locks
        yield
        return
    with (store_folder / LOCK_FILE).open("a") as file:
        try:
            flock(file, LOCK_EX | LOCK_NB)
        except BlockingIOError:
            allowed = "another process is at work in this folder: wait for it, or begin in a new one"
            raise InputError(store_folder, "", None, allowed) from None
        yield


def _read_job_file(job_file_path: Path) -> dict[str, Any]:
    """Content of a folder's job file; raises InputError if it cannot be read."""
    try:
        note = json.loads(job_file_path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(job_file_path, "", None, f"is not the note of an ensemble: {error}") from None
    return note if isinstance(note, dict) else {}


def fingerprint(job_facts: dict[str, Any]) -> dict[str, Any]:
    """Facts that identify a job: its settings as dotted keys, arrays by their checksum, the code and the package
    versions.

    Bits depend on all of these (and on the processor's own rounding of sines, which is left out).
    """
    versions = {name: version(name) for name in RECORDED_PACKAGES}
    return dict(_flat_items("", {**job_facts, "code of models": _code_checksum(), "versions": versions}))


def _flat_items(key_path: str, job_value: Any) -> list[tuple[str, Any]]:
    """Pairs of dotted key and plain value in nested job settings; arrays are replaced by their checksum."""
    if isinstance(job_value, dict):
        return [
            pair
            for key, inner in job_value.items()
            for pair in _flat_items(f"{key_path}.{key}" if key_path else str(key), inner)
        ]
    if isinstance(job_value, np.ndarray):
        digest = hashlib.sha256(np.ascontiguousarray(job_value).tobytes()).hexdigest()[:16]
        return [(key_path, f"{job_value.dtype} {list(job_value.shape)} {digest}")]
    return [(key_path, list(job_value) if isinstance(job_value, tuple) else job_value)]


@cache
def _code_checksum() -> str:
    """Checksum of all sources of ``models``."""
    return checksum_of_sources(Path(__file__).parents[1])


def checksum_of_sources(source_folder: Path) -> str:
    """Checksum of all files below a folder on which a run can depend: sources, parameters, tables."""
    digest = hashlib.sha256()
    for path in sorted(path for path in source_folder.rglob("*") if path.suffix in (".py", ".toml", ".csv", ".dat")):
        digest.update(path.relative_to(source_folder).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:16]


def named_files(job_value: Any, base_folder: Path) -> dict[str, str]:
    """Checksum of each file that a text in a job names, by that text; paths start from ``base_folder`` or from the
    working folder.

    job_value : texts, and lists and tables of these. Files that a TOML file names count from its own folder; of code
    named ``file.py:Name`` or ``module:Name`` it is the file, without what that imports.
    """
    hashes: dict[str, str] = {}
    _collect_files(job_value, base_folder, hashes, set())
    return hashes


def _collect_files(job_value: Any, base_folder: Path, checksums: dict[str, str], paths_seen: set[Path]) -> None:
    """Add the checksums of all files named in a job's values to ``checksums``."""
    if isinstance(job_value, dict | list | tuple):
        for inner in job_value.values() if isinstance(job_value, dict) else job_value:
            _collect_files(inner, base_folder, checksums, paths_seen)
    elif (
        isinstance(job_value, str)
        and (path := _named_file(job_value, base_folder))
        and path.resolve() not in paths_seen
    ):
        paths_seen.add(path.resolve())
        content = path.read_bytes()
        checksums[job_value] = checksums.get(job_value, "") + hashlib.sha256(content).hexdigest()[:16]
        if path.suffix == ".toml":
            _collect_files(_toml_content(content), path.parent, checksums, paths_seen)


def _named_file(file_text: str, base_folder: Path) -> Path | None:
    """Path of the file that a text names, or None."""
    text_before_colon, _, _ = file_text.rpartition(":")
    for path in (base_folder / file_text, Path(file_text), base_folder / text_before_colon, Path(text_before_colon)):
        if file_text and os.path.isfile(path):
            return path
    return _module_file(text_before_colon)


def _module_file(module_name: str) -> Path | None:
    """Path of a Python module's source, or None."""
    if not module_name or not all(name_part.isidentifier() for name_part in module_name.split(".")):
        return None
    try:
        spec = find_spec(module_name)
    except (ImportError, ValueError):
        return None
    return Path(spec.origin) if spec and spec.origin and os.path.isfile(spec.origin) else None


def _toml_content(file_content: bytes) -> Any:
    """Content of a TOML file; None if it is not valid, which is reported when the scene is read."""
    try:
        return tomllib.loads(file_content.decode("utf-8-sig"))
    except ValueError:
        return None
