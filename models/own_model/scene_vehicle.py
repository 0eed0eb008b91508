"""The vehicle that a scene names: a vehicle that comes with twinrig, a vehicle file in TOML, or a car in MJCF."""

from pathlib import Path

from models.core.scene_file import existing_file
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle

MJCF_EXTENSION = ".xml"


def scene_vehicle(
    vehicle_name: str,
    scene_folder: str | Path = ".",
    scene_path: str = "",
    key_path: str = "",
    allows_reduced_vehicle: bool = False,
    allows_towing: bool = False,
) -> SpatialVehicle:
    """The unloaded vehicle of a scene, by its name or by a file relative to ``scene_folder``.

    ``scene_path`` and ``key_path`` say who asked for it, for the message if there is none. allows_reduced_vehicle,
    allows_towing : may a vehicle file have [reduced], and may it tow? Raises InputError."""
    if vehicle_name.endswith(MJCF_EXTENSION):
        from models.own_model.car import vehicle_of_file

        return vehicle_of_file(existing_file(vehicle_name, Path(scene_folder), scene_path, key_path))
    return load_vehicle(vehicle_name, scene_folder, scene_path, key_path, allows_reduced_vehicle, allows_towing)
