"""Figure of the computing time of a contact kernel inside an engine's step."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from models.drawing.figures import COLOURS, COLUMN_WIDTH, PALE, SKY, SMALL_TEXT, VERMILION, add_heading, subplot_mosaic

LAW_NAMES = (
    "no contact",
    "empty callback",
    "linear theory",
    "FASTSIM, 7 cells",
    "FASTSIM, 11 cells",
    "FASTSIM, 21 cells",
    "FASTSIM, 41 cells",
    "non-Hertzian",
)
ENGINE_NAMES = {"mujoco": "MuJoCo", "exudyn": "Exudyn"}
BRIDGE_NAMES = {"native": "native", "jitted": "jitted, from Python", "plain": "plain Python"}
STEP_PARTS = (("own", "engine", PALE), ("kernel", "kernel", SKY), ("over", "bridge", VERMILION))
METHOD_OF_ENGINE = {"mujoco": "Euler", "exudyn": "ExplicitEuler"}
WHEELS = 4
LINE_STYLES = {1: ":", WHEELS: "-", 8: "--"}


def figure(timed_points: list[dict[str, Any]]) -> Figure:
    """Figure of the computing time per step for each contact law, and of the shares of engine, kernel and bridge
    between them, by law and by number of wheels."""
    drawing, places = subplot_mosaic([["laws", "laws"], ["by law", "by wheels"]], figsize=(COLUMN_WIDTH, 8.6))
    left, middle, right = (places[name] for name in ("laws", "by law", "by wheels"))
    some = [p for p in timed_points if METHOD_OF_ENGINE[p["engine"]] == p["method"]]
    best = [p for p in some if p["bridge"] in ("empty", _best_bridge(p["engine"]))]
    _plot_laws(left, some)
    _draw_stacked_shares(
        middle, [(f"{ENGINE_NAMES[p['engine']]}, {p['law']}", p) for p in best if p["wheels"] == WHEELS]
    )
    _draw_stacked_shares(
        right,
        [(f"{ENGINE_NAMES[p['engine']]}, {p['wheels']} wheel{'s' * (p['wheels'] > 1)}", p) for p in best if p["main"]],
    )
    middle.set_title(f"Shares by law, {WHEELS} wheels")
    right.set_title("Shares by wheels, FASTSIM, 21 cells")
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3)
    add_heading(drawing, "A contact kernel inside an engine: what a step costs and what it is made of")
    return drawing


def _best_bridge(engine: str) -> str:
    return "native" if engine == "mujoco" else "generic object"


def _plot_laws(panel: Any, timed_points: list[dict[str, Any]]) -> None:
    """Plot the time per step over the contact laws: a line of the fastest bridge for each number of wheels, and marks
    for the other bridges between engine and kernel."""
    for engine in METHOD_OF_ENGINE:
        of_engine = [p for p in timed_points if p["engine"] == engine]
        for count, style in LINE_STYLES.items():
            line = [
                p for p in of_engine if p["wheels"] == count and p["bridge"] in ("none", "empty", _best_bridge(engine))
            ]
            x, y = np.array(sorted((LAW_NAMES.index(p["law"]), 1e6 * p["step"]) for p in line)).T
            label = f"{ENGINE_NAMES[engine]}, {_best_bridge(engine)}, {count} wheel{'s' * (count > 1)}"
            panel.semilogy(x, y, style, marker=".", color=COLOURS[engine], label=label)
        others = [p for p in of_engine if p["bridge"] not in ("none", "empty", _best_bridge(engine))]
        for mark, bridge in zip("sD^", dict.fromkeys(p["bridge"] for p in others), strict=False):
            x, y = np.array([(LAW_NAMES.index(p["law"]), 1e6 * p["step"]) for p in others if p["bridge"] == bridge]).T
            panel.semilogy(
                x,
                y,
                mark,
                color=COLOURS[engine],
                mfc="white",
                label=f"{ENGINE_NAMES[engine]}, {BRIDGE_NAMES.get(bridge, bridge)}, {WHEELS} wheels",
            )
    panel.set_xticks(range(len(LAW_NAMES)), LAW_NAMES, rotation=35, ha="right")
    panel.set(ylabel="time per step [µs]", title="One call per step")
    panel.grid(True, axis="y", alpha=0.3)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high * (high / low) ** 0.4)  # room for the legend
    panel.legend(fontsize=SMALL_TEXT, loc="upper left", ncols=2)


def _draw_stacked_shares(panel: Any, timed_points: list[tuple[str, dict[str, Any]]]) -> None:
    """Draw for each measurement a bar of 100 % with the shares of engine, kernel and bridge; negative shares count as
    zero."""
    labels, before = [label for label, _ in timed_points], np.zeros(len(timed_points))
    whole = np.array([sum(max(p[part], 0.0) for part, _, _ in STEP_PARTS) for _, p in timed_points])
    for part, name, colour in STEP_PARTS:
        share = np.array([100.0 * max(p[part], 0.0) for _, p in timed_points]) / whole
        panel.barh(labels, share, left=before, color=colour, label=name)
        for i, (at, value) in enumerate(zip(before, share, strict=True)):
            if value >= 6.0:
                panel.text(at + value / 2.0, i, f"{value:.0f}", ha="center", va="center", fontsize=SMALL_TEXT)
        before += share
    panel.invert_yaxis()
    panel.tick_params(axis="y", labelsize=SMALL_TEXT)
    panel.set_xlabel("share of the step [%]")
