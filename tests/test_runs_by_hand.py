"""Runs of whole scenes, from the scene's table to the labelled result, by closed forms at rest, at the start and on a
road that is written out."""

import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from models.core.systems import scene_of_table
from models.core.time_series import write_time_series
from models.engines.cut_vehicle import HubModel
from models.road.iso8608 import iso8608_road, random_phases
from models.road.profile import SineProfile
from models.road.study import study_road
from models.systems import run
from models.systems.hub_forces.measurement import recorded_measurement, road_under_wheels
from models.systems.hub_forces.run import measure
from models.systems.hub_forces.tilt_filter import StatedDeviations, estimate_tilt
from models.vehicles.parameters import asymmetric_twin
from models.vehicles.vehicle_file import load_vehicle
from validation.absence.hub_forces import BARE_SCENE, HUBS, ON_ROAD, SAMPLE_PERIOD, STEP, STEP_COUNT, write
from validation.spatial.cars import r19
from validation.spatial.hub_inputs import centres_of_mass

pytestmark = pytest.mark.grounds("closed form")
P = asymmetric_twin.PARAMETERS
FRONT, REAR = P.m3 * P.g * P.a / (P.a + P.b), P.m3 * P.g * P.b / (P.a + P.b)
"""N: weight of the chassis on each suspension, by the moment about the other."""
Z1, Z2 = (FRONT + P.m1 * P.g) / P.k1, (REAR + P.m2 * P.g) / P.k2
SINE = (Z2 + REAR / P.k4 - Z1 - FRONT / P.k3) / (P.a + P.b)
REST = {"z1": Z1, "z2": Z2, "z3": Z1 + FRONT / P.k3 + P.b * SINE, "pitch": math.asin(SINE)}
"""m, rad: positions at rest, by the springs in a row."""
PLANE_ENGINES = ("reference", "exudyn", "mujoco")
R19 = load_vehicle("r19_free")


def plane_run(engine, start=None, effects=None, duration=0.02):
    """A run of the asymmetric vehicle in the pitch plane in steps of 1 ms."""
    table = {"title": "t", "vehicle": {"parameters": "asymmetric_twin"}, "run": {"duration": duration, "step": 1e-3}}
    return run(scene_of_table({**table, "start": start or {}, "effects": effects or {}}, "s.toml", Path()), engine)


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_a_vehicle_at_rest_stays_on_springs_that_bear_its_weight(engine):
    result = plane_run(engine)
    forces = {"f1": FRONT + P.m1 * P.g, "f2": REAR + P.m2 * P.g, "f3": FRONT, "f4": REAR}
    for name, value in (REST | forces).items():
        assert result[name] == pytest.approx(value, rel=1e-9), name
    assert np.abs(result["suspension_moment"]).max() < 1e-7 * FRONT
    assert result.times == pytest.approx(1e-3 * np.arange(21), abs=1e-12)


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_a_run_begins_where_its_scene_says_with_the_forces_of_its_springs_there(engine):
    start = {"z1": 0.02, "z2": 0.03, "z3": 0.15, "pitch": 0.1}
    rates = {"z1_rate": 0.2, "z2_rate": -0.3, "z3_rate": 0.4, "pitch_rate": 0.5}
    result = plane_run(engine, {**start, **rates})
    sine, cosine = math.sin(0.1), math.cos(0.1)
    front = P.k3 * (0.15 - P.b * sine - 0.02) + P.d3 * (0.4 - P.b * cosine * 0.5 - 0.2)
    rear = P.k4 * (0.15 + P.a * sine - 0.03) + P.d4 * (0.4 + P.a * cosine * 0.5 + 0.3)
    forces = {"f1": P.k1 * 0.02 + P.d1 * 0.2, "f2": P.k2 * 0.03 - P.d2 * 0.3, "f3": front, "f4": rear}
    moment = {"suspension_moment": cosine * (P.b * front - P.a * rear)}
    for name, value in (start | rates | forces | moment).items():
        assert result[name][0] == pytest.approx(value, rel=1e-12), name


