"""A spatial vehicle as Exudyn's items: native spring-dampers between points of its bodies, and user functions.

What Exudyn has no item for is a function in Python: curves and friction, inclined axes between two bodies that turn,
anti-roll bars, side forces, the road.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import numpy as np

from models.engines.exudyn_system import KINDS, items
from models.engines.exudyn_tree import TreeBuild, add_slider, add_tree
from models.vehicles.spatial import (
    AntiRollBar,
    Body,
    PointOutput,
    SideForce,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
)
from models.vehicles.spatial_linear import static_preloads


@dataclass
class RoadForces:
    """Road forces for one callback. by_road (2 w, k) : factors of the road's heights and rates under w tyres; rows :
    the k forces at every half step."""

    by_road: np.ndarray
    rows: list[list[float]]


@dataclass
class RoadRows:
    """The road under the tyres. rows : heights (m), then rates (m/s), ``rows_per_second`` in a second; computed_forces
    : the forces that callbacks read from them."""

    rows: np.ndarray
    rows_per_second: float
    computed_forces: list[RoadForces] = field(default_factory=list)

    def forces(self, road_factors: np.ndarray) -> RoadForces:
        """Forces at all rows of the road for one callback, with the factors ``road_factors`` (2 w, k)."""
        self.computed_forces.append(RoadForces(road_factors, (self.rows @ road_factors).tolist()))
        return self.computed_forces[-1]

    @contextmanager
    def fixed_row(self, road_row: np.ndarray) -> Iterator[None]:
        """Context in which one row (2 w,) of the road is used at all times."""
        before, per_time, self.rows_per_second = [each.rows for each in self.computed_forces], self.rows_per_second, 0.0
        for each in self.computed_forces:
            each.rows = [(road_row @ each.by_road).tolist()]
        try:
            yield
        finally:
            self.rows_per_second = per_time
            for each, rows in zip(self.computed_forces, before, strict=True):
                each.rows = rows


def _add_spring(tree_build: TreeBuild, spring: SpringDamper) -> None:
    """Add a spring-damper: native where Exudyn has an item for it, that is along a global axis, or along any axis of a
    body that never turns."""
    axis, ends, held = (
        np.array(spring.axis),
        [spring.first_body, spring.second_body],
        tree_build.preloads.parts[spring.name],
    )
    upright = np.count_nonzero(axis) == 1
    first, two = (
        tree_build.marker(end, point, not upright)
        for end, point in zip(ends, (spring.first_point, spring.second_point), strict=True)
    )
    rest = np.subtract(spring.second_point, spring.first_point)
    curved = spring.travel_force or spring.rate_force or spring.friction
    if curved or not (upright or any(not tree_build.vehicle.turns(end) for end in ends)):
        return tree_build.connect(f"spring {spring.name!r}", first, two, _spring_law(spring, axis, rest, held))
    sunk = held / spring.stiffness if spring.stiffness else 0.0
    if upright:
        diagonal = axis**2
        law = {"stiffness": spring.stiffness * diagonal, "damping": spring.damping * diagonal}
        return tree_build.spring(first, two, **law, offset=rest - sunk * axis, name=f"spring {spring.name!r}")
    sign = -1 if tree_build.vehicle.turns(spring.first_body) else 1  # the axis is one of the first marker's body
    tree_build.mbs.AddObject(
        items.LinearSpringDamper(
            name=f"spring {spring.name!r}",
            markerNumbers=[first, two][::sign],
            axisMarker0=sign * tree_build.in_body_axes(ends[::sign][0], axis),
            stiffness=spring.stiffness,
            damping=spring.damping,
            offset=float(axis @ rest) - sunk,
        )
    )


def _spring_law(
    spring: SpringDamper, spring_axis: np.ndarray, length_at_rest: np.ndarray, preload: float
) -> Callable[[Any, Any], list[float]]:
    """Force law of a spring-damper with all its terms, for a callback: force (3,) in N from relative position and
    velocity of its ends."""
    (ax, ay, az), design = spring_axis.tolist(), float(spring_axis @ length_at_rest)
    k, c, dry, dry_rate = spring.stiffness, spring.damping, spring.friction, spring.friction_rate
    travel_force, rate_force = spring.travel_force, spring.rate_force

    def law(relative_position: Any, relative_velocity: Any) -> list[float]:
        travel = ax * relative_position[0] + ay * relative_position[1] + az * relative_position[2] - design
        rate = ax * relative_velocity[0] + ay * relative_velocity[1] + az * relative_velocity[2]
        force = preload + k * travel + c * rate
        if travel_force is not None:
            force += travel_force(travel)
        if rate_force is not None:
            force += rate_force(rate)
        if dry:
            force += dry * math.tanh(rate / dry_rate)
        return [force * ax, force * ay, force * az]

    return law


def _add_bar(tree_build: TreeBuild, bar: AntiRollBar) -> None:
    """Add an anti-roll bar: vertical forces at its two points, and a moment on the body's roll coordinate."""
    left, right = tree_build.marker(bar.left, bar.point_left), tree_build.marker(bar.right, bar.point_right)
    roll, turning = tree_build.reader(bar.body, "rx"), tree_build.reader(bar.body, "rx", KINDS.Coordinates_t)
    rest, held, track, read = (
        bar.point_right[2] - bar.point_left[2],
        tree_build.preloads.parts[bar.name],
        bar.track,
        tree_build.mbs,
    )
    k, c = bar.stiffness, bar.damping

    def moment(height_difference: float, rate: float) -> float:
        """Moment of the bar for the height of its right point above the left one, and the rate of this height."""
        twisting = c * (rate / track + turning()) if c else 0.0
        return held + k * ((height_difference - rest) / track + roll()) + twisting

    def on_body(mbs: Any, t: float, item: int, angle: float, rate: float, k: float, d: float, offset: float) -> float:
        heights = [read.GetMarkerOutput(marker, KINDS.Position)[2] for marker in (right, left)]
        rates = [read.GetMarkerOutput(marker, KINDS.Velocity)[2] for marker in (right, left)] if c else [0.0, 0.0]
        return moment(heights[0] - heights[1], rates[0] - rates[1])

    name = f"anti-roll bar {bar.name!r}"
    tree_build.connect(name, left, right, lambda apart, rate: [0.0, 0.0, moment(apart[2], rate[2]) / track])
    if (bar.body, "rx") in tree_build.coordinate_nodes:
        node, index = tree_build.coordinate_nodes[bar.body, "rx"]
        still = tree_build.coordinate(tree_build.mbs.AddNode(items.NodePointGround()), 0)
        rolling = tree_build.coordinate(node, index)
        tree_build.mbs.AddObject(
            items.CoordinateSpringDamper(
                name=f"{name}, on {bar.body!r}", markerNumbers=[still, rolling], springForceUserFunction=on_body
            )
        )
        tree_build.callbacks += 1


