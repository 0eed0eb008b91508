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

    def rows(self, path: Path) -> Iterator[tuple[int, np.ndarray]]:
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
                raise InputError(path, place, None, "an infinite value cannot be written")
            yield first, values
            first += len(values)
        if first != self.count:
            raise ValueError(f"{first} samples instead of {self.count}")


def check_groups(path: Path, groups: Sequence[ChannelGroup], start: datetime | None) -> None:
    """Raise InputError for channels that a reader could not tell apart or a header could not hold, and for a start
    without time zone."""
    names = [name for group in groups for name in group.names]
    for name in names:
        if not name.strip() or name != name.strip() or not name.isprintable():
            raise InputError(path, "channel", name, "a name of printable characters without spaces around is needed")
        if names.count(name) > 1:
            raise InputError(path, "channel", name, "every name may occur once in a file")
    if not names or any(group.count < 1 or not group.period > 0.0 for group in groups):
        raise InputError(path, "groups", len(groups), "channels with samples and a period above 0 are needed")
    if start is not None and start.tzinfo is None:
        raise InputError(path, "start", str(start), "a start with its time zone is needed")


def _only_group(path: Path, groups: Sequence[ChannelGroup], format_name: str) -> ChannelGroup:
    """The single group of channels, for a format that has only one clock."""
    if len(groups) != 1:
        raise InputError(
            path, "groups", len(groups), f"{format_name} has one sampling rate: write a file for each, or MDF 4"
        )
    return groups[0]


def missing_package_error(path: Path, format_name: str, package: str) -> InputError:
    """Error for a format whose package is not installed."""
    return InputError(path, "", None, f"{format_name} files need {package}: pip install 'twinrig[measured]'")


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Context with a temporary path beside ``path`` and with its extension; it is renamed to ``path`` when all is
    written.

    Raises InputError where ``path`` exists, before or after, or nothing can be written; then nothing is left behind.
    """
    part = path.with_name(f".{path.stem}.part{path.suffix}")
    exists = InputError(path, "", None, "the file exists already: name another one, as nothing is overwritten")
    if path.exists():
        raise exists
    if not path.parent.is_dir():
        raise InputError(path, "", None, "the file cannot be written: its folder does not exist")
    try:
        part.unlink(missing_ok=True)
        yield part
        os.link(part, path)  # unlike a rename, it never replaces what came into being meanwhile
    except FileExistsError:
        raise exists from None
    except OSError as error:
        if error.errno in DISK_FULL_ERRORS:
            raise
        raise InputError(path, "", None, f"the file cannot be written: {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)


def write_csv(
    path: Path, temporary: Path, groups: Sequence[ChannelGroup], start: datetime | None, comment: str
) -> None:
    """Write a CSV file, as the file ``temporary``: header, then rows of shortest numbers, block by block."""
    group = _only_group(path, groups, "CSV")
    for name, unit in zip(group.names, group.units, strict=True):
        if is_clock(name):
            raise InputError(path, "channel", name, "a CSV file has one column of times: give the channel another name")
        if name_and_unit(f"{name} [{unit}]") != (name, unit) or not unit.isprintable():
            raise InputError(path, f"channel {name!r}, unit", unit, "a unit in CSV has no brackets and no line ends")
    with temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(_csv_header(group, start, comment))
        for first, values in group.rows(path):
            times = [f"{t:.15g}" for t in (group.period * np.arange(first, first + len(values))).tolist()]
            file.writelines(f"{t},{','.join(map(repr, row))}\n" for t, row in zip(times, values.tolist(), strict=True))


def _csv_header(group: ChannelGroup, start: datetime | None, comment: str) -> str:
    """Comment lines and headings; ``# samples:`` lets a reader see that the file was cut off."""
    lines = [f"comment: {line}" for line in comment.splitlines()]
    lines += [] if start is None else [f"start: {start.isoformat()}"]
    lines += [f"samples: {group.count}"]
    for name, text in zip(group.names, group.comments, strict=True):
        lines += [f"channel {json.dumps(name, ensure_ascii=False)}: {line}" for line in text.splitlines()]
    headings, channel_headings = (
        io.StringIO(),
        [f"{name} [{unit}]" for name, unit in zip(group.names, group.units, strict=True)],
    )
    quoting: Literal[0, 1] = 1 if ";" in "".join(channel_headings) else 0  # of all: it would look like a separator
    csv.writer(headings, lineterminator="\n", quoting=quoting).writerow(["time [s]", *channel_headings])
    return "".join(f"# {line}\n" for line in lines) + headings.getvalue()


