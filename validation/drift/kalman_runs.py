"""Experiments on the Kalman filter of the pitch: scenes, consistency, linear closed loop, missing samples, damage."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, sosfiltfilt

from models.core.noise import PITCH_SENSOR, normal_samples
from models.core.result import Result
from models.core.time_series import write_time_series
from models.drift.growth import pitch_spring
from models.drift.score import SECTION_FORCE_CHANNELS, root_mean_square, section_forces
from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build
from models.engines.stability import first_order, linearised_matrices
from models.fatigue.damage import damage_ratio
from models.systems.pitch_plane.effects.kalman_filter import PULL_BANDWIDTH, guide_of
from models.systems.pitch_plane.pitch_filter import (
    FILTERED_STATES,
    PITCH,
    PITCH_RATE,
    RELATIVE_STATES,
    PitchEstimate,
    PitchMeasurement,
    estimate_pitch,
)
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, changed_scene
from models.systems.pitch_plane.scene import build as build_scene
from models.systems.pitch_plane.virtual_measurement import perturbed_parameters, write_measurement, write_wheel_forces
from models.vehicles.parameters.itwm_drift import PARAMETERS
from validation.common.scenes import force_scene, road_scene

ANGLE_DEVIATION = float(np.deg2rad(0.1))
"""Standard deviation (rad) of the inertial unit's pitch samples, white noise at 1 kHz."""
GYRO_DEVIATION = 0.1
"""Standard deviation (rad/s) of the gyro's samples, white noise at 1 kHz."""
FORCE_NOISE_SHARE = 0.002
"""Standard deviation of the force noise divided by the largest force, at 1 kHz."""
COARSE_PERIOD = 5e-3
"""Sampling period (s) of the statistics; deviations per sample are scaled to the noise intensity at 1 kHz."""
JUDGED_BAND = 15.0
"""Frequency (Hz) up to which the artificial moment is judged."""


def deviation_at_period(noise_deviation: float, sample_period: float) -> float:
    """Standard deviation of samples at a sampling period (s) that has the same noise intensity as ``noise_deviation``
    at 1 kHz."""
    return noise_deviation * float(np.sqrt(1e-3 / sample_period))


@cache
def measured_drive(output_folder: Path, duration: float, sample_period: float) -> Result:
    """Virtual measurement on the study road with rows ``sample_period`` (s) apart; its files are written to the
    folder.
    """
    path = simulate(road_scene(step=min(sample_period, 1e-3) / 2, duration=duration), "reference")
    write_measurement(path, output_folder, sample_period)
    return path.every(sample_period)


def force_deviation(true_run: Result) -> float:
    """Standard deviation (N) of the force noise: 0.2 % of the largest wheel force of a run."""
    return FORCE_NOISE_SHARE * float(max(np.abs(true_run["f1"]).max(), np.abs(true_run["f2"]).max()))


def force_driven_scene(
    scene_folder: Path,
    duration: float,
    effect_tables: dict[str, Any],
    *,
    with_wrong_parameters: bool = False,
    geometry: str = "exact",
) -> Scene:
    """Scene of the vehicle under the wheel forces in the folder, with steps of 1 ms. with_wrong_parameters: whether the
    model's parameters are wrong."""
    override = perturbed_parameters(PARAMETERS) if with_wrong_parameters else {}
    return changed_scene(
        force_scene(scene_folder, duration=duration, parameter_changes=override, effects=effect_tables),
        vehicle={"geometry": geometry},
    )


def force_noise_settings(noise_deviation: float, seed: int) -> dict[str, Any]:
    """Scene table of the effect that adds noise of a standard deviation (N) to the wheel forces."""
    return {"force_noise": {"deviation": noise_deviation, "seed": seed}}


def free_run(assembly: Assembly, duration: float, sample_period: float) -> np.ndarray:
    """States (n, 8) of a run without stabiliser in the reference, ``sample_period`` (s) apart."""
    states = build("reference", assembly, Settings("RK4", 1e-3, duration)).run().states
    return states[:: round(sample_period / 1e-3)]


