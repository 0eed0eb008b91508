"""From MuJoCo's compiled model to the description of a vehicle, in the design position ``qpos0``.

Every joint is a body without mass that moves along its axis, at its anchor; behind the last one of a body of the file
is a body with its mass, at its centre. What stands still with the world is left out: it moves nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from models.engines.free_vehicle import Driven
from models.engines.native_parts import (
    Connection,
    Coupling,
    DryFriction,
    GroundSpring,
    LineSpring,
    TurningSpring,
    joint_parts,
)
from models.own_model.coordinates import BALL, FREE, SLIDE, Coordinates
from models.vehicles.spatial import FREEDOMS, PARALLEL, Body, Freedom, JointElement, SpatialVehicle, Vector

CONNECT, WELD = int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD)
TURNS: tuple[Freedom, ...] = ("rx", "ry", "rz")
OF_KIND: dict[int, tuple[Freedom, ...]] = {BALL: TURNS, FREE: FREEDOMS}


@dataclass(frozen=True, eq=False)
class TwinModel:
    """A file as MuJoCo parsed it (``model``), without what was left out, and the same as a description (``driven``)."""

    name: str
    model: mujoco.MjModel
    driven: Driven
    coordinates: Coordinates

    @property
    def size(self) -> int:
        """How many coordinates there are."""
        return self.coordinates.size

    @property
    def names(self) -> tuple[str, ...]:
        """Of every coordinate: its joint, and which freedom of it where it has several."""
        return coordinate_names(self.model)


def described(model: mujoco.MjModel, name: str) -> TwinModel:
    """The model as a description; what ``content`` finds without an equal must have been left out of it before."""
    design = mujoco.MjData(model)
    design.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, design)
    elements = joint_elements(model)
    vehicle = SpatialVehicle(name, tuple(_bodies(model, design)), (), (), (), joint_elements=elements)
    gravity = np.zeros(3) if _disabled(model, "GRAVITY") else np.array(model.opt.gravity)
    loads = tuple(_lifted(model, design, gravity))
    lines = tuple(line_springs(model, design))
    ties = tuple(dry_frictions(model)), tuple(couplings(model)), tuple(connections(model, design))
    parts = joint_parts(vehicle)
    turns = tuple(turning_springs(model, design))
    driven = Driven(vehicle, gravity, np.zeros(1), None, None, parts, loads, lines, *ties, turns)
    return TwinModel(name, model, driven, Coordinates(model, design))


def joint_elements(model: mujoco.MjModel) -> tuple[JointElement, ...]:
    """What acts along the coordinates of joints: springs, dampers and rotors of joints and fixed tendons, actuators."""
    return (*_joint_elements(model), *_tendon_elements(model), *_actuator_elements(model))


def label(model: mujoco.MjModel, kind: str, number: int) -> str:
    """Name of a joint, body, tendon or actuator of a file; its number where it has none."""
    name: str = getattr(model, kind)(number).name
    return f"{kind} {name!r}" if name else f"{kind} {number}"


def coordinate_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Of every coordinate: its joint, and which freedom of it where it has several."""
    names = list[str]()
    for j in range(model.njnt):
        of = OF_KIND.get(int(model.jnt_type[j]), ())
        names += [f"{label(model, 'joint', j)} {freedom}" for freedom in of] or [label(model, "joint", j)]
    return tuple(names)


def place_of(model: mujoco.MjModel, joint: int) -> tuple[str, Freedom]:
    """The coordinate of a hinge or slide."""
    return _moved(joint), "x" if model.jnt_type[joint] == SLIDE else "rx"


def moving(model: mujoco.MjModel) -> dict[int, None]:
    """Numbers of the bodies that a joint moves, their own or one further down, in their order."""
    numbers = dict[int, None]()
    for b in range(1, model.nbody):
        if model.body_jntnum[b] or int(model.body_parentid[b]) in numbers:
            numbers[b] = None
    return numbers


