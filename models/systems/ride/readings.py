"""Numbers derived from the results of a ride: static loads, errors of simpler roads, vehicles and methods."""

from dataclasses import replace
from functools import partial

import numpy as np

from models.ride.sweep import VarianceSweep
from models.ride.varying_speed import VaryingSpeedDeviations
from models.systems.ride.of_scene import GRAVITY, half_track_of, linear_vehicle, placed_wheels, road_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle, TyreOutput
from models.vehicles.spatial_linear import static_preloads, wheels

LOWEST_WAVENUMBER_SHARE, HIGHEST_WAVENUMBER = 1e-2, 500.0
"""Wavenumbers between which a road is compared with an isotropic one: lowest as a share of the smallest corner
wavenumber, highest in rad/m.
"""


def static_loads(vehicle: SpatialVehicle) -> dict[str, float]:
    """Static load (N) of the tyre of every output of kind "tyre force", by output name."""
    loads = static_preloads(replace(vehicle, gravity=GRAVITY)).tyres
    forces = (
        tyre_output
        for tyre_output in vehicle.outputs
        if isinstance(tyre_output, TyreOutput) and tyre_output.kind == "tyre force"
    )
    return {output.name: loads[output.tyre] for output in forces}


def isotropic_change(scene: RideScene, vehicle: SpatialVehicle, speed: float) -> dict[str, float]:
    """Relative change of every output's standard deviation if the road is replaced by an isotropic road with the same
    track spectrum, both up to HIGHEST_WAVENUMBER.

    Empty where no isotropic road corresponds: for a vehicle without a width, a road of second order, or correlations of
    axles or tracks other than modelled.
    """
    from models.ride.frequency import variances_over_wavenumbers
    from models.road.isotropic import isotropic_road_like, spectral_matrix

    placed = placed_wheels(scene, wheels(vehicle))
    road, y = road_of(scene, placed), half_track_of(scene, placed)
    modelled = (scene.road.left_right, scene.road.front_rear) == ("modelled", "delayed")
    if not modelled or road.mean.cutoff is not None or len({wheel.y for wheel in placed}) < 2:
        return {}
    linear = linear_vehicle(vehicle)(speed)
    low = (
        LOWEST_WAVENUMBER_SHARE * min(f.corner for f in (road.mean, road.roll) if f.corner)
        if road.mean.corner
        else 0.01
    )
    of_road, of_isotropic = (
        variances_over_wavenumbers(linear, partial(spectral_matrix, road_model, placed), speed, low, HIGHEST_WAVENUMBER)
        for road_model in (road, isotropic_road_like(road, y))
    )
    pairs = zip(linear.names, of_road, of_isotropic, strict=True)
    return {name: float(np.sqrt(isotropic / plain) - 1.0) for name, plain, isotropic in pairs if plain > 0}


def largest_deviation_difference(sweep: VarianceSweep, reference_sweep: VarianceSweep) -> float:
    """Largest difference of standard deviations between two sweeps, where both are finite, divided by the output's
    largest standard deviation on any road.
    """
    finite = np.isfinite(reference_sweep.deviation) & np.isfinite(sweep.deviation)
    known, compared_deviations = (
        np.where(finite, compared_sweep.deviation, 0.0) for compared_sweep in (reference_sweep, sweep)
    )
    largest = known.max(axis=(0, 1))  # an output may be zero on one of the roads
    return float(np.max(np.abs(compared_deviations - known) / np.where(largest > 0, largest, 1.0)))


def largest_deviation_errors(
    sweep: VarianceSweep, case_index: int, true_deviations: np.ndarray, output_names: list[str]
) -> np.ndarray:
    """Largest relative error (outputs,) over the speeds of the standard deviations in a case of a sweep, compared with
    true standard deviations (speeds, outputs).

    NaN for an output that the sweep's vehicle does not have.
    """
    errors = np.full(len(output_names), np.nan)
    for i, name in enumerate(output_names):
        if name in sweep.outputs:
            deviation = sweep.deviation[case_index, :, sweep.outputs.index(name)]
            are_known = np.isfinite(deviation) & np.isfinite(true_deviations[:, i]) & (true_deviations[:, i] > 0)
            gaps = deviation[are_known] / true_deviations[are_known, i] - 1.0
            errors[i] = gaps[np.argmax(np.abs(gaps))] if len(gaps) else np.nan
    return errors


def quasi_stationary_errors(
    varying_speed_deviations: VaryingSpeedDeviations, quasi_stationary_deviations: np.ndarray
) -> np.ndarray:
    """Errors (instants, outputs) of quasi-stationary standard deviations along a drive, divided by each output's
    largest standard deviation in the drive; 0 where an output does not move.
    """
    are_known = np.isfinite(quasi_stationary_deviations) & np.isfinite(varying_speed_deviations.deviation)
    known = np.where(are_known, varying_speed_deviations.deviation, 0.0)
    largest = known.max(axis=0)
    return (np.where(are_known, quasi_stationary_deviations, 0.0) - known) / np.where(largest > 0, largest, 1.0)
