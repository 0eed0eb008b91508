"""The vehicle that a scene names: one that comes with twinrig, a vehicle file in TOML, or a car in MJCF."""

from pathlib import Path

from models.core.scene_file import existing
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle

MJCF = ".xml"


def scene_vehicle(
    name: str, folder: str | Path = ".", file: str = "", place: str = "", reduced: bool = False, towing: bool = False
) -> SpatialVehicle:
    """The vehicle by its name or by a file relative to ``folder``; unloaded.

    ``file`` and ``place`` say who asked for it, for the message if there is none. reduced, towing : may a vehicle file
    have [reduced], and may it tow? Raises InputError.
    """
    if name.endswith(MJCF):
        from models.own_model.car import car

        return car(existing(name, Path(folder), file, place))
    return load_vehicle(name, folder, file, place, reduced, towing)
