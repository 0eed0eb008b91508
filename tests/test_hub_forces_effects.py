"""Noise and stabilisers of hub forces as effects: left out one by one, put in, legal; how they are run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.advice.choice.systems.hub_forces import computed_quantities
from models.core.errors import InputError
from models.core.scene_effects import check_combination, named_effects, scene_without, with_effects
from models.systems.hub_forces.comparison import planned_runs
from models.systems.hub_forces.measurement import recorded_measurement
from models.systems.hub_forces.run import measure
from models.systems.hub_forces.scene import build
from studies.command.asked import plan_module_of

NOISES = ("angle_noise", "force_noise")
ON_ROAD = {
    "title": "t",
    "system": "hub-forces",
    "study": "hub_forces",
    "vehicle": {"file": "r19_free"},
    "road": {},
    "run": {"duration": 0.1},
}


def scene(**more):
    return build({**ON_ROAD, **more}, "s.toml")


def test_each_noise_leaves_alone_and_without_both_transducers_tell_the_truth():
    own = scene()
    with_noise = measure(own, "mujoco")
    assert with_noise.truth is not None
    true, both = recorded_measurement(with_noise.truth, own.forces.frame, 2), (with_noise.forces, with_noise.angles)
    left_out = (measure(scene_without(own, *out), "mujoco") for out in (*((name,) for name in NOISES), NOISES))
    told = [(measurement.forces, measurement.angles) for measurement in left_out]
    same = [[np.array_equal(a.samples, b.samples) for a, b in zip(one, true, strict=True)] for one in (both, *told)]
    assert same == [[False, False], [False, True], [True, False], [True, True]]
    assert np.array_equal(told[0][0].samples, both[0].samples)  # its own noise is what it was


def test_what_is_stated_stays_without_noise():
    quiet = scene_without(scene(angles={"angle_deviation": 0.01}), *NOISES)
    assert quiet.angles.deviations == (0.01, 5e-3)  # the filter weighs by it, and needs some
    told = plan_module_of(quiet).describe(quiet)
    assert "  noise      none\n" in told and "absent     angle_noise, force_noise, held_forces, kalman_filter" in told


def test_a_stabiliser_leaves_for_none_and_gives_way_to_the_other():
    held = scene(stabilise={"method": "kalman"})
    assert scene_without(held, "kalman_filter").stabilise.method == "none"
    assert with_effects(held, "prescribed_angles").stabilise.method == "prescribed"
    assert scene_without(with_effects(held, "prescribed_angles"), "prescribed_angles").stabilise.method == "none"


@pytest.mark.parametrize(
    ("there", "told"),
    [
        (
            ("force_noise",),
            "forces.noise: needs the effect 'virtual_measurement', for files have the noise that they have",
        ),
        (("angle_noise",), "angles.noise: needs the effect 'virtual_measurement'"),
        (
            ("kalman_filter", "prescribed_angles"),
            "stabilise.method: cannot stand beside 'prescribed_angles', as one moment "
            "holds roll and pitch: drop one of them",
        ),
    ],
)
def test_what_cannot_be_together_is_told_with_the_remedy(there, told):
    with pytest.raises(InputError, match=told):
        check_combination(there, scene())


@pytest.mark.parametrize("table", ["forces", "angles"])
def test_files_have_the_noise_that_they_have(table):
    own = {"forces": {"file": "f.csv"}, "angles": {"file": "a.csv"}, "road": None}
    own[table] = {**own[table], "noise": "none"}
    with pytest.raises(InputError, match=rf"{table}.noise = 'none': is that of {table}.file: drop it"):
        build({key: value for key, value in {**ON_ROAD, **own}.items() if value is not None}, "s.toml", Path())


def test_quantities_are_those_of_the_run_that_the_scene_holds():
    """A price and a choice see a stabiliser by what it changes; angles that nothing reads change nothing."""
    free, held = scene(), scene(stabilise={"method": "kalman"})
    paths = [
        computed_quantities(own, "mujoco").quantities["roll"].case_values[0]
        for own in (free, scene_without(free, "angle_noise"), held, scene_without(held, "angle_noise"))
    ]
    assert np.array_equal(paths[0], paths[1])
    assert not np.array_equal(paths[0], paths[2]) and not np.array_equal(paths[2], paths[3])


def test_a_scene_that_names_no_stabiliser_makes_no_estimate(monkeypatch):
    """Positive control beside it: a filter that cannot be made is missed where it is named, and there only."""

    def missing(*given):
        raise AssertionError("was made")

    monkeypatch.setattr("models.systems.hub_forces.tilt_filter.estimate_tilt", missing)
    monkeypatch.setattr("models.systems.hub_forces.run.inputs_with_smoothed_angles", missing)
    measurement = measure(scene(), "mujoco")
    assert measurement.hub_inputs("none", 1e-3, 100).guide is None
    for method in ("kalman", "prescribed"):
        with pytest.raises(AssertionError, match="was made"):
            replace(measurement).hub_inputs(method, 1e-3, 100)


def test_a_study_runs_the_scene_as_it_is_in_every_engine_and_the_others_in_one():
    engines = ("exudyn", "mujoco")
    names = {method: list(planned_runs(scene(stabilise={"method": method}), engines)) for method in ("none", "kalman")}
    assert names["none"] == ["free, exudyn", "free, mujoco", "filter", "prescribed"]
    assert names["kalman"] == ["free, mujoco", "filter, exudyn", "filter", "prescribed"]
    assert named_effects(scene(stabilise={"method": "kalman"})) == (
        "angle_noise",
        "force_noise",
        "kalman_filter",
        "turning_forces",
        "virtual_measurement",
    )
