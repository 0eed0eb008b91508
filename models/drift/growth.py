"""Growth of the pitch error of a force-excited vehicle, and its variance from noise on the wheel forces.

Vertical wheel forces act at an arm b cos(pitch), so a fast moment pushes the pitch away from zero on average, as a
fast shaken support holds Kapitza's pendulum up, with the opposite sign. Averaging the rigid vehicle, whose wheels
follow its chassis, (I + J cos^2) beta'' = cos n + J sin cos beta'^2, gives for a slow error X

    X'' = lambda^2 X,    lambda^2 = I / (I + J) <beta'^2>   (fast part of the pitch rate),

and for forces that turn with the chassis lambda^2 = -J / (I + J) <beta'^2>: no growth but a slow swing. A vehicle
whose two ends differ couples pitch to heave through c = b m1 - a m2. Eliminating heave leaves the same equation with
both arms measured from the common centre of mass, b - c/M and a + c/M, and J = m1 b^2 + m2 a^2 - c^2/M.

"Drift from noisy wheel forces" knows the law for lambda = 0 alone (t^1.5); this one goes beyond it.
"""

import math
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.vehicles.pitch_plane import PitchPlaneParameters

FAST_PITCH_FREQUENCY = 0.2
"""Frequency (Hz) above which a pitch rate counts as fast: 1.3 rad/s, three times the largest growth rate of the study
roads, for an average over a motion means something only where the error hardly grows meanwhile. Half of it or twice
as much changes the growth rate of these roads by 1 to 3 %."""
SERIES_ARGUMENT_LIMIT = 0.1
"""Argument 2 lambda t below which the sinh law is summed as a power series, which loses no digit."""
LARGEST_EXPONENT = 710.0
"""Argument 2 lambda t from which on sinh overflows."""
SMALLEST_POSITIVE = 1e-300
"""Least accepted positive value of an intensity (rad^2/s^3) or angle (rad)."""
MEDIAN_OF_NORMAL = 0.6744897501960817
"""Median of |x| of a normally distributed x, divided by the standard deviation."""


@dataclass(frozen=True)
class RigidPitch:
    """Pitch of the vehicle as a rigid body about the common centre of mass of chassis and wheels.

    front_arm, rear_arm : arms of the wheel forces (m); inertia : I of the chassis; wheel_inertia : J of the wheels (kg
    m^2);
    mass : of everything, kg; coupling : c = b m1 - a m2, kg m, which moves the chassis' heave by (c/M) per rad.
    """

    front_arm: float
    rear_arm: float
    inertia: float
    wheel_inertia: float
    mass: float
    coupling: float

    @property
    def total_inertia(self) -> float:
        """Total pitch inertia I + J (kg m^2)."""
        return self.inertia + self.wheel_inertia

    def moment(self, wheel_forces: np.ndarray) -> np.ndarray:
        """Pitch moment (n,) in N m from wheel forces (n, 2) in N."""
        return self.front_arm * wheel_forces[:, 0] - self.rear_arm * wheel_forces[:, 1]

    def noise_intensity(self, force_deviation: float, sample_period: float) -> float:
        """Noise intensity q (rad^2/s^3) of the pitch acceleration from white samples of both wheel forces, each with
        the standard deviation (N) and the sample period (s).

        q = s^2 D (front^2 + rear^2) / (I + J)^2 with the standard deviation s (N) of each sample and the period D (s).
        """
        return force_deviation**2 * sample_period * (self.front_arm**2 + self.rear_arm**2) / self.total_inertia**2

    def squared_growth_rate(self, pitch_rates: np.ndarray) -> np.ndarray:
        """Squared growth rate lambda^2 (1/s^2) of a pitch error for each fast pitch rate (rad/s); the wheel forces are
        vertical in space."""
        return pitch_rates**2 * self.inertia / self.total_inertia


def rigid_pitch(parameters: PitchPlaneParameters) -> RigidPitch:
    """``RigidPitch`` of a pitch-plane parameter set."""
    mass, coupling = (
        parameters.m1 + parameters.m2 + parameters.m3,
        parameters.b * parameters.m1 - parameters.a * parameters.m2,
    )
    carried = parameters.m1 * parameters.b**2 + parameters.m2 * parameters.a**2 - coupling**2 / mass
    return RigidPitch(
        parameters.b - coupling / mass, parameters.a + coupling / mass, parameters.I, carried, mass, coupling
    )


