"""A vehicle in space as Exudyn's items: kinematic trees, native spring-dampers between points, user functions.

A body without parent and all that ride on it are one tree with a link per coordinate; only the last link of a body has
mass. (Rigid bodies whose missing freedoms are constrained would be wrong: the explicit solvers drop constrained rows
after solving with the full mass matrix, which couples them.) What Exudyn has no item for is a function in Python:
curves and friction, inclined axes between two bodies that turn, anti-roll bars, side forces, the road.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import exudyn.itemInterface as typed_items
import numpy as np

from models.vehicles.spatial import (
    FREEDOMS,
    AntiRollBar,
    Body,
    PointOutput,
    SideForce,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
    Vector,
)
from models.vehicles.spatial_linear import Preloads, preloads

exu.config.printToConsole = False
KINDS = exu.OutputVariableType
lists: Any = exu
items: Any = typed_items
"""Exudyn's type hints know neither how its lists are made nor that a function is a user function."""
JOINTS = dict(
    zip(
        FREEDOMS,
        (
            exu.JointType.PrismaticX,
            exu.JointType.PrismaticY,
            exu.JointType.PrismaticZ,
            exu.JointType.RevoluteX,
            exu.JointType.RevoluteY,
            exu.JointType.RevoluteZ,
        ),
        strict=True,
    )
)


SLIDES = dict(
    zip(
        FREEDOMS,
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [[0, 0, -1], [0, 1, 0], [1, 0, 0]]),
        strict=False,
    )
)
"""Where a body of one slide has its own axes: its first one lies along the slide."""


@dataclass
class RoadForces:
    """What callbacks hand over: lists of forces at every half step, ``by_road`` (2 w, k) of heights and rates."""

    by_road: np.ndarray
    rows: list[list[float]]


@dataclass
class RoadTable:
    """Heights (m) under the tyres, then their rates (m/s), ``per_time`` rows in a second, and all forces of them."""

    rows: np.ndarray
    per_time: float
    read: list[RoadForces] = field(default_factory=list)

    def forces(self, by_road: np.ndarray) -> RoadForces:
        """Forces by the road, for one callback."""
        self.read.append(RoadForces(by_road, (self.rows @ by_road).tolist()))
        return self.read[-1]

    @contextmanager
    def still(self, row: np.ndarray) -> Iterator[None]:
        """One row of the road at every time."""
        kept, per_time, self.per_time = [one.rows for one in self.read], self.per_time, 0.0
        for one in self.read:
            one.rows = [(row @ one.by_road).tolist()]
        try:
            yield
        finally:
            self.per_time = per_time
            for one, rows in zip(self.read, kept, strict=True):
                one.rows = rows


