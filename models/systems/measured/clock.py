"""Resampling of all mapped channels of all files to common sample times, stored in columns on disk.

The sampling rate is that of the fastest wheel force, unless the scene names a rate. The recording covers the time in
which all wheel forces exist. Files are aligned by their absolute start times if all have one, else their zeros are the
same moment; ``offset`` is added. Channels of a lower or equal rate are interpolated linearly. Channels of a higher rate
are low-passed without phase first. Samples in a gap of more than 1.5 sampling periods of the channel, or outside its
file, are NaN.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding, FindingWeight
from models.core.scene_effects import extended_by_effects
from models.core.whole_files import write_whole
from models.measured.channel import SAMPLES_PER_BLOCK, MeasurementSource
from models.measured.columns import SampleFile
from models.measured.gaps import without_impossible_values
from models.measured.recording import Progress, Recording, report_no_progress
from models.measured.resampling import EQUAL_RATE_RATIO, resample_to
from models.measured.signal import MeasuredSignal
from models.measured.timing import EVEN_CLOCK_DEVIATION_SHARE, SampleTiming, sample_timing
from models.systems.measured.scene import MeasuredScene

COLUMNS_FILE, RAW_COLUMNS_FILE, SOURCES_FILE, ABSURD_VALUES_FILE = (
    "recording.columns",
    "raw.columns",
    "sources.json",
    "no_value.json",
)
FEWEST_SAMPLES = 100
"""Fewest samples of a recording."""
SLOWEST_SPACING = {"force": 0.02, "moment": 0.02, "acceleration": 1.0, "angular rate": 1.0}
"""Longest time (s) between samples at which a channel still shows its quantity; wheel forces vary with up to 25 Hz."""
FASTEST_RATE = 60e3
"""Highest sampling rate (Hz) that is plausible: no amplifier of wheel forces or gyros is faster."""


@dataclass(frozen=True)
class ClockGroup:
    """Mapped signals of a channel group in a file, with their sample times in the common time of the recording.

    The times are corrected for the drift of the file's clock, and shifted.
    """

    source: MeasurementSource
    signals: tuple[MeasuredSignal, ...]
    timing: SampleTiming

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels in the file."""
        return tuple(signal.channel for signal in self.signals)

    def values_in_si(self, file_values: np.ndarray) -> np.ndarray:
        """Converts values (n, signals) of the file to SI units: zero subtracted, times sign and factor."""
        zeros, factors = np.array([(signal.zero, signal.sign * signal.factor) for signal in self.signals]).T
        return (file_values - zeros) * factors


@dataclass(frozen=True)
class ClockGrid:
    """Equally spaced sample times of a recording: start + i period, i < count, in s of the common time."""

    start: float
    period: float
    count: int

    @property
    def times(self) -> np.ndarray:
        """Times (n,) of all samples in s."""
        return self.start + self.period * np.arange(self.count)

    def places(self, times: np.ndarray) -> np.ndarray:
        """Index of the sample nearest to each time (s); it may lie outside the recording."""
        return np.rint((times - self.start) / self.period).astype(np.int64)


def record_on_clock(
    scene: MeasuredScene,
    measurement_files: Sequence[MeasurementSource],
    signals: Sequence[MeasuredSignal],
    hub_names: Sequence[str],
    columns_folder: Path,
    report_progress: Progress = report_no_progress,
) -> Recording:
    """Resample the mapped signals of opened files to common sample times, store them as columns in ``columns_folder``,
    and apply the scene's effects.

    hub_names : places of the wheel forces, which determine the sample times. Columns in the folder from the same files
    are used again. Raises InputError for files that do not overlap in time, or without wheel forces.
    """
    shifts, start, noticed = file_shifts(scene, measurement_files)
    report_progress("reading times", 0.0)
    placing = zip(measurement_files, shifts, (file.drift for file in scene.files), strict=True)
    groups = [each for source, shift, drift in placing for each in _mapped_groups(source, signals, shift, drift)]
    wheel_force_groups = [group for group in groups if any(s.at in hub_names and not s.check for s in group.signals)]
    if not wheel_force_groups:
        needed = "no channel is mapped to a hub: wheel forces are what drives the vehicle"
        raise InputError(scene.file, "files", None, needed)
    grid = _clock_grid(scene, wheel_force_groups)
    noticed += [finding for group in groups for finding in (*_group_findings(group), *_check_cover(scene, group, grid))]
    columns = _recording_columns(columns_folder, scene, signals, measurement_files, grid)
    if columns.done < grid.count:
        absurd = list[Finding]()
        for i, group in enumerate(groups):
            report_progress(f"reading {group.source.path.name}", i / len(groups))
            absurd += (_write_unchanged if _is_on_clock(group, grid) else _write_resampled)(
                group, grid, columns, columns_folder
            )
        _moments_at_hubs(scene, signals, columns)
        (columns_folder / ABSURD_VALUES_FILE).write_text(json.dumps([asdict(finding) for finding in absurd]))
        columns.close(grid.count)
    for row in json.loads((columns_folder / ABSURD_VALUES_FILE).read_text()):  # of this run, or of one that was killed
        noticed.append(Finding(**row | {key: tuple(row[key]) for key in ("signals", "times")}))
    began = start + timedelta(seconds=grid.start) if start else None
    comment = "\n".join(source.comment for source in measurement_files if source.comment)
    findings = [finding for source in measurement_files for finding in source.findings]
    findings += [*noticed, _clock_finding(scene, groups, grid)]
    return extended_by_effects(Recording(tuple(signals), columns, grid.period, began, comment, tuple(findings)), scene)


