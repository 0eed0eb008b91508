"""Ride at varying speed: the covariance compared with its stationary limit, with an adjoint solution, and with Monte
Carlo; cost of both."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from models.ride.covariance import stationary_covariance
from models.ride.monte_carlo import variances_along_drive, variances_at_constant_speed
from models.ride.road_in_path import system_at_speed
from models.ride.speed_profile import SpeedProfile
from models.ride.varying_speed import LARGEST_RATE_TIMES_STEP, quasi_stationary, varying_speed
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.ride.rides import largest_relative_error, paper_road

TITLE = "Ride at varying speed, through standstill, and by Monte Carlo"
SYSTEM: System = "ride"
SEED = 21
MONTE_CARLO_COPY_COUNT = 4000
BODY_POINTS = ("body front", "body centre", "body rear")
SPEED_PROFILES_OF_DRIVES = {
    "accelerating": SpeedProfile((0.0, 25.0 / 3.0), (5.0, 30.0)),
    "braking": SpeedProfile((0.0, 3.0), (30.0, 6.0)),
}
"""Speed profiles with 3 and with -8 m/s^2."""
STOP_PROFILE = SpeedProfile((0.0, 1.0, 11.0, 12.0, 15.75, 18.0), (0.0, 0.0, 30.0, 30.0, 0.0, 0.0))
"""Speed profile: standing, to 30 m/s at 3 m/s^2, to standstill at -8 m/s^2, standing."""
SHORT_STOP_PROFILE = SpeedProfile((0.0, 0.2, 2.2, 2.4, 3.4, 4.0), (0.0, 0.0, 30.0, 30.0, 0.0, 0.0))
SETTLED_RATE_TIMES_TIME = 13.0
"""Slowest decay rate times the time after a change of speed; e^-26 of the change is left in a variance."""
CONSTANT_SPEED_PROFILE = SpeedProfile((0.0, 0.5), (20.0, 20.0))
STOP_AND_GO_PROFILE = SpeedProfile((0.0, 0.5, 1.0, 1.3, 2.0), (12.0, 12.0, 0.0, 0.0, 5.0))
"""Speed profile with a stop within the wheelbase: the last axle passes the same road after the stop as the first axle
before the stop."""
STEADY_SPEED = 20.0
"""Speed (m/s) of the Monte Carlo at constant speed."""
STEADY_SECONDS, STEADY_COPY_COUNT = 10.0, 1000
"""Length (s) and number of the Monte Carlo copies at constant speed; each copy tells as much as dozens do at a single
instant."""
TIMED_REPEAT_COUNT = 20
"""Number of repetitions in the timing of the covariance, which is too short to time once."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of limits and of the adjoint with a half car; a full run also has larger vehicles, Monte Carlo, and the
    cost."""
    rows = [*_stationary_limit_rows("half_car", SHORT_STOP_PROFILE), _adjoint_row(), _damped_tyre_row()]
    if quick:
        return rows, {}
    rows += [
        *_stationary_limit_rows("r19_ride", STOP_PROFILE),
        *_stationary_limit_rows("three_axle_truck", SHORT_STOP_PROFILE),
    ]
    data = {name: _drive_comparison(profile) for name, profile in SPEED_PROFILES_OF_DRIVES.items()}
    for name, drive in data.items():
        rows += _monte_carlo_rows(name, drive)
    return rows + _constant_speed_rows(), data


@cache
def vehicle_and_road(
    vehicle_name: str, tyre_damping: float = 0.0, second_corner: float | None = None
) -> tuple[LinearVehicle, RoadExcitation]:
    """A shipped vehicle and the paper's road, which reaches the rear wheels with a delay. A vehicle without a track
    width has one track.

    ``second_corner`` (rad/m): a second corner of the road.
    """
    spatial = load_vehicle(vehicle_name)
    vehicle = linearise(replace(spatial, tyres=tuple(replace(t, damping=tyre_damping) for t in spatial.tyres)))
    return vehicle, paper_road(vehicle.wheels, cutoff_wavenumber=second_corner)


def _stationary_limit_rows(vehicle_name: str, stop_profile: SpeedProfile) -> list[Row]:
    """Rows on limits: stationary covariance long after a change of speed and at constant speed, the road's own
    covariance, and effect of half the step."""
    vehicle, road = vehicle_and_road(vehicle_name)
    system = system_at_speed(vehicle, road, STEADY_SPEED)
    exact, settling = (
        stationary_covariance(system).deviation,
        -SETTLED_RATE_TIMES_TIME / np.linalg.eigvals(system.A).real.max(),
    )
    change = SpeedProfile((0.0, 0.5, 0.5 + settling), (STEADY_SPEED / 2.0, STEADY_SPEED, STEADY_SPEED))
    settled, even = (varying_speed(vehicle, road, profile).deviation for profile in (change, CONSTANT_SPEED_PROFILE))
    often = np.linspace(stop_profile.times[0], stop_profile.times[-1], 41)
    stopped, fine = (
        varying_speed(vehicle, road, stop_profile, instants=often, largest_rate_times_step=reach)
        for reach in (LARGEST_RATE_TIMES_STEP, LARGEST_RATE_TIMES_STEP / 2)
    )
    step = np.abs(stopped.at(often) ** 2 - fine.at(often) ** 2) / stopped.deviation.max(axis=0) ** 2
    return [
        Observed(
            f"ride_varying_speed.settled.{vehicle_name}",
            SYSTEM,
            f"{vehicle_name}, long after a change from 10 to 20 m/s: difference of all outputs from the Lyapunov "
            "equation",
            largest_relative_error(settled[-1], exact),
            "",
        ).at_most(1e-10, "the stationary limit, relative", "closed form"),
        Observed(
            f"ride_varying_speed.even.{vehicle_name}",
            SYSTEM,
            f"{vehicle_name}, at 20 m/s all the time: difference of all outputs from the Lyapunov equation, worst "
            "instant",
            largest_relative_error(even, exact),
            "",
        ).at_most(1e-10, "nothing may drift", "closed form"),
        Observed(
            f"ride_varying_speed.road.{vehicle_name}",
            SYSTEM,
            f"{vehicle_name}, through 0, 30 and 0 m/s with standing: error of the variance of the road under "
            "each wheel, worst instant",
            largest_relative_error((stopped.height / stopped.height[0]) ** 2, 1.0),
            "",
        ).at_most(1e-10, "the road does not know how fast it is driven over; relative", "closed form"),
        Observed(
            f"ride_varying_speed.step.{vehicle_name}",
            SYSTEM,
            f"{vehicle_name}, through 0, 30 and 0 m/s: change of all variances at half the step, over their largest "
            "value",
            float(step.max()),
            "",
        ).at_most(1e-9, "ten times what was seen", "none"),
    ]


def _adjoint_row() -> Row:
    """Row: standard deviation at the end of a drive with a stop, compared with the value by the adjoint equation."""
    vehicle, road = vehicle_and_road("half_car")
    varied = varying_speed(vehicle, road, STOP_AND_GO_PROFILE)
    exact = deviation_by_adjoint(vehicle, road, STOP_AND_GO_PROFILE, "body rear")
    return Observed(
        "ride_varying_speed.adjoint",
        SYSTEM,
        "half_car, a stop within its wheelbase and off again: relative difference of the body's rear "
        "acceleration from the adjoint",
        largest_relative_error(varied.of("body rear")[-1], exact),
        "",
    ).at_most(1e-8, "the adjoint's solver is good to 1e-10", "closed form")


def _damped_tyre_row() -> Row:
    """Row: with a damped tyre, white noise makes the variance of the tyre force infinite as long as the vehicle
    moves."""
    varied = varying_speed(*vehicle_and_road("half_car", 100.0), SHORT_STOP_PROFILE)
    force, moving = varied.of("tyre force front left"), varied.speed > 0.0
    outcome = "infinite" if np.isinf(force[moving]).all() else "finite"
    outcome += ", finite" if np.isfinite(force[~moving]).all() else ", infinite"
    return behaviour_row(
        "ride_varying_speed.damped",
        SYSTEM,
        "half_car with tyre damping: variance of the tyre force while driving, and at standstill",
        outcome,
        "infinite, finite",
        "white noise of the road's rate, which standstill turns off",
    )


def _drive_comparison(speed_profile: SpeedProfile) -> dict[str, Any]:
    """Data of a vehicle with 19 degrees of freedom on a drive: covariance, quasi-stationary solution, Monte Carlo
    copies, and computing times."""
    vehicle, road = vehicle_and_road("r19_ride")
    instants = speed_profile.times[-1] * np.array([0.25, 0.6, 0.95])
    copies, slow = _timed_call(
        variances_along_drive, vehicle, road, speed_profile, instants, copy_count=MONTE_CARLO_COPY_COUNT, seed=SEED
    )
    varied, fast = _timed_call(varying_speed, vehicle, road, speed_profile, instants=copies.time)
    often = np.linspace(speed_profile.times[0], speed_profile.times[-1], 101)
    columns = [varied.names.index(point) for point in BODY_POINTS]
    near = np.abs(varied.time[:, None] - often).argmin(axis=0)
    return {
        "time": varied.time[near].tolist(),
        "speed": varied.speed[near].tolist(),
        "deviation": varied.deviation[near][:, columns].tolist(),
        "quasi": quasi_stationary(vehicle, road, varied.speed[near])[:, columns].tolist(),
        "instants": copies.time.tolist(),
        "copies": np.sqrt(copies.variance[:, columns]).tolist(),
        "error": (copies.error / 2.0 / np.sqrt(copies.variance))[:, columns].tolist(),
        "z": copies.z(varied.at(copies.time))[:, columns].tolist(),
        "all": float(np.abs(copies.z(varied.at(copies.time))).max()),
        "seconds": [fast, slow],
    }


def _monte_carlo_rows(drive_name: str, drive_record: dict[str, Any]) -> list[Row]:
    """Rows: Monte Carlo copies at three instants, judged at three points of the body; all outputs and the error of the
    quasi-stationary solution are reported."""
    error = largest_relative_error(np.array(drive_record["quasi"]), np.array(drive_record["deviation"]))
    return [
        Observed(
            f"ride_varying_speed.copies.{drive_name}",
            SYSTEM,
            f"r19_ride {drive_name}: largest |z| of {MONTE_CARLO_COPY_COUNT} Monte Carlo copies at 3 instants in 3 "
            "points of the "
            "body",
            float(np.abs(drive_record["z"]).max()),
            "",
        ).at_most(4.0, "of 9 normal values one beyond 4 in 1800 times", "none"),
        Observed(
            f"ride_varying_speed.outputs.{drive_name}",
            SYSTEM,
            f"r19_ride {drive_name}: largest |z| of {MONTE_CARLO_COPY_COUNT} Monte Carlo copies at 3 instants for "
            "all 16 outputs",
            drive_record["all"],
            "",
        ).beside("below 4", "wheel loads and travels follow the same law", "none"),
        Observed(
            f"ride_varying_speed.quasi.{drive_name}",
            SYSTEM,
            f"r19_ride {drive_name}: largest error of the quasi-stationary standard deviation in 3 points",
            error,
            "",
        ).beside(
            {"accelerating": 0.017, "braking": 0.15}[drive_name],
            "beside what a prototype sampled; the largest over all instants",
            "none",
        ),
    ]


def _constant_speed_rows() -> list[Row]:
    """Rows: Monte Carlo copies at constant speed, and cost of an accurate standard deviation by Monte Carlo divided by
    that of the covariance."""
    vehicle, road = vehicle_and_road("r19_ride")
    exact = stationary_covariance(system_at_speed(vehicle, road, STEADY_SPEED))
    fast = (
        _timed_call(
            lambda: [
                stationary_covariance(system_at_speed(vehicle, road, STEADY_SPEED)) for _ in range(TIMED_REPEAT_COUNT)
            ]
        )[1]
        / TIMED_REPEAT_COUNT
    )
    copies, slow = _timed_call(
        variances_at_constant_speed,
        vehicle,
        road,
        STEADY_SPEED,
        STEADY_SECONDS,
        copy_count=STEADY_COPY_COUNT,
        seed=SEED,
    )
    columns = [copies.names.index(point) for point in BODY_POINTS]
    z = copies.z(exact.deviation[None])[0]
    error = float((copies.error[0] / 2.0 / copies.variance[0])[columns].max())
    return [
        Observed(
            "ride_varying_speed.constant",
            SYSTEM,
            f"r19_ride at 20 m/s: largest |z| of {STEADY_COPY_COUNT} Monte Carlo copies of {STEADY_SECONDS:g} s "
            "in 3 points of the body",
            float(np.abs(z[columns]).max()),
            "",
        ).at_most(4.0, "of 3 normal values one beyond 4 in 5000 times", "none"),
        Observed(
            "ride_varying_speed.constant.outputs",
            SYSTEM,
            f"r19_ride at 20 m/s: largest |z| of {STEADY_COPY_COUNT} Monte Carlo copies "
            f"of {STEADY_SECONDS:g} s for all 16 outputs",
            float(np.abs(z).max()),
            "",
        ).beside("below 4", "as above", "none"),
        Observed(
            "ride_varying_speed.constant.error",
            SYSTEM,
            "relative standard error of these Monte Carlo standard deviations, r19_ride at 20 m/s",
            error,
            "",
        ).beside("falls as 1 / sqrt(copies x length)", "what its time buys", "none"),
        Observed(
            "ride_varying_speed.cost",
            SYSTEM,
            "ratio of the processor time of Monte Carlo for a standard error of 1e-3 to that of the "
            "covariance, which is exact, each measured once",
            slow * (error / 1e-3) ** 2 / fast,
            "",
        ).beside("hundreds", "every further digit costs Monte Carlo a hundredfold, the covariance nothing", "none"),
    ]


def _timed_call(timed_function: Callable[..., Any], *arguments: Any, **keywords: Any) -> tuple[Any, float]:
    """Result of a function call, and its processor time (s)."""
    start = time.process_time()
    return timed_function(*arguments, **keywords), time.process_time() - start


def deviation_by_adjoint(
    vehicle: LinearVehicle, road_excitation: RoadExcitation, speed_profile: SpeedProfile, output_name: str
) -> float:
    """Standard deviation of one output at a drive's end by the adjoint equation, from the output's response to the road
    noise at each position.

    Backward in time l' = -A' l from l = C: noise that axle i meets at t moves the output by l(t) . B_i. The drive
    begins in motion and is taken as even long before.
    """
    at_1, two = (system_at_speed(vehicle, road_excitation, speed) for speed in (1.0, 2.0))
    steady, per_speed = (2.0 * at_1.A - two.A).T, (two.A - at_1.A).T
    row = at_1.names.index(output_name)
    seen = at_1.C[row] + (speed_profile.speeds[-1] - 1.0) * (two.C - at_1.C)[row]
    slowest = -np.linalg.eigvals(system_at_speed(vehicle, road_excitation, float(speed_profile.speeds[0])).A).real.max()
    pieces, cuts = {}, [speed_profile.times[0] - 10.0 / slowest, *speed_profile.times]
    for start, stop in reversed(list(pairwise(cuts))):
        back = solve_ivp(
            lambda t, x: -(steady @ x + speed_profile.speed(t) * (per_speed @ x)),
            (stop, start),
            seen,
            method="DOP853",
            rtol=1e-10,
            atol=1e-11 * np.abs(at_1.C[row]).max(),
            dense_output=True,
        )
        pieces[start, stop], seen = back.sol, back.y[:, -1]
    path_points, weights = _road_quadrature_points(speed_profile, cuts, road_excitation.lengths)
    response = np.zeros((len(path_points), at_1.B[0].shape[1]))
    for B, length in zip(at_1.B, road_excitation.lengths, strict=True):
        met = speed_profile.time(path_points + length)
        for (start, stop), adjoint in pieces.items():
            then = np.flatnonzero((met > start) & (met < stop))
            if len(then):
                response[then] += adjoint(met[then]).T @ B
    return float(np.sqrt(weights @ (response**2).sum(axis=1)))


def _road_quadrature_points(
    speed_profile: SpeedProfile, times: list[float], axle_distances: tuple[float, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature points (m) along the road and their weights, dense enough for the fast response of every axle."""
    fine = [np.linspace(start, stop, int(np.ceil((stop - start) / 0.02)) + 1) for start, stop in pairwise(times)]
    passed = speed_profile.path(np.unique(np.concatenate(fine)))
    cells = np.unique(np.concatenate([passed - length for length in axle_distances]))
    points, weights = np.polynomial.legendre.leggauss(6)
    half = np.diff(cells)[:, None] / 2.0
    return (cells[:-1, None] + half * (points + 1.0)).ravel(), (half * weights).ravel()


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the distances of the Monte Carlo variances from the covariance in standard errors, at each instant."""
    rows = [
        (name, f"{t:.2f} s", *(f"{value:.2f}" for value in z))
        for name, drive in case_data.items()
        for t, z in zip(drive["instants"], drive["z"], strict=True)
    ]
    if not rows:
        return []
    note = (
        f"How many standard errors the variance over {MONTE_CARLO_COPY_COUNT} copies lies above the covariance along "
        "the "
        "drive."
    )
    return [Table("Monte Carlo at varying speed", note, ("drive", "time", *BODY_POINTS), tuple(rows))]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot standard deviations over time, with the quasi-stationary solution for comparison."""
    if not case_data:
        return []
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, axes = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.9), sharey=True)
    for axis, (name, drive) in zip(axes, case_data.items(), strict=True):
        for column, point in enumerate(BODY_POINTS):
            pick = [row[column] for row in drive["deviation"]]
            (line,) = axis.plot(drive["time"], pick, label=point)
            colour = line.get_color()
            axis.plot(drive["time"], [row[column] for row in drive["quasi"]], "--", color=colour, linewidth=1.0)
            spread = [2.0 * row[column] for row in drive["error"]]
            axis.errorbar(
                drive["instants"],
                [row[column] for row in drive["copies"]],
                spread,
                fmt="o",
                color=colour,
                markersize=3,
                capsize=2,
            )
        axis.set(title=f"{name}, {drive['speed'][0]:.0f} to {drive['speed'][-1]:.0f} m/s", xlabel="time [s]")
    axes[0].set_ylabel("standard deviation of\nvertical acceleration [m/s²]")
    axes[0].plot([], [], "k--", linewidth=1.0, label="quasi-stationary")
    axes[0].plot([], [], "ko", markersize=3, label=f"{MONTE_CARLO_COPY_COUNT} copies, 2 standard errors")
    axes[0].legend(fontsize=7.5)
    add_heading(figure, "A drive of varying speed is no row of constant speeds")
    caption = (
        "Standard deviation of the body's vertical acceleration (19 freedoms, the paper's road) while the speed "
        "varies; dashed as if the momentary speed had always been driven."
    )
    return [(caption, figure)]
