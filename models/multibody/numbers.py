"""A free vehicle, its tyres, its controls and its road as the one table of doubles that the compiled forces read."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from models.core.errors import InputError
from models.multibody import forces as at
from models.multibody import tree
from models.multibody.parts import ON_RATE, ON_TRAVEL, PER_PART, curve_numbers
from models.tyre.bristles import cornering_stiffness_factor, patch_grid
from models.vehicles.free_vehicle import (
    CARRIER,
    chassis_of,
    free_vehicle,
    joint_table,
    last_coordinate_and_joint,
    rotor_name,
)
from models.vehicles.spatial import Curve, SpatialVehicle, Vector
from models.vehicles.spatial_linear import Preloads, static_preloads, with_preloads

Control = tuple[tuple[float, float], ...]
"""Knots (time in s, value) of a control over time; it rests at each knot and goes from one to the next by the smoothest
step of degree 5."""
GRAVITY = 9.81


@dataclass(frozen=True)
class TyreParameters:
    """Tyre and wheel parameters that the vehicle file does not give.

    friction : mu; half_width : of the patch (m); inclination : of the wheels of the left side about their forward
    axis (rad), the right side's mirrored; cells : of the patch's net per strip; spin_inertia : of a wheel about its
    axle (kg m^2), chosen; fixed : tyres whose wheels do not spin; brake_rate : spin beside the chassis (rad/s) at which
    a brake's torque is whole (within 24 %, by tanh). Wheels of towed bodies do not lean.
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
    """Steering, brake and drive of a vehicle over time, and how they are shared between its axles.

    steer : angle of the front wheels (rad); brake, drive : torque on all wheels together (N m), both 0 or more.
    front_brake : share of the front axle in braking; front_drive : in driving. All axles behind it share the rest
    evenly, those of towed bodies in braking alone, and so do the wheels of an axle.
    """

    steer: Control = ((0.0, 0.0),)
    brake: Control = ((0.0, 0.0),)
    drive: Control = ((0.0, 0.0),)
    front_brake: float = 0.65
    front_drive: float = 0.0


@dataclass(frozen=True)
class Push:
    """External force on a body, such as wind: ``size`` (N, over time) along ``axis``, x ahead, y to the left and z up.
    The axes turn with the vehicle's heading only. It acts at ``point`` (m) of a body, in the design position."""

    body: str
    point: Vector
    axis: Vector
    size: Control


