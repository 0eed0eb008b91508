"""What ``twinrig validate`` does beside the report: the suite for an engine from outside, and the blind-spot audit."""

import sys
from pathlib import Path

from models.core.errors import InputError
from studies.command.finishing import exit_with_message, folder_of
from studies.command.waiting import progress_bar


def conformity_report(engine: str, more: bool, out: Path | None) -> None:
    """Put an engine from outside the tree through the suite."""
    from models.core.result_folders import new_folder
    from models.engines.outside import register
    from validation.conformity import conformity

    if more:
        raise InputError("--engine", "", engine, "has one suite, without --quick, --against and --resume")
    register(engine)
    folder = new_folder(out, "conformity")
    sys.exit(1 if conformity(engine, folder, " ".join(["twinrig", *sys.argv[1:]])) else 0)


def blind_spot_audit(more: bool, only: str | None, out: Path | None, resume: Path | None) -> None:
    """Audit all shared functions, or those whose name is like ``only``; raises InputError for options that go with a
    report."""
    if more:
        raise InputError("--blind-spots", "", True, "goes without --quick and --against")
    from validation.blind_spots.audit import TRACE, audit, audit_of, audit_summary

    again = "twinrig validate --blind-spots" + ("" if only is None else f" --only '{only}'")
    folder = folder_of("blind-spots", TRACE, "", out, resume)
    try:
        with progress_bar("blind spots") as progress:
            lines = audit(folder, progress) if only is None else audit_of(only, folder, progress)
    except KeyboardInterrupt:
        exit_with_message(f"interrupted; finished functions are kept: {again} --resume {folder}", 130)
    print("\n".join(audit_summary(lines, folder)))