def _moments_at_hubs(scene: MeasuredScene, signals: Sequence[MeasuredSignal], recording_columns: SampleFile) -> None:
    """Convert moments measured about points above or below hubs to moments about the hubs: (Mx - r Fy, My + r Fx) for a
    point r (m) above the hub.
    """
    for hub, lever in scene.levers.items():
        of_component = {(s.quantity, s.component): s.name for s in signals if s.at == hub and not s.check}
        for axis, across, sign in (("x", "y", -1.0), ("y", "x", 1.0)):
            moment, force = of_component.get(("moment", axis)), of_component.get(("force", across))
            if moment is not None and force is not None:
                values = recording_columns.read(moment) + sign * lever * recording_columns.read(force)
                recording_columns.put((moment,), 0, values[:, None])


def _clock_finding(scene: MeasuredScene, clock_groups: list[ClockGroup], clock_grid: ClockGrid) -> Finding:
    """Returns a finding on how all channels were resampled to the common sample times."""
    groups_by_method: dict[str, list[str]] = {}
    for group in clock_groups:
        faster = group.timing.period < clock_grid.period * (1 - EQUAL_RATE_RATIO)
        method = (
            "as it is"
            if _is_on_clock(group, clock_grid)
            else "filtered without phase"
            if faster
            else "interpolated linearly"
        )
        groups_by_method.setdefault(method, []).append(f"{group.source.path.name} ({group.timing.rate:.6g} Hz)")
    by, rate = "the scene" if scene.clock.rate else "the wheel forces", 1 / clock_grid.period
    told = "; ".join(f"{method}: {', '.join(dict.fromkeys(names))}" for method, names in groups_by_method.items())
    text = f"The clock is that of {by}, {rate:.6g} Hz, {clock_grid.count} samples; {told}."
    return Finding("clock", "note", "recording", text, rate, "Hz")


def file_shifts(
    scene: MeasuredScene, measurement_files: Sequence[MeasurementSource]
) -> tuple[list[float], datetime | None, list[Finding]]:
    """Returns the shift (s) of each file's times, the date at which the common time is 0, and findings on missing start
    times.
    """
    offsets = [file.offset for file in scene.files]
    known = [source.start for source in measurement_files if source.start is not None]
    if len(known) == len(measurement_files):
        first = min(known)
        return [(s - first).total_seconds() + o for s, o in zip(known, offsets, strict=True)], first, []
    several, unsaid = (
        len(measurement_files) > 1,
        ", ".join(source.path.name for source in measurement_files if source.start is None),
    )
    text = f"{unsaid}: no start time is given"
    if several:
        text += ": the zero of every file is taken as the same moment; set offset of [[files]] if it is not"
    return offsets, None, [Finding("start", "doubt" if several else "note", unsaid, f"{text}.")]


def _mapped_groups(
    measurement_file: MeasurementSource, signals: Sequence[MeasuredSignal], clock_shift: float, clock_drift: float
) -> Iterator[ClockGroup]:
    """Yields the channel groups of a file that have mapped channels, with their times in the common time. clock_shift :
    s;
    clock_drift : relative error of the file's clock.
    """
    group_of_channel = {channel.name: channel.group for channel in measurement_file.channels}
    mapped = dict[int, list[MeasuredSignal]]()
    for signal in (signal for signal in signals if signal.file == measurement_file.path.name):
        mapped.setdefault(group_of_channel[signal.channel], []).append(signal)
    for first, *other_signals in mapped.values():
        times = np.concatenate([block.times for block in measurement_file.blocks([first.channel])])
        label = (
            measurement_file.path.name
            if len(set(group_of_channel.values())) == 1
            else f"{measurement_file.path.name}, {first.channel} ..."
        )
        clock = sample_timing(times, label, (first.name,))
        slowed = replace(
            clock, times=clock.times / (1 + clock_drift) + clock_shift, period=clock.period / (1 + clock_drift)
        )
        yield ClockGroup(measurement_file, (first, *other_signals), slowed)


