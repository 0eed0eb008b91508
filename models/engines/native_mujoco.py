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
from models.vehicles.cut_vehicle import Element
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


def end_bodies(parts: Sequence[NativePart]) -> set[str]:
    """Names of bodies that carry sites of the parts, so that MuJoCo must not merge them with the bodies that they
    carry."""
    axial = [part.travel for part in parts if isinstance(part.travel, AxialTravel)]
    return {name for travel in axial for name in (travel.frame, travel.body)}


def add_parts(spec: mujoco.MjSpec, vehicle: SpatialVehicle, parts: Sequence[NativePart]) -> None:
    """Add tendons, sites and actuators for native parts to a specification of ``mujoco_tree.spec_of``; ``set_laws``
    sets their values."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for i, part in enumerate(parts):
        travel, name = part.travel, f"{i}{NAME_SEPARATOR}{part.element.name}"
        if isinstance(travel, CoordinateTravel):
            tendon = spec.add_tendon(name=name)
            for coordinate, factor in zip(travel.coordinates, travel.factors, strict=True):
                tendon.wrap_joint(joints[coordinate], factor)
            of = {"trntype": mujoco.mjtTrn.mjTRN_TENDON, "target": name}
        else:
            for end, body, place in (("foot", travel.frame, travel.foot), ("tip", travel.body, travel.tip)):
                spec.body(numbers[body]).add_site(name=f"{end} {i}", pos=place - vehicle.body(body).position)
            of = {"trntype": mujoco.mjtTrn.mjTRN_SITE, "target": f"tip {i}", "refsite": f"foot {i}"}
            of["gear"] = [*travel.axis, 0.0, 0.0, 0.0]
        for k, _ in enumerate(affine_forces(part)):
            actuator = spec.add_actuator(name=f"{i}.{k}{NAME_SEPARATOR}{part.element.name}", **of)
            actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE


def add_rotors(
    spec: mujoco.MjSpec, vehicle: SpatialVehicle, rotors: Sequence[tuple[str, CoordinateTravel, float]]
) -> None:
    """Add tendons for inertias along sums of coordinates to a specification; ``set_rotors`` sets their values."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for i, (name, travel, _) in enumerate(rotors):
        tendon = spec.add_tendon(name=f"{ROTOR_PREFIX}{i}{NAME_SEPARATOR}{name}")
        for coordinate, factor in zip(travel.coordinates, travel.factors, strict=True):
            tendon.wrap_joint(joints[coordinate], factor)


def set_rotors(model: mujoco.MjModel, rotors: Sequence[tuple[str, CoordinateTravel, float]]) -> None:
    """Write the inertias (kg, kg m^2) along sums of coordinates into the compiled MuJoCo model."""
    for i, (name, _, inertia) in enumerate(rotors):
        model.tendon_armature[model.tendon(f"{ROTOR_PREFIX}{i}{NAME_SEPARATOR}{name}").id] = inertia


def add_ground_spring(spec: mujoco.MjSpec, vehicle: SpatialVehicle, spring: GroundSpring) -> None:
    """Add an actuator along each axis of space in which a ground spring acts, between sites on the body and on the
    ground."""
    number = len(spec.sites)
    tip, foot = f"ground spring {number}", f"ground {number}"
    _add_site(spec, vehicle, tip, spring.body, spring.point)
    _add_site(spec, vehicle, foot, None, spring.anchor)
    for i, load in enumerate(spring.load):
        if spring.stiffness[i] or spring.damping[i] or load:
            strut = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=tip, refsite=foot)
            strut.gear[:], strut.gainprm[0], strut.biastype = np.eye(6)[i], 0.0, mujoco.mjtBias.mjBIAS_AFFINE
            strut.biasprm[:3] = load, -spring.stiffness[i], -spring.damping[i]


def add_line_spring(spec: mujoco.MjSpec, vehicle: SpatialVehicle, spring: LineSpring) -> None:
    """Add a spatial tendon between two sites; ``set_line_springs`` sets its stiffness, damping and length."""
    number, tendon = len(spec.sites), spec.add_tendon(name=f"{LINE_SPRING_PREFIX}{spring.name}")
    for i, end in enumerate(spring.ends):
        site = f"end {number + i}"
        _add_site(spec, vehicle, site, *end)
        tendon.wrap_site(site)


