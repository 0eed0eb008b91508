"""Equilibrium of measured vertical axle forces with the rigid vehicle that they carry, and what is left of it.

All forces, integrated once, give the rates of the rigid vehicle: v' = F / M - g upwards, r' = (front F1 - rear F2) /
(I + J) nose up. A true motion keeps both rates bounded, so that neither rises steadily; an error of the forces' mean
does. A vehicle that climbs a grade rises at its speed times its pitch, which is taken off v first. What is left is
fitted by a straight line over block means: its slope is the acceleration that the vehicle cannot have, and the scatter
about it says how well that is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.drift.growth import RigidPitch, rigid_pitch
from models.measured.ratios import NEGLIGIBLE_MEAN_LOAD_SHARE, WrongFactor
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal
from models.vehicles.pitch_plane import PitchPlaneParameters

LOCATIONS_OF_AXLE_FORCES = {
    "front": ("front", "front left", "front right"),
    "rear": ("rear", "rear left", "rear right"),
}
"""Locations at which vertical forces may be measured: at an axle, or at its wheels, whose forces are added."""
GRAVITY = 9.81
"""Acceleration (m/s^2) by which shares are computed for a vehicle with another gravity, or none."""
RECORD_BLOCK_COUNT = 16
"""Number of blocks of a record over which means are taken; motion faster than a block says nothing about the slope."""
NEGLIGIBLE_IMBALANCE_SHARE = 0.003
"""Share of the weight, or of the moment of an axle's load, below which an imbalance is not reported; the drift of 0.1 %
is the subject of studies of trust."""
STEADY_SPEED_GAIN, STEADY_RATE_GAIN = 0.5, 0.1
"""Vertical speed (m/s) and pitch rate (rad/s) that a short record may gain steadily by its motion, as when it enters a
grade."""
BLOCK_MEAN_SCATTER_FACTOR = 1.5
"""Factor on the rms scatter of block means about the fitted line, for the uncertainty of the gain over the record; a
wave as long as the record makes 1.7 of it."""
FASTEST_SPEED = 60.0
"""Largest speed (m/s) of a vehicle on a grade."""
STEEPEST_GRADE = 0.35
"""Steepest grade (rad) of a road (36 %)."""
PITCH_INTEGRATION_COUNT = 3
"""Number of repeated integrations of the pitch, each with the lever arms of the one before."""
LEAST_UNSTEADY_PITCH_SHARE = 0.05
"""Least share of a pitch signal that counts as not rising steadily."""


@dataclass(frozen=True)
class AxleForces:
    """Measured vertical forces (n, 2) of the front and rear axle, in N, up on the wheels, ``period`` (s) apart, with
    their signals and the vehicle's parameters.

    duration : s, of the run that they drive. remedies : what to do about a wrong sign, unit or factor, None for those
    of a channel map. starts_at_rest : whether the run starts from the static equilibrium; turns_with_chassis :
    whether the forces turn with the chassis.
    """

    forces: np.ndarray
    period: float
    parameters: PitchPlaneParameters
    signals: tuple[tuple[MeasuredSignal, ...], tuple[MeasuredSignal, ...]]
    duration: float
    remedies: Mapping[WrongFactor, str] | None = None
    starts_at_rest: bool = True
    turns_with_chassis: bool = False

    @cached_property
    def rigid_pitch_body(self) -> RigidPitch:
        """The vehicle as one rigid body in the pitch plane."""
        return rigid_pitch(self.parameters)

    @cached_property
    def static_loads(self) -> np.ndarray:
        """Static axle loads (2,) in N; computed with 9.81 m/s^2 if the vehicle has no gravity."""
        return _axle_masses(self.parameters) * (self.parameters.g or GRAVITY)

    @cached_property
    def mean_forces(self) -> np.ndarray:
        """Mean forces (2,) of the axles in N."""
        return self.forces.mean(axis=0)

    @property
    def is_unloaded(self) -> np.ndarray:
        """Which axles (2,) have a mean force that is negligible compared with their static load and with their
        variation."""
        return (np.abs(self.mean_forces) < NEGLIGIBLE_MEAN_LOAD_SHARE * self.static_loads) & (
            np.abs(self.mean_forces) <= self.forces.std(axis=0)
        )

    @property
    def last_sample_time(self) -> float:
        """Time (s) of the last sample."""
        return self.period * (len(self.forces) - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all force signals."""
        return tuple(s.name for axle in self.signals for s in axle)

    @cached_property
    def accelerations_per_newton(self) -> np.ndarray:
        """Accelerations (2, 2) per 1 N at the front and at the rear axle: heave (upwards), then pitch (nose up)."""
        body = self.rigid_pitch_body
        return np.array(
            [[1 / body.mass, 1 / body.mass], [body.front_arm / body.total_inertia, -body.rear_arm / body.total_inertia]]
        )

    @cached_property
    def pitch_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Pitch rate (n,) in rad/s and pitch angle (n,) in rad, nose up, from integrating the forces alone, starting at
        rest.

        The lever arms of vertical forces shorten with the cosine of the pitch. A few iterations account for this while
        the pitch is small.
        """
        moments = self.forces @ self.accelerations_per_newton[1]
        rate = self._time_integral(moments)
        pitch = self._time_integral(rate)
        for _ in range(0 if self.turns_with_chassis else PITCH_INTEGRATION_COUNT):
            if abs(pitch).max() > STEEPEST_GRADE:
                break
            rate = self._time_integral(moments * np.cos(pitch))
            pitch = self._time_integral(rate)
        return rate, pitch

    @cached_property
    def vertical_speed(self) -> np.ndarray:
        """Vertical speed (n,) of the centre of mass in m/s, upwards, from integrating the forces, starting at rest."""
        pitch = self.pitch_motion[1]
        upright = np.cos(pitch) if self.turns_with_chassis and abs(pitch).max() < STEEPEST_GRADE else 1.0
        return self._time_integral(self.forces @ self.accelerations_per_newton[0] * upright - self.parameters.g)

    def _time_integral(self, samples: np.ndarray) -> np.ndarray:
        """Time integral (n,) of samples (n,) by the trapezoidal rule, starting with 0."""
        return np.concatenate(([0.0], np.cumsum(0.5 * (samples[1:] + samples[:-1]) * self.period)))


def axle_signals(recording: Recording, axle_name: str) -> list[MeasuredSignal]:
    """Signals of the vertical force of an axle: the axle's own signal, or those of its wheels."""
    vertical = [
        s for at in LOCATIONS_OF_AXLE_FORCES[axle_name] for s in recording.find_signals("force", at, "z") if not s.check
    ]
    whole = [signal for signal in vertical if signal.at == axle_name]
    return whole or vertical


