"""Hard cases of random input: noise streams, shape filters at any step, closed laws at their limits.

No engine takes part except where a model is asked: noise is drawn before a run and is the same for all.
"""

from dataclasses import replace
from decimal import Decimal, localcontext
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from models.core.noise import FORCES, GYRO, ROAD, SAMPLES_PER_BLOCK, normal_samples
from models.drift.growth import SERIES_ARGUMENT_LIMIT, pitch_variance
from models.engines.protocol import build
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.road_path import RoadPath, road_path
from models.road.excitation import RoadExcitation
from models.road.two_track import road_excitation, road_of_level, wheels_on_track
from models.sensors.inertial_unit import (
    angle_random_walk_of,
    error_rotation,
    mean_error_trace,
    mean_square_norm_by_euler,
    measured_attitude,
    quaternions_by_euler_steps,
)
from models.sensors.rotations import rotation_matrix
from models.systems.ride.of_scene import linear_vehicle
from models.vehicles.vehicle_file import load_vehicle
from validation.hard_cases import setups
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import driven_by_forces, largest_magnitude, run_settings, static_forces

NORMAL_LIMIT = 3.29
"""Number of standard errors that a normal value exceeds once in a thousand."""
CORNER, Q, SPEED = 0.3, 1e-4, 31.0
WALK, PATHS, SAMPLES, SAMPLING_RATE = 0.5, 600, 100, 50.0
"""Angle random walk (rad/sqrt(s)), number of paths, samples in each and their rate (Hz); the mean trace of the error
rotation falls from 3 to 1.8."""


def repeated_call_difference(engine_name: str, work_folder: Path) -> float:
    """Case: accelerations with force noise of 800 N, evaluated forwards, backwards and twice in time. Error: largest
    difference, which must be 0."""
    base = setups.vehicle("asymmetric_twin")
    forces = static_forces(base, 200, 1e-3, noise_deviation=800.0)
    model = build(engine_name, driven_by_forces(base, forces), run_settings(engine_name, 1e-3, 0.1))
    states = base.initial + 1e-3 * np.random.default_rng(3).standard_normal((40, 8))
    arguments_of_calls = [(2e-3 * i, state[:4], state[4:]) for i, state in enumerate(states)]
    once = [model.acceleration(*arguments).copy() for arguments in arguments_of_calls]
    reversed_answers = [model.acceleration(*arguments).copy() for arguments in reversed(arguments_of_calls)][::-1]
    return largest_magnitude(np.array(once) - reversed_answers)


def stream_correlation(engine_name: str, work_folder: Path) -> float:
    """Case: noise streams of several seeds, paths and sources. Error: largest correlation between two streams, divided
    by the size that chance allows among so many pairs."""
    paths = [
        normal_samples(seed, path, SAMPLES_PER_BLOCK, 1, noise_source=source)[:, 0]
        for seed in (0, 1)
        for path in (0, 1)
        for source in (FORCES, GYRO, ROAD)
    ]
    paths += [
        normal_samples(0, 0, SAMPLES_PER_BLOCK, 1, first_sample=SAMPLES_PER_BLOCK)[:, 0],
        *normal_samples(5, 0, SAMPLES_PER_BLOCK, 2).T,
    ]
    worst = max(
        abs(float(first @ second_path)) / SAMPLES_PER_BLOCK**0.5 for first, second_path in combinations(paths, 2)
    )
    return worst / 4.75  # one pair of 105 beyond 4.75 errors once in 5000


def stream_piece_error(engine_name: str, work_folder: Path) -> float:
    """Case: a noise stream read in pieces of odd lengths, the last first. Error: difference from the complete
    stream."""
    complete_stream, edges = (
        normal_samples(9, 4, 3 * SAMPLES_PER_BLOCK, 3),
        [
            0,
            1,
            SAMPLES_PER_BLOCK - 1,
            SAMPLES_PER_BLOCK,
            SAMPLES_PER_BLOCK + 7,
            2 * SAMPLES_PER_BLOCK + 1,
            3 * SAMPLES_PER_BLOCK,
        ],
    )
    parts = [normal_samples(9, 4, end - start, 3, first_sample=start) for start, end in reversed(list(pairwise(edges)))]
    return float(np.abs(np.concatenate(parts[::-1]) - complete_stream).max())


def _first_order_road() -> RoadExcitation:
    """Road height as white noise through a first-order filter, under a single wheel."""
    return RoadExcitation(np.array([[-CORNER]]), np.array([[Q**0.5]]), (np.ones((1, 1)),), (0.0,))


