"""Conversion of MuJoCo's compiled model to twinrig's description of a vehicle, in the design position ``qpos0``.

Every joint is a body without mass that moves along its axis, at its anchor; behind the last one of a body of the file
is a body with its mass, at its centre. What stands still with the world is left out: it moves nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from models.engines.free_vehicle import LoadedVehicle
from models.engines.native_parts import BodyLoad, DryFriction, GroundSpring, LineSpring, TurningSpring, joint_parts
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, ModelCoordinates
from models.own_model.equalities import connections, joint_couplings, stiffness_and_damping
from models.own_model.names import (
    FREEDOMS_OF_JOINT,
    coordinate_names,
    coordinate_of,
    feature_is_disabled,
    joint_body_name,
    joints_above,
    mass_body_name,
    matrix_rows,
    moving_bodies,
    object_label,
    rotation_matrix,
    vector_tuple,
)
from models.vehicles.spatial import PARALLEL, Body, Freedom, JointElement, SpatialVehicle, Vector

JOINT_TARGETS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
"""MuJoCo's kinds of actuator targets that mean the same for a hinge or slide."""
LAST_GROUP = 30


@dataclass(frozen=True, eq=False)
class TwinModel:
    """A user's model twice: as MuJoCo parsed it (``model``), without the parts that were left out, and as twinrig's
    description (``driven``)."""

    name: str
    model: mujoco.MjModel
    driven: LoadedVehicle
    coordinates: ModelCoordinates

    @property
    def size(self) -> int:
        """Number of coordinates of the model."""
        return self.coordinates.size

    @property
    def names(self) -> tuple[str, ...]:
        """Name of every coordinate: its joint and, where the joint has several freedoms, which freedom."""
        return coordinate_names(self.model)


def described_model(mujoco_model: mujoco.MjModel, file_name: str) -> TwinModel:
    """A MuJoCo model with twinrig's description of it; parts without an equivalent (see ``content``) must have been
    removed before."""
    design = mujoco.MjData(mujoco_model)
    design.qpos[:] = mujoco_model.qpos0
    mujoco.mj_kinematics(mujoco_model, design)
    elements = joint_elements(mujoco_model)
    vehicle = SpatialVehicle(file_name, tuple(_bodies(mujoco_model, design)), (), (), (), joint_elements=elements)
    gravity = np.zeros(3) if feature_is_disabled(mujoco_model, "GRAVITY") else np.array(mujoco_model.opt.gravity)
    loads = tuple(_compensated_loads(mujoco_model, design, gravity))
    lines = tuple(line_springs(mujoco_model, design))
    ties = (
        tuple(dry_frictions(mujoco_model)),
        tuple(joint_couplings(mujoco_model)),
        tuple(connections(mujoco_model, design)),
    )
    parts = joint_parts(vehicle)
    turns = tuple(turning_springs(mujoco_model, design))
    pushes = tuple(body_loads(mujoco_model, design))
    driven = LoadedVehicle(vehicle, gravity, np.zeros(1), None, None, parts, loads, lines, *ties, turns, pushes)
    return TwinModel(file_name, mujoco_model, driven, ModelCoordinates(mujoco_model, design))


def joint_elements(mujoco_model: mujoco.MjModel) -> tuple[JointElement, ...]:
    """Elements that act along joint coordinates: springs, dampers and rotors of joints and fixed tendons, and
    actuators."""
    return (*_joint_elements(mujoco_model), *_tendon_elements(mujoco_model), *_actuator_elements(mujoco_model))