@dataclass(frozen=True, eq=False)
class Handling:
    """A vehicle on its tyres, with its controls, road and external pushes: what every engine integrates.

    given : the vehicle of the ride; waves (m, 4) : the road as ``road`` makes it; slope : of the whole road, uphill
    along x (rad); pushes : forces from outside; forces : whose the springs and bars of towed bodies are, the engine's
    as far as it has them ("native") or the compiled forces' ("compiled"). ``vehicle`` is the free one, ``numbers`` its
    table, ``gravity`` (3,) in m/s^2.
    """

    given: SpatialVehicle
    tyres: TyreParameters = TyreParameters()
    controls: Controls = Controls()
    waves: np.ndarray = field(default_factory=lambda: np.empty((0, 4)))
    slope: float = 0.0
    pushes: tuple[Push, ...] = ()
    forces: Literal["native", "compiled"] = "native"
    vehicle: SpatialVehicle = field(init=False)
    held: Preloads = field(init=False)
    numbers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        tyres = self.tyres
        names = tuple(tyre.name for tyre in self.given.tyres)
        for name in set(tyres.fixed) - set(names):
            raise InputError(self.given.name, "fixed", name, "no such tyre", names)
        free = free_vehicle(self.given, GRAVITY * float(np.cos(self.slope)), tyres.spin_inertia, tyres.fixed)
        held = static_preloads(free)
        object.__setattr__(self, "vehicle", with_preloads(free, held))
        object.__setattr__(self, "held", held)
        object.__setattr__(self, "numbers", free_vehicle_table(self))

    @property
    def gravity(self) -> np.ndarray:
        """Acceleration of gravity (3,) in m/s^2, in the axes of the sloping road."""
        return GRAVITY * np.array([-np.sin(self.slope), 0.0, -np.cos(self.slope)])

    def tyre_numbers(self, tyre_index: int) -> np.ndarray:
        """View of the numbers (PER_TYRE,) of tyre i in the table; changes to it take effect at once."""
        first = int(self.numbers[at.OF_TYRES]) + at.PER_TYRE * tyre_index
        return self.numbers[first : first + at.PER_TYRE]

    def changed(self, **changed_fields: object) -> "Handling":
        """Returns a copy of this vehicle on its tyres with other values in some fields."""
        return replace(self, **changed_fields)  # type: ignore[arg-type]

    def straight(self, speed: float) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and rates (n,) of straight rolling at a speed (m/s), with all other coordinates at rest."""
        places = self.vehicle.coordinates()
        v = np.zeros(len(places))
        v[0] = speed
        for tyre in self.vehicle.tyres:
            if (rotor_name(tyre.name), "ry") in places:
                v[places.index((rotor_name(tyre.name), "ry"))] = speed / tyre.point[2]
        return np.zeros(len(places)), v


def free_vehicle_table(vehicle_on_tyres: Handling) -> np.ndarray:
    """Table of all numbers that the compiled forces of a free vehicle read, in the order described in ``forces``."""
    free, chassis, of, points = (
        vehicle_on_tyres.vehicle,
        chassis_of(vehicle_on_tyres.given),
        patch_grid(vehicle_on_tyres.tyres.cells),
        _ForcePoints(vehicle_on_tyres.vehicle),
    )
    parts = [*_spring_rows(vehicle_on_tyres, points), *_bar_rows(vehicle_on_tyres, points)]
    tyres, knots = (
        [_tyre_row(vehicle_on_tyres, i, points) for i in range(len(free.tyres))],
        _control_knots(vehicle_on_tyres.controls, vehicle_on_tyres.pushes),
    )
    pushes = _push_rows(vehicle_on_tyres)
    held = {*pushes[at.PUSHED_BY : -1 : at.PER_PUSH], *(row[tree.JOINT] for row in points.rows)}
    sections = [
        _joint_rows(free, held),
        np.ravel(points.rows),
        np.ravel([row for row, _ in parts]),
        np.ravel(tyres),
        pushes,
        knots.ravel(),
        vehicle_on_tyres.waves.ravel(),
        of.cells.ravel(),
        of.strips.ravel(),
    ]
    begins = at.HEADER + np.cumsum([0, *(section.size for section in sections)])
    curves = _put_curves(parts, sections[2], int(begins[-1]))
    joint, place = _point_position(free, chassis.name, chassis.position)
    drag = vehicle_on_tyres.given.drags[0].coefficient / 2.0 if vehicle_on_tyres.given.drags else 0.0
    counts = [
        begins[-1] + curves.size,
        len(free.coordinates()),
        len(points.rows),
        len(parts),
        len(free.tyres),
        knots.shape[2],
        len(vehicle_on_tyres.waves),
    ]
    places = [*begins[1:4], *begins[5:-1]]  # pushes are found from the controls
    head = [*counts, joint, drag, *place, of.cells.shape[1], of.strips.shape[1], of.middle, *places]
    return np.concatenate([np.array(head, float), *sections, curves])


class _ForcePoints:
    """List of points at which forces act, without duplicates; their rows are in the form that ``tree`` reads."""

    def __init__(self, vehicle: SpatialVehicle) -> None:
        self.vehicle, self.rows = vehicle, list[tuple[float, ...]]()

    def number(self, body: str, point: Vector) -> int:
        """Index of a point on a body, given by its position (m) in the design position; a new point is added to the
        list."""
        joint, place = _point_position(self.vehicle, body, point)
        row = (float(joint), *place.tolist())
        if row not in self.rows:
            self.rows.append(row)
        return self.rows.index(row)


def _joint_rows(vehicle: SpatialVehicle, loaded_coordinates: set[float]) -> np.ndarray:
    """Table rows of all coordinates, each with the number of coordinates of its body. The rotation of a body that
    carries nothing is marked ``LOOSE``.

    loaded_coordinates : coordinates that are the last to move a point where something acts.
    """
    rows, counts = joint_table(vehicle), [len(body.freedoms) for body in vehicle.bodies for _ in body.freedoms]
    bears = {*rows[:, tree.BELOW], *loaded_coordinates}
    loose = [counts[j] == 1 and row[tree.KIND] >= 3.0 and j not in bears for j, row in enumerate(rows)]
    rows[loose, tree.KIND] = tree.LOOSE
    return np.column_stack([rows, counts]).ravel()


def _point_position(vehicle: SpatialVehicle, body: str, point: Vector) -> tuple[int, np.ndarray]:
    """Index of the last coordinate that moves a point, and the point's position (m) relative to that joint."""
    joint, origin = last_coordinate_and_joint(vehicle, body)
    return joint, np.subtract(point, origin)


