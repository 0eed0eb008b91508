"""Hard cases of the Kalman filter of the pitch: missing measurements, a wrong start, a vehicle too stiff for its
samples."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from filterpy.common import van_loan_discretization
from filterpy.kalman import ExtendedKalmanFilter
from scipy.linalg import expm

from models.core.noise import PITCH_SENSOR, normal_samples
from models.core.signals import SampledSignal
from models.core.time_series import write_time_series
from models.systems.pitch_plane.pitch_filter import PITCH, RELATIVE_STATES, PitchMeasurement, PitchStep, estimate_pitch
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build
from models.systems.pitch_plane.virtual_measurement import write_wheel_forces
from validation.drift.kalman_runs import relative_state_matrices
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import REFUSED, driven_by_forces, largest_magnitude, static_forces, vehicle

SAMPLE_PERIOD, DURATION = 5e-3, 6.0
FORCE, ANGLE, START_TURN = 16.0, 8e-4, 0.2
"""Standard deviations of each force sample (N), of each measured angle (rad) and of the unknown initial pitch (rad)."""
SLOW_SAMPLE_PERIOD = 0.1
"""Period (s) of force samples that is 70 time constants of the wheels."""


def _largest_pitch_error(
    engine_name: str, work_folder: Path, lost_samples: slice, start_pitch_error: float = 0.0, **filter_options: Any
) -> float:
    """Largest pitch error divided by its stated deviation for a vehicle at rest, with the pitch missing in the
    ``lost_samples`` samples.

    The filter starts from a pitch that is ``start_pitch_error`` (rad) wrong.
    """
    count = round(DURATION / SAMPLE_PERIOD) + 1
    base = vehicle()
    forces = static_forces(base, count, SAMPLE_PERIOD, is_held=False).values
    write_wheel_forces(work_folder, forces[:, 0], forces[:, 1], SAMPLE_PERIOD)
    measured_pitch = base.initial[3] + ANGLE * normal_samples(7, 0, count, 1, noise_source=PITCH_SENSOR)[:, 0]
    measured_pitch[lost_samples] = np.nan
    write_time_series(work_folder / "pitch.csv", {"pitch": ("rad", measured_pitch)}, SAMPLE_PERIOD)
    p, start = base.parameters, base.initial.copy()
    start[[0, 1, 3]] += start_pitch_error * np.array([-p.b, p.a, 1.0])
    scene = build(
        {
            "title": "kalman",
            "run": {"duration": DURATION, "step": 1e-3},
            "start": {"z1": start[0], "z2": start[1], "pitch": start[3]},
            "effects": {
                "wheel_forces": {"file": "wheel_forces.csv", "interpolation": "linear"},
                "force_noise": {"deviation": FORCE, "seed": 7},
                "kalman_filter": {
                    "file": "pitch.csv",
                    "force_deviation": FORCE,
                    "pitch_deviation": ANGLE,
                    **filter_options,
                },
            },
        },
        "kalman",
        work_folder,
    )
    run = simulate(scene, engine_name)
    ended = SAMPLE_PERIOD * (lost_samples.stop or 0)
    late = (run.times < ended) | (run.times > ended + 1.0)  # the moment takes a while to draw the vehicle back
    return largest_magnitude(((run["pitch"] - base.initial[3]) / run["pitch_deviation"])[late & (run.times > 0.1)])


def pitch_outage_error(engine_name: str, work_folder: Path) -> float:
    """Case: no pitch measurement for 3.5 s. Error: largest pitch error divided by its stated deviation."""
    return _largest_pitch_error(engine_name, work_folder, slice(200, 900))


def outage_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: the filter library's own update with a NaN."""
    kalman = ExtendedKalmanFilter(2, 1)
    kalman.x = np.zeros(2)
    kalman.update(np.array([np.nan]), lambda x: np.eye(2)[:1], lambda x: x[:1])
    return f"filterpy takes the NaN in without a word: its state is {kalman.x[0]} for ever after"


def wrong_start_error(engine_name: str, work_folder: Path) -> float:
    """Case: the initial pitch is wrong by one stated deviation. Error: largest pitch error divided by its stated
    deviation."""
    return _largest_pitch_error(engine_name, work_folder, slice(0, 0), START_TURN, start_deviation=START_TURN)