@dataclass
class Build:
    """Exudyn's system while it is put together.

    links: (object, last link or None, where its joint is) of every body; places: (node, index within it) of every
    coordinate; markers by body and point.
    """

    vehicle: SpatialVehicle
    mbs: Any
    held: Preloads
    ground: Any
    links: dict[str, tuple[Any, int | None, Vector]] = field(default_factory=dict)
    places: dict[tuple[str, str], tuple[Any, int]] = field(default_factory=dict)
    markers: dict[tuple[str | None, Vector, bool], Any] = field(default_factory=dict)
    callbacks: int = 0

    def marker(self, body: str | None, point: Vector, turning: bool = False) -> Any:
        """Marker of a point, made once; ``turning``: it is asked for its axes or its turning, too."""
        apart = turning and body is not None and self.links[body][1] is None
        key = (body, point, apart or (body, point, True) in self.markers)
        if key not in self.markers:
            self.markers[key] = self.mbs.AddMarker(self._new_marker(*key))
        return self.markers[key]

    def _new_marker(self, body: str | None, point: Vector, turning: bool) -> Any:
        if body is None:
            return items.MarkerBodyRigid(bodyNumber=self.ground, localPosition=list(point))
        tree, link, origin = self.links[body]
        local = self.own(body, np.subtract(point, origin))
        if link is None:
            kind = items.MarkerBodyRigid if turning else items.MarkerBodyPosition
            return kind(bodyNumber=tree, localPosition=local)
        return items.MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=link, localPosition=local)

    def reader(self, body: str, freedom: str, kind: Any = KINDS.Coordinates) -> Callable[[], float]:
        """Function that reads a coordinate, or its rate, at the stage; 0 where the body does not have it."""
        if (body, freedom) not in self.places:
            return lambda: 0.0
        read, (node, index) = self.mbs.GetNodeOutput, self.places[body, freedom]
        if sum(node == own for own, _ in self.places.values()) == 1:  # Exudyn gives a number, no array
            return lambda: read(node, kind)
        return lambda: read(node, kind)[index]

    def own(self, body: str | None, vector: np.ndarray) -> np.ndarray:
        """A vector (3,) of the design position in the axes that Exudyn gives a body."""
        if body is None or self.links[body][1] is not None:
            return vector
        return np.array(SLIDES[self.vehicle.body(body).freedoms[0]]).T @ vector

    def coordinate(self, node: Any, index: int) -> Any:
        """Marker of one coordinate of a node."""
        return self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=index))

    def connect(self, first: Any, second: Any, law: Callable[[Any, Any], list[float]]) -> None:
        """Two points and the force (N, space's axes) on the first by the second's position and rate beside it."""
        self.mbs.AddObject(
            items.CartesianSpringDamper(
                markerNumbers=[first, second],
                springForceUserFunction=lambda mbs, t, item, apart, rate, k, d, offset: law(apart, rate),
            )
        )
        self.callbacks += 1


@dataclass
class Link:
    """A joint of a tree and the mass behind it; ``centre`` counts from the joint, ``inertia`` about the centre."""

    joint: Any
    parent: int
    offset: np.ndarray
    mass: float = 0.0
    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))

    def load(self, body: Body, at: np.ndarray) -> None:
        """Add a body's mass with its centre there."""
        mass = self.mass + body.mass
        centre = (self.mass * self.centre + body.mass * at) / mass if mass else at
        self.inertia = (
            self.inertia
            + _carried(self.mass, self.centre - centre)
            + np.array(body.inertia, float)
            + _carried(body.mass, at - centre)
        )
        self.mass, self.centre = mass, centre


