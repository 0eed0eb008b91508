"""Damaged and unusual MTS RPC III files."""

from typing import Any

import numpy as np

from validation.measured.measured_files.odd import (
    FX,
    FZ,
    REPEATED_NAME,
    SAMPLE_COUNT,
    SAMPLE_PERIOD,
    SAMPLE_TIMES,
    FileMaker,
    Files,
    altered_file_maker,
    file_of_bytes,
    odd_files,
    patched_bytes,
    usual_file,
    usual_truth,
)

KEY, RECORD, BLOCK, POINTS = 32, 128, 512, 2048


RPC = usual_file(".rsp")


def with_parameters(make_file: FileMaker = RPC, **changed_parameters: str | None) -> FileMaker:
    """Make a file with some header parameters changed or, if None, removed. In the keywords, ``_`` stands for ``.``."""

    def change(raw_bytes: bytes) -> bytes:
        values = _header_parameters(raw_bytes)
        size = BLOCK * int(values["NUM_HEADER_BLOCKS"])
        names = {name.replace(".", "_"): name for name in values}
        values |= {names.get(key, key): value for key, value in changed_parameters.items()}
        given_parameters = {name: value for name, value in values.items() if value is not None}
        given_parameters["NUM_PARAMS"] = changed_parameters.get("NUM_PARAMS") or str(len(given_parameters))
        records = [
            (name.encode().ljust(KEY, b"\0"), value.encode("latin-1")) for name, value in given_parameters.items()
        ]
        return (
            b"".join(key + value.ljust(RECORD - KEY, b"\0") for key, value in records).ljust(size, b"\0")
            + raw_bytes[size:]
        )

    return altered_file_maker(make_file, change)


def _header_parameters(raw_bytes: bytes) -> dict[str, Any]:
    """Header parameters of a file, by name."""
    count = int(raw_bytes[2 * RECORD + KEY : 3 * RECORD].rstrip(b"\0"))
    records = [raw_bytes[i * RECORD : (i + 1) * RECORD] for i in range(count)]
    key_value_texts = [
        [header_part.rstrip(b"\0").decode("latin-1") for header_part in (record[:KEY], record[KEY:])]
        for record in records
    ]
    return dict(key_value_texts)


DIGITS = np.pad(np.tile(np.arange(SAMPLE_COUNT, dtype="<i2"), (2, 1)), ((0, 0), (0, POINTS - SAMPLE_COUNT)))
"""Samples as 16-bit integers. One step is 2^-6 in the first channel (with an offset) and -2.5 in the second."""
SCALED = with_parameters(DATA_TYPE="SHORT_INTEGER", SCALE_CHAN_1="0.015625", SCALE_CHAN_2="-2.5")


def with_sample_value(sample_value: float) -> FileMaker:
    """Make the usual file with another value at sample 5 of its first channel."""
    new_bytes = np.array([sample_value], "<f4").tobytes()
    return altered_file_maker(RPC, lambda data: patched_bytes(data, len(data) - 2 * POINTS * 4 + 5 * 4, new_bytes))


