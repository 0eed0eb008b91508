"""Cost of accuracy in ride: errors of standard deviations of the vehicle R19-ride by every method, over work and time.

All routes take the same linear vehicle on the paper's road at one speed. The reference is the quadrature that halves
its panels until nothing changes, an integral over frequencies with the delay in closed form; it knows its own error.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any
from unittest import mock

import numpy as np
from matplotlib.figure import Figure

from models.machine.timing import interleave
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.frequency import spectral_densities, variances_by_quadrature
from models.ride.monte_carlo import VarianceEstimate, variances_at_constant_speed
from models.ride.sweep import variance_sweep
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, Table
from validation.ride.rides import five_correlation_cases

SYSTEM: System = "cost"
SPEED, LOWEST_FREQUENCY = 20.0, 1e-2
"""Speed (m/s), and lowest frequency (Hz) of the logarithmic grids."""
SEED = 5
SWEPT_SPEEDS = 60
"""Number of speeds of the sweep, each with five cases of road correlation; its cost is stated per point."""
FREQUENCY_GRIDS = {True: ((200, 100.0), (2000, 1000.0)), False: ((200, 100.0), (2000, 1000.0), (20_000, 10_000.0))}
"""Number and highest frequency (Hz) of logarithmic frequency grids, by ``quick``."""
UNIFORM_GRID = (500, 50.0)
COPY_COUNTS = {True: ((16, 4.0),), False: ((2, 100.0), (20, 100.0), (100, 100.0))}
"""Number of Monte Carlo copies and duration (s) of each, by ``quick``."""
OUTPUT_KINDS = {"accelerations": "acceleration", "tyre forces": "tyre force"}


@dataclass(frozen=True)
class RoutePoint:
    """Cost and error of one method to compute standard deviations. count, unit : amount of work (solves,
    decompositions, frequencies or copies); errors : largest relative error for each of OUTPUT_KINDS; z : largest
    deviation of a random method's variances in standard errors; seconds : median time, or that of a single run if it is
    long."""

    name: str
    unit: str
    count: int
    errors: dict[str, float]
    seconds: float
    z: float = 0.0


@dataclass(frozen=True)
class PricedRide:
    """Problem of the cost of accuracy in ride: the vehicle, the road in the paper's five cases of correlation by their
    numbers, and the true standard deviations (p,) in case 3 with their relative uncertainty."""

    vehicle: LinearVehicle
    roads: dict[str, RoadExcitation]
    true_deviations: np.ndarray
    uncertainty: float

    @property
    def road(self) -> RoadExcitation:
        """The road in the paper's third case of correlation: two tracks, with a delay at the rear axle."""
        return self.roads["3"]

    def errors(self, computed_deviations: np.ndarray) -> dict[str, float]:
        """Largest relative error of computed standard deviations (p,), by kind of output."""
        relative_errors = np.abs(computed_deviations / self.true_deviations - 1.0)
        return {
            name: float(max(e for e, o in zip(relative_errors, self.vehicle.outputs, strict=True) if o.kind == kind))
            for name, kind in OUTPUT_KINDS.items()
        }


def problem() -> PricedRide:
    """Problem of the cost of accuracy in ride, for the vehicle R19-ride at 20 m/s."""
    vehicle = linearise(load_vehicle("r19_ride"))
    roads = five_correlation_cases(vehicle.wheels)
    true = variances_by_quadrature(vehicle, roads["3"], SPEED)
    return PricedRide(vehicle, roads, np.sqrt(true.variance), float(true.error.max()))


def lyapunov_deviations(priced_ride: PricedRide) -> np.ndarray:
    """Standard deviations (p,) of the outputs by a Lyapunov equation."""
    return stationary_covariance(vehicle_with_road(priced_ride.vehicle, priced_ride.road, SPEED)).deviation


def swept_deviations(priced_ride: PricedRide, speed_count: int) -> np.ndarray:
    """Standard deviations (p,) of the outputs at SPEED, from a sweep by eigenvectors over five cases of road
    correlation and ``speed_count`` speeds."""
    speeds = [*np.linspace(5.0, 50.0, speed_count - 1), SPEED]
    return variance_sweep(lambda speed: priced_ride.vehicle, priced_ride.roads, speeds).deviation[
        list(priced_ride.roads).index("3"), -1
    ]