def _carried(mass: float, arm: np.ndarray) -> np.ndarray:
    """Inertia (3, 3) of a point mass at an arm (Steiner)."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def _tree(built: Build, bodies: list[Body]) -> None:
    """A body without parent and its riders: a link per coordinate, mass on the last one of each body.

    A rider without freedoms adds its mass to the last link of what it rides on.
    """
    links: list[Link] = []
    places = []
    last: dict[str | None, tuple[int, Vector]] = {None: (-1, (0.0, 0.0, 0.0))}
    for body in bodies:
        parent, origin = last[body.parent]
        for freedom in (freedom for freedom in FREEDOMS if freedom in body.freedoms):
            links.append(Link(JOINTS[freedom], parent, np.subtract(body.position, origin)))
            places.append((body.name, freedom))
            parent, origin = len(links) - 1, body.position
        links[parent].load(body, np.subtract(body.position, origin))
        last[body.name] = parent, origin
    n, zero = len(links), [0.0] * len(links)
    node = built.mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=zero, initialCoordinates=zero, initialCoordinates_t=zero, numberOfODE2Coordinates=n
        )
    )
    tree = built.mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            gravity=[0, 0, -built.vehicle.gravity],
            jointTypes=[link.joint for link in links],
            linkParents=[link.parent for link in links],
            jointTransformations=lists.Matrix3DList([np.eye(3)] * n),
            jointOffsets=lists.Vector3DList([link.offset for link in links]),
            linkInertiasCOM=lists.Matrix3DList([link.inertia for link in links]),
            linkCOMs=lists.Vector3DList([link.centre for link in links]),
            linkMasses=[link.mass for link in links],
        )
    )
    built.links |= {body.name: (tree, *last[body.name]) for body in bodies}
    built.places |= {place: (node, i) for i, place in enumerate(places)}


def _slider(built: Build, body: Body) -> None:
    """A body of one slide on the ground that carries nothing: with trees of one link a car takes 1.6 times as long."""
    still = [0.0]
    node = built.mbs.AddNode(
        items.Node1D(referenceCoordinates=still, initialCoordinates=still, initialVelocities=still)
    )
    mass = built.mbs.AddObject(
        items.Mass1D(
            nodeNumber=node,
            mass=body.mass,
            referencePosition=list(body.position),
            referenceRotation=SLIDES[body.freedoms[0]],
        )
    )
    built.links[body.name], built.places[body.name, body.freedoms[0]] = (mass, None, body.position), (node, 0)
    if body.freedoms == ("z",) and built.vehicle.gravity:
        built.mbs.AddLoad(
            items.LoadCoordinate(markerNumber=built.coordinate(node, 0), load=-body.mass * built.vehicle.gravity)
        )


def _trees(vehicle: SpatialVehicle) -> list[list[Body]]:
    """Bodies without parent, each with all that ride on it, parents first."""
    roots: dict[str, str] = {}
    for body in vehicle.bodies:
        roots[body.name] = body.name if body.parent is None else roots[body.parent]
    return [[body for body in vehicle.bodies if roots[body.name] == root] for root in dict.fromkeys(roots.values())]


def _spring(built: Build, spring: SpringDamper) -> None:
    """Native where Exudyn has an item for it: along a global axis, or along any axis of a body that never turns."""
    axis, ends = np.array(spring.axis), [spring.one, spring.two]
    upright = np.count_nonzero(axis) == 1
    one, two = (
        built.marker(end, point, not upright)
        for end, point in zip(ends, (spring.point_one, spring.point_two), strict=True)
    )
    rest = np.subtract(spring.point_two, spring.point_one)
    curved = spring.travel_force or spring.rate_force or spring.friction
    if curved or not (upright or any(not built.vehicle.turns(end) for end in ends)):
        built.connect(one, two, _law(spring, axis, rest, built.held.parts[spring.name]))
        return
    sunk = built.held.parts[spring.name] / spring.stiffness if spring.stiffness else 0.0
    if upright:
        built.mbs.AddObject(
            items.CartesianSpringDamper(
                markerNumbers=[one, two],
                stiffness=spring.stiffness * axis**2,
                damping=spring.damping * axis**2,
                offset=rest - sunk * axis,
            )
        )
        return
    sign = -1 if built.vehicle.turns(spring.one) else 1  # the axis is one of the first marker's body
    built.mbs.AddObject(
        items.LinearSpringDamper(
            markerNumbers=[one, two][::sign],
            axisMarker0=sign * built.own(ends[::sign][0], axis),
            stiffness=spring.stiffness,
            damping=spring.damping,
            offset=float(axis @ rest) - sunk,
        )
    )


def _law(spring: SpringDamper, axis: np.ndarray, rest: np.ndarray, held: float) -> Callable[[Any, Any], list[float]]:
    """All terms of a spring-damper's force."""
    (ax, ay, az), design = axis.tolist(), float(axis @ rest)
    k, c, dry, dry_rate = spring.stiffness, spring.damping, spring.friction, spring.friction_rate
    travel_force, rate_force = spring.travel_force, spring.rate_force

    def law(apart: Any, rates: Any) -> list[float]:
        travel = ax * apart[0] + ay * apart[1] + az * apart[2] - design
        rate = ax * rates[0] + ay * rates[1] + az * rates[2]
        force = held + k * travel + c * rate
        if travel_force is not None:
            force += travel_force(travel)
        if rate_force is not None:
            force += rate_force(rate)
        if dry:
            force += dry * math.tanh(rate / dry_rate)
        return [force * ax, force * ay, force * az]

    return law