def road_variance_error(engine_name: str, work_folder: Path) -> float:
    """Case: roads with half steps of 1e-3 to 30 corner lengths. Error: difference of the variance from q / (2 corner),
    in standard errors."""
    worst = 0.0
    for step_share in (1e-3, 0.1, 0.9, 2.5, 30.0):
        keeps = np.exp(
            -2.0 * step_share
        )  # squared correlation of neighbours: n samples count as n (1 - keeps) / (1 + keeps)
        road = RoadPath(_first_order_road(), SPEED, step_share / (CORNER * SPEED)).wheel_heights_and_rates(
            20_000, seed=12
        )[:, 0]
        error = (2.0 / len(road) * (1.0 + keeps) / (1.0 - keeps)) ** 0.5
        worst = max(worst, abs(float(np.mean(road**2)) / (Q / (2.0 * CORNER)) - 1.0) / error)
    return worst


def any_step_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: variance by explicit Euler, which is 1 / (1 - part / 2) of the true one."""
    return f"explicit Euler at 0.9 corner lengths has {1.0 / (1.0 - 0.45):.2f} times the variance, at 2.5 none at all"


def axle_delay_error(engine_name: str, work_folder: Path) -> float:
    """Case: a wheelbase that is no multiple of the steps. Error: relative difference between the delay of the rear axle
    and the wheelbase; infinite if the axles' heights differ."""
    worst = 0.0
    for length, speed, longest in ((2.7, 31.0, 0.02), (3.1415926, 17.3, 0.0055), (1.234567, 0.37, 0.001)):
        heights = (np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]]))
        road = road_path(replace(_first_order_road(), heights=heights, lengths=(0.0, length)), speed, longest)
        steps = int(2.0 * length / (speed * road.step)) + 50
        front, rear = road.wheel_heights_and_rates(steps, seed=3)[:, :2].T
        lag = next((i for i in range(1, len(front)) if np.array_equal(rear[i : i + 20], front[:20])), 0)
        worst = max(worst, abs(lag * road.half_step * speed / length - 1.0) if lag else np.inf)
    return worst


def odd_delay_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: distance between the axles if the delay is rounded to steps of 20 ms."""
    length, speed, step = 2.7, SPEED, 0.02
    lag = round(length / (speed * step)) * speed * step
    return f"rounded to steps of 20 ms the axles stand {lag:.2f} m apart in place of {length} m"


def attitude_error(engine_name: str, work_folder: Path) -> float:
    """Case: a noisy gyro on a rotating body. Error: difference of the mean trace of its attitude error from 3 exp(-s^2
    t), in standard errors."""
    rates = np.tile([0.0, 0.0, 2.0], (SAMPLES, 1))
    start, deviation = np.array([1.0, 0.0, 0.0, 0.0]), np.full(3, WALK * SAMPLING_RATE**0.5)
    attitudes = measured_attitude(rates, 1.0 / SAMPLING_RATE, deviation, start, range(PATHS), seed=5)[-1]
    true = measured_attitude(rates, 1.0 / SAMPLING_RATE, np.zeros(3), start, range(1))[-1]
    traces = np.trace(rotation_matrix(error_rotation(attitudes, true)), axis1=-2, axis2=-1)
    wanted = mean_error_trace(angle_random_walk_of(deviation[0], SAMPLING_RATE), SAMPLES / SAMPLING_RATE)
    return abs(float(traces.mean()) - wanted) / (float(traces.std()) / PATHS**0.5)


def attitude_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: norm of a quaternion that is integrated by explicit Euler."""
    turns = WALK / SAMPLING_RATE**0.5 * np.stack([normal_samples(5, path, SAMPLES, 3) for path in range(PATHS)], axis=1)
    q = quaternions_by_euler_steps(turns, np.array([1.0, 0.0, 0.0, 0.0]))
    return (
        f"explicit Euler's quaternion has a mean square of {float((q**2).sum(axis=-1).mean()):.3f} "
        f"({mean_square_norm_by_euler(WALK, 3, 1.0 / SAMPLING_RATE, SAMPLES):.3f} by its law): its matrix is no "
        "rotation"
    )


def growth_law_error(engine_name: str, work_folder: Path) -> float:
    """Case: the pitch variance for 2 lambda t of 1e-12 to 600, below and above the switch to its series. Error:
    relative difference from values with 60 digits."""
    worst = 0.0
    for x in (
        1e-12,
        1e-6,
        1e-3,
        0.0999,
        SERIES_ARGUMENT_LIMIT,
        np.nextafter(SERIES_ARGUMENT_LIMIT, 1.0),
        0.1001,
        0.5,
        1.0,
        10.0,
        600.0,
    ):
        variance = float(pitch_variance(2.0, x / 4.0, 0.7))
        worst = max(worst, abs(variance / _exact_growth_law(Decimal(x)) - 1.0))
    return max(worst, abs(float(pitch_variance(2.0, 0.0, 0.7)) / (0.7 * 8.0 / 3.0) - 1.0))


