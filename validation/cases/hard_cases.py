"""Hard cases: outcome of each implementation, and of a straightforward model without the guard or rule in question.

A full run has every case; a quick run has the last case of each family and every QUICK_CASE_SPACING-th before it.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory

from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, Saved, System, Table, behaviour_row
from validation.hard_cases import cases_by_family
from validation.hard_cases.case import IMPLEMENTATIONS, WORDS, CaseOutcome, HardCase, judge
from validation.hard_cases.catalogue import COVERED_CLASSES, cases_beyond_catalogue

TITLE = "Hard cases"
SYSTEM: System = "hard-cases"
FEWEST_CASE_COUNT = 80
"""Least number of hard cases asked for; files of measurements count as one, since there are many."""
FAMILIES_OF_FILES = ("measured_files",)
QUICK_CASE_SPACING = 24


@allowing_breaches("hard cases go beyond what is taken for granted: that they stay stable, or say so, is judged")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """A row for each case and implementation; a quick run has the last case of each family and every twenty-fourth
    before it."""
    known, rows, data = cases_by_family(), list[Row](), list[Saved]()
    for family, case in cases_of_quick_run(known) if quick else known:
        with TemporaryDirectory() as files_folder:
            outcomes = {name: judge(case, name, Path(files_folder)) for name in case.judged_engines()}
            naive = case.naive_result(Path(files_folder)) if case.naive_result else ""
        rows += [_outcome_row(case, name, outcome) for name, outcome in outcomes.items()]
        case_texts: Saved = {"name": case.name, "hard": case.difficulty, "check": case.exact_answer}
        case_texts |= {"unit": case.unit, "tolerance": case.tolerance}
        sentence = {name: asdict(outcome) for name, outcome in outcomes.items()}
        data.append({"family": family, **case_texts, "outcomes": sentence, "naive": naive})
    words = [[outcome["word"] for outcome in entry["outcomes"].values()] for entry in data]
    counted = sum(family not in FAMILIES_OF_FILES for family, _ in known)
    share = f"{len(data)} of {len(known)}" if quick else f"all {len(known)}"
    rows += [
        Observed(
            "hard.silent",
            SYSTEM,
            f"silent wrong answers in {share} hard cases, {sum(map(len, words))} outcomes",
            sum(files_folder.count("SILENT") for files_folder in words),
            "",
        ).at_most(0.0, "a finite wrong answer without a word is never accepted", "none"),
        Observed(
            "hard.passed",
            SYSTEM,
            "hard cases in which every implementation gives a right answer, refuses, or reports its failure",
            sum("SILENT" not in files_folder for files_folder in words),
            "cases",
        ).within(len(data), 0, f"every one; {share} were run", "none"),
        Observed(
            "hard.count",
            SYSTEM,
            "shortfall of the number of hard cases from 80, all measurement files counted once",
            max(0, FEWEST_CASE_COUNT - counted - 1),
            "cases",
        ).at_most(0.0, f"{counted} cases without measurement files", "none"),
    ]
    return rows, {"cases": data, "known": [(family, case.name) for family, case in known]}


def cases_of_quick_run(cases_with_family: Sequence[tuple[str, HardCase]]) -> list[tuple[str, HardCase]]:
    """Cases of a quick run: the last case of each family, and every QUICK_CASE_SPACING-th before it."""
    families = dict.fromkeys(family for family, _ in cases_with_family)
    return [
        pair
        for name in families
        for pair in [case for case in cases_with_family if case[0] == name][::-QUICK_CASE_SPACING]
    ]


def _outcome_row(hard_case: HardCase, implementation_name: str, case_outcome: CaseOutcome) -> Row:
    """Row of a hard case: its error if a result is expected and given, else its outcome."""
    name = hard_case.name.replace(",", "").replace(" ", "-")
    id = f"hard.{name}.{'any' if hard_case.is_without_engine else implementation_name}"
    quantity = (
        f"{hard_case.name}{'' if hard_case.is_without_engine else f', {implementation_name}'}: {hard_case.exact_answer}"
    )
    if hard_case.wanted_outcome(implementation_name) == "right" and case_outcome.error is not None:
        error, judged = case_outcome.error, hard_case.independence(implementation_name)
        return Observed(id, SYSTEM, quantity, error, hard_case.unit).at_most(
            hard_case.tolerance, hard_case.tolerance_reason, judged
        )
    return behaviour_row(
        id, SYSTEM, quantity, case_outcome.word, hard_case.wanted_outcome(implementation_name), hard_case.difficulty
    )


def tables(case_data: Saved) -> list[Table]:
    """Tables of the catalogue of failures, of the counts by family, and of all hard cases."""
    return [_catalogue_table(case_data), _family_table(case_data), _case_table(case_data["cases"])]


def _catalogue_table(case_data: Saved) -> Table:
    """Table of the catalogue's classes of failures with the hard cases that belong to each."""
    words = {name: ["in full"] for _, name in case_data["known"]}
    words |= {entry["name"]: sorted({o["word"] for o in entry["outcomes"].values()}) for entry in case_data["cases"]}
    rows = tuple(
        (str(number), what, "; ".join(f"{name} ({', '.join(words.get(name, ['missing']))})" for name in names))
        for number, (what, names) in COVERED_CLASSES.items()
    )
    more = len(cases_beyond_catalogue(list(words)))
    return Table(
        "The catalogue of hard cases",
        f"Classes of failures known from practice and literature, with the "
        f"cases here that stand for each and their outcomes; {more} further cases belong to none of them.",
        ("number", "class of failures", "cases"),
        rows,
    )


