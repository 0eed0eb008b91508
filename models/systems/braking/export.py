"""The vehicle of a braking scene as a file of its engine: bodies and joints of one on its suspension."""

from models.core.errors import InputError
from models.engines.export import Exported, ExportSubject
from models.systems.braking.of_scene import sprung_of
from models.systems.braking.scene import BrakingScene
from models.systems.handling.export import AXES, export_handling


def exported(scene: BrakingScene, engine: str) -> Exported:
    """Export the vehicle on its suspension; InputError for a vehicle in the plane, of which engines have no model."""
    if scene.vehicle.file is None:
        allowed = "is in the plane, by equations of twinrig's: give vehicle.file, a vehicle on its suspension"
        raise InputError(scene.file, "vehicle.parameters", scene.vehicle.parameters, allowed)
    omissions = ["spin of the wheels, brakes and controller"]
    return export_handling(engine, sprung_of(scene).handling, ExportSubject(scene.title, scene.file, AXES), omissions)
