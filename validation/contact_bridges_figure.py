"""Picture of what a contact kernel costs inside an engine."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from studies.figures import plt

LAWS = ("no contact", "empty callback", "linear theory", "FASTSIM, 7 cells", "FASTSIM, 11 cells", "FASTSIM, 21 cells",
        "FASTSIM, 41 cells", "non-Hertzian")  # fmt: skip
NAMES = {"mujoco": "MuJoCo", "exudyn": "Exudyn"}
BRIDGES = {"native": "native", "jitted": "jitted, from Python", "plain": "plain Python", "none": "", "empty": ""}
PARTS = (("own", "engine", "0.75"), ("kernel", "kernel", "C0"), ("over", "bridge", "C3"))
METHODS = {"mujoco": "Euler", "exudyn": "ExplicitEuler"}
WHEELS = 4


def figure(points: list[dict[str, Any]]) -> Figure:
    """Cost per step over the law at four wheels, and shares of engine, kernel and bridge over the wheels."""
    drawing, (left, right) = plt.subplots(1, 2, figsize=(11.5, 4.8), width_ratios=(1.15, 1.0))
    some = [p for p in points if METHODS[p["engine"]] == p["method"]]
    _laws(left, [p for p in some if p["wheels"] == WHEELS])
    _shares(right, [p for p in some if p["cells"] == 21 and p["bridge"] in ("native", "generic object")])
    drawing.suptitle("A contact kernel inside an engine costs little more than itself, if no Python stands between",
                     x=0.01, ha="left", fontweight="bold")  # fmt: skip
    return drawing


def _laws(axis: Any, points: list[dict[str, Any]]) -> None:
    lines: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for p in points:
        bridges = [p["bridge"]] if p["bridge"] not in ("none", "empty") else [_main(p["engine"])]
        for bridge in bridges:
            lines.setdefault((p["engine"], bridge), []).append((LAWS.index(p["law"]), 1e6 * p["step"]))
    for i, ((engine, bridge), values) in enumerate(sorted(lines.items(), key=lambda one: one[0], reverse=True)):
        main = bridge == _main(engine)
        x, y = np.array(sorted(values)).T
        mark, colour = "o-" if main else "osD^v"[i % 5], "C0" if engine == "mujoco" else "C1"
        axis.semilogy(x, y, mark, color=colour, mfc=None if main else "white",
                      label=f"{NAMES[engine]}, {BRIDGES.get(bridge, bridge)}")  # fmt: skip
    axis.set_xticks(range(len(LAWS)), LAWS, rotation=35, ha="right")
    axis.set(ylabel="time per step [us]", title=f"{WHEELS} wheels, one call per step")
    axis.grid(True, axis="y", alpha=0.3)
    axis.legend(fontsize="small")


def _main(engine: str) -> str:
    return "native" if engine == "mujoco" else "generic object"


def _shares(axis: Any, points: list[dict[str, Any]]) -> None:
    labels = [f"{NAMES[p['engine']]}, {p['wheels']} wheel{'s' if p['wheels'] > 1 else ''}" for p in points]
    before = np.zeros(len(points))
    for part, name, colour in PARTS:
        share = np.array([100.0 * max(p[part], 0.0) / p["step"] for p in points])
        axis.barh(labels, share, left=before, color=colour, label=name)
        for i, (at, value) in enumerate(zip(before, share, strict=True)):
            if value >= 6.0:
                axis.text(at + value / 2.0, i, f"{value:.0f}", ha="center", va="center", fontsize="small")
        before += share
    axis.invert_yaxis()
    axis.set(xlabel="share of the step [%]", title="FASTSIM, 21 cells")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize="small")
