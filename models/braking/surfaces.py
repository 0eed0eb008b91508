"""Which tyre table holds where on the road: stretches along x, each with its own surface left and right of a line."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from models.braking.plane_chain import place_of, point
from models.compiled import njit
from models.errors import InputError


class Road(NamedTuple):
    """Stretches of a road for compiled functions.

    starts (n,): x in m at which each stretch begins, the first at minus infinity; left, right (n,): numbers of their
    surfaces; line: y in m from which on the left one holds. Table of a wheel: surface * kinds + kind of its tyre.
    """

    starts: np.ndarray
    left: np.ndarray
    right: np.ndarray
    line: float
    kinds: int


@dataclass(frozen=True)
class Stretch:
    """From x (m) on, the numbers of the surfaces left and right of the line."""

    x: float
    left: int
    right: int


def road(stretches: list[Stretch], line: float = 0.0, kinds: int = 1) -> Road:
    """Road of stretches in the order of their x; the first also holds before it begins."""
    starts = np.array([stretch.x for stretch in stretches], dtype=float)
    if starts.size == 0 or (np.diff(starts) <= 0.0).any():
        raise InputError("", "stretches", starts.tolist(), "must be at least one, with x that rises strictly")
    starts[0] = -np.inf
    return Road(starts, np.array([s.left for s in stretches]), np.array([s.right for s in stretches]), line, kinds)


@njit(cache=True, error_model="numpy")
def under_wheels(state, step, plane, kind, road, surface):
    """Fill ``surface`` (W, 3): tables of each wheel and the share of the second.

    state (2, 2 + U): positions and rates; kind (W,): of each wheel's tyre. Of two stretches that a wheel passes in the
    step each has the share of the way on it, so that no place of the road counts by how steps fall on it.
    """
    for i in range(plane.unit.size):
        k, x, y = plane.unit[i], plane.place[i, 0], plane.place[i, 1]
        px, py = place_of(k, x, y, state[0], plane.reach)
        vx, vy = point(k, x, y, state[0], state[1], plane.reach)
        left = py + 0.5 * step * vy >= road.line
        low, high = min(px, px + step * vx), max(px, px + step * vx)
        here = np.searchsorted(road.starts, low, side="right") - 1
        there = np.searchsorted(road.starts, high, side="right") - 1
        here, there = max(here, 0), max(there, 0)
        share = (high - road.starts[there]) / (high - low) if there > here else 0.0
        first = road.left[here] if left else road.right[here]
        second = road.left[there] if left else road.right[there]
        surface[i, 0] = first * road.kinds + kind[i]
        surface[i, 1] = second * road.kinds + kind[i]
        surface[i, 2] = share if first != second else 0.0
