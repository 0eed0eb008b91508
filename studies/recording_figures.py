"""Figures of a recording: for each finding of its checks, its hub forces, the drift of the runs, section forces."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from models.core.finding import Finding
from models.drawing.figures import (
    BLUE,
    COLUMN_WIDTH,
    CURVE_COLOURS,
    MEASURED_COLOUR,
    PALE,
    TRUTH_COLOUR,
    VERMILION,
    YELLOW,
    add_heading,
    save,
    subplots,
)
from models.fatigue.counting import CountedLoad
from models.measured.checks.agreement import MeasurementFault, SignalGroup
from models.measured.checks.evidence import CheckedRecording
from models.measured.signal import UNIT_OF_QUANTITY, MeasuredSignal
from models.systems.measured.holds import FREE_RUN_NAME
from models.systems.measured.run import RecordingAnalysis
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.sections import SectionChannel
from models.systems.measured.verdict import ChannelComparison, paired_channels
from models.vehicles.cut_vehicle import ANGLES, GRAVITY

MARKED_SECONDS, UNMARKED_SECONDS, MOST_SAMPLES = 0.6, 15.0, 20_000
"""Time (s) drawn before and after a marked span; time (s) drawn without a mark; largest number of drawn samples."""
SHOWN_SIGNAL_LIMIT = 4
"""Largest number of signals in a figure."""
TITLE_LETTER_LIMIT = 60
"""Longest text (letters) of a finding's place in a figure's title."""
CURVE_COLUMNS = 1200
"""Number of columns of a long curve; least and largest value of each column are drawn, so that no peak is lost."""
LOUD_COLOUR, QUIET_COLOUR, MARK_COLOUR = VERMILION, TRUTH_COLOUR, YELLOW
RUN_STYLES = {
    "measured": ("measured", MEASURED_COLOUR),
    "truth": ("truth", TRUTH_COLOUR),
    FREE_RUN_NAME: ("free run", LOUD_COLOUR),
    "kalman": ("held by the Kalman filter", BLUE),
    "prescribed": ("held to the measured angles", BLUE),
}
"""Label and colour of each run, of the measurement, and of the true motion."""
WHEEL_COLOURS = CURVE_COLOURS[:6]
CHECKS_OF_FAULT = {"late": ("shift",), "factor": ("sign", "unit", "gain"), "swapped": ("swapped",)}
"""Names of the checks that detect each kind of measurement fault."""


def figure_of_finding(finding: Finding, recording_data: CheckedRecording, figure_path: Path) -> Path | None:
    """Save the figure that illustrates a finding; returns its path, or None if there is nothing to draw."""
    telling = (f for f in recording_data.faults if finding.check in CHECKS_OF_FAULT.get(f.kind, ()))
    fault = next((f for f in telling if set(f.names) == set(finding.signals)), None)
    signals = tuple(s for s in recording_data.recording.signals if s.name in finding.signals)
    if not signals:
        return None
    vertical, hubs = (
        recording_data.vertical_force_signals(),
        recording_data.vehicle.hubs if recording_data.vehicle else (),
    )
    loads = len(vertical) == len(hubs) > 0 and set(signals) <= set(vertical.values())
    if finding.check in ("weight", "gain", "sign", "unit") and loads:
        return _plot_mean_forces(recording_data, figure_path)
    if recording_data.agreement is not None and fault is not None:
        return (
            _plot_exchanged_hubs(recording_data, fault, figure_path)
            if fault.kind == "swapped"
            else _plot_channel_ratio(recording_data, fault, figure_path)
        )
    return (
        _plot_spectrum(recording_data, signals, figure_path)
        if finding.check == "noise"
        else _plot_signals(finding, recording_data, signals, figure_path)
    )


def _save_titled(
    figure: Any,
    figure_title: str,
    figure_path: Path,
    legend_axis: Any = None,
    legend_position: str = "outside upper right",
) -> Path:
    """Add a title, and the legend of an axis if one is given, to a figure, and save it; returns its path."""
    if legend_axis is not None:
        columns = 3 if "lower" in legend_position else 2
        figure.legend(*legend_axis.get_legend_handles_labels(), loc=legend_position, ncols=columns)
    add_heading(figure, figure_title)
    return save(figure, figure_path)


def _plot_signals(
    finding: Finding, recording_data: CheckedRecording, signals: tuple[MeasuredSignal, ...], figure_path: Path
) -> Path:
    """Save a figure of the signals of a finding over time, with the time span of the finding marked."""
    recording, marked, shown = recording_data.recording, finding.times, signals[:SHOWN_SIGNAL_LIMIT]
    begin = max(marked[0] - MARKED_SECONDS, 0.0) if marked else 0.0
    end = min(marked[1] + MARKED_SECONDS if marked else UNMARKED_SECONDS, recording.duration)
    first_sample, last_sample = round(begin / recording.period), round(end / recording.period) + 1
    stride = max((last_sample - first_sample) // MOST_SAMPLES, 1)
    sample_times = recording.period * np.arange(first_sample, last_sample)[::stride]
    drawn, axes = subplots(len(shown), 1, figsize=(COLUMN_WIDTH, 1.2 + 1.5 * len(shown)), sharex=True, squeeze=False)
    for axis, signal in zip(axes[:, 0], shown, strict=True):
        values = recording.columns.read(signal.name, first_sample, last_sample - first_sample)[::stride]
        axis.plot(sample_times[: len(values)], values, color=QUIET_COLOUR, lw=0.8)
        axis.set_ylabel(f"{signal.name} [{UNIT_OF_QUANTITY[signal.quantity]}]")
        if finding.check == "gravity" and signal.component == "z":
            axis.axhline(GRAVITY if signal.gravity else 0.0, color=LOUD_COLOUR, ls="--", label="expected mean")
            axis.legend(loc="best")
        if marked:
            axis.axvspan(*marked, color=MARK_COLOUR, alpha=0.5, lw=0)
        if finding.check == "clipped" and marked:
            axis.axhline(
                float(recording.columns.read(signal.name, round(marked[0] / recording.period), 1)[0]),
                color=LOUD_COLOUR,
                ls="--",
            )
    axes[-1, 0].set_xlabel("time [s]" + ("; yellow: what is meant" if marked else ""))
    return _save_titled(
        drawn,
        f"{shorten(finding.place or 'Recording', TITLE_LETTER_LIMIT, placeholder=' ...')}: as recorded",
        figure_path,
    )


def _plot_mean_forces(recording_data: CheckedRecording, figure_path: Path) -> Path:
    """Save a bar chart of each hub's mean measured vertical force beside its static load by the vehicle file."""
    assert recording_data.vehicle is not None
    hubs, loads, vertical = (
        recording_data.vehicle.hubs,
        recording_data.vehicle.loads,
        recording_data.vertical_force_signals(),
    )
    means = np.array([recording_data.mean_of_signal(vertical[hub]) for hub in hubs])
    drawn, axis = subplots(figsize=(COLUMN_WIDTH, 3.4))
    bar_positions = np.arange(len(hubs))
    axis.bar(bar_positions - 0.2, loads, 0.38, color=PALE, label="static load by the vehicle file")
    bars = axis.bar(bar_positions + 0.2, means, 0.38, color=LOUD_COLOUR, label="mean of the recording")
    axis.bar_label(
        bars,
        [f"{deviation:+.2%}" if abs(deviation) < 0.5 else f"x {deviation + 1:.3g}" for deviation in means / loads - 1],
    )
    axis.set_xticks(bar_positions, [f"{hub}\n{vertical[hub].name}" for hub in hubs])
    axis.set_ylabel("vertical force [N]")
    if np.abs(means).max() > 10 * loads.max():
        axis.set_yscale("symlog", linthresh=float(loads.max()))
    axis.margins(y=0.2)
    return _save_titled(drawn, "Mean vertical forces", figure_path, axis)


