"""Comparing results: differences and where they are, other steps and durations, and what cannot be compared."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.result import Result
from models.systems.pitch_plane.run import run as simulate
from studies.command.comparison import compare, compare_runs, comparison_lines
from validation.common.scenes import road_scene


@pytest.fixture(scope="module")
def run():
    return simulate(road_scene(duration=0.1), "reference")


def saved(run, path, **changes):
    """The run with changed channels, in a file."""
    data = run.data.copy(deep=True)
    for name, change in changes.items():
        data[name].values[:] = change(data[name].values)
    type(run)(data).save(path)
    return path


def test_one_changed_value_is_found_with_its_place(run, tmp_path):
    def kick(values):
        return values + np.where(np.arange(len(values)) == 40, 0.25, 0.0)

    found, notes = compare(saved(run, tmp_path / "a.nc"), saved(run, tmp_path / "b.nc", pitch=kick))
    worst = found[0]
    assert (worst.name, worst.unit, worst.largest) == ("pitch", "rad", pytest.approx(0.25, rel=1e-12))
    assert worst.at == pytest.approx(run.times[40]) and worst.rms == pytest.approx(0.25 / len(run.times) ** 0.5)
    assert [each.name for each in found if each.largest > 0] == ["pitch"] and not notes


def test_what_is_no_number_in_one_alone_is_an_infinite_difference(run, tmp_path):
    holed = saved(run, tmp_path / "b.nc", f1=lambda v: np.where(np.arange(len(v)) == 3, np.nan, v))
    found, _ = compare(saved(run, tmp_path / "a.nc"), holed)
    assert found[0].name == "f1" and found[0].largest == np.inf and found[0].at == pytest.approx(run.times[3])
    assert all(each.largest == 0.0 for each in compare(holed, holed)[0])


def test_another_step_is_read_by_a_spline_and_said(run, tmp_path):
    coarse = simulate(road_scene(duration=0.1, step=5e-4), "reference")
    found, _ = compare(saved(run, tmp_path / "a.nc"), saved(coarse, tmp_path / "b.nc"))
    states = {each.name: each for each in found}
    assert states["pitch"].rows_note and states["pitch"].largest < 1e-7  # order 4 and a cubic spline on 0.25 ms
    assert "only from" not in states["pitch"].rows_note


def test_a_shorter_run_is_compared_as_far_as_it_lasts_and_this_is_said(run):
    half = Result(run.data.isel(time=slice(0, len(run.times) // 2 + 1)))
    found, notes = compare_runs(run, half, ("long", "short"))
    told = "\n".join(comparison_lines(found, notes))
    assert "are the same to the last bit" in told and "only from 0 to 0.05 s, the part that both runs have" in told


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ("t [s],x [m]\n0,1\n1,2\n", "t [s],x [mm]\n0,1\n1,2\n", "the other one is in m"),
        ("v,x\n0,1\n1,2\n", "v,x\n0,1\n3,2\n", "at other places .v. than the first$"),
        ("v,x\n0,1\n1e-10,2\n", "v,x\n0,1\n2e-10,2\n", "at other places"),
        ("v,x\n0,1\n1,2\n", "v,x\n0,1\n", "at other places .v. than the first, 1 instead of 2"),
        ("name,x\na,1\nb,2\n", "name,x\nb,1\na,2\n", "other rows than the first, which has 'a' there"),
        ("v,x\n0,1\n", "v,x\n", "has no rows"),
        ("v,x\n0,1\n", "v,x,x\n0,1,2\n", "two columns are called 'x'"),
        ("time [s],x\n0,1\n1,2\n", "time [s],x\n0,1\n2,3\n1,7\n4,6\n", "do not increase"),
        ("time [s],x\n0,1\n1,2\n", "time [s],x\n0,1\n0.5,\n1,2\n2,6\n", "holds what is no number"),
        ("v,x\n0,1\n1,2\n", "v,y\n0,1\n1,2\n", "no quantity in common"),
        ("v,x\n0,1\n1,2\n", "", "not a table of results"),
        ("v,x\n0,1\n1,2\n", "v,x\n0\n", "not a table of results"),
    ],
    ids=str,
)
def test_tables_that_do_not_fit_are_refused(tmp_path, first, second, said):
    for name, text in (("a.csv", first), ("b.csv", second)):
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=said):
        compare(tmp_path / "a.csv", tmp_path / "b.csv")


def test_channels_over_more_than_time_are_compared_by_what_their_places_are_called(tmp_path):
    """Swapped engines, or other speeds, are no equal entries."""
    import xarray as xr

    data = xr.Dataset(
        {"load": (("engine", "speed"), np.arange(6.0).reshape(2, 3), {"units": "N"})},
        {"engine": ["exudyn", "mujoco"], "speed": [5.0, 10.0, 15.0]},
    )
    for name, each in {
        "a": data,
        "swapped": data.isel(engine=[1, 0]),
        "one": data.isel(engine=[0]),
        "kicked": data + 0.5 * ((data.speed == 10.0) & (data.engine == "mujoco")),
        "faster": data.assign_coords(speed=data.speed * 1.5),
    }.items():
        each["load"].attrs["units"] = "N"
        each.to_netcdf(tmp_path / f"{name}.nc", engine="h5netcdf")
    found, notes = compare(tmp_path / "a.nc", tmp_path / "kicked.nc")
    assert [(one.name, one.largest, one.where) for one in found] == [
        ("load, mujoco", 0.5, "speed = 10"),
        ("load, exudyn", 0.0, "speed = 5"),
    ] and not notes
    assert not any(one.largest for one in compare(tmp_path / "a.nc", tmp_path / "swapped.nc")[0])
    found, notes = compare(tmp_path / "a.nc", tmp_path / "one.nc")
    assert len(found) == 1 and "load, mujoco" in notes[0]
    with pytest.raises(InputError, match="at other places"):
        compare(tmp_path / "a.nc", tmp_path / "faster.nc")


def test_of_a_netcdf_and_the_same_table_the_table_is_compared(run, tmp_path):
    """A netCDF of several axes says more than a table beside it, and is compared itself."""
    for name, kick in (("a", 0.0), ("b", 0.5)):
        (tmp_path / name).mkdir()
        data = saved(run, tmp_path / name / "run.nc", pitch=lambda values, kick=kick: values + kick)
        (tmp_path / name / "run.csv").write_text(f"t [s],x [m]\n0,1\n1,{2 + kick}\n")
    found, _ = compare(tmp_path / "a", tmp_path / "b")
    assert [(one.name, one.largest) for one in found] == [("x", 0.5)]
    wide = type(run)(run.data[["pitch"]].expand_dims(engine=["mujoco"]))
    for name in ("a", "b"):
        wide.save(tmp_path / name / data.name)
    assert [one.name for one in compare(tmp_path / "a", tmp_path / "b")[0]] == ["pitch, mujoco"]


def test_what_is_no_pair_of_results_is_refused(run, tmp_path, twinrig, capsys):
    file = saved(run, tmp_path / "a.nc")
    (tmp_path / "b.nc").write_bytes(file.read_bytes()[:1000])
    (tmp_path / "empty").mkdir()
    for other, said in (("b.nc", "not a saved result"), ("empty", "is a folder"), ("c.nc", "no such file")):
        assert twinrig("compare", "a.nc", other) == 2
        assert said in capsys.readouterr().err
    assert twinrig("compare", "empty", "empty") == 2
    assert "empty: holds no results (.nc or .csv): name the folder of a run" in capsys.readouterr().err
    assert not (tmp_path / "results").exists()
    assert twinrig("compare", "a.nc", "a.nc", "--out", "out") == 0
    assert "the same to the last bit" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"command.txt", "compare.csv", "compare.png"}
