"""Figures of the runs of a recording: what drives the vehicle, how it drifts, and the forces inside it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from models.fatigue.counting import Counted
from models.systems.measured.comparison import Compared, overlay
from models.systems.measured.section_run import Outcome
from models.systems.measured.sections import Answer
from studies.recording import FREE, Found

POINTS = 1200
"""Columns of a curve: of each the least and the greatest value are drawn, so that no peak is lost."""
LINES = {"measured": "#b5b5b5", "truth": "#222222", FREE: "#d55e00", "kalman": "#0072b2", "prescribed": "#0072b2"}
NAMES = {
    "measured": "measured",
    "truth": "truth",
    FREE: "free run",
    "kalman": "held by the Kalman filter",
    "prescribed": "held to the measured angles",
}
WHEELS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")


def thinned(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and values (m,) with the least and the greatest of every stretch, of as many as can be seen."""
    width = len(times) // POINTS
    if width < 3:
        return times, values
    rows = len(times) // width
    parts = values[: rows * width].reshape(rows, width)
    empty = ~np.isfinite(parts).any(axis=1)
    safe = np.where(np.isfinite(parts) | empty[:, None], parts, np.nanmean(values))
    both = np.column_stack([safe.min(axis=1), safe.max(axis=1)])
    both[empty] = np.nan
    return np.repeat(times[: rows * width : width], 2), both.ravel()


