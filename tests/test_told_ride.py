"""Rides tell their errors and what they take for granted: planted runs, finer truths, planted faults of an estimate."""

from dataclasses import replace

import numpy as np
import pytest

from models.core import discretisation, told
from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.systems.ride import errors, nonlinear
from models.systems.ride.nonlinear import RunSampling
from models.systems.ride.of_scene import excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.plan import describe
from models.systems.ride.run import run
from models.systems.ride.scene import build
from models.vehicles.spatial import Curve
from models.vehicles.spatial_linear import wheels
from validation.stated_errors.systems.ride import exact_deviations, samples

ENGINES = ("reference", "exudyn", "mujoco")
SHORT = RunSampling(copies=20, lasting=2.0, driven=3.0, skipped=0.5)


def scene(file="half_car", level=1.6e-5, speed=20.0, point="unloaded", **tables):
    table = {"title": "t", "system": "ride", "road": {"level": level}, **tables}
    table["vehicle"] = {"file": file, "operating_point": point, **table.get("vehicle", {})}
    if "drive" not in table:
        table.setdefault("speeds", {"values": [speed]})
    return build(table, "s.toml")


def names(result):
    return {one.name for one in broken_assumptions_of(result)}


PLANTED = {
    "tyres press": (scene(level=2e-4), scene(level=1e-6), "lift_off"),
    "free travel of front left": (
        scene("seven_freedoms", options={"free_travel": 0.02}),
        scene("seven_freedoms", options={"free_travel": 0.2}),
        "travel_force",
    ),
    "small angles": (scene(level=0.2), scene(), "smoother road"),
    "waves of the road": (scene(speed=0.5), scene(speed=5.0), "take speeds from 1"),
    "people stay seated": (
        scene("r19_ride", level=2e-3, weighting={"left occupant": "Wk"}),
        scene("r19_ride", weighting={"left occupant": "Wk"}),
        "smoother road",
    ),
    "small slip": (scene("r19_free", level=2e-1, speed=30.0), scene("r19_free", level=1e-8), "system handling"),
    "travel of front left": (
        scene("quarter_car_nonlinear", level=1e-3, vehicle={"small_motion": True}),
        scene("quarter_car_nonlinear", level=1e-9, vehicle={"small_motion": True}),
        "small_motion",
    ),
}


@pytest.mark.parametrize("name", PLANTED)
@pytest.mark.parametrize("engine", ENGINES[::2])
def test_a_planted_breach_of_a_covariance_is_found_and_its_remedy_lifts_it(name, engine):
    breaking, keeping, remedy = PLANTED[name]
    (one,) = (one for one in broken_assumptions_of(run(breaking, engine)) if one.name == name)
    assert remedy in one.remedy and (not one.law or 0.00135 < one.share <= 0.5) and one.says in describe(breaking)
    assert name not in names(run(keeping, engine))


def test_the_share_of_time_is_that_of_the_normal_law():
    from scipy.special import ndtr

    result = run(scene(level=2e-4), "reference")
    (one,) = (one for one in broken_assumptions_of(result) if one.name == "tyres press")
    outputs = result["output"].tolist()
    deviation = max(result["deviation"][0, 0, [i for i, name in enumerate(outputs) if "tyre force" in name]])
    load = 3.0 * deviation + one.worst  # the worst value lies three deviations below the load at rest
    assert one.share == pytest.approx(float(ndtr((-1.0 - load) / deviation)), rel=1e-9)
    assert "at 20 m/s" in one.where and "by the normal law" in one.line()


BENT = scene("quarter_car_nonlinear", level=4e-4, speed=30.0, point="loaded", study="ride_nonlinear")


@pytest.fixture(scope="module")
def bent():
    """A bent quarter car on a road that is too rough for it, in every implementation."""
    return {engine: run(BENT, engine, sampling=SHORT) for engine in ENGINES}


@pytest.mark.parametrize("name", ["tyres press", "travel of front left", "rate of front left"])
def test_planted_breaches_of_runs_in_time_are_found_by_all(bent, name):
    for engine, result in bent.items():
        (one,) = (one for one in broken_assumptions_of(result) if one.name == name)
        assert one.share > 0.0 and (engine == "reference" or one.first >= 0.0)
    assert ("nearly Gaussian" in names(bent["reference"])) and "nearly Gaussian" not in names(bent["mujoco"])


def test_lift_off_and_longer_tables_take_the_assumptions_away():
    lifting = scene("quarter_car_nonlinear", 4e-4, 30.0, "loaded", study="ride_nonlinear", effects={"lift_off": {}})
    car = vehicle_of(lifting)
    far = Curve((-99.0, 0.0, 99.0), (-99e3, 0.0, 99e3))
    springs = tuple(replace(spring, travel_force=None, rate_force=far) for spring in car.springs)
    for vehicle, engine in ((car, "mujoco"), (car, "exudyn"), (replace(car, springs=springs), "mujoco")):
        assert "tyres press" not in names(nonlinear.engine_result(lifting, engine, vehicle, SHORT))
    assert names(nonlinear.engine_result(lifting, "mujoco", replace(car, springs=springs), SHORT)) == set()
    assert (
        names(run(scene("quarter_car_nonlinear", level=1e-6, study="ride_nonlinear"), "mujoco", sampling=SHORT))
        == set()
    )


