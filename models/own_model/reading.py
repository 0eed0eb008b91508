"""Conversion of MuJoCo's compiled model to twinrig's description of a vehicle, in the design position ``qpos0``.

Every joint is a body without mass that moves along its axis, at its anchor; behind the last one of a body of the file
is a body with its mass, at its centre. What stands still with the world is left out: it moves nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from models.engines.free_vehicle import Driven
from models.engines.native_parts import BodyLoad, DryFriction, GroundSpring, LineSpring, TurningSpring, joint_parts
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, Coordinates
from models.own_model.equalities import connections, joint_couplings, stiffness_and_damping
from models.own_model.names import (
    FREEDOMS_OF_JOINT,
    coordinate_names,
    coordinate_of,
    feature_is_disabled,
    joint_body_name,
    joints_above,
    label,
    mass_body_name,
    matrix_rows,
    moving_bodies,
    rotation_matrix,
    vector_of,
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
    driven: Driven
    coordinates: Coordinates

    @property
    def size(self) -> int:
        """Number of coordinates of the model."""
        return self.coordinates.size

    @property
    def names(self) -> tuple[str, ...]:
        """Name of every coordinate: its joint and, where the joint has several freedoms, which freedom."""
        return coordinate_names(self.model)


def described_model(model: mujoco.MjModel, name: str) -> TwinModel:
    """A MuJoCo model with twinrig's description of it; parts without an equivalent (see ``content``) must have been
    removed before."""
    design = mujoco.MjData(model)
    design.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, design)
    elements = joint_elements(model)
    vehicle = SpatialVehicle(name, tuple(_bodies(model, design)), (), (), (), joint_elements=elements)
    gravity = np.zeros(3) if feature_is_disabled(model, "GRAVITY") else np.array(model.opt.gravity)
    loads = tuple(_compensated_loads(model, design, gravity))
    lines = tuple(line_springs(model, design))
    ties = tuple(dry_frictions(model)), tuple(joint_couplings(model)), tuple(connections(model, design))
    parts = joint_parts(vehicle)
    turns = tuple(turning_springs(model, design))
    pushes = tuple(body_loads(model, design))
    driven = Driven(vehicle, gravity, np.zeros(1), None, None, parts, loads, lines, *ties, turns, pushes)
    return TwinModel(name, model, driven, Coordinates(model, design))


def joint_elements(model: mujoco.MjModel) -> tuple[JointElement, ...]:
    """Elements that act along joint coordinates: springs, dampers and rotors of joints and fixed tendons, and
    actuators."""
    return (*_joint_elements(model), *_tendon_elements(model), *_actuator_elements(model))


def _bodies(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[Body]:
    numbers = moving_bodies(model)
    for b in numbers:
        above = int(model.body_parentid[b])
        behind = mass_body_name(above) if above in numbers else None
        for j in range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b]):
            yield _joint_body(model, design, j, behind)
            behind = joint_body_name(j)
        axes = design.ximat[b].reshape(3, 3)
        inertia = matrix_rows(axes * model.body_inertia[b] @ axes.T + _armature_inertia(model, b))
        yield Body(mass_body_name(b), float(model.body_mass[b]), vector_of(design.xipos[b]), (), inertia, behind)


def _joint_body(model: mujoco.MjModel, design: mujoco.MjData, j: int, behind: str | None) -> Body:
    """Massless body that moves as a joint of the file does."""
    kind, body = int(model.jnt_type[j]), int(model.jnt_bodyid[j])
    if kind in FREEDOMS_OF_JOINT:
        anchor = design.xpos[body] if kind == FREE_JOINT else design.xanchor[j]
        return Body(joint_body_name(j), 0.0, vector_of(anchor), FREEDOMS_OF_JOINT[kind], parent=behind)
    freedoms: tuple[Freedom, ...] = (coordinate_of(model, j)[1],)
    return Body(
        joint_body_name(j),
        0.0,
        vector_of(design.xanchor[j]),
        freedoms,
        parent=behind,
        axes=_axes_along(design.xaxis[j]),
    )


def _axes_along(axis: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """Right-handed axes, as rows, of which the first is the given unit vector."""
    if tuple(axis) == PARALLEL[0]:  # a component of 1 is no proof: others below 1e-8 leave it so
        return PARALLEL
    second = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    second /= np.linalg.norm(second)
    return matrix_rows(np.array((axis, second, np.cross(axis, second))))


def _armature_inertia(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Inertia (3, 3), the same about all axes, that the armature on the rotation of a free body adds."""
    joint = int(model.body_jntadr[body])
    free = joint >= 0 and model.jnt_type[joint] == FREE_JOINT
    return float(model.dof_armature[model.jnt_dofadr[joint] + 3]) * np.eye(3) if free else np.zeros((3, 3))


