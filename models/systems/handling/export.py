"""The vehicle of a scene of handling as a file of its engine: bodies and joints."""

from models.engines.export import Exported, ExportSubject, elements_left_out, export_free_vehicle
from models.multibody.numbers import Handling
from models.systems.handling.run import driven_by
from models.systems.handling.scene import HandlingScene

AXES = "x forward, y left, z up; the carrier has x, y and yaw, the sway z, roll and pitch; zero is the design."


def exported(scene: HandlingScene, engine: str) -> Exported:
    """Export the vehicle of the first manoeuvre to "mujoco" or "exudyn", without springs, tyres and driver."""
    handling = scene.car(next(iter(scene.manoeuvres)))
    return of_handling(
        engine, handling, ExportSubject(scene.title, scene.file, AXES), ["the driver's steer and torques"]
    )


def of_handling(
    engine: str, handling: Handling, export_subject: ExportSubject, further_omissions: list[str]
) -> Exported:
    """Export a vehicle of the handling system; ``further_omissions`` lists what the model leaves out besides the
    vehicle's own parts.
    """
    left_out = [*elements_left_out(handling.vehicle), *further_omissions]
    return export_free_vehicle(engine, driven_by(handling), export_subject, left_out)
