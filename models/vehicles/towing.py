"""Static load of a towed body on its hitch, and a line of text about it."""

from models.vehicles.spatial import SpatialVehicle, hitch_of
from models.vehicles.spatial_linear import Preloads


def hitch_load(vehicle: SpatialVehicle, preloads: Preloads, towed_body: str) -> float:
    """Static load (N, downwards) on the hitch from a towed body and all bodies that it carries and tows.

    preloads : of the vehicle under its gravity; tyres carry the other part of the weight.
    """
    weight = sum(body.mass for body in vehicle.bodies if towed_body in vehicle.chain(body.name)) * vehicle.gravity
    return weight - sum(preloads.tyres[tyre.name] for tyre in vehicle.tyres if towed_body in vehicle.chain(tyre.body))


def hitch_line(vehicle: SpatialVehicle, preloads: Preloads, towed_body: str) -> str:
    """Text about a towed body: which body tows it, position and freedoms of its hitch, and static load on the hitch
    (N)."""
    hitch, load = vehicle.body(hitch_of(towed_body)), hitch_load(vehicle, preloads, towed_body)
    x, y, z = hitch.position
    towing = vehicle.chain(towed_body)[2]
    turns = " ".join(hitch.freedoms)
    return f"{towed_body}, towed by {towing} at ({x:g}, {y:g}, {z:g}) m, turns {turns}; {load:.0f} N on it"