def test_a_drive_tells_when_a_tyre_would_first_pull():
    drive = {"time": [0.0, 2.0], "speed": [2.0, 30.0]}
    given = scene(level=1e-4, drive=drive, study="ride_drive")
    (one,) = (one for one in broken_assumptions_of(run(given, "reference")) if one.name == "tyres press")
    assert 0.0 < one.first < 2.0 and "at " not in one.where


def of_rounding(engine):
    """True errors by the stated ones of a half car's deviations."""
    given = scene(speeds={"values": [3.3, 17.0, 41.0]})
    result, vehicle = run(given, engine, error=True), vehicle_of(given)
    road, linear = excitation_of(given, wheels(vehicle)), linear_vehicle(vehicle)
    true = np.array([exact_deviations(linear(float(v)), road, float(v)) for v in result["speed"]])
    gaps = np.sqrt(np.mean((result["deviation"][0] - true) ** 2, axis=0))
    assert len(error_estimates_of(result)) == len(gaps) and error_estimates_of(run(given, engine)) == {}
    return [float(gap / one.error) for gap, one in zip(gaps, error_estimates_of(result).values(), strict=True)]


@pytest.mark.parametrize("engine", ENGINES)
def test_rounding_of_a_covariance_is_told(engine):
    assert max(of_rounding(engine)) < 3.0  # every channel, as asked of the worst one


@pytest.mark.parametrize("lasting", [1e-6, 1e-3, 5e-3, 0.01, 0.02])
def test_a_drive_of_few_steps_has_its_error_or_a_reason(lasting):
    """And one whose deviations hardly change is not told that they err by much of their change."""
    made = run(scene(drive={"time": [0.0, lasting], "speed": [20.0, 20.0 + lasting]}), error=True)
    assert error_estimates_of(made) or "one step long" in discretisation.error_lines(made)[0]
    assert not any(each.warned for each in error_estimates_of(made).values())


def test_what_stands_still_on_equal_tracks_is_no_alarm():
    """Roll of a symmetric car is rounding there: no share of it is told as an error of 200 %."""
    made = run(scene("r19_ride", road={"level": 1.6e-5, "left_right": "equal"}), "reference", error=True)
    told_roll = error_estimates_of(made)["roll acceleration"]
    assert (
        not any(each.warned for each in error_estimates_of(made).values()) and 0.0 < told_roll.error < 1e-12
    )  # rad/s^2


def test_an_estimate_that_is_too_small_is_caught(monkeypatch):
    monkeypatch.setattr(errors, "SAFETY_FACTOR", 1e-3)
    monkeypatch.setattr(errors, "MATRIX_ACCURACY", 1e-19)
    assert max(of_rounding("reference")) > 3.0


def test_a_step_too_long_is_refused_and_the_advised_one_accepted():
    rough = scene("half_car", 1e-4, 5.0, "loaded", effects={"lift_off": {}}, study="ride_nonlinear")
    long = SHORT.model_copy(update={"step": 9e-3})
    with pytest.raises(RunFailed, match="use at most") as refusal:
        with_refusals_early(lambda: run(rough, "mujoco", sampling=long, error=True))
    advised = min(one.step for one in error_estimates_of(refusal.value.partial).values())
    run(rough, "mujoco", sampling=SHORT.model_copy(update={"step": advised}), error=True)


def with_refusals_early(work):
    """The answer, errors of 2 % refused: where they would be half of it, engines refuse the step before."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(discretisation, "REFUSED_SHARE", 0.02)
        return work()


@pytest.mark.full
def test_an_order_that_no_road_has_is_caught(monkeypatch):
    assert next(samples(1, 3)).ratio < 3.0
    monkeypatch.setattr(discretisation, "observed_order", lambda fine, coarse, declared: 4.0)  # as on a smooth road
    assert next(samples(1, 3)).ratio > 3.0


def test_copies_state_steps_chance_and_what_gains_miss():
    given = scene("quarter_car_nonlinear", level=6.4e-5, study="ride_nonlinear", point="loaded")
    result = run(given, "reference", sampling=SHORT, error=True)
    channels = error_estimates_of(result)
    assert 0.0 < channels["body front, copies"].share < 0.01 and 0.0 < channels["body front, gains"].share < 0.5
    text = "\n".join(told.messages_on_results({"reference": result}))
    assert "standard error of 20 paths" in text


@pytest.mark.full
def test_the_shipped_scenes_tell_what_their_texts_say():
    from studies.command.asked import load_scene

    said = {
        "ride": {"tyres press"},
        "ride_drive": {"tyres press"},
        "ride_choice": set(),
        "ride_nonlinear": {"tyres press", "rate of front left", "nearly Gaussian"},
    }
    for name, broken in said.items():
        assert names(run(load_scene(name, None), "reference")) == broken


@pytest.mark.full
def test_errors_hold_beside_finer_truths():
    ratios = [sample.ratio for sample in samples(12, 7)]
    assert sum(ratio <= 3.0 for ratio in ratios) >= 11 and max(ratios) < 10.0