def _group_findings(clock_group: ClockGroup) -> Iterator[Finding]:
    """Yields findings on the sample times of a channel group, for example that they seem to be in another unit."""
    yield from clock_group.timing.findings
    clock, label = (
        clock_group.timing,
        f"{clock_group.source.path.name}, {clock_group.names[0]}{' ...' if len(clock_group.names) > 1 else ''}",
    )
    slowest = min(SLOWEST_SPACING.get(s.quantity, np.inf) for s in clock_group.signals)
    slow = clock.period > slowest
    if not slow and clock.rate < FASTEST_RATE:
        return
    true, written = ("milliseconds", "seconds") if slow else ("seconds", "milliseconds")
    text = (
        f"{label}: the samples lie {clock.period:.4g} s apart ({clock.rate:.4g} Hz) and last for "
        f"{clock.end - clock.times[0]:.4g} s, which is too {'slow' if slow else 'fast'} for "
        f"{clock_group.signals[0].quantity}: "
        f"if its times are in {true}, not in {written}, correct the unit that heads them."
    )
    weight: FindingWeight = "error" if clock.period > 10 * slowest else "doubt"
    yield Finding("times", weight, label, text, clock.period, "s", (clock_group.signals[0].name,))


def _clock_grid(scene: MeasuredScene, wheel_force_groups: list[ClockGroup]) -> ClockGrid:
    """Returns the sample times of the recording. Raises InputError where the wheel forces do not overlap in time, or do
    not allow the settings of [clock].
    """
    settings, file, timings = scene.clock, scene.file, [group.timing for group in wheel_force_groups]
    fastest = min(timings, key=lambda timing: timing.period)
    period = 1.0 / settings.rate if settings.rate else fastest.period
    if period < fastest.period * (1 - EQUAL_RATE_RATIO):
        slower = f"is faster than the wheel forces, {fastest.rate:g} Hz, which adds nothing"
        raise InputError(file, "clock.rate", settings.rate, slower)
    first, last = max(timing.times[0] for timing in timings), min(timing.end for timing in timings)
    if first >= last:
        spans = "; ".join(
            f"{g.source.path.name}: {g.timing.times[0]:.6g} to {g.timing.end:.6g} s" for g in wheel_force_groups
        )
        raise InputError(file, "files", None, f"the wheel forces do not overlap in time ({spans}): set offset")
    times = fastest.times
    start = float(
        times[min(np.searchsorted(times, first + settings.start - EVEN_CLOCK_DEVIATION_SHARE * period), len(times) - 1)]
    )
    end = last if settings.duration is None else min(last, start + settings.duration)
    count = int(np.floor((end - start) / period + EVEN_CLOCK_DEVIATION_SHARE)) + 1
    if settings.duration is not None and start + settings.duration > last + period:
        raise InputError(file, "clock.duration", settings.duration, f"the wheel forces last {last - start:.6g} s")
    if count < FEWEST_SAMPLES:
        few = f"{count} sample(s) of wheel forces are left: at least {FEWEST_SAMPLES} are needed"
        raise InputError(file, "clock", None, few)
    return ClockGrid(start, period, count)


def _check_cover(scene: MeasuredScene, clock_group: ClockGroup, clock_grid: ClockGrid) -> Iterator[Finding]:
    """Yields a finding where a channel group has no data in part of the recording's time. Raises InputError where it
    has none at all.
    """
    begin, end, name = (
        float(clock_group.timing.times[0]),
        clock_grid.start + clock_grid.period * (clock_grid.count - 1),
        clock_group.source.path.name,
    )
    late, early = begin - clock_grid.start, end - clock_group.timing.end
    label = f"{name}: {', '.join(clock_group.names[:3])}{', ...' if len(clock_group.names) > 3 else ''}"
    if max(late, early) >= end - clock_grid.start:
        text = (
            f"{label} lies wholly outside the wheel forces ({clock_grid.start:.6g} to {end:.6g} s): it runs from "
            f"{begin:.6g} to {clock_group.timing.end:.6g} s; set offset"
        )
        raise InputError(scene.file, "files", None, text)
    missing = max(late, 0.0) + max(early, 0.0)
    if missing > 2 * max(clock_grid.period, clock_group.timing.period):
        text = f"{label} covers the recording but for {missing:.4g} s at its ends, where nothing is known of it."
        yield Finding("overlap", "doubt", name, text, missing, "s", (clock_group.signals[0].name,))


