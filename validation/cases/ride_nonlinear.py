"""Nonlinear springs on a random road: statistical linearisation compared with Monte Carlo, and Exudyn and MuJoCo in
time."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import quad

from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.gaussian_laws import mean_force_and_slope, mean_friction_slope
from models.ride.nonlinear_copies import copies_in_time
from models.ride.statistical_linearisation import largest_error_seen, statistically_linear
from models.vehicles.spatial_linear import linearise
from validation.common.rows import Observed, Row, System, Table
from validation.ride.in_engines import (
    NONLINEAR_VEHICLE,
    SEED,
    SPEED,
    draw,
    linear_engine_rows,
    nonlinear_engine_rows,
    vehicle_and_road,
)
from validation.ride.rides import largest_relative_error

__all__ = ["draw", "measure", "tables"]
TITLE = "Nonlinear ride: statistical linearisation, Monte Carlo beside it, both engines in time"
SYSTEM: System = "ride"
ROAD_LEVELS = (1.0, 4.0, 16.0)
"""Road levels as factors on the paper's: about class C, E, and G, where the stops are hit all the time."""
MONTE_CARLO_COPY_COUNTS, MONTE_CARLO_COPY_SECONDS = (60, 400), (1.5, 10.0)
"""Number of Monte Carlo copies in a quick and in a full run; and their length (s)."""
DAMPING_BESIDE_SINGLE_LAW = 1500.0
"""Damping (N s/m) of the spring whose friction or stops are tested alone."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of gains, fixed point, one road level and a short run in time; a full run has three levels and a vehicle of
    19 degrees of freedom in time."""
    rows = [*_equivalent_gain_rows(), *_fixed_point_rows()]
    table = []
    for level in ROAD_LEVELS[: 1 if quick else None]:
        level_rows, line = _road_level_rows(level, quick)
        rows += level_rows
        table.append(line)
    rows += nonlinear_engine_rows(quick)
    if quick:
        return rows, {"levels": table, "spectra": {}}
    rows += [_linear_springs_row(), *_single_law_rows()]
    level_rows, shown = linear_engine_rows()
    return rows + level_rows, {"levels": table, "spectra": shown}


def _equivalent_gain_rows() -> list[Row]:
    """Rows: equivalent gains by closed forms compared with their defining integrals, for damper, bump stops and dry
    friction."""
    spring = vehicle_and_road(NONLINEAR_VEHICLE)[0].springs[0]
    worst, dry = 0.0, 0.0
    for curve, mean, size in ((spring.rate_force, 0.0, 0.3), (spring.travel_force, 0.01, 0.02)):
        assert curve is not None
        for deviation in size * np.array([0.1, 1.0, 10.0]):
            cut = [(x - mean) / deviation for x in curve.arguments[1:-1]]
            force = normal_expectation(lambda x: curve(mean + deviation * x), cut)  # noqa: B023
            gain = normal_expectation(lambda x: curve(mean + deviation * x) * x, cut) / deviation  # noqa: B023
            gains = mean_force_and_slope(curve, mean, deviation)
            scale = max(abs(force), abs(gain) * deviation, 1e-3)
            worst = max(worst, abs(gains[0] - force) / scale, abs(gains[1] - gain) * deviation / scale)
    for ratio in (0.1, 1.0, 10.0, 100.0):
        gain = normal_expectation(lambda x: np.tanh(ratio * x) * x, (-1.0 / ratio, 0.0, 1.0 / ratio)) / ratio  # noqa: B023
        dry = max(dry, abs(mean_friction_slope(1.0, 1.0, ratio) / gain - 1.0))
    coulomb = mean_friction_slope(1.0, 1e-6, 1.0) / np.sqrt(2.0 / np.pi) - 1.0
    return [
        Observed(
            "ride_nonlinear.gains.curves",
            SYSTEM,
            "relative difference of the mean force and gain of damper and stops in closed form from "
            "the defining integrals, 6 motions",
            worst,
            "",
        ).at_most(1e-9, "error functions", "closed form"),
        Observed(
            "ride_nonlinear.gains.friction",
            SYSTEM,
            "relative difference of the gain of dry friction in closed form from the defining "
            "integrals, rates 0.1 to 100 times that of friction",
            dry,
            "",
        ).at_most(1e-9, "the trapezoidal rule converges geometrically", "closed form"),
        Observed(
            "ride_nonlinear.gains.coulomb",
            SYSTEM,
            "relative difference of the gain of dry friction from friction (2 / pi)^(1/2) / "
            "deviation, which Coulomb's law has",
            abs(float(coulomb)),
            "",
        ).at_most(1e-9, "rates 1e6 times that of friction", "closed form"),
    ]


