"""Export of the wheelset of a scene as a model file of an engine: body, joints and suspension, without the rails."""

from models.engines.export import ExportedModel, ExportSubject, export_free_vehicle
from models.engines.wheelset import driven_wheelset
from models.systems.wheelset.of_scene import equations_of, path_speeds
from models.systems.wheelset.scene import WheelsetScene

AXES_TEXT = "x along the track, y to the right, z down; the frame travels with the wheelset."
OMISSIONS_TEXTS = ("normal and creep forces of the right rail", "normal and creep forces of the left rail")


def exported(scene: WheelsetScene, engine: str) -> ExportedModel:
    """Export the wheelset, without the forces of the rails, as a model file of "mujoco" or "exudyn"."""
    equations = equations_of(scene, engine, path_speeds(scene)[0])
    return export_free_vehicle(
        engine, driven_wheelset(equations), ExportSubject(scene.title, scene.file, AXES_TEXT), OMISSIONS_TEXTS
    )
