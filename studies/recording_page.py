"""The page of a recording: a self-contained HTML file; its texts are in the template."""

import base64
import math
import platform
import sys
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from models.core.assumptions import assumption_sentences, broken_assumptions_of
from models.core.discretisation import error_lines
from models.core.result import Result
from models.core.whole_files import write_whole
from models.drawing.pages import environment_of
from models.fatigue.damage import WOEHLER_SLOPE
from models.systems.measured.consequences import DAMAGE_LIMITS, FORCE_LIMITS
from models.systems.measured.holds import FREE_RUN
from models.systems.measured.run import Examination
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.verdict import LARGEST_DISAGREEMENT, errors_of_run
from studies import recording_figures as draw

PAGE_TEMPLATE = "recording.html.jinja"
RUN_NAMES = {
    FREE_RUN: "Free run",
    "kalman": "Run held by the Kalman filter",
    "prescribed": "Run held to measured angles",
}
NEGLIGIBLE_CHANGE = 1e-6
"""Range (N, N m) below which a section force counts as constant: smaller changes are rounding."""
DRAWN_FORCES = 6
"""Largest number of section forces that are drawn; all are in the table and in the files."""


def write(examination: Examination, path: Path, result: Result) -> Path:
    """Write the page of a recording as a complete file; returns its path."""
    with TemporaryDirectory() as folder:
        text = page_text(examination, Path(folder), result)
    write_whole(path, text)
    return path


def page_text(examination: Examination, folder: Path, result: Result) -> str:
    """HTML text of a recording's page, with the stated errors and assumptions of the result; figures are drawn into
    ``folder`` and embedded."""
    environment = environment_of(Path(__file__).parent)
    environment.filters |= {"as": format, "png": lambda path: base64.b64encode(path.read_bytes()).decode()}
    library = examination.engine if examination.engine != "reference" else "numpy"
    return environment.get_template(PAGE_TEMPLATE).render(
        exam=examination,
        names=RUN_NAMES,
        errors=error_lines(result),
        breaches=[breach.line() for breach in broken_assumptions_of(result)],
        assumed=assumption_sentences(result),
        free=FREE_RUN,
        weights=[finding.weight for finding in examination.findings],
        used=[(signal, examination.is_input(signal)) for signal in examination.recording.signals],
        effects={
            finding: f" {consequence}."
            for consequence in examination.consequences
            if consequence.section_force
            for finding in [consequence.finding]
        },
        figures=_page_figures(examination, folder),
        limits={"disagrees": LARGEST_DISAGREEMENT, "force": FORCE_LIMITS, "damage": DAMAGE_LIMITS},
        forces=_section_force_content(examination, examination.outcome, folder)
        if examination.outcome is not None
        else None,
        sizes=[
            math.sqrt(sum(band.measured**2 for band in consequence.bands)) or math.inf
            for consequence in examination.channel_comparisons
        ],
        files=[
            (source, examination.scene.path(source.file, f"files.{i}.file"))
            for i, source in enumerate(examination.scene.files)
        ],
        command=" ".join(sys.argv),
        versions={name: version(name) for name in dict.fromkeys(("twinrig", library, "numpy", "scipy"))},
        python=platform.python_version(),
        scene=(Path(examination.scene.folder) / examination.scene.file).read_text(encoding="utf-8-sig"),
    )


def _page_figures(examination: Examination, folder: Path) -> dict[str, Any]:
    """Figures of the recording's page by name: input forces, findings above a note, drift of the runs, and measured
    channels that were not inputs of the run."""
    figures: dict[str, Any] = {"inputs": draw.inputs_figure(examination, folder / "inputs.png")}
    figures["findings"] = [
        (finding, draw.figure_of_finding(finding, examination.evidence, folder / f"finding_{i}.png"))
        for i, finding in enumerate(examination.findings)
        if finding.weight != "note"
    ]
    if examination.runs:
        figures["drift"] = draw.drift_figure(examination, folder / "drift.png")
    if examination.outcome is not None and examination.channel_comparisons:
        shown = [
            comparison for comparison in examination.channel_comparisons if comparison.signal.check
        ] or examination.channel_comparisons
        figures["checks"] = draw.overlay_figure(
            examination, examination.outcome, shown[:DRAWN_FORCES], folder / "checks.png"
        )
    return figures


def _section_force_content(examination: Examination, outcome: SectionOutcome, folder: Path) -> dict[str, Any]:
    """Content of the page's part on section forces: load counts of the varying forces, number of the constant ones, and
    figures of the first few."""
    moving = {
        answer: counts
        for answer, counts in examination.counted.items()
        if counts.largest_load - counts.smallest_load > NEGLIGIBLE_CHANGE
    }
    first, connectors = list(moving)[:DRAWN_FORCES], set(examination.rig.places.connectors)
    return {
        "slope": WOEHLER_SLOPE,
        "true": errors_of_run(outcome, examination.virtual, WOEHLER_SLOPE).damage
        if examination.virtual is not None
        else {},
        "moving": moving,
        "still": len(examination.counted) - len(moving),
        "first": len(first),
        "parts": [
            {a: counts for a, counts in moving.items() if (a.section in connectors) is is_connector}
            for is_connector in (True, False)
        ],
        "forces": draw.forces_figure(outcome, first, folder / "forces.png", examination.chosen_run),
        "counting": draw.counting_figure({answer: moving[answer] for answer in first}, folder / "counting.png"),
    }
