"""Poses of bodies as an engine itself computes them from the coordinates of its own run."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Poses = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]
"""Places (f, 3) in m and turns (f, 3, 3), space from body, of each body by its name."""


def of_mujoco(model: Any, bodies: Mapping[str, int], coordinates: np.ndarray) -> Poses:
    """Poses by ``mj_kinematics`` at ``qpos`` (f, nq); ``bodies`` are MuJoCo's numbers of them."""
    import mujoco

    data = mujoco.MjData(model)
    found = []
    for data.qpos[:] in coordinates:
        mujoco.mj_kinematics(model, data)
        found.append((data.xpos.copy(), data.xmat.reshape(-1, 3, 3).copy()))
    places, turns = (np.array(part) for part in zip(*found, strict=True))
    return ({name: places[:, i] for name, i in bodies.items()}, {name: turns[:, i] for name, i in bodies.items()})


def of_exudyn(mbs: Any, bodies: Mapping[str, Callable[[Any], Any]], coordinates: np.ndarray) -> Poses:
    """Poses at Exudyn's coordinates (f, n), in its own order; ``bodies`` answer for an output variable of Exudyn."""
    import exudyn as exu

    kinds, found = exu.OutputVariableType, []
    for row in coordinates:
        mbs.systemData.SetODE2Coordinates(row)
        found.append([(ask(kinds.Position), np.reshape(ask(kinds.RotationMatrix), (3, 3))) for ask in bodies.values()])
    places, turns = (np.array([[pose[part] for pose in frame] for frame in found]) for part in (0, 1))
    return ({name: places[:, i] for i, name in enumerate(bodies)}, {name: turns[:, i] for i, name in enumerate(bodies)})