def _plot_channel_ratio(recording_data: CheckedRecording, suspected_fault: MeasurementFault, figure_path: Path) -> Path:
    """Save a figure of the ratio of a channel's reading to its expected value over frequency; a delay shows as a slope
    of the phase, a wrong factor as a constant magnitude."""
    agreement = recording_data.agreement
    assert agreement is not None
    for earlier_fault in recording_data.faults[
        : recording_data.faults.index(suspected_fault)
    ]:  # the agreement in which this one was found
        agreement = agreement.corrected_for(earlier_fault)
    group_channels = (
        agreement.force_signals if suspected_fault.signals[0] in agreement.force_signals else agreement.reading_signals
    )
    group = SignalGroup(
        suspected_fault.name,
        group_channels is agreement.force_signals,
        tuple(group_channels.index(s) for s in suspected_fault.signals),
    )
    line, size = (
        (agreement.weights * part_of_weights).sum(axis=1) for part_of_weights in agreement.cross_and_own_power(group)
    )
    f, ratio, sure = agreement.frequencies, size / line if group.forces else line / size, size / size.max()
    late, factor = (suspected_fault.size, 1.0) if suspected_fault.kind == "late" else (0.0, suspected_fault.size)
    size_text = (
        f"{1e3 * suspected_fault.size:+.2f} ms"
        if suspected_fault.kind == "late"
        else f"factor {suspected_fault.size:.4g}"
    )
    expected = factor * np.exp(-2j * np.pi * f * late)
    phase = -360 * f * late + (180.0 if factor < 0 else 0.0)
    drawn, axes = subplots(2, 1, figsize=(COLUMN_WIDTH, 4.6), sharex=True)
    for axis, measured, predicted_values, level in (
        (axes[0], np.abs(ratio), np.abs(expected), 1.0),
        (axes[1], np.degrees(np.angle(ratio / expected)) + phase, phase, 0.0),
    ):
        axis.scatter(f, measured, s=4 + 40 * sure, color=QUIET_COLOUR, label="measured; larger: surer")
        axis.plot(f, predicted_values, color=LOUD_COLOUR, label=size_text)
        axis.axhline(level, color=PALE, ls=":", label="as it should be")
    axes[0].set_ylabel("size [-]")
    axes[1].set_ylabel("phase [deg]")
    axes[0].set_ylim(0.0, 2 * max(abs(factor), 1.0))
    axes[1].set_xlabel("frequency [Hz]")
    title = f"{suspected_fault.name}: recorded by what the motion of the vehicle tells"
    return _save_titled(drawn, title, figure_path, axes[0], "outside lower center")