SENSED = {"gyro": {"sampling_rate": 1000.0, "deviation": 0.0}}
ACCELERATIONS = {"accelerometers": {"sampling_rate": 1000.0, "sensors": {"one": {"x": 1.3, "z": 0.21}}}}
BIASED = SENSED | {"gyro_bias": {"turn_on": 10.0, "instability": 3.0, "correlation_time": 0.1}}
EFFECTS = [SENSED, BIASED, {"lift_off": {}}, ACCELERATIONS, {"pitch_spring": {"stiffness": 300.0}}]


@pytest.mark.parametrize("effects", EFFECTS, ids=[list(effects)[-1] for effects in EFFECTS])
def test_what_a_scene_adds_leaves_the_vehicle_where_it_rests(effects):
    result = plane_run("reference", None, effects)
    assert {name: result[name][0] for name in REST} == pytest.approx(REST, rel=1e-12)


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_an_accelerometer_at_rest_reads_gravity_along_the_axes_of_the_chassis(engine):
    result = plane_run(engine, None, ACCELERATIONS)
    assert np.hypot(result["ax1"], result["az1"]) == pytest.approx(P.g, rel=1e-9)
    assert np.abs(result["ax1"]) == pytest.approx(P.g * abs(SINE), rel=1e-6)


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_wheels_pass_the_road_at_the_speed_of_the_scene_one_wheelbase_apart(engine):
    speed, duration = 20.0, 0.3
    result = plane_run(engine, None, {"road": {"source": "study", "speed": speed}}, duration)
    assert {name: result[name][0] for name in REST} == pytest.approx(REST, rel=1e-12)
    road, states = study_road(), {name: result[name] for name in ("z1", "z2", "z1_rate", "z2_rate")}
    for wheel, behind, k, d in (("1", 0.0, P.k1, P.d1), ("2", P.a + P.b, P.k2, P.d2)):
        height, slope = np.array([road.height_slope_at(speed * time - behind) for time in result.times]).T
        assert np.abs(height).max() > 1e-5
        assert result[f"zeta{wheel}"] == pytest.approx(height, abs=1e-12)
        force = k * (states[f"z{wheel}"] - height) + d * (states[f"z{wheel}_rate"] - speed * slope)
        assert result[f"f{wheel}"] == pytest.approx(force, rel=1e-9)


def test_the_finest_detail_of_sines_is_a_quarter_of_the_shortest_wave():
    lengths = np.array([40.0, 0.8, 3.0])
    road = SineProfile(np.full(3, 1e-3), 2.0 * math.pi / lengths, np.zeros(3))
    assert road.finest == pytest.approx(0.2, rel=1e-12)


def test_random_phases_are_even_over_one_turn_and_never_beyond_it():
    phases = random_phases(3, 100_000) / (2.0 * math.pi)
    assert phases.min() >= 0.0 and 0.999 < phases.max() < 1.0
    assert phases.mean() == pytest.approx(0.5, abs=4.0 / math.sqrt(12.0 * phases.size))


def turn(**changes):
    """A car on a flat road, 20 ms, its front wheels and all brakes at once at their values."""
    manoeuvre = {"speed": 20.5, "duration": 0.02, "steer": [[0.0, 0.02]], "brake": [[0.0, 1000.0]], "front_brake": 0.7}
    table = {"title": "t", "system": "handling", "tyres": {"cells": 5, "cornering": [1.25, 0.75]}}
    return scene_of_table({**table, "manoeuvres": {"turn": {**manoeuvre, **changes}}}, "s.toml", Path())


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_manoeuvre_begins_with_the_speed_the_steering_and_the_weight_of_its_car(engine):
    result = run(turn(), engine)
    loads, steer = result["load"][0], result["steer"][0]
    weight = 9.81 * sum(body.mass for body in R19.bodies)
    assert loads.sum() == pytest.approx(weight, rel=1e-9)
    assert steer == pytest.approx([0.02 if tyre.name.startswith("f") else 0.0 for tyre in R19.tyres], rel=1e-12)
    assert result["forward speed"][0] == pytest.approx(20.5, rel=1e-12)
    assert result.times == pytest.approx(1e-3 * np.arange(21), abs=1e-12)
    # braking and the tyres' forces take less than 10 m/s^2
    assert result["positions"][-1, 0] == pytest.approx(20.5 * 0.02, abs=0.5 * 10.0 * 0.02**2)
    assert result["side slip"][0] == 0.0


