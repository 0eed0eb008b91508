"""Virtual accelerometers: what they read on a vehicle, on a bracket, and that they change nothing."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.time_series import write_time_series
from models.sensors import rigid_body_motion, sensor_array
from models.sensors.sensor_array import reading_on_bracket, sensor_readings
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build
from validation.hard_cases import accelerometers as family
from validation.hard_cases.case import judge

ENGINES = ("reference", "exudyn", "mujoco")
SENSORS = {"front": {"x": 1.1, "y": 0.6, "z": 0.2}, "rear": {"x": -0.9, "z": -0.3}}

BARE = {
    "title": "test",
    "vehicle": {"parameters": "asymmetric_twin"},
    "start": {"pitch": 0.1, "z3": -0.1},
    "run": {"duration": 0.2, "step": 5e-4},
}
EXCITED = {
    "free": {},
    "road": {"road": {"source": "study", "speed": 20.0}},
    "spring": {"pitch_spring": {"stiffness": 2e4, "damping": 1e3}},
}


def scene(sensors=SENSORS, effects=None, rate=1000.0, **other):
    own = {"sampling_rate": rate, "sensors": sensors, **other}
    return build(BARE | {"effects": {"accelerometers": own, **(effects or {})}})


def still(pitch, places=((1.0, 0.0, 0.2),)):
    none = np.zeros(1)
    return sensor_readings(np.array(places), np.array([pitch]), none, none, none, 9.81)[0]


@pytest.mark.grounds("closed form")
def test_at_rest_they_read_gravity():
    assert still(0.0)[0] == pytest.approx([0.0, 0.0, -9.81])
    # nose up: the reaction to gravity points up, so forward along the chassis
    assert still(0.1)[0] == pytest.approx([9.81 * np.sin(0.1), 0.0, -9.81 * np.cos(0.1)])


@pytest.mark.grounds("closed form")
def test_a_pitch_acceleration_lifts_the_front_and_a_rate_pulls_inwards():
    one, none = np.ones(1), np.zeros(1)
    places = np.array([[2.0, 0.0, -0.5]])
    assert sensor_readings(places, none, none, none, one, 0.0)[0, 0] == pytest.approx([-0.5, 0.0, -2.0])
    assert sensor_readings(places, none, 3 * one, none, none, 0.0)[0, 0] == pytest.approx([-18.0, 0.0, 4.5])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("effects", EXCITED.values(), ids=EXCITED)
def test_readings_are_the_second_derivative_of_a_point_of_the_run(engine, effects):
    """Not by any acceleration: the point's global position is differentiated twice."""
    run = simulate(scene(effects=effects), engine)
    pitch, period = run["pitch"], 1e-3
    sine, cosine = np.sin(pitch), np.cos(pitch)
    x, z = SENSORS["front"]["x"], SENSORS["front"]["z"]
    place = np.column_stack([cosine * x + sine * z, run["z3"] - sine * x + cosine * z])[::2]
    second = (-place[:-4] + 16 * place[1:-3] - 30 * place[2:-2] + 16 * place[3:-1] - place[4:]) / (12 * period**2)
    force = second - [0.0, 9.81]
    rows = slice(4, -4, 2)
    local = np.column_stack(
        [cosine[rows] * force[:, 0] - sine[rows] * force[:, 1], sine[rows] * force[:, 0] + cosine[rows] * force[:, 1]]
    )
    felt = np.column_stack([run["ax1"], run["az1"]])[rows]
    # fourth-order differences across the fastest poles, 1/ms and faster, once the start has rung off
    assert np.abs(local - felt)[60:].max() < 2e-3 * np.abs(felt).max()
    assert np.abs(run["ay1"]).max() < 1e-14


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
@pytest.mark.parametrize("guide", [{}, {"prescribed_heave_and_pitch": {"file": "m.csv"}}], ids=["body frame", "guided"])
def test_readings_follow_the_run_whatever_drives_it(engine, guide, tmp_path):
    """Two sensors ahead of one another give heave and pitch acceleration, whatever else acts: against differences."""
    t = 1e-3 * np.arange(301)
    write_time_series(
        tmp_path / "f.csv",
        {"front": ("N", 4200 + 800 * np.sin(9 * t)), "rear": ("N", 3300 + 500 * np.cos(7 * t))},
        1e-3,
    )
    write_time_series(
        tmp_path / "m.csv",
        {"z3": ("m", 0.06 + 0.01 * np.sin(np.pi * t) ** 2), "pitch": ("rad", 0.05 * (1 - np.cos(8 * t)))},
        1e-3,
    )
    forces = {"file": "f.csv", "interpolation": "linear", "frame": "inertial" if guide else "body"}
    two = {"sampling_rate": 1000.0, "sensors": {"middle": {"x": 0.0, "z": 0.0}, "ahead": {"x": 1.0, "z": 0.0}}}
    run = simulate(
        build(BARE | {"start": {}, "effects": {"wheel_forces": forces, "accelerometers": two, **guide}}, "", tmp_path),
        engine,
    )
    heave = 9.81 + np.cos(run["pitch"]) * run["az1"] - np.sin(run["pitch"]) * run["ax1"]
    for found, rate in ((heave, run["z3_rate"]), (run["az1"] - run["az2"], run["pitch_rate"])):
        slope = np.gradient(rate, run.times)
        # second-order differences at 0.5 ms, once the start has rung off
        assert np.abs(found - slope)[200:-4:2].max() < 2e-4 * np.abs(slope).max()


