"""Rides in time in Exudyn and MuJoCo, compared with each other and with linear or linearised vehicles."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.frequency import one_sided_densities, standard_errors
from models.ride.road_path import road_path
from models.ride.statistical_linearisation import largest_error_seen, statistically_linear
from models.road.excitation import RoadExcitation
from models.road.two_track import TRACK_DENSITY_LEVEL
from models.systems.ride.nonlinear import EngineRide, drive_over_road
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System
from validation.ride.rides import paper_road

SYSTEM: System = "ride"
ENGINES = ("exudyn", "mujoco")
SEED, GRAVITY, SPEED = 2211, 9.81, 20.0
NONLINEAR_VEHICLE = "quarter_car_nonlinear"
STEP, RUN_DURATION, SKIPPED_SECONDS = 2.5e-3, 24.0, 4.0
"""Longest step, duration, and beginning that is left out, of the engines' runs with 19 freedoms (s each)."""
NONLINEAR_STEP, NONLINEAR_DURATIONS = 2e-3, (1.0, 60.0)
SHOWN_OUTPUTS = ("body centre", "left occupant", "travel front left", "tyre force front left")
SAME_LAWS = "the same tableau, road and laws; the sums are taken in another order"


@cache
def vehicle_and_road(
    vehicle_name: str, level_factor: float = 1.0, gravity: float = GRAVITY
) -> tuple[SpatialVehicle, RoadExcitation]:
    """A shipped vehicle, and a road with ``level_factor`` times the paper's level; a vehicle without a track width has
    one track.
    """
    vehicle = replace(load_vehicle(vehicle_name), gravity=gravity)
    return vehicle, paper_road(wheels(vehicle), level_factor=level_factor * TRACK_DENSITY_LEVEL)


def nonlinear_engine_rows(is_quick: bool) -> list[Row]:
    """Rows on the nonlinear quarter car under gravity: difference of the engines' trajectories, mean travel, which the
    asymmetric damper shifts, and mean tyre force."""
    vehicle, excitation_ = vehicle_and_road(NONLINEAR_VEHICLE)
    road = road_path(excitation_, SPEED, NONLINEAR_STEP)
    runs = {
        engine: drive_over_road(
            engine,
            vehicle,
            road,
            NONLINEAR_DURATIONS[not is_quick],
            road_seed=SEED,
            skipped_time=SKIPPED_SECONDS * (not is_quick),
            steps_per_output=5,
        )
        for engine in ENGINES
    }
    rows = [
        _engine_difference_row(
            "bent", f"{NONLINEAR_VEHICLE} under gravity, {NONLINEAR_DURATIONS[not is_quick]:g} s", runs
        )
    ]
    if is_quick:
        return rows
    linear = statistically_linear(vehicle, excitation_, SPEED)
    travel, force = (linear.covariance.names.index(f"{kind} front left") for kind in ("travel", "tyre force"))
    size, left = linear.covariance.deviation, linear.left_out
    error, _ = standard_errors(linear.vehicle, excitation_, SPEED, NONLINEAR_DURATIONS[1] - SKIPPED_SECONDS)
    for engine, run in runs.items():
        shift = abs(run.outputs[:, travel].mean() - linear.mean[travel]) / size[travel]
        rows.append(
            Observed(
                f"ride_nonlinear.mean.{engine}",
                SYSTEM,
                f"difference of the mean travel in {engine} from the predicted "
                f"{1e3 * linear.mean[travel]:.2f} mm, over its deviation",
                float(shift),
                "",
            ).at_most(
                largest_error_seen(left[travel]) + 4.0 * float(error[travel] / size[travel]),
                "what its sentence promises, and 4 standard errors",
                "none",
            )
        )
        mean = abs(run.outputs[:, force].mean()) / error[force]
        rows.append(
            Observed(
                f"ride_nonlinear.load.{engine}", SYSTEM, "|z| of the mean of the dynamic tyre force", float(mean), ""
            ).at_most(4.0, "the tyre bears the weight, however the damper pulls", "none")
        )
    return rows


def _engine_difference_row(row_id: str, run_description: str, runs_by_engine: dict[str, EngineRide]) -> Row:
    first, other_run = (runs_by_engine[engine].run for engine in ENGINES)
    gap = max(np.abs(first.positions - other_run.positions).max(), np.abs(first.rates - other_run.rates).max())
    return Observed(
        f"ride_nonlinear.path.{row_id}",
        SYSTEM,
        f"largest difference of all states between Exudyn and MuJoCo, {run_description} on the same random road",
        float(gap),
        "m, rad, m/s, rad/s",
    ).at_most(1e-12, SAME_LAWS, "native")


