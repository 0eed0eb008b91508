"""Measurement files in four formats: written data are read back unchanged, by twinrig block by block and by each
format's own library."""

import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.noise import normal_samples
from models.fatigue.damage import pseudo_damage
from models.measured.channel import MeasurementSource
from models.measured.formats import open_source, write
from models.measured.formats.writing import ChannelGroup
from validation.common.rows import Observed, Row, System, Table, behaviour_row, not_run
from validation.measured.measured_files import csv_forms, kinds
from validation.measured.measured_files.odd import OddFile, read_channels
from validation.measured.measured_files.own_libraries import LIBRARIES

TITLE = "Measurement files"
SYSTEM: System = "measured"
SEED = 41
SINGLE_PRECISION = 2.0**-24
"""Relative rounding error of 32-bit floating-point numbers."""
RELATIVE_RESOLUTION = {".csv": 0.0, ".mf4": 0.0, ".rsp": SINGLE_PRECISION, ".tdms": 0.0}
"""Largest relative change of a value that is written and read, by format."""
FORMAT_NAMES = {".csv": "CSV", ".mf4": "MDF 4", ".rsp": "RPC III", ".tdms": "TDMS"}
MEASUREMENT_START = datetime(2026, 11, 21, 8, 0, 0, 123456, tzinfo=timezone(timedelta(hours=1)))
FILE_COMMENT = "Prüfgelände, Runde 3 <nass>\nFahrer & Beifahrer"
CHANNEL_NAMES = ("Kraft vorn links, Fz", "Größe µ", "a [x]")
CHANNEL_UNITS = ("kN", "°", "m/s^2")
CHANNEL_COMMENTS = ('Rad 1: "neu"', "", "zweite Zeile\nfolgt")
SAMPLE_COUNT, SAMPLE_PERIOD, SAMPLES_PER_BLOCK = 5000, 1e-3, 1234
"""Number of samples, sampling period (s), and samples in a block that is read."""


def written_values() -> np.ndarray:
    """Values (SAMPLE_COUNT, 3) of widely different sizes, with a gap."""
    values = normal_samples(SEED, 0, SAMPLE_COUNT, 3) * np.array([1e3, 1e-6, 1.0])
    values[100:200, 1] = np.nan
    return values


def write_in_blocks(file_path: Path, measured_values: np.ndarray) -> Path:
    """Write the values to a file in blocks of 700 samples; returns the file's path."""
    blocks = (measured_values[i : i + 700] for i in range(0, len(measured_values), 700))
    return write(
        file_path,
        [ChannelGroup(CHANNEL_NAMES, CHANNEL_UNITS, CHANNEL_COMMENTS, SAMPLE_PERIOD, len(measured_values), blocks)],
        MEASUREMENT_START,
        FILE_COMMENT,
    )


def largest_relative_difference(read_values: np.ndarray, true_values: np.ndarray) -> float:
    """Largest relative difference of the values from the true ones; infinite if other values are missing than should
    be."""
    if not np.array_equal(np.isnan(read_values), np.isnan(true_values)):
        return float("inf")
    return float(np.nanmax(np.abs(read_values - true_values) / np.abs(true_values)))


