"""Odd TDMS files."""

import struct
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from models.measured.formats.writing import Group, write_tdms
from validation.measured.measured_files.csv import BACK, MANY, WIDE, raw
from validation.measured.measured_files.odd import (
    COUNT,
    FX,
    FZ,
    PERIOD,
    TIMES,
    Odd,
    Truth,
    cut,
    patched,
    usual,
    written,
)

LEAD = 28
"""Bytes that lead in a segment."""
CLOCK = {"wf_increment": PERIOD, "wf_start_offset": 0.0}
START = datetime(2026, 11, 21, 8, tzinfo=UTC)


def usual_file(folder: Path) -> Path:
    """Write the usual file."""
    return written(folder / "odd.tdms")


def channels(*own: tuple[str, str, Any, dict[str, Any]]) -> Callable[[Path], Path]:
    """Make a file of channels: group, name, samples, properties."""

    def make(folder: Path) -> Path:
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(str(folder / "odd.tdms")) as file:
            file.write_segment([ChannelObject(*one) for one in own])
        return folder / "odd.tdms"

    return make


def last_segment(path: Path) -> int:
    """Byte where the last segment begins."""
    return path.read_bytes().rindex(b"TDSm")


def changed(offset: int, new: bytes) -> Callable[[Path], Path]:
    """Make the usual file with other bytes, counted from the beginning of its last segment."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        return patched(path, last_segment(path) + offset, new)

    return make


def cut_by(count: int) -> Callable[[Path], Path]:
    """Make the usual file without its last bytes."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        return cut(path, len(path.read_bytes()) - count)

    return make


