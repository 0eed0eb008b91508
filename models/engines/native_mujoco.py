"""Springs, dampers, mounts and bars as MuJoCo's native elements: fixed tendons and site actuators.

A travel that is a sum of coordinates is the length of a fixed tendon with its own spring and damper. A travel along an
axis that is fixed in a body is that of a site beside a reference site on this body, exact because the body carries the
site: MuJoCo leaves out the coordinates that move both. Actuators act there whose force is affine in length and speed;
a curve has one more for each corner, whose force range cuts it off at 0 on one side.

Names of tendons and actuators end in that of the element. What MuJoCo's compiler would take for something else (a
spring length below 0, a positive damping for a ratio) is written into the compiled model.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from models.engines.native_parts import (
    AxialTravel,
    BodyLoad,
    Connection,
    CoordinateTravel,
    Coupling,
    DryFriction,
    GroundSpring,
    LineSpring,
    NativePart,
    TurningSpring,
)
from models.vehicles.cut_vehicle import CutVehicleElement
from models.vehicles.spatial import Curve, SpatialVehicle, Vector

UNLIMITED_FORCE = 1e300
"""Force range (N) of an actuator that limits nothing."""
ROTOR_PREFIX = "rotor "
"""Beginning of the names of tendons that have inertia alone."""
LINE_SPRING_PREFIX = "line "
"""Beginning of the names of tendons along the line between two points."""
SOLVER_TOLERANCE = 1e-15
"""Relative residual of constraints at which MuJoCo's solver stops; its default, 1e-8, is visible in accelerations of
joints with little inertia."""
NAME_SEPARATOR = ": "
"""Separator between the number of a tendon or an actuator and its element's name."""


class AffineForce(NamedTuple):
    """A force (N) constant + slope L + damping L' of a length L (m) and its rate L', limited to a range; slope in N/m,
    damping in N s/m."""

    constant: float = 0.0
    slope: float = 0.0
    damping: float = 0.0
    low: float = -UNLIMITED_FORCE
    high: float = UNLIMITED_FORCE


def end_bodies(native_parts: Sequence[NativePart]) -> set[str]:
    """Names of bodies that carry sites of the parts, so that MuJoCo must not merge them with the bodies that they
    carry."""
    axial = [part.travel for part in native_parts if isinstance(part.travel, AxialTravel)]
    return {name for travel in axial for name in (travel.frame, travel.body)}


def add_parts(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, native_parts: Sequence[NativePart]) -> None:
    """Add tendons, sites and actuators for native parts to a specification of ``mujoco_tree.mujoco_specification``;
    ``set_laws`` sets their values.
    """
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for i, part in enumerate(native_parts):
        travel, name = part.travel, f"{i}{NAME_SEPARATOR}{part.element.name}"
        if isinstance(travel, CoordinateTravel):
            tendon = mujoco_spec.add_tendon(name=name)
            for coordinate, factor in zip(travel.coordinates, travel.factors, strict=True):
                tendon.wrap_joint(joints[coordinate], factor)
            of = {"trntype": mujoco.mjtTrn.mjTRN_TENDON, "target": name}
        else:
            for end, body, place in (("foot", travel.frame, travel.foot), ("tip", travel.body, travel.tip)):
                mujoco_spec.body(numbers[body]).add_site(name=f"{end} {i}", pos=place - vehicle.body(body).position)
            of = {"trntype": mujoco.mjtTrn.mjTRN_SITE, "target": f"tip {i}", "refsite": f"foot {i}"}
            of["gear"] = [*travel.axis, 0.0, 0.0, 0.0]
        for k, _ in enumerate(affine_forces(part)):
            actuator = mujoco_spec.add_actuator(name=f"{i}.{k}{NAME_SEPARATOR}{part.element.name}", **of)
            actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE


