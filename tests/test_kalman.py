"""The Kalman filter of the pitch: its step, its covariances, its smoother, gaps, and the moment that it leads to."""

import numpy as np
import pytest
from scipy.linalg import expm

from models.core.errors import InputError, RunFailed
from models.core.tables import NEWTONS
from models.core.time_series import read_time_series, write_time_series
from models.drift.innovations import FALSE_ALARM_SHARE, consistency
from models.engines.assembly import Settings
from models.engines.protocol import build
from models.engines.stability import first_order, linearised_matrices
from models.systems.pitch_plane import pitch_filter
from models.systems.pitch_plane.pitch_filter import (
    FILTERED_STATES,
    INERTIA_SHARE,
    PITCH,
    PITCH_RATE,
    RELATIVE_STATES,
    PitchMeasurement,
    PitchStep,
    estimate_pitch,
)
from models.systems.pitch_plane.plan import describe
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene

PERIOD, DURATION = 5e-3, 2.0
ENGINES = ("reference", "exudyn", "mujoco")
ANGLE = 1e-3


@pytest.fixture
def folder(tmp_path):
    t = PERIOD * np.arange(round(DURATION / PERIOD) + 1)
    front = 3825.9 + 2500 * np.sin(9 * t) + 900 * np.sin(40 * t)  # static load and a pitch rate of 0.3 rad/s
    rear = 3825.9 - 2500 * np.sin(9 * t)
    write_time_series(tmp_path / "f.csv", {"front": ("N", front), "rear": ("N", rear)}, PERIOD)
    states = free(tmp_path)
    noise = ANGLE * np.random.default_rng(1).standard_normal(len(t))
    write_time_series(tmp_path / "p.csv", {"pitch": ("rad", states[:, 3] + noise)}, PERIOD)
    return tmp_path


def scene(
    folder, effects=None, *, duration=DURATION, interpolation="linear", geometry="exact", frame="inertial", **override
):
    forces = {"wheel_forces": {"file": "f.csv", "interpolation": interpolation, "frame": frame}}
    table = {
        "title": "test",
        "vehicle": {"geometry": geometry, "override": override},
        "run": {"duration": duration, "step": 1e-3},
        "effects": forces | (effects or {}),
    }
    return build_scene(table, "test.toml", folder)


def free(folder, **own):
    """States of the reference at the samples."""
    return (
        build("reference", assembly_of_scene(scene(folder, **own)), Settings("RK4", 1e-3, DURATION)).run().states[::5]
    )


def drawn(folder, **own):
    settings = {"file": "p.csv", "force_deviation": 16.0, "pitch_deviation": ANGLE}
    return {"kalman_filter": settings | own}


def angles(folder):
    return read_time_series(folder / "p.csv", {"pitch": {"rad": 1.0}}, gaps_allowed=True)[0]


def matrices(assembly):
    p, pushes = assembly.parameters, np.zeros((8, 2))
    pushes[4, 0], pushes[5, 1] = -1 / p.m1, -1 / p.m2
    return RELATIVE_STATES @ first_order(linearised_matrices(assembly.vehicle))[
        :, FILTERED_STATES
    ], RELATIVE_STATES @ pushes


@pytest.mark.parametrize("interpolation", ["held", "linear"])
def test_the_step_of_the_linear_vehicle_is_the_matrix_exponential(folder, interpolation, monkeypatch):
    monkeypatch.setattr(pitch_filter, "LONGEST_SUBSTEP", 0.02)  # substeps in which Runge-Kutta errs by 1e-8
    assembly = assembly_of_scene(scene(folder, geometry="linear", interpolation=interpolation))
    a, b = matrices(assembly)
    h = 2e-3
    block = np.zeros((10, 10))
    block[:6, :6], block[:6, 6:8], block[6:8, 8:] = a, b, np.eye(2) / h
    moved = expm(block * h)
    late = moved[:6, 8:] if interpolation == "linear" else np.zeros((6, 2))
    x = np.array([0.01, -0.02, 0.05, 0.1, 0.2, -0.3, 0.0])
    _, transition, first, last = PitchStep(assembly, h, 5).advance(x, 3)
    size = np.abs(moved[:6, 6:8]).max(axis=1, keepdims=True)
    np.testing.assert_allclose(transition[:6, :6], moved[:6, :6], atol=1e-7 * np.abs(moved[:6, :6]).max())
    np.testing.assert_allclose(first[:6] / size, (moved[:6, 6:8] - late) / size, atol=1e-6)
    np.testing.assert_allclose(last[:6] / size, late / size, atol=1e-6)


