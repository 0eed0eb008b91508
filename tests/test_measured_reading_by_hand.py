"""Functions that read measured files, by closed forms: bytes and conversions written by hand, clocks, units, gaps, and
the channel map."""

import struct
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from models.measured.channel import FileChannel
from models.measured.checks.spectra import white_noise
from models.measured.columns import SampleFile, SamplesInMemory
from models.measured.faults_of_measurement import SimulatedFaults, measured_samples
from models.measured.formats import open_source
from models.measured.gaps import bridged_signals, filled_samples, without_impossible_values
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, TransducerPlace
from models.measured.timing import sample_timing
from models.measured.units import factor_to_si
from models.systems.measured.channel_map import find_channel, mapped_signals
from models.systems.measured.clock import ClockGrid, ClockGroup, _clock_finding, _clock_grid, file_shifts
from models.systems.measured.holds import noise_deviations, stabilisers_of_runs
from models.systems.measured.plan import opened_files, signals_of_files
from models.systems.measured.run import read_files
from models.systems.measured.scene import NoiseTable, build

pytestmark = pytest.mark.grounds("closed form")
PERIOD = 2e-3
HUBS = ("fl", "fr", "rl", "rr")


def signal_of(name="fl", quantity="force", at="fl", component="z", frame="inertial", sign=1, factor=1.0, zero=0.0):
    """A signal that a file calls as the recording does."""
    return MeasuredSignal(name, "a.csv", name, quantity, at, component, frame, sign, "N", factor, zero=zero)


def recording_of(samples, period=PERIOD):
    """A recording in memory; samples : values (n,) by signal."""
    names = tuple(signal.name for signal in samples)
    return Recording(tuple(samples), SamplesInMemory(names, np.column_stack([*samples.values()])), period)


def test_columns_read_the_doubles_of_their_file(tmp_path):
    columns = SampleFile(tmp_path / "c.bin", ("a", "b"), 4)
    (tmp_path / "c.bin").write_bytes(struct.pack("<8d", *(k + 0.5 for k in range(8))))
    assert columns.read("a").tolist() == [0.5, 1.5, 2.5, 3.5]
    assert columns.read("b", 1, 2).tolist() == [5.5, 6.5]


def test_a_recording_hands_on_the_samples_and_the_signals_that_it_has():
    force, roll = signal_of(factor=4.5, zero=0.25), signal_of("roll", "angle", "body", "roll", factor=0.5)
    recording = recording_of({force: np.array([1.5, -2.5, 3.5, 0.5]), roll: np.full(4, 0.25)}, 0.25)
    assert recording.duration == 0.75
    assert recording.samples(force).tolist() == [1.5, -2.5, 3.5, 0.5]
    assert recording.find_signals("force", "fl", "z") == (force,) and recording.find_signals("angle") == (roll,)


def test_even_times_have_the_period_of_their_clock():
    times = 3.5 + PERIOD * np.arange(500)
    timing = sample_timing(times, "a.csv")
    assert timing.times.tolist() == times.tolist() and timing.order is None
    assert (timing.period, timing.rate) == (pytest.approx(2e-3, rel=1e-9), pytest.approx(500.0, rel=1e-9))
    assert timing.end == pytest.approx(3.5 + 499 * 2e-3, rel=1e-12)


def test_times_of_the_year_2026_whose_steps_are_rounded_have_the_mean_step():
    """Doubles of 1.77e9 s are 2.4e-7 s apart: the steps of 0.3 ms are of two kinds, 0.0003 % beside the mean."""
    timing = sample_timing(1.77e9 + 3e-4 * np.arange(2000), "a.csv")
    assert timing.period == pytest.approx(3e-4, rel=1e-6)


INCH, POUND, GRAVITY, TURN = 0.0254, 0.45359237, 9.80665, 2.0 * np.pi


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("kN", "force", 1e3),
        ("lbf", "force", POUND * GRAVITY),
        ("lbf ft", "moment", POUND * GRAVITY * 12.0 * INCH),
        ("g", "acceleration", GRAVITY),
        ("deg/s", "angular rate", TURN / 360.0),
        ("rpm", "angular rate", TURN / 60.0),
        ("in", "travel", INCH),
    ],
)
def test_units_have_the_factors_of_their_definitions(unit, quantity, factor):
    assert factor_to_si(unit, quantity, "", "") == pytest.approx(factor, rel=1e-12)