def linear_engine_rows() -> tuple[list[Row], dict[str, Any]]:
    """Rows and figure data of a vehicle with 19 freedoms under gravity on one random road: difference of the engines'
    trajectories, and variances and means of both against the stationary covariance."""
    vehicle, excitation_ = vehicle_and_road("r19_ride")
    road = road_path(excitation_, SPEED, STEP)
    runs = {
        engine: drive_over_road(
            engine, vehicle, road, RUN_DURATION, road_seed=SEED, skipped_time=SKIPPED_SECONDS, steps_per_output=2
        )
        for engine in ENGINES
    }
    linear = linearise(vehicle)
    exact = stationary_covariance(vehicle_with_road(linear, excitation_, SPEED))
    errors = standard_errors(linear, excitation_, SPEED, RUN_DURATION - SKIPPED_SECONDS)
    rows = [_engine_difference_row("r19_ride", f"r19_ride under gravity, {RUN_DURATION:g} s", runs)]
    for engine, run in runs.items():
        mean = run.outputs.mean(axis=0) / errors[0]
        square = ((run.outputs**2).mean(axis=0) - exact.variance) / errors[1]
        share = float(np.median(errors[1] / exact.variance / 2.0))
        rows += [
            Observed(
                f"ride_nonlinear.variance.{engine}",
                SYSTEM,
                f"largest |z| of the variances of 16 outputs of r19_ride in {engine} against the "
                f"covariance, {RUN_DURATION - SKIPPED_SECONDS:g} s (deviations to {100 * share:.1f} %)",
                float(np.abs(square).max()),
                "",
            ).at_most(4.0, "standard errors by the densities: samples of a path know of each other", "none"),
            Observed(
                f"ride_nonlinear.zero.{engine}",
                SYSTEM,
                "largest |z| of the means of 16 outputs of r19_ride about the equilibrium",
                float(np.abs(mean).max()),
                "",
            ).at_most(4.0, "the road has no mean, and gravity is carried", "none"),
        ]
    return rows, _spectral_densities(runs, linear, excitation_)


def _spectral_densities(
    runs_by_engine: dict[str, EngineRide], linear_vehicle: LinearVehicle, road_excitation: RoadExcitation
) -> dict[str, Any]:
    """One-sided spectral densities (1/Hz) of SHOWN_OUTPUTS: of the linear vehicle in closed form, and by Welch's method
    of each engine's run."""
    frequency = np.geomspace(0.2, 40.0, 300)
    sides = {"own": (frequency, one_sided_densities(linear_vehicle, road_excitation, SPEED, frequency))}
    sides |= {engine: run.densities(frequency[-1]) for engine, run in runs_by_engine.items()}
    return {
        side: {
            "frequency": f.tolist(),
            **{name: density[:, linear_vehicle.names.index(name)].tolist() for name in SHOWN_OUTPUTS},
        }
        for side, (f, density) in sides.items()
    }


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Figure, with its caption, of output spectra: of both engines' runs, and of the linear vehicle in closed form."""
    if not case_data["spectra"]:
        return []
    from models.drawing.figures import COLOURS, COLUMN_WIDTH, DARK, LABELS, add_heading, legend_below, subplots

    shown = case_data["spectra"]
    units = ("(m/s²)²/Hz", "(m/s²)²/Hz", "m²/Hz", "N²/Hz")
    figure, axes = subplots(2, 2, figsize=(COLUMN_WIDTH, 6.0), sharex=True)
    for axis, name, unit in zip(axes.ravel(), SHOWN_OUTPUTS, units, strict=True):
        for engine, width, style in zip(ENGINES, (2.2, 1.0), ("-", "--"), strict=True):
            curves = shown[engine]
            axis.loglog(
                curves["frequency"],
                curves[name],
                style,
                color=COLOURS[engine],
                linewidth=width,
                label=f"{LABELS[engine]}, {RUN_DURATION - SKIPPED_SECONDS:g} s in time",
            )
        axis.loglog(shown["own"]["frequency"], shown["own"][name], color=DARK, linewidth=1.2, label="of the covariance")
        top = max(shown["own"][name])
        axis.set(title=name.capitalize(), ylabel=f"one-sided density [{unit}]", ylim=(1e-5 * top, 5 * top))
    for axis in axes[1]:
        axis.set_xlabel("frequency [Hz]")
    legend_below(figure, axes[0, 0])
    add_heading(figure, f"R19-ride at {SPEED:g} m/s: one path through both engines, over the spectra of its covariance")
    caption = (
        "Spectra of one path of 19 freedoms on the paper's road through both engines, gravity on, by Welch's "
        "method; black, what the covariance's own linear vehicle and road say."
    )
    return [(caption, figure)]
