"""Cross-section profiles of wheels and rails.

A profile is a curve z(y) with z downwards, from the wheel into the rail, and y away from the middle of the track:
a right wheel on a right rail. The flange and the gauge corner lie at negative y.
    wheel  y from the taping line, z the growth of the radius over that at the taping line
    rail   y from the rail's axis, z from its highest point
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline, make_smoothing_spline

from models.contact.inputs import Array
from models.core.errors import InputError

POINT_SPACING = 1e-4
"""Distance (m) of the points along a profile's contour."""
SPIKE_DISTANCE = 2e-4
"""Distance (m) from both neighbours above which a point that turns back counts as a measurement error."""
LARGEST_BACKWARD_STEP = 1e-3
"""Step (m) against y up to which a contour that turns back is rough, and not the end of what can be touched; also the
largest width of y that may be lost beyond it.
"""
LARGEST_BACKWARD_RATIO = 0.3
"""Largest ratio of a contour's way against its direction to its way along it: a rail with web and foot turns by
0.27.
"""


@dataclass(frozen=True, eq=False)
class ContactProfile:
    """A wheel or rail profile, given by points.

    y, z : (n,) in m, y ascending. smoothing : wavelength (m) along the contour of which smoothing left half, 0 for
    none; longer waves pass, shorter ones are damped by 1 / (1 + (smoothing / wavelength)^4).
    """

    y: Array
    z: Array
    smoothing: float = 0.0

    @cached_property
    def curve(self) -> CubicSpline:
        """Profile curve z(y) in m through the points, twice continuously differentiable."""
        return CubicSpline(self.y, self.z)

    def turned(self, angle: float) -> "ContactProfile":
        """The profile turned by an angle (rad), for a rail the inclination towards the middle of the track.

        The part that stays a curve over y is kept; z counts from its highest point again.
        """
        y = self.y * np.cos(angle) + self.z * np.sin(angle)
        z = self.z * np.cos(angle) - self.y * np.sin(angle)
        keep = _longest_ascending_run(y)
        return ContactProfile(y[keep], z[keep] - z[keep].min(), self.smoothing)


def profile_of_points(y: Array, z: Array, smoothing: float = 0.0, profile_path: object = "") -> ContactProfile:
    """Profile from measured points y, z (n,) in m, in order along the contour, smoothed and evenly spaced again.

    smoothing : wavelength (m) of which half is left (see ``ContactProfile``). Raises InputError for wrong shapes,
    values that are not finite or not a profile's size in m, and a contour that does not run along y.
    """
    y, z = np.asarray(y, float), np.asarray(z, float)
    _check_points(y, z, smoothing, profile_path)
    if y[0] > y[-1]:
        y, z = y[::-1], z[::-1]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    apart = np.concatenate([[True], np.diff(length) > 0.0])
    length, y, z = length[apart], y[apart], z[apart]
    even = np.linspace(0.0, length[-1], max(round(length[-1] / POINT_SPACING), 10) + 1)
    y, z = (_smoothed_coordinate(length, values, even, smoothing) for values in (y, z))
    keep = _longest_ascending_run(y)
    _check_backward_steps(y, keep, profile_path)
    return ContactProfile(y[keep], z[keep], smoothing)


def _check_points(y: Array, z: Array, smoothing: float, profile_path: object) -> None:
    """Refuse profile points of wrong shape or size, that are not finite, or whose contour does not run along y; and a
    smoothing out of bounds.
    """
    if y.ndim != 1 or y.shape != z.shape or y.size < 10:
        raise InputError(
            profile_path, "profile", [list(y.shape), list(z.shape)], "must be two columns of ten points or more"
        )
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise InputError(profile_path, "profile", None, "must hold finite numbers")
    width = float(np.ptp(y))
    if not 0.01 <= width <= 0.5:
        raise InputError(
            profile_path, "profile", width, "is its width in m, which must be from 0.01 to 0.5: is the unit right?"
        )
    steps = np.diff(y)
    there, back = float(steps[steps > 0.0].sum()), float(-steps[steps < 0.0].sum())
    if min(there, back) > LARGEST_BACKWARD_RATIO * max(there, back):
        raise InputError(
            profile_path,
            "profile",
            None,
            f"runs {there:.3g} m along y and {back:.3g} m against it: points must follow the contour, y before z",
        )
    _check_spikes(np.column_stack((y, z)), profile_path)
    if not 0.0 <= smoothing <= 0.05:
        raise InputError(profile_path, "smoothing", smoothing, "must be a wavelength from 0 to 0.05 m")


def _check_spikes(points: Array, profile_path: object) -> None:
    """Refuse measurement errors: points far from the line between their neighbours. A contour never turns back
    sharply.
    """
    way, straight = np.linalg.norm(np.diff(points, axis=0), axis=1), np.linalg.norm(points[2:] - points[:-2], axis=1)
    spikes = np.minimum(way[:-1], way[1:]) > np.maximum(2.0 * straight, SPIKE_DISTANCE)
    if spikes.any():
        y, z = points[1 + int(np.argmax(spikes))]
        raise InputError(
            profile_path,
            "profile",
            [float(y), float(z)],
            f"sticks out between its neighbours: {spikes.sum()} such points (m); take out what was measured wrongly",
        )


def _check_backward_steps(y: Array, kept_points: slice, profile_path: object) -> None:
    """Refuse a contour whose y briefly decreases, as in rough or coarsely rounded data, since the points beyond would
    be lost.
    """
    for beyond, last in (
        (y[kept_points.stop :], y[kept_points.stop - 1]),
        (-y[: kept_points.start][::-1], -y[kept_points.start]),
    ):
        highest = np.maximum.accumulate(np.append(last, beyond))[1:]
        rough = np.logical_and.accumulate(highest - beyond < LARGEST_BACKWARD_STEP)
        lost = float(np.max(beyond[rough], initial=last) - last)
        if lost > LARGEST_BACKWARD_STEP:
            raise InputError(
                profile_path,
                "profile",
                float(abs(last)),
                f"is |y| (m) where the contour turns back by less than "
                f"{LARGEST_BACKWARD_STEP:g} m, as noise or rounding makes it, and {lost:.2g} m beyond it would "
                "be lost: give a smoothing, from 0.002 m on",
            )


def _smoothed_coordinate(contour_lengths: Array, coordinate: Array, even_lengths: Array, smoothing: float) -> Array:
    """Smoothed coordinate at evenly spaced lengths along the contour: the curve that minimises error^2 + (L / 2 pi)^4
    curvature^2.
    """
    interpolated = CubicSpline(contour_lengths, coordinate)(even_lengths)
    if smoothing == 0.0:
        return interpolated
    penalty = (smoothing / (2.0 * np.pi)) ** 4 / (even_lengths[1] - even_lengths[0])
    return make_smoothing_spline(even_lengths, interpolated, lam=penalty)(even_lengths)


def _longest_ascending_run(y: Array) -> slice:
    """Longest run of consecutive profile points with ascending y."""
    breaks = np.flatnonzero(np.diff(y) <= 0.0)
    starts, ends = np.concatenate([[0], breaks + 1]), np.concatenate([breaks + 1, [y.size]])
    k = int(np.argmax(ends - starts))
    return slice(int(starts[k]), int(ends[k]))