def _recording_columns(
    work_folder: Path,
    scene: MeasuredScene,
    signals: Sequence[MeasuredSignal],
    measurement_files: Sequence[MeasurementSource],
    clock_grid: ClockGrid,
) -> SampleFile:
    """Opens the columns of a recording, new or begun earlier from the same files. Raises InputError where the folder
    has columns of other files.
    """
    files = {source.path.name: [(at := source.path.stat()).st_size, at.st_mtime_ns] for source in measurement_files}
    channels = [[s.channel, s.sign, s.factor, s.zero] for s in signals]
    described = {
        "files": files,
        "map": channels,
        "clock": [clock_grid.start, clock_grid.period],
        "levers": scene.levers,
    }
    path = work_folder / SOURCES_FILE
    if path.is_file() and json.loads(path.read_text()) != described:
        raise InputError(path, "", None, "was written from other files or by another map: choose a new folder")
    write_whole(path, json.dumps(described))
    return SampleFile(work_folder / COLUMNS_FILE, tuple(signal.name for signal in signals), clock_grid.count)


def _is_on_clock(clock_group: ClockGroup, clock_grid: ClockGrid) -> bool:
    """Whether a channel group was sampled at the sample times of the recording."""
    clock = clock_group.timing
    indices = clock_grid.places(clock.times)
    inside = (indices >= 0) & (indices < clock_grid.count)
    deviations = np.abs(clock.times[inside] - clock_grid.start - clock_grid.period * indices[inside])
    return (
        clock.order is None
        and abs(clock.period / clock_grid.period - 1) <= EVEN_CLOCK_DEVIATION_SHARE
        and bool((deviations <= EVEN_CLOCK_DEVIATION_SHARE * clock_grid.period).all())
    )


def _write_unchanged(
    clock_group: ClockGroup, clock_grid: ClockGrid, recording_columns: SampleFile, work_folder: Path
) -> list[Finding]:
    """Write a group that was sampled at the recording's sample times into the columns, block by block, NaN in gaps.
    Returns findings on absurd values.
    """
    names, done, absurd = tuple(signal.name for signal in clock_group.signals), 0, list[Finding]()

    def put(last_index: int, sample_indices: np.ndarray, si_values: np.ndarray) -> None:
        """Write the samples up to ``last_index``: SI values at ``sample_indices``, NaN at other samples."""
        for first in range(done, last_index, SAMPLES_PER_BLOCK):
            in_block = (sample_indices >= first) & (sample_indices < min(first + SAMPLES_PER_BLOCK, last_index))
            values = np.full((min(SAMPLES_PER_BLOCK, last_index - first), len(names)), np.nan)
            values[sample_indices[in_block] - first] = si_values[in_block]
            recording_columns.put(names, first, values)

    for block in clock_group.source.blocks(clock_group.names):
        at = clock_grid.places(clock_group.timing.times[block.first : block.first + len(block.values)])
        inside = (at >= done) & (at < clock_grid.count)
        if inside.any():
            last = int(at[inside][-1]) + 1
            put(last, at[inside], clock_group.values_in_si(block.values[inside]))
            done = last
    put(clock_grid.count, np.empty(0, np.int64), np.empty((0, len(names))))
    for signal in clock_group.signals:
        values, finding = without_impossible_values(
            signal, recording_columns.read(signal.name), clock_grid.times - clock_grid.start
        )
        if finding:
            recording_columns.put((signal.name,), 0, values[:, None])
            absurd.append(finding)
    return absurd


def _write_resampled(
    clock_group: ClockGroup, clock_grid: ClockGrid, recording_columns: SampleFile, work_folder: Path
) -> list[Finding]:
    """Resample a group with other sample times into the columns, by a temporary file, signal by signal. Returns
    findings on absurd values.
    """
    clock, absurd = clock_group.timing, list[Finding]()
    count = next(channel.count for channel in clock_group.source.channels if channel.name == clock_group.names[0])
    raw = SampleFile(work_folder / RAW_COLUMNS_FILE, clock_group.names, count)
    for block in clock_group.source.blocks(clock_group.names):
        raw.put(clock_group.names, block.first, clock_group.values_in_si(block.values))
    for signal in clock_group.signals:
        values = raw.read(signal.channel)[slice(None) if clock.order is None else clock.order]
        values, finding = without_impossible_values(signal, values, clock.times - clock_grid.start)
        absurd += [finding] if finding else []
        recording_columns.put(
            (signal.name,), 0, resample_to(clock.times, values, clock.period, clock_grid.times)[:, None]
        )
    raw.remove()
    return absurd
