"""Equivalent conicity of a wheelset by EN 15302 and by the first harmonic, from a table or from wheel and rail
profiles."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from models.systems.wheelset import conicity
from models.systems.wheelset.scene import WheelsetScene

SYSTEM = "wheelset"
ReportProgress = Callable[[str, float], None]


def run(
    scene: WheelsetScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute both equivalent conicities at each amplitude; saves ``conicity.nc``, ``conicity.csv``,
    ``rolling_radii.csv`` and a figure, and returns the summary.

    ``rolling_radii.csv`` holds the differences that were used and can be read as a table again.
    """
    from studies.wheelset_figures import conicity_figure

    conicities = conicity.run(scene, lambda share: report_progress("rolling radii", 0.9 * share))
    conicity.refuse_without_wave(scene, conicities.detail)
    conicities.save(output_folder / "conicity.nc")
    conicities.save_table(output_folder / "conicity.csv", "amplitude", *conicity.CONICITY_CHANNELS)
    conicities.detail.save_table(output_folder / "rolling_radii.csv")
    conicity_figure(conicities, scene.title, output_folder / "conicity.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": conicity.conicity_numbers(conicities),
        "results": {"conicity": conicities},
        "table": conicity.conicity_lines(conicities.detail),
    }


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("conicity")
