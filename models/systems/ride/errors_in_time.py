"""Stated errors of drives at varying speed, of Monte Carlo copies and of statistical linearisation, by step length and
number of copies.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from models.core.discretisation import (
    Estimate,
    RunSeries,
    not_estimated,
    observed_order,
    root_mean_square,
    sampling_error,
    with_estimated_errors,
    with_sampling_error,
    with_stated_errors,
)
from models.core.errors import RunFailed
from models.core.result import Result
from models.ride.nonlinear_copies import CopyStatistics, coarser_variances
from models.ride.speed_profile import SpeedProfile
from models.ride.statistical_linearisation import StatisticallyLinear
from models.ride.varying_speed import LARGEST_RATE_TIMES_STEP, VaryingSpeedDeviations, varying_speed
from models.road.excitation import RoadExcitation
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle

DRIVE_ERROR_ORDER = 10
"""Order of convergence of the covariance along a drive, in the length of its steps."""
EACH_SPEED_ALONE_TEXT = ", each speed by itself"
"""Ending of the names of quasi-stationary channels."""
COPIES_ERROR_ORDER = 4
"""Order of convergence of the copies' standard deviations, in the time step."""
LEAST_ERROR_OF_NEGLECTED_SHARE = 0.25
"""Least relative error of a standard deviation by statistical linearisation, divided by the share of its variance that
gains neglect.
"""

DeviationsAtConstantSpeed = Callable[[int], np.ndarray]
"""Function from a stride n to quasi-stationary standard deviations (time, outputs) along a drive, interpolated between
every n-th of the solved speeds.
"""


def with_error_of_drive(
    run_result: Result,
    scene: RideScene,
    vehicle_at_speed: LinearVehicle,
    road: RoadExcitation,
    quasi_stationary_of: DeviationsAtConstantSpeed,
) -> Result:
    """Returns the result of a drive with the errors of its standard deviations. They are estimated by the same drive in
    longer steps, and by fewer speeds between which quasi-stationary deviations are interpolated
    linearly.

    Longer steps end at ends of the drive's steps. Relative errors refer to the deviations, not to their change, which
    is 0 along a drive of constant speed. A drive of one step has no estimate.
    """
    assert scene.drive is not None
    drive: VaryingSpeedDeviations = run_result.detail
    if len(drive.time) < 3:
        return not_estimated(run_result, "the drive is one step long, and no longer step could be beside it")
    profile, step = scene.drive.profile(scene.file), float(np.diff(drive.time).max())
    shown = np.isfinite(drive.deviation).all(axis=0)

    def series(time_rows: np.ndarray, deviation: np.ndarray, quasi_stationary_rows: np.ndarray) -> RunSeries:
        channels = {str(name): deviation[:, i] for i, name in enumerate(drive.names) if shown[i]}
        speed_by_speed = {
            f"{name}{EACH_SPEED_ALONE_TEXT}": quasi_stationary_rows[:, i]
            for i, name in enumerate(drive.names)
            if np.isfinite(quasi_stationary_rows[:, i]).all()
        }
        return RunSeries(time_rows, channels | speed_by_speed)

    def rerun(step_factor: float, run_share: float) -> RunSeries:
        stride = max(1, round(step_factor))
        end = drive.time[0] + run_share * (drive.time[-1] - drive.time[0])
        wanted = drive.time[::stride][drive.time[::stride] <= end + 1e-9]
        if step_factor < 1.0 or len(wanted) < 2:
            raise RunFailed(str(run_result.data.attrs["engine"]), "the drive cannot be repeated in other steps")
        cut = _drive_until(profile, float(wanted[-1]))
        coarse = varying_speed(
            vehicle_at_speed,
            road,
            cut,
            weightings=scene.weighting,
            instants=wanted,
            largest_rate_times_step=1.01 * step_factor * LARGEST_RATE_TIMES_STEP,
        )
        rows = np.abs(coarse.time[:, None] - wanted).argmin(axis=0)
        return series(coarse.time[rows], coarse.deviation[rows], quasi_stationary_of(stride)[::stride][: len(wanted)])

    units = dict(zip(run_result["output"].tolist(), run_result["unit"].tolist(), strict=True))
    units |= {f"{name}{EACH_SPEED_ALONE_TEXT}": unit for name, unit in units.items()}
    fine = series(drive.time, drive.deviation, run_result["quasi_stationary"])._replace(units=units)
    return with_estimated_errors(
        run_result,
        fine,
        rerun,
        DRIVE_ERROR_ORDER,
        step,
        channel_sizes={
            name: root_mean_square(quasi_stationary_rows) for name, quasi_stationary_rows in fine.channels.items()
        },
    )


def _drive_until(speed_profile: SpeedProfile, end_time: float) -> SpeedProfile:
    """Returns the drive up to a time (s)."""
    is_before = speed_profile.times < end_time - 1e-9
    kept_times = [*speed_profile.times[is_before], end_time]
    return SpeedProfile(kept_times, [*speed_profile.speeds[is_before], float(speed_profile.speed(end_time))])


