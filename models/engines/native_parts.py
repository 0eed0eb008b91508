"""Division of a vehicle's springs, mounts and bars between an engine's native elements and the forces of a callback.

A travel d that is a sum of coordinates is one for every engine. So is d = a . (p2 - p1), where the axis a is fixed in
the body of one end and that body carries the other end. What an engine lacks stays in the compiled forces that act for
the hubs anyway, ``models.multibody.cut_kernel``: each part of it is named with the reason.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from models.vehicles.cut_vehicle import CutVehicleElement
from models.vehicles.spatial import FREEDOMS, JointElement, SpatialVehicle, Vector

ENGINES_WITH_CURVES = ("mujoco",)
"""Engines whose native elements can have a force that is piecewise linear in travel or rate."""
FULL_FRICTION_SPEED = 1e-3
"""Speed (m/s, rad/s) above which dry friction has its whole force; below, the force is proportional to the speed."""
NO_FRAME = "its axis is fixed in no end of it that carries the other end"
"""Reasons why an element or a term of its law is not native."""
NO_TRAVEL = "no coordinate moves its ends apart along its axis"
NO_CURVE = "curve: piecewise linear forces are functions in Exudyn, no elements"
NO_FRICTION = {
    "exudyn": "friction: tanh is a function in Exudyn, no element",
    "mujoco": "friction: MuJoCo's is a constraint, which is no tanh",
}


@dataclass(frozen=True)
class CoordinateTravel:
    """Spring travel along coordinates q: the sum of factor times q over ``coordinates``, which are numbered in the
    order of the tree."""

    coordinates: tuple[int, ...]
    factors: tuple[float, ...]


@dataclass(frozen=True)
class AxialTravel:
    """Spring travel along an axis: axis . (tip - foot) less its design value (m). Axis (3,) and foot are fixed in the
    body ``frame``.

    foot, tip : places (3,) in the design position, m; the tip is on ``body``, which ``frame`` carries.
    """

    frame: str
    foot: np.ndarray
    body: str
    tip: np.ndarray
    axis: np.ndarray

    @property
    def design(self) -> float:
        """Design value of the travel (m): axis . (tip - foot) in the design position."""
        return float(self.axis @ (self.tip - self.foot))


@dataclass(frozen=True)
class NativePart:
    """An element with the terms of its force law that the engine itself computes, and its travel."""

    element: CutVehicleElement
    travel: CoordinateTravel | AxialTravel


@dataclass(frozen=True)
class GroundSpring:
    """Springs and dampers between the ground and a point of a body along the axes of space, and a load at this point.

    point, anchor : places (m) of the body's point and of the ground's in the design position; stiffness (N/m), damping
    (N s/m), load (N) : along x, y, z; what is 0 is not built.
    """

    body: str
    point: Vector
    anchor: Vector
    stiffness: Vector
    damping: Vector
    load: np.ndarray


@dataclass(frozen=True)
class LineSpring:
    """A spring and damper along the straight line between points of two bodies; None means the ground.

    Both are drawn together by F = stiffness (l - length) + damping l', l their distance (m); first_point, second_point
    in the design position, m; length in m, stiffness in N/m, damping in N s/m.
    """

    name: str
    first_body: str | None
    second_body: str | None
    first_point: Vector
    second_point: Vector
    stiffness: float
    damping: float
    length: float

    @property
    def ends(self) -> tuple[tuple[str | None, Vector], ...]:
        """The two bodies, each with its point (m)."""
        return (self.first_body, self.first_point), (self.second_body, self.second_point)


@dataclass(frozen=True)
class DryFriction:
    """Coulomb friction against the motion of a coordinate (number in the tree's order); force in N or N m; solref,
    solimp : MuJoCo's softness of sticking."""

    name: str
    coordinate: int
    force: float
    solref: tuple[float, ...]
    solimp: tuple[float, ...]


@dataclass(frozen=True)
class Coupling:
    """A constraint between two coordinates (numbers in the tree's order): q_driven = offset + ratio q_driver.

    driver : None where the driven coordinate keeps to the offset; offset in m or rad; solref, solimp : how soft MuJoCo
    makes it, whose equality constraints are never rigid. Exudyn's is rigid.
    """

    name: str
    driven: int
    driver: int | None
    ratio: float
    offset: float
    solref: tuple[float, ...]
    solimp: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class BodyLoad:
    """A force (3,) in N at a point (m) of a body, and a moment (3,) in N m; both turn with the body.

    All three as they are in the design position, along the axes of space.
    """

    name: str
    body: str
    point: Vector
    force: np.ndarray
    moment: np.ndarray


@dataclass(frozen=True, eq=False)
class TurningSpring:
    """A rotational spring and damper between two bodies (None: the ground), with the same stiffness about all axes.

    The moment is -stiffness r - damping w: r the rotation vector from the first body's axes to the second's, w the
    angular velocity of the second against the first; axes : (3, 3) of each as columns in the design position, parallel
    where it is at rest; stiffness in N m/rad, damping in N m s/rad.
    """

    name: str
    bodies: tuple[str | None, str]
    axes: tuple[np.ndarray, np.ndarray]
    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class Connection:
    """A constraint that keeps a point of a body at a point of another (None: the ground) and, if ``axes`` are given,
    the bodies parallel.

    ends : both bodies with their points (m) in the design position, where they need not meet; axes : (3, 3) of each as
    columns in the design position, which must be parallel, None where the bodies turn freely about the point; solref,
    solimp, torque_scale (m) : how soft MuJoCo makes it. Exudyn's is rigid.
    """

    name: str
    ends: tuple[tuple[str | None, Vector], tuple[str | None, Vector]]
    axes: tuple[np.ndarray, np.ndarray] | None
    solref: tuple[float, ...]
    solimp: tuple[float, ...]
    torque_scale: float


@dataclass(frozen=True)
class ElementDivision:
    """Division of a vehicle's elements between an engine and the compiled forces.

    native : elements that the engine itself computes; shared : the remainder of each law, which the compiled forces
    add; reasons : why an element is shared, by its name.
    """

    native: tuple[NativePart, ...]
    shared: tuple[CutVehicleElement, ...]
    reasons: dict[str, str] = field(default_factory=dict)


def divide_between_engine_and_callback(
    vehicle_tree: SpatialVehicle, elements: Iterable[CutVehicleElement], engine: str
) -> ElementDivision:
    """Division of the elements of a vehicle's tree between an engine ("exudyn" or "mujoco") and the compiled forces."""
    native, shared, reasons = list[NativePart](), list[CutVehicleElement](), dict[str, str]()
    for element in elements:
        travel = travel_of(vehicle_tree, element)
        still = isinstance(travel, CoordinateTravel) and not travel.coordinates
        if travel is None or still:
            shared.append(element)
            reasons[element.name] = NO_TRAVEL if still else NO_FRAME
            continue
        kept, left, why = _divided_element(element, engine)
        if kept is not None:
            native.append(NativePart(kept, travel))
        if left is not None:
            shared.append(left)
            reasons[element.name] = "; ".join(why)
    return ElementDivision(tuple(native), tuple(shared), reasons)


def _divided_element(
    element: CutVehicleElement, engine: str
) -> tuple[CutVehicleElement | None, CutVehicleElement | None, list[str]]:
    """An element with the law's terms that the engine computes, the element with the terms left to a callback, and the
    reasons. A preload goes with the terms that carry it."""
    curved, rough = bool(element.travel_force or element.rate_force), element.friction != 0.0
    left, why = replace(element, stiffness=0.0, damping=0.0, preload=0.0), list[str]()
    if curved and engine not in ENGINES_WITH_CURVES:
        why.append(NO_CURVE)
        element = replace(element, travel_force=None, rate_force=None)
        if not element.stiffness:
            left, element = replace(left, preload=element.preload), replace(element, preload=0.0)
    else:
        left = replace(left, travel_force=None, rate_force=None)
    if rough:
        why.append(NO_FRICTION[engine])
        element = replace(element, friction=0.0)
    acts = element.stiffness or element.damping or element.travel_force or element.rate_force
    return element if acts else None, left if why else None, why


def joint_parts(vehicle: SpatialVehicle) -> tuple[NativePart, ...]:
    """Joint elements with a spring, damper or preload, as native parts; their inertia is in ``rotors``."""
    return tuple(
        NativePart(_joint_force(element), CoordinateTravel(_coordinate_numbers(vehicle, element), element.factors))
        for element in vehicle.joint_elements
        if element.stiffness or element.damping or element.preload
    )


def rotors(vehicle: SpatialVehicle) -> list[tuple[str, CoordinateTravel, float]]:
    """Name, travel and inertia (kg, kg m^2) of the joint elements that have inertia."""
    return [
        (element.name, CoordinateTravel(_coordinate_numbers(vehicle, element), element.factors), element.inertia)
        for element in vehicle.joint_elements
        if element.inertia
    ]


def _coordinate_numbers(vehicle: SpatialVehicle, joint_element: JointElement) -> tuple[int, ...]:
    """Numbers, in the tree's order, of the coordinates of a joint element."""
    places = {place: i for i, place in enumerate(vehicle.coordinates())}
    return tuple(places[place] for place in joint_element.coordinates)


def _joint_force(joint_element: JointElement) -> CutVehicleElement:
    """The force law of a joint element, as an element without points."""
    still, gains = np.zeros(3), (joint_element.stiffness, joint_element.damping, joint_element.preload)
    return CutVehicleElement(joint_element.name, "", "", still, still, still, *gains, frame="")


def travel_of(vehicle_tree: SpatialVehicle, element: CutVehicleElement) -> CoordinateTravel | AxialTravel | None:
    """The travel of an element in a form that an engine may have, along coordinates or along an axis; None if it has
    neither form."""
    first, two = (
        _bodies_up_to_frame(vehicle_tree, end, element.frame) for end in (element.first_body, element.second_body)
    )
    if (
        first is not None
        and two is not None
        and not any(_turns_on_carrier(vehicle_tree, body) for body in (*first, *two))
    ):
        return _along_coordinates(vehicle_tree, element, first, two)
    if element.frame == element.second_body and first is not None:
        return AxialTravel(
            element.second_body, element.second_point, element.first_body, element.first_point, -element.axis
        )
    if element.frame == element.first_body and two is not None:
        return AxialTravel(
            element.first_body, element.first_point, element.second_body, element.second_point, element.axis
        )
    return None


def _turns_on_carrier(vehicle_tree: SpatialVehicle, body: str) -> bool:
    """Whether a body can turn relative to the body that carries it."""
    return any(freedom.startswith("r") for freedom in vehicle_tree.body(body).freedoms)


def _bodies_up_to_frame(vehicle_tree: SpatialVehicle, body: str, frame_body: str) -> tuple[str, ...] | None:
    """The bodies in the chain from ``body`` to the one carried directly by ``frame_body``; None where the frame does
    not carry the body."""
    chain = vehicle_tree.chain(body)
    return chain[: chain.index(frame_body)] if frame_body in chain else None


def _along_coordinates(
    vehicle_tree: SpatialVehicle,
    element: CutVehicleElement,
    first_chain: tuple[str, ...],
    second_chain: tuple[str, ...],
) -> CoordinateTravel:
    """Travel along the sliding coordinates of the bodies between the frame and either end; slides that move both ends
    cancel."""
    factors = dict[int, float]()
    for number, (body, freedom) in enumerate(vehicle_tree.coordinates()):
        ends = int(body in second_chain) - int(body in first_chain)
        if factor := ends * float(element.axis[FREEDOMS.index(freedom) % 3]):
            factors[number] = factor
    return CoordinateTravel(tuple(factors), tuple(factors.values()))
