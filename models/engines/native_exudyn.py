"""Springs, dampers, mounts and bars as Exudyn's native elements: connectors between coordinates, and along an axis.

A travel that is a sum of coordinates is a spring-damper between two of them, or a matrix where it is one of more. A
travel along an axis that is fixed in a turning body has no connector that is exact: Exudyn takes axes as they lie in
the space. So what the body carries is hung up a second time, as a tree of the same coordinates on the ground: there the
body stands still, and a connector from the ground along a fixed axis is exact. Its links have next to no mass. Every
point of it costs a walk through the tree, so the springs of a mount, along x, y and z at one place, are one connector.

Names of these objects are those of the elements.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from models.engines.exudyn_system import items, lists
from models.engines.exudyn_tree import JOINT_TYPES, TreeBuild
from models.engines.native_parts import (
    FULL_FRICTION_SPEED,
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
from models.vehicles.free_vehicle import joint_table, last_coordinate_and_joint

Axial = tuple[CutVehicleElement, AxialTravel]
"""An element with its travel along an axis."""
LINK_MASS = 1e-15
"""Mass (kg) and inertia (kg m^2) of a link of an additional tree: Exudyn divides by them, and the vehicle must not feel
them."""
LAW_PREFIX, ROTOR_PREFIX, NAME_SEPARATOR = "native law: ", "rotors: ", "; "
"""Beginnings of the names of objects (springs, rotors), and the separator of several element names in one object's
name."""


def add_parts(tree_build: TreeBuild, exudyn_node: Any, native_parts: Sequence[NativePart]) -> None:
    """Add all native parts to an Exudyn system with one tree, whose coordinates are in ``exudyn_node``."""
    coordinates, trees, axial = (
        CoordinateConnectors(tree_build, exudyn_node),
        _AxisFrameTrees(tree_build, exudyn_node),
        list[Axial](),
    )
    for part in native_parts:
        if isinstance(part.travel, CoordinateTravel):
            coordinates.add(part.element, part.travel)
        else:
            axial.append((part.element, part.travel))
    for group in _groups_at_one_place(axial):
        trees.add(group)


def add_rotors(tree_build: TreeBuild, exudyn_node: Any, rotors: Sequence[tuple[str, CoordinateTravel, float]]) -> None:
    """Add inertias (kg, kg m^2) that move with sums of coordinates, as one mass matrix in addition to the tree's."""
    size = tree_build.size(exudyn_node)
    mass = np.zeros((size, size))
    for _, travel, inertia in rotors:
        row = np.zeros(size)
        row[list(travel.coordinates)] = travel.factors
        mass += inertia * np.outer(row, row)
    if rotors:
        names = ROTOR_PREFIX + NAME_SEPARATOR.join(_without_separator(name) for name, _, _ in rotors)
        nothing = np.zeros((size, size))
        matrices = {"massMatrix": mass, "stiffnessMatrix": nothing, "dampingMatrix": nothing}
        tree_build.mbs.AddObject(
            items.ObjectGenericODE2(name=names, nodeNumbers=[exudyn_node], forceVector=np.zeros(size), **matrices)
        )


def add_ground_spring(tree_build: TreeBuild, ground_spring: GroundSpring) -> None:
    """Add a spring-damper between the ground and a body's point along the axes of space, and the load at this point."""
    foot, tip = (
        tree_build.marker(None, ground_spring.anchor),
        tree_build.marker(ground_spring.body, ground_spring.point),
    )
    if any(ground_spring.stiffness + ground_spring.damping):
        tree_build.spring(foot, tip, stiffness=ground_spring.stiffness, damping=ground_spring.damping)
    if np.any(ground_spring.load):
        tree_build.mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=ground_spring.load))


