"""The inertial unit of the paper's Section 3.2: attitude integrated from noisy rates, its exact laws, and a recording
from a real car."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.core.noise import GYRO, normal_samples
from models.core.time_series import write_time_series
from models.drift.score import root_mean_square, section_forces
from models.sensors.inertial_unit import (
    DEGREES_PER_HOUR,
    angle_random_walk_of,
    angle_variance,
    bias_path,
    error_rotation,
    mean_error_rotation,
    mean_error_scalar,
    mean_error_trace,
    mean_square_norm_by_euler,
    measured_attitude,
    quaternion_norm_by_ito,
    quaternions_by_euler_steps,
    true_attitude,
)
from models.sensors.rotations import integrate_attitude, quaternion_of_rotation_vector, rotation_matrix, rotation_vector
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.virtual_measurement import follower_builder, write_measurement
from models.systems.pitch_plane.virtual_measurement import measure as measure_road
from validation.common.bands import mean_square
from validation.common.rows import CaseAnswer, Observed, Row, System, not_run
from validation.common.scenes import on_paper_road, road_scene
from validation.drift.attitudes import (
    SEED,
    START_ATTITUDE,
    attitude_errors,
    coning_motion,
    largest_angle,
    standard_errors,
    turning_rates,
)
from validation.drift.ten_minutes import RATE_DEVIATION, SAMPLING_RATE, TEN_MINUTES
from validation.drift.ten_minutes import draw as draw
from validation.drift.ten_minutes import tables as tables
from validation.measured import recording

TITLE = "Attitude from a gyro's rates"
SYSTEM: System = "drift"
STANDARD_ERRORS_OF_BAND = 3.3
"""Number of standard errors within which a mean lies 999 times in 1,000."""
UNEQUAL_ANGLE_WALKS = np.array([0.1, 0.3, 0.6])
"""Angle random walk of each axis, rad per sqrt(s)."""
EQUAL_ANGLE_WALK = 0.5
"""Angle random walk, rad per sqrt(s), where all axes have the same."""
SAMPLE_PERIOD, RUN_SECONDS = 5e-3, 2.0
"""Sampling period and length (s) of the Monte Carlo runs; one step contributes some 1e-4 of the law's value."""


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for exact rates, the laws, the ten-minute example, gyro bias and the recording; a full run also has the
    section forces."""
    paths = 200 if quick else 4000
    rows = [
        *_exact_rate_rows(),
        *_one_axis_noise_rows(paths),
        *_three_axis_noise_rows(paths),
        *_quaternion_norm_rows(paths),
        *_gyro_bias_rows(paths),
    ]
    example, data = _ten_minute_drive_rows(0 if quick else 60)
    recorded, seen = _real_car_recording_rows(paths)
    return [*rows, *example, *recorded, *([] if quick else _section_force_rows())], {
        "ten minutes": data,
        "recording": seen,
    }


def _exact_rate_rows() -> list[Row]:
    """Rows: error of the attitude integrated from exact rates, about a fixed axis and about an axis that moves on a
    cone."""
    rate, h = np.array([0.3, -1.1, 0.7]), 1e-3
    attitudes = true_attitude(np.broadcast_to(rate, (10_000, 3)), h, START_ATTITUDE)
    rates, true = coning_motion(h * np.arange(10_001))
    coned = integrate_attitude(rates, h, true[0])
    off = float(np.abs(np.linalg.norm(coned, axis=1) - 1).max())
    fixed, turned = (
        "constant rate, 10 s at 1 kHz: largest error of the attitude",
        quaternion_of_rotation_vector(10 * rate),
    )
    swept = "axis on a cone of 0.3 rad at 2 rad/s, 10 s at 1 kHz: largest error"
    order = "fourth order in the sampling period, without noise"
    return [
        _closed_form_row(
            "clean.axis", fixed, largest_angle(attitudes[-1], turned), "rad", "each step is the exact exponential"
        ),
        _closed_form_row("clean.cone", swept, largest_angle(coned, true), "rad", order),
        _closed_form_row(
            "clean.norm", "largest departure of the quaternion's norm from 1", off, "", "normalised in each step"
        ),
    ]


def _closed_form_row(
    row_name: str, quantity_name: str, error_value: float, unit: str, tolerance_reason: str, error_bound: float = 1e-12
) -> Row:
    """Row for an error relative to a closed form."""
    return Observed(f"inertial_unit.{row_name}", SYSTEM, quantity_name, error_value, unit).at_most(
        error_bound, tolerance_reason, "closed form"
    )


def _one_axis_noise_rows(noise_path_count: int) -> list[Row]:
    """Rows on eqs (27) to (30): with noise on one gyro axis and no rotation, the angle about this axis is a Brownian
    motion."""
    rows = []
    for axis in range(3):
        deviation = EQUAL_ANGLE_WALK / SAMPLE_PERIOD**0.5 * np.eye(3)[axis]
        turns = rotation_vector(attitude_errors(np.zeros((200, 3)), SAMPLE_PERIOD, deviation, noise_path_count))
        spill = float(np.abs(np.delete(turns, axis, axis=1)).max())
        rows += [
            mean_square(
                Observed(
                    f"inertial_unit.one_axis.{axis + 1}",
                    SYSTEM,
                    f"mean square angle with noise about axis {axis + 1}",
                    float(np.mean(turns[:, axis] ** 2)),
                    "rad^2",
                ),
                EQUAL_ANGLE_WALK**2 * 200 * SAMPLE_PERIOD,
                noise_path_count,
                f"s^2 t; {noise_path_count:,} paths, seed {SEED}",
            ),
            _closed_form_row(
                f"one_axis.{axis + 1}.spill",
                f"largest angle about the two axes without noise, noise about axis {axis + 1}",
                spill,
                "rad",
                "eq. (30): the spurious rotation keeps to its own axis",
            ),
        ]
    return rows


def _mean_value_row(
    row_name: str, quantity_name: str, simulated_values: np.ndarray, expected_mean: float, tolerance_reason: str
) -> Row:
    """Row for a mean that must lie within STANDARD_ERRORS_OF_BAND standard errors of its theoretical value."""
    error = float(simulated_values.std(ddof=1) / math.sqrt(len(simulated_values)))
    return Observed(f"inertial_unit.{row_name}", SYSTEM, quantity_name, float(simulated_values.mean()), "").within(
        expected_mean,
        STANDARD_ERRORS_OF_BAND * error,
        f"{tolerance_reason}; {len(simulated_values):,} paths, seed {SEED}, within {STANDARD_ERRORS_OF_BAND} "
        "standard errors "
        f"of {error:.2g}",
        "closed form",
    )


def _three_axis_noise_rows(noise_path_count: int) -> list[Row]:
    """Rows on noise about three axes. Equal noise: mean trace of the error matrix; unequal noise on a turning body:
    mean error matrix and mean quaternion."""
    count = round(RUN_SECONDS / SAMPLE_PERIOD)
    rates, root = turning_rates(count, SAMPLE_PERIOD), SAMPLE_PERIOD**0.5
    equal = attitude_errors(rates, SAMPLE_PERIOD, EQUAL_ANGLE_WALK / root * np.ones(3), noise_path_count)
    wandered = attitude_errors(rates, SAMPLE_PERIOD, UNEQUAL_ANGLE_WALKS / root, noise_path_count)
    trace, exact = (
        np.trace(rotation_matrix(equal), axis1=1, axis2=2),
        mean_error_rotation(UNEQUAL_ANGLE_WALKS, rates, SAMPLE_PERIOD, START_ATTITUDE),
    )
    resting = mean_error_rotation(UNEQUAL_ANGLE_WALKS, np.zeros_like(rates), SAMPLE_PERIOD, START_ATTITUDE)
    all_equal = np.full(3, EQUAL_ANGLE_WALK)
    same = float(np.trace(mean_error_rotation(all_equal, rates, SAMPLE_PERIOD, START_ATTITUDE)))
    return [
        _mean_value_row(
            "trace",
            "mean trace of the error's rotation matrix, three equal axes, turning body",
            trace,
            mean_error_trace(EQUAL_ANGLE_WALK, RUN_SECONDS),
            "3 exp(-s^2 t)",
        ),
        _mean_value_row(
            "scalar",
            "mean scalar part q1 of the error's quaternion, three equal axes, turning body",
            equal[:, 0],
            mean_error_scalar(all_equal, RUN_SECONDS),
            "exp(-3 s^2 t / 8), of the normalised quaternion",
        ),
        _mean_value_row(
            "scalar.unequal",
            "mean scalar part q1 of the error's quaternion, unequal axes, turning body",
            wandered[:, 0],
            mean_error_scalar(UNEQUAL_ANGLE_WALKS, RUN_SECONDS),
            "exp(-sum of s^2 t / 8): the quaternion cannot see which axis is noisy",
        ),
        _closed_form_row(
            "matrix.equal",
            "difference of the matrix law with equal noise from 3 exp(-s^2 t)",
            abs(same - mean_error_trace(EQUAL_ANGLE_WALK, RUN_SECONDS)),
            "",
            "both are exact",
        ),
        _closed_form_row(
            "matrix",
            "error of the mean rotation matrix with unequal noise, turning body, worst entry over its standard error",
            standard_errors(wandered, exact),
            "",
            f"{noise_path_count:,} paths, seed {SEED}; entries differ from the identity by "
            f"up to {np.abs(exact - np.eye(3)).max():.2f}",
            STANDARD_ERRORS_OF_BAND,
        ),
        Observed(
            "inertial_unit.matrix.resting",
            SYSTEM,
            "difference of the mean rotation matrix of a turning body from the law of a body at "
            "rest, worst entry over its standard error",
            standard_errors(wandered, resting),
            "",
        ).beside(f"far beyond {STANDARD_ERRORS_OF_BAND}", "the rows above can tell the laws apart", "closed form"),
    ]


STRATONOVICH_LAW_REASON = "exp(-k s^2 t / 8), as after Stratonovich"


def _quaternion_norm_rows(noise_path_count: int) -> list[Row]:
    """Rows on Ito's theory: the norm of a quaternion that is never normalised grows by a law, and the mean quaternion
    is the true one."""
    rows, steps, span = [], 100, 4.0
    period = span / steps
    for axes in (1, 3):
        noise = np.zeros((steps, noise_path_count, 3))
        noise[:, :, :axes] = normal_samples(SEED, axes, steps * noise_path_count, axes, noise_source=GYRO).reshape(
            steps, noise_path_count, axes
        )
        q = quaternions_by_euler_steps(EQUAL_ANGLE_WALK * period**0.5 * noise, START_ATTITUDE)
        square = np.sum(q**2, axis=1)
        law = mean_square_norm_by_euler(EQUAL_ANGLE_WALK, axes, period, steps)
        scalar, true, noisy = mean_error_scalar(np.full(axes, EQUAL_ANGLE_WALK), span), q[:, 0], f"{axes} noisy axes"
        means = (
            (
                "norm",
                f"mean squared norm of the quaternion by explicit Euler, {noisy}, not normalised",
                square,
                law,
                "(1 + k s^2 D / 4)^n",
            ),
            (
                "mean",
                f"mean scalar part q1 by explicit Euler, {noisy}, not normalised",
                true,
                1.0,
                "after Ito the mean is the true quaternion",
            ),
            (
                "direction",
                f"mean scalar part q1 by explicit Euler, normalised at the end, {noisy}",
                true / square**0.5,
                scalar,
                STRATONOVICH_LAW_REASON,
            ),
        )
        rows += [
            *(_mean_value_row(f"{id}.{axes}", *figures) for id, *figures in means),
            Observed(
                f"inertial_unit.growth.{axes}",
                SYSTEM,
                f"root of the explicit Euler law at 4e6 steps, {axes} noisy axes",
                mean_square_norm_by_euler(EQUAL_ANGLE_WALK, axes, 1e-6, 4_000_000) ** 0.5,
                "",
            ).within(
                quaternion_norm_by_ito(np.full(axes, EQUAL_ANGLE_WALK), span),
                1e-6,
                "exp(k s^2 t / 8), eq. (28)",
                "closed form",
            ),
        ]
    return rows


def _ten_minute_drive_rows(noise_path_count: int) -> CaseAnswer:
    """Rows and data on the paper's example: 600 s of a car's motion at 1 kHz, with white noise of 0.1 rad/s on each
    gyro sample."""
    walk = angle_random_walk_of(RATE_DEVIATION, SAMPLING_RATE)
    axis = math.degrees(walk * TEN_MINUTES**0.5)
    why = "s = 0.1 sqrt(1e-3) rad; the fraction that the print garbles is 180 / pi"
    rows = [
        Observed(
            "inertial_unit.walk",
            SYSTEM,
            "angle random walk of the ten-minute example",
            math.degrees(walk),
            "deg per sqrt(s)",
        ).within(0.1812, 5e-5, why, "published"),
        *(
            Observed(f"inertial_unit.ten_minutes.{id}", SYSTEM, what, angle, "deg").within(
                law, 5e-3, why, "closed form"
            )
            for id, what, angle, law, why in (
                ("axis", "rms angle per axis of the ten-minute example at 600 s", axis, 4.44, "s sqrt(t)"),
                (
                    "total",
                    "rms angle about all axes of the ten-minute example at 600 s",
                    axis * 3**0.5,
                    7.69,
                    "s sqrt(3 t)",
                ),
            )
        ),
    ]
    if not noise_path_count:
        return rows, {}
    every = round(SAMPLING_RATE)
    t = np.arange(round(TEN_MINUTES * SAMPLING_RATE)) / SAMPLING_RATE
    rates = np.column_stack([0.05 * np.sin(5 * t), 0.08 * np.sin(7 * t), 0.1 * np.sin(0.2 * t)])  # a car on a road
    true = true_attitude(rates, 1 / SAMPLING_RATE, START_ATTITUDE)[::every]
    wandered = np.array([_error_angles(path, rates, true) for path in range(noise_path_count)])
    rows.append(
        mean_square(
            Observed(
                "inertial_unit.ten_minutes",
                SYSTEM,
                "mean square angle per axis of the ten-minute example by Monte Carlo",
                float(np.mean(wandered[:, -1] ** 2)),
                "deg^2",
            ),
            axis**2,
            3 * noise_path_count,
            f"{noise_path_count} paths of 600,000 steps, seed {SEED}",
        )
    )
    return rows, {
        "paths": wandered[:8].tolist(),
        "rms": np.sqrt(np.mean(wandered**2, axis=(0, 2))).tolist(),
        "count": noise_path_count,
    }


def _error_angles(noise_path: int, body_rates: np.ndarray, true_attitudes: np.ndarray) -> np.ndarray:
    """Error angles (601, 3) in degrees of one noisy path, about the global axes, at the times of ``true_attitudes``
    (601, 4)."""
    attitudes = measured_attitude(
        body_rates,
        1 / SAMPLING_RATE,
        RATE_DEVIATION * np.ones(3),
        START_ATTITUDE,
        range(noise_path, noise_path + 1),
        SEED,
    )
    return np.degrees(
        rotation_vector(error_rotation(attitudes[:: len(body_rates) // (len(true_attitudes) - 1), 0], true_attitudes))
    )


def _gyro_bias_rows(noise_path_count: int) -> list[Row]:
    """Rows: mean square angle error by simulated gyro biases, constant and wandering, compared with its law."""
    rows, grade, tau = [], 10.0 * DEGREES_PER_HOUR, 100.0
    for name, turn_on, instability, span in (
        ("constant", grade, 0.0, 60),
        ("wandering", 0.0, grade, 60),
        ("forgetful", 0.0, grade, 600),
    ):
        angles = np.array(
            [bias_path(span, 1.0, turn_on, instability, tau, SEED, path).sum() for path in range(noise_path_count)]
        )
        law = float(angle_variance(np.array(float(span)), 0.0, turn_on, instability, tau))
        rows.append(
            mean_square(
                Observed(
                    f"inertial_unit.bias.{name}",
                    SYSTEM,
                    f"mean square angle of a bias of 10 deg/h, {name}, {span} s",
                    float(np.mean(angles**2)),
                    "rad^2",
                ),
                law,
                noise_path_count,
                f"b^2 t^2 or 2 b^2 tau^2 (t/tau - 1 + exp(-t/tau)), tau = 100 s; {noise_path_count:,} paths, seed "
                f"{SEED}",
            )
        )
    return rows


def _section_force_rows() -> list[Row]:
    """Rows: a slowly growing pitch error only rotates the section forces, shown with runs whose pitch is prescribed."""
    scene, size = road_scene(duration=10.0), 0.1
    with TemporaryDirectory() as name:
        run_folder = Path(name)
        measured, follow = measure_road(scene), follower_builder(scene, run_folder)
        write_measurement(measured, run_folder, scene.run.step)
        true = simulate(follow({}, {"prescribed_pitch": {"file": "pitch.csv"}}), "reference")
        section_part = measured.times / scene.run.duration
        wrong = measured["pitch"] + size * section_part**3 * (10 - 15 * section_part + 6 * section_part**2)
        write_time_series(run_folder / "wrong.csv", {"pitch": ("rad", wrong)}, scene.run.step)
        guided = simulate(follow({}, {"prescribed_pitch": {"file": "wrong.csv"}}), "reference")
    pairs = ((guided, guided), (true, guided), (true, true))
    corrected, turned, before = (section_forces(run["f3"], run["f4"], pitched["pitch"]) for run, pitched in pairs)
    return [
        _closed_form_row(
            f"section.{name}",
            f"difference of {name} of a run guided by a pitch that goes wrong by {size} rad in 10 s from "
            "the true force turned by that angle, over the change",
            root_mean_square(corrected[name] - turned[name]) / root_mean_square(turned[name] - before[name]),
            "",
            "f3 and f4 are those of the true run: a slow angle error leaves no inertia force",
            0.01,
        )
        for name in ("f3x", "f4x")
    ]


def _real_car_recording_rows(noise_path_count: int) -> CaseAnswer:
    """Rows and data from a recording of a minute in a real car: gyro compared with camera, and the noise law on the
    car's motion."""
    path = recording.find_recording()
    if path is None:
        reason = f"needs {recording.RECORDING_FILE} in the folder that TWINRIG_DATA names"
        return [
            not_run(f"inertial_unit.recording{end}", SYSTEM, f"a minute in a real car: {what}", reason)
            for end, what in (("", "gyro against camera"), (".law", "noise law on its motion"))
        ], {}
    recorded = recording.read_recording(path)
    off = np.degrees(recording.gyro_error(recorded))
    rates, period = recorded.rates[::5], 5 * recording.SAMPLE_PERIOD
    deviation = np.array([0.02, 0.05, 0.1]) / period**0.5
    wandered = attitude_errors(rates, period, deviation, noise_path_count)
    law = mean_error_rotation(deviation * period**0.5, rates, period, START_ATTITUDE)
    return [
        Observed(
            "inertial_unit.recording",
            SYSTEM,
            "a minute in a real car: difference of the gyro's attitude from the camera's after "
            f"{recording.SAMPLE_PERIOD * (len(off) - 1):.0f} s, gyro alone, its bias removed",
            float(off[-1]),
            "deg",
        ).beside("nothing published", f"as of a bias of {off[-1] / 60 * 3600:.0f} deg/h: a telephone's grade", "none"),
        _closed_form_row(
            "recording.law",
            "error of the mean rotation matrix of noise on the car's motion, worst entry over its standard error",
            standard_errors(wandered, law),
            "",
            f"the recorded rates, read each 50 ms, as the true motion; {noise_path_count:,} paths, seed {SEED}",
            STANDARD_ERRORS_OF_BAND,
        ),
    ], {"off": off[::20].tolist()}
