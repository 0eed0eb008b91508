"""Equality constraints of a file in twinrig's description: couplings of joint coordinates, and joints between
bodies."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from models.engines.native_parts import Connection, Coupling
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT
from models.own_model.names import (
    feature_is_disabled,
    mass_body_name,
    moving_bodies,
    object_label,
    rotation_matrix,
    vector_tuple,
)

CONNECT_EQUALITY, WELD_EQUALITY = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)


def couples_joints(mujoco_model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint couples a hinge or slide linearly to another joint, or fixes it."""
    if mujoco_model.eq_type[equality] != mujoco.mjtEq.mjEQ_JOINT or mujoco_model.eq_data[equality, 2:5].any():
        return False
    joints = [j for j in (mujoco_model.eq_obj1id[equality], mujoco_model.eq_obj2id[equality]) if j >= 0]
    return not any(mujoco_model.jnt_type[j] in (BALL_JOINT, FREE_JOINT) for j in joints)


def joint_couplings(mujoco_model: mujoco.MjModel) -> Iterator[Coupling]:
    """Couplings of the description from the active equality constraints of one or two joints."""
    if feature_is_disabled(mujoco_model, "EQUALITY"):
        return
    for e in (e for e in range(mujoco_model.neq) if mujoco_model.eq_active0[e] and couples_joints(mujoco_model, e)):
        first, second = int(mujoco_model.eq_obj1id[e]), int(mujoco_model.eq_obj2id[e])
        driver = int(mujoco_model.jnt_dofadr[second]) if second >= 0 else None
        offset, ratio = mujoco_model.eq_data[e, :2].tolist()
        softness = stiffness_and_damping(mujoco_model, mujoco_model.eq_solref[e], mujoco_model.eq_solimp[e])
        yield Coupling(
            object_label(mujoco_model, "equality", e),
            int(mujoco_model.jnt_dofadr[first]),
            driver,
            ratio,
            offset,
            *softness,
        )


def stiffness_and_damping(
    mujoco_model: mujoco.MjModel, solref: np.ndarray, solimp: np.ndarray
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """MuJoCo's solref (2,) of a constraint, converted to stiffness and damping so that it does not depend on the step,
    and its solimp (5,)."""
    time, ratio = solref.tolist()
    if time > 0.0 and ratio > 0.0:
        time = (
            time if feature_is_disabled(mujoco_model, "REFSAFE") else max(time, 2.0 * float(mujoco_model.opt.timestep))
        )
        time, ratio = -1.0 / (time * ratio) ** 2, -2.0 / time
    return (time, ratio), tuple(solimp.tolist())


def joins_bodies(mujoco_model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint connects points of two bodies, or fixes the bodies to each other."""
    return int(mujoco_model.eq_type[equality]) in (CONNECT_EQUALITY, WELD_EQUALITY)


def is_between_sites(mujoco_model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint is defined by two sites instead of bodies."""
    return bool(mujoco_model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE)


def connections(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> Iterator[Connection]:
    """Connections of the description from the active equality constraints between points, or between points and axes,
    of two bodies."""
    if feature_is_disabled(mujoco_model, "EQUALITY"):
        return
    numbers = moving_bodies(mujoco_model)
    for e in (e for e in range(mujoco_model.neq) if mujoco_model.eq_active0[e] and joins_bodies(mujoco_model, e)):
        things = int(mujoco_model.eq_obj1id[e]), int(mujoco_model.eq_obj2id[e])
        bodies = [
            int(mujoco_model.site_bodyid[thing]) if is_between_sites(mujoco_model, e) else thing for thing in things
        ]
        first, second = (mass_body_name(b) if b in numbers else None for b in bodies)
        if first == second:
            continue
        (start, turned), (end, other) = _frames_of_ends(mujoco_model, design_data, e)
        turns = mujoco_model.eq_type[e] == WELD_EQUALITY and mujoco_model.eq_data[e, 10]
        axes = (turned, other) if turns else None
        softness = stiffness_and_damping(mujoco_model, mujoco_model.eq_solref[e], mujoco_model.eq_solimp[e])
        ends = (first, vector_tuple(start)), (second, vector_tuple(end))
        yield Connection(
            object_label(mujoco_model, "equality", e), ends, axes, *softness, float(mujoco_model.eq_data[e, 10])
        )


def _frames_of_ends(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, equality: int
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points (3,) in m and axes (3, 3) at both ends of a constraint in the design position; they coincide where the
    constraint is satisfied.

    A weld between bodies gives its point on the second body first.
    """
    things, data = (mujoco_model.eq_obj1id[equality], mujoco_model.eq_obj2id[equality]), mujoco_model.eq_data[equality]
    if is_between_sites(mujoco_model, equality):
        return [(design_data.site_xpos[s].copy(), design_data.site_xmat[s].reshape(3, 3).copy()) for s in things]
    points, axes = [data[:3], data[3:6]], [np.eye(3), np.eye(3)]
    if mujoco_model.eq_type[equality] == WELD_EQUALITY:
        points, axes = points[::-1], [rotation_matrix(data[6:10]), np.eye(3)]
    turns = [design_data.xmat[b].reshape(3, 3) for b in things]
    places = [design_data.xpos[b] + turn @ point for b, turn, point in zip(things, turns, points, strict=True)]
    return [(place, turn @ axis) for place, turn, axis in zip(places, turns, axes, strict=True)]


def coupling_rows(couplings: Sequence[Coupling], coordinate_count: int) -> tuple[np.ndarray, np.ndarray]:
    """Linear equations rows q = offsets that couplings impose on n coordinates q: rows (c, n) and offsets (c,)."""
    rows = np.zeros((len(couplings), coordinate_count))
    for row, coupling in zip(rows, couplings, strict=True):
        row[coupling.driven] = 1.0
        if coupling.driver is not None:
            row[coupling.driver] -= coupling.ratio
    return rows, np.array([coupling.offset for coupling in couplings])
