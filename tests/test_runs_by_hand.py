"""Runs of whole scenes, from the scene's table to the labelled result, by closed forms at rest, at the start and on a
road that is written out."""

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from models.core.systems import of_table
from models.road.iso8608 import random_phases
from models.road.profile import SineProfile
from models.road.study import study_road
from models.systems import run
from models.vehicles.parameters import asymmetric_twin
from models.vehicles.vehicle_file import load_vehicle

pytestmark = pytest.mark.grounds("closed form")
P = asymmetric_twin.PARAMETERS
FRONT, REAR = P.m3 * P.g * P.a / (P.a + P.b), P.m3 * P.g * P.b / (P.a + P.b)
"""N: weight of the chassis on each suspension, by the moment about the other."""
PLANE_ENGINES = ("reference", "exudyn", "mujoco")
R19 = load_vehicle("r19_free")


def plane_run(engine, start=None, effects=None, duration=0.02):
    """A run of the asymmetric vehicle in the pitch plane in steps of 1 ms."""
    table = {"title": "t", "vehicle": {"parameters": "asymmetric_twin"}, "run": {"duration": duration, "step": 1e-3}}
    return run(of_table({**table, "start": start or {}, "effects": effects or {}}, "s.toml", Path()), engine)


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_a_vehicle_at_rest_stays_on_springs_that_bear_its_weight(engine):
    result = plane_run(engine)
    z1, z2 = (FRONT + P.m1 * P.g) / P.k1, (REAR + P.m2 * P.g) / P.k2
    sine = (z2 + REAR / P.k4 - z1 - FRONT / P.k3) / (P.a + P.b)
    rest = {"z1": z1, "z2": z2, "z3": z1 + FRONT / P.k3 + P.b * sine, "pitch": math.asin(sine)}
    forces = {"f1": FRONT + P.m1 * P.g, "f2": REAR + P.m2 * P.g, "f3": FRONT, "f4": REAR}
    for name, value in (rest | forces).items():
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


@pytest.mark.parametrize("engine", PLANE_ENGINES)
def test_wheels_pass_the_road_at_the_speed_of_the_scene_one_wheelbase_apart(engine):
    speed, duration = 20.0, 0.3
    result = plane_run(engine, None, {"road": {"source": "study", "speed": speed}}, duration)
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
    manoeuvre = {"speed": 20.0, "duration": 0.02, "steer": [[0.0, 0.02]], "brake": [[0.0, 1000.0]], "front_brake": 0.7}
    table = {"title": "t", "system": "handling", "tyres": {"cells": 5, "cornering": [1.25, 0.75]}}
    return of_table({**table, "manoeuvres": {"turn": {**manoeuvre, **changes}}}, "s.toml", Path())


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_manoeuvre_begins_with_the_speed_the_steering_and_the_weight_of_its_car(engine):
    result = run(turn(), engine)
    loads, steer = result["load"][0], result["steer"][0]
    weight = 9.81 * sum(body.mass for body in R19.bodies)
    assert loads.sum() == pytest.approx(weight, rel=1e-9)
    assert steer == pytest.approx([0.02 if tyre.name.startswith("f") else 0.0 for tyre in R19.tyres], rel=1e-12)
    assert result["forward speed"][0] == pytest.approx(20.0, rel=1e-12)
    assert result.times == pytest.approx(1e-3 * np.arange(21), abs=1e-12)
    # braking and the tyres' forces take less than 10 m/s^2
    assert result["positions"][-1, 0] == pytest.approx(20.0 * 0.02, abs=0.5 * 10.0 * 0.02**2)
    assert result["side slip"][0] == 0.0


def test_a_scene_of_handling_reads_controls_and_ratios_as_they_are_written():
    scene = turn(drive=[[0.0, 0.0], [0.01, 500.0]], front_drive=0.25)
    given, controls = scene.given(), scene.manoeuvres["turn"].controls()
    front = {tyre.name for tyre in R19.tyres if tyre.axle == 0}
    for mine, files in zip(given.side_forces, R19.side_forces, strict=True):
        assert mine.stiffness == pytest.approx((1.25 if files.name in front else 0.75) * files.stiffness, rel=1e-12)
    assert (controls.steer, controls.brake) == (((0.0, 0.02),), ((0.0, 1000.0),))
    assert controls.drive == ((0.0, 0.0), (0.01, 500.0))
    assert (controls.front_brake, controls.front_drive) == (0.7, 0.25)
    car = asdict(scene.handling("turn").tyres)
    assert (car["friction"], car["half_width"], car["spin_inertia"]) == (0.9, 0.09, 1.7)
