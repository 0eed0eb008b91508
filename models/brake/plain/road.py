"""Which tables hold under the wheels over a step, in plain code: see ``models.brake.surfaces`` for the rule."""

import numpy as np

from models.brake.plain.tyre import Surface
from models.brake.surfaces import Road


def under_wheels(road: Road, ways: np.ndarray, kinds: np.ndarray) -> list[Surface]:
    """Surface under each wheel. ways (W, 2, 2) : x, y (m) at the start and at the end of the step, joined by a straight
    line; kinds (W,) : kind of each wheel's tyre."""
    return [_surface_under(road, way, int(kind)) for way, kind in zip(ways, kinds, strict=True)]


def _surface_under(road: Road, distance: np.ndarray, kind: int) -> Surface:
    (behind, ahead), (right, left) = np.sort(distance[:, 0]), np.sort(distance[:, 1])
    first, last = _stretch_at(road, behind), _stretch_at(road, ahead)
    if last > first:
        on_left = distance[:, 1].mean() >= road.line
        sides = [int((road.left if on_left else road.right)[k]) for k in (first, last)]
        share = (ahead - road.starts[last]) / (ahead - behind)
    elif right < road.line <= left:
        sides, share = [int(road.right[first]), int(road.left[first])], (left - road.line) / (left - right)
    else:
        sides, share = 2 * [int((road.left if right >= road.line else road.right)[first])], 0.0
    near, far = (side * road.kinds + kind for side in sides)
    return Surface(near, far, float(share) if near != far else 0.0)


def _stretch_at(road: Road, x: float) -> int:
    """Number of the stretch of road at x (m): the last one that begins at or before x."""
    return max(sum(bool(start <= x) for start in road.starts) - 1, 0)


def ground_paths(place: np.ndarray, rates: np.ndarray, points: np.ndarray, step: float) -> np.ndarray:
    """Positions (W, 2, 2) in m of a vehicle's points on the ground at both ends of a step (s); each point moves on a
    straight line.

    place, rates (3,) : x, y and heading, and their rates; points (W, 2) : along and across the vehicle (m).
    """
    complex_points = points @ (1.0, 1.0j) * np.exp(1j * place[2])
    begin = place[0] + 1j * place[1] + complex_points
    end = begin + step * (rates[0] + 1j * rates[1] + 1j * rates[2] * complex_points)
    return np.stack([np.column_stack((ends.real, ends.imag)) for ends in (begin, end)], axis=1)


def in_row(place: np.ndarray, rates: np.ndarray, reach: np.ndarray, unit: int) -> tuple[np.ndarray, np.ndarray]:
    """Position x, y and heading (3,) of a unit's centre, and their rates, from the coordinates (2 + U,) of a row of
    units.

    reach (U,) : m, from the first centre to this one along each unit.
    """
    arms = reach * np.exp(1j * place[2:])
    centre, speed = arms.sum(), (1j * rates[2:] * arms).sum()
    return (
        np.array([place[0] + centre.real, place[1] + centre.imag, place[2 + unit]]),
        np.array([rates[0] + speed.real, rates[1] + speed.imag, rates[2 + unit]]),
    )
