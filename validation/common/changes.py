"""Changes between two validation reports: rows that are new, missing or changed."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from models.core.errors import InputError
from validation.common.rows import STATUSES, Row, Saved, row_of_saved

ROUNDING_SHARE = 1e-9
"""Relative change that rounding explains."""
NEGLIGIBLE_SHARE = 1e-3
"""Share of its tolerance by which an error (expected 0) may change without mention, as rounding decides its digits."""
CHANGE_KINDS = ("status", "gone", "new", "expected", "value")
"""Kinds of changes in the order of the comparison: status, missing and new rows, changed expectations, values."""

Change = Saved


def read_results(report_path: Path) -> Saved:
    """Rows by id, and provenance, of an earlier ``results.json`` (or of the folder with it); raises InputError for
    other files."""
    file = report_path / "results.json" if report_path.is_dir() else report_path
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        return {"file": str(file), "provenance": _provenance_tables(content), "rows": _rows_by_id(content)}
    except FileNotFoundError:
        raise InputError("--against", "", str(file), "no such file: name the results.json of a report") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("--against", "", str(file), f"cannot be read: {error}") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        allowed = f"is not the results.json of a validation: {_misread_text(error)}"
        raise InputError("--against", "", str(file), allowed) from None


def _misread_text(read_error: Exception) -> str:
    """Text that says why a results file cannot be read."""
    if isinstance(read_error, json.JSONDecodeError):
        return f"line {read_error.lineno} is no JSON"
    return f"{read_error} is missing" if isinstance(read_error, KeyError) else str(read_error)


def _rows_by_id(report_content: Saved) -> dict[str, Saved]:
    """Row id -> row of a report. Raises ValueError if two rows have the same id."""
    saved = map(row_of_saved, report_content["rows"])
    rows = {row["id"]: {name: row[name] for name in Row.__dataclass_fields__} for row in saved}
    if len(rows) < len(report_content["rows"]):
        raise ValueError("an id stands there twice")
    return rows


def _provenance_tables(report_content: Saved) -> Saved:
    """Provenance of a report (versions, seeds, machine), with tables where an old report lacks them."""
    tables = dict(report_content["provenance"])
    return tables | {name: dict(tables.get(name) or {}) for name in ("versions", "seeds")}


def comparison_with_earlier(earlier_report: Saved, report_rows: list[Saved], report_source: Saved) -> Saved:
    """Comparison of rows with an earlier report, for ``results.json``: the earlier file and commit, notes, and all
    changed rows.

    report_source : provenance of the rows. The notes list versions, seeds and machine that differ from the earlier
    report's.
    """
    was = earlier_report["provenance"]
    old, new = (("quick" if report.get("quick") else "full") for report in (was, report_source))
    notes = [] if old == new else [f"the earlier report is the {old} one and this the {new} one"]
    notes += [
        f"{name} {earlier_text} -> {current_text}"
        for name, earlier_text, current_text in _differing_environment(was, report_source)
    ]
    return {
        "file": earlier_report["file"],
        "commit": str(was.get("commit", "unknown")),
        "note": "; ".join(notes),
        "changes": changed_rows(earlier_report["rows"], {row["id"]: row for row in report_rows}),
    }


def _differing_environment(earlier_source: Saved, report_source: Saved) -> Iterator[tuple[str, Any, Any]]:
    """Name, earlier and present value of each version, seed, Python, machine and system in which two reports differ."""
    for name in ("versions", "seeds"):
        old, new = earlier_source.get(name) or {}, report_source.get(name) or {}
        yield from (
            (f"{name[:-1]} of {key}", old.get(key), new.get(key))
            for key in {**old, **new}
            if old.get(key) != new.get(key)
        )
    yield from (
        (name, earlier_source.get(name), report_source.get(name))
        for name in ("python", "machine", "system")
        if earlier_source.get(name) != report_source.get(name)
    )


def changed_rows(earlier_rows: dict[str, Saved], later_rows: dict[str, Saved]) -> list[Change]:
    """Changes of all rows that differ between two reports, sorted by CHANGE_KINDS; changed values are sorted by their
    change divided by the tolerance, largest first."""
    listed = [
        change
        for id in (*earlier_rows, *(id for id in later_rows if id not in earlier_rows))
        for change in _changes_of_row(id, earlier_rows.get(id), later_rows.get(id))
    ]
    return sorted(
        listed, key=lambda entry: (CHANGE_KINDS.index(entry["kind"]), _status_rank(entry["after"]), -entry["size"])
    )


def _status_rank(status: Any) -> int:
    """Rank of a row's status for sorting, 0 for the worst; 0 also for a value that is not a status."""
    return STATUSES.index(status) if status in STATUSES else 0


