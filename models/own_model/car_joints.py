"""Roles of the joints of an MJCF car: to free the chassis, to spin or steer a wheel, or to be part of the suspension.

Whatever acts on a joint that twinrig moves itself, by the driver's steering, by brakes and drive, is left out with it.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.content import BIAS, DSBL, GAIN, JOINT_TARGETS, TRN
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, SLIDE_JOINT
from models.own_model.names import moving_bodies, object_label
from models.own_model.reading import is_fixed, tendon_travel
from models.own_model.wheel_sites import SAME_AXLE_DISTANCE, WheelSite, site_text
from models.own_model.xml_guard import ModelXml
from models.vehicles.spatial import FREEDOMS, Freedom

PARALLEL_TOLERANCE = 1e-9
"""Largest component of a unit axis perpendicular to the vehicle axis to which it is parallel."""
NEGLIGIBLE_MASS = 1e-6
"""Mass (kg) below which a body counts as a mere carrier of joints."""


@dataclass(frozen=True)
class JointRoles:
    """Roles of the joints of a car. chassis : numbers of its bodies; spin, steer : for each joint that spins or steers
    a wheel, the site of that wheel."""

    chassis: tuple[int, ...]
    spin: dict[int, WheelSite]
    steer: dict[int, WheelSite]


def joints_of(mujoco_model: mujoco.MjModel, body: int) -> range:
    """Numbers of the joints of a body, from the ground outwards."""
    first = int(mujoco_model.body_jntadr[body])
    return range(first, first + int(mujoco_model.body_jntnum[body]))


def freedom_of(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, joint: int) -> tuple[Freedom, float] | None:
    """A hinge or slide as a freedom in the vehicle's axes, and the sign of its axis; None where its axis is not
    parallel to one of the vehicle's."""
    axis, kind = design_data.xaxis[joint], int(mujoco_model.jnt_type[joint])
    along = int(np.abs(axis).argmax())
    if kind in (FREE_JOINT, BALL_JOINT) or np.abs(np.delete(axis, along)).max() > PARALLEL_TOLERANCE:
        return None
    return FREEDOMS[along + (0 if kind == SLIDE_JOINT else 3)], float(np.sign(axis[along]))


def roles_of(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, wheels: tuple[WheelSite, ...], model_xml: ModelXml
) -> JointRoles:
    """Roles of all joints of a car. Raises InputError where no chassis is free, or a wheel turns in a way that twinrig
    does not have."""
    chassis = _chassis_bodies(mujoco_model, design_data, model_xml)
    spin, steer = dict[int, WheelSite](), dict[int, WheelSite]()
    for wheel in wheels:
        if (spins := _spin_hinge(mujoco_model, design_data, wheel, model_xml)) is not None:
            spin[spins] = wheel
        for joint in _joints_to_ground(mujoco_model, wheel.body, chassis):
            if (freedom := freedom_of(mujoco_model, design_data, joint)) is not None and freedom[0] == "rz":
                _check_steering(mujoco_model, design_data, joint, wheel, model_xml)
                steer[joint] = wheel
    return JointRoles(chassis, spin, steer)


def joint_text(mujoco_model: mujoco.MjModel, model_xml: ModelXml, joint: int) -> str:
    """Text by which messages name a joint."""
    line = model_xml.line(("joint", "freejoint"), mujoco_model.joint(joint).name)
    return object_label(mujoco_model, "joint", joint) + (f" ({line})" if line else "")