def _exact_growth_law(x: Decimal) -> float:
    """Pitch variance by the closed law at x = 2 lambda t, with 60 digits."""
    with localcontext() as context:
        context.prec = 60
        sinh = (x.exp() - (-x).exp()) / 2
        return float(Decimal("0.7") * 8 / 3 * 6 * (sinh - x) / x**3)


def no_growth_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the variance without growth by the formula as printed."""
    x = 1e-8
    return f"the closed law as printed is {6.0 * (np.sinh(x) - x) / x**3:.2f} times the truth at 2 lambda t = 1e-8"


def negative_eigenvalue_share(engine_name: str, work_folder: Path) -> float:
    """Case: the half car's covariance at 2 to 60 m/s. Error: magnitude of its most negative eigenvalue divided by the
    largest, with states scaled by their deviations."""
    vehicle = linear_vehicle(load_vehicle("half_car"), engine_name)
    worst = 0.0
    for speed in (2.0, 7.0, 20.0, 60.0):
        half_car = vehicle(speed)
        P = stationary_covariance(
            vehicle_with_road(
                half_car, road_excitation(road_of_level(1.0), wheels_on_track(half_car.wheels, 1.0)), speed
            )
        ).P
        scale = np.sqrt(np.diag(P))
        values = np.linalg.eigvalsh(P / np.outer(scale, scale))
        worst = max(worst, -values[0] / values[-1])
    return worst


CASES = (
    HardCase(
        "accelerations asked again",
        "noise drawn inside a callback changes from one stage to the next",
        "the same time and state, the same bits",
        "m/s^2",
        0.0,
        "a function has no memory",
        repeated_call_difference,
    ),
    HardCase(
        "streams of noise",
        "one seed for forces, gyro and road, two for two runs, one path for front and rear",
        "no correlation of any two of 15",
        "of 4.75 standard errors",
        1.0,
        "once in 5000 by chance, fixed seeds",
        stream_correlation,
        answer_independence="none",
        is_without_engine=True,
    ),
    HardCase(
        "stream in pieces",
        "blocks may be asked for in any order by any worker",
        "the whole, bit by bit",
        "",
        0.0,
        "the same numbers",
        stream_piece_error,
        answer_independence="none",
        is_without_engine=True,
    ),
    HardCase(
        "shape filter at any step",
        "explicit Euler has 1 / (1 - a h / 2) of the variance",
        "q / (2 corner) at half steps of 0.001 to 30 corner lengths",
        "standard errors",
        NORMAL_LIMIT + 0.6,
        "once in a thousand by chance in five lengths, fixed seed",
        road_variance_error,
        naive_result=any_step_naive_result,
        is_without_engine=True,
    ),
    HardCase(
        "delay between steps",
        "the wheelbase is no whole number of steps",
        "the rear axle meets the front one's heights, its wheelbase later",
        "of the wheelbase",
        1e-3,
        "the tolerance of the cells of the path",
        axle_delay_error,
        naive_result=odd_delay_naive_result,
        is_without_engine=True,
    ),
    HardCase(
        "white noise on a gyro",
        "Ito and Stratonovich differ, and a quaternion grows",
        "E[tr E] = 3 exp(-s^2 t) on a turning body",
        "standard errors",
        NORMAL_LIMIT,
        "once in a thousand, fixed seed",
        attitude_error,
        naive_result=attitude_naive_result,
        is_without_engine=True,
    ),
    HardCase(
        "growth law at no growth",
        "sinh x - x loses all digits where the exponent 3/2 begins",
        "60 digits, for 2 lambda t from 0 to 600",
        "relative",
        1e-12,
        "rounding of sinh x - x at x = 0.1 is 6e-14",
        growth_law_error,
        naive_result=no_growth_naive_result,
        is_without_engine=True,
    ),
    HardCase(
        "delayed axle in Lyapunov's equation",
        "its right side is indefinite: roots of it do not exist",
        "the covariance is positive semidefinite at 2 to 60 m/s",
        "of the largest eigenvalue",
        1e-12,
        "rounding; scaled by the states' own deviations",
        negative_eigenvalue_share,
        answer_independence="none",
    ),
)
