"""Export of the vehicle of a hub forces scene as a model file of an engine: bodies, joints, and native springs."""

import numpy as np

from models.engines.export import ExportedModel, ExportSubject, export_free_vehicle
from models.engines.free_vehicle import LoadedVehicle
from models.engines.native_parts import divide_between_engine_and_callback
from models.systems.hub_forces.scene import HubScene
from models.vehicles.cut_vehicle import CutVehicle

AXES_TEXT = (
    "x forward, y left, z up; the chassis has position, heading, pitch (nose down) and roll; zero is the design."
)


def exported(scene: HubScene, engine: str) -> ExportedModel:
    """Export the vehicle without tyres, hub forces and stabiliser as a model file of "mujoco" or "exudyn"."""
    vehicle = scene.cut_vehicle()
    omissions = [] if scene.stabilise.method == "none" else [f"stabiliser of roll and pitch ({scene.stabilise.method})"]
    return export_cut_vehicle(engine, vehicle, ExportSubject(scene.title, scene.file, AXES_TEXT), omissions)


def export_cut_vehicle(
    engine: str, vehicle: CutVehicle, export_subject: ExportSubject, further_omissions: list[str]
) -> ExportedModel:
    """Export a vehicle without tyres as a model file of an engine. ``further_omissions`` lists what the file leaves
    out besides hub forces and springs that the engine does not have.
    """
    division = divide_between_engine_and_callback(vehicle.tree, vehicle.elements, engine)
    weight = np.array([0.0, 0.0, -vehicle.tree.gravity])
    driven = LoadedVehicle(vehicle.tree, weight, np.zeros(1), None, None, division.native)
    left_out = [
        *(f"{name!r}, in part or as a whole: {why}" for name, why in division.reasons.items()),
        *(f"force and moment at the hub {hub!r}" for hub in vehicle.hubs),
        *further_omissions,
    ]
    return export_free_vehicle(engine, driven, export_subject, left_out)
