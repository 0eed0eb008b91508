"""The work-precision figure: error over what work is counted in and over seconds, a curve per integrator."""

from collections import defaultdict
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from models.advice.price import curves
from models.advice.price import runner as cost
from models.advice.price.runner import Point, by_curve
from models.drawing.figures import COLOURS, plt
from validation.price.tables import groups_of, named, quantity_of

SHARED = {"RK4": "o", "RK44": "o", "Euler": "D", "ExplicitEuler": "D"}
"""Markers of methods that several engines have."""
MARKERS = "s^v<>PXhp*d"
"""Markers of the others, in turn within each engine."""
STYLES = {1: ":", 2: "--", 3: "-.", 4: "-"}
MORE = ("#999999", "#0072b2", "#009e73", "#cc79a7", "#d55e00", "#56b4e9")
"""Colours of families that are no implementation."""
LONGEST = 26
"""Letters of a curve's name of which five stand beside each other."""
SIZES = {"reference": 8.5, "exudyn": 6.5, "mujoco": 4.5}
"""Coinciding curves show as rings within each other."""
ONCE = 0.5
"""Size of a marker whose seconds are those of one run, by that of the others."""


def draw(problem: dict[str, Any], points: list[Point]) -> Figure:
    """Two panels that share the error axis; failures stand above the first, whose axis they have a place on."""
    figure, axes = plt.subplots(1, 2, figsize=(12.5, 8.4), sharey=True)
    styles = _styles(points)
    top = _top(problem, points)
    for ax, kind in zip(axes, cost.costs(points), strict=True):
        _floor(ax, problem)
        _front(ax, problem, points, kind)
        for curve, own in by_curve(points).items():
            _curve(ax, problem, own, kind, styles[curve])
        timed = kind == "seconds"
        label = "seconds for the run, model built anew (median)" if timed else f"{kind} in the run"
        ax.set(xscale="log", yscale="log", xlabel=label)
        rounds = max(len(p.seconds) for p in points)
        several = f"up to {rounds} interleaved rounds (small: one run)" if rounds > 1 else "one run"
        ax.set_title(f"by {kind}, {several if timed else 'exact'}")
    _failures(axes[0], points, top)
    quantity = quantity_of(problem)
    axes[0].set_ylabel(f"error of the {quantity} [{problem['units'][quantity]}]")
    axes[0].set_ylim(0.3 * problem["uncertainty"][quantity], 12 * top)
    for ax, kind in zip(axes, cost.costs(points), strict=True):
        _defaults(ax, problem, points, kind)
    alike = "; ".join(named(group[0], [group]) for group in groups_of(problem, points))
    title = fill(f"What accuracy costs. {problem['title']}", 120)
    same = fill(f"Same error at the same setting: {alike}.", 165) if alike else ""
    figure.suptitle(title + "\n" * (1 + same.count("\n")), x=0.01, ha="left", fontsize=12)
    figure.text(0.011, 0.98 - 0.026 * (1 + title.count("\n")), same, va="top", fontsize=9, color="#333333")
    handles = _legend(points, styles)
    longest = max(len(str(handle.get_label())) for handle in handles[: len(styles)])
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=5 if longest <= LONGEST else 4,
        fontsize=8.5,
        handlelength=3.2,
    )
    return figure


def _styles(points: list[Point]) -> dict[str, dict[str, Any]]:
    """Colour by engine, marker by method, line by declared order (solid from 4 up)."""
    found: dict[str, dict[str, Any]] = {}
    for own in by_curve(points).values():
        one = own[0].setting
        colour = _colour(one.engine, points)
        used = {style["marker"] for style in found.values() if style["color"] == colour}
        marker = SHARED.get(one.method) or next((m for m in MARKERS if m not in used), ".")
        found[one.curve] = {
            "color": colour,
            "marker": marker,
            "linestyle": STYLES.get(one.order, "-"),
            "markersize": SIZES.get(one.engine, 5),
        }
    return found


