"""Odd files of MTS RPC III."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from validation.measured.measured_files.csv import raw
from validation.measured.measured_files.odd import COUNT, FX, FZ, PERIOD, TIMES, Odd, cut, usual, written

KEY, RECORD, BLOCK, POINTS = 32, 128, 512, 2048


def usual_file(folder: Path) -> Path:
    """Write the usual file."""
    return written(folder / "odd.rsp")


def with_parameters(**changed: str | None) -> Callable[[Path], Path]:
    """Make the usual file with other values of some parameters (``_`` for ``.``); None takes one away."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        data = path.read_bytes()
        blocks = int(_values(data)["NUM_HEADER_BLOCKS"])
        values = _values(data)
        for key, value in changed.items():
            name = next((own for own in values if own.replace(".", "_") == key), key)
            values.pop(name, None)
            values |= {} if value is None else {name: value}
        values["NUM_PARAMS"] = changed.get("NUM_PARAMS") or str(len(values))
        order = ["FORMAT", "NUM_HEADER_BLOCKS", "NUM_PARAMS"]
        keys = order + [name for name in values if name not in order]
        head = b"".join(_record(name, values[name]) for name in keys).ljust(blocks * BLOCK, b"\0")
        path.write_bytes(head + data[blocks * BLOCK :])
        return path

    return make


def _record(key: str, value: str) -> bytes:
    """One parameter."""
    return key.encode().ljust(KEY, b"\0") + value.encode("latin-1").ljust(RECORD - KEY, b"\0")


def _values(data: bytes) -> dict[str, str]:
    """Parameters of a header."""
    found = {}
    for i in range(int(data[2 * RECORD + KEY : 3 * RECORD].rstrip(b"\0"))):
        key, value = data[i * RECORD : i * RECORD + KEY], data[i * RECORD + KEY : (i + 1) * RECORD]
        found[key.rstrip(b"\0").decode()] = value.rstrip(b"\0").decode("latin-1")
    return found


def whole_numbers(folder: Path) -> Path:
    """Make the usual file with samples of 16 bits: 2^-6 per digit and an offset that fits, -2.5 per digit."""
    path = with_parameters(DATA_TYPE="SHORT_INTEGER", SCALE_CHAN_1="0.015625", SCALE_CHAN_2="-2.5")(folder)
    data = path.read_bytes()
    digits = np.zeros((2, POINTS), "<i2")
    digits[:, :COUNT] = np.arange(COUNT)
    path.write_bytes(data[: -2 * POINTS * 4] + digits.tobytes())
    return path


def two_frames(folder: Path) -> Path:
    """Make a file of three frames of 16 samples in a group of 2048, as short recordings have them."""
    return with_parameters(PTS_PER_FRAME="16", FRAMES="3", SAMPLES=None)(folder)


def sample(value: float) -> Callable[[Path], Path]:
    """Make the usual file with another value at sample 5 of the first channel."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        data = bytearray(path.read_bytes())
        place = len(data) - 2 * POINTS * 4 + 5 * 4
        data[place : place + 4] = np.array([value], "<f4").tobytes()
        path.write_bytes(bytes(data))
        return path

    return make


def longer(folder: Path) -> Path:
    """Make the usual file with a hundred bytes after its end."""
    path = usual_file(folder)
    path.write_bytes(path.read_bytes() + bytes(100))
    return path


def with_hole() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Truth with nothing measured at sample 5."""
    return usual(Fz=np.where(np.arange(COUNT) == 5, np.nan, FZ))


