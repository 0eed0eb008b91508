"""Scenes of a wheelset, their studies, and orbits."""

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from models.core.assumptions import broken_assumptions_of
from models.core.errors import InputError, RunFailed
from models.core.scene_effects import named_effects, scene_without
from models.rail import equations as eq
from models.rail.eigenvalues import free_wheelset, largest_growth_rate
from models.rail.equations import WheelsetEquations
from models.rail.flange_climbing import nadal_limit, shares_of_bounds
from models.rail.limit_cycle import (
    attained_limit_cycle,
    branch_of_orbits,
    orbit_of_small_amplitude,
    refined_orbit,
    solved_orbit,
)
from models.rail.linear import NoCriticalSpeed, critical_speed, critical_speed_or_reason
from models.rail.wheelset import CHOSEN_WHEELSET
from models.systems.wheelset import plan
from models.systems.wheelset.of_scene import path_speeds, wheelset_of
from models.systems.wheelset.run import run
from models.systems.wheelset.scene import build
from studies import limit_cycle, wheelset
from validation.absence import wheelset as absence

SCENE = {
    "title": "t",
    "system": "wheelset",
    "contact": {"cells": 11},
    "speeds": {"start": 50.0, "stop": 80.0, "count": 4},
    "run": {"duration": 0.2, "speeds": [60.0]},
}
OWN = "".join(
    f"{key} = {value}\n" for key, value in CHOSEN_WHEELSET.model_dump(exclude={"material", "profiles"}).items()
)


def scene(**tables):
    return build(SCENE | tables, "s.toml")


@pytest.mark.parametrize(
    ("tables", "place", "words"),
    [
        ({"speeds": {"values": [0.0]}}, "speeds.values.0", "above 0"),
        ({"speeds": {"start": 0.0, "stop": 9.0}}, "speeds.start", "above 0"),
        ({"speeds": {"start": 60.0, "stop": 60.0}}, "speeds.stop", "for one speed write speeds.values = [60]"),
        ({"speeds": {"start": 60.0, "stop": 300.0}}, "speeds.stop", "at most 200"),
        ({"run": {"speeds": [-1.0]}}, "run.speeds.0", "above 0"),
        ({"run": {"duration": 1.0, "step": 3e-4}}, "run.step", "divide"),
        ({"run": {"displacement": 0.5}}, "run.displacement", "at most 0.02 m"),
        ({"contact": {"law": "lineer"}}, "contact.law", "did you mean 'linear'"),
        ({"contact": {"law": "linear", "cells": 9}}, "contact.cells", "no meaning"),
        ({"wheelset": {"overide": {}}}, "wheelset.overide", "did you mean 'override'"),
    ],
)
def test_scenes_that_cannot_be(tables, place, words):
    with pytest.raises(InputError, match=r"s\.toml") as told:
        scene(**tables)
    assert told.value.place == place and words in str(told.value)


@pytest.mark.parametrize(
    ("table", "place", "words"),
    [
        ({"override": {"mass": -1.0}}, "wheelset.override.mass", "above 0"),
        ({"override": {"stifness_x": 1e5}}, "wheelset.override.stifness_x", "did you mean 'stiffness_x'"),
        ({"override": {"load": 100.0}}, "wheelset.override", "own weight"),
        ({"parameters": "chosn"}, "wheelset.parameters", "did you mean 'chosen'"),
        ({"parameters": "mine.toml"}, "wheelset.parameters", "no such file"),
    ],
)
def test_wheelsets_that_cannot_be(table, place, words):
    with pytest.raises(InputError, match=r"s\.toml") as told:
        wheelset_of(scene(wheelset=table))
    assert told.value.place == place and words in str(told.value)


def test_a_wheelset_of_ones_own(tmp_path):
    (tmp_path / "mine.toml").write_text(OWN.replace("mass = 1200.0", "mass = 1300.0"))
    own = wheelset_of(build(SCENE | {"wheelset": {"parameters": "mine.toml", "override": {"load": 9e4}}}, "", tmp_path))
    assert own == CHOSEN_WHEELSET.changed(mass=1300.0, load=9e4)
    (tmp_path / "mine.toml").write_text(OWN.replace("mass", "maas"))
    with pytest.raises(InputError, match=r"mine\.toml: maas.*did you mean 'mass'"):
        wheelset_of(build(SCENE | {"wheelset": {"parameters": "mine.toml"}}, "", tmp_path))


def test_a_step_that_is_too_large_is_refused_before_the_run():
    with pytest.raises(InputError, match=r"s.toml: run.step = 0.005: must be above 0 and at most .* at 60 m/s"):
        plan.check(scene(run={"duration": 0.2, "step": 5e-3, "speeds": [60.0]}), ("reference",))


def test_the_plan_says_what_is_absent_and_whether_there_is_a_critical_speed():
    told = plan.describe(scene(contact={"law": "linear"}))
    assert "absent     fastsim" in told and "critical   67.672 m/s" in told
    heavy = {f"{kind}_{axis}": 0.0 for kind in ("stiffness", "damping") for axis in "xyz"}
    heavy |= {"mass": 1e4, "yaw_inertia": 3e4}
    told = plan.describe(scene(wheelset={"override": heavy}))
    assert "nothing: it is free" in told and "unstable at 1 m/s already" in told
    assert "absent     primary_dampers, primary_springs, profiles (not computed)" in told


