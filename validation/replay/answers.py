"""Outputs of a job's commands: exit codes, messages, every array that they save or print; saved, and compared."""

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
"""Time (s) after which a running command is stopped."""
MESSAGE_MASKS = (
    (r"\d+(\.\d+)?(e[-+]\d+)? (s|ms|us)\b( once)?", "SECONDS"),
    (r"/[\w./-]*/", "PATH/"),
    (r"[\d.]+ times (as long|the)", "RATIO"),
)
"""Patterns of machine-dependent text in messages, and the words that replace it."""
JOBS_FILE = "jobs.json"
UNWATCHED_KEYS = ("seconds", "folder", "command", "price", "range")
"""Machine-dependent keys of printed tables and names of columns, which are not compared."""


@dataclass
class CommandOutput:
    """Output of a job's commands: exit codes, messages, seconds, and arrays by "file: channel"; channels of printed
    tables have no file name."""

    codes: list[int]
    message: str
    seconds: float
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


def output_of_job(replay_job: ReplayJob, executable: str, work_folder: Path) -> CommandOutput:
    """Output of a job's commands, which run in a new folder that is deleted afterwards."""
    shutil.rmtree(work_folder, ignore_errors=True)
    work_folder.mkdir(parents=True)
    for file in BASE_SCENES.glob("*.[!t]*"):
        shutil.copy(file, work_folder)
    (work_folder / "scene.toml").write_text(replay_job.scene)
    input_files = {path.name for path in work_folder.iterdir()}
    job_answer = CommandOutput([], "", 0.0)
    for words in replay_job.commands:
        _run_command([executable, *words], work_folder, job_answer)
    job_answer.arrays |= dict(_arrays_of_files(work_folder, input_files))
    shutil.rmtree(work_folder)
    return job_answer


def _run_command(command_words: list[str], work_folder: Path, job_output: CommandOutput) -> None:
    """Run one command, and add its exit code, message and printed tables to the job's output."""
    start_time = time.monotonic()
    code, printed_output, wrong = _process_output(command_words, work_folder)
    job_output.seconds += time.monotonic() - start_time
    printed = _parsed_json(printed_output)
    if printed is not None:
        job_output.arrays |= {
            f": {len(job_output.codes)}{path_in_table}": np.array(value)
            for path_in_table, value in _values_with_paths(printed)
        }
        printed_output = ""
    job_output.codes.append(code)
    job_output.message += _masked_message(printed_output + wrong)


