"""Identification: estimates of a car that is known, honest standard errors, bands, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.core.discretisation import error_estimates_of
from models.core.errors import InputError, RunFailed
from models.core.systems import load
from models.core.tables import write_table
from models.identification.bands import error_bands, error_model
from models.identification.fit import fit
from models.identification.of_scene import identification_problem_of, parameter_of_scene
from models.identification.problem import FitClock, IdentificationProblem, IdentifiedParameter, measured_channel
from models.identification.uncertainty import likelihood_profile, uncertainty
from models.measured.drive import read_drive
from models.measured.outliers import without_outliers
from models.systems.single_track import run as single_track
from models.systems.single_track.run import run
from models.systems.single_track.scene import SingleTrackScene, build
from models.systems.wheelset import run as wheelset_run
from studies.command.identify import clock_delay, identification_lines, identify

SCENES = Path(__file__).parents[1] / "studies" / "scenes"
NOISE = {"yaw rate": 0.004, "lateral acceleration": 0.2, "side slip": 0.0008}
UNITS = {"yaw rate": "rad/s", "lateral acceleration": "m/s^2", "side slip": "rad"}
TIMES = np.arange(0.0, 12.0, 0.02)
KEYS = ["vehicle.yaw_inertia", "front.stiffness", "rear.stiffness", "front.friction"]
TRUTH = np.array([1700.0, 16.0, 19.0, 0.95])


def table(**more: object) -> dict:
    """A car, its drive in drive.csv."""
    return {
        "title": "a car",
        "system": "single-track",
        "vehicle": {"mass": 1200.0, "front": 1.2, "rear": 1.4, "yaw_inertia": 1700.0},
        "front": {"stiffness": 16.0, "friction": 0.95},
        "rear": {"stiffness": 19.0, "friction": 1.0},
        "drive": {"file": "drive.csv"},
        **more,
    }


def steer() -> np.ndarray:
    """rad, of both sides and several rates."""
    return 0.045 * np.sin(1.1 * TIMES) * np.cos(0.35 * TIMES) + 0.015 * np.sin(3.7 * TIMES)


@pytest.fixture
def scene(tmp_path: Path) -> SingleTrackScene:
    """The car, and a drive."""
    speed = 20.0 + 3.0 * np.sin(0.4 * TIMES)
    write_table(tmp_path / "drive.csv", {"time": ("s", TIMES), "steer": ("rad", steer()), "speed": ("m/s", speed)})
    return build(table(), "car.toml", tmp_path)


@pytest.mark.parametrize("stiffer", [1.0, 5.0, 20.0])
def test_a_drive_tells_the_error_of_its_steps_between_samples(scene, stiffer):
    """Within 3 of the difference from 16 times as many steps with the inputs straight between the samples."""
    changes = {axle: {**table()[axle], "stiffness": stiffer * table()[axle]["stiffness"]} for axle in ("front", "rear")}
    stiff = build(table(**changes), "car.toml", scene.folder)
    driven, true = run(stiff, error=True), single_track._sensed_in_finer_steps(stiff, *_given(stiff), 16)
    assert set(error_estimates_of(driven)) == set(true)
    for name, estimate in error_estimates_of(driven).items():
        off = float(np.sqrt(np.mean((driven[name] - true[name]) ** 2)))
        assert off / 3.0 < estimate.error < 3.0 * off and estimate.unit == UNITS[name]


def test_tyres_too_stiff_for_the_samples_are_refused(scene):
    """Steps beyond the stability of Heun's method swing from side to side within the friction: nothing diverges."""
    tyres = {axle: {"stiffness": 2000.0, "friction": 0.95} for axle in ("front", "rear")}
    stiff = build(table(**tyres), "car.toml", scene.folder)
    assert np.isfinite(run(stiff)["yaw rate"]).all()
    with pytest.raises(RunFailed, match=r"no answer: .* use at most .* s between samples"):
        run(stiff, error=True)


def _given(scene: SingleTrackScene) -> tuple[np.ndarray, float]:
    """Inputs of a scene's drive, and the period (s) of its samples."""
    drive = read_drive(scene.path(scene.drive.file))
    return single_track.equation_inputs(drive, scene), float(drive.times[1] - drive.times[0])


def measured(scene: SingleTrackScene, seed: int = 1) -> Path:
    """A file of its channels with noise."""
    driven, random = run(scene), np.random.default_rng(seed)
    columns = {n: (UNITS[n], driven[n] + NOISE[n] * random.standard_normal(len(TIMES))) for n in NOISE}
    path = Path(scene.folder) / f"measured_{seed}.csv"
    write_table(path, {"time": ("s", TIMES), **columns})
    return path