def _bodies(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> Iterator[Body]:
    numbers = moving_bodies(mujoco_model)
    for b in numbers:
        above = int(mujoco_model.body_parentid[b])
        behind = mass_body_name(above) if above in numbers else None
        for j in range(mujoco_model.body_jntadr[b], mujoco_model.body_jntadr[b] + mujoco_model.body_jntnum[b]):
            yield _joint_body(mujoco_model, design_data, j, behind)
            behind = joint_body_name(j)
        axes = design_data.ximat[b].reshape(3, 3)
        inertia = matrix_rows(axes * mujoco_model.body_inertia[b] @ axes.T + _armature_inertia(mujoco_model, b))
        yield Body(
            mass_body_name(b), float(mujoco_model.body_mass[b]), vector_tuple(design_data.xipos[b]), (), inertia, behind
        )


def _joint_body(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, joint: int, parent_name: str | None) -> Body:
    """Massless body that moves as a joint of the file does."""
    kind, body = int(mujoco_model.jnt_type[joint]), int(mujoco_model.jnt_bodyid[joint])
    if kind in FREEDOMS_OF_JOINT:
        anchor = design_data.xpos[body] if kind == FREE_JOINT else design_data.xanchor[joint]
        return Body(joint_body_name(joint), 0.0, vector_tuple(anchor), FREEDOMS_OF_JOINT[kind], parent=parent_name)
    freedoms: tuple[Freedom, ...] = (coordinate_of(mujoco_model, joint)[1],)
    return Body(
        joint_body_name(joint),
        0.0,
        vector_tuple(design_data.xanchor[joint]),
        freedoms,
        parent=parent_name,
        axes=_axes_along(design_data.xaxis[joint]),
    )


def _axes_along(axis: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """Right-handed axes, as rows, of which the first is the given unit vector."""
    if tuple(axis) == PARALLEL[0]:  # a component of 1 is no proof: others below 1e-8 leave it so
        return PARALLEL
    second = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    second /= np.linalg.norm(second)
    return matrix_rows(np.array((axis, second, np.cross(axis, second))))


def _armature_inertia(mujoco_model: mujoco.MjModel, body: int) -> np.ndarray:
    """Inertia (3, 3), the same about all axes, that the armature on the rotation of a free body adds."""
    joint = int(mujoco_model.body_jntadr[body])
    free = joint >= 0 and mujoco_model.jnt_type[joint] == FREE_JOINT
    return (
        float(mujoco_model.dof_armature[mujoco_model.jnt_dofadr[joint] + 3]) * np.eye(3) if free else np.zeros((3, 3))
    )


def _joint_elements(mujoco_model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not feature_is_disabled(mujoco_model, "SPRING"), not feature_is_disabled(mujoco_model, "DAMPER")
    for j in range(mujoco_model.njnt):
        first, place = int(mujoco_model.jnt_dofadr[j]), int(mujoco_model.jnt_qposadr[j])
        free, ball = mujoco_model.jnt_type[j] == FREE_JOINT, mujoco_model.jnt_type[j] == BALL_JOINT
        freedoms: tuple[Freedom, ...] = (
            ("x", "y", "z") if free else () if ball else (coordinate_of(mujoco_model, j)[1],)
        )
        for i, freedom in enumerate(freedoms):
            stiffness = float(mujoco_model.jnt_stiffness[j]) * springs
            damping, inertia = (
                float(mujoco_model.dof_damping[first + i]) * dampers,
                float(mujoco_model.dof_armature[first + i]),
            )
            held = stiffness * float(mujoco_model.qpos0[place + i] - mujoco_model.qpos_spring[place + i])
            if stiffness or damping or inertia:
                numbers = (stiffness, damping, held, inertia)
                name = f"{object_label(mujoco_model, 'joint', j)} {freedom if free else ''}".rstrip()
                yield JointElement(name, ((joint_body_name(j), freedom),), (1.0,), *numbers)


def tendon_travel(mujoco_model: mujoco.MjModel, tendon: int) -> tuple[list[int], list[float]]:
    """Numbers of the joints of a fixed tendon, and their coefficients."""
    of = range(
        int(mujoco_model.tendon_adr[tendon]), int(mujoco_model.tendon_adr[tendon] + mujoco_model.tendon_num[tendon])
    )
    return [int(mujoco_model.wrap_objid[w]) for w in of], [float(mujoco_model.wrap_prm[w]) for w in of]


def is_fixed(mujoco_model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon is a linear combination of joints, not a path through space."""
    return bool(mujoco_model.wrap_type[mujoco_model.tendon_adr[tendon]] == mujoco.mjtWrap.mjWRAP_JOINT)


def is_line(mujoco_model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon runs straight from one site to another."""
    first, site = int(mujoco_model.tendon_adr[tendon]), mujoco.mjtWrap.mjWRAP_SITE
    return bool(mujoco_model.tendon_num[tendon] == 2 and (mujoco_model.wrap_type[first : first + 2] == site).all())


def sites_of(mujoco_model: mujoco.MjModel, tendon: int) -> list[int]:
    """Both sites of a tendon that is a line."""
    first = int(mujoco_model.tendon_adr[tendon])
    return mujoco_model.wrap_objid[first : first + 2].tolist()


def line_springs(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> Iterator[LineSpring]:
    """Springs and dampers of the tendons that run straight between two sites."""
    springs, dampers, numbers = (
        not feature_is_disabled(mujoco_model, "SPRING"),
        not feature_is_disabled(mujoco_model, "DAMPER"),
        moving_bodies(mujoco_model),
    )
    for t in (t for t in range(mujoco_model.ntendon) if is_line(mujoco_model, t)):
        stiffness, damping = (
            float(mujoco_model.tendon_stiffness[t]) * springs,
            float(mujoco_model.tendon_damping[t]) * dampers,
        )
        bodies = [int(mujoco_model.site_bodyid[s]) for s in sites_of(mujoco_model, t)]
        if (stiffness or damping) and bodies[0] != bodies[1]:
            first, second = (mass_body_name(b) if b in numbers else None for b in bodies)
            start, end = (vector_tuple(design_data.site_xpos[s]) for s in sites_of(mujoco_model, t))
            length = float(mujoco_model.tendon_lengthspring[t, 0])
            yield LineSpring(
                object_label(mujoco_model, "tendon", t), first, second, start, end, stiffness, damping, length
            )


def turning_springs(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> Iterator[TurningSpring]:
    """Rotational springs and dampers of ball and free joints; those of translation are in ``joint_elements``."""
    springs, dampers = not feature_is_disabled(mujoco_model, "SPRING"), not feature_is_disabled(mujoco_model, "DAMPER")
    for j in (j for j in range(mujoco_model.njnt) if mujoco_model.jnt_type[j] in (BALL_JOINT, FREE_JOINT)):
        body, free = int(mujoco_model.jnt_bodyid[j]), mujoco_model.jnt_type[j] == FREE_JOINT
        stiffness = float(mujoco_model.jnt_stiffness[j]) * springs
        damping = float(mujoco_model.dof_damping[mujoco_model.jnt_dofadr[j] + 3 * free]) * dampers
        if not (stiffness or damping):
            continue
        place, axes = int(mujoco_model.jnt_qposadr[j]) + 3 * free, design_data.xmat[body].reshape(3, 3).copy()
        rest = rotation_matrix(mujoco_model.qpos_spring[place : place + 4])
        yield TurningSpring(
            object_label(mujoco_model, "joint", j),
            _bodies_beside(mujoco_model, j),
            (rest if free else axes @ rest, axes),
            stiffness,
            damping,
        )


def _bodies_beside(mujoco_model: mujoco.MjModel, joint: int) -> tuple[str | None, str]:
    """Names of the bodies before and after a joint. A massless body stands between two joints of the same body."""
    body = int(mujoco_model.jnt_bodyid[joint])
    first, above = int(mujoco_model.body_jntadr[body]), int(mujoco_model.body_parentid[body])
    last = first + int(mujoco_model.body_jntnum[body]) - 1
    before = (
        joint_body_name(joint - 1)
        if joint > first
        else mass_body_name(above)
        if above in moving_bodies(mujoco_model)
        else None
    )
    return before, joint_body_name(joint) if joint < last else mass_body_name(body)


def has_dry_friction(mujoco_model: mujoco.MjModel, joint: int) -> bool:
    """Whether a hinge or slide has dry friction."""
    several = mujoco_model.jnt_type[joint] in (BALL_JOINT, FREE_JOINT)
    return bool(not several and mujoco_model.dof_frictionloss[mujoco_model.jnt_dofadr[joint]] > 0.0)


def dry_frictions(mujoco_model: mujoco.MjModel) -> Iterator[DryFriction]:
    """Dry friction of hinges and slides."""
    if feature_is_disabled(mujoco_model, "FRICTIONLOSS"):
        return
    for j in (j for j in range(mujoco_model.njnt) if has_dry_friction(mujoco_model, j)):
        first = int(mujoco_model.jnt_dofadr[j])
        softness = stiffness_and_damping(mujoco_model, mujoco_model.dof_solref[first], mujoco_model.dof_solimp[first])
        yield DryFriction(
            object_label(mujoco_model, "joint", j), first, float(mujoco_model.dof_frictionloss[first]), *softness
        )


def _along_tendon(mujoco_model: mujoco.MjModel, tendon: int) -> tuple[tuple, tuple[float, ...], float]:
    """Coordinates and factors of a fixed tendon, and its length (m) in the design position."""
    joints, factors = tendon_travel(mujoco_model, tendon)
    length = sum(
        k * float(mujoco_model.qpos0[mujoco_model.jnt_qposadr[j]]) for j, k in zip(joints, factors, strict=True)
    )
    return tuple(coordinate_of(mujoco_model, j) for j in joints), tuple(factors), length


def _tendon_elements(mujoco_model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not feature_is_disabled(mujoco_model, "SPRING"), not feature_is_disabled(mujoco_model, "DAMPER")
    for t in range(mujoco_model.ntendon):
        if not is_fixed(mujoco_model, t):
            continue
        places, factors, length = _along_tendon(mujoco_model, t)
        stiffness, damping = (
            float(mujoco_model.tendon_stiffness[t]) * springs,
            float(mujoco_model.tendon_damping[t]) * dampers,
        )
        held, inertia = (
            stiffness * (length - float(mujoco_model.tendon_lengthspring[t, 0])),
            float(mujoco_model.tendon_armature[t]),
        )
        if stiffness or damping or inertia:
            yield JointElement(
                object_label(mujoco_model, "tendon", t), places, factors, stiffness, damping, held, inertia
            )


def constant_controls(mujoco_model: mujoco.MjModel) -> np.ndarray:
    """Constant controls (nu,): 0, or for a limited control the nearest number in its range."""
    limited = mujoco_model.actuator_ctrllimited[:, None].astype(bool)
    low, high = np.where(limited, mujoco_model.actuator_ctrlrange, (-np.inf, np.inf)).T
    return np.clip(np.zeros(len(low)), low, high)


def pushes_site(mujoco_model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator acts on one site only, without a reference site; it then has no length."""
    kind, (_, other) = mujoco_model.actuator_trntype[actuator], mujoco_model.actuator_trnid[actuator]
    return bool(kind == mujoco.mjtTrn.mjTRN_SITE and other < 0)


def affine_law(mujoco_model: mujoco.MjModel, actuator: int, control_value: float) -> np.ndarray:
    """Force law of an actuator at a control, (3,): its constant force, and its coefficients of length and of speed."""
    gain = np.array(mujoco_model.actuator_gainprm[actuator, :3])
    gain[1:] *= mujoco_model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_AFFINE
    affine = mujoco_model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
    law: np.ndarray = gain * control_value + np.array(mujoco_model.actuator_biasprm[actuator, :3]) * affine
    return law


def actuator_is_on(mujoco_model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator is in no group that is switched off; MuJoCo has such switches for groups 0 to 30."""
    group = int(mujoco_model.actuator_group[actuator])
    return not (0 <= group <= LAST_GROUP and mujoco_model.opt.disableactuator & (1 << group))


def _active_actuators(mujoco_model: mujoco.MjModel) -> list[int]:
    """Numbers of the actuators that are not switched off."""
    return [
        i
        for i in range(mujoco_model.nu)
        if actuator_is_on(mujoco_model, i) and not feature_is_disabled(mujoco_model, "ACTUATION")
    ]


def body_loads(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData) -> Iterator[BodyLoad]:
    """Constant forces and moments of the actuators that act on sites."""
    constant, numbers = constant_controls(mujoco_model), moving_bodies(mujoco_model)
    for i in (i for i in _active_actuators(mujoco_model) if pushes_site(mujoco_model, i)):
        site = int(mujoco_model.actuator_trnid[i, 0])
        body, axes = int(mujoco_model.site_bodyid[site]), design_data.site_xmat[site].reshape(3, 3)
        force = affine_law(mujoco_model, i, float(constant[i]))[0]
        wrench = force * mujoco_model.actuator_gear[i].reshape(2, 3) @ axes.T
        if wrench.any() and body in numbers:
            yield BodyLoad(
                object_label(mujoco_model, "actuator", i),
                mass_body_name(body),
                vector_tuple(design_data.site_xpos[site]),
                *wrench,
            )


def _actuator_elements(mujoco_model: mujoco.MjModel) -> Iterator[JointElement]:
    """Actuator forces gain u + bias at constant controls, affine in length and speed of a joint or fixed tendon."""
    constant = constant_controls(mujoco_model)
    for i in (i for i in _active_actuators(mujoco_model) if not pushes_site(mujoco_model, i)):
        gear, target = float(mujoco_model.actuator_gear[i, 0]), int(mujoco_model.actuator_trnid[i, 0])
        if mujoco_model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_TENDON:
            places, factors, start = _along_tendon(mujoco_model, target)
        else:
            places, factors = (coordinate_of(mujoco_model, target),), (1.0,)
            start = float(mujoco_model.qpos0[mujoco_model.jnt_qposadr[target]])
        offset, slope, rate = affine_law(mujoco_model, i, float(constant[i]))
        if offset or slope or rate:
            numbers = (-slope, -rate, -(offset + slope * gear * start))
            yield JointElement(
                object_label(mujoco_model, "actuator", i), places, tuple(gear * k for k in factors), *numbers
            )


def compensation(mujoco_model: mujoco.MjModel, body: int) -> float:
    """Share of a body's weight that MuJoCo compensates, as the share of the joints above it that transmit the
    compensation; 0 for none.

    MuJoCo has it among the passive forces, which are none at all without springs and dampers, or among the forces of
    actuators where a joint says so (``actuatorgravcomp``), which are none without actuators.
    """
    passive = not (feature_is_disabled(mujoco_model, "SPRING") and feature_is_disabled(mujoco_model, "DAMPER"))
    joints = joints_above(mujoco_model, body)
    if not (mujoco_model.body_gravcomp[body] and passive and joints):
        return 0.0
    actuated = mujoco_model.nu > 0 and not feature_is_disabled(mujoco_model, "ACTUATION")
    return sum(actuated or not mujoco_model.jnt_actgravcomp[j] for j in joints) / len(joints)


def _compensated_loads(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, gravity: np.ndarray
) -> Iterator[GroundSpring]:
    """Upward loads at the centres of the bodies whose weight is compensated."""
    for b in moving_bodies(mujoco_model):
        if mujoco_model.body_mass[b] and gravity.any() and compensation(mujoco_model, b) == 1.0:
            load, still = -gravity * float(mujoco_model.body_gravcomp[b] * mujoco_model.body_mass[b]), np.zeros(3)
            point = vector_tuple(design_data.xipos[b])
            yield GroundSpring(mass_body_name(b), point, point, still, still, load)  # type: ignore[arg-type]
