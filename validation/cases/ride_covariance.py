"""Stationary covariance of ride compared with closed forms and quadrature; outputs without a variance; the fast method
for many speeds."""

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from models.ride.closed_forms import half_car_acceleration, quarter_cars_of_half_car
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.frequency import variances_by_quadrature
from models.ride.sweep import variance_sweep
from models.road.excitation import RoadExcitation
from models.road.shape_filter import ShapeFilter
from models.road.two_track import CORRELATION_CASES, TwoTrackRoad, input_covariance, road_of_level
from models.systems.ride.of_scene import linear_vehicle
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.ride.no_variance import QUARTER_CAR, no_variance_rows, weighting_rows
from validation.ride.rides import (
    ROAD_INTENSITY,
    changed_vehicle,
    five_correlation_cases,
    largest_relative_error,
    one_track,
    paper_road,
    quarter_car_vehicle,
)

TITLE = "Ride: stationary covariance with exact delays"
SYSTEM: System = "ride"
SEED = 5
"""Seed of the asymmetric vehicle variants, and of their roads and speeds."""
SHIPPED_VEHICLES = ("r19_ride", "r19_free", "seven_freedoms", "three_axle_truck")
VARIED_VEHICLES = ("r19_ride", "r19_free", "three_axle_truck")
WEIGHTED_OUTPUTS = {"left occupant": "Wk", "right occupant": "Wk", "body centre": "Wk"}
SWEPT_SPEEDS = np.linspace(5.0, 50.0, 60)
SYMMETRY_ZERO_SHARE = 1e-20
"""Variances below this share of the largest variance count as zero by symmetry."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows: covariance compared with quadrature, closed forms and limits, and the fast method for many speeds. A quick
    run leaves out the engines' own linearisations, and compares two vehicles at one speed each."""
    routes = [_quadrature_comparison(*job) for job in _compared_vehicles_and_roads(quick)]
    rows = [
        *_closed_form_rows(),
        *_quadrature_rows(routes),
        *_delay_limit_rows(),
        *weighting_rows(SEED),
        *no_variance_rows(),
    ]
    engines = () if quick else ("exudyn", "mujoco")
    rows += [_engine_row(engine) for engine in engines]
    speeds = SWEPT_SPEEDS[::20] if quick else SWEPT_SPEEDS
    fast_rows, figure = _speed_sweep_rows(speeds, "reference" if quick else "exudyn")
    return rows + fast_rows, {"routes": routes, "figure": figure}


@cache
def _ride_vehicle(vehicle_name: str, variant_seed: int = 0) -> SpatialVehicle:
    """A shipped vehicle, or a random variant of it if the seed is not 0."""
    vehicle = load_vehicle(vehicle_name)
    return changed_vehicle(vehicle, variant_seed) if variant_seed else vehicle


def _compared_vehicles_and_roads(quick: bool) -> Iterator[tuple[str, int, TwoTrackRoad | None, float]]:
    """Vehicles and roads to compare: vehicle name, seed of its random variant or 0, random road or None for the
    paper's, speed (m/s)."""
    if quick:
        yield from (("r19_ride", 0, None, 20.0), ("three_axle_truck", SEED, _random_road(SEED), 13.0))
        return
    rng = np.random.default_rng(SEED)
    for name in SHIPPED_VEHICLES:
        yield from ((name, 0, None, speed) for speed in (2.0, 20.0, 50.0))
    for name in VARIED_VEHICLES:
        for seed in (SEED, SEED + 1):
            yield from ((name, seed, _random_road(int(rng.integers(1000))), rng.uniform(1.0, 60.0)) for _ in range(2))


def _random_road(seed: int) -> TwoTrackRoad:
    """Random two-track road whose corner wavenumbers vary over two decades, and whose intensities vary over two
    decades."""
    rng = np.random.default_rng(seed)
    mean, roll = (ShapeFilter(10 ** rng.uniform(-1.5, 0.5), 1e-5 * 10 ** rng.uniform(-1, 1)) for _ in range(2))
    return TwoTrackRoad(mean, roll)


