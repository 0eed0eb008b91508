"""What others publish of the Manchester contact benchmark, and second ways to the same figures.

Published are the reference outputs mbench_a22_right and mbench_a22_left that CONTACT comes with (revision 2447 of
2023-11-04, Vtech CMCC, Apache 2.0): case A-2.2, exact half-space contact on one plane for all patches, cells of 0.2 mm.
"""

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from models.contact.material import Pair
from models.contact.normal_problem import NormalSolution, centres, solve_normal
from models.contact.undeformed_distance import Distance
from models.contact.wheel_on_rail import Pose, Side, _distance, touches_of
from models.rail.contact_table import Contact, Placed

CONTACT = np.array(
    [
        [0.0, 0.0, 751.4397, 9997, 338.3, 751.4397, 9997, 338.3],
        [0.5, -0.02304, 744.7416, 9870, 632.5, 754.2648, 10050, 395.3],
        [1.0, -0.05049, 741.8109, 9827, 741.3, 755.2849, 10050, 423.9],
        [1.5, -0.08103, 741.3132, 9811, 754.1, 756.0026, 10050, 446.5],
        [2.0, -0.11280, 740.9042, 9799, 744.8, 756.5382, 10040, 465.9],
        [2.5, -0.14570, 740.4689, 9787, 730.4, 756.9482, 10040, 483.1],
        [3.0, -0.18030, 739.9795, 9774, 713.2, 757.2640, 10030, 498.8],
        [3.5, -0.21680, 739.4199, 9760, 691.6, 757.5068, 10030, 513.4],
        [4.0, -0.25570, 738.7560, 9745, 664.4, 757.6900, 10030, 527.2],
        [4.5, -0.29770, 737.9185, 9726, 625.5, 757.8237, 10030, 540.2],
        [5.0, -0.35540, 727.9412, 9619, 1556.0, 757.9189, 10030, 552.8],
        [5.5, -0.47770, 726.1267, 9629, 1486.0, 757.9972, 10020, 565.8],
        [6.0, -0.62720, 725.1701, 9709, 1149.0, 758.0421, 10020, 578.5],
        [6.5, -4.37600, 718.4776, 15440, 2603.0, 758.6418, 10010, 637.0],
        [7.0, -6.39300, 719.0298, 14030, 2622.0, 758.6240, 10010, 666.7],
        [7.5, -7.64200, 719.4491, 13260, 2630.0, 758.4584, 10010, 685.9],
        [8.0, -8.60600, 719.8180, 12720, 2634.0, 758.2352, 10020, 701.1],
        [8.5, -9.40800, 720.1578, 12310, 2638.0, 757.9798, 10020, 714.0],
        [9.0, -10.10113, 720.4778, 11970, 2640.0, 757.7031, 10020, 725.3],
        [9.5, -10.71386, 720.7830, 11680, 2641.0, 757.4113, 10020, 735.2],
        [10.0, -11.26431, 721.0765, 11440, 2643.0, 757.1077, 10020, 744.0],
    ]
)
"""Shift (mm), roll (mrad), then of the right and of the left wheel the mean place of contact across the track (mm), the
normal force (N) and the largest pressure (MPa)."""
PLANE = (5.0e-3, 727.0855e-3, -0.2905)
"""Shift (m) at which CONTACT joins two patches, and its plane there: place across the track (m), angle (rad)."""
CELL, DEEPEST = 1e-4, 1e-3
"""m: of the exact theory on this plane, and more than the bodies reach into each other."""
SETTLED, SUNK = 1e-4, 1e-8
"""Of the load, to which two patches that sink each other are followed; m, to which their approach is found."""
SEARCHED, GRID, HALVINGS, STEP = (2e-3, 0.06), np.linspace(-1.0, 1.0, 101), 6, 3e-4
"""Reach of the search along the profile (m) and round the axle (rad), its grid, how often it shrinks to a quarter; step
(m) over which the rail's angle is taken."""


def sums(placed: Placed, wheel: str) -> tuple[float, float, float]:
    """Mean place across the track (mm), normal force (N), largest pressure (MPa) of all patches of one wheel."""
    places = getattr(placed, wheel)
    normal = sum(place.normal for place in places)
    mean = sum(place.normal * place.y for place in places) / normal
    return 1e3 * mean, normal, max(place.peak for place in places) / 1e6


