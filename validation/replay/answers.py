"""Answers of a job's commands: exit codes, messages, every array that they save or print; kept, and compared."""

import csv
import json
import os
import re
import shutil
import subprocess
import time
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from validation.replay.jobs import BASE_SCENES, ReplayJob

COMMAND_SECONDS = 900.0
"""Seconds after which a command is ended."""
MESSAGE_MASKS = (
    (r"\d+(\.\d+)?(e[-+]\d+)? (s|ms|us)\b( once)?", "SECONDS"),
    (r"/[\w./-]*/", "PATH/"),
    (r"[\d.]+ times (as long|the)", "RATIO"),
)
"""What a machine decides in messages, and what stands in its place."""
JOBS_FILE = "jobs.json"
UNWATCHED_KEYS = ("seconds", "folder", "command", "price", "range")
"""Keys of printed tables, and columns, that a machine decides."""


@dataclass
class CommandAnswer:
    """Recorded result of a job: exit codes, messages, seconds, and arrays by "file: channel"; channels of printed
    tables have no file name."""

    codes: list[int]
    message: str
    seconds: float
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


def answer_of_job(job: ReplayJob, command: str, folder: Path) -> CommandAnswer:
    """Run the commands of a job in a new folder that is deleted afterwards."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for file in BASE_SCENES.glob("*.[!t]*"):
        shutil.copy(file, folder)
    (folder / "scene.toml").write_text(job.scene)
    given = {path.name for path in folder.iterdir()}
    now = CommandAnswer([], "", 0.0)
    for words in job.commands:
        _run_command([command, *words], folder, now)
    now.arrays |= dict(_arrays_of_files(folder, given))
    shutil.rmtree(folder)
    return now


def _run_command(words: list[str], folder: Path, answer: CommandAnswer) -> None:
    """Run one command, and add its exit code, message and printed tables to the answer."""
    begun = time.monotonic()
    code, said, wrong = _run(words, folder)
    answer.seconds += time.monotonic() - begun
    printed = _parsed_json(said)
    if printed is not None:
        answer.arrays |= {
            f": {len(answer.codes)}{place}": np.array(value) for place, value in _values_with_places(printed)
        }
        said = ""
    answer.codes.append(code)
    answer.message += _masked_message(said + wrong)


def _run(words: list[str], folder: Path) -> tuple[int, str, str]:
    surroundings = os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "MPLBACKEND": "agg"}
    try:
        done = subprocess.run(
            words,
            cwd=folder,
            env=surroundings,
            capture_output=True,
            text=True,
            timeout=COMMAND_SECONDS,
            check=False,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return -1, "", f"ended after {COMMAND_SECONDS:g} s"
    return done.returncode, done.stdout, done.stderr


def _parsed_json(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return None


def _values_with_places(value: Any, place: str = "") -> Iterator[tuple[str, float | str]]:
    """Numbers and texts of a nested table, each with its place in the table."""
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            if key not in UNWATCHED_KEYS:
                yield from _values_with_places(inner, f"{place}/{key}")
    elif isinstance(value, bool | int | float):
        yield place, float(value)
    elif value is not None:
        yield place, _masked_message(str(value))


def _masked_message(text: str) -> str:
    for pattern, mask in MESSAGE_MASKS:
        text = re.sub(pattern, mask, text)
    return text


def _arrays_of_files(folder: Path, given_files: set[str]) -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of all files in the folder, except files that were there before."""
    for path in sorted(folder.rglob("*")):
        read = {".nc": _netcdf_channels, ".csv": _csv_columns}.get(path.suffix)
        if read is not None and path.name not in given_files:
            yield from ((f"{path.relative_to(folder)}: {name}", array) for name, array in read(path))