def padded() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Truth with the last value repeated until a frame is full."""
    times = PERIOD * np.arange(48)
    return {name: (times, np.pad(values, (0, 8), mode="edge")) for name, values in (("Fz", FZ), ("Fx", FX))}


DIGITS = {"Fz": (TIMES, 2.0**-6 * np.arange(COUNT)), "Fx": (TIMES, FX)}

FILES = (
    Odd(
        "RPC III cut in its header",
        "the parameters are incomplete",
        lambda folder: cut(usual_file(folder), 700),
        "refused",
        "ends in its header",
    ),
    Odd(
        "RPC III cut in its first group",
        "samples of the second channel are missing",
        lambda folder: cut(usual_file(folder), 20_000),
        "refused",
        "first group",
    ),
    Odd(
        "RPC III with another beginning",
        "FORMAT is spelt otherwise",
        lambda folder: _spelt(usual_file(folder)),
        "refused",
        "no known format",
    ),
    Odd(
        "RPC III of big-endian numbers",
        "read as little-endian they are finite",
        with_parameters(FORMAT="BINARY_IEEE_BIG_END"),
        "refused",
        "BINARY",
    ),
    Odd("RPC III of a matrix", "no time history", with_parameters(FILE_TYPE="MATRIX"), "refused", "TIME_HISTORY"),
    Odd("RPC III of 16 bits", "digits times a scale of either sign", whole_numbers, "right", truth=DIGITS),
    Odd(
        "RPC III of 16 bits without a scale",
        "digits are no forces",
        with_parameters(DATA_TYPE="SHORT_INTEGER", SCALE_CHAN_1=None),
        "refused",
        "SCALE.CHAN_1",
    ),
    Odd(
        "RPC III without its number of samples",
        "padding at the end looks like a constant force",
        two_frames,
        "named",
        "padding",
        padded(),
    ),
    Odd(
        "RPC III of a huge number of frames",
        "a reader makes room for all",
        with_parameters(FRAMES="900000000000", SAMPLES=None),
        "named",
        "cut off",
        {
            name: (PERIOD * np.arange(POINTS), np.pad(values, (0, POINTS - COUNT), mode="edge"))
            for name, values in (("Fz", FZ), ("Fx", FX))
        },
        greedy=True,
    ),
    Odd(
        "RPC III of a huge number of channels",
        "a reader makes room for all",
        with_parameters(CHANNELS="1000000000"),
        "refused",
        "CHANNELS",
        greedy=True,
    ),
    Odd(
        "RPC III of fewer channels than it names",
        "samples of one channel become those of another",
        with_parameters(CHANNELS="1"),
        "refused",
        "described as well",
    ),
    Odd(
        "RPC III of a huge header",
        "a reader takes the samples for parameters",
        with_parameters(NUM_HEADER_BLOCKS="99999999"),
        "refused",
        "NUM_HEADER_BLOCKS",
        greedy=True,
    ),
    Odd(
        "RPC III of more parameters than its header holds",
        "the rest would be samples",
        with_parameters(NUM_PARAMS="999"),
        "refused",
        "NUM_PARAMS",
    ),
    Odd(
        "RPC III of no samples",
        "a file of a recording that never began",
        with_parameters(FRAMES="0", SAMPLES="0"),
        "refused",
        "FRAMES",
    ),
    Odd(
        "RPC III of a negative number of samples",
        "counted from the end",
        with_parameters(SAMPLES="-5"),
        "refused",
        "SAMPLES",
    ),
    Odd("RPC III without a period", "a division by zero", with_parameters(DELTA_T="0.0"), "refused", "DELTA_T"),
    Odd(
        "RPC III with a period of nan",
        "it passes every comparison",
        with_parameters(DELTA_T="nan"),
        "refused",
        "DELTA_T",
    ),
    Odd(
        "RPC III of broken groups",
        "a group of two frames and a half",
        with_parameters(PTS_PER_FRAME="800"),
        "refused",
        "whole frames",
    ),
    Odd(
        "RPC III with the same name twice",
        "the last one hides the first",
        with_parameters(DESC_CHAN_2="Fz"),
        "named",
        "2 channels are called 'Fz'",
        {"Fz (1)": (TIMES, FZ), "Fz (2)": (TIMES, FX)},
    ),
    Odd(
        "RPC III with a channel without a name",
        "nothing to map",
        with_parameters(DESC_CHAN_2=None),
        "named",
        "no channel 2",
        {"Fz": (TIMES, FZ), "channel 2": (TIMES, FX)},
    ),
    Odd(
        "RPC III with umlauts",
        "bytes beyond ASCII",
        with_parameters(DESC_CHAN_1="Kraft Räder", DESC_CHAN_2="Größe"),
        "right",
        truth={"Kraft Räder": (TIMES, FZ), "Größe": (TIMES, FX)},
    ),
    Odd("RPC III without units", "kN or N, nobody knows", with_parameters(UNITS_CHAN_1=None), "right"),
    Odd(
        "RPC III with a date without zone",
        "eight o'clock where",
        with_parameters(DATE="21-NOV-2026 08:00:00"),
        "named",
        "is not used",
    ),
    Odd("RPC III with NaN", "nothing was measured at one sample", sample(np.nan), "right", truth=with_hole()),
    Odd("RPC III with inf", "an overflow of the amplifier", sample(np.inf), "refused", "channel 'Fz', sample 5"),
    Odd("RPC III with bytes after its end", "a second recording, or rubbish", longer, "named", "100 bytes"),
    Odd("RPC III of one word", "a header of 6 bytes", raw(b"FORMAT", "odd.rsp"), "refused", "header"),
)


def _spelt(path: Path) -> Path:
    """Change the first letter of a file."""
    path.write_bytes(b"f" + path.read_bytes()[1:])
    return path