def normal_expectation(force_law: Any, law_corners: Any) -> float:
    """Expected value of force_law(x) for a standard normal x, integrated piece by piece between the law's corners
    ``law_corners``."""
    edges = np.unique(np.clip([-12.0, *law_corners, 12.0], -12.0, 12.0))
    integrals = [
        quad(lambda x: force_law(x) * np.exp(-x * x / 2), a, b, epsabs=0.0, epsrel=1e-12, limit=200)[0]
        for a, b in pairwise(edges)
    ]
    return float(sum(integrals)) / np.sqrt(2 * np.pi)


def _fixed_point_rows() -> list[Row]:
    """Rows: statistical linearisation converges, to the same gains from another start; gravity has no effect on a
    vehicle that only moves vertically."""
    vehicle, road = vehicle_and_road(NONLINEAR_VEHICLE, 4.0)
    first, from_other_start = (statistically_linear(vehicle, road, SPEED, scale) for scale in (1.0, 10.0))
    unloaded = statistically_linear(replace(vehicle, gravity=0.0), road, SPEED)
    apart = [
        largest_relative_error(linearised.covariance.deviation, first.covariance.deviation)
        for linearised in (from_other_start, unloaded)
    ]
    return [
        Observed(
            "ride_nonlinear.fixed_point",
            SYSTEM,
            f"relative distance of the gains from the fixed point after {len(first.gain_changes)} "
            f"iterations, each change at most {first.contraction:.2g} of the last",
            first.fixed_point_distance,
            "",
        ).at_most(1e-11, "last change * c / (1 - c), Banach's bound", "none"),
        Observed(
            "ride_nonlinear.start",
            SYSTEM,
            "relative difference of the standard deviations if the first gains are those of a tenfold motion",
            apart[0],
            "",
        ).at_most(1e-10, "one fixed point, whatever the start", "none"),
        Observed(
            "ride_nonlinear.gravity",
            SYSTEM,
            "relative difference of the standard deviations with gravity from those without",
            apart[1],
            "",
        ).at_most(1e-10, "preloads hold the weights, and nothing turns", "none"),
    ]


def _road_level_rows(road_level: float, quick: bool) -> tuple[list[Row], list[str]]:
    """Rows at one road level: standard deviations and mean travel by statistical linearisation, compared with Monte
    Carlo. The tolerance of each is the accuracy that the result states."""
    vehicle, road = vehicle_and_road(NONLINEAR_VEHICLE, road_level)
    linear = statistically_linear(vehicle, road, SPEED)
    copies = copies_in_time(
        vehicle,
        road,
        SPEED,
        MONTE_CARLO_COPY_SECONDS[not quick],
        copy_count=MONTE_CARLO_COPY_COUNTS[not quick],
        seed=SEED,
    )
    rows, cells = [], [f"{road_level:g}"]
    for i, name in enumerate(copies.names):
        error = float(linear.covariance.deviation[i] / copies.deviation[i] - 1.0)
        spread = float(copies.error[i] / copies.variance[i] / 2.0)
        cells.append(
            f"{100 * error:+.1f} ± {100 * spread:.1f} % ({100 * linear.left_out[i]:.1f} %, {copies.kurtosis[i]:.1f})"
        )
        rows.append(
            Observed(
                f"ride_nonlinear.level.{road_level:g}.{name}",
                SYSTEM,
                f"relative difference of the deviation of {name} from {len(copies.moments[0])} copies "
                f"of {copies.duration:.0f} s, {road_level:g} times the paper's road",
                abs(error),
                "",
            ).at_most(
                largest_error_seen(linear.left_out[i]) + 4.0 * spread,
                f"left out {100 * linear.left_out[i]:.2g} % of the variance: what its sentence promises, "
                "and 4 standard errors",
                "none",
            )
        )
    travel = copies.names.index("travel front left")
    size = float(copies.deviation[travel])
    shift = float(linear.mean[travel] - copies.mean[travel]) / size
    rows.append(
        Observed(
            f"ride_nonlinear.mean.{road_level:g}",
            SYSTEM,
            f"difference of the mean travel, {1e3 * linear.mean[travel]:.2f} mm, from that of the "
            "copies, over its deviation",
            abs(shift),
            "",
        ).at_most(
            largest_error_seen(linear.left_out[travel]) + 4.0 * float(copies.mean_error[travel]) / size,
            "as above: the damper pulls the body down",
            "none",
        )
    )
    return rows, cells


