"""A braked vehicle on its suspension: the bodies of a vehicle file on a carrier that can turn to any heading.

Its coordinates begin with those of the plane vehicle of the same file, x, y and heading of its centre of mass in the
design position; heave, roll and pitch of the chassis follow (see ``models.vehicles.free_vehicle``). Loads are those
that springs and tyres have at the time. Wheels turn as in the plane and are no bodies of their own.

What the vehicle tows is a unit of its own in the plane, hinged to the one before it: its heading is that of the vehicle
and the yaws of all hitches up to its own. Surfaces under wheels, and the end of a stop, go by these units.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from models.brake.plane_vehicle import PlaneVehicle, Truck, TruckAxle, plane_of_truck
from models.core.errors import InputError
from models.multibody.numbers import Handling, TyreParameters
from models.vehicles.free_vehicle import CARRIER, SWAY, wheel_spin_inertia
from models.vehicles.spatial import Body, Freedom, SpatialVehicle, Tyre, Vector, hitch_of

ROLL, PITCH = 4, 5
"""Indices of the chassis' roll and pitch among the coordinates."""
LARGEST_HINGE_ANGLE = math.pi / 2.0
"""Yaw angle (rad) of a towed body relative to what tows it, beyond which a train jackknifes."""
WHEEL_LIMIT = 8
"""Largest number of wheels of a train: a controller's frame has room for as many."""
LEADING_COORDINATES: tuple[tuple[str, Freedom], ...] = (
    (CARRIER, "x"),
    (CARRIER, "y"),
    (CARRIER, "rz"),
    (SWAY, "z"),
    (SWAY, "rx"),
    (SWAY, "ry"),
)


@dataclass(frozen=True, eq=False)
class SprungVehicle:
    """A vehicle on its suspension as engines build it, and the plane vehicle with the same mass, axles and wheels,
    without trailers.

    wheel_inertias : (W,) kg m^2, inertias of the wheels, including those of trailers
    """

    handling: Handling
    plane: Truck
    wheel_inertias: tuple[float, ...]

    @property
    def size(self) -> int:
        """Number of coordinates of the vehicle on its suspension."""
        return len(self.handling.vehicle.coordinates())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates, each with its body and freedom."""
        return tuple(" ".join(body_freedom) for body_freedom in self.handling.vehicle.coordinates())

    @property
    def turns(self) -> np.ndarray:
        """Indices (towed,) of the yaw coordinates between each towed unit and the one that tows it."""
        return self._turning_coordinates("rz")

    @property
    def leans(self) -> np.ndarray:
        """Indices of the roll and pitch coordinates: of the chassis, then of each towed unit relative to the previous
        one.
        """
        return np.concatenate(([ROLL, PITCH], self._turning_coordinates("rx"), self._turning_coordinates("ry")))

    def _turning_coordinates(self, freedom: Freedom) -> np.ndarray:
        """Indices of the hitches' coordinates of one freedom, for all towed units that have it."""
        free = self.handling.vehicle
        hitch_coordinates = [(hitch_of(name), freedom) for name in free.towed]
        known = free.coordinates()
        return np.array(
            [known.index(coordinate) for coordinate in hitch_coordinates if coordinate in known], dtype=np.int64
        )

    def in_plane(self, with_load_transfer: bool = True) -> PlaneVehicle:
        """``PlaneVehicle`` of the vehicle with its trailers and wheels. In a train, loads are the static ones that its
        springs carry.

        Each hitch is taken to lie in the middle plane of the towing unit.
        """
        plane, free = plane_of_truck(self.plane, with_load_transfer), self.handling.vehicle
        if not free.towed:
            return plane
        units = [_unit_inertia_and_position(free, name) for name in (None, *free.towed)]
        masses, inertias, centres = (np.array(column) for column in zip(*units, strict=True))
        unit_names = [free.towed_under(tyre.body) for tyre in free.tyres]
        unit = np.array([0 if name is None else 1 + free.towed.index(name) for name in unit_names])
        wheel_positions = np.array([tyre.point[:2] for tyre in free.tyres])
        wheel_positions[:, 0] -= centres[unit]
        zeros = np.zeros(unit.size)
        return plane._replace(
            masses=masses,
            inertias=inertias,
            arm_lengths=_hitch_reach(np.array([free.body(hitch_of(name)).position[0] for name in free.towed]), centres),
            unit=unit,
            load_unit=unit.copy(),
            place=wheel_positions,
            radius=np.array([tyre.point[2] for tyre in free.tyres]),
            spin_inertia=np.array(self.wheel_inertias),
            static_loads=np.array([self.handling.held.tyres[tyre.name] for tyre in free.tyres]),
            load_per_x_acceleration=zeros,
            load_per_y_acceleration=zeros.copy(),
            jackknife_angle=LARGEST_HINGE_ANGLE,
            units=np.arange(len(units)),
        )