def on_one_plane(contact: Contact, placed: Placed) -> tuple[float, float, list[float]]:
    """The right wheel lowered on CONTACT's plane: mean place (mm), largest pressure (MPa), both patches' forces (N)."""
    side, (_, y, angle) = contact.side, PLANE
    normal, pose = sum(one.normal for one in placed.right), _lowered(side, placed)
    place = np.array([-7e-3, y, float(side.rail.curve(y))])
    x, s = centres(140, CELL), 5e-3 + centres(180, CELL)

    def pressed(depth: float) -> NormalSolution:
        distance = _distance(side, replace(pose, fall=pose.fall + depth), place, angle, (-5e-3, 15e-3))
        return solve_normal(distance.at(x[None, :], s[:, None]) + DEEPEST, CELL, CELL, contact.pair, approach=DEEPEST)

    depth = brentq(lambda depth: pressed(depth).load - normal, 2e-5, 4e-5, xtol=1e-9)
    solved = pressed(depth)
    rows = solved.pressure.sum(axis=1) * CELL**2
    loads = [float(rows[part].sum()) for part in (s < 5e-3, s >= 5e-3)]
    return 1e3 * float(rows @ (y + s * math.cos(angle)) / rows.sum()), float(solved.pressure.max()) / 1e6, loads


def apart(contact: Contact, placed: Placed) -> list[float]:
    """Normal forces (N) of the right wheel's patches, each on a half-space of its own.

    Each patch sinks under the other one's resultant as Boussinesq's point force sinks a half-space at that distance.
    """
    side = contact.side
    touches = touches_of(side, _lowered(side, placed))[: len(placed.right)]
    away = abs(touches[0].patch.place - touches[1].patch.place)
    vertical, cosines = sum(one.vertical for one in placed.right), [math.cos(touch.angle) for touch in touches]

    def pressed(approach: float) -> np.ndarray:
        forces = np.zeros(2)
        while True:
            before, sunk = forces, forces[::-1] / (math.pi * contact.pair.modulus * away)
            forces = np.array(
                [
                    _alone(touch.patch.distance, approach * cosine - by, contact.pair)
                    for touch, cosine, by in zip(touches, cosines, sunk, strict=True)
                ]
            )
            if np.abs(forces - before).max() < SETTLED * vertical:
                return forces

    approach = brentq(lambda approach: float(pressed(approach) @ cosines) - vertical, 0.0, 4e-5, xtol=SUNK)
    return [float(force) for force in pressed(approach)]


def _alone(distance: Distance, approach: float, pair: Pair) -> float:
    x, s = centres(60, 2e-4), centres(70, 1e-4)
    heights = distance.at(x[None, :], s[:, None])
    return solve_normal(heights, 2e-4, 1e-4, pair, approach=approach).load if heights.min() < approach else 0.0


def _lowered(side: Side, placed: Placed) -> Pose:
    pose = Pose(placed.shift, placed.yaw, placed.roll, 0.0)
    return Pose(placed.shift, placed.yaw, placed.roll, side.clearance(pose))


def searched(side: Side, placed: Placed, sign: float, near: float) -> tuple[float, float, float]:
    """First touch of a wheel near a place on it (m from the taping line), by search over points of its surface.

    sign : 1 for the right wheel, -1 for the left one in its mirror. Both profiles are straight between their points.
    Returns the place across the track and that on the wheel (m), and the rail's angle there (rad).
    """
    roll, yaw = sign * placed.roll, sign * placed.yaw
    ahead, reach_u, reach_a = 0.0, SEARCHED[0], SEARCHED[1]
    for _ in range(HALVINGS):
        u, a = np.meshgrid(near + reach_u * GRID, ahead + reach_a * GRID)
        radius = side.wheelset.radius + np.interp(u, side.wheel.y, side.wheel.z)
        x, y, z = radius * np.sin(a), side.wheelset.arm + u, radius * np.cos(a)
        y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
        y = x * math.sin(yaw) + y * math.cos(yaw) + sign * placed.shift
        k = np.argmin(np.interp(y, side.rail.y, side.rail.z) - z)
        place, near, ahead = float(y.flat[k]), float(u.flat[k]), float(a.flat[k])
        reach_u, reach_a = reach_u / 4.0, reach_a / 4.0
    low, high = np.interp([place - STEP, place + STEP], side.rail.y, side.rail.z)
    return place, near, math.atan(float(high - low) / (2.0 * STEP))