def high_passed(signal: np.ndarray, sample_period: float, cutoff: float = FAST_PITCH_FREQUENCY) -> np.ndarray:
    """Part of the signal ``signal`` (n,) above ``cutoff`` (Hz), without delay, with the gain x^4 / (1 + x^4) at x =
    frequency / cutoff.

    That is a Butterworth filter of order 2 run forward and backward. Beyond its ends the signal goes on as its odd
    mirror image, for a period of the cut-off where it is that long.
    """
    beyond = min(len(signal) - 1, round(1.0 / (cutoff * sample_period)))
    longer = np.pad(signal, beyond, mode="reflect", reflect_type="odd")
    power = (np.fft.rfftfreq(len(longer), sample_period) / cutoff) ** 4
    return np.fft.irfft(np.fft.rfft(longer) * power / (1.0 + power), len(longer))[beyond : beyond + len(signal)]


def pitch_rate_of_forces(
    wheel_forces: np.ndarray, sample_period: float, parameters: PitchPlaneParameters
) -> np.ndarray:
    """Pitch rate (n,) in rad/s from wheel forces (n, 2) in N alone: their moment is integrated once, without a
    simulation."""
    rigid = rigid_pitch(parameters)
    moment = rigid.moment(wheel_forces)
    steps = 0.5 * (moment[1:] + moment[:-1]) * sample_period
    return np.concatenate(([0.0], np.cumsum(steps))) / rigid.total_inertia


def growth_rate(
    pitch_rate: np.ndarray,
    sample_period: float,
    vehicle_parameters: PitchPlaneParameters,
    cutoff: float = FAST_PITCH_FREQUENCY,
) -> float:
    """Growth rate lambda (1/s) of a pitch error from the pitch rate (n,) in rad/s of a run or of
    ``pitch_rate_of_forces``; the wheel forces are vertical in space."""
    return float(
        np.sqrt(
            rigid_pitch(vehicle_parameters).squared_growth_rate(high_passed(pitch_rate, sample_period, cutoff)).mean()
        )
    )


def sinh_law_rate(
    pitch_rate: np.ndarray, sample_period: float, parameters: PitchPlaneParameters, cutoff: float = FAST_PITCH_FREQUENCY
) -> np.ndarray:
    """Growth rate lambda (n,) in 1/s with which the sinh law of ``pitch_variance`` holds at each time, if the motion
    changes along the run.

    A noise impulse at s moves the pitch at t by g(t, s) with g'' = lambda^2(t) g. To first order in lambda^2 the
    variance q int g^2 ds depends on int lambda^2(u) w(u) du alone, with the weight w = u^2 (t - u) (3 t - u): what
    happens at about two thirds of the time counts most.
    """
    times = sample_period * np.arange(len(pitch_rate))
    squares = rigid_pitch(parameters).squared_growth_rate(high_passed(pitch_rate, sample_period, cutoff))

    def weighted(squared_rates: np.ndarray) -> np.ndarray:
        second, third, fourth = (np.cumsum(squared_rates * times**power) for power in (2, 3, 4))
        return 3 * times**2 * second - 4 * times * third + fourth

    scaled = np.zeros(len(times))
    scaled[2:] = weighted(squares)[2:] / weighted(np.ones(len(times)))[2:]
    return np.sqrt(np.maximum(scaled, 0.0))