@pytest.mark.parametrize("frame", ["inertial", "body"])
def test_steps_follow_the_reference_and_so_do_their_derivatives_to_the_inertia(folder, frame):
    """Run as one chain from the start, state and product of the steps' derivatives."""
    own = assembly_of_scene(scene(folder, frame=frame))
    step, count = PitchStep(own, PERIOD, 100), 100
    x, slope = np.append(RELATIVE_STATES @ own.initial, 0.0), np.eye(7)
    for i in range(count):
        x, transition, _, _ = step.advance(x, i)
        slope = transition @ slope
    run = free(folder, frame=frame)[count]
    np.testing.assert_allclose(x[:6], RELATIVE_STATES @ run, atol=1e-10)  # the same Runge-Kutta at the same 1 ms
    more, less = (free(folder, frame=frame, I=own.parameters.I / (1 + d))[count] for d in (1e-4, -1e-4))
    found = RELATIVE_STATES @ (more - less) / 2e-4
    np.testing.assert_allclose(slope[:6, 6], found, rtol=1e-5, atol=1e-7)


def test_without_measurement_the_covariance_is_that_of_all_force_samples(folder, monkeypatch):
    """Linear vehicle: each sample's response at the end, from the reference itself, squared and summed."""
    monkeypatch.setattr(pitch_filter, "KNOWN_DEVIATION", 0.0)
    own = assembly_of_scene(scene(folder, duration=0.05, geometry="linear"))
    found = estimate_pitch(own, PitchMeasurement(np.full((11, 1), np.nan), PERIOD, (PITCH,), (ANGLE,)), 16.0)
    base, total = own.input.values, np.zeros((6, 6))
    settings = Settings("RK4", 1e-3, 0.05)
    at_rest = build("reference", own, settings).run().states[-1]
    for i in range(11):
        for wheel in range(2):
            own.input.values[i, wheel] += 1e3
            response = RELATIVE_STATES @ (build("reference", own, settings).run().states[-1] - at_rest) * 16.0 / 1e3
            own.input.values[i, wheel] -= 1e3
            total += np.outer(response, response)
    assert np.array_equal(own.input.values, base)
    scale = np.sqrt(total.diagonal())
    difference = (found.error_covariances()[-1, :6, :6] - total) / np.outer(scale, scale)
    assert np.abs(difference).max() < 1e-6  # differences of the step are good to 1e-9


def test_the_smoother_is_the_conditional_mean_of_everything(folder):
    """Linear vehicle, held forces: the joint Gaussian of all states, conditioned on all measurements at once."""
    n, own = 12, assembly_of_scene(scene(folder, duration=0.06, geometry="linear", interpolation="held"))
    measured = PitchMeasurement(angles(folder), PERIOD, (PITCH,), (ANGLE,))
    step = PitchStep(own, PERIOD, n)
    mean, start = pitch_filter._initial_state_and_covariance(own, 0.05, 0.0)
    means, roots = [mean], [np.linalg.cholesky(start)]
    for i in range(n):
        after, transition, first, _ = step.advance(means[-1], i)
        means.append(after)
        roots.append(np.hstack([transition @ roots[-1], 16.0 * first]))
    wide = np.zeros((n + 1, 7, roots[-1].shape[1]))
    for i, root in enumerate(roots):
        wide[i, :, : root.shape[1]] = root
    see = wide[:, PITCH]
    gain = np.einsum("nij,mj->nim", wide, see) @ np.linalg.inv(see @ see.T + ANGLE**2 * np.eye(n + 1))
    wanted = np.array(means) + gain @ (measured.values[: n + 1, 0] - np.array(means)[:, PITCH])
    left = np.einsum("nij,nkj->nik", wide, wide) - np.einsum("nim,nkm->nik", gain, np.einsum("nij,mj->nim", wide, see))
    found = estimate_pitch(own, measured, 16.0, start_deviation=0.05, with_smoother=True)
    size = np.sqrt(np.einsum("nii->ni", left))[:, :6]
    assert np.abs((found.states - wanted)[:, :6] / size).max() < 1e-3  # of a deviation; the start's 1e-6 costs digits
    spread = np.sqrt(np.einsum("nii->ni", found.covariances))[:, :6]
    np.testing.assert_allclose(spread, size, rtol=1e-3)
    filtered = estimate_pitch(own, measured, 16.0, start_deviation=0.05)
    assert np.all(spread[:, PITCH] <= np.sqrt(filtered.covariances[:, PITCH, PITCH]) * (1 + 1e-6))