def _add_turning_tyre(tree_build: TreeBuild, tyre: Tyre, road_factors: np.ndarray, road_rows: RoadRows) -> None:
    """Add a tyre on a body that turns: a spring-damper to flat ground, and the road's force as a load; ``road_factors``
    (2 w,) : factors of this force (N)."""
    marker, held = tree_build.marker(tyre.body, tyre.point), tree_build.preloads.tyres[tyre.name]
    sunk = held / tyre.stiffness if tyre.stiffness else 0.0
    law = {"stiffness": [0, 0, tyre.stiffness], "damping": [0, 0, tyre.damping], "offset": [0, 0, sunk]}
    tree_build.spring(tree_build.marker(None, tyre.point), marker, **law, name=f"tyre {tyre.name!r}")
    force = road_rows.forces(np.outer(road_factors, (0.0, 0.0, 1.0)))
    tree_build.mbs.AddLoad(
        items.LoadForceVector(
            name=f"road under the tyre {tyre.name!r}, flat here",
            markerNumber=marker,
            loadVectorUserFunction=lambda mbs, t, load: force.rows[round(t * road_rows.rows_per_second)],
        )
    )
    tree_build.callbacks += 1


def _add_steady_tyres(tree_build: TreeBuild, tyres: list[Tyre], road_factors: np.ndarray, road_rows: RoadRows) -> None:
    """Add all tyres on bodies that never turn: matrices over the coordinates that lift them, and one callback.

    road_factors : (2 w, tyres), what the road adds to each (N).
    """
    lifts = [
        [
            tree_build.coordinate_nodes[name, "z"]
            for name in tree_build.vehicle.chain(tyre.body)
            if (name, "z") in tree_build.coordinate_nodes
        ]
        for tyre in tyres
    ]
    nodes = list(dict.fromkeys(node for places in lifts for node, _ in places))
    if not nodes:
        return
    sizes = [tree_build.size(node) for node in nodes]
    first = dict(zip(nodes, np.cumsum([0, *sizes]), strict=False))
    rows = np.zeros((len(tyres), sum(sizes)))
    for row, places in zip(rows, lifts, strict=True):
        for node, index in places:
            row[first[node] + index] = 1.0
    stiffness, damping, held = np.array([(t.stiffness, t.damping, tree_build.preloads.tyres[t.name]) for t in tyres]).T
    force = road_rows.forces(road_factors @ rows)
    tree_build.mbs.AddObject(
        items.ObjectGenericODE2(
            name=f"tyres {', '.join(repr(tyre.name) for tyre in tyres)}",
            nodeNumbers=nodes,
            massMatrix=np.zeros((rows.shape[1],) * 2),
            stiffnessMatrix=rows.T * stiffness @ rows,
            **({"dampingMatrix": rows.T * damping @ rows} if damping.any() else {}),
            **({"forceVector": rows.T @ held} if held.any() else {}),
            forceUserFunction=lambda mbs, t, item, q, v: force.rows[round(t * road_rows.rows_per_second)],
        )
    )
    tree_build.callbacks += 1


