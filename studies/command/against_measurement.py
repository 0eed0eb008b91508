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
from models.measured.channel import FileChannel, MeasurementSource
from models.measured.file_kinds import is_measurement
from models.measured.formats import open_source
from models.measured.time_shift import ChannelPair, TimeShift, time_shift
from models.measured.timing import sample_timing
from models.measured.units import factor_between
from studies.command.comparison import channels_of
from studies.command.differences import ResultQuantity

TIME_AXIS = "time [s]"
DOUBTFUL_CORRELATION = 0.5
"""Correlation of run and measurement below which a time shift is in doubt."""
SHOWN_CHANNEL_COUNT = 4
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
    run_values: np.ndarray
    measured_values: np.ndarray
    stated: float

    @property
    def error(self) -> np.ndarray:
        """Error (n,) of the channel: value of the run minus measured value."""
        return self.run_values - self.measured_values

    @property
    def rms(self) -> float:
        """Root mean square of the channel's error."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def relative(self) -> float:
        """Rms error divided by the standard deviation of the measurement; infinite if the measurement is constant."""
        size = float(np.std(self.measured_values))
        return self.rms / size if size > 0.0 else (0.0 if self.rms == 0.0 else np.inf)

    @property
    def row_of_peak(self) -> int:
        """Index of the sample at which the channel's error is largest."""
        return int(np.abs(self.error).argmax())

    @property
    def peak(self) -> float:
        """Error of the largest magnitude, with its sign."""
        return float(self.error[self.row_of_peak])

    @property
    def time_of_peak(self) -> float:
        """Time (s) of the run at which the channel's error is largest."""
        return float(self.times[self.row_of_peak])

    def errors_for_json(self) -> dict[str, float | None]:
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
class MeasurementOverlay:
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


def _share_text(relative_error: float) -> str:
    """Text of a relative error in per cent; "-" if it is not finite, as for a constant measurement."""
    return f"{100.0 * relative_error:.3g} %" if np.isfinite(relative_error) else "-"


def _within_error_text(channel_comparison: ChannelComparison) -> str:
    """Text if the rms error lies within the error that the run states; else ""."""
    return (
        f"; rms within the run's own error of {channel_comparison.stated:.2g}"
        if channel_comparison.rms <= channel_comparison.stated
        else ""
    )


def is_run_against_measurement(run_path: Path, measurement_path: Path) -> bool:
    """Whether the two paths are a run (a saved result or a folder) and a file of measurements, in this order."""
    return (
        (run_path.is_dir() or run_path.suffix == ".nc")
        and not measurement_path.is_dir()
        and measurement_path.suffix != ".nc"
        and is_measurement(measurement_path)
    )


def overlay_of_run(
    saved_run: Result, measurement_path: str | Path, time_shift_seconds: float | None = None
) -> MeasurementOverlay:
    """Compare a measurement with a run channel by channel, largest relative error first.

    Headers are ``name [unit]``, names those of the run's channels; units are converted. A run of several engines has a
    channel of each under a name. time_shift_seconds : s, what the measurement's clock shows at the run's time 0; sought
    where None. Raises InputError for a file without any channel of the run, and for a unit that does not fit.
    """
    timed = (
        (name, quantity)
        for name, quantity in channels_of(saved_run.data)
        if quantity.grid_name == TIME_AXIS and len(quantity.grid) > 3
    )
    ours = {name: quantity for name, quantity in timed if np.isfinite(quantity.values).all()}
    if not ours:
        raise InputError("compare", "", None, "the run has no channels over time: a measurement cannot lie over it")
    source = open_source(measurement_path)
    engines = (
        [str(engine) for engine in saved_run.data.coords["engine"].values] if "engine" in saved_run.data.coords else []
    )
    named = {
        name: channel for channel in source.channels for name in _matching_run_channels(channel.name, engines, ours)
    }
    if not named:
        theirs = [channel.name for channel in source.channels]
        name = next((other for other in theirs if suggestion_phrase(other, tuple(ours))), theirs[0] if theirs else None)
        raise InputError(measurement_path, "", name, "no channel has the name of one of the run", tuple(ours))
    doubts = list[str]()
    pairs = {name: _channel_pair(source, channel, ours[name], doubts) for name, channel in named.items()}
    moved_by = time_shift(list(pairs.values())) if time_shift_seconds is None else TimeShift(time_shift_seconds, np.nan)
    matches = [
        _compared_channel(name, pair, ours[name].unit, moved_by.seconds, saved_run) for name, pair in pairs.items()
    ]
    complete = [match for match in matches if match is not None]
    if not complete:
        raise InputError(
            measurement_path, "time", moved_by.seconds, "at this time shift (s) no sample lies within the run"
        )
    notes = [*_missing_channel_notes(source, ours, engines), *dict.fromkeys(doubts)]
    return MeasurementOverlay(moved_by, sorted(complete, key=lambda channel_match: -channel_match.relative), notes)


