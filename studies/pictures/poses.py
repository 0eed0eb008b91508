"""Poses of bodies as an engine itself computes them from the coordinates of its own run."""

from collections.abc import Mapping
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


def of_exudyn(mbs: Any, markers: Mapping[str, Any], coordinates: np.ndarray) -> Poses:
    """Poses by Exudyn's markers on the bodies at its coordinates (f, n), in its own order."""
    import exudyn as exu

    kinds = exu.OutputVariableType
    places: dict[str, list] = {name: [] for name in markers}
    turns: dict[str, list] = {name: [] for name in markers}
    for row in coordinates:
        mbs.systemData.SetODE2Coordinates(row)
        for name, marker in markers.items():
            places[name].append(mbs.GetMarkerOutput(marker, kinds.Position))
            turns[name].append(np.reshape(mbs.GetMarkerOutput(marker, kinds.RotationMatrix), (3, 3)))
    return ({name: np.array(rows) for name, rows in places.items()},
            {name: np.array(rows) for name, rows in turns.items()})  # fmt: skip
