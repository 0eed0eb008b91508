"""A braked vehicle on its suspension: the bodies of a vehicle file on a carrier that turns through any angle.

Its coordinates begin with those of the plane vehicle of the same file, x, y and heading of its centre of mass in the
design position; heave, roll and pitch of the chassis follow (see ``models.vehicles.free_vehicle``). Loads are those
that springs and tyres have at the time. Wheels turn as in the plane and are no bodies of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.brake.plane_vehicle import Axle, Truck
from models.core.errors import InputError
from models.multibody.numbers import Handling, Tyres
from models.vehicles.free_vehicle import CARRIER, SWAY, spinning
from models.vehicles.spatial import Freedom, SpatialVehicle, Vector

ROLL, PITCH = 4, 5
"""Places of the chassis' roll and pitch among the coordinates."""
LEADING: tuple[tuple[str, Freedom], ...] = (
    (CARRIER, "x"),
    (CARRIER, "y"),
    (CARRIER, "rz"),
    (SWAY, "z"),
    (SWAY, "rx"),
    (SWAY, "ry"),
)


@dataclass(frozen=True, eq=False)
class Sprung:
    """The vehicle as the engines build it, and the plane one that has its mass, axles and wheels."""

    handling: Handling
    plane: Truck

    @property
    def size(self) -> int:
        """Number of coordinates of the vehicle on its suspension."""
        return len(self.handling.vehicle.coordinates())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates."""
        return tuple(" ".join(place) for place in self.handling.vehicle.coordinates())


def sprung(vehicle: SpatialVehicle, spin_inertia: float, front: float = 0.5) -> Sprung:
    """A vehicle of two axles with two wheels each; spin_inertia (kg m^2): of a wheel
    whose tyre names none.

    front : share of the front axle in the plane vehicle's load transfer by lateral acceleration, which springs know
    here. Raises InputError for a vehicle of other axles, that tows, or that cannot be steered.
    """
    if vehicle.towed:
        allowed = "must not be towed: the wheels of a braked vehicle on its suspension are those of its chassis"
        raise InputError(vehicle.name, f"bodies[{vehicle.towed[0]}].hitch", None, allowed)
    tyres = sorted(vehicle.tyres, key=lambda tyre: (tyre.axle, -tyre.point[1]))
    if [tyre.axle for tyre in tyres] != [0, 0, 1, 1] or any(
        left.point[1] <= right.point[1] for left, right in (tyres[:2], tyres[2:])
    ):
        raise InputError(vehicle.name, "tyres", [tyre.name for tyre in tyres], "must be two of each of two axles")
    inertias = [spinning(tyre, spin_inertia) for tyre in tyres]
    for tyre, inertia, beside in zip(tyres, inertias, (1, 0, 3, 2), strict=True):
        if not inertia > 0.0 or inertia != inertias[beside]:
            allowed = "kg m^2 of its spin must be above 0, and the same for both wheels of its axle"
            raise InputError(vehicle.name, f"tyres[{tyre.name}]", inertia, allowed)
    centred = _moved(replace(vehicle, tyres=tuple(tyres)), -centre(vehicle))
    handling = Handling(centred, Tyres(spin_inertia=0.0))
    if handling.vehicle.coordinates()[: len(LEADING)] != LEADING:
        raise ValueError("the carrier and the sway are not the first bodies")
    return Sprung(handling, _plane(centred, inertias[::2], front))


def centre(vehicle: SpatialVehicle) -> np.ndarray:
    """(3,) m: centre of mass in the design position."""
    masses = np.array([body.mass for body in vehicle.bodies])
    return masses @ np.array([body.position for body in vehicle.bodies]) / masses.sum()


PLACES = ("position", "point", "first_point", "second_point", "point_left", "point_right")
"""What parts of a vehicle call their places."""


def _moved(vehicle: SpatialVehicle, distance: np.ndarray) -> SpatialVehicle:
    """The vehicle drawn elsewhere on the ground."""

    def at(part: Any, name: str) -> Vector:
        x, y, z = np.add(getattr(part, name), (distance[0], distance[1], 0.0))
        return float(x), float(y), float(z)

    parts: dict[str, Any] = {
        kind: tuple(
            replace(part, **{name: at(part, name) for name in PLACES if hasattr(part, name)})
            for part in getattr(vehicle, kind)
        )
        for kind in ("bodies", "springs", "tyres", "bars", "side_forces")
    }
    return replace(vehicle, **parts, axles=tuple(float(x + distance[0]) for x in vehicle.axles))


def _plane(vehicle: SpatialVehicle, spin_inertias: Sequence[float], front: float) -> Truck:
    """The plane vehicle of a centred one."""
    turn = sum(
        body.inertia[2][2] + body.mass * (body.position[0] ** 2 + body.position[1] ** 2) for body in vehicle.bodies
    )
    front_axle, rear_axle = (
        Axle(
            x=left.point[0],
            track=left.point[1] - right.point[1],
            radius=left.point[2],
            spin_inertia=inertia,
            roll_share=share,
        )
        for left, right, inertia, share in zip(
            vehicle.tyres[::2], vehicle.tyres[1::2], spin_inertias, (front, 1.0 - front), strict=True
        )
    )
    return Truck(
        mass=sum(body.mass for body in vehicle.bodies),
        yaw_inertia=turn,
        height=float(centre(vehicle)[2]),
        front=front_axle,
        rear=rear_axle,
    )
