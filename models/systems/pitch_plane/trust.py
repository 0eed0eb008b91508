"""How long a force-excited run can be trusted, said before it starts.

Each source of error has its own time at which the pitch is ``angle`` off: half of all noise paths by the closed law
along the wheel forces; the error between the samples, and that of a wrong model, carried along the run's own path;
and rounding, which no integrator escapes. The earliest one counts. What samples do not show, motion faster than half
their rate, nothing here can see.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.core.signals import Sampled, Smooth
from models.drift.growth import (
    MEDIAN_OF_NORMAL,
    growth_rate,
    pitch_rate_of_forces,
    pitch_variance,
    rigid_pitch,
    sinh_law_rate,
)
from models.engines.assembly import Assembly
from models.systems.pitch_plane.tangent import LONGEST_STEP, TangentPath, path_of
from models.vehicles.pitch_plane import Parameters

if TYPE_CHECKING:
    from models.measured.axle_forces import AxleForces

UNTRUSTED_PITCH = 0.05
"""A pitch error (rad) from which on a run is not trusted: 0.05 rad turn 5 % of a vertical force into the x axis."""
FEWEST_SAMPLES = 8
"""Samples that a quintic spline needs, with two to spare."""


SMALL_PITCH = 0.2
"""rad: the laws are of small errors, and right to 5 % up to here (Monte Carlo)."""


def small_errors(angle: float) -> Assumption:
    """Assumption that ``angle``, up to which a run is trusted, is small enough for the laws of growth."""
    says, remedy = "the laws of growth are of small errors", "take a smaller options.angle"
    return Assumption(
        "small errors", says, remedy, partial(_watched_allowed_error, angle), "rad", upper_limit=SMALL_PITCH
    )


def _watched_allowed_error(angle: float, run: Result) -> Watched:
    return {"allowed error": np.array([angle])}


@dataclass(frozen=True)
class Growth:
    """Growth that the wheel forces alone give a pitch error, computed before any run.

    times (n,) in s, those of the samples; rate : mean growth rate, 1/s; sinh_rate (n,) : the rate in the sinh law at
    each time, 1/s. All rates are 0 where the forces turn with the chassis or the geometry is linear.
    """

    times: np.ndarray
    rate: float
    sinh_rate: np.ndarray


@dataclass(frozen=True)
class GrowthCurve:
    """Size (rad) of the pitch error from one source at ``times`` (n,) in s, valid while it is small."""

    times: np.ndarray
    size: np.ndarray

    def passing_time(self, angle: float = UNTRUSTED_PITCH) -> float | None:
        """First time (s) at which the error exceeds ``angle`` (rad), None if it never does."""
        beyond = ~(self.size <= angle)  # what is not a number any more has
        return float(self.times[beyond.argmax()]) if beyond.any() else None


def pitch_error_growth(assembly: Assembly) -> Growth:
    """Growth of a pitch error along a free force-excited run; raises ValueError for a run of another kind."""
    path = path_of(assembly)
    sample_times = path.forces.period * np.arange(path.samples + 1)
    if assembly.mode == "force-body" or assembly.vehicle.geometry == "linear":
        return Growth(sample_times, 0.0, np.zeros(len(sample_times)))
    values, p = _covering_samples(path), assembly.parameters
    rate = pitch_rate_of_forces(values, path.forces.period, p)
    arguments = (rate, path.forces.period, p)
    return Growth(sample_times, growth_rate(*arguments), sinh_law_rate(*arguments))


def _covering_samples(path: TangentPath) -> np.ndarray:
    """Samples (n + 1, 2) of the run's wheel forces; if held samples end with the run, the last one is repeated."""
    values = path.forces.values[: path.samples + 1]
    return values if len(values) > path.samples else np.vstack([values, values[-1:]])


def noise(assembly: Assembly, deviation: float) -> GrowthCurve:
    """Pitch error from white noise of ``deviation`` (N) on each force sample: median of its size over noise paths."""
    growing, period = pitch_error_growth(assembly), path_of(assembly).forces.period
    intensity = rigid_pitch(assembly.parameters).noise_intensity(deviation, period)
    return GrowthCurve(
        growing.times, MEDIAN_OF_NORMAL * np.sqrt(pitch_variance(growing.times, growing.sinh_rate, intensity))
    )


def interpolation_error(path: TangentPath) -> np.ndarray:
    """Error (3 steps, 2) in N that the scene's interpolation of force samples has, compared with a quintic spline
    through these samples.

    At the start, the middle and the end of each step. Linear samples err by f'' t (T - t) / 2, on average by
    f'' T^2 / 12. Held ones first of all delay the whole run by T / 2, which is no drift: they are judged by the
    spline as late as that, and err by -f'' T^2 / 24 on average.
    """
    spline = Smooth(_covering_samples(path), path.forces.period, degree=5)
    count, stage_forces = path.steps, path.forces_at_stages
    late = path.forces.period / 2 if path.forces.held else 0.0
    true = spline.sample(-late, path.step / 2, 2 * count + 1)
    read = [stage_forces] * 3 if path.forces.held else [stage_forces[0:-1:2], stage_forces[1::2], stage_forces[2::2]]
    return np.stack([read[0] - true[0:-1:2], read[1] - true[1::2], read[2] - true[2::2]], axis=1).reshape(3 * count, 2)


def interpolation(assembly: Assembly, longest_duration: float = LONGEST_STEP) -> GrowthCurve:
    """Pitch error from the interpolation between samples alone; 0 for a run with too few samples to estimate it."""
    path = path_of(assembly, longest_duration)
    return _growth_by_parameters(path, interpolation_error(path) if path.samples >= FEWEST_SAMPLES else None)


