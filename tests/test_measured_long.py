"""Long recordings: blocks, interruptions, other inputs, gaps, failures, counting, check channels, files."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from rainflow import extract_cycles

from models.core.errors import InputError, RunFailed
from models.core.signals import SampledSignal
from models.fatigue.counting import counted_load
from models.fatigue.damage import turning_points
from models.fatigue.rainflow_cycles import rainflow_cycles
from models.measured.columns import SampleFile
from models.measured.recording import Recording
from models.systems.hub_forces.tilt_filter import StatedDeviations, TiltFilter
from models.systems.measured.hand_on import write_section_forces
from models.systems.measured.inputs import RecordingInputs, StepGrid
from models.systems.measured.section_run import AttitudeHold, Checkpoint, SectionRunSettings, run
from models.systems.measured.sections import AccelerometerPoint, Sections, accelerometer_points
from models.systems.measured.verdict import channels_to_compare, compare_channel
from models.vehicles.cut_vehicle import PITCH, ROLL
from validation.cases import measured_long as case
from validation.measured.long_recording import (
    computed_channel_bytes,
    long_recording,
    repeated_pattern,
    run_killed_process,
    section_run_of_recording,
)
from validation.spatial.cars import r19

SECONDS = 0.2


def test_the_quick_share_passes(tmp_path):
    rows, _ = case.measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A short run in one piece."""
    folder = tmp_path_factory.mktemp("whole")
    own = section_run_of_recording(folder, SECONDS, case.PATTERN_SECONDS)
    return own, run(own, folder / "run"), computed_channel_bytes(folder)


def changed(own: SectionRunSettings, folder, change) -> SectionRunSettings:
    """The run of a recording whose samples (n, signals) are changed."""
    values = own.recording.columns.block(own.recording.columns.names, 0, own.recording.count)
    columns = SampleFile(folder / "changed.f64", own.recording.columns.names, own.recording.count)
    columns.write(0, change(values))
    return replace(own, recording=replace(own.recording, columns=columns))


class Killed(BaseException):
    """Nobody catches it."""


@pytest.mark.parametrize("moment", ["save", "write", "between"])
@pytest.mark.parametrize("time", [1, 3])
def test_killed_at_any_moment_it_goes_on_to_the_same_bits(whole, tmp_path, monkeypatch, moment, time):
    own, _, bits = whole
    calls, save, write = [0], Checkpoint.save, SampleFile.write

    def now(at):
        calls[0] += at == moment
        return at == moment and calls[0] > time  # the first call of save is that of the start

    def saved(self, **arrays):
        if now("save"):
            self.path.with_suffix(".part").write_bytes(b"half")
            raise Killed
        save(self, **arrays)
        if now("between"):
            raise Killed

    def written(self, first, values):
        if now("write"):
            write(self, first, values[: len(values) // 2])
            raise Killed
        write(self, first, values)

    with monkeypatch.context() as patch:
        patch.setattr(Checkpoint, "save", saved)
        patch.setattr(SampleFile, "write", written)
        with pytest.raises(Killed):
            run(own, tmp_path / "run", block_duration=0.04)
    told = list[float]()
    found = run(own, tmp_path / "run", lambda done, of: told.append(done), block_duration=0.05)
    assert computed_channel_bytes(tmp_path) == bits and found.done == own.count
    assert told[0] > 0.0 or time == 1  # it did not begin anew
    assert told[-1] == pytest.approx(SECONDS, abs=2e-3)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda own: replace(own, hold=AttitudeHold("none")), "another stabiliser"),
        (lambda own: replace(own, engine="exudyn"), "another engine"),
        (lambda own: replace(own, step=5e-4), "another step"),
        (lambda own: replace(own, sections=Sections(own.vehicle)), "another list of sections"),
        (lambda own: replace(own, vehicle=replace(own.vehicle, loads=own.vehicle.loads * 2)), "another vehicle"),
    ],
)
def test_results_of_other_inputs_are_not_mixed(whole, change, told):
    own, found, bits = whole
    with pytest.raises(InputError, match=told):
        run(change(own), found.columns.path.parent)
    assert found.columns.path.read_bytes() == bits


def test_one_changed_sample_is_another_recording(whole, tmp_path):
    own, found, _ = whole
    other = changed(own, tmp_path, lambda values: values + 1e-9 * np.eye(*values.shape))
    with pytest.raises(InputError, match="another recording"):
        run(other, found.columns.path.parent)


