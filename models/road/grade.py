"""Road on a grade: it comes to climb, or to fall, at a constant slope angle."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from models.road.profile import HeightsAndSlopes, RoadProfile

TRANSITION_LENGTH = 40.0
"""Length (m) over which the slope of a grade grows from 0 to its full value."""


@dataclass(frozen=True, eq=False)
class GradedRoad:
    """A road profile on a grade: zeta(s) = profile(s) - tan(grade) TRANSITION_LENGTH W((s - start) /
    TRANSITION_LENGTH).

    W is the integral of the quintic smoothstep: 0 before 0, x^6 - 3 x^5 + 5/2 x^4 up to 1, x - 1/2 beyond. So
    the slope grows monotonically and without a jump up to its second derivative, and beyond the transition the
    grade adds exactly -tan(grade) (s - start - TRANSITION_LENGTH / 2) to the height.

    Parameters
    ----------
    profile : the road without its grade
    grade : slope angle in rad, positive where the road rises (heights are positive down)
    start : arc length (m) at which the slope begins to grow
    """

    profile: RoadProfile
    grade: float
    start: float

    @property
    def name(self) -> str:
        """Name of the profile, with the grade."""
        return f"{self.profile.name}, grade {self.grade:g} rad"

    @property
    def extent(self) -> tuple[float, float]:
        """First and last arc length (m) of the profile."""
        return self.profile.extent

    @property
    def finest(self) -> float:
        """Length (m) of the finest detail: that of the profile, or a quarter of the transition."""
        return min(self.profile.finest, TRANSITION_LENGTH / 4.0)

    def height_and_slope(self, stations: ArrayLike) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at the arc lengths ``stations`` (m), in the shape of ``stations``."""
        height, slope = self.profile.height_and_slope(stations)
        climb_and_slope = self._climb_and_slope(np.asarray(stations, dtype=float))
        return height + climb_and_slope[0], slope + climb_and_slope[1]

    def sample_uniform(self, start_station: float, station_step: float, sample_count: int) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at ``start_station + j step`` (m), j = 0 .. count - 1."""
        height, slope = self.profile.sample_uniform(start_station, station_step, sample_count)
        climb_and_slope = self._climb_and_slope(start_station + station_step * np.arange(sample_count))
        return height + climb_and_slope[0], slope + climb_and_slope[1]

    def height_slope_at(self, stations: float) -> tuple[float, float]:
        """Height (m, positive down) and slope at one arc length ``stations`` (m)."""
        height, slope = self.profile.height_slope_at(stations)
        climb_and_slope = self._climb_and_slope(np.asarray(stations, dtype=float))
        return height + float(climb_and_slope[0]), slope + float(climb_and_slope[1])

    def _climb_and_slope(self, stations: np.ndarray) -> HeightsAndSlopes:
        """Heights (m) and slopes that the grade adds at stations ``stations``."""
        beyond = (stations - self.start) / TRANSITION_LENGTH
        x, steepness = np.clip(beyond, 0.0, 1.0), math.tan(self.grade)
        risen = x**4 * (2.5 - x * (3.0 - x)) + np.maximum(beyond - 1.0, 0.0)
        return -steepness * TRANSITION_LENGTH * risen, -steepness * x**3 * (10.0 - x * (15.0 - 6.0 * x))