def _bar(built: Build, bar: AntiRollBar) -> None:
    """Vertical forces between the two points, and the moment on the body's roll coordinate."""
    left, right = built.marker(bar.left, bar.point_left), built.marker(bar.right, bar.point_right)
    roll, turning = built.reader(bar.body, "rx"), built.reader(bar.body, "rx", KINDS.Coordinates_t)
    rest, held, track, read = bar.point_right[2] - bar.point_left[2], built.held.parts[bar.name], bar.track, built.mbs
    k, c = bar.stiffness, bar.damping

    def moment(apart: float, rate: float) -> float:
        """From the right point's height and its rate beside the left one's."""
        twisting = c * (rate / track + turning()) if c else 0.0
        return held + k * ((apart - rest) / track + roll()) + twisting

    def on_body(mbs: Any, t: float, item: int, angle: float, rate: float, k: float, d: float, offset: float) -> float:
        heights = [read.GetMarkerOutput(marker, KINDS.Position)[2] for marker in (right, left)]
        rates = [read.GetMarkerOutput(marker, KINDS.Velocity)[2] for marker in (right, left)] if c else [0.0, 0.0]
        return moment(heights[0] - heights[1], rates[0] - rates[1])

    built.connect(left, right, lambda apart, rate: [0.0, 0.0, moment(apart[2], rate[2]) / track])
    if (bar.body, "rx") in built.places:
        node, index = built.places[bar.body, "rx"]
        still = built.coordinate(built.mbs.AddNode(items.NodePointGround()), 0)
        rolling = built.coordinate(node, index)
        built.mbs.AddObject(
            items.CoordinateSpringDamper(markerNumbers=[still, rolling], springForceUserFunction=on_body)
        )
        built.callbacks += 1


def _turning_tyre(built: Build, tyre: Tyre, by_road: np.ndarray, road: RoadTable) -> None:
    """A spring-damper to the flat ground, and what the road adds as a load; ``by_road`` (2 w,): what it adds (N)."""
    marker, held = built.marker(tyre.body, tyre.point), built.held.tyres[tyre.name]
    sunk = held / tyre.stiffness if tyre.stiffness else 0.0
    built.mbs.AddObject(
        items.CartesianSpringDamper(
            markerNumbers=[built.marker(None, tyre.point), marker],
            stiffness=[0, 0, tyre.stiffness],
            damping=[0, 0, tyre.damping],
            offset=[0, 0, sunk],
        )
    )
    force = road.forces(np.outer(by_road, (0.0, 0.0, 1.0)))
    built.mbs.AddLoad(
        items.LoadForceVector(
            markerNumber=marker, loadVectorUserFunction=lambda mbs, t, load: force.rows[round(t * road.per_time)]
        )
    )
    built.callbacks += 1


def _steady_tyres(built: Build, tyres: list[Tyre], by_road: np.ndarray, road: RoadTable) -> None:
    """All tyres of bodies that never turn: matrices over the coordinates that lift them, and one callback.

    by_road : (2 w, tyres), what the road adds to each (N).
    """
    lifts = [
        [built.places[name, "z"] for name in built.vehicle.chain(tyre.body) if (name, "z") in built.places]
        for tyre in tyres
    ]
    nodes = list(dict.fromkeys(node for places in lifts for node, _ in places))
    if not nodes:
        return
    sizes = [sum(node == own for own, _ in built.places.values()) for node in nodes]
    first = dict(zip(nodes, np.cumsum([0, *sizes]), strict=False))
    rows = np.zeros((len(tyres), sum(sizes)))
    for row, places in zip(rows, lifts, strict=True):
        for node, index in places:
            row[first[node] + index] = 1.0
    stiffness, damping, held = np.array([(t.stiffness, t.damping, built.held.tyres[t.name]) for t in tyres]).T
    force = road.forces(by_road @ rows)
    built.mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=nodes,
            massMatrix=np.zeros((rows.shape[1],) * 2),
            stiffnessMatrix=rows.T * stiffness @ rows,
            **({"dampingMatrix": rows.T * damping @ rows} if damping.any() else {}),
            **({"forceVector": rows.T @ held} if held.any() else {}),
            forceUserFunction=lambda mbs, t, item, q, v: force.rows[round(t * road.per_time)],
        )
    )
    built.callbacks += 1


