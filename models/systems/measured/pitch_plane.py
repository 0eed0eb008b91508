"""Run of a recording on the pitch-plane vehicle, driven by its vertical wheel forces summed by axle; the measured pitch
may stabilise it.

The vehicle, its effects, engines, trust and verdict are those of its scenes (``models.systems.pitch_plane``); the
recording is handed to them as the files that such scenes read. A recording's pitch is positive nose down (ISO 8855),
this vehicle's nose up. Forces in the axes of hubs or chassis turn with the vehicle: its wheels do not pitch against
the chassis.
"""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.core.result import Result
from models.core.time_series import write_time_series
from models.drift import score
from models.drift.score import AcceptanceLimits, StabilisedRunVerdict, section_forces
from models.measured import axle_forces
from models.measured.axle_balance import LOCATIONS_OF_AXLE_FORCES, axle_forces_of, axle_signals
from models.measured.columns import SampleFile
from models.measured.gaps import bridged_signals
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, Quantity
from models.systems.measured.section_run import AttitudeHold, SectionOutcome
from models.systems.measured.sections import SectionChannel
from models.systems.pitch_plane import trust as drift_trust
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, build
from models.systems.pitch_plane.trust import TrustPrediction

CHASSIS_NAME = "chassis"
LONGEST_STEP = 1e-3
"""Longest time step (s): the fastest pole of the published vehicle needs steps below 2.8 ms."""
UNCHECKED_TEXT = (
    "free, with forces that turn with the vehicle and no measured pitch: an offset, or forces of another frame, "
    "would drive it off unseen"
)
EFFECT_OF_STABILISER = {"kalman": "kalman_filter", "prescribed": "prescribed_pitch"}
"""Effects of the pitch-plane system by stabiliser method."""
SPRING_NAMES = {"f3": "front spring", "f4": "rear spring"}
"""Names of the suspension forces as sections."""


@dataclass(frozen=True)
class PlaneRunSettings:
    """Settings of a recording's run in the pitch plane. parameters : name of a parameter set, or of a TOML file; hold :
    stabiliser of the pitch; step : time step (s).
    """

    recording: Recording
    parameters: str
    engine: str = "mujoco"
    hold: AttitudeHold = field(default_factory=AttitudeHold)
    step: float | None = None
    file: str = ""

    @property
    def effect(self) -> str | None:
        """Name of the effect that stabilises the pitch; None for a free run."""
        return EFFECT_OF_STABILISER.get(self.hold.method)


@dataclass(frozen=True)
class PlaneRun:
    """A run in the pitch plane: its result, the predicted time of trust, the verdict, and the section forces."""

    result: Result
    trust: TrustPrediction | None
    verdict: StabilisedRunVerdict
    outcome: SectionOutcome


def run(
    run_settings: PlaneRunSettings,
    scene_folder: Path,
    verdict_limits: AcceptanceLimits | None = None,
    estimate_error: bool = False,
) -> PlaneRun:
    """Run a recording on the pitch-plane vehicle; files of its scene are written into a new folder. Raises InputError,
    Refused or RunFailed.

    estimate_error : whether the error of the time steps is estimated, by further runs.
    """
    scene_folder.mkdir(parents=True)
    scene, said = scene_of(run_settings, scene_folder)
    result = simulate(scene, run_settings.engine, error=estimate_error)
    limited = trusted_time(scene, run_settings.hold.force)
    if limited and run_settings.recording.find_signals("angle", CHASSIS_NAME, "pitch"):
        limited = replace(limited, unchecked_text="")  # the run is compared with it
    figures = score.figures_of_run(result, scene.vehicle_parameters())
    until = limited.until[1] if limited and limited.until else result.times[-1]
    effects = [run_settings.effect] if run_settings.effect else []
    # whether the filter's innovations are as large as stated is not asked: deviations of a recording are estimates
    verdict = score.verdict_without_true_run(
        figures,
        effects,
        result.times[-1],
        verdict_limits or AcceptanceLimits(),
        until,
        pitch_uncertainty=score.stated_pitch_uncertainty(result),
    )
    if run_settings.effect is None and verdict.word == "accepted":
        verdict = _verdict_with_measured_pitch(run_settings, result, verdict_limits or AcceptanceLimits(), verdict)
    return PlaneRun(result, limited, verdict, _section_outcome(result, said, scene_folder))


