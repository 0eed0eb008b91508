"""Forces for a table of contacts: from a CSV with a contact in every row to a CSV with forces, errors and a status."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from models.core.errors import InputError
from models.machine.seconds import duration_text
from models.systems import run as run_scene
from models.systems.contact.run import BLOCKS_FOLDER
from models.systems.contact.scene import ContactScene

__all__ = ["BLOCKS_FOLDER"]  # what --resume goes on from
SYSTEM = "contact"
ReportProgress = Callable[[str, float], None]


def check(scene: ContactScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a scene of a single contact, and for a missing file."""
    if scene.cases is None:
        allowed = "needs the table [cases] with a file; one contact is what the study contact computes"
        raise InputError(scene.file, "study", scene.study, allowed)
    scene.cases_file()


def run(
    scene: ContactScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute the forces of every row into ``forces.csv``; saves the first rows and the magnitudes of all as
    ``forces.nc``, and returns the summary."""
    check(scene, engines)
    rows = run_scene(scene, error=scene.error, answers=output_folder / "forces.csv", progress=report_progress)
    rows.save(output_folder / "forces.nc")
    counts = rows.counts()
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "rows": counts,
        "answer": json.loads(rows.data.attrs["sizes"]),
        "results": {"forces": rows},
        "seconds": rows.seconds,
        "table": summary_lines(counts["rows"], counts["wrong"], scene.cases_file().name, rows.seconds, scene.error),
    }


def summary_lines(
    row_count: int, wrong_row_count: int, file_name: str, computing_seconds: float, has_errors: bool = True
) -> list[str]:
    """Lines for the screen on the number of computed rows of the file ``file_name``, the number of wrong rows, and the
    computing time (s)."""
    if row_count == 0:
        return [f"  no rows in {file_name}"]
    sound = ", all of them sound" if row_count > 1 else ", sound"
    state = f"; {wrong_row_count:,} of them wrong, see their status" if wrong_row_count else sound
    row_time_text = f", {duration_text(computing_seconds / row_count)} a row" if row_count > 1 else ""
    twice = " twice for the error of cells" if has_errors else ""
    return [
        f"  {row_count:,} row{'s' * (row_count > 1)} of {file_name}{state}",
        f"  {duration_text(computing_seconds)}{row_time_text}, once: reading, forces{twice}, writing",
    ]


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("contact_table")
