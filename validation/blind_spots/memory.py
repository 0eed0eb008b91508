"""What an audit and the processes that it starts share: of each function its fault, and whether it ran.

One file of doubles, mapped into the processes of one run, their workers too: rows of faults, of functions that ran, and
of those that gave numbers, with a place for each function. A process that is none of an audit has such rows to itself.
Compiled code finds them by the name ``SYMBOL``.
"""

import ctypes
import json
import mmap
import os
from pathlib import Path

VARIABLE = "TWINRIG_BLIND_SPOTS"
"""JSON that the environment hands on: {"functions": path of a list of names, "memory": path of the file of doubles}."""
PLACES = 8192
"""Most functions that can be told apart."""
BYTES = 3 * 8 * PLACES
SYMBOL = "twinrig_blind_spots"


def order() -> dict[str, str]:
    """What the environment says; empty in a process that is none of an audit."""
    told: dict[str, str] = json.loads(os.environ.get(VARIABLE, "{}"))
    return told


def shared(path: Path) -> memoryview:
    """The doubles of a file as processes share them; the file is made, all zero, where there is none."""
    if not path.is_file():
        path.write_bytes(bytes(BYTES))
    with path.open("r+b") as file:
        return memoryview(mmap.mmap(file.fileno(), BYTES)).cast("d")


ROWS = shared(Path(order()["memory"])) if order() else memoryview(mmap.mmap(-1, BYTES)).cast("d")
FAULTS, RAN, NUMBERS = (ROWS[row * PLACES : (row + 1) * PLACES] for row in range(3))
"""Of each function: 0.01 where its output is 1 % off, else 0; 1 where it ran; 1 where it gave or wrote a number."""
ADDRESS = ctypes.addressof(ctypes.c_double.from_buffer(ROWS))


def places(marks: memoryview) -> list[int]:
    """Functions that are marked."""
    return [place for place, mark in enumerate(marks) if mark]


def forget() -> None:
    """Take the marks of all functions away; faults stay."""
    RAN[:] = NUMBERS[:] = memoryview(bytes(8 * PLACES)).cast("d")