def _changes_of_row(row_id: str, old_row: Saved | None, new_row: Saved | None) -> Iterator[Change]:
    row = new_row or old_row or {}

    def change(change_kind: str, old_value: Any, new_value: Any, change_size: float = 0.0) -> Change:
        return {
            "id": row_id,
            "kind": change_kind,
            "quantity": row["quantity"],
            "unit": row["unit"],
            "before": old_value,
            "after": new_value,
            "size": change_size,
            "reason": row["reason"] if change_kind in ("status", "new") else "",
        }

    if old_row is None or new_row is None:
        yield change("new" if old_row is None else "gone", old_row and old_row["status"], new_row and new_row["status"])
        return
    if old_row["status"] != new_row["status"]:
        yield change("status", old_row["status"], new_row["status"])
    for name in ("expected", "tolerance"):
        if _values_differ(old_row[name], new_row[name]):
            yield change("expected", f"{name} {old_row[name]}", f"{name} {new_row[name]}")
    size = _relative_change(old_row, new_row)
    if size > 0.0:
        yield change("value", old_row["value"], new_row["value"], size)


def _is_number(value_of_row: Any) -> bool:
    return isinstance(value_of_row, int | float) and not isinstance(value_of_row, bool)


def _values_differ(old_value: Any, new_value: Any) -> bool:
    if not (_is_number(old_value) and _is_number(new_value)):
        return old_value != new_value
    both_none = old_value != old_value and new_value != new_value  # neither is a number
    return not (
        both_none
        or old_value == new_value
        or abs(new_value - old_value) <= ROUNDING_SHARE * max(abs(old_value), abs(new_value))
    )


def _relative_change(old_row: Saved, new_row: Saved) -> float:
    """Change of a row's value divided by its tolerance, or by the value if it has no tolerance; 0 for rounding."""
    was, current_value, tolerance = old_row["value"], new_row["value"], new_row["tolerance"]
    if not _values_differ(was, current_value):
        return 0.0
    if not (_is_number(was) and _is_number(current_value)) or not abs(current_value - was) < float("inf"):
        return float("inf")
    if tolerance and _is_number(tolerance):
        share = abs(current_value - was) / tolerance
        return 0.0 if new_row["expected"] == 0 and share < NEGLIGIBLE_SHARE else share
    return abs(current_value - was) / max(abs(was), abs(current_value))


def change_lines(report_comparison: Saved) -> list[str]:
    """Lines of text of a report_comparison: counts of changes, the note, then each changed row."""
    changed = report_comparison["changes"]
    names = zip(CHANGE_KINDS, ("of status", "gone", "new", "judged otherwise", "of value"), strict=True)
    counts = ", ".join(f"{sum(change['kind'] == kind for change in changed)} {text}" for kind, text in names)
    head = (
        f"against {report_comparison['file']} (commit {report_comparison['commit']}): {len(changed)} changes: {counts}"
    )
    lines = [
        f"  {change['kind']}: {change['id']}: {change['quantity']}: "
        f"{_value_text(change['before'])} -> {_value_text(change['after'])}"
        f"{' ' + change['unit'] if change['kind'] == 'value' and change['unit'] else ''}"
        f"{': ' + change['reason'] if change['reason'] else ''}"
        for change in changed
    ]
    return [head, *([f"  note: {report_comparison['note']}"] if report_comparison["note"] else []), *lines]


def _value_text(value_of_row: Any) -> str:
    return "-" if value_of_row is None else f"{value_of_row:.6g}" if _is_number(value_of_row) else str(value_of_row)