def _chassis_bodies(mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, model_xml: ModelXml) -> tuple[int, ...]:
    """Numbers of the bodies from the ground to the one that completes all six freedoms of the chassis; those before it
    are almost massless."""
    numbers, name = moving_bodies(mujoco_model), model_xml.path.name
    roots = [b for b in numbers if int(mujoco_model.body_parentid[b]) not in numbers]
    if len(roots) > 1:
        names = tuple(mujoco_model.body(b).name for b in roots)
        raise InputError(name, "worldbody", names, "a vehicle is one tree: all that moves must ride on one chassis")
    bodies, freedoms, body = list[int](), list[Freedom](), roots[0]
    while True:
        bodies.append(body)
        for joint in joints_of(mujoco_model, body):
            known = freedom_of(mujoco_model, design_data, joint)
            free = mujoco_model.jnt_type[joint] == FREE_JOINT
            freedoms += FREEDOMS if free else [] if known is None else [known[0]]
        if len(freedoms) >= len(FREEDOMS):
            break
        riders = [b for b in numbers if int(mujoco_model.body_parentid[b]) == body]
        if len(riders) != 1 or mujoco_model.body_mass[body] > NEGLIGIBLE_MASS:
            break
        body = riders[0]
    if sorted(freedoms) != sorted(FREEDOMS):
        said = "the chassis must be free: give it a <freejoint/>, or three slides and three hinges along x, y and z"
        raise InputError(name, object_label(mujoco_model, "body", body), None, said)
    _check_without_forces(
        mujoco_model, [j for b in bodies for j in joints_of(mujoco_model, b)], model_xml, "the chassis"
    )
    return tuple(bodies)


def _joints_to_ground(mujoco_model: mujoco.MjModel, body: int, chassis: tuple[int, ...]) -> list[int]:
    """Joints on the path from the chassis to a body, including the body's own."""
    joints = list[int]()
    while body not in chassis and body:
        joints += joints_of(mujoco_model, body)
        body = int(mujoco_model.body_parentid[body])
    return joints


def _spin_hinge(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, wheel: WheelSite, model_xml: ModelXml
) -> int | None:
    """Number of the hinge about y through a wheel's centre, on the wheel's body or on a body that it carries; None if
    there is none."""
    bodies = [
        wheel.body,
        *(b for b in range(1, mujoco_model.nbody) if int(mujoco_model.body_parentid[b]) == wheel.body),
    ]
    spins = []
    for joint in (j for b in bodies for j in joints_of(mujoco_model, b)):
        known, beside = freedom_of(mujoco_model, design_data, joint), (design_data.xanchor[joint] - wheel.point)[[0, 2]]
        if known is not None and known[0] == "ry" and np.abs(beside).max() <= SAME_AXLE_DISTANCE:
            spins.append(joint)
    if len(spins) > 1:
        names = [mujoco_model.joint(j).name for j in spins]
        raise InputError(
            model_xml.path.name, site_text(mujoco_model, model_xml, wheel.site), names, "two joints spin this wheel"
        )
    _check_without_forces(mujoco_model, spins, model_xml, "a wheel's spin")
    return spins[0] if spins else None


def _check_without_forces(
    mujoco_model: mujoco.MjModel, joints: list[int], model_xml: ModelXml, owner_text: str
) -> None:
    """Refuse springs, dampers, rotors and dry friction on joints that twinrig models in another way."""
    for joint in joints:
        first = int(mujoco_model.jnt_dofadr[joint])
        freedoms = slice(first, first + (6 if mujoco_model.jnt_type[joint] == FREE_JOINT else 1))
        laws = {
            "stiffness": mujoco_model.jnt_stiffness[joint],
            "damping": mujoco_model.dof_damping[freedoms].max(),
            "armature": mujoco_model.dof_armature[freedoms].max(),
            "frictionloss": mujoco_model.dof_frictionloss[freedoms].max(),
        }
        for law, value in laws.items():
            if value:
                where = f"{joint_text(mujoco_model, model_xml, joint)} {law}"
                raise InputError(
                    model_xml.path.name, where, float(value), f"must be 0: {owner_text} has none in a vehicle"
                )


def _check_steering(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, joint: int, wheel: WheelSite, model_xml: ModelXml
) -> None:
    """Refuse steering other than that of the front wheels about the vertical through their centres."""
    beside = round(float(np.linalg.norm((design_data.xanchor[joint] - wheel.point)[:2])), 9)
    where = joint_text(mujoco_model, model_xml, joint)
    if wheel.axle:
        raise InputError(
            model_xml.path.name, where, "rz", f"steers {wheel.name!r}: only wheels of the front axle steer"
        )
    if beside > SAME_AXLE_DISTANCE:
        said = f"m beside the centre of {wheel.name!r}: front wheels steer about the vertical through their centres"
        raise InputError(model_xml.path.name, where, beside, said)


