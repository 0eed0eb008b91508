"""Wheel forces prescribed from a file (eq. 37), in place of tyres on a road."""

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from models.core.assumptions import Assumption, Watched
from models.core.errors import InputError
from models.core.result import Result
from models.core.signals import Interpolation, signal_from_samples
from models.core.strict import Strict
from models.core.tables import NEWTONS
from models.engines.assembly import Assembly
from models.systems.pitch_plane.sampling import check_end

if TYPE_CHECKING:
    from models.core.finding import Finding
    from models.measured.axle_forces import AxleForces
    from models.measured.signal import MeasuredSignal

EXCLUDES = ("road",)
COST = "one force per wheel, read from a table; no tyre"
EXAMPLE = {"file": "forces.csv", "interpolation": "held"}
COUNTS = {"exudyn": {"callbacks": 3}}
"""Counts that the effect adds. In Exudyn held forces take a callback per wheel and one before each step; in MuJoCo they
take none."""


class Parameters(Strict):
    """[effects.wheel_forces]: file of the wheel forces, their interpolation and their axis."""

    file: str = Field(description="CSV with the columns time [s], front [N], rear [N]; forces up on the wheels")
    interpolation: Interpolation = Field(description="held, linear or smooth between the samples")
    frame: Literal["inertial", "body"] = Field("inertial", description="axis of the forces: vertical, or the chassis'")
    accept: list[
        Literal["weight", "balance", "sign", "unit", "swapped", "start", "times", "copied", "spikes", "clipped"]
    ] = Field([], description="findings of the checks against the vehicle's weight that are meant as they are")


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the vehicle without tyres, with two wheel forces from a file as its input."""
    from models.core.time_series import read_time_series

    scene = vehicle_assembly.scene
    columns = {"front": NEWTONS, "rear": NEWTONS}
    values, period = read_time_series(scene.path(parameters.file, "effects.wheel_forces.file"), columns)
    signal = signal_from_samples(values, period, parameters.interpolation)
    check_end(scene, "effects.wheel_forces.file", parameters.file, signal.end)
    turns = parameters.frame == "body" and vehicle_assembly.vehicle.geometry == "exact"
    driven = vehicle_assembly.without_tyres().with_input("force-body" if turns else "force", signal)
    doubts, assumed = _doubts_about_forces(driven, parameters, values, period)
    return replace(driven, doubts=(*driven.doubts, *doubts), assumptions=(*driven.assumptions, *assumed))


def _doubts_about_forces(
    vehicle_assembly: Assembly, force_parameters: Parameters, force_samples: np.ndarray, sample_period: float
) -> tuple[tuple[str, ...], tuple[Assumption, ...]]:
    """Returns doubts about wheel forces (n, 2) in N that do not suit the vehicle, and assumptions that they carry its
    weight. Raises InputError for impossible forces.
    """
    from models.measured.axle_forces import FILE_REMEDIES, AxleForces, check_axle_forces
    from models.measured.signal import MeasuredSignal

    front, rear = (
        MeasuredSignal(axle, force_parameters.file, f"{axle} [N]", "force", axle, "z", "inertial", 1, "N", 1.0)
        for axle in ("front", "rear")
    )
    scene = vehicle_assembly.scene
    axles = AxleForces(
        force_samples,
        sample_period,
        vehicle_assembly.parameters,
        ((front,), (rear,)),
        scene.run.duration,
        FILE_REMEDIES,
        starts_at_rest=not scene.start,
        turns_with_chassis=vehicle_assembly.mode == "force-body",
    )
    looked = (*check_axle_forces(axles), *_sample_findings((front, rear), force_samples, sample_period))
    findings = tuple(
        finding for finding in looked if finding.weight != "note" and finding.check not in force_parameters.accept
    )
    errors = [finding for finding in findings if finding.weight == "error"]
    if errors:
        names = ", ".join(f'"{name}"' for name in dict.fromkeys(finding.check for finding in errors))
        raise InputError(
            scene.file,
            "effects.wheel_forces.file",
            force_parameters.file,
            f"{' '.join(finding.text for finding in errors)} If it is meant so: accept = [{names}].",
        )
    return tuple(finding.text for finding in findings), _balance_assumptions(axles, force_parameters)


def _balance_assumptions(axle_forces: "AxleForces", force_parameters: Parameters) -> tuple[Assumption, ...]:
    """Assumptions that the mean wheel forces carry the vehicle's weight and balance in pitch, within the uncertainty of
    the record's length.
    """
    from models.measured.axle_balance import equilibrium_residual

    means = equilibrium_residual(axle_forces)
    balance_rows = (
        ("weight", "the wheel forces carry the vehicle's weight on average", "m/s^2", "m1, m2, m3"),
        ("balance", "front and rear wheel forces balance each other on average", "rad/s^2", "a, b"),
    )
    return tuple(
        Assumption(
            name,
            says,
            f"correct the forces' calibration or zero, or {symbols} of the vehicle; "
            f'if it is meant so: effects.wheel_forces.accept = ["{name}"]',
            partial(_steady_accelerations, float(means.accelerations[i])),
            unit,
            -float(means.uncertainties[i]),
            float(means.uncertainties[i]),
        )
        for i, (name, says, unit, symbols) in enumerate(balance_rows)
        if name not in force_parameters.accept and axle_forces.parameters.g > 0
    )


def _steady_accelerations(steady_acceleration: float, run_result: Result) -> Watched:
    """The steady acceleration of the chassis by the mean wheel forces, as the value that an assumption judges."""
    return {"chassis": np.array([steady_acceleration])}


def _sample_findings(
    force_signals: "tuple[MeasuredSignal, ...]", force_samples: np.ndarray, sample_period: float
) -> "list[Finding]":
    """Findings on impossible samples of wheel forces: spikes, and values clipped at the sensor's range. Zeros of a
    lifted wheel do not count.
    """
    from models.measured.checks import clipped, spikes
    from models.measured.checks.evidence import CheckedRecording
    from models.measured.columns import SamplesInMemory
    from models.measured.recording import Recording

    felt = SamplesInMemory(tuple(s.name for s in force_signals), np.where(force_samples == 0.0, np.nan, force_samples))
    evidence = CheckedRecording(Recording(force_signals, felt, sample_period), None)
    return [*spikes.check(evidence), *(finding for finding in clipped.check(evidence) if finding.unit == "%")]