def _hitch_reach(hitch_positions: np.ndarray, unit_centres: np.ndarray) -> np.ndarray:
    """Distances ``reach`` (U, U) of ``PlaneVehicle``, m, from the hitches' positions (U - 1,) and the units' centres
    (U,), both ahead of the vehicle's centre.
    """
    reach = np.zeros((unit_centres.size, unit_centres.size))
    for k in range(1, unit_centres.size):
        reach[k:, k - 1] = hitch_positions[k - 1] - (hitch_positions[k - 2] if k > 1 else unit_centres[0])
        reach[k, k] = unit_centres[k] - hitch_positions[k - 1]
    return reach


def _unit_inertia_and_position(vehicle: SpatialVehicle, towed_body: str | None) -> tuple[float, float, float]:
    """Mass (kg), yaw inertia (kg m^2) and position ahead (m) of a unit's centre of mass. The unit is a towed body with
    all that it carries, or the vehicle without its trailers.
    """
    bodies = [body for body in vehicle.bodies if vehicle.towed_under(body.name) == towed_body]
    masses, positions = np.array([body.mass for body in bodies]), np.array([body.position for body in bodies])
    x, y, _ = masses @ positions / masses.sum()
    return float(masses.sum()), _yaw_inertia(bodies, float(x), float(y)), float(x)


def _yaw_inertia(bodies: list[Body], x: float, y: float) -> float:
    """Inertia (kg m^2) of bodies about the vertical through a point x, y (m)."""
    return sum(
        body.inertia[2][2] + body.mass * ((body.position[0] - x) ** 2 + (body.position[1] - y) ** 2) for body in bodies
    )


def suspended_vehicle(
    vehicle: SpatialVehicle,
    spin_inertia: float,
    front_roll_share: float = 0.5,
    trailer_spring_code: Literal["native", "compiled"] = "native",
) -> SprungVehicle:
    """A two-axle vehicle with two wheels per axle, and its trailers, on its suspension; spin_inertia (kg m^2): for
    wheels whose tyres name no inertia.

    front_roll_share : share of the front axle in the lateral load transfer of the plane vehicle, while here the springs
    determine it; trailer_spring_code : who computes the trailers' springs, see ``Handling``. Raises InputError for a
    vehicle with other axles, with trailers that do not form a row, or without steering.
    """
    tyres = _tyres_by_axle(vehicle)
    _check_trailer_row(vehicle)
    inertias = _wheel_inertias(vehicle.name, tyres, spin_inertia)
    centred = _displaced_vehicle(replace(vehicle, tyres=tuple(tyres)), -centre_of_mass(vehicle))
    handling = Handling(centred, TyreParameters(spin_inertia=0.0), forces=trailer_spring_code)
    if handling.vehicle.coordinates()[: len(LEADING_COORDINATES)] != LEADING_COORDINATES:
        raise ValueError("the carrier and the sway are not the first bodies")
    return SprungVehicle(handling, _plane_truck(centred, inertias, front_roll_share), tuple(inertias))


