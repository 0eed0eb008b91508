"""The plan of a scene of hub forces: printed by ``twinrig show``, checked before any run."""

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import assumption_lines
from models.core.errors import InputError
from models.core.finding import Finding, merged_findings
from models.core.scene_effects import effect_lines as effect_lines
from models.engines.cut_vehicle import check_step, native_share
from models.engines.error_control import plan_lines
from models.engines.free_vehicle import ENGINES as FREE_ENGINES
from models.measured.signal import UNIT_OF_QUANTITY, MeasuredSignal, Quantity
from models.systems.hub_forces.assumptions import RUN_ON_TYRES, assumptions
from models.systems.hub_forces.scene import ForceFrame, HubScene
from models.vehicles.cut_vehicle import CutVehicle, rigid_vehicle
from models.vehicles.plausible import implausible_values

if TYPE_CHECKING:
    from models.measured.recording import Recording

COMPARING_STUDY = "hub_forces"
"""Name of the study that runs a scene with every stabiliser and without."""

Signals = tuple[tuple[Quantity, str], ...]
ANGLE_SIGNALS: Signals = tuple((what, axis) for what in ("angle", "angular rate") for axis in ("roll", "pitch"))
WRENCH_SIGNALS: Signals = tuple((what, axis) for what in ("force", "moment") for axis in "xyz")
COLUMN_REMEDY = "Correct the columns of the file, or map them in a scene of the system measured"
"""Advice in place of a channel map, which files of hub forces do not have."""


def check(scene: HubScene, engines: tuple[str, ...]) -> None:
    """Raise InputError, before any file is written, for a wrong vehicle, a time step that is too long, a bandwidth that
    is too low, and impossible measured values.
    """
    vehicle = scene.cut_vehicle()
    if fixed := [engine for engine in engines if engine not in scene.engines]:
        check_step(fixed[-1], vehicle, scene.run.step, scene.run.duration)
    if scene.forces.frame == "inertial":
        growth = float(rigid_vehicle(vehicle).toppling_rates().max()) / (2 * np.pi)
        if scene.stabilise.bandwidth <= growth:
            raise InputError(
                scene.file,
                "stabilise.bandwidth",
                scene.stabilise.bandwidth,
                f"must be above {growth:.3g} Hz: forces that keep their directions topple the vehicle so fast",
            )
    if scene.forces.file is not None:
        doubts_about_files(scene, vehicle)


def findings(scene: HubScene) -> tuple[Finding, ...]:
    """Returns doubts about implausible parameters of the vehicle, and about measured files."""
    vehicle = scene.cut_vehicle()
    doubts = doubts_about_files(scene, vehicle) if scene.forces.file is not None else ()
    return (*implausible_values(vehicle.uncut, scene.vehicle.accept), *doubts)


def describe(scene: HubScene) -> str:
    """Returns the plan of a hub forces scene as text: vehicle, forces, noise, run, doubts, effects, assumptions."""
    vehicle, forces = scene.cut_vehicle(), scene.forces
    body = rigid_vehicle(vehicle)
    source = f"file {forces.file}" if forces.file else f"virtual measurement at {forces.sampling_rate:g} Hz"
    lines = [
        scene.title,
        _plan_line("scene", f"{scene.file}, study {scene.study}"),
        _plan_line(
            "vehicle",
            f"{vehicle.tree.name}: {vehicle.size} freedoms, {body.mass:.6g} kg, cut at {', '.join(vehicle.hubs)}",
        ),
        *(_plan_line("read", note) for note in vehicle.uncut.notes),
        _plan_line("inside", f"{len(vehicle.elements)} springs, mounts and bars, {_frames_text(vehicle)}"),
        _plan_line("forces", f"{source}, six per hub in the frame {forces.frame!r}, {forces.interpolation}"),
        _plan_line("noise", _noise_text(scene)),
    ]
    if scene.road is not None:
        lines.append(
            _plan_line(
                "road",
                f"ISO 8608 class {scene.road.iso8608}, two independent tracks, seeds "
                f"{scene.road.seed} and {scene.road.seed + 1}, {scene.road.speed:g} m/s",
            )
        )
    lines.append(_plan_line("run", f"{scene.run.duration:g} s, Runge-Kutta 4, {scene.run.step:g} s"))
    lines += [_plan_line(*line) for line in plan_lines(scene.engines, scene.run.step)]
    if scene.study == COMPARING_STUDY:
        lines.append(_plan_line("compared", "free, with kalman_filter, with prescribed_angles: a scene each"))
    lines += [_plan_line("doubt", text) for text in filter_objections(scene)]
    lines += _engine_share_lines(scene, vehicle)
    never = "drag, tyres that roll"
    runs = [*([RUN_ON_TYRES] if scene.road is not None else []), scene.stabilise.method]
    assumed = {assumption.says: assumption for run in runs for assumption in assumptions(scene, vehicle, run)}
    return "\n".join([*lines, *effect_lines(scene), *assumption_lines(assumed.values()), _plan_line("never", never)])


