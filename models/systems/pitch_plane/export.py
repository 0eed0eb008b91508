"""Export of the pitch-plane vehicle as a model file of an engine: bodies, struts, tyres and pitch springs, without
road, wheel forces or prescribed motion.
"""

from models.engines.assembly import Assembly, Settings
from models.engines.export import ExportedModel, ExportSubject, exported_exudyn_system, exported_mujoco_model
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of

AXES_TEXT_BY_ENGINE = {
    "mujoco": "x forward, y right, z down, so that gravity is positive; pitch is positive with the nose up.",
    "exudyn": "x backward, y down; pitch is positive with the nose up.",
}
INPUTS_OF_MODE = {
    "free": (),
    "road": ("road under the tyres, flat here",),
    "force": ("forces at the wheels, in the inertial frame",),
    "force-body": ("forces at the wheels, along the chassis' own axis",),
    "pitch": ("forces at the wheels", "prescribed pitch, free here"),
    "heave-pitch": ("forces at the wheels", "prescribed heave and pitch of the chassis, free here"),
}
"""Inputs of the vehicle that an export leaves out, by the mode of excitation."""


def exported(scene: Scene, engine: str) -> ExportedModel:
    """Export the pitch-plane vehicle as a model file of "mujoco" or "exudyn"."""
    assembly, subject = assembly_of_scene(scene), ExportSubject(scene.title, scene.file, AXES_TEXT_BY_ENGINE[engine])
    left_out = _left_out(assembly)
    if engine == "exudyn":
        return _in_exudyn(assembly, subject, left_out)
    return _in_mujoco(assembly, settings_of(scene, engine), subject, left_out)


def _left_out(vehicle_assembly: Assembly) -> list[str]:
    """Names of what the export leaves out: inputs, moments on the pitch, tyres that only push, and pitch springs with a
    dead band.
    """
    vehicle = vehicle_assembly.vehicle
    return [
        *INPUTS_OF_MODE[vehicle_assembly.mode],
        *(["moment that holds the pitch"] if vehicle_assembly.moment is not None else []),
        *(f"tyre {tyre.name!r}, which only pushes" for tyre in vehicle.tyres if tyre.pushes_only),
        *(
            f"pitch spring of {pitch_spring.body!r}, with its dead band"
            for pitch_spring in vehicle.pitch_springs
            if pitch_spring.dead_band
        ),
    ]


def _in_mujoco(
    vehicle_assembly: Assembly, solver_settings: Settings, export_subject: ExportSubject, omissions: list[str]
) -> ExportedModel:
    from models.engines.mujoco import specification
    from models.engines.mujoco_export import add_shapes

    spec = specification(vehicle_assembly.vehicle, solver_settings)
    add_shapes(spec, {body.name: body.mass for body in vehicle_assembly.vehicle.bodies})
    return exported_mujoco_model(spec, spec.compile(), {}, export_subject, omissions)


def _in_exudyn(vehicle_assembly: Assembly, export_subject: ExportSubject, omissions: list[str]) -> ExportedModel:
    from models.engines.exudyn import coordinate_indices, native_elements

    built, vehicle = native_elements(vehicle_assembly), vehicle_assembly.vehicle
    built.mbs.Assemble()
    names = [" ".join(coordinate) for coordinate in vehicle.coordinates()]
    return exported_exudyn_system(
        built.mbs, dict(zip(names, coordinate_indices(built, vehicle), strict=True)), export_subject, omissions
    )