def remove_elements_on(mujoco_model: mujoco.MjModel, roles: JointRoles) -> list[str]:
    """Remove from the model all elements that act on the joints for spin or steering; returns their names."""
    moved, names = {*roles.spin, *roles.steer}, list[str]()
    for joint in roles.steer:
        first = int(mujoco_model.jnt_dofadr[joint])
        mujoco_model.jnt_stiffness[joint] = mujoco_model.dof_damping[first] = mujoco_model.dof_armature[first] = 0.0
        mujoco_model.dof_frictionloss[first] = mujoco_model.jnt_stiffnesspoly[joint] = mujoco_model.dof_dampingpoly[
            first
        ] = 0.0
    for joint in moved:
        mujoco_model.jnt_actfrclimited[joint] = mujoco_model.jnt_limited[joint] = 0
    tendons = {
        t
        for t in range(mujoco_model.ntendon)
        if is_fixed(mujoco_model, t) and moved.issuperset(tendon_travel(mujoco_model, t)[0])
    }
    for t in tendons:
        mujoco_model.tendon_stiffness[t] = mujoco_model.tendon_damping[t] = mujoco_model.tendon_armature[t] = 0.0
        mujoco_model.tendon_frictionloss[t] = mujoco_model.tendon_limited[t] = mujoco_model.tendon_actfrclimited[t] = 0
        names.append(object_label(mujoco_model, "tendon", t))
    names += _forget_actuators(mujoco_model, moved, tendons)
    if not mujoco_model.opt.disableflags & int(DSBL.mjDSBL_EQUALITY):
        names += _forget_equalities(mujoco_model, moved, tendons)
    return names


def _forget_actuators(mujoco_model: mujoco.MjModel, joints: set[int], tendons: set[int]) -> list[str]:
    """Switch off the actuators on these joints and tendons; returns their names."""
    names = list[str]()
    for i in range(mujoco_model.nu):
        kind, target = int(mujoco_model.actuator_trntype[i]), int(mujoco_model.actuator_trnid[i, 0])
        if (kind in JOINT_TARGETS and target in joints) or (kind == TRN.mjTRN_TENDON and target in tendons):
            mujoco_model.actuator_gaintype[i], mujoco_model.actuator_biastype[i] = GAIN.mjGAIN_FIXED, BIAS.mjBIAS_NONE
            mujoco_model.actuator_dyntype[i], mujoco_model.actuator_delay[i] = mujoco.mjtDyn.mjDYN_NONE, 0.0
            mujoco_model.actuator_gainprm[i], mujoco_model.actuator_biasprm[i], mujoco_model.actuator_dampingpoly[i] = (
                0.0,
                0.0,
                0.0,
            )
            mujoco_model.actuator_damping[i] = mujoco_model.actuator_armature[i] = mujoco_model.actuator_forcelimited[
                i
            ] = 0
            names.append(object_label(mujoco_model, "actuator", i))
    return names


def _forget_equalities(mujoco_model: mujoco.MjModel, joints: set[int], tendons: set[int]) -> list[str]:
    """Switch off the constraints that couple only these joints or tendons; returns their names."""
    names, kinds = list[str](), mujoco.mjtEq
    for e in np.flatnonzero(mujoco_model.eq_active0).tolist():
        pair = {int(mujoco_model.eq_obj1id[e]), int(mujoco_model.eq_obj2id[e])} - {-1}
        of = {int(kinds.mjEQ_JOINT): joints, int(kinds.mjEQ_TENDON): tendons}.get(
            int(mujoco_model.eq_type[e]), set[int]()
        )
        if pair <= of:
            mujoco_model.eq_active0[e] = 0
            names.append(object_label(mujoco_model, "equality", e))
    return names
