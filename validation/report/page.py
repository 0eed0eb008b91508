"""The report's page: one self-contained HTML file, written from saved results without any simulation.

``python -m validation.report FOLDER`` writes it again, byte for byte the same.
"""

import inspect
import json
import pkgutil
import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from importlib import import_module
from itertools import groupby
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

from models.core.errors import InputError
from models.core.whole_files import write_whole
from models.drawing.pages import environment_of
from validation.common.rows import STATUSES, Independence, Saved, System, row_of_saved
from validation.report.blind_spots import blind_spots
from validation.report.numbers import (
    docstring_markup,
    duration,
    error_markup,
    margin_of_row,
    number_markup,
    numeric_columns,
    powers_markup,
    share_markup,
)
from validation.report.shares import case_of_row, report_sizes_of_systems
from validation.report.shown import case_on_page

PAGE_TEMPLATE = "page.html.jinja"
BLANK_PROVENANCE: Saved = {"quick": False, "command": "", "versions": {}, "seconds": {}, "wall": None}
"""Defaults of the provenance entries that the page needs, for results in which they are missing."""
INDEPENDENCE_TEXTS = {
    "native": "both sides have force laws of their own; what they share is the description of the vehicle",
    "handed over": "the engine is handed M, D and K of the description: what is tested is these and the integrator, no "
    "spring of the engine's own",
    "shared kernel": "both sides call the same force code: nothing is learned about that code",
    "closed form": "the other side is an exact answer",
    "published": "the other side is a figure from the literature",
    "measured": "the other side was measured on a real vehicle",
    "none": "there is no second side: a behaviour, or a count",
}
assert set(INDEPENDENCE_TEXTS) == set(get_args(Independence))


def report_verdict(validation_results: Saved) -> Saved:
    """Verdict of the report: number of rows by status, warnings on their source, the tightest passed row, and the
    computing time."""
    rows = validation_results["rows"]
    of = {status: [row for row in rows if row["status"] == status] for status in STATUSES}
    margins = [(ratio, row) for row in of["passed"] if (ratio := margin_of_row(row)) is not None]
    return {
        "count": len(rows),
        "of": of,
        "worst": max(margins, key=lambda pair: pair[0], default=None),
        "seconds": validation_results["provenance"]["wall"],
        "source": _source_lines(validation_results["provenance"]),
    }


def _source_lines(report_provenance: Saved) -> list[tuple[str, str]]:
    """Version, commit, date, machine and data of a report, as pairs of name and value."""
    known = {"version": "twinrig", "commit": "commit", "date": "date", "machine": "machine", "data": "data"}
    return [(name, str(report_provenance.get(key) or "not saved")) for name, key in known.items()]


def silent_systems(report_rows: list[Saved]) -> list[str]:
    """Names of the systems of which no row was run."""
    run = {row["system"] for row in report_rows if row["status"] != "not run"}
    return [system for system in get_args(System) if system not in run]


def rows_by_system(validation_results: Saved, content_of_case: dict[str, Saved]) -> list[Saved]:
    """Rows grouped by system and, within it, by case, in the order of the report; content_of_case : title, tables and
    figures of each case."""
    order = list(dict.fromkeys((*get_args(System), *(row["system"] for row in validation_results["rows"]))))
    by_system = sorted(validation_results["rows"], key=lambda row: order.index(row["system"]))
    return [
        {
            "name": system,
            "cases": list(_cases_of_system(list(rows), validation_results["provenance"]["seconds"], content_of_case)),
        }
        for system, rows in groupby(by_system, key=lambda row: row["system"])
    ]


def _cases_of_system(
    report_rows: list[Saved], seconds_of_case: dict[str, float], content_of_case: dict[str, Saved]
) -> Iterator[Saved]:
    for name in dict.fromkeys(map(case_of_row, report_rows)):
        of_case = [row for row in report_rows if case_of_row(row) == name]
        groups: dict[str, list[Saved]] = {}
        for row in of_case:
            groups.setdefault(row["why"], []).append(row)
        statuses = [row["status"] for row in of_case]
        yield {
            "name": name,
            "seconds": seconds_of_case.get(name),
            "groups": [{"why": why, "rows": alike} for why, alike in groups.items()],
            "count": len(of_case),
            "failed": statuses.count("failed"),
            "missed": statuses.count("missed"),
            **content_of_case[name],
        }


def independence_counts(validation_results: Saved, content_of_case: dict[str, Saved]) -> Saved:
    """Number of rows of each case for each kind of independence of the two compared sides; content_of_case : title,
    tables and figures of each case."""
    lines = []
    for name in dict.fromkeys(map(case_of_row, validation_results["rows"])):
        kinds = [
            row["independence"]
            for row in validation_results["rows"]
            if case_of_row(row) == name and row["status"] != "not run"
        ]
        lines.append((name, content_of_case[name]["title"], [kinds.count(kind) for kind in INDEPENDENCE_TEXTS]))
    return {
        "kinds": INDEPENDENCE_TEXTS,
        "lines": lines,
        "total": [sum(line[2][i] for line in lines) for i in range(len(INDEPENDENCE_TEXTS))],
    }


