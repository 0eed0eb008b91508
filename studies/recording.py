"""From an engineer's measurement files to section forces: files are read, checked, run and judged; results and a page
are saved."""

from pathlib import Path
from typing import Any

import numpy as np

from models.core.finding import findings_as_dicts, merged_findings
from models.core.strict import Strict, read
from models.drift.score import root_mean_square
from models.systems.measured.consequences import consequence_texts
from models.systems.measured.run import WORK_FOLDER, RecordingAnalysis
from models.systems.measured.run import run as run_scene
from models.systems.measured.scene import MeasuredScene

SYSTEM, BLOCKS_FOLDER = "measured", WORK_FOLDER


class Options(Strict):
    """Keys of the table [options] of this study: none."""


def check(scene: MeasuredScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for any option, as this study has none."""
    read(Options, scene.options, scene.file, "options")


def run(scene: MeasuredScene, engines: tuple[str, ...], output_folder: Path, report_progress: Any) -> dict[str, Any]:
    """Check, run and judge the recording; saves the result and the page, the page even if errors in the recording
    prevent the run; returns the summary."""
    from studies.recording_page import write

    result = run_scene(scene, engines[-1], output_folder, report_progress, whole_run=True, error=scene.error)
    exam: RecordingAnalysis = result.detail
    result.save(output_folder / "recording.nc")
    page = write(exam, output_folder / "recording.html", result)
    return {
        "scene": exam.scene.title,
        "folder": str(output_folder),
        "failed": _failure_reasons(exam),
        "page": str(page),
        "results": {exam.chosen_run: result},
        "verdicts": {name: [verdict.word, verdict.reason] for name, verdict in exam.verdicts.items()},
        "effects": [str(consequence) for consequence in exam.consequences],
        "findings": findings_as_dicts(finding for finding in exam.findings if finding.weight != "note"),
        "doubts": sum(finding.weight == "doubt" for finding in exam.findings),
        "channels": _section_force_magnitudes(exam),
        "table": [*_lines_of_findings(exam), f"  the page: {page}"],
    }


def _failure_reasons(examined_recording: RecordingAnalysis) -> dict[str, str]:
    """Reasons for which the command ends with code 1: errors in the recording, or the failure of the run whose results
    were to be saved."""
    if examined_recording.has_error_findings:
        count = sum(finding.weight == "error" for finding in examined_recording.findings)
        return {"checks": f"{count} error(s) in the recording: nothing was run"}
    return {
        name: text
        for name, text in examined_recording.failed.items()
        if name == examined_recording.scene.stabilise.method
    }


def _section_force_magnitudes(examined_recording: RecordingAnalysis) -> dict[str, Any]:
    """Unit, largest magnitude and rms of each section force, for the summary."""
    sizes = dict[str, Any]()
    for answer, counted in examined_recording.counted.items():
        assert examined_recording.outcome is not None
        largest = float(np.abs([counted.smallest_load, counted.largest_load]).max())
        sizes[answer.name] = {
            "unit": answer.unit,
            "max": largest,
            "rms": root_mean_square(examined_recording.outcome.samples(answer)),
        }
    return sizes


def _lines_of_findings(examined_recording: RecordingAnalysis) -> list[str]:
    """Lines for the screen: findings above a note, how each run ended, and the verdicts on the runs."""
    lines = [
        f"  {finding.weight}: {finding.text}"
        for finding in merged_findings(examined_recording.findings)
        if finding.weight != "note"
    ]
    notes = sum(finding.weight == "note" for finding in examined_recording.findings)
    lines.append(f"  {notes} notes say what was looked at and found good, or could not be looked at: see the page")
    lines += [f"  {subject} of the free run: {trust}" for subject, trust in examined_recording.trust]
    for name, outcome in examined_recording.runs.items():
        end = examined_recording.failed.get(name, "to the end")
        lines.append(f"  {name} run: {outcome.period * (outcome.done - 1):.6g} s, {end}")
    lines += [f"  effect of {text}" for text in consequence_texts(examined_recording.consequences)]
    lines += [
        f"  verdict on the {name} run: {verdict.word} ({verdict.reason})"
        for name, verdict in examined_recording.verdicts.items()
    ]
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("recording")
