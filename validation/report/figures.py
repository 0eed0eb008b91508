"""Figures inside the page: SVG where it is small, PNG where it is not; the same bytes from the same data."""

import base64
import io
import re
from typing import Any

from markupsafe import Markup, escape

LARGEST_SVG = 150_000
"""Bytes; above, the figure is drawn in points of colour."""


def inline(figure: Any, caption: str, key: str) -> Markup:
    """A figure as markup that needs nothing else; ``key`` keeps its identifiers apart from other figures'."""
    from models.drawing.figures import plt

    vector = _svg(figure, caption, key)
    picture = vector if len(vector) <= LARGEST_SVG else _png(figure, caption)
    plt.close(figure)
    return Markup(picture)


def _svg(figure: Any, caption: str, key: str) -> str:
    """SVG element without prologue, metadata and superfluous digits; drawn once, where ``savefig`` draws twice."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    buffer = io.StringIO()
    FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(?<= d=")[^"]*', _shorter, text)
    text = re.sub(r'(?<=id=")|(?<=url\(#)|(?<=href="#)', f"{key}-", text)
    text = re.sub(r">\s+<", "><", text).strip()
    return text.replace("<svg", f'<svg role="img" aria-label="{escape(caption)}"', 1)


def _shorter(path: re.Match[str]) -> str:
    """Coordinates of a path with two decimals: a hundredth of a point."""
    rounded = re.sub(r"-?\d+\.\d+", lambda found: f"{float(found[0]):.2f}".rstrip("0").rstrip("."), path[0])
    return rounded.replace("\n", " ")


def _png(figure: Any, caption: str) -> str:
    """PNG with a palette of 256 colours, as data within the page."""
    from PIL import Image

    buffer, small = io.BytesIO(), io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    Image.open(buffer).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(small, format="png", optimize=True)
    data = base64.b64encode(small.getvalue()).decode("ascii")
    return f'<img alt="{escape(caption)}" src="data:image/png;base64,{data}">'