def add_line_spring(tree_build: TreeBuild, line_spring: LineSpring) -> None:
    """Add a spring-damper along the line between two points. Exudyn needs a free length above 0; a constant force
    compensates for it."""
    length = line_spring.length if line_spring.length > 0.0 else 1.0
    tree_build.mbs.AddObject(
        items.SpringDamper(
            markerNumbers=[tree_build.marker(*end) for end in line_spring.ends],
            referenceLength=length,
            stiffness=line_spring.stiffness,
            damping=line_spring.damping,
            force=line_spring.stiffness * (length - line_spring.length),
        )
    )


def add_body_load(tree_build: TreeBuild, body_load: BodyLoad) -> None:
    """Add a force and a moment that turn with a body."""
    marker, axes = tree_build.marker(body_load.body, body_load.point, True), {"bodyFixed": True}
    force, moment = (tree_build.in_body_axes(body_load.body, vector) for vector in (body_load.force, body_load.moment))
    if force.any():
        tree_build.mbs.AddLoad(items.LoadForceVector(markerNumber=marker, loadVector=force, **axes))
    if moment.any():
        tree_build.mbs.AddLoad(items.LoadTorqueVector(markerNumber=marker, loadVector=moment, **axes))


def add_turning_spring(tree_build: TreeBuild, turning_spring: TurningSpring) -> None:
    """Add a rotational spring-damper between frames of two bodies; it measures the rotation as a vector, not by
    angles."""
    ends = zip(turning_spring.bodies, turning_spring.axes, strict=True)
    places = {
        body: (0.0, 0.0, 0.0) if body is None else tree_build.vehicle.body(body).position
        for body in turning_spring.bodies
    }
    turning = np.diag((0.0, 0.0, 0.0, 1.0, 1.0, 1.0))
    tree_build.mbs.AddObject(
        items.RigidBodySpringDamper(
            markerNumbers=[tree_build.frame_marker(body, places[body], axes) for body, axes in ends],
            stiffness=turning_spring.stiffness * turning,
            damping=turning_spring.damping * turning,
            useIntrinsicFormulation=True,
        )
    )


def add_connection(tree_build: TreeBuild, connection: Connection) -> None:
    """Add a spherical joint between points of two bodies, or a rigid joint between frames of both."""
    if connection.axes is None:
        markers = [tree_build.marker(*end) for end in connection.ends]
        tree_build.mbs.AddObject(items.ObjectJointSpherical(markerNumbers=markers))
        return
    ends = zip(connection.ends, connection.axes, strict=True)
    markers = [tree_build.frame_marker(*end, axes) for end, axes in ends]
    tree_build.mbs.AddObject(items.ObjectJointGeneric(markerNumbers=markers, constrainedAxes=[1] * 6))


def built_elements(mbs: Any, element_names: Sequence[str]) -> tuple[str, ...]:
    """Names of the given elements for which an assembled Exudyn system has an object."""
    objects = [mbs.GetObject(i)["name"] for i in range(mbs.systemData.NumberOfObjects())]
    listed = {
        name
        for each in objects
        if each.startswith(LAW_PREFIX)
        for name in each.removeprefix(LAW_PREFIX).split(NAME_SEPARATOR)
    }
    return tuple(name for name in element_names if _without_separator(name) in listed)


def _object_name(*element_names: CutVehicleElement) -> str:
    """Name of the Exudyn object that represents these elements."""
    return LAW_PREFIX + NAME_SEPARATOR.join(_without_separator(element.name) for element in element_names)


def _without_separator(element_name: str) -> str:
    """An element's name without the separator that stands between names."""
    return element_name.replace(NAME_SEPARATOR, " ")


def _groups_at_one_place(native_parts: Sequence[Axial]) -> list[list[Axial]]:
    """Groups of parts that one connector can represent: along different axes x, y, z at the same points. Every other
    part is a group by itself."""
    groups = dict[object, list[Axial]]()
    for i, (element, travel) in enumerate(native_parts):
        places = (travel.frame, travel.body, *travel.foot, *travel.tip)
        key: object = places if np.count_nonzero(travel.axis) == 1 else i
        if any(np.any(travel.axis * other.axis) for _, other in groups.get(key, ())):
            key = i
        groups.setdefault(key, []).append((element, travel))
    return list(groups.values())


