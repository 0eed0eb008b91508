"""What a scene of hub forces will compute: printed by ``twinrig show``, checked before any run."""

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.core.scene_effects import lines as effect_lines
from models.engines.cut_vehicle import check_step
from models.multibody.cut_rigid import rigid
from models.systems.hub_forces.judged import judged
from models.systems.hub_forces.scene import HubScene
from models.vehicles.plausible import plausible

COMPARING = "hub_forces"
"""The study that runs a scene with every stabiliser and without, whichever it names."""


def check(scene: HubScene, engines: tuple[str, ...]) -> None:
    """Everything that can be refused before a run is refused here, before any file is written."""
    vehicle = scene.cut_vehicle()
    check_step(engines[-1], vehicle, scene.run.step, scene.run.duration)
    if scene.forces.frame == "inertial":
        growth = float(rigid(vehicle).toppling().max()) / (2 * np.pi)
        if scene.stabilise.bandwidth <= growth:
            raise InputError(
                scene.file,
                "stabilise.bandwidth",
                scene.stabilise.bandwidth,
                f"must be above {growth:.3g} Hz: forces that keep their directions topple the vehicle so fast",
            )
    if scene.forces.file is not None:
        judged(scene, vehicle)


def findings(scene: HubScene) -> tuple[Finding, ...]:
    """Queries about the vehicle, and doubts about measured forces."""
    vehicle = scene.cut_vehicle()
    doubts = judged(scene, vehicle) if scene.forces.file is not None else ()
    return (*plausible(vehicle.whole, scene.vehicle.accept), *doubts)


def describe(scene: HubScene) -> str:
    """The scene's plan as text."""
    vehicle, forces = scene.cut_vehicle(), scene.forces
    own = rigid(vehicle)
    source = f"file {forces.file}" if forces.file else f"virtual measurement at {forces.sampling_rate:g} Hz"
    lines = [
        scene.title,
        _line("scene", f"{scene.file}, study {scene.study}"),
        _line(
            "vehicle",
            f"{vehicle.tree.name}: {vehicle.size} freedoms, {own.mass:.6g} kg, cut at {', '.join(vehicle.hubs)}",
        ),
        _line("inside", f"{len(vehicle.elements)} springs, mounts and bars, in the chassis' axes"),
        _line("forces", f"{source}, six per hub in the frame {forces.frame!r}, {forces.interpolation}"),
        _line("noise", _noise(scene)),
    ]
    if scene.road is not None:
        lines.append(
            _line(
                "road",
                f"ISO 8608 class {scene.road.iso8608}, two independent tracks, seeds "
                f"{scene.road.seed} and {scene.road.seed + 1}, {scene.road.speed:g} m/s",
            )
        )
    lines.append(_line("run", f"{scene.run.duration:g} s, Runge-Kutta 4, {scene.run.step:g} s"))
    if scene.study == COMPARING:
        lines.append(_line("compared", "free, with kalman_filter, with prescribed_angles: a scene each"))
    lines += [_line("doubt", text) for text in doubts(scene)]
    never = "drag, tyres that roll, curves and friction of springs"
    return "\n".join([*lines, *effect_lines(scene), _line("never", never)])


def doubts(scene: HubScene) -> tuple[str, ...]:
    """What the Kalman filter says against files that it would follow; a virtual measurement is not made for it."""
    if scene.forces.file is None or (scene.stabilise.method != "kalman" and scene.study != COMPARING):
        return ()
    from models.systems.hub_forces.stabilised import Stabilised

    vehicle = scene.cut_vehicle()
    return Stabilised(scene, vehicle, *scene.measured(vehicle)).tilt.doubts


def _noise(scene: HubScene) -> str:
    """What every sample has, as is stated of files, or was added to a virtual measurement."""
    forces, angles = scene.forces, scene.angles
    of_forces = f"{forces.force_deviation:g} N and {forces.moment_deviation:g} N m on every sample of forces"
    of_angles = f"{angles.angle_deviation:g} rad and {angles.rate_deviation:g} rad/s on every one of angles"
    said = [text for own, text in ((forces, of_forces), (angles, of_angles)) if own.noise == "white"]
    return ", ".join(said) or "none"


def _line(head: str, text: str) -> str:
    return f"  {head:<10} {text}"
