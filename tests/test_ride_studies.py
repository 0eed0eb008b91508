"""Scenes and studies of ride: what they save, what they say, what they refuse."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError
from models.ride.export import control_state_space
from models.ride.measures import exceedance_rate, time_share_beyond
from models.systems.ride import nonlinear
from models.systems.ride.of_scene import excitation_of, placed_wheels, road_of, vehicle_of
from models.systems.ride.scene import build
from models.vehicles.spatial import Curve
from models.vehicles.spatial_linear import wheels
from studies.command.asked import load_scene

pytestmark = pytest.mark.usefixtures("empty_folder")
TABLE = {"title": "a ride", "system": "ride", "vehicle": {"file": "seven_freedoms"}, "speeds": {"values": [10.0, 20.0]}}
SMALL = ("--set", "vehicle.file=half_car", "--set", "speeds={values=[10.0, 20.0]}", "--set", "weighting={}")


def test_a_run_saves_deviations_figures_and_the_system(twinrig, capsys):
    import xarray as xr

    assert twinrig("run", "ride", *SMALL, "--engine", "reference", "--out", "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)["answer"]
    names = {
        "command.txt",
        "deviations.nc",
        "deviations.csv",
        "system.npz",
        "system.mat",
        "body_acceleration.png",
        "over_speed.png",
        "spectra.png",
        "road.png",
    }
    assert {path.name for path in Path("out").iterdir()} == names
    with xr.open_dataset("out/deviations.nc", engine="h5netcdf") as data:
        saved = data["deviation"].sel(engine="reference", correlation="as in the scene", output="body centre").values
    assert saved == pytest.approx(found["deviation"]["body centre"]) and found["speed"] == [10.0, 20.0]
    with np.load("out/system.npz") as system:  # at the middle speed: the second of two
        at = list(system["outputs"]).index("body centre")
        assert system["deviation"][at] == pytest.approx(saved[1], rel=1e-9)
        assert system["delays"][1] == pytest.approx((1.1561957064 + 1.4227170936) / 20.0, rel=1e-12)


def test_engines_linear_vehicles_agree_in_what_is_printed(twinrig, capsys):
    assert twinrig("run", "ride", *SMALL, "--out", "out") == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "own linear vehicle" in line]
    gaps = [float(line.split("within ")[1].split()[0]) for line in lines]
    assert len(gaps) == 2 and max(gaps) < 1e-9  # matrices agree to 1e-12; the sweep is exact to 1e-10


def test_detail_compares_outputs_of_the_same_name(twinrig, capsys):
    given = (
        "--set",
        "speeds={values=[15.0]}",
        "--set",
        "options.simpler=['quarter_car']",
        "--set",
        "vehicle.file=half_car",
        "--json",
    )
    assert twinrig("run", "ride_detail", *given, "--out", "out") == 0
    found = json.loads(capsys.readouterr().out)["answer"]
    assert found["4 freedoms, one track"]["body centre"] == 0.0  # the scene's vehicle against itself
    assert found["2 freedoms, one track"]["pitch acceleration"] is None
    with open("out/errors.csv", newline="") as file:
        rows = {row["output"]: row for row in csv.DictReader(file)}
    assert rows["pitch acceleration"]["2 freedoms, one track [-]"] == ""
    assert float(rows["body centre"]["4 freedoms, one track [-]"]) == 0.0
    assert abs(found["2 freedoms, one track"]["tyre force front left"]) < 0.05


def test_a_drive_rests_at_standstill_and_is_saved(twinrig):
    import xarray as xr

    drive = "drive={time=[0.0, 0.5, 2.0], speed=[0.0, 0.0, 12.0]}"
    given = ("--set", "vehicle.file=quarter_car", "--set", drive, "--set", "weighting={}", "--engine", "reference")
    assert twinrig("run", "ride_drive", *given, "--out", "out") == 0
    with xr.open_dataset("out/drive.nc", engine="h5netcdf") as data:
        body = data["deviation"].sel(output="body front")
        # At rest a variance is zero to rounding, 1e-16 of others; its root is 1e-8 m/s^2 of 1 m/s^2.
        assert float(body.sel(time=0.25, method="nearest")) < 1e-7 < 1.0 < float(body[-1])
        assert float(data["quasi_stationary"].sel(output="body front")[0]) < 1e-7
    assert Path("out/drive.png").exists()


def test_a_vehicle_without_width_runs_on_a_track():
    scene = build({**TABLE, "vehicle": {"file": "quarter_car"}, "road": {"half_track": 0.6}})
    assert {wheel.y for wheel in placed_wheels(scene, wheels(vehicle_of(scene)))} == {0.6}


def test_wheels_stand_at_their_own_place_or_on_the_tracks():
    tables = {"own": {"wheels": "own"}, "tracks": {"wheels": "tracks"}}
    found = {}
    for name, road in tables.items():
        scene = build({**TABLE, "road": road})
        found[name] = [wheel.y for wheel in placed_wheels(scene, wheels(vehicle_of(scene)))]
    assert sorted(set(map(abs, found["own"]))) == [0.68199, 0.69342]  # rear and front track of the vehicle
    assert found["tracks"] == [0.69342, -0.69342, 0.69342, -0.69342]


def test_a_road_of_an_iso_class_has_its_level():
    """Class C: one-sided 256e-6 m^3 at 0.1 waves per metre are 2 pi 0.01 256e-6 = 16.1e-6 m^3 at 1 rad/m."""
    scene = build({**TABLE, "road": {"iso8608": "C"}})
    there = wheels(vehicle_of(scene))
    assert 2 * road_of(scene, there).level(there[0].y) == pytest.approx(2 * np.pi * 0.01 * 256e-6, rel=1e-12)


def test_the_system_as_python_control_has_it():
    from models.ride.excited import vehicle_with_road
    from models.vehicles.spatial_linear import linearise

    scene = build(TABLE)
    linear = linearise(vehicle_of(scene))
    system = vehicle_with_road(linear, excitation_of(scene, linear.wheels), 20.0)
    found = control_state_space(system)
    assert found.ninputs == 4 and found.noutputs == len(system.names) and found.input_labels[2] == "w2_1"
    assert np.array_equal(found.A, system.A) and np.array_equal(found.B[:, 2:], system.B[1])


def test_exceedance_of_a_gaussian_process():
    """Of a standard normal, 4.55 % lies beyond 2; a sine-like process of 1 Hz passes it 2 exp(-2) times a second."""
    assert time_share_beyond(1.0, 2.0) == pytest.approx(0.0455003, rel=1e-6)
    assert exceedance_rate(1.0, 2 * np.pi, 2.0) == pytest.approx(2 * np.exp(-2.0))
    assert time_share_beyond(0.0, 1.0) == exceedance_rate(0.0, 1.0, 1.0) == 0.0


REFUSED = [
    ({"speeds": None}, "speeds: give either the table speeds or the table drive"),
    ({"drive": {"time": [0.0, 1.0], "speed": [0.0, 1.0]}}, "give either the table speeds or the table drive"),
    ({"speeds": {"values": [10.0, 0.0]}}, "speeds.values.1 = 0.0: must be above 0"),
    ({"speeds": {"start": 5.0}}, "speeds.stop: is missing"),
    ({"speeds": {"values": [5.0], "start": 5.0}}, "is not read beside"),
    ({"road": {"q_mean": 1e-5}}, "road.q_roll: is missing"),
    ({"road": {"q_mean": 1e-5, "q_roll": 1e-5, "level": 1e-5}}, "road.level"),
    ({"road": {"iso8608": "C", "level": 1e-5}}, "is that of class C already"),
    ({"road": {"iso8608": "I"}}, "road.iso8608"),
    ({"road": {"track_width": 1.4}}, "road.track_width = 1.4: has no meaning without road.file"),
    ({"road": {"file": "a.crg", "level": 1e-5}}, "road.level = 1e-05: is fitted to road.file"),
    ({"road": {"cutoff": 1.0}}, "road.cutoff = 1.0: must be above road.corner_roll, 1.5"),
    ({"road": {"left_right": "same"}}, "left_right"),
    ({"weighting": {"body centre": "Wx"}}, "weighting"),
    ({"vehicle": {"file": "r19_rode"}}, "did you mean 'r19_ride'"),
    ({"speeds": {"values": [5.0], "stop": 9.0}}, "speeds.stop = 9.0: is not read beside"),
    ({"speeds": {"values": [5.0], "count": 9}}, "speeds.count = 9: is not read beside"),
    ({"road": {"q_mean": 0.0, "q_roll": 0.0}}, "road.q_mean = 0.0: is 0, and road.q_roll, too"),
    ({"weighting": {"travel front left": "Wk"}}, "weights accelerations, and this output is one of the kind 'travel'"),
]


@pytest.mark.parametrize(("change", "said"), REFUSED, ids=[said[:30] for _, said in REFUSED])
def test_a_scene_that_cannot_be_is_told_why(change, said):
    from models.systems.ride.plan import check

    table = {key: value for key, value in {**TABLE, **change}.items() if value is not None}
    with pytest.raises(InputError, match=said.replace("(", r"\(")) as caught:
        check(build(table, "my.toml"), ("reference",))
    assert str(caught.value).startswith("my.toml")


def test_an_output_that_symmetry_silences_is_zero(twinrig, capsys):
    """Both tracks alike do not roll a car whose halves are equal."""
    given = (
        "--set",
        "vehicle.file=seven_freedoms",
        "--set",
        "speeds={values=[15.0]}",
        "--set",
        "weighting={}",
        "--set",
        "road={left_right='equal'}",
        "--engine",
        "reference",
    )
    assert twinrig("run", "ride", *given, "--out", "out") == 0
    (line,) = [line for line in capsys.readouterr().out.splitlines() if line.strip().startswith("roll acceleration ")]
    assert line.split()[2:4] == ["0", "rad/s^2"] and line.count("%") == 0


def test_a_loaded_vehicle_that_may_yaw_is_refused(twinrig, capsys):
    given = ("--set", "vehicle={file='r19_free', operating_point='loaded'}", "--set", "weighting={}")
    assert twinrig("run", "ride", *given) == 2
    assert "use unloaded" in capsys.readouterr().err


@pytest.mark.parametrize("study", ["ride", "ride_detail", "ride_drive"])
def test_curves_are_not_taken_as_lines_without_a_word(twinrig, capsys, study):
    given = ("--set", "vehicle.file=quarter_car_nonlinear", "--set", "weighting={}", "--set", "options={}")
    assert twinrig("run", study, *given) == 2
    said = capsys.readouterr().err
    assert "ride_nonlinear" in said and "small_motion" in said


def test_weighting_of_no_output_offers_the_nearest(twinrig, capsys):
    assert twinrig("run", "ride", *SMALL[:-2], "--set", "weighting={'body center'='Wk'}") == 2
    assert "did you mean 'body centre'" in capsys.readouterr().err
    assert not Path("results").exists()


TRICYCLE = """
title = "One wheel in front, two behind, on damped tyres; no output is an acceleration"
axles = [{name = "front", x = 1.2}, {name = "rear", x = -0.9}]
tyres = [{name = "f", axle = "front", body = "wheel", stiffness = 2e5},
         {name = "l", axle = "rear", body = "body", y = 0.6, stiffness = 2e5, damping = 300.0},
         {name = "r", axle = "rear", body = "body", y = -0.6, stiffness = 2e5, damping = 300.0}]