def _quadrature_comparison(
    vehicle_name: str, variant_seed: int, road: TwoTrackRoad | None, speed: float
) -> dict[str, Any]:
    """Largest relative difference between standard deviations by covariance and by quadrature, over all outputs and
    five cases of correlation, with the error that each method states."""
    vehicle = linearise(_ride_vehicle(vehicle_name, variant_seed), speed)
    compared = [
        _covariance_difference(vehicle, vehicle, excitation, speed)
        for excitation in five_correlation_cases(vehicle.wheels, road).values()
    ]
    worst, by_covariance, by_quadrature, counts = zip(*compared, strict=True)
    return {
        "vehicle": vehicle_name + (f", twin {variant_seed}" if variant_seed else ""),
        "speed": speed,
        "values": sum(counts),
        "worst": max(worst),
        "errors": [max(by_covariance), max(by_quadrature)],
    }


def _covariance_difference(
    vehicle: LinearVehicle, analytic_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float
) -> tuple[float, float, float, int]:
    """Largest relative difference between a vehicle's standard deviations by covariance and those by quadrature on the
    analytic vehicle, the error that each method states, and the number of outputs that do not vanish by symmetry."""
    covariance, integrals = (
        stationary_covariance(vehicle_with_road(vehicle, road_excitation, speed)),
        variances_by_quadrature(analytic_vehicle, road_excitation, speed),
    )
    is_finite = covariance.variance > SYMMETRY_ZERO_SHARE * covariance.variance.max()
    worst = largest_relative_error(covariance.deviation[is_finite], np.sqrt(integrals.variance[is_finite]))
    return worst, covariance.error[is_finite].max(), integrals.error[is_finite].max(), int(is_finite.sum())


def _closed_form_rows() -> list[Row]:
    """Rows: variances of quarter car and half car compared with closed formulas."""
    worst = {"acceleration": 0.0, "travel": 0.0, "deflection": 0.0}
    for corner in (0.0, 1e-6, 1e-3, 0.3, 3.0):
        variance = stationary_covariance(
            vehicle_with_road(quarter_car_vehicle([(0.0, QUARTER_CAR)]), one_track((0.0,), corner), 20.0)
        ).variance
        q, w = 20.0 * ROAD_INTENSITY, 20.0 * corner
        exact = [
            QUARTER_CAR.body_acceleration_variance(q, w),
            QUARTER_CAR.suspension_travel_variance(q, w),
            QUARTER_CAR.tyre_deflection_variance(q),
        ]
        for key, value, expected in zip(worst, variance[:3], exact if corner == 0.0 else exact[:2], strict=False):
            worst[key] = max(worst[key], largest_relative_error(value, expected))
    rows = [
        Observed(
            f"ride_covariance.quarter.{key}",
            SYSTEM,
            f"relative error of the variance of the {key} of a quarter car, corners of the road from 0 to 3 rad/m",
            value,
            "",
        ).at_most(1e-10, "asked; the sums have no cancellation", "closed form")
        for key, value in worst.items()
    ]
    a, b, speeds = 1.2, 1.5, (3.0, 17.0, 50.0)
    front, rear, inertia = quarter_cars_of_half_car(QUARTER_CAR, a, b)
    vehicle = quarter_car_vehicle([(a, front), (-b, rear)], np.diag([front.m_s + rear.m_s, inertia]))
    half = [stationary_covariance(vehicle_with_road(vehicle, one_track((a, -b)), v)).variance[0] for v in speeds]
    formula = [half_car_acceleration(QUARTER_CAR, v * ROAD_INTENSITY, a, b, v) for v in speeds]
    what = "error of the variance at the centre of a half car that splits into quarter cars, delay exact, 3 to 50 m/s"
    worst_half = largest_relative_error(np.array(half), np.array(formula))
    return [
        *rows,
        Observed("ride_covariance.half", SYSTEM, what, worst_half, "").at_most(1e-10, "asked", "closed form"),
    ]


