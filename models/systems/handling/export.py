"""Export of the vehicle of a handling scene as a model file of an engine: bodies and joints."""

from models.engines.export import ExportedModel, ExportSubject, elements_left_out, export_free_vehicle
from models.multibody.numbers import Handling
from models.systems.handling.run import driven_model
from models.systems.handling.scene import HandlingScene

AXES_TEXT = "x forward, y left, z up; the carrier has x, y and yaw, the sway z, roll and pitch; zero is the design."


def exported(scene: HandlingScene, engine: str) -> ExportedModel:
    """Export the vehicle of the first manoeuvre, without springs, tyres and driver, as a model file of "mujoco" or
    "exudyn".
    """
    handling = scene.model_with_scene_controls(next(iter(scene.manoeuvres)))
    return export_handling(
        engine, handling, ExportSubject(scene.title, scene.file, AXES_TEXT), ["the driver's steer and torques"]
    )


def export_handling(
    engine: str, handling_model: Handling, export_subject: ExportSubject, further_omissions: list[str]
) -> ExportedModel:
    """Export a vehicle as a model file of an engine. ``further_omissions`` lists what the file leaves out besides
    springs, tyres and other forces of the vehicle.
    """
    left_out = [*elements_left_out(handling_model.vehicle), *further_omissions]
    return export_free_vehicle(engine, driven_model(handling_model), export_subject, left_out)