def with_error_of_copies(
    run_result: Result,
    vehicle: SpatialVehicle,
    road: RoadExcitation,
    linearised_by_speed: Mapping[float, StatisticallyLinear],
    copies_by_speed: Mapping[float, CopyStatistics],
    road_seed: int,
) -> Result:
    """Returns the result with the errors of its standard deviations by copies and by statistical linearisation, for
    each output.

    Copies: the error of their time steps, from longer steps of some copies on the same roads, and the statistical
    error. Statistical linearisation: the difference from the copies at the same speeds, less the statistical error of
    this difference, or LEAST_ERROR_OF_NEGLECTED_SHARE of the variance that gains neglect where that is more.
    """
    first = next(iter(copies_by_speed.values()))
    units = dict(zip(run_result["output"].tolist(), run_result["unit"].tolist(), strict=True))
    size = _rms_over_speeds([copies_at_speed.deviation for copies_at_speed in copies_by_speed.values()])
    chance = _rms_over_speeds(
        [copies_at_speed.error / (2.0 * copies_at_speed.deviation) for copies_at_speed in copies_by_speed.values()]
    )
    steps = [
        _step_errors(vehicle, road, speed, copies_at_speed, road_seed)
        for speed, copies_at_speed in copies_by_speed.items()
    ]
    estimates = {}
    for i, name in enumerate(first.names):
        if size[i] > 0.0:
            error, order = max(((row[i], orders[i]) for row, orders in steps), key=lambda pair: pair[0])
            estimates[f"{name}, copies"] = Estimate(error, units[name], error / size[i], order, first.step)
    if linearised_by_speed:
        estimates |= _linearisation_errors(linearised_by_speed, copies_by_speed, units)
    with_stated_errors(run_result, estimates, "the copies in longer steps, and gains beside copies")
    scatter = {
        f"{name}, copies": sampling_error(float(chance[i]), float(size[i]), units[name], len(first.moments[0]))
        for i, name in enumerate(first.names)
        if size[i] > 0.0
    }
    return with_sampling_error(run_result, scatter, len(first.moments[0]))


def _rms_over_speeds(deviation_rows: Sequence[np.ndarray]) -> np.ndarray:
    """Root mean square over the rows, one for each speed."""
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.sqrt(np.mean(np.square(deviation_rows), axis=0)))


def _step_errors(
    vehicle: SpatialVehicle, road: RoadExcitation, speed: float, fine_copies: CopyStatistics, road_seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Errors that the time steps cause in the copies' standard deviations at a speed (m/s), and observed orders of
    convergence, each (outputs,).
    """
    twice, fourfold = (
        coarser_variances(vehicle, road, speed, fine_copies, step_factor, road_seed) for step_factor in (2, 4)
    )
    count = len(twice)
    deviation = np.sqrt(fine_copies.about_mean()[:count].mean(axis=0))
    coarse, coarser = np.sqrt(twice.mean(axis=0)), np.sqrt(fourfold.mean(axis=0))
    pairs = zip(abs(deviation - coarse), abs(coarse - coarser), strict=True)
    order = np.array([observed_order(float(a), float(b), COPIES_ERROR_ORDER) for a, b in pairs])
    return abs(deviation - coarse) / (2.0**order - 1.0), order


def _linearisation_errors(
    linearised_by_speed: Mapping[float, StatisticallyLinear],
    copies_by_speed: Mapping[float, CopyStatistics],
    unit_by_output: Mapping[str, str],
) -> dict[str, Estimate]:
    """Errors of the standard deviations by statistical linearisation, from their difference to the copies' standard
    deviations at the same speeds.
    """
    pairs = [(linearised_by_speed[speed], copies_at_speed) for speed, copies_at_speed in copies_by_speed.items()]
    gains = np.array([copies_at_speed.covariance.deviation for copies_at_speed, _ in pairs])
    true = np.array([copies_at_speed.deviation for _, copies_at_speed in pairs])
    scatter = np.array([copies_at_speed.error / (2.0 * copies_at_speed.deviation) for _, copies_at_speed in pairs])
    left = np.array([copies_at_speed.left_out for copies_at_speed, _ in pairs])
    errors = np.sqrt(np.maximum((gains - true) ** 2 - scatter**2, (LEAST_ERROR_OF_NEGLECTED_SHARE * left * gains) ** 2))
    estimates = {}
    for i, name in enumerate(pairs[0][1].names):
        known = np.isfinite(errors[:, i]) & (gains[:, i] > 0.0) & np.isfinite(gains[:, i])
        if known.any():
            error, size = root_mean_square(errors[known, i]), root_mean_square(gains[known, i])
            estimates[f"{name}, gains"] = Estimate(error, unit_by_output[name], error / size, 1.0, 0.0)
    return estimates
