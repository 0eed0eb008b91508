"""Damaged or unusual measurement files: how a file is made, what reading it must give, and the error of what is
read."""

import hashlib
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.core.errors import InputError
from models.measured.channel import MeasurementSource
from models.measured.formats import open_source, write
from models.measured.formats.writing import ChannelGroup

ExpectedOutcome = Literal["right", "named", "refused"]
"""The file is read correctly; it is read as far as possible and a message names the problem; or it is refused with a
reason."""
Truth = Mapping[str, tuple[np.ndarray, np.ndarray]]
FileMaker = Callable[[Path], Path]
"""Function that writes a file into a folder and returns its path."""
Files = dict[str, tuple[Any, ...]]
"""For each file name: why it is difficult, the function that makes it, a phrase that the message must contain, and the
expected values unless they are the usual ones. Files that are read correctly have no phrase."""
SAMPLE_COUNT, SAMPLE_PERIOD = 40, 0.01
"""Number of samples of the usual file, and its sampling period (s)."""
SAMPLE_TIMES = SAMPLE_PERIOD * np.arange(SAMPLE_COUNT)
FZ, FX = 1000.0 + 2.0**-6 * np.arange(SAMPLE_COUNT), -2.5 * np.arange(SAMPLE_COUNT)
"""Values of the two channels. They need so few bits that every format stores them exactly."""
SLOW_PERIOD = 0.05
"""Sampling period (s) of a channel with a lower rate."""
TWO_RATES = {"Fz": (SAMPLE_TIMES, FZ), "Fx": (SLOW_PERIOD * np.arange(SAMPLE_COUNT), FX)}
MANY_CHANNELS = {f"c{i}": (SAMPLE_TIMES, FZ + i) for i in range(300)}
"""Expected values of the file with 300 channels."""
REPEATED_NAME = {"Fz (1)": (SAMPLE_TIMES, FZ), "Fz (2)": (SAMPLE_TIMES, FX)}
"""Expected values of a file in which two channels have the same name."""
TOLERANCE = 1e-12
"""Tolerance of times (s) and values. CSV stores times with 15 digits; values must be exact to the last bit."""
MEMORY, SECONDS = 5e7, 10.0
"""Memory (bytes) and time (s) that reading a small file may take at most, whatever size the file states."""


