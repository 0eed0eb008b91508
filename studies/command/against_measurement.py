"""Comparison of a measurement with a run: time shift, errors of the channels with equal names, and a figure."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import InputError, suggestion_phrase
from models.core.result import Result, load_result
from models.core.whole_files import whole_file
from models.measured.channel import Channel, Source
from models.measured.file_kinds import is_measurement
from models.measured.formats import open_source
from models.measured.time_shift import ChannelPair, TimeShift, time_shift
from models.measured.timing import sample_timing
from models.measured.units import factor_between
from studies.command.comparison import channels_of
from studies.command.differences import Quantity

TIME_AXIS = "time [s]"
DOUBTFUL_CORRELATION = 0.5
"""Correlation of run and measurement below which a time shift is in doubt."""
SHOWN_CHANNELS = 4
"""Number of channels in the figure, those with the largest relative errors."""
TABLE_HEADINGS = ("channel", "unit", "rms error", "relative", "peak error", "at [s]", "stated error")


@dataclass(frozen=True)
class ChannelComparison:
    """A channel that was computed and measured: values (n,) of both in the run's unit, at the same times (n,) in s of
    the run.

    stated : error that the run states for the channel, NaN if it states none.
    """

    name: str
    unit: str
    times: np.ndarray
    run: np.ndarray
    measured: np.ndarray
    stated: float

    @property
    def error(self) -> np.ndarray:
        """Error (n,) of the channel: value of the run minus measured value."""
        return self.run - self.measured

    @property
    def rms(self) -> float:
        """Root mean square of the channel's error."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def relative(self) -> float:
        """Rms error divided by the standard deviation of the measurement; infinite if the measurement is constant."""
        size = float(np.std(self.measured))
        return self.rms / size if size > 0.0 else (0.0 if self.rms == 0.0 else np.inf)

    @property
    def row(self) -> int:
        """Index of the sample at which the channel's error is largest."""
        return int(np.abs(self.error).argmax())

    @property
    def peak(self) -> float:
        """Error of the largest magnitude, with its sign."""
        return float(self.error[self.row])

    @property
    def time_of_peak(self) -> float:
        """Time (s) of the run at which the channel's error is largest."""
        return float(self.times[self.row])

    def values(self) -> dict[str, float | None]:
        """Errors of the channel as plain values for JSON; None for numbers that are not finite."""
        plain = {
            "rms": self.rms,
            "relative": self.relative,
            "peak": self.peak,
            "at": self.time_of_peak,
            "stated": self.stated,
        }
        return {key: value if np.isfinite(value) else None for key, value in plain.items()}


@dataclass(frozen=True)
class Overlay:
    """Comparison of a measurement with a run: the time shift, the common channels, and notes on channels that could not
    be compared."""

    shift: TimeShift
    matches: list[ChannelComparison]
    notes: list[str]

    def lines(self) -> list[str]:
        """Lines for the screen: time shift, table of the channels' errors, and notes."""
        head = (
            f"  {TABLE_HEADINGS[0]:<28} {TABLE_HEADINGS[2]:>11} {'unit':<8} {TABLE_HEADINGS[3]:>9} "
            f"{TABLE_HEADINGS[4]:>11}  at"
        )
        rows = [
            f"  {channel_match.name:<28} {channel_match.rms:>11.4g} {channel_match.unit or '-':<8} "
            f"{_share_text(channel_match.relative):>9} {channel_match.peak:>11.4g}  "
            f"{channel_match.time_of_peak:.6g} s{_within_error_text(channel_match)}"
            for channel_match in self.matches
        ]
        return [f"  {self.shift_sentence()}", head, *rows, *(f"  {note}" for note in self.notes)]

    def shift_sentence(self) -> str:
        """Sentence for the screen on the time shift between measurement and run."""
        shift, correlation = self.shift.seconds, self.shift.correlation
        if np.isnan(correlation):
            return f"time shift {shift:.6g} s: as given, or nothing moves by which one could be told"
        doubt = (
            "" if correlation >= DOUBTFUL_CORRELATION else "; in doubt, as both are hardly alike: name it with --shift"
        )
        return f"time shift {shift:.6g} s, by which the measurement is later (correlation {correlation:.4f}){doubt}"


def _share_text(relative: float) -> str:
    """Text of a relative error in per cent; "-" if it is not finite, as for a constant measurement."""
    return f"{100.0 * relative:.3g} %" if np.isfinite(relative) else "-"


def _within_error_text(channel_match: ChannelComparison) -> str:
    return (
        f"; rms within the run's own error of {channel_match.stated:.2g}"
        if channel_match.rms <= channel_match.stated
        else ""
    )


