"""A vehicle in space that may turn through any heading: the bodies, masses and springs of the ride vehicle on a yawing
carrier.

The laws of the ride hold along directions fixed in space, for small motion about straight travel. Here a massless
**carrier** on the ground has the chassis' motion in the plane, x, y and yaw, all finite (ISO 8855: x forward, y left, z
up). On it a massless **sway** has the rest, z, roll and pitch, about axes on the ground below the chassis' centre, and
the chassis is fixed to it. Springs and bars that name no frame have the carrier's. All that had no parent
rides on the chassis, which guides it: what it has no coordinate for, as wheels and occupants have none along y, it does
with the chassis, which feels its inertia and its weight there. So wheel loads balance the inertia of the whole vehicle.
Each tyre that turns gets a **rotor**, a body of its own with the spin.
"""

from dataclasses import replace

import numpy as np

from models.core.errors import InputError
from models.vehicles.spatial import FREEDOMS, AntiRollBar, Body, Freedom, SpatialVehicle, Tyre, Vector

CARRIER, SWAY, ROTOR = "carrier", "sway", "rotor"
ROTOR_MASS = 1e-9
"""Mass (kg) of a rotor: Exudyn divides by the mass of every body that has inertia."""
CARRIER_FREEDOMS: tuple[Freedom, ...] = ("x", "y", "rz")
SWAY_FREEDOMS: tuple[Freedom, ...] = ("z", "rx", "ry")


def free_vehicle(
    vehicle: SpatialVehicle, gravity: float = 9.81, spin_inertia: float = 0.0, bodies_without_spin: tuple[str, ...] = ()
) -> SpatialVehicle:
    """The vehicle on a yawing carrier body, without side forces, drag and outputs; its bodies are in tree order.

    gravity : m/s^2; spin_inertia : kg m^2 of each wheel about its axle where its tyre names none, 0 for wheels that do
    not spin; bodies_without_spin : tyres whose wheels do not spin. Raises InputError unless the vehicle's chassis has
    all six freedoms and no parent, and where a body that carries a tyre turns about the vertical beside it."""
    chassis = chassis_of(vehicle)
    _check_headings(vehicle, chassis.name)
    x, y, _ = chassis.position
    bodies = [
        Body(CARRIER, 0.0, (0.0, 0.0, 0.0), CARRIER_FREEDOMS),
        Body(SWAY, 0.0, (x, y, 0.0), SWAY_FREEDOMS, parent=CARRIER),
    ]
    bodies += [
        replace(body, freedoms=(), parent=SWAY) if body.name == chassis.name else body
        for body in with_chassis_as_parent(vehicle, chassis.name).bodies
    ]
    bodies += [
        Body(
            rotor_name(tyre.name),
            ROTOR_MASS,
            tyre.point,
            ("ry",),
            _inertia_about_y(wheel_spin_inertia(tyre, spin_inertia)),
            tyre.body,
        )
        for tyre in vehicle.tyres
        if spin_inertia and tyre.name not in bodies_without_spin
    ]
    bars = tuple(_bar_on_sway(bar) if bar.body == chassis.name else bar for bar in vehicle.bars)
    free = replace(
        vehicle, bodies=_bodies_before_riders(bodies), bars=bars, side_forces=(), drags=(), outputs=(), gravity=gravity
    )
    return free.in_frame(CARRIER)


def wheel_spin_inertia(tyre: Tyre, spin_inertia: float) -> float:
    """Inertia (kg m^2) of a wheel about its axle: the tyre's own value, else ``spin_inertia``."""
    return spin_inertia if tyre.spin_inertia is None else tyre.spin_inertia


def _inertia_about_y(inertia: float) -> tuple[Vector, Vector, Vector]:
    return (0.0, 0.0, 0.0), (0.0, inertia, 0.0), (0.0, 0.0, 0.0)


def with_chassis_as_parent(vehicle: SpatialVehicle, chassis_name: str) -> SpatialVehicle:
    """The vehicle with the chassis as the parent of every body that had none, so that these move in the chassis'
    axes."""
    return replace(
        vehicle,
        bodies=tuple(
            body if body.parent or body.name == chassis_name else replace(body, parent=chassis_name)
            for body in vehicle.bodies
        ),
    )


