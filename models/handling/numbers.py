"""A free vehicle, its tyres, its controls and the road as the one table of doubles that ``forces`` reads."""

from dataclasses import dataclass, field, replace

import numpy as np

from models.errors import InputError
from models.handling import forces as at
from models.handling.tyre import net, shape_factor
from models.vehicles.curve import Curve
from models.vehicles.free_vehicle import anchor, chassis_of, free_vehicle, joints, rotor
from models.vehicles.spatial import SpatialVehicle, Vector
from models.vehicles.spatial_linear import Preloads, preloads

Control = tuple[tuple[float, float], ...]
"""Knots (s, value); a control rests at each and goes from one to the next by the smoothest step of degree 5."""
GRAVITY = 9.81


@dataclass(frozen=True)
class Tyres:
    """What the tyres and wheels have beside the vehicle file's stiffness, damping and cornering stiffness.

    friction : mu; half_width : of the patch (m); inclination : of the wheels of the left side about their forward
    axis (rad), the right side's mirrored; cells : of the patch's net per strip; spin_inertia : of a wheel about its
    axle (kg m^2), chosen; fixed : tyres whose wheels do not spin; brake_rate : spin beside the chassis (rad/s) at which
    a brake's torque is whole (within 24 %, by tanh).
    """

    friction: float = 0.9
    half_width: float = 0.09
    inclination: float = 0.0
    cells: int = 21
    spin_inertia: float = 1.7
    fixed: tuple[str, ...] = ()
    brake_rate: float = 1.0


@dataclass(frozen=True)
class Controls:
    """steer : angle of the front wheels (rad); brake, drive : torque on all wheels together (N m), both 0 or more.

    front_brake : share of the front axle in braking; front_drive : in driving. The wheels of an axle share evenly.
    """

    steer: Control = ((0.0, 0.0),)
    brake: Control = ((0.0, 0.0),)
    drive: Control = ((0.0, 0.0),)
    front_brake: float = 0.65
    front_drive: float = 0.0


@dataclass(frozen=True, eq=False)
class Handling:
    """A vehicle on the road: what every implementation marches.

    given : the vehicle of the ride; waves (m, 4) : the road as ``road`` makes it; slope : of the whole road, uphill
    along x (rad). ``vehicle`` is the free one, ``numbers`` its table, ``gravity`` (3,) in m/s^2.
    """

    given: SpatialVehicle
    tyres: Tyres = Tyres()
    controls: Controls = Controls()
    waves: np.ndarray = field(default_factory=lambda: np.empty((0, 4)))
    slope: float = 0.0
    vehicle: SpatialVehicle = field(init=False)
    held: Preloads = field(init=False)
    numbers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        own = self.tyres
        names = tuple(tyre.name for tyre in self.given.tyres)
        for name in set(own.fixed) - set(names):
            raise InputError(self.given.name, "fixed", name, "no such tyre", names)
        free = free_vehicle(self.given, GRAVITY * float(np.cos(self.slope)), own.spin_inertia, own.fixed)
        object.__setattr__(self, "vehicle", free)
        object.__setattr__(self, "held", preloads(free))
        object.__setattr__(self, "numbers", _table(self))

    @property
    def gravity(self) -> np.ndarray:
        """(3,) m/s^2 in the axes of the road."""
        return GRAVITY * np.array([-np.sin(self.slope), 0.0, -np.cos(self.slope)])

    def changed(self, **changes: object) -> "Handling":
        """The same with other fields."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def straight(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions and rates (n,) of rolling straight ahead at a speed (m/s) at rest in all else."""
        places = self.vehicle.coordinates()
        v = np.zeros(len(places))
        v[0] = speed
        for tyre in self.vehicle.tyres:
            if (rotor(tyre.name), "ry") in places:
                v[places.index((rotor(tyre.name), "ry"))] = speed / tyre.point[2]
        return np.zeros(len(places)), v


def _table(own: Handling) -> np.ndarray:
    """All numbers, in the order that ``forces`` names."""
    free, chassis = own.vehicle, chassis_of(own.given)
    parts, of = _parts(own), net(own.tyres.cells)
    knots = _knots(own.controls)
    tyres = [_tyre(own, i) for i in range(len(free.tyres))]
    sections = [joints(free).ravel(), np.concatenate(parts or [np.empty(0)]), np.ravel(tyres), knots.ravel(),
                own.waves.ravel(), of.cells.ravel(), of.strips.ravel()]  # fmt: skip
    begins = at.HEADER + np.cumsum([0, *(section.size for section in sections)])
    joint, place = _place(free, chassis.name, chassis.position)
    drag = own.given.drags[0].coefficient / 2.0 if own.given.drags else 0.0
    counts = [begins[-1], len(free.coordinates()), len(parts), len(free.tyres), knots.shape[2], len(own.waves)]
    head = [*counts, joint, drag, *place, of.cells.shape[1], of.strips.shape[1], of.middle, *begins[1:-1]]
    return np.concatenate([np.array(head, float), *sections])