def axle_forces_of(recording: Recording, vehicle_parameters: PitchPlaneParameters) -> AxleForces | None:
    """``AxleForces`` of a recording, gaps bridged by straight lines; None where an axle lacks a wheel's signal."""
    signals = tuple(tuple(axle_signals(recording, axle)) for axle in LOCATIONS_OF_AXLE_FORCES)
    if not all(
        side and len(side) == (1 if side[0].at == axle else 2)
        for axle, side in zip(LOCATIONS_OF_AXLE_FORCES, signals, strict=True)
    ):
        return None
    front, rear = (np.asarray(sum(_bridged_samples(recording.samples(s)) for s in side)) for side in signals)
    turn = all(s.frame != "inertial" for side in signals for s in side)
    return AxleForces(
        np.column_stack([front, rear]),
        recording.period,
        vehicle_parameters,
        (signals[0], signals[1]),
        recording.duration,
        turns_with_chassis=turn,
    )


def _bridged_samples(samples: np.ndarray) -> np.ndarray:
    """Samples (n,) with straight lines across gaps; all 0 if nothing was measured."""
    known = np.flatnonzero(np.isfinite(samples))
    return np.interp(np.arange(len(samples)), known, samples[known]) if len(known) else np.zeros(len(samples))


@dataclass(frozen=True)
class SteadyResidual:
    """Steady accelerations (2,) that the vehicle's motion cannot explain, m/s^2 upwards and rad/s^2 nose up, with their
    uncertainties (2,), and the accelerations (2,) that a whole load would cause: gravity, and the pitch acceleration by
    one axle's load."""

    accelerations: np.ndarray
    uncertainties: np.ndarray
    whole_load_accelerations: np.ndarray

    @property
    def shares_of_load(self) -> np.ndarray:
        """Ratios (2,) of the unexplained accelerations to those that a whole load would cause."""
        return self.accelerations / self.whole_load_accelerations

    @property
    def is_beyond_uncertainty(self) -> np.ndarray:
        """Which of the two steady accelerations (2,), heave and pitch, exceeds its uncertainty."""
        return np.abs(self.accelerations) > self.uncertainties