def filter_consistency(
    scene_folder: Path, duration: float, seed: int, uncertainty_scales: dict[str, tuple[float, float]]
) -> dict[str, Any]:
    """Filter name -> normalised estimation errors squared (NEES), normalised innovations squared (NIS) and innovations
    in a run without model error. ``uncertainty_scales``: factors of each filter's process and measurement noise.

    The true vehicle starts turned by a random angle, which the filter knows the deviation of. NEES (6 states) is
    taken once a second from the second one on, far beyond the estimate's memory of some 0.2 s.
    """
    true = measured_drive(scene_folder, duration, COARSE_PERIOD)
    force, angle = (
        deviation_at_period(force_deviation(true), COARSE_PERIOD),
        deviation_at_period(ANGLE_DEVIATION, COARSE_PERIOD),
    )
    clean = assembly_of_scene(force_driven_scene(scene_folder, duration, {}))
    turn = START_DEVIATION * float(normal_samples(seed, 1, 1, 1, noise_source=PITCH_SENSOR)[0, 0])
    p, start = clean.parameters, clean.initial.copy()
    start[[0, 1, 3]] += turn * np.array([-p.b, p.a, 1.0])
    states = free_run(replace(clean, initial=start), duration, COARSE_PERIOD)
    measured_pitch = states[:, 3] + angle * normal_samples(seed, 0, len(states), 1, noise_source=PITCH_SENSOR)[:, 0]
    noisy = assembly_of_scene(force_driven_scene(scene_folder, duration, force_noise_settings(force, seed)))
    figures = {}
    for name, (q, r) in uncertainty_scales.items():
        measurement = PitchMeasurement(measured_pitch[:, None], COARSE_PERIOD, (PITCH,), (angle * np.sqrt(r),))
        filtered = estimate_pitch(noisy, measurement, force * np.sqrt(q), start_deviation=START_DEVIATION)
        first = round(1 / COARSE_PERIOD)
        figures[name] = (
            normalised_estimation_error(filtered, states),
            filtered.normalised_innovations[first:],
            filtered.innovations[first:],
        )
    return figures


START_DEVIATION = 0.02
"""Standard deviation (rad) of the initial pitch in the runs on filter consistency."""


def normalised_estimation_error(pitch_estimate: PitchEstimate, true_states: np.ndarray) -> np.ndarray:
    """Normalised estimation error squared (NEES) of the six relative states, once a second from 2 s on."""
    rows = np.arange(round(2 / pitch_estimate.period), len(true_states), round(1 / pitch_estimate.period))
    wrong = (pitch_estimate.states[rows, :6] - true_states[rows] @ RELATIVE_STATES.T)[:, :, None]
    return (wrong.transpose(0, 2, 1) @ np.linalg.solve(pitch_estimate.error_covariances()[rows, :6, :6], wrong))[
        :, 0, 0
    ]


