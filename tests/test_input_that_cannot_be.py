"""Wheel forces that cannot be the vehicle's, vehicles that no one builds, files without a last line end."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.finding import Finding
from models.core.tables import has_line_end
from models.core.time_series import read_time_series, write_time_series
from models.measured.axle_forces import FILE_REMEDIES, AxleForces, check_axle_forces
from models.measured.signal import MeasuredSignal
from models.systems.pitch_plane.run import run as simulate
from models.vehicles.parameters import asymmetric_twin, itwm_drift
from models.vehicles.plausible import implausible_values
from models.vehicles.plausible_plane import implausible_plane_values
from models.vehicles.vehicle_file import SHIPPED_FOLDER, load_vehicle, shipped_vehicles
from studies.command.asked import input_findings_of, load_scene
from validation.common.scenes import road_scene

TWIN, DURATION, PERIOD = asymmetric_twin.PARAMETERS, 20.0, 1e-3
WHEELS = np.array([TWIN.m1, TWIN.m2]) * TWIN.g
LOADS = TWIN.m3 * TWIN.g * np.array([TWIN.a, TWIN.b]) / (TWIN.a + TWIN.b) + WHEELS
SIGNALS = tuple(
    (MeasuredSignal(axle, "f.csv", axle, "force", axle, "z", "inertial", 1, "N", 1.0),) for axle in ("front", "rear")
)


@cache
def true(road=("hills", 0.0), duration=DURATION):
    """Wheel forces (n, 2) and pitch (n,) of the asymmetric vehicle on a road, up to a grade (rad)."""
    source, grade = road
    table = {"source": source, "speed": 20.0} | ({"grade": grade} if grade else {})
    run = simulate(road_scene("asymmetric_twin", PERIOD, duration, table), "reference")
    return np.column_stack([run["f1"], run["f2"]]), run["pitch"]


def judged(forces, turn=False, parameters=TWIN) -> list[Finding]:
    lasted = PERIOD * (len(forces) - 1)
    own = AxleForces(
        np.ascontiguousarray(forces), PERIOD, parameters, SIGNALS, lasted, FILE_REMEDIES, turns_with_chassis=turn
    )
    return [finding for finding in check_axle_forces(own) if finding.weight != "note"]


FAULTS = {
    "both signs": (lambda f: -f, "error", "sign"),
    "front sign": (lambda f: f * [-1, 1], "error", "sign"),
    "rear sign": (lambda f: f * [1, -1], "error", "sign"),
    "kN": (lambda f: f / 1e3, "error", "unit"),
    "daN": (lambda f: f / 10, "error", "unit"),
    "rear in kN": (lambda f: f * [1, 1e-3], "error", "unit"),
    "exchanged": (lambda f: f[:, ::-1], "error", "swapped"),
    "no static load": (lambda f: f - LOADS, "error", "weight"),
    "no static load in front": (lambda f: f - LOADS * [1, 0], "error", "weight"),
    "without the wheels' weight": (lambda f: f - WHEELS, "error", "weight"),
    "one wheel of each axle": (lambda f: f / 2, "error", "weight"),
    "twice": (lambda f: f * 2, "error", "weight"),
    "15 % low": (lambda f: f * 0.85, "error", "weight"),
    "5 % low": (lambda f: f * 0.95, "doubt", "weight"),
    "2 % high": (lambda f: f * 1.02, "doubt", "weight"),
    "front 2 % high": (lambda f: f * [1.02, 1], "doubt", "balance"),
    "offset at the rear": (lambda f: f + np.array([0, 60.0]), "doubt", "balance"),
    "front constant": (lambda f: np.column_stack([np.full(len(f), LOADS[0]), f[:, 1]]), "doubt", "balance"),
    "one channel twice": (lambda f: f[:, [0, 0]] * [1, LOADS[1] / LOADS[0]], "doubt", "copied"),
    "no value": (lambda f: np.where(np.arange(len(f))[:, None] == 500, 9.9e34, f), "error", "weight"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_wheel_forces_that_cannot_be_are_named(name):
    fault, weight, kind = FAULTS[name]
    found = judged(fault(true()[0]))
    assert found and (found[0].weight, found[0].check) == (weight, kind), found


def test_times_in_milliseconds_under_seconds_are_doubted():
    """A run would take ten of ten thousand samples, each a second long."""
    forces, lasted = true()[0], 20.0
    for period, said in ((1e3 * PERIOD, ["times"]), (PERIOD, [])):
        own = AxleForces(forces, period, TWIN, SIGNALS, lasted, FILE_REMEDIES)
        assert [finding.check for finding in check_axle_forces(own) if finding.weight == "doubt"] == said
    few = AxleForces(np.tile(LOADS, (5, 1)), 1000.0, TWIN, SIGNALS, lasted, FILE_REMEDIES)  # a constant load, as meant
    assert not [finding for finding in check_axle_forces(few) if finding.check == "times"]


def test_doubts_about_a_vehicle_stand_beside_its_refusal(twinrig, capsys):
    """Only they tell why the step is too long: the chassis weighs a kilogram."""
    assert twinrig("run", "release", "--set", "vehicle.override={m3=1.35}", "--set", "run.step=2e-3") == 2
    *doubts, refused = capsys.readouterr().err.splitlines()
    assert "in kg, not in tonnes" in doubts[0] and "stability limit" in refused


def test_a_wheel_that_carries_nothing_is_told_and_ends_no_run(twinrig, capsys, tmp_path):
    """The centre of mass lies ahead of both axles: the rear wheel pulls on the road."""
    vehicle = (SHIPPED_FOLDER / "half_car.toml").read_text()
    ahead = vehicle.replace("position = [-0.011052666963241803,", "position = [5.0,")
    assert ahead != vehicle
    (tmp_path / "car.toml").write_text(ahead)
    (tmp_path / "s.toml").write_text(
        'title = "t"\nsystem = "ride"\n[vehicle]\nfile = "car.toml"\n[speeds]\nvalues = [20.0]\n'
    )
    assert twinrig("run", str(tmp_path / "s.toml"), "--engine", "reference", "--out", str(tmp_path / "out")) == 0
    said = capsys.readouterr().out
    assert "the wheel pulls on the road" in said and "tyre force rear left has no load to carry" in said


def test_the_fall_that_is_told_is_that_of_the_run():
    found = judged(0.95 * true()[0])[0]
    fall = 0.05 * 9.81 * DURATION**2 / 2
    told = float(found.text.split("falls ")[1].split(" m")[0])
    assert told == pytest.approx(fall, rel=0.05)


@pytest.mark.parametrize("road", [("hills", 0.0), ("study", 0.0), ("hills", 0.1), ("study", -0.1)])
def test_true_forces_raise_nothing(road):
    """Hills, a rough road, grades up and down, with white noise of 0.2 % of the largest force, and 0.1 % low."""
    forces, pitch = true(road)
    noise = np.random.default_rng(3).standard_normal(forces.shape) * 0.002 * abs(forces).max()
    assert not judged(forces) and not judged(forces + noise) and not judged(0.999 * forces)
    # forces along the chassis carry less upwards on a grade: told at the most
    assert all(finding.weight == "doubt" for finding in judged(forces / np.cos(pitch)[:, None], turn=True))


def test_short_files_of_true_forces_raise_nothing():
    for duration in (0.5, 1.0, 3.0):
        assert not judged(true(("study", 0.0), duration)[0])


def test_time_that_runs_backwards_is_told():
    found = judged(true(("study", 0.0))[0][::-1])
    assert found and all(finding.weight == "doubt" for finding in found)


def scene(folder, forces, extra=""):
    """A scene of wheel forces in a file."""
    write_time_series(folder / "f.csv", {"front": ("N", forces[:, 0]), "rear": ("N", forces[:, 1])}, PERIOD)
    (folder / "s.toml").write_text(
        f'title = "t"\n[vehicle]\nparameters = "asymmetric_twin"\n[run]\nduration = {PERIOD * (len(forces) - 1):g}\n'
        f'step = 1e-3\n[effects.wheel_forces]\nfile = "f.csv"\ninterpolation = "linear"\n{extra}'
    )
    return load_scene(str(folder / "s.toml"), [])


def test_a_doubt_is_printed_saved_and_taken_into_the_trust(tmp_path):
    own = scene(tmp_path, 0.95 * true()[0])
    assert ["falls" in finding.text for finding in input_findings_of(own)] == [True]
    result = simulate(own, "reference")
    assert "falls" in json.loads(result.data.attrs["doubts"])[0] and "doubt" in result.data.attrs["status"]
    assert abs(result["z3"][-1]) > 80.0  # as the doubt says
    from models.systems.pitch_plane.plan import trust_line
    from models.systems.pitch_plane.scene import assembly_of_scene

    assert "mean of the wheel forces" in trust_line(assembly_of_scene(own))[0]
    accepted = scene(tmp_path, 0.95 * true()[0], 'accept = ["weight"]\n')
    assert not input_findings_of(accepted)


@pytest.mark.parametrize("unit, said", [("s", "head the column time"), ("ms", "correct the unit")])
def test_a_prescribed_pitch_with_times_of_another_unit_is_told(tmp_path, unit, said):
    """Twenty of its 20,000 samples made a pitch that nobody had measured."""
    forces, pitch = true(("study", 0.0))
    times = PERIOD * np.arange(len(pitch)) * {"s": 1e3, "ms": 1.0}[unit]
    rows = "\n".join(f"{time:.9g},{value:.9g}" for time, value in zip(times, pitch, strict=True))
    (tmp_path / "p.csv").write_text(f"time [{unit}],pitch [rad]\n{rows}\n")
    try:
        told = [
            f.text for f in input_findings_of(scene(tmp_path, forces, '[effects.prescribed_pitch]\nfile = "p.csv"\n'))
        ]
    except InputError as error:
        told = [str(error)]
    assert len(told) == 1 and said in told[0]


SAMPLES = {
    "spikes": lambda f: np.where(np.arange(len(f))[:, None] == 700, [60e3, 0.0], 0.0) + f,
    "clipped": lambda f: np.minimum(f, np.quantile(f, 0.98, axis=0)),
}


@pytest.mark.parametrize("kind", SAMPLES)
def test_samples_that_no_wheel_felt_are_doubted_as_in_a_recording(kind, tmp_path):
    own = scene(tmp_path, SAMPLES[kind](true(("study", 0.0))[0]))
    found = input_findings_of(own)
    assert found and all({"spikes": "spike(s)", "clipped": "is clipped at"}[kind] in finding.text for finding in found)
    assert not input_findings_of(scene(tmp_path, SAMPLES[kind](true(("study", 0.0))[0]), f'accept = ["{kind}"]\n'))
    assert not input_findings_of(scene(tmp_path, true(("study", 0.0))[0]))


def test_a_file_that_is_far_too_short_may_be_in_seconds_under_milliseconds(tmp_path):
    scene(tmp_path, true(("study", 0.0))[0])
    path = tmp_path / "f.csv"
    path.write_text(path.read_text().replace("time [s]", "time [ms]"))
    with pytest.raises(InputError, match=r"ends at 0\.02 s, but .* in seconds, not in milliseconds"):
        input_findings_of(load_scene(str(tmp_path / "s.toml"), []))


@pytest.mark.parametrize("late", [0.0, 0.05])
def test_the_trust_says_that_a_late_axle_was_not_looked_for(tmp_path, late, twinrig, capsys):
    """Speed is not known: the rear axle 50 ms late is that of a slower vehicle."""
    forces, shift = true(("study", 0.0))[0], round(late / PERIOD)
    moved = np.column_stack([forces[shift:, 0], forces[: len(forces) - shift, 1]])
    scene(tmp_path, moved)
    assert twinrig("show", str(tmp_path / "s.toml")) == 0
    (trust,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("  trust"))
    assert "not checked: whether an axle is late" in trust and "kalman_filter" in trust
    told = float(trust.split("right for about ")[1].split(" m/s")[0])
    assert told == pytest.approx(2.1 / (2.1 / 20.0 + late), rel=0.1)


def test_an_error_refuses_the_run_unless_it_is_accepted(tmp_path):
    with pytest.raises(InputError, match=r'sign is wrong.*accept = \["sign"\]'):
        simulate(scene(tmp_path, -true()[0]), "reference")
    simulate(scene(tmp_path, -true()[0][:301], 'accept = ["sign", "weight"]\n'), "reference")


def test_shipped_vehicles_raise_no_query():
    assert not [
        finding for name in shipped_vehicles() for finding in implausible_values(load_vehicle(name, allows_towing=True))
    ]
    assert not implausible_plane_values(itwm_drift.PARAMETERS) and not implausible_plane_values(TWIN)


PLANE = {
    "chassis in tonnes": ({"m3": 1.35}, "mass"),
    "all in tonnes": ({"m3": 1.35, "m1": 0.04, "m2": 0.05}, "mass"),
    "wheelbase in mm": ({"a": 1300.0, "b": 800.0}, "size"),
    "inertia in t m^2": ({"I": 0.54}, "inertia"),
    "springs in N/mm": ({"k3": 90.0, "k4": 120.0}, "frequency"),
    "tyres in N/mm": ({"k1": 190.0}, "frequency"),
    "dampers in N s/mm": ({"d3": 9.0, "d4": 12.0}, "damping"),
    "a wheel in tonnes": ({"m1": 0.014}, "frequency"),
}


@pytest.mark.parametrize("name", PLANE)
def test_parameters_of_no_vehicle_are_queried(name):
    change, kind = PLANE[name]
    found = implausible_plane_values(TWIN.model_copy(update=change))
    assert kind in {finding.check for finding in found} and all(finding.weight == "doubt" for finding in found)
    assert kind not in {finding.check for finding in implausible_plane_values(TWIN.model_copy(update=change), [kind])}


def car():
    return load_vehicle("seven_freedoms")


def body(vehicle, name, **changes):
    return replace(vehicle, bodies=tuple(replace(b, **changes) if b.name == name else b for b in vehicle.bodies))


def spring(vehicle, name, **changes):
    return replace(vehicle, springs=tuple(replace(s, **changes) if s.name == name else s for s in vehicle.springs))


SPACE = {
    "mass in tonnes": (lambda v: body(v, "body", mass=1.0857), "mass"),
    "centre beyond the front axle": (lambda v: body(v, "body", position=(1.6, 0.0, 0.6)), "load"),
    "centre at the left wheels": (lambda v: body(v, "body", position=(0.0, 0.55, 0.6)), "load"),
    "a strut on the other side": (
        lambda v: spring(v, "front left", first_point=(1.156, -0.69, 0.344), second_point=(1.156, -0.69, 0.344)),
        "strut",
    ),
    "a strut in mm": (
        lambda v: spring(v, "front left", first_point=(1156.0, 0.69, 0.344), second_point=(1156.0, 0.69, 0.344)),
        "strut",
    ),
    "a corner without a strut": (
        lambda v: replace(v, springs=tuple(s for s in v.springs if s.name != "front left")),
        "strut",
    ),
    "a damper alone": (lambda v: spring(v, "front left", stiffness=0.0), "strut"),
    "a tyre in N/mm": (
        lambda v: replace(v, tyres=tuple(replace(t, stiffness=158.0) if t.name == "fl" else t for t in v.tyres)),
        "stiffness",
    ),
    "height in mm": (lambda v: body(v, "body", position=(-0.01, 0.0, 613.7)), "size"),
    "inertia in kg mm^2": (
        lambda v: body(v, "body", inertia=((2.2e8, 0.0, 0.0), (0.0, 1.6e9, 0.0), (0.0,) * 3)),
        "inertia",
    ),
}


@pytest.mark.parametrize("name", SPACE)
def test_vehicles_that_no_one_builds_are_queried(name):
    fault, kind = SPACE[name]
    assert kind in {finding.check for finding in implausible_values(fault(car()))}


def test_a_whole_row_without_a_line_end_is_read_and_remarked_on(tmp_path):
    forces = true()[0][:2001]
    own = scene(tmp_path, forces)
    path = tmp_path / "f.csv"
    path.write_text(path.read_text().rstrip("\n"))
    assert not has_line_end(path)
    values, _ = read_time_series(path, {"front": {"N": 1.0}, "rear": {"N": 1.0}})
    np.testing.assert_array_equal(values, forces)
    notes = [finding for finding in input_findings_of(own) if finding.check == "file"]
    assert len(notes) == 1 and notes[0].weight == "note" and "no line end" in notes[0].text


@pytest.mark.parametrize("kept", [",", "2", ",3"])
def test_a_last_number_that_was_cut_off_is_refused(tmp_path, kept):
    rows = [f"{i * 1e-3:.3f},3000.{i:02d},2000.{i:02d}" for i in range(20)]
    cut = {",": "0.020,3000.20", "2": "0.020,3000.20,2", ",3": "0.020,3"}[kept]
    (tmp_path / "f.csv").write_text("\n".join(["time [s],front [N],rear [N]", *rows, cut]))
    with pytest.raises(InputError, match="no line end and was cut off"):
        read_time_series(tmp_path / "f.csv", {"front": {"N": 1.0}, "rear": {"N": 1.0}})


TRUCKS = {
    "mass=1e7": ["mass", "inertia"],
    "yaw_inertia=2.5e-2": ["inertia"],
    "height=120.0": ["size"],
    "front={radius=50.0}": ["size"],
    "rear={x=-2190.0}": ["size", "inertia"],
}


@pytest.mark.parametrize("change", TRUCKS)
def test_a_truck_that_no_one_builds_is_queried(change):
    """One of 10,000 t braked without a word."""
    own = load_scene("braking", [f"vehicle.override={{{change}}}"])
    assert [finding.check for finding in input_findings_of(own)] == TRUCKS[change]
    accepted = load_scene("braking", [f"vehicle.override={{{change}}}", f"vehicle.accept={TRUCKS[change]}"])
    assert not input_findings_of(accepted) and not input_findings_of(load_scene("braking", []))


@pytest.mark.parametrize("radius, said", [(1e-4, 1), (2e-3, 0), (0.46, 0)])
def test_a_contact_as_large_as_its_body_is_doubted(radius, said):
    found = input_findings_of(load_scene("contact_ellipse", [f"radii.wheel_x={radius}"]))
    assert ["radii.wheel_x" in finding.text and finding.weight for finding in found] == ["doubt"] * said