def _linear_springs_row() -> Row:
    """Row: with linear springs, the variances of the Monte Carlo copies agree with the covariance."""
    vehicle, road = vehicle_and_road("quarter_car")
    exact = stationary_covariance(vehicle_with_road(linearise(vehicle), road, SPEED))
    copies = copies_in_time(
        vehicle, road, SPEED, MONTE_CARLO_COPY_SECONDS[1], copy_count=MONTE_CARLO_COPY_COUNTS[1], seed=SEED
    )
    return Observed(
        "ride_nonlinear.linear",
        SYSTEM,
        f"largest |z| of 3 variances of quarter_car in {MONTE_CARLO_COPY_COUNTS[1]} copies in time against the "
        "covariance",
        float(np.abs(copies.z(exact.deviation)).max()),
        "",
    ).at_most(4.0, "of 3 normal values one beyond 4 in 5000 times", "none")


def _single_law_rows() -> list[Row]:
    """Rows: each nonlinear law alone, at the road level at which statistical linearisation is least accurate."""
    vehicle, _ = vehicle_and_road(NONLINEAR_VEHICLE)
    spring = vehicle.springs[0]
    law_cases: dict[str, tuple[float, dict[str, Any]]] = {
        "damper": (4.0, {"travel_force": None, "friction": 0.0}),
        "friction of 100 N": (
            0.25,
            {"travel_force": None, "rate_force": None, "damping": DAMPING_BESIDE_SINGLE_LAW, "friction": 100.0},
        ),
        "stops": (64.0, {"rate_force": None, "damping": DAMPING_BESIDE_SINGLE_LAW, "friction": 0.0}),
    }
    rows = []
    for name, (level, laws) in law_cases.items():
        alone = replace(vehicle, springs=(replace(spring, **laws),))
        road = vehicle_and_road(NONLINEAR_VEHICLE, level)[1]
        linear = statistically_linear(alone, road, SPEED)
        copies = copies_in_time(
            alone, road, SPEED, MONTE_CARLO_COPY_SECONDS[1], copy_count=MONTE_CARLO_COPY_COUNTS[1] // 2, seed=SEED
        )
        error = np.abs(linear.covariance.deviation / copies.deviation - 1.0)
        curve_kept = [
            largest_error_seen(share) for share in linear.left_out
        ] + 4.0 * copies.error / copies.variance / 2.0
        worst = int((error / curve_kept).argmax())
        rows.append(
            Observed(
                f"ride_nonlinear.alone.{name.split()[0]}",
                SYSTEM,
                f"relative difference of the deviation of {copies.names[worst]}, which keeps its "
                f"promise worst, {name} alone on {level:g} times the paper's road",
                float(error[worst]),
                "",
            ).at_most(
                float(curve_kept[worst]),
                f"left out {100 * linear.left_out[worst]:.2g} %: the promise, and 4 standard errors",
                "none",
            )
        )
    return rows


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the errors of statistical linearisation."""
    names = [output.name for output in vehicle_and_road(NONLINEAR_VEHICLE)[0].outputs]
    note = (
        "Error of each standard deviation beside Monte Carlo; in brackets what was left out of the variance, and "
        "the kurtosis, 3 for a Gaussian output. The road's level by that of the paper."
    )
    return [
        Table("Statistical linearisation", note, ("level", *names), tuple(tuple(row) for row in case_data["levels"]))
    ]