def is_run_against_measurement(run: Path, measurement: Path) -> bool:
    """Whether the two paths are a run (a saved result or a folder) and a file of measurements, in this order."""
    return (
        (run.is_dir() or run.suffix == ".nc")
        and not measurement.is_dir()
        and measurement.suffix != ".nc"
        and is_measurement(measurement)
    )


def overlay_of_run(run: Result, file: str | Path, time_shift_seconds: float | None = None) -> Overlay:
    """Compare a measurement with a run channel by channel, largest relative error first.

    Headers are ``name [unit]``, names those of the run's channels; units are converted. A run of several engines has a
    channel of each under a name. time_shift_seconds : s, what the measurement's clock shows at the run's time 0; sought
    where None. Raises InputError for a file without any channel of the run, and for a unit that does not fit.
    """
    timed = (
        (name, quantity)
        for name, quantity in channels_of(run.data)
        if quantity.over == TIME_AXIS and len(quantity.grid) > 3
    )
    ours = {name: quantity for name, quantity in timed if np.isfinite(quantity.values).all()}
    if not ours:
        raise InputError("compare", "", None, "the run has no channels over time: a measurement cannot lie over it")
    source = open_source(file)
    engines = [str(engine) for engine in run.data.coords["engine"].values] if "engine" in run.data.coords else []
    named = {name: channel for channel in source.channels for name in _channels_by_engine(channel.name, engines, ours)}
    if not named:
        theirs = [channel.name for channel in source.channels]
        name = next((other for other in theirs if suggestion_phrase(other, tuple(ours))), theirs[0] if theirs else None)
        raise InputError(file, "", name, "no channel has the name of one of the run", tuple(ours))
    doubts = list[str]()
    pairs = {name: _channel_pair(source, channel, ours[name], doubts) for name, channel in named.items()}
    moved_by = time_shift(list(pairs.values())) if time_shift_seconds is None else TimeShift(time_shift_seconds, np.nan)
    matches = [_channel_match(name, pair, ours[name].unit, moved_by.seconds, run) for name, pair in pairs.items()]
    complete = [match for match in matches if match is not None]
    if not complete:
        raise InputError(file, "time", moved_by.seconds, "at this time shift (s) no sample lies within the run")
    notes = [*_missing_channel_notes(source, ours, engines), *dict.fromkeys(doubts)]
    return Overlay(moved_by, sorted(complete, key=lambda channel_match: -channel_match.relative), notes)


def _channels_by_engine(name: str, engines: list[str], run_quantities: Mapping[str, Quantity]) -> list[str]:
    """Names of the run's channels to compare with a measured channel: its own name, or this name followed by the name
    of an engine."""
    if name in run_quantities:
        return [name]
    return [
        channel_name for channel_name in (f"{name}, {engine}" for engine in engines) if channel_name in run_quantities
    ]


def _missing_channel_notes(
    measurement_source: Source, run_quantities: Mapping[str, Quantity], engines: list[str]
) -> Iterator[str]:
    """Yield a note on each measured channel that the run does not have, with the most similar name of the run."""
    for channel in measurement_source.channels:
        if not _channels_by_engine(channel.name, engines, run_quantities):
            yield (
                f"not compared: {channel.name!r} is no channel of the "
                f"run{suggestion_phrase(channel.name, tuple(run_quantities))}"
            )


def _channel_pair(
    measurement_source: Source, channel: Channel, run_quantity: Quantity, doubts: list[str]
) -> ChannelPair:
    """Times and values of a channel in the run and in the measurement, both in the run's unit; doubts about the
    measured times are appended to ``doubts``.
    """
    if not channel.unit and run_quantity.unit not in ("", "-"):
        allowed = f"has no unit: write {channel.name} [{run_quantity.unit}] in the header, or its unit there"
        raise InputError(measurement_source.path, channel.name, None, allowed)
    factor = factor_between(channel.unit, run_quantity.unit, measurement_source.path, channel.name)
    blocks = list(measurement_source.blocks([channel.name]))
    sample_times, values = (
        np.concatenate(parts) for parts in zip(*((b.times, b.values[:, 0]) for b in blocks), strict=True)
    )
    if not np.isfinite(values).any():
        raise InputError(measurement_source.path, channel.name, None, "has no values: no cell of it holds a number")
    clock = sample_timing(sample_times, str(measurement_source.path), (channel.name,))
    doubts.extend(finding.text for finding in clock.findings)
    return ChannelPair(
        run_quantity.grid,
        run_quantity.values,
        clock.times,
        factor * (values if clock.order is None else values[clock.order]),
    )