def closed_loop_covariance(scene_folder: Path, noise_deviation: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition matrix (14, 14) and stationary covariance (14, 14) of the linearised loop of filter and vehicle. Its
    states are the filter's error (6), the run's error (6) and the force noise (2).

    Errors are those of the six relative states at the samples, estimate after its update, ``COARSE_PERIOD`` apart.
    Exact: exponentials of the vehicle's and of the held vehicle's matrices under inputs that are linear between
    samples.
    noise_deviation : N, of each force sample at COARSE_PERIOD.
    """
    import control

    force, angle = noise_deviation, deviation_at_period(ANGLE_DEVIATION, COARSE_PERIOD)
    assembly = assembly_of_scene(force_driven_scene(scene_folder, 1.0, {}, geometry="linear"))
    stiffness, damping = pitch_spring(assembly.parameters, PULL_BANDWIDTH, 0.7)
    free, pushes = relative_state_matrices(assembly)
    lever = np.zeros((6, 6))
    lever[PITCH_RATE, [PITCH, PITCH_RATE]] = np.array([stiffness, damping]) / assembly.parameters.I
    f, g0, g1 = first_order_hold(free, pushes)
    h, m0, m1 = first_order_hold(free - lever, np.hstack([pushes, lever]))
    q = force**2 * (g0 + f @ g1) @ (g0 + f @ g1).T
    see = np.eye(6)[[PITCH]]
    prior = control.dare(f.T, see.T, q, np.array([[angle**2]]))[0]
    gain = prior @ see.T / (prior[PITCH, PITCH] + angle**2)
    keep = np.eye(6) - gain @ see
    step, push = np.zeros((14, 14)), np.zeros((14, 3))
    step[:6, :6], step[:6, 12:], push[:6, :2], push[:6, 2:] = keep @ f, keep @ g0, keep @ g1, gain
    step[6:12, :6] = m0[:, 2:] + m1[:, 2:] @ keep @ f
    step[6:12, 6:12], step[6:12, 12:] = h, m0[:, :2] + m1[:, 2:] @ keep @ g0
    push[6:12, :2], push[6:12, 2:] = m1[:, :2] + m1[:, 2:] @ keep @ g1, m1[:, 2:] @ gain
    push[12:, :2] = np.eye(2)
    scaled = push * np.array([force, force, angle])
    return step, control.dlyap(step, scaled @ scaled.T)


def relative_state_matrices(assembly: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """State matrix A (6, 6) and input matrix B (6, 2) for wheel forces of the vehicle's states relative to the chassis,
    linearised about zero pitch."""
    p = assembly.parameters
    pushes = np.zeros((8, 2))
    pushes[4, 0], pushes[5, 1] = -1 / p.m1, -1 / p.m2
    return RELATIVE_STATES @ first_order(linearised_matrices(assembly.vehicle))[
        :, FILTERED_STATES
    ], RELATIVE_STATES @ pushes


def first_order_hold(state_matrix: np.ndarray, input_matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Discretises x' = a x + b u over COARSE_PERIOD with linearly interpolated input: transition matrix, and input
    matrices for the samples at start and end."""
    n, m = input_matrix.shape
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m] = state_matrix, input_matrix
    block[n : n + m, n + m :] = np.eye(m) / COARSE_PERIOD
    transition = expm(block * COARSE_PERIOD)
    late = transition[:n, n + m :]
    return transition[:n, :n], transition[:n, n : n + m] - late, late


def loop_errors(scene_folder: Path, noise_deviation: float, duration: float, seed: int) -> np.ndarray:
    """Errors (n, 12) of the estimate and of the run, from 2 s on, ordered as in ``closed_loop_covariance``, simulated
    with the effect ``kalman_filter`` on the linearised vehicle.

    noise_deviation : N, at COARSE_PERIOD. The true vehicle rests, because the interpolation of a moving estimate
    between its samples would add an error that is no noise.
    """
    rest_assembly = assembly_of_scene(
        build_scene({"title": "kalman", "vehicle": {"geometry": "linear"}, "run": {"duration": 1.0}})
    )
    p, start, angle = (
        rest_assembly.parameters,
        rest_assembly.initial,
        deviation_at_period(ANGLE_DEVIATION, COARSE_PERIOD),
    )
    count = round(duration / COARSE_PERIOD) + 1
    write_wheel_forces(scene_folder, np.full(count, p.k1 * start[0]), np.full(count, p.k2 * start[1]), COARSE_PERIOD)
    measured_pitch = start[3] + angle * normal_samples(seed, 0, count, 1, noise_source=PITCH_SENSOR)[:, 0]
    write_time_series(scene_folder / "read.csv", {"pitch": ("rad", measured_pitch)}, COARSE_PERIOD)
    effect = {"file": "read.csv", "force_deviation": noise_deviation, "pitch_deviation": angle}
    noise = force_noise_settings(noise_deviation, seed)
    drawn = force_driven_scene(scene_folder, duration, noise | {"kalman_filter": effect}, geometry="linear")
    run = free_run(assembly_of_scene(drawn), duration, COARSE_PERIOD)
    guide = guide_of(
        assembly_of_scene(force_driven_scene(scene_folder, duration, noise, geometry="linear")),
        drawn.effects["kalman_filter"],
    )
    errors = np.hstack([guide.states[:, :6] - RELATIVE_STATES @ start, (run - start) @ RELATIVE_STATES.T])
    return errors[round(2 / COARSE_PERIOD) :]