def _plot_exchanged_hubs(
    recording_data: CheckedRecording, suspected_fault: MeasurementFault, figure_path: Path
) -> Path:
    """Save a bar chart of the share of each reading that the hub forces do not explain, with the hubs as mapped and
    with two of them exchanged."""
    agreement = recording_data.agreement
    assert agreement is not None
    names = [s.name for s in agreement.reading_signals]
    drawn, axis = subplots(figsize=(COLUMN_WIDTH, 1.4 + 0.24 * len(names)))
    bar_positions = np.arange(len(names))
    axis.barh(bar_positions - 0.2, 100 * agreement.unexplained_shares, 0.38, color=LOUD_COLOUR, label="as mapped")
    axis.barh(
        bar_positions + 0.2,
        100 * agreement.corrected_for(suspected_fault).unexplained_shares,
        0.38,
        color=QUIET_COLOUR,
        label=f"{suspected_fault.name} exchanged",
    )
    axis.set_yticks(bar_positions, names)
    axis.invert_yaxis()
    axis.set_xlabel("what the hub forces leave unexplained of each reading [%]")
    return _save_titled(drawn, "Exchanged hubs", figure_path, axis)


def _plot_spectrum(recording_data: CheckedRecording, signals: tuple[MeasuredSignal, ...], figure_path: Path) -> Path:
    """Save a figure of the spectral density of signals, and of the noise density that is stated for them."""
    from scipy.signal import welch

    recording = recording_data.recording
    drawn, axis = subplots(figsize=(COLUMN_WIDTH, 3.4))
    for signal in signals[:SHOWN_SIGNAL_LIMIT]:
        values = recording.samples(signal)
        f, density = welch(
            np.where(np.isfinite(values), values, np.nanmean(values)), 1 / recording.period, nperseg=2048
        )
        axis.loglog(f[1:], np.sqrt(density[1:]), lw=0.9, label=signal.name)
        stated = recording_data.stated_noise.get(signal.name)
        if stated:
            axis.axhline(
                stated * np.sqrt(2 * recording.period), color=LOUD_COLOUR, ls="--", label=f"stated for {signal.name}"
            )
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(f"spectral density [{UNIT_OF_QUANTITY[signals[0].quantity]} / sqrt(Hz)]")
    return _save_titled(drawn, "Noise: where the spectrum goes flat", figure_path, axis)


