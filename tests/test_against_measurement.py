"""A measurement laid over a run: names, units, time shift, errors; known shifts and errors are found again."""

import json

import numpy as np
import pytest

import twinrig as library
from models.core.errors import InputError
from models.measured.time_shift import ChannelPair, time_shift
from models.measured.units import factor_between
from models.systems.pitch_plane.run import run as simulate
from studies.command.against_measurement import overlay_of_run
from validation.common.scenes import road_scene

LATE = 3.7183
"""s by which the measurement's clock is ahead."""


@pytest.fixture(scope="module")
def run():
    return simulate(road_scene(duration=2.0), "reference", error=True)


def measured(run, path, names, factors, late=LATE, rate=400.0, begin=0.31, noise=0.0, more=""):
    """A file of channels in other units, by another clock that begins within the run."""
    times = np.arange(begin, 1.7, 1.0 / rate)
    rng = np.random.default_rng(3)
    columns = [times + late]
    for name, factor in zip(names, factors, strict=True):
        values = np.interp(times, run.times, run[name.partition(" [")[0]]) * factor
        columns.append(values + noise * values.std() * rng.normal(size=len(times)))
    head = ",".join(["time [s]", *names, *([more] if more else [])])
    rows = np.column_stack([*columns, *([times] if more else [])])
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.12g")
    return path


def test_names_units_and_time_shift_are_found(run, tmp_path):
    file = measured(run, tmp_path / "m.csv", ["f1 [kN]", "pitch [deg]"], [1e-3, 180.0 / np.pi], more="pich [rad]")
    laid = overlay_of_run(run, file)
    assert laid.shift.seconds == pytest.approx(LATE, abs=2e-5) and laid.shift.correlation > 0.99999
    assert {each.name: each.unit for each in laid.matches} == {"f1": "N", "pitch": "rad"}
    assert all(each.relative < 2e-3 for each in laid.matches)
    assert laid.notes == ["not compared: 'pich' is no channel of the run; did you mean 'pitch'?"]


def test_an_error_is_told_in_size_and_place(run, tmp_path):
    """A gauge that reads 3 % too much: the rms error is 3 % of the rms value; noise of 10 % is told as 10 %."""
    scaled = overlay_of_run(run, measured(run, tmp_path / "a.csv", ["f1 [N]"], [1.03])).matches[0]
    assert scaled.rms == pytest.approx(0.03 / 1.03 * np.sqrt(np.mean(scaled.measured_values**2)), rel=2e-2)
    assert abs(scaled.peak) == pytest.approx(0.03 / 1.03 * np.abs(scaled.measured_values).max(), rel=5e-2)
    noisy = overlay_of_run(run, measured(run, tmp_path / "b.csv", ["f1 [N]"], [1.0], noise=0.1))
    assert noisy.matches[0].relative == pytest.approx(0.1 / np.sqrt(1.01), rel=0.15)
    assert noisy.shift.seconds == pytest.approx(LATE, abs=1e-3)


def test_a_shift_that_is_given_is_taken(run, tmp_path):
    file = measured(run, tmp_path / "m.csv", ["f1 [N]"], [1.0])
    assert overlay_of_run(run, file, LATE).matches[0].relative < 2e-3
    assert overlay_of_run(run, file, LATE + 0.05).matches[0].relative > 0.05
    with pytest.raises(InputError, match="no sample lies within the run"):
        overlay_of_run(run, file, 100.0)


def test_samples_that_are_missing_and_means_do_not_matter():
    times = np.arange(0.0, 10.0, 0.01)
    run = np.sin(2.0 * times) + 0.3 * np.sin(11.3 * times)
    clock = np.arange(2.0, 7.0, 0.013)
    values = 5.0 + 2.0 * np.interp(clock, times, run)
    values[50:90] = np.nan
    found = time_shift(
        [ChannelPair(times, run, clock - 40.0, values), ChannelPair(times, 0.0 * times, clock - 40.0, 0.0 * values)]
    )
    assert found.seconds == pytest.approx(-40.0, abs=1e-3) and found.correlation > 0.9999
    still = time_shift([ChannelPair(times, 0.0 * times, clock, 1.0 + 0.0 * clock)])
    assert still.seconds == 0.0 and np.isnan(still.correlation)


def test_units_are_converted_strictly():
    assert factor_between("g", "m/s^2", "", "") == pytest.approx(9.80665)
    assert factor_between("deg/s", "rad/s", "", "") == pytest.approx(np.pi / 180.0)
    assert factor_between("kN", "N", "", "") == pytest.approx(1e3)
    assert factor_between("%", "-", "", "") == pytest.approx(0.01)
    for unit, wanted in (("kg", "N"), ("furlonk", "m"), ("%", "rad"), ("rpm", "1/s")):
        with pytest.raises(InputError, match="the channel is in"):
            factor_between(unit, wanted, "m.csv", "f1")


def test_what_does_not_fit_is_told(run, tmp_path):
    def told(text):
        (tmp_path / "m.csv").write_text(text)
        with pytest.raises(InputError) as error:
            overlay_of_run(run, tmp_path / "m.csv")
        return str(error.value)

    rows = "\n".join(f"{0.1 * i},{np.sin(i)}" for i in range(20))
    assert "did you mean 'pitch'?" in told(f"time [s],pitsch [rad]\n{rows}\n")
    assert "has no unit: write f1 [N]" in told(f"time [s],f1\n{rows}\n")
    assert "is the unit of another quantity: the channel is in N" in told(f"time [s],f1 [m]\n{rows}\n")
    empty = "\n".join(f"{0.1 * i}," for i in range(20))
    assert "f1: has no values" in told(f"time [s],f1 [N]\n{empty}\n")


def test_times_in_doubt_are_told(run, tmp_path):
    (tmp_path / "m.csv").write_text("time [s],f1 [N]\n0,1\n0,2\n0.02,3\n0.04,1\n0.06,2\n")
    assert any("m.csv" in note and "time" in note for note in overlay_of_run(run, tmp_path / "m.csv").notes)


def test_what_does_not_move_has_no_relative_error(run, tmp_path):
    rows = "\n".join(f"{0.1 * i},4000" for i in range(20))
    (tmp_path / "m.csv").write_text(f"time [s],f1 [N]\n{rows}\n")
    (line,) = [line for line in overlay_of_run(run, tmp_path / "m.csv").lines() if line.startswith("  f1")]
    assert "inf" not in line and line.split()[3] == "-"


def test_command_and_library_say_the_same(run, tmp_path, twinrig, capsys):
    folder = tmp_path / "run"
    folder.mkdir()
    run.save(folder / "reference.nc")
    file = measured(run, tmp_path / "m.csv", ["f1 [kN]"], [1e-3])
    assert twinrig("compare", str(folder), str(file), "--out", "laid", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    report = library.compare(library.read(folder / "reference.nc"), file)
    assert said["shift"]["reference"] == report.values["shift"]
    assert said["errors of channels"]["reference"] == report.values["channels"]
    assert {path.name for path in (tmp_path / "laid").iterdir()} == {"command.txt", "compare.csv", "compare.png"}
    assert "by which the measurement is later" in str(report) and "f1" in str(report)
    assert twinrig("compare", str(folder), str(folder), "--shift", "1") == 2
    assert "--shift" in capsys.readouterr().err
