"""Title, tables and figures of one case in the report, from the case's saved data.

Figures are SVG where that is small, PNG where it is not; the same bytes from the same data.
"""

import base64
import inspect
import io
import json
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from markupsafe import Markup, escape

from validation.common.rows import Saved

LARGEST_SVG = 150_000
"""Largest size (bytes) of a figure in SVG; larger ones become PNG."""


def case_on_page(case_data_folder: Path, case_name: str) -> Saved:
    """Title, texts, tables and figures of a case for the report; "notes" state what could not be read.

    case_data_folder : of the saved data, ``CASE.json`` each. The same data give the same bytes in any process.
    """
    module = _case_module(case_name)
    content: Saved = {
        "title": getattr(module, "TITLE", case_name.replace("_", " ")),
        "about": _first_paragraph(module),
        "share": _first_paragraph(getattr(module, "measure", None)),
        "tables": [],
        "figures": [],
        "notes": [],
    }
    if module is None:
        content["notes"].append("This version of twinrig has no such case; its rows are shown as they were saved.")
    if not (hasattr(module, "tables") or hasattr(module, "draw")):
        return content
    path = case_data_folder / f"{case_name}.json"
    try:
        saved = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        content["notes"].append(f"data/{path.name} is missing or damaged: no tables and figures.")
        return content
    for kind, make in (("tables", _tables_of_case), ("figures", _figures_of_case)):
        try:
            content[kind] = list(make(module, saved, case_name))
        except Exception as error:  # old data under new code must still give a page
            content["notes"].append(
                f"The {kind} cannot be shown from data/{path.name}: {type(error).__name__}: {error}"
            )
    return content


def _case_module(case_name: str) -> ModuleType | None:
    """The module of a case; None if this version has no case of that name."""
    if not case_name.isidentifier():
        return None
    try:
        return import_module(f"validation.cases.{case_name}")
    except ImportError:
        return None


def _first_paragraph(documented_object: Any) -> str:
    """First paragraph of the docstring of a module or function."""
    return "" if documented_object is None else (inspect.getdoc(documented_object) or "").partition("\n\n")[0]


def _tables_of_case(case_module: Any, saved_data: Any, case_name: str) -> Iterable[Any]:
    return case_module.tables(saved_data) if hasattr(case_module, "tables") else ()


def _figures_of_case(case_module: Any, saved_data: Any, case_name: str) -> Iterator[tuple[str, Any]]:
    for i, (caption, figure) in enumerate(case_module.draw(saved_data) if hasattr(case_module, "draw") else ()):
        yield caption, inline_figure(figure, caption, f"{case_name}-{i}")


def inline_figure(figure: Any, caption: str, identifier_prefix: str) -> Markup:
    """A figure as self-contained markup; ``identifier_prefix`` makes its identifiers differ from those of other
    figures."""

    vector = _svg_markup(figure, caption, identifier_prefix)
    picture = vector if len(vector) <= LARGEST_SVG else _png_markup(figure, caption)
    return Markup(picture)


def _svg_markup(figure: Any, caption: str, identifier_prefix: str) -> str:
    """SVG element of a figure without prologue, metadata and needless digits; the figure is drawn once, whereas
    ``savefig`` draws it twice."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    buffer = io.StringIO()
    FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(?<= d=")[^"]*', _rounded_svg_path, text)
    text = re.sub(r'(?<=id=")|(?<=url\(#)|(?<=href="#)', f"{identifier_prefix}-", text)
    text = re.sub(r">\s+<", "><", text).strip()
    return text.replace("<svg", f'<svg role="img" aria-label="{escape(caption)}"', 1)


def _rounded_svg_path(path_match: re.Match[str]) -> str:
    """Path of an SVG with coordinates rounded to a hundredth of a point."""
    rounded = re.sub(r"-?\d+\.\d+", lambda matched: f"{float(matched[0]):.2f}".rstrip("0").rstrip("."), path_match[0])
    return rounded.replace("\n", " ")


def _png_markup(figure: Any, caption: str) -> str:
    """HTML image of a figure: PNG with a palette of 256 colours, as data within the page."""
    from PIL import Image

    buffer, small = io.BytesIO(), io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    Image.open(buffer).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(small, format="png", optimize=True)
    data = base64.b64encode(small.getvalue()).decode("ascii")
    return f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
