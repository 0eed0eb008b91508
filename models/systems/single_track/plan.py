"""What a scene of a measured drive will compute: printed by ``twinrig show``, checked before any run."""

from models.core.assumptions import assumption_lines
from models.measured.drive import read_drive
from models.systems.single_track.assumptions import assumptions
from models.systems.single_track.run import equation_inputs
from models.systems.single_track.scene import SingleTrackScene


def check(scene: SingleTrackScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for a measured file that contains no drive."""
    equation_inputs(read_drive(scene.path(scene.drive.file, "drive.file"), tuple(scene.drive.stretch)), scene)


def describe(scene: SingleTrackScene) -> str:
    """Returns the plan of a single-track scene as text: vehicle, axles, measured drive, assumptions."""
    car, drive = scene.vehicle, read_drive(scene.path(scene.drive.file, "drive.file"), tuple(scene.drive.stretch))
    left_out = ", ".join(f"{count} of {name}" for name, count in drive.left_out.items())
    lines = {
        "scene": f"{scene.file}, study {scene.study}",
        "vehicle": f"{car.mass:g} kg, axles {car.front:g} m ahead of its centre and {car.rear:g} m behind it",
        **{name: _axle_text(getattr(scene, name)) for name in ("front", "rear")},
        "drive": f"{scene.drive.file}, {drive.times[0]:g} to {drive.times[-1]:g} s, "
        f"{drive.speed.min():.3g} to {drive.speed.max():.3g} m/s",
        "left out": f"{left_out} (spikes and samples that were not measured)",
        "never": "roll, tyres that build up their force slowly, bank and slope of the road, a driver",
    }
    lines_of_text = [f"  {head:<10} {text}" for head, text in lines.items()]
    return "\n".join([scene.title, *lines_of_text, *assumption_lines(assumptions(scene))])


def _axle_text(axle_table: object) -> str:
    """Text on the tyres of an axle: cornering stiffness, friction, sharpness of the bend between them."""
    stiffness, friction, sharpness = (getattr(axle_table, name) for name in ("stiffness", "friction", "sharpness"))
    return f"cornering stiffness {stiffness:.4g} of the load per rad, friction {friction:.4g}, bend {sharpness:.3g}"
