"""The report: one self-contained page, from saved results alone; it never simulates.

``python -m validation.report FOLDER`` draws it again, byte for byte the same.
"""

import json
import os
from pathlib import Path
from typing import Any

from models.errors import InputError
from validation.report import content
from validation.report.numbers import duration, margin, marked, number, numeric_columns, powers, share

TEMPLATE = "page.html.jinja"
BLANK: dict[str, Any] = {"quick": False, "command": "", "versions": {}, "seconds": {}, "wall": None}
"""What a page needs of its provenance, where the results do not hold it."""


def write(folder: Path) -> Path:
    """Write ``folder/report.html`` from ``results.json`` and ``data/CASE.json``; returns its path."""
    results = _read(folder / "results.json")
    path = folder / "report.html"
    part = folder / ".report.html.part"
    part.write_text(page(results, folder / "data"), encoding="utf-8")
    os.replace(part, path)
    return path


def _read(path: Path) -> dict[str, Any]:
    """Saved results; raises InputError if the file is not one."""
    try:
        results = json.loads(path.read_text(encoding="utf-8"))
        return {"provenance": {**BLANK, **results["provenance"]}, "rows": list(results["rows"]),
                "against": results.get("against")}  # fmt: skip
    except FileNotFoundError:
        raise InputError(path, "", None, "no such file: `twinrig validate` writes it") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(path, "", None, f"not the results of a validation: {error}") from None


def page(results: dict[str, Any], data: Path) -> str:
    """The page as text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined,
                              trim_blocks=True, lstrip_blocks=True)  # fmt: skip
    environment.filters |= {"number": number, "share": share, "duration": duration, "powers": powers, "marked": marked,
                            "numeric_columns": numeric_columns}  # fmt: skip
    environment.globals |= {"margin": margin, "reported": content.reported, "case_of": content.case_of}
    systems = content.systems(results)
    for case in (case for system in systems for case in system["cases"]):
        case |= _shown(case, data / f"{case['name']}.json")
    return environment.get_template(TEMPLATE).render(
        verdict=content.verdict(results), against=results.get("against"), systems=systems,
        silent=content.silent_systems(results["rows"]),
        shares=content.shares(results), independence=content.independence(results), conventions=content.conventions(),
        parameters=content.parameter_tables(), provenance=results["provenance"],
    )  # fmt: skip


def _shown(case: dict[str, Any], path: Path) -> dict[str, Any]:
    """Tables and figures of a case; what is missing or cannot be read is said on the page."""
    shown: dict[str, Any] = {"tables": [], "figures": [], "notes": []}
    module = case["module"]
    if module is None:
        shown["notes"].append("This version of twinrig has no such case; its rows are shown as they were saved.")
    if not (hasattr(module, "tables") or hasattr(module, "draw")):
        return shown
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        shown["notes"].append(f"data/{path.name} is missing or damaged: no tables and figures.")
        return shown
    for kind, make in (("tables", _tables), ("figures", _figures)):
        try:
            shown[kind] = make(module, saved, case["name"])
        except Exception as error:  # old data under new code must still give a page
            shown["notes"].append(f"The {kind} cannot be shown from data/{path.name}: {type(error).__name__}: {error}")
    return shown


def _tables(module: Any, saved: Any, name: str) -> list[Any]:
    return list(module.tables(saved)) if hasattr(module, "tables") else []


def _figures(module: Any, saved: Any, name: str) -> list[tuple[str, Any]]:
    if not hasattr(module, "draw"):
        return []
    from validation.report.figures import inline

    drawn = module.draw(saved)
    return [(caption, inline(figure, caption, f"{name}-{i}")) for i, (caption, figure) in enumerate(drawn)]