def test_whole_numbers_of_an_mdf_file_become_values_by_its_line(tmp_path):
    """Counts k with the conversion 0.25 k - 3.0 kN."""
    asammdf = pytest.importorskip("asammdf")
    times, counts, file = 0.5 + PERIOD * np.arange(50), np.arange(50, dtype=np.uint16), asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(counts, times, name="fz", unit="kN", conversion={"a": 0.25, "b": -3.0})])
    file.save(tmp_path / "a.mf4")
    source = open_source(tmp_path / "a.mf4")
    (channel,), (block,) = source.channels, source.blocks(["fz"])
    assert (channel.unit, channel.count, channel.resolution) == ("kN", 50, 0.25)
    assert block.values[:, 0] == pytest.approx(0.25 * np.arange(50) - 3.0, rel=1e-12)
    assert block.times == pytest.approx(times, rel=1e-12)


def sine_with_a_gap():
    """A sine of 10 Hz about 3.5 and which of its samples are lost."""
    lost = np.zeros(4000, bool)
    lost[2000:2005] = True
    return 3.5 + np.sin(TURN * 10.0 * PERIOD * np.arange(4000)), lost


def test_a_gap_of_a_sine_is_filled_by_the_sine_and_all_else_stays():
    """The autocovariance of a finite record is a little too small at long lags: 3e-3 of the amplitude."""
    values, lost = sine_with_a_gap()
    filled, (gap,) = filled_samples(np.where(lost, np.nan, values), PERIOD, 0.03)
    assert filled[~lost].tolist() == values[~lost].tolist() and (gap.first, gap.end) == (2000, 2005)
    assert filled[lost] == pytest.approx(values[lost], abs=3e-3)


def test_a_bridged_signal_tells_the_length_of_its_gap():
    values, lost = sine_with_a_gap()
    force = signal_of()
    bridged, (gap,), (finding,) = bridged_signals(recording_of({force: np.where(lost, np.nan, values)}), force)
    assert bridged[~lost].tolist() == values[~lost].tolist() and (gap.first, gap.end) == (2000, 2005)
    assert finding.size == pytest.approx(5 * PERIOD) and finding.times == pytest.approx((2000 * PERIOD, 2005 * PERIOD))


def test_marks_for_no_value_are_taken_out_and_all_else_stays():
    values, times = np.array([1.5, 9.9e34, 2.5, 9.9e34, 3.5]), 0.25 * np.arange(5) + 0.5
    kept, finding = without_impossible_values(signal_of(), values, times)
    assert np.flatnonzero(np.isnan(kept)).tolist() == [1, 3] and kept[::2].tolist() == [1.5, 2.5, 3.5]
    assert (finding.size, finding.times) == (2.0, (0.75, 1.25))


def test_noise_of_an_impulse_is_that_of_its_flat_spectrum():
    """A at sample k of 1024, times the window's sine square: every line above the lowest has its power. The median of
    exponential noise is log 2 of the mean."""
    count, k, size = 1024, 300, 2.5
    angle, force = np.pi * (k + 1) / (count + 1), signal_of()
    window, squares = np.sin(angle) ** 2, 3.0 / 8.0 * (count + 1)
    expected = size * window / np.sqrt(np.log(2.0) * squares)
    impulse = size * (np.arange(count) == k)
    assert white_noise(recording_of({force: impulse}), force) == pytest.approx(expected, rel=1e-6)


def test_noise_that_is_added_has_the_deviation_of_its_fault():
    """Within 4 deviations, 0.45 %, of the deviation of 400,000 numbers."""
    faults = SimulatedFaults(noise={"force": 2.0}, gain={"fl": 0.25})
    samples = measured_samples(faults, (signal_of(),), np.zeros((400_000, 1)), 1e-3, 1, 7)
    assert samples.std() == pytest.approx(2.0, rel=0.0045)
    assert (
        measured_samples(SimulatedFaults(gain={"fl": 0.25}), (signal_of(),), np.full((9, 1), 2.0), 1e-3, 1, 7)[4, 0]
        == 2.5
    )


