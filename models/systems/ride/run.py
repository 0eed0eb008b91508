"""Runs of a ride scene: covariances of a linear vehicle, or runs in time of a nonlinear one.

The scene decides which. At constant speeds a linear vehicle has exact variances, for several correlations of the road
at once. Along a drive it has them at every instant. Vehicles without a linear equivalent are run in time.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.result import Channel, Result, result
from models.systems.ride.assumptions import assumptions
from models.systems.ride.errors import CORNERED_LAW_ACCURACY, MATRIX_ACCURACY, with_error_of_sweep
from models.systems.ride.of_scene import excitation_of, linear_vehicle, needs_run_in_time, scene_errors, vehicle_of
from models.systems.ride.scene import RideScene
from models.systems.ride.watched import (
    JUDGED_SPEED_COUNT,
    MotionAlongDrive,
    SpectralMotion,
    checked_speeds,
    watched_deviations,
)
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import wheels

if TYPE_CHECKING:
    from models.systems.ride.nonlinear import Progress, RunSampling

CORRELATIONS_AS_WRITTEN = "as in the scene"
"""Name of the scene's correlation of the road in a result."""
ARBITRARY_SPEED = 1.0
"""Speed (m/s) at which a vehicle of a drive at varying speed is linearised: its matrices do not depend on the speed."""
QUASI_STATIONARY_SPEED_COUNT = 90
"""Number of constant speeds, from standstill on, between which quasi-stationary deviations of a drive are
interpolated.
"""


@dataclass(frozen=True)
class SweepPoints:
    """Speeds and correlations of the road at which a linear vehicle is solved, in place of the scene's.

    speeds : m/s, the scene's if None. correlations : of the road, left to right and front to rear, by name; None is the
    scene's correlation.
    """

    speeds: Sequence[float] | None = None
    correlations: Mapping[str, tuple[str, str] | None] = field(default_factory=lambda: {CORRELATIONS_AS_WRITTEN: None})


def run(
    scene: RideScene,
    engine: str = "",
    *,
    vehicle: SpatialVehicle | None = None,
    points: SweepPoints | None = None,
    sampling: "RunSampling | None" = None,
    progress: "Progress" = lambda text, share: None,
    error: bool = False,
) -> Result:
    """Run a ride scene by covariances of the linear vehicle of an engine, or in time. Raises InputError, Refused or
    RunFailed.

    vehicle, points : in place of the scene's. sampling : requests a run in time, which nonlinear springs and
    tyres that may lift need. The reference then uses statistical linearisation and Monte Carlo copies, an engine one
    random road.
    progress : called during such a run. error : whether errors are estimated, by further solutions or runs. Assumptions
    are always checked.

    The result's detail is a ``VarianceSweep``, a ``VaryingSpeedDeviations``, a ``NonlinearRide`` or, for an engine in
    time, an ``EngineRide``.
    """
    engine = engine or "reference"
    with scene_errors(scene):
        if scene.drive is not None:
            return _drive_deviations(scene, engine, vehicle or vehicle_of(scene), error)
        if vehicle is not None or not (sampling or needs_run_in_time(scene)):
            return _deviations_by_speed(scene, engine, vehicle or vehicle_of(scene), points or SweepPoints(), error)
        from models.systems.ride import nonlinear

        vehicle, sampling = vehicle_of(scene), sampling or nonlinear.RunSampling()
        if engine == "reference":
            return nonlinear.linearised_result(scene, vehicle, sampling, progress, error)
        return nonlinear.engine_result(scene, engine, vehicle, sampling, error)