def _joint_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not feature_is_disabled(model, "SPRING"), not feature_is_disabled(model, "DAMPER")
    for j in range(model.njnt):
        first, place = int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])
        free, ball = model.jnt_type[j] == FREE_JOINT, model.jnt_type[j] == BALL_JOINT
        freedoms: tuple[Freedom, ...] = ("x", "y", "z") if free else () if ball else (coordinate_of(model, j)[1],)
        for i, freedom in enumerate(freedoms):
            stiffness = float(model.jnt_stiffness[j]) * springs
            damping, inertia = float(model.dof_damping[first + i]) * dampers, float(model.dof_armature[first + i])
            held = stiffness * float(model.qpos0[place + i] - model.qpos_spring[place + i])
            if stiffness or damping or inertia:
                numbers = (stiffness, damping, held, inertia)
                name = f"{label(model, 'joint', j)} {freedom if free else ''}".rstrip()
                yield JointElement(name, ((joint_body_name(j), freedom),), (1.0,), *numbers)


def tendon_travel(model: mujoco.MjModel, tendon: int) -> tuple[list[int], list[float]]:
    """Numbers of the joints of a fixed tendon, and their coefficients."""
    of = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    return [int(model.wrap_objid[w]) for w in of], [float(model.wrap_prm[w]) for w in of]


