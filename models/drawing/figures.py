"""How figures look: one style, SVG and PNG, the same bytes from the same results."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

import models.drawing.log_axis  # noqa: F401  the scale "log" of every figure
from models.core.whole_files import whole_file


class _Colours(dict[str, str]):
    def __missing__(self, engine: str) -> str:
        return "#009e73"


class _Labels(dict[str, str]):
    def __missing__(self, engine: str) -> str:
        return engine


COLOURS = _Colours({"reference": "#222222", "exudyn": "#0072b2", "mujoco": "#d55e00"})
"""One colour per implementation in every figure; told apart by people who see colours differently."""
LABELS = _Labels({"reference": "reference", "exudyn": "Exudyn", "mujoco": "MuJoCo"})
"""As figures call them; one from outside the tree by its own name and in a colour of its own."""

plt.rcParams.update(
    {
        "figure.dpi": 110,
        "savefig.dpi": 130,
        "font.size": 9.5,
        "axes.titlesize": 10.5,
        "axes.titlelocation": "left",
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "grid.alpha": 0.25,
        "legend.frameon": False,
        "lines.linewidth": 1.1,
        "svg.hashsalt": "twinrig",
        "figure.constrained_layout.use": True,
    }
)


def heading(figure: Figure, title: str) -> None:
    """Title of a whole figure, above its left edge."""
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")


def save(figure: Figure, path: Path) -> Path:
    """Write ``path`` (.svg or .png) without a date, close the figure and return the path."""
    metadata = {"Date": None} if path.suffix == ".svg" else {"Software": None}
    with whole_file(path) as part:
        figure.savefig(part, metadata=metadata)
    plt.close(figure)
    return path