def model_error_curve(
    assembly: Assembly, wrong_parameters: Parameters, longest_duration: float = LONGEST_STEP
) -> GrowthCurve:
    """Pitch error of a run with the parameters ``wrong_parameters`` instead of the assembly's.

    The error that drifts is the moment of the inertia's error, dI beta''; stiffness and damping act through the cosine
    alone. The difference is propagated along a run with the mean of both models, which leaves no error of second
    order.
    """
    parameters = assembly.parameters.model_dump()
    change = {name: getattr(wrong_parameters, name) - value for name, value in parameters.items()}
    mean = Parameters(**{name: value + 0.5 * change[name] for name, value in parameters.items()})
    shifted = Parameters(**{name: value + change[name] for name, value in mean.model_dump().items()})
    return _growth_by_parameters(
        path_of(replace(assembly, parameters=mean), longest_duration), wrong_parameters=shifted
    )


def _growth_by_parameters(
    path: TangentPath, errors: np.ndarray | None = None, wrong_parameters: Parameters | None = None
) -> GrowthCurve:
    pushes = None if errors is None else errors[:, None, :]
    _, columns = path.carry_errors(np.zeros((1, 8)), pushes, wrong_parameters)
    return GrowthCurve(path.times, np.abs(columns[:, 0, 3]))


def rounding_error_curve(assembly: Assembly) -> GrowthCurve:
    """Pitch error from rounding alone, median of its size: each step rounds the pitch rate anew. No solver can do
    better.
    """
    growing, path = pitch_error_growth(assembly), path_of(assembly)
    rate = pitch_rate_of_forces(_covering_samples(path), path.forces.period, assembly.parameters)
    rounding_deviation = np.finfo(float).eps * float(np.sqrt(np.mean(rate**2))) / math.sqrt(12)
    return GrowthCurve(
        growing.times,
        MEDIAN_OF_NORMAL * np.sqrt(pitch_variance(growing.times, growing.sinh_rate, rounding_deviation**2 / path.step)),
    )


@dataclass(frozen=True)
class Trust:
    """Times (s) at which each source of error ends the trust in a run, None where it does not; ``rate`` in 1/s,
    ``angle`` in rad.

    unchecked_text : what was not looked at, with what would show it.
    """

    times: dict[str, float | None]
    rate: float
    angle: float
    unchecked_text: str = ""

    @property
    def until(self) -> tuple[str, float] | None:
        """The source of error that ends the trust first, and its time (s); None if nothing limits the run."""
        limits = [(time, name) for name, time in self.times.items() if time is not None]
        return min(limits)[::-1] if limits else None

    def __str__(self) -> str:
        """The line that describes this trust in a plan."""
        grown, remarks = (
            f"{self.angle:g} rad, growth rate {self.rate:.3g} 1/s",
            self.unchecked_text and f"; {self.unchecked_text}",
        )
        if self.until is None:
            return f"nothing known limits this run ({grown}; looked at: {', '.join(self.times)}){remarks}"
        name, time = self.until
        return f"trusted until about {time:.3g} s ({grown}, {name}){remarks}"


def predict_trust(assembly: Assembly, angle: float = UNTRUSTED_PITCH) -> Trust | None:
    """Time for which a scene's run can be trusted, and the reason. None for a run that is guided, held, or on a road:
    its errors do not grow.
    """
    forces = assembly.input
    try:
        path_of(assembly)
    except ValueError:
        return None
    assert isinstance(forces, Sampled | Smooth)
    times_of_causes = {"interpolation between the samples": interpolation(assembly).passing_time(angle)}
    added = assembly.scene.effects.get("force_noise")
    if added is not None and added.deviation > 0:
        named = f"noise of {added.deviation:g} N at {1 / forces.period:g} Hz"
        times_of_causes[named] = noise(assembly, added.deviation).passing_time(angle)
    times_of_causes |= _steady_drift_time(assembly, angle)
    times_of_causes["rounding"] = rounding_error_curve(assembly).passing_time(angle)
    return Trust(times_of_causes, pitch_error_growth(assembly).rate, angle, _unchecked_sentence(assembly))


def _steady_drift_time(assembly: Assembly, angle: float) -> dict[str, float]:
    """Time (s) by which the mean accelerations of doubtful forces have turned the vehicle by the angle, or moved it
    vertically as far as the angle moves one axle relative to the other.
    """
    if not assembly.doubts:
        return {}
    from models.measured.axle_forces import equilibrium_residual

    p, motion = assembly.parameters, equilibrium_residual(_axles(assembly))
    limits_of_motion = {"mean of the wheel forces": angle * (p.a + p.b), "balance of the axles": angle}
    return {
        name: math.sqrt(2 * limit_of_motion / abs(acceleration))
        for (name, limit_of_motion), acceleration, is_significant in zip(
            limits_of_motion.items(), motion.accelerations.tolist(), motion.is_beyond_uncertainty, strict=True
        )
        if is_significant
    }


def _axles(assembly: Assembly) -> "AxleForces":
    """The wheel forces of a run in the form that the checks of recordings read."""
    from models.measured.axle_forces import AxleForces

    path, turn = path_of(assembly), assembly.mode == "force-body"
    forces, lasts = _covering_samples(path), assembly.scene.run.duration
    return AxleForces(forces, path.forces.period, assembly.parameters, ((), ()), lasts, turns_with_chassis=turn)


def _unchecked_sentence(assembly: Assembly) -> str:
    """Sentence on the properties of wheel forces from a file that were not checked."""
    from models.measured.axle_forces import unchecked_delay_sentence

    return unchecked_delay_sentence(_axles(assembly)) if "wheel_forces" in assembly.scene.effects else ""
