"""twinrig from Python: every system in three lines, beginner's errors and their remedies, what a result shows."""

import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import twinrig
from models.core.systems import SYSTEMS
from models.systems import run as run_system

matplotlib.use("Agg")

ROOT = Path(__file__).parents[1]

SHORT = {
    "pitch-plane": ("study_road", {"run.duration": 0.1}, {}),
    "handling": ("handling", {"manoeuvres.brake_in_curve.duration": 0.02}, {"manoeuvre": "brake_in_curve"}),
    "single-track": ("single_track", {"drive.stretch": [0.0, 2.0]}, {}),
    "bicycle": ("bicycle", {"run.duration": 0.02}, {}),
    "wheelset": ("wheelset", {"run.duration": 0.02, "contact.law": "linear"}, {"speed": 20.0}),
    "contact": ("contact_ellipse", {"method.cells": 11}, {}),
    "hub-forces": ("hub_forces", {"run.duration": 0.05}, {}),
    "ride": ("ride", {"speeds.count": 2}, {}),
    "wheel-rail": ("manchester", {"positions.count": 2, "positions.stop": 1e-3}, {"case": "A-1"}),
    "measured": ("recording", {"virtual.duration": 0.5, "virtual.format": "csv"}, {}),
    "braking": ("braking", {"procedures.straight.speed": 1.0}, {"procedure": "straight"}),
}
"""A shipped scene of each system, shortened, and what its run takes."""
USUAL = {"handling": "exudyn", "bicycle": "exudyn", "measured": "mujoco", "contact": "", "wheel-rail": ""}
"""Engines that run where none is named, if not the reference."""
HEAVY = ("numpy", "scipy", "numba", "xarray", "pandas", "pydantic", "matplotlib", "mujoco", "exudyn", "typer", "rich")


@pytest.fixture(scope="module")
def scene():
    return twinrig.load("study_road", set={"run.duration": 0.1})


@pytest.fixture(scope="module")
def result(scene):
    return twinrig.run(scene, "mujoco")


def test_every_system_has_a_scene_here():
    assert SHORT.keys() == SYSTEMS.keys()


@pytest.mark.parametrize("system", SHORT)
def test_every_system_runs_in_three_lines(system):
    name, changes, how = SHORT[system]
    loaded = twinrig.load(name, set=changes)
    run = twinrig.run(loaded, error=False, **how)
    said = f"{run}"
    assert loaded.system == system == run.data.attrs["system"] and loaded.title in said
    assert run.data.attrs["engine"] == USUAL.get(system, "reference")
    numeric = [name for name, channel in run.data.data_vars.items() if channel.dtype.kind in "fiu"]
    assert all(f"  {name} " in said or "more: " in said for name in numeric)
    assert np.isfinite(run[numeric[0]]).all()
    axes = run.plot(numeric[0])
    assert axes.lines and f"[{run.data[numeric[0]].attrs['units'] or '-'}]" in axes.get_ylabel()
    matplotlib.pyplot.close(axes.figure)


def test_a_run_is_that_of_its_system_to_the_bit(scene, result):
    alone = run_system(scene.checked, "mujoco", error=True)
    assert result.data.drop_attrs().identical(alone.data.drop_attrs())
    assert result.data.attrs["error"] == alone.data.attrs["error"] != "{}"


def test_a_table_and_a_file_give_the_same_scene(scene, tmp_path):
    (tmp_path / "mine.toml").write_text((ROOT / "studies/scenes/study_road.toml").read_text())
    for given in (tmp_path / "mine.toml", str(tmp_path / "mine.toml"), dict(twinrig.load("study_road").table)):
        assert twinrig.load(given, set={"run.duration": 0.1}).checked.table() == scene.checked.table()


def test_changes_are_checked_and_leave_the_scene_as_it_was(scene):
    changed = scene.with_({"run.step": np.float64(5e-4), "effects.lift_off": None, "vehicle.override": {"I": 620}})
    assert (changed.checked.run.step, changed.table["vehicle"]["override"]) == (5e-4, {"I": 620})
    assert "lift_off" in scene.checked.effects and "lift_off" not in changed.checked.effects
    assert "step" not in scene.table["run"] and changed.file == scene.file == "study_road.toml with changes"
    assert "run.step = 0.0005" in repr(changed) and "lift_off" in scene.plan()


