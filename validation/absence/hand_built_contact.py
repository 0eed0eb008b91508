"""FASTSIM written out for one round contact without spin: the march of 1982, strip after strip, and nothing else.

The product's own call serves any ellipse, load and creepage with spin, in three marches and with friction that falls;
this one has neither a choice nor a moment.
"""

import math
import time
from collections.abc import Callable

import numpy as np

from models.contact.fastsim import Ellipse
from models.contact.fastsim_grid import grid
from models.contact.inputs import Array
from models.contact.linear_theory import flexibilities
from models.contact.material import MaterialPair
from models.machine.compiled import njit
from models.machine.timing import interleave, paired_ratio

CELLS_PER_STRIP, AXIS, LOAD, FRICTION = 21, 5e-3, 8e4, 0.3
"""Cells of a strip, semi-axes (m), load (N), coefficient of friction."""
CREEPAGES = (1e-3, 5e-4)
CALLS_PER_TURN = 200
"""In a turn."""


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def forces(axis, friction_limit, creepage_along, creepage_across, halves, shares, bound):
    """Creep forces fx, fy (N) on a circular contact area of radius ``axis`` (m).

    friction_limit : friction by load (N); creepage_along, creepage_across : creepages by their flexibilities (N/m^3);
    halves, shares (n,) : half length of a strip by the axis, share of the load; bound (cells,) : traction that a cell
    may bear divided by that in the strip's middle
    """
    cells, count, fx, fy = bound.size, halves.size, 0.0, 0.0
    for k in range(count):
        half, share = halves[k], shares[k]
        middle = friction_limit * share / half * cells * count / (4.0 * axis * axis)
        step = 2.0 * axis * half / cells / middle
        u, v, x, y, sum_x, sum_y = step * creepage_along, step * creepage_across, 0.0, 0.0, 0.0, 0.0
        for i in range(cells):
            x, y = x - u, y - v
            size = math.sqrt(x * x + y * y)
            if size > bound[i]:
                x, y = x * bound[i] / size, y * bound[i] / size
            sum_x, sum_y = sum_x + x, sum_y + y
        fx, fy = fx + share * sum_x, fy + share * sum_y
    return friction_limit * fx, friction_limit * fy


def contact_jobs() -> tuple[Callable[[], Array], Callable[[], Array]]:
    """Two functions that compute the same contact CALLS_PER_TURN times, by twinrig and by hand-written code, and return
    fx, fy (N)."""
    pair = MaterialPair()
    product = Ellipse(1.0, pair, cells=CELLS_PER_STRIP, march="plain", flexibilities="three")
    flexible = tuple(float(value) for value in flexibilities(AXIS, AXIS, pair))[:2]
    strips, cells = grid(CELLS_PER_STRIP, product.net.strips.shape[1], "intermediate").records
    halves, shares, bound = strips.half, strips.part, cells.bound

    def ours() -> Array:
        for _ in range(CALLS_PER_TURN):
            rolled = product(AXIS, LOAD, FRICTION, *CREEPAGES, 0.0)
        return np.array(rolled[:2])

    def theirs() -> Array:
        for _ in range(CALLS_PER_TURN):
            flexible_along, across = CREEPAGES[0] / flexible[0], CREEPAGES[1] / flexible[1]
            written = forces(AXIS, FRICTION * LOAD, flexible_along, across, halves, shares, bound)
        return np.array(written)

    return ours, theirs


def ratio_of_contacts(round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of the creep forces between twinrig and the hand-written code, divided by the friction limit;
    ratio of computing times with its confidence interval."""
    jobs = contact_jobs()
    ours, theirs = (job() for job in jobs)
    gap = float(np.abs(ours - theirs).max()) / (FRICTION * LOAD)
    return gap, paired_ratio(*interleave(jobs, round_count, 5e-3, clock=time.process_time))
