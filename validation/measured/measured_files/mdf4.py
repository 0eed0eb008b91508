"""Odd files of ASAM MDF."""

import struct
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.measured.formats.mdf4 import unheard
from models.measured.formats.writing import Group
from validation.measured.measured_files.csv import BACK, MANY, WIDE, raw
from validation.measured.measured_files.odd import COUNT, FX, FZ, PERIOD, TIMES, Odd, Truth, patched, usual, written

DATA = 24
"""Bytes of a block before its links."""


def usual_file(folder: Path) -> Path:
    """Write the usual file."""
    return written(folder / "odd.mf4")


def signals(
    *groups: dict[str, Any],
    version: str = "4.10",
    compression: Literal[0, 2] = 0,
    start: datetime | None = None,
    times: np.ndarray = TIMES,
    families: tuple[str, ...] = (),
) -> Callable[[Path], Path]:
    """Make a file of groups, name -> samples or keywords of asammdf's Signal; ``families`` are their names."""

    def make(folder: Path) -> Path:
        from asammdf import MDF, Signal

        path = folder / ("odd.mdf" if version < "4" else "odd.mf4")
        file = MDF(version=version)
        if start is not None:
            file.header.start_time = start
        for group, family in zip(groups, families or [""] * len(groups), strict=True):
            plain = {name: own if isinstance(own, dict) else {"samples": own} for name, own in group.items()}
            file.append(
                [Signal(name=name, timestamps=times[: len(own["samples"])], **own) for name, own in plain.items()],
                acq_name=family,
                comment=family,
                common_timebase=True,
            )
        with unheard():
            file.save(path, compression=compression)
            file.close()
        return path

    return make


def block(path: Path, kind: bytes, number: int = 0) -> int:
    """Byte where the block of a kind begins that is first, second ... in the file; -1 is the last."""
    data = path.read_bytes()
    places = [i for i in range(0, len(data) - 3, 8) if data[i : i + 4] == kind]
    return places[number]


def inside(path: Path, kind: bytes, offset: int, new: bytes, number: int = 0) -> Path:
    """Replace bytes of a block's data, which stand after its links."""
    place = block(path, kind, number)
    links = struct.unpack_from("<Q", path.read_bytes(), place + 16)[0]
    return patched(path, place + DATA + 8 * links + offset, new)


def changed(kind: bytes, offset: int, new: bytes, link: bool = False) -> Callable[[Path], Path]:
    """Make the usual file with other bytes in a block: in its data, or from its beginning on for a ``link``."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        return patched(path, block(path, kind) + offset, new) if link else inside(path, kind, offset, new)

    return make


def looped(kind: bytes) -> Callable[[Path], Path]:
    """Make the usual file with a block that follows itself."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        return patched(path, block(path, kind) + DATA, struct.pack("<Q", block(path, kind)))

    return make


def without_clock(folder: Path) -> Path:
    """Make the usual file whose master channel is an ordinary one."""
    path = usual_file(folder)
    return patched(path, master(path) + 88, b"\0\0")


def master(path: Path) -> int:
    """Byte where the block of the master channel begins: its kind, 2, stands after eight links."""
    data = path.read_bytes()
    return next(i for i in range(0, len(data), 8) if data[i : i + 4] == b"##CN" and data[i + 88] == 2)


def over(kind: int) -> Callable[[Path], Path]:
    """Make the usual file whose master channel counts something else: 2 angle, 3 distance, 4 index."""

    def make(folder: Path) -> Path:
        path = usual_file(folder)
        return patched(path, master(path) + 89, bytes((kind,)))

    return make


def mdf3_of_records(count: int) -> Callable[[Path], Path]:
    """Make a file of version 3 that claims a number of records."""

    def make(folder: Path) -> Path:
        path = signals(usual_samples(), version="3.30")(folder)
        data = path.read_bytes()
        return patched(path, data.index(b"CG") + 22, struct.pack("<L", count))

    return make


def unknown_lengths(folder: Path) -> Path:
    """Make the usual file with records whose lengths are said to differ, and a huge number of them."""
    path = inside(usual_file(folder), b"##CG", 8, struct.pack("<Q", 2**50))
    return inside(path, b"##CG", 16, b"\1")


def huge_packed(folder: Path) -> Path:
    """Make a packed file that claims to be of a terabyte when unpacked."""
    path = signals(usual_samples(), compression=2)(folder)
    return inside(path, b"##DZ", 8, struct.pack("<Q", 2**40))


def two_rates(folder: Path) -> Path:
    """Make a file of two groups of different rates."""
    from models.measured.formats import write

    groups = [
        Group((name,), ("N",), ("",), period, COUNT, [values[:, None]])
        for name, period, values in (("Fz", PERIOD, FZ), ("Fx", 0.05, FX))
    ]
    return write(folder / "odd.mf4", groups)