def _pushing_tyre(built: Build, tyre: Tyre, by_road: np.ndarray, road: RoadTable) -> None:
    """A tyre that may leave the road: one law of all of it; ``by_road`` (2 w, 2): the height and the rate under it."""
    k, c, held, rest = tyre.stiffness, tyre.damping, built.held.tyres[tyre.name], tyre.point[2]
    under = road.forces(by_road)

    def law(mbs: Any, t: float, item: int, place: Any, speed: Any, *_: Any) -> list[float]:
        height, rate = under.rows[round(t * road.per_time)]
        elastic = held + k * (height - place[2] + rest)
        return [0.0, 0.0, -max(min(elastic + c * (rate - speed[2]), 2.0 * elastic), 0.0)]

    on_road = (tyre.point[0], tyre.point[1], 0.0)
    built.mbs.AddObject(
        items.CartesianSpringDamper(
            markerNumbers=[built.marker(None, on_road), built.marker(tyre.body, tyre.point)],
            springForceUserFunction=law,
        )
    )
    built.callbacks += 1


def _tyres(built: Build, road: RoadTable) -> None:
    """All tyres."""
    tyres, turns, count = built.vehicle.tyres, built.vehicle.turns, len(built.vehicle.tyres)
    by_road = np.vstack([np.diag([tyre.stiffness for tyre in tyres]), np.diag([tyre.damping for tyre in tyres])])
    steady = [i for i, tyre in enumerate(tyres) if not (tyre.pushes_only or turns(tyre.body))]
    if steady:
        _steady_tyres(built, [tyres[i] for i in steady], by_road[:, steady], road)
    for i, tyre in enumerate(tyres):
        if tyre.pushes_only:
            _pushing_tyre(built, tyre, np.eye(2 * count)[:, [i, count + i]], road)
        elif i not in steady:
            _turning_tyre(built, tyre, by_road[:, i], road)


def _side_force(built: Build, force: SideForce, speed: float) -> None:
    roll, yaw = (built.reader(force.chassis, freedom) for freedom in ("rx", "rz"))

    def law(apart: Any, rate: Any) -> list[float]:
        return [0.0, force.stiffness * (rate[1] / speed - force.roll_steer * roll() - yaw()), 0.0]

    built.connect(built.marker(None, force.point), built.marker(force.body, force.point), law)


def assemble(vehicle: SpatialVehicle, speed: float | None, road: RoadTable) -> Build:
    """The vehicle in a system of its own, which is not assembled yet: sensors may follow."""
    mbs = exu.SystemContainer().AddSystem()
    built = Build(vehicle, mbs, preloads(vehicle), mbs.AddObject(items.ObjectGround()))
    for bodies in _trees(vehicle):
        if len(bodies) == 1 and bodies[0].freedoms in (("x",), ("y",), ("z",)):
            _slider(built, bodies[0])
        else:
            _tree(built, bodies)
    for spring in vehicle.springs:
        _spring(built, spring)
    for bar in vehicle.bars:
        _bar(built, bar)
    _tyres(built, road)
    for force in vehicle.side_forces:
        _side_force(built, force, float(speed or 0.0))
    for drag in vehicle.drags:
        centre = vehicle.body(drag.body).position
        built.mbs.AddObject(
            items.CartesianSpringDamper(
                markerNumbers=[built.marker(None, centre), built.marker(drag.body, centre)],
                damping=[drag.coefficient * float(speed or 0.0), 0, 0],
            )
        )
    for tyre in vehicle.tyres:
        built.marker(tyre.body, tyre.point)
    for output in vehicle.outputs:
        if isinstance(output, PointOutput):
            built.marker(output.body, output.point)
        if isinstance(output, TurnOutput):
            built.marker(output.body, vehicle.body(output.body).position, True)
    return built
