"""Errors of rides in time by their step length and their finite number of copies: drives, copies, gains."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from models.core.discretisation import (
    Estimate,
    Series,
    by_chance,
    estimated,
    not_estimated,
    observed_order,
    of_chance,
    with_stated_errors,
)
from models.core.errors import RunFailed
from models.core.result import Result
from models.ride.nonlinear_copies import Copies, coarser_variances
from models.ride.speed_profile import SpeedProfile
from models.ride.statistical_linearisation import StatisticallyLinear
from models.ride.varying_speed import LARGEST_RATE_TIMES_STEP, VaryingSpeed, varying_speed
from models.road.excitation import Excitation
from models.systems.ride.errors import finite_rms
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle

DRIVE_ORDER = 10
"""Of a drive's points in path."""
SPEED_BY_SPEED = ", each speed by itself"
COPIES_ORDER = 4
LEAST_LEFT = 0.25
"""Error of a deviation, at least, by the share of its variance that gains leave out."""

DeviationsAtConstantSpeed = Callable[[int], np.ndarray]
"""Deviations (time, outputs) as if each speed had always been driven, by every so many of the speeds that are known."""


def with_error_of_drive(
    run: Result, scene: RideScene, linear: LinearVehicle, road: Excitation, alone: DeviationsAtConstantSpeed
) -> Result:
    """The result with the errors of its deviations. They are estimated by the same drive in longer steps that end with
    its own, and by fewer speeds between which quasi-stationary deviations are interpolated linearly. Shares are of the
    deviations themselves, which along an even drive do not change. A drive of one step has no estimate.
    """
    assert scene.drive is not None
    drive: VaryingSpeed = run.detail
    if len(drive.time) < 3:
        return not_estimated(run, "the drive is one step long, and no longer step could be beside it")
    profile, step = scene.drive.profile(scene.file), float(np.diff(drive.time).max())
    shown = np.isfinite(drive.deviation).all(axis=0)

    def series(time: np.ndarray, deviation: np.ndarray, each: np.ndarray) -> Series:
        channels = {str(name): deviation[:, i] for i, name in enumerate(drive.names) if shown[i]}
        apart = {
            f"{name}{SPEED_BY_SPEED}": each[:, i] for i, name in enumerate(drive.names) if np.isfinite(each[:, i]).all()
        }
        return Series(time, channels | apart)

    def rerun(times: float, share: float) -> Series:
        every = max(1, round(times))
        end = drive.time[0] + share * (drive.time[-1] - drive.time[0])
        wanted = drive.time[::every][drive.time[::every] <= end + 1e-9]
        if times < 1.0 or len(wanted) < 2:
            raise RunFailed(str(run.data.attrs["engine"]), "the drive cannot be repeated in other steps")
        cut = _drive_until(profile, float(wanted[-1]))
        coarse = varying_speed(
            linear,
            road,
            cut,
            weightings=scene.weighting,
            instants=wanted,
            largest_rate_times_step=1.01 * times * LARGEST_RATE_TIMES_STEP,
        )
        rows = np.abs(coarse.time[:, None] - wanted).argmin(axis=0)
        return series(coarse.time[rows], coarse.deviation[rows], alone(every)[::every][: len(wanted)])

    units = dict(zip(run["output"].tolist(), run["unit"].tolist(), strict=True))
    units |= {f"{name}{SPEED_BY_SPEED}": unit for name, unit in units.items()}
    fine = series(drive.time, drive.deviation, run["quasi_stationary"])._replace(units=units)
    return estimated(
        run, fine, rerun, DRIVE_ORDER, step, sizes={name: finite_rms(each) for name, each in fine.channels.items()}
    )


def _drive_until(profile: SpeedProfile, end: float) -> SpeedProfile:
    """The drive cut off at a time (s)."""
    before = profile.times < end - 1e-9
    times = [*profile.times[before], end]
    return SpeedProfile(times, [*profile.speeds[before], float(profile.speed(end))])


def with_error_of_copies(
    run: Result,
    vehicle: SpatialVehicle,
    road: Excitation,
    equivalents: Mapping[float, StatisticallyLinear],
    copies: Mapping[float, Copies],
    seed: int,
) -> Result:
    """The result with the errors of its standard deviations, one for each output.

    Copies: the error of their steps, from longer steps for some of them on the same roads, and the statistical error.
    Statistical linearisation: the difference from the copies at the same speeds, less the statistical error of this
    difference, or what the gains leave out where that is more.
    """
    first = next(iter(copies.values()))
    units = dict(zip(run["output"].tolist(), run["unit"].tolist(), strict=True))
    size = _over_speeds([each.deviation for each in copies.values()])
    chance = _over_speeds([each.error / (2.0 * each.deviation) for each in copies.values()])
    steps = [_of_steps(vehicle, road, speed, each, seed) for speed, each in copies.items()]
    told = {}
    for i, name in enumerate(first.names):
        if size[i] > 0.0:
            error, order = max(((row[i], orders[i]) for row, orders in steps), key=lambda pair: pair[0])
            told[f"{name}, copies"] = Estimate(error, units[name], error / size[i], order, first.step)
    if equivalents:
        told |= _of_gains(equivalents, copies, units)
    with_stated_errors(run, told, "the copies in longer steps, and gains beside copies")
    scatter = {
        f"{name}, copies": by_chance(float(chance[i]), float(size[i]), units[name], len(first.moments[0]))
        for i, name in enumerate(first.names)
        if size[i] > 0.0
    }
    return of_chance(run, scatter, len(first.moments[0]))


def _over_speeds(rows: Sequence[np.ndarray]) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.sqrt(np.mean(np.square(rows), axis=0)))


def _of_steps(
    vehicle: SpatialVehicle, road: Excitation, speed: float, fine: Copies, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Errors (p,) that the steps cause in the copies' standard deviations at a speed, and observed orders (p,)."""
    twice, fourfold = (coarser_variances(vehicle, road, speed, fine, times, seed) for times in (2, 4))
    count = len(twice)
    deviation = np.sqrt(fine.about_mean()[:count].mean(axis=0))
    coarse, coarser = np.sqrt(twice.mean(axis=0)), np.sqrt(fourfold.mean(axis=0))
    pairs = zip(abs(deviation - coarse), abs(coarse - coarser), strict=True)
    order = np.array([observed_order(float(a), float(b), COPIES_ORDER) for a, b in pairs])
    return abs(deviation - coarse) / (2.0**order - 1.0), order


def _of_gains(
    equivalents: Mapping[float, StatisticallyLinear], copies: Mapping[float, Copies], units: Mapping[str, str]
) -> dict[str, Estimate]:
    """Errors of the standard deviations by statistical linearisation, from their difference to those of the copies at
    the copies' speeds.
    """
    beside = [(equivalents[speed], each) for speed, each in copies.items()]
    gains = np.array([each.covariance.deviation for each, _ in beside])
    true = np.array([each.deviation for _, each in beside])
    scatter = np.array([each.error / (2.0 * each.deviation) for _, each in beside])
    left = np.array([each.left_out for each, _ in beside])
    errors = np.sqrt(np.maximum((gains - true) ** 2 - scatter**2, (LEAST_LEFT * left * gains) ** 2))
    told = {}
    for i, name in enumerate(beside[0][1].names):
        known = np.isfinite(errors[:, i]) & (gains[:, i] > 0.0) & np.isfinite(gains[:, i])
        if known.any():
            error, size = finite_rms(errors[known, i]), finite_rms(gains[known, i])
            told[f"{name}, gains"] = Estimate(error, units[name], error / size, 1.0, 0.0)
    return told