def _quadrature_rows(quadrature_comparisons: list[dict[str, Any]]) -> list[Row]:
    """Rows: largest difference of standard deviations from quadrature, for every vehicle."""
    by_vehicle = {name: [*group] for name, group in groupby(quadrature_comparisons, key=itemgetter("vehicle"))}
    return [
        Observed(
            f"ride_covariance.quadrature.{name.replace(', ', '-').replace(' ', '-')}",
            SYSTEM,
            f"relative difference of {sum(route['values'] for route in group)} standard deviations of "
            f"{name} in five cases from quadrature of spectra by dynamic stiffness",
            max(route["worst"] for route in group),
            "",
        ).at_most(1e-6, "asked; both routes claim better than 1e-9", "native")
        for name, group in by_vehicle.items()
    ]


def _delay_limit_rows() -> list[Row]:
    """Rows: limits of zero and of infinite delay between the axles, and covariances of the road under the wheels."""
    vehicle = linearise(_ride_vehicle("three_axle_truck", SEED))
    road = paper_road(vehicle.wheels)
    lagged = vehicle_with_road(vehicle, road, 20.0)
    at_once = stationary_covariance(replace(lagged, delays=(0.0,) * 3)).deviation
    joined = stationary_covariance(replace(lagged, B=(sum(lagged.B),), D=(sum(lagged.D),), delays=(0.0,))).deviation  # type: ignore[arg-type]
    late = stationary_covariance(replace(lagged, delays=(0.0, 1e6, 2e6))).deviation
    apart = stationary_covariance(replace(lagged, independent=True)).deviation
    return [
        Observed(
            "ride_covariance.delay.zero",
            SYSTEM,
            "difference of three axles at delay 0 from a single input, worst output",
            largest_relative_error(at_once, joined),
            "",
        ).at_most(0.0, "exact: they are the same equation", "closed form"),
        Observed(
            "ride_covariance.delay.long",
            SYSTEM,
            "difference of axles at delays of 1e6 s from independent axles, worst output",
            largest_relative_error(late, apart),
            "",
        ).at_most(1e-14, "exact but for rounding: the response has died out", "closed form"),
        _road_height_row(),
    ]


def _road_height_row() -> Row:
    """Row: covariance of the road heights under the wheels in the stationary solution, compared with its law."""
    vehicle = linearise(_ride_vehicle("three_axle_truck", SEED))
    road, worst = road_of_level(1.0), 0.0
    for met, case in zip(
        five_correlation_cases(vehicle.wheels, road).values(), CORRELATION_CASES.values(), strict=True
    ):
        H = np.hstack([np.zeros((len(vehicle.wheels), 2 * len(vehicle.mass))), *met.heights])
        heights = H @ stationary_covariance(vehicle_with_road(vehicle, met, 13.0)).P @ H.T
        expected = input_covariance(road, vehicle.wheels, *case)
        worst = max(worst, float(np.abs(heights - expected).max() / np.abs(expected).max()))
    return Observed(
        "ride_covariance.inputs",
        SYSTEM,
        "difference of the covariances of the heights under six wheels from their law, five cases",
        worst,
        "",
    ).at_most(1e-12, "exact but for rounding", "closed form")


def _engine_row(engine_name: str) -> Row:
    """Row: covariance of an engine's own linearised vehicle, compared with quadrature on the analytic vehicle."""
    from models.engines.spatial_protocol import build

    worst = 0.0
    for name, speed in (("r19_ride", 20.0), ("r19_free", 33.0), ("three_axle_truck", 9.0)):
        vehicle = _ride_vehicle(name, SEED)
        linear, analytic = build(engine_name, vehicle, speed=speed).linearise(), linearise(vehicle, speed)
        roads = five_correlation_cases(analytic.wheels).values()
        worst = max(worst, *(_covariance_difference(linear, analytic, road, speed)[0] for road in roads))
    return Observed(
        f"ride_covariance.engine.{engine_name}",
        SYSTEM,
        f"difference of the standard deviations from the linearisation of {engine_name}, three asymmetric "
        "twins, five cases, from quadrature of the analytic vehicles",
        worst,
        "",
    ).at_most(1e-6, "asked", "native")


