"""The vehicle that a scene names: a vehicle that comes with twinrig, a vehicle file in TOML, or a car in MJCF."""

from pathlib import Path

from models.core.scene_file import existing_file
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle

MJCF_EXTENSION = ".xml"


def scene_vehicle(
    name: str,
    folder: str | Path = ".",
    file: str = "",
    place: str = "",
    allows_reduced: bool = False,
    allows_towing: bool = False,
) -> SpatialVehicle:
    """The unloaded vehicle of a scene, by its name or by a file relative to ``folder``.

    ``file`` and ``place`` say who asked for it, for the message if there is none. allows_reduced, allows_towing : may a
    vehicle file have [reduced], and may it tow? Raises InputError."""
    if name.endswith(MJCF_EXTENSION):
        from models.own_model.car import vehicle_of_file

        return vehicle_of_file(existing_file(name, Path(folder), file, place))
    return load_vehicle(name, folder, file, place, allows_reduced, allows_towing)
