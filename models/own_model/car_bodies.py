"""Bodies of an MJCF car in the description of a vehicle; bodies that do not move relative to each other are merged.

A body with slides alone, or with hinges through its centre of mass, has them itself; hinges elsewhere are a body
without mass at their place, and so are joints in another order than that of the freedoms.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.car_joints import JointRoles, freedom_of, joint_text, joints_of
from models.own_model.names import moving_bodies
from models.own_model.wheel_sites import SAME_AXLE_DISTANCE, WheelSite
from models.own_model.xml_guard import ModelXml
from models.vehicles.spatial import FREEDOMS, Body, Freedom, Vector, point_mass_inertia

REVOLUTION_TOLERANCE = 1e-9
"""Share of a wheel's inertia by which it may differ from the inertia of a body of revolution about its axle."""
CENTRE_TOLERANCE = 1e-12
"""Distance (m) up to which a hinge counts as being in a body's centre of mass."""


class MassProperties(NamedTuple):
    """Mass properties of a rigid body: mass (kg), centre (3,) in the design position (m), inertia (3, 3) about it in
    the vehicle's axes (kg m^2)."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray


@dataclass(frozen=True)
class CarBodies:
    """Bodies of a car in the description of a vehicle, and where the file's bodies and joints are in it.

    bodies : parents before children; chassis : its name; body_names : for each body of the file, by number, the name of
    the body that contains it; coordinates : of the suspension's joints, by number, with the signs of their axes;
    spin_inertia : inertia about the axle (kg m^2) of every spinning wheel, by the name of its tyre.
    """

    bodies: tuple[Body, ...]
    chassis: str
    body_names: dict[int, str]
    coordinates: dict[int, tuple[tuple[str, Freedom], float]]
    spin_inertia: dict[str, float]


@dataclass
class _JointSegment:
    """Consecutive freedoms of a body that one joint of the description can have; anchor : common point of the hinges
    among them."""

    freedoms: list[Freedom] = field(default_factory=list)
    joints: list[tuple[int, Freedom, float]] = field(default_factory=list)
    anchor: np.ndarray | None = None

    def accepts(self, freedom: Freedom, hinge_anchor: np.ndarray) -> bool:
        """Whether the body's next joint in the file can belong to this segment."""
        order = FREEDOMS.index
        if self.freedoms and order(freedom) <= order(self.freedoms[-1]):
            return False
        return (
            freedom[0] != "r"
            or self.anchor is None
            or bool(np.abs(hinge_anchor - self.anchor).max() <= CENTRE_TOLERANCE)
        )

    def add(self, joint: int, freedom: Freedom, sign: float, hinge_anchor: np.ndarray) -> None:
        """Add a joint to the segment."""
        self.freedoms.append(freedom)
        self.joints.append((joint, freedom, sign))
        if freedom[0] == "r":
            self.anchor = hinge_anchor


def car_bodies(
    mujoco_model: mujoco.MjModel,
    design_data: mujoco.MjData,
    roles: JointRoles,
    model_xml: ModelXml,
    reserved_names: Collection[str],
) -> CarBodies:
    """Bodies of a car from an MJCF model. Raises InputError for joints with oblique axes, and for wheels with
    imbalance.

    design_data : data of the model in the design position, with kinematics computed; reserved_names : names for other
    bodies."""
    return _CarBuilder(mujoco_model, design_data, roles, model_xml, reserved_names).build()


