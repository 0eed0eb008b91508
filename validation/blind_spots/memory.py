"""Shared memory of an audit and the processes that it starts: of each function its fault, and whether it ran.

One file of doubles, mapped into the processes of one run, their workers too: rows of faults, of functions that ran, and
of those that gave numbers, with a place for each function. A process that is none of an audit has such rows to itself.
Compiled code finds them by the name ``ADDRESS_SYMBOL``.
"""

import ctypes
import json
import mmap
import os
from pathlib import Path

ENVIRONMENT_VARIABLE = "TWINRIG_BLIND_SPOTS"
"""JSON that the environment hands on: {"functions": path of a list of names, "memory": path of the file of doubles,
"bytecode": folder of the code of rewritten modules}."""
MOST_FUNCTIONS = 8192
"""Most functions that can be told apart."""
Row = ctypes.c_double * MOST_FUNCTIONS
MEMORY_SIZE = 3 * ctypes.sizeof(Row)
ADDRESS_SYMBOL = "twinrig_blind_spots"


def order() -> dict[str, str]:
    """The audit's instructions for this process, from the environment; empty in a process that is not part of an
    audit."""
    told: dict[str, str] = json.loads(os.environ.get(ENVIRONMENT_VARIABLE, "{}"))
    return told


def rows(path: Path | None) -> list[ctypes.Array[ctypes.c_double]]:
    """Three rows of numbers: faults, functions that ran, functions that gave numbers. They lie in a file that processes
    share, or in private memory without a path; a new file holds zeros."""
    if path is None:
        memory = mmap.mmap(-1, MEMORY_SIZE)
    else:
        path.touch()
        os.truncate(path, MEMORY_SIZE)
        with path.open("r+b") as file:
            memory = mmap.mmap(file.fileno(), MEMORY_SIZE)
    return [Row.from_buffer(memory, row * ctypes.sizeof(Row)) for row in range(3)]


FAULTS, FUNCTIONS_THAT_RAN, FUNCTIONS_WITH_NUMBERS = rows(Path(order()["memory"]) if order() else None)
"""Of each function: 0.01 where its output is 1 % off, else 0; 1 where it ran; 1 where it gave or wrote a number."""
ADDRESS = ctypes.addressof(FAULTS)


def nonzero_functions(marks: ctypes.Array[ctypes.c_double]) -> list[int]:
    """Numbers of the functions whose entry is not zero."""
    return [place for place, mark in enumerate(marks) if mark]


def clear(row: ctypes.Array[ctypes.c_double]) -> None:
    """Set a row to zero: the faults, or the marks of all functions."""
    ctypes.memset(row, 0, ctypes.sizeof(Row))


def forget() -> None:
    """Set the marks of all functions to zero; planted faults stay."""
    clear(FUNCTIONS_THAT_RAN)
    clear(FUNCTIONS_WITH_NUMBERS)