def _deviations_by_speed(
    scene: RideScene, engine: str, vehicle: SpatialVehicle, sweep_points: SweepPoints, estimate_error: bool
) -> Result:
    """Result with standard deviations (correlation, speed, output) at constant speeds. Assumptions are checked on the
    scene's road, or on the last road if the scene's is not among them.
    """
    from models.ride.sweep import variance_sweep

    assert scene.speeds is not None
    roads = {name: excitation_of(scene, wheels(vehicle), case) for name, case in sweep_points.correlations.items()}
    start_time, linear = time.process_time(), linear_vehicle(vehicle, engine)
    swept = variance_sweep(linear, roads, sweep_points.speeds or scene.speeds.all(), scene.weighting)
    labelled = result(
        scene,
        {"deviation": Channel(("correlation", "speed", "output"), swept.deviation)},
        {
            "correlation": Channel("correlation", list(swept.cases)),
            "speed": Channel("speed", swept.speeds, "m/s"),
            "output": Channel("output", list(swept.outputs)),
            "unit": Channel("output", list(swept.units)),
        },
        engine=engine,
        counts={"points": swept.variance[..., 0].size, "direct": sum(swept.direct_counts.values())},
        seconds=time.process_time() - start_time,
        detail=swept,
    )
    road = roads.get(CORRELATIONS_AS_WRITTEN, [*roads.values()][-1])
    with_assumptions(
        labelled, assumptions(scene, vehicle, SpectralMotion(vehicle, linear, road, checked_speeds(swept.speeds), {}))
    )
    if not estimate_error:
        return labelled
    matrix_accuracy = (
        MATRIX_ACCURACY
        if engine == "reference" or not any(spring.is_nonlinear for spring in vehicle.springs)
        else CORNERED_LAW_ACCURACY
    )
    return with_error_of_sweep(labelled, swept, linear, roads, scene.weighting, matrix_accuracy)


def _drive_deviations(scene: RideScene, engine: str, vehicle: SpatialVehicle, estimate_error: bool) -> Result:
    """Result with standard deviations (time, output) along a drive, and with the quasi-stationary deviations that
    constant driving at each speed would give.
    """
    from models.ride.varying_speed import quasi_stationary, varying_speed
    from models.systems.ride.errors_in_time import with_error_of_drive

    assert scene.drive is not None
    start_time, weightings = time.process_time(), scene.weighting
    linear, road = linear_vehicle(vehicle, engine)(ARBITRARY_SPEED), excitation_of(scene, wheels(vehicle))
    drive = varying_speed(linear, road, scene.drive.profile(scene.file), weightings=weightings)
    speeds = np.linspace(0.0, drive.speed.max(), QUASI_STATIONARY_SPEED_COUNT)
    quasi_stationary_deviations = quasi_stationary(linear, road, speeds, weightings=weightings)

    def deviations_along(steps_per_row: int) -> np.ndarray:
        kept_speeds = np.unique([*range(0, len(speeds), steps_per_row), len(speeds) - 1])
        return np.column_stack(
            [
                np.interp(drive.speed, speeds[kept_speeds], column)
                for column in quasi_stationary_deviations[kept_speeds].T
            ]
        )

    labelled = result(
        scene,
        {
            "deviation": Channel(("time", "output"), drive.deviation),
            "quasi_stationary": Channel(("time", "output"), deviations_along(1)),
            "speed": Channel("time", drive.speed, "m/s"),
            "path": Channel("time", drive.path, "m"),
        },
        {
            "time": Channel("time", drive.time, "s"),
            "output": Channel("output", list(drive.names)),
            "unit": Channel("output", [output.unit for output in linear.outputs] + ["m/s^2"] * len(weightings)),
        },
        engine=engine,
        counts={"instants": len(drive.time)},
        seconds=time.process_time() - start_time,
        detail=drive,
    )
    spectral = SpectralMotion(
        vehicle,
        lambda _: linear,
        road,
        checked_speeds(np.linspace(0.0, drive.speed.max(), JUDGED_SPEED_COUNT + 1)[1:]),
        {},
    )
    with_assumptions(
        labelled, assumptions(scene, vehicle, MotionAlongDrive(watched_deviations(vehicle, drive.deviation), spectral))
    )
    return with_error_of_drive(labelled, scene, linear, road, deviations_along) if estimate_error else labelled
