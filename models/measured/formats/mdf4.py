"""Reader of ASAM MDF files, versions 3 and 4, by asammdf: one group of channels per channel group of the file.

Times are those of each group's master channel; a group without a master in seconds is left out, and that is said.
Values are the physical ones, after the file's own conversion; samples that the file marks as invalid are NaN. Channels
of text, bytes, arrays and structures are left out. Records are loaded block by block: neither a common time base nor a
whole channel is ever made.
"""

import gc
import io
import logging
import re
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.channel import FileChannel
from models.measured.formats.mdf4_blocks import VARIABLE_LENGTH_FLAG, check_blocks
from models.measured.formats.opened import (
    OpenFile,
    SampleSpan,
    SkippedChannels,
    distinct_names,
    flaw_finding,
    library_errors_as_input,
    no_readable_channel_error,
)

SECONDS_SYNCHRONISATION = 1
"""Synchronisation type of a master channel that counts seconds (MDF 4; that of MDF 3 always does)."""
SECONDS_OF_UNIT = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
"""Factors to seconds of the units that some exporters write for a master channel besides the standard's own."""
ALL_INVALID, INVALIDATION_FLAGS, VIRTUAL_MASTER = 1, 2, 3
"""Channel flags of MDF 4 (never measured; has invalidation bits), and channel type of a clock without samples."""
LOCAL_TIME_FLAG, OFFSET_VALID_FLAG = 1, 2
"""Flags of the start time in MDF 4: local time of an unknown zone; offset to UTC is valid."""
NUMBER_TYPES = {3: {0, 1, 2, 3, 9, 10, 11, 12, 13, 14, 15, 16}, 4: {0, 1, 2, 3, 4, 5}}
"""By MDF version: data types of numbers."""
WHOLE_NUMBER_TYPES = {3: {0, 1, 9, 10, 13, 14}, 4: {0, 1, 2, 3}}
"""By MDF version: data types of whole numbers."""
NUMERIC_CONVERSIONS = {3: {0, 1, 2, 6, 7, 8, 9, 10, 65535}, 4: {0, 1, 2, 3, 4, 5, 6}}
"""By MDF version: conversions that give numbers."""
LINEAR_CONVERSION = {3: 0, 4: 1}
"""By MDF version: the linear conversion."""


