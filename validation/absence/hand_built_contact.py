"""FASTSIM written by hand for one circular contact without spin: Kalker's march of 1982 along each strip, and nothing
else.

Twinrig's function serves any ellipse, load and creepage with spin, with three integration schemes and falling friction.
This one has no options and computes no moment.
"""

import math
import time
from collections.abc import Callable

import numpy as np

from models.contact.fastsim import FastsimEllipse
from models.contact.fastsim_grid import ellipse_grid
from models.contact.inputs import Array
from models.contact.linear_theory import fastsim_flexibilities
from models.contact.material import MaterialPair
from models.machine.compiled import njit
from models.machine.timing import interleave, paired_ratio

CELLS_PER_STRIP, RADIUS, LOAD, FRICTION = 21, 5e-3, 8e4, 0.3
"""Cells per strip; radius of the contact area (m); normal load (N); coefficient of friction."""
CREEPAGES = (1e-3, 5e-4)
"""Longitudinal and lateral creepage."""
CALLS_PER_JOB = 200
"""Calls of the contact law in a timed job."""


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def creep_forces(
    radius, friction_limit, creepage_along, creepage_across, strip_half_lengths, strip_load_shares, traction_bound
):
    """Creep forces fx, fy (N) on a circular contact area of a radius (m).

    friction_limit : coefficient of friction times load (N); creepage_along, creepage_across : creepages divided by
    their flexibilities (N/m^3); strip_half_lengths, strip_load_shares (n,) : half length of each strip divided by the
    radius, share of the load that it bears; traction_bound (cells,) : largest traction of a cell divided by the strip's
    largest
    """
    cells, count, fx, fy = traction_bound.size, strip_half_lengths.size, 0.0, 0.0
    for k in range(count):
        half, share = strip_half_lengths[k], strip_load_shares[k]
        middle = friction_limit * share / half * cells * count / (4.0 * radius * radius)
        step = 2.0 * radius * half / cells / middle
        u, v, x, y, sum_x, sum_y = step * creepage_along, step * creepage_across, 0.0, 0.0, 0.0, 0.0
        for i in range(cells):
            x, y = x - u, y - v
            size = math.sqrt(x * x + y * y)
            if size > traction_bound[i]:
                x, y = x * traction_bound[i] / size, y * traction_bound[i] / size
            sum_x, sum_y = sum_x + x, sum_y + y
        fx, fy = fx + share * sum_x, fy + share * sum_y
    return friction_limit * fx, friction_limit * fy


def contact_jobs() -> tuple[Callable[[], Array], Callable[[], Array]]:
    """Two functions that compute the same contact CALLS_PER_JOB times, by twinrig and by hand-written code. Both return
    the creep forces fx, fy (N)."""
    pair = MaterialPair()
    product = FastsimEllipse(1.0, pair, cells=CELLS_PER_STRIP, march="plain", flexibilities="three")
    flexible = tuple(float(value) for value in fastsim_flexibilities(RADIUS, RADIUS, pair))[:2]
    strips, cells = ellipse_grid(CELLS_PER_STRIP, product.net.strips.shape[1], "intermediate").records
    halves, shares, bound = strips.half, strips.part, cells.bound

    def run_twinrig() -> Array:
        for _ in range(CALLS_PER_JOB):
            rolled = product(RADIUS, LOAD, FRICTION, *CREEPAGES, 0.0)
        return np.array(rolled[:2])

    def run_hand_built() -> Array:
        for _ in range(CALLS_PER_JOB):
            flexible_along, across = CREEPAGES[0] / flexible[0], CREEPAGES[1] / flexible[1]
            written = creep_forces(RADIUS, FRICTION * LOAD, flexible_along, across, halves, shares, bound)
        return np.array(written)

    return run_twinrig, run_hand_built


def ratio_of_contacts(round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of the creep forces between twinrig and the hand-written code, divided by the friction limit,
    and the ratio of their computing times with its confidence interval."""
    jobs = contact_jobs()
    ours, theirs = (job() for job in jobs)
    gap = float(np.abs(ours - theirs).max()) / (FRICTION * LOAD)
    return gap, paired_ratio(*interleave(jobs, round_count, 5e-3, clock=time.process_time))
