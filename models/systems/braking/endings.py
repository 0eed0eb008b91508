"""Why a run of the plane vehicle ends before it stands: what lifted or folded, with its value and its limit."""

import math

import numpy as np

from models.brake.advance import FOLDED, NOT_FOUND, PITCHED, ROLLED
from models.brake.plane_chain import rows
from models.brake.plane_step import LOAD
from models.brake.plane_vehicle import Plane

ENDS = (NOT_FOUND, PITCHED, ROLLED, FOLDED)
"""Ends of a sample after which a run cannot go on."""
BODIES = ("vehicle", "trailer")
HINGES = ("the drawbar against the truck", "the trailer's body against the drawbar")


def ending(status: int, plane: Plane, state: np.ndarray, found: np.ndarray, report: np.ndarray) -> str:
    """Why a sample ended a run; state (2, 2 + U), accelerations ``found`` (2 + U,), report (W, 7) of its last step."""
    if status == FOLDED:
        return _folded(plane, state[0, 2:])
    if status == NOT_FOUND:
        return "no loads were found"
    first = next(i for i in range(0, plane.wheels, 4) if _lifted(report[i : i + 4, LOAD]))
    return _tipped(status, plane, slice(first, first + 4), _acceleration(plane, first, state, found), report[:, LOAD])


def _folded(plane: Plane, headings: np.ndarray) -> str:
    angles = np.degrees(np.diff(headings))
    k = int(np.argmax(np.abs(angles)))
    hinge = HINGES[k] if angles.size > 1 else HINGES[1]
    return f"the train jackknifes: {hinge} at {angles[k]:.1f} deg, limit {math.degrees(plane.fold):g} deg"


def _lifted(loads: np.ndarray) -> bool:
    """Whether two wheels of a side or of an axle bear nothing."""
    up = loads <= 0.0
    return bool((up[0] or up[3]) and (up[1] or up[2]))


def _acceleration(plane: Plane, first: int, state: np.ndarray, found: np.ndarray) -> tuple[float, float]:
    """Of the body on four wheels, along and across it (m/s^2)."""
    k, along, across = plane.group[first], np.zeros(found.size), np.zeros(found.size)
    units = np.column_stack((np.cos(state[0, 2:]), np.sin(state[0, 2:])))
    ahead, aside = rows(k, 0.0, 0.0, *units[k], units, state[1], plane.reach, along, across)
    return float(along @ found + ahead), float(across @ found + aside)


def _tipped(status: int, plane: Plane, four: slice, rates: tuple[float, float], loads: np.ndarray) -> str:
    """By moments about the wheels that stay on the road: statics of a body whose loads follow its accelerations."""
    body, (ahead, aside) = BODIES[four.start // 4], rates
    static, by_x, by_y, y = (part[four] for part in (plane.static, plane.by_x, plane.by_y, plane.place[:, 1]))
    if status == PITCHED:
        axle = 0 if loads[four][:2].max() <= 0.0 else 2
        limit = -static[axle : axle + 2].sum() / by_x[axle : axle + 2].sum()
        return (
            f"the {body} pitches over: its {'rear' if axle else 'front'} wheels lift off at {ahead:.2f} m/s^2 "
            f"along it, limit {limit:.2f}"
        )
    pressed = static + by_x * ahead
    limit = float(np.abs(y) @ pressed / np.abs(by_y @ y))
    side = "left" if loads[four][0] <= 0.0 else "right"
    return f"the {body} rolls over: its {side} wheels lift off at {aside:.2f} m/s^2 across it, limit {limit:.2f}"
