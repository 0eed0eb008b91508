"""Time up to which the pitch of a force-excited run can be trusted, predicted before the run.

Each source of error has a time at which the pitch is wrong by ``angle``: noise by a closed law along the wheel forces
(median of all noise paths); interpolation between samples and a wrong model by error propagation along the run's path;
and rounding, which no integrator avoids. The earliest time counts. Motion faster than half the sampling rate is not in
the samples and cannot be judged here.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.core.signals import SampledSignal, Smooth
from models.drift.growth import (
    MEDIAN_OF_NORMAL,
    growth_rate,
    pitch_rate_of_forces,
    pitch_variance,
    rigid_pitch,
    sinh_law_rate,
)
from models.engines.assembly import Assembly
from models.systems.pitch_plane.tangent import LONGEST_TIME_STEP, TangentPath, tangent_path_of
from models.vehicles.pitch_plane import PitchPlaneParameters

if TYPE_CHECKING:
    from models.measured.axle_forces import AxleForces

UNTRUSTED_PITCH = 0.05
"""Pitch error (rad) beyond which a run is not trusted: 0.05 rad turn 5 % of a vertical force into the x axis."""
FEWEST_SAMPLES = 8
"""Fewest samples for which the interpolation error is estimated: a quintic spline needs six."""


SMALL_PITCH = 0.2
"""Largest pitch error (rad) for the laws of growth, which are right to 5 % up to here (Monte Carlo)."""


def small_errors(largest_pitch_error: float) -> Assumption:
    """Assumption that the pitch error ``largest_pitch_error`` (rad) up to which a run is trusted is small enough for
    the laws of growth.
    """
    says, remedy = "the laws of growth are of small errors", "take a smaller options.angle"
    return Assumption(
        "small errors",
        says,
        remedy,
        partial(_watched_allowed_error, largest_pitch_error),
        "rad",
        upper_limit=SMALL_PITCH,
    )


def _watched_allowed_error(largest_pitch_error: float, run_result: Result) -> Watched:
    """The pitch error (rad) up to which a run is trusted, as the value that an assumption judges."""
    return {"allowed error": np.array([largest_pitch_error])}


@dataclass(frozen=True)
class PitchErrorGrowth:
    """Growth of a pitch error along the wheel forces of a run, computed before the run.

    times (n,) : of the samples (s); rate : mean growth rate (1/s); sinh_rate (n,) : the rate in the sinh law at each
    time (1/s). All rates are 0 where the forces turn with the chassis or the geometry is linear.
    """

    times: np.ndarray
    rate: float
    sinh_rate: np.ndarray


@dataclass(frozen=True)
class GrowthCurve:
    """Magnitude (n,) of the pitch error (rad) from a source of error over ``times`` (n,) in s, valid while small."""

    times: np.ndarray
    size: np.ndarray

    def passing_time(self, largest_pitch_error: float = UNTRUSTED_PITCH) -> float | None:
        """First time (s) at which the pitch error exceeds ``largest_pitch_error`` (rad); None if it never does."""
        beyond = ~(self.size <= largest_pitch_error)  # what is not a number any more has
        return float(self.times[beyond.argmax()]) if beyond.any() else None


def pitch_error_growth(vehicle_assembly: Assembly) -> PitchErrorGrowth:
    """Computes the growth of a pitch error along a free force-excited run; raises ValueError for a
    run of another kind.
    """
    path = tangent_path_of(vehicle_assembly)
    sample_times = path.forces.period * np.arange(path.samples + 1)
    if vehicle_assembly.mode == "force-body" or vehicle_assembly.vehicle.geometry == "linear":
        return PitchErrorGrowth(sample_times, 0.0, np.zeros(len(sample_times)))
    values, p = _covering_samples(path), vehicle_assembly.parameters
    rate = pitch_rate_of_forces(values, path.forces.period, p)
    arguments = (rate, path.forces.period, p)
    return PitchErrorGrowth(sample_times, growth_rate(*arguments), sinh_law_rate(*arguments))


def _covering_samples(tangent_path: TangentPath) -> np.ndarray:
    """Wheel force samples (n + 1, 2) in N that cover the run; if held samples end with the run, the
    last is repeated.
    """
    values = tangent_path.forces.values[: tangent_path.samples + 1]
    return values if len(values) > tangent_path.samples else np.vstack([values, values[-1:]])


def noise_error_curve(vehicle_assembly: Assembly, force_deviation: float) -> GrowthCurve:
    """Pitch error over time from white noise of ``force_deviation`` (N) on each force sample: median magnitude over
    noise paths.
    """
    growing, period = pitch_error_growth(vehicle_assembly), tangent_path_of(vehicle_assembly).forces.period
    intensity = rigid_pitch(vehicle_assembly.parameters).noise_intensity(force_deviation, period)
    return GrowthCurve(
        growing.times, MEDIAN_OF_NORMAL * np.sqrt(pitch_variance(growing.times, growing.sinh_rate, intensity))
    )


def interpolation_error(tangent_path: TangentPath) -> np.ndarray:
    """Error (3 steps, 2) in N of the scene's interpolation of force samples, compared with a quintic spline, at the
    start, the middle and the end of each step.

    Linear samples err by f'' t (T - t) / 2, on average by f'' T^2 / 12. Held samples delay the run by T / 2, which is
    no drift: they are compared with the spline at that delay, and err by -f'' T^2 / 24 on average.
    """
    spline = Smooth(_covering_samples(tangent_path), tangent_path.forces.period, degree=5)
    count, stage_forces = tangent_path.steps, tangent_path.forces_at_stages
    late = tangent_path.forces.period / 2 if tangent_path.forces.held else 0.0
    true = spline.sample(-late, tangent_path.step / 2, 2 * count + 1)
    read = (
        [stage_forces] * 3
        if tangent_path.forces.held
        else [stage_forces[0:-1:2], stage_forces[1::2], stage_forces[2::2]]
    )
    return np.stack([read[0] - true[0:-1:2], read[1] - true[1::2], read[2] - true[2::2]], axis=1).reshape(3 * count, 2)


def interpolation_error_curve(vehicle_assembly: Assembly, longest_step: float = LONGEST_TIME_STEP) -> GrowthCurve:
    """Pitch error over time from the interpolation between force samples alone; 0 for a run with too few samples."""
    path = tangent_path_of(vehicle_assembly, longest_step)
    return _growth_by_parameters(path, interpolation_error(path) if path.samples >= FEWEST_SAMPLES else None)


def model_error_curve(
    vehicle_assembly: Assembly, wrong_parameters: PitchPlaneParameters, longest_step: float = LONGEST_TIME_STEP
) -> GrowthCurve:
    """Pitch error over time of a run with ``wrong_parameters`` instead of the assembly's parameters.

    The error that drifts is the moment of the inertia's error, dI beta''; stiffness and damping act through the cosine
    alone. The difference is propagated along a run with the mean of both models, which leaves no error of second
    order.
    """
    parameters = vehicle_assembly.parameters.model_dump()
    change = {name: getattr(wrong_parameters, name) - value for name, value in parameters.items()}
    mean = PitchPlaneParameters(**{name: value + 0.5 * change[name] for name, value in parameters.items()})
    shifted = PitchPlaneParameters(**{name: value + change[name] for name, value in mean.model_dump().items()})
    return _growth_by_parameters(
        tangent_path_of(replace(vehicle_assembly, parameters=mean), longest_step), wrong_parameters=shifted
    )


def _growth_by_parameters(
    tangent_path: TangentPath,
    force_errors: np.ndarray | None = None,
    wrong_parameters: PitchPlaneParameters | None = None,
) -> GrowthCurve:
    """Pitch error over time that force errors (N) or wrong parameters cause along a path."""
    pushes = None if force_errors is None else force_errors[:, None, :]
    _, columns = tangent_path.propagate_errors(np.zeros((1, 8)), pushes, wrong_parameters)
    return GrowthCurve(tangent_path.times, np.abs(columns[:, 0, 3]))


def rounding_error_curve(vehicle_assembly: Assembly) -> GrowthCurve:
    """Pitch error over time from rounding alone, median magnitude: each step rounds the pitch rate. No solver can do
    better.
    """
    growing, path = pitch_error_growth(vehicle_assembly), tangent_path_of(vehicle_assembly)
    rate = pitch_rate_of_forces(_covering_samples(path), path.forces.period, vehicle_assembly.parameters)
    rounding_deviation = np.finfo(float).eps * float(np.sqrt(np.mean(rate**2))) / math.sqrt(12)
    return GrowthCurve(
        growing.times,
        MEDIAN_OF_NORMAL * np.sqrt(pitch_variance(growing.times, growing.sinh_rate, rounding_deviation**2 / path.step)),
    )


@dataclass(frozen=True)
class TrustPrediction:
    """Prediction of how long a run can be trusted. times : time (s) at which each source of error exceeds ``angle``
    (rad), None where it never does; rate : mean growth rate of a pitch error (1/s).

    unchecked_text : text on properties of the inputs that were not checked.
    """

    times: dict[str, float | None]
    rate: float
    angle: float
    unchecked_text: str = ""

    @property
    def until(self) -> tuple[str, float] | None:
        """Source of error whose time comes first, and this time (s); None if nothing limits the run."""
        limits = [(time, name) for name, time in self.times.items() if time is not None]
        return min(limits)[::-1] if limits else None

    def __str__(self) -> str:
        """Returns the line of text on this prediction in a plan."""
        grown, remarks = (
            f"{self.angle:g} rad, growth rate {self.rate:.3g} 1/s",
            self.unchecked_text and f"; {self.unchecked_text}",
        )
        if self.until is None:
            return f"nothing known limits this run ({grown}; looked at: {', '.join(self.times)}){remarks}"
        name, time = self.until
        return f"trusted until about {time:.3g} s ({grown}, {name}){remarks}"


def predict_trust(vehicle_assembly: Assembly, largest_pitch_error: float = UNTRUSTED_PITCH) -> TrustPrediction | None:
    """Predict how long a scene's run can be trusted, up to a pitch error ``largest_pitch_error`` (rad). None for a run
    with prescribed pitch, with a pitch spring or on a road, whose errors do not grow.
    """
    forces = vehicle_assembly.input
    try:
        tangent_path_of(vehicle_assembly)
    except ValueError:
        return None
    assert isinstance(forces, SampledSignal | Smooth)
    times_of_causes = {
        "interpolation between the samples": interpolation_error_curve(vehicle_assembly).passing_time(
            largest_pitch_error
        )
    }
    added = vehicle_assembly.scene.effects.get("force_noise")
    if added is not None and added.deviation > 0:
        named = f"noise of {added.deviation:g} N at {1 / forces.period:g} Hz"
        times_of_causes[named] = noise_error_curve(vehicle_assembly, added.deviation).passing_time(largest_pitch_error)
    times_of_causes |= _steady_drift_time(vehicle_assembly, largest_pitch_error)
    times_of_causes["rounding"] = rounding_error_curve(vehicle_assembly).passing_time(largest_pitch_error)
    return TrustPrediction(
        times_of_causes,
        pitch_error_growth(vehicle_assembly).rate,
        largest_pitch_error,
        _unchecked_sentence(vehicle_assembly),
    )


def _steady_drift_time(vehicle_assembly: Assembly, largest_pitch_error: float) -> dict[str, float]:
    """Times (s) after which mean accelerations of doubtful wheel forces have turned the vehicle by
    ``largest_pitch_error`` (rad), or moved it vertically by ``largest_pitch_error`` times the wheelbase.
    """
    if not vehicle_assembly.doubts:
        return {}
    from models.measured.axle_forces import equilibrium_residual

    p, motion = vehicle_assembly.parameters, equilibrium_residual(_axles(vehicle_assembly))
    limits_of_motion = {
        "mean of the wheel forces": largest_pitch_error * (p.a + p.b),
        "balance of the axles": largest_pitch_error,
    }
    return {
        name: math.sqrt(2 * limit_of_motion / abs(acceleration))
        for (name, limit_of_motion), acceleration, is_significant in zip(
            limits_of_motion.items(), motion.accelerations.tolist(), motion.is_beyond_uncertainty, strict=True
        )
        if is_significant
    }


def _axles(vehicle_assembly: Assembly) -> "AxleForces":
    """Returns the wheel forces of a run in the form that the checks of recordings take."""
    from models.measured.axle_forces import AxleForces

    path, turn = tangent_path_of(vehicle_assembly), vehicle_assembly.mode == "force-body"
    forces, lasts = _covering_samples(path), vehicle_assembly.scene.run.duration
    return AxleForces(forces, path.forces.period, vehicle_assembly.parameters, ((), ()), lasts, turns_with_chassis=turn)


def _unchecked_sentence(vehicle_assembly: Assembly) -> str:
    """Sentence on properties of wheel forces from a file that were not checked; empty without such a file."""
    from models.measured.axle_forces import unchecked_delay_sentence

    return (
        unchecked_delay_sentence(_axles(vehicle_assembly)) if "wheel_forces" in vehicle_assembly.scene.effects else ""
    )