def write_mdf(
    path: Path, temporary: Path, groups: Sequence[ChannelGroup], start: datetime | None, comment: str
) -> None:
    """Write an MDF file, as the file ``temporary``: blocks are first appended to a second temporary file."""
    try:
        from asammdf import MDF
    except ImportError:
        raise missing_package_error(path, "MDF", "asammdf") from None
    mdf = MDF(version="4.10", temporary_folder=str(temporary.parent))
    try:
        if start is None:
            mdf.header.abs_time = 0
        else:
            mdf.header.start_time = start
        mdf.header.comment = comment
        for index, group in enumerate(groups):
            for first, values in group.rows(path):
                _append_block(mdf, index, group, group.period * np.arange(first, first + len(values)), values)
        with suppressed_output():
            mdf.save(temporary)
    finally:
        mdf.close()


def _append_block(mdf: Any, index: int, group: ChannelGroup, times: np.ndarray, values: np.ndarray) -> None:
    """Append a block to a group; the first block creates the group."""
    from asammdf import Signal

    columns = np.ascontiguousarray(values.T)
    if times[0] > 0.0:
        mdf.extend(index, [(times, None), *((column, None) for column in columns)])
        return
    texts = zip(columns, group.names, group.units, group.comments, strict=True)
    mdf.append(
        [Signal(column, times, name=name, unit=unit, comment=text) for column, name, unit, text in texts],
        common_timebase=True,
    )


def write_tdms(
    path: Path, temporary: Path, groups: Sequence[ChannelGroup], start: datetime | None, comment: str
) -> None:
    """Write a TDMS file, as the file ``temporary``: one group after the other, with one segment per block."""
    try:
        from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
    except ImportError:
        raise missing_package_error(path, "TDMS", "npTDMS") from None
    with TdmsWriter(str(temporary)) as file:
        file.write_segment([RootObject({"description": comment} if comment else {})])
        for number, group in enumerate(groups, start=1):
            clock: dict[str, Any] = {
                "wf_increment": float(group.period),
                "wf_start_offset": 0.0,
                "wf_xunit_string": "s",
            }
            if start is not None:
                clock["wf_start_time"] = np.datetime64(start.astimezone(UTC).replace(tzinfo=None), "us")
            texts = zip(group.units, group.comments, strict=True)
            properties = [
                clock | {key: text for key, text in (("unit_string", unit), ("description", note)) if text}
                for unit, note in texts
            ]
            file.write_segment([GroupObject(f"group {number}", {})])
            for first, values in group.rows(path):
                columns = zip(group.names, np.ascontiguousarray(values.T), properties, strict=True)
                file.write_segment(
                    [
                        ChannelObject(f"group {number}", name, samples, {} if first else more)
                        for name, samples, more in columns
                    ]
                )


def write_rpc(
    path: Path, temporary: Path, groups: Sequence[ChannelGroup], start: datetime | None, comment: str
) -> None:
    """Write an RPC III file, as the file ``temporary``: header, groups of samples, and the header again with the limits
    of every channel."""
    group = _only_group(path, groups, "RPC III")
    limits = np.tile([[np.inf], [-np.inf]], len(group.names))
    with temporary.open("wb") as file:
        file.write(_rpc_header(path, group, limits, start, comment))
        for values in _equal_frames(path, group):
            limits = np.array([np.fmin(limits[0], np.fmin.reduce(values)), np.fmax(limits[1], np.fmax.reduce(values))])
            file.write(np.ascontiguousarray(values.T).astype("<f4").tobytes())
        file.seek(0)
        file.write(_rpc_header(path, group, np.where(np.isfinite(limits), limits, 0.0), start, comment))