def equilibrium_residual(axle_forces: AxleForces) -> SteadyResidual:
    """Residual of the vertical and the pitch equilibrium of axle forces over the whole record.

    Vertical motion is compared with two explanations: a level road, and a climb with the pitch that the forces give.
    The residual is that of the better explanation.
    """
    rate, pitch = axle_forces.pitch_motion
    times = _block_means(axle_forces.last_sample_time * np.linspace(-0.5, 0.5, len(axle_forces.forces)))
    units = np.array(
        [
            GRAVITY,
            axle_forces.accelerations_per_newton[1, 0]
            * axle_forces.static_loads[0]
            * GRAVITY
            / (axle_forces.parameters.g or GRAVITY),
        ]
    )
    level = _slope_and_scatter(times, _block_means(axle_forces.vertical_speed))
    climbing = (
        _slope_and_scatter(times, _block_means(axle_forces.vertical_speed), _block_means(pitch))
        if abs(pitch).max() < STEEPEST_GRADE
        else level
    )
    risen, turned = (
        _slope_with_error(estimate, unit, gained, axle_forces.last_sample_time)
        for estimate, unit, gained in (
            (level, units[0], STEADY_SPEED_GAIN),
            (_slope_and_scatter(times, _block_means(rate)), units[1], STEADY_RATE_GAIN),
        )
    )
    risen = min(
        risen,
        _slope_with_error(climbing, units[0], STEADY_SPEED_GAIN, axle_forces.last_sample_time),
        key=lambda estimate: abs(estimate[0]) / estimate[1],
    )
    return SteadyResidual(np.array([risen[0], turned[0]]), np.array([risen[1], turned[1]]), units)


def _slope_with_error(
    slope_and_scatter: tuple[float, float], whole_load_acceleration: float, permitted_gain: float, duration: float
) -> tuple[float, float]:
    """A fitted slope, and its uncertainty from the scatter of the values about the fitted line."""
    return slope_and_scatter[0], NEGLIGIBLE_IMBALANCE_SHARE * whole_load_acceleration + (
        permitted_gain + BLOCK_MEAN_SCATTER_FACTOR * slope_and_scatter[1]
    ) / duration


def _slope_and_scatter(times: np.ndarray, values: np.ndarray, pitch: np.ndarray | None = None) -> tuple[float, float]:
    """Least-squares slope of values (n,) over times (n,), and the rms scatter of the values about the line.

    What a vehicle climbs with its pitch (n,), at a speed between 0 and the fastest, is fitted beside it; the scatter
    grows where a pitch that rises steadily can hardly be told from it.
    """
    values, unlike = values - values.mean(), 1.0
    if pitch is not None and np.ptp(pitch) > 0:
        climb = pitch - pitch.mean()
        steady_climb = climb @ times / (times @ times)
        curve = climb - steady_climb * times
        speed = float(np.clip(curve @ values / (curve @ curve), 0.0, FASTEST_SPEED)) if curve @ curve > 0 else 0.0
        values = values - speed * climb
        unlike = max(float(np.sqrt((curve @ curve) / (climb @ climb))), LEAST_UNSTEADY_PITCH_SHARE)
    slope = float(times @ values / (times @ times))
    return slope, float(np.sqrt(np.mean((values - slope * times) ** 2))) / unlike


def _block_means(samples: np.ndarray) -> np.ndarray:
    """Means of values (n, ...) over blocks of equal length along the first axis."""
    blocks = np.array_split(samples, min(RECORD_BLOCK_COUNT, max(len(samples) // 2, 2)))
    return np.array([block.mean(axis=0) for block in blocks])


def _axle_masses(parameters: PitchPlaneParameters) -> np.ndarray:
    """Mass (2,) in kg carried by each axle, wheels included."""
    return np.array(
        [
            parameters.m3 * parameters.a / (parameters.a + parameters.b) + parameters.m1,
            parameters.m3 * parameters.b / (parameters.a + parameters.b) + parameters.m2,
        ]
    )
