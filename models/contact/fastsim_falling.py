"""FASTSIM with friction that falls with the speed of slip: kernels of its own, so that constant friction pays nothing.

mu(s) = mu (floor + (1 - floor) exp(-decay s)), s the speed of slip in m/s (Polach, Wear 258 (2005) 992, but point by
point). It is taken at the rigid slip of the point: exact where all slides, and no loop in which slip and friction
chase one another, which would have more than one end. A sticking cell is asked for less than it could hold.
"""

import math
from typing import Any

import numpy as np
from pydantic import Field

from models.compiled import njit
from models.contact.fastsim_kernels import BEFORE, BOUND, CENTRE, MIDDLE, RATE, advance, cut
from models.contact.fastsim_many import HALF, LOAD, MU, PART, SPIN, SPREAD, XI_X, XI_Y, A, B, Y, rigid_slip, touches
from models.strict import Strict


class Falling(Strict):
    """Falling friction, ``Falling(floor=0.4, decay=0.6, speed=20.0)``."""

    floor: float = Field(gt=0.0, le=1.0, description="friction at endless slip by that at none")
    decay: float = Field(ge=0.0, le=1e6, description="of the exponential", json_schema_extra={"unit": "s/m"})
    speed: float = Field(ge=0.0, le=1e4, description="rolling speed", json_schema_extra={"unit": "m/s"})

    @property
    def law(self) -> tuple[float, float]:
        """Floor, and decay per unit of slip by the rolling speed."""
        return self.floor, self.decay * self.speed

    def __init__(self, **values: Any) -> None:
        super().__init__(**values)


@njit(cache=True, error_model="numpy")
def forces_falling(contacts, strips, cells, middle, kind, floor, decay, found):
    """As ``fastsim_many.forces`` with the second-order march, and friction that falls."""
    n, m = cells.shape[1], strips.shape[1]
    slip, sums = np.empty(5), np.empty(4)
    area = 0.0
    for s in range(m):
        area += strips[HALF, s]
    for c in range(len(contacts)):
        own = contacts[c]
        found[c] = 0.0
        if not touches(own):
            continue
        rigid_slip(own, n, middle, kind, slip)
        limit = own[MU] * own[LOAD]
        for s in range(m):
            _strip(own, strips[:, s], cells, slip, floor, decay, sums)
            part, half = limit * strips[PART, s], strips[HALF, s]
            found[c, 0] += part * sums[0]
            found[c, 1] += part * sums[1]
            found[c, 2] += part * (slip[4] * own[A] * half * sums[2] - slip[3] * own[B] * strips[Y, s] * sums[0])
            found[c, 3] += half * sums[3] / (n * area)


@njit(cache=True, error_model="numpy")
def _strip(own, strip, cells, slip, floor, decay, sums):
    """Sums of q_x, q_y, t q_y and of sticking cells along one strip."""
    y, half, spread = strip[Y], strip[HALF], strip[SPREAD]
    u, v0 = spread * (slip[0] - slip[2] * own[B] * y), spread * slip[1]
    v1 = spread * slip[2] * own[A] * half
    along, across, turn = own[XI_X] - own[SPIN] * own[B] * y, own[XI_Y], own[SPIN] * own[A] * half
    change, last = -2.0 / cells.shape[1], 0.0
    px = py = slips = 0.0
    sums[:] = 0.0
    for i in range(cells.shape[1]):
        t, v = cells[CENTRE, i], v0 + v1 * cells[MIDDLE, i]
        here = _left(along, across + turn * t, floor, decay)
        middle = _left(along, across + turn * cells[MIDDLE, i], floor, decay)
        g = here * cells[BOUND, i]
        if i == 0:
            px, py, slips = cut(-0.5 * u, -0.5 * v, g)
        else:
            rate = cells[RATE, i] / middle
            px, py, slips = advance(px, py, slips, u, v, v1 * change, g, last * cells[BEFORE, i], rate)
        last = here
        sums[0] += px
        sums[1] += py
        sums[2] += t * py
        sums[3] += 1.0 - slips


@njit(cache=True, error_model="numpy")
def _left(along, across, floor, decay):
    """Share of the friction that is left at a slip."""
    return floor + (1.0 - floor) * math.exp(-decay * math.sqrt(along * along + across * across))
