"""Damaged and unusual ASAM MDF files."""

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
    FileMaker,
    Files,
    OddFile,
    Truth,
    altered_file_maker,
    file_of_300_channels,
    file_of_bytes,
    file_of_two_rates,
    odd_files,
    patched_bytes,
    usual_file,
    usual_file_called,
    usual_truth,
)

DATA = 24
"""Length (bytes) of a block's head, which comes before its links."""


def mdf_file(
    *channels_by_group: dict[str, Any],
    mdf_version: str = "4.10",
    compression: Literal[0, 2] = 0,
    start_date: datetime | None = None,
    sample_times: np.ndarray = SAMPLE_TIMES,
    group_names: tuple[str, ...] = (),
) -> FileMaker:
    """Make an MDF file. Each group maps channel names to samples or to keywords of asammdf's ``Signal``;
    ``group_names`` are the names of the groups."""

    def make(output_folder: Path) -> Path:
        from asammdf import MDF, Signal

        path = output_folder / ("odd.mdf" if mdf_version < "4" else "odd.mf4")
        file = MDF(version=mdf_version)
        if start_date is not None:
            file.header.start_time = start_date
        for group, family in zip(channels_by_group, group_names or [""] * len(channels_by_group), strict=True):
            signal_settings = {
                name: data if isinstance(data, dict) else {"samples": data} for name, data in group.items()
            }
            file.append(
                [
                    Signal(name=name, timestamps=sample_times[: len(data["samples"])], **data)
                    for name, data in signal_settings.items()
                ],
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
MDF4, MDF3 = usual_file(".mf4"), mdf_file(USUAL_CHANNELS, mdf_version="3.30")


def first_block_offset(raw_bytes: bytes, block_type: bytes) -> int:
    """Offset (bytes) of the first block of a kind."""
    return next(i for i in range(0, len(raw_bytes), 8) if raw_bytes[i : i + 4] == block_type)


def with_block_data(raw_bytes: bytes, block_type: bytes, byte_offset: int, new_bytes: bytes) -> bytes:
    """Bytes of a file with the data of a block replaced from an offset on. The data come after the block's links."""
    block_start = first_block_offset(raw_bytes, block_type)
    return patched_bytes(
        raw_bytes,
        block_start + DATA + 8 * struct.unpack_from("<Q", raw_bytes, block_start + 16)[0] + byte_offset,
        new_bytes,
    )


def with_changed_block(block_type: bytes, byte_offset: int, new_bytes: bytes, make_file: FileMaker = MDF4) -> FileMaker:
    """Make a file with some bytes in a block's data replaced."""
    return altered_file_maker(make_file, lambda data: with_block_data(data, block_type, byte_offset, new_bytes))


def with_block_number(block_type: bytes, byte_offset: int, new_number: int) -> FileMaker:
    """Make the usual file with a number replaced in the head or the links of a block."""
    return altered_file_maker(
        MDF4,
        lambda data: patched_bytes(
            data, first_block_offset(data, block_type) + byte_offset, struct.pack("<Q", new_number)
        ),
    )


def with_looped_block(block_type: bytes) -> FileMaker:
    """Make the usual file with a block that links to itself as the next one."""
    return altered_file_maker(
        MDF4,
        lambda data: patched_bytes(
            data, first_block_offset(data, block_type) + DATA, struct.pack("<Q", first_block_offset(data, block_type))
        ),
    )


def with_other_clock(byte_offset: int, new_bytes: bytes) -> FileMaker:
    """Make the usual file with bytes of its time channel's description replaced. This block is found by its type, 2,
    which comes after eight links."""

    def change(raw_bytes: bytes) -> bytes:
        master = next(
            i for i in range(0, len(raw_bytes), 8) if raw_bytes[i : i + 4] == b"##CN" and raw_bytes[i + 88] == 2
        )
        return patched_bytes(raw_bytes, master + 88 + byte_offset, new_bytes)

    return altered_file_maker(MDF4, change)


def with_other_head(byte_offset: int, new_bytes: bytes, byte_count: int | None = None) -> FileMaker:
    """Make the usual file with bytes near its beginning replaced, and optionally only its first bytes."""
    return altered_file_maker(MDF4, lambda data: patched_bytes(data, byte_offset, new_bytes)[:byte_count])


def truth_of_channel(channel_name: str, expected_values: np.ndarray, sample_times: np.ndarray = SAMPLE_TIMES) -> Truth:
    """Expected values of a file with a single channel."""
    return {channel_name: (sample_times, expected_values)}


WHOLE_NUMBERS = np.arange(SAMPLE_COUNT, dtype="i2")
INVALID = np.arange(SAMPLE_COUNT) % 11 == 3
LOST_SAMPLES = np.where(FX < -50.0, np.nan, FZ)

STOPPED = np.where(np.arange(SAMPLE_COUNT) == 9, np.nan, SAMPLE_TIMES)

REFUSED: Files = {
    "MDF 4 cut in its header": ("the first block is incomplete", with_other_head(0, b"MDF", 100), "cut off"),
    "MDF 4 of one word": ("an identification of 8 bytes", file_of_bytes(b"MDF     ", "odd.mf4"), "version"),
    "MDF 4 with another beginning": ("one letter is wrong", with_other_head(0, b"MDX"), "no known format"),
    "MDF 4 never finished": (
        "the recorder lost power: counters are not yet written",
        with_other_head(0, b"UnFinMF "),
        "finalise",
    ),
    "MDF 4 never finished, by its flags": (
        "the name is right, the flags are set",
        with_other_head(60, b"\5\0"),
        "finalise",
    ),
    "MDF 4 of version 9": ("nobody knows it", with_other_head(8, b"9.99"), "version"),
    "MDF 3 cut": ("the records are incomplete", altered_file_maker(MDF3, lambda data: data[:-400]), ""),
    "MDF 4 with a block that follows itself": (
        "a reader goes round for ever",
        with_looped_block(b"##CN"),
        "leads back",
    ),
    "MDF 4 with a group that follows itself": (
        "a reader goes round for ever",
        with_looped_block(b"##DG"),
        "leads back",
    ),
    "MDF 4 with a link into the samples": (
        "no block begins there",
        with_block_number(b"##DG", DATA + 8, 2**13 + 1),
        "begin",
    ),
    "MDF 4 with a link beyond the file": ("nothing is there", with_block_number(b"##DG", DATA, 2**40), "cut off"),
    "MDF 4 with a block of a huge length": (
        "a reader makes room for it",
        with_block_number(b"##DT", 8, 2**50),
        "cut off",
    ),
    "MDF 4 with a huge number of links": (
        "a reader makes room for them",
        with_block_number(b"##CG", 16, 2**40),
        "links",
    ),
    "MDF 4 of a huge number of records": (
        "a reader makes room for them",
        with_changed_block(b"##CG", 8, struct.pack("<Q", 2**50)),
        "records",
    ),
    "MDF 3 of a huge number of records": (
        "a reader makes room for them",
        altered_file_maker(MDF3, lambda data: patched_bytes(data, data.index(b"CG") + 22, b"\xff" * 4)),
        "too short",
    ),
    "MDF 4 of a huge number of records of unknown length": (
        "no length tells how many there are",
        with_changed_block(b"##CG", 16, b"\1", with_changed_block(b"##CG", 8, struct.pack("<Q", 2**50))),
        "lengths of their own",
    ),
    "MDF 4 with a channel outside its records": (
        "a library copies what lies behind them",
        with_changed_block(b"##CN", 4, struct.pack("<L", 2**24)),
        "outside the records",
    ),
    "MDF 4 of one record more than there is": (
        "the last one is made up",
        with_changed_block(b"##CG", 8, struct.pack("<Q", SAMPLE_COUNT + 1)),
        "records",
    ),
    "MDF 4 of no records": (
        "a recording that never began",
        with_changed_block(b"##CG", 8, struct.pack("<Q", 0)),
        "no samples",
    ),
    "MDF 4 without channels": ("an empty file of a recorder", mdf_file(), "no channel"),
    "MDF 4 without a clock": ("records have no times", with_other_clock(0, b"\0\0"), "no clock"),
    "MDF 4 over the angle of a shaft": (
        "the clock counts radians",
        with_other_clock(1, b"\2"),
        "does not count seconds",
    ),
    "MDF 4 that claims to be a terabyte when unpacked": (
        "a reader makes room for it",
        with_changed_block(b"##DZ", 8, struct.pack("<Q", 2**40), mdf_file(USUAL_CHANNELS, compression=2)),
        "packed bytes",
    ),
    "MDF 4 with inf": (
        "an overflow of the amplifier",
        mdf_file({"Fz": np.where(FX < -50.0, np.inf, FZ)}),
        "channel 'Fz', sample 21",
    ),
    "MDF 4 with a clock of nan": (
        "a time is no time",
        mdf_file({"Fz": FZ}, sample_times=STOPPED),
        "channel 'time', sample 9",
    ),
}
NAMED: Files = {
    "MDF 4 of fewer records than there are": (
        "counters of a recorder that stopped early",
        with_changed_block(b"##CG", 8, struct.pack("<Q", SAMPLE_COUNT - 5)),
        "announced and read",
    ),
    "MDF 4 with texts": (
        "remarks of the driver in a channel",
        mdf_file({"Fz": FZ, "remark": {"samples": np.array([b"abc"] * SAMPLE_COUNT), "encoding": "utf-8"}}),
        "no numbers: 'remark'",
        truth_of_channel("Fz", FZ),
    ),
    "MDF 4 with the same name twice": (
        "one in each group",
        mdf_file({"Fz": FZ}, {"Fz": FX}),
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "MDF 4 with a start without zone": (
        "eight o'clock where",
        mdf_file(USUAL_CHANNELS, start_date=datetime(2026, 11, 21, 8)),
        "is not used",
    ),
    "MDF 4 called odd.tdms": ("the extension says otherwise", usual_file_called(".mf4", "odd.tdms"), "extension"),
}
RIGHT: Files = {
    "MDF 3": (
        "another layout, the same samples",
        mdf_file(USUAL_CHANNELS, mdf_version="3.30", start_date=datetime.fromisoformat("2026-11-21T08:00:00+00:00")),
    ),
    "MDF 4 packed": ("samples are deflated", mdf_file(USUAL_CHANNELS, compression=2)),
    "MDF 4 of two rates": ("a common clock does not exist", file_of_two_rates(".mf4"), TWO_RATES),
    "MDF 4 with invalid samples": (
        "their values look like any other",
        mdf_file({"Fz": {"samples": FZ, "invalidation_bits": INVALID}, "Fx": FX}),
        usual_truth(Fz=np.where(INVALID, np.nan, FZ)),
    ),
    "MDF 4 of whole numbers": (
        "digits, a factor and an offset",
        mdf_file({"Fz": {"samples": WHOLE_NUMBERS, "conversion": {"a": 0.5, "b": -3.0}}}),
        truth_of_channel("Fz", 0.5 * WHOLE_NUMBERS - 3.0),
    ),
    "MDF 4 with umlauts": (
        "names beyond ASCII",
        mdf_file({"Kraft Räder/Ω": FZ}),
        truth_of_channel("Kraft Räder/Ω", FZ),
    ),
    "MDF 4 of 300 channels": ("long records", file_of_300_channels(".mf4"), MANY_CHANNELS),
    "MDF 4 with NaN": (
        "nothing was measured for a while",
        mdf_file({"Fz": LOST_SAMPLES, "Fx": FX}),
        usual_truth(Fz=LOST_SAMPLES),
    ),
    "MDF 4 whose clock goes back": (
        "sorting would hide it",
        mdf_file({"Fz": FZ}, sample_times=BACK),
        truth_of_channel("Fz", FZ, BACK),
    ),
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
    *odd_files(refused_files=REFUSED, files_with_message=NAMED, readable_files=RIGHT, greedy_names=GREEDY),
    *(
        OddFile(
            f"MDF {version[0]} whose groups are wheels",
            "every wheel has an Fz",
            mdf_file({"Fz": FZ}, {"Fz": FX}, mdf_version=version, group_names=("WFT VL", "WFT HR")),
            "named",
            "'WFT HR/Fz'",
            {"WFT VL/Fz": (SAMPLE_TIMES, FZ), "WFT HR/Fz": (SAMPLE_TIMES, FX)},
        )
        for version in ("4.10", "3.30")
    ),
)
