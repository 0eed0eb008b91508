"""The command itself: what it imports, prints, saves and keeps."""

import json
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from models.core.errors import RunFailed
from models.core.result import load_result
from studies import command_line, single_run

HEAVY = ("numpy", "scipy", "numba", "exudyn", "mujoco", "xarray", "h5netcdf", "matplotlib", "pydantic", "jinja2")
SHORT = ("--set", "run.duration=0.05", "--set", "run.step=0.001")
STUDIES = Path(command_line.__file__).parent
ENGINES = ("reference", "exudyn", "mujoco")
pytestmark = pytest.mark.usefixtures("empty_folder")


def imported(*args):
    """Heavy packages that a fresh process has imported once the command has ended."""
    code = (
        "import sys; from studies.command_line import main; sys.argv = ['twinrig', *sys.argv[1:]]\n"
        "try: main()\nexcept SystemExit as e: assert not e.code\n"
        f"print('\\n' + ' '.join(m for m in {HEAVY} if m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code, *args], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


def contents(folder):
    """Every file below a folder with its bytes and the time of its last change."""
    files = [path for path in sorted(Path(folder).rglob("*")) if path.is_file()]
    return {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files}


@pytest.mark.parametrize("args", [(), ("--help",), ("run", "--help"), ("validate", "--help")], ids=" ".join)
def test_help_imports_nothing_heavy(args):
    """What makes it answer in well under half a second; seconds themselves are not gated."""
    assert imported(*args) <= ({"pydantic"} if args[:-1] else set())  # typer's own, for the options of a command


def test_list_imports_no_engine_and_names_everything(twinrig, capsys):
    assert not imported("list") & {"exudyn", "mujoco", "numba", "xarray", "matplotlib"}
    assert twinrig("list") == 0
    said = capsys.readouterr().out
    for path in [*STUDIES.glob("scenes/*.toml"), *STUDIES.parent.glob("models/systems/pitch_plane/effects/[a-z]*.py")]:
        assert f"  {path.stem} " in said
    assert all(word in said for word in ("itwm_drift", "asymmetric_twin", "GeneralizedAlpha", "implicitfast"))


def test_show_says_what_each_engine_will_compute(twinrig, capsys):
    assert twinrig("show", "study_road", *SHORT, "--set", "effects.pitch_spring.stiffness=5") == 0
    said = capsys.readouterr().out
    for words in (
        "Pitch-plane vehicle",
        "eq. 38",
        "chassis",
        "750 kg, 500 kg m^2",
        "5 N m/rad",
        "z1 0.0191",
        "pitch_rate",
        "road: height",
        "absent     accelerometers, contact_points",
        "f1, f2, f3, f4",
        "native items",
    ):
        assert words in said
    rows = {line.split()[0]: line.split() for line in said.splitlines()[-3:]}
    assert rows["reference"][1:6] == ["RK4", "4", "0.001", "s", "50"]
    assert (rows["exudyn"][-1], rows["mujoco"][-1]) == ("2", "1")  # a law per tyre that can lift
    assert not Path("results").exists()


def test_show_of_a_combination_that_an_engine_refuses(twinrig, capsys):
    assert twinrig("show", "release", *SHORT, "--set", "engines.exudyn.integrator=DVERK6") == 0
    assert "exudyn     refused: DVERK6" in capsys.readouterr().out


@pytest.mark.parametrize(
    "scene,change,said",
    [
        ("race_car", "drive.low_pass=1e9", "drive.low_pass = 1000000000.0: must be below 25 Hz"),
        ("race_car", "options.measurement=nowhere.csv", "options.measurement = 'nowhere.csv': no such file"),
        ("conicity", "conicity.table=flat.csv", "rows = 1: at least 3 rows of numbers are needed"),
    ],
)
def test_show_refuses_what_no_engine_would_run(twinrig, capsys, scene, change, said):
    path = Path("flat.csv").resolve()
    path.write_text("y [m],dr [m]\n0,0\n")
    assert twinrig("show", scene, "--set", change.replace("=flat.csv", f"={path}")) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("speed,said", [("0", "unstable at 0 m/s"), ("-3", "unstable at -3 m/s"), ("5", "dies out")])
def test_show_tells_whether_a_bicycle_stays_upright(twinrig, capsys, speed, said):
    assert twinrig("show", "bicycle", "--set", f"run.speed={speed}") == 0
    assert said in capsys.readouterr().out


def test_run_saves_every_engine_and_prints_json_alone(twinrig, capsys):
    assert twinrig("run", "study_road", *SHORT, "--json") == 0
    said = capsys.readouterr()
    summary = json.loads(said.out)
    assert said.err == "" and set(summary["runs"]) == set(ENGINES) and summary["failed"] == {}
    assert len(summary["largest difference of states"]) == 3
    assert max(summary["largest difference of states"].values()) < 1e-12
    for engine in ENGINES:
        result = load_result(Path("results/study_road") / f"{engine}.nc")
        assert result.times[-1] == 0.05 and result.counts()["steps"] == 50
        assert all(channel.attrs["units"] for channel in result.data.data_vars.values())
    assert Path("results/study_road/states.png").read_bytes().startswith(b"\x89PNG")
    assert not list(Path("results").rglob(".*"))


def test_run_prints_a_summary_for_people(twinrig, capsys):
    assert twinrig("run", "release", *SHORT, "--engine", "exudyn") == 0
    said = capsys.readouterr().out
    words = ("Free release", "exudyn", "RK44", "50 steps", "200 force calls", "results/release")
    assert all(word in said for word in words)


def test_set_changes_one_engine_alone(twinrig):
    assert twinrig("run", "release", *SHORT, "--set", "engines.mujoco.step=5e-4", "--out", "out") == 0
    steps = {engine: load_result(Path("out") / f"{engine}.nc").counts()["steps"] for engine in ENGINES}
    assert steps == {"reference": 50, "exudyn": 50, "mujoco": 100}


def test_results_are_numbered_and_never_overwritten(twinrig):
    for expected in ("release", "release-2", "release-3"):
        before = contents("results") if Path("results").exists() else {}
        assert twinrig("run", "release", *SHORT, "--engine", "reference") == 0
        after = contents("results")
        assert before.items() <= after.items()
        assert f"results/{expected}/reference.nc" in {str(path) for path in after}


def test_a_study_as_a_script_gives_the_same_as_the_command(twinrig):
    script = [sys.executable, str(STUDIES / "single_run.py"), *SHORT, "--out", "script", "--json"]
    done = subprocess.run(script, capture_output=True, text=True, check=True)
    assert set(json.loads(done.stdout)["runs"]) == set(ENGINES)
    assert twinrig("run", "study_road", *SHORT, "--out", "command") == 0
    for engine in ENGINES:
        one, other = (load_result(Path(folder) / f"{engine}.nc") for folder in ("script", "command"))
        assert (one.states == other.states).all() and list(one.data.data_vars) == list(other.data.data_vars)


def _failing(engine, error):
    def simulate(scene, name, **how):
        if name == engine:
            raise error
        return real(scene, name, **how)

    real = single_run.simulate
    return simulate


def test_a_failed_run_keeps_the_others(twinrig, monkeypatch, capsys):
    broken = RunFailed("exudyn", "the state became infinite", 0.02)
    monkeypatch.setattr(single_run, "simulate", _failing("exudyn", broken))
    assert twinrig("run", "release", *SHORT) == 1
    assert "FAILED: exudyn: the state became infinite (last good state at t = 0.02 s)" in capsys.readouterr().out
    assert sorted(path.name for path in Path("results/release").glob("*.nc")) == ["mujoco.nc", "reference.nc"]


def test_runs_that_all_fail_leave_no_folder(twinrig, capfd):
    assert twinrig("run", "release", *SHORT, "--set", "start.z3=1e200", "--json") == 1
    assert set(json.loads(capfd.readouterr().out)["failed"]) == set(ENGINES)
    assert not Path("results").exists()


def test_an_interrupted_run_that_finished_nothing_says_so(twinrig, monkeypatch, capsys):
    monkeypatch.setattr(single_run, "simulate", _failing("reference", KeyboardInterrupt()))
    assert twinrig("run", "release", *SHORT, "--out", "mine") == 130
    assert capsys.readouterr().err.strip() == "twinrig: interrupted; nothing was finished"
    assert not Path("mine").exists()


def test_an_interrupted_run_keeps_what_was_finished(twinrig, monkeypatch, capsys):
    assert twinrig("run", "release", *SHORT) == 0
    before = contents("results")
    monkeypatch.setattr(single_run, "simulate", _failing("exudyn", KeyboardInterrupt()))
    assert twinrig("run", "release", *SHORT) == 130
    assert "interrupted; finished results are kept in results/release-2" in capsys.readouterr().err
    assert before.items() <= contents("results").items()
    assert [path.name for path in Path("results/release-2").iterdir()] == ["reference.nc"]
    assert load_result(Path("results/release-2/reference.nc")).times[-1] == 0.05


def test_an_interrupt_before_the_first_result_leaves_no_folder(twinrig, monkeypatch):
    monkeypatch.setattr(single_run, "simulate", _failing("reference", KeyboardInterrupt()))
    assert twinrig("run", "release", *SHORT) == 130
    assert not Path("results").exists()


@pytest.mark.parametrize("error", [MemoryError(), OSError(28, "No space left on device")], ids=["memory", "disk"])
def test_a_machine_that_is_too_small_is_said_so(twinrig, error, monkeypatch, capsys):
    monkeypatch.setattr(single_run, "simulate", _failing("reference", error))
    assert twinrig("run", "release", *SHORT) == 1
    said = capsys.readouterr().err
    assert said.startswith("twinrig: ") and said.count("\n") == 1 and ("memory" in said or "disk is full" in said)


def test_the_console_command_is_this_one():
    (command,) = entry_points(group="console_scripts", name="twinrig")
    assert command.load() is command_line.main


def test_a_price_says_before_it_runs_code_of_the_user(twinrig, empty_folder, capsys, monkeypatch):
    (empty_folder / "scene.toml").write_text(
        'title = "t"\nsystem = "braking"\n[procedures.p]\nspeed = 11.1\n[port]\ncallable = "mine.py:Mine"\n'
    )
    (empty_folder / "mine.py").write_text("class Mine: pass\n")
    said = []

    def stop(*given):
        said.append(capsys.readouterr().err)
        raise ZeroDivisionError

    monkeypatch.setattr("models.advice.price.effects.price_list", stop)
    with pytest.raises(ZeroDivisionError):
        twinrig("show", "scene.toml", "--price")
    assert said == ["twinrig: this runs your own code, many times: [port] callable mine.py:Mine\n"]