def add_rotors(
    mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, rotors: Sequence[tuple[str, CoordinateTravel, float]]
) -> None:
    """Add tendons for inertias along sums of coordinates to a specification; ``set_rotors`` sets their values."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for i, (name, travel, _) in enumerate(rotors):
        tendon = mujoco_spec.add_tendon(name=f"{ROTOR_PREFIX}{i}{NAME_SEPARATOR}{name}")
        for coordinate, factor in zip(travel.coordinates, travel.factors, strict=True):
            tendon.wrap_joint(joints[coordinate], factor)


def set_rotors(mujoco_model: mujoco.MjModel, rotors: Sequence[tuple[str, CoordinateTravel, float]]) -> None:
    """Write the inertias (kg, kg m^2) along sums of coordinates into the compiled MuJoCo model."""
    for i, (name, _, inertia) in enumerate(rotors):
        mujoco_model.tendon_armature[mujoco_model.tendon(f"{ROTOR_PREFIX}{i}{NAME_SEPARATOR}{name}").id] = inertia


def add_ground_spring(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, ground_spring: GroundSpring) -> None:
    """Add an actuator along each axis of space in which a ground spring acts, between sites on the body and on the
    ground."""
    number = len(mujoco_spec.sites)
    tip, foot = f"ground spring {number}", f"ground {number}"
    _add_site(mujoco_spec, vehicle, tip, ground_spring.body, ground_spring.point)
    _add_site(mujoco_spec, vehicle, foot, None, ground_spring.anchor)
    for i, load in enumerate(ground_spring.load):
        if ground_spring.stiffness[i] or ground_spring.damping[i] or load:
            strut = mujoco_spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=tip, refsite=foot)
            strut.gear[:], strut.gainprm[0], strut.biastype = np.eye(6)[i], 0.0, mujoco.mjtBias.mjBIAS_AFFINE
            strut.biasprm[:3] = load, -ground_spring.stiffness[i], -ground_spring.damping[i]


def add_line_spring(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, line_spring: LineSpring) -> None:
    """Add a spatial tendon between two sites; ``set_line_springs`` sets its stiffness, damping and length."""
    number, tendon = len(mujoco_spec.sites), mujoco_spec.add_tendon(name=f"{LINE_SPRING_PREFIX}{line_spring.name}")
    for i, end in enumerate(line_spring.ends):
        site = f"end {number + i}"
        _add_site(mujoco_spec, vehicle, site, *end)
        tendon.wrap_site(site)


def add_constraints(
    mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, frictions: Sequence[DryFriction], couplings: Sequence[Coupling]
) -> None:
    """Add dry friction of joints, and equality constraints between joints; MuJoCo makes both soft."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for friction in frictions:
        joint = mujoco_spec.joint(joints[friction.coordinate])
        joint.frictionloss = friction.force
        joint.solref_friction[:], joint.solimp_friction[:] = friction.solref, friction.solimp
    for coupling in couplings:
        equality = mujoco_spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=joints[coupling.driven])
        if coupling.driver is not None:
            equality.name2 = joints[coupling.driver]
        equality.data[:2] = coupling.offset, coupling.ratio
        equality.solref[:], equality.solimp[:] = coupling.solref, coupling.solimp
    if frictions or couplings:
        _allow_constraints(mujoco_spec)


def _allow_constraints(mujoco_spec: mujoco.MjSpec) -> None:
    """Switch MuJoCo's constraint solver on, with a tight tolerance."""
    mujoco_spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    mujoco_spec.option.tolerance = SOLVER_TOLERANCE


def add_connection(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, connection: Connection) -> None:
    """Add a soft equality constraint between two sites: of their positions, or of their positions and axes."""
    axes = connection.axes or (np.eye(3), np.eye(3))
    first = len(mujoco_spec.sites)
    for i, ((body, point), columns) in enumerate(zip(connection.ends, axes, strict=True)):
        _add_site(mujoco_spec, vehicle, f"joint {first + i}", body, point).quat = _quaternion(columns)
    kinds, turns = mujoco.mjtEq, connection.axes is not None
    equality = mujoco_spec.add_equality(
        type=kinds.mjEQ_WELD if turns else kinds.mjEQ_CONNECT,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=f"joint {first}",
        name2=f"joint {first + 1}",
    )
    equality.data[10] = connection.torque_scale
    equality.solref[:], equality.solimp[:] = connection.solref, connection.solimp
    _allow_constraints(mujoco_spec)


def add_body_load(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, body_load: BodyLoad) -> None:
    """Add an actuator that applies a constant force and moment at a site of a body and turns with it."""
    site = f"load {len(mujoco_spec.sites)}"
    _add_site(mujoco_spec, vehicle, site, body_load.body, body_load.point)
    push = mujoco_spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=site)
    push.gear[:], push.gainprm[0], push.biastype = (
        (*body_load.force, *body_load.moment),
        0.0,
        mujoco.mjtBias.mjBIAS_AFFINE,
    )
    push.biasprm[0] = 1.0


def add_turning_spring(mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, turning_spring: TurningSpring) -> None:
    """Add an actuator about each axis of a site on the first body; its length is the rotation vector's component along
    this axis."""
    number = len(mujoco_spec.sites)
    foot, tip = f"turn {number}", f"turn {number + 1}"
    for name, body, axes in zip((foot, tip), turning_spring.bodies, turning_spring.axes, strict=True):
        place = (0.0, 0.0, 0.0) if body is None else vehicle.body(body).position
        _add_site(mujoco_spec, vehicle, name, body, place).quat = _quaternion(axes)
    for gear in np.eye(6)[3:]:
        twist = mujoco_spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=tip, refsite=foot)
        twist.gear[:], twist.gainprm[0], twist.biastype = gear, 0.0, mujoco.mjtBias.mjBIAS_AFFINE
        twist.biasprm[1:3] = -turning_spring.stiffness, -turning_spring.damping