def _matching_run_channels(name: str, engines: list[str], run_quantities: Mapping[str, ResultQuantity]) -> list[str]:
    """Names of the run's channels to compare with a measured channel: its own name, or this name followed by the name
    of an engine."""
    if name in run_quantities:
        return [name]
    return [
        channel_name for channel_name in (f"{name}, {engine}" for engine in engines) if channel_name in run_quantities
    ]


def _missing_channel_notes(
    measurement_source: MeasurementSource, run_quantities: Mapping[str, ResultQuantity], engines: list[str]
) -> Iterator[str]:
    """Yield a note on each measured channel that the run does not have, with the most similar name of the run."""
    for channel in measurement_source.channels:
        if not _matching_run_channels(channel.name, engines, run_quantities):
            yield (
                f"not compared: {channel.name!r} is no channel of the "
                f"run{suggestion_phrase(channel.name, tuple(run_quantities))}"
            )


def _channel_pair(
    measurement_source: MeasurementSource,
    measured_channel: FileChannel,
    run_quantity: ResultQuantity,
    doubts: list[str],
) -> ChannelPair:
    """Times and values of a channel in the run and in the measurement, both in the run's unit; doubts about the
    measured times are appended to ``doubts``.
    """
    if not measured_channel.unit and run_quantity.unit not in ("", "-"):
        allowed = f"has no unit: write {measured_channel.name} [{run_quantity.unit}] in the header, or its unit there"
        raise InputError(measurement_source.path, measured_channel.name, None, allowed)
    factor = factor_between(measured_channel.unit, run_quantity.unit, measurement_source.path, measured_channel.name)
    blocks = list(measurement_source.blocks([measured_channel.name]))
    sample_times, values = (
        np.concatenate(parts) for parts in zip(*((b.times, b.values[:, 0]) for b in blocks), strict=True)
    )
    if not np.isfinite(values).any():
        raise InputError(
            measurement_source.path, measured_channel.name, None, "has no values: no cell of it holds a number"
        )
    clock = sample_timing(sample_times, str(measurement_source.path), (measured_channel.name,))
    doubts.extend(finding.text for finding in clock.findings)
    return ChannelPair(
        run_quantity.grid,
        run_quantity.values,
        clock.times,
        factor * (values if clock.order is None else values[clock.order]),
    )


def _compared_channel(
    channel_name: str, channel_pair: ChannelPair, channel_unit: str, time_shift_seconds: float, saved_run: Result
) -> ChannelComparison | None:
    """Comparison of a channel at the measured times within the run, at which the run is interpolated by a cubic spline;
    None if no measured time lies within it."""
    from scipy.interpolate import CubicSpline

    times = channel_pair.measured_times - time_shift_seconds
    slack = 1e-9 * (channel_pair.run_times[-1] - channel_pair.run_times[0])
    is_within = (
        np.isfinite(channel_pair.measured_values)
        & (times >= channel_pair.run_times[0] - slack)
        & (times <= channel_pair.run_times[-1] + slack)
    )
    if not is_within.any():
        return None
    read = CubicSpline(channel_pair.run_times, channel_pair.run_values)(times[is_within])
    stated = error_estimates_of(saved_run).get(channel_name.partition(", ")[0])
    return ChannelComparison(
        channel_name,
        channel_unit,
        times[is_within],
        read,
        channel_pair.measured_values[is_within],
        np.nan if stated is None else stated.error,
    )