def _family_table(case_data: Saved) -> Table:
    """Table with the numbers of cases, of cases that were run, and of their outcomes, for every family and for all."""
    known = Counter(family for family, _ in case_data["known"])
    groups = {name: [entry for entry in case_data["cases"] if entry["family"] == name] for name in known}
    groups["all"] = case_data["cases"]
    known["all"] = len(case_data["known"])
    ended = {
        name: Counter(o["word"] for entry in in_group for o in entry["outcomes"].values())
        for name, in_group in groups.items()
    }
    rows = tuple(
        (name.replace("_", " "), f"{len(in_group)} of {known[name]}", *(str(ended[name][word]) for word in WORDS))
        for name, in_group in groups.items()
    )
    return Table(
        "Hard cases by family",
        "Outcomes are counted per implementation; a case in which no engine has a part is judged once.",
        ("family", "cases run", *WORDS),
        rows,
    )


def _case_table(case_entries: list[Saved]) -> Table:
    """Table of all cases: what is hard, the check, and the outcome in each implementation."""
    rows = tuple(
        (
            entry["name"],
            entry["hard"],
            f"{entry['check']}{_tolerance_text(entry)}",
            *(
                _outcome_text(entry["outcomes"][name]) if name in entry["outcomes"] else "as left"
                for name in IMPLEMENTATIONS
            ),
            entry["naive"],
        )
        for entry in case_entries
    )
    note = (
        "Each implementation is right (its error is beside the word), refuses before the run, or raises after it. "
        "SILENT would be a finite wrong answer without a word. The last column is what a build without the guard "
        "or rule in question does, measured in the same run."
    )
    return Table(TITLE, note, ("case", "what is hard", "checked against", *IMPLEMENTATIONS, "without the guard"), rows)


def _tolerance_text(case_entry: Saved) -> str:
    return f" (allowed {case_entry['tolerance']:.0e} {case_entry['unit']})" if case_entry["unit"] else ""


def _outcome_text(case_outcome: Saved) -> str:
    return (
        case_outcome["word"]
        if case_outcome["error"] is None
        else f"{case_outcome['word']}, {case_outcome['error']:.1e}"
    )