def _disabled(model: mujoco.MjModel, what: str) -> bool:
    return bool(model.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{what}"))


def _moved(joint: int) -> str:
    """Name of the body without mass of a joint; numbers, since names of files need not be there."""
    return f"joint {joint}"


def _massive(body: int) -> str:
    return f"body {body}"


def _vector(numbers: np.ndarray) -> Vector:
    x, y, z = np.asarray(numbers, float).tolist()
    return x, y, z


def _rows(matrix: np.ndarray) -> tuple[Vector, Vector, Vector]:
    x, y, z = map(_vector, matrix)
    return x, y, z


def _bodies(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[Body]:
    numbers = moving(model)
    for b in numbers:
        above = int(model.body_parentid[b])
        behind = _massive(above) if above in numbers else None
        for j in range(model.body_jntadr[b], model.body_jntadr[b] + model.body_jntnum[b]):
            yield _joint(model, design, j, behind)
            behind = _moved(j)
        axes = design.ximat[b].reshape(3, 3)
        inertia, mass = _rows(axes * model.body_inertia[b] @ axes.T + _armature(model, b)), float(model.body_mass[b])
        yield Body(_massive(b), mass, _vector(design.xipos[b]), (), inertia, behind)


def _joint(model: mujoco.MjModel, design: mujoco.MjData, j: int, behind: str | None) -> Body:
    """A body without mass that moves as a joint does."""
    kind, body = int(model.jnt_type[j]), int(model.jnt_bodyid[j])
    if kind in OF_KIND:
        anchor = design.xpos[body] if kind == FREE else design.xanchor[j]
        return Body(_moved(j), 0.0, _vector(anchor), OF_KIND[kind], parent=behind)
    freedoms: tuple[Freedom, ...] = (place_of(model, j)[1],)
    return Body(_moved(j), 0.0, _vector(design.xanchor[j]), freedoms, parent=behind, axes=_along(design.xaxis[j]))


def _along(axis: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """Right-handed axes, as rows, the first of which lies along a unit vector."""
    if axis[0] == 1.0:
        return PARALLEL
    second = np.cross(axis, np.eye(3)[int(np.abs(axis).argmin())])
    second /= np.linalg.norm(second)
    return _rows(np.array((axis, second, np.cross(axis, second))))


def _armature(model: mujoco.MjModel, body: int) -> np.ndarray:
    """(3, 3): what an armature on the turning of a free body adds to its inertia, the same about all axes."""
    joint = int(model.body_jntadr[body])
    free = joint >= 0 and model.jnt_type[joint] == FREE
    return float(model.dof_armature[model.jnt_dofadr[joint] + 3]) * np.eye(3) if free else np.zeros((3, 3))


def _joint_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not _disabled(model, "SPRING"), not _disabled(model, "DAMPER")
    for j in range(model.njnt):
        first, place = int(model.jnt_dofadr[j]), int(model.jnt_qposadr[j])
        free, ball = model.jnt_type[j] == FREE, model.jnt_type[j] == BALL
        freedoms: tuple[Freedom, ...] = ("x", "y", "z") if free else () if ball else (place_of(model, j)[1],)
        for i, freedom in enumerate(freedoms):
            stiffness = float(model.jnt_stiffness[j]) * springs
            damping, inertia = float(model.dof_damping[first + i]) * dampers, float(model.dof_armature[first + i])
            held = stiffness * float(model.qpos0[place + i] - model.qpos_spring[place + i])
            if stiffness or damping or inertia:
                numbers = (stiffness, damping, held, inertia)
                name = f"{label(model, 'joint', j)} {freedom if free else ''}".rstrip()
                yield JointElement(name, ((_moved(j), freedom),), (1.0,), *numbers)


def tendon_travel(model: mujoco.MjModel, tendon: int) -> tuple[list[int], list[float]]:
    """Joints of a fixed tendon, and their coefficients."""
    of = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    return [int(model.wrap_objid[w]) for w in of], [float(model.wrap_prm[w]) for w in of]


def is_fixed(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon is a sum of joints, and not a way through space."""
    return bool(model.wrap_type[model.tendon_adr[tendon]] == mujoco.mjtWrap.mjWRAP_JOINT)


def is_line(model: mujoco.MjModel, tendon: int) -> bool:
    """Whether a tendon goes straight from one site to another."""
    first, site = int(model.tendon_adr[tendon]), mujoco.mjtWrap.mjWRAP_SITE
    return bool(model.tendon_num[tendon] == 2 and (model.wrap_type[first : first + 2] == site).all())


def sites_of(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Both sites of a tendon that is a line."""
    first = int(model.tendon_adr[tendon])
    return model.wrap_objid[first : first + 2].tolist()


def line_springs(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[LineSpring]:
    """Springs and dampers of tendons between two sites."""
    springs, dampers, numbers = not _disabled(model, "SPRING"), not _disabled(model, "DAMPER"), moving(model)
    for t in (t for t in range(model.ntendon) if is_line(model, t)):
        stiffness, damping = float(model.tendon_stiffness[t]) * springs, float(model.tendon_damping[t]) * dampers
        bodies = [int(model.site_bodyid[s]) for s in sites_of(model, t)]
        if (stiffness or damping) and bodies[0] != bodies[1]:
            first, second = (_massive(b) if b in numbers else None for b in bodies)
            start, end = (_vector(design.site_xpos[s]) for s in sites_of(model, t))
            length = float(model.tendon_lengthspring[t, 0])
            yield LineSpring(label(model, "tendon", t), first, second, start, end, stiffness, damping, length)


def turning_springs(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[TurningSpring]:
    """Springs and dampers of how ball and free joints turn; of how free ones shift is in ``joint_elements``."""
    springs, dampers, numbers = not _disabled(model, "SPRING"), not _disabled(model, "DAMPER"), moving(model)
    for j in (j for j in range(model.njnt) if model.jnt_type[j] in (BALL, FREE)):
        body, free = int(model.jnt_bodyid[j]), model.jnt_type[j] == FREE
        stiffness = float(model.jnt_stiffness[j]) * springs
        damping = float(model.dof_damping[model.jnt_dofadr[j] + 3 * free]) * dampers
        if not (stiffness or damping):
            continue
        place, axes = int(model.jnt_qposadr[j]) + 3 * free, design.xmat[body].reshape(3, 3).copy()
        rest = _matrix(model.qpos_spring[place : place + 4])
        above = int(model.body_parentid[body])
        first = _massive(above) if above in numbers else None
        yield TurningSpring(
            label(model, "joint", j), (first, _massive(body)), (rest if free else axes @ rest, axes), stiffness, damping
        )


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    """(3, 3) of a quaternion."""
    numbers = np.empty(9)
    mujoco.mju_quat2Mat(numbers, quaternion)
    return numbers.reshape(3, 3)


def rubs(model: mujoco.MjModel, joint: int) -> bool:
    """Whether a hinge or slide has dry friction."""
    several = model.jnt_type[joint] in (BALL, FREE)
    return bool(not several and model.dof_frictionloss[model.jnt_dofadr[joint]] > 0.0)


def dry_frictions(model: mujoco.MjModel) -> Iterator[DryFriction]:
    """Dry friction of hinges and slides."""
    if _disabled(model, "FRICTIONLOSS"):
        return
    for j in (j for j in range(model.njnt) if rubs(model, j)):
        first = int(model.jnt_dofadr[j])
        yield DryFriction(label(model, "joint", j), first, float(model.dof_frictionloss[first]))


def is_tie(model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint makes a hinge or slide follow another one in proportion, or stay where it is."""
    if model.eq_type[equality] != mujoco.mjtEq.mjEQ_JOINT or model.eq_data[equality, 2:5].any():
        return False
    joints = [j for j in (model.eq_obj1id[equality], model.eq_obj2id[equality]) if j >= 0]
    return not any(model.jnt_type[j] in (BALL, FREE) for j in joints)


def couplings(model: mujoco.MjModel) -> Iterator[Coupling]:
    """Equality constraints of two joints, or of one, that act."""
    if _disabled(model, "EQUALITY"):
        return
    for e in (e for e in range(model.neq) if model.eq_active0[e] and is_tie(model, e)):
        first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        driver = int(model.jnt_dofadr[second]) if second >= 0 else None
        offset, ratio = model.eq_data[e, :2].tolist()
        softness = tuple(model.eq_solref[e].tolist()), tuple(model.eq_solimp[e].tolist())
        yield Coupling(label(model, "equality", e), int(model.jnt_dofadr[first]), driver, ratio, offset, *softness)


def joins(model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint keeps points of bodies together, or bodies as they lie to each other."""
    return int(model.eq_type[equality]) in (CONNECT, WELD)


def by_sites(model: mujoco.MjModel, equality: int) -> bool:
    """Whether an equality constraint is between two sites, and not between bodies."""
    return bool(model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE)


def connections(model: mujoco.MjModel, design: mujoco.MjData) -> Iterator[Connection]:
    """Equality constraints between points of two bodies, or with their axes, that act."""
    if _disabled(model, "EQUALITY"):
        return
    numbers = moving(model)
    for e in (e for e in range(model.neq) if model.eq_active0[e] and joins(model, e)):
        things = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        bodies = [int(model.site_bodyid[thing]) if by_sites(model, e) else thing for thing in things]
        first, second = (_massive(b) if b in numbers else None for b in bodies)
        if first == second:
            continue
        (start, turned), (end, other) = _frames(model, design, e)
        axes = (turned, other) if model.eq_type[e] == WELD else None
        softness = tuple(model.eq_solref[e].tolist()), tuple(model.eq_solimp[e].tolist())
        ends = (first, _vector(start)), (second, _vector(end))
        yield Connection(label(model, "equality", e), ends, axes, *softness, float(model.eq_data[e, 10]))


def _frames(model: mujoco.MjModel, design: mujoco.MjData, equality: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points (3,) and axes (3, 3) of both ends of a constraint in the design position: they lie alike where it is met.

    A weld between bodies has its point of the second one first.
    """
    things, data = (model.eq_obj1id[equality], model.eq_obj2id[equality]), model.eq_data[equality]
    if by_sites(model, equality):
        return [(design.site_xpos[s].copy(), design.site_xmat[s].reshape(3, 3).copy()) for s in things]
    points, axes = [data[:3], data[3:6]], [np.eye(3), np.eye(3)]
    if model.eq_type[equality] == WELD:
        points, axes = points[::-1], [_matrix(data[6:10]), np.eye(3)]
    turns = [design.xmat[b].reshape(3, 3) for b in things]
    places = [design.xpos[b] + turn @ point for b, turn, point in zip(things, turns, points, strict=True)]
    return [(place, turn @ own) for place, turn, own in zip(places, turns, axes, strict=True)]


def tie_rows(ties: Sequence[Coupling], size: int) -> tuple[np.ndarray, np.ndarray]:
    """(c, n) and (c,): rows q = offsets is what couplings ask of n coordinates."""
    rows = np.zeros((len(ties), size))
    for row, coupling in zip(rows, ties, strict=True):
        row[coupling.driven] = 1.0
        if coupling.driver is not None:
            row[coupling.driver] -= coupling.ratio
    return rows, np.array([coupling.offset for coupling in ties])


def _along_tendon(model: mujoco.MjModel, tendon: int) -> tuple[tuple, tuple[float, ...], float]:
    """Coordinates and factors of a fixed tendon, and its length in the design position."""
    joints, factors = tendon_travel(model, tendon)
    length = sum(k * float(model.qpos0[model.jnt_qposadr[j]]) for j, k in zip(joints, factors, strict=True))
    return tuple(place_of(model, j) for j in joints), tuple(factors), length


def _tendon_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    springs, dampers = not _disabled(model, "SPRING"), not _disabled(model, "DAMPER")
    for t in range(model.ntendon):
        if not is_fixed(model, t):
            continue
        places, factors, length = _along_tendon(model, t)
        stiffness, damping = float(model.tendon_stiffness[t]) * springs, float(model.tendon_damping[t]) * dampers
        held, inertia = stiffness * (length - float(model.tendon_lengthspring[t, 0])), float(model.tendon_armature[t])
        if stiffness or damping or inertia:
            yield JointElement(label(model, "tendon", t), places, factors, stiffness, damping, held, inertia)


def controls(model: mujoco.MjModel) -> np.ndarray:
    """Constant controls (nu,): 0, or the nearest number in the range of a limited one."""
    limited = model.actuator_ctrllimited[:, None].astype(bool)
    low, high = np.where(limited, model.actuator_ctrlrange, (-np.inf, np.inf)).T
    return np.clip(np.zeros(len(low)), low, high)


def _actuator_elements(model: mujoco.MjModel) -> Iterator[JointElement]:
    """Forces gain u + bias, affine in length and speed of a joint or a fixed tendon, at constant controls."""
    if _disabled(model, "ACTUATION"):
        return
    constant = controls(model)
    for i in range(model.nu):
        if model.opt.disableactuator & (1 << int(model.actuator_group[i])):
            continue
        gear, target = float(model.actuator_gear[i, 0]), int(model.actuator_trnid[i, 0])
        if model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_TENDON:
            places, factors, start = _along_tendon(model, target)
        else:
            places, factors = (place_of(model, target),), (1.0,)
            start = float(model.qpos0[model.jnt_qposadr[target]])
        gain = np.array(model.actuator_gainprm[i, :3])
        gain[1:] *= model.actuator_gaintype[i] == mujoco.mjtGain.mjGAIN_AFFINE
        bias = np.array(model.actuator_biasprm[i, :3]) * (model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE)
        offset, slope, rate = gain * constant[i] + bias
        if offset or slope or rate:
            numbers = (-slope, -rate, -(offset + slope * gear * start))
            yield JointElement(label(model, "actuator", i), places, tuple(gear * k for k in factors), *numbers)


def _lifted(model: mujoco.MjModel, design: mujoco.MjData, gravity: np.ndarray) -> Iterator[GroundSpring]:
    """Loads at the centres of bodies whose weight is compensated."""
    for b in moving(model):
        if model.body_gravcomp[b] and model.body_mass[b] and gravity.any():
            load, still = -gravity * float(model.body_gravcomp[b] * model.body_mass[b]), np.zeros(3)
            point = _vector(design.xipos[b])
            yield GroundSpring(_massive(b), point, point, still, still, load)  # type: ignore[arg-type]