def deviations_on_grid(
    priced_ride: PricedRide, frequency_count: int, highest_frequency: float, is_evenly_spaced: bool = False
) -> np.ndarray:
    """Standard deviations (p,) of the outputs by the trapezoidal rule on a frequency grid up to ``highest_frequency``
    (Hz), evenly spaced in frequency if ``is_evenly_spaced``, else in its logarithm."""
    frequency = (
        np.linspace(highest_frequency / frequency_count, highest_frequency, frequency_count)
        if is_evenly_spaced
        else np.geomspace(LOWEST_FREQUENCY, highest_frequency, frequency_count)
    )
    omega = 2 * np.pi * frequency
    return np.sqrt(
        2 * np.trapezoid(spectral_densities(priced_ride.vehicle, priced_ride.road, SPEED, omega), omega, axis=0)
    )


def measure_routes(is_quick: bool, round_count: int, minimum_seconds: float) -> tuple[list[Row], dict[str, Any]]:
    """Rows and saved data of all methods; counts and errors are judged, times are not."""
    ride = problem()
    swept = 3 if is_quick else SWEPT_SPEEDS
    points = [_lyapunov_point(ride), _route_point_of_sweep(ride, swept)]
    jobs: list[Callable[[], Any]] = [partial(lyapunov_deviations, ride), partial(swept_deviations, ride, swept)]
    for count, highest_frequency, even in (
        *((*net, False) for net in FREQUENCY_GRIDS[is_quick]),
        (*UNIFORM_GRID, True),
    ):
        name = f"{'uniform' if even else 'logarithmic'} grid to {highest_frequency:g} Hz"
        start_time = time.perf_counter()
        errors = ride.errors(deviations_on_grid(ride, count, highest_frequency, even))
        points.append(RoutePoint(name, "frequencies", count, errors, time.perf_counter() - start_time))
        jobs.append(partial(deviations_on_grid, ride, count, highest_frequency, even))
    for copies, lasting in COPY_COUNTS[is_quick]:
        jobs.append(
            partial(variances_at_constant_speed, ride.vehicle, ride.road, SPEED, lasting, copy_count=copies, seed=SEED)
        )
        start_time = time.perf_counter()
        estimate: VarianceEstimate = jobs[-1]()
        errors, z = (
            ride.errors(np.sqrt(estimate.variance[0])),
            float(np.abs(estimate.z(ride.true_deviations[None])).max()),
        )
        name, seconds = f"Monte Carlo, {lasting:g} s each", time.perf_counter() - start_time
        points.append(RoutePoint(name, "copies", copies, errors, seconds, z))
    quick_points = [i for i, p in enumerate(points) if p.unit != "copies" and p.count < 10_000]
    for i, seconds_of_rounds in zip(
        quick_points, interleave([jobs[i] for i in quick_points], round_count, minimum_seconds), strict=True
    ):
        points[i] = replace(points[i], seconds=float(np.median(seconds_of_rounds)))
    points[1] = replace(points[1], seconds=points[1].seconds / (5 * swept))  # of the sweep a point
    return judging_rows(ride, points), {"points": [asdict(p) for p in points], "uncertainty": ride.uncertainty}


def _lyapunov_point(priced_ride: PricedRide) -> RoutePoint:
    import control

    with mock.patch.object(control, "lyap", wraps=control.lyap) as solve:
        deviations = lyapunov_deviations(priced_ride)
    return RoutePoint("Lyapunov, delay exact", "solves", solve.call_count, priced_ride.errors(deviations), 0.0)


def _route_point_of_sweep(priced_ride: PricedRide, speed_count: int) -> RoutePoint:
    from models.ride import sweep as module

    with mock.patch.object(module, "modes_of_matrix", wraps=module.modes_of_matrix) as watched_modes:
        deviations = swept_deviations(priced_ride, speed_count)
    return RoutePoint(
        f"sweep, one of {5 * speed_count} points",
        "decompositions",
        watched_modes.call_count,
        priced_ride.errors(deviations),
        0.0,
    )


