"""Bodies of a spatial vehicle in Exudyn: kinematic trees, sliders, and markers of points on bodies.

A body without parent and all that ride on it are one tree with a link per coordinate; only the last link of a body has
mass. (Rigid bodies whose missing freedoms are constrained would be wrong: the explicit solvers drop constrained rows
after solving with the full mass matrix, which couples them.)
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import exudyn as exu
import numpy as np

from models.engines.exudyn_system import KINDS, items, lists
from models.vehicles.free_vehicle import freedom_axes, joint_table, last_coordinate_and_joint
from models.vehicles.spatial import FREEDOMS, Body, SpatialVehicle, Vector, point_mass_inertia
from models.vehicles.spatial_linear import Preloads

JOINT_TYPES = {
    freedom: getattr(exu.JointType, f"{'Revolute' if freedom.startswith('r') else 'Prismatic'}{freedom[-1].upper()}")
    for freedom in FREEDOMS
}
"""Exudyn's joint type of each freedom."""
SLIDER_AXES = {
    "x": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "y": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "z": [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
}
"""Axes of a body with one sliding freedom, as columns: the first lies along the slide."""


@dataclass
class TreeBuild:
    """Exudyn's system of a spatial vehicle while it is being built.

    links: (object, last link or None, where its joint is) of every body; coordinate_nodes: (node, index within it) of
    every coordinate; markers by body and point; frames: axes (3, 3) of the last link of every body as columns.
    """

    vehicle: SpatialVehicle
    mbs: Any
    preloads: Preloads
    ground: Any
    links: dict[str, tuple[Any, int | None, Vector]] = field(default_factory=dict)
    coordinate_nodes: dict[tuple[str, str], tuple[Any, int]] = field(default_factory=dict)
    markers: dict[tuple[str | None, Vector, bool], Any] = field(default_factory=dict)
    frames: dict[str, np.ndarray] = field(default_factory=dict)
    callbacks: int = 0

    def marker(self, body: str | None, point: Vector, with_rotation: bool = False) -> Any:
        """Marker of a point (m) on a body, made once. ``with_rotation``: whether the body's axes or rotation are needed
        as well."""
        apart = with_rotation and body is not None and self.links[body][1] is None
        key = (body, point, apart or (body, point, True) in self.markers)
        if key not in self.markers:
            self.markers[key] = self.mbs.AddMarker(self._new_marker(*key))
        return self.markers[key]

    def _new_marker(self, body: str | None, point: Vector, with_rotation: bool) -> Any:
        """Exudyn item of a marker of a point (m) on a body; None means the ground."""
        if body is None:
            return items.MarkerBodyRigid(bodyNumber=self.ground, localPosition=list(point))
        tree, link, origin = self.links[body]
        local = self.in_body_axes(body, np.subtract(point, origin))
        if link is None:
            kind = items.MarkerBodyRigid if with_rotation else items.MarkerBodyPosition
            return kind(bodyNumber=tree, localPosition=local)
        return items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=local)

    def frame_marker(self, body: str | None, point: Vector, axes: np.ndarray) -> Any:
        """Marker of a point (m) on a body with axes (3, 3), as columns in the design position; only for bodies in trees
        and the ground."""
        if body is None:
            frame = lists.HT(rotation=axes.tolist(), translation=list(point))
            return self.mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=self.ground, localHT=frame))
        tree, link, origin = self.links[body]
        local = self.in_body_axes(body, np.subtract(point, origin))
        frame = lists.HT(rotation=(self.frames[body].T @ axes).tolist(), translation=local.tolist())
        return self.mbs.AddMarker(items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localHT=frame))

    def reader(self, body: str, freedom: str, variable_type: Any = KINDS.Coordinates) -> Callable[[], float]:
        """Function that reads a body's coordinate, or its rate, at the current stage; it returns 0 if the body does not
        have the coordinate."""
        if (body, freedom) not in self.coordinate_nodes:
            return lambda: 0.0
        read, (node, index) = self.mbs.GetNodeOutput, self.coordinate_nodes[body, freedom]
        if self.size(node) == 1:  # Exudyn gives a number, no array
            return lambda: read(node, variable_type)
        return lambda: read(node, variable_type)[index]

    def size(self, exudyn_node: Any) -> int:
        """Number of coordinates of a node."""
        return sum(exudyn_node == each for each, _ in self.coordinate_nodes.values())

    def in_body_axes(self, body: str | None, design_vector: np.ndarray) -> np.ndarray:
        """A vector (3,), given in the design position along the axes of space, in the axes that Exudyn uses for a
        body."""
        if body is None:
            return design_vector
        if self.links[body][1] is not None:
            return self.frames[body].T @ design_vector
        return np.array(SLIDER_AXES[self.vehicle.body(body).freedoms[0]]).T @ design_vector

    def coordinate(self, exudyn_node: Any, coordinate_index: int) -> Any:
        """Marker of one coordinate of a node."""
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=exudyn_node, coordinate=coordinate_index))

    def spring(self, first_marker: Any, second_marker: Any, **spring_law: Any) -> None:
        """Add a native spring-damper between two points along the axes of space, or one whose force is a function of
        position and speed."""
        self.mbs.AddObject(items.CartesianSpringDamper(markerNumbers=[first_marker, second_marker], **spring_law))
        self.callbacks += "springForceUserFunction" in spring_law

    def connect(
        self, connector_name: str, first_marker: Any, second_marker: Any, force_law: Callable[[Any, Any], list[float]]
    ) -> None:
        """Connect two points by a force law. The force on the first point (N, axes of space) depends on the second
        point's relative position and velocity."""
        self.spring(
            first_marker,
            second_marker,
            name=connector_name,
            springForceUserFunction=lambda mbs, t, item, apart, rate, k, d, offset: force_law(apart, rate),
        )