def _verdict_with_measured_pitch(
    run_settings: PlaneRunSettings,
    pitch_plane_result: Result,
    verdict_limits: AcceptanceLimits,
    verdict: StabilisedRunVerdict,
) -> StabilisedRunVerdict:
    """Returns the verdict on an accepted free run after its pitch is compared with the measured pitch.

    Where forces turn with the vehicle no error grows, but offsets and forces in another frame still make it drift, and
    its longitudinal forces are as wrong as its pitch. In this case a measured pitch must confirm the run.
    """
    angles = run_settings.recording.find_signals("angle", CHASSIS_NAME, "pitch")
    if not angles:
        return (
            StabilisedRunVerdict("stabilise", UNCHECKED_TEXT)
            if _force_frames(run_settings) != {"inertial"}
            else verdict
        )
    measured = run_settings.recording.samples(angles[0])
    known = np.flatnonzero(np.isfinite(measured))
    beside = np.interp(pitch_plane_result.times, run_settings.recording.period * known, measured[known])
    off = float(np.abs(score.low_pass(pitch_plane_result["pitch"] + beside, float(pitch_plane_result.times[1]))).max())
    if off <= verdict_limits.pitch_error:
        return verdict
    limit = f"(at most {verdict_limits.pitch_error:g}): check the frame of the forces and their offsets"
    return StabilisedRunVerdict("stabilise", f"free, and its pitch is up to {off:.2g} rad off the measured one {limit}")


def _force_frames(run_settings: PlaneRunSettings) -> set[str]:
    """Frames ("inertial", "body" or "hub") of the vertical forces at both axles."""
    return {signal.frame for axle in LOCATIONS_OF_AXLE_FORCES for signal in axle_signals(run_settings.recording, axle)}


def scene_of(run_settings: PlaneRunSettings, scene_folder: Path) -> tuple[Scene, tuple[Finding, ...]]:
    """Returns a pitch-plane scene of a recording, whose files are written into the folder, and findings on bridged
    gaps.
    """
    period, said, frames = run_settings.recording.period, list[Finding](), _force_frames(run_settings)
    forces = {axle: ("N", _axle_force(run_settings, axle, said)) for axle in LOCATIONS_OF_AXLE_FORCES}
    write_time_series(scene_folder / "wheel_forces.csv", forces, period)
    if "inertial" in frames and len(frames) > 1:
        text = "vertical forces must all keep their direction in space, or all turn with the vehicle"
        raise InputError(run_settings.file, "files.channels", None, text)
    fixed = (
        frames == {"inertial"} or run_settings.hold.method == "prescribed"
    )  # an enforced pitch does not feel the frame
    driving = {"file": "wheel_forces.csv", "interpolation": "smooth", "accept": list(axle_forces.FINDING_NAMES)}
    effects: dict[str, Any] = {"wheel_forces": driving | {"frame": "inertial" if fixed else "body"}}
    if run_settings.effect:
        effects[run_settings.effect] = _prescribed_pitch(run_settings, scene_folder, said)
    step = run_settings.step or period / math.ceil(period / LONGEST_STEP * (1 - 1e-9))
    table = {
        "title": "recording",
        "vehicle": {"parameters": run_settings.parameters},
        "effects": effects,
        "run": {"duration": run_settings.recording.duration, "step": step},
    }
    scene = build(table, run_settings.file, scene_folder)
    recorded = axle_forces_of(run_settings.recording, scene.vehicle_parameters())
    errors = (
        [each.text for each in axle_forces.check_axle_forces(recorded) if each.weight == "error"] if recorded else []
    )
    if errors:  # doubts are told by the checks of the recording
        raise InputError(run_settings.file, "vehicle.parameters", run_settings.parameters, " ".join(errors))
    return scene, tuple(said)


def trusted_time(scene: Scene, force_deviation: float) -> TrustPrediction | None:
    """Predict how long a pitch-plane scene's run can be trusted, under force noise of standard deviation
    ``force_deviation`` (N); None where the pitch is stabilised.
    """
    assembly = assembly_of_scene(scene)
    bounds = drift_trust.predict_trust(assembly)
    if bounds is None or force_deviation <= 0:
        return bounds
    noise = drift_trust.noise_error_curve(assembly, force_deviation).passing_time(bounds.angle)
    return replace(bounds, times={**bounds.times, f"noise of {force_deviation:g} N": noise})


