"""Reader of TDMS files, as LabVIEW and DIAdem write them, by npTDMS: channels in groups, each with a clock of its own.

A channel's times are wf_start_offset + i wf_increment after its wf_start_time; without an increment they are those of
the one channel of its group that is called time and counts seconds. Time 0 of the file is the earliest wf_start_time.
An index file beside the file is not read: it may be older than the data.
"""

import io
import logging
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.channel import FileChannel
from models.measured.formats.opened import (
    OpenFile,
    SampleSpan,
    SkippedChannels,
    distinct_names,
    flaw_finding,
    library_errors_as_input,
    no_readable_channel_error,
)

UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")
"""Properties of a channel that may hold its unit."""
TIME_CHANNEL_NAMES = ("time", "zeit", "t")
"""Names of a channel that holds times."""
SECOND_SPELLINGS = ("", "s", "sec", "seconds")
"""Accepted spellings of the unit second."""
LEAD_IN_LENGTH, OPEN_END = 28, 2**64 - 1
"""Length (bytes) of a segment's lead-in, and the length stated for a segment that its writer never finished."""
TDMS_EPOCH = datetime(1904, 1, 1, tzinfo=UTC)
"""Zero of the TDMS time scale: a start on this day was never set."""


@dataclass(frozen=True)
class ChannelLocation:
    """Location of a channel's data: group and name in the file, and either the name of its time channel, or first time
    and increment (s)."""

    group: str
    name: str
    clock: str
    first: float
    increment: float


