"""Time up to which a free run of a spatial vehicle on measured hub forces can be trusted, predicted before the run.

The cut vehicle as one rigid body (``models.vehicles.cut_vehicle``). An error of roll, pitch and heading, e (3,), obeys

    e'' = A e + I^-1 (moment of noise and bias),

with A = 0 where the forces turn with the vehicle (frames "hub" and "body"), and A = I^-1 diag(m g h, m g h, 0) where
they keep their directions ("inertial"): what carries the vehicle from below its centre of mass topples it. Its impulse
response is G = sinh(sqrt(A) t) / sqrt(A), so that white samples of covariance C, ``period`` apart, leave the variance
int G q G^T dt with q = period I^-1 C I^-1: q t^3 / 3 where A = 0. A bias leaves int G dt I^-1 M, a tilt at the start
cosh(sqrt(A) t) of itself, a rate G of itself.

Forces that turn with the vehicle do not feel it: gravity acts on all bodies alike, and the section forces of such a
run are right whatever its tilt is. What ends its trust for them is tumbling, when its angles lose their meaning. Where
forces keep their directions an error of ``UNTRUSTED_PITCH`` turns as much of every force into another axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from models.engines.cut_vehicle import TUMBLED_PITCH
from models.multibody.cut_kernel import WRENCH
from models.systems.pitch_plane.trust import UNTRUSTED_PITCH, TrustPrediction
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle, RigidVehicle, rigid_vehicle

SUMMED_TIME_COUNT = 2000
"""Number of time intervals by which the laws of drift are integrated."""


@dataclass(frozen=True)
class MeasurementErrors:
    """Errors of measured hub forces: noise of forces and moments, their bias, and the initial error of tilt and rate.

    force, moment : standard deviation of the white noise of each sample (N, N m). bias (6 h,) : N and N m hub by hub,
    None for none. tilt, rate (2,) : error of roll and pitch at the start (rad) and of their rates (rad/s).
    """

    force: float
    moment: float
    bias: np.ndarray | None = None
    tilt: Sequence[float] = (0.0, 0.0)
    rate: Sequence[float] = (0.0, 0.0)

    def deviations(self, vehicle: CutVehicle) -> np.ndarray:
        """Standard deviations (6 h,) of the noise of each hub force (N) and moment (N m), hub by hub."""
        return np.tile(np.repeat([self.force, self.moment], 3), len(vehicle.hubs))


@dataclass(frozen=True)
class Drift:
    """Predicted drift of a free run by the errors of measured hub forces.

    mean_errors : source -> errors (n, 3) of roll, pitch, heading (rad) at ``times`` (n,) in s; deviations (n, 3) :
    standard deviations caused by noise (rad); rates (3,) : growth rates of errors (1/s).
    """

    times: np.ndarray
    mean_errors: dict[str, np.ndarray]
    deviations: np.ndarray
    rates: np.ndarray
    frame: str = "hub"

    def passing_time(self, largest_angle: float = UNTRUSTED_PITCH, error_source: str | None = None) -> float | None:
        """First time (s) at which, in half of all runs, the error of roll or pitch exceeds ``largest_angle`` (rad);
        None if never.

        error_source : a key of ``mean_errors``, or "noise" alone; None: all together.
        """
        from scipy.special import ndtr

        mean = sum(
            (means for name, means in self.mean_errors.items() if error_source in (None, name)),
            np.zeros((len(self.times), 3)),
        )
        spread = self.deviations if error_source in (None, "noise") else np.zeros_like(self.deviations)
        mean, deviation = mean[:, :2], np.maximum(spread[:, :2], 1e-300)
        inside = np.prod(ndtr((largest_angle - mean) / deviation) - ndtr((-largest_angle - mean) / deviation), axis=1)
        beyond = inside < 0.5
        return float(self.times[beyond.argmax()]) if beyond.any() else None

    @property
    def angle(self) -> float:
        """Error (rad) of roll or pitch beyond which the section forces of a free run are not trusted."""
        return UNTRUSTED_PITCH if self.frame == "inertial" else TUMBLED_PITCH

    @property
    def trusted_time(self) -> float:
        """Time (s) until which the section forces of a free run are trusted; at most the duration of the run."""
        passed = self.passing_time(self.angle)
        return float(self.times[-1]) if passed is None else passed

    def trust(self, largest_angle: float | None = None) -> TrustPrediction:
        """Returns the time at which each source of error exceeds ``largest_angle`` (rad), by default the limit for
        section forces; 0.05 rad is the limit for the motion.
        """
        limit = self.angle if largest_angle is None else largest_angle
        times = {name: self.passing_time(limit, name) for name in ("noise", *self.mean_errors)}
        return TrustPrediction({**times, "all together": self.passing_time(limit)}, float(self.rates.max()), limit)


def predicted_drift(
    vehicle: CutVehicle, measurement_errors: MeasurementErrors, sample_period: float, duration: float, force_frame: str
) -> Drift:
    """Predict the drift of a free run over a duration (s), under hub forces in a frame, sampled
    every ``sample_period`` (s).
    """
    body, law = (
        rigid_vehicle(vehicle),
        _AngleResponse(rigid_vehicle(vehicle), force_frame, np.linspace(0.0, duration, SUMMED_TIME_COUNT + 1)),
    )
    noise = sample_period * body.turning(measurement_errors.deviations(vehicle))
    spread = np.sqrt(
        np.diagonal(law.time_integral(law.impulse @ noise @ law.impulse.transpose(0, 2, 1)), axis1=1, axis2=2)
    )
    means = dict[str, np.ndarray]()
    if measurement_errors.bias is not None:
        turning = np.linalg.solve(body.inertia, body.moments(np.asarray(measurement_errors.bias, float)[None])[0])
        means["bias"] = law.time_integral(law.impulse) @ turning
    for name, start, response in (
        ("tilt", measurement_errors.tilt, "step"),
        ("rate", measurement_errors.rate, "impulse"),
    ):
        if np.any(start):
            means[f"{name} at the start"] = getattr(law, response) @ np.array([*start, 0.0])
    return Drift(law.times, means, spread, law.rates, force_frame)


def position_error(
    vehicle: CutVehicle,
    measurement_errors: MeasurementErrors,
    sample_period: float,
    times: np.ndarray,
    force_frame: str,
) -> np.ndarray:
    """Error (n, 3) in m of the position x, y, z of a free run at times (n,) in s, from noise, bias and initial tilt.

    With forces that turn with the vehicle, gravity moves a tilted vehicle by g tilt t^2 / 2; in the frame "inertial"
    only noise and bias of the forces act. The result combines one standard deviation of the noise with the means of the
    other errors.
    """
    body, deviation = rigid_vehicle(vehicle), measurement_errors.deviations(vehicle)
    mean = np.zeros((len(times), 3))
    bias = np.zeros(len(deviation)) if measurement_errors.bias is None else np.asarray(measurement_errors.bias, float)
    mean += np.outer(times**2 / 2, bias.reshape(-1, WRENCH)[:, :3].sum(axis=0) / body.mass)
    if force_frame != "inertial":
        turning = np.linalg.solve(body.inertia, body.moments(bias[None])[0])
        for axis, about, sign in ((0, 1, 1.0), (1, 0, -1.0)):
            tilt = (
                measurement_errors.tilt[about] * times**2 / 2
                + measurement_errors.rate[about] * times**3 / 6
                + turning[about] * times**4 / 24
            )
            mean[:, axis] += sign * GRAVITY * tilt
    return np.sqrt(mean**2 + body.position_variance(deviation, sample_period, times, force_frame))


@dataclass(frozen=True)
class _AngleResponse:
    """Response of the rigid vehicle's roll, pitch and heading to errors, at times (n,) in s, equally spaced from 0."""

    rigid: RigidVehicle
    frame: str
    times: np.ndarray
    _modes: tuple[np.ndarray, np.ndarray] = field(init=False)

    def __post_init__(self) -> None:
        carried = -self.rigid.arms[:, 2].mean() * self.rigid.mass * GRAVITY if self.frame == "inertial" else 0.0
        values, shapes = np.linalg.eig(np.linalg.solve(self.rigid.inertia, np.diag([carried, carried, 0.0])))
        object.__setattr__(self, "_modes", (np.sqrt(values.astype(complex)), shapes))

    @property
    def rates(self) -> np.ndarray:
        """Growth rates (3,) of an error in 1/s; 0 where an error does not grow by itself."""
        return np.asarray(self._modes[0].real)

    def _matrices_of_modes(self, mode_functions: np.ndarray) -> np.ndarray:
        """Response matrices (n, 3, 3) of the angles from the time functions (n, 3) of the modes."""
        shapes = self._modes[1]
        return np.asarray(((shapes * mode_functions[:, None, :]) @ np.linalg.inv(shapes)).real)

    @cached_property
    def impulse(self) -> np.ndarray:
        """Response G (n, 3, 3) of the angles to a sudden change of their rates, in s."""
        turns = np.outer(self.times, self._modes[0])
        return self._matrices_of_modes(self.times[:, None] * np.sinc(1j * turns / np.pi))

    @cached_property
    def step(self) -> np.ndarray:
        """Response (n, 3, 3) of the angles to an initial tilt, dimensionless."""
        return self._matrices_of_modes(np.cosh(np.outer(self.times, self._modes[0])))

    def time_integral(self, values_over_time: np.ndarray) -> np.ndarray:
        """Time integral (n, ...) of values (n, ...) from 0 on, by the trapezoidal rule."""
        steps = 0.5 * (values_over_time[1:] + values_over_time[:-1]) * self.times[1]
        return np.concatenate((np.zeros_like(values_over_time[:1]), np.cumsum(steps, axis=0)))