def add_constraints(
    spec: mujoco.MjSpec, vehicle: SpatialVehicle, frictions: Sequence[DryFriction], couplings: Sequence[Coupling]
) -> None:
    """Add dry friction of joints, and equality constraints between joints; MuJoCo makes both soft."""
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    joints = [f"{numbers[body]} {freedom}" for body, freedom in vehicle.coordinates()]
    for friction in frictions:
        joint = spec.joint(joints[friction.coordinate])
        joint.frictionloss = friction.force
        joint.solref_friction[:], joint.solimp_friction[:] = friction.solref, friction.solimp
    for coupling in couplings:
        equality = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=joints[coupling.driven])
        if coupling.driver is not None:
            equality.name2 = joints[coupling.driver]
        equality.data[:2] = coupling.offset, coupling.ratio
        equality.solref[:], equality.solimp[:] = coupling.solref, coupling.solimp
    if frictions or couplings:
        _allow_constraints(spec)


def _allow_constraints(spec: mujoco.MjSpec) -> None:
    """Switch MuJoCo's constraint solver on, with a tight tolerance."""
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    spec.option.tolerance = SOLVER_TOLERANCE


def add_connection(spec: mujoco.MjSpec, vehicle: SpatialVehicle, connection: Connection) -> None:
    """Add a soft equality constraint between two sites: of their positions, or of their positions and axes."""
    axes = connection.axes or (np.eye(3), np.eye(3))
    first = len(spec.sites)
    for i, ((body, point), columns) in enumerate(zip(connection.ends, axes, strict=True)):
        _add_site(spec, vehicle, f"joint {first + i}", body, point).quat = _quaternion(columns)
    kinds, turns = mujoco.mjtEq, connection.axes is not None
    equality = spec.add_equality(
        type=kinds.mjEQ_WELD if turns else kinds.mjEQ_CONNECT,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=f"joint {first}",
        name2=f"joint {first + 1}",
    )
    equality.data[10] = connection.torque_scale
    equality.solref[:], equality.solimp[:] = connection.solref, connection.solimp
    _allow_constraints(spec)


def add_body_load(spec: mujoco.MjSpec, vehicle: SpatialVehicle, load: BodyLoad) -> None:
    """Add an actuator that applies a constant force and moment at a site of a body and turns with it."""
    site = f"load {len(spec.sites)}"
    _add_site(spec, vehicle, site, load.body, load.point)
    push = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=site)
    push.gear[:], push.gainprm[0], push.biastype = (*load.force, *load.moment), 0.0, mujoco.mjtBias.mjBIAS_AFFINE
    push.biasprm[0] = 1.0


def add_turning_spring(spec: mujoco.MjSpec, vehicle: SpatialVehicle, spring: TurningSpring) -> None:
    """Add an actuator about each axis of a site on the first body; its length is the rotation vector's component along
    this axis."""
    number = len(spec.sites)
    foot, tip = f"turn {number}", f"turn {number + 1}"
    for name, body, axes in zip((foot, tip), spring.bodies, spring.axes, strict=True):
        place = (0.0, 0.0, 0.0) if body is None else vehicle.body(body).position
        _add_site(spec, vehicle, name, body, place).quat = _quaternion(axes)
    for gear in np.eye(6)[3:]:
        twist = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=tip, refsite=foot)
        twist.gear[:], twist.gainprm[0], twist.biastype = gear, 0.0, mujoco.mjtBias.mjBIAS_AFFINE
        twist.biasprm[1:3] = -spring.stiffness, -spring.damping


