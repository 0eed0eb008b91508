"""Random states of a user's model, with every coordinate within its range and all constraints satisfied."""

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.own_model.constraints import plain_constraints, satisfying_state
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, SLIDE_JOINT
from models.own_model.equalities import coupling_rows
from models.own_model.names import first_names_text
from models.own_model.reading import TwinModel

STATE_COUNT = 100
SEED = 26
LARGEST_ANGLE, LARGEST_SHIFT, LARGEST_SPEED, LARGEST_TILT = np.pi, 0.5, 1.0, 1.2
"""Limits (rad, m, and rad/s or m/s) within which a coordinate without a range, and its rate, are drawn; LARGEST_TILT
(rad): limit of the three angles of a ball or free joint, the second of which is singular at a quarter turn."""

STEEPEST_MIDDLE_ANGLE = 1.45
"""Largest size (rad) of the second of three angles, which is singular at a quarter turn."""
DISTANCE_SHARES = (1.0, 0.7, 0.5, 0.3, 0.1, 0.03, 0.01)
"""Shares of a random distance from the design position; the first at which constraints can be satisfied is taken."""
UNMET_GAP = 1e-9
"""Violation (rad, m) of couplings above which no coordinates satisfy all of them."""
UNMET_REASON = (
    "constraints cannot be satisfied all at once by coordinates in their ranges: {}; try `--without equality`"
)


def random_states(user_model: TwinModel, state_count: int, seed: int = SEED) -> tuple[np.ndarray, np.ndarray]:
    """Random coordinates and rates (count, n), uniform in their ranges; equal for equal ``state_count`` and ``seed``.

    Those that constraints tie go to the nearest place, and the nearest rate, that satisfies them. RunFailed where no
    state does.
    """
    draw, (low, high) = np.random.default_rng(seed), drawing_bounds(user_model.model)
    q, v = (
        draw.uniform(low, high, (state_count, len(low))),
        draw.uniform(-LARGEST_SPEED, LARGEST_SPEED, (state_count, len(low))),
    )
    if user_model.driven.connections:
        return _constrained_states(user_model, q, v)
    rows, offsets = coupling_rows(user_model.driven.couplings, user_model.size)
    if not len(rows):
        return q, v
    nearest = np.linalg.pinv(rows).T
    q, v = q - (q @ rows.T - offsets) @ nearest, v - v @ rows.T @ nearest
    unmet = np.abs(q @ rows.T - offsets).max(axis=0) > UNMET_GAP
    if unmet.any():
        names = [tie.name for tie, off in zip(user_model.driven.couplings, unmet, strict=True) if off]
        raise RunFailed("twin", f"{' and '.join(names)} contradict each other: no coordinates satisfy all of them")
    return q, v


def _constrained_states(user_model: TwinModel, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States (count, n) that satisfy the constraints between bodies, computed from random ones; a state moves towards
    the design position where no solution is near."""
    constraints, (low, high) = plain_constraints(user_model), file_limits(user_model.model)
    middle = np.clip(0.0, low, high)

    def nearest(coordinates: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        for ranges in ((-np.inf, np.inf), (low, high)):  # within them alone where the nearest ones lie beyond
            for share in DISTANCE_SHARES:
                state = satisfying_state(constraints, middle + share * (coordinates - middle), rates, ranges)
                if state is not None and ((low <= state[0]) & (state[0] <= high)).all():
                    return state
        names = [each.name for each in user_model.driven.couplings] + [
            each.name for each in user_model.driven.connections
        ]
        raise RunFailed("twin", UNMET_REASON.format(first_names_text(names)))

    states = [nearest(*each) for each in zip(q, v, strict=True)]
    return np.array([place for place, _ in states]), np.array([rate for _, rate in states])


def drawing_bounds(mujoco_model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (n,) between which random states are drawn."""
    high = np.full(mujoco_model.nv, LARGEST_ANGLE)
    low = -high
    for j in range(mujoco_model.njnt):
        first, place = int(mujoco_model.jnt_dofadr[j]), int(mujoco_model.jnt_qposadr[j])
        if mujoco_model.jnt_type[j] in (FREE_JOINT, BALL_JOINT):
            turn = first + (3 if mujoco_model.jnt_type[j] == FREE_JOINT else 0)
            reach = mujoco_model.jnt_range[j, 1] - mujoco_model.jnt_margin[j] if mujoco_model.jnt_limited[j] else np.inf
            high[first:turn], high[turn : turn + 3] = LARGEST_SHIFT, min(LARGEST_TILT, reach / np.sqrt(3.0))
            low[first : turn + 3] = -high[first : turn + 3]
        elif mujoco_model.jnt_limited[j]:
            margin = min(float(mujoco_model.jnt_margin[j]), 0.5 * float(np.ptp(mujoco_model.jnt_range[j])))
            low[first], high[first] = mujoco_model.jnt_range[j] - mujoco_model.qpos0[place] + (margin, -margin)
        elif mujoco_model.jnt_type[j] == SLIDE_JOINT:
            low[first], high[first] = -LARGEST_SHIFT, LARGEST_SHIFT
    return low, high


def file_limits(mujoco_model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (n,) of the ranges in the file, infinite where there is no range.

    The middle one of three angles keeps away from a quarter turn all the same.
    """
    low, high = drawing_bounds(mujoco_model)
    for j in range(mujoco_model.njnt):
        first, several = int(mujoco_model.jnt_dofadr[j]), mujoco_model.jnt_type[j] in (FREE_JOINT, BALL_JOINT)
        free = mujoco_model.jnt_type[j] == FREE_JOINT
        if not mujoco_model.jnt_limited[j] or free:
            of = slice(first, first + (6 if free else 3 if several else 1))
            low[of], high[of] = -np.inf, np.inf
        if several:
            middle = first + (4 if free else 1)
            low[middle], high[middle] = (
                max(low[middle], -STEEPEST_MIDDLE_ANGLE),
                min(high[middle], STEEPEST_MIDDLE_ANGLE),
            )
    return low, high
