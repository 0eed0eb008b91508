"""Lists in docs/not_covered.md: functions whose faults no independent row or test detects, by the saved audit.

``python -m docs.not_covered`` writes them; what stands before the mark is written by hand.
"""

from collections import Counter
from itertools import groupby
from textwrap import fill

from docs.pages import ROOT
from validation.blind_spots.table import NOT_AUDITED, WHY_HARMLESS, Line, read_table, uncovered_functions

PAGE = ROOT / "docs" / "not_covered.md"
GENERATED_PART_MARK = "<!-- functions: written by `python -m docs.not_covered`; do not edit below -->\n"
HEADINGS = {
    "noticed by nothing": "No row or test that has an independent second side and runs them noticed these:",
    "noticed by nothing independent": "Rows noticed these, but none with an independent second side:",
    "run by nothing": "Nothing with an independent second side runs these in the quick cases:",
    "not spoiled": "The audit's rewriting sees nothing that these give back or write:",
    NOT_AUDITED: "These are shared, and were not put off so far:",
    WHY_HARMLESS[
        0
    ]: "A fault in these moves where a search begins, or its steps, and no value beyond the stated error, "
    "as a test of each proves:",
    WHY_HARMLESS[1]: "These hand on views of what they are given, arrays that are written over, zeros, or nothing:",
    WHY_HARMLESS[
        2
    ]: "These select by arrays of zeros and ones, which the audit leaves as they are; a test of each holds "
    "them to the right places:",
}
"""Sentence before the list of each kind of ``uncovered_functions``."""


def count_sentence(audit_lines: list[Line]) -> str:
    """Sentence for the page on the number of the audit's lines, their commits, and the covered functions."""
    noticed, empty = (
        sum(line.is_covered for line in audit_lines),
        sum(line.ended == "no numbers" for line in audit_lines),
    )
    commits = [f"{count} to `{commit}`" for commit, count in Counter(line.commit for line in audit_lines).most_common()]
    belong = ", ".join(commits[:-1]) + " and " + commits[-1] if len(commits) > 1 else commits[0]
    text = (
        f"The table has {len(audit_lines)} lines; by commit, {belong}. {noticed} functions were noticed by something "
        f"independent, and {empty} give no number."
    )
    return fill(text, 120) + "\n"


def function_list(names: list[str]) -> str:
    """Markdown list of functions, with an item for each module."""
    shown = [name.replace(".<locals>", "") for name in names]
    modules = groupby(shown, lambda name: name.partition(":")[0])
    return "".join("- " + ",\n  ".join(f"`{name}`" for name in same) + "\n" for _, same in modules)


def page(text: str) -> str:
    """Text of docs/not_covered.md, with counts and lists from the saved audit; the part before the mark is
    unchanged."""
    lines = read_table()
    kinds = uncovered_functions(lines, [line.function for line in lines])
    parts = [f"{fill(HEADINGS[kind], 120)}\n\n{function_list(names)}" for kind, names in kinds.items()]
    head = text.partition(GENERATED_PART_MARK)[0] + GENERATED_PART_MARK
    return head + "\n" + "\n".join([count_sentence(lines), *parts])


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
