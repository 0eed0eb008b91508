"""Bodies and joints of a spatial vehicle in MuJoCo, their masses, and their indices there.

World axes are those of ride, z up. A body has one joint per freedom, in their order. MuJoCo counts bodies and joints
from the root of a tree to its leaves: a rider may come earlier there than in the vehicle. Masses and inertias are
written into the compiled model: MuJoCo refuses bodies without inertia, even where they never turn, and tensors that
no distribution of mass has, which published vehicles contain.
"""

from collections.abc import Iterable, Mapping

import mujoco
import numpy as np

from models.vehicles.spatial import FREEDOMS, Body, SpatialVehicle

AXES = {freedom: np.eye(3)[i % 3].tolist() for i, freedom in enumerate(FREEDOMS)}
"""Unit axis of each freedom, along or about which the freedom moves a body."""
NO_CARRIERS: Mapping[str, str] = {}
"""Merged bodies (name of the carrier to name of the carried body) of a vehicle in which none are merged."""


def mujoco_specification(
    vehicle: SpatialVehicle, time_step: float, merged_carriers: Mapping[str, str] = NO_CARRIERS
) -> mujoco.MjSpec:
    """MuJoCo specification with the vehicle's bodies and joints; masses and inertias are 1 until ``set_masses`` sets
    them.

    Their names are numbers: a user's body may be called "world". merged_carriers : bodies that are merged with the
    only body that they carry, whose frame and name they get."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = [0, 0, -vehicle.gravity]
    spec.option.timestep, spec.option.integrator = time_step, mujoco.mjtIntegrator.mjINT_RK4
    off = mujoco.mjtDisableBit
    spec.option.disableflags |= off.mjDSBL_AUTORESET | off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT
    for body in (body for body in vehicle.bodies if body.name not in merged_carriers):
        joined = [part for part in vehicle.bodies if _merged_body(merged_carriers, part.name) == body.name]
        parent = joined[0].parent
        below = spec.worldbody if parent is None else spec.body(numbers[parent])
        built = below.add_body(
            name=numbers[body.name],
            pos=np.subtract(body.position, (0.0, 0.0, 0.0) if parent is None else vehicle.body(parent).position),
            ipos=[0, 0, 0],
            mass=1.0,
            iquat=principal_inertias(body)[1],
            inertia=[1.0, 1.0, 1.0],
            explicitinertial=True,
        )
        for part, freedom in ((part, freedom) for part in joined for freedom in FREEDOMS if freedom in part.freedoms):
            built.add_joint(
                name=f"{numbers[part.name]} {freedom}",
                type=mujoco.mjtJoint.mjJNT_HINGE if freedom.startswith("r") else mujoco.mjtJoint.mjJNT_SLIDE,
                axis=part.direction(freedom),
                pos=np.subtract(part.position, body.position),
            )
    return spec


def _merged_body(merged_carriers: Mapping[str, str], body_name: str) -> str:
    """Name of the body with which a body is merged in MuJoCo; the body itself if it is not merged."""
    while body_name in merged_carriers:
        body_name = merged_carriers[body_name]
    return body_name


def principal_inertias(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments of inertia (3,) of a body and the quaternion (4,) of their axes, which is the identity if there
    are no products of inertia."""
    tensor, quaternion = np.array(body.inertia, float), np.array([1.0, 0.0, 0.0, 0.0])
    if np.array_equal(tensor, np.diag(tensor.diagonal())):
        return tensor.diagonal(), quaternion
    inertias, axes = np.linalg.eigh(tensor)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return inertias, quaternion


class MujocoIndices:
    """Indices of a vehicle's bodies and coordinates in MuJoCo: ids of bodies by name, columns (n,) of the coordinates
    in the vehicle's order.

    carriers : bodies that are one there with the only one that rides on them, by its name.
    """

    def __init__(
        self, vehicle: SpatialVehicle, mujoco_model: mujoco.MjModel, merged_carriers: Mapping[str, str] = NO_CARRIERS
    ) -> None:
        order = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
        self.bodies = {name: int(mujoco_model.body(order[_merged_body(merged_carriers, name)]).id) for name in order}
        self.joints: dict[tuple[str, str], int] = {
            (name, freedom): int(mujoco_model.joint(f"{order[name]} {freedom}").id)
            for name, freedom in vehicle.coordinates()
        }
        self.columns = np.array(list(self.joints.values()))


def keep_small_turns(mujoco_model: mujoco.MjModel) -> None:
    """Make MuJoCo apply rotations and offsets of inertia and site frames that nearly coincide with the body's frame;
    its compiler ignores them, which moves a link on angles of ten digits by 1e-9."""
    for part, place in (("body", "ipos"), ("site", "pos")):
        same = getattr(mujoco_model, f"{part}_sameframe")
        turn, shift = (
            getattr(mujoco_model, f"{part}_{'i' * (part == 'body')}quat"),
            getattr(mujoco_model, f"{part}_{place}"),
        )
        same[turn[:, 1:].any(axis=1) | (shift.any(axis=1) & (same != mujoco.mjtSameFrame.mjSAMEFRAME_BODYROT))] = 0


def set_masses(mujoco_model: mujoco.MjModel, mujoco_indices: MujocoIndices, bodies: Iterable[Body]) -> None:
    """Set masses and principal inertias in a MuJoCo model; merged bodies get the sum."""
    mujoco_model.body_mass[1:] = mujoco_model.body_inertia[1:] = 0.0
    for body in bodies:
        number = mujoco_indices.bodies[body.name]
        mujoco_model.body_mass[number] += body.mass
        mujoco_model.body_inertia[number] += principal_inertias(body)[0]
    mujoco.mj_setConst(mujoco_model, mujoco.MjData(mujoco_model))
