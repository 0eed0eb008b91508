"""Random states of a model, every coordinate within its range, or as its couplings want it."""

import mujoco
import numpy as np

from models.own_model.coordinates import BALL, FREE, SLIDE
from models.own_model.reading import couplings, tie_rows

COUNT = 100
SEED = 26
ANGLE, SHIFT, SPEED, TILT = np.pi, 0.5, 1.0, 1.2
"""rad, m, and rad/s or m/s: what a coordinate without a range may reach; TILT (rad): the three angles of what turns
without limit, the second of which is singular at a quarter turn."""


def random_states(model: mujoco.MjModel, count: int = COUNT, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and rates (count, n), uniform in the ranges: the same for the same count and seed.

    Those that couplings tie go to the nearest place, and the nearest rate, that satisfies them.
    """
    draw, (low, high) = np.random.default_rng(seed), bounds(model)
    q, v = draw.uniform(low, high, (count, len(low))), draw.uniform(-SPEED, SPEED, (count, len(low)))
    rows, offsets = tie_rows(tuple(couplings(model)), model.nv)
    if not len(rows):
        return q, v
    nearest = np.linalg.pinv(rows).T
    return q - (q @ rows.T - offsets) @ nearest, v - v @ rows.T @ nearest


def bounds(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (n,) that states are drawn between."""
    high = np.full(model.nv, ANGLE)
    low = -high
    for j in range(model.njnt):
        first, place = int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])
        if model.jnt_type[j] in (FREE, BALL):
            turn = first + (3 if model.jnt_type[j] == FREE else 0)
            reach = model.jnt_range[j, 1] if model.jnt_limited[j] else np.inf
            high[first:turn], high[turn : turn + 3] = SHIFT, min(TILT, reach / np.sqrt(3.0))
            low[first : turn + 3] = -high[first : turn + 3]
        elif model.jnt_limited[j]:
            low[first], high[first] = model.jnt_range[j] - model.qpos0[place]
        elif model.jnt_type[j] == SLIDE:
            low[first], high[first] = -SHIFT, SHIFT
    return low, high
