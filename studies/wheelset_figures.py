"""Figures of a wheelset on straight track: eigenvalues over speed, runs in time, creep forces and their power."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from models.core.result import Result
from models.drawing.figures import (
    BLUE,
    COLOURS,
    COLUMN_WIDTH,
    LABELS,
    SMALL_TEXT,
    VERMILION,
    add_heading,
    legend_below,
    save,
    subplots,
)
from models.rail.equations import YAW, Y
from models.rail.equations import WheelsetPath as Motion
from models.rail.limit_cycle import Orbit
from models.rail.linear import klingel_wavelength
from models.rail.wheelset import Wheelset
from models.systems.wheelset.conicity import Conicities
from models.systems.wheelset.run import LinearisedMotion, results_by_speed_text

ENGINE_MARKS = {"reference": "-", "exudyn": "x", "mujoco": "+"}
"""Line or mark of each implementation: the reference is a line, the engines are marks on it."""
SHOWN_SECONDS = 1.0
"""Time (s) at the end of a run for which creep forces are drawn."""


def _write_note(
    axis: Axes, note_text: str, noted_point: tuple[float, float], text_offset: tuple[float, float], **text_style: Any
) -> None:
    """Write text beside a point of a plot; the text's right end is shifted from the point by ``text_offset`` (printer's
    points).
    """
    axis.annotate(note_text, noted_point, text_offset, textcoords="offset points", ha="right", **text_style)


def _patch_sums_of_wheels(patch_table: np.ndarray, *quantity_names: str) -> Iterator[tuple[str, str, list[np.ndarray]]]:
    """Yield for each wheel its name, its colour, and sums (n,) over its contact patches of the named quantities."""
    patches_per_wheel = patch_table.shape[1] // 2
    yield "right wheel", BLUE, [patch_table[name][:, :patches_per_wheel].sum(axis=1) for name in quantity_names]
    yield "left wheel", VERMILION, [patch_table[name][:, patches_per_wheel:].sum(axis=1) for name in quantity_names]


def stability_figure(
    eigenvalues_by_engine: Mapping[str, Result], wheelset: Wheelset, title: str, figure_path: Path
) -> None:
    """Save a figure of growth rate and wavelength of the hunting motion over speed, and of its root locus."""
    linear: dict[str, LinearisedMotion] = {engine: result.detail for engine, result in eigenvalues_by_engine.items()}
    figure, (left, middle, right) = subplots(1, 3, figsize=(COLUMN_WIDTH, 3.8))
    for engine, linear_run in linear.items():
        style: Any = {"color": COLOURS[engine], "label": LABELS[engine]}
        left.plot(linear_run.speeds, linear_run.values.real.max(axis=1), ENGINE_MARKS[engine], **style)
        middle.plot(
            linear_run.speeds,
            2.0 * np.pi * linear_run.speeds / linear_run.hunting_eigenvalue.imag,
            ENGINE_MARKS[engine],
            **style,
        )
        right.plot(
            linear_run.hunting_eigenvalue.real,
            linear_run.hunting_eigenvalue.imag / (2.0 * np.pi),
            ENGINE_MARKS[engine],
            **style,
        )
    first = next(iter(linear.values()))
    for line in (left.axhline, right.axvline):
        line(0.0, color="0.6", linewidth=0.8)
    if first.critical_speed is not None:
        left.axvline(first.critical_speed, color="0.6", linestyle=":")
        _write_note(left, f"{first.critical_speed:.4g} m/s", (first.critical_speed, 0.0), (-4, 8))
    middle.axhline(klingel_wavelength(wheelset), color="0.6", linestyle=":")
    _write_note(
        middle,
        "Klingel's, without suspension",
        (first.speeds[-1], klingel_wavelength(wheelset)),
        (0, -12),
        fontsize=SMALL_TEXT,
    )
    for i in np.unique(np.linspace(0, len(first.speeds) - 1, 6).astype(int)):
        eigenvalue = first.hunting_eigenvalue[i]
        if np.isfinite(eigenvalue):
            mark_position = eigenvalue.real, eigenvalue.imag / (2.0 * np.pi)
            clear = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
            _write_note(
                right,
                f"{first.speeds[i]:g} m/s",
                mark_position,
                (-8, 0),
                va="center",
                fontsize=SMALL_TEXT,
                bbox=clear,
                zorder=1,
            )
    left.set(xlabel="speed [m/s]", ylabel="largest real part [1/s]", title="Least stable motion")
    middle.set(xlabel="speed [m/s]", ylabel="wavelength [m]", title="Wavelength of hunting")
    right.set(xlabel="real part [1/s]", ylabel="frequency [Hz]", title="Root locus of hunting")
    right.margins(x=0.6)
    middle.margins(y=0.2)
    legend_below(figure, left)
    add_heading(figure, f"{title}\nLinear creep, all motions of the wheelset", eigenvalues_by_engine)
    save(figure, figure_path)


def lateral_motion_figure(runs_by_engine: Mapping[str, Mapping[float, Result]], title: str, figure_path: Path) -> None:
    """Save a figure of the lateral displacement over time, with a panel per speed, and below it the difference of each
    engine from the first."""
    paths: dict[str, dict[float, Motion]] = {
        engine: {speed: result.detail for speed, result in path_then.items()}
        for engine, path_then in runs_by_engine.items()
    }
    name, first = next(iter(paths.items()))
    rows = (2, 1) if len(paths) > 1 else (2,)
    size = COLUMN_WIDTH, 1.1 + 1.3 * sum(rows)
    figure, axes = subplots(len(rows), len(first), figsize=size, squeeze=False, sharex="col", height_ratios=rows)
    for column, (speed, path_then) in zip(axes.T, first.items(), strict=True):
        for i, (engine, motions) in enumerate(paths.items()):
            states, colour = motions[speed].states, COLOURS[engine]
            drawn_rows = slice(40 * (1 + i), None, 150) if i else slice(None)
            mark = ENGINE_MARKS[engine] if i else "-"
            column[0].plot(
                path_then.times[drawn_rows], 1e3 * states[drawn_rows, Y], mark, color=colour, label=LABELS[engine]
            )
            if i:
                gap = np.maximum(np.abs(states - path_then.states).max(axis=1), 1e-17)
                column[1].semilogy(path_then.times, gap, color=colour, linewidth=0.7)
                column[1].set(ylabel="[m, rad, m/s, rad/s]", title=f"Largest difference from {LABELS[name]}")
        column[0].set(ylabel="lateral displacement [mm]", title=f"{speed:g} m/s")
        column[-1].set_xlabel("time [s]")
    legend_below(figure, axes[0, 0])
    runs_by_name = {
        f"{engine}, {speed_of_path}": run
        for engine, path_then in runs_by_engine.items()
        for speed_of_path, run in results_by_speed_text(path_then).items()
    }
    add_heading(figure, f"{title}: the same path in every implementation", runs_by_name)
    save(figure, figure_path)


def creep_force_figure(runs_by_speed: Mapping[float, Result], title: str, figure_path: Path) -> None:
    """Save a figure of the creep forces on each wheel, and of their power, over the last second of every run."""
    paths: dict[float, Motion] = {speed: result.detail for speed, result in runs_by_speed.items()}
    figure, axes = subplots(3, len(paths), figsize=(COLUMN_WIDTH, 6.0), squeeze=False, sharex="col")
    for k, (speed, course) in enumerate(paths.items()):
        is_last_second = course.times >= course.times[-1] - SHOWN_SECONDS
        for side, colour, sums in _patch_sums_of_wheels(course.contacts[is_last_second], "fx", "fy", "power"):
            for axis, values in zip(axes[:, k], sums, strict=True):
                axis.plot(course.times[is_last_second], values, color=colour, label=side)
        axes[0, k].set(ylabel="along the track [N]", title=f"{speed:g} m/s")
        axes[1, k].set(ylabel="across the track [N]")
        axes[2, k].set(ylabel="power [W]", xlabel="time [s]")
        axes[2, k].axhline(0.0, color="0.6", linewidth=0.8)
    legend_below(figure, axes[0, 0])
    largest = max(float(course.contacts["power"].max()) for course in paths.values())
    subtitle = f"Creep forces on the wheels and their power, at any time {largest:.3g} W or less"
    add_heading(figure, f"{title}\n{subtitle}", results_by_speed_text(runs_by_speed))
    save(figure, figure_path)


def limit_cycle_branch_figure(limit_cycle_branch: Result, wheelset: Wheelset, title: str, figure_path: Path) -> None:
    """Save a figure of amplitude and frequency of the limit cycles over speed: stable ones filled, unstable ones
    open."""
    orbits: Sequence[Orbit] = limit_cycle_branch.detail
    figure, (left, middle, right) = subplots(1, 3, figsize=(COLUMN_WIDTH, 3.8))
    speeds, amplitudes, frequencies = (
        np.array([getattr(orbit, name) for orbit in orbits]) for name in ("speed", "amplitude", "frequency")
    )
    stable, clearance = np.array([orbit.stable for orbit in orbits]), 1e3 * wheelset.flange_clearance
    for axis, values in ((left, 1e3 * amplitudes), (middle, 1e3 * amplitudes), (right, frequencies)):
        axis.plot(speeds, values, color="0.7", zorder=1)
        for chosen, face, label in ((stable, BLUE, "attracts"), (~stable, "white", "repels")):
            label = f"cycle that {label}" if chosen.any() else ""
            style: Any = {"s": 18, "facecolor": face, "edgecolor": BLUE, "zorder": 2}
            axis.scatter(speeds[chosen], values[chosen], label=label or None, **style)
        axis.set_xlabel("speed [m/s]")
    for axis in (left, middle):
        axis.axhline(clearance, color="0.6", linestyle=":")
        axis.set(ylabel="lateral amplitude [mm]", ylim=(0, None))
    begins = speeds[amplitudes <= 1.02e-3 * clearance] if (amplitudes <= 1e-3 * clearance).any() else speeds[:1]
    margin = 0.2 * np.ptp(begins) + 0.05
    middle.set(xlim=(begins.min() - margin, begins.max() + margin), ylim=(0, 1.1 * clearance), title="Where it begins")
    _write_note(left, "flanges touch", (speeds.max(), clearance), (0, -11), fontsize=SMALL_TEXT)
    ends = np.array([speeds.min(), speeds.max()])
    right.plot(
        ends, ends / klingel_wavelength(wheelset), color="0.6", linestyle=":", label="speed by Klingel's wavelength"
    )
    left.set_title("Amplitude")
    right.set(ylabel="frequency [Hz]", title="Frequency")
    legend_below(figure, left, right, column_count=3)
    add_heading(figure, title, {"branch": limit_cycle_branch})
    save(figure, figure_path)


def limit_cycle_figure(cycles_by_engine: Mapping[str, Result], title: str, figure_path: Path) -> None:
    """Save a figure of the limit cycle as yaw over lateral displacement in every engine, and of its creep forces over a
    period."""
    cycles: dict[str, Orbit] = {engine: result.detail for engine, result in cycles_by_engine.items()}
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.2))
    for engine, orbit in cycles.items():
        states = orbit.path().states[:: 1 if engine == "reference" else 16]
        left.plot(
            1e3 * states[:, Y], 1e3 * states[:, YAW], ENGINE_MARKS[engine], color=COLOURS[engine], label=LABELS[engine]
        )
    first = next(iter(cycles.values()))
    around = first.path()
    for side, colour, (force_along, across) in _patch_sums_of_wheels(around.contacts, "fx", "fy"):
        for force, name, line in ((force_along, "along", "-"), (across, "across", "--")):
            right.plot(around.times, 1e-3 * force, line, color=colour, label=f"{side}, {name}")
    left.set(
        xlabel="lateral displacement [mm]",
        ylabel="yaw [mrad]",
        title=f"Cycle at {first.speed:g} m/s, {first.frequency:.4g} Hz",
    )
    right.set(xlabel="time [s]", ylabel="creep force [kN]", title="Creep forces in one period")
    left.legend()
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)
    add_heading(figure, f"{title}\nOne cycle, the same in every implementation", cycles_by_engine)
    save(figure, figure_path)


def conicity_figure(conicity_result: Result, title: str, figure_path: Path) -> None:
    """Save a figure of the rolling radius difference over lateral displacement, with the amplitudes of the waves, and
    of both equivalent conicities over the amplitude."""
    conicities: Conicities = conicity_result.detail
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.6))
    table, rows = conicities.table, conicities.rows
    left.plot(1e3 * table.displacements, 1e3 * table.differences, color=BLUE, label="right less left")
    for row in rows:
        if np.isfinite(row.centre):
            swing = row.centre + np.array([-row.amplitude, 0.0, row.amplitude])
            heights = 1e3 * np.interp(swing, table.displacements, table.differences)
            left.plot(1e3 * swing, heights, "|-", color="0.7", linewidth=0.7, zorder=1, label="swing of a wave")
            left.plot(1e3 * swing[1], heights[1], "o", color=VERMILION, markersize=4, label="its centre")
    left.set(xlabel="lateral displacement [mm]", ylabel="right less left [mm]", title="Difference of the rolling radii")
    amplitudes = [1e3 * row.amplitude for row in rows]
    right.plot(amplitudes, [row.equivalent for row in rows], "o-", color=BLUE, label="EN 15302")
    right.plot(amplitudes, [row.harmonic for row in rows], "s--", color=VERMILION, label="first harmonic")
    right.set(
        xlabel="amplitude, half of peak to peak [mm]",
        ylabel="equivalent conicity [-]",
        title="Conicity",
        ylim=(0, None),
    )
    right.legend()
    handles, labels = left.get_legend_handles_labels()
    named = dict(zip(labels, handles, strict=True))  # every wave by one entry
    left.legend(list(named.values()), list(named))
    add_heading(figure, title, {"conicity": conicity_result})
    save(figure, figure_path)
