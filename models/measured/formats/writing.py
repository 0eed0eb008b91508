"""Writers of measurement files: groups of channels, checked beforehand, written block by block; completely or not at
all.

CSV is read back to the last bit by ``models.measured.formats.csv``. ASAM MDF 4.10 is written by asammdf: one channel
group per clock; it takes spaces away from the ends of the lines of a file's comment, all else comes back as it was
given. TDMS is written by npTDMS: a segment per block, the clock as waveform properties of every channel.

MTS RPC III is written with floating-point samples: 2^-24 of each value is kept, where 16 bits keep 2^-16 of the
largest. The last group is filled up with the last values; SAMPLES, which is no part of the format but known to
rpc3-file, says how many count. Comments are parameters of our own, COMMENT_1 ... and COMMENT.CHAN_1_1 ...; NaN is
written as NaN. A name, a unit or a comment that the format cannot hold is refused, never cut.
"""

import csv
import io
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.core.csv_header import name_and_unit
from models.core.errors import InputError
from models.core.whole_files import DISK_FULL_ERRORS
from models.measured.formats.csv_layout import is_clock
from models.measured.formats.mdf4 import suppressed_output
from models.measured.formats.rpc3 import HEADER_BLOCK, KEY_LENGTH, RECORD_LENGTH

POINTS_PER_GROUP = 2048
"""Number of samples of an RPC III group, which is also a frame."""
LONGEST_VALUE = RECORD_LENGTH - KEY_LENGTH - 1
"""Longest value (bytes) of an RPC III parameter before the zero that ends it."""
MOST_PARAMETERS = 1024
"""Most parameters of an RPC III header."""