def test_a_scene_of_handling_reads_controls_and_ratios_as_they_are_written():
    scene = turn(drive=[[0.0, 0.0], [0.01, 500.0]], front_drive=0.25)
    given, controls = scene.file_vehicle(), scene.manoeuvres["turn"].controls()
    front = {tyre.name for tyre in R19.tyres if tyre.axle == 0}
    for mine, files in zip(given.side_forces, R19.side_forces, strict=True):
        assert mine.stiffness == pytest.approx((1.25 if files.name in front else 0.75) * files.stiffness, rel=1e-12)
    assert (controls.steer, controls.brake) == (((0.0, 0.02),), ((0.0, 1000.0),))
    assert controls.drive == ((0.0, 0.0), (0.01, 500.0))
    assert (controls.front_brake, controls.front_drive) == (0.7, 0.25)
    car = asdict(scene.handling("turn").tyres)
    assert (car["friction"], car["half_width"], car["spin_inertia"]) == (0.9, 0.09, 1.7)


CUT = r19()
CUT_MASS = sum(body.mass for body in CUT.tree.bodies)
CUT_ENGINES = ("reference", "exudyn", "mujoco")
GRAVITY = 9.81


@pytest.mark.parametrize("engine", CUT_ENGINES)
def test_hub_forces_of_a_file_move_the_centre_of_mass_as_they_would_a_point(engine, tmp_path):
    """Four forces up, 4 kN and 500 N u^2 by the time u (1 at the end) at the samples, lines between them."""
    write(tmp_path)
    result = run(scene_of_table(BARE_SCENE, "s.toml", tmp_path), engine, method="none")
    samples = 4.0 * (4e3 + 500.0 * np.linspace(0.0, 1.0, round(STEP_COUNT * STEP / SAMPLE_PERIOD) + 1) ** 2)
    time, dense = STEP * STEP_COUNT, 4001
    fine = np.linspace(0.0, time, dense)
    acceleration = np.interp(fine, SAMPLE_PERIOD * np.arange(len(samples)), samples) / CUT_MASS - GRAVITY
    rise = np.trapezoid((time - fine) * acceleration, fine)
    path = centres_of_mass(CUT, result.detail.positions[[0, -1]])
    assert path[1] - path[0] == pytest.approx([0.0, 0.0, rise], abs=1e-6 * abs(rise))
    assert result.times == pytest.approx(STEP * np.arange(STEP_COUNT + 1), abs=1e-12)
    assert result["z"].tolist() == result.detail.positions[:, 2].tolist()


def test_angles_of_a_file_are_those_of_the_run_that_is_held_to_them(tmp_path):
    """Roll and pitch that stay: a low-pass leaves them as they are."""
    write(tmp_path)
    still = np.ones(round(STEP_COUNT * STEP / SAMPLE_PERIOD) + 1)
    units = {"roll": "rad", "pitch": "rad", "roll_rate": "rad/s", "pitch_rate": "rad/s"}
    held = {"roll": 0.02, "pitch": -0.01, "roll_rate": 0.0, "pitch_rate": 0.0}
    columns = {name: (unit, held[name] * still) for name, unit in units.items()}
    write_time_series(tmp_path / "angles.csv", columns, SAMPLE_PERIOD)
    result = run(scene_of_table(BARE_SCENE, "s.toml", tmp_path), "reference", method="prescribed")
    assert result["roll"] == pytest.approx(0.02, rel=1e-9) and result["pitch"] == pytest.approx(-0.01, rel=1e-9)


@pytest.mark.parametrize("engine", CUT_ENGINES)
def test_at_rest_on_the_road_hubs_bear_the_vehicle_and_mounts_what_they_carry(engine):
    scene = scene_of_table({**BARE_SCENE, **ON_ROAD}, "s.toml", Path())
    measured = measure(scene, engine)
    first = measured.forces.samples[0].reshape(len(HUBS), 6)
    assert first[:, 2].sum() == pytest.approx(CUT_MASS * GRAVITY, rel=1e-9)
    assert np.abs(measured.angles.samples[0]).max() < 1e-12
    assert measured.forces.period == pytest.approx(1.0 / scene.forces.sampling_rate, rel=1e-12)
    tracks = road_under_wheels(CUT, *(iso8608_road("C", seed) for seed in (1, 2)), 20.0, STEP, STEP_COUNT)
    direct = HubModel(engine, CUT, replace(tracks, frame="inertial"), scene.settings(engine), scene.run.forces).run()
    assert measured.truth.states == pytest.approx(direct.states, abs=1e-13)
    result = run(scene, engine, method="none", measurement=measured)
    forces = dict(zip(result.data["element"].values.tolist(), result["section_force"][0], strict=True))
    engine_weight = sum(forces[f"{name} mount.z"] for name in ("left", "right", "rear"))
    assert engine_weight == pytest.approx(CUT.tree.body("engine").mass * GRAVITY, rel=1e-9)
    assert forces["left seat"] == pytest.approx(CUT.tree.body("left seat").mass * GRAVITY, rel=1e-9)
    # lines between samples of 2 ms beside the smooth forces of the road, which begins gently: 1e-6 m in 20 ms
    assert result.detail.states == pytest.approx(measured.truth.states, abs=1e-5)