def _quaternion(axes: np.ndarray) -> np.ndarray:
    """Quaternion (4,) of a frame whose axes (3, 3) are columns."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return quaternion


def _add_site(
    mujoco_spec: mujoco.MjSpec, vehicle: SpatialVehicle, site_name: str, body: str | None, point: Vector
) -> Any:
    """Add a site to a body (None: the ground) at a point (m) of the design position."""
    if body is None:
        return mujoco_spec.worldbody.add_site(name=site_name, pos=point)
    number = [each.name for each in vehicle.bodies].index(body)
    return mujoco_spec.body(str(number)).add_site(name=site_name, pos=np.subtract(point, vehicle.body(body).position))


def set_line_springs(mujoco_model: mujoco.MjModel, line_springs: Sequence[LineSpring]) -> None:
    """Write stiffness, damping and free length of the line springs into the compiled MuJoCo model."""
    for spring in line_springs:
        tendon = mujoco_model.tendon(f"{LINE_SPRING_PREFIX}{spring.name}").id
        mujoco_model.tendon_stiffness[tendon], mujoco_model.tendon_damping[tendon] = spring.stiffness, spring.damping
        mujoco_model.tendon_lengthspring[tendon] = spring.length


def set_laws(mujoco_model: mujoco.MjModel, native_parts: Sequence[NativePart]) -> None:
    """Write stiffness, damping, preload and curves of all native parts into the compiled MuJoCo model."""
    mujoco_model.actuator_gainprm[:] = 0.0
    for i, part in enumerate(native_parts):
        element = part.element
        if isinstance(part.travel, CoordinateTravel):
            tendon = mujoco_model.tendon(f"{i}{NAME_SEPARATOR}{element.name}").id
            mujoco_model.tendon_stiffness[tendon], mujoco_model.tendon_damping[tendon] = (
                element.stiffness,
                element.damping,
            )
            mujoco_model.tendon_lengthspring[tendon] = (
                -element.preload / element.stiffness if element.stiffness else 0.0
            )
        for k, force in enumerate(affine_forces(part)):
            actuator = mujoco_model.actuator(f"{i}.{k}{NAME_SEPARATOR}{element.name}").id
            mujoco_model.actuator_biasprm[actuator, :3] = force[:3]
            mujoco_model.actuator_forcelimited[actuator] = (force.low, force.high) != (
                -UNLIMITED_FORCE,
                UNLIMITED_FORCE,
            )
            mujoco_model.actuator_forcerange[actuator] = force.low, force.high


def built_elements(mujoco_model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the elements that have a tendon or an actuator in a MuJoCo model, each once."""
    tendons = [mujoco_model.tendon(i).name for i in range(mujoco_model.ntendon)]
    actuators = [mujoco_model.actuator(i).name for i in range(mujoco_model.nu)]
    return tuple(dict.fromkeys(name.split(NAME_SEPARATOR, 1)[1] for name in (*tendons, *actuators)))


def affine_forces(native_part: NativePart) -> list[AffineForce]:
    """Forces of actuators on the length L of a part, beyond the force of the tendon's own spring, with d = L less its
    design value.

    They draw it together: where the element presses with F, they are -F.
    """
    axial, e = isinstance(native_part.travel, AxialTravel), native_part.element
    design = native_part.travel.design if isinstance(native_part.travel, AxialTravel) else 0.0
    stiffness, damping = (e.stiffness, e.damping) if axial else (0.0, 0.0)
    preload = e.preload if axial or not e.stiffness else 0.0
    line = np.array([preload, stiffness, damping]) + sum(_first_pieces(e), np.zeros(3))
    forces = [AffineForce(*-line), *_corner_forces(e.travel_force, 1), *_corner_forces(e.rate_force, 2)]
    shifted = [force._replace(constant=force.constant - force.slope * design) for force in forces]
    return [force for force in shifted if any(force[:3])]


def _first_pieces(element: CutVehicleElement) -> Iterator[np.ndarray]:
    """Constant, slope and damping (3,) of the first straight piece of each of an element's two curves, over travel and
    rate."""
    for curve, place in ((element.travel_force, 1), (element.rate_force, 2)):
        if curve is not None:
            line = np.zeros(3)
            line[[0, place]] = curve.hinges()[:2]
            yield line


def _corner_forces(force_curve: Curve | None, length_or_rate_index: int) -> Iterator[AffineForce]:
    """Force -bend max(x - corner, 0) for every corner of a curve; x is the travel if ``length_or_rate_index`` is 1, its
    rate if 2."""
    _, _, corners, bends = force_curve.hinges() if force_curve else (0.0, 0.0, (), ())
    for corner, bend in zip(corners, bends, strict=True):
        low, high = (-UNLIMITED_FORCE, 0.0) if bend > 0.0 else (0.0, UNLIMITED_FORCE)
        slope, damping = (-bend, 0.0) if length_or_rate_index == 1 else (0.0, -bend)
        yield AffineForce(bend * corner, slope, damping, low, high)