def test_a_result_says_its_error_and_what_it_broke():
    run = twinrig.run("ride", set={"speeds.count": 2})
    (broken,) = run.broken
    assert broken.remedy in f"{run}" and broken.says in run.assumed and "error at most" in f"{run}"
    assert max(one.share for one in run.errors.values()) < 1e-9
    axes = run.plot("deviation")
    assert "assumption broken" in axes.get_title("left") + axes.get_title()  # a house style may set titles to the left


def test_a_result_shows_itself_in_a_notebook(result):
    result.data["f1"].attrs["long_name"], kept = "a < b", result.data["f1"].attrs["long_name"]
    shown = result._repr_html_()
    result.data["f1"].attrs["long_name"] = kept
    assert shown.count("<tr>") == 1 + len(result.data.data_vars) and "a &lt; b" in shown and "error at most" in shown


def test_a_plot_has_units_and_a_line_per_channel(result):
    axes = result.plot("f1", "f2")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "f1, f2 [N]")
    assert [line.get_label() for line in axes.lines] == ["f1", "f2"]
    assert np.array_equal(axes.lines[1].get_ydata(), result["f2"])
    assert result.plot("f3", axes=axes) is axes and len(axes.lines) == 3


def test_a_result_becomes_a_table_and_a_dataset(result):
    frame = result.to_pandas("f1", "pitch")
    assert frame.index.name == "time" and list(frame) == ["f1", "pitch"] and frame.attrs["units"]["f1"] == "N"
    assert np.array_equal(frame["pitch"], result["pitch"]) and len(result.to_pandas().columns) == len(result.data)
    copied = result.to_xarray()
    copied["f1"][:] = 0.0
    assert result["f1"].all()
    assert isinstance(result.every(0.01), twinrig.Result)


def test_a_saved_result_is_read_and_compared_with_the_same_numbers(scene, result, tmp_path):
    from studies.command.comparison import compare

    other = twinrig.run(scene, "reference")
    result.save(str(tmp_path / "a.nc"))
    other.save(tmp_path / "b.nc")
    report = twinrig.compare(result, tmp_path / "b.nc")
    files, _ = compare(tmp_path / "a.nc", tmp_path / "b.nc")
    assert [numbers(each) for each in report.detail] == [numbers(each) for each in files]
    assert report.values["f1"]["largest"] < 1e-9 < 1e-3 < abs(result["f1"]).max()
    assert "the first (mujoco)" in repr(report) and "<pre>" in report._repr_html_()
    assert "same to the last bit" in repr(twinrig.compare(result, twinrig.read(tmp_path / "a.nc")))


def numbers(difference):
    """What is told of a difference; repr, for what is not a number is not equal to itself."""
    return repr([difference.name, difference.largest, difference.rms, difference.at, difference.stated])


def test_a_planted_difference_is_told_first(scene, result):
    kicked = twinrig.Result(result.to_xarray())
    kicked.data["pitch"].values[7] += 0.25
    first = twinrig.compare(result, kicked).detail[0]
    assert (first.name, first.largest) == ("pitch", pytest.approx(0.25)) and first.at == result.times[7]


def test_a_price_names_the_cheapest_setting(scene):
    report = twinrig.price(scene, 1.0, ["f1"], "reference")
    assert "RK4" in repr(report) and report.detail.winners["", "calls"].error <= 1.0
    assert report.values["tolerance"] == 1.0


def test_a_choice_leaves_out_what_the_quantities_do_not_feel(scene, tmp_path):
    soft = scene.with_({"effects.pitch_spring.stiffness": 1e-3})
    report = twinrig.choose(soft, ["rms f1"], 0.05, "reference", folder=tmp_path / "kept")
    assert "pitch_spring" in report.values["answer"][0]["left out"]
    assert "rms f1" in repr(report) and (tmp_path / "kept" / "choice.png").is_file()


def test_validate_hands_on_what_the_report_says(empty_folder, monkeypatch):
    """The cases themselves take a minute: here the call, its folder and its answer."""

    def run(folder, quick, command):
        (folder / "results.json").write_text('{"rows": 3}')
        print(f"3 rows: 1 failed, {quick}, {command}")
        return 1

    monkeypatch.setattr("validation.run.validate", run)
    report = twinrig.validate(quick=True)
    assert repr(report) == "3 rows: 1 failed, True, twinrig.validate(quick=True)" and report.detail == 1
    assert report.values == {"folder": str(Path("results/validate-quick")), "results": {"rows": 3}}
    with pytest.raises(twinrig.InputError, match=r"^folder = .*name a new or empty folder"):
        twinrig.validate(quick=True, folder=report.values["folder"])


