"""Export of the vehicle of a recording's scene as a model file of an engine."""

from models.core.errors import InputError
from models.engines.export import ExportedModel, ExportSubject
from models.systems.hub_forces.export import AXES_TEXT, export_cut_vehicle
from models.systems.measured.scene import MeasuredScene


def exported(scene: MeasuredScene, engine: str) -> ExportedModel:
    """Export the vehicle without tyres as a model file of "mujoco" or "exudyn". Raises InputError for the pitch plane,
    which a scene of that system exports.
    """
    vehicle = scene.rig().vehicle
    if vehicle is None:
        allowed = "is driven in the pitch plane: export a scene of that system with the same parameters"
        raise InputError(scene.file, "vehicle.parameters", scene.vehicle.parameters, allowed)
    return export_cut_vehicle(
        engine, vehicle, ExportSubject(scene.title, scene.file, AXES_TEXT), ["stabiliser of roll and pitch"]
    )
