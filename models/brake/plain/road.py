"""Friction tables under the wheels over a step, in plain code: the reference of ``models.brake.surfaces``."""

import numpy as np

from models.brake.plain.tyre import WheelSurface
from models.brake.surfaces import RoadSurfaces


def surfaces_under_wheels(road: RoadSurfaces, wheel_paths: np.ndarray, surface_kinds: np.ndarray) -> list[WheelSurface]:
    """Surface under each wheel. wheel_paths (W, 2, 2) : x, y (m) at the start and at the end of the step, joined by a
    straight line; surface_kinds (W,) : kind of each wheel's tyre.
    """
    return [
        _surface_under(road, wheel_path, int(kind)) for wheel_path, kind in zip(wheel_paths, surface_kinds, strict=True)
    ]


def _surface_under(road: RoadSurfaces, wheel_path: np.ndarray, surface_kind: int) -> WheelSurface:
    """Surface under one wheel whose path (2, 2) in m may cross from one stretch or side of the road to another."""
    (behind, front_end), (right, left) = np.sort(wheel_path[:, 0]), np.sort(wheel_path[:, 1])
    first_stretch, last_stretch = _stretch_at(road, behind), _stretch_at(road, front_end)
    if last_stretch > first_stretch:
        on_left = wheel_path[:, 1].mean() >= road.line
        sides = [int((road.left if on_left else road.right)[k]) for k in (first_stretch, last_stretch)]
        share = (front_end - road.starts[last_stretch]) / (front_end - behind)
    elif right < road.line <= left:
        sides, share = (
            [int(road.right[first_stretch]), int(road.left[first_stretch])],
            (left - road.line) / (left - right),
        )
    else:
        sides, share = 2 * [int((road.left if right >= road.line else road.right)[first_stretch])], 0.0
    near, far = (side * road.kinds + surface_kind for side in sides)
    return WheelSurface(near, far, float(share) if near != far else 0.0)


def _stretch_at(road: RoadSurfaces, x: float) -> int:
    """Index of the stretch of road at x (m): the last one that begins at or before x."""
    return max(sum(bool(start <= x) for start in road.starts) - 1, 0)


def ground_paths(
    plane_position: np.ndarray, rates: np.ndarray, points_on_vehicle: np.ndarray, time_step: float
) -> np.ndarray:
    """Positions (W, 2, 2) in m of a vehicle's points on the ground at both ends of a step (s); each point moves on a
    straight line.

    plane_position, rates (3,) : x, y and heading, and their rates; points_on_vehicle (W, 2) : along and across the
    vehicle (m).
    """
    complex_points = points_on_vehicle @ (1.0, 1.0j) * np.exp(1j * plane_position[2])
    begin = plane_position[0] + 1j * plane_position[1] + complex_points
    end = begin + time_step * (rates[0] + 1j * rates[1] + 1j * rates[2] * complex_points)
    return np.stack([np.column_stack((ends.real, ends.imag)) for ends in (begin, end)], axis=1)


def unit_position_in_train(
    unit_coordinates: np.ndarray, unit_rates: np.ndarray, arm_lengths: np.ndarray, unit_index: int
) -> tuple[np.ndarray, np.ndarray]:
    """Position x, y and heading (3,) of a unit's centre in a train, and their rates, from the train's coordinates (2 +
    U,).

    arm_lengths (U,) : m, from the first centre to this one along each unit.
    """
    arms = arm_lengths * np.exp(1j * unit_coordinates[2:])
    centre, speed = arms.sum(), (1j * unit_rates[2:] * arms).sum()
    return (
        np.array(
            [unit_coordinates[0] + centre.real, unit_coordinates[1] + centre.imag, unit_coordinates[2 + unit_index]]
        ),
        np.array([unit_rates[0] + speed.real, unit_rates[1] + speed.imag, unit_rates[2 + unit_index]]),
    )