def _channel_match(
    name: str, channel_pair: ChannelPair, unit: str, time_shift_seconds: float, run: Result
) -> ChannelComparison | None:
    """Comparison of a channel at the measured times within the run, at which the run is interpolated by a cubic spline;
    None if no measured time lies within it."""
    from scipy.interpolate import CubicSpline

    times = channel_pair.times - time_shift_seconds
    slack = 1e-9 * (channel_pair.run_times[-1] - channel_pair.run_times[0])
    is_within = (
        np.isfinite(channel_pair.values)
        & (times >= channel_pair.run_times[0] - slack)
        & (times <= channel_pair.run_times[-1] + slack)
    )
    if not is_within.any():
        return None
    read = CubicSpline(channel_pair.run_times, channel_pair.run)(times[is_within])
    stated = error_estimates_of(run).get(name.partition(", ")[0])
    return ChannelComparison(
        name, unit, times[is_within], read, channel_pair.values[is_within], np.nan if stated is None else stated.error
    )


def saved_results(file_or_folder: Path) -> dict[str, Result]:
    """All saved results in a file or folder, by the name of the file; raises InputError if there are none."""
    if not file_or_folder.exists():
        raise InputError(file_or_folder, "", None, "no such file or folder")
    files = [file_or_folder] if file_or_folder.is_file() else sorted(file_or_folder.rglob("*.nc"))
    if not files:
        raise InputError(file_or_folder, "", None, "holds no saved result (.nc): name the folder of a run")
    return {file.stem: load_result(file) for file in files}


def report(run_path: Path, measurement: Path, folder: Path, time_shift_seconds: float | None = None) -> dict[str, Any]:
    """Compare a measurement with a run, or with all runs in a folder; saves ``compare.csv`` and figures, and returns
    the summary."""
    overlays = {
        name: overlay_of_run(run, measurement, time_shift_seconds) for name, run in saved_results(run_path).items()
    }
    with whole_file(folder / "compare.csv") as partial_path, partial_path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("run", *TABLE_HEADINGS))
        for name, overlay in overlays.items():
            for m in overlay.matches:
                writer.writerow((name, m.name, m.unit, m.rms, m.relative, m.peak, m.time_of_peak, m.stated))
    for name, overlay in overlays.items():
        draw_overlay(
            overlay,
            f"{measurement.name} over {name}",
            folder / (f"compare_{name}.png" if len(overlays) > 1 else "compare.png"),
        )
    table = [line for name, overlay in overlays.items() for line in _overlay_lines(name, overlay, len(overlays))]
    return {
        "scene": f"{measurement} over {run_path}",
        "folder": str(folder),
        "failed": {},
        "shift": {name: overlay.shift.seconds for name, overlay in overlays.items()},
        "errors of channels": {
            name: {m.name: m.values() for m in overlay.matches} for name, overlay in overlays.items()
        },
        "table": table,
        "results": {},
    }


def _overlay_lines(name: str, overlay: Overlay, overlay_count: int) -> Sequence[str]:
    return [*([f"  {name}"] if overlay_count > 1 else []), *overlay.lines()]


def draw_overlay(overlay: Overlay, title: str, path: Path) -> None:
    """Save a figure of the channels with the largest relative errors: measurement and run, and below it their
    difference."""
    from models.drawing.figures import BLUE, DARK, VERMILION, add_heading, save, subplots

    shown = overlay.matches[:SHOWN_CHANNELS]
    figure, axes = subplots(2, len(shown), figsize=(3.6 * len(shown) + 1.0, 5.4), sharex="col", squeeze=False)
    for (top, error_axis), match in zip(axes.T, shown, strict=True):
        unit = match.unit or "-"
        top.plot(match.times, match.measured, color=DARK, linewidth=1.8, label="measured")
        top.plot(match.times, match.run, color=VERMILION, linewidth=1.0, label="run")
        top.set(title=match.name, ylabel=f"{match.name} [{unit}]")
        error_axis.plot(match.times, match.error, color=BLUE)
        error_axis.plot(match.time_of_peak, match.peak, "o", color=BLUE, markersize=5)
        error_axis.set(
            title=f"rms error {match.rms:.3g} {unit}, {_share_text(match.relative)} of its deviation",
            xlabel="time of the run [s]",
        )
        error_axis.set_ylabel(f"run less measurement [{unit}]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    add_heading(figure, f"{title}: {overlay.shift_sentence().partition(';')[0]}", {})
    save(figure, path)
