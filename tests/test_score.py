"""The score: exact figures of made-up runs, what each verdict judges by, and that a tumbling run is rejected."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.result import Result
from models.drift.score import (
    SECTION_FORCE_CHANNELS,
    AcceptanceLimits,
    RunErrors,
    RunFigures,
    errors_of_run,
    figures_of_run,
    innovations_are_consistent,
    low_pass,
    root_mean_square,
    section_forces,
    verdict_on_run,
    verdict_without_true_run,
)
from models.fatigue.damage import damage_ratio, pseudo_damage, turning_points
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.scenes import force_scene, road_scene

DURATION = 4.0
FIGURES = RunFigures(
    moment_rms=1.0,
    moment_max=3.0,
    moment_share=0.5,
    moment_share_band=0.1,
    force_share_band=0.0,
    pitch_max=0.1,
    seconds=1.0,
    force_calls=4,
    steps=1,
)
ERRORS = RunErrors(
    damage=dict.fromkeys(SECTION_FORCE_CHANNELS, 1.01),
    force_rms={},
    vertical_damage={"f3": 1.0, "f4": 1.0},
    pitch_max=0.01,
    pitch_rms=0.005,
    heave_max=0.0,
)
GUIDED, SPRUNG, FREE = ("wheel_forces", "prescribed_pitch"), ("wheel_forces", "pitch_spring"), ("wheel_forces",)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("score")
    truth = simulate(road_scene(duration=DURATION), "reference")
    write_measurement(truth, folder, 1e-3)
    return folder, truth


def run(folder, effects=None, engine="reference", **override):
    scene = force_scene(folder, duration=DURATION, parameter_changes=override, effects=effects)
    return simulate(scene, engine), scene.vehicle_parameters()


def test_a_run_scored_against_itself_is_perfect(place):
    _, truth = place
    found = errors_of_run(truth, truth)
    assert set(found.damage.values()) | set(found.vertical_damage.values()) == {1.0}
    assert {*found.force_rms.values(), found.pitch_max, found.pitch_rms, found.heave_max} == {0.0}


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_artificial_moment_is_the_multiplier_of_a_guided_run(engine, place):
    folder, _ = place
    found, p = run(folder, {"prescribed_pitch": {"file": "pitch.csv"}}, engine, I=580.0)
    # generalised-alpha's multiplier and states err by 1e-3 of I pitch'', 4 N m in 150; the others by less
    assert figures_of_run(found, p).moment_rms == pytest.approx(root_mean_square(found["enforced_moment"]), rel=0.03)


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_artificial_moment_is_that_of_the_spring(engine, place):
    folder, _ = place
    found, p = run(folder, {"pitch_spring": {"stiffness": 300.0, "damping": 50.0}}, engine)
    spring = 300.0 * found["pitch"] + 50.0 * found["pitch_rate"]
    # the balance over a step errs by some 1e-4 of I pitch'', 0.3 N m in 15
    assert figures_of_run(found, p).moment_rms == pytest.approx(root_mean_square(spring), rel=0.02)


@pytest.mark.parametrize("frame", ["inertial", "body"])
def test_a_free_run_has_no_artificial_moment(frame, place):
    folder, _ = place
    scene = force_scene(folder, duration=DURATION)
    wheels = scene.effects["wheel_forces"].model_copy(update={"frame": frame})
    found = simulate(scene.model_copy(update={"effects": {"wheel_forces": wheels}}), "reference")
    own = figures_of_run(found, scene.vehicle_parameters())
    # rounding of the balance's order-4 rule on forces that are linear between samples
    assert own.moment_share_band < 1e-4 and own.force_share_band < 1e-4


@pytest.mark.grounds("closed form")
def test_figures_of_a_run_are_shares_of_its_chassis_inertia(place):
    """The moment by a chassis stated twice as heavy to turn: half of its own inertia term, to the balance's order."""
    folder, _ = place
    found, p = run(folder)
    figures = figures_of_run(found, p.model_copy(update={"I": 2.0 * p.I}))
    inertia = 2.0 * p.I * np.diff(found["pitch_rate"]) / (found.times[1] - found.times[0])
    assert figures.moment_rms == pytest.approx(0.5 * np.sqrt(np.mean(inertia**2)), rel=2e-3)
    assert figures.moment_share == pytest.approx(0.5, rel=2e-3)
    assert figures.moment_share_band == pytest.approx(0.5, rel=2e-3)
    assert figures.moment_max == pytest.approx(0.5 * np.abs(inertia).max(), rel=5e-3)
    assert figures.pitch_max == np.abs(found["pitch"]).max()