def saved_results(result_path: Path) -> dict[str, Result]:
    """All saved results in a file or folder, by the name of the file; raises InputError if there are none."""
    if not result_path.exists():
        raise InputError(result_path, "", None, "no such file or folder")
    files = [result_path] if result_path.is_file() else sorted(result_path.rglob("*.nc"))
    if not files:
        raise InputError(result_path, "", None, "holds no saved result (.nc): name the folder of a run")
    return {file.stem: load_result(file) for file in files}


def report(
    run_path: Path, measurement_path: Path, output_folder: Path, time_shift_seconds: float | None = None
) -> dict[str, Any]:
    """Compare a measurement with a run, or with all runs in a folder; saves ``compare.csv`` and figures, and returns
    the summary."""
    overlays = {
        name: overlay_of_run(run, measurement_path, time_shift_seconds) for name, run in saved_results(run_path).items()
    }
    with whole_file(output_folder / "compare.csv") as partial_path, partial_path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("run", *TABLE_HEADINGS))
        for name, overlay in overlays.items():
            for m in overlay.matches:
                writer.writerow((name, m.name, m.unit, m.rms, m.relative, m.peak, m.time_of_peak, m.stated))
    for name, overlay in overlays.items():
        draw_overlay(
            overlay,
            f"{measurement_path.name} over {name}",
            output_folder / (f"compare_{name}.png" if len(overlays) > 1 else "compare.png"),
        )
    table = [line for name, overlay in overlays.items() for line in _overlay_lines(name, overlay, len(overlays))]
    return {
        "scene": f"{measurement_path} over {run_path}",
        "folder": str(output_folder),
        "failed": {},
        "shift": {name: overlay.shift.seconds for name, overlay in overlays.items()},
        "errors of channels": {
            name: {m.name: m.errors_for_json() for m in overlay.matches} for name, overlay in overlays.items()
        },
        "table": table,
        "results": {},
    }


def _overlay_lines(run_name: str, measurement_overlay: MeasurementOverlay, overlay_count: int) -> Sequence[str]:
    return [*([f"  {run_name}"] if overlay_count > 1 else []), *measurement_overlay.lines()]


def draw_overlay(measurement_overlay: MeasurementOverlay, title: str, figure_path: Path) -> None:
    """Save a figure of the channels with the largest relative errors: measurement and run, and below it their
    difference."""
    from models.drawing.figures import BLUE, DARK, VERMILION, add_heading, save, subplots

    shown = measurement_overlay.matches[:SHOWN_CHANNEL_COUNT]
    figure, axes = subplots(2, len(shown), figsize=(3.6 * len(shown) + 1.0, 5.4), sharex="col", squeeze=False)
    for (top, error_axis), match in zip(axes.T, shown, strict=True):
        unit = match.unit or "-"
        top.plot(match.times, match.measured_values, color=DARK, linewidth=1.8, label="measured")
        top.plot(match.times, match.run_values, color=VERMILION, linewidth=1.0, label="run")
        top.set(title=match.name, ylabel=f"{match.name} [{unit}]")
        error_axis.plot(match.times, match.error, color=BLUE)
        error_axis.plot(match.time_of_peak, match.peak, "o", color=BLUE, markersize=5)
        error_axis.set(
            title=f"rms error {match.rms:.3g} {unit}, {_share_text(match.relative)} of its deviation",
            xlabel="time of the run [s]",
        )
        error_axis.set_ylabel(f"run less measurement [{unit}]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    add_heading(figure, f"{title}: {measurement_overlay.shift_sentence().partition(';')[0]}", {})
    save(figure, figure_path)
