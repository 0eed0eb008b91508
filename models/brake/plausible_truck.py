"""What no usual vehicle that brakes in the plane has: its parameters against the bounds of ``plausible``."""

from models.brake.plane_vehicle import Truck
from models.core.finding import Finding
from models.vehicles.plausible import GYRATION, HEIGHT, MASS, TRACK, WHEELBASE

RADIUS = 0.1, 1.5
"""m, of a wheel."""


def plausible_truck(truck: Truck) -> tuple[Finding, ...]:
    """All queries, each at the name of its parameter."""
    radius, gyration = (truck.yaw_inertia / truck.mass) ** 0.5, GYRATION["rz"]
    span = gyration[0] * truck.wheelbase, gyration[1] * truck.wheelbase
    looks = [
        ("mass", "mass", truck.mass, MASS, "kg", "Masses are in kg"),
        ("size", "wheelbase", truck.wheelbase, WHEELBASE, "m", "Lengths are in m"),
        ("size", "height", truck.height, (0.0, HEIGHT), "m", "Lengths are in m"),
        ("inertia", "radius of gyration by yaw_inertia", radius, span, "m", "Inertias are in kg m^2"),
    ]
    for name, axle in (("front", truck.front), ("rear", truck.rear)):
        looks.append(("size", f"{name}.track", axle.track, TRACK, "m", "Lengths are in m"))
        looks.append(("size", f"{name}.radius", axle.radius, RADIUS, "m", "Lengths are in m"))
    return tuple(
        Finding(
            check,
            "doubt",
            place,
            f"{place}: {value:.4g} {unit}; usual are {usual[0]:.3g} to {usual[1]:.3g} {unit}. {remedy}.",
            value,
            unit,
        )
        for check, place, value, usual, unit, remedy in looks
        if not usual[0] <= value <= usual[1]
    )
