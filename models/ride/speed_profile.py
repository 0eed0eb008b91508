"""A speed that varies along straight lines between the points of a table, the path driven, and its inverse."""

from collections.abc import Sequence

import numpy as np

from models.core.errors import InputError


class SpeedProfile:
    """Speed v(t), piecewise linear between points (t in s, v in m/s, 0 for standstill); path 0 at the first point.

    Before the first point the vehicle has always driven at the first speed, or has always stood. Raises InputError
    for fewer than two points, times that do not rise, and speeds that are negative or not finite.
    """

    def __init__(self, times: Sequence[float], speeds: Sequence[float], file: str = "", place: str = "drive") -> None:
        self.times, self.speeds = np.array(times, float), np.array(speeds, float)
        if len(self.times) != len(self.speeds) or len(self.times) < 2:
            sizes = f"{len(self.times)} times, {len(self.speeds)} speeds"
            raise InputError(file, place, sizes, "must be a table of two points or more, a time and a speed each")
        _check(
            self.speeds,
            (self.speeds >= 0.0) & np.isfinite(self.speeds),
            f"{place}.speed",
            "must be 0 or above, in m/s: the road is met from one side only",
            file,
        )
        rises = np.append(True, np.diff(self.times) > 0.0) & np.isfinite(self.times)
        _check(self.times, rises, f"{place}.time", "must rise from point to point, in s", file)
        pieces = np.diff(self.times)
        self.accelerations = np.append(np.diff(self.speeds) / pieces, 0.0)
        self.paths = np.append(0.0, np.cumsum(pieces * (self.speeds[1:] + self.speeds[:-1]) / 2.0))

    def speed(self, time: np.ndarray | float) -> np.ndarray:
        """Speed (m/s) at times (s); constant outside the table."""
        return np.interp(time, self.times, self.speeds)

    def path(self, time: np.ndarray | float) -> np.ndarray:
        """Path (m) driven since the first point, negative before it."""
        time = np.asarray(time, float)
        piece = np.maximum(np.searchsorted(self.times, time, side="right") - 1, 0)
        since = time - self.times[piece]
        acceleration = np.where(since < 0.0, 0.0, self.accelerations[piece])
        return self.paths[piece] + since * (self.speeds[piece] + acceleration * since / 2.0)

    def time(self, path: np.ndarray | float) -> np.ndarray:
        """Time (s) at which a place (m) is passed; minus or plus infinity for a place never passed.

        At a place of standstill: the time of arrival.
        """
        path = np.asarray(path, float)
        piece = np.clip(np.searchsorted(self.paths, path, side="left") - 1, 0, None)
        further = path - self.paths[piece]
        start, acceleration = self.speeds[piece], np.where(further < 0.0, 0.0, self.accelerations[piece])
        root = np.sqrt(np.maximum(start**2 + 2.0 * acceleration * further, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            since = np.where(further == 0.0, 0.0, 2.0 * further / (start + root))
        return self.times[piece] + since


def _check(values: np.ndarray, good: np.ndarray, place: str, allowed: str, file: str) -> None:
    """Name the first value that is not good."""
    if not good.all():
        at = int(np.argmin(good))
        raise InputError(file, f"{place}.{at}", float(values[at]), allowed)