def evidence_counts(report_rows: list[Saved]) -> list[tuple[str, list[int]]]:
    """For each system, its name and the numbers of rows by the independence of the two compared sides, in the order of
    INDEPENDENCE_TEXTS; rows that were not run are left out."""
    ran = [row for row in report_rows if row["status"] != "not run"]
    names = dict.fromkeys(row["system"] for row in ran)
    kinds = {name: [row["independence"] for row in ran if row["system"] == name] for name in names}
    return [(name, [each.count(kind) for kind in INDEPENDENCE_TEXTS]) for name, each in kinds.items()]


NUMBERS_AND_RUNS = re.compile(r"\([^()]*\)|[-+\d.e]+")
"""Pattern of the text parts in which allowed broken assumptions of similar runs of a case differ."""


def allowed_assumptions(report_rows: list[Saved]) -> list[tuple[str, list[Saved]]]:
    """Each allowed broken assumption, similar ones merged, with the rows that rest on it."""
    alike_rows: dict[tuple[str, str], list[Saved]] = {}
    for row in report_rows:
        if row["allowed"]:
            alike_rows.setdefault((case_of_row(row), NUMBERS_AND_RUNS.sub("", row["allowed"])), []).append(row)
    return [(alike[0]["allowed"], alike) for alike in alike_rows.values()]


def conventions() -> list[tuple[str, str]]:
    """Heading and text of each paragraph on twinrig's conventions of axes, signs and units."""
    import models

    pairs: list[tuple[str, str]] = []
    for line in (inspect.getdoc(models) or "").splitlines()[1:]:
        if line and not line.startswith(" "):
            pairs.append((line, ""))
        elif pairs and line.strip():
            pairs[-1] = (pairs[-1][0], f"{pairs[-1][1]} {line.strip()}".strip())
    return pairs


def parameter_tables() -> list[Saved]:
    """One table of parameters per kind of vehicle: fields with unit and meaning, a column per parameter set,
    sources."""
    tables: dict[type, Saved] = {}
    for name, module in _parameter_modules():
        kind: Any = type(module.PARAMETERS)
        title = (inspect.getdoc(kind) or kind.__name__).partition("\n")[0].rstrip(".")
        fields = [
            (key, str((field.json_schema_extra or {}).get("unit", "")), field.description or "")
            for key, field in kind.model_fields.items()
        ]
        table = tables.setdefault(kind, {"title": title, "fields": fields, "sets": []})
        values = [getattr(module.PARAMETERS, field) for field in kind.model_fields]
        shown_as = [value if isinstance(value, int | float) else str(value) for value in values]
        table["sets"].append({"name": name, "source": module.SOURCE, "values": shown_as})
    return list(tables.values())


def _parameter_modules() -> Iterator[tuple[str, ModuleType]]:
    """Yield name and module of each parameter set: modules with a SOURCE and a pydantic model PARAMETERS."""
    import models.vehicles.parameters as package

    for name in sorted(named.name for named in pkgutil.iter_modules(package.__path__)):
        module = import_module(f"{package.__name__}.{name}")
        if hasattr(module, "SOURCE") and hasattr(type(getattr(module, "PARAMETERS", None)), "model_fields"):
            yield name, module


def write(report_folder: Path, map_cases: Callable[..., Iterable[Any]] = map) -> Path:
    """Write ``report_folder/report.html`` from ``results.json`` and ``data/CASE.json``; returns the path of the page.

    map_cases : maps the function that draws a case over all cases, such as the map of a pool of processes.
    """
    results = read(report_folder / "results.json")
    path = report_folder / "report.html"
    write_whole(path, page_text(results, report_folder / "data", map_cases))
    return path


def read(results_path: Path) -> Saved:
    """Saved results of a validation; raises InputError if the file holds none."""
    try:
        results = json.loads(results_path.read_text(encoding="utf-8"))
        return {
            "provenance": {**BLANK_PROVENANCE, **results["provenance"]},
            "rows": [row_of_saved(row) for row in results["rows"]],
            "against": results.get("against"),
        }
    except FileNotFoundError:
        raise InputError(results_path, "", None, "no such file: `twinrig validate` writes it") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(results_path, "", None, f"not the results of a validation: {error}") from None


def page_text(validation_results: Saved, case_data_folder: Path, map_cases: Callable[..., Iterable[Any]] = map) -> str:
    """HTML text of the report's page."""
    environment = environment_of(Path(__file__).parent)
    environment.filters |= {
        "number": number_markup,
        "error": error_markup,
        "share": share_markup,
        "duration": duration,
        "powers": powers_markup,
        "marked": docstring_markup,
        "numeric_columns": numeric_columns,
    }
    environment.globals |= {"margin": margin_of_row}
    names = list(dict.fromkeys(map(case_of_row, validation_results["rows"])))
    drawn = dict(zip(names, map_cases(partial(case_on_page, case_data_folder), names), strict=True))
    return environment.get_template(PAGE_TEMPLATE).render(
        verdict=report_verdict(validation_results),
        against=validation_results.get("against"),
        systems=rows_by_system(validation_results, drawn),
        silent=silent_systems(validation_results["rows"]),
        shares=report_sizes_of_systems(validation_results),
        independence=independence_counts(validation_results, drawn),
        evidence=evidence_counts(validation_results["rows"]),
        measured_rows=sum(
            row["independence"] == "measured" and row["status"] != "not run" for row in validation_results["rows"]
        ),
        allowances=allowed_assumptions(validation_results["rows"]),
        blind=blind_spots(),
        conventions=conventions(),
        parameters=parameter_tables(),
        provenance=validation_results["provenance"],
    )
