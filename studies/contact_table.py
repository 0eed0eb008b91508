"""Forces for a table of contacts: from a CSV with a contact in every row to a CSV with forces, errors and a status."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from models.contact.cases_table import answer, compile_first
from models.contact.scene import ContactScene
from models.contact.work_precision import duration
from models.errors import InputError

SYSTEM = "contact"
Progress = Callable[[str, float], None]
ANSWER = "forces.csv"


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
    compile_first(scene.pair, scene.method)  # no part of the time below
    start = time.perf_counter()
    rows = answer(path, folder / ANSWER, scene.pair, scene.method, lambda done: progress(f"{done:,} rows", 0.0))
    seconds = time.perf_counter() - start
    table = told(rows["rows"], rows["wrong"], path.name, seconds)
    return {"scene": scene.title, "folder": str(folder), "failed": {}, "rows": rows, "seconds": seconds, "table": table}


def told(rows: int, wrong: int, name: str, seconds: float) -> list[str]:
    """What is printed of ``rows`` rows, of which some are wrong, from the file ``name``."""
    if rows == 0:
        return [f"  no rows in {name}"]
    sound = ", all of them sound" if rows > 1 else ", sound"
    state = f"; {wrong:,} of them wrong, see their status" if wrong else sound
    each = f", {duration(seconds / rows)} a row" if rows > 1 else ""
    return [f"  {rows:,} row{'s' * (rows > 1)} of {name}{state}",
            f"  {duration(seconds)}{each}: reading, forces twice for the error of the cells, writing"]  # fmt: skip


if __name__ == "__main__":
    from studies.command_line import study

    study("contact_table")
