"""Damaged and unusual TDMS files."""

import struct
from pathlib import Path
from typing import Any

import numpy as np

from validation.measured.measured_files.csv import BACK
from validation.measured.measured_files.odd import (
    FX,
    FZ,
    MANY_CHANNELS,
    SAMPLE_COUNT,
    SAMPLE_PERIOD,
    SAMPLE_TIMES,
    SLOW_PERIOD,
    TWO_RATES,
    FileMaker,
    Files,
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
    write_usual_file,
)

LEAD = 28
"""Length (bytes) of the lead-in of a segment."""
CLOCK = {"wf_increment": SAMPLE_PERIOD, "wf_start_offset": 0.0}


TDMS = usual_file(".tdms")


def tdms_file(*channel_columns: tuple[str, str, Any, dict[str, Any]]) -> FileMaker:
    """Make a TDMS file. Each column gives group, name, samples and properties of a channel."""

    def make(output_folder: Path) -> Path:
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(str(output_folder / "odd.tdms")) as file:
            file.write_segment([ChannelObject(*column) for column in channel_columns])
        return output_folder / "odd.tdms"

    return make


def with_changed_bytes(byte_offset: int, new_bytes: bytes, byte_count: int | None = None) -> FileMaker:
    """Make the usual file with bytes replaced, or cut off at ``byte_count``. Both offsets count from the start of its
    last segment."""

    def change(raw_bytes: bytes) -> bytes:
        begin = raw_bytes.rindex(b"TDSm")
        return patched_bytes(raw_bytes, begin + byte_offset, new_bytes)[
            : None if byte_count is None else begin + byte_count
        ]

    return altered_file_maker(TDMS, change)


def cut_by(byte_count: int) -> FileMaker:
    """Make the usual file without its last ``byte_count`` bytes."""
    return altered_file_maker(TDMS, lambda data: data[:-byte_count])


def with_stated_count(stated_sample_count: int) -> FileMaker:
    """Make the usual file with a wrong number of samples stated for its first channel."""
    index, number = struct.pack("<LLLQ", 20, 10, 1, SAMPLE_COUNT), struct.pack("<Q", stated_sample_count)
    return altered_file_maker(TDMS, lambda data: patched_bytes(data, data.rindex(index) + 12, number))


def beside_old_index(output_folder: Path) -> Path:
    """Write the usual file next to an index file that belongs to another TDMS file."""
    other_path = write_usual_file(output_folder / "other.tdms", ("a", "b", "c"), np.ones((5, 3)))
    data = other_path.read_bytes()
    other_path.unlink()
    (output_folder / "odd.tdms_index").write_bytes(data.replace(b"TDSm", b"TDSh"))
    return TDMS(output_folder)


def channel_named(channel_name: str, channel_values: Any, **properties: Any) -> tuple[str, str, Any, dict[str, Any]]:
    """A channel with the usual clock, as group, name, samples and properties."""
    return "g", channel_name, channel_values, CLOCK | properties


def start_time(start_hour: int) -> np.datetime64:
    """Start time of a recording that begins at a given hour."""
    return np.datetime64(f"2026-11-21T{start_hour:02d}:00:00")


def usual_truth_of(**channel_values: np.ndarray) -> Truth:
    """Expected times and values of channels that have the usual clock."""
    return {name: (SAMPLE_TIMES, samples) for name, samples in channel_values.items()}


