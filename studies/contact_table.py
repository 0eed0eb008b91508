"""Forces for a table of contacts: from a CSV with a contact in every row to a CSV with forces, errors and a status."""

import csv
import time
from collections.abc import Callable
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.scene_effects import extended
from models.machine.seconds import duration
from models.systems.contact.cases_table import answer, compile_first
from models.systems.contact.scene import ContactScene

SYSTEM = "contact"
Progress = Callable[[str, float], None]
ANSWER = "forces.csv"
BLOCK = 10_000
"""Rows of an answer that are read at once."""


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Refuse a scene of one contact, and a file that is not there."""
    if scene.cases is None:
        allowed = "needs the table [cases] with a file; one contact is what the study contact computes"
        raise InputError(scene.file, "study", scene.study, allowed)
    scene.cases_file()


def run(scene: ContactScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Answer every row; saves ``forces.csv``."""
    check(scene, engines)
    path = scene.cases_file()
    extend = partial(extended, scene=scene)
    compile_first(scene.pair, scene.method, extend)  # no part of the time below
    start = time.perf_counter()
    rows = answer(path, folder / ANSWER, scene.pair, scene.method, lambda done: progress(f"{done:,} rows", 0.0), extend)
    seconds = time.perf_counter() - start
    table = told(rows["rows"], rows["wrong"], path.name, seconds)
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "rows": rows,
        "answer": sizes(folder / ANSWER),
        "seconds": seconds,
        "table": table,
    }


def sizes(path: Path) -> dict[str, dict[str, Any]]:
    """Largest magnitude and rms of every column of an answer, over its sound rows; read block by block."""
    with path.open(newline="") as file:
        rows = csv.reader(file)
        heads = [head.rstrip("]").split(" [") for head in next(rows)[1:-1]]
        largest, squares, count = np.zeros(len(heads)), np.zeros(len(heads)), 0
        while block := list(islice(rows, BLOCK)):
            sound = np.array([row[1:-1] for row in block if row[-1] == "ok"], float).reshape(-1, len(heads))
            largest = np.maximum(largest, np.abs(sound).max(axis=0, initial=0.0))
            squares, count = squares + (sound**2).sum(axis=0), count + len(sound)
    return {
        name: {"unit": unit, "largest": float(most), "rms": float(np.sqrt(square / count))}
        for (name, unit), most, square in zip(heads, largest, squares, strict=True)
        if count
    }


def told(rows: int, wrong: int, name: str, seconds: float) -> list[str]:
    """What is printed of ``rows`` rows, of which some are wrong, from the file ``name``."""
    if rows == 0:
        return [f"  no rows in {name}"]
    sound = ", all of them sound" if rows > 1 else ", sound"
    state = f"; {wrong:,} of them wrong, see their status" if wrong else sound
    each = f", {duration(seconds / rows)} a row" if rows > 1 else ""
    return [
        f"  {rows:,} row{'s' * (rows > 1)} of {name}{state}",
        f"  {duration(seconds)}{each}, once: reading, forces twice for the error of cells, writing",
    ]


if __name__ == "__main__":
    from studies.command_line import study

    study("contact_table")
