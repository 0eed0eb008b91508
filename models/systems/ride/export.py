"""Export of the vehicle of a ride scene as a model file of an engine."""

from dataclasses import replace

import numpy as np

from models.engines.export import (
    ExportedModel,
    ExportSubject,
    coordinate_names,
    elements_left_out,
    exported_exudyn_system,
    exported_mujoco_model,
    exported_names,
    masses_of_shown_bodies,
)
from models.engines.spatial_protocol import check_buildable
from models.systems.ride.of_scene import vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle

AXES_TEXT = "x forward, y left, z up from the ground; the frame moves with the vehicle; zero is the design position."


def exported(scene: RideScene, engine: str) -> ExportedModel:
    """Export the vehicle as a model file of "mujoco" (bodies and joints) or "exudyn" (with linear springs and tyres).
    Raises Refused for reduced vehicles.
    """
    vehicle = vehicle_of(scene)
    check_buildable(engine, vehicle)
    by_speed = [
        *(f"side force {force.name!r}" for force in vehicle.side_forces),
        *(f"drag of {drag.body!r}" for drag in vehicle.drags),
    ]
    still = replace(vehicle, side_forces=(), drags=(), outputs=())
    subject = ExportSubject(scene.title, scene.file, AXES_TEXT)
    return (_in_exudyn if engine == "exudyn" else _in_mujoco)(still, subject, by_speed)


def _in_exudyn(
    vehicle: SpatialVehicle, export_subject: ExportSubject, speed_dependent_items: list[str]
) -> ExportedModel:
    from models.engines.exudyn_export import items_with_functions
    from models.engines.spatial_exudyn_build import RoadRows, assemble

    built = assemble(vehicle, None, RoadRows(np.zeros((1, 2 * len(vehicle.tyres))), 0.0))
    mbs = built.mbs
    mbs.Assemble()
    node_indices = [built.coordinate_nodes[coordinate] for coordinate in vehicle.coordinates()]
    columns = [mbs.GetNodeODE2Index(node) + index for node, index in node_indices]
    names = dict(zip(coordinate_names(vehicle), columns, strict=True))
    return exported_exudyn_system(mbs, names, export_subject, [*items_with_functions(mbs), *speed_dependent_items])


def _in_mujoco(
    vehicle: SpatialVehicle, export_subject: ExportSubject, speed_dependent_items: list[str]
) -> ExportedModel:
    from models.engines.mujoco_export import add_shapes
    from models.engines.mujoco_inertia import with_realisable_inertia
    from models.engines.mujoco_tree import MujocoIndices, mujoco_specification, set_masses

    left_out = [*elements_left_out(vehicle), *speed_dependent_items]
    vehicle, lowered = with_realisable_inertia(vehicle)
    spec = mujoco_specification(vehicle, 1e-3)
    add_shapes(spec, masses_of_shown_bodies(vehicle, {body.name for body in spec.bodies}))
    model = spec.compile()
    set_masses(model, MujocoIndices(vehicle, model), vehicle.bodies)
    return exported_mujoco_model(spec, model, exported_names(vehicle), export_subject, [*left_out, *lowered])
