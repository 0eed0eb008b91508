"""What the report says, as plain values: verdict, gaps, cases, independence, parameters.

Everything measured comes from the saved results; titles, conventions and parameters come from the code.
"""

import inspect
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from itertools import groupby
from types import ModuleType
from typing import Any, get_args

from validation.cases import CASES
from validation.common.rows import STATUSES, Independence, System
from validation.report.numbers import margin

Results = dict[str, Any]

KINDS = {
    "native": "both sides have force laws of their own; what they share is the description of the vehicle",
    "handed over": "the engine is handed M, D and K of the description: what is tested is these and the integrator, no "
    "spring of the engine's own",
    "shared kernel": "both sides call the same force code: nothing is learned about that code",
    "closed form": "the other side is an exact answer",
    "published": "the other side is a figure from the literature",
    "none": "there is no second side: a behaviour, or a count",
}
assert set(KINDS) == set(get_args(Independence))


def verdict(results: Results) -> dict[str, Any]:
    """Rows by status, what a reader must know first of where they are from, the tightest passed row and the time."""
    rows = results["rows"]
    of = {status: [row for row in rows if row["status"] == status] for status in STATUSES}
    margins = [(ratio, row) for row in of["passed"] if (ratio := margin(row)) is not None]
    return {
        "count": len(rows),
        "of": of,
        "worst": max(margins, key=lambda pair: pair[0], default=None),
        "seconds": results["provenance"]["wall"],
        "source": _source(results["provenance"]),
    }


def _source(provenance: dict[str, Any]) -> list[tuple[str, str]]:
    """Version, commit, date, machine and data, as (name, value)."""
    known = {"version": "twinrig", "commit": "commit", "date": "date", "machine": "machine", "data": "data"}
    return [(name, str(provenance.get(key) or "not saved")) for name, key in known.items()]


def silent_systems(rows: list[dict[str, Any]]) -> list[str]:
    """Systems that have no row, or none that was run."""
    run = {row["system"] for row in rows if row["status"] != "not run"}
    return [system for system in get_args(System) if system not in run]


def case_of(row: dict[str, Any]) -> str:
    """Name of the case that a row belongs to: its id begins with it, or with a word of it."""
    first = row["id"].partition(".")[0]
    return first if first in CASES else next((case for case in CASES if first in case.split("_")), first)


def systems(results: Results) -> list[dict[str, Any]]:
    """Rows by system and, within it, by case, in the order of the report."""
    order = list(dict.fromkeys((*get_args(System), *(row["system"] for row in results["rows"]))))
    by_system = sorted(results["rows"], key=lambda row: order.index(row["system"]))
    return [
        {"name": system, "cases": list(_cases(list(rows), results))}
        for system, rows in groupby(by_system, key=lambda row: row["system"])
    ]


def _cases(rows: list[dict[str, Any]], results: Results) -> Iterator[dict[str, Any]]:
    for name in dict.fromkeys(map(case_of, rows)):
        own = [row for row in rows if case_of(row) == name]
        yield {
            "name": name,
            "seconds": results["provenance"]["seconds"].get(name),
            "groups": [
                {"why": why, "rows": [row for row in own if row["why"] == why]}
                for why in dict.fromkeys(row["why"] for row in own)
            ],
            "count": len(own),
            "failed": sum(row["status"] == "failed" for row in own),
            "missed": sum(row["status"] == "missed" for row in own),
        }


def independence(results: Results, drawn: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """How many rows of each case rest on which kind of second side; drawn : what is shown of each, by name."""
    lines = []
    for name in dict.fromkeys(map(case_of, results["rows"])):
        own = [row["independence"] for row in results["rows"] if case_of(row) == name and row["status"] != "not run"]
        lines.append((name, drawn[name]["title"], [own.count(kind) for kind in KINDS]))
    return {"kinds": KINDS, "lines": lines, "total": [sum(line[2][i] for line in lines) for i in range(len(KINDS))]}


def conventions() -> list[tuple[str, str]]:
    """Heading and text of every paragraph of the conventions page."""
    import models

    pairs: list[tuple[str, str]] = []
    for line in (inspect.getdoc(models) or "").splitlines()[1:]:
        if line and not line.startswith(" "):
            pairs.append((line, ""))
        elif pairs and line.strip():
            pairs[-1] = (pairs[-1][0], f"{pairs[-1][1]} {line.strip()}".strip())
    return pairs


def parameter_tables() -> list[dict[str, Any]]:
    """One table per kind of vehicle: fields with unit and meaning, a column per parameter set, and sources."""
    tables: dict[type, dict[str, Any]] = {}
    for name, module in _parameter_modules():
        kind = type(module.PARAMETERS)
        table = tables.setdefault(kind, {"title": _first_line(kind), "fields": _fields(kind), "sets": []})
        values = [_shown(getattr(module.PARAMETERS, field)) for field in kind.model_fields]
        table["sets"].append({"name": name, "source": module.SOURCE, "values": values})
    return list(tables.values())


def _parameter_modules() -> Iterator[tuple[str, ModuleType]]:
    """Parameter sets that follow the form: SOURCE and a pydantic PARAMETERS."""
    import models.vehicles.parameters as package

    for found in sorted(pkgutil.iter_modules(package.__path__), key=lambda item: item.name):
        module = import_module(f"{package.__name__}.{found.name}")
        if hasattr(module, "SOURCE") and hasattr(type(getattr(module, "PARAMETERS", None)), "model_fields"):
            yield found.name, module


def _fields(kind: Any) -> list[tuple[str, str, str]]:
    """(name, unit, meaning) of every field."""
    out = []
    for name, own in kind.model_fields.items():
        extra = own.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        out.append((name, unit, own.description or ""))
    return out


def _shown(value: Any) -> Any:
    """A parameter as the table shows it: numbers as they are, anything else as text."""
    return value if isinstance(value, int | float) else str(value)


def _first_line(kind: Any) -> str:
    return (inspect.getdoc(kind) or kind.__name__).partition("\n")[0].rstrip(".")
