"""The wheelset of a scene as a file of its engine: body, joints, and the suspension."""

from models.engines.export import Exported, Subject, of_exudyn, of_mujoco
from models.systems.wheelset.of_scene import equations_of, path_speeds
from models.systems.wheelset.scene import WheelsetScene

AXES = "x along the track, y to the right, z down; the frame travels with the wheelset."
LEFT_OUT = ("normal and creep forces of the right rail", "normal and creep forces of the left rail")


def exported(scene: WheelsetScene, engine: str) -> Exported:
    """The wheelset in "mujoco" or "exudyn" without the rails."""
    subject = Subject(scene.title, scene.file, AXES)
    equations = equations_of(scene, engine, path_speeds(scene)[0])
    if engine == "exudyn":
        names = {name: i for i, name in enumerate(("y", "z", "yaw", "roll", "spin"))}
        return of_exudyn(equations.system[0], names, subject, LEFT_OUT)  # type: ignore[attr-defined]
    from models.engines.mujoco_export import add_shapes
    from models.engines.wheelset_mujoco import NAME, specified
    from models.rail.joint_forces import table

    spec = specified(table(float(equations.speed), equations.rails), equations.body)
    add_shapes(spec, {NAME: equations.body.mass})
    return of_mujoco(spec, spec.compile(), {}, subject, LEFT_OUT)