def mapped(channel, at, quantity="force", component="z", **more):
    """A row of a channel map."""
    return {"channel": channel, "at": at, "quantity": quantity, "component": component, **more}


def scene_of(folder: Path, *files, **tables):
    """A scene of the shipped car that reads these files, free."""
    table = {"title": "t", "system": "measured", "vehicle": {"file": "r19_free"}, "files": list(files)}
    return build({**table, "stabilise": {"method": "none"}, **tables}, "scene.toml", folder)


CHANNEL = FileChannel("fl", "kN", "", 0, 10, 0.0625, 0.5)
SOURCE = SimpleNamespace(path=Path("a.csv"), channels=(CHANNEL, FileChannel("fr", "kN", "", 0, 10, 0.0625, 0.25)))


def test_a_channel_is_found_as_its_file_has_it():
    assert find_channel(SOURCE, "fl", "s.toml", "files") == CHANNEL


def test_signals_of_the_map_have_the_zero_of_the_scene_and_the_factor_of_the_unit(tmp_path):
    scene = scene_of(tmp_path, {"file": "a.csv", "channels": [mapped("fl", "fl", zero=0.25, sign=-1)]})
    (signal,) = mapped_signals(scene, [SOURCE], scene.rig().places)
    assert (signal.factor, signal.zero, signal.sign, signal.frame) == (1e3, 0.25, -1, "hub")


def test_places_of_sensors_are_those_of_the_scene(tmp_path):
    sensors = {"dash": {"body": "body", "position": [0.5, -0.25, 0.75]}}
    scene = scene_of(tmp_path, {"file": "a.csv", "channels": [mapped("fl", "fl")]}, sensors=sensors)
    assert scene.places == {"dash": TransducerPlace("body", (0.5, -0.25, 0.75))}


def timing_of(start=0.0, period=PERIOD, count=501):
    """An even clock."""
    return sample_timing(start + period * np.arange(count), "a.csv")


def group_of(timing, *signals):
    """A group of channels of the file a.csv."""
    return ClockGroup(SimpleNamespace(path=Path("a.csv")), signals, timing)


def test_a_clock_s_times_and_values_in_si_units():
    assert ClockGrid(2.5, 0.25, 4).times.tolist() == [2.5, 2.75, 3.0, 3.25]
    group = group_of(timing_of(), signal_of(sign=-1, factor=1e3, zero=0.25), signal_of("fr", factor=0.5, zero=-1.0))
    assert group.values_in_si(np.array([[0.75, 2.0], [0.25, -1.0]])).tolist() == [[-500.0, 1.5], [0.0, 0.0]]


def test_the_clock_is_that_of_the_forces_from_the_moment_that_the_scene_names(tmp_path):
    """Forces from 0.1 s and 0.2 s on, of which 0.2 s are left out and 0.4 s are taken."""
    settings = {"start": 0.2, "duration": 0.4}
    scene = scene_of(tmp_path, {"file": "a.csv", "channels": [mapped("fl", "fl")]}, clock=settings)
    groups = [group_of(timing_of(start), signal_of()) for start in (0.1, 0.2)]
    grid = _clock_grid(scene, groups)
    assert (grid.start, grid.period, grid.count) == (pytest.approx(0.4), pytest.approx(2e-3), 201)
    finding = _clock_finding(scene, groups, grid)
    assert finding.size == pytest.approx(500.0) and "500 Hz, 201 samples" in finding.text


def test_files_are_shifted_by_their_starts_and_offsets(tmp_path):
    files = [
        {"file": name, "offset": offset, "channels": [mapped("fl", "fl")]}
        for name, offset in (("a.csv", 0.25), ("b.csv", -0.5))
    ]
    scene, noon = scene_of(tmp_path, *files), datetime(2026, 1, 5, 12, tzinfo=UTC)
    sources = [SimpleNamespace(path=Path("a.csv"), start=noon + timedelta(seconds=after)) for after in (1.5, 0.0)]
    shifts, start, findings = file_shifts(scene, sources)
    assert (shifts, start, findings) == ([1.75, -0.5], noon, [])