def certain_start_error(engine_name: str, work_folder: Path) -> float:
    """Case: angles measured to 1e-9 rad after an initial uncertainty of 1 rad. Error: largest pitch error divided by
    its stated deviation; infinite for a negative variance."""
    count, exact = 400, 1e-9
    base = vehicle()
    forces = static_forces(base, count + 1, SAMPLE_PERIOD, is_held=False)
    assembly = driven_by_forces(base, forces)
    assembly = replace(
        assembly,
        scene=assembly.scene.model_copy(
            update={"run": assembly.scene.run.model_copy(update={"duration": count * SAMPLE_PERIOD})}
        ),
    )
    measured_pitch = base.initial[3] + exact * normal_samples(7, 0, count + 1, 1, noise_source=PITCH_SENSOR)
    estimated = estimate_pitch(
        assembly, PitchMeasurement(measured_pitch, SAMPLE_PERIOD, (PITCH,), (exact,)), FORCE, start_deviation=1.0
    )
    P = estimated.error_covariances()
    scale = np.sqrt(np.diagonal(P, axis1=1, axis2=2).clip(1e-300))
    values = np.linalg.eigvalsh(P / (scale[:, :, None] * scale[:, None, :]))
    if not np.isfinite(values).all() or values.min() < -1e-6:
        return np.inf
    error_of_values = estimated.states[1:, PITCH] - base.initial[3]
    return float(np.abs(error_of_values / np.sqrt(P[1:, PITCH, PITCH])).max())


def empty_column_error(engine_name: str, work_folder: Path) -> float:
    """Case: a pitch measurement without any number must be refused. Error: largest pitch error divided by its stated
    deviation."""
    return _largest_pitch_error(engine_name, work_folder, slice(None))


def _exact_response() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """State matrix A (6, 6) and input matrix B (6, 2) of the relative states, and their exact response (6, 2) to forces
    held constant over SLOW_PERIOD."""
    a, b = relative_state_matrices(vehicle(geometry="linear").without_tyres())
    block = np.zeros((8, 8))
    block[:6, :6], block[:6, 6:] = a, b
    return a, b, expm(block * SLOW_SAMPLE_PERIOD)[:6, 6:]


def stiff_process_noise_error(engine_name: str, work_folder: Path) -> float:
    """Case: process noise of a filter with forces at 10 Hz, for a vehicle with a pole at -697 1/s. Error: relative
    difference from the exact covariance."""
    base = vehicle(geometry="linear")
    forces = SampledSignal(static_forces(base, 2, SLOW_SAMPLE_PERIOD).values, SLOW_SAMPLE_PERIOD, held=True)
    step = PitchStep(driven_by_forces(base, forces), SLOW_SAMPLE_PERIOD, 1)
    early = step.advance(np.append(RELATIVE_STATES @ base.initial, 0.0), 0)[2][:6]
    wanted = _exact_response()[2]
    return float(np.linalg.norm(early @ early.T - wanted @ wanted.T) / np.linalg.norm(wanted @ wanted.T))


def stiff_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: process noise of the stiff vehicle by filterpy's discretisation."""
    a, b, wanted = _exact_response()
    noise = van_loan_discretization(a, b * np.sqrt(SLOW_SAMPLE_PERIOD), SLOW_SAMPLE_PERIOD)[1]
    variance_ratio, least_eigenvalue = (
        noise[2, 2] / (wanted @ wanted.T)[2, 2],
        np.linalg.eigvalsh((noise + noise.T) / 2).min(),
    )
    return (
        f"filterpy's van_loan_discretization gives a pitch variance {variance_ratio:.1e} times the right one, and an "
        f"eigenvalue of {least_eigenvalue:.1e}, unwarned"
    )


CASES = (
    HardCase(
        "pitch measurement with an outage",
        "3.5 s without a number, during which the vehicle drifts freely",
        "the true pitch, by the deviation that the filter states",
        "deviations",
        5.0,
        "Gaussian: 5 deviations are left once in 1.7 million",
        pitch_outage_error,
        {},
        outage_naive_result,
    ),
    HardCase(
        "filter from a wrong start",
        "vehicle and filter begin 0.2 rad from where the true one is",
        "the true pitch after 1 s, by the deviation that the filter states",
        "deviations",
        5.0,
        "Gaussian: 5 deviations are left once in 1.7 million",
        wrong_start_error,
    ),
    HardCase(
        "filter told of angles to a billionth",
        "R = 1e-18 beside P = 1: subtracted covariances lose all digits",
        "the true pitch by the stated deviation, eigenvalues of the scaled covariance above -1e-6",
        "deviations",
        5.0,
        "Gaussian: 5 deviations are left once in 1.7 million",
        certain_start_error,
        is_without_engine=True,
    ),
    HardCase(
        "pitch measurement without a number",
        "a column of NaN",
        "refused",
        "",
        0.0,
        "there is nothing to follow",
        empty_column_error,
        REFUSED,
    ),
    HardCase(
        "process noise of a stiff vehicle",
        "forces at 10 Hz, a pole of -697 1/s",
        "the response to a held force by the matrix exponential",
        "of its norm",
        1e-6,
        "Runge-Kutta in substeps of 1 ms; the fast modes have settled",
        stiff_process_noise_error,
        {},
        stiff_naive_result,
    ),
)
