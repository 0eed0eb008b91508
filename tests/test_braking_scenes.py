"""Scenes of braking: what they refuse, what they call absent, how procedures begin, that failed runs are kept."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.brake.controller import Command
from models.brake.port.ask import ControllerFailed
from models.core.errors import InputError
from models.core.systems import load
from models.systems.braking.adhesion import Adhesion, NoAdhesion, measured_utilisation
from models.systems.braking.of_scene import braked_vehicle
from models.systems.braking.plan import check, check_reference, describe
from models.systems.braking.procedures import vehicle_and_start_state
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from models.systems.braking.stop_report import StopHistory
from studies.braking import figures_of_merit_lines

SCENES = Path(__file__).parents[1] / "studies" / "scenes"
PLAIN = {"title": "t", "system": "braking", "run": {"duration": 0.3}, "procedures": {"stop": {"speed": 10.0}}}


def scene(**tables):
    return build({**PLAIN, **tables}, "s.toml")


@pytest.mark.parametrize(
    ("tables", "place", "said"),
    [
        ({"procedures": {}}, "procedures", "at least 1"),
        ({"procedures": {"a": {"kind": "jturn"}}}, "procedures.a.kind", "j_turn"),
        ({"procedures": {"a": {"kind": "j_turn"}}}, "procedures.a.steer", "missing"),
        ({"procedures": {"a": {"steer": 0.1}}}, "procedures.a.steer", "no meaning for straight"),
        ({"procedures": {"a": {"kind": "turn", "radius": 1.0}}}, "procedures.a.radius", "at least 10 m"),
        ({"procedures": {"a": {"speed": 200.0}}}, "procedures.a.speed", "100 m/s"),
        ({"brakes": {"front": {"gradient": 9.0, "push_outt": 1.0}}}, "brakes.front.push_outt", "push_out"),
        ({"run": {"sample": 5.5}}, "run.sample", "0.1 s"),
        ({"loadtransfer": {}}, "loadtransfer", "load_transfer"),
    ],
)
def test_what_a_scene_cannot_be_is_told_by_its_key(tables, place, said):
    with pytest.raises(InputError) as error:
        scene(**tables)
    assert error.value.file == "s.toml" and error.value.place == place and said in str(error.value)


@pytest.mark.parametrize(
    ("tables", "place", "said"),
    [
        ({"controller": {"kind": "slip_bangbang"}}, "controller.kind", "slip_bang_bang"),
        ({"controller": {"kind": "slip_pi", "parameters": {"gian": 1.0}}}, "controller.parameters.gian", "gain"),
        ({"controller": {"kind": "slip_pi", "parameters": {"gain": -1.0}}}, "controller.parameters.gain", "above 0"),
        ({"road": {"stretches": [{"left": "icy"}]}}, "road.stretches", "ice"),
        ({"road": {"stretches": [{"x": 5.0, "left": "ice"}, {"x": 5.0, "left": "dry"}]}}, "road.stretches", "rise"),
        ({"vehicle": {"parameters": "papr"}}, "vehicle.parameters", "paper"),
        ({"vehicle": {"override": {"mas": 1.0}}}, "vehicle.override.mas", "mass"),
        ({"brakes": {"front": {"gradient": 1.0, "release": 1.0}}}, "brakes.front", "push_out"),
        ({"tyres": {"scale": {"ice": 3.0}}}, "tyres.scale.ice", "at most 2"),
        ({"tyres": {"scale": {"icee": 1.1}}}, "tyres.scale.icee", "no such surface"),
    ],
)
def test_what_reading_does_not_find_is_refused_before_a_run(tables, place, said):
    with pytest.raises(InputError) as error:
        check(scene(**tables), ())
    assert error.value.place == place and said in str(error.value)


def test_a_plan_names_what_is_absent_and_what_is_there():
    plain, full = describe(scene()), describe(load(SCENES / "braking.toml"))
    absent = re.search(r"absent +(.*) \(not computed\)", plain)[1]
    for effect in ("load_transfer", "push_out", "hysteresis", "pressure_dynamics", "anti_lock", "faults"):
        assert effect in absent
    there = re.findall(r"effect +(\w+): .*", full)
    assert there == ["anti_lock", "hysteresis", "load_transfer", "pressure_dynamics", "push_out", "second_surface"]


def test_without_load_transfer_and_dynamics_nothing_of_them_is_computed():
    bare, full = braked_vehicle(scene(), scene().procedures["stop"]), load(SCENES / "braking.toml")
    assert (
        not bare.plane.load_per_x_acceleration.any()
        and not bare.plane.load_per_y_acceleration.any()
        and not bare.chambers.fill_time.any()
    )
    assert braked_vehicle(full, full.procedures["straight"]).plane.load_per_x_acceleration.all()


@pytest.mark.parametrize("radius", [137.0, -137.0])
def test_a_turn_begins_on_its_steady_circle(radius):
    own = scene(procedures={"a": {"kind": "turn", "speed": 8.0, "radius": radius}}, load_transfer={})
    vehicle, start = vehicle_and_start_state(own, "a")
    path = replace(vehicle, switch_time=1.0).run(Applied(), start, 0.5)
    centre = radius * np.array([-start.state[1, 1], start.state[1, 0]]) / 8.0
    off = np.hypot(*(path.states[:, 0, :2] - centre).T) - abs(radius)
    assert abs(start.state[1, 2] - 8.0 / radius) < 1e-12 and np.sign(vehicle.steer[0]) == np.sign(radius)
    assert np.abs(off).max() < 1e-4  # m, within 4 m of way; without its side slip at the start it is some cm


def test_a_circle_that_the_tyres_cannot_hold_is_refused():
    with pytest.raises(InputError, match=r"procedures\.a\.radius.*do not hold"):
        check(scene(procedures={"a": {"kind": "turn", "speed": 30.0, "radius": 50.0}}), ())


class Applied:
    """All valves open, and for ``samples`` of them an answer."""

    def __init__(self, samples=10**6):
        self.samples = samples

    def sample(self, given):
        if given.number == self.samples:
            raise ValueError("dead")
        return Command(valves=np.full(4, 1 if given.brake else -1))


def test_a_controller_that_dies_leaves_the_path_until_then():
    vehicle, start = vehicle_and_start_state(scene(), "stop")
    with pytest.raises(ControllerFailed, match="dead") as error:
        vehicle.run(Applied(5), start)
    assert len(error.value.partial.times) == 6 and error.value.partial.reports.load.shape[0] == 5


def test_split_friction_turns_to_the_better_side_and_equal_friction_not_at_all():
    both = {"split": {"kind": "split", "speed": 10.0, "right": "snow"}, "straight": {"speed": 10.0}}
    own = scene(procedures=both, load_transfer={})
    assert drive(own, procedure="split").detail.states[-1, 0, 2] < -1e-3
    straight = drive(own, procedure="straight").detail
    assert not straight.states[:, 0, 1:].any() and straight.states[-1, 1, 0] < 10.0


def test_the_system_whose_adhesion_is_measured_is_the_one_behind_the_port(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import numpy as np\nfrom models.brake.controller import Command\nclass Released:\n"
        "    def __init__(self, wheels): pass\n"
        "    def sample(self, given): return Command(pressures=np.full(4, 0.5))\n"
    )
    tables = {**PLAIN, "run": {"duration": 60.0}, "controller": {"kind": "slip_bang_bang"}}
    port = {"callable": "mine.py:Released", "timeout": 60.0, "start": 60.0}
    own, others = (
        measured_utilisation(build({**tables, **more}, "s.toml", tmp_path), "ice", Adhesion(0.17, 0.17)).z
        for more in ({}, {"port": port})
    )
    expected = 0.5 * 2 * (1500.0 + 1200.0) / 0.5 / (5640.0 * 9.81 + 2 * (13.35 + 27.0) / 0.25 * 9.81)
    assert others == pytest.approx(expected, rel=0.02) and own > 1.3 * others


def test_steps_at_which_a_vehicle_would_rock_up_on_its_tyres_are_refused():
    lags = {"relaxation": {"front": 0.005, "rear": 0.5}, "road": {"stretches": [{"left": "dry"}]}}
    with pytest.raises(InputError, match=r"run\.substeps = 1: must be at least 2: .* rocks up"):
        vehicle_and_start_state(scene(run={"sample": 0.01, "substeps": 1}, **lags), "stop")
    vehicle_and_start_state(scene(run={"sample": 0.01, "substeps": 2}, **lags), "stop")
    lags["relaxation"]["front"] = 1e-12
    with pytest.raises(InputError, match=r"relaxation = 1e-12: must be at least .* m: .* more than 1000") as refusal:
        vehicle_and_start_state(scene(run={"sample": 0.01}, **lags), "stop")
    lags["relaxation"]["front"] = float(re.search(r"at least (\S+) m", str(refusal.value))[1])
    vehicle_and_start_state(scene(run={"sample": 0.01, "substeps": 1000}, **lags), "stop")


def test_a_stop_from_walking_pace_has_figures_of_its_wheels():
    slips = StopHistory(drive(scene(procedures={"stop": {"speed": 0.5}}, run={"duration": 3.0})).detail).wheel_results()
    assert 0.0 < slips["mean slip"].min() <= slips["largest slip"].max() <= 1.0


def test_the_study_saves_tables_figures_and_paths(tmp_path):
    import xarray as xr

    from studies.braking import run

    own = scene(options={"adhesion": False}, controller={"kind": "slip_bang_bang"})
    summary = run(own, (), tmp_path, lambda text, part: None)
    assert summary["answer"]["stop"]["initial speed [m/s]"] == 10.0 and not summary["failed"]
    with xr.open_dataset(tmp_path / "stop.nc", engine="h5netcdf") as data:
        assert data["pressure"].attrs["units"] == "bar" and data["pressure"].shape[1] == 4
    assert (tmp_path / "stop.png").stat().st_size > 10_000


def test_every_shipped_scene_of_braking_is_valid():
    for path in SCENES.glob("braking*.toml"):
        assert describe(build(tomllib.loads(path.read_text()), path.name))


@pytest.mark.parametrize(
    ("tables", "place", "said"),
    [
        ({"controller": {"kind": "slip_pi", "parameters": {"gian": 1.0}}}, "controller.parameters.gian", "gain"),
        ({"tyres": {"files": {"ice": "tyre.csv"}}}, "line 1 (header), column 'slip', unit", "not known"),
        ({"port": {"fmu": "no.fmu"}}, "port.fmu", "no such file"),
        (
            {"port": {"replay": "tyre.csv", "faults": [{"kind": "lost", "wheels": [4]}]}},
            "port.faults.0.wheels",
            "0 to 3",
        ),
    ],
)
def test_what_a_scene_names_is_read_before_its_plan_is_shown(tmp_path, tables, place, said):
    (tmp_path / "tyre.csv").write_text("slip [furlong]\n1\n")
    with pytest.raises(InputError, match=said) as error:
        describe(build({**PLAIN, **tables}, "s.toml", tmp_path))
    assert error.value.place == place


@pytest.mark.parametrize(
    ("port", "place", "said"),
    [
        ({"callable": "models.brake.port.example:Exampel"}, "port.callable", "Example"),
        ({"command": ["/no/such/program"]}, "port.command", "cannot be started"),
        ({"replay": "s.log"}, "port.replay", "is no log"),
        ({"fmu": "s.log"}, "port.fmu", "is no FMU"),
    ],
)
def test_what_is_wrong_behind_the_port_is_told_by_the_scene_s_key(tmp_path, port, place, said):
    (tmp_path / "s.log").write_text("x")
    with pytest.raises(InputError, match=said) as error:
        drive(build({**PLAIN, "port": port}, "s.toml", tmp_path))
    assert error.value.file == "s.toml" and error.value.place == place


@pytest.mark.parametrize(
    ("port", "engines", "said"),
    [
        ({"log": "{engine}.log"}, ("reference",), r"{procedure} in it: 2"),
        ({"log": "{procedure}.log"}, ("reference", "mujoco"), r"{engine} in it: 2"),
        ({"log": "none/{procedure}.log"}, ("reference",), "no such folder"),
        ({"log": "{procedure}.csv"}, ("reference",), "is no log"),
        ({"log": ".{procedure}"}, ("reference",), "is a folder"),
    ],
)
def test_a_log_that_another_drive_or_file_would_lose_is_refused(tmp_path, port, engines, said):
    (tmp_path / "b.csv").write_text("mine")
    (tmp_path / ".b").mkdir()
    two = {"procedures": {"a": {"speed": 9.0}, "b": {"speed": 8.0}}}
    with pytest.raises(InputError, match=said) as error:
        check(build({**PLAIN, **two, "port": port}, "s.toml", tmp_path), engines)
    assert error.value.place == "port.log"


def test_a_study_of_many_drives_keeps_no_log():
    with pytest.raises(InputError, match="many times"):
        check_reference(scene(port={"log": "a.log"}), ())


def test_the_surface_on_the_right_is_told_by_its_procedure():
    with pytest.raises(InputError, match="icee") as error:
        describe(scene(procedures={"a": {"kind": "split", "right": "icee"}}))
    assert error.value.place == "procedures.a.right"


def test_stretches_shorter_than_a_step_are_told_before_a_run():
    with pytest.raises(InputError, match="way in a step") as error:
        check(scene(road={"stretches": [{"left": "ice"}, {"x": 1.0, "left": "dry"}, {"x": 1.001, "left": "ice"}]}), ())
    assert (error.value.file, error.value.place) == ("s.toml", "road.stretches")


def test_a_run_of_less_than_two_samples_is_refused():
    with pytest.raises(InputError, match=r"at least 0\.011 s"):
        scene(run={"duration": 0.01})


def test_adhesion_of_an_axle_that_does_not_lock_is_not_told():
    weak = scene(controller={"kind": "slip_bang_bang"}, brakes={"supply": 2.0}, road={"stretches": [{"left": "dry"}]})
    with pytest.raises(NoAdhesion, match=r"front axle does not lock at the supply's 2 bar"):
        measured_utilisation(weak, "dry")


def test_a_run_that_ends_before_the_vehicle_stands_says_so():
    stop = StopHistory(drive(scene()).detail)
    assert "not stopped by 0.3025 s, still 9.7" in figures_of_merit_lines("stop", stop, {}, {})[0]