@dataclass(frozen=True)
class ChannelGroup:
    """Channels to be written that share one clock; the first sample is at the file's start.

    names, units, comments : one text per channel. period : s. count : samples. blocks : arrays (n, channels) that
    follow each other and have ``count`` rows together, NaN where there is no value; taken once.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    comments: tuple[str, ...]
    period: float
    count: int
    blocks: Iterable[np.ndarray]

    def rows(self, measurement_path: Path) -> Iterator[tuple[int, np.ndarray]]:
        """Index of the first sample and values (n, channels) of every block; InputError where a value is infinite,
        ValueError for wrong shapes."""
        first = 0
        for block in self.blocks:
            values = np.asarray(block, float)
            if values.ndim != 2 or values.shape[1] != len(self.names) or first + len(values) > self.count:
                raise ValueError(f"a block of shape {values.shape} at sample {first} of {self.count}")
            if np.isinf(values).any():
                row, column = (int(i[0]) for i in np.nonzero(np.isinf(values)))
                place = f"channel {self.names[column]!r}, sample {first + row}"
                raise InputError(measurement_path, place, None, "an infinite value cannot be written")
            yield first, values
            first += len(values)
        if first != self.count:
            raise ValueError(f"{first} samples instead of {self.count}")


def check_groups(measurement_path: Path, channel_groups: Sequence[ChannelGroup], start_time: datetime | None) -> None:
    """Raise InputError for channels that a reader could not tell apart or a header could not hold, and for a start
    without time zone."""
    names = [name for group in channel_groups for name in group.names]
    for name in names:
        if not name.strip() or name != name.strip() or not name.isprintable():
            raise InputError(
                measurement_path, "channel", name, "a name of printable characters without spaces around is needed"
            )
        if names.count(name) > 1:
            raise InputError(measurement_path, "channel", name, "every name may occur once in a file")
    if not names or any(group.count < 1 or not group.period > 0.0 for group in channel_groups):
        raise InputError(
            measurement_path, "groups", len(channel_groups), "channels with samples and a period above 0 are needed"
        )
    if start_time is not None and start_time.tzinfo is None:
        raise InputError(measurement_path, "start", str(start_time), "a start with its time zone is needed")


def _only_group(measurement_path: Path, channel_groups: Sequence[ChannelGroup], format_name: str) -> ChannelGroup:
    """The single group of channels, for a format that has only one clock."""
    if len(channel_groups) != 1:
        raise InputError(
            measurement_path,
            "groups",
            len(channel_groups),
            f"{format_name} has one sampling rate: write a file for each, or MDF 4",
        )
    return channel_groups[0]


def missing_package_error(measurement_path: Path, format_name: str, package_name: str) -> InputError:
    """Error for a format whose package is not installed."""
    return InputError(
        measurement_path, "", None, f"{format_name} files need {package_name}: pip install 'twinrig[measured]'"
    )


@contextmanager
def new_file(measurement_path: Path) -> Iterator[Path]:
    """Context with a temporary path beside ``measurement_path`` and with its extension; it is renamed to
    ``measurement_path`` when all is written.

    Raises InputError where ``measurement_path`` exists, before or after, or nothing can be written; then nothing is
    left behind.
    """
    part = measurement_path.with_name(f".{measurement_path.stem}.part{measurement_path.suffix}")
    exists = InputError(
        measurement_path, "", None, "the file exists already: name another one, as nothing is overwritten"
    )
    if measurement_path.exists():
        raise exists
    if not measurement_path.parent.is_dir():
        raise InputError(measurement_path, "", None, "the file cannot be written: its folder does not exist")
    try:
        part.unlink(missing_ok=True)
        yield part
        os.link(part, measurement_path)  # unlike a rename, it never replaces what came into being meanwhile
    except FileExistsError:
        raise exists from None
    except OSError as error:
        if error.errno in DISK_FULL_ERRORS:
            raise
        raise InputError(measurement_path, "", None, f"the file cannot be written: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)


def write_csv(
    measurement_path: Path,
    temporary_path: Path,
    channel_groups: Sequence[ChannelGroup],
    start_time: datetime | None,
    comment: str,
) -> None:
    """Write a CSV file, as the file ``temporary_path``: header, then rows of shortest numbers, block by block."""
    group = _only_group(measurement_path, channel_groups, "CSV")
    for name, unit in zip(group.names, group.units, strict=True):
        if is_clock(name):
            raise InputError(
                measurement_path, "channel", name, "a CSV file has one column of times: give the channel another name"
            )
        if name_and_unit(f"{name} [{unit}]") != (name, unit) or not unit.isprintable():
            raise InputError(
                measurement_path, f"channel {name!r}, unit", unit, "a unit in CSV has no brackets and no line ends"
            )
    with temporary_path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_csv_header(group, start_time, comment))
        for first, values in group.rows(measurement_path):
            times = [f"{t:.15g}" for t in (group.period * np.arange(first, first + len(values))).tolist()]
            file.writelines(f"{t},{','.join(map(repr, row))}\n" for t, row in zip(times, values.tolist(), strict=True))


def _csv_header(channel_group: ChannelGroup, start_time: datetime | None, comment: str) -> str:
    """Comment lines and headings; ``# samples:`` lets a reader see that the file was cut off."""
    lines = [f"comment: {line}" for line in comment.splitlines()]
    lines += [] if start_time is None else [f"start: {start_time.isoformat()}"]
    lines += [f"samples: {channel_group.count}"]
    for name, text in zip(channel_group.names, channel_group.comments, strict=True):
        lines += [f"channel {json.dumps(name, ensure_ascii=False)}: {line}" for line in text.splitlines()]
    headings, channel_headings = (
        io.StringIO(),
        [f"{name} [{unit}]" for name, unit in zip(channel_group.names, channel_group.units, strict=True)],
    )
    quoting: Literal[0, 1] = 1 if ";" in "".join(channel_headings) else 0  # of all: it would look like a separator
    csv.writer(headings, lineterminator="\n", quoting=quoting).writerow(["time [s]", *channel_headings])
    return "".join(f"# {line}\n" for line in lines) + headings.getvalue()


def write_mdf(
    measurement_path: Path,
    temporary_path: Path,
    channel_groups: Sequence[ChannelGroup],
    start_time: datetime | None,
    comment: str,
) -> None:
    """Write an MDF file, as the file ``temporary_path``: blocks are first appended to a second temporary file."""
    try:
        from asammdf import MDF
    except ImportError:
        raise missing_package_error(measurement_path, "MDF", "asammdf") from None
    mdf = MDF(version="4.10", temporary_folder=str(temporary_path.parent))
    try:
        if start_time is None:
            mdf.header.abs_time = 0
        else:
            mdf.header.start_time = start_time
        mdf.header.comment = comment
        for index, group in enumerate(channel_groups):
            for first, values in group.rows(measurement_path):
                _append_block(mdf, index, group, group.period * np.arange(first, first + len(values)), values)
        with suppressed_output():
            mdf.save(temporary_path)
    finally:
        mdf.close()