def begun(scene: SingleTrackScene) -> SingleTrackScene:
    """The scene from which a search starts: other values."""
    changed = table(
        vehicle={"mass": 1200.0, "front": 1.2, "rear": 1.4, "yaw_inertia": 1400.0},
        front={"stiffness": 13.0, "friction": 1.1},
        rear={"stiffness": 22.0, "friction": 1.0},
    )
    return build(changed, "car.toml", Path(scene.folder))


def test_estimates_are_the_truth_within_their_errors(scene: SingleTrackScene) -> None:
    """Over several noises the squared distances by their covariance are those of chi-square: not too small, either."""
    distances, inside = [], []
    for seed in range(6):
        known = uncertainty(
            fit(identification_problem_of(begun(scene), measured(scene, seed), KEYS, low_pass_edge=5.0))
        )
        assert known.fit.converged
        off = (known.fit.values - TRUTH) / known.fit.problem.scales
        distances.append(float(off @ np.linalg.solve(known.covariance, off)))
        inside.append(np.abs(known.fit.values - TRUTH) < 2.0 * known.deviations)
    total = sum(distances)  # of chi-square with 24 freedoms 99.9 % lie below 52; errors are the larger of two estimates
    assert 3.0 < total < 52.0
    assert np.mean(inside) > 0.75
    with_fault = (known.fit.values * 1.05 - TRUTH) / known.fit.problem.scales
    assert with_fault @ np.linalg.solve(known.covariance, with_fault) > 52.0  # estimates 5 % off are seen


def test_noise_that_stays_widens_errors(scene: SingleTrackScene) -> None:
    """Standard errors from coloured residuals are larger than those of white ones of the same size."""
    problem = identification_problem_of(scene, measured(scene), KEYS)
    white = uncertainty(fit(problem))
    random, coloured = np.random.default_rng(3), []
    for channel in problem.channels:
        slow = np.convolve(random.standard_normal(len(channel.values) + 49), np.ones(50) / np.sqrt(50), "valid")
        coloured.append(replace(channel, values=channel.values + NOISE[channel.name] * slow))
    known = uncertainty(fit(replace(problem, channels=coloured)))
    assert np.all(known.deviations > 1.5 * white.deviations)
    assert known.correlation_time > 5.0 * white.correlation_time


def test_what_data_do_not_determine_is_said(scene: SingleTrackScene) -> None:
    """Drag acts through the friction ellipse alone: the worst combination is its, and it is not determined."""
    keys = ["vehicle.mass", "vehicle.yaw_inertia", "vehicle.drag=-0.0:10.0"]
    blind = build(table(vehicle={**table()["vehicle"], "drag": 1.0}), "car.toml", Path(scene.folder))
    known = uncertainty(fit(identification_problem_of(blind, measured(scene), keys)))
    error, direction = known.combinations()[-1]
    assert np.argmax(np.abs(direction)) == 2 or error > 1.0
    assert not known.is_determined[2]


@pytest.mark.parametrize("late", [0.0, 0.6])
def test_a_clock_that_is_late_is_told(scene: SingleTrackScene, late: float) -> None:
    """The model is held to a measurement of its own, whose clock shows more by 0.6 s."""
    driven = run(scene)
    columns = {name: (UNITS[name], np.interp(TIMES - late, TIMES, driven[name])) for name in NOISE}
    write_table(Path(scene.folder) / "late.csv", {"time": ("s", TIMES), **columns})
    known = uncertainty(
        fit(identification_problem_of(begun(scene), Path(scene.folder) / "late.csv", ["vehicle.yaw_inertia"]))
    )
    assert clock_delay(known) == pytest.approx(late, abs=0.1)  # the start has other tyres, which move the phase
    assert any("the measurement's clock seems" in line for line in identification_lines(known)) == (late > 0.0)


def test_bands_hold_what_was_measured(scene: SingleTrackScene) -> None:
    """Another noise over the same drive lies inside of 95 % bands; bands of a quarter of the width do not hold it."""
    known = uncertainty(fit(identification_problem_of(begun(scene), measured(scene), KEYS, low_pass_edge=5.0)))
    problem = known.fit.problem
    predicted = problem.predicted(known.fit.values)
    errors = [error_model(row - channel.values, row) for row, channel in zip(predicted, problem.channels, strict=True)]
    fresh = identification_problem_of(begun(scene), measured(scene, 7), KEYS, low_pass_edge=5.0)
    answer = error_bands(fresh, known, errors)
    assert np.all(answer.share_inside() > 0.9) and np.all(answer.share_inside() <= 0.995)
    assert np.all(answer.relative_width() < 2.5)
    assert np.all(replace(answer, half_width=0.25 * answer.half_width).share_inside() < 0.7)


