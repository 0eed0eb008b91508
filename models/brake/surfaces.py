"""Friction surfaces of the road: stretches along x, each with its own tyre tables left and right of a line."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from models.brake.plane_chain import ChainPoint, chain_point_position, chain_point_velocity
from models.brake.plane_vehicle import PlaneVehicle
from models.core.errors import InputError
from models.machine.compiled import inlined, lean
from models.tyre.tyre_table import StackedTyreTables


class RoadSurfaces(NamedTuple):
    """Stretches of a road with their surfaces, for compiled functions.

    starts (n,): x in m at which each stretch begins, the first at minus infinity; left, right (n,): numbers of their
    surfaces; line: y in m from which on the left one holds. Table of a wheel: surface * kinds + kind of its tyre.
    """

    starts: np.ndarray
    left: np.ndarray
    right: np.ndarray
    line: float
    kinds: int


class VehicleOnRoad(NamedTuple):
    """A vehicle in the plane with its tyres and road: all data that stay constant during a run.

    kind (W,): which of the road's kinds of tyre each wheel has; slope: largest cornering coefficient of the tables
    (1/rad); tables: surface by surface and kind by kind.
    """

    plane: PlaneVehicle
    kind: np.ndarray
    slope: float
    tables: StackedTyreTables
    road: RoadSurfaces


class WheelSurfaces(NamedTuple):
    """Surface under each wheel, arrays (W,): indices of two tyre tables, and the share of the second; lag: tan of the
    slip angle that lags behind the motion of the wheel, NaN for a tyre without lag.
    """

    first: np.ndarray
    second: np.ndarray
    share: np.ndarray
    lag: np.ndarray


def new_wheel_surfaces(wheel_count: int) -> WheelSurfaces:
    """``WheelSurfaces`` for this number of wheels, with the first table under each and without lag of the tyres."""
    return WheelSurfaces(
        np.zeros(wheel_count), np.zeros(wheel_count), np.zeros(wheel_count), np.full(wheel_count, math.nan)
    )


@inlined
def surfaces_of_rows(rows):
    """``WheelSurfaces`` as views of rows (4, W); for compiled functions only, as Python would free the rows twice."""
    rows[3, :] = math.nan
    return WheelSurfaces(rows[0], rows[1], rows[2], rows[3])


@dataclass(frozen=True)
class RoadStretch:
    """A stretch of road that begins at x (m): indices of the surfaces left and right of the line."""

    x: float
    left: int
    right: int


def road_of_stretches(
    stretches: list[RoadStretch], dividing_line: float = 0.0, tyre_kind_count: int = 1
) -> RoadSurfaces:
    """Road of stretches in ascending order of x; the first one also extends to minus infinity.

    Another level of friction on a stretch is a surface of its own, ``TyreTable.scaled``.
    """
    starts = np.array([stretch.x for stretch in stretches], dtype=float)
    if starts.size == 0 or not np.isfinite(starts).all() or (np.diff(starts) <= 0.0).any():
        raise InputError("", "stretches", starts.tolist(), "must be at least one, with finite x that rise strictly")
    starts[0] = -np.inf
    left, right = (np.array([getattr(s, side) for s in stretches], dtype=np.int64) for side in ("left", "right"))
    if min(left.min(), right.min()) < 0:
        raise InputError("", "stretches", int(min(left.min(), right.min())), "numbers of surfaces count from 0")
    return RoadSurfaces(starts, left, right, dividing_line, tyre_kind_count)


UNIFORM_ROAD = road_of_stretches([RoadStretch(0.0, 0, 0)])
"""Road with the same surface everywhere."""


def check_step_distance(braking_road: RoadSurfaces, step_distance: float) -> None:
    """Refuse time steps in which a wheel may travel a distance (m) longer than the shortest inner stretch of the
    road.
    """
    shortest = float(np.diff(braking_road.starts[1:]).min()) if braking_road.starts.size > 2 else np.inf
    if step_distance > shortest:
        raise InputError(
            "",
            "stretches",
            shortest,
            f"must be at least as long as the way in a step, {step_distance:.3g} m: "
            "take longer stretches or more substeps",
        )


@inlined
def is_uniform(road):
    """Whether the road has the same surface everywhere."""
    return road.starts.size == 1 and road.left[0] == road.right[0]


@lean
def fill_surfaces_under_wheels(vehicle_state, time_step, vehicle_on_road, wheel_surfaces):
    """Fill table indices and shares of the ``WheelSurfaces`` under the wheels of an ``VehicleOnRoad`` for a step (s).

    vehicle_state (2, 2 + U): positions and rates, by which wheels are taken to move over the step. Of two stretches
    that a wheel passes in the step, or of the two sides of the line, each has the share of the way on it, forwards or
    backwards, so that no place of the road counts by how steps fall on it. A wheel that passes both in one step is on
    the side where it is in the middle of the step.
    """
    plane, kind, road = vehicle_on_road.plane, vehicle_on_road.kind, vehicle_on_road.road
    if is_uniform(road):
        for i in range(kind.size):
            wheel_surfaces.first[i] = wheel_surfaces.second[i] = road.left[0] * road.kinds + kind[i]
            wheel_surfaces.share[i] = 0.0
        return
    for i in range(plane.unit.size):
        centre = ChainPoint(plane.unit[i], plane.place[i, 0], plane.place[i, 1])
        px, py = chain_point_position(centre, vehicle_state[0], plane.arm_lengths)
        vx, vy = chain_point_velocity(centre, vehicle_state[0], vehicle_state[1], plane.arm_lengths)
        low, high = min(px, px + time_step * vx), max(px, px + time_step * vx)
        right, left = min(py, py + time_step * vy), max(py, py + time_step * vy)
        first_stretch = max(np.searchsorted(road.starts, low, side="right") - 1, 0)
        last_stretch = max(np.searchsorted(road.starts, high, side="right") - 1, 0)
        share = 0.0
        if last_stretch > first_stretch:
            side = road.left if py + 0.5 * time_step * vy >= road.line else road.right
            first, second = side[first_stretch], side[last_stretch]
            share = (high - road.starts[last_stretch]) / (high - low)
        elif right < road.line <= left:
            first, second = road.right[first_stretch], road.left[first_stretch]
            share = (left - road.line) / (left - right)
        else:
            first = second = road.left[first_stretch] if right >= road.line else road.right[first_stretch]
        wheel_surfaces.first[i] = first * road.kinds + kind[i]
        wheel_surfaces.second[i] = second * road.kinds + kind[i]
        wheel_surfaces.share[i] = share if first != second else 0.0
