"""What a towed body weighs on its hitch."""

from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import Preloads


def hitch_load(vehicle: SpatialVehicle, held: Preloads, towed: str) -> float:
    """Static load (N, downwards) of a towed body, and of all that it carries and tows, on its hitch.

    held : of the vehicle under its gravity, whose tyres bear the rest of their weight.
    """
    weight = sum(body.mass for body in vehicle.bodies if towed in vehicle.chain(body.name)) * vehicle.gravity
    return weight - sum(held.tyres[tyre.name] for tyre in vehicle.tyres if towed in vehicle.chain(tyre.body))
