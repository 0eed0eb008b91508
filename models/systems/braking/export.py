"""Export of the suspended vehicle of a braking scene as a model file of an engine: bodies and joints."""

from models.core.errors import InputError
from models.engines.export import ExportedModel, ExportSubject
from models.systems.braking.of_scene import sprung_of
from models.systems.braking.scene import BrakingScene
from models.systems.handling.export import AXES_TEXT, export_handling


def exported(scene: BrakingScene, engine: str) -> ExportedModel:
    """Export the vehicle on its suspension as a model file of "mujoco" or "exudyn". Raises InputError for a vehicle in
    the plane, of which engines have no model.
    """
    if scene.vehicle.file is None:
        allowed = "is in the plane, by equations of twinrig's: give vehicle.file, a vehicle on its suspension"
        raise InputError(scene.file, "vehicle.parameters", scene.vehicle.parameters, allowed)
    omissions = ["spin of the wheels, brakes and controller"]
    return export_handling(
        engine, sprung_of(scene).handling, ExportSubject(scene.title, scene.file, AXES_TEXT), omissions
    )