def preserved_metadata(measurement_source: MeasurementSource) -> dict[str, bool]:
    """Whether names, units, comments and start time are read back as they were written, and nothing else was
    reported."""
    return {
        "names": tuple(channel.name for channel in measurement_source.channels) == CHANNEL_NAMES,
        "units": tuple(channel.unit for channel in measurement_source.channels) == CHANNEL_UNITS,
        "comments": tuple(channel.comment for channel in measurement_source.channels) == CHANNEL_COMMENTS
        and measurement_source.comment == FILE_COMMENT,
        "start": measurement_source.start == MEASUREMENT_START,
        "quiet": measurement_source.findings == (),
    }


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of round trips through each format, of two sampling rates in one file, and of the choice of number format; a
    full run also measures memory."""
    rows: list[Row] = []
    lines: list[dict[str, Any]] = []
    with TemporaryDirectory() as name:
        for extension in FORMAT_NAMES:
            format_rows, line = round_trip_rows(Path(name) / f"trip{extension}", extension)
            rows += format_rows
            lines.append(line)
        rows += [two_sampling_rates_row(Path(name) / f"rates{extension}", extension) for extension in (".mf4", ".tdms")]
        rows += sample_resolution_rows(Path(name))
        rows += file_form_rows(Path(name))
        if not quick:
            rows += [
                row
                for extension in (".mf4", ".rsp", ".tdms")
                for row in peak_memory_rows(Path(name) / f"long{extension}", extension)
            ]
    return rows, {"formats": lines}


def round_trip_rows(file_path: Path, file_extension: str) -> tuple[list[Row], dict[str, Any]]:
    """Rows and data: a file is written, read back block by block, and read with the format's own library."""
    truth, form = written_values(), FORMAT_NAMES[file_extension]
    began = time.perf_counter()
    source = open_source(write_in_blocks(file_path, truth))
    blocks = list(source.blocks(CHANNEL_NAMES, SAMPLES_PER_BLOCK))
    seconds = time.perf_counter() - began
    values, times = (np.concatenate([getattr(block, key) for block in blocks]) for key in ("values", "times"))
    library, reading = LIBRARIES[file_extension]
    foreign = reading(file_path)
    same = [foreign.get(name, (None, ""))[1] for name in CHANNEL_NAMES] == list(CHANNEL_UNITS)
    there = np.column_stack([foreign[name][0] for name in CHANNEL_NAMES]) if same else np.full_like(truth, np.inf)
    error, off, by_library = (
        largest_relative_difference(values, truth),
        float(np.abs(times - SAMPLE_PERIOD * np.arange(SAMPLE_COUNT)).max()),
        largest_relative_difference(there, truth),
    )
    lost = ", ".join(what for what, good in preserved_metadata(source).items() if not good)
    key, why = f"measured_formats.{file_extension[1:]}", "what the format can hold; every bit where it is 0"
    return [
        Observed(
            f"{key}.values",
            SYSTEM,
            f"{form}: largest change of values that are written and read by block",
            error,
            "of the value",
        ).at_most(RELATIVE_RESOLUTION[file_extension], why, "closed form"),
        Observed(
            f"{key}.times", SYSTEM, f"{form}: largest change of times that are written and read", off, "s"
        ).at_most(1e-12, "a thousand millionth of a period; CSV writes times with 15 digits", "closed form"),
        behaviour_row(
            f"{key}.texts",
            SYSTEM,
            f"{form}: names with umlauts, units, comments of two lines and the start survive writing and reading",
            f"lost: {lost}" if lost else "kept",
            "kept",
            "a file without them cannot be mapped by anybody else",
        ),
        Observed(
            f"{key}.library",
            SYSTEM,
            f"{form}: difference of the values from those that {library} reads",
            by_library,
            "of the value",
        ).at_most(RELATIVE_RESOLUTION[file_extension], f"{why}; names and units are compared, too", "native"),
    ], {
        "format": form,
        "library": library,
        "size": file_path.stat().st_size,
        "values": error,
        "times": off,
        "own": by_library,
        "rate": SAMPLE_COUNT * len(CHANNEL_NAMES) / seconds,
    }


def two_sampling_rates_row(file_path: Path, file_extension: str) -> Row:
    """Row: largest change of times and values of two groups with different sampling rates, written to one file and read
    back."""
    values = {("fast",): (1e-3, np.arange(4000.0)), ("slow",): (2e-2, np.arange(200.0) ** 2)}
    write(
        file_path,
        [
            ChannelGroup(names, ("N",), ("",), period, len(values_of), [values_of[:, None]])
            for names, (period, values_of) in values.items()
        ],
    )
    channels = read_channels(open_source(file_path))
    errors = [
        np.abs(channels[name][k] - truth).max()
        for (name,), (period, values_of) in values.items()
        for k, truth in ((0, period * np.arange(len(values_of))), (1, values_of))
    ]
    return Observed(
        f"measured_formats.{file_extension[1:]}.rates",
        SYSTEM,
        f"{FORMAT_NAMES[file_extension]}: change of times and values of two groups, 1 kHz and 50 Hz, written and read",
        max(errors),
        "s or N",
    ).at_most(1e-12, "each group has a clock of its own", "closed form")


def file_form_rows(work_folder: Path) -> list[Row]:
    """Rows: CSV files in the forms that loggers, spreadsheets and scripts write, and files of other kinds, are read
    exactly or refused."""
    files = (*csv_forms.FILES, *kinds.FILES)
    ends = [_difference_or_error(odd, work_folder / f"form {i}") for i, odd in enumerate(files)]
    crashed = sorted({odd.name for odd, end in zip(files, ends, strict=True) if isinstance(end, str)})
    readable = [(odd, end) for odd, end in zip(files, ends, strict=True) if odd.expected_outcome != "refused"]
    errors = [end if isinstance(end, float) else float("inf") for _, end in readable]
    silent = sum(end is not None for odd, end in zip(files, ends, strict=True) if odd.expected_outcome == "refused")
    why = "all of them are hard cases of their own"
    bits = f"{why}; half a bit of a time of 0.4 s, and less than the last bit of any force"
    return [
        Observed(
            "measured_formats.forms.values",
            SYSTEM,
            f"difference of times and values of {len(readable)} forms of CSV and of file names from the plain file",
            max(errors),
            "s or N",
        ).at_most(1e-16, bits, "closed form"),
        Observed(
            "measured_formats.forms.silent",
            SYSTEM,
            f"files that are read without a word, of {len(files) - len(readable)} with two meanings or of another kind",
            silent,
            "files",
        ).at_most(0.0, f"{why}; each refusal says what to do", "none"),
        behaviour_row(
            "measured_formats.forms.crashes",
            SYSTEM,
            f"errors that are no refusal or that say too little, of {len(files)} such files",
            ", ".join(crashed) or "none",
            "none",
            why,
        ),
    ]