def usual_truth(**changed_values: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Expected times and values of the usual file's two channels. Keywords replace the values of a channel."""
    return {name: (SAMPLE_TIMES, changed_values.get(name, values)) for name, values in (("Fz", FZ), ("Fx", FX))}


@dataclass(frozen=True)
class OddFile:
    """A damaged or unusual file, and what reading it must give.

    difficulty : why it is hard to read. make : function that writes it. expected_outcome : see ``ExpectedOutcome``.
    expected_text : phrase that the refusal or the message must contain. expected_channels : for each channel, times and
    values; a file whose outcome is "named" may give only the first of them. is_greedy : whether the file states a huge
    size, for which no memory may be allocated.
    """

    name: str
    difficulty: str
    make: FileMaker
    expected_outcome: ExpectedOutcome
    expected_text: str = ""
    expected_channels: Truth = field(default_factory=usual_truth)
    is_greedy: bool = False

    def error(self, work_folder: Path) -> float:
        """Largest difference between the values read and the expected ones; infinite if a channel or a sample is
        missing. If the file is refused, the reader's exception is raised. AssertionError is raised if the refusal does
        not give the reason, if the folder was changed, or if reading took too much time or memory."""
        work_folder.mkdir(parents=True, exist_ok=True)
        path = self.make(work_folder)
        state_before = _file_digests(work_folder)
        try:
            return self._measured(path)
        except InputError as refusal:
            if path.name not in str(refusal) or self.expected_text not in str(refusal) or "\n" in str(refusal):
                raise AssertionError(f"{self.name}: {refusal} does not say {self.expected_text!r}") from refusal
            raise
        finally:
            if _file_digests(work_folder) != state_before:
                raise AssertionError(f"{self.name}: something was written beside {path} or into it")

    def _measured(self, file_path: Path) -> float:
        """Error of the values read. For a greedy file, time and memory are limited to those of a small file."""
        if not self.is_greedy:
            return reading_error(
                open_source(file_path),
                self.expected_channels,
                self.expected_text if self.expected_outcome == "named" else "",
            )
        tracemalloc.start()
        began = time.perf_counter()
        try:
            return reading_error(
                open_source(file_path),
                self.expected_channels,
                self.expected_text if self.expected_outcome == "named" else "",
            )
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            if peak > MEMORY or time.perf_counter() - began > SECONDS:
                raise AssertionError(f"{self.name}: {peak / 1e6:.0f} MB, {time.perf_counter() - began:.1f} s")


def odd_files(
    refused_files: Files | None = None,
    files_with_message: Files | None = None,
    readable_files: Files | None = None,
    greedy_names: Sequence[str] = (),
) -> tuple[OddFile, ...]:
    """All files of the three tables. ``greedy_names``: names of the files that state a huge size, for which no memory
    may be allocated."""
    tables: tuple[tuple[ExpectedOutcome, Files], ...] = (
        ("refused", refused_files or {}),
        ("named", files_with_message or {}),
        ("right", readable_files or {}),
    )
    collected_files = list[OddFile]()
    for expected_outcome, files in tables:
        for name, (difficulty, make, *expectation) in files.items():
            expected_text, *truth = expectation if expected_outcome != "right" else ("", *expectation)
            collected_files.append(
                OddFile(
                    name,
                    difficulty,
                    make,
                    expected_outcome,
                    expected_text,
                    truth[0] if truth else usual_truth(),
                    name in greedy_names,
                )
            )
    return tuple(collected_files)


def _file_digests(checked_folder: Path) -> dict[str, str]:
    """Digest of every file below a folder. It shows whether a file was changed."""
    return {
        str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(checked_folder.rglob("*")) if p.is_file()
    }


def read_channels(measurement_source: MeasurementSource) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times and values of every channel, read in several blocks."""
    channels: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for group in {channel.group for channel in measurement_source.channels}:
        names = [channel.name for channel in measurement_source.channels if channel.group == group]
        count = next(channel.count for channel in measurement_source.channels if channel.group == group)
        blocks = list(measurement_source.blocks(names, 1 + count // (6 if len(names) < 100 else 1)))
        sample_times, values = (
            np.concatenate([getattr(block, key) for block in blocks]) for key in ("times", "values")
        )
        channels |= {name: (sample_times, values[:, i]) for i, name in enumerate(names)}
    return channels


def reading_error(measurement_source: MeasurementSource, expected_channels: Truth, expected_text: str) -> float:
    """Largest difference between what is read from a file and the expected values; infinite if a channel, a sample or
    the reader's message is missing."""
    channels, finding_texts = (
        read_channels(measurement_source),
        [finding.text for finding in measurement_source.findings if finding.weight != "note" or expected_text],
    )
    if set(channels) != set(expected_channels) or not (
        any(expected_text in text for text in finding_texts) if expected_text else not finding_texts
    ):
        return np.inf
    return max(
        _largest_difference(channels[name], expected_channels[name], bool(expected_text)) for name in expected_channels
    )


def _largest_difference(
    read_channel: tuple[np.ndarray, np.ndarray],
    expected_channels: tuple[np.ndarray, np.ndarray],
    is_partial_allowed: bool,
) -> float:
    """Largest difference of times and values of a channel. With ``is_partial_allowed``, it is enough that the first
    samples were read."""
    count = len(read_channel[0])
    if (
        count == 0
        or count > len(expected_channels[0])
        or (count < len(expected_channels[0]) and not is_partial_allowed)
    ):
        return np.inf
    true_times, values = expected_channels[0][:count], expected_channels[1][:count]
    if not np.array_equal(np.isnan(read_channel[1]), np.isnan(values)):
        return np.inf
    return float(
        max(np.abs(read_channel[0] - true_times).max(), np.nanmax(np.abs(read_channel[1] - values), initial=0.0))
    )


def write_usual_file(
    file_path: Path, channel_names: tuple[str, ...] = ("Fz", "Fx"), channel_values: np.ndarray | None = None
) -> Path:
    """Write channels (by default those of the usual file) in the format given by the extension of ``file_path``."""
    table = np.column_stack((FZ, FX)) if channel_values is None else channel_values
    group = ChannelGroup(
        channel_names, ("N",) * len(channel_names), ("",) * len(channel_names), SAMPLE_PERIOD, len(table), [table]
    )
    return write(file_path, [group])


def file_of_bytes(raw_bytes: bytes, file_name: str = "odd.csv") -> FileMaker:
    """Make a file with this content."""

    def make(output_folder: Path) -> Path:
        (output_folder / file_name).write_bytes(raw_bytes)
        return output_folder / file_name

    return make


def usual_file(file_extension: str) -> FileMaker:
    """Make the usual file in the format of an extension."""
    return lambda folder: write_usual_file(folder / f"odd{file_extension}")


def file_of_300_channels(file_extension: str) -> FileMaker:
    """Make a file of 300 channels in the format of an extension."""
    table = np.column_stack([values for _, values in MANY_CHANNELS.values()])
    return lambda folder: write_usual_file(folder / f"odd{file_extension}", tuple(MANY_CHANNELS), table)


def altered_file_maker(make_file: FileMaker, change_bytes: Callable[[bytes], bytes], file_name: str = "") -> FileMaker:
    """Function that makes a file, changes its bytes and optionally gives it another name."""

    def altered_file(output_folder: Path) -> Path:
        path = make_file(output_folder)
        path.write_bytes(change_bytes(path.read_bytes()))
        return path.rename(output_folder / file_name) if file_name else path

    return altered_file


def patched_bytes(raw_bytes: bytes, byte_offset: int, new_bytes: bytes) -> bytes:
    """Bytes of a file with some of them replaced: ``new_bytes`` are written at an offset."""
    return raw_bytes[:byte_offset] + new_bytes + raw_bytes[byte_offset + len(new_bytes) :]


def file_of_two_rates(file_extension: str) -> FileMaker:
    """Make a file of two groups that have different sampling rates."""
    clocks = (("Fz", SAMPLE_PERIOD, FZ), ("Fx", SLOW_PERIOD, FX))

    def make(output_folder: Path) -> Path:
        groups = [
            ChannelGroup((name,), ("N",), ("",), period, SAMPLE_COUNT, [samples[:, None]])
            for name, period, samples in clocks
        ]
        return write(output_folder / f"odd{file_extension}", groups)

    return make


def usual_file_called(file_extension: str, file_name: str) -> FileMaker:
    """Make the usual file under another name."""
    return altered_file_maker(usual_file(file_extension), bytes, file_name)


@dataclass(frozen=True)
class CutSweep:
    """The usual file, cut off at many places. Each cut file must be refused, or its samples must be read correctly and
    reported as incomplete.

    cuts : number of places, evenly distributed over the file; 0 to cut at every byte.
    """

    extension: str
    cuts: int = 40

    def silent_cuts(self, work_folder: Path) -> int:
        """Number of cuts after which the reader returns wrong values or does not report that the file is cut off."""
        work_folder.mkdir(parents=True, exist_ok=True)
        count = 7000 if self.extension == ".rsp" else SAMPLE_COUNT  # three groups of RPC III and a half
        table = np.column_stack((FZ, FX)) if count == SAMPLE_COUNT else np.arange(float(count))[:, None] * [1.0, -2.5]
        path = write_usual_file(work_folder / f"cut{self.extension}", channel_values=table)
        truth = {
            name: (SAMPLE_PERIOD * np.arange(count), column) for name, column in zip(("Fz", "Fx"), table.T, strict=True)
        }
        data = path.read_bytes()
        cut_lengths = (
            range(len(data)) if self.cuts == 0 else np.linspace(0, len(data) - 1, self.cuts).astype(int).tolist()
        )
        return sum(self._is_silent(path, data[:cut_length], truth) for cut_length in cut_lengths)

    def _is_silent(self, file_path: Path, raw_bytes: bytes, expected_channels: Truth) -> bool:
        """Whether the reader fails to report that this file is cut off, or reads it wrongly."""
        file_path.write_bytes(raw_bytes)
        try:
            source = open_source(file_path)
            complete_truth = {
                name: expected_channels[name]
                for name in expected_channels
                if name in {channel.name for channel in source.channels}
            }
            return reading_error(source, complete_truth, "cut off") > TOLERANCE
        except InputError as refusal:
            return file_path.name not in str(refusal)