class _CarBuilder:
    """Merges the bodies of one MJCF file into the bodies of the description."""

    def __init__(
        self,
        mujoco_model: mujoco.MjModel,
        design_data: mujoco.MjData,
        roles: JointRoles,
        model_xml: ModelXml,
        reserved_names: Collection[str],
    ) -> None:
        self.model, self.design, self.roles, self.document, self.reserved = (
            mujoco_model,
            design_data,
            roles,
            model_xml,
            reserved_names,
        )
        self.leaders = dict[int, int]()
        for b in moving_bodies(mujoco_model):
            above = self.leaders.get(int(mujoco_model.body_parentid[b]))
            joined = b in roles.chassis[1:] or (above is not None and not self._suspension_joints(b))
            self.leaders[b] = above if joined and above is not None else b
        self.spin_inertia = dict[str, float]()
        self.masses: dict[int, list[MassProperties]] = {leader: [] for leader in self.leaders.values()}
        spinning = self._spinning_bodies()
        for b, leader in self.leaders.items():
            if b not in spinning:
                self.masses[leader].append(self._mass(b))

    def build(self) -> CarBodies:
        """All bodies of the car."""
        bodies, coordinates, names = list[Body](), dict[int, tuple[tuple[str, Freedom], float]](), dict[int, str]()
        for leader, masses in self.masses.items():
            names[leader] = self._name(leader)
            whole, above = combined_mass(masses), self.leaders.get(int(self.model.body_parentid[leader]))
            if leader in self.roles.chassis:
                bodies.append(_body_from_segment(names[leader], whole, FREEDOMS, None))
                continue
            assert above is not None
            segments = self._segments(leader)
            bodies += _bodies_of_joints(names[leader], names[above], segments, whole, coordinates)
        named = {b: names[leader] for b, leader in self.leaders.items()}
        return CarBodies(tuple(bodies), names[self.roles.chassis[0]], named, coordinates, self.spin_inertia)

    def _suspension_joints(self, body: int) -> list[int]:
        """Joints of a body that belong to the suspension, by number."""
        left_out = {*self.roles.spin, *self.roles.steer}
        return [j for j in joints_of(self.model, body) if j not in left_out] if body not in self.roles.chassis else []

    def _name(self, leading_body: int) -> str:
        """Name of the combined body: that of its leading body, or for the chassis that of its heaviest body."""
        body = max(
            self.roles.chassis if leading_body in self.roles.chassis else (leading_body,), key=self.model.body_mass.item
        )
        name: str = self.model.body(body).name or f"body {body}"
        return f"{name} of the file" if name in self.reserved else name

    def _mass(self, body: int) -> MassProperties:
        axes = self.design.ximat[body].reshape(3, 3)
        inertia = axes * self.model.body_inertia[body] @ axes.T
        return MassProperties(float(self.model.body_mass[body]), self.design.xipos[body].copy(), inertia)

    def _spinning_bodies(self) -> set[int]:
        """Bodies that spin with the wheels, by number. Their inertia about the axle is removed from the masses, because
        it counts as the wheel's spin inertia."""
        spinning = set[int]()
        for joint, wheel in self.roles.spin.items():
            body = int(self.model.jnt_bodyid[joint])
            turned = [b for b in self.leaders if self._rides_on_suspension(b, body)]
            behind = [j for b in turned for j in joints_of(self.model, b) if j > joint]
            if behind:
                said = f"lies behind {joint_text(self.model, self.document, joint)}, which spins a wheel: nothing may"
                raise InputError(self.document.path.name, joint_text(self.model, self.document, behind[0]), None, said)
            whole = combined_mass([self._mass(b) for b in turned])
            self._check_round(whole, wheel, joint)
            self.spin_inertia[wheel.name] = float(whole.inertia[1, 1])
            inertia = whole.inertia.copy()
            inertia[1] = inertia[:, 1] = 0.0
            self.masses[self.leaders[body]].append(whole._replace(inertia=inertia))
            spinning.update(turned)
        return spinning

    def _rides_on_suspension(self, body: int, carrier: int) -> bool:
        while body and body != carrier:
            body = int(self.model.body_parentid[body])
        return body == carrier

    def _check_round(self, mass_properties: MassProperties, wheel: WheelSite, joint: int) -> None:
        """Refuse a wheel with imbalance, which would shake as it spins."""
        inertia, beside = mass_properties.inertia, np.abs((mass_properties.centre - wheel.point)[[0, 2]]).max()
        uneven = np.abs([inertia[0, 0] - inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]).max()
        if (
            mass_properties.mass and (beside > SAME_AXLE_DISTANCE or uneven > REVOLUTION_TOLERANCE * np.trace(inertia))
        ) or not inertia[1, 1] > 0.0:
            said = (
                f"spins {wheel.name!r}, whose mass must be one of revolution about the axle: its centre is "
                f"{beside:.3g} m off, its inertia {np.round(inertia, 9).tolist()} kg m^2"
            )
            raise InputError(self.document.path.name, joint_text(self.model, self.document, joint), None, said)

    def _segments(self, leading_body: int) -> list[_JointSegment]:
        segments = [_JointSegment()]
        for joint in self._suspension_joints(leading_body):
            known, anchor = freedom_of(self.model, self.design, joint), self.design.xanchor[joint].copy()
            if known is None:
                axis = np.round(self.design.xaxis[joint], 9).tolist()
                said = "is no hinge or slide along x, y or z of the vehicle: the suspension of a car has no others"
                raise InputError(self.document.path.name, joint_text(self.model, self.document, joint), axis, said)
            if not segments[-1].accepts(known[0], anchor):
                segments.append(_JointSegment())
            segments[-1].add(joint, *known, anchor)
        return segments


def combined_mass(masses: list[MassProperties]) -> MassProperties:
    """Mass, centre and inertia of a rigid body that consists of all the given ones."""
    if len(masses) == 1:
        return masses[0]
    total = sum(each.mass for each in masses)
    shares = [each.mass / total if total else 1.0 / len(masses) for each in masses]
    centre = np.sum([share * each.centre for share, each in zip(shares, masses, strict=True)], axis=0)
    inertia = np.sum([each.inertia + point_mass_inertia(each.mass, each.centre - centre) for each in masses], axis=0)
    return MassProperties(total, centre, inertia)


def _bodies_of_joints(
    body_name: str,
    carrier_name: str,
    segments: list[_JointSegment],
    mass_properties: MassProperties,
    joint_coordinates: dict[int, tuple[tuple[str, Freedom], float]],
) -> Iterator[Body]:
    """Bodies of the description for one body of the file and its joints; fills ``joint_coordinates`` with the names
    that the joints have in the description."""
    for number, segment in enumerate(segments):
        last, at = number == len(segments) - 1, segment.anchor
        itself = last and (at is None or np.abs(at - mass_properties.centre).max() <= CENTRE_TOLERANCE)
        link = body_name if itself else f"{body_name} joint {number + 1}"
        joint_coordinates |= {joint: ((link, freedom), sign) for joint, freedom, sign in segment.joints}
        if itself:
            yield _body_from_segment(body_name, mass_properties, tuple(segment.freedoms), carrier_name)
            return
        yield Body(
            link,
            0.0,
            _vector_of(mass_properties.centre if at is None else at),
            tuple(segment.freedoms),
            parent=carrier_name,
        )
        carrier_name = link
    yield _body_from_segment(body_name, mass_properties, (), carrier_name)


def _body_from_segment(
    body_name: str, mass_properties: MassProperties, freedoms: tuple[Freedom, ...], parent_name: str | None
) -> Body:
    x, y, z = map(_vector_of, mass_properties.inertia)
    return Body(body_name, mass_properties.mass, _vector_of(mass_properties.centre), freedoms, (x, y, z), parent_name)


def _vector_of(components: np.ndarray) -> Vector:
    x, y, z = np.asarray(components, float).tolist()
    return x, y, z