@dataclass
class Link:
    """Mass carried by one joint of a tree. ``centre`` (m) is measured from the joint, ``inertia`` (kg m^2) is about the
    centre."""

    mass: float = 0.0
    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))

    def load(self, body: Body, mass_centre: np.ndarray) -> None:
        """Add a body's mass and inertia to the link, with the body's centre of mass at ``mass_centre`` (m)."""
        mass = self.mass + body.mass
        centre = (self.mass * self.centre + body.mass * mass_centre) / mass if mass else mass_centre
        self.inertia = (
            self.inertia
            + point_mass_inertia(self.mass, self.centre - centre)
            + np.array(body.inertia, float)
            + point_mass_inertia(body.mass, mass_centre - centre)
        )
        self.mass, self.centre = mass, centre


def add_tree(tree_build: TreeBuild, bodies: list[Body]) -> None:
    """Add a body without parent and all bodies that it carries: a link per coordinate, the mass of each body on its
    last link.

    A rider without freedoms adds its mass to the last link of what it rides on.
    """
    part = replace(tree_build.vehicle, bodies=tuple(bodies))
    rows, places, ends = (
        joint_table(part),
        part.coordinates(),
        {body.name: last_coordinate_and_joint(part, body.name) for body in bodies},
    )
    links, zero = [Link() for _ in places], [0.0] * len(places)
    axes, below = freedom_axes(part), rows[:, 1].astype(int)
    base = np.array([axes[i] if i >= 0 else np.eye(3) for i in below])
    for body in bodies:
        last, origin = ends[body.name]
        links[last].load(body, np.subtract(body.position, origin))
    node = tree_build.mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=zero,
            initialCoordinates=zero,
            initialCoordinates_t=zero,
            numberOfODE2Coordinates=len(links),
        )
    )
    tree = tree_build.mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            gravity=[0, 0, -tree_build.vehicle.gravity],
            jointTypes=[JOINT_TYPES[freedom] for _, freedom in places],
            linkParents=below.tolist(),
            jointTransformations=lists.Matrix3DList([b.T @ a for a, b in zip(axes, base, strict=True)]),
            jointOffsets=lists.Vector3DList([b.T @ arm for arm, b in zip(rows[:, 2:], base, strict=True)]),
            linkInertiasCOM=lists.Matrix3DList([a.T @ link.inertia @ a for a, link in zip(axes, links, strict=True)]),
            linkCOMs=lists.Vector3DList([a.T @ link.centre for a, link in zip(axes, links, strict=True)]),
            linkMasses=[link.mass for link in links],
        )
    )
    tree_build.links |= {name: (tree, *end) for name, end in ends.items()}
    tree_build.frames |= {name: axes[end[0]] for name, end in ends.items()}
    tree_build.coordinate_nodes |= {place: (node, i) for i, place in enumerate(places)}


def add_slider(tree_build: TreeBuild, body: Body) -> None:
    """Add a body on the ground that has one sliding coordinate and carries no other body. As trees of one link, the
    bodies of a car would take 1.6 times as long."""
    still, (freedom,) = [0.0], body.freedoms
    node = tree_build.mbs.AddNode(
        items.Node1D(referenceCoordinates=still, initialCoordinates=still, initialVelocities=still)
    )
    mass = tree_build.mbs.AddObject(
        items.Mass1D(
            nodeNumber=node,
            mass=body.mass,
            referencePosition=list(body.position),
            referenceRotation=SLIDER_AXES[freedom],
        )
    )
    tree_build.links[body.name], tree_build.coordinate_nodes[body.name, freedom] = (
        (mass, None, body.position),
        (node, 0),
    )
    if freedom == "z" and tree_build.vehicle.gravity:
        tree_build.mbs.AddLoad(
            items.LoadCoordinate(
                markerNumber=tree_build.coordinate(node, 0), load=-body.mass * tree_build.vehicle.gravity
            )
        )