def chassis_of(vehicle: SpatialVehicle) -> Body:
    """The body on which the tyres' side forces act. Raises InputError unless it has all six freedoms."""
    names = {force.chassis for force in vehicle.side_forces if force.chassis not in vehicle.towed}
    missing = [tyre.name for tyre in vehicle.tyres if tyre.name not in {force.name for force in vehicle.side_forces}]
    if missing or len(names) != 1:
        raise InputError(
            vehicle.name,
            f"tyres[{missing[0]}].cornering" if missing else "chassis",
            None,
            "a vehicle that is steered needs a chassis, and the cornering stiffness of every tyre",
        )
    chassis = vehicle.body(names.pop())
    if chassis.parent is not None or set(chassis.freedoms) != set(FREEDOMS):
        allowed = "a vehicle that is steered needs a chassis with the freedoms x, y, z, rx, ry, rz and without a parent"
        raise InputError(vehicle.name, f"bodies[{chassis.name}].freedoms", list(chassis.freedoms), allowed)
    return chassis


def _check_headings(vehicle: SpatialVehicle, chassis_name: str) -> None:
    """Raise InputError for an axle that can yaw relative to the body that carries it, since tyre forces follow that
    body's heading."""
    hitches = {vehicle.body(name).parent for name in vehicle.towed}
    for tyre in vehicle.tyres:
        for name in vehicle.chain(tyre.body):
            if name != chassis_name and name not in hitches and "rz" in vehicle.body(name).freedoms:
                allowed = (
                    f"must not have rz: the body carries the tyre {tyre.name!r}, and tyres of a vehicle file keep to "
                    f"the heading of {chassis_name!r}, or of a body with a hitch, by which a trailer is towed"
                )
                raise InputError(vehicle.name, f"bodies[{name}].freedoms", list(vehicle.body(name).freedoms), allowed)


def rotor_name(tyre_name: str) -> str:
    """Name of the rotating body of a wheel."""
    return f"{tyre_name} {ROTOR}"


def last_coordinate_and_joint(vehicle: SpatialVehicle, body_name: str) -> tuple[int, Vector]:
    """Index of the last coordinate that moves a body, -1 if none does, and the position (m) of that coordinate's joint
    in the design position."""
    given_body = vehicle.body(body_name)
    last = [i for i, (name, _) in enumerate(vehicle.coordinates()) if name == body_name]
    if last:
        return last[-1], given_body.position
    return (-1, (0.0, 0.0, 0.0)) if given_body.parent is None else last_coordinate_and_joint(vehicle, given_body.parent)


def joint_table(vehicle: SpatialVehicle) -> np.ndarray:
    """Joint table (n, 5) of a vehicle with a row per coordinate: its kind (index in FREEDOMS), the coordinate below it
    (-1: none), and the vector (m) from the joint below to its own in the design position."""
    rows = []
    for body in vehicle.bodies:
        below, origin = (
            (-1, (0.0, 0.0, 0.0)) if body.parent is None else last_coordinate_and_joint(vehicle, body.parent)
        )
        for freedom in (freedom for freedom in FREEDOMS if freedom in body.freedoms):
            rows.append([FREEDOMS.index(freedom), below, *np.subtract(body.position, origin)])
            below, origin = len(rows) - 1, body.position
    return np.array(rows)


def freedom_axes(vehicle: SpatialVehicle) -> np.ndarray:
    """Axes (n, 3, 3), as columns, of the freedoms of each coordinate's body in the design position."""
    axes = [vehicle.body(name).axes for name, _ in vehicle.coordinates()]
    return np.array(axes, float).reshape(-1, 3, 3).transpose(0, 2, 1)


def _bar_on_sway(bar: AntiRollBar) -> AntiRollBar:
    return replace(bar, body=SWAY)


def _bodies_before_riders(bodies: list[Body]) -> tuple[Body, ...]:
    """Bodies in tree order: each body is followed directly by all bodies that it carries, as engines number them."""
    walked: list[Body] = []

    def walk(parent_name: str | None) -> None:
        for body in bodies:
            if body.parent == parent_name:
                walked.append(body)
                walk(body.name)

    walk(None)
    return tuple(walked)
