"""Names of the objects of a compiled MuJoCo model and of the bodies that represent its joints, and small readers of its
numbers."""

from collections.abc import Sequence

import mujoco
import numpy as np

from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, SLIDE_JOINT
from models.vehicles.spatial import FREEDOMS, Freedom, Vector

ROTATION_NAMES: tuple[Freedom, ...] = ("rx", "ry", "rz")
FREEDOMS_OF_JOINT: dict[int, tuple[Freedom, ...]] = {BALL_JOINT: ROTATION_NAMES, FREE_JOINT: FREEDOMS}
"""Freedoms of the joint types that have several."""
NAMES_SHOWN = 3
"""Largest count of names in a message."""
CONSTRAINT_FEATURES = ("EQUALITY", "FRICTIONLOSS", "LIMIT", "CONTACT")


def first_names_text(object_names: Sequence[str]) -> str:
    """Text with the first names, and how many more there are."""
    more = f" and {len(object_names) - NAMES_SHOWN} more" if len(object_names) > NAMES_SHOWN else ""
    return ", ".join(object_names[:NAMES_SHOWN]) + more


def object_label(mujoco_model: mujoco.MjModel, object_kind: str, object_index: int) -> str:
    """Text that names a joint, body, tendon, actuator or the like of a file; its number if it has no name."""
    name = object_name(mujoco_model, object_kind, object_index)
    return f"{object_kind} {name!r}" if name else f"{object_kind} {object_index}"


def object_name(mujoco_model: mujoco.MjModel, object_kind: str, object_index: int) -> str:
    """Name of an object in the file; "" if there is none."""
    return (
        mujoco.mj_id2name(mujoco_model, int(getattr(mujoco.mjtObj, f"mjOBJ_{object_kind.upper()}")), object_index) or ""
    )


def coordinate_names(mujoco_model: mujoco.MjModel) -> tuple[str, ...]:
    """Name of every coordinate: its joint and, where the joint has several freedoms, which freedom."""
    names = list[str]()
    for j in range(mujoco_model.njnt):
        of = FREEDOMS_OF_JOINT.get(int(mujoco_model.jnt_type[j]), ())
        names += [f"{object_label(mujoco_model, 'joint', j)} {freedom}" for freedom in of] or [
            object_label(mujoco_model, "joint", j)
        ]
    return tuple(names)


def coordinate_of(mujoco_model: mujoco.MjModel, joint: int) -> tuple[str, Freedom]:
    """Coordinate of a hinge or slide in the description: body and freedom."""
    return joint_body_name(joint), "x" if mujoco_model.jnt_type[joint] == SLIDE_JOINT else "rx"


def moving_bodies(mujoco_model: mujoco.MjModel) -> dict[int, None]:
    """Indices, in order, of the bodies that move: they or a body before them in the tree have a joint."""
    numbers = dict[int, None]()
    for b in range(1, mujoco_model.nbody):
        if mujoco_model.body_jntnum[b] or int(mujoco_model.body_parentid[b]) in numbers:
            numbers[b] = None
    return numbers


def joints_above(mujoco_model: mujoco.MjModel, body: int) -> list[int]:
    """Numbers of all joints that move a body, from the body to the world."""
    joints = list[int]()
    while body:
        first = int(mujoco_model.body_jntadr[body])
        joints += range(first, first + int(mujoco_model.body_jntnum[body]))
        body = int(mujoco_model.body_parentid[body])
    return joints


def feature_is_disabled(mujoco_model: mujoco.MjModel, feature: str) -> bool:
    """Whether a file switches off a feature, such as "GRAVITY", or all constraints at once."""
    kinds = (feature, "CONSTRAINT") if feature in CONSTRAINT_FEATURES else (feature,)
    return any(mujoco_model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{kind}") for kind in kinds)


def joint_body_name(joint: int) -> str:
    """Name of the massless body that represents a joint. It contains the joint's number, because joints in a file may
    have no names."""
    return f"joint {joint}"


def mass_body_name(body: int) -> str:
    """Name of the description's body that has the mass of a file's body and follows its last joint."""
    return f"body {body}"


def vector_tuple(components: np.ndarray) -> Vector:
    """Three numbers as a tuple, the form of vectors in descriptions."""
    x, y, z = np.asarray(components, float).tolist()
    return x, y, z


def matrix_rows(matrix: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """Matrix (3, 3) as a tuple of rows, the form of matrices in descriptions."""
    x, y, z = map(vector_tuple, matrix)
    return x, y, z


def rotation_matrix(quaternion: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    numbers = np.empty(9)
    mujoco.mju_quat2Mat(numbers, quaternion)
    return numbers.reshape(3, 3)