_PartRow = tuple[list[float], tuple[Curve | None, ...]]
"""Numbers of a spring or bar, as ``parts`` reads them, and its curves of force over travel and over rate."""


def _spring_rows(vehicle_on_tyres: Handling, force_points: _ForcePoints) -> Iterator[_PartRow]:
    for s in vehicle_on_tyres.vehicle.springs:
        if s.second_body is None:
            raise InputError(
                vehicle_on_tyres.vehicle.name,
                f"springs[{s.name}].bodies",
                s.name,
                "a free vehicle is not tied to the ground",
            )
        ends = force_points.number(s.first_body, s.first_point), force_points.number(s.second_body, s.second_point)
        rest = float(np.dot(np.subtract(s.second_point, s.first_point), s.axis))
        law = [s.stiffness, s.damping, vehicle_on_tyres.held.parts[s.name], s.friction, s.friction_rate, rest]
        frame = _last_coordinate_of_frame(vehicle_on_tyres.vehicle, f"springs[{s.name}]", s.frame)
        yield [*law, -1.0, 0.0, *ends, *s.axis, 0.0, 0.0, frame], (s.travel_force, s.rate_force)


def _bar_rows(vehicle_on_tyres: Handling, force_points: _ForcePoints) -> Iterator[_PartRow]:
    for bar in vehicle_on_tyres.vehicle.bars:
        ends = force_points.number(bar.left, bar.point_left), force_points.number(bar.right, bar.point_right)
        rest, frame = (
            (bar.point_right[2] - bar.point_left[2]) / bar.track,
            _last_coordinate_of_frame(vehicle_on_tyres.vehicle, bar.name, bar.frame),
        )
        law = [bar.stiffness, bar.damping, vehicle_on_tyres.held.parts[bar.name], 0.0, 1.0, rest]
        turns = [-1.0, 0.0] if frame else [float(vehicle_on_tyres.vehicle.coordinates().index((bar.body, "rx"))), 1.0]
        yield [*law, *turns, *ends, 0.0, 0.0, 1.0 / bar.track, 0.0, 0.0, frame], (None, None)


def _last_coordinate_of_frame(vehicle: SpatialVehicle, part_key_path: str, frame_body: str | None) -> float:
    """Last coordinate of the body in which the axis of a spring or bar is fixed; 0 for the carrier."""
    if frame_body == CARRIER:
        return 0.0
    if frame_body not in vehicle.towed:
        allowed = "must be left out, or be a towed body: in handling axes are fixed in the carrier, which only yaws"
        raise InputError(vehicle.name, f"{part_key_path}.frame", frame_body, allowed, vehicle.towed)
    return float(last_coordinate_and_joint(vehicle, frame_body)[0])