def _quaternion(axes: np.ndarray) -> np.ndarray:
    """Quaternion (4,) of a frame whose axes (3, 3) are columns."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return quaternion


def _add_site(spec: mujoco.MjSpec, vehicle: SpatialVehicle, name: str, body: str | None, point: Vector) -> Any:
    """Add a site to a body (None: the ground) at a point (m) of the design position."""
    if body is None:
        return spec.worldbody.add_site(name=name, pos=point)
    number = [each.name for each in vehicle.bodies].index(body)
    return spec.body(str(number)).add_site(name=name, pos=np.subtract(point, vehicle.body(body).position))


def set_line_springs(model: mujoco.MjModel, springs: Sequence[LineSpring]) -> None:
    """Write stiffness, damping and free length of the line springs into the compiled MuJoCo model."""
    for spring in springs:
        tendon = model.tendon(f"{LINE_SPRING_PREFIX}{spring.name}").id
        model.tendon_stiffness[tendon], model.tendon_damping[tendon] = spring.stiffness, spring.damping
        model.tendon_lengthspring[tendon] = spring.length


def set_laws(model: mujoco.MjModel, parts: Sequence[NativePart]) -> None:
    """Write stiffness, damping, preload and curves of all native parts into the compiled MuJoCo model."""
    model.actuator_gainprm[:] = 0.0
    for i, part in enumerate(parts):
        element = part.element
        if isinstance(part.travel, CoordinateTravel):
            tendon = model.tendon(f"{i}{NAME_SEPARATOR}{element.name}").id
            model.tendon_stiffness[tendon], model.tendon_damping[tendon] = element.stiffness, element.damping
            model.tendon_lengthspring[tendon] = -element.preload / element.stiffness if element.stiffness else 0.0
        for k, force in enumerate(affine_forces(part)):
            actuator = model.actuator(f"{i}.{k}{NAME_SEPARATOR}{element.name}").id
            model.actuator_biasprm[actuator, :3] = force[:3]
            model.actuator_forcelimited[actuator] = (force.low, force.high) != (-UNLIMITED_FORCE, UNLIMITED_FORCE)
            model.actuator_forcerange[actuator] = force.low, force.high


def built_elements(model: mujoco.MjModel) -> tuple[str, ...]:
    """Names of the elements that have a tendon or an actuator in a MuJoCo model, each once."""
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    actuators = [model.actuator(i).name for i in range(model.nu)]
    return tuple(dict.fromkeys(name.split(NAME_SEPARATOR, 1)[1] for name in (*tendons, *actuators)))


def affine_forces(part: NativePart) -> list[AffineForce]:
    """Forces of actuators on the length L of a part, beyond the force of the tendon's own spring, with d = L less its
    design value.

    They draw it together: where the element presses with F, they are -F.
    """
    axial, e = isinstance(part.travel, AxialTravel), part.element
    design = part.travel.design if isinstance(part.travel, AxialTravel) else 0.0
    stiffness, damping = (e.stiffness, e.damping) if axial else (0.0, 0.0)
    preload = e.preload if axial or not e.stiffness else 0.0
    line = np.array([preload, stiffness, damping]) + sum(_first_pieces(e), np.zeros(3))
    forces = [AffineForce(*-line), *_corner_forces(e.travel_force, 1), *_corner_forces(e.rate_force, 2)]
    shifted = [force._replace(constant=force.constant - force.slope * design) for force in forces]
    return [force for force in shifted if any(force[:3])]


def _first_pieces(element: Element) -> Iterator[np.ndarray]:
    """Constant, slope and damping (3,) of the first straight piece of each of an element's two curves, over travel and
    rate."""
    for curve, place in ((element.travel_force, 1), (element.rate_force, 2)):
        if curve is not None:
            line = np.zeros(3)
            line[[0, place]] = curve.hinges()[:2]
            yield line


def _corner_forces(curve: Curve | None, place: int) -> Iterator[AffineForce]:
    """Force -bend max(x - corner, 0) for every corner of a curve; x is the travel if ``place`` is 1, its rate if 2."""
    _, _, corners, bends = curve.hinges() if curve else (0.0, 0.0, (), ())
    for corner, bend in zip(corners, bends, strict=True):
        low, high = (-UNLIMITED_FORCE, 0.0) if bend > 0.0 else (0.0, UNLIMITED_FORCE)
        slope, damping = (-bend, 0.0) if place == 1 else (0.0, -bend)
        yield AffineForce(bend * corner, slope, damping, low, high)
