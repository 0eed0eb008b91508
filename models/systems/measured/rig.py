"""What a recording drives: a vehicle in space, cut at its wheels, or the pitch-plane vehicle; by names alone."""

from dataclasses import dataclass

from models.measured.axle_forces import AXLES
from models.measured.places import Places
from models.systems.measured.pitch_plane import CHASSIS, SPRINGS
from models.systems.measured.sections import names
from models.vehicles.cut_vehicle import CutVehicle


@dataclass(frozen=True)
class Rig:
    """name : of the vehicle; chassis : whose angles hold it; vehicle : None of the pitch plane; sections that can be
    asked for; angles : the components that hold it."""

    name: str
    chassis: str
    places: Places
    sections: tuple[str, ...]
    angles: tuple[str, ...]
    vehicle: CutVehicle | None

    @property
    def hubs(self) -> tuple[str, ...]:
        """Where forces are put in."""
        return self.places.hubs


def in_space(vehicle: CutVehicle, sensors: tuple[str, ...]) -> Rig:
    """A cut vehicle."""
    bodies = tuple(body.name for body in vehicle.whole.bodies)
    places = Places(vehicle.hubs, bodies, tuple(element.name for element in vehicle.elements), sensors)
    return Rig(vehicle.tree.name, vehicle.chassis, places, names(vehicle), ("roll", "pitch"), vehicle)


def in_plane(parameters: str) -> Rig:
    """The pitch plane with a parameter set: forces at its axles, or at the wheels of each."""
    hubs = tuple(name for names in AXLES.values() for name in names)
    springs = tuple(SPRINGS.values())
    return Rig(parameters, CHASSIS, Places(hubs, (CHASSIS,), springs), springs, ("pitch",), None)
