"""Writes TDMS by npTDMS: a segment per block, the clock as waveform properties of every channel."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.measured.formats.writing import Group


def write_tdms(path: Path, part: Path, groups: Sequence[Group], start: datetime | None, comment: str) -> None:
    """Write the groups one after the other, each block as one segment."""
    try:
        from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
    except ImportError:
        raise InputError(path, "", None, "TDMS files need npTDMS: pip install 'twinrig[measured]'") from None
    with TdmsWriter(str(part)) as file:
        file.write_segment([RootObject({"description": comment} if comment else {})])
        for number, group in enumerate(groups, start=1):
            properties = [clock(group, start) | text for text in texts(group)]
            file.write_segment([GroupObject(f"group {number}", {})])
            for first, values in group.rows(path):
                columns = np.ascontiguousarray(values.T)
                file.write_segment(
                    [
                        ChannelObject(f"group {number}", name, column, own if first == 0 else {})
                        for name, column, own in zip(group.names, columns, properties, strict=True)
                    ]
                )


def clock(group: Group, start: datetime | None) -> dict[str, object]:
    """Waveform properties of one group."""
    own: dict[str, object] = {"wf_increment": float(group.period), "wf_start_offset": 0.0, "wf_xunit_string": "s"}
    if start is not None:
        own["wf_start_time"] = np.datetime64(start.astimezone(UTC).replace(tzinfo=None), "us")
    return own


def texts(group: Group) -> list[dict[str, object]]:
    """Unit and comment of every channel, where it has them."""
    keys = ("unit_string", "description")
    return [
        {key: text for key, text in zip(keys, pair, strict=True) if text}
        for pair in zip(group.units, group.comments, strict=True)
    ]