def run_short(name="study_road", *engine, **options):
    """A run that is refused before anything is computed."""
    return twinrig.run(name, *engine, **options)


ERRORS = {
    "engine": (lambda r: run_short("study_road", "mujocco"), "^engine = 'mujocco': .*did you mean 'mujoco'"),
    "all engines": (lambda r: run_short("study_road", "all"), "run each, and .* twinrig.compare"),
    "engine of no engine": (lambda r: run_short("contact_ellipse", "mujoco"), "no engine computes: leave it out"),
    "scene": (lambda r: twinrig.load("study_raod"), "no such scene.*did you mean 'study_road'"),
    "file": (lambda r: twinrig.load("nowhere.toml"), "nowhere.toml: no such file"),
    "no scene": (lambda r: twinrig.load(5), "must be a name, a file, a table or a scene, not int"),
    "saved result": (lambda r: twinrig.load("run.nc"), "twinrig.read reads a saved result"),
    "key": (lambda r: twinrig.load("study_road", set={"run.duratoin": 2.0}), "did you mean 'duration'"),
    "value": (lambda r: twinrig.load("study_road", set={"run.step": -1.0}), "run.step = -1.0: must be above 0.*in s"),
    "text": (lambda r: twinrig.load("study_road", set={"run.duration": "2 s"}), "'2 s': must be a number"),
    "changes as text": (lambda r: twinrig.load("study_road", set="run.step=1"), "table of dotted keys, for example"),
    "key within a value": (
        lambda r: twinrig.load("handling", set={"run.step.x": 1}),
        "set: run.step.x = 1: run.step is",
    ),
    "taken out": (lambda r: twinrig.load("study_road", set={"run.duratoin": None}), "taken out.*did you mean 'dur"),
    "system": (lambda r: twinrig.load({"title": "x", "system": "brakng"}), "no such system.*did you mean 'braking'"),
    "no title": (lambda r: twinrig.load({"vehicle": {"parameters": "itwm_drift"}}), "title: is missing"),
    "option": (lambda r: run_short("braking", proceduer="split"), "no option.*did you mean 'procedure'"),
    "procedure": (lambda r: run_short("braking", procedure="strait"), "not among procedures.*did you mean 'straight'"),
    "pictures": (lambda r: run_short("animation"), "drawn by its study"),
    "channel": (lambda r: r["picth"], "no such channel.*did you mean 'pitch'"),
    "plotted channel": (lambda r: r.plot("F1"), "no such channel.*did you mean 'f1'"),
    "nothing plotted": (lambda r: r.plot(), "name one channel or more"),
    "two units": (lambda r: r.plot("f1", "pitch"), "N over time.* and rad over time.*one unit at a time"),
    "no result": (lambda r: twinrig.compare("study_road", r), "give what twinrig.run returns"),
    "no price": (lambda r: twinrig.price("ride", 1.0), "accuracy is priced in scenes of other systems"),
    "tolerance": (lambda r: twinrig.price("study_road", -1.0), "^tolerance = -1.0: must be a finite number above 0"),
    "no steps": (lambda r: twinrig.price("race_car", 1.0), "system = 'single-track'.*no steps to choose"),
    "no quantity": (lambda r: twinrig.price("study_road", 1.0, 3), "^quantity = 3: must be a name, or a list of names"),
    "no engine": (lambda r: twinrig.export("handling", "adams"), "^engine = 'adams': no engine that has files"),
    "no vehicle": (lambda r: twinrig.export("contact_ellipse", "mujoco"), "no vehicle that an engine builds"),
    "no such file": (lambda r: twinrig.export("handling", "mujoco", "x.py"), "^file = 'x.py': must end in .xml"),
    "no quantities": (lambda r: twinrig.choose("study_road"), "quantities: is missing.*give both"),
    "no saved file": (
        lambda r: twinrig.read("nowhere.nc"),
        r"^nowhere.nc: no such file \(a saved result ends in .nc\)$",
    ),
    "a folder": (lambda r: twinrig.read("."), "is a folder: name one file of it"),
}


