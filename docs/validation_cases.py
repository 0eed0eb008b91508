"""The reference of the validation report: its cases, and the rows of a report.

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
START = "<!-- cases: written by `python -m docs.validation_cases`; do not edit below -->\n"
FOLDER = ROOT / "validation" / "cases"


def _constant(tree: ast.Module, name: str) -> str:
    """Value of a constant of a module, read and not imported."""
    for node in tree.body:
        targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
        value = getattr(node, "value", None)
        if any(getattr(target, "id", "") == name for target in targets) and isinstance(value, ast.Constant):
            return str(value.value)
    return ""


def cases() -> str:
    """The table of cases in Markdown, in the order of the report."""
    lines = ["| case | title | system | what is compared |", "|---|---|---|---|"]
    for name in CASES:
        tree = ast.parse((FOLDER / f"{name}.py").read_text(encoding="utf-8"))
        says = (ast.get_docstring(tree) or "").partition("\n\n")[0].replace("\n", " ")
        lines.append(f"| `{name}` | {_constant(tree, 'TITLE')} | {_constant(tree, 'SYSTEM')} | {says} |")
    return "\n".join(lines) + "\n"


def page(text: str) -> str:
    """The page with the cases as they are now; what stands before them is written by hand."""
    return text.partition(START)[0] + START + "\n" + cases()


def newest_report(folder: Path = ROOT / "results") -> Path | None:
    """The newest results.json of a report below a folder, None where there is none."""
    reports = [path for path in folder.glob("*/results.json") if "rows" in json.loads(path.read_text(encoding="utf-8"))]
    return max(reports, key=lambda path: path.stat().st_mtime, default=None)


def rows(report: Path) -> str:
    """All rows of a report in Markdown: what is compared, with what, and how it ended."""
    lines = ["\n## Rows of the newest report\n", "| row | quantity | expected | tolerance | second side | status |"]
    lines += ["|---|---|---|---|---|---|"]
    shown = ("quantity", "expected", "tolerance", "independence", "status")
    for row in json.loads(report.read_text(encoding="utf-8"))["rows"]:
        cells = (f"`{row['id']}`", *(row[key] for key in shown))
        lines.append("| " + " | ".join(_cell(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def counts(report: Path) -> str:
    """Rows of a report per system and kind of second side in Markdown; those that were not run do not count."""
    from validation.report.page import INDEPENDENCE_TEXTS, evidence_counts

    lines = [
        "\n## Rows of the newest report\n",
        "| system | " + " | ".join(INDEPENDENCE_TEXTS) + " |",
        "|---" * (len(INDEPENDENCE_TEXTS) + 1) + "|",
    ]
    for system, numbers in evidence_counts(json.loads(report.read_text(encoding="utf-8"))["rows"]):
        lines.append(f"| {system} | " + " | ".join(map(str, numbers)) + " |")
    return "\n".join(lines) + "\n"


def _cell(value: Any) -> str:
    """Text of a cell; brackets are escaped, as a pair of them would be a link to a reference."""
    text = "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
    return re.sub(r"([|\[\]])", r"\\\1", text).replace("\n", " ")


def main(path: Path = PAGE) -> None:
    """Write the cases into the page."""
    path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