def test_without_a_critical_speed_the_study_says_so(tmp_path):
    stiff = {"stiffness_x": 1e8, "stiffness_y": 1e8, "damping_x": 1e5, "damping_y": 1e5}
    one = scene(wheelset={"override": stiff}, run={"duration": 0.02, "step": 1e-4})
    assert path_speeds(one) == [80.0]
    assert critical_speed_or_reason(wheelset_of(one), partial(largest_growth_rate, WheelsetEquations))[0] is None
    assert "none: the wheelset is stable up to 200 m/s" in wheelset._stability_lines(wheelset_of(one), {})[1]
    found = limit_cycle.run(scene(wheelset={"override": stiff}, run={}), ("reference",), tmp_path, lambda *_: None)
    assert found["answer"] == {"branch": [], "cycles": {}}
    assert any("no branch begins" in line for line in found["table"])


def test_the_study_saves_what_it_says(tmp_path):
    import xarray as xr

    found = wheelset.run(scene(), ("reference",), tmp_path, lambda *_: None)
    json.dumps({key: value for key, value in found.items() if key != "results"})
    assert found["answer"]["critical_speed"]["reference"] == pytest.approx(67.42, rel=1e-4)
    assert found["answer"]["largest_power"]["reference"] <= 0.0
    with xr.open_dataset(tmp_path / "paths.nc") as data:
        assert data["y"].dims == ("engine", "speed", "time") and data["y"].units == "m"
        assert float(data["y"][0, 0, 0]) == 5e-3
        assert json.loads(data.attrs["scene_table"])["run"]["speeds"] == [60.0] and "provenance" in data.attrs
    with xr.open_dataset(tmp_path / "eigenvalues.nc") as data:
        assert data["real"].shape == (1, 4, 9)
    assert (tmp_path / "over_speed.csv").read_text().startswith("speed [m/s],reference growth [1/s]")


def test_no_critical_speed_is_told_apart():
    with pytest.raises(NoCriticalSpeed) as told:
        critical_speed(
            free_wheelset(CHOSEN_WHEELSET).changed(mass=1e4, yaw_inertia=3e4),
            partial(largest_growth_rate, WheelsetEquations),
        )
    assert told.value.unstable


def test_a_branch_stands_upright_until_flanges_touch():
    first = orbit_of_small_amplitude(WheelsetEquations(CHOSEN_WHEELSET, 60.0, cells=7), 1e-3, 5e-4)
    low, high = branch_of_orbits(first, [5e-3, 7.3e-3])
    assert abs(low.speed - first.speed) < 0.01 < 1.0 < high.speed - low.speed
    assert low.multiplier > 0.99 and high.multiplier < 0.2
    half = refined_orbit(high, "speed")
    assert 0.0 < half.error < 1e-4 * half.speed and half.amplitude == high.amplitude
    path = high.path()
    assert path.states[-1, eq.YAW] == pytest.approx(path.states[0, eq.YAW], abs=1e-11)


def test_orbits_that_are_none():
    assert attained_limit_cycle(WheelsetEquations(CHOSEN_WHEELSET, 40.0, cells=7), initial_displacement=1e-3) is None
    orbit = attained_limit_cycle(WheelsetEquations(CHOSEN_WHEELSET, 75.0, cells=7))
    with pytest.raises(RunFailed, match="no periodic motion"):
        solved_orbit(replace(orbit, equations=WheelsetEquations(CHOSEN_WHEELSET, 20.0, cells=7)), "amplitude")


def test_what_the_scene_does_not_name_is_absent():
    assert [(row.id, row.reason) for row in absence.rows() if row.status in ("failed", "not run")] == []


def test_limit_cycles_need_a_bound_and_a_range():
    with pytest.raises(InputError, match="without bound"):
        limit_cycle.check(scene(contact={"law": "linear"}), ())
    with pytest.raises(InputError, match="range of speeds"):
        limit_cycle.check(scene(speeds={"values": [60.0]}), ())


def test_limit_of_climbing() -> None:
    """Without friction a flange climbs only beyond the tangent of its angle; a wheel without load climbs at once."""
    assert nadal_limit(0.0) == pytest.approx(np.tan(np.radians(70.0)), rel=1e-15)
    force, load = np.array([0.0, 0.0, -2e4, 1e3]), np.array([0.0, 1e4, 1e4, 0.0])
    assert shares_of_bounds(force, load).tolist() == [0.0, 0.0, 2.0, np.inf]


def test_the_flange_of_a_cone_is_not_silently_unread_beside_profiles() -> None:
    with pytest.raises(InputError, match="profiles, which have flanges of their own") as told:
        wheelset_of(scene(wheelset={"override": {"flange_stiffness": 1e6}}, profiles={}))
    assert told.value.place == "wheelset.override.flange_stiffness"


def test_profiles_of_a_parameter_file_are_an_effect_that_its_file_has_to_drop(tmp_path) -> None:
    values = CHOSEN_WHEELSET.model_dump(exclude={"material", "profiles"})
    lines = "\n".join(f"{key} = {value!r}" for key, value in values.items())
    (tmp_path / "own.toml").write_text(f"{lines}\n[profiles]\nwheel = 'S1002'\n")
    own = scene(wheelset={"parameters": str(tmp_path / "own.toml")})
    assert "profiles" in named_effects(own) and "flange" not in named_effects(own)
    with pytest.raises(InputError, match=r"wheelset.parameters = .*has profiles: name a file without them"):
        scene_without(own, "profiles")


@pytest.mark.parametrize(
    ("law", "friction", "doubt"), [("linear", 0.0, True), ("linear", 0.3, False), ("fastsim", 0.0, False)]
)
def test_creep_forces_beyond_friction_are_told(law, friction, doubt) -> None:
    short = {"duration": 0.02, "displacement": 1e-3}
    own = scene(contact={"law": law}, wheelset={"override": {"friction": friction}}, run=short)
    told = [one for one in broken_assumptions_of(run(own, "reference", 20.0)) if one.name == "no slip"]
    assert bool(told) == doubt and all(np.isinf(one.worst) for one in told)