def _colour(engine: str, points: list[Point]) -> str:
    """That of an implementation, or else the next of MORE."""
    others = [one for one in dict.fromkeys(p.setting.engine for p in points) if one not in COLOURS]
    return COLOURS[engine] if engine in COLOURS else MORE[others.index(engine) % len(MORE)]


def _top(problem: dict[str, Any], points: list[Point]) -> float:
    """Height at which failures are drawn: above every error."""
    return 6 * max(p.errors[quantity_of(problem)] for p in points if p.status == "ok")


def _curve(ax: Axes, problem: dict[str, Any], own: list[Point], kind: str, style: dict[str, Any]) -> None:
    """One curve; points that the reference cannot judge are hollow."""
    quantity = quantity_of(problem)
    costs, errors = [p.cost(kind) for p in own], [p.errors[quantity] for p in own]
    floor = curves.HOLLOW * problem["uncertainty"][quantity]
    ax.plot(costs, errors, **{**style, "marker": "none"}, alpha=0.75)
    alike = defaultdict(list)
    for p, place in zip(own, zip(costs, errors, strict=True), strict=True):
        alike[place[1] < floor, kind == "seconds" and p.changed is None].append(place)
    for (hollow, once), some in alike.items():
        look = {**style, "linestyle": "none", "markersize": style["markersize"] * (ONCE if once else 1.0)}
        ax.plot(
            *zip(*some, strict=True), **look, markerfacecolor="white" if hollow else style["color"], markeredgewidth=0.9
        )


def _floor(ax: Axes, problem: dict[str, Any]) -> None:
    """The band in which the reference itself is not certain."""
    own = problem["uncertainty"][quantity_of(problem)]
    unit = problem["units"][quantity_of(problem)]
    ax.axhspan(1e-30, own, color="#bbbbbb", alpha=0.6, zorder=0, linewidth=0)
    ax.axhspan(own, curves.HOLLOW * own, color="#bbbbbb", alpha=0.25, zorder=0, linewidth=0)
    ax.text(
        0.015,
        0.012,
        f"reference known to {own:.1g} {unit} (dark);\nbelow ten times that: hollow",
        transform=ax.transAxes,
        ha="left",
        va="bottom",
        fontsize=8,
        color="#555555",
    )


def _front(ax: Axes, problem: dict[str, Any], points: list[Point], kind: str) -> None:
    """The settings that no other one beats, as a broad pale line behind the curves."""
    quantity = quantity_of(problem)
    front = cost.front(points, quantity, problem["uncertainty"][quantity], kind)
    ax.plot(
        [p.cost(kind) for p in front],
        [p.errors[quantity] for p in front],
        color="#f0c808",
        linewidth=9,
        alpha=0.45,
        solid_capstyle="round",
        zorder=1,
    )


def _defaults(ax: Axes, problem: dict[str, Any], points: list[Point], kind: str) -> None:
    """Ring and name each engine's default setting, where the panel is emptiest."""
    quantity = quantity_of(problem)
    found = [(owner, p) for owner, p in cost.defaults(points).items() if p.status == "ok"]
    taken = _drawn(ax)
    for owner, p in found:
        place = (p.cost(kind), p.errors[quantity])
        ax.plot(
            *place, "o", markersize=15, markerfacecolor="none", markeredgecolor="#111111", markeredgewidth=1.4, zorder=5
        )
        corner = _emptiest(taken, _within(ax, [place])[0])
        taken = np.vstack([taken, corner + LABEL * np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])])
        ax.annotate(
            f"{owner} default:\n{p.setting.method},\n{p.setting.label()}",
            place,
            fontsize=8.5,
            xytext=(float(corner[0]), float(corner[1])),
            textcoords="axes fraction",
            ha="left",
            va="center",
            zorder=6,
            arrowprops={"arrowstyle": "-", "color": "#111111", "linewidth": 0.7, "shrinkB": 7},
        )