def _netcdf_channels(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    with h5py.File(path) as file:
        sets: dict[str, np.ndarray] = {}
        file.visititems(lambda name, each: sets.update({name: each[()]}) if isinstance(each, h5py.Dataset) else None)
    for name, values in sets.items():
        array = np.asarray(values)
        yield name, array if array.dtype.kind in "fiub" else array.astype(str)


def _csv_columns(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and values of each column of a CSV file, whose first line holds the names."""
    with path.open(newline="") as file:
        lines = [line for line in csv.reader(file) if line]
    if lines:
        for name, *cells in zip(*[line + [""] * (len(lines[0]) - len(line)) for line in lines], strict=False):
            yield name, _column_values(cells)


def _column_values(cells: list[str]) -> np.ndarray:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return np.array([_masked_message(cell) for cell in cells])


def write_jobs(folder: Path, jobs: list[ReplayJob]) -> None:
    """Save the jobs in the recording, so that a later version runs the same ones."""
    (folder / JOBS_FILE).write_text(json.dumps([asdict(job) for job in jobs], indent=1))


def read_jobs(folder: Path) -> list[ReplayJob]:
    """The jobs that are saved in a recording."""
    return [
        ReplayJob(each["name"], tuple(map(tuple, each["commands"])), each["scene"])
        for each in json.loads((folder / JOBS_FILE).read_text())
    ]


def save(folder: Path, name: str, answer: CommandAnswer) -> None:
    """Save an answer; its summary is written last, as a mark that it is complete."""
    arrays = {str(i): array for i, array in enumerate(answer.arrays.values())}
    np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **arrays)
    note = {"codes": answer.codes, "message": answer.message, "seconds": answer.seconds, "arrays": list(answer.arrays)}
    (folder / f"{name}.json").write_text(json.dumps(note, indent=1))


def load(folder: Path, name: str) -> CommandAnswer | None:
    """A saved answer; None if it is missing or incomplete."""
    try:
        note = json.loads((folder / f"{name}.json").read_text())
        with np.load(folder / f"{name}.npz") as file:
            arrays = {key: file[str(i)] for i, key in enumerate(note["arrays"])}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None
    return CommandAnswer(note["codes"], note["message"], note["seconds"], arrays)


@dataclass
class AnswerDifference:
    """Differences between two answers, as sentences: those in ``wrong`` fail a replay, those in ``tolerated``
    (messages, new channels) are reported only."""

    wrong: list[str] = field(default_factory=list)
    tolerated: list[str] = field(default_factory=list)


def answer_difference(
    recorded: CommandAnswer, current: CommandAnswer, bound: float, renamed: Mapping[str, str]
) -> AnswerDifference:
    """Differences of an answer from the recorded one.

    bound : largest change of a number by the largest one of its channel; 0 asks for the same bits. renamed : earlier
    names of channels to later ones; a channel that is in another file now is looked for by its name.
    """
    told = AnswerDifference()
    if recorded.codes != current.codes:
        told.wrong.append(f"exit codes {recorded.codes} are {current.codes}: {current.message.strip()[-200:]}")
    if recorded.message != current.message:
        told.tolerated.append(f"message {recorded.message.strip()[:200]!r} is {current.message.strip()[:200]!r}")
    matched = set()
    for name, array in recorded.arrays.items():
        if not {*re.split(r"[:/ ]+", name)}.isdisjoint(UNWATCHED_KEYS):
            continue
        if (later := _renamed_channel(name, current.arrays, renamed)) is None:
            told.wrong.append(f"{name} is gone")
            continue
        matched.add(later)
        if text := _change_text(array, current.arrays[later], bound):
            (told.tolerated if array.dtype.kind == "U" else told.wrong).append(f"{name}: {text}")
    told.tolerated += [f"{name} is new" for name in current.arrays if name not in matched]
    return told


def _renamed_channel(name: str, arrays: Mapping[str, np.ndarray], renamed: Mapping[str, str]) -> str | None:
    """Name under which a channel occurs in later arrays: unchanged, renamed, or in another file if that is the only one
    with this channel."""
    if (name_then := renamed.get(name, name)) in arrays:
        return name_then
    channel = name_then.partition(": ")[2]
    others = [other for other in arrays if other.partition(": ")[2] == channel]
    return others[0] if len(others) == 1 else None


def _change_text(recorded: np.ndarray, current: np.ndarray, bound: float) -> str:
    """Text on how an array changed; "" if no change exceeds the bound."""
    if recorded.dtype.kind == current.dtype.kind == "U" and recorded.size == current.size == 1:
        return "" if recorded == current else f"{recorded} is {current}"
    if recorded.shape != current.shape or recorded.dtype != current.dtype:
        return f"{recorded.dtype} {recorded.shape} is {current.dtype} {current.shape}"
    if recorded.tobytes() == current.tobytes():
        return ""
    if recorded.dtype.kind != "f" or not bound:
        return "other values" if recorded.size > 1 else f"{recorded} is {current}"
    known = np.isfinite(recorded)
    if not np.array_equal(recorded[~known], current[~known], equal_nan=True) or not np.isfinite(current[known]).all():
        return "numbers are finite elsewhere"
    share = abs(recorded - current)[known].max(initial=0.0) / max(abs(recorded)[known].max(initial=0.0), 1e-300)
    return "" if share <= bound else f"a number changed by {share:.2g} of the largest"