springs = [{name = "strut", bodies = ["body", "wheel"], point = [1.2, 0, 0.3], stiffness = 2e4, damping = 1500}]
outputs = [{name = "strut force", kind = "force", part = "strut"}, {name = "load", kind = "tyre force", tyre = "l"}]

[[bodies]]
name = "body"
mass = 600.0
position = [-0.9, 0.0, 0.5]
inertia = [200.0, 900.0, 0.0]
freedoms = ["z", "rx", "ry"]

[[bodies]]
name = "wheel"
mass = 20.0
position = [1.2, 0.0, 0.3]
freedoms = ["z"]
"""


def test_a_wheel_in_the_middle_is_on_neither_of_two_tracks(twinrig, capsys):
    """The study leaves out the road that it cannot run on, draws what there is, and finds the file of the command."""
    Path("tricycle.toml").write_text(TRICYCLE)
    given = (
        "--set",
        "vehicle.file=tricycle.toml",
        "--set",
        "speeds={values=[10.0, 20.0]}",
        "--set",
        "weighting={}",
        "--engine",
        "reference",
    )
    assert twinrig("run", "ride", *given, "--out", "out") == 0
    said = capsys.readouterr().out
    assert "tracks alike" in said and "tracks independent" not in said
    assert "load [N]: white noise" in said and "every wheel meets z_M + y theta" in said
    assert twinrig("run", "ride", *given, "--set", "road.left_right=uncorrelated") == 2
    assert "road.left_right = 'uncorrelated': wheel 'f' stands at y = 0" in capsys.readouterr().err
    assert twinrig("run", "ride", *given, "--set", "road.wheels=tracks") == 2
    assert "road.wheels = 'tracks': the first axle has no two tracks" in capsys.readouterr().err


def test_a_mass_in_grams_is_asked_about_and_no_shipped_vehicle_is():
    from dataclasses import replace

    from models.systems.ride.plan import frequency_doubts
    from models.vehicles.vehicle_file import load_vehicle, shipped_vehicles

    assert not any(frequency_doubts(load_vehicle(name, allows_towing=True)) for name in shipped_vehicles())
    own = load_vehicle("half_car")
    heavy = replace(own, bodies=tuple(replace(body, mass=1e3 * body.mass) for body in own.bodies))
    assert "SI units" in frequency_doubts(heavy)[0]


def test_models_of_the_same_size_are_told_by_their_files():
    from models.vehicles.vehicle_file import load_vehicle
    from studies.ride_detail import _vehicles_by_name

    names = list(_vehicles_by_name([load_vehicle(name) for name in ("half_car", "r19_free", "r19_ride")]))
    assert names == ["4 freedoms", "19 freedoms of r19_free.toml", "19 freedoms of r19_ride.toml"]


def test_engines_follow_springs_where_they_are_steep(monkeypatch):
    """A stop of 2e7 N/m swings body and wheel at 834 rad/s: steps of 2 ms made nothing of it, and said nothing."""
    scene = load_scene("ride_nonlinear", None)
    own = vehicle_of(scene)
    (spring,) = own.springs
    steep = replace(own, springs=(replace(spring, travel_force=Curve((0.04, 0.06, 0.061), (0.0, 0.0, 2e4))),))
    steps = []

    class Ridden(Exception):
        """Enough is known."""

    def driven(engine, vehicle, path, *rest, **more):
        steps.append(path.step)
        raise Ridden

    monkeypatch.setattr(nonlinear, "ride_over_heights", driven)
    for vehicle in (own, steep):
        with pytest.raises(Ridden):
            nonlinear.engine_result(scene, "mujoco", vehicle, nonlinear.RunSampling(speed=20.0))
    assert steps[0] == pytest.approx(2e-3) and steps[1] * 834.0 == pytest.approx(0.5, rel=0.01)