def inputs_figure(found: Found, path: Path) -> Path:
    """Forces at all hubs along each axis."""
    from models.drawing.figures import plt, save

    own, axes = found.recording, [a for a in "zxy" if found.recording.find("force", component=a)]
    figure, panels = plt.subplots(len(axes), 1, figsize=(9.5, 1.9 * len(axes) + 0.5), sharex=True, squeeze=False)
    times = own.period * np.arange(own.count)
    for panel, axis in zip(panels[:, 0], axes, strict=True):
        for i, hub in enumerate(found.rig.hubs):
            for signal in (s for s in own.find("force", hub, axis) if not s.check):
                panel.plot(*thinned(times, own.samples(signal) / 1e3), color=WHEELS[i % len(WHEELS)], label=hub, lw=0.7)
        panel.set_title(f"force on the hub along {axis} [kN]")
    panels[-1, 0].set_xlabel("time [s]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=len(found.rig.hubs))
    return save(figure, path)


def drift_figure(found: Found, path: Path) -> Path:
    """Roll and pitch of every run, beside what was measured and, of a virtual measurement, the truth."""
    from models.drawing.figures import plt, save

    angles = found.rig.angles
    figure, panels = plt.subplots(len(angles), 1, figsize=(9.5, 2.0 * len(angles) + 0.6), sharex=True, squeeze=False)
    for panel, angle in zip(panels[:, 0], angles, strict=True):
        for name, times, values in _angles(found, angle):
            panel.plot(*thinned(times, np.degrees(values)), color=LINES[name], label=NAMES[name], lw=1.0)
        _expected(found, panel, angle)
        panel.set_title(f"{angle} of the {found.rig.chassis} [degrees]")
        _bounded(panel)
    panels[-1, 0].set_xlabel("time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3)
    return save(figure, path)


def _expected(found: Found, panel: Any, angle: str) -> None:
    """Standard deviation of the free run, as predicted, about the run that is held."""
    if found.drift is None or found.chosen == FREE or found.chosen not in found.runs:
        return
    times, values = next((t, v) for name, t, v in _angles(found, angle) if name == found.chosen)
    slow = np.interp(found.drift.times, times, values)
    spread = found.drift.deviations[:, ("roll", "pitch").index(angle)]
    low, high = np.degrees(slow - spread), np.degrees(slow + spread)
    panel.fill_between(
        found.drift.times,
        low,
        high,
        color=LINES[FREE],
        alpha=0.15,
        lw=0,
        label="free run as predicted, 1 standard deviation",
    )


def _angles(found: Found, angle: str) -> list[tuple[str, np.ndarray, np.ndarray]]:
    own, out = found.recording, list[tuple[str, np.ndarray, np.ndarray]]()
    for signal in own.find("angle", found.rig.chassis, angle)[:1]:
        out.append(("measured", own.period * np.arange(own.count), own.samples(signal)))
    for name, run in found.runs.items():
        answer = next(a for a in run.answers if a.name == f"{found.rig.chassis} {angle}")
        out.append((name, run.period * np.arange(run.done), run.samples(answer)))
    if found.virtual is not None:
        from models.vehicles.cut_vehicle import ANGLES

        true = found.virtual.run
        out.append(("truth", true.times, true.states[:, ANGLES[angle]]))
    return out


def _bounded(panel: Any) -> None:
    """A free run that topples must not squeeze all else to a line."""
    low, high = (max(-30.0, panel.get_ylim()[0]), min(30.0, panel.get_ylim()[1]))
    panel.set_ylim(low, high)


def forces_figure(run: Outcome, answers: Sequence[Answer], path: Path, name: str = "") -> Path:
    """Up to six section forces over the whole recording, and two seconds of each about its greatest range."""
    from models.drawing.figures import plt, save

    times = run.period * np.arange(run.done)
    figure, panels = plt.subplots(
        len(answers), 2, figsize=(9.5, 1.5 * len(answers) + 0.5), squeeze=False, width_ratios=(2.4, 1)
    )
    for (left, right), answer in zip(panels, answers, strict=True):
        values, unit, scale = run.samples(answer), f"k{answer.unit}", 1e-3
        if np.abs(values).max() < 1e3:
            unit, scale = answer.unit, 1.0
        left.plot(*thinned(times, scale * values), color=LINES.get(name, "#0072b2"), lw=0.7)
        left.set_title(f"{answer.name} [{unit}]")
        peak = times[int(np.argmax(np.abs(values - values.mean())))]
        near = np.abs(times - peak) <= 1.0
        right.plot(times[near], scale * values[near], color=LINES.get(name, "#0072b2"))
        right.set_title("two seconds about its peak", color="#555555")
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    return save(figure, path)


def counting_figure(counted: dict[Answer, Counted], path: Path) -> Path:
    """Level crossings and range pairs of some loads."""
    from models.drawing.figures import plt, save

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.6))
    for colour, (answer, own) in zip(WHEELS, counted.items(), strict=False):
        scale = 1e-3
        left.plot(np.maximum(own.crossings, 0.5), scale * own.levels, drawstyle="steps-mid", color=colour)
        right.plot(np.maximum(own.pairs, 0.25), scale * own.ranges, color=colour, label=answer.name)
    left.set_title("level crossings, upwards")
    right.set_title("range pairs of at least")
    for panel in (left, right):
        panel.set_xscale("log")
        panel.set_xlabel("number")
    left.set_ylabel("level [kN, kN m]")
    right.set_ylabel("range [kN, kN m]")
    figure.legend(loc="outside upper right", ncols=3)
    return save(figure, path)


def overlay_figure(found: Found, compared: Sequence[Compared], path: Path) -> Path:
    """Channels that were not put in beside the run: the whole, and two seconds where the error is largest."""
    from models.drawing.figures import plt, save

    assert found.held is not None
    figure, panels = plt.subplots(
        len(compared), 2, figsize=(9.5, 1.5 * len(compared) + 0.7), squeeze=False, width_ratios=(2.4, 1)
    )
    for (left, right), one in zip(panels, compared, strict=True):
        times, measured, computed = overlay(found.recording, found.held, one.signal, one.answer)
        peak = times[int(np.nanargmax(np.abs(computed - measured)))]
        near = np.abs(times - peak) <= 1.0
        for values, name, label in ((measured, "measured", "measured"), (computed, found.chosen, "computed")):
            width = 2.6 if name == "measured" else 0.8
            left.plot(*thinned(times, values), color=LINES[name], lw=width, label=label)
            right.plot(times[near], values[near], color=LINES[name], lw=width)
        left.set_title(f"{one.signal.name} [{one.answer.unit}]")
        right.set_title("about the largest error", color="#555555")
    for panel in panels[-1]:
        panel.set_xlabel("time [s]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return save(figure, path)