def is_fixed(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon is a linear combination of joints, not a path through space."""
    return bool(model.wrap_type[model.tendon_adr[tendon]] == mujoco.mjtWrap.mjWRAP_JOINT)


def is_line(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon runs straight from one site to another."""
    first, site = int(model.tendon_adr[tendon]), mujoco.mjtWrap.mjWRAP_SITE
    return bool(model.tendon_num[tendon] == 2 and (model.wrap_type[first : first + 2] == site).all())


def sites_of(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Both sites of a tendon that is a line."""
    first = int(model.tendon_adr[tendon])
    return model.wrap_objid[first : first + 2].tolist()


def line_springs(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[LineSpring]:
    """Springs and dampers of the tendons that run straight between two sites."""
    springs, dampers, numbers = (
        not feature_is_disabled(model, "SPRING"),
        not feature_is_disabled(model, "DAMPER"),
        moving_bodies(model),
    )
    for t in (t for t in range(model.ntendon) if is_line(model, t)):
        stiffness, damping = float(model.tendon_stiffness[t]) * springs, float(model.tendon_damping[t]) * dampers
        bodies = [int(model.site_bodyid[s]) for s in sites_of(model, t)]
        if (stiffness or damping) and bodies[0] != bodies[1]:
            first, second = (mass_body_name(b) if b in numbers else None for b in bodies)
            start, end = (vector_of(design.site_xpos[s]) for s in sites_of(model, t))
            length = float(model.tendon_lengthspring[t, 0])
            yield LineSpring(label(model, "tendon", t), first, second, start, end, stiffness, damping, length)


def turning_springs(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[TurningSpring]:
    """Rotational springs and dampers of ball and free joints; those of translation are in ``joint_elements``."""
    springs, dampers = not feature_is_disabled(model, "SPRING"), not feature_is_disabled(model, "DAMPER")
    for j in (j for j in range(model.njnt) if model.jnt_type[j] in (BALL_JOINT, FREE_JOINT)):
        body, free = int(model.jnt_bodyid[j]), model.jnt_type[j] == FREE_JOINT
        stiffness = float(model.jnt_stiffness[j]) * springs
        damping = float(model.dof_damping[model.jnt_dofadr[j] + 3 * free]) * dampers
        if not (stiffness or damping):
            continue
        place, axes = int(model.jnt_qposadr[j]) + 3 * free, design.xmat[body].reshape(3, 3).copy()
        rest = rotation_matrix(model.qpos_spring[place : place + 4])
        yield TurningSpring(
            label(model, "joint", j),
            _bodies_beside(model, j),
            (rest if free else axes @ rest, axes),
            stiffness,
            damping,
        )


def _bodies_beside(model: mujoco.MjModel, joint: int) -> tuple[str | None, str]:
    """Names of the bodies before and after a joint. A massless body stands between two joints of the same body."""
    body = int(model.jnt_bodyid[joint])
    first, above = int(model.body_jntadr[body]), int(model.body_parentid[body])
    last = first + int(model.body_jntnum[body]) - 1
    before = (
        joint_body_name(joint - 1)
        if joint > first
        else mass_body_name(above)
        if above in moving_bodies(model)
        else None
    )
    return before, joint_body_name(joint) if joint < last else mass_body_name(body)


def has_dry_friction(model: mujoco.MjModel, joint: int) -> bool:
    """Whether a hinge or slide has dry friction."""
    several = model.jnt_type[joint] in (BALL_JOINT, FREE_JOINT)
    return bool(not several and model.dof_frictionloss[model.jnt_dofadr[joint]] > 0.0)


def dry_frictions(model: mujoco.MjModel) -> Iterator[DryFriction]:
    """Dry friction of hinges and slides."""
    if feature_is_disabled(model, "FRICTIONLOSS"):
        return
    for j in (j for j in range(model.njnt) if has_dry_friction(model, j)):
        first = int(model.jnt_dofadr[j])
        softness = stiffness_and_damping(model, model.dof_solref[first], model.dof_solimp[first])
        yield DryFriction(label(model, "joint", j), first, float(model.dof_frictionloss[first]), *softness)


def _along_tendon(model: mujoco.MjModel, tendon: int) -> tuple[tuple, tuple[float, ...], float]:
    """Coordinates and factors of a fixed tendon, and its length (m) in the design position."""
    joints, factors = tendon_travel(model, tendon)
    length = sum(k * float(model.qpos0[model.jnt_qposadr[j]]) for j, k in zip(joints, factors, strict=True))
    return tuple(coordinate_of(model, j) for j in joints), tuple(factors), length


def _tendon_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not feature_is_disabled(model, "SPRING"), not feature_is_disabled(model, "DAMPER")
    for t in range(model.ntendon):
        if not is_fixed(model, t):
            continue
        places, factors, length = _along_tendon(model, t)
        stiffness, damping = float(model.tendon_stiffness[t]) * springs, float(model.tendon_damping[t]) * dampers
        held, inertia = stiffness * (length - float(model.tendon_lengthspring[t, 0])), float(model.tendon_armature[t])
        if stiffness or damping or inertia:
            yield JointElement(label(model, "tendon", t), places, factors, stiffness, damping, held, inertia)


def constant_controls(model: mujoco.MjModel) -> np.ndarray:
    """Constant controls (nu,): 0, or for a limited control the nearest number in its range."""
    limited = model.actuator_ctrllimited[:, None].astype(bool)
    low, high = np.where(limited, model.actuator_ctrlrange, (-np.inf, np.inf)).T
    return np.clip(np.zeros(len(low)), low, high)


def pushes_site(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator acts on one site only, without a reference site; it then has no length."""
    kind, (_, other) = model.actuator_trntype[actuator], model.actuator_trnid[actuator]
    return bool(kind == mujoco.mjtTrn.mjTRN_SITE and other < 0)


def affine_law(model: mujoco.MjModel, actuator: int, control: float) -> np.ndarray:
    """Force law of an actuator at a control, (3,): its constant force, and its coefficients of length and of speed."""
    gain = np.array(model.actuator_gainprm[actuator, :3])
    gain[1:] *= model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_AFFINE
    affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
    law: np.ndarray = gain * control + np.array(model.actuator_biasprm[actuator, :3]) * affine
    return law


def actuator_is_on(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator is in no group that is switched off; MuJoCo has such switches for groups 0 to 30."""
    group = int(model.actuator_group[actuator])
    return not (0 <= group <= LAST_GROUP and model.opt.disableactuator & (1 << group))


def _active_actuators(model: mujoco.MjModel) -> list[int]:
    """Numbers of the actuators that are not switched off."""
    return [i for i in range(model.nu) if actuator_is_on(model, i) and not feature_is_disabled(model, "ACTUATION")]


def body_loads(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[BodyLoad]:
    """Constant forces and moments of the actuators that act on sites."""
    constant, numbers = constant_controls(model), moving_bodies(model)
    for i in (i for i in _active_actuators(model) if pushes_site(model, i)):
        site = int(model.actuator_trnid[i, 0])
        body, axes = int(model.site_bodyid[site]), design.site_xmat[site].reshape(3, 3)
        force = affine_law(model, i, float(constant[i]))[0]
        wrench = force * model.actuator_gear[i].reshape(2, 3) @ axes.T
        if wrench.any() and body in numbers:
            yield BodyLoad(
                label(model, "actuator", i), mass_body_name(body), vector_of(design.site_xpos[site]), *wrench
            )


def _actuator_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    """Actuator forces gain u + bias at constant controls, affine in length and speed of a joint or fixed tendon."""
    constant = constant_controls(model)
    for i in (i for i in _active_actuators(model) if not pushes_site(model, i)):
        gear, target = float(model.actuator_gear[i, 0]), int(model.actuator_trnid[i, 0])
        if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_TENDON:
            places, factors, start = _along_tendon(model, target)
        else:
            places, factors = (coordinate_of(model, target),), (1.0,)
            start = float(model.qpos0[model.jnt_qposadr[target]])
        offset, slope, rate = affine_law(model, i, float(constant[i]))
        if offset or slope or rate:
            numbers = (-slope, -rate, -(offset + slope * gear * start))
            yield JointElement(label(model, "actuator", i), places, tuple(gear * k for k in factors), *numbers)


def compensation(model: mujoco.MjModel, body: int) -> float:
    """Share of a body's weight that MuJoCo compensates, as the share of the joints above it that transmit the
    compensation; 0 for none.

    MuJoCo has it among the passive forces, which are none at all without springs and dampers, or among the forces of
    actuators where a joint says so (``actuatorgravcomp``), which are none without actuators.
    """
    passive = not (feature_is_disabled(model, "SPRING") and feature_is_disabled(model, "DAMPER"))
    joints = joints_above(model, body)
    if not (model.body_gravcomp[body] and passive and joints):
        return 0.0
    actuated = model.nu > 0 and not feature_is_disabled(model, "ACTUATION")
    return sum(actuated or not model.jnt_actgravcomp[j] for j in joints) / len(joints)


def _compensated_loads(model: mujoco.MjModel, design: mujoco.MjData, gravity: np.ndarray) -> Iterator[GroundSpring]:
    """Upward loads at the centres of the bodies whose weight is compensated."""
    for b in moving_bodies(model):
        if model.body_mass[b] and gravity.any() and compensation(model, b) == 1.0:
            load, still = -gravity * float(model.body_gravcomp[b] * model.body_mass[b]), np.zeros(3)
            point = vector_of(design.xipos[b])
            yield GroundSpring(mass_body_name(b), point, point, still, still, load)  # type: ignore[arg-type]