def _tyres_by_axle(vehicle: SpatialVehicle) -> list[Tyre]:
    """Tyres axle by axle, left before right; InputError unless the vehicle has two axles, and these and all trailer
    axles have two tyres each.
    """
    tyres = sorted(vehicle.tyres, key=lambda tyre: (tyre.axle, -tyre.point[1]))
    names, on_front_unit = [tyre.name for tyre in tyres], [vehicle.towed_under(tyre.body) is None for tyre in tyres]
    pairs = list(zip(tyres[::2], tyres[1::2], strict=False))
    left_before_right = all(left.axle == right.axle and left.point[1] > right.point[1] for left, right in pairs)
    if (
        not left_before_right
        or [tyre.axle for tyre in tyres] != [k // 2 for k in range(2 * len(pairs))]
        or sum(on_front_unit) != 4
    ):
        of_towed = ", and of each axle behind them that is towed" if vehicle.towed else ""
        raise InputError(vehicle.name, "tyres", names, f"must be two of each of two axles{of_towed}")
    if not all(on_front_unit[:4]):
        raise InputError(vehicle.name, "axles", names, "must be first those of the vehicle, then those of what it tows")
    if len(tyres) > WHEEL_LIMIT:
        allowed = f"must be at most {WHEEL_LIMIT} of a braked train on its suspension"
        raise InputError(vehicle.name, "tyres", names, allowed)
    return tyres


def _wheel_inertias(vehicle_name: str, tyres: list[Tyre], spin_inertia: float) -> list[float]:
    """Inertias (kg m^2) of the wheels with these tyres, axle by axle; InputError unless both wheels of an axle are
    equal.
    """
    inertias = [wheel_spin_inertia(tyre, spin_inertia) for tyre in tyres]
    for number, (tyre, inertia) in enumerate(zip(tyres, inertias, strict=True)):
        if not inertia > 0.0 or inertia != inertias[number ^ 1]:
            allowed = "kg m^2 of its spin must be above 0, and the same for both wheels of its axle"
            raise InputError(vehicle_name, f"tyres[{tyre.name}]", inertia, allowed)
    return inertias


def _check_trailer_row(vehicle: SpatialVehicle) -> None:
    """Refuse trailers that are not coupled one behind the other, or have a coupling without yaw."""
    carrier: str | None = None
    for name in vehicle.towed:
        hitch = vehicle.body(hitch_of(name))
        if vehicle.towed_under(hitch.parent) != carrier:
            allowed = f"must be on {carrier!r} or on what it carries: a braked train is a row"
            raise InputError(vehicle.name, f"bodies[{name}].parent", hitch.parent, allowed)
        if "rz" not in hitch.freedoms:
            allowed = "must have rz: what is towed by a braked vehicle yaws beside it"
            raise InputError(vehicle.name, f"bodies[{name}].freedoms", list(hitch.freedoms), allowed)
        carrier = name


def bodies_without_trailer(vehicle: SpatialVehicle) -> list[Body]:
    """Bodies of the vehicle without the bodies that it tows."""
    return [body for body in vehicle.bodies if vehicle.towed_under(body.name) is None]


def centre_of_mass(vehicle: SpatialVehicle) -> np.ndarray:
    """Centre of mass (3,) in m, in the design position, of a vehicle without its trailers."""
    bodies = bodies_without_trailer(vehicle)
    masses = np.array([body.mass for body in bodies])
    return masses @ np.array([body.position for body in bodies]) / masses.sum()


POSITION_FIELDS = ("position", "point", "first_point", "second_point", "point_left", "point_right")
"""Names of the fields that hold positions of a vehicle's parts."""


def _displaced_vehicle(vehicle: SpatialVehicle, displacement: np.ndarray) -> SpatialVehicle:
    """The vehicle with all positions shifted by ``displacement`` (m) along and across, on the ground."""

    def moved_position(vehicle_element: Any, field_name: str) -> Vector:
        x, y, z = np.add(getattr(vehicle_element, field_name), (displacement[0], displacement[1], 0.0))
        return float(x), float(y), float(z)

    parts: dict[str, Any] = {
        kind: tuple(
            replace(
                element, **{name: moved_position(element, name) for name in POSITION_FIELDS if hasattr(element, name)}
            )
            for element in getattr(vehicle, kind)
        )
        for kind in ("bodies", "springs", "tyres", "bars", "side_forces")
    }
    return replace(vehicle, **parts, axles=tuple(float(x + displacement[0]) for x in vehicle.axles))


def _plane_truck(vehicle: SpatialVehicle, spin_inertias: Sequence[float], front_roll_share: float) -> Truck:
    """``Truck`` in the plane of a vehicle centred at its mass centre, without trailers; spin_inertias (kg m^2): of its
    wheels.
    """
    bodies = bodies_without_trailer(vehicle)
    front_axle, rear_axle = (
        TruckAxle(
            x=left.point[0],
            track=left.point[1] - right.point[1],
            radius=left.point[2],
            spin_inertia=inertia,
            roll_share=share,
        )
        for left, right, inertia, share in zip(
            vehicle.tyres[:4:2],
            vehicle.tyres[1:4:2],
            spin_inertias[:4:2],
            (front_roll_share, 1.0 - front_roll_share),
            strict=True,
        )
    )
    return Truck(
        mass=sum(body.mass for body in bodies),
        yaw_inertia=_yaw_inertia(bodies, 0.0, 0.0),
        height=float(centre_of_mass(vehicle)[2]),
        front=front_axle,
        rear=rear_axle,
    )