@pytest.mark.parametrize("mistake", ERRORS)
def test_a_beginners_error_is_answered_with_the_remedy(mistake, result):
    ask, said = ERRORS[mistake]
    with pytest.raises(twinrig.InputError, match=said):
        ask(result)


def test_a_vehicle_is_written_as_a_file_of_an_engine(tmp_path):
    file = tmp_path / "car.xml"
    report = twinrig.export("handling", "mujoco", file)
    assert file.read_text().startswith("<") and report.values["file"] == str(file)
    assert any("tyre" in text for text in report.values["left out"]) and "left out:" in repr(report)
    with pytest.raises(twinrig.InputError, match="nothing is overwritten"):
        twinrig.export("handling", "mujoco", file)


def test_an_unlikely_vehicle_is_told_in_the_result_and_where_the_run_is_refused():
    with pytest.raises(twinrig.InputError, match="shorten the step") as refused:
        twinrig.run("study_road", set={"vehicle.override.m3": 0.75})
    assert any("m3" in note and "0.75 kg" in note for note in refused.value.__notes__)
    run = twinrig.run("study_road", set={"vehicle.override.I": 5e4, "run.duration": 0.01}, error=False)
    assert (
        "  doubt: bodies[chassis: m3, I].inertia: 5e+04 kg m^2" in repr(run)
        and "radius of gyration" in run._repr_html_()
    )


def test_channels_over_different_axes_are_told_by_their_axes():
    run = twinrig.run("contact_ellipse", set={"method.cells": 11}, error=False)
    with pytest.raises(twinrig.InputError, match=r"over the same axes .*over other: alone"):
        twinrig.Result(run.data.assign(alone=("other", [1.0]))).to_pandas()


def test_a_misspelt_name_of_the_library_offers_the_nearest():
    with pytest.raises(AttributeError, match="did you mean 'price'"):
        twinrig.prize  # noqa: B018  the access itself is tested


def fresh(folder, code):
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)


def test_import_loads_nothing_heavy(tmp_path):
    """What makes it answer in well under 0.3 s; seconds themselves are not gated."""
    done = fresh(tmp_path, f"import sys, twinrig; print([m for m in {HEAVY} if m in sys.modules], dir(twinrig))")
    assert done.stdout.startswith("[] ['") and "'Result'" in done.stdout, done.stderr
    assert "numpy" in fresh(tmp_path, "import sys, twinrig; twinrig.Result; print(*sys.modules)").stdout.split()


@pytest.mark.parametrize("hiding", ["models.py", "models/__init__.py", "validation.py"])
def test_a_file_of_the_users_that_hides_a_package_is_named(tmp_path, hiding):
    (tmp_path / hiding).parent.mkdir(exist_ok=True)
    (tmp_path / hiding).write_text("")
    said = fresh(tmp_path, "import twinrig").stderr.splitlines()[-1]
    place = (tmp_path / hiding).parent if hiding.endswith("__init__.py") else tmp_path / hiding
    assert said.startswith("ImportError") and f"{place} hides twinrig's package" in said and "rename it" in said


def test_the_command_names_what_hides_a_package_without_a_traceback(tmp_path):
    (tmp_path / "models.py").write_text("")
    script = tmp_path / "twinrig"
    script.write_text("from twinrig.command import main\nmain()\n")
    done = fresh(tmp_path, f"import sys, runpy; sys.argv = [{str(script)!r}, 'list']; runpy.run_path({str(script)!r})")
    assert done.returncode == 1 and done.stderr.startswith(f"twinrig: {tmp_path / 'models.py'} hides twinrig's package")
    assert len(done.stderr.splitlines()) == 1


def test_a_folder_without_code_hides_nothing(tmp_path):
    (tmp_path / "models").mkdir()
    assert fresh(tmp_path, "import twinrig").returncode == 0


def test_the_version_is_told(capsys, monkeypatch):
    from studies import command_line

    monkeypatch.setattr(sys, "argv", ["twinrig", "--version"])
    with pytest.raises(SystemExit) as ended:
        command_line.main()
    assert ended.value.code == 0 and capsys.readouterr().out == f"twinrig {twinrig.__version__}\n"


def test_the_wheel_holds_the_package_and_its_types():
    import tomllib

    wheel = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert "twinrig" in wheel["packages"] and (ROOT / "twinrig/py.typed").is_file()