def spread_of_mean_square(transition_matrix: np.ndarray, covariance: np.ndarray, sample_count: int) -> np.ndarray:
    """Relative standard deviation of the mean square of each error over ``sample_count`` correlated samples.

    For Gaussian errors: 2/N times the sum over all lags of the squared autocorrelation.
    """
    lags, total, carried = min(sample_count, 2000), np.zeros(len(transition_matrix)), covariance.copy()
    for lag in range(lags):
        total += (2.0 if lag else 1.0) * np.square(carried.diagonal() / covariance.diagonal())
        carried = transition_matrix @ carried
    return np.sqrt(2.0 * total / sample_count)


def scores_of_stabilised(
    scene_folder: Path, duration: float, seed: int, engines: tuple[str, ...], with_wrong_parameters: bool = True
) -> dict[str, dict[str, float]]:
    """Engine -> scores of a run that the Kalman filter stabilises, for a noise path: damage ratios, shares of the
    artificial moment, and largest pitch error (rad)."""
    true = measured_drive(scene_folder, duration, 1e-3)
    measured_pitch = (
        true["pitch"] + ANGLE_DEVIATION * normal_samples(seed, 0, len(true.times), 1, noise_source=PITCH_SENSOR)[:, 0]
    )
    write_time_series(scene_folder / "read.csv", {"pitch": ("rad", measured_pitch)}, 1e-3)
    force = force_deviation(true)
    effect = {
        "file": "read.csv",
        "force_deviation": force,
        "pitch_deviation": ANGLE_DEVIATION,
        "inertia_deviation": INERTIA_UNCERTAINTY,
    }
    scene = force_driven_scene(
        scene_folder,
        duration,
        force_noise_settings(force, seed) | {"kalman_filter": effect},
        with_wrong_parameters=with_wrong_parameters,
    )
    return {engine: _scores_of_run(true, simulate(scene, engine)) for engine in engines}


INERTIA_UNCERTAINTY = 0.05
"""Standard deviation of the relative error of the model's inertia that the filter assumes: 5 %."""


def _scores_of_run(true_run: Result, stabilised_run: Result) -> dict[str, float]:
    wanted, had = (
        section_forces(compared_run["f3"], compared_run["f4"], compared_run["pitch"])
        for compared_run in (true_run, stabilised_run)
    )
    scores = {name: damage_ratio(had[name], wanted[name]) for name in SECTION_FORCE_CHANNELS}
    term = PARAMETERS.I * np.gradient(true_run["pitch_rate"], true_run.times)
    moments = {
        "pull": stabilised_run["kalman_moment"],
        "all": stabilised_run["kalman_moment"] + stabilised_run["inertia_moment"],
    }
    low = butter(4, JUDGED_BAND, fs=1 / float(true_run.times[1]), output="sos")
    for name, moment in moments.items():
        scores[name] = root_mean_square(moment) / root_mean_square(term)
        scores[f"{name}, band"] = root_mean_square(sosfiltfilt(low, moment)) / root_mean_square(sosfiltfilt(low, term))
    scores["pitch"] = float(np.abs(stabilised_run["pitch"] - true_run["pitch"]).max())
    scores["inertia"] = float(stabilised_run["inertia_share"][-1])
    return scores