def _speed_sweep_rows(speeds: np.ndarray, engine_name: str) -> tuple[list[Row], dict[str, Any]]:
    """Rows and data on the fast method: five cases of correlation over many speeds with weighting, by the fast and by
    the direct method, with processor times."""
    vehicle = _ride_vehicle("r19_ride")
    linear = linear_vehicle(vehicle, engine_name)
    roads = five_correlation_cases(linear(20.0).wheels)
    variance_sweep(
        linear, roads, speeds[:1], WEIGHTED_OUTPUTS
    )  # what is loaded and linearised once is no part of the sweep
    start = time.process_time()
    quick = variance_sweep(linear, roads, speeds, WEIGHTED_OUTPUTS)
    seconds = time.process_time() - start
    some = slice(None, None, max(1, len(speeds) // 6))
    slow = variance_sweep(linear, roads, speeds[some], WEIGHTED_OUTPUTS, by_modes=False)
    is_finite = slow.variance > SYMMETRY_ZERO_SHARE * slow.variance.max()
    rows = [
        Observed(
            "ride_covariance.fast.equal",
            SYSTEM,
            "difference of the variances by the fast route from the direct route, three weighted "
            "seats, worst of all outputs",
            largest_relative_error(quick.variance[:, some][is_finite], slow.variance[is_finite]),
            "",
        ).at_most(1e-10, "asked", "none"),
        behaviour_row(
            "ride_covariance.fast.taken",
            SYSTEM,
            "points of the sweep that had to go the direct way",
            str(sum(quick.direct_counts.values())),
            "0",
            "its eigenvectors are well apart",
        ),
        Observed(
            "ride_covariance.fast.time",
            SYSTEM,
            f"time of five cases at {len(speeds)} speeds with ISO weighting, from the linear vehicle "
            f"of {engine_name}, single core, measured once",
            seconds,
            "s",
        ).aim(2.0, "asked for 60 speeds; it counts this process's seconds and not other load"),
    ]
    return rows, {
        "speeds": speeds.tolist(),
        "cases": list(quick.cases),
        "seat": "left occupant Wk",
        **{
            name: [quick.of(case, name).tolist() for case in quick.cases] for name in (*BODY_POINTS, "left occupant Wk")
        },
    }


BODY_POINTS = ("body front", "body centre", "body rear")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the agreement between covariance and quadrature, with the error that each states."""
    rows = tuple(
        (
            route["vehicle"],
            f"{route['speed']:.3g}",
            str(route["values"]),
            f"{route['worst']:.1e}",
            *(f"{error:.1e}" for error in route["errors"]),
        )
        for route in case_data["routes"]
    )
    note = (
        "Largest relative difference of standard deviations over all outputs in the five cases of correlation; the "
        "last two columns are what each route says of its own variances, at its worst output."
    )
    headings = ("vehicle", "speed [m/s]", "values", "difference", "covariance says", "quadrature says")
    return [Table("Covariance against frequency quadrature", note, headings, rows)]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the standard deviation of the vertical acceleration at three points of the body over speed, one line for
    each case of correlation."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, subplots

    shown = case_data["figure"]
    figure, axes = subplots(1, 3, figsize=(COLUMN_WIDTH, 4.2), sharey=True)
    for axis, body_point in zip(axes, BODY_POINTS, strict=True):
        for i, case in enumerate(shown["cases"]):
            words = "left/right {}, front/rear {}".format(*CORRELATION_CASES[int(case)])
            axis.plot(shown["speeds"], shown[body_point][i], label=f"{case}: {words}")
        axis.set(title=body_point, xlabel="speed [m/s]")
    axes[0].set_ylabel("standard deviation of\nvertical acceleration [m/s²]")
    axes[0].set_ylim(bottom=0.0)
    legend_below(figure, axes[0], column_count=2)
    add_heading(figure, "Which roads belong together matters most at the centre of the body")
    return [(FIGURE_CAPTION, figure)]


FIGURE_CAPTION = (
    "R19-ride on the paper's road in its five cases of correlation. At the centre the order of the cases changes with "
    "the speed: there front and rear add up or cancel with the delay, which axles that are equal or independent both "
    "miss. Front and rear of the body hardly feel it: there only the correlation of left and right matters."
)
"""Caption of the figure."""