def judging_rows(priced_ride: PricedRide, route_points: list[RoutePoint]) -> list[Row]:
    """Rows that judge the errors and the counts of work of all methods."""
    exact = route_points[:2]
    grids = [p for p in route_points if p.name.startswith("logarithmic")]
    rows = [
        Observed(
            f"price.ride.error.{p.name.split(',')[0]}",
            SYSTEM,
            "largest relative error of a standard deviation of R19-ride's accelerations and tyre "
            f"forces at {SPEED:g} m/s, {p.name}",
            max(p.errors.values()),
            "relative",
        ).at_most(1e-9, f"quadrature knows its variances to {priced_ride.uncertainty:.0e}", "closed form")
        for p in exact
    ]
    rows += [
        Observed(
            "price.ride.counts.solves",
            SYSTEM,
            "number of Lyapunov equations solved for a road at a speed",
            exact[0].count,
            "solves",
        ).within(2, 0, "the first solution and one correction", "none"),
        Observed(
            "price.ride.counts.decompositions",
            SYSTEM,
            "number of eigenvector decompositions for all points of the sweep",
            exact[1].count,
            "decompositions",
        ).within(
            4,
            0,
            "the vehicle; the filters of two tracks as modelled or alike, and of two apart; "
            "no weighting, which is empty",
            "none",
        ),
    ]
    falls = [a.errors[kind] / b.errors[kind] for kind in OUTPUT_KINDS for a, b in pairwise(grids)]
    rows.append(
        Observed(
            "price.ride.grids",
            SYSTEM,
            "frequency grids whose tenfold refinement does not have a smaller error",
            sum(ratio <= 1.0 for ratio in falls),
            "",
        ).within(0, 0, "they converge", "none")
    )
    rows += [
        Observed(
            f"price.ride.copies.{p.count}",
            SYSTEM,
            f"largest error of a standard deviation with {p.count} copies, {p.name}, single draw, |z| up to {p.z:.1f}",
            max(p.errors.values()),
            "relative",
        ).beside(
            "one over the root of copies times seconds",
            "statistics of few copies: the judged ones are in the case of varying speed",
            "none",
        )
        for p in route_points
        if p.unit == "copies"
    ]
    return rows


def table(case_data: dict[str, Any]) -> Table:
    """Table of all methods with errors, counts of work and times."""
    lines = tuple(
        (
            p["name"],
            f"{p['count']:,} {p['unit']}",
            *(f"{p['errors'][kind]:.1e}" for kind in OUTPUT_KINDS),
            f"{1e3 * p['seconds']:.3g}",
        )
        for p in case_data["points"]
    )
    note = (
        "Largest relative error of a standard deviation over all outputs of the kind. Part of a grid's error in "
        "the tyre forces is what lies beyond its last frequency, which some users do not want. Monte Carlo is one "
        "draw. Milliseconds are those of one run on this machine, and wander."
    )
    return Table(
        f"Standard deviations of R19-ride at {SPEED:g} m/s", note, ("route", "count", *OUTPUT_KINDS, "ms"), lines
    )


def draw(case_data: dict[str, Any]) -> tuple[str, Figure]:
    """Plot error over computing time (ms), with a panel per kind of output."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, subplots

    figure, axes = subplots(1, len(OUTPUT_KINDS), figsize=(COLUMN_WIDTH, 4.4), sharey=True)
    markers = {"solves": "*", "decompositions": "D", "frequencies": "o", "copies": "s"}
    for ax, kind in zip(axes, OUTPUT_KINDS, strict=True):
        for p in case_data["points"]:
            x, y = 1e3 * p["seconds"], max(p["errors"][kind], np.finfo(float).eps)
            ax.plot(x, y, markers[p["unit"]], markersize=8, label=f"{p['name']}, {p['count']:,} {p['unit']}")
        ax.axhspan(1e-30, case_data["uncertainty"], color="#bbbbbb", alpha=0.4, linewidth=0)
        ax.set(xscale="log", yscale="log", xlabel="time [ms] (median)", title=kind)
        ax.set_ylim(1e-16, 1.0)
    axes[0].set_ylabel("largest relative error\nof a standard deviation [-]")
    legend_below(figure, axes[0], column_count=2)
    add_heading(figure, f"What accuracy costs in ride: R19-ride at {SPEED:g} m/s, rear axle delayed")
    caption = "Standard deviations by every route against quadrature with the delay exact (grey: its own error)."
    return caption, figure
