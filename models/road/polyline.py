"""Road of straight lines through measured points: a hard case, to show what it does to an integrator.

The slope jumps at every point, and a fourth-order method falls to first order (notes on sampled input:
errors of 6e-3 to 2e-2 at 0.5 ms where the C2 road gives 4e-5). Never the road of a result.
"""

import numpy as np
from numpy.typing import ArrayLike

from models.road.profile import SplineProfile


class PolylineProfile(SplineProfile):
    """Piecewise linear road profile; at a point, the slope is that of the following piece. Units as in the base
    class."""

    @classmethod
    def through(cls, stations: ArrayLike, height: ArrayLike, name: str = "polyline") -> "PolylineProfile":
        """Polyline through 2 or more points: stations and heights in m, height positive down. Raises InputError as its
        base does."""
        s, zeta = np.asarray(stations, dtype=float), np.asarray(height, dtype=float)
        nothing = np.zeros(s.size - 1)
        with np.errstate(divide="ignore", invalid="ignore"):  # repeated stations are refused by the base
            slope = np.diff(zeta) / np.diff(s)
        pieces = np.column_stack([nothing, nothing, np.nan_to_num(slope), zeta[:-1]])
        return cls(s, pieces, name=name)


def polyline_through(road_points: SplineProfile | tuple[ArrayLike, ArrayLike]) -> PolylineProfile:
    """Polyline through the points of a spline, or through (stations, heights) in m."""
    if isinstance(road_points, SplineProfile):
        return PolylineProfile.through(*road_points.points, f"{road_points.name}, polyline")
    return PolylineProfile.through(*road_points)