def filter_objections(scene: HubScene) -> tuple[str, ...]:
    """Returns the Kalman filter's objections to the measured files; empty for a virtual measurement, which is not made
    here.
    """
    if scene.forces.file is None or (scene.stabilise.method != "kalman" and scene.study != COMPARING_STUDY):
        return ()
    from models.systems.hub_forces.run import HubMeasurement

    vehicle = scene.cut_vehicle()
    return HubMeasurement(scene, vehicle, None, *scene.measured(vehicle)).tilt.objections


def _frames_text(vehicle: CutVehicle) -> str:
    """Text on the bodies in whose axes springs, mounts and bars act."""
    elements_in_other_axes = [
        f"{element.name} in those of {element.frame}"
        for element in vehicle.elements
        if element.frame != vehicle.chassis
    ]
    return "; ".join(["in the chassis' axes", *elements_in_other_axes])


def _engine_share_lines(scene: HubScene, vehicle: CutVehicle) -> list[str]:
    """Lines of text on the forces that each engine computes by native elements, and on the forces that all engines
    share, counted in built models."""
    shared = "hub forces" if scene.road is None else "hub forces, tyres on the road"
    if scene.spring_force_route(scene.stabilise.method) == "compiled":
        return [_plan_line("native", "bodies and joints"), _plan_line("shared", f"springs, mounts and bars, {shared}")]
    lines = []
    for engine in FREE_ENGINES:
        share = native_share(engine, vehicle)
        count = f"{len(share.elements)} of {len(vehicle.elements)} springs, mounts and bars, {share.joints} joints"
        lines.append(_plan_line("native", f"{engine}: {count}"))
        lines += [_plan_line("shared", f"{engine}: {name}, {why}") for name, why in share.reasons.items()]
    return [*lines, _plan_line("shared", f"{shared}: no engine has sampled ones")]


def _noise_text(scene: HubScene) -> str:
    """Text on the noise of forces and angles: stated for files, or added to a virtual measurement."""
    forces, angles = scene.forces, scene.angles
    of_forces = f"{forces.force_deviation:g} N and {forces.moment_deviation:g} N m on every sample of forces"
    of_angles = f"{angles.angle_deviation:g} rad and {angles.rate_deviation:g} rad/s on every one of angles"
    noise_texts = [text for table, text in ((forces, of_forces), (angles, of_angles)) if table.noise == "white"]
    return ", ".join(noise_texts) or "none"


def _plan_line(label: str, text: str) -> str:
    return f"  {label:<10} {text}"


def doubts_about_files(scene: HubScene, vehicle: CutVehicle) -> tuple[Finding, ...]:
    """Returns doubts about the measured files of a scene. Raises InputError for impossible values that the scene does
    not accept.
    """
    from models.measured.checks import check

    findings = [
        replace(finding, text=_finding_text(finding.text))
        for finding in check(_measured_recording(scene, vehicle), vehicle)
        if finding.check not in scene.forces.accept
    ]
    if errors := [finding for finding in findings if finding.weight == "error"]:
        names = json.dumps(list(dict.fromkeys(finding.check for finding in errors)))
        raise InputError(
            scene.file,
            "forces.file",
            scene.forces.file,
            f"{' '.join(finding.text for finding in merged_findings(errors))} {COLUMN_REMEDY}; if it is "
            f"meant so: accept = {names} under "
            "[forces].",
        )
    return tuple(finding for finding in findings if finding.weight == "doubt")


def _finding_text(finding_text: str) -> str:
    """Text of a finding without its advice on a channel map, which plain files do not have."""
    text_before, colon, _ = finding_text.partition("; give sign")
    return text_before + "." if colon else finding_text.replace(" in the channel map", "")


def _measured_recording(scene: HubScene, vehicle: CutVehicle) -> "Recording":
    """Returns the measured files of forces and angles as a ``Recording``, which the checks of recordings take."""
    from models.measured.columns import SamplesInMemory
    from models.measured.recording import Recording

    def signal(
        location: str, quantity: Quantity, axis: str, file_name: str | None, frame: ForceFrame
    ) -> MeasuredSignal:
        name = f"{location} {quantity} {axis}"
        return MeasuredSignal(
            name, str(file_name), name, quantity, location, axis, frame, 1, UNIT_OF_QUANTITY[quantity], 1.0
        )

    (forces, angles), files = scene.measured(vehicle), (scene.forces.file, scene.angles.file)
    signals = (
        *(
            signal(hub, *signal_fields, files[0], scene.forces.frame)
            for hub in vehicle.hubs
            for signal_fields in WRENCH_SIGNALS
        ),
        *(signal(vehicle.chassis, *signal_fields, files[1], "body") for signal_fields in ANGLE_SIGNALS),
    )
    count = min(len(forces.samples), len(angles.samples))
    samples = np.hstack([forces.samples[:count], angles.samples[:count]])
    return Recording(signals, SamplesInMemory(tuple(s.name for s in signals), samples), forces.period)