def test_a_wrong_inertia_is_learnt(folder):
    right = assembly_of_scene(scene(folder)).parameters.I
    wrong = assembly_of_scene(scene(folder, I=0.95 * right))
    found = estimate_pitch(
        wrong, PitchMeasurement(angles(folder), PERIOD, (PITCH,), (ANGLE,)), 16.0, inertia_deviation=0.05
    )
    share, sure = found.states[-1, INERTIA_SHARE], np.sqrt(found.error_covariances()[-1, INERTIA_SHARE, INERTIA_SHARE])
    assert sure < 0.01 and abs(share + 0.05) < 4 * sure  # 1/I of the model is 1/0.95 of the true one
    trusted = estimate_pitch(wrong, PitchMeasurement(angles(folder), PERIOD, (PITCH,), (ANGLE,)), 16.0)
    assert abs(trusted.states[-1, INERTIA_SHARE]) < 1e-6


@pytest.mark.parametrize("interpolation", ["held", "linear"])
def test_three_implementations_are_drawn_alike_by_the_moment_that_is_reported(folder, interpolation):
    own = drawn(folder, inertia_deviation=0.05)
    runs = [simulate(scene(folder, own, interpolation=interpolation, I=475.0), engine) for engine in ENGINES]
    for run in runs[1:]:
        np.testing.assert_allclose(run.states, runs[0].states, atol=1e-9)  # Runge-Kutta of order 4 in all three
    run = runs[0]
    middle = np.diff(run["pitch_rate"]) / 1e-3 * 475.0  # the mean of I beta'' over each step
    moment = run["suspension_moment"] + run["kalman_moment"] + run["inertia_moment"]
    inside = slice(20, None)  # the wheels' first swing is too fast for a trapezoid
    difference = (middle - 0.5 * (moment[1:] + moment[:-1]))[inside]
    assert np.abs(difference).max() < 0.01 * np.abs(middle).max()
    lacking = run["inertia_share"] * run["suspension_moment"]
    assert np.abs(lacking).max() > 0.03 * np.abs(middle).max()
    learnt = slice(500, None)  # by then the run is where the estimate is
    assert np.abs(run["inertia_moment"] - lacking)[learnt].max() < 0.05 * np.abs(lacking).max()


def test_gaps_are_skipped_counted_and_never_absorbed(folder):
    lines = (folder / "p.csv").read_text().splitlines()
    for i, gap in ((20, ""), (21, "nan"), (22, " NaN "), *((i, "") for i in range(100, 200))):
        lines[i] = lines[i].split(",")[0] + "," + gap
    (folder / "p.csv").write_text("\n".join(lines) + "\n")
    run = simulate(scene(folder, drawn(folder)), "reference")
    assert run["kalman_missed"][-1] == 103 and run["kalman_used"][-1] == len(lines) - 1 - 103
    assert np.isfinite(run.states).all()
    during, before = run["pitch_deviation"][985], run["pitch_deviation"][480]
    assert during > 3 * before  # half a second of free drift: 9e-4 rad beside 2e-4
    assert np.abs((run["pitch_estimate"][::5] - free(folder)[:, 3]) / run["pitch_deviation"][::5])[1:].max() < 5


def test_gaps_are_allowed_only_where_they_are_asked_for(folder):
    (folder / "g.csv").write_text("time [s],front [N]\n" + "".join(f"{i},{'' if i == 3 else i}\n" for i in range(9)))
    assert np.isnan(read_time_series(folder / "g.csv", {"front": NEWTONS}, gaps_allowed=True)[0][3, 0])
    with pytest.raises(InputError, match="line 5"):
        read_time_series(folder / "g.csv", {"front": NEWTONS})
    (folder / "g.csv").write_text("time [s],front [N]\n" + "".join(f"{'' if i == 3 else i},{i}\n" for i in range(9)))
    with pytest.raises(InputError, match="line 5, column 'time"):
        read_time_series(folder / "g.csv", {"front": NEWTONS}, gaps_allowed=True)