def write_forces(folder: Path, times, **columns):
    """A CSV file of times (s) and columns, each NAME__UNIT."""
    head = ",".join(f"{name.replace('__', ' [')}]" for name in columns)
    rows = "\n".join(",".join(f"{value:.15g}" for value in row) for row in np.column_stack([times, *columns.values()]))
    (folder / "a.csv").write_text(f"time [s],{head}\n{rows}\n")
    return "a.csv"


def test_a_file_is_read_onto_its_clock_in_si_units_about_the_hubs(tmp_path):
    """Moments about a point 0.25 m above the hub: Mx - r Fy."""
    times = 0.5 + PERIOD * np.arange(301)
    ramp, columns = np.arange(301) / 128.0, {f"{hub}__kN": np.full(301, 4.5) for hub in HUBS}
    file = write_forces(tmp_path, times, **columns | {"fl__kN": 0.25 - ramp, "fy__N": 8.0 * ramp, "mx__kNm": ramp})
    rows = [mapped("fl", "fl", zero=0.25, sign=-1), *(mapped(hub, hub) for hub in HUBS[1:])]
    rows += [mapped("fy", "fl", component="y"), mapped("mx", "fl", "moment", "x")]
    scene = scene_of(tmp_path, {"file": file, "channels": rows}, levers={"fl": 0.25})
    sources = opened_files(scene)
    (block,) = sources[0].blocks(["fl", "fr"])
    assert block.times == pytest.approx(times, rel=1e-12) and block.values[:, 1] == pytest.approx(np.full(301, 4.5))
    signals = signals_of_files(scene, sources, scene.rig())
    assert [(signal.factor, signal.zero) for signal in signals] == [
        (1e3, 0.25),
        *3 * [(1e3, 0.0)],
        (1.0, 0.0),
        (1e3, 0.0),
    ]
    (tmp_path / "work").mkdir()
    recording = read_files(scene, tmp_path / "work")
    assert recording.signals == signals and (recording.period, recording.count) == (pytest.approx(PERIOD), 301)
    vertical, *_, lateral, moment = (recording.samples(signal) for signal in signals)
    assert vertical == pytest.approx(1e3 * ramp, abs=1e-9) and lateral == pytest.approx(8.0 * ramp, abs=1e-9)
    assert moment == pytest.approx(1e3 * ramp - 0.25 * 8.0 * ramp, abs=1e-9)


def test_deviations_of_a_hold_are_stated_or_estimated_or_at_least_those_of_transducers(tmp_path):
    """An impulse of 1 MN has more noise than 8 N, that of the pitch rate less than 5e-3 rad/s; no angle is there."""
    impulse, window = (np.arange(1024) == 511).astype(float), np.sin(np.pi * 512 / 1025) ** 2
    estimated = 1e6 * window / np.sqrt(np.log(2.0) * 3.0 / 8.0 * 1025)
    rate = signal_of("pitch", "angular rate", "body", "pitch")
    recording = recording_of({signal_of(): 1e6 * impulse, rate: 1e-3 * impulse})
    expected = {"force": pytest.approx(estimated, rel=1e-6), "moment": 2.5, "angle": 1.75e-3, "rate": 5e-3}
    assert noise_deviations(NoiseTable(moment=2.5), recording) == expected
    stabilise = {"method": "kalman", "bandwidth": 0.75, "model": 12.5, "smoothing": 6.5}
    stated = {"force": 12.5, "moment": 2.5, "angle": 0.25, "rate": 0.5}
    file = {"file": "a.csv", "channels": [mapped("fl", "fl")]}
    scene = scene_of(tmp_path, file, stabilise=stabilise, noise=stated)
    free, held = stabilisers_of_runs(scene, recording).values()
    assert [vars(held)[key] for key in stabilise | stated] == [*stabilise.values(), *stated.values()]
    assert (free.method, {key: vars(free)[key] for key in stated}) == ("none", stated)