def _stiffness_and_damping(element: CutVehicleElement) -> dict[str, float]:
    """Stiffness and damping of an element, as arguments of an Exudyn item."""
    return {"stiffness": element.stiffness, "damping": element.damping}


def _preload_travel(element: CutVehicleElement) -> float:
    """Travel of a spring at which its force equals its preload."""
    return element.preload / element.stiffness if element.stiffness else 0.0


def _connector_law(axial_parts: Sequence[Axial]) -> dict[str, Any]:
    """Name, stiffness, damping and offset (3,) of one connector for parts along different axes; a part's axis may point
    backwards."""
    stiffness, damping, offset = np.zeros((3, 3))
    for element, travel in axial_parts:
        stiffness += element.stiffness * travel.axis**2
        damping += element.damping * travel.axis**2
        offset += (travel.design - _preload_travel(element)) * travel.axis
    names = _object_name(*(element for element, _ in axial_parts))
    return {"name": names, "stiffness": stiffness, "damping": damping, "offset": offset}


class CoordinateConnectors:
    """Builder of connectors and constraints between coordinates of one Exudyn node."""

    def __init__(self, tree_build: TreeBuild, exudyn_node: Any) -> None:
        self.built, self.node, self.markers = tree_build, exudyn_node, dict[int, Any]()

    def add(self, element: CutVehicleElement, coordinate_travel: CoordinateTravel) -> None:
        """Add one connector for an element, or a matrix object where more than two coordinates take part."""
        if len(coordinate_travel.coordinates) > 2:
            return self._add_matrix(element, coordinate_travel)
        if not coordinate_travel.coordinates:
            return
        if element.preload and not element.stiffness:
            self._add_loads(element, coordinate_travel)
        first, *others = [self._marker(i) for i in coordinate_travel.coordinates]
        factor, *rest = coordinate_travel.factors
        other, against = (others[0], -rest[0]) if others else (self._ground_marker(), 1.0)
        self.built.mbs.AddObject(
            items.CoordinateSpringDamperExt(
                name=_object_name(element),
                markerNumbers=[other, first],
                factor0=against,
                factor1=factor,
                offset=-_preload_travel(element),
                **_stiffness_and_damping(element),
            )
        )

    def add_friction(self, friction: DryFriction) -> None:
        """Add dry friction of a coordinate against the ground."""
        markers, law = (
            [self._ground_marker(), self._marker(friction.coordinate)],
            {"frictionProportionalZone": FULL_FRICTION_SPEED},
        )
        self.built.mbs.AddObject(
            items.CoordinateSpringDamperExt(markerNumbers=markers, dynamicFrictionForce=friction.force, **law)
        )

    def add_coupling(self, coupling: Coupling) -> None:
        """Add a rigid constraint between coordinates; Exudyn's form is factor1 q1 - q0 - offset = 0."""
        driver = self._ground_marker() if coupling.driver is None else self._marker(coupling.driver)
        markers = [self._marker(coupling.driven), driver]
        self.built.mbs.AddObject(
            items.CoordinateConstraint(markerNumbers=markers, factor1=coupling.ratio, offset=-coupling.offset)
        )

    def _add_loads(self, element: CutVehicleElement, coordinate_travel: CoordinateTravel) -> None:
        """Add the constant force of an element as loads, since a spring without stiffness has none."""
        for coordinate, factor in zip(coordinate_travel.coordinates, coordinate_travel.factors, strict=True):
            load = items.LoadCoordinate(markerNumber=self._marker(coordinate), load=-factor * element.preload)
            self.built.mbs.AddLoad(load)

    def _add_matrix(self, element: CutVehicleElement, coordinate_travel: CoordinateTravel) -> None:
        """Add an element whose travel is a sum of more than two coordinates, as a stiffness and damping matrix."""
        row = np.zeros(self.built.size(self.node))
        row[list(coordinate_travel.coordinates)] = coordinate_travel.factors
        self.built.mbs.AddObject(
            items.ObjectGenericODE2(
                name=_object_name(element),
                nodeNumbers=[self.node],
                massMatrix=np.zeros((row.size, row.size)),
                stiffnessMatrix=element.stiffness * np.outer(row, row),
                dampingMatrix=element.damping * np.outer(row, row),
                forceVector=-element.preload * row,
            )
        )

    def _marker(self, coordinate_index: int) -> Any:
        """Marker of a coordinate, made once."""
        if coordinate_index not in self.markers:
            self.markers[coordinate_index] = self.built.coordinate(self.node, coordinate_index)
        return self.markers[coordinate_index]

    def _ground_marker(self) -> Any:
        """Marker of a coordinate that is fixed to the ground, made once."""
        if -1 not in self.markers:
            self.markers[-1] = self.built.coordinate(self.built.mbs.AddNode(items.NodePointGround()), 0)
        return self.markers[-1]