@pytest.mark.parametrize("size", [200.0, 1e9])
def test_a_vehicle_that_topples_ends_with_the_time_and_what_there_was(whole, tmp_path, size):
    own, _, _ = whole
    names = [signal.name for signal in own.recording.signals]

    def pushed(values):
        values[100:, names.index("fl_mx")] += size * 1e3  # 200 kN m about x: 700 rad/s^2, over after 0.06 s
        return values

    with pytest.raises(RunFailed, match=r"topples|infinite|gave up") as error:
        run(replace(changed(own, tmp_path, pushed), hold=AttitudeHold("none")), tmp_path / "run", block_duration=0.03)
    assert error.value.time is not None and 0.097 <= error.value.time <= SECONDS  # the cubic begins a sample earlier
    assert 98 <= error.value.partial.done <= 201
    assert np.isfinite(error.value.partial.samples(error.value.partial.answers[0])).all()


def gap(own, folder, name, first, last):
    names = [signal.name for signal in own.recording.signals]

    def silent(values):
        values[first:last, names.index(name)] = np.nan
        return values

    return changed(own, folder, silent)


def test_short_gaps_of_forces_are_bridged_and_told_and_long_ones_refused(whole, tmp_path):
    own, _, _ = whole
    with pytest.raises(InputError, match=r"fl_fz.*silent from 0.02 s to 0.17 s"):
        run(gap(own, tmp_path, "fl_fz", 20, 170), tmp_path / "run")
    (tmp_path / "changed.json").unlink()
    other = gap(own, tmp_path, "rr_fz", 70, 110)  # across the blocks' border at 0.09 s
    outcome = run(other, tmp_path / "run", block_duration=0.03)
    assert [(one.place, one.weight, one.size) for one in outcome.findings] == [("rr_fz", "doubt", pytest.approx(0.04))]
    column = RecordingInputs(other.recording, own.vehicle).wrenches(0, 201)[:, 20]
    assert np.isfinite(column).all() and np.ptp(column[70:110]) <= 2 * np.ptp(column)
    parts = np.concatenate(
        [RecordingInputs(other.recording, own.vehicle).wrenches(i, 30)[:, 20] for i in range(0, 201, 30)]
    )
    assert np.array_equal(parts, column)


def test_rows_are_linear_between_samples_and_gyros_become_rates_of_angles(whole):
    own, _, _ = whole
    values = np.random.default_rng(1).normal(size=(50, 3))
    for step in (1e-3, 5e-4, 2e-3, 2.5e-4):
        count = round(49e-3 / step * 2) + 1 - (step == 2e-3)
        expected = SampledSignal(values, 1e-3, held=False).sample(0.0, step / 2, count)
        assert StepGrid(step, 1e-3).rows(values, count) == pytest.approx(expected, abs=1e-12)
    with pytest.raises(InputError, match="part or a multiple"):
        StepGrid(3e-4, 1e-3).check()
    signals, true = repeated_pattern(case.PATTERN_SECONDS)
    names = [signal.name for signal in signals]
    angles = true[:, [names.index("roll"), names.index("pitch")]]
    made = np.cumsum(RecordingInputs(own.recording, own.vehicle).tilt(0, 201)[:, 2:], axis=0)
    assert own.recording.find_signals("angular rate", component="roll")[0].frame == "body"
    assert np.abs(made[-1] * 1e-3 - (angles[200] - angles[0])).max() < 5e-4  # noise of 5e-3 rad/s, 200 samples: 7e-5


def test_the_filter_is_filterpys_and_leaves_gaps_to_the_prediction():
    car, rng, dt = r19(), np.random.default_rng(2), 1e-3
    wrenches, angles = rng.normal(0, 20, (300, 24)), rng.normal(0, 1e-3, (300, 4))
    own = TiltFilter(car, "hub", dt, StatedDeviations(np.full(24, 8.0), (1e-3, 1e-3), 1.0))
    kalman = KalmanFilter(dim_x=4, dim_z=4, dim_u=2)
    kalman.F, kalman.H, kalman.Q = np.eye(4) + dt * np.eye(4, k=2), np.eye(4), own.noise.process
    kalman.R = 1e-6 * np.eye(4)
    kalman.B, kalman.x, kalman.P = np.vstack([np.eye(2) * dt**2 / 2, np.eye(2) * dt]), angles[:1].T.copy(), kalman.R
    turning = own.rigid.moments(wrenches) @ own.inverse.T
    expected = [kalman.x[:, 0].copy()]
    for i in range(1, 300):
        kalman.predict(u=turning[i - 1][:, None])
        kalman.update(angles[i] if not 100 <= i < 150 else None)
        expected.append(kalman.x[:, 0].copy())
    angles[100:150] = np.nan
    parts = [own.advance(wrenches[i : i + 61], angles[i : i + 61])[0][bool(i) :] for i in range(0, 300, 60)]
    assert np.vstack(parts)[:300] == pytest.approx(np.array(expected), abs=1e-12)