def pitch_variance(
    times: np.ndarray | float, error_growth_rate: np.ndarray | float, noise_intensity: float
) -> np.ndarray:
    """Variance (rad^2) of the pitch after times t (s) by the sinh law: q / (4 lambda^3) (sinh(2 lambda t) - 2 lambda
    t), with growth rate lambda (1/s) and noise intensity q (rad^2/s^3); q t^3 / 3 for lambda = 0.

    times in s, rate lambda in 1/s, intensity q in rad^2/s^3; InputError for one that is negative or no number. With
    x = 2 lambda t it is q t^3 / 3 times 6 (sinh x - x) / x^3, whose bracket loses its digits for small x and is summed
    there.
    """
    for name, argument in (("times", times), ("rate", error_growth_rate), ("intensity", noise_intensity)):
        if not (np.asarray(argument, dtype=float) >= 0.0).all():
            raise InputError("", name, None, "must be 0 or more, and a number")
    t, x = (
        np.asarray(times, dtype=float),
        2.0 * np.asarray(error_growth_rate, dtype=float) * np.asarray(times, dtype=float),
    )
    small = np.minimum(np.abs(x), SERIES_ARGUMENT_LIMIT) ** 2
    series = 1.0 + small / 20 * (1.0 + small / 42 * (1.0 + small / 72 * (1.0 + small / 110)))
    large = np.where(np.abs(x) > SERIES_ARGUMENT_LIMIT, x, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):  # beyond all numbers is infinite, at no rate and no time alike
        closed = np.where(large > LARGEST_EXPONENT, np.inf, 6 * (np.sinh(large) - large) / large**3)
    return noise_intensity * t**3 / 3 * np.where(np.abs(x) > SERIES_ARGUMENT_LIMIT, closed, series)


def heave_variance(
    times: np.ndarray | float, parameters: PitchPlaneParameters, force_deviation: float, sample_period: float
) -> np.ndarray:
    """Variance (m^2) of the heave of the common centre of mass after times t (s): 2 s^2 D / M^2 t^3 / 3, with standard
    deviation s (N) and period D (s) of the wheel forces' samples, and total mass M. A heave error does not grow by
    itself."""
    mass = rigid_pitch(parameters).mass
    return 2 * force_deviation**2 * sample_period / mass**2 * np.asarray(times, dtype=float) ** 3 / 3


def holding_stiffness(parameters: PitchPlaneParameters, error_growth_rate: float) -> float:
    """Smallest rotational stiffness to the ground (N m/rad) that keeps the pitch from growing: total pitch inertia
    times the squared growth rate (1/s)."""
    return rigid_pitch(parameters).total_inertia * error_growth_rate**2


def pitch_spring(parameters: PitchPlaneParameters, frequency: float, damping_ratio: float) -> tuple[float, float]:
    """Stiffness k = (I + J) wc^2 (N m/rad) and damping d = 2 zeta (I + J) wc (N m s/rad) of a pitch spring to the
    ground with a natural ``frequency`` (Hz)."""
    corner, inertia = 2 * math.pi * frequency, rigid_pitch(parameters).total_inertia
    return inertia * corner**2, 2 * damping_ratio * inertia * corner


def drift_off_time(error_growth_rate: float, noise_intensity: float, pitch_limit: float) -> float:
    """Time (s) after which half of all runs deviate in pitch by more than ``pitch_limit`` (rad), for a constant growth
    rate (1/s) and noise intensity (rad^2/s^3).

    Raises InputError for an intensity or angle that is not above 0, and for a rate below it.
    """
    from scipy.optimize import brentq

    for name, value, smallest_value in (
        ("rate", error_growth_rate, 0.0),
        ("intensity", noise_intensity, SMALLEST_POSITIVE),
        ("angle", pitch_limit, SMALLEST_POSITIVE),
    ):
        if not (math.isfinite(value) and value >= smallest_value):
            raise InputError("", name, value, "must be finite, intensity and angle above 0 and the rate not below")
    longest = (
        math.log(3.0) + 2.0 * math.log(pitch_limit / MEDIAN_OF_NORMAL) - math.log(noise_intensity)
    ) / 3.0  # without growth
    if error_growth_rate == 0.0:
        return math.exp(longest)
    longest_log_time = math.log(2.0) + math.log(error_growth_rate) + longest
    ends = min(longest_log_time, 0.0) - 1.0, min(longest_log_time, math.log(3.0 * max(longest_log_time, 0.0) + 3.0))
    return math.exp(brentq(lambda x: 3.0 * (x - longest_log_time) + _log_gain(x), *ends, xtol=1e-14)) / (
        2.0 * error_growth_rate
    )


def _log_gain(log_x: float) -> float:
    """Logarithm of the sinh law's gain 6 (sinh x - x) / x^3 from the logarithm of x = 2 lambda t; works where x or the
    result would overflow."""
    x = math.exp(log_x)
    if x > LARGEST_EXPONENT:
        return math.log(3.0) + x - 3.0 * log_x
    return float(np.log(pitch_variance(1.0, x / 2.0, 3.0)))
