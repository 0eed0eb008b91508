"""Further tasks of ``twinrig validate``: conformity checks for an engine of the user, and the blind-spot audit."""

import sys
from pathlib import Path

from models.core.errors import InputError
from studies.command.finishing import exit_with_message, results_folder_of
from studies.command.waiting import progress_bar


def conformity_report(engine: str, has_other_options: bool, requested_folder: Path | None) -> None:
    """Run the conformity checks on an engine of the user, write their report, and end the process with the exit
    code."""
    from models.core.result_folders import new_folder
    from models.engines.outside import register
    from validation.conformity import conformity

    if has_other_options:
        raise InputError("--engine", "", engine, "has one suite, without --quick, --against and --resume")
    register(engine)
    folder = new_folder(requested_folder, "conformity")
    sys.exit(1 if conformity(engine, folder, " ".join(["twinrig", *sys.argv[1:]])) else 0)


def blind_spot_audit(
    has_other_options: bool,
    function_pattern: str | None,
    requested_folder: Path | None,
    interrupted_folder: Path | None,
) -> None:
    """Audit which rows and tests detect faults in shared functions, all or those that match ``function_pattern``;
    raises InputError for options of a report."""
    if has_other_options:
        raise InputError("--blind-spots", "", True, "goes without --quick and --against")
    from validation.blind_spots.audit import TRACE, audit, audit_of, audit_summary

    command = "twinrig validate --blind-spots" + ("" if function_pattern is None else f" --only '{function_pattern}'")
    folder = results_folder_of("blind-spots", TRACE, "", requested_folder, interrupted_folder)
    try:
        with progress_bar("blind spots") as progress:
            lines = (
                audit(folder, progress) if function_pattern is None else audit_of(function_pattern, folder, progress)
            )
    except KeyboardInterrupt:
        exit_with_message(f"interrupted; finished functions are kept: {command} --resume {folder}", 130)
    print("\n".join(audit_summary(lines, folder)))