def padded_truth(sample_count: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Expected values, with the last one repeated until there are ``sample_count`` samples."""
    sample_times, padding = SAMPLE_PERIOD * np.arange(sample_count), (0, sample_count - SAMPLE_COUNT)
    return {name: (sample_times, np.pad(values, padding, mode="edge")) for name, (_, values) in usual_truth().items()}


WHOLE_NUMBERS = {"Fz": (SAMPLE_TIMES, 2.0**-6 * np.arange(SAMPLE_COUNT)), "Fx": (SAMPLE_TIMES, FX)}
REFUSED: Files = {
    "RPC III cut in its header": (
        "the parameters are incomplete",
        altered_file_maker(RPC, lambda data: data[:700]),
        "ends in its header",
    ),
    "RPC III cut in its first group": (
        "samples of the second channel are missing",
        altered_file_maker(RPC, lambda data: data[:20_000]),
        "first group",
    ),
    "RPC III with another beginning": (
        "FORMAT is spelt otherwise",
        altered_file_maker(RPC, lambda data: b"f" + data[1:]),
        "no known format",
    ),
    "RPC III of big-endian numbers": (
        "read as little-endian they are finite",
        with_parameters(FORMAT="BINARY_IEEE_BIG_END"),
        "BINARY",
    ),
    "RPC III of a matrix": ("no time history", with_parameters(FILE_TYPE="MATRIX"), "TIME_HISTORY"),
    "RPC III of 16 bits without a scale": (
        "digits are no forces",
        with_parameters(DATA_TYPE="SHORT_INTEGER", SCALE_CHAN_1=None),
        "SCALE.CHAN_1",
    ),
    "RPC III of a huge number of channels": (
        "a reader makes room for all",
        with_parameters(CHANNELS="1000000000"),
        "CHANNELS",
    ),
    "RPC III of fewer channels than it names": (
        "samples of one channel become those of another",
        with_parameters(CHANNELS="1"),
        "described as well",
    ),
    "RPC III of a huge header": (
        "a reader takes the samples for parameters",
        with_parameters(NUM_HEADER_BLOCKS="99999999"),
        "NUM_HEADER_BLOCKS",
    ),
    "RPC III of more parameters than its header holds": (
        "the rest would be samples",
        with_parameters(NUM_PARAMS="999"),
        "NUM_PARAMS",
    ),
    "RPC III of no samples": (
        "a file of a recording that never began",
        with_parameters(FRAMES="0", SAMPLES="0"),
        "FRAMES",
    ),
    "RPC III of a negative number of samples": ("counted from the end", with_parameters(SAMPLES="-5"), "SAMPLES"),
    "RPC III without a period": ("a division by zero", with_parameters(DELTA_T="0.0"), "DELTA_T"),
    "RPC III with a period of nan": ("it passes every comparison", with_parameters(DELTA_T="nan"), "DELTA_T"),
    "RPC III of broken groups": (
        "a group of two frames and a half",
        with_parameters(PTS_PER_FRAME="800"),
        "whole frames",
    ),
    "RPC III with inf": ("an overflow of the amplifier", with_sample_value(np.inf), "channel 'Fz', sample 5"),
    "RPC III of one word": ("a header of 6 bytes", file_of_bytes(b"FORMAT", "odd.rsp"), "header"),
}
NAMED: Files = {
    "RPC III without its number of samples": (
        "padding at the end looks like a constant force",
        with_parameters(PTS_PER_FRAME="16", FRAMES="3", SAMPLES=None),
        "padding",
        padded_truth(48),
    ),
    "RPC III of a huge number of frames": (
        "a reader makes room for all",
        with_parameters(FRAMES="900000000000", SAMPLES=None),
        "cut off",
        padded_truth(POINTS),
    ),
    "RPC III with the same name twice": (
        "the last one hides the first",
        with_parameters(DESC_CHAN_2="Fz"),
        "2 channels are called 'Fz'",
        REPEATED_NAME,
    ),
    "RPC III with a channel without a name": (
        "nothing to map",
        with_parameters(DESC_CHAN_2=None),
        "no channel 2",
        {"Fz": (SAMPLE_TIMES, FZ), "channel 2": (SAMPLE_TIMES, FX)},
    ),
    "RPC III with a date without zone": (
        "eight o'clock where",
        with_parameters(DATE="21-NOV-2026 08:00:00"),
        "is not used",
    ),
    "RPC III with bytes after its end": (
        "a second recording, or rubbish",
        altered_file_maker(RPC, lambda data: data + bytes(100)),
        "100 bytes",
    ),
}
RIGHT: Files = {
    "RPC III of 16 bits": (
        "digits times a scale of either sign",
        altered_file_maker(SCALED, lambda data: data[: -2 * POINTS * 4] + DIGITS.tobytes()),
        WHOLE_NUMBERS,
    ),
    "RPC III with umlauts": (
        "bytes beyond ASCII",
        with_parameters(DESC_CHAN_1="Kraft Räder", DESC_CHAN_2="Größe"),
        {"Kraft Räder": (SAMPLE_TIMES, FZ), "Größe": (SAMPLE_TIMES, FX)},
    ),
    "RPC III without units": ("kN or N, nobody knows", with_parameters(UNITS_CHAN_1=None)),
    "RPC III with NaN": (
        "nothing was measured at one sample",
        with_sample_value(np.nan),
        usual_truth(Fz=np.where(np.arange(SAMPLE_COUNT) == 5, np.nan, FZ)),
    ),
}
GREEDY = ("RPC III of a huge number of frames", "RPC III of a huge number of channels", "RPC III of a huge header")
FILES = odd_files(refused_files=REFUSED, files_with_message=NAMED, readable_files=RIGHT, greedy_names=GREEDY)