def test_rainflow_counts_as_the_library_does():
    rng = np.random.default_rng(3)
    for k in range(60):
        load = rng.integers(-5, 6, rng.integers(1, 60)).astype(float) if k % 2 else rng.normal(size=40)
        turns = turning_points(load)
        found = np.column_stack(rainflow_cycles(turns))
        expected = [(span, mean, part) for span, mean, part, *_ in extract_cycles([*turns, turns[-1]])]
        assert found == pytest.approx(np.array(expected).reshape(-1, 3))
    with pytest.raises(InputError, match="not finite"):
        counted_load(np.array([0.0, np.nan]))


def test_a_check_channel_with_a_wrong_gain_shows_it(whole):
    own, outcome, _ = whole
    signal, answer = next(pair for pair in channels_to_compare(own) if pair[0].name == "front left_force")
    true = outcome.samples(answer)
    names = own.recording.columns.names
    columns = SampleFile(outcome.columns.path.with_name("gain.f64"), names, own.recording.count)
    values = own.recording.columns.block(names, 0, own.recording.count)
    values[:, names.index(signal.name)] = true / 1.1
    columns.write(0, values)
    found = compare_channel(Recording(own.recording.signals, columns, own.recording.period), outcome, signal, answer)
    assert found.damage == pytest.approx({slope: 1.1**slope for slope in (3.0, 5.0, 8.0)})
    assert [band.error / band.measured for band in found.bands] == pytest.approx([0.1] * len(found.bands))
    assert found.explained_variance == pytest.approx(0.99) and found.trusted_time == np.inf
    assert found.offset == pytest.approx(np.mean(true) * (1 - 1 / 1.1))


def test_sections_are_named_and_their_files_are_not_overwritten(whole, tmp_path):
    own, outcome, _ = whole
    assert {"front left F", "fl guide Fy", "fl hub Mz", "front bar M"} <= {answer.name for answer in outcome.answers}
    assert "fl guide Fz" not in {answer.name for answer in outcome.answers}  # it slides there
    with pytest.raises(InputError, match="did you mean 'front left'"):
        Sections(own.vehicle, wanted=("frontleft",))
    kept = Sections(own.vehicle, wanted=("front left", "fl guide")).answers
    assert {answer.section for answer in kept} == {"", "front left", "fl guide"}
    write_section_forces(outcome, tmp_path, ["csv"], outcome.answers[:2])
    with pytest.raises(InputError, match="exists"):
        write_section_forces(outcome, tmp_path, ["csv"], outcome.answers[:2])


def test_accelerometers_feel_gravity_and_motion(whole):
    own, outcome, _ = whole
    signals = tuple(
        replace(s, at="engine", gravity=False) for s in own.recording.find_signals("acceleration", "acc fl")
    )
    assert accelerometer_points(own.vehicle, signals, {}) == (
        AccelerometerPoint("engine", "engine", (0.95, 0.0, 0.55), gravity=False),
    )
    for name in ("acc fl_ax", "acc roof_az"):
        signal = next(s for s in own.recording.signals if s.name == name)
        answer = next(a for a in outcome.answers if a.measures(signal))
        off = outcome.samples(answer)[50:] - own.recording.samples(signal)[50:]
        assert np.abs(off).max() < 0.2  # noise of 0.01 m/s^2, of 8 N on 60 kg, and the stabiliser's start


def test_a_start_on_a_slope_is_the_measured_one(whole, tmp_path):
    own, _, _ = whole
    names = [signal.name for signal in own.recording.signals]
    tilted = changed(own, tmp_path, lambda values: values + 0.05 * np.eye(len(names))[names.index("roll")])
    outcome = run(tilted, tmp_path / "run")
    roll = outcome.samples(next(a for a in outcome.answers if a.name == "body roll"))
    assert np.abs(roll - 0.05).max() < 0.01 and PITCH != ROLL


@pytest.mark.full
def test_an_hour_at_1_khz_in_less_than_2_gb_killed_and_gone_on_to_the_same_bits(tmp_path):
    bits = []
    for times in (0, 3):
        folder = tmp_path / str(times)
        folder.mkdir()
        long_recording(3600.0, folder / "recording.f64")
        if times:
            run_killed_process(folder, 3600.0, 20.0, 60.0, times, kill_window=60.0)
        else:
            command = [sys.executable, "-m", "validation.measured.long_recording", str(folder), "3600", "20", "60"]
            told = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
            assert len(told) == 61 and float(told[-1].split()[1]) < 2e9
        bits.append(np.memmap(folder / "run" / "run.f64", np.int64, "r"))
    assert np.array_equal(bits[0], bits[1])