def _append_block(
    mdf: Any, group_index: int, channel_group: ChannelGroup, times: np.ndarray, values: np.ndarray
) -> None:
    """Append a block to a group; the first block creates the group."""
    from asammdf import Signal

    columns = np.ascontiguousarray(values.T)
    if times[0] > 0.0:
        mdf.extend(group_index, [(times, None), *((column, None) for column in columns)])
        return
    texts = zip(columns, channel_group.names, channel_group.units, channel_group.comments, strict=True)
    mdf.append(
        [Signal(column, times, name=name, unit=unit, comment=text) for column, name, unit, text in texts],
        common_timebase=True,
    )


def write_tdms(
    measurement_path: Path,
    temporary_path: Path,
    channel_groups: Sequence[ChannelGroup],
    start_time: datetime | None,
    comment: str,
) -> None:
    """Write a TDMS file, as the file ``temporary_path``: one group after the other, with one segment per block."""
    try:
        from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
    except ImportError:
        raise missing_package_error(measurement_path, "TDMS", "npTDMS") from None
    with TdmsWriter(str(temporary_path)) as file:
        file.write_segment([RootObject({"description": comment} if comment else {})])
        for number, group in enumerate(channel_groups, start=1):
            clock: dict[str, Any] = {
                "wf_increment": float(group.period),
                "wf_start_offset": 0.0,
                "wf_xunit_string": "s",
            }
            if start_time is not None:
                clock["wf_start_time"] = np.datetime64(start_time.astimezone(UTC).replace(tzinfo=None), "us")
            texts = zip(group.units, group.comments, strict=True)
            properties = [
                clock | {key: text for key, text in (("unit_string", unit), ("description", note)) if text}
                for unit, note in texts
            ]
            file.write_segment([GroupObject(f"group {number}", {})])
            for first, values in group.rows(measurement_path):
                columns = zip(group.names, np.ascontiguousarray(values.T), properties, strict=True)
                file.write_segment(
                    [
                        ChannelObject(f"group {number}", name, samples, {} if first else more)
                        for name, samples, more in columns
                    ]
                )


def write_rpc(
    measurement_path: Path,
    temporary_path: Path,
    channel_groups: Sequence[ChannelGroup],
    start_time: datetime | None,
    comment: str,
) -> None:
    """Write an RPC III file, as the file ``temporary_path``: header, groups of samples, and the header again with the
    limits of every channel."""
    group = _only_group(measurement_path, channel_groups, "RPC III")
    limits = np.tile([[np.inf], [-np.inf]], len(group.names))
    with temporary_path.open("wb") as file:
        file.write(_rpc_header(measurement_path, group, limits, start_time, comment))
        for values in _equal_frames(measurement_path, group):
            limits = np.array([np.fmin(limits[0], np.fmin.reduce(values)), np.fmax(limits[1], np.fmax.reduce(values))])
            file.write(np.ascontiguousarray(values.T).astype("<f4").tobytes())
        file.seek(0)
        file.write(
            _rpc_header(measurement_path, group, np.where(np.isfinite(limits), limits, 0.0), start_time, comment)
        )


def _equal_frames(measurement_path: Path, channel_group: ChannelGroup) -> Iterator[np.ndarray]:
    """Values in frames of equal length; the last frame is padded with the last values."""
    pending = np.empty((0, len(channel_group.names)))
    for first, values in channel_group.rows(measurement_path):
        if (np.abs(values) > np.finfo("<f4").max).any():
            raise InputError(
                measurement_path, f"sample {first} and after", None, "values above 3.4e38 have no room in RPC III"
            )
        pending = np.concatenate((pending, values))
        used = len(pending) // POINTS_PER_GROUP * POINTS_PER_GROUP
        yield from pending[:used].reshape(-1, POINTS_PER_GROUP, len(channel_group.names))
        pending = pending[used:]
    if len(pending):
        yield np.concatenate((pending, np.repeat(pending[-1:], POINTS_PER_GROUP - len(pending), axis=0)))