def _difference_or_error(odd_file: OddFile, work_folder: Path) -> float | str | None:
    """Error of the values read from a file; None if the file is refused with a reason; text of any other error that is
    raised."""
    try:
        return odd_file.error(work_folder)
    except InputError:
        return None
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def wheel_force_with_pothole() -> np.ndarray:
    """A wheel force (N) of ten seconds at 1 kHz, with one pothole whose force is forty times that of the normal
    road."""
    load = np.convolve(normal_samples(SEED, 1, 10_000, 1)[:, 0], np.ones(20) / 20.0, mode="same") * 450.0
    load[5000:5020] += 8e4 * np.sin(np.linspace(0.0, np.pi, 20)) / 2
    return load


def sample_resolution_rows(work_folder: Path) -> list[Row]:
    """Rows: change of the damage of the road without its pothole by integer and by floating-point samples. RPC III
    files are written in floating point for this reason."""
    load = wheel_force_with_pothole()
    path = write(work_folder / "choice.rsp", [ChannelGroup(("Fz",), ("N",), ("",), 1e-3, len(load), [load[:, None]])])
    floating = read_channels(open_source(path))["Fz"][1]
    step = np.abs(load).max() / 32752
    rounded_load = step * np.round(load / step)
    errors = [
        abs(pseudo_damage(damaged[:4500]) / pseudo_damage(load[:4500]) - 1.0) for damaged in (floating, rounded_load)
    ]
    why = "slope 5, of the smooth road before a pothole that sets the scale of the whole numbers"
    return [
        Observed(
            "measured_formats.rsp.damage",
            SYSTEM,
            "relative change of the damage when the load is saved as RPC III in 32-bit floating point",
            errors[0],
            "relative",
        ).at_most(1e-5, why, "closed form"),
        Observed(
            "measured_formats.rsp.whole",
            SYSTEM,
            "relative change of the damage by RPC III with 16-bit whole numbers",
            errors[1],
            "relative",
        ).beside("not written; read where others have", why, "closed form"),
    ]


PROCESS_STATUS_FILE = Path("/proc/self/status")
PEAK_MEMORY_SCRIPT = f"""
import sys
from models.measured.formats import open_source
source = open_source(sys.argv[1])
count = sum(len(block.times) for block in source.blocks([one.name for one in source.channels]))
print(count, next(line for line in open("{PROCESS_STATUS_FILE}") if line.startswith("VmHWM")).split()[1])
"""


def peak_memory_rows(file_path: Path, file_extension: str) -> list[Row]:
    """Rows: peak memory of a fresh process that reads five minutes of sixty channels block by block."""
    key, form = f"measured_formats.{file_extension[1:]}.memory", FORMAT_NAMES[file_extension]
    if not PROCESS_STATUS_FILE.exists():
        return [not_run(key, SYSTEM, f"{form}: peak memory", "this system does not tell the peak of a process")]
    count, base = 300_000, 1e3 * normal_samples(SEED, 2, 60_000, 60)
    blocks: Iterator[np.ndarray] = (base + i for i in range(count // len(base)))
    write(file_path, [ChannelGroup(tuple(f"ch{i}" for i in range(60)), ("N",) * 60, ("",) * 60, 1e-3, count, blocks)])
    out = subprocess.run(
        [sys.executable, "-c", PEAK_MEMORY_SCRIPT, str(file_path)], capture_output=True, text=True, check=True
    ).stdout
    sample_total, peak = (int(word) for word in out.split())
    size = file_path.stat().st_size / 1e6
    file_path.unlink()
    return [
        Observed(
            f"{key}.samples", SYSTEM, f"{form}: samples of five minutes that are read by block", sample_total, ""
        ).within(count, 0, "a count: none is lost between blocks", "none"),
        Observed(
            key,
            SYSTEM,
            f"{form}: peak memory of a process that reads 60 channels of {size:.0f} MB by block, measured once",
            peak / 1e3,
            "MB",
        ).aim(350.0, "libraries included; blocks of 29 MB, the same for a file of an hour"),
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of what each file format preserves."""
    note = (
        f"{SAMPLE_COUNT:,} samples of three channels, values from 1e-6 to 1e3, written and read by block. Errors of "
        "values are by the size of each value; the format's own library opens the same file. CSV and RPC III "
        "have one sampling rate, MDF 4 and TDMS one per group."
    )
    rows = tuple(
        (
            format_row["format"],
            f"{format_row['values']:.1e}",
            f"{format_row['times']:.1e}",
            f"{format_row['library']}: {format_row['own']:.1e}",
            f"{format_row['size'] / 1e3:.0f}",
            f"{format_row['rate'] / 1e6:.1f}",
        )
        for format_row in case_data["formats"]
    )
    headings = ("format", "values", "times, s", "own library", "kB", "million values per s, there and back, once")
    return [Table(TITLE, note, headings, rows)]
