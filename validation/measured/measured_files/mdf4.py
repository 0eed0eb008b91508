"""Odd files of ASAM MDF."""

import struct
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.measured.formats.mdf4 import suppressed_output
from validation.measured.measured_files.csv import BACK
from validation.measured.measured_files.odd import (
    FX,
    FZ,
    MANY_CHANNELS,
    REPEATED_NAME,
    SAMPLE_COUNT,
    SAMPLE_TIMES,
    TWO_RATES,
    Files,
    Make,
    OddFile,
    Truth,
    altered,
    called,
    every,
    patched,
    plain,
    raw,
    two_rates,
    usual,
    wide,
)

DATA = 24
"""Bytes of a block before its links."""


def signals(
    *groups: dict[str, Any],
    version: str = "4.10",
    compression: Literal[0, 2] = 0,
    start_date: datetime | None = None,
    times: np.ndarray = SAMPLE_TIMES,
    families: tuple[str, ...] = (),
) -> Make:
    """Make a file of groups, name -> samples or keywords of asammdf's Signal; ``families`` are their names."""

    def make(folder: Path) -> Path:
        from asammdf import MDF, Signal

        path = folder / ("odd.mdf" if version < "4" else "odd.mf4")
        file = MDF(version=version)
        if start_date is not None:
            file.header.start_time = start_date
        for group, family in zip(groups, families or [""] * len(groups), strict=True):
            plain = {name: data if isinstance(data, dict) else {"samples": data} for name, data in group.items()}
            file.append(
                [Signal(name=name, timestamps=times[: len(data["samples"])], **data) for name, data in plain.items()],
                acq_name=family,
                comment=family,
                common_timebase=True,
            )
        with suppressed_output():
            file.save(path, compression=compression)
            file.close()
        return path

    return make


USUAL_CHANNELS = {"Fz": FZ, "Fx": FX}
MDF4, MDF3 = plain(".mf4"), signals(USUAL_CHANNELS, version="3.30")


def block(raw_bytes: bytes, block_kind: bytes) -> int:
    """Byte where the first block of a kind begins."""
    return next(i for i in range(0, len(raw_bytes), 8) if raw_bytes[i : i + 4] == block_kind)


def inside(raw_bytes: bytes, block_kind: bytes, byte_offset: int, new_bytes: bytes) -> bytes:
    """Other bytes in a block's data, which stand after its links."""
    block_start = block(raw_bytes, block_kind)
    return patched(
        raw_bytes,
        block_start + DATA + 8 * struct.unpack_from("<Q", raw_bytes, block_start + 16)[0] + byte_offset,
        new_bytes,
    )


def changed(block_kind: bytes, byte_offset: int, new_bytes: bytes, make_file: Make = MDF4) -> Make:
    """Make a file with other bytes in a block's data."""
    return altered(make_file, lambda data: inside(data, block_kind, byte_offset, new_bytes))


def linked(block_kind: bytes, byte_offset: int, new_number: int) -> Make:
    """Make the usual file with another number in the head or a link of a block."""
    return altered(
        MDF4, lambda data: patched(data, block(data, block_kind) + byte_offset, struct.pack("<Q", new_number))
    )


def looped(block_kind: bytes) -> Make:
    """Make the usual file with a block that follows itself."""
    return altered(
        MDF4, lambda data: patched(data, block(data, block_kind) + DATA, struct.pack("<Q", block(data, block_kind)))
    )


def clocked(byte_offset: int, new_bytes: bytes) -> Make:
    """Make the usual file whose master channel is another one; its block has its kind, 2, after eight links."""

    def change(raw_bytes: bytes) -> bytes:
        master = next(
            i for i in range(0, len(raw_bytes), 8) if raw_bytes[i : i + 4] == b"##CN" and raw_bytes[i + 88] == 2
        )
        return patched(raw_bytes, master + 88 + byte_offset, new_bytes)

    return altered(MDF4, change)


def headed(byte_offset: int, new_bytes: bytes, length: int | None = None) -> Make:
    """Make the usual file, or its first bytes, with others at its beginning."""
    return altered(MDF4, lambda data: patched(data, byte_offset, new_bytes)[:length])


