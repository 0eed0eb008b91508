"""A quarter vehicle braked to a stop by a constant torque on the surfaces that have a name."""

import math
from functools import cache

import numpy as np

from models.brake.plane_vehicle import GRAVITY
from models.brake.quarter import Quarter, Stop, braked
from models.brake.surfaces import EVEN
from models.tyre.magic_formula import surface
from models.tyre.tyre_table import Tables, TyreTable, stacked

FRONT = Quarter(mass=16900.0 / GRAVITY, radius=0.5, spin_inertia=13.35)
"""A front wheel of the paper's truck under what it bears while braking."""
STEP = 5.5e-3
"""The paper's step (s)."""


@cache
def met(on: str, scale: float = 1.0) -> tuple[TyreTable, Tables]:
    """Table of a surface, as it is and for compiled functions."""
    tyre = surface(on, scale)
    return tyre, stacked([tyre])


def steady(quarter: Quarter, tyre: TyreTable, slip: float) -> tuple[float, float]:
    """Force (N) at a slip and the torque (N m) under which it stays."""
    force = quarter.mass * GRAVITY * float(np.interp(slip, tyre.slips, tyre.mu_x[0, 0]))
    return force, quarter.steady_torque(slip, force)


def stop(
    quarter: Quarter,
    tyre: tuple[TyreTable, Tables],
    torque: float,
    speed: float,
    step: float = STEP,
    after: float = 0.0,
    turning: float | None = None,
) -> Stop:
    """Braked by a constant torque (N m) for more than it takes at the least of both forces, and ``after`` (s)."""
    least = min(torque / quarter.radius, quarter.mass * GRAVITY * float(tyre[0].mu_x[0, 0, -1]))
    steps = math.ceil((1.25 * speed * quarter.mass / least + 0.5 + after) / step) if torque > 0.0 else 1000
    return braked(quarter, tyre[1], EVEN, np.full(steps + 1, torque), step, speed, turning)