def count_of_values(new: int) -> Callable[[Path], Path]:
    """Make the usual file whose first channel claims another number of samples."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        place = path.read_bytes().rindex(struct.pack("<LLLQ", 20, 10, 1, COUNT))
        return patched(path, place + 12, struct.pack("<Q", new))

    return make


def beside_old_index(folder: Path) -> Path:
    """Make the usual file beside an index of another one."""
    other = written(folder / "other.tdms", ("a", "b", "c"), np.ones((5, 3)))
    data = other.read_bytes()
    other.unlink()
    (folder / "odd.tdms_index").write_bytes(data.replace(b"TDSm", b"TDSh"))
    return usual_file(folder)


def two_rates(folder: Path) -> Path:
    """Make a file of two groups of different rates."""
    groups = [
        Group((name,), ("N",), ("",), period, COUNT, [values[:, None]])
        for name, period, values in (("Fz", PERIOD, FZ), ("Fx", 0.05, FX))
    ]
    write_tdms(folder / "odd.tdms", folder / "odd.tdms", groups, START, "")
    return folder / "odd.tdms"


def one(name: str, values: Any, **properties: Any) -> tuple[str, str, Any, dict[str, Any]]:
    """Return a channel of the usual clock."""
    return "g", name, values, CLOCK | properties


def at(hour: int) -> np.datetime64:
    """A start."""
    return np.datetime64(f"2026-11-21T{hour:02d}:00:00")


def prefix(**values: np.ndarray) -> Truth:
    """Truth of some channels on the usual clock."""
    return {name: (TIMES, own) for name, own in values.items()}


FILES = (
    Odd(
        "TDMS cut in its samples", "the last channel has fewer samples than the first", cut_by(100), "named", "cut off"
    ),
    Odd(
        "TDMS cut in its first lead-in",
        "not a segment is whole",
        lambda folder: cut(usual_file(folder), 20),
        "refused",
        "cut off",
    ),
    Odd(
        "TDMS cut in a description",
        "channels without samples",
        lambda folder: cut(usual_file(folder), last_segment(folder / "odd.tdms") + 60),
        "refused",
        "cut off",
    ),
    Odd(
        "TDMS with another beginning",
        "one letter is wrong",
        lambda folder: patched(usual_file(folder), 0, b"tDSm"),
        "refused",
        "no known format",
    ),
    Odd(
        "TDMS whose second segment begins wrongly",
        "what follows is not where it should be",
        changed(0, b"XXXX"),
        "refused",
        "a segment of TDMS must begin here",
    ),
    Odd(
        "TDMS never finished",
        "the recorder lost power: the length of the segment is missing",
        changed(12, b"\xff" * 8),
        "named",
        "cut off",
    ),
    Odd(
        "TDMS of a huge segment",
        "a reader makes room for it",
        changed(12, struct.pack("<Q", 2**50)),
        "named",
        "cut off",
        greedy=True,
    ),
    Odd(
        "TDMS whose samples begin after their end",
        "an offset too large",
        changed(20, struct.pack("<Q", 2**40)),
        "refused",
        "after the end",
        greedy=True,
    ),
    Odd(
        "TDMS of a huge number of samples",
        "a reader makes room for them",
        count_of_values(2**60),
        "refused",
        "",
        greedy=True,
    ),
    Odd(
        "TDMS of a huge number of channels",
        "a reader looks for them to the end",
        changed(LEAD, b"\xff\xff\xff\x7f"),
        "refused",
        "damaged",
        greedy=True,
    ),
    Odd(
        "TDMS of a huge name",
        "a reader makes room for it",
        changed(LEAD + 4, b"\xff\xff\xff\x7f"),
        "refused",
        "damaged",
        greedy=True,
    ),
    Odd(
        "TDMS without a clock",
        "no increment and no channel of times",
        channels(("g", "Fz", FZ, {})),
        "refused",
        "no clock",
    ),
    Odd(
        "TDMS with an increment below zero",
        "time runs backwards",
        channels(one("Fz", FZ, wf_increment=-PERIOD)),
        "refused",
        "no clock",
    ),
    Odd(
        "TDMS with an increment of nan",
        "it passes every comparison",
        channels(one("Fz", FZ, wf_increment=np.nan)),
        "refused",
        "no clock",
    ),
    Odd(
        "TDMS over a path",
        "the increment is in m",
        channels(one("Fz", FZ, wf_xunit_string="m")),
        "refused",
        "does not count seconds",
    ),
    Odd(
        "TDMS with a channel of times",
        "the clock is a channel like any other",
        channels(("g", "time", TIMES, {"unit_string": "s"}), ("g", "Fz", FZ, {}), ("g", "Fx", FX, {})),
        "right",
    ),
    Odd(
        "TDMS whose clock goes back",
        "sorting would hide it",
        channels(("g", "time", BACK, {}), ("g", "Fz", FZ, {})),
        "right",
        truth={"Fz": (BACK, FZ)},
    ),
    Odd(
        "TDMS of two rates",
        "a common clock does not exist",
        two_rates,
        "right",
        truth={"Fz": (TIMES, FZ), "Fx": (0.05 * np.arange(COUNT), FX)},
    ),
    Odd(
        "TDMS of two rates in one group",
        "the clock belongs to the channel",
        channels(one("Fz", FZ), one("Fx", FX, wf_increment=0.05)),
        "right",
        truth={"Fz": (TIMES, FZ), "Fx": (0.05 * np.arange(COUNT), FX)},
    ),
    Odd(
        "TDMS of two starts",
        "one amplifier was switched on an hour later",
        channels(one("Fz", FZ, wf_start_time=at(8)), one("Fx", FX, wf_start_time=at(9))),
        "right",
        truth={"Fz": (TIMES, FZ), "Fx": (3600.0 + TIMES, FX)},
    ),
    Odd(
        "TDMS with a start offset",
        "the trigger came later",
        channels(one("Fz", FZ, wf_start_offset=-2.5)),
        "right",
        truth={"Fz": (TIMES - 2.5, FZ)},
    ),
    Odd(
        "TDMS of two lengths",
        "one channel has half the samples",
        channels(one("Fz", FZ), one("Fx", FX[:20])),
        "right",
        truth={"Fz": (TIMES, FZ), "Fx": (TIMES[:20], FX[:20])},
    ),
    Odd(
        "TDMS of no samples",
        "channels that were never written to",
        channels(one("Fz", FZ[:0])),
        "refused",
        "no samples",
    ),
    Odd(
        "TDMS with texts",
        "remarks of the driver in a channel",
        channels(one("Fz", FZ), one("remark", ["a"] * COUNT)),
        "named",
        "no numbers: 'remark'",
        prefix(Fz=FZ),
    ),
    Odd(
        "TDMS of whole numbers",
        "16 bits of a converter",
        channels(one("Fz", (1000 + np.arange(COUNT)).astype("i2"))),
        "right",
        truth=prefix(Fz=1000.0 + np.arange(COUNT)),
    ),
    Odd(
        "TDMS with the same name twice",
        "one in each group",
        channels(("a", "Fz", FZ, CLOCK), ("b", "Fz", FX, CLOCK)),
        "named",
        "2 channels are called 'Fz'",
        prefix(**{"a/Fz": FZ, "b/Fz": FX}),
    ),
    Odd(
        "TDMS whose groups are wheels",
        "every wheel has an Fz",
        channels(
            *(
                (group, name, values, CLOCK)
                for group in ("WFT VL", "WFT HR")
                for name, values in (("Fz", FZ), ("Fx", FX))
            )
        ),
        "named",
        "'WFT HR/Fz'",
        prefix(
            **{f"{group}/{name}": values for group in ("WFT VL", "WFT HR") for name, values in (("Fz", FZ), ("Fx", FX))}
        ),
    ),
    Odd(
        "TDMS with umlauts and quotes",
        "paths within the file are quoted",
        channels(("Größe 'a'", "Kraft 'Räder'/Ω", FZ, CLOCK)),
        "right",
        truth=prefix(**{"Kraft 'Räder'/Ω": FZ}),
    ),
    Odd(
        "TDMS of 300 channels",
        "a long description",
        lambda folder: written(folder / "odd.tdms", WIDE, MANY),
        "right",
        truth={name: (TIMES, MANY[:, i]) for i, name in enumerate(WIDE)},
    ),
    Odd(
        "TDMS with NaN",
        "nothing was measured for a while",
        channels(one("Fz", np.where(FX < -50, np.nan, FZ)), one("Fx", FX)),
        "right",
        truth=usual(Fz=np.where(FX < -50, np.nan, FZ)),
    ),
    Odd(
        "TDMS with inf",
        "an overflow of the amplifier",
        channels(one("Fz", np.where(FX < -50, np.inf, FZ))),
        "refused",
        "channel 'Fz', sample 21",
    ),
    Odd("TDMS beside an old index", "the index describes another file", beside_old_index, "right"),
    Odd(
        "index of a TDMS file", "it has no samples", raw(b"TDSh" + bytes(200), "odd.tdms_index"), "refused", "beside it"
    ),
    Odd(
        "TDMS called odd.rsp",
        "the extension says otherwise",
        lambda folder: usual_file(folder).rename(folder / "odd.rsp"),
        "named",
        "extension",
    ),
)