@pytest.mark.grounds("closed form")
def test_the_band_ends_at_15_hz():
    t = 1e-3 * np.arange(20_000)
    ratios = [
        root_mean_square(low_pass(np.sin(2 * np.pi * f * t), 1e-3)[5000:-5000]) * 2**0.5 for f in (5.0, 15.0, 30.0)
    ]
    # Butterworth of order 4 run twice: 1 / (1 + (f / 15 Hz)^8), within the ripple of frequency warping
    assert ratios == pytest.approx([1.0, 0.5, 1 / 257], rel=0.02)


@pytest.mark.grounds("closed form")
def test_a_drifting_heave_leaves_body_frame_forces_alone(place):
    _, truth = place
    moved = Result(truth.data.copy())
    for name in ("z1", "z2", "z3"):
        moved.data[name] = truth.data[name] + 3.0 * truth.data["time"]
    found = errors_of_run(moved, truth)
    assert found.heave_max == pytest.approx(3.0 * DURATION) and set(found.damage.values()) == {1.0}


def test_vertical_forces_are_blind_to_a_pitch_of_any_size(place):
    _, truth = place
    turned = Result(truth.data.copy())
    turned.data["pitch"] = truth.data["pitch"] + 1.0
    found = errors_of_run(turned, truth)
    assert set(found.vertical_damage.values()) == {1.0}
    assert min(found.damage["f3x"], found.damage["f4x"]) > 1e3


@pytest.mark.grounds("closed form")
def test_section_forces_turn_with_the_chassis():
    """Nose up by 30 degrees: half of a vertical force points forward, and cos 30 of it stays upright."""
    found = section_forces(np.array([2.0]), np.array([-4.0]), np.array([np.pi / 6]))
    wanted = {"f3x": 1.0, "f3z": 3**0.5, "f4x": -2.0, "f4z": -2 * 3**0.5}
    assert {name: float(force[0]) for name, force in found.items()} == pytest.approx(wanted, rel=1e-15)


def test_the_upright_component_is_scored_in_the_chassis_frame(place):
    """Turned by a further radian at every time, f3 cos(pitch) is about cos(1) of what it was: damage by its power 5."""
    _, truth = place
    turned = Result(truth.data.copy())
    turned.data["pitch"] = truth.data["pitch"] + 1.0
    # pitch of up to 0.07 rad changes cos(1 + pitch) by 11 %, to the power 5 by up to 1.7
    assert 0.54**5 / 2 < errors_of_run(turned, truth).damage["f3z"] < 0.54**5 * 2


@pytest.mark.parametrize(
    ("own", "wrong", "effects", "word"),
    [
        ({}, {}, GUIDED, "accepted"),
        ({}, {}, SPRUNG, "accepted"),
        ({}, {"damage": {**ERRORS.damage, "f4x": 1.06}}, GUIDED, "rejected"),
        ({}, {"damage": {**ERRORS.damage, "f3z": float("nan")}}, GUIDED, "rejected"),
        ({}, {"damage": {**ERRORS.damage, "f4x": 0.9}}, FREE, "stabilise"),
        ({}, {"pitch_max": 0.03}, SPRUNG, "rejected"),
        ({"moment_share_band": 0.2}, {}, GUIDED, "rejected"),
        ({"force_share_band": 0.2}, {}, GUIDED, "rejected"),
        ({"pitch_max": 5.9}, {}, FREE, "rejected"),
        ({"pitch_max": 5.9}, {}, GUIDED, "rejected"),
    ],
)
def test_verdict_with_the_truth(own, wrong, effects, word):
    assert verdict_on_run(replace(FIGURES, **own), replace(ERRORS, **wrong), effects, AcceptanceLimits()).word == word


@pytest.mark.parametrize(
    ("own", "effects", "more", "word"),
    [
        ({}, GUIDED, {}, "accepted"),
        ({}, (*FREE, "kalman_filter"), {"innovations_consistent": True}, "accepted"),
        ({}, (*FREE, "kalman_filter"), {"innovations_consistent": False}, "rejected"),
        ({}, (*FREE, "kalman_filter"), {"innovations_consistent": True, "pitch_uncertainty": 0.03}, "rejected"),
        ({"moment_share_band": 0.2}, GUIDED, {}, "rejected"),
        ({"moment_share_band": 0.2}, SPRUNG, {}, "rejected"),
        ({}, SPRUNG, {}, "stabilise"),
        ({}, (*FREE, "high_pass"), {"trusted_duration": 100.0}, "stabilise"),
        ({}, FREE, {}, "stabilise"),
        ({}, FREE, {"trusted_duration": 5.0}, "stabilise"),
        ({}, FREE, {"trusted_duration": 10.0}, "accepted"),
        ({"pitch_max": 5.9}, FREE, {"trusted_duration": 100.0}, "rejected"),
    ],
)
def test_verdict_without_the_truth(own, effects, more, word):
    assert verdict_without_true_run(replace(FIGURES, **own), effects, 10.0, AcceptanceLimits(), **more).word == word


