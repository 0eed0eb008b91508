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
from models.systems.measured.holds import FREE_RUN_NAME
from models.systems.measured.run import RecordingAnalysis
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.verdict import LARGEST_DISAGREEMENT, errors_of_run
from studies import recording_figures as draw

PAGE_TEMPLATE = "recording.html.jinja"
RUN_NAMES = {
    FREE_RUN_NAME: "Free run",
    "kalman": "Run held by the Kalman filter",
    "prescribed": "Run held to measured angles",
}
NEGLIGIBLE_CHANGE = 1e-6
"""Range (N, N m) below which a section force counts as constant: smaller changes are rounding."""
DRAWN_FORCE_LIMIT = 6
"""Largest number of section forces that are drawn; all are in the table and in the files."""


def write(examined_recording: RecordingAnalysis, page_path: Path, saved_result: Result) -> Path:
    """Write the page of a recording as a complete file; returns its path."""
    with TemporaryDirectory() as folder:
        text = page_text(examined_recording, Path(folder), saved_result)
    write_whole(page_path, text)
    return page_path


def page_text(examined_recording: RecordingAnalysis, output_folder: Path, saved_result: Result) -> str:
    """HTML text of a recording's page, with the stated errors and assumptions of the result; figures are drawn into
    ``output_folder`` and embedded."""
    environment = environment_of(Path(__file__).parent)
    environment.filters |= {"as": format, "png": lambda path: base64.b64encode(path.read_bytes()).decode()}
    library = examined_recording.engine if examined_recording.engine != "reference" else "numpy"
    return environment.get_template(PAGE_TEMPLATE).render(
        exam=examined_recording,
        names=RUN_NAMES,
        errors=error_lines(saved_result),
        breaches=[breach.line() for breach in broken_assumptions_of(saved_result)],
        assumed=assumption_sentences(saved_result),
        free=FREE_RUN_NAME,
        weights=[finding.weight for finding in examined_recording.findings],
        used=[(signal, examined_recording.is_input(signal)) for signal in examined_recording.recording.signals],
        effects={
            finding: f" {consequence}."
            for consequence in examined_recording.consequences
            if consequence.section_force
            for finding in [consequence.finding]
        },
        figures=_page_figures(examined_recording, output_folder),
        limits={"disagrees": LARGEST_DISAGREEMENT, "force": FORCE_LIMITS, "damage": DAMAGE_LIMITS},
        forces=_section_force_content(examined_recording, examined_recording.outcome, output_folder)
        if examined_recording.outcome is not None
        else None,
        sizes=[
            math.sqrt(sum(band.measured**2 for band in consequence.bands)) or math.inf
            for consequence in examined_recording.channel_comparisons
        ],
        files=[
            (source, examined_recording.scene.path(source.file, f"files.{i}.file"))
            for i, source in enumerate(examined_recording.scene.files)
        ],
        command=" ".join(sys.argv),
        versions={name: version(name) for name in dict.fromkeys(("twinrig", library, "numpy", "scipy"))},
        python=platform.python_version(),
        scene=(Path(examined_recording.scene.folder) / examined_recording.scene.file).read_text(encoding="utf-8-sig"),
    )


def _page_figures(examined_recording: RecordingAnalysis, output_folder: Path) -> dict[str, Any]:
    """Figures of the recording's page by name: input forces, findings above a note, drift of the runs, and measured
    channels that were not inputs of the run."""
    figures: dict[str, Any] = {"inputs": draw.measured_forces_figure(examined_recording, output_folder / "inputs.png")}
    figures["findings"] = [
        (
            finding,
            draw.figure_of_finding(finding, examined_recording.evidence_for_checks, output_folder / f"finding_{i}.png"),
        )
        for i, finding in enumerate(examined_recording.findings)
        if finding.weight != "note"
    ]
    if examined_recording.runs:
        figures["drift"] = draw.drift_figure(examined_recording, output_folder / "drift.png")
    if examined_recording.outcome is not None and examined_recording.channel_comparisons:
        shown = [
            comparison for comparison in examined_recording.channel_comparisons if comparison.signal.check
        ] or examined_recording.channel_comparisons
        figures["checks"] = draw.measured_and_computed_figure(
            examined_recording, examined_recording.outcome, shown[:DRAWN_FORCE_LIMIT], output_folder / "checks.png"
        )
    return figures


def _section_force_content(
    examined_recording: RecordingAnalysis, run_outcome: SectionOutcome, output_folder: Path
) -> dict[str, Any]:
    """Content of the page's part on section forces: load counts of the varying forces, number of the constant ones, and
    figures of the first few."""
    moving = {
        answer: counts
        for answer, counts in examined_recording.counted.items()
        if counts.largest_load - counts.smallest_load > NEGLIGIBLE_CHANGE
    }
    first, connectors = list(moving)[:DRAWN_FORCE_LIMIT], set(examined_recording.rig.places.connectors)
    return {
        "slope": WOEHLER_SLOPE,
        "true": errors_of_run(run_outcome, examined_recording.virtual, WOEHLER_SLOPE).damage
        if examined_recording.virtual is not None
        else {},
        "moving": moving,
        "still": len(examined_recording.counted) - len(moving),
        "first": len(first),
        "parts": [
            {a: counts for a, counts in moving.items() if (a.section in connectors) is is_connector}
            for is_connector in (True, False)
        ],
        "forces": draw.section_forces_figure(
            run_outcome, first, output_folder / "forces.png", examined_recording.chosen_run
        ),
        "counting": draw.load_counts_figure(
            {answer: moving[answer] for answer in first}, output_folder / "counting.png"
        ),
    }