def thinned_curve(curve_times: np.ndarray, curve_values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and values (m,) of a curve (n,), thinned for plotting to the least and the largest value of each short
    section of samples."""
    width = len(curve_times) // CURVE_COLUMNS
    if width < 3:
        return curve_times, curve_values
    rows = len(curve_times) // width
    parts = curve_values[: rows * width].reshape(rows, width)
    empty = ~np.isfinite(parts).any(axis=1)
    safe = np.where(np.isfinite(parts) | empty[:, None], parts, np.nanmean(curve_values))
    extremes = np.column_stack([safe.min(axis=1), safe.max(axis=1)])
    extremes[empty] = np.nan
    return np.repeat(curve_times[: rows * width : width], 2), extremes.ravel()


def _panels_over_time(row_count: int, height: float, **options_of_panels: Any) -> tuple[Any, np.ndarray]:
    """Figure and axes of rows of panels over time."""
    drawn, panels = subplots(row_count, figsize=(COLUMN_WIDTH, height), squeeze=False, **options_of_panels)
    for panel in panels[-1] if options_of_panels.get("sharex") else panels.flat:
        panel.set_xlabel("time [s]")
    return drawn, panels


def measured_forces_figure(examined_recording: RecordingAnalysis, figure_path: Path) -> Path:
    """Save a figure of the measured forces at all hubs along each axis over time."""
    recording, axes = (
        examined_recording.recording,
        [a for a in "zxy" if examined_recording.recording.find_signals("force", component=a)],
    )
    drawn, panels = _panels_over_time(len(axes), 1.9 * len(axes) + 0.5, sharex=True)
    sample_times = recording.period * np.arange(recording.count)
    for panel, axis in zip(panels[:, 0], axes, strict=True):
        for i, hub in enumerate(examined_recording.rig.hubs):
            for signal in (s for s in recording.find_signals("force", hub, axis) if not s.check):
                panel.plot(
                    *thinned_curve(sample_times, recording.samples(signal) / 1e3),
                    color=WHEEL_COLOURS[i % len(WHEEL_COLOURS)],
                    label=hub,
                    lw=0.7,
                )
        panel.set_title(f"Force on the hub along {axis} [kN]")
    drawn.legend(
        *panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=len(examined_recording.rig.hubs)
    )
    return save(drawn, figure_path)


def drift_figure(examined_recording: RecordingAnalysis, figure_path: Path) -> Path:
    """Save a figure of roll and pitch of every run, with the measured angles and, for a virtual measurement, the true
    angles."""
    angles = examined_recording.rig.angles
    drawn, panels = _panels_over_time(len(angles), 2.0 * len(angles) + 0.6, sharex=True)
    for panel, angle in zip(panels[:, 0], angles, strict=True):
        curves = _angles_of_runs(examined_recording, angle)
        for name, (times_of_run, values) in curves.items():
            label, colour = RUN_STYLES[name]
            panel.plot(*thinned_curve(times_of_run, np.degrees(values)), color=colour, label=label, lw=1.0)
        if (
            examined_recording.drift is not None
            and examined_recording.chosen_run != FREE_RUN_NAME
            and examined_recording.chosen_run in curves
        ):
            chosen_angles = np.interp(examined_recording.drift.times, *curves[examined_recording.chosen_run])
            spread = examined_recording.drift.deviations[:, ("roll", "pitch").index(angle)]
            label = "free run as predicted, 1 standard deviation"
            bounds = np.degrees(chosen_angles - spread), np.degrees(chosen_angles + spread)
            panel.fill_between(
                examined_recording.drift.times, *bounds, color=LOUD_COLOUR, alpha=0.15, lw=0, label=label
            )
        panel.set_title(f"{angle} of the {examined_recording.rig.chassis} [degrees]")
        low, high = panel.get_ylim()
        panel.set_ylim(max(-30.0, low), min(30.0, high))  # a run that topples must not squeeze all else to a line
    drawn.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return save(drawn, figure_path)


def _angles_of_runs(examined_recording: RecordingAnalysis, angle_name: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Times (s) and values (rad) of an angle by name: measured, of every run, and true for a virtual measurement."""
    recording, chassis = examined_recording.recording, examined_recording.rig.chassis
    curves = dict[str, tuple[np.ndarray, np.ndarray]]()
    for signal in recording.find_signals("angle", chassis, angle_name)[:1]:
        curves["measured"] = recording.period * np.arange(recording.count), recording.samples(signal)
    for name, run in examined_recording.runs.items():
        curves[name] = run.period * np.arange(run.done), run.samples(f"{chassis} {angle_name}")
    if examined_recording.virtual is not None:
        curves["truth"] = (
            examined_recording.virtual.run.times,
            examined_recording.virtual.run.states[:, ANGLES[angle_name]],
        )
    return curves


def section_forces_figure(
    recording_run: SectionOutcome, section_channels: Sequence[SectionChannel], figure_path: Path, run_name: str = ""
) -> Path:
    """Save a figure of section forces over the complete recording, and of two seconds about the peak of each."""
    sample_times, colour = (
        recording_run.period * np.arange(recording_run.done),
        RUN_STYLES.get(run_name, RUN_STYLES["kalman"])[1],
    )
    drawn, panels = _panels_over_time(
        len(section_channels), 1.7 * len(section_channels) + 0.5, column_count=2, width_ratios=(2.4, 1)
    )
    for (left, right), answer in zip(panels, section_channels, strict=True):
        values, unit, scale = recording_run.samples(answer), f"k{answer.unit}", 1e-3
        if np.abs(values).max() < 1e3:
            unit, scale = answer.unit, 1.0
        left.plot(*thinned_curve(sample_times, scale * values), color=colour, lw=0.7)
        left.set_title(f"{answer.name} [{unit}]")
        near = np.abs(sample_times - sample_times[int(np.argmax(np.abs(values - values.mean())))]) <= 1.0
        right.plot(sample_times[near], scale * values[near], color=colour)
        right.set_title(f"Two seconds about its peak [{unit}]", fontsize=8)
    return save(drawn, figure_path)


def load_counts_figure(counted_loads: dict[SectionChannel, CountedLoad], figure_path: Path) -> Path:
    """Save a figure of the level crossings and range pairs of some section forces."""
    drawn, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    for colour, (answer, counts) in zip(WHEEL_COLOURS, counted_loads.items(), strict=False):
        left.plot(np.maximum(counts.crossings, 0.5), 1e-3 * counts.levels, drawstyle="steps-mid", color=colour)
        right.plot(np.maximum(counts.pairs_of_range, 0.25), 1e-3 * counts.ranges, color=colour, label=answer.name)
    for panel, title, quantity_name in (
        (left, "level crossings, upwards", "level"),
        (right, "range pairs of at least", "range"),
    ):
        panel.set_title(title)
        panel.set_xscale("log")
        panel.set_xlabel("number [-]")
        panel.set_ylabel(f"{quantity_name} [kN, kN m]")
    drawn.legend(loc="outside upper right", ncols=3)
    return save(drawn, figure_path)


def measured_and_computed_figure(
    examined_recording: RecordingAnalysis,
    recording_run: SectionOutcome,
    channel_comparisons: Sequence[ChannelComparison],
    figure_path: Path,
) -> Path:
    """Save a figure of measured channels that were not inputs of the run, and of the computed ones: over the complete
    time, and for two seconds about the largest error."""
    drawn, panels = _panels_over_time(
        len(channel_comparisons), 1.7 * len(channel_comparisons) + 0.7, column_count=2, width_ratios=(2.4, 1)
    )
    for (left, right), comparison in zip(panels, channel_comparisons, strict=True):
        common_times, measured, computed = paired_channels(
            examined_recording.recording, recording_run, comparison.signal, comparison.answer
        )
        near = np.abs(common_times - common_times[int(np.nanargmax(np.abs(computed - measured)))]) <= 1.0
        for values, colour, width, label in (
            (measured, PALE, 2.6, "measured"),
            (computed, RUN_STYLES[examined_recording.chosen_run][1], 0.8, "computed"),
        ):
            left.plot(*thinned_curve(common_times, values), color=colour, lw=width, label=label)
            right.plot(common_times[near], values[near], color=colour, lw=width)
        left.set_title(f"{comparison.signal.name} [{comparison.answer.unit}]")
        right.set_title(f"About the largest error [{comparison.answer.unit}]", fontsize=8)
    drawn.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return save(drawn, figure_path)
