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

CHECKED_SPEED_COUNT = 3
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


def with_changed_last_digits(
    linear_vehicle: LinearVehicle, relative_accuracy: float, draw_number: int = 0
) -> LinearVehicle:
    """Returns the vehicle with every entry of its matrices changed by a relative error of up to ``relative_accuracy``.

    draw_number : offset in the sequence of errors, which selects another set of changes.
    """

    def changed(matrix: np.ndarray) -> np.ndarray:
        return matrix * (
            1.0
            + relative_accuracy
            * np.cos(np.arange(1 + draw_number, 1 + draw_number + matrix.size)).reshape(matrix.shape)
        )

    return replace(
        linear_vehicle,
        mass=_symmetrised(changed(linear_vehicle.mass)),
        damping=changed(linear_vehicle.damping),
        stiffness=changed(linear_vehicle.stiffness),
        road_stiffness=changed(linear_vehicle.road_stiffness),
    )


def _symmetrised(matrix: np.ndarray) -> np.ndarray:
    """Symmetric part of a matrix."""
    return (matrix + matrix.T) / 2.0


def with_error_of_sweep(
    run_result: Result,
    sweep_by_speed: VarianceSweep,
    vehicle_at_speed: LinearVehicleAtSpeed,
    road_by_case: Mapping[str, RoadExcitation],
    weighting_by_output: Mapping[str, str],
    matrix_accuracy: float,
) -> Result:
    """Returns the result with the rounding errors of its standard deviations, estimated at some speeds on all roads.

    matrix_accuracy : relative accuracy of the entries of the vehicle's matrices.
    """
    checked_speeds = np.unique(np.linspace(0, len(sweep_by_speed.speeds) - 1, CHECKED_SPEED_COUNT).round().astype(int))
    recomputed = np.array(
        [
            [
                _deviations_of_changed(
                    vehicle_at_speed, road, weighting_by_output, float(sweep_by_speed.speeds[i]), matrix_accuracy
                )
                for i in checked_speeds
            ]
            for road in road_by_case.values()
        ]
    )
    deviation = sweep_by_speed.deviation[:, checked_speeds]
    known = np.isfinite(deviation) & np.isfinite(recomputed)
    sizes, estimates = (
        [root_mean_square(deviation[..., i][known[..., i]]) for i in range(len(sweep_by_speed.outputs))],
        {},
    )
    largest = {
        unit: max(
            size for size, unit_of_output in zip(sizes, sweep_by_speed.units, strict=True) if unit_of_output == unit
        )
        for unit in sweep_by_speed.units
    }
    for i, (name, unit, size) in enumerate(zip(sweep_by_speed.outputs, sweep_by_speed.units, sizes, strict=True)):
        if size > 0.0:
            is_known = known[..., i]
            changes = recomputed[..., i][is_known] - deviation[..., i][is_known]
            error = max(SAFETY_FACTOR * root_mean_square(changes), MATRIX_ACCURACY / 4.0 * size)
            estimates[name] = Estimate(error, unit, error / max(size, STANDSTILL_SHARE * largest[unit]), 1.0, 0.0)
    points = f"{len(checked_speeds)} of {len(sweep_by_speed.speeds)} speeds"
    return with_stated_errors(run_result, estimates, f"the Lyapunov equation of nudged matrices at {points}", "")


def _deviations_of_changed(
    vehicle_at_speed: LinearVehicleAtSpeed,
    road: RoadExcitation,
    weighting_by_output: Mapping[str, str],
    speed: float,
    matrix_accuracy: float,
) -> np.ndarray:
    """Standard deviations (outputs,) at a speed (m/s) of the vehicle with changed last digits; NaN where the solution
    fails.
    """
    system = system_with_weightings(
        vehicle_with_road(with_changed_last_digits(vehicle_at_speed(speed), matrix_accuracy), road, speed),
        weighting_by_output,
    )
    try:
        return stationary_covariance(system).deviation
    except InputError:
        return np.full(len(system.names), np.nan)
