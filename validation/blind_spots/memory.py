"""Memory that an audit shares with its worker processes: for each function its planted fault, and whether it ran.

A file of doubles is mapped into the processes of a run and their workers: a row of faults, a row of functions that ran
and a row of functions that gave numbers, with an entry for each function. A process outside an audit has private rows.
Compiled code finds them by the name ``ADDRESS_SYMBOL``.
"""

import ctypes
import json
import mmap
import os
from pathlib import Path

ENVIRONMENT_VARIABLE = "TWINRIG_BLIND_SPOTS"
"""Environment variable with JSON for the worker processes: {"functions": path of a list of names, "memory": path of the
file of doubles, "bytecode": folder for the bytecode of rewritten modules}."""
MOST_FUNCTIONS = 8192
"""Largest number of functions in an audit."""
FunctionRow = ctypes.c_double * MOST_FUNCTIONS
MEMORY_SIZE = 3 * ctypes.sizeof(FunctionRow)
ADDRESS_SYMBOL = "twinrig_blind_spots"


def audit_instructions() -> dict[str, str]:
    """Instructions of the audit for this process, from an environment variable; empty in a process outside an
    audit."""
    told: dict[str, str] = json.loads(os.environ.get(ENVIRONMENT_VARIABLE, "{}"))
    return told


def shared_rows(memory_path: Path | None) -> list[ctypes.Array[ctypes.c_double]]:
    """Three rows of doubles, with an entry for each function: its fault, whether it ran, whether it gave numbers. They
    lie in a file that processes share, or in private memory without a path; a new file contains zeros."""
    if memory_path is None:
        memory = mmap.mmap(-1, MEMORY_SIZE)
    else:
        memory_path.touch()
        os.truncate(memory_path, MEMORY_SIZE)
        with memory_path.open("r+b") as file:
            memory = mmap.mmap(file.fileno(), MEMORY_SIZE)
    return [FunctionRow.from_buffer(memory, row * ctypes.sizeof(FunctionRow)) for row in range(3)]


FAULTS, FUNCTIONS_THAT_RAN, FUNCTIONS_WITH_NUMBERS = shared_rows(
    Path(audit_instructions()["memory"]) if audit_instructions() else None
)
"""For each function: 0.01 where its output is made 1 % wrong, else 0; 1 where it ran; 1 where it returned or wrote a
number."""
ADDRESS = ctypes.addressof(FAULTS)


def nonzero_functions(memory_row: ctypes.Array[ctypes.c_double]) -> list[int]:
    """Numbers of the functions whose entry in a row is not zero."""
    return [number for number, mark in enumerate(memory_row) if mark]


def clear(memory_row: ctypes.Array[ctypes.c_double]) -> None:
    """Set a row to zero for all functions: the faults, or the marks of functions that ran."""
    ctypes.memset(memory_row, 0, ctypes.sizeof(FunctionRow))


def clear_marks() -> None:
    """Set to zero, for all functions, the marks that they ran and gave numbers; planted faults stay."""
    clear(FUNCTIONS_THAT_RAN)
    clear(FUNCTIONS_WITH_NUMBERS)