def test_three_engines_read_the_same_and_are_not_disturbed():
    runs = [simulate(scene(), engine) for engine in ENGINES]
    for run in runs[1:]:
        for channel in ("ax1", "az1", "ax2", "az2"):
            assert np.abs(run[channel] - runs[0][channel]).max() < 1e-9  # accelerations of 20 m/s^2
    for engine, run in zip(ENGINES, runs, strict=True):
        plain = simulate(build(BARE), engine)
        assert np.array_equal(plain.states, run.states) and "ax1" not in plain.data


def test_samples_are_held_and_noise_belongs_to_them():
    clean, noisy = (simulate(scene(rate=200.0, deviation=size), "reference") for size in (0.0, 0.3))
    assert (np.diff(noisy["az1"]) != 0).sum() == 40  # new samples in 0.2 s
    noise = np.concatenate([(noisy[f"a{x}{i}"] - clean[f"a{x}{i}"])[::10] for x in "xyz" for i in (1, 2)])
    # 246 samples: 4.5 % standard error
    assert noise.std() == pytest.approx(0.3, rel=0.15)


def test_a_bracket_answers_a_ramp_exactly():
    """u'' + 2 zeta w u' + w^2 u = -t: the sensor lags, rings and catches up; exact at any period."""
    frequency, damping = 20.0, 0.1
    w0 = 2 * np.pi * frequency
    wd, sigma = w0 * np.sqrt(1 - damping**2), damping * w0
    for period in (1e-4, 1e-3, 2e-2):
        t = period * np.arange(round(0.4 / period) + 1)
        got = reading_on_bracket(np.column_stack([t, 2 * t, 0 * t]), period, frequency, damping)
        # passed on: (2 zeta w0 s + w0^2) / (s^2 (s^2 + 2 zeta w0 s + w0^2)) = 1/s^2 - 1 / (s^2 + 2 zeta w0 s + w0^2)
        truth = t - np.exp(-sigma * t) * np.sin(wd * t) / wd
        assert np.abs(got[:, 0] - truth).max() < 1e-12 and np.abs(got[:, 1] - 2 * truth).max() < 1e-12


def test_a_stiff_bracket_is_a_rigid_mount_and_gravity_passes():
    still_ = np.tile([0.1, 0.0, -9.81], (100, 1))
    assert np.abs(reading_on_bracket(still_, 1e-3, 5.0, 0.0) - still_).max() < 1e-9
    moved = np.sin(0.02 * np.arange(500))[:, None] * [1.0, 0.0, 0.5]  # 3 Hz at 1 kHz
    assert np.abs(reading_on_bracket(moved, 1e-3, 3000.0, 0.7) - moved).max() < 1e-3


@pytest.mark.parametrize(
    ("own", "words"),
    [
        ({"sensors": {}}, "sensors"),
        ({"sensors": {"a": {"x": 1.0}}}, "sensors.a.z"),
        ({"sensors": {"a": {"x": 1.0, "z": 0.0, "height": 2.0}}}, "unknown key"),
        ({"sensors": {"a": {"x": 1.0, "z": float("nan")}}}, "sensors.a.z"),
        ({"sensors": {"a": {"x": 1.0, "z": 0.0, "bracket": {"frequency": -3.0, "damping": 0.1}}}}, "bracket.frequency"),
        ({"rate": 700.0}, "sampling_rate"),
    ],
)
def test_bad_scenes_are_one_clear_message(own, words):
    with pytest.raises(InputError, match=words):
        simulate(scene(**own), "reference")


def outcome(name, folder):
    return judge(next(case for case in family.CASES if case.name == name), "mujoco", folder).word


def test_without_the_check_of_the_arrangement_a_plane_is_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(sensor_array, "PLANE_SPREAD_RATIO", 0.0)
    monkeypatch.setattr(sensor_array, "FLAT_SPREAD_RATIO", 0.0)
    assert outcome("accelerometers nearly in a plane", tmp_path) == "SILENT"


def test_without_the_consistency_figure_a_loose_sensor_is_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(rigid_body_motion, "UNEXPLAINED_SHARE_LIMIT", 1.0)
    assert outcome("accelerometer on a bracket", tmp_path) == "SILENT"