LABEL = np.array([0.27, 0.09])
"""Width and height of a default's name, in fractions of the panel."""
CORNERS = np.array([(x, y) for x in np.linspace(0.015, 0.74, 13) for y in np.linspace(0.2, 0.92, 17)])
"""Where a name may stand: the middle of its left side, clear of the bands below and of what is told above."""


def _within(ax: Axes, places: Any) -> np.ndarray:
    """Fractions of the panel (n, 2) of places in its units (n, 2)."""
    return np.asarray((ax.transData - ax.transAxes).transform(np.asarray(places, float)))


def _drawn(ax: Axes) -> np.ndarray:
    """Places along all lines of a panel, in its fractions (n, 2)."""
    found = [np.empty((0, 2))]
    for line in ax.get_lines():
        ends = _within(ax, line.get_xydata())
        found += [one + (two - one) * np.linspace(0.0, 1.0, 9)[:, None] for one, two in pairwise(ends)] + [ends]
    return np.vstack(found)


def _emptiest(taken: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Of CORNERS, one whose name keeps off what is taken, near its own place where several do."""
    middles = CORNERS + LABEL * np.array([0.5, 0.0])
    apart = np.abs(middles[:, None] - taken) / (0.5 * LABEL)
    clear = np.minimum(apart.max(axis=2).min(axis=1), 1.8)
    far = np.hypot(*(middles - own).T)
    return np.asarray(CORNERS[np.argmax(clear - 0.3 * far)])


def _failures(ax: Axes, points: list[Point], top: float) -> None:
    """A cross where each failed setting would have stood: stages times steps on the cost axis."""
    failed = [p for p in points if p.status != "ok"]
    for p in failed:
        calls = _expected(p, points)
        if calls:
            size = 1.4 * SIZES.get(p.setting.engine, 5)
            ax.plot(calls, top, "x", color=_colour(p.setting.engine, points), markersize=size, markeredgewidth=1.6)
    if failed:
        text = "; ".join(f"{status}: {_who(failed, status)}" for status in dict.fromkeys(p.status for p in failed))
        ax.annotate(text, (0.995, 0.99), xycoords="axes fraction", ha="right", va="top", fontsize=8)


def _expected(p: Point, points: list[Point]) -> float:
    """What a failed setting cost, or one with fixed steps would have, from its neighbours on the curve."""
    own = by_curve(points).get(p.setting.curve)
    if p.counts:
        return p.cost(cost.costs(points)[0])
    if not own or p.setting.adaptive:
        return 0.0
    return own[0].cost(cost.costs(points)[0]) * own[0].setting.value / p.setting.value


def _who(failed: list[Point], status: str) -> str:
    """Methods without an answer, those with none at all named."""
    own = [p for p in failed if p.status == status]
    if status == "flagged":
        return ", ".join(dict.fromkeys(f"{p.setting.curve} (cross, see table)" for p in own))
    unstable = [p for p in own if not p.setting.adaptive]
    what = "beyond stability, steps" if status == "refused" else "settings"
    parts = [f"{what}: {len(unstable)} (crosses)"] if unstable else []
    parts += [
        f"{p.setting.method} ({'not implemented' if 'not implemented' in p.reason else 'see table'})"
        for p in own
        if p.setting.adaptive
    ]
    return ", ".join(parts)


def _legend(points: list[Point], styles: dict[str, dict[str, Any]]) -> list[Line2D]:
    """A handle per curve, then what is not a curve."""
    handles = [Line2D([], [], **styles[curve], label=named(curve)) for curve in by_curve(points)]
    handles.sort(key=lambda handle: str(handle.get_label()))
    front = "no other setting is better (Pareto)"
    handles.append(Line2D([], [], color="#f0c808", linewidth=9, alpha=0.45, label=front))
    if any(p.status != "ok" for p in points):
        failed = "no answer to rely on"
        handles.append(Line2D([], [], color="#777777", marker="x", linestyle="none", label=failed))
    return handles