def only(name: str, values: np.ndarray, times: np.ndarray = SAMPLE_TIMES) -> Truth:
    """Truth of one channel."""
    return {name: (times, values)}


WHOLE_NUMBERS = np.arange(SAMPLE_COUNT, dtype="i2")
INVALID = np.arange(SAMPLE_COUNT) % 11 == 3
LOST_SAMPLES = np.where(FX < -50.0, np.nan, FZ)

STOPPED = np.where(np.arange(SAMPLE_COUNT) == 9, np.nan, SAMPLE_TIMES)

REFUSED: Files = {
    "MDF 4 cut in its header": ("the first block is incomplete", headed(0, b"MDF", 100), "cut off"),
    "MDF 4 of one word": ("an identification of 8 bytes", raw(b"MDF     ", "odd.mf4"), "version"),
    "MDF 4 with another beginning": ("one letter is wrong", headed(0, b"MDX"), "no known format"),
    "MDF 4 never finished": (
        "the recorder lost power: counters are not yet written",
        headed(0, b"UnFinMF "),
        "finalise",
    ),
    "MDF 4 never finished, by its flags": ("the name is right, the flags are set", headed(60, b"\5\0"), "finalise"),
    "MDF 4 of version 9": ("nobody knows it", headed(8, b"9.99"), "version"),
    "MDF 3 cut": ("the records are incomplete", altered(MDF3, lambda data: data[:-400]), ""),
    "MDF 4 with a block that follows itself": ("a reader goes round for ever", looped(b"##CN"), "leads back"),
    "MDF 4 with a group that follows itself": ("a reader goes round for ever", looped(b"##DG"), "leads back"),
    "MDF 4 with a link into the samples": ("no block begins there", linked(b"##DG", DATA + 8, 2**13 + 1), "begin"),
    "MDF 4 with a link beyond the file": ("nothing is there", linked(b"##DG", DATA, 2**40), "cut off"),
    "MDF 4 with a block of a huge length": ("a reader makes room for it", linked(b"##DT", 8, 2**50), "cut off"),
    "MDF 4 with a huge number of links": ("a reader makes room for them", linked(b"##CG", 16, 2**40), "links"),
    "MDF 4 of a huge number of records": (
        "a reader makes room for them",
        changed(b"##CG", 8, struct.pack("<Q", 2**50)),
        "records",
    ),
    "MDF 3 of a huge number of records": (
        "a reader makes room for them",
        altered(MDF3, lambda data: patched(data, data.index(b"CG") + 22, b"\xff" * 4)),
        "too short",
    ),
    "MDF 4 of a huge number of records of unknown length": (
        "no length tells how many there are",
        changed(b"##CG", 16, b"\1", changed(b"##CG", 8, struct.pack("<Q", 2**50))),
        "lengths of their own",
    ),
    "MDF 4 with a channel outside its records": (
        "a library copies what lies behind them",
        changed(b"##CN", 4, struct.pack("<L", 2**24)),
        "outside the records",
    ),
    "MDF 4 of one record more than there is": (
        "the last one is made up",
        changed(b"##CG", 8, struct.pack("<Q", SAMPLE_COUNT + 1)),
        "records",
    ),
    "MDF 4 of no records": ("a recording that never began", changed(b"##CG", 8, struct.pack("<Q", 0)), "no samples"),
    "MDF 4 without channels": ("an empty file of a recorder", signals(), "no channel"),
    "MDF 4 without a clock": ("records have no times", clocked(0, b"\0\0"), "no clock"),
    "MDF 4 over the angle of a shaft": ("the clock counts radians", clocked(1, b"\2"), "does not count seconds"),
    "MDF 4 that claims to be a terabyte when unpacked": (
        "a reader makes room for it",
        changed(b"##DZ", 8, struct.pack("<Q", 2**40), signals(USUAL_CHANNELS, compression=2)),
        "packed bytes",
    ),
    "MDF 4 with inf": (
        "an overflow of the amplifier",
        signals({"Fz": np.where(FX < -50.0, np.inf, FZ)}),
        "channel 'Fz', sample 21",
    ),
    "MDF 4 with a clock of nan": ("a time is no time", signals({"Fz": FZ}, times=STOPPED), "channel 'time', sample 9"),
}
NAMED: Files = {
    "MDF 4 of fewer records than there are": (
        "counters of a recorder that stopped early",
        changed(b"##CG", 8, struct.pack("<Q", SAMPLE_COUNT - 5)),
        "announced and read",
    ),
    "MDF 4 with texts": (
        "remarks of the driver in a channel",
        signals({"Fz": FZ, "remark": {"samples": np.array([b"abc"] * SAMPLE_COUNT), "encoding": "utf-8"}}),
        "no numbers: 'remark'",
        only("Fz", FZ),
    ),
    "MDF 4 with the same name twice": (
        "one in each group",
        signals({"Fz": FZ}, {"Fz": FX}),
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "MDF 4 with a start without zone": (
        "eight o'clock where",
        signals(USUAL_CHANNELS, start_date=datetime(2026, 11, 21, 8)),
        "is not used",
    ),
    "MDF 4 called odd.tdms": ("the extension says otherwise", called(".mf4", "odd.tdms"), "extension"),
}
RIGHT: Files = {
    "MDF 3": (
        "another layout, the same samples",
        signals(USUAL_CHANNELS, version="3.30", start_date=datetime.fromisoformat("2026-11-21T08:00:00+00:00")),
    ),
    "MDF 4 packed": ("samples are deflated", signals(USUAL_CHANNELS, compression=2)),
    "MDF 4 of two rates": ("a common clock does not exist", two_rates(".mf4"), TWO_RATES),
    "MDF 4 with invalid samples": (
        "their values look like any other",
        signals({"Fz": {"samples": FZ, "invalidation_bits": INVALID}, "Fx": FX}),
        usual(Fz=np.where(INVALID, np.nan, FZ)),
    ),
    "MDF 4 of whole numbers": (
        "digits, a factor and an offset",
        signals({"Fz": {"samples": WHOLE_NUMBERS, "conversion": {"a": 0.5, "b": -3.0}}}),
        only("Fz", 0.5 * WHOLE_NUMBERS - 3.0),
    ),
    "MDF 4 with umlauts": ("names beyond ASCII", signals({"Kraft Räder/Ω": FZ}), only("Kraft Räder/Ω", FZ)),
    "MDF 4 of 300 channels": ("long records", wide(".mf4"), MANY_CHANNELS),
    "MDF 4 with NaN": (
        "nothing was measured for a while",
        signals({"Fz": LOST_SAMPLES, "Fx": FX}),
        usual(Fz=LOST_SAMPLES),
    ),
    "MDF 4 whose clock goes back": ("sorting would hide it", signals({"Fz": FZ}, times=BACK), only("Fz", FZ, BACK)),
}
GREEDY = (
    "MDF 4 with a block that follows itself",
    "MDF 4 with a group that follows itself",
    "MDF 4 with a link beyond the file",
    "MDF 4 with a block of a huge length",
    "MDF 4 with a huge number of links",
    "MDF 4 of a huge number of records",
    "MDF 3 of a huge number of records",
    "MDF 4 of a huge number of records of unknown length",
    "MDF 4 that claims to be a terabyte when unpacked",
)
FILES = (
    *every(refused=REFUSED, named_files=NAMED, right_files=RIGHT, greedy=GREEDY),
    *(
        OddFile(
            f"MDF {version[0]} whose groups are wheels",
            "every wheel has an Fz",
            signals({"Fz": FZ}, {"Fz": FX}, version=version, families=("WFT VL", "WFT HR")),
            "named",
            "'WFT HR/Fz'",
            {"WFT VL/Fz": (SAMPLE_TIMES, FZ), "WFT HR/Fz": (SAMPLE_TIMES, FX)},
        )
        for version in ("4.10", "3.30")
    ),
)
