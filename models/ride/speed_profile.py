"""Speed of a drive that varies linearly between the points of a table, with its division into steps and integration
points.

The path driven, its inverse, steps in time for the motion, and on them cells and points that integrate noise in path.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.core.errors import InputError


class SpeedProfile:
    """Speed v(t), piecewise linear between points (t in s, v in m/s, 0 for standstill); path 0 at the first point.

    Before the first point the vehicle has always driven at the first speed, or has always stood. Raises InputError
    for fewer than two points, times that do not rise, and speeds that are negative or not finite.
    """

    def __init__(
        self, times: Sequence[float], speeds: Sequence[float], scene_path: str = "", key_path: str = "drive"
    ) -> None:
        self.times, self.speeds = np.array(times, float), np.array(speeds, float)
        if len(self.times) != len(self.speeds) or len(self.times) < 2:
            sizes = f"{len(self.times)} times, {len(self.speeds)} speeds"
            raise InputError(
                scene_path, key_path, sizes, "must be a table of two points or more, a time and a speed each"
            )
        _check_values(
            self.speeds,
            (self.speeds >= 0.0) & np.isfinite(self.speeds),
            f"{key_path}.speed",
            "must be 0 or above, in m/s: the road is met from one side only",
            scene_path,
        )
        rises = np.append(True, np.diff(self.times) > 0.0) & np.isfinite(self.times)
        _check_values(self.times, rises, f"{key_path}.time", "must rise from point to point, in s", scene_path)
        pieces = np.diff(self.times)
        self.accelerations = np.append(np.diff(self.speeds) / pieces, 0.0)
        self.paths = np.append(0.0, np.cumsum(pieces * (self.speeds[1:] + self.speeds[:-1]) / 2.0))

    def speed(self, time: np.ndarray | float) -> np.ndarray:
        """Speed (m/s) at times (s); constant outside the table."""
        return np.interp(time, self.times, self.speeds)

    def path(self, time: np.ndarray | float) -> np.ndarray:
        """Distance (m) driven since the first point at times (s), negative before it."""
        time = np.asarray(time, float)
        piece = np.maximum(np.searchsorted(self.times, time, side="right") - 1, 0)
        since = time - self.times[piece]
        acceleration = np.where(since < 0.0, 0.0, self.accelerations[piece])
        return self.paths[piece] + since * (self.speeds[piece] + acceleration * since / 2.0)

    def time(self, distance: np.ndarray | float) -> np.ndarray:
        """Time (s) at which a distance (m) along the path is passed; minus or plus infinity if it never is.

        At a place of standstill: the time of arrival.
        """
        distance = np.asarray(distance, float)
        piece = np.clip(np.searchsorted(self.paths, distance, side="left") - 1, 0, None)
        further = distance - self.paths[piece]
        start, acceleration = self.speeds[piece], np.where(further < 0.0, 0.0, self.accelerations[piece])
        root = np.sqrt(np.maximum(start**2 + 2.0 * acceleration * further, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            since = np.where(further == 0.0, 0.0, 2.0 * further / (start + root))
        return self.times[piece] + since


def _check_values(values: np.ndarray, is_valid: np.ndarray, key_path: str, allowed_text: str, scene_path: str) -> None:
    """Raise InputError for the first value that is not valid."""
    if not is_valid.all():
        first_wrong = int(np.argmin(is_valid))
        raise InputError(scene_path, f"{key_path}.{first_wrong}", float(values[first_wrong]), allowed_text)


GAUSS_NODES = 5
"""Count of Gauss points of the integral over a cell, exact up to the power 2 GAUSS_NODES of its length."""
UNIT_POINTS, UNIT_WEIGHTS = (
    half / 2.0 for half in (np.polynomial.legendre.leggauss(GAUSS_NODES) + np.array([[1.0], [0.0]]))
)
"""Gauss points and weights of the integral from 0 to 1."""
EQUAL_CUTS = 1e-11
"""Difference (s) below which two ends of cells count as equal: 1e-9 m of road at most."""

STANDSTILL_CUTS = np.outer((-1.0, 1.0), 4.0 ** -np.arange(1.0, 7.0)).ravel()
"""Ends of cells about an instant of standstill, relative to the longest step."""


@dataclass(frozen=True)
class IntegrationPoints:
    """Integration points (K,) of the integral over the path: time (s), weight (m), and index of the step in which each
    lies."""

    time: np.ndarray
    weight: np.ndarray
    step: np.ndarray


def step_ends_of_drive(
    speed_profile: SpeedProfile,
    begin_time: float,
    instants: Sequence[float] | np.ndarray,
    motion_rate: float,
    road_rate: float,
    largest_rate_times_step: float,
) -> np.ndarray:
    """Ends (N + 1,) of the time steps (s) from ``begin_time`` to the profile's end; the profile's points and
    ``instants`` are among them.

    A step times the fastest rate of the motion (1/s) and of the road met (``road_rate`` in 1/m) is at most
    ``largest_rate_times_step``.
    """
    within = [t for t in instants if begin_time < t < speed_profile.times[-1]]
    cuts = np.unique(np.concatenate([[begin_time], speed_profile.times, within]))
    ends = [cuts[:1]]
    for start, stop in pairwise(cuts):
        rate = max(motion_rate, road_rate * float(speed_profile.speed(np.array([start, stop])).max()))
        ends.append(
            np.linspace(start, stop, max(1, int(np.ceil(rate * (stop - start) / largest_rate_times_step))) + 1)[1:]
        )
    return np.concatenate(ends)


def integration_points(
    speed_profile: SpeedProfile, step_ends: np.ndarray, axle_distances: Sequence[float]
) -> IntegrationPoints:
    """Integration points of the integral over the path, in cells. Cells end at every step's end, and wherever an axle
    passes a position at which a step ended.

    ``axle_distances`` (m) of the other axles behind the first: at such a place the speed may change its slope, or the
    vehicle may have stood. Near a standstill, where time depends on the root of the distance, cells become smaller.
    """
    path, ends_after = speed_profile.path(step_ends), step_ends[step_ends >= speed_profile.times[0]]
    stops = _passing_times(speed_profile, path[speed_profile.speed(step_ends) == 0.0], axle_distances)
    shrinking = (stops[:, None] + np.diff(ends_after).max() * STANDSTILL_CUTS).ravel()
    cell_ends = np.sort(np.concatenate([_passing_times(speed_profile, path, axle_distances), shrinking]))
    cell_ends = cell_ends[(cell_ends > ends_after[0]) & (cell_ends < ends_after[-1])]
    next_end = np.searchsorted(ends_after, cell_ends)
    is_separate = np.minimum(ends_after[next_end] - cell_ends, cell_ends - ends_after[next_end - 1]) > EQUAL_CUTS
    is_separate &= np.diff(cell_ends, prepend=-np.inf) > EQUAL_CUTS
    cuts = np.sort(np.concatenate([ends_after, cell_ends[is_separate]]))
    time = cuts[:-1, None] + np.diff(cuts)[:, None] * UNIT_POINTS
    weight = np.diff(cuts)[:, None] * UNIT_WEIGHTS * speed_profile.speed(time)
    moving = weight.any(axis=1)
    time, weight = time[moving].ravel(), weight[moving].ravel()
    return IntegrationPoints(time, weight, np.searchsorted(step_ends, time, side="right") - 1)


def _passing_times(
    speed_profile: SpeedProfile, path_positions: np.ndarray, axle_distances: Sequence[float]
) -> np.ndarray:
    """Times (s) at which any axle, one of ``axle_distances`` behind the first, reaches the positions of the first."""
    different = np.unique(path_positions)
    return np.concatenate([speed_profile.time(different + distance) for distance in axle_distances] or [np.zeros(0)])