@pytest.mark.parametrize(("mean", "expected"), [(1.0, True), (0.97, True), (1.3, False), (0.9, False)])
def test_a_filter_is_consistent_where_its_surprises_are_its_own(mean, expected, place):
    """10,000 values: the 99.9 % band of their mean is 1 +- 0.047."""
    filtered = Result(place[1].data.copy())
    assert innovations_are_consistent(filtered) is None
    for name, last in (("kalman_used", 1e4), ("kalman_surprise", mean * 1e4)):
        filtered.data[name] = ("time", np.linspace(0.0, last, len(filtered.times)))
    assert innovations_are_consistent(filtered) is expected


def test_reasons_name_what_is_wrong():
    found = verdict_on_run(
        replace(FIGURES, moment_share_band=0.2), replace(ERRORS, pitch_max=0.3), GUIDED, AcceptanceLimits()
    )
    assert found.reason == "pitch wrong by 0.3 rad; artificial moment 20% of I pitch''"


@pytest.mark.parametrize("spacing", [0.01, 0.5])
def test_rows_that_are_too_far_apart_are_refused(spacing, place):
    _, truth = place
    with pytest.raises(InputError, match="output_step"):
        figures_of_run(truth.every(spacing), road_scene().vehicle_parameters())


def test_runs_at_other_times_are_refused(place):
    _, truth = place
    with pytest.raises(InputError, match="same times"):
        errors_of_run(truth.every(2e-3), truth)


@pytest.mark.parametrize("load", [np.array([]), np.array([1.0, np.nan, 2.0]), np.array([1.0, np.inf])])
def test_broken_loads_are_refused(load):
    with pytest.raises(InputError, match="finite"):
        pseudo_damage(load)


def test_a_constant_load_does_no_damage_and_is_no_truth():
    assert pseudo_damage(np.full(9, 3.0)) == 0.0
    with pytest.raises(InputError, match="never varies"):
        damage_ratio(np.array([0.0, 1.0, 0.0]), np.full(9, 3.0))
    standing = 3000.0 + 1e-9 * np.sin(np.arange(90.0))  # rounding: the ratio to it would be 1e57
    with pytest.raises(InputError, match="never varies"):
        damage_ratio(standing + np.sin(np.arange(90.0)), standing)


def test_damage_counts_astm_half_cycles():
    """The example of ASTM E1049-85, figure 6: ranges 3, 4, 4, 6, 8, 8, 9, counted 0.5, 1.5 (twice 4), 0.5, 1, 0.5."""
    load = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])
    assert pseudo_damage(load, 1.0) == 0.5 * 3 + 1.5 * 4 + 0.5 * 6 + 1.0 * 8 + 0.5 * 9
    # residue as half cycles: a single rise is half of a cycle
    assert pseudo_damage(np.array([0.0, 2.0])) == 0.5 * 2.0**5


def test_turning_points_change_no_count():
    from rainflow import extract_cycles

    load = np.round(np.random.default_rng(4).standard_normal(3000).cumsum(), 0)  # plateaus among them
    whole = sum(count * span**5 for span, _, count, _, _ in extract_cycles(load.tolist()))
    assert len(turning_points(load)) < 2000 and pseudo_damage(load) == pytest.approx(whole, rel=1e-12)


@pytest.mark.parametrize("implementation", ["reference", "mujoco"])
def test_a_spring_taken_for_a_measurement_is_found(implementation, monkeypatch, tmp_path):
    """Planted: whoever trusts a spring as if it knew the pitch is told by the hard case on a grade."""
    from models.drift import score
    from validation.hard_cases import drift
    from validation.hard_cases.case import judge

    case = next(case for case in drift.CASES if case.name == "spring on a grade")
    monkeypatch.setattr(score, "MEASURED_PITCH_EFFECTS", (*score.MEASURED_PITCH_EFFECTS, "pitch_spring"))
    assert judge(case, implementation, tmp_path).word == "SILENT"


def test_forces_scored_without_their_pitch_are_found(monkeypatch, tmp_path):
    """Planted: a score that leaves out the component along the chassis calls the tumbled run anything but rejected."""
    from models.drift import score
    from validation.hard_cases import drift
    from validation.hard_cases.case import judge

    case = next(case for case in drift.CASES if case.name == "drifted run scored by its vertical forces")
    monkeypatch.setattr(score, "TUMBLING_PITCH", np.inf)
    monkeypatch.setattr(score, "_exceeded_limits", lambda found, limits: [])
    assert judge(case, "reference", tmp_path).word == "SILENT"
