"""The report: one self-contained page, from saved results alone; it never simulates.

``python -m validation.report FOLDER`` draws it again, byte for byte the same.
"""

import json
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from models.core.errors import InputError
from models.core.whole_files import write_whole
from validation.common.rows import of_saved
from validation.report import content
from validation.report.numbers import duration, margin, marked, number, numeric_columns, powers, share
from validation.report.shares import shares
from validation.report.shown import shown

TEMPLATE = "page.html.jinja"
BLANK: dict[str, Any] = {"quick": False, "command": "", "versions": {}, "seconds": {}, "wall": None}
"""What a page needs of its provenance, where the results do not hold it."""


def write(folder: Path, each: Callable[..., Iterable[Any]] = map) -> Path:
    """Write ``folder/report.html`` from ``results.json`` and ``data/CASE.json``; returns its path.

    each : draws the cases, such as the map of a pool of processes.
    """
    results = read(folder / "results.json")
    path = folder / "report.html"
    write_whole(path, page(results, folder / "data", each))
    return path


def read(path: Path) -> dict[str, Any]:
    """Saved results; raises InputError if the file is not one."""
    try:
        results = json.loads(path.read_text(encoding="utf-8"))
        return {
            "provenance": {**BLANK, **results["provenance"]},
            "rows": [of_saved(row) for row in results["rows"]],
            "against": results.get("against"),
        }
    except FileNotFoundError:
        raise InputError(path, "", None, "no such file: `twinrig validate` writes it") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(path, "", None, f"not the results of a validation: {error}") from None


def page(results: dict[str, Any], data: Path, each: Callable[..., Iterable[Any]] = map) -> str:
    """The page as text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {
        "number": number,
        "share": share,
        "duration": duration,
        "powers": powers,
        "marked": marked,
        "numeric_columns": numeric_columns,
    }
    environment.globals |= {"margin": margin, "case_of": content.case_of}
    names = list(dict.fromkeys(map(content.case_of, results["rows"])))
    drawn = dict(zip(names, each(partial(shown, data), names), strict=True))
    systems = content.systems(results)
    for case in (case for system in systems for case in system["cases"]):
        case |= drawn[case["name"]]
    return environment.get_template(TEMPLATE).render(
        verdict=content.verdict(results),
        against=results.get("against"),
        systems=systems,
        silent=content.silent_systems(results["rows"]),
        shares=shares(results),
        independence=content.independence(results, drawn),
        conventions=content.conventions(),
        parameters=content.parameter_tables(),
        provenance=results["provenance"],
    )