def usual_samples() -> dict[str, Any]:
    """Return the two channels of the usual file."""
    return {"Fz": FZ, "Fx": FX}


def only(name: str, values: np.ndarray, times: np.ndarray = TIMES) -> Truth:
    """Truth of one channel."""
    return {name: (times, values)}


WHOLE = np.arange(COUNT, dtype="i2")
INVALID = np.arange(COUNT) % 11 == 3
LOST = np.where(FX < -50.0, np.nan, FZ)

STOPPED = np.where(np.arange(COUNT) == 9, np.nan, TIMES)

FILES = (
    Odd(
        "MDF 4 cut in its header",
        "the first block is incomplete",
        lambda folder: patched(_short(folder, 100), 0, b"MDF"),
        "refused",
        "cut off",
    ),
    Odd("MDF 4 of one word", "an identification of 8 bytes", raw(b"MDF     ", "odd.mf4"), "refused", "version"),
    Odd(
        "MDF 4 with another beginning",
        "one letter is wrong",
        lambda folder: patched(usual_file(folder), 0, b"MDX"),
        "refused",
        "no known format",
    ),
    Odd(
        "MDF 4 never finished",
        "the recorder lost power: counters are not yet written",
        lambda folder: patched(usual_file(folder), 0, b"UnFinMF "),
        "refused",
        "finalise",
    ),
    Odd(
        "MDF 4 never finished, by its flags",
        "the name is right, the flags are set",
        lambda folder: patched(usual_file(folder), 60, b"\5\0"),
        "refused",
        "finalise",
    ),
    Odd(
        "MDF 4 of version 9",
        "nobody knows it",
        lambda folder: patched(usual_file(folder), 8, b"9.99"),
        "refused",
        "version",
    ),
    Odd(
        "MDF 3",
        "another layout, the same samples",
        signals(usual_samples(), version="3.30", start=datetime.fromisoformat("2026-11-21T08:00:00+00:00")),
        "right",
    ),
    Odd("MDF 3 cut", "the records are incomplete", lambda folder: _short_mdf3(folder, 400), "refused", ""),
    Odd(
        "MDF 4 with a block that follows itself",
        "a reader goes round for ever",
        looped(b"##CN"),
        "refused",
        "leads back",
        greedy=True,
    ),
    Odd(
        "MDF 4 with a group that follows itself",
        "a reader goes round for ever",
        looped(b"##DG"),
        "refused",
        "leads back",
        greedy=True,
    ),
    Odd(
        "MDF 4 with a link into the samples",
        "no block begins there",
        changed(b"##DG", DATA + 8, struct.pack("<Q", 2**13 + 1), link=True),
        "refused",
        "begin",
    ),
    Odd(
        "MDF 4 with a link beyond the file",
        "nothing is there",
        changed(b"##DG", DATA, struct.pack("<Q", 2**40), link=True),
        "refused",
        "cut off",
        greedy=True,
    ),
    Odd(
        "MDF 4 with a block of a huge length",
        "a reader makes room for it",
        changed(b"##DT", 8, struct.pack("<Q", 2**50), link=True),
        "refused",
        "cut off",
        greedy=True,
    ),
    Odd(
        "MDF 4 with a huge number of links",
        "a reader makes room for them",
        changed(b"##CG", 16, struct.pack("<Q", 2**40), link=True),
        "refused",
        "links",
        greedy=True,
    ),
    Odd(
        "MDF 4 of a huge number of records",
        "a reader makes room for them",
        changed(b"##CG", 8, struct.pack("<Q", 2**50)),
        "refused",
        "records",
        greedy=True,
    ),
    Odd(
        "MDF 3 of a huge number of records",
        "a reader makes room for them",
        mdf3_of_records(2**32 - 1),
        "refused",
        "too short",
        greedy=True,
    ),
    Odd(
        "MDF 4 of a huge number of records of unknown length",
        "no length tells how many there are",
        unknown_lengths,
        "refused",
        "lengths of their own",
        greedy=True,
    ),
    Odd(
        "MDF 4 with a channel outside its records",
        "a library copies what lies behind them",
        changed(b"##CN", 4, struct.pack("<L", 2**24)),
        "refused",
        "outside the records",
    ),
    Odd(
        "MDF 4 of one record more than there is",
        "the last one is made up",
        changed(b"##CG", 8, struct.pack("<Q", COUNT + 1)),
        "refused",
        "records",
    ),
    Odd(
        "MDF 4 of fewer records than there are",
        "counters of a recorder that stopped early",
        changed(b"##CG", 8, struct.pack("<Q", COUNT - 5)),
        "named",
        "announced and read",
    ),
    Odd(
        "MDF 4 of no records",
        "a recording that never began",
        changed(b"##CG", 8, struct.pack("<Q", 0)),
        "refused",
        "no samples",
    ),
    Odd("MDF 4 without channels", "an empty file of a recorder", signals(), "refused", "no channel"),
    Odd("MDF 4 without a clock", "records have no times", without_clock, "refused", "no clock"),
    Odd("MDF 4 over the angle of a shaft", "the clock counts radians", over(2), "refused", "does not count seconds"),
    Odd("MDF 4 packed", "samples are deflated", signals(usual_samples(), compression=2), "right"),
    Odd(
        "MDF 4 that claims to be a terabyte when unpacked",
        "a reader makes room for it",
        huge_packed,
        "refused",
        "packed bytes",
        greedy=True,
    ),
    Odd(
        "MDF 4 of two rates",
        "a common clock does not exist",
        two_rates,
        "right",
        truth={"Fz": (TIMES, FZ), "Fx": (0.05 * np.arange(COUNT), FX)},
    ),
    Odd(
        "MDF 4 with invalid samples",
        "their values look like any other",
        signals({"Fz": {"samples": FZ, "invalidation_bits": INVALID}, "Fx": FX}),
        "right",
        truth=usual(Fz=np.where(INVALID, np.nan, FZ)),
    ),
    Odd(
        "MDF 4 of whole numbers",
        "digits, a factor and an offset",
        signals({"Fz": {"samples": WHOLE, "conversion": {"a": 0.5, "b": -3.0}}}),
        "right",
        truth=only("Fz", 0.5 * WHOLE - 3.0),
    ),
    Odd(
        "MDF 4 with texts",
        "remarks of the driver in a channel",
        signals({"Fz": FZ, "remark": {"samples": np.array([b"abc"] * COUNT), "encoding": "utf-8"}}),
        "named",
        "no numbers: 'remark'",
        only("Fz", FZ),
    ),
    Odd(
        "MDF 4 with the same name twice",
        "one in each group",
        signals({"Fz": FZ}, {"Fz": FX}),
        "named",
        "2 channels are called 'Fz'",
        {"Fz (1)": (TIMES, FZ), "Fz (2)": (TIMES, FX)},
    ),
    *(
        Odd(
            f"MDF {version[0]} whose groups are wheels",
            "every wheel has an Fz",
            signals({"Fz": FZ}, {"Fz": FX}, version=version, families=("WFT VL", "WFT HR")),
            "named",
            "'WFT HR/Fz'",
            {"WFT VL/Fz": (TIMES, FZ), "WFT HR/Fz": (TIMES, FX)},
        )
        for version in ("4.10", "3.30")
    ),
    Odd(
        "MDF 4 with umlauts",
        "names beyond ASCII",
        signals({"Kraft Räder/Ω": FZ}),
        "right",
        truth=only("Kraft Räder/Ω", FZ),
    ),
    Odd(
        "MDF 4 of 300 channels",
        "long records",
        lambda folder: written(folder / "odd.mf4", WIDE, MANY),
        "right",
        truth={name: (TIMES, MANY[:, i]) for i, name in enumerate(WIDE)},
    ),
    Odd(
        "MDF 4 with NaN",
        "nothing was measured for a while",
        signals({"Fz": LOST, "Fx": FX}),
        "right",
        truth=usual(Fz=LOST),
    ),
    Odd(
        "MDF 4 with inf",
        "an overflow of the amplifier",
        signals({"Fz": np.where(FX < -50.0, np.inf, FZ)}),
        "refused",
        "channel 'Fz', sample 21",
    ),
    Odd(
        "MDF 4 whose clock goes back",
        "sorting would hide it",
        signals({"Fz": FZ}, times=BACK),
        "right",
        truth=only("Fz", FZ, BACK),
    ),
    Odd(
        "MDF 4 with a clock of nan",
        "a time is no time",
        signals({"Fz": FZ}, times=STOPPED),
        "refused",
        "channel 'time', sample 9",
    ),
    Odd(
        "MDF 4 with a start without zone",
        "eight o'clock where",
        signals(usual_samples(), start=datetime(2026, 11, 21, 8)),
        "named",
        "is not used",
    ),
    Odd(
        "MDF 4 called odd.tdms",
        "the extension says otherwise",
        lambda folder: usual_file(folder).rename(folder / "odd.tdms"),
        "named",
        "extension",
    ),
)


def _short(folder: Path, length: int) -> Path:
    """Write the first bytes of the usual file."""
    path = usual_file(folder)
    path.write_bytes(path.read_bytes()[:length])
    return path


def _short_mdf3(folder: Path, missing: int) -> Path:
    """Write a file of version 3 without its last bytes."""
    path = signals(usual_samples(), version="3.30")(folder)
    path.write_bytes(path.read_bytes()[:-missing])
    return path