def _axle_force(run_settings: PlaneRunSettings, axle_name: str, findings: list[Finding]) -> np.ndarray:
    """Vertical force (n,) of an axle in N with short gaps bridged. Raises InputError for a long gap
    or a missing wheel.
    """
    signals = axle_signals(run_settings.recording, axle_name)
    if len(signals) != (1 if signals and signals[0].at == axle_name else 2):
        axle_place, left, right = map(repr, LOCATIONS_OF_AXLE_FORCES[axle_name])
        text = f"the vertical force is needed at {axle_place}, or at both {left} and {right}"
        raise InputError(run_settings.file, "files.channels", None, text)
    return np.asarray(sum(_samples_without_gaps(run_settings, signal, findings) for signal in signals))


def _samples_without_gaps(
    run_settings: PlaneRunSettings, signal: MeasuredSignal, all_findings: list[Finding]
) -> np.ndarray:
    """Samples (n,) of a signal with bridged gaps; findings on the gaps are appended to ``all_findings``."""
    values, _, findings = bridged_signals(run_settings.recording, signal)
    all_findings += findings
    return values


def _prescribed_pitch(run_settings: PlaneRunSettings, scene_folder: Path, findings: list[Finding]) -> dict[str, Any]:
    """Returns the scene table of the effect that stabilises the pitch, and writes the measured pitch and rate, nose up,
    to a file.
    """
    hold, filtered = run_settings.hold, run_settings.hold.method == "kalman"
    columns, deviations = dict[str, tuple[str, np.ndarray]](), dict[str, float]()
    known = (
        ("angle", "pitch", "rad", "pitch_deviation", hold.angle),
        ("angular rate", "pitch_rate", "rad/s", "rate_deviation", hold.rate),
    )
    for quantity, name, unit, key, deviation in known if filtered else known[:1]:
        for signal in [s for s in run_settings.recording.find_signals(quantity, CHASSIS_NAME, "pitch") if not s.check][
            :1
        ]:
            values = (
                run_settings.recording.samples(signal)
                if filtered
                else _samples_without_gaps(run_settings, signal, findings)
            )
            columns[name], deviations[key] = (unit, -values), deviation
    if "pitch" not in columns:
        raise InputError(
            run_settings.file, "stabilise.method", hold.method, f"needs the angle 'pitch' of {CHASSIS_NAME!r}"
        )
    write_time_series(scene_folder / "pitch.csv", columns, run_settings.recording.period)
    if not filtered:
        return {"file": "pitch.csv", "bandwidth": hold.smoothing}
    noise = hold.force * math.sqrt(
        max(len(axle_signals(run_settings.recording, axle)) for axle in LOCATIONS_OF_AXLE_FORCES)
    )
    return {"file": "pitch.csv", "force_deviation": noise, "start_deviation": hold.angle, **deviations}


def _section_outcome(pitch_plane_result: Result, findings: tuple[Finding, ...], columns_folder: Path) -> SectionOutcome:
    """Returns section forces in body axes (x forward, z up) and pitch (positive nose down) of a pitch-plane result as a
    ``SectionOutcome``.
    """
    forces = section_forces(pitch_plane_result["f3"], pitch_plane_result["f4"], pitch_plane_result["pitch"])
    channels = dict[SectionChannel, np.ndarray]()
    for name, spring in SPRING_NAMES.items():
        for axis, direction in (("x", "forward"), ("z", "upward")):
            text = f"on the {CHASSIS_NAME} in its axes, {direction} positive"
            channels[SectionChannel(f"{spring} F{axis}", "N", text, spring, "force", spring, axis)] = forces[
                f"{name}{axis}"
            ]
    pitch: tuple[tuple[str, Quantity, str, str], ...] = (
        ("", "angle", "rad", "pitch"),
        (" rate", "angular rate", "rad/s", "pitch_rate"),
    )
    for suffix, quantity, unit, name in pitch:
        answer = SectionChannel(
            f"{CHASSIS_NAME} pitch{suffix}", unit, "nose down positive", "", quantity, CHASSIS_NAME, "pitch"
        )
        channels[answer] = -pitch_plane_result[name]
    columns = SampleFile(
        columns_folder / "run.f64", tuple(answer.name for answer in channels), len(pitch_plane_result.times)
    )
    columns.write(0, np.column_stack(list(channels.values())))
    surprise = (
        pitch_plane_result["kalman_surprise"][-1] / pitch_plane_result["kalman_used"][-1]
        if "kalman_used" in pitch_plane_result.data
        else math.nan
    )
    period, count = float(pitch_plane_result.times[1]), len(pitch_plane_result.times)
    return SectionOutcome(
        columns, tuple(channels), period, count, float(surprise), findings, counts=pitch_plane_result.counts()
    )
