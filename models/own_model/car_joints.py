"""Roles of the joints of an MJCF car: to free the chassis, to spin or steer a wheel, or to be part of the suspension.

Whatever acts on a joint that twinrig moves itself, by the driver's steering, by brakes and drive, is left out with it.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.content import BIAS, DSBL, GAIN, JOINT_TARGETS, TRN
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, SLIDE_JOINT
from models.own_model.names import label, moving_bodies
from models.own_model.reading import is_fixed, tendon_travel
from models.own_model.wheel_sites import SAME_AXLE_DISTANCE, WheelSite, site_text
from models.own_model.xml_guard import Document
from models.vehicles.spatial import FREEDOMS, Freedom

PARALLEL_TOLERANCE = 1e-9
"""Largest component of a unit axis perpendicular to the vehicle axis to which it is parallel."""
NEGLIGIBLE_MASS = 1e-6
"""Mass (kg) below which a body counts as a mere carrier of joints."""


@dataclass(frozen=True)
class Roles:
    """Roles of the joints of a car. chassis : numbers of its bodies; spin, steer : for each joint that spins or steers
    a wheel, the site of that wheel."""

    chassis: tuple[int, ...]
    spin: dict[int, WheelSite]
    steer: dict[int, WheelSite]


def joints_of(model: mujoco.MjModel, body: int) -> range:
    """Numbers of the joints of a body, from the ground outwards."""
    first = int(model.body_jntadr[body])
    return range(first, first + int(model.body_jntnum[body]))


def freedom_of(model: mujoco.MjModel, design: mujoco.MjData, joint: int) -> tuple[Freedom, float] | None:
    """A hinge or slide as a freedom in the vehicle's axes, and the sign of its axis; None where its axis is not
    parallel to one of the vehicle's."""
    axis, kind = design.xaxis[joint], int(model.jnt_type[joint])
    along = int(np.abs(axis).argmax())
    if kind in (FREE_JOINT, BALL_JOINT) or np.abs(np.delete(axis, along)).max() > PARALLEL_TOLERANCE:
        return None
    return FREEDOMS[along + (0 if kind == SLIDE_JOINT else 3)], float(np.sign(axis[along]))


def roles_of(model: mujoco.MjModel, design: mujoco.MjData, wheels: tuple[WheelSite, ...], document: Document) -> Roles:
    """Roles of all joints of a car. Raises InputError where no chassis is free, or a wheel turns in a way that twinrig
    does not have."""
    chassis = _chassis_bodies(model, design, document)
    spin, steer = dict[int, WheelSite](), dict[int, WheelSite]()
    for wheel in wheels:
        if (spins := _spin_hinge(model, design, wheel, document)) is not None:
            spin[spins] = wheel
        for joint in _joints_to_ground(model, wheel.body, chassis):
            if (freedom := freedom_of(model, design, joint)) is not None and freedom[0] == "rz":
                _check_steering(model, design, joint, wheel, document)
                steer[joint] = wheel
    return Roles(chassis, spin, steer)


def joint_text(model: mujoco.MjModel, document: Document, joint: int) -> str:
    """Text by which messages name a joint."""
    line = document.line(("joint", "freejoint"), model.joint(joint).name)
    return label(model, "joint", joint) + (f" ({line})" if line else "")


def _chassis_bodies(model: mujoco.MjModel, design: mujoco.MjData, document: Document) -> tuple[int, ...]:
    """Numbers of the bodies from the ground to the one that completes all six freedoms of the chassis; those before it
    are almost massless."""
    numbers, name = moving_bodies(model), document.path.name
    roots = [b for b in numbers if int(model.body_parentid[b]) not in numbers]
    if len(roots) > 1:
        names = tuple(model.body(b).name for b in roots)
        raise InputError(name, "worldbody", names, "a vehicle is one tree: all that moves must ride on one chassis")
    bodies, freedoms, body = list[int](), list[Freedom](), roots[0]
    while True:
        bodies.append(body)
        for joint in joints_of(model, body):
            known = freedom_of(model, design, joint)
            free = model.jnt_type[joint] == FREE_JOINT
            freedoms += FREEDOMS if free else [] if known is None else [known[0]]
        if len(freedoms) >= len(FREEDOMS):
            break
        riders = [b for b in numbers if int(model.body_parentid[b]) == body]
        if len(riders) != 1 or model.body_mass[body] > NEGLIGIBLE_MASS:
            break
        body = riders[0]
    if sorted(freedoms) != sorted(FREEDOMS):
        said = "the chassis must be free: give it a <freejoint/>, or three slides and three hinges along x, y and z"
        raise InputError(name, label(model, "body", body), None, said)
    _check_without_forces(model, [j for b in bodies for j in joints_of(model, b)], document, "the chassis")
    return tuple(bodies)


def _joints_to_ground(model: mujoco.MjModel, body: int, chassis: tuple[int, ...]) -> list[int]:
    """Joints on the path from the chassis to a body, including the body's own."""
    joints = list[int]()
    while body not in chassis and body:
        joints += joints_of(model, body)
        body = int(model.body_parentid[body])
    return joints