def _add_pushing_tyre(tree_build: TreeBuild, tyre: Tyre, road_factors: np.ndarray, road_rows: RoadRows) -> None:
    """Add a tyre that may leave the road, its whole law as a callback; ``road_factors`` (2 w, 2) selects height and
    rate under the tyre."""
    k, c, held, rest = tyre.stiffness, tyre.damping, tree_build.preloads.tyres[tyre.name], tyre.point[2]
    under = road_rows.forces(road_factors)

    def law(mbs: Any, t: float, item: int, position: Any, speed: Any, *_: Any) -> list[float]:
        height, rate = under.rows[round(t * road_rows.rows_per_second)]
        elastic = held + k * (height - position[2] + rest)
        return [0.0, 0.0, -max(min(elastic + c * (rate - speed[2]), 2.0 * elastic), 0.0)]

    on_road = tree_build.marker(None, (tyre.point[0], tyre.point[1], 0.0))
    name = f"tyre {tyre.name!r}, which only pushes"
    tree_build.spring(on_road, tree_build.marker(tyre.body, tyre.point), name=name, springForceUserFunction=law)


def _add_tyres(tree_build: TreeBuild, road_rows: RoadRows) -> None:
    """Add all tyres of the vehicle."""
    tyres, turns, count = tree_build.vehicle.tyres, tree_build.vehicle.turns, len(tree_build.vehicle.tyres)
    by_road = np.vstack([np.diag([tyre.stiffness for tyre in tyres]), np.diag([tyre.damping for tyre in tyres])])
    steady = [i for i, tyre in enumerate(tyres) if not (tyre.pushes_only or turns(tyre.body))]
    if steady:
        _add_steady_tyres(tree_build, [tyres[i] for i in steady], by_road[:, steady], road_rows)
    for i, tyre in enumerate(tyres):
        if tyre.pushes_only:
            _add_pushing_tyre(tree_build, tyre, np.eye(2 * count)[:, [i, count + i]], road_rows)
        elif i not in steady:
            _add_turning_tyre(tree_build, tyre, by_road[:, i], road_rows)


def _add_side_force(tree_build: TreeBuild, side_force: SideForce, speed: float) -> None:
    """Add a lateral force that depends on the body's lateral speed and the chassis' roll and yaw."""
    roll, yaw = (tree_build.reader(side_force.chassis, freedom) for freedom in ("rx", "rz"))

    def law(relative_position: Any, relative_velocity: Any) -> list[float]:
        return [
            0.0,
            side_force.stiffness * (relative_velocity[1] / speed - side_force.roll_steer * roll() - yaw()),
            0.0,
        ]

    tree_build.connect(
        f"side force {side_force.name!r}",
        tree_build.marker(None, side_force.point),
        tree_build.marker(side_force.body, side_force.point),
        law,
    )


def _trees(vehicle: SpatialVehicle) -> list[list[Body]]:
    """Trees of bodies: each body without parent together with all bodies that it carries, parents first."""
    trees: dict[str, list[Body]] = {}
    for body in vehicle.bodies:
        trees.setdefault(vehicle.chain(body.name)[-1], []).append(body)
    return list(trees.values())


def assemble(vehicle: SpatialVehicle, speed: float | None, road_rows: RoadRows) -> TreeBuild:
    """Build the vehicle in a new Exudyn system, which is not assembled yet, so that sensors can be added."""
    mbs = exu.SystemContainer().AddSystem()
    built = TreeBuild(vehicle, mbs, static_preloads(vehicle), mbs.AddObject(items.ObjectGround()))
    for bodies in _trees(vehicle):
        if len(bodies) == 1 and bodies[0].freedoms in (("x",), ("y",), ("z",)):
            add_slider(built, bodies[0])
        else:
            add_tree(built, bodies)
    for spring in vehicle.springs:
        _add_spring(built, spring)
    for bar in vehicle.bars:
        _add_bar(built, bar)
    _add_tyres(built, road_rows)
    for force in vehicle.side_forces:
        _add_side_force(built, force, float(speed or 0.0))
    for drag in vehicle.drags:
        centre = vehicle.body(drag.body).position
        damping = [drag.coefficient * float(speed or 0.0), 0, 0]
        built.spring(built.marker(None, centre), built.marker(drag.body, centre), damping=damping)
    for tyre in vehicle.tyres:
        built.marker(tyre.body, tyre.point)
    for output in vehicle.outputs:
        if isinstance(output, PointOutput):
            built.marker(output.body, output.point)
        if isinstance(output, TurnOutput):
            built.marker(output.body, vehicle.body(output.body).position, True)
    return built
