"""What the report shows of one case beside its rows, from its saved data alone: title, tables and figures."""

import inspect
import json
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any


def shown(folder: Path, name: str) -> dict[str, Any]:
    """Title, tables and figures of a case, what is said of it and of its share; "notes" tell what cannot be read.

    folder : of the saved data, ``CASE.json`` each. The same data give the same bytes in any process.
    """
    module = _module(name)
    found: dict[str, Any] = {
        "title": getattr(module, "TITLE", name.replace("_", " ")),
        "about": _doc(module),
        "share": _doc(getattr(module, "measure", None)),
        "tables": [],
        "figures": [],
        "notes": [],
    }
    if module is None:
        found["notes"].append("This version of twinrig has no such case; its rows are shown as they were saved.")
    if not (hasattr(module, "tables") or hasattr(module, "draw")):
        return found
    path = folder / f"{name}.json"
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found["notes"].append(f"data/{path.name} is missing or damaged: no tables and figures.")
        return found
    for kind, make in (("tables", _tables), ("figures", _figures)):
        try:
            found[kind] = make(module, saved, name)
        except Exception as error:  # old data under new code must still give a page
            found["notes"].append(f"The {kind} cannot be shown from data/{path.name}: {type(error).__name__}: {error}")
    return found


def _module(name: str) -> ModuleType | None:
    """The module of a case, None where this checkout has none of that name."""
    if not name.isidentifier():
        return None
    try:
        return import_module(f"validation.cases.{name}")
    except ImportError:
        return None


def _doc(what: Any) -> str:
    """The first paragraph of what is said of a module or a function."""
    return "" if what is None else (inspect.getdoc(what) or "").partition("\n\n")[0]


def _tables(module: Any, saved: Any, name: str) -> list[Any]:
    return list(module.tables(saved)) if hasattr(module, "tables") else []


def _figures(module: Any, saved: Any, name: str) -> list[tuple[str, Any]]:
    if not hasattr(module, "draw"):
        return []
    from validation.report.figures import inline

    drawn = module.draw(saved)
    return [(caption, inline(figure, caption, f"{name}-{i}")) for i, (caption, figure) in enumerate(drawn)]
