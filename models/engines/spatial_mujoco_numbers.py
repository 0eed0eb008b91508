"""The numbers of a vehicle in space as MuJoCo's callback reads them: what moves, and what acts between it."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain

import mujoco
import numpy as np

from models.engines.spatial_mujoco_callback import SHARES
from models.vehicles.curve import Curve
from models.vehicles.spatial import FREEDOMS, SpatialVehicle, Vector
from models.vehicles.spatial_linear import preloads

UP: Vector = (0.0, 0.0, 1.0)
AXES = {freedom: np.eye(3)[i % 3].tolist() for i, freedom in enumerate(FREEDOMS)}
NONE: Mapping[str, str] = {}
Place = tuple[str | None, Vector, Vector]
"""Body, point and axis."""


class Numbers:
    """Where MuJoCo keeps a vehicle's bodies and coordinates: ids by name, columns (n,) by the vehicle's order.

    carriers : bodies that are one there with the only one that rides on them, by its name.
    """

    def __init__(self, vehicle: SpatialVehicle, model: mujoco.MjModel, carriers: Mapping[str, str] = NONE) -> None:
        order = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
        self.bodies = {name: int(model.body(order[_last(carriers, name)]).id) for name in order}
        self.joints: dict[tuple[str, str], int] = {
            (name, freedom): int(model.joint(f"{order[name]} {freedom}").id) for name, freedom in vehicle.coordinates()
        }
        self.columns = np.array(list(self.joints.values()))


def _last(carriers: Mapping[str, str], name: str) -> str:
    """The body that a body is one with in MuJoCo."""
    while name in carriers:
        name = carriers[name]
    return name


@dataclass(frozen=True)
class Element:
    """A force F against the travel s = own coordinate + sum of axis . point - value at rest, less the tyre's road.

    F = held + stiffness s + damping s' + curves + friction + sum of gain * coordinate (``steered``): what acts on
    every coordinate q is -F ds/dq. A tyre that only pushes is ``one_sided``: F is negative where it does.
    """

    points: tuple[Place, ...]
    stiffness: float = 0.0
    damping: float = 0.0
    held: float = 0.0
    friction: tuple[float, float] = (0.0, 1.0)
    tyre: int = -1
    own: tuple[str, str] | None = None
    steered: tuple[tuple[tuple[str, str], float], ...] = ()
    on_travel: Curve | None = None
    on_rate: Curve | None = None
    one_sided: bool = False


def elements(vehicle: SpatialVehicle, speed: float | None) -> list[Element]:
    """Everything that acts in a vehicle besides weights and inertia."""
    held, v, found = preloads(vehicle), float(speed or 0.0), []
    for s in vehicle.springs:
        points = ((s.two, s.point_two, s.axis), (s.one, s.point_one, _scaled(s.axis, -1.0)))
        found.append(
            Element(
                points,
                s.stiffness,
                s.damping,
                held.parts[s.name],
                (s.friction, s.friction_rate),
                on_travel=s.travel_force,
                on_rate=s.rate_force,
            )
        )
    for bar in vehicle.bars:
        down, up = _scaled(UP, -1.0 / bar.track), _scaled(UP, 1.0 / bar.track)
        found.append(
            Element(
                ((bar.left, bar.point_left, down), (bar.right, bar.point_right, up)),
                bar.stiffness,
                bar.damping,
                held.parts[bar.name],
                own=(bar.body, "rx"),
            )
        )
    for i, tyre in enumerate(vehicle.tyres):
        found.append(
            Element(
                ((tyre.body, tyre.point, UP),),
                tyre.stiffness,
                tyre.damping,
                -held.tyres[tyre.name],
                tyre=i,
                one_sided=tyre.pushes_only,
            )
        )
    for f in vehicle.side_forces:
        steered = (((f.chassis, "rx"), -f.stiffness * f.roll_steer), ((f.chassis, "rz"), -f.stiffness))
        found.append(Element(((f.body, f.point, (0.0, 1.0, 0.0)),), damping=f.stiffness / v, steered=steered))
    for drag in vehicle.drags:
        centre = vehicle.body(drag.body).position
        found.append(Element(((drag.body, centre, (1.0, 0.0, 0.0)),), damping=drag.coefficient * v))
    return found


def _scaled(axis: Vector, factor: float) -> Vector:
    return (factor * axis[0], factor * axis[1], factor * axis[2])


@dataclass(frozen=True)
class Packed:
    """Numbers of bodies, points and elements, so many of each, as ``spatial_mujoco_callback`` names them."""

    counts: tuple[int, int, int]
    numbers: list[float]


def packed(vehicle: SpatialVehicle, acting: list[Element], model: mujoco.MjModel, numbers: Numbers) -> Packed:
    """All that the callback reads but the road."""
    carrying = {name for body in vehicle.bodies if vehicle.turns(body.name) for name in vehicle.chain(body.name)}
    moving = [body.name for body in vehicle.bodies if body.name in carrying]
    bodies, points = list[list[float]](), list[list[float]]()
    for name in moving:
        before = len(points)
        points += _points(acting, vehicle, name)
        bodies.append([*_body(vehicle, name, moving, model, numbers), before, len(points)])
    laws = [_element(element, vehicle, numbers) for element in acting]
    found = [float(value) for value in chain(*bodies, *points, *laws)]
    return Packed((len(bodies), len(laws), len(points)), found)


def _body(
    vehicle: SpatialVehicle, name: str, moving: list[str], model: mujoco.MjModel, numbers: Numbers
) -> list[float]:
    """A body that may turn, or carries one that may."""
    body, number = vehicle.body(name), numbers.bodies[name]
    first, count = max(int(model.body_jntadr[number]), 0), len(body.freedoms)
    sliding = sum(not freedom.startswith("r") for freedom in body.freedoms)
    parent = moving.index(body.parent) if body.parent else -1
    return [parent, number, first, first + sliding, first + count]


def _points(acting: list[Element], vehicle: SpatialVehicle, name: str) -> list[list[float]]:
    """Where the elements act on a body that may turn."""
    centre = vehicle.body(name).position
    return [
        [i, *np.subtract(point, centre), *axis]
        for i, element in enumerate(acting)
        for body, point, axis in element.points
        if body == name and vehicle.turns(name)
    ]


def _element(element: Element, vehicle: SpatialVehicle, numbers: Numbers) -> list[float]:
    """An element: its law, the shares of coordinates in its travel, and what of its law is no line."""
    shares, rest = dict[int, float](), 0.0
    if element.own in numbers.joints:
        shares[numbers.joints[element.own]] = 1.0
    for name, point, axis in element.points:
        if vehicle.turns(name):
            rest += float(np.dot(point, axis))
            continue
        for place in ((one, freedom) for one in vehicle.chain(name) for freedom in vehicle.body(one).freedoms):
            share = float(np.dot(axis, AXES[place[1]]))
            shares[numbers.joints[place]] = shares.get(numbers.joints[place], 0.0) + share
    flat = [value for pair in shares.items() if pair[1] for value in pair]
    more = _more(element, numbers)
    law = [element.stiffness, element.damping, element.held, element.tyre, rest, element.one_sided]
    begins = SHARES + len(flat)
    return [begins + len(more), *law, begins if more else 0, *flat, *more]


def _more(element: Element, numbers: Numbers) -> list[float]:
    """What of a law is no line; nothing where there is nothing."""
    steered = [value for place, gain in element.steered for value in (numbers.joints.get(place, -1), gain)]
    curves = [element.on_travel, element.on_rate]
    if not (element.friction[0] or steered or any(curves)):
        return []
    counts = [len(curve.arguments) if curve else 0 for curve in curves]
    pairs = [
        value for curve in curves if curve for pair in zip(curve.arguments, curve.forces, strict=True) for value in pair
    ]
    return [*element.friction, *(steered or [-1, 0.0, -1, 0.0]), *counts, *pairs]