@dataclass(frozen=True)
class TdmsData(OpenFile):
    """Reader of a TDMS file with the location of every channel."""

    channel_places: tuple[ChannelLocation, ...]

    def pieces(
        self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times and values of each span, read separately for each channel."""
        places = [self.channel_places[i] for i in channel_indices]
        with BoundedFile(self.path) as file:
            data = opened_tdms(self.path, file)
            for first, count in sample_spans:
                values = [np.asarray(data[each.group][each.name].read_data(first, count), float) for each in places]
                least = min(len(column) for column in values)
                place = places[0]
                times = place.increment * np.arange(first, first + least)
                if place.clock:
                    times = np.asarray(data[place.group][place.clock].read_data(first, least), float)
                yield place.first + times, np.column_stack([column[:least] for column in values])


class BoundedFile(io.BufferedReader):
    """A file whose reads never allocate more memory than the file's size, since a damaged length field may claim
    gigabytes."""

    def __init__(self, tdms_path: Path) -> None:
        super().__init__(io.FileIO(tdms_path))
        self.size = tdms_path.stat().st_size

    def read(self, byte_count: int | None = -1, /) -> bytes:
        """Read at most the bytes that remain in the file."""
        return super().read(
            byte_count if byte_count is None or byte_count < 0 else min(byte_count, max(self.size - self.tell(), 0))
        )


def opened_tdms(tdms_path: Path, bounded_file: BoundedFile) -> Any:
    """npTDMS's open file, with its terminal output suppressed; InputError where the package is missing."""
    try:
        from nptdms import TdmsFile
        from nptdms.log import log_manager
    except ImportError:
        raise InputError(tdms_path, "", None, "TDMS files need npTDMS: pip install 'twinrig[measured]'") from None
    log_manager.set_level(logging.CRITICAL)
    return TdmsFile.open(bounded_file, raw_timestamps=True)


def open_tdms(tdms_path: Path) -> TdmsData:
    """``TdmsData`` of a path with its list of channels; raises InputError where the file is damaged."""
    with library_errors_as_input(tdms_path):
        cut = check_segments(tdms_path)
        with BoundedFile(tdms_path) as file:
            return _file_with_channels(tdms_path, opened_tdms(tdms_path, file), cut)


def check_segments(tdms_path: Path) -> list[Finding]:
    """Findings on an incomplete last segment of a TDMS file; raises InputError for any other damage to the chain of
    segments."""
    size, place = tdms_path.stat().st_size, 0
    with tdms_path.open("rb") as file:
        while place < size:
            file.seek(place)
            lead = file.read(LEAD_IN_LENGTH)
            if not b"TDSm".startswith(lead[:4]):
                raise InputError(tdms_path, f"byte {place}", lead[:4].hex(" "), "a segment of TDMS must begin here")
            if len(lead) < LEAD_IN_LENGTH:
                return [_cut_off_finding(tdms_path, place)]
            order = ">" if lead[4] & 0x40 else "<"
            following, raw = struct.unpack(order + "QQ", lead[12:])
            if following == OPEN_END or place + LEAD_IN_LENGTH + following > size:
                if place == 0 and LEAD_IN_LENGTH + raw > size:
                    raise InputError(tdms_path, f"byte {size}", None, "the file ends before its first samples")
                return [_cut_off_finding(tdms_path, place)]
            if raw > following:
                raise InputError(
                    tdms_path, f"byte {place + 20}", raw, "the samples begin after the end of their segment"
                )
            place += LEAD_IN_LENGTH + following
    return []


def _cut_off_finding(tdms_path: Path, segment_offset: int) -> Finding:
    """Finding on a segment that is not complete."""
    return flaw_finding(
        tdms_path,
        "doubt",
        f"the segment at byte {segment_offset} is not complete: the file is cut off, and what is whole is read",
    )


def _file_with_channels(tdms_path: Path, tdms_file: Any, cut_off_findings: list[Finding]) -> TdmsData:
    """``TdmsData`` with the channels that hold numbers over time; channels with the same time axis form a group."""
    left_out = SkippedChannels()
    usable = [
        (group, channel)
        for group in tdms_file.groups()
        for channel in group.channels()
        if _is_numeric(channel, left_out)
    ]
    if sum(len(channel) for _, channel in usable) > tdms_path.stat().st_size:
        raise InputError(tdms_path, "channels", None, "more samples are announced than the file has bytes")
    zero = min((start for _, channel in usable if (start := _start_in_utc(channel)) is not None), default=None)
    with_clock = [
        (channel, place)
        for group, channel in usable
        if (place := _channel_location(group, channel, zero, left_out)) is not None
    ]
    findings = [*cut_off_findings, *left_out.findings(tdms_path)]
    if not with_clock:
        raise no_readable_channel_error(tdms_path, findings)
    clocks = [(place.group, place.clock, place.first, place.increment) for _, place in with_clock]
    counts = [len(channel) for channel, _ in with_clock]
    if cut_off_findings:
        counts = [min(n for n, other in zip(counts, clocks, strict=True) if other == clock) for clock in clocks]
    keys = list(zip(clocks, counts, strict=True))
    names, repeated = distinct_names(
        tdms_path, [place.name for _, place in with_clock], [place.group for _, place in with_clock]
    )
    channels = tuple(
        FileChannel(
            name,
            _property_text(channel, *UNIT_PROPERTIES),
            _property_text(channel, "description"),
            keys.index(key),
            key[1],
            None if place.clock else place.increment,
            _value_step(channel),
            place.group,
        )
        for name, key, (channel, place) in zip(names, keys, with_clock, strict=True)
    )
    comment = str(tdms_file.properties.get("description", "")).strip()
    return TdmsData(tdms_path, channels, zero, comment, (*findings, *repeated), tuple(place for _, place in with_clock))


def _is_numeric(tdms_channel: Any, skipped_channels: SkippedChannels) -> bool:
    """Whether a channel holds real numbers, one or more."""
    if len(tdms_channel) and tdms_channel.data_type is not None and tdms_channel.dtype.kind in "iuf":
        return True
    skipped_channels.add("no numbers" if len(tdms_channel) else "no samples", repr(tdms_channel.name))
    return False


def _channel_location(
    tdms_group: Any, tdms_channel: Any, time_zero: datetime | None, skipped_channels: SkippedChannels
) -> ChannelLocation | None:
    """Location of a channel's samples and times; None where it has no time axis, or is a time axis itself."""
    properties, start = tdms_channel.properties, _start_in_utc(tdms_channel)
    late = 0.0 if time_zero is None or start is None else (start - time_zero).total_seconds()
    increment = float(properties.get("wf_increment", 0.0))
    if str(properties.get("wf_xunit_string", "s")).casefold() not in SECOND_SPELLINGS:
        skipped_channels.add("its clock does not count seconds", repr(tdms_channel.name))
        return None
    if np.isfinite(increment) and increment > 0.0:
        return ChannelLocation(
            tdms_group.name, tdms_channel.name, "", late + float(properties.get("wf_start_offset", 0.0)), increment
        )
    clocks = [
        clock
        for clock in tdms_group.channels()
        if clock.name.casefold() in TIME_CHANNEL_NAMES
        and len(clock) == len(tdms_channel)
        and _property_text(clock, *UNIT_PROPERTIES).casefold() in SECOND_SPELLINGS
    ]
    if tdms_channel.name.casefold() in TIME_CHANNEL_NAMES and clocks:
        return None
    if len(clocks) != 1:
        skipped_channels.add(
            "no clock (wf_increment, or one channel 'time' in s of the same length)", repr(tdms_channel.name)
        )
        return None
    return ChannelLocation(tdms_group.name, tdms_channel.name, clocks[0].name, late, 0.0)


def _start_in_utc(tdms_channel: Any) -> datetime | None:
    """Date and time in UTC at which a channel begins; None where the file does not say."""
    stamp = tdms_channel.properties.get("wf_start_time")
    if not hasattr(stamp, "seconds"):
        return None
    start = TDMS_EPOCH + timedelta(
        seconds=int(stamp.seconds), microseconds=round(stamp.second_fractions * 2**-64 * 1e6)
    )
    return None if start - TDMS_EPOCH < timedelta(days=1) else start


def _property_text(tdms_channel: Any, *property_names: str) -> str:
    """Value of the first of the named properties that a channel has, as text."""
    return next(
        (str(tdms_channel.properties[name]).strip() for name in property_names if name in tdms_channel.properties), ""
    )


def _value_step(tdms_channel: Any) -> float:
    """Step between values stored as whole numbers without a scaling; 0 otherwise."""
    scaled = any(name.startswith("NI_Scale") for name in tdms_channel.properties)
    return 1.0 if tdms_channel.dtype.kind in "iu" and not scaled else 0.0
