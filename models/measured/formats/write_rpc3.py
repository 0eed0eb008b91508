"""Writes MTS RPC III with floating-point samples: 2^-24 of each value is kept, where 16 bits keep 2^-16 of the largest.

The last group is filled up with the last values; SAMPLES, which is no part of the format but known to rpc3-file, says
how many count. Comments are parameters of our own, COMMENT_1 ... and COMMENT.CHAN_1_1 ...; NaN is written as NaN.
A name, a unit or a comment that the format cannot hold is refused, never cut.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.measured.formats.rpc3 import BLOCK, KEY, RECORD
from models.measured.formats.writing import Group, one_group

POINTS = 2048
"""Samples of a group, which is also a frame."""
LONGEST = RECORD - KEY - 1
"""Bytes of a value before the zero that ends it."""
MOST = 1024
"""Parameters of a header."""


def write_rpc(path: Path, part: Path, groups: Sequence[Group], start: datetime | None, comment: str) -> None:
    """Write the header, groups of samples, and the header again with the limits of every channel."""
    group = one_group(path, groups, "RPC III")
    limits = np.tile([[np.inf], [-np.inf]], len(group.names))
    with part.open("wb") as file:
        file.write(header(path, group, limits, start, comment))
        for values in _frames(path, group):
            limits = np.array([np.fmin(limits[0], np.fmin.reduce(values)), np.fmax(limits[1], np.fmax.reduce(values))])
            file.write(np.ascontiguousarray(values.T).astype("<f4").tobytes())
        file.seek(0)
        file.write(header(path, group, np.where(np.isfinite(limits), limits, 0.0), start, comment))


def _frames(path: Path, group: Group) -> Iterator[np.ndarray]:
    """Values in frames of equal length, the last one filled up with the last values."""
    kept = np.empty((0, len(group.names)))
    for first, values in group.rows(path):
        if (np.abs(values) > np.finfo("<f4").max).any():
            raise InputError(path, f"sample {first} and after", None, "values above 3.4e38 have no room in RPC III")
        kept = np.concatenate((kept, values))
        used = len(kept) // POINTS * POINTS
        yield from kept[:used].reshape(-1, POINTS, len(group.names))
        kept = kept[used:]
    if len(kept):
        yield np.concatenate((kept, np.repeat(kept[-1:], POINTS - len(kept), axis=0)))


def header(path: Path, group: Group, limits: np.ndarray, start: datetime | None, comment: str) -> bytes:
    """Header blocks; of the same length whatever the limits are."""
    frames = -(-group.count // POINTS)
    own: dict[str, object] = {
        "FILE_TYPE": "TIME_HISTORY",
        "TIME_TYPE": "RESPONSE",
        "DATA_TYPE": "FLOATING_POINT",
        "DATE": "" if start is None else start.isoformat(),
        "OPERATION": "twinrig",
        "CHANNELS": len(group.names),
        "DELTA_T": repr(group.period),
        "PTS_PER_FRAME": POINTS,
        "PTS_PER_GROUP": POINTS,
        "FRAMES": frames,
        "SAMPLES": group.count,
        "BYPASS_FILTER": 0,
        "HALF_FRAMES": 0,
        "INT_FULL_SCALE": 32752,
        "REPEATS": 1,
        "PARTITIONS": 1,
        "PART.CHAN_1": 1,
        "PART.NCHAN_1": len(group.names),
        **_long("COMMENT", comment),
    }
    for i, (name, unit, text) in enumerate(zip(group.names, group.units, group.comments, strict=True)):
        own |= {
            f"DESC.CHAN_{i + 1}": name,
            f"UNITS.CHAN_{i + 1}": unit,
            f"SCALE.CHAN_{i + 1}": "1.0",
            f"LOWER_LIMIT.CHAN_{i + 1}": f"{limits[0, i]:.9g}",
            f"UPPER_LIMIT.CHAN_{i + 1}": f"{limits[1, i]:.9g}",
            f"MAP.CHAN_{i + 1}": i + 1,
            **_long(f"COMMENT.CHAN_{i + 1}", text),
        }
    count = len(own) + 3
    if count > MOST:
        raise InputError(
            path,
            "channels",
            len(group.names),
            f"the header has {MOST} parameters, {count} are needed: write fewer channels or comments, or MDF 4",
        )
    blocks = -(-count // (BLOCK // RECORD))
    own = {"FORMAT": "BINARY", "NUM_HEADER_BLOCKS": blocks, "NUM_PARAMS": count, **own}
    return b"".join(_record(path, key, str(value)) for key, value in own.items()).ljust(blocks * BLOCK, b"\0")


def _record(path: Path, key: str, value: str) -> bytes:
    """One parameter."""
    try:
        text = value.encode("latin-1")
    except UnicodeEncodeError as error:
        letter = value[error.start]
        raise InputError(path, key, value, f"RPC III has no {letter!r}: write it otherwise, or MDF 4") from None
    if len(text) > LONGEST or "\0" in value:
        raise InputError(path, key, value, f"RPC III has room for {LONGEST} characters, and this has {len(text)}")
    return key.encode("ascii").ljust(KEY, b"\0") + text.ljust(RECORD - KEY, b"\0")


def _long(name: str, text: str) -> dict[str, object]:
    """Spread a text over several parameters, with line ends written as ``\\n``."""
    plain = text.replace("\\", "\\\\").replace("\n", "\\n")
    return {f"{name}_{i // LONGEST + 1}": plain[i : i + LONGEST] for i in range(0, len(plain), LONGEST)}