def gyro_only_pitch_error(scene_folder: Path, duration: float, seed: int) -> dict[str, float]:
    """Pitch error (rad) after a long run with a gyro as the only sensor: rms error, the filter's stated deviation, the
    deviation that the averaged instability predicts, and a random walk.

    The law: the stationary Riccati equation of pitch'' = lambda^2 pitch + noise with the rate measured. About a
    vehicle that stands level, A(0), the same gyro leaves a random walk.
    """
    import control

    true = measured_drive(scene_folder, duration, COARSE_PERIOD)
    force, gyro = (
        deviation_at_period(force_deviation(true), COARSE_PERIOD),
        deviation_at_period(GYRO_DEVIATION, COARSE_PERIOD),
    )
    assembly = assembly_of_scene(force_driven_scene(scene_folder, duration, force_noise_settings(force, seed)))
    clean = true.states
    measured_rate = clean[:, 7] + gyro * normal_samples(seed, 0, len(clean), 1, noise_source=PITCH_SENSOR)[:, 0]
    estimated = estimate_pitch(
        assembly, PitchMeasurement(measured_rate[:, None], COARSE_PERIOD, (PITCH_RATE,), (gyro,)), force
    )
    p, sure = assembly.parameters, np.sqrt(estimated.error_covariances()[:, PITCH, PITCH])
    inertia = p.I + p.m1 * p.b**2 + p.m2 * p.a**2
    growth = root_mean_square(true["pitch_rate"]) * np.sqrt(p.I / inertia)
    push = (force**2 * COARSE_PERIOD * (p.a**2 + p.b**2)) / inertia**2
    model, see = np.array([[0.0, 1.0], [growth**2, 0.0]]), np.array([[0.0, 1.0]])
    law = control.care(model.T, see.T, np.diag([0.0, push]), np.array([[gyro**2 * COARSE_PERIOD]]))[0]
    wrong = estimated.states[len(clean) // 6 :, PITCH] - clean[len(clean) // 6 :, 3]
    return {
        "stated": float(sure[-1]),
        "law": float(np.sqrt(law[0, 0])),
        "error": root_mean_square(wrong),
        "walk": float(GYRO_DEVIATION * np.sqrt(1e-3 * duration)),
    }


def run_with_missing_samples(
    scene_folder: Path,
    duration: float,
    seed: int,
    missing_columns: tuple[int, ...],
    random_gap_level: float,
    outage_times: tuple[float, float] | None,
) -> dict[str, float]:
    """Figures of a stabilised run on a file with missing samples: largest pitch error (rad), largest pitch error
    divided by the deviation that the filter states, and counts of missing samples."""
    true = measured_drive(scene_folder, duration, COARSE_PERIOD)
    deviations = {
        PITCH: deviation_at_period(ANGLE_DEVIATION, COARSE_PERIOD),
        PITCH_RATE: deviation_at_period(GYRO_DEVIATION, COARSE_PERIOD),
    }
    clean = free_run(assembly_of_scene(force_driven_scene(scene_folder, duration, {})), duration, COARSE_PERIOD)
    noise = normal_samples(seed, 0, len(clean), 3, noise_source=PITCH_SENSOR)
    lost = np.abs(noise[:, 2]) < random_gap_level
    if outage_times is not None:
        lost[round(outage_times[0] / COARSE_PERIOD) : round(outage_times[1] / COARSE_PERIOD)] = True
    names = {PITCH: ("pitch", "rad", 3, "pitch_deviation"), PITCH_RATE: ("pitch_rate", "rad/s", 7, "rate_deviation")}
    table, force = {}, deviation_at_period(force_deviation(true), COARSE_PERIOD)
    effect: dict[str, Any] = {"file": "read.csv", "force_deviation": force}
    for i, column in enumerate(missing_columns):
        name, unit, state, key = names[column]
        table[name] = (unit, np.where(lost, np.nan, clean[:, state] + deviations[column] * noise[:, i]))
        effect[key] = deviations[column]
    write_time_series(scene_folder / "read.csv", table, COARSE_PERIOD)
    run = simulate(
        force_driven_scene(scene_folder, duration, force_noise_settings(force, seed) | {"kalman_filter": effect}),
        "reference",
    )
    stride = round(COARSE_PERIOD / 1e-3)
    wrong = run["pitch_estimate"][::stride] - clean[:, 3]
    sure = run["pitch_deviation"][::stride]
    return {
        "error by deviation": float(np.abs(wrong[1:] / sure[1:]).max()),
        "error": float(np.abs(wrong).max()),
        "run's error": float(np.abs(run["pitch"][::stride] - clean[:, 3]).max()),
        "deviation": float(sure.max()),
        "miscounted": float(abs(run["kalman_missed"][-1] - lost.sum() * len(missing_columns))),
        "missed": float(run["kalman_missed"][-1]),
    }
