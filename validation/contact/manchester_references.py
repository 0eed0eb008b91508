"""Published results of the Manchester contact benchmark, and independent computations of the same figures.

Published are the reference outputs mbench_a22_right and mbench_a22_left that CONTACT comes with (revision 2447 of
2023-11-04, Vtech CMCC, Apache 2.0): case A-2.2, exact half-space contact on one plane for all patches, cells of 0.2 mm.
"""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from models.contact.material import MaterialPair
from models.contact.normal_problem import NormalSolution, cell_centres, solve_normal
from models.contact.undeformed_distance import UndeformedDistance
from models.contact.wheel_on_rail import WheelAndRail, WheelsetPose, distance_over, touching_places
from models.rail.contact_table import WheelsetContact, WheelsetPlacement
from models.systems.wheel_rail.scene import build

SCENE = build(
    {
        "title": "Manchester contact benchmark",
        "system": "wheel-rail",
        "cases": {"A-1": {}, "A-2": {"yaw": 2.4, "friction": 0.3}},
    }
)
"""Benchmark scene: new S1002 wheels on new UIC 60 rails at 1:40 with 10 kN on each wheel. In case A-1 they are pressed
together, in case A-2 they roll at 2 m/s with yaw."""
PUBLISHED_CONTACT = np.loadtxt(Path(__file__).with_name("manchester_contact.csv"), delimiter=",", skiprows=1)
"""Published output of CONTACT (rows, 8): shift (mm), roll (mrad), then for the right and the left wheel the mean
lateral position of contact (mm), the normal force (N) and the largest pressure (MPa)."""
CONTACT_PLANE = (5.0e-3, 727.0855e-3, -0.2905)
"""Shift (m) at which CONTACT joins two patches, and its contact plane there: lateral position (m), angle (rad)."""
CELL_SIZE, LARGEST_PENETRATION = 1e-4, 1e-3
"""Cell size (m) of the exact theory on CONTACT's plane; an upper limit (m) of the penetration of the bodies."""
PATCH_LOAD_TOLERANCE, SINKING_TOLERANCE = 1e-4, 1e-8
"""Tolerance of the loads of two patches that deform each other, divided by the load; tolerance (m) of their
approach."""
SEARCH_REACH, SEARCH_GRID, SEARCH_ROUNDS, SLOPE_STEP = (2e-3, 0.06), np.linspace(-1.0, 1.0, 101), 6, 3e-4
"""Search for the contact point: range along the profile (m) and about the axle (rad), grid, number of times that it
shrinks to a quarter; distance (m) over which the rail's angle is measured."""


@cache
def contact_of(benchmark_case: str) -> WheelsetContact:
    """Contact model of wheelset and track in a case ("A-1", "A-2") of the benchmark."""
    return SCENE.contact(SCENE.cases[benchmark_case])


def placement_at(benchmark_case: str, lateral_shift: float) -> WheelsetPlacement:
    """Wheelset placed at a lateral shift (m) in a case of the benchmark, with its contact patches."""
    return contact_of(benchmark_case).at(lateral_shift, SCENE.cases[benchmark_case].yaw * lateral_shift)


def wheel_sums(placed_wheelset: WheelsetPlacement, wheel_side: str) -> tuple[float, float, float]:
    """Load-weighted lateral position (mm), normal force (N) and largest pressure (MPa) over all contact patches of the
    "right" or "left" wheel."""
    places = getattr(placed_wheelset, wheel_side)
    normal = sum(place.normal for place in places)
    mean = sum(place.normal * place.y for place in places) / normal
    return 1e3 * mean, normal, max(place.peak for place in places) / 1e6


def exact_on_contact_plane(
    wheelset_contact: WheelsetContact, placed_wheelset: WheelsetPlacement
) -> tuple[float, float, list[float]]:
    """Exact contact of the right wheel with its gap measured along CONTACT's plane: mean lateral position (mm), largest
    pressure (MPa), forces of both patches (N)."""
    side, (_, y, angle) = wheelset_contact.side, CONTACT_PLANE
    normal, pose = sum(touch.normal for touch in placed_wheelset.right), _lowered_pose(side, placed_wheelset)
    place = np.array([-7e-3, y, float(side.rail.curve(y))])
    x, s = cell_centres(140, CELL_SIZE), 5e-3 + cell_centres(180, CELL_SIZE)

    def pressed(approach: float) -> NormalSolution:
        distance = distance_over(side, replace(pose, fall=pose.fall + approach), place, angle, (-5e-3, 15e-3))
        return solve_normal(
            distance.at(x[None, :], s[:, None]) + LARGEST_PENETRATION,
            CELL_SIZE,
            CELL_SIZE,
            wheelset_contact.material_pair,
            approach=LARGEST_PENETRATION,
        )

    depth = brentq(lambda depth: pressed(depth).load - normal, 2e-5, 4e-5, xtol=1e-9)
    solved = pressed(depth)
    rows = solved.pressure.sum(axis=1) * CELL_SIZE**2
    loads = [float(rows[part].sum()) for part in (s < 5e-3, s >= 5e-3)]
    return 1e3 * float(rows @ (y + s * math.cos(angle)) / rows.sum()), float(solved.pressure.max()) / 1e6, loads


