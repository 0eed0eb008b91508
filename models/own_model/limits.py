"""Limits of joints and tendons, which twinrig does not build: which of them a state reaches.

MuJoCo's limit is soft: with d the impedance of its documentation, and a the acceleration without it, it leaves
(1 - d) a and adds d times a spring and a damper. So a joint that presses on a limit has 1 / (1 - d) of its inertia
there. A stop of Exudyn is a spring and a damper beside the inertia. Inside its range a limit does nothing.
"""

from collections.abc import Callable
from copy import copy

import mujoco
import numpy as np

from models.own_model.names import object_label
from models.own_model.reading import TwinModel

LIMIT_CONSTRAINTS = {
    int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT): "joint",
    int(mujoco.mjtConstraint.mjCNSTR_LIMIT_TENDON): "tendon",
}
"""MuJoCo's constraint types that are limits, with the kind of object that they limit."""


def limits_struck(user_model: TwinModel) -> Callable[[np.ndarray], tuple[str, ...]]:
    """Returns a function of coordinates (n,) that returns the names of the joints and tendons whose limits act there in
    MuJoCo's model of the file."""
    model = copy(user_model.model)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    data, still = mujoco.MjData(model), np.zeros(user_model.size)

    def struck(q: np.ndarray) -> tuple[str, ...]:
        data.qpos[:] = user_model.coordinates.to_mujoco(q, still).qpos
        mujoco.mj_fwdPosition(model, data)
        rows = zip(data.efc_type.tolist(), data.efc_id.tolist(), strict=True)
        return tuple(
            object_label(model, LIMIT_CONSTRAINTS[kind], number) for kind, number in rows if kind in LIMIT_CONSTRAINTS
        )

    return struck
