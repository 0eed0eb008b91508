"""Results: labelled, with units, saved whole, and enough in them to run the scene again."""

import json

import numpy as np
import pytest
import xarray as xr

from models.core.errors import InputError
from models.core.result import Result, load_result
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build

STUDY = {"road": {"source": "study", "speed": 15.0}}
ROAD = {"title": "test", "run": {"duration": 0.5, "step": 1e-3}, "effects": STUDY}


def test_every_channel_has_unit_and_meaning(tmp_path):
    result = simulate(build(ROAD), "reference")
    result.save(tmp_path / "run.nc")
    back = load_result(tmp_path / "run.nc")
    for channel in back.data.data_vars.values():
        assert channel.attrs["units"] and channel.attrs["long_name"]
    assert np.array_equal(back.states, result.states)
    assert list(tmp_path.iterdir()) == [tmp_path / "run.nc"]


def test_two_runs_leave_the_same_bytes(tmp_path):
    """Seconds differ by nature: they are told, not saved."""
    for name in ("a.nc", "b.nc"):
        result = simulate(build(ROAD), "reference")
        assert result.data.attrs["seconds"] > 0.0
        result.save(tmp_path / name)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    assert "seconds" not in load_result(tmp_path / "a.nc").data.attrs


def test_the_saved_scene_gives_the_same_numbers(tmp_path):
    first = simulate(build(ROAD), "mujoco")
    table = json.loads(first.data.attrs["scene_table"])
    again = simulate(build(table), "mujoco")
    assert np.array_equal(first.states, again.states)


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_a_run_repeats_bit_for_bit(engine):
    assert np.array_equal(simulate(build(ROAD), engine).states, simulate(build(ROAD), engine).states)


def test_output_step_thins_the_rows():
    whole = simulate(build(ROAD), "exudyn")
    thin = simulate(build(ROAD | {"run": {"duration": 0.5, "step": 1e-3, "output_step": 0.01}}), "exudyn")
    assert len(thin.times) == 51 and np.array_equal(thin.states, whole.states[::10])


def test_wheel_forces_carry_the_vehicle_on_average():
    """Over a road the mean of f1 + f2 is the weight, but for the change of momentum."""
    y = simulate(build(ROAD | {"run": {"duration": 4.0, "step": 1e-3}}), "reference")
    momentum = 750 * y["z3_rate"] + 15 * (y["z1_rate"] + y["z2_rate"])
    impulse = np.trapezoid(780 * 9.81 - y["f1"] - y["f2"], y.times)
    # trapezoid of forces with 40 Hz content at 1 ms
    assert momentum[-1] - momentum[0] == pytest.approx(impulse, abs=0.5)


def test_a_file_that_is_no_result_is_named(tmp_path):
    (tmp_path / "x.nc").write_text("hello")
    with pytest.raises(InputError, match="not a saved result"):
        load_result(tmp_path / "x.nc")


def test_a_result_with_one_bit_flipped_is_refused(tmp_path):
    """Every so often among the numbers: nothing that was changed is read."""
    data = xr.Dataset({"z1": ("time", np.linspace(1.0, 2.0, 64))}, {"time": ("time", np.arange(64.0))})
    Result(data).save(tmp_path / "x.nc")
    whole = (tmp_path / "x.nc").read_bytes()
    for name in ("z1", "time"):
        begin = whole.index(data[name].values.tobytes())
        for place in range(begin, begin + 512, 101):
            (tmp_path / "x.nc").write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
            with pytest.raises(InputError, match="damaged"):
                load_result(tmp_path / "x.nc")


def test_headers_that_HDF5_finds_damaged_are_refused_as_well(tmp_path):
    """Many attributes lie in a heap, whose checksum HDF5 reads late and tells as another error."""
    many = {f"a{i}": "words" for i in range(12)}
    Result(xr.Dataset({"z1": ("time", np.zeros(8))}, attrs=many)).save(tmp_path / "x.nc")
    content = bytearray((tmp_path / "x.nc").read_bytes())
    content[content.index(b"FRHP") + 6] ^= 4
    (tmp_path / "x.nc").write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        load_result(tmp_path / "x.nc")
