"""The table of hard cases: outcome of each implementation, and what an obvious build does instead."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from validation.hard_cases import all_cases
from validation.hard_cases.case import IMPLEMENTATIONS, Case, Outcome, judge
from validation.rows import Row, System, Table, at_most, behaves

TITLE = "Hard cases"
SYSTEM: System = "hard-cases"


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """A row per case and implementation, all of them in both modes: they take seconds."""
    rows: list[Row] = []
    data: list[dict[str, Any]] = []
    for case in all_cases():
        with TemporaryDirectory() as own:
            outcomes = {name: judge(case, name, Path(own)) for name in case.judged()}
            naive = case.naive(Path(own)) if case.naive else ""
        rows += [_row(case, "any" if case.once else name, outcome) for name, outcome in outcomes.items()]
        data.append(_record(case, outcomes, naive))
    silent = sum(outcome["word"] == "SILENT" for entry in data for outcome in entry["outcomes"].values())
    rows.append(
        at_most(
            "hard.silent",
            SYSTEM,
            f"silent wrong answers in {len(data)} cases, three implementations each",
            silent,
            "",
            0.0,
            "a finite wrong answer without a word is never accepted",
            "none",
        )
    )
    return rows, {"cases": data}


def _row(case: Case, implementation: str, outcome: Outcome) -> Row:
    """The error where an answer is wanted and given, the behaviour otherwise."""
    id = f"hard.{case.name.replace(',', '').replace(' ', '-')}.{implementation}"
    quantity = f"{case.name}{'' if case.once else f', {implementation}'}: {case.check}"
    if case.wanted(implementation) == "right" and outcome.error is not None:
        error, judged = outcome.error, case.independence(implementation)
        return at_most(id, SYSTEM, quantity, error, case.unit, case.tolerance, case.why, judged)
    return behaves(id, SYSTEM, quantity, outcome.word, case.wanted(implementation), case.hard)


def _record(case: Case, outcomes: dict[str, Outcome], naive: str) -> dict[str, Any]:
    found = {name: {"word": o.word, "error": o.error, "message": o.message} for name, o in outcomes.items()}
    return {
        "name": case.name,
        "hard": case.hard,
        "check": case.check,
        "unit": case.unit,
        "tolerance": case.tolerance,
        "outcomes": found,
        "naive": naive,
    }


def tables(data: dict[str, Any]) -> list[Table]:
    """The one table of hard cases."""
    rows = tuple(
        (entry["name"], entry["hard"], f"{entry['check']}{_allowed(entry)}",
         *(_cell(entry["outcomes"][name]) if name in entry["outcomes"] else "as left" for name in IMPLEMENTATIONS),
         entry["naive"])
        for entry in data["cases"]
    )  # fmt: skip
    note = (
        "Each implementation is right (its error is beside the word), refuses before the run, or raises after it. "
        "SILENT would be a finite wrong answer without a word. The last column is what a build without the guard "
        "or rule in question does, measured in the same run."
    )
    return [
        Table(TITLE, note, ("case", "what is hard", "checked against", *IMPLEMENTATIONS, "without the guard"), rows)
    ]


def _allowed(entry: dict[str, Any]) -> str:
    return f" (allowed {entry['tolerance']:.0e} {entry['unit']})" if entry["unit"] else ""


def _cell(outcome: dict[str, Any]) -> str:
    return outcome["word"] if outcome["error"] is None else f"{outcome['word']}, {outcome['error']:.1e}"