def _rpc_header(
    measurement_path: Path,
    channel_group: ChannelGroup,
    channel_limits: np.ndarray,
    start_time: datetime | None,
    comment: str,
) -> bytes:
    """Header blocks of an RPC III file; their length does not depend on the channel limits."""
    parameters: dict[str, object] = {
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE",
        "DATA_TYPE": "FLOATING_POINT",
        "DATE": "" if start_time is None else start_time.isoformat(),
        "OPERATION": "twinrig",
        "CHANNELS": len(channel_group.names),
        "DELTA_T": repr(channel_group.period),
        "PTS_PER_FRAME": POINTS_PER_GROUP,
        "PTS_PER_GROUP": POINTS_PER_GROUP,
        "FRAMES": -(-channel_group.count // POINTS_PER_GROUP),
        "SAMPLES": channel_group.count,
        "BYPASS_FILTER": 0,
        "HALF_FRAMES": 0,
        "INT_FULL_SCALE": 32752,
        "REPEATS": 1,
        "PARTITIONS": 1,
        "PART.CHAN_1": 1,
        "PART.NCHAN_1": len(channel_group.names),
        **_spread_long_text("COMMENT", comment),
    }
    texts = zip(channel_group.names, channel_group.units, channel_limits.T, channel_group.comments, strict=True)
    for i, (name, unit, (low, high), text) in enumerate(texts, start=1):
        told = {"DESC": name, "UNITS": unit, "SCALE": "1.0", "LOWER_LIMIT": f"{low:.9g}", "UPPER_LIMIT": f"{high:.9g}"}
        parameters |= {f"{key}.CHAN_{i}": value for key, value in (told | {"MAP": str(i)}).items()}
        parameters |= _spread_long_text(f"COMMENT.CHAN_{i}", text)
    count = len(parameters) + 3
    if count > MOST_PARAMETERS:
        text = (
            f"the header has {MOST_PARAMETERS} parameters, {count} are needed: "
            "write fewer channels or comments, or MDF 4"
        )
        raise InputError(measurement_path, "channels", len(channel_group.names), text)
    blocks = -(-count // (HEADER_BLOCK // RECORD_LENGTH))
    parameters = {"FORMAT": "BINARY", "NUM_HEADER_BLOCKS": blocks, "NUM_PARAMS": count, **parameters}
    return b"".join(_header_record(measurement_path, key, str(value)) for key, value in parameters.items()).ljust(
        blocks * HEADER_BLOCK, b"\0"
    )


def _header_record(measurement_path: Path, parameter_name: str, parameter_value: str) -> bytes:
    """One RPC III header parameter as bytes."""
    try:
        text = parameter_value.encode("latin-1")
    except UnicodeEncodeError as error:
        letter = parameter_value[error.start]
        raise InputError(
            measurement_path,
            parameter_name,
            parameter_value,
            f"RPC III has no {letter!r}: write it otherwise, or MDF 4",
        ) from None
    if len(text) > LONGEST_VALUE or "\0" in parameter_value:
        raise InputError(
            measurement_path,
            parameter_name,
            parameter_value,
            f"RPC III has room for {LONGEST_VALUE} characters, and this has {len(text)}",
        )
    return parameter_name.encode("ascii").ljust(KEY_LENGTH, b"\0") + text.ljust(RECORD_LENGTH - KEY_LENGTH, b"\0")


def _spread_long_text(parameter_name: str, long_text: str) -> dict[str, object]:
    """A text spread over several header parameters, with line ends written as ``\\n``."""
    plain = long_text.replace("\\", "\\\\").replace("\n", "\\n")
    return {
        f"{parameter_name}_{i // LONGEST_VALUE + 1}": plain[i : i + LONGEST_VALUE]
        for i in range(0, len(plain), LONGEST_VALUE)
    }


WRITER_OF_EXTENSION: dict[str, Callable[[Path, Path, Sequence[ChannelGroup], datetime | None, str], None]] = {
    ".csv": write_csv,
    ".mf4": write_mdf,
    ".rsp": write_rpc,
    ".tdms": write_tdms,
}
"""Writer of each extension: function of path, temporary file, groups, start and the file's comment."""
