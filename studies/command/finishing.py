"""End of a command: a folder of results and a summary on the terminal, or a message and an exit code."""

import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from models.core.errors import InputError
from models.core.finding import Finding, finding_lines, findings_as_dicts
from models.core.whole_files import write_whole
from studies.command.waiting import progress_bar

StudyRun = Callable[[Any], dict[str, Any]]
"""Function that runs a study: its argument reports progress, and it returns the summary."""


def exit_with_message(message: str, exit_code: int) -> NoReturn:
    """End the process with a message on stderr and an exit code: 1 for a failed run, 2 for a user's mistake, 130 for
    Ctrl-C."""
    print(f"twinrig: {message}", file=sys.stderr)
    sys.exit(exit_code)


def profiling_wrapper(is_profiled: bool) -> Callable[[StudyRun], StudyRun]:
    """Wrapper for the function that runs a study: with ``is_profiled``, its summary also states where computing time
    was spent; without, the function is unchanged."""
    if not is_profiled:
        return lambda work: work
    from studies.command.profile import Profiler

    profiler = Profiler()
    return lambda work: partial(profiler.run_profiled, work)


def run_and_print_summary(
    run_study: StudyRun,
    output_folder: Path,
    as_json: bool,
    doubts: tuple[Finding, ...] = (),
    is_strict: bool = False,
    system_name: str = "",
) -> None:
    """Run a study, whose results are saved in ``output_folder``, with a progress bar, and print its summary.

    doubts : about the input, which stand in the summary and, as ``queries.json``, beside the results; is_strict :
    whether a broken assumption ends with code 1; system_name : of the scene.
    """
    from models.core.result_folders import COMMAND_FILE, drop_if_empty
    from models.core.told import summary_with_errors

    try:
        with progress_bar(output_folder.name, system_name) as progress:
            summary = summary_with_errors(run_study(progress))
        if doubts:
            summary["queries"] = findings_as_dicts(doubts)
            write_whole(output_folder / "queries.json", json.dumps(summary["queries"], indent=1) + "\n")
    except KeyboardInterrupt:
        has_results = {path.name for path in output_folder.iterdir()} - {COMMAND_FILE}
        outcome = f"finished results are kept in {output_folder}" if has_results else "nothing was finished"
        exit_with_message(f"interrupted; {outcome}", 130)
    finally:
        drop_if_empty(output_folder)
    if as_json:
        print(json.dumps(summary, indent=1))
    else:
        _print_summary(summary, doubts)
    if summary.get("failed") or (is_strict and any(judged["broken"] for judged in summary["assumptions"].values())):
        sys.exit(1)


def results_folder_of(
    scene_name: str,
    blocks_folder: str | None,
    study_name: str,
    output_folder: Path | None,
    interrupted_folder: Path | None,
) -> Path:
    """Folder for the results: a new folder, or the folder of an interrupted run, with finished parts in
    ``blocks_folder``."""
    from models.core.result_folders import new_folder, resumed_folder

    if interrupted_folder is None:
        return new_folder(output_folder, scene_name)
    if output_folder is not None:
        raise InputError("--resume", "", str(interrupted_folder), "goes on in its own folder: leave out --out")
    if blocks_folder is None:
        raise InputError(
            "--resume", "", str(interrupted_folder), f"the study {study_name!r} keeps nothing that can be resumed"
        )
    return resumed_folder(interrupted_folder, blocks_folder)


def unprinted_finding_lines(findings: tuple[Finding, ...], printed_text: str) -> list[str]:
    """Lines for the screen on findings whose text does not occur in ``printed_text``, the lines already printed."""
    return finding_lines(finding for finding in findings if finding.text not in printed_text)


def _print_summary(summary: dict[str, Any], doubts: tuple[Finding, ...]) -> None:
    """Print the summary of a study, with doubts about its input, as text."""
    print(summary["scene"])
    for engine, line in summary.get("runs", {}).items():
        steps, calls = line["counts"].get("steps", 0), line["counts"].get("force calls", 0)
        print(
            f"  {engine:<10} {line['integrator']:<17} step {line['step']:g} s  {steps} steps, "
            f"{calls} force calls, {line['seconds']:.3f} s once"
        )
    for engine, reason in summary.get("failed", {}).items():
        print(f"  {engine:<10} FAILED: {reason}")
    for pair, gap in summary.get("largest difference of states", {}).items():
        print(f"  {pair}: states differ by at most {gap:.1e}")
    table = summary.get("table", [])
    for line in (*unprinted_finding_lines(doubts, "\n".join(table)), *table):
        print(line)
    has_folder = Path(summary["folder"]).exists()
    print(f"  results in {summary['folder']}" if has_folder else "  nothing was saved")