def test_resumed_is_the_same(scene: SingleTrackScene, tmp_path: Path) -> None:
    """Stages that are kept give the same bits."""
    path = measured(scene)
    whole = identify(begun(scene), path, KEYS, low_pass=5.0, stages_folder=tmp_path / "kept")
    stages = sorted((tmp_path / "kept" / "stages").glob("block*"))
    stages[-1].unlink()
    again = identify(begun(scene), path, KEYS, low_pass=5.0, stages_folder=tmp_path / "kept")
    assert np.array_equal(whole.fit.values, again.fit.values)
    with pytest.raises(InputError, match="another job"):
        identify(begun(scene), path, KEYS, low_pass=4.0, stages_folder=tmp_path / "kept")


def test_profile_of_a_straight_problem_is_a_parabola() -> None:
    """A model that is linear in its parameters: the profile is what the standard error says."""
    times, random = np.linspace(0.0, 1.0, 400), np.random.default_rng(5)
    clock = FitClock(times)

    def model(values: np.ndarray) -> dict:
        return {"y": (times, values[0] + values[1] * times)}

    channel = measured_channel("y", "-", (times, 1.0 + 2.0 * times + 0.1 * random.standard_normal(400)), clock)
    known = uncertainty(
        fit(
            IdentificationProblem(
                model, [IdentifiedParameter("a", 0.5), IdentifiedParameter("b", 1.0)], [channel], clock
            )
        )
    )
    closed = np.linalg.inv(np.array([[400.0, times.sum()], [times.sum(), (times**2).sum()]])) * 0.01
    assert known.deviations == pytest.approx(np.sqrt(np.diag(closed)), rel=0.4)  # long-run scores scatter
    rises = likelihood_profile(known, 1)
    assert rises.is_quadratic
    assert rises.misfit_rise == pytest.approx(rises.parabolic_rise, rel=0.02)


def test_spikes_are_left_out(scene: SingleTrackScene) -> None:
    """One sample far off is bridged, and counted; noise is kept."""
    values = 0.1 * np.random.default_rng(2).standard_normal(2000)
    assert np.isfinite(without_outliers(values)).all()
    values[700] = 5.0
    assert np.flatnonzero(np.isnan(without_outliers(values))).tolist() == [700]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("front.frictoin", "is no key of the scene"),
        ("front", "holds no number: a parameter is a number of the scene$"),
        ("options.scale", "is not in the scene: --set options.scale=VALUE gives it a value to start from"),
        ("vehicle.centre_height", "must start between its bounds"),
        ("front.friction=2:3", "must start between its bounds"),
        ("front.friction=2", "LOW:HIGH"),
        ("front.friction=2:0.5", "= '2:0.5': .*LOW must be below HIGH"),
        ("front.friction=nan:3", "= 'nan:3': .*both must be numbers"),
    ],
)
def test_parameters_are_refused(scene: SingleTrackScene, text: str, said: str) -> None:
    """Each with the key."""
    with pytest.raises(InputError, match=said) as caught:
        parameter_of_scene(scene, text)
    assert text.partition("=")[0] in str(caught.value)


def test_a_measurement_of_other_channels_is_refused_before_the_long_run(tmp_path: Path, monkeypatch) -> None:
    """Nothing longer than a fiftieth of the scene is run."""
    scene, seconds = load(SCENES / "wheelset.toml"), []
    honest = wheelset_run.run

    def counted(scene, engine=""):
        seconds.append(scene.run.duration)
        return honest(scene, engine)

    monkeypatch.setattr(wheelset_run, "run", counted)
    write_table(tmp_path / "other.csv", {"time": ("s", TIMES), "yaw rate of another": ("rad/s", TIMES)})
    with pytest.raises(InputError, match="no channel has the name"):
        identification_problem_of(scene, tmp_path / "other.csv", ["run.displacement"], "reference")
    assert seconds and max(seconds) <= scene.run.duration / 50.0


def test_files_are_refused(scene: SingleTrackScene, tmp_path: Path) -> None:
    """No channel of the run, a channel without a unit, a measurement of another time."""
    other = tmp_path / "other.csv"
    write_table(other, {"time": ("s", TIMES), "yaw": ("rad/s", TIMES)})
    with pytest.raises(InputError, match="no channel has the name"):
        identification_problem_of(scene, other, KEYS)
    write_table(tmp_path / "late.csv", {"time": ("s", TIMES + 100.0), "yaw rate": ("rad/s", np.sin(TIMES))})
    with pytest.raises(InputError, match="share no time"):
        identification_problem_of(scene, tmp_path / "late.csv", KEYS)
    with pytest.raises(InputError, match="half the sampling rate"):
        identification_problem_of(scene, measured(scene), KEYS, low_pass_edge=30.0)
    with pytest.raises(InputError, match="named twice"):
        identification_problem_of(scene, measured(scene), [KEYS[0], KEYS[0]])
