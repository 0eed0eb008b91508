"""A scene of ride, run: the only place where one is.

What a scene calls for decides how. At constant speeds a linear vehicle has exact variances, in several correlations of
the road at once; along a drive it has them at every instant; vehicles that nothing linear stands for go in time.
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
from models.systems.ride.of_scene import excitation_of, goes_in_time, linear_vehicle, scene_errors, vehicle_of
from models.systems.ride.scene import RideScene
from models.systems.ride.watched import JUDGED_SPEEDS, MotionAlongDrive, Spectral, few_speeds, own_deviations
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import wheels

if TYPE_CHECKING:
    from models.systems.ride.nonlinear import Progress, Sampling

AS_WRITTEN = "as in the scene"
ANY_SPEED = 1.0
"""m/s: the matrices of vehicles that are driven at a varying speed are the same at every one."""
QUASI_STATIONARY = 90
"""Speeds at which each is taken by itself beside a drive, from standstill on; straight between them."""


@dataclass(frozen=True)
class SweepPoints:
    """Speeds and correlations at which a linear vehicle is solved; they replace the scene's own.

    speeds : m/s, those of the scene if None. correlations : of the road, left to right and front to rear, by name; None
    is the scene's own.
    """

    speeds: Sequence[float] | None = None
    correlations: Mapping[str, tuple[str, str] | None] = field(default_factory=lambda: {AS_WRITTEN: None})


def run(
    scene: RideScene,
    engine: str = "",
    *,
    vehicle: SpatialVehicle | None = None,
    points: SweepPoints | None = None,
    sampling: "Sampling | None" = None,
    progress: "Progress" = lambda text, share: None,
    error: bool = False,
) -> Result:
    """Run a scene with the linear vehicle of an engine, or in time; raises InputError, Refused or RunFailed.

    vehicle, points : replace the scene's own. sampling : requests a run in time, which nonlinear springs and tyres that
    may lift need. The reference then uses statistical linearisation and Monte Carlo copies, an engine one path of the
    road. progress : called during such a run. error : whether errors are estimated, by further solutions or runs. The
    assumptions of a run are always judged.

    The result's detail is a ``Sweep``, a ``VaryingSpeed``, a ``Nonlinear`` or, for an engine in time, a ``Ride``.
    """
    engine = engine or "reference"
    with scene_errors(scene):
        if scene.drive is not None:
            return _drive_deviations(scene, engine, vehicle or vehicle_of(scene), error)
        if vehicle is not None or not (sampling or goes_in_time(scene)):
            return _deviations_by_speed(scene, engine, vehicle or vehicle_of(scene), points or SweepPoints(), error)
        from models.systems.ride import nonlinear

        vehicle, sampling = vehicle_of(scene), sampling or nonlinear.Sampling()
        if engine == "reference":
            return nonlinear.linearised_result(scene, vehicle, sampling, progress, error)
        return nonlinear.in_engine(scene, engine, vehicle, sampling, error)


def _deviations_by_speed(
    scene: RideScene, engine: str, vehicle: SpatialVehicle, points: SweepPoints, error: bool
) -> Result:
    """Standard deviations (correlation, speed, output). Assumptions are judged on the scene's own road, or on the last
    one.
    """
    from models.ride.sweep import variance_sweep

    assert scene.speeds is not None
    roads = {name: excitation_of(scene, wheels(vehicle), case) for name, case in points.correlations.items()}
    start_time, linear = time.process_time(), linear_vehicle(vehicle, engine)
    swept = variance_sweep(linear, roads, points.speeds or scene.speeds.all(), scene.weighting)
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
    road = roads.get(AS_WRITTEN, [*roads.values()][-1])
    with_assumptions(
        labelled, assumptions(scene, vehicle, Spectral(vehicle, linear, road, few_speeds(swept.speeds), {}))
    )
    if not error:
        return labelled
    digit = (
        MATRIX_ACCURACY
        if engine == "reference" or not any(spring.is_nonlinear for spring in vehicle.springs)
        else CORNERED_LAW_ACCURACY
    )
    return with_error_of_sweep(labelled, swept, linear, roads, scene.weighting, digit)


def _drive_deviations(scene: RideScene, engine: str, vehicle: SpatialVehicle, error: bool) -> Result:
    """Standard deviations (time, output) along a drive, and the quasi-stationary ones, as if each speed had always been
    driven.
    """
    from models.ride.varying_speed import quasi_stationary, varying_speed
    from models.systems.ride.errors_in_time import with_error_of_drive

    assert scene.drive is not None
    start_time, weightings = time.process_time(), scene.weighting
    linear, road = linear_vehicle(vehicle, engine)(ANY_SPEED), excitation_of(scene, wheels(vehicle))
    drive = varying_speed(linear, road, scene.drive.profile(scene.file), weightings=weightings)
    speeds = np.linspace(0.0, drive.speed.max(), QUASI_STATIONARY)
    quasi_stationary_deviations = quasi_stationary(linear, road, speeds, weightings=weightings)

    def deviations_along(stride: int) -> np.ndarray:
        kept_speeds = np.unique([*range(0, len(speeds), stride), len(speeds) - 1])
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
    spectral = Spectral(
        vehicle, lambda _: linear, road, few_speeds(np.linspace(0.0, drive.speed.max(), JUDGED_SPEEDS + 1)[1:]), {}
    )
    with_assumptions(
        labelled, assumptions(scene, vehicle, MotionAlongDrive(own_deviations(vehicle, drive.deviation), spectral))
    )
    return with_error_of_drive(labelled, scene, linear, road, deviations_along) if error else labelled
