"""Rounding errors of the standard deviations of linear rides at constant speeds.

A covariance has no time steps. Its error is that of rounding, estimated by a second solution at some speeds: the
Lyapunov equation, refined in extended precision, for a vehicle whose matrices differ in their last digits. Relative
errors refer to an output's standard deviation.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from models.core.discretisation import Estimate, root_mean_square, with_stated_errors
from models.core.errors import InputError
from models.core.result import Result
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.sweep import VarianceSweep
from models.ride.weighting import system_with_weightings
from models.road.excitation import RoadExcitation
from models.systems.ride.of_scene import LinearVehicleAtSpeed
from models.vehicles.linear_vehicle import LinearVehicle

CHECKED_SPEEDS = 3
"""Number of speeds of a sweep at which the solution is repeated with changed matrices."""
MATRIX_ACCURACY, CORNERED_LAW_ACCURACY = 4.0 * float(np.finfo(float).eps), 1e-11
"""Relative accuracy of the vehicle's matrices: from formulas or an engine's smooth force laws, and from an engine's
force curves with corners.
"""
STANDSTILL_SHARE = 1e-9
"""Standard deviation of an output, divided by the largest of the same unit, below which the output does not move, as
roll on equal tracks.
"""
SAFETY_FACTOR = 2.0
"""Factor on the observed change, as a single change of last digits may have little effect by chance."""


def with_changed_last_digits(vehicle: LinearVehicle, accuracy: float, draw: int = 0) -> LinearVehicle:
    """Returns the vehicle with every entry of its matrices changed by a relative error of up to ``accuracy``.

    draw : offset in the sequence of errors, which selects another set of changes.
    """

    def changed(matrix: np.ndarray) -> np.ndarray:
        return matrix * (1.0 + accuracy * np.cos(np.arange(1 + draw, 1 + draw + matrix.size)).reshape(matrix.shape))

    return replace(
        vehicle,
        mass=_symmetrised(changed(vehicle.mass)),
        damping=changed(vehicle.damping),
        stiffness=changed(vehicle.stiffness),
        road_stiffness=changed(vehicle.road_stiffness),
    )


def _symmetrised(matrix: np.ndarray) -> np.ndarray:
    return (matrix + matrix.T) / 2.0


def with_error_of_sweep(
    run: Result,
    sweep: VarianceSweep,
    linear: LinearVehicleAtSpeed,
    roads: Mapping[str, RoadExcitation],
    weightings: Mapping[str, str],
    matrix_accuracy: float,
) -> Result:
    """Returns the result with the rounding errors of its standard deviations, estimated at some speeds on all roads.

    matrix_accuracy : relative accuracy of the entries of the vehicle's matrices.
    """
    checked_speeds = np.unique(np.linspace(0, len(sweep.speeds) - 1, CHECKED_SPEEDS).round().astype(int))
    recomputed = np.array(
        [
            [
                _deviations_of_changed(linear, road, weightings, float(sweep.speeds[i]), matrix_accuracy)
                for i in checked_speeds
            ]
            for road in roads.values()
        ]
    )
    deviation = sweep.deviation[:, checked_speeds]
    known = np.isfinite(deviation) & np.isfinite(recomputed)
    sizes, estimates = [root_mean_square(deviation[..., i][known[..., i]]) for i in range(len(sweep.outputs))], {}
    largest = {
        unit: max(size for size, unit_of_output in zip(sizes, sweep.units, strict=True) if unit_of_output == unit)
        for unit in sweep.units
    }
    for i, (name, unit, size) in enumerate(zip(sweep.outputs, sweep.units, sizes, strict=True)):
        if size > 0.0:
            is_known = known[..., i]
            changes = recomputed[..., i][is_known] - deviation[..., i][is_known]
            error = max(SAFETY_FACTOR * root_mean_square(changes), MATRIX_ACCURACY / 4.0 * size)
            estimates[name] = Estimate(error, unit, error / max(size, STANDSTILL_SHARE * largest[unit]), 1.0, 0.0)
    points = f"{len(checked_speeds)} of {len(sweep.speeds)} speeds"
    return with_stated_errors(run, estimates, f"the Lyapunov equation of nudged matrices at {points}", "")


def _deviations_of_changed(
    linear: LinearVehicleAtSpeed,
    road: RoadExcitation,
    weightings: Mapping[str, str],
    speed: float,
    matrix_accuracy: float,
) -> np.ndarray:
    """Standard deviations (outputs,) at a speed (m/s) of the vehicle with changed last digits; NaN where the solution
    fails.
    """
    system = system_with_weightings(
        vehicle_with_road(with_changed_last_digits(linear(speed), matrix_accuracy), road, speed), weightings
    )
    try:
        return stationary_covariance(system).deviation
    except InputError:
        return np.full(len(system.names), np.nan)