def test_the_filter_of_a_scene_is_told_the_deviations_of_its_scene_and_forces_that_may_lift_bear_the_same():
    table = {**BARE_SCENE, **ON_ROAD, "effects": {"lift_off": {}}}
    table["forces"] = {"frame": "inertial", "noise": "none", "force_deviation": 8.5, "moment_deviation": 1.5}
    table["angles"] = {"noise": "none", "angle_deviation": 2.5e-3, "rate_deviation": 4.5e-3}
    scene = scene_of_table(table, "s.toml", Path())
    measured = measure(scene, "reference")
    first = measured.forces.samples[0].reshape(len(HUBS), 6)
    assert first[:, 2].sum() == pytest.approx(CUT_MASS * GRAVITY, rel=1e-9)
    deviations = StatedDeviations(np.tile([8.5] * 3 + [1.5] * 3, 4), (2.5e-3, 4.5e-3), scene.stabilise.model)
    told = estimate_tilt(CUT, measured.forces, measured.angles, deviations)
    assert measured.tilt.states == pytest.approx(told.states, rel=1e-12, abs=1e-15)
    assert measured.tilt.deviations == pytest.approx(told.deviations, rel=1e-12)


def test_noise_of_hub_forces_and_angles_has_the_deviations_of_its_scene():
    table = {**BARE_SCENE, "road": {}, "run": {"duration": 1.0, "step": 1e-3}}
    noisy = {"frame": "inertial", "sampling_rate": 1000.0, "force_deviation": 80.0, "moment_deviation": 20.0}
    table["angles"] = {"angle_deviation": 0.02, "rate_deviation": 0.3}
    measured = measure(scene_of_table({**table, "forces": noisy}, "s.toml", Path()), "reference")
    forces, angles = recorded_measurement(measured.truth, "inertial", 1)
    noise = (measured.forces.samples - forces.samples).reshape(-1, len(HUBS), 2, 3)
    angles = (measured.angles.samples - angles.samples).reshape(-1, 2, 2)
    # 4 deviations of the deviation of 12,000 and of 2,000 samples: 2.6 % and 6.3 %
    assert noise.std(axis=(0, 1, 3)) == pytest.approx([80.0, 20.0], rel=0.026)
    assert angles.std(axis=(0, 2)) == pytest.approx([0.02, 0.3], rel=0.063)
    assert measured.scene.deviations(CUT).tolist() == 4 * [80.0, 80.0, 80.0, 20.0, 20.0, 20.0]
    assert measured.scene.angles.deviations == (0.02, 0.3)


def test_wheels_pass_their_tracks_at_the_speed_one_after_the_other():
    speed, step, steps = 15.0, 2e-3, 40
    tracks = [iso8608_road("C", seed) for seed in (1, 2)]
    given = road_under_wheels(CUT, *tracks, speed, step, steps)
    count, front = len(CUT.uncut.tyres), max(tyre.point[0] for tyre in CUT.uncut.tyres)
    assert given.hubs.shape == (2 * steps + 1, 2 * count) and given.speed == speed
    for row in (0, 37, 2 * steps):
        for i, tyre in enumerate(CUT.uncut.tyres):
            place = speed * (0.5 * step * row) - (front - tyre.point[0])
            height, slope = tracks[0 if tyre.point[1] > 0.0 else 1].height_slope_at(place)
            assert given.hubs[row, [i, count + i]] == pytest.approx([-height, -speed * slope], abs=1e-12)