def test_angle_and_rate_together_are_surer_than_either(folder):
    states = free(folder)
    noise = np.random.default_rng(2).standard_normal((len(states), 2)) * [ANGLE, 0.05]
    values = states[:, [3, 7]] + noise
    own, sure = assembly_of_scene(scene(folder)), {}
    for columns in ((PITCH,), (PITCH_RATE,), (PITCH, PITCH_RATE)):
        chosen = [0 if column == PITCH else 1 for column in columns]
        deviations = tuple((ANGLE, 0.05)[i] for i in chosen)
        found = estimate_pitch(own, PitchMeasurement(values[:, chosen], PERIOD, columns, deviations), 16.0)
        sure[columns] = np.sqrt(found.error_covariances()[-1, PITCH, PITCH])
        assert abs(found.states[-1, PITCH] - states[-1, 3]) < 5 * sure[columns]
    assert sure[PITCH, PITCH_RATE] < min(sure[PITCH,], sure[PITCH_RATE,])


def test_a_measurement_at_its_own_rate_lies_at_its_own_times(folder):
    states = free(folder)
    slow = PitchMeasurement(states[::4, [3]], 4 * PERIOD, (PITCH,), (ANGLE,))
    found = estimate_pitch(assembly_of_scene(scene(folder)), slow, 16.0)
    assert found.used_values.sum() == len(slow.values) and (found.used_values[::4] == 1).all()
    np.testing.assert_allclose(found.states[:, PITCH], states[:, 3], atol=1e-9)  # all data are true
    fine = build("reference", assembly_of_scene(scene(folder)), Settings("RK4", 1e-3, DURATION)).run().states
    fast = estimate_pitch(
        assembly_of_scene(scene(folder)), PitchMeasurement(fine[:, [3]], 1e-3, (PITCH,), (ANGLE,)), 16.0
    )
    np.testing.assert_allclose(fast.states[:, PITCH], fine[:, 3], atol=1e-9)


def test_what_is_no_number_in_the_estimate_fails_the_run(folder, monkeypatch):
    advance = PitchStep.advance

    def broken(self, x, number):
        found = advance(self, x, number)
        if number == 50:
            found[0][PITCH] = np.nan
        return found

    monkeypatch.setattr(PitchStep, "advance", broken)
    with pytest.raises(RunFailed, match="kalman filter: the estimate"):
        simulate(scene(folder, drawn(folder)), "reference")


def test_one_estimate_serves_a_check_and_all_engines(folder, monkeypatch):
    calls = []

    def counted(*arguments, **named):
        calls.append(1)
        return estimate_pitch(*arguments, **named)

    monkeypatch.setattr(pitch_filter, "estimate_pitch", counted)
    for _ in range(3):
        assembly_of_scene(scene(folder, drawn(folder)))
    assembly_of_scene(scene(folder, drawn(folder, force_deviation=17.0)))
    assert len(calls) == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pitch_deviation": None}, "pitch_deviation, rate_deviation or both"),
        ({"rate_deviation": 0.1}, "'pitch_rate' is missing"),
        ({"file": "short.csv"}, "ends at 1"),
        ({"file": "odd.csv"}, "one must be a multiple of the other"),
        ({"file": "empty.csv"}, "holds no number at all"),
        ({"bandwidth": 0.001}, "must be above"),
        ({"force_deviation": 0.0}, "must be above 0"),
    ],
)
def test_bad_input_gets_one_clear_message(folder, change, words):
    pitch = angles(folder)[:, 0]
    write_time_series(folder / "short.csv", {"pitch": ("rad", pitch[:200])}, PERIOD)
    write_time_series(folder / "odd.csv", {"pitch": ("rad", pitch)}, 7e-3)
    write_time_series(folder / "empty.csv", {"pitch": ("rad", np.full(500, np.nan))}, PERIOD)
    own = drawn(folder, **change)
    own["kalman_filter"] = {key: value for key, value in own["kalman_filter"].items() if value is not None}
    with pytest.raises(InputError, match=words):
        assembly_of_scene(scene(folder, own))


