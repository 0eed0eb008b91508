"""Smooth road profiles: a sum of sines without end, and a cubic spline through points.

Both are twice continuously differentiable (C2). That is not a matter of looks: with a slope that jumps,
a fourth-order integrator falls to first order. Arc length s is in m; zeta is the height in m, positive
**down** (a rise is negative, models/__init__.py); the slope is d(zeta)/ds, dimensionless.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from models.core.errors import InputError
from models.road import kernels

HeightsAndSlopes = tuple[np.ndarray, np.ndarray]

OVERRUN_SHARE = 1e-9
"""Share of its length by which a road may be overrun: the rounding of s = v t is not the end of the road."""


class RoadProfile(Protocol):
    """Protocol of a road profile: height (m, positive down) and slope over arc length (m)."""

    @property
    def name(self) -> str:
        """Name of the road for reports and messages."""
        ...

    @property
    def extent(self) -> tuple[float, float]:
        """First and last arc length (m) at which the road is defined; infinite where it has no end."""
        ...

    @property
    def finest(self) -> float:
        """Length (m) of the finest detail, which limits the step of adaptive solvers."""
        ...

    def height_and_slope(self, stations: ArrayLike) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at the arc lengths ``stations`` (m), in the shape of ``stations``."""
        ...

    def sample_uniform(self, start_station: float, station_step: float, sample_count: int) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at ``start_station + j step`` (m), j = 0 .. count - 1."""
        ...

    def height_slope_at(self, stations: float) -> tuple[float, float]:
        """Height (m, positive down) and slope at one arc length ``stations`` (m)."""
        ...


@dataclass(frozen=True, eq=False)
class SineProfile:
    """Road as a sum of sines, zeta(s) = -w(s) sum_i amplitude_i sin(wavenumber_i s + phase_i), and 0 for s <= 0.

    Parameters
    ----------
    amplitude : of each wave, m, shape (n,)
    wavenumber : angular wavenumber 2 pi / wavelength of each wave, rad/m, shape (n,)
    phase : of each wave at s = 0, rad, shape (n,)
    window_length : length in m of the quintic smoothstep w, which lets the road begin without a jump of
        height, slope or curvature; 0 for none (height and slope then jump at s = 0: a hard case)
    name : for reports

    Raises
    ------
    InputError : arrays of different lengths, values that are not finite, a negative window
    """

    amplitude: np.ndarray
    wavenumber: np.ndarray
    phase: np.ndarray
    window_length: float = 0.0
    name: str = "sines"

    def __post_init__(self) -> None:
        for field in ("amplitude", "wavenumber", "phase"):
            object.__setattr__(self, field, _read_only_copy(getattr(self, field), field, 1))
            if getattr(self, field).shape != self.amplitude.shape:
                raise InputError("", field, getattr(self, field).shape, f"must have shape {self.amplitude.shape}")
        object.__setattr__(self, "window_length", _checked_window(self.window_length))

    @property
    def waves(self) -> kernels.RoadWaves:
        """Waves of the road in the form that compiled functions take."""
        return kernels.RoadWaves(self.amplitude, self.wavenumber, self.phase, self.window_length)

    @property
    def extent(self) -> tuple[float, float]:
        """First and last arc length of the road: minus and plus infinity."""
        return -math.inf, math.inf

    @property
    def finest(self) -> float:
        """Length (m) of the finest detail: a quarter of the shortest wavelength."""
        return float(0.5 * math.pi / np.abs(self.wavenumber).max())

    def height_and_slope(self, stations: ArrayLike) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at the arc lengths ``stations`` (m), in the shape of ``stations``."""
        flat, shape = _flat_stations(stations)
        height, slope = np.empty_like(flat), np.empty_like(flat)
        kernels.fill_sines(flat, self.waves, height, slope)
        return height.reshape(shape), slope.reshape(shape)

    def sample_uniform(self, start_station: float, station_step: float, sample_count: int) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at ``start_station + j step`` (m), j = 0 .. count - 1.

        Agrees with :meth:`height_and_slope` to about 1e-14 of the sum of the amplitudes (slopes: of the
        sum of amplitude times wavenumber), as long as the rounding of s itself, 1e-16 of s times the
        wavenumber, stays below that.
        """
        start_station, station_step = _checked_number(start_station, "start"), _checked_number(station_step, "step")
        height, slope = np.empty(sample_count), np.empty(sample_count)
        kernels.sines_uniform(start_station, station_step, self.waves, height, slope)
        return height, slope

    def height_slope_at(self, stations: float) -> tuple[float, float]:
        """Height (m, positive down) and slope at one arc length ``stations`` (m)."""
        return kernels.sines_at(float(stations), self.amplitude, self.wavenumber, self.phase, self.window_length)


@dataclass(frozen=True, eq=False)
class SplineProfile:
    """Road of cubic pieces between stations; C2 when made by :meth:`through`.

    Parameters
    ----------
    station : arc lengths of the points, m, strictly increasing, shape (n,)
    coefficients : of the piece from station i to i + 1 as powers 3, 2, 1, 0 of s - station_i; zeta in m,
        positive down; shape (n - 1, 4)
    window_length : length in m of a quintic smoothstep from the first station on, before which the road
        is flat at height 0 (see models/road/continuation.py); 0 for none
    name : for reports and messages, for example the file's name

    Raises
    ------
    InputError : stations out of order, wrong shapes, values that are not finite; and, from the three
        evaluations, arc lengths outside the extent
    """

    station: np.ndarray
    coefficients: np.ndarray
    window_length: float = 0.0
    name: str = "spline"

    def __post_init__(self) -> None:
        object.__setattr__(self, "station", _read_only_copy(self.station, "station", 1))
        object.__setattr__(self, "coefficients", _read_only_copy(self.coefficients, "coefficients", 2))
        object.__setattr__(self, "window_length", _checked_window(self.window_length))
        wanted = (self.station.size - 1, 4)
        if self.station.size < 2 or self.coefficients.shape != wanted:
            raise InputError(self.name, "coefficients", self.coefficients.shape, f"must have shape {wanted}")
        _check_order(self.name, self.station)

    @classmethod
    def through(cls, stations: ArrayLike, height: ArrayLike, name: str = "spline") -> "SplineProfile":
        """C2 spline through at least 4 points: ``stations`` and ``height`` (positive down) in m, shape (n,).

        The ends are "not-a-knot". A natural spline would bend the first and the last few metres straight,
        an error of order h^2 where the rest has h^4, for the sake of a curvature of 0 that no measured
        road has. Raises InputError for fewer points, points out of order or values that are not finite.
        """
        from scipy.interpolate import CubicSpline

        s, zeta = _read_only_copy(stations, "station", 1), _read_only_copy(height, "height", 1)
        if s.size < 4 or zeta.shape != s.shape:
            raise InputError(name, "points", (s.size, zeta.size), "as many heights as stations, 4 or more, are needed")
        _check_order(name, s)
        return cls(s, CubicSpline(s, zeta, bc_type="not-a-knot").c.T, name=name)

    @property
    def start(self) -> float:
        """Arc length (m) of the first point of the road."""
        return float(self.station[0])

    @property
    def end(self) -> float:
        """Arc length (m) of the last point of the road."""
        return float(self.station[-1])

    @property
    def extent(self) -> tuple[float, float]:
        """First and last arc length (m) of the road; with a window it is also defined before its start, where it is
        flat."""
        return (-math.inf if self.window_length > 0.0 else self.start), self.end

    @property
    def finest(self) -> float:
        """Length (m) of the finest detail: the smallest distance of two stations."""
        return float(np.diff(self.station).min())

    @property
    def points(self) -> HeightsAndSlopes:
        """Stations (m) and heights (m, positive down, without the window) of the road's points, each of shape (n,)."""
        end_height = kernels.cubic_at_station(self.end, self.station, self.coefficients, 0.0)[0]
        return self.station, np.append(self.coefficients[:, 3], end_height)

    def height_and_slope(self, stations: ArrayLike) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at the arc lengths ``stations`` (m), in the shape of ``stations``."""
        flat, shape = _flat_stations(stations)
        if flat.size:
            self._check_extent(float(flat.min()), float(flat.max()))
        height, slope = np.empty_like(flat), np.empty_like(flat)
        kernels.fill_cubics(flat, self.station, self.coefficients, self.window_length, height, slope)
        return height.reshape(shape), slope.reshape(shape)

    def sample_uniform(self, start_station: float, station_step: float, sample_count: int) -> HeightsAndSlopes:
        """Heights (m, positive down) and slopes at ``start_station + j step`` (m), j = 0 .. count - 1."""
        start_station, station_step = _checked_number(start_station, "start"), _checked_number(station_step, "step")
        last_station = start_station + max(sample_count - 1, 0) * station_step
        self._check_extent(min(start_station, last_station), max(start_station, last_station))
        height, slope = np.empty(sample_count), np.empty(sample_count)
        road = (self.station, self.coefficients, self.window_length)
        kernels.cubics_uniform(start_station, station_step, *road, height, slope)
        return height, slope

    def height_slope_at(self, stations: float) -> tuple[float, float]:
        """Height (m, positive down) and slope at one arc length ``stations`` (m)."""
        self._check_extent(stations, stations)
        return kernels.cubic_at_station(float(stations), self.station, self.coefficients, self.window_length)

    def _check_extent(self, first_station: float, last_station: float) -> None:
        """Refuse arc lengths outside the road, where extrapolated polynomials would not be a road."""
        slack = OVERRUN_SHARE * (self.end - self.start)
        begin, end = self.extent
        if not (first_station >= begin - slack and last_station <= end + slack):
            allowed = f"the road is defined from s = {begin:.6g} m to {end:.6g} m; declare how it goes on"
            raise InputError(
                self.name,
                "arc length (m)",
                first_station if not first_station >= begin - slack else last_station,
                allowed,
            )


def _read_only_copy(values: ArrayLike, field_name: str, dimension_count: int) -> np.ndarray:
    """Read-only, contiguous copy of an array, checked to have finite values only."""
    array = np.array(values, dtype=float, order="C")
    if array.ndim != dimension_count or not np.isfinite(array).all():
        raise InputError(
            "", field_name, None, f"must be an array of finite numbers with {dimension_count} dimension(s)"
        )
    array.setflags(write=False)
    return array


def _flat_stations(stations: ArrayLike) -> tuple[np.ndarray, tuple[int, ...]]:
    """Arc lengths as a flat contiguous array, and the original shape."""
    array = np.asarray(stations, dtype=float)
    return np.ascontiguousarray(array).reshape(-1), array.shape


def _checked_number(field_value: float, field_name: str) -> float:
    if not math.isfinite(field_value):
        raise InputError("", field_name, field_value, "must be a finite number")
    return float(field_value)


def _checked_window(window_length: float) -> float:
    if not (math.isfinite(window_length) and window_length >= 0.0):
        raise InputError("", "window_length", window_length, "must be a finite length in m, 0 or more")
    return float(window_length)


def _check_order(road_name: str, stations: np.ndarray) -> None:
    wrong = np.flatnonzero(np.diff(stations) <= 0.0)
    if wrong.size:
        i = int(wrong[0]) + 1
        raise InputError(
            road_name, f"station {i}", float(stations[i]), f"must be greater than {stations[i - 1]:g} before it"
        )