def _equal_frames(path: Path, group: ChannelGroup) -> Iterator[np.ndarray]:
    """Values in frames of equal length; the last frame is padded with the last values."""
    pending = np.empty((0, len(group.names)))
    for first, values in group.rows(path):
        if (np.abs(values) > np.finfo("<f4").max).any():
            raise InputError(path, f"sample {first} and after", None, "values above 3.4e38 have no room in RPC III")
        pending = np.concatenate((pending, values))
        used = len(pending) // POINTS_PER_GROUP * POINTS_PER_GROUP
        yield from pending[:used].reshape(-1, POINTS_PER_GROUP, len(group.names))
        pending = pending[used:]
    if len(pending):
        yield np.concatenate((pending, np.repeat(pending[-1:], POINTS_PER_GROUP - len(pending), axis=0)))


def _rpc_header(path: Path, group: ChannelGroup, limits: np.ndarray, start: datetime | None, comment: str) -> bytes:
    """Header blocks of an RPC III file; their length does not depend on the channel limits."""
    parameters: dict[str, object] = {
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE",
        "DATA_TYPE": "FLOATING_POINT",
        "DATE": "" if start is None else start.isoformat(),
        "OPERATION": "twinrig",
        "CHANNELS": len(group.names),
        "DELTA_T": repr(group.period),
        "PTS_PER_FRAME": POINTS_PER_GROUP,
        "PTS_PER_GROUP": POINTS_PER_GROUP,
        "FRAMES": -(-group.count // POINTS_PER_GROUP),
        "SAMPLES": group.count,
        "BYPASS_FILTER": 0,
        "HALF_FRAMES": 0,
        "INT_FULL_SCALE": 32752,
        "REPEATS": 1,
        "PARTITIONS": 1,
        "PART.CHAN_1": 1,
        "PART.NCHAN_1": len(group.names),
        **_spread_long_text("COMMENT", comment),
    }
    texts = zip(group.names, group.units, limits.T, group.comments, strict=True)
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
        raise InputError(path, "channels", len(group.names), text)
    blocks = -(-count // (HEADER_BLOCK // RECORD_LENGTH))
    parameters = {"FORMAT": "BINARY", "NUM_HEADER_BLOCKS": blocks, "NUM_PARAMS": count, **parameters}
    return b"".join(_header_record(path, key, str(value)) for key, value in parameters.items()).ljust(
        blocks * HEADER_BLOCK, b"\0"
    )


def _header_record(path: Path, key: str, value: str) -> bytes:
    """One RPC III header parameter as bytes."""
    try:
        text = value.encode("latin-1")
    except UnicodeEncodeError as error:
        letter = value[error.start]
        raise InputError(path, key, value, f"RPC III has no {letter!r}: write it otherwise, or MDF 4") from None
    if len(text) > LONGEST_VALUE or "\0" in value:
        raise InputError(path, key, value, f"RPC III has room for {LONGEST_VALUE} characters, and this has {len(text)}")
    return key.encode("ascii").ljust(KEY_LENGTH, b"\0") + text.ljust(RECORD_LENGTH - KEY_LENGTH, b"\0")


def _spread_long_text(name: str, text: str) -> dict[str, object]:
    """A text spread over several header parameters, with line ends written as ``\\n``."""
    plain = text.replace("\\", "\\\\").replace("\n", "\\n")
    return {
        f"{name}_{i // LONGEST_VALUE + 1}": plain[i : i + LONGEST_VALUE] for i in range(0, len(plain), LONGEST_VALUE)
    }


WRITER_OF_EXTENSION: dict[str, Callable[[Path, Path, Sequence[ChannelGroup], datetime | None, str], None]] = {
    ".csv": write_csv,
    ".mf4": write_mdf,
    ".rsp": write_rpc,
    ".tdms": write_tdms,
}
"""Writer of each extension: function of path, temporary file, groups, start and the file's comment."""