@pytest.mark.parametrize("other", [{"pitch_spring": {"stiffness": 1.0}}, {"prescribed_pitch": {"file": "p.csv"}}])
def test_it_stands_alone_among_the_stabilisers(folder, other):
    with pytest.raises(InputError, match="cannot stand beside"):
        assembly_of_scene(scene(folder, drawn(folder) | other))


@pytest.mark.parametrize("wrong", ["pitch_deviation", "sign"])
def test_a_measurement_that_contradicts_the_forces_is_refused(folder, wrong):
    """Errors of ANGLE, stated as a tenth of it: squares 100 times too large. A pitch nose down is worse."""
    if wrong == "sign":
        write_time_series(folder / "p.csv", {"pitch": ("rad", -angles(folder)[:, 0])}, PERIOD)
    own = {"pitch_deviation": ANGLE / 10} if wrong == "pitch_deviation" else {}
    with pytest.raises(InputError, match="contradicts forces and model"):
        assembly_of_scene(scene(folder, drawn(folder, **own)))


def test_right_innovations_are_called_wrong_as_seldom_as_stated():
    rng, runs = np.random.default_rng(7), 3000
    wrong = sum(not consistency(rng.standard_normal((400, 2)), ("pitch", "rate")).is_consistent for _ in range(runs))
    # 3 of 3000 are expected; the tests of a run hang together a little; Poisson: more than 10 are seen once in 3000
    assert wrong <= 10 and FALSE_ALARM_SHARE == 1e-3
    gaps = rng.standard_normal((4000, 1))
    gaps[rng.random(4000) < 0.3] = np.nan
    assert consistency(gaps, ("pitch",)).is_consistent


@pytest.mark.parametrize(
    "plant, named",
    [
        (lambda w: 1.2 * w, "mean square"),
        (lambda w: 0.8 * w, "mean square"),
        (lambda w: w + 0.2, "mean of pitch"),
        (lambda w: (w[1:] + 0.3 * w[:-1]) / 1.044, "correlation of pitch"),
    ],
)
def test_wrong_innovations_are_named(plant, named):
    found = consistency(plant(np.random.default_rng(8).standard_normal((2000, 1))), ("pitch",))
    assert not found.is_consistent and named in str(found)


def measured_pitch(folder, bias=0.0):
    """The pitch on forces with noise of 16 N, which the scene does not see, and an angle with a bias from 1 s on."""
    clean, noise = free(folder)[:, 3], np.random.default_rng(3).standard_normal(401)
    late = np.arange(401) >= 200
    write_time_series(folder / "p.csv", {"pitch": ("rad", clean + ANGLE * noise + bias * late)}, PERIOD)
    forces = read_time_series(folder / "f.csv", {"front": NEWTONS, "rear": NEWTONS})[0]
    forces = forces + 16.0 * np.random.default_rng(4).standard_normal(forces.shape)
    write_time_series(folder / "f.csv", {"front": ("N", forces[:, 0]), "rear": ("N", forces[:, 1])}, PERIOD)


def test_a_filter_that_contradicts_its_measurement_is_named_by_plan_and_result(folder):
    measured_pitch(folder)
    assert assembly_of_scene(scene(folder, drawn(folder))).doubts == ()
    assert "in doubt" not in simulate(scene(folder, drawn(folder)), "reference").data.attrs["status"]


def test_a_biased_angle_and_wrong_deviations_are_named(folder):
    measured_pitch(folder, bias=4 * ANGLE)
    for changes in ({}, {"pitch_deviation": 2 * ANGLE}):
        own = scene(folder, drawn(folder, **changes))
        (text,) = assembly_of_scene(own).doubts
        assert "the filter contradicts p.csv" in text and "doubt      the filter" in describe(own)
        result = simulate(own, "reference")
        assert "in doubt" in result.data.attrs["status"] and "contradicts" in result.data.attrs["doubts"]


def test_a_mark_for_no_value_is_told_with_column_and_time(folder):
    forces = read_time_series(folder / "f.csv", {"front": NEWTONS, "rear": NEWTONS})[0]
    forces[100, 1] = 9.9e34
    write_time_series(folder / "f.csv", {"front": ("N", forces[:, 0]), "rear": ("N", forces[:, 1])}, PERIOD)
    with pytest.raises(InputError, match=r"column 'rear' at 0.5 s = 9.9e\+34: is an exporter's mark for no value"):
        assembly_of_scene(scene(folder))