def _process_output(command_words: list[str], work_folder: Path) -> tuple[int, str, str]:
    surroundings = os.environ | {"COLUMNS": "200", "NO_COLOR": "1", "MPLBACKEND": "agg"}
    try:
        completed_process = subprocess.run(
            command_words,
            cwd=work_folder,
            env=surroundings,
            capture_output=True,
            text=True,
            timeout=COMMAND_SECONDS,
            check=False,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return -1, "", f"ended after {COMMAND_SECONDS:g} s"
    return completed_process.returncode, completed_process.stdout, completed_process.stderr


def _parsed_json(printed_text: str) -> Any:
    try:
        return json.loads(printed_text)
    except ValueError:
        return None


def _values_with_paths(nested_value: Any, path_in_table: str = "") -> Iterator[tuple[str, float | str]]:
    """Yield the numbers and texts of a nested table, each with its path (keys joined by /) in the table."""
    if isinstance(nested_value, dict | list):
        for key, inner in nested_value.items() if isinstance(nested_value, dict) else enumerate(nested_value):
            if key not in UNWATCHED_KEYS:
                yield from _values_with_paths(inner, f"{path_in_table}/{key}")
    elif isinstance(nested_value, bool | int | float):
        yield path_in_table, float(nested_value)
    elif nested_value is not None:
        yield path_in_table, _masked_message(str(nested_value))


def _masked_message(message_text: str) -> str:
    for pattern, mask in MESSAGE_MASKS:
        message_text = re.sub(pattern, mask, message_text)
    return message_text


def _arrays_of_files(work_folder: Path, input_file_names: set[str]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name ("file: channel") and values of each array in the files that a job's commands wrote into the
    folder."""
    for path in sorted(work_folder.rglob("*")):
        read = {".nc": _netcdf_channels, ".csv": _csv_columns}.get(path.suffix)
        if read is not None and path.name not in input_file_names:
            yield from ((f"{path.relative_to(work_folder)}: {name}", array) for name, array in read(path))


def _netcdf_channels(file_path: Path) -> Iterator[tuple[str, np.ndarray]]:
    import h5py

    with h5py.File(file_path) as file:
        sets: dict[str, np.ndarray] = {}
        file.visititems(lambda name, item: sets.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    for name, values in sets.items():
        array = np.asarray(values)
        yield name, array if array.dtype.kind in "fiub" else array.astype(str)


def _csv_columns(file_path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and values of each column of a CSV file, whose first line holds the names."""
    with file_path.open(newline="") as file:
        lines = [line for line in csv.reader(file) if line]
    if lines:
        for name, *cells in zip(*[line + [""] * (len(lines[0]) - len(line)) for line in lines], strict=False):
            yield name, _column_values(cells)


def _column_values(cell_texts: list[str]) -> np.ndarray:
    try:
        return np.array([float(cell) for cell in cell_texts])
    except ValueError:
        return np.array([_masked_message(cell) for cell in cell_texts])


def write_jobs(recording_folder: Path, replay_jobs: list[ReplayJob]) -> None:
    """Save the jobs in the folder of a recording, so that a later version runs the same jobs."""
    (recording_folder / JOBS_FILE).write_text(json.dumps([asdict(job) for job in replay_jobs], indent=1))


def read_jobs(recording_folder: Path) -> list[ReplayJob]:
    """The jobs that are saved in the folder of a recording."""
    return [
        ReplayJob(job_table["name"], tuple(map(tuple, job_table["commands"])), job_table["scene"])
        for job_table in json.loads((recording_folder / JOBS_FILE).read_text())
    ]


def save_output(recording_folder: Path, job_name: str, job_output: CommandOutput) -> None:
    """Save the output of a job; its summary file is written last, as a mark that the output is complete."""
    arrays = {str(i): array for i, array in enumerate(job_output.arrays.values())}
    np.savez_compressed(recording_folder / f"{job_name}.npz", allow_pickle=False, **arrays)
    note = {
        "codes": job_output.codes,
        "message": job_output.message,
        "seconds": job_output.seconds,
        "arrays": list(job_output.arrays),
    }
    (recording_folder / f"{job_name}.json").write_text(json.dumps(note, indent=1))


def load_output(recording_folder: Path, job_name: str) -> CommandOutput | None:
    """The saved output of a job; None if it is missing or incomplete."""
    try:
        note = json.loads((recording_folder / f"{job_name}.json").read_text())
        with np.load(recording_folder / f"{job_name}.npz") as file:
            arrays = {key: file[str(i)] for i, key in enumerate(note["arrays"])}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None
    return CommandOutput(note["codes"], note["message"], note["seconds"], arrays)


@dataclass
class OutputDifference:
    """Differences between two outputs of a job, as sentences: those in ``wrong`` fail a replay, those in ``tolerated``
    (messages, new channels) are only reported."""

    wrong: list[str] = field(default_factory=list)
    tolerated: list[str] = field(default_factory=list)


def output_difference(
    recorded_output: CommandOutput,
    current_output: CommandOutput,
    relative_bound: float,
    renamed_channels: Mapping[str, str],
) -> OutputDifference:
    """Differences of a job's output from the recorded output.

    relative_bound : largest change of a number by the largest one of its channel; 0 asks for the same bits.
    renamed_channels : earlier names of channels to later ones; a channel that is in another file now is looked for by
    its name.
    """
    difference = OutputDifference()
    if recorded_output.codes != current_output.codes:
        difference.wrong.append(
            f"exit codes {recorded_output.codes} are {current_output.codes}: {current_output.message.strip()[-200:]}"
        )
    if recorded_output.message != current_output.message:
        difference.tolerated.append(
            f"message {recorded_output.message.strip()[:200]!r} is {current_output.message.strip()[:200]!r}"
        )
    matched = set()
    for name, array in recorded_output.arrays.items():
        if not {*re.split(r"[:/ ]+", name)}.isdisjoint(UNWATCHED_KEYS):
            continue
        if (later := _renamed_channel(name, current_output.arrays, renamed_channels)) is None:
            difference.wrong.append(f"{name} is gone")
            continue
        matched.add(later)
        if text := _change_text(array, current_output.arrays[later], relative_bound):
            (difference.tolerated if array.dtype.kind == "U" else difference.wrong).append(f"{name}: {text}")
    difference.tolerated += [f"{name} is new" for name in current_output.arrays if name not in matched]
    return difference


def _renamed_channel(
    recorded_name: str, later_arrays: Mapping[str, np.ndarray], renamed_channels: Mapping[str, str]
) -> str | None:
    """Name of a recorded channel in later arrays: unchanged, renamed, or in another file if only one file has this
    channel; None if it is missing."""
    if (name_then := renamed_channels.get(recorded_name, recorded_name)) in later_arrays:
        return name_then
    channel = name_then.partition(": ")[2]
    other_names = [other_name for other_name in later_arrays if other_name.partition(": ")[2] == channel]
    return other_names[0] if len(other_names) == 1 else None


def _change_text(recorded_values: np.ndarray, current_values: np.ndarray, relative_bound: float) -> str:
    """Sentence part on how an array changed; "" if no change exceeds the bound, relative to its largest number."""
    if (
        recorded_values.dtype.kind == current_values.dtype.kind == "U"
        and recorded_values.size == current_values.size == 1
    ):
        return "" if recorded_values == current_values else f"{recorded_values} is {current_values}"
    if recorded_values.shape != current_values.shape or recorded_values.dtype != current_values.dtype:
        return f"{recorded_values.dtype} {recorded_values.shape} is {current_values.dtype} {current_values.shape}"
    if recorded_values.tobytes() == current_values.tobytes():
        return ""
    if recorded_values.dtype.kind != "f" or not relative_bound:
        return "other values" if recorded_values.size > 1 else f"{recorded_values} is {current_values}"
    known = np.isfinite(recorded_values)
    if (
        not np.array_equal(recorded_values[~known], current_values[~known], equal_nan=True)
        or not np.isfinite(current_values[known]).all()
    ):
        return "numbers are finite elsewhere"
    share = abs(recorded_values - current_values)[known].max(initial=0.0) / max(
        abs(recorded_values)[known].max(initial=0.0), 1e-300
    )
    return "" if share <= relative_bound else f"a number changed by {share:.2g} of the largest"