def _put_curves(part_rows: list[_PartRow], table_rows: np.ndarray, first_index: int) -> np.ndarray:
    """Numbers of all force curves. The position of each curve, counted from ``first_index``, is also written into the
    row of its spring."""
    laid_curves = np.empty(0)
    for row, (_, curves) in zip(table_rows.reshape(-1, PER_PART), part_rows, strict=True):
        for column, curve in zip((ON_TRAVEL, ON_RATE), curves, strict=True):
            if curve is not None:
                row[column] = first_index + laid_curves.size
                laid_curves = np.concatenate((laid_curves, curve_numbers(curve)))
    return laid_curves


def _tyre_row(vehicle_on_tyres: Handling, tyre_index: int, force_points: _ForcePoints) -> list[float]:
    """Numbers of tyre i. Its bristle stiffness is chosen such that, at static load, it has the ride vehicle's cornering
    stiffness."""
    free, of = vehicle_on_tyres.vehicle, vehicle_on_tyres.tyres
    tyre, places = free.tyres[tyre_index], free.coordinates()
    joint, _ = _point_position(free, tyre.body, tyre.point)
    load = vehicle_on_tyres.held.tyres[tyre.name]
    if not load > 0.0:
        raise InputError(free.name, f"tyres[{tyre.name}]", load, "carries no weight: it must press on the road at rest")
    sunk = load / tyre.stiffness
    radius = tyre.point[2] + sunk
    cornering = next(force.stiffness for force in vehicle_on_tyres.given.side_forces if force.name == tyre.name)
    bristles = cornering / (cornering_stiffness_factor(of.cells) * radius * sunk * of.half_width)
    spins = (rotor_name(tyre.name), "ry")
    axle = [t for t in free.tyres if t.axle == tyre.axle]
    share, front, c = 1.0 / len(axle), tyre.axle == 0, vehicle_on_tyres.controls
    rear, towed = max(t.axle for t in free.tyres) or 1, free.towed_under(tyre.body)
    driven = max(t.axle for t in free.tyres if free.towed_under(t.body) is None) or 1
    brake = share * (c.front_brake if front else (1.0 - c.front_brake) / rear)
    drive = 0.0 if towed else share * (c.front_drive if front else (1.0 - c.front_drive) / driven)
    leans = 0.0 if towed else np.sign(tyre.point[1]) * of.inclination
    carrying, _ = last_coordinate_and_joint(free, towed or chassis_of(vehicle_on_tyres.given).name)
    return [
        joint,
        places.index(spins) if spins in places else -1,
        force_points.number(tyre.body, tyre.point),
        tyre.point[2],
        load,
        tyre.stiffness,
        tyre.damping,
        radius,
        of.half_width,
        bristles,
        of.friction,
        float(front),
        brake,
        drive,
        leans,
        of.brake_rate,
        carrying,
        float(towed is not None),
    ]


def _push_rows(vehicle_on_tyres: Handling) -> np.ndarray:
    """A row of numbers for each external push, and then the number of pushes."""
    names = tuple(body.name for body in vehicle_on_tyres.vehicle.bodies)
    for push in vehicle_on_tyres.pushes:
        if push.body not in names:
            raise InputError(vehicle_on_tyres.given.name, "pushes", push.body, "no such body", names)
    rows = [
        [joint, *place, *push.axis]
        for push in vehicle_on_tyres.pushes
        for joint, place in [_point_position(vehicle_on_tyres.vehicle, push.body, push.point)]
    ]
    return np.array([*np.ravel(rows), len(rows)])


def _control_knots(controls: Controls, pushes: tuple[Push, ...]) -> np.ndarray:
    """Knots (3 + pushes, 2, k) of steer, brake, drive and pushes: times and values, padded behind the last knot."""
    all_knots = (controls.steer, controls.brake, controls.drive, *(push.size for push in pushes))
    most = max(map(len, all_knots))
    filled = [
        (*knots, *[(knots[-1][0] + 1.0 + i, knots[-1][1]) for i in range(most - len(knots))]) for knots in all_knots
    ]
    return np.array(filled, float).transpose(0, 2, 1)