REFUSED: Files = {
    "TDMS cut in its first lead-in": (
        "not a segment is whole",
        altered_file_maker(TDMS, lambda data: data[:20]),
        "cut off",
    ),
    "TDMS cut in a description": ("channels without samples", with_changed_bytes(0, b"", 60), "cut off"),
    "TDMS with another beginning": (
        "one letter is wrong",
        altered_file_maker(TDMS, lambda data: patched_bytes(data, 0, b"tDSm")),
        "no known format",
    ),
    "TDMS whose second segment begins wrongly": (
        "what follows is not where it should be",
        with_changed_bytes(0, b"XXXX"),
        "a segment of TDMS must begin here",
    ),
    "TDMS whose samples begin after their end": (
        "an offset too large",
        with_changed_bytes(20, struct.pack("<Q", 2**40)),
        "after the end",
    ),
    "TDMS of a huge number of samples": ("a reader makes room for them", with_stated_count(2**60), ""),
    "TDMS of a huge number of channels": (
        "a reader looks for them to the end",
        with_changed_bytes(LEAD, b"\xff\xff\xff\x7f"),
        "damaged",
    ),
    "TDMS of a huge name": ("a reader makes room for it", with_changed_bytes(LEAD + 4, b"\xff\xff\xff\x7f"), "damaged"),
    "TDMS without a clock": ("no increment and no channel of times", tdms_file(("g", "Fz", FZ, {})), "no clock"),
    "TDMS with an increment below zero": (
        "time runs backwards",
        tdms_file(channel_named("Fz", FZ, wf_increment=-SAMPLE_PERIOD)),
        "no clock",
    ),
    "TDMS with an increment of nan": (
        "it passes every comparison",
        tdms_file(channel_named("Fz", FZ, wf_increment=np.nan)),
        "no clock",
    ),
    "TDMS over a path": (
        "the increment is in m",
        tdms_file(channel_named("Fz", FZ, wf_xunit_string="m")),
        "does not count seconds",
    ),
    "TDMS of no samples": ("channels that were never written to", tdms_file(channel_named("Fz", FZ[:0])), "no samples"),
    "TDMS with inf": (
        "an overflow of the amplifier",
        tdms_file(channel_named("Fz", np.where(FX < -50, np.inf, FZ))),
        "channel 'Fz', sample 21",
    ),
    "index of a TDMS file": ("it has no samples", file_of_bytes(b"TDSh" + bytes(200), "odd.tdms_index"), "beside it"),
}
NAMED: Files = {
    "TDMS cut in its samples": ("the last channel has fewer samples than the first", cut_by(100), "cut off"),
    "TDMS never finished": (
        "the recorder lost power: the length of the segment is missing",
        with_changed_bytes(12, b"\xff" * 8),
        "cut off",
    ),
    "TDMS of a huge segment": (
        "a reader makes room for it",
        with_changed_bytes(12, struct.pack("<Q", 2**50)),
        "cut off",
    ),
    "TDMS with texts": (
        "remarks of the driver in a channel",
        tdms_file(channel_named("Fz", FZ), channel_named("remark", ["a"] * SAMPLE_COUNT)),
        "no numbers: 'remark'",
        usual_truth_of(Fz=FZ),
    ),
    "TDMS with the same name twice": (
        "one in each group",
        tdms_file(("a", "Fz", FZ, CLOCK), ("b", "Fz", FX, CLOCK)),
        "2 channels are called 'Fz'",
        usual_truth_of(**{"a/Fz": FZ, "b/Fz": FX}),
    ),
    "TDMS whose groups are wheels": (
        "every wheel has an Fz",
        tdms_file(
            *(
                (group, name, values, CLOCK)
                for group in ("WFT VL", "WFT HR")
                for name, values in (("Fz", FZ), ("Fx", FX))
            )
        ),
        "'WFT HR/Fz'",
        usual_truth_of(
            **{f"{group}/{name}": values for group in ("WFT VL", "WFT HR") for name, values in (("Fz", FZ), ("Fx", FX))}
        ),
    ),
    "TDMS called odd.rsp": ("the extension says otherwise", usual_file_called(".tdms", "odd.rsp"), "extension"),
}
RIGHT: Files = {
    "TDMS with a channel of times": (
        "the clock is a channel like any other",
        tdms_file(("g", "time", SAMPLE_TIMES, {"unit_string": "s"}), ("g", "Fz", FZ, {}), ("g", "Fx", FX, {})),
    ),
    "TDMS whose clock goes back": (
        "sorting would hide it",
        tdms_file(("g", "time", BACK, {}), ("g", "Fz", FZ, {})),
        {"Fz": (BACK, FZ)},
    ),
    "TDMS of two rates": ("a common clock does not exist", file_of_two_rates(".tdms"), TWO_RATES),
    "TDMS of two rates in one group": (
        "the clock belongs to the channel",
        tdms_file(channel_named("Fz", FZ), channel_named("Fx", FX, wf_increment=SLOW_PERIOD)),
        TWO_RATES,
    ),
    "TDMS of two starts": (
        "one amplifier was switched on an hour later",
        tdms_file(
            channel_named("Fz", FZ, wf_start_time=start_time(8)), channel_named("Fx", FX, wf_start_time=start_time(9))
        ),
        {"Fz": (SAMPLE_TIMES, FZ), "Fx": (3600.0 + SAMPLE_TIMES, FX)},
    ),
    "TDMS with a start offset": (
        "the trigger came later",
        tdms_file(channel_named("Fz", FZ, wf_start_offset=-2.5)),
        {"Fz": (SAMPLE_TIMES - 2.5, FZ)},
    ),
    "TDMS of two lengths": (
        "one channel has half the samples",
        tdms_file(channel_named("Fz", FZ), channel_named("Fx", FX[:20])),
        {"Fz": (SAMPLE_TIMES, FZ), "Fx": (SAMPLE_TIMES[:20], FX[:20])},
    ),
    "TDMS of whole numbers": (
        "16 bits of a converter",
        tdms_file(channel_named("Fz", (1000 + np.arange(SAMPLE_COUNT)).astype("i2"))),
        usual_truth_of(Fz=1000.0 + np.arange(SAMPLE_COUNT)),
    ),
    "TDMS with umlauts and quotes": (
        "paths within the file are quoted",
        tdms_file(("Größe 'a'", "Kraft 'Räder'/Ω", FZ, CLOCK)),
        usual_truth_of(**{"Kraft 'Räder'/Ω": FZ}),
    ),
    "TDMS of 300 channels": ("a long description", file_of_300_channels(".tdms"), MANY_CHANNELS),
    "TDMS with NaN": (
        "nothing was measured for a while",
        tdms_file(channel_named("Fz", np.where(FX < -50, np.nan, FZ)), channel_named("Fx", FX)),
        usual_truth(Fz=np.where(FX < -50, np.nan, FZ)),
    ),
    "TDMS beside an old index": ("the index describes another file", beside_old_index),
}
GREEDY = (
    "TDMS of a huge segment",
    "TDMS whose samples begin after their end",
    "TDMS of a huge number of samples",
    "TDMS of a huge number of channels",
    "TDMS of a huge name",
)
FILES = odd_files(refused_files=REFUSED, files_with_message=NAMED, readable_files=RIGHT, greedy_names=GREEDY)