def _place(vehicle: SpatialVehicle, body: str, point: Vector) -> tuple[int, np.ndarray]:
    """The coordinate that moves a point last, and where the point is from its joint."""
    joint, origin = anchor(vehicle, body)
    return joint, np.subtract(point, origin)


def _parts(own: Handling) -> list[np.ndarray]:
    """Spring-dampers and bars."""
    free, found = own.vehicle, []
    for s in free.springs:
        ends = [(s.two, s.point_two, np.array(s.axis)), (s.one, s.point_one, -np.array(s.axis))]
        if s.two is None:
            raise InputError(free.name, f"springs[{s.name}].bodies", s.name, "a free vehicle is not tied to the ground")
        law = [s.stiffness, s.damping, own.held.parts[s.name], s.friction, s.friction_rate]
        found.append(_packed(free, law, ends, -1, (s.travel_force, s.rate_force)))
    places = free.coordinates()
    for bar in free.bars:
        up = np.array([0.0, 0.0, 1.0 / bar.track])
        ends = [(bar.left, bar.point_left, -up), (bar.right, bar.point_right, up)]
        law = [bar.stiffness, bar.damping, own.held.parts[bar.name], 0.0, 1.0]
        found.append(_packed(free, law, ends, places.index((bar.body, "rx")), (None, None)))
    return found


def _packed(free: SpatialVehicle, law: list[float], ends: list[tuple], own: int,
            curves: tuple[Curve | None, ...]) -> np.ndarray:  # fmt: skip
    rest = sum(float(np.dot(point, axis)) for _, point, axis in ends)
    points = np.concatenate([[joint, *place, *axis] for body, point, axis in ends
                             for joint, place in [_place(free, body, point)]])  # fmt: skip
    hinges = [_hinges(curve) for curve in curves]
    count = at.FIRST_POINT + len(points) + sum(map(len, hinges))
    head = [*law, rest, own, 1.0 if own >= 0 else 0.0, len(ends), count, *map(len, hinges)]
    return np.concatenate([head, points, *hinges])


def _hinges(curve: Curve | None) -> np.ndarray:
    if curve is None:
        return np.empty(0)
    offset, slope, corners, bends = curve.hinges()
    return np.array([offset, slope, *(value for pair in zip(corners, bends, strict=True) for value in pair)])


def _tyre(own: Handling, i: int) -> list[float]:
    """One tyre; its bristles are those with which it has the ride vehicle's cornering stiffness at its static load."""
    free, of = own.vehicle, own.tyres
    tyre, places = free.tyres[i], free.coordinates()
    joint, place = _place(free, tyre.body, tyre.point)
    load = own.held.tyres[tyre.name]
    if not load > 0.0:
        raise InputError(free.name, f"tyres[{tyre.name}]", load, "carries no weight: it must press on the road at rest")
    sunk = load / tyre.stiffness
    radius = tyre.point[2] + sunk
    cornering = next(force.stiffness for force in own.given.side_forces if force.name == tyre.name)
    bristles = cornering / (shape_factor(of.cells) * radius * sunk * of.half_width)
    spins = (rotor(tyre.name), "ry")
    axle = [t for t in free.tyres if t.axle == tyre.axle]
    share, front, c = 1.0 / len(axle), tyre.axle == 0, own.controls
    rear = max(t.axle for t in free.tyres) or 1  # all axles behind the first share evenly
    brake = share * (c.front_brake if front else (1.0 - c.front_brake) / rear)
    drive = share * (c.front_drive if front else (1.0 - c.front_drive) / rear)
    side = np.sign(tyre.point[1])
    return [joint, places.index(spins) if spins in places else -1, *place, tyre.point[2], load, tyre.stiffness,
            tyre.damping, radius, of.half_width, bristles, of.friction, float(front), brake, drive,
            side * of.inclination, of.brake_rate]  # fmt: skip


def _knots(controls: Controls) -> np.ndarray:
    """(3, 2, k): times and values of steer, brake and drive, filled up with the last knot."""
    all_knots = (controls.steer, controls.brake, controls.drive)
    most = max(map(len, all_knots))
    filled = [(*knots, *[(knots[-1][0] + 1.0 + i, knots[-1][1]) for i in range(most - len(knots))])
              for knots in all_knots]  # fmt: skip
    return np.array(filled, float).transpose(0, 2, 1)