@dataclass(frozen=True)
class MdfFile(OpenFile):
    """Reader of an MDF file; ``channel_places`` holds the group and the index of every channel in the file."""

    channel_places: tuple[tuple[int, int], ...]

    def pieces(
        self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times and values of the records of each span, loaded once for all channels."""
        with opened_mdf(self.path) as mdf:
            group = self.channel_places[channel_indices[0]][0]
            for first, count in sample_spans:
                with suppressed_output():
                    block = _record_block(
                        mdf, group, [self.channel_places[i][1] for i in channel_indices], first, count
                    )
                yield block


@contextmanager
def opened_mdf(mdf_path: Path) -> Iterator[Any]:
    """Context with asammdf's open file, its terminal output suppressed; InputError where the file is damaged or the
    package missing."""
    try:
        from asammdf import MDF
    except ImportError:
        raise InputError(mdf_path, "", None, "MDF files need asammdf: pip install 'twinrig[measured]'") from None
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    with mdf_path.open("rb") as file:  # a path would be mapped into memory as a whole
        mdf, why = None, ""
        with suppressed_output():
            try:
                mdf = MDF(file)
            except Exception as error:
                why = f"{type(error).__name__}: {error}".splitlines()[0]
                traceback.clear_frames(error.__traceback__)
            if mdf is None:
                gc.collect()  # what it left in circles would complain later
        if mdf is None:
            raise InputError(mdf_path, "", None, f"the file is damaged and cannot be read ({why})")
        try:
            yield mdf
        finally:
            mdf.close()


@contextmanager
def suppressed_output() -> Iterator[None]:
    """Context in which asammdf prints nothing, also while it cleans up a file that it could not open."""
    kept, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        sys.unraisablehook = kept


def _record_block(
    mdf: Any, group_index: int, channel_indices: list[int], first_record: int, record_count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of some records, loaded only once; asammdf's public functions would load them again for each
    channel."""
    getattr(mdf._mdf, "_invalidation_cache", {}).clear()  # it knows a block by its length, and takes the one before
    data_blocks = list(
        mdf._mdf._load_data(mdf.groups[group_index], record_offset=first_record, record_count=record_count)
    )
    unit = mdf.groups[group_index].channels[mdf.masters_db[group_index]].unit or ""
    times = SECONDS_OF_UNIT.get(unit.strip(), 1.0) * np.concatenate(
        [mdf.get_master(group_index, data=data_block) for data_block in data_blocks]
    )
    values = [
        np.concatenate([_physical_values(mdf, group_index, i, data_block) for data_block in data_blocks])
        for i in channel_indices
    ]
    return times[:record_count], np.column_stack(values)[:record_count]


def _physical_values(mdf: Any, group_index: int, channel_index: int, records: Any) -> np.ndarray:
    """Physical values (n,) of one channel in some records; NaN where they are marked as invalid.

    What the library calls to ignore the marks is to hand them over; it would leave out the samples otherwise.
    """
    samples, invalid = mdf.get(
        group=group_index, index=channel_index, data=records, samples_only=True, ignore_invalidation_bits=True
    )
    values = np.asarray(samples, float)
    return values if invalid is None else np.where(np.asarray(invalid, bool), np.nan, values)


def open_mdf(mdf_path: Path) -> MdfFile:
    """``MdfFile`` of a path with its list of channels; raises InputError where the file is damaged."""
    with library_errors_as_input(mdf_path):
        with mdf_path.open("rb") as file:
            identification = re.match(rb"(?:MDF|UnFinMF) +([34])\.\d\d", file.read(64))
        if identification is None:
            raise InputError(mdf_path, "byte 8", None, "MDF of version 3 or 4 can be read")
        version = int(identification[1])
        findings = check_blocks(mdf_path) if version == 4 else []
        with opened_mdf(mdf_path) as mdf:
            return _file_with_channels(mdf_path, mdf, version, findings)


def _file_with_channels(mdf_path: Path, mdf: Any, mdf_version: int, findings: list[Finding]) -> MdfFile:
    """``MdfFile`` with the channels that hold numbers over time."""
    left_out, locations, channels = SkippedChannels(), [], []
    for g, group in enumerate(mdf.groups):
        records = group.channel_group
        if mdf_version == 3 and records.cycles_nr * records.samples_byte_nr > mdf_path.stat().st_size:
            raise InputError(
                mdf_path, f"group {g + 1}", records.cycles_nr, "the file is too short for the records that it announces"
            )
        why = _why_group_unusable(mdf, g, mdf_version)
        if why:
            left_out.add(why, f"group {g + 1}")
            continue
        for i, channel in enumerate(group.channels):
            if i == mdf.masters_db.get(g):
                continue
            why = _why_channel_unusable(group, i, mdf_version)
            if why:
                left_out.add(why, repr(channel.name))
            else:
                locations.append((g, i))
                channels.append(channel)
    findings = findings + left_out.findings(mdf_path)
    if not locations:
        raise no_readable_channel_error(mdf_path, findings)
    groups = [
        _group_names(mdf.groups[g].channel_group, channel) for channel, (g, _) in zip(channels, locations, strict=True)
    ]
    names, repeated = distinct_names(mdf_path, [channel.name for channel in channels], *zip(*groups, strict=True))
    listed = tuple(
        FileChannel(
            name,
            channel.unit or "",
            _plain_comment(channel.comment),
            g,
            mdf.groups[g].channel_group.cycles_nr,
            None,
            _value_step(channel, mdf_version),
            next(filter(None, texts), ""),
        )
        for name, channel, (g, _), texts in zip(names, channels, locations, groups, strict=True)
    )
    start, notes = _start_time(mdf_path, mdf.header, mdf_version)
    return MdfFile(
        mdf_path,
        listed,
        start,
        _plain_comment(mdf.header.comment),
        tuple(findings + repeated + notes),
        tuple(locations),
    )


def _group_names(group: Any, channel: Any) -> tuple[str, str, str, str]:
    """Texts that can serve as the name of a channel's group: acquisition name, source, first comment line, channel's
    source."""
    sources = [
        f"{getattr(source, 'name', '')} {getattr(source, 'path', '')}".strip()
        for source in (getattr(group, "acq_source", None), getattr(channel, "source", None))
    ]
    comment = _plain_comment(group.comment or "").partition("\n")[0]
    return (getattr(group, "acq_name", None) or "").strip(), sources[0], comment.strip(), sources[1]


def _why_group_unusable(mdf: Any, group_index: int, mdf_version: int) -> str:
    """Reason why a channel group cannot be used; empty if it can."""
    group, master = mdf.groups[group_index], mdf.masters_db.get(group_index)
    if group.channel_group.cycles_nr == 0:
        return "no samples"
    if mdf_version == 4 and group.channel_group.flags & VARIABLE_LENGTH_FLAG:
        return "records with lengths of their own"
    if master is None:
        return "no clock"
    if mdf_version == 4 and group.channels[master].sync_type != SECONDS_SYNCHRONISATION:
        return "its clock does not count seconds"
    return (
        ""
        if _bits_within_record(group, group.channels[master], mdf_version)
        else ("its clock lies outside the records")
    )


def _why_channel_unusable(group: Any, channel_index: int, mdf_version: int) -> str:
    """Reason why a channel does not give one number per sample; empty if it does."""
    channel = group.channels[channel_index]
    conversion = 0 if channel.conversion is None else channel.conversion.conversion_type
    if mdf_version == 4 and channel.flags & ALL_INVALID:
        return "marked as invalid by the recorder"
    numbers = (
        channel.channel_type == 0
        and channel.data_type in NUMBER_TYPES[mdf_version]
        and conversion in NUMERIC_CONVERSIONS[mdf_version]
    )
    if not numbers or group.channel_dependencies[channel_index]:
        return "no numbers"
    return (
        ""
        if _bits_within_record(group, channel, mdf_version)
        else ("bits outside the records (a damaged file has such)")
    )


def _bits_within_record(group: Any, channel: Any, mdf_version: int) -> bool:
    """Whether a channel's bits lie inside its records. asammdf copies without this check and could crash the
    process."""
    records, whole = group.channel_group, channel.data_type in WHOLE_NUMBER_TYPES[mdf_version]
    if mdf_version == 4 and channel.channel_type == VIRTUAL_MASTER:
        return True
    begin = 8 * channel.byte_offset + channel.bit_offset if mdf_version == 4 else channel.start_offset
    begin += 8 * getattr(channel, "additional_byte_offset", 0) if mdf_version == 3 else 0
    marked = mdf_version == 4 and channel.flags & INVALIDATION_FLAGS
    return (
        0 <= begin <= begin + channel.bit_count <= 8 * records.samples_byte_nr
        and (0 < channel.bit_count <= 64 if whole else begin % 8 == 0 and channel.bit_count in (16, 32, 64))
        and (not marked or channel.pos_invalidation_bit < 8 * records.invalidation_bytes_nr)
    )


def _value_step(channel: Any, mdf_version: int) -> float:
    """Step between values of a channel stored as whole numbers, in its unit; 0 for floating-point values and nonlinear
    conversions."""
    if channel.data_type not in WHOLE_NUMBER_TYPES[mdf_version]:
        return 0.0
    conversion = channel.conversion
    if conversion is None or conversion.conversion_type == (0 if mdf_version == 4 else 65535):
        return 1.0
    return abs(float(conversion.a)) if conversion.conversion_type == LINEAR_CONVERSION[mdf_version] else 0.0


def _plain_comment(comment: str) -> str:
    """Text of a comment without XML tags."""
    if not comment.lstrip().startswith("<"):
        return comment.strip()
    try:
        root = ElementTree.fromstring(re.sub(r'\sxmlns="[^"]*"', "", comment))
    except ElementTree.ParseError:
        return comment.strip()
    return (root.findtext(".//TX") or "").strip()


def _start_time(mdf_path: Path, file_header: Any, mdf_version: int) -> tuple[datetime | None, list[Finding]]:
    """Date and time at time 0; None, with a finding, where the file does not give the time zone."""
    if not getattr(file_header, "abs_time", 0):
        return None, [flaw_finding(mdf_path, "note", "the file does not say when it was measured")]
    if mdf_version == 4 and file_header.time_flags & LOCAL_TIME_FLAG:
        clock = datetime.fromtimestamp(file_header.abs_time / 1e9, UTC)
        text = f"the start ({clock:%Y-%m-%d %H:%M:%S}) is local in a zone that the file does not name, and is not used"
        return None, [flaw_finding(mdf_path, "doubt", text)]
    minutes = 60 * file_header.tz_offset if mdf_version == 3 else 0
    if mdf_version == 4 and file_header.time_flags & OFFSET_VALID_FLAG:
        minutes = file_header.tz_offset + file_header.daylight_save_time
    seconds, nanoseconds = divmod(file_header.abs_time, 10**9)
    zone = timezone(timedelta(minutes=minutes))
    return datetime.fromtimestamp(seconds, zone) + timedelta(microseconds=nanoseconds // 1000), []
