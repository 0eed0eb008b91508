"""Reference page of the validation report: its cases, and the rows of a report.

``python -m docs.validation_cases`` writes the cases into ``docs/reference/report_rows.md``; the site has the rows of
the newest report of the machine in that page, too (``docs.website``).
"""

import ast
import json
import re
from pathlib import Path
from typing import Any

from docs.pages import ROOT
from validation.cases import CASES

PAGE = ROOT / "docs" / "reference" / "report_rows.md"
GENERATED_PART_MARK = "<!-- cases: written by `python -m docs.validation_cases`; do not edit below -->\n"
CASES_FOLDER = ROOT / "validation" / "cases"


def _constant_text(tree: ast.Module, name: str) -> str:
    """Text of a constant of a module, from the syntax tree of its source; "" if it has no such constant."""
    for node in tree.body:
        targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
        value = getattr(node, "value", None)
        if any(getattr(target, "id", "") == name for target in targets) and isinstance(value, ast.Constant):
            return str(value.value)
    return ""


def cases_table() -> str:
    """Markdown table of the validation cases, in the order of the report."""
    lines = ["| case | title | system | what is compared |", "|---|---|---|---|"]
    for name in CASES:
        tree = ast.parse((CASES_FOLDER / f"{name}.py").read_text(encoding="utf-8"))
        says = (ast.get_docstring(tree) or "").partition("\n\n")[0].replace("\n", " ")
        lines.append(f"| `{name}` | {_constant_text(tree, 'TITLE')} | {_constant_text(tree, 'SYSTEM')} | {says} |")
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """Text of the reference page with the current cases; the part before the mark is unchanged."""
    return text.partition(GENERATED_PART_MARK)[0] + GENERATED_PART_MARK + "\n" + cases_table()


def newest_report(folder: Path = ROOT / "results") -> Path | None:
    """Path of the newest results.json of a report below a folder; None if there is none."""
    reports = [path for path in folder.glob("*/results.json") if "rows" in json.loads(path.read_text(encoding="utf-8"))]
    return max(reports, key=lambda path: path.stat().st_mtime, default=None)


def rows_table(report: Path) -> str:
    """Markdown table of all rows of a report: quantity, expected value, tolerance, independence and status."""
    lines = ["\n## Rows of the newest report\n", "| row | quantity | expected | tolerance | second side | status |"]
    lines += ["|---|---|---|---|---|---|"]
    shown = ("quantity", "expected", "tolerance", "independence", "status")
    for row in json.loads(report.read_text(encoding="utf-8"))["rows"]:
        cells = (f"`{row['id']}`", *(row[key] for key in shown))
        lines.append("| " + " | ".join(_cell_text(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def counts_table(report: Path) -> str:
    """Markdown table of the numbers of a report's rows by system and independence; rows that were not run are left
    out."""
    from validation.report.page import INDEPENDENCE_TEXTS, evidence_counts

    lines = [
        "\n## Rows of the newest report\n",
        "| system | " + " | ".join(INDEPENDENCE_TEXTS) + " |",
        "|---" * (len(INDEPENDENCE_TEXTS) + 1) + "|",
    ]
    for system, numbers in evidence_counts(json.loads(report.read_text(encoding="utf-8"))["rows"]):
        lines.append(f"| {system} | " + " | ".join(map(str, numbers)) + " |")
    return "\n".join(lines) + "\n"


def _cell_text(cell_value: Any) -> str:
    """Text of a table cell; brackets are escaped, because Markdown would take a pair as a link."""
    text = "" if cell_value is None else f"{cell_value:.6g}" if isinstance(cell_value, float) else str(cell_value)
    return re.sub(r"([|\[\]])", r"\\\1", text).replace("\n", " ")


def main(path: Path = PAGE) -> None:
    """Write the current cases into the reference page."""
    path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
