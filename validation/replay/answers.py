"""What the commands of a job answer: exit codes, messages, and every array that they save or print."""

import csv
import json
import os
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from validation.replay.jobs import SCENES, Job

LIMIT = 900.0
"""Seconds after which a command is ended."""
MASKS = (
    (r"\d+(\.\d+)?(e[-+]\d+)? (s|ms|us)\b( once)?", "SECONDS"),
    (r"/[\w./-]*/", "PATH/"),
    (r"[\d.]+ times (as long|the)", "RATIO"),
)
"""What a machine decides in messages, and what stands in its place."""
UNWATCHED = ("seconds", "folder", "command", "price")
"""Keys of printed tables that a machine decides."""


@dataclass
class Answer:
    """Exit codes, message, seconds, arrays by "file: channel"; channels of printed tables belong to no file."""

    codes: list[int]
    message: str
    seconds: float
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


def answer(job: Job, command: str, folder: Path) -> Answer:
    """Run the commands of a job in a new folder, which is gone afterwards."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in SCENES.glob("*.[!t]*"):
        shutil.copy(file, folder)
    (folder / "scene.toml").write_text(job.scene)
    given = {path.name for path in folder.iterdir()}
    now = Answer([], "", 0.0)
    for words in job.commands:
        _ask([command, *words], folder, now)
    now.arrays |= dict(_saved(folder, given))
    shutil.rmtree(folder)
    return now


def _ask(words: list[str], folder: Path, now: Answer) -> None:
    """Run one command, and add what it says."""
    begun = time.monotonic()
    code, said, wrong = _run(words, folder)
    now.seconds += time.monotonic() - begun
    printed = _json(said)
    if printed is not None:
        now.arrays |= {f": {len(now.codes)}{place}": np.array(value) for place, value in _leaves(printed)}
        said = ""
    now.codes.append(code)
    now.message += _masked(said + wrong)


def _run(words: list[str], folder: Path) -> tuple[int, str, str]:
    surroundings = os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "MPLBACKEND": "agg"}
    try:
        done = subprocess.run(
            words,
            cwd=folder,
            env=surroundings,
            capture_output=True,
            text=True,
            timeout=LIMIT,
            check=False,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return -1, "", f"ended after {LIMIT:g} s"
    return done.returncode, done.stdout, done.stderr


def _json(said: str) -> Any:
    try:
        return json.loads(said)
    except ValueError:
        return None


def _leaves(value: Any, place: str = "") -> Iterator[tuple[str, float | str]]:
    """Numbers and texts of a printed table with their places."""
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            if key not in UNWATCHED:
                yield from _leaves(inner, f"{place}/{key}")
    elif isinstance(value, bool | int | float):
        yield place, float(value)
    elif value is not None:
        yield place, _masked(str(value))


def _masked(text: str) -> str:
    for pattern, mask in MASKS:
        text = re.sub(pattern, mask, text)
    return text


def _saved(folder: Path, given: set[str]) -> Iterator[tuple[str, np.ndarray]]:
    """Of all files but those that were given."""
    for path in sorted(folder.rglob("*")):
        read = {".nc": _netcdf, ".csv": _csv}.get(path.suffix)
        if read is not None and path.name not in given:
            yield from ((f"{path.relative_to(folder)}: {name}", array) for name, array in read(path))


def _netcdf(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    with h5py.File(path) as file:
        sets: dict[str, np.ndarray] = {}
        file.visititems(lambda name, each: sets.update({name: each[()]}) if isinstance(each, h5py.Dataset) else None)
    for name, values in sets.items():
        array = np.asarray(values)
        yield name, array if array.dtype.kind in "fiub" else array.astype(str)


def _csv(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Columns of a table with one line of names, as they are written."""
    with path.open(newline="") as file:
        lines = [line for line in csv.reader(file) if line]
    if lines:
        for name, *cells in zip(*[line + [""] * (len(lines[0]) - len(line)) for line in lines], strict=False):
            yield name, _column(cells)


def _column(cells: list[str]) -> np.ndarray:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return np.array([_masked(cell) for cell in cells])