class _AxisFrameTrees:
    """Additional trees of links, one for each body in which axes of connectors are fixed, and connectors from the
    ground to them."""

    def __init__(self, tree_build: TreeBuild, exudyn_node: Any) -> None:
        self.built, self.node, self.trees = tree_build, exudyn_node, dict[str, Any]()

    def add(self, axial_parts: Sequence[Axial]) -> None:
        """Add one connector for a group of parts, from the foot's position on the ground to the tip."""
        (element, travel), *others = axial_parts
        mbs, (link, origin) = self.built.mbs, last_coordinate_and_joint(self.built.vehicle, travel.body)
        foot = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=self.built.ground, localPosition=travel.foot.tolist()))
        tip = mbs.AddMarker(
            items.MarkerKinematicTreeRigid(
                objectNumber=self._tree(travel.frame),
                linkNumber=link,
                localPosition=np.subtract(travel.tip, origin).tolist(),
            )
        )
        if others or np.count_nonzero(travel.axis) == 1:
            mbs.AddObject(items.CartesianSpringDamper(markerNumbers=[foot, tip], **_connector_law(axial_parts)))
            return
        mbs.AddObject(
            items.LinearSpringDamper(
                name=_object_name(element),
                markerNumbers=[foot, tip],
                axisMarker0=travel.axis.tolist(),
                offset=travel.design - _preload_travel(element),
                **_stiffness_and_damping(element),
            )
        )

    def _tree(self, frame_body: str) -> Any:
        """Tree of the links that a body carries, attached to the ground where the body is in the design position; made
        once per body."""
        if frame_body not in self.trees:
            self.trees[frame_body] = self.built.mbs.AddObject(self._new_tree(frame_body))
        return self.trees[frame_body]

    def _new_tree(self, frame_body: str) -> Any:
        """Exudyn item of the tree of links that a body carries."""
        vehicle = self.built.vehicle
        rows, places = joint_table(vehicle), vehicle.coordinates()
        parents, offsets = rows[:, 1].astype(int), rows[:, 2:].copy()
        for i, (name, _) in enumerate(places):
            carried = frame_body in vehicle.chain(name)[1:]
            if not carried or (vehicle.body(name).parent == frame_body and places[i - 1][0] != name):
                parents[i], offsets[i] = -1, vehicle.body(name).position
        count = len(places)
        return items.ObjectKinematicTree(
            nodeNumber=self.node,
            gravity=[0, 0, 0],
            jointTypes=[JOINT_TYPES[freedom] for _, freedom in places],
            linkParents=parents.tolist(),
            jointTransformations=lists.Matrix3DList([np.eye(3)] * count),
            jointOffsets=lists.Vector3DList(list(offsets)),
            linkInertiasCOM=lists.Matrix3DList([LINK_MASS * np.eye(3)] * count),
            linkCOMs=lists.Vector3DList([np.zeros(3)] * count),
            linkMasses=[LINK_MASS] * count,
        )