def _spin_hinge(model: mujoco.MjModel, design: mujoco.MjData, wheel: WheelSite, document: Document) -> int | None:
    """Number of the hinge about y through a wheel's centre, on the wheel's body or on a body that it carries; None if
    there is none."""
    bodies = [wheel.body, *(b for b in range(1, model.nbody) if int(model.body_parentid[b]) == wheel.body)]
    spins = []
    for joint in (j for b in bodies for j in joints_of(model, b)):
        known, beside = freedom_of(model, design, joint), (design.xanchor[joint] - wheel.point)[[0, 2]]
        if known is not None and known[0] == "ry" and np.abs(beside).max() <= SAME_AXLE_DISTANCE:
            spins.append(joint)
    if len(spins) > 1:
        names = [model.joint(j).name for j in spins]
        raise InputError(
            document.path.name, site_text(model, document, wheel.site), names, "two joints spin this wheel"
        )
    _check_without_forces(model, spins, document, "a wheel's spin")
    return spins[0] if spins else None


def _check_without_forces(model: mujoco.MjModel, joints: list[int], document: Document, owner: str) -> None:
    """Refuse springs, dampers, rotors and dry friction on joints that twinrig models in another way."""
    for joint in joints:
        first = int(model.jnt_dofadr[joint])
        freedoms = slice(first, first + (6 if model.jnt_type[joint] == FREE_JOINT else 1))
        laws = {
            "stiffness": model.jnt_stiffness[joint],
            "damping": model.dof_damping[freedoms].max(),
            "armature": model.dof_armature[freedoms].max(),
            "frictionloss": model.dof_frictionloss[freedoms].max(),
        }
        for law, value in laws.items():
            if value:
                where = f"{joint_text(model, document, joint)} {law}"
                raise InputError(document.path.name, where, float(value), f"must be 0: {owner} has none in a vehicle")


def _check_steering(
    model: mujoco.MjModel, design: mujoco.MjData, joint: int, wheel: WheelSite, document: Document
) -> None:
    """Refuse steering other than that of the front wheels about the vertical through their centres."""
    beside = round(float(np.linalg.norm((design.xanchor[joint] - wheel.point)[:2])), 9)
    where = joint_text(model, document, joint)
    if wheel.axle:
        raise InputError(document.path.name, where, "rz", f"steers {wheel.name!r}: only wheels of the front axle steer")
    if beside > SAME_AXLE_DISTANCE:
        said = f"m beside the centre of {wheel.name!r}: front wheels steer about the vertical through their centres"
        raise InputError(document.path.name, where, beside, said)


def remove_elements_on(model: mujoco.MjModel, roles: Roles) -> list[str]:
    """Remove from the model all elements that act on the joints for spin or steering; returns their names."""
    moved, names = {*roles.spin, *roles.steer}, list[str]()
    for joint in roles.steer:
        first = int(model.jnt_dofadr[joint])
        model.jnt_stiffness[joint] = model.dof_damping[first] = model.dof_armature[first] = 0.0
        model.dof_frictionloss[first] = model.jnt_stiffnesspoly[joint] = model.dof_dampingpoly[first] = 0.0
    for joint in moved:
        model.jnt_actfrclimited[joint] = model.jnt_limited[joint] = 0
    tendons = {t for t in range(model.ntendon) if is_fixed(model, t) and moved.issuperset(tendon_travel(model, t)[0])}
    for t in tendons:
        model.tendon_stiffness[t] = model.tendon_damping[t] = model.tendon_armature[t] = 0.0
        model.tendon_frictionloss[t] = model.tendon_limited[t] = model.tendon_actfrclimited[t] = 0
        names.append(label(model, "tendon", t))
    names += _forget_actuators(model, moved, tendons)
    if not model.opt.disableflags & int(DSBL.mjDSBL_EQUALITY):
        names += _forget_equalities(model, moved, tendons)
    return names


def _forget_actuators(model: mujoco.MjModel, joints: set[int], tendons: set[int]) -> list[str]:
    """Switch off the actuators on these joints and tendons; returns their names."""
    names = list[str]()
    for i in range(model.nu):
        kind, target = int(model.actuator_trntype[i]), int(model.actuator_trnid[i, 0])
        if (kind in JOINT_TARGETS and target in joints) or (kind == TRN.mjTRN_TENDON and target in tendons):
            model.actuator_gaintype[i], model.actuator_biastype[i] = GAIN.mjGAIN_FIXED, BIAS.mjBIAS_NONE
            model.actuator_dyntype[i], model.actuator_delay[i] = mujoco.mjtDyn.mjDYN_NONE, 0.0
            model.actuator_gainprm[i], model.actuator_biasprm[i], model.actuator_dampingpoly[i] = 0.0, 0.0, 0.0
            model.actuator_damping[i] = model.actuator_armature[i] = model.actuator_forcelimited[i] = 0
            names.append(label(model, "actuator", i))
    return names


def _forget_equalities(model: mujoco.MjModel, joints: set[int], tendons: set[int]) -> list[str]:
    """Switch off the constraints that couple only these joints or tendons; returns their names."""
    names, kinds = list[str](), mujoco.mjtEq
    for e in np.flatnonzero(model.eq_active0).tolist():
        pair = {int(model.eq_obj1id[e]), int(model.eq_obj2id[e])} - {-1}
        of = {int(kinds.mjEQ_JOINT): joints, int(kinds.mjEQ_TENDON): tendons}.get(int(model.eq_type[e]), set[int]())
        if pair <= of:
            model.eq_active0[e] = 0
            names.append(label(model, "equality", e))
    return names