def patch_forces(wheelset_contact: WheelsetContact, placed_wheelset: WheelsetPlacement) -> list[float]:
    """Normal forces (N) of the right wheel's patches, each computed on a separate half-space.

    Each patch is lowered by the other patch's resultant, as by Boussinesq's point force at that distance.
    """
    side = wheelset_contact.side
    touches = touching_places(side, _lowered_pose(side, placed_wheelset))[: len(placed_wheelset.right)]
    away = abs(touches[0].patch.contour_position - touches[1].patch.contour_position)
    vertical, cosines = (
        sum(wheel.vertical for wheel in placed_wheelset.right),
        [math.cos(touch.angle) for touch in touches],
    )

    def pressed(approach: float) -> np.ndarray:
        forces = np.zeros(2)
        while True:
            before, sunk = forces, forces[::-1] / (math.pi * wheelset_contact.material_pair.modulus * away)
            forces = np.array(
                [
                    _load_of_patch(touch.patch.distance, approach * cosine - by, wheelset_contact.material_pair)
                    for touch, cosine, by in zip(touches, cosines, sunk, strict=True)
                ]
            )
            if np.abs(forces - before).max() < PATCH_LOAD_TOLERANCE * vertical:
                return forces

    approach = brentq(lambda approach: float(pressed(approach) @ cosines) - vertical, 0.0, 4e-5, xtol=SINKING_TOLERANCE)
    return [float(force) for force in pressed(approach)]


def _load_of_patch(patch_gap: UndeformedDistance, approach: float, material_pair: MaterialPair) -> float:
    x, s = cell_centres(60, 2e-4), cell_centres(70, 1e-4)
    heights = patch_gap.at(x[None, :], s[:, None])
    return solve_normal(heights, 2e-4, 1e-4, material_pair, approach=approach).load if heights.min() < approach else 0.0


def _lowered_pose(wheel_and_rail: WheelAndRail, placed_wheelset: WheelsetPlacement) -> WheelsetPose:
    pose = WheelsetPose(placed_wheelset.shift, placed_wheelset.yaw, placed_wheelset.roll, 0.0)
    return WheelsetPose(
        placed_wheelset.shift, placed_wheelset.yaw, placed_wheelset.roll, wheel_and_rail.clearance(pose)
    )


def first_touch(
    wheel_and_rail: WheelAndRail, placed_wheelset: WheelsetPlacement, wheel_sign: float, position_guess: float
) -> tuple[float, float, float]:
    """Contact point of a wheel on a rail near a guess (m from the taping line), by a search over points of the wheel's
    surface. Returns its lateral position in the track (m), its position on the wheel (m), and the rail's angle there
    (rad).

    wheel_sign : 1 for the right wheel, -1 for the mirrored left wheel. Both profiles are straight between their points.
    """
    roll, yaw = wheel_sign * placed_wheelset.roll, wheel_sign * placed_wheelset.yaw
    ahead, reach_u, reach_a = 0.0, SEARCH_REACH[0], SEARCH_REACH[1]
    for _ in range(SEARCH_ROUNDS):
        u, a = np.meshgrid(position_guess + reach_u * SEARCH_GRID, ahead + reach_a * SEARCH_GRID)
        radius = wheel_and_rail.wheelset.radius + np.interp(u, wheel_and_rail.wheel.y, wheel_and_rail.wheel.z)
        x, y, z = radius * np.sin(a), wheel_and_rail.wheelset.arm + u, radius * np.cos(a)
        y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
        y = x * math.sin(yaw) + y * math.cos(yaw) + wheel_sign * placed_wheelset.shift
        k = np.argmin(np.interp(y, wheel_and_rail.rail.y, wheel_and_rail.rail.z) - z)
        place, position_guess, ahead = float(y.flat[k]), float(u.flat[k]), float(a.flat[k])
        reach_u, reach_a = reach_u / 4.0, reach_a / 4.0
    low, high = np.interp([place - SLOPE_STEP, place + SLOPE_STEP], wheel_and_rail.rail.y, wheel_and_rail.rail.z)
    return place, position_guess, math.atan(float(high - low) / (2.0 * SLOPE_STEP))
