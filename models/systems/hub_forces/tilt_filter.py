"""Kalman filter that estimates roll and pitch of the vehicle from measured angles, rates and hub forces.

State: roll, pitch and their rates. The hub forces turn the rigid vehicle. The motion of its springs is treated as noise
of the acceleration, ``model`` (rad/s^2). Products of rates are neglected, and so is the difference between angles and
rotations about the body's axes, as is right for tilts of a few degrees. Values that were not measured are NaN; the
filter predicts them.
"""

import math
from dataclasses import dataclass, field, replace
from typing import get_args

import numpy as np

from models.core.errors import InputError
from models.core.signals import SampledSignal
from models.drift.score import DOUBTFUL_INNOVATION_LIMIT
from models.multibody.cut_table import HubInputs
from models.systems.hub_forces.measurement import HubForces, MeasuredAngles
from models.systems.hub_forces.scene import ForceFrame
from models.systems.hub_forces.tilt_march import TiltNoise, march
from models.vehicles.cut_vehicle import CutVehicle, rigid_vehicle

INNOVATION_LIMIT = 4.0
"""Largest mean of the normalised innovation squared, per measured value, which means errors twice as large as stated.
"""

BIAS_IN_DEVIATIONS, BIAS_IN_STANDARD_ERRORS = 0.1, 4.0
"""Mean of a measured value's innovations above which it counts as biased: in standard deviations, and in standard
errors of the mean. One faultless run in 4000 exceeds the second; a gyro wrong by 0.1 degree/s has -0.35 and 27 in 15 s.
"""
MEASURED_VALUES = "roll", "pitch", "roll_rate", "pitch_rate"
"""Names of the measured values of the filter, in the order of its state."""
LARGEST_UNEXPLAINED_SHARE = 0.65
"""Largest share of the measured rates that hub forces may leave unexplained. The rigid vehicle leaves 0.3 to 0.45 of
them on rough roads, because its springs move; forces in another frame than stated leave 0.8, exchanged hubs 2 and
more."""
BALANCE_WINDOW = 15.0
"""Longest time (s) over which moments are integrated to be compared with rates; over longer times small biases add
up.
"""
UNKNOWN_VARIANCE = 0.1**2
"""Initial variance (rad^2, rad^2/s^2) of angles and rates that are not measured at the first sample."""
SIGNAL_REMEDY = "check signs, units, order of the hubs and frame, or state larger deviations"


@dataclass(frozen=True)
class TiltEstimate:
    """Output of the tilt filter. states (m, 4) : estimated roll, pitch (rad) and their rates (rad/s); deviations :
    their standard deviations; period : between samples (s); normalised_innovation : mean of the normalised innovation
    squared per measured value, 1 where the stated deviations are right; objections : to the measurement, as text.
    """

    states: np.ndarray
    deviations: np.ndarray
    period: float
    normalised_innovation: float
    objections: tuple[str, ...] = ()


@dataclass
class TiltFilterState:
    """State of the tilt filter after a sample. x (4,) : estimate; p (4, 4) : its covariance; squared_innovations : sum
    and number of the normalised innovations squared; rate_variances (2, 2) : sums of the variances of the unexplained
    and of the measured rates of roll and pitch; sums (5, 4) : of innovations, as in ``tilt_march.march``.
    """

    x: np.ndarray = field(default_factory=lambda: np.full(4, np.nan))
    p: np.ndarray = field(default_factory=lambda: np.full((4, 4), np.nan))
    squared_innovations: np.ndarray = field(default_factory=lambda: np.zeros(2))
    rate_variances: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))
    sums: np.ndarray = field(default_factory=lambda: np.zeros((5, 4)))


@dataclass(frozen=True)
class StatedDeviations:
    """Stated standard deviations of a measurement. forces (6 h,) : of each force (N) and moment (N m); angles : of the
    angles (rad) and of their rates (rad/s); model : of the acceleration that a rigid vehicle does not have (rad/s^2).
    """

    forces: np.ndarray
    angles: tuple[float, float]
    model: float


class TiltFilter:
    """Kalman filter of roll and pitch for angles and forces sampled together, every ``sample_period`` (s). It takes a
    measurement block by block.
    """

    def __init__(
        self,
        vehicle: CutVehicle,
        force_frame: str,
        sample_period: float,
        stated_deviations: StatedDeviations,
        named_file: str = "",
    ) -> None:
        _check_measurement(force_frame, sample_period, stated_deviations)
        self.rigid, self.frame, self.period, self.file = rigid_vehicle(vehicle), force_frame, sample_period, named_file
        self.forces_noise = self.rigid.turning(stated_deviations.forces)[:2, :2]
        push = np.vstack([np.eye(2) * sample_period**2 / 2, np.eye(2) * sample_period])
        process = push @ (self.forces_noise + stated_deviations.model**2 * np.eye(2)) @ push.T
        self.noise = TiltNoise(sample_period, process, np.repeat(stated_deviations.angles, 2) ** 2)
        self.inverse = np.linalg.inv(self.rigid.inertia)[:2]
        self.state = TiltFilterState()

    def advance(self, hub_wrenches: np.ndarray, measured_angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Filter a block of hub forces (n, 6 h) and angles (n, 4), NaN where not measured. Returns estimates (n, 4) and
        their standard deviations.

        The first sample is the last sample of the previous block. Raises InputError where angles and forces contradict
        one another, or are infinite.
        """
        _check_numbers(hub_wrenches, measured_angles, self.file)
        state, count = self.state, len(measured_angles)
        if np.isnan(state.x[0]):
            state.x, state.p = (
                np.nan_to_num(measured_angles[0]),
                np.diag(np.where(np.isnan(measured_angles[0]), UNKNOWN_VARIANCE, self.noise.variances)),
            )
        tilted = (
            _wrenches_in_tilted_axes(hub_wrenches, np.nan_to_num(measured_angles))
            if self.frame == "inertial"
            else hub_wrenches
        )
        turning, filtered = self.rigid.moments(tilted) @ self.inverse.T, np.empty((2, count, 4))
        self._check_balance(turning, measured_angles[:, 2:])
        state.squared_innovations += march(state.x, state.p, turning, measured_angles, self.noise, state.sums, filtered)
        if not self.normalised_innovation <= INNOVATION_LIMIT:
            raise InputError(
                self.file,
                "angles",
                None,
                "contradict the hub forces: the squares of the innovations are "
                f"{self.normalised_innovation:.3g} times what the deviations allow (at most "
                f"{INNOVATION_LIMIT:g}): {SIGNAL_REMEDY}",
            )
        return filtered[0], filtered[1]

    @property
    def normalised_innovation(self) -> float:
        """Mean of the normalised innovations squared per measured value; 1 where the stated deviations are right."""
        return float(self.state.squared_innovations[0] / max(self.state.squared_innovations[1], 1.0))

    def innovation_biases(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean (4,) of the normalised innovations of roll, pitch and their rates, and its standard error (4,).

        The springs of the vehicle, which the filter takes for noise, make successive innovations correlated. The number
        of independent ones is reduced according to the correlation of each innovation with the one before.
        """
        count, total, squares, products, _ = self.state.sums
        number = np.maximum(count, 1.0)
        variance = np.maximum(squares / number - (total / number) ** 2, 0.0)
        autocorrelation = np.clip(products / np.maximum(squares, 1e-300), 0.0, 0.999)
        return total / number, np.sqrt(variance * (1 + autocorrelation) / (1 - autocorrelation) / number)

    def objections(self) -> tuple[str, ...]:
        """Objections to the measurement, as text, where innovations are too large or have a mean. They do not show a
        constant error of an angle.
        """
        large = (
            f"the filter's innovations squared are {self.normalised_innovation:.3g} times what the "
            "stated deviations allow (up "
            f"to {DOUBTFUL_INNOVATION_LIMIT:g} is not said): {SIGNAL_REMEDY}"
        )
        mean, error = self.innovation_biases()
        biased = [
            f"the filter's innovations of {name} have a mean of {average:+.2g} deviations (of a right filter at most "
            f"{BIAS_IN_DEVIATIONS:g}, and {BIAS_IN_STANDARD_ERRORS * wide:.2g} by chance): a gyro or "
            "forces have an offset, or an angle drifts"
            for name, average, wide in zip(MEASURED_VALUES, mean, error, strict=True)
            if abs(average) > max(BIAS_IN_DEVIATIONS, BIAS_IN_STANDARD_ERRORS * wide)
        ]
        return (*([large] if self.normalised_innovation > DOUBTFUL_INNOVATION_LIMIT else []), *biased)

    def _check_balance(self, turning_acceleration: np.ndarray, angular_rates: np.ndarray) -> None:
        """Raise InputError for hub forces whose moments, integrated over time, do not give the measured rates of roll
        and pitch.

        A constant offset of a transducer, which the filter treats as noise, gives a linear trend in the difference. The
        trend is not counted, or 30 N at one wheel would be as much as a smooth road.

        turning_acceleration : (n, 2), rad/s^2; angular_rates : (n, 2), rad/s.
        """
        dt, length = self.period, round(BALANCE_WINDOW / self.period)
        for first in range(0, len(angular_rates) - 1, length):
            turning_part, measured = (
                turning_acceleration[first : first + length + 1],
                angular_rates[first : first + length + 1],
            )
            if not np.isfinite(measured).all():
                continue
            integral = np.vstack((np.zeros(2), np.cumsum(turning_part[1:] + turning_part[:-1], axis=0) * dt / 2))
            allowed = self.noise.variances[2:] + np.diag(self.forces_noise) * dt * dt * len(measured) / 6
            left = np.var(_without_slope(measured - integral), axis=0)
            self.state.rate_variances += np.maximum(left - 9 * allowed, 0.0), np.var(measured, axis=0)
        unexplained, measured_change = self.state.rate_variances
        share = np.sqrt(unexplained / np.where(measured_change > 0, measured_change, 1.0))
        for name, turning_part in zip(("roll", "pitch"), share, strict=True):
            if not turning_part <= LARGEST_UNEXPLAINED_SHARE:
                contradiction = (
                    f"{turning_part:.0%} of it is not the integral of their moment (at most "
                    f"{LARGEST_UNEXPLAINED_SHARE:.0%}): {SIGNAL_REMEDY}"
                )
                raise InputError(self.file, f"angles.{name}_rate", None, f"contradicts the hub forces: {contradiction}")


def _check_measurement(force_frame: str, sample_period: float, stated_deviations: StatedDeviations) -> None:
    """Raise InputError for an unknown frame, and for a sampling period or deviations that are not
    above 0 and finite.
    """
    if force_frame not in get_args(ForceFrame):
        raise InputError("", "frame", force_frame, "is none", get_args(ForceFrame))
    named_values = {
        "period": (sample_period,),
        "angle_deviations": stated_deviations.angles,
        "model": (stated_deviations.model,),
    }
    for name, value in ((name, value) for name, values in named_values.items() for value in sorted(values)):
        if not 0.0 < value < math.inf:
            raise InputError("", name, value, "must be above 0, and finite")


def _check_numbers(hub_wrenches: np.ndarray, measured_angles: np.ndarray, named_file: str) -> None:
    """Raise InputError for forces that are not finite, and for infinite angles. NaN marks an angle that was not
    measured.
    """
    for name, wrong in (("forces", ~np.isfinite(hub_wrenches)), ("angles", np.isinf(measured_angles))):
        if wrong.any():
            row = int(np.flatnonzero(wrong.any(axis=1))[0])
            raise InputError(named_file, name, None, f"hold what is no number in sample {row} of this stretch")


def _without_slope(value_columns: np.ndarray) -> np.ndarray:
    """Remove the linear trend from each column of values (n, k); the means stay."""
    line = np.linspace(-1.0, 1.0, len(value_columns))
    return value_columns - np.outer(line, line @ value_columns / (line @ line))


def estimate_tilt(
    vehicle: CutVehicle,
    hub_forces: HubForces,
    measured_angles: MeasuredAngles,
    stated_deviations: StatedDeviations,
    named_file: str = "",
) -> TiltEstimate:
    """Estimate roll and pitch from measured angles and hub forces by ``TiltFilter``. Raises InputError also where no
    angle was measured.
    """
    if len(hub_forces.samples) != len(measured_angles.samples):
        raise InputError(
            named_file,
            "angles",
            len(measured_angles.samples),
            f"must be as many samples as the forces', {len(hub_forces.samples)}",
        )
    if np.isnan(measured_angles.samples).all():
        raise InputError(named_file, "angles", None, "hold no number: there is nothing to follow")
    tilt_filter = TiltFilter(vehicle, hub_forces.frame, hub_forces.period, stated_deviations, named_file)
    states, spread = tilt_filter.advance(hub_forces.samples, measured_angles.samples)
    return TiltEstimate(states, spread, hub_forces.period, tilt_filter.normalised_innovation, tilt_filter.objections())


def _wrenches_in_tilted_axes(hub_wrenches: np.ndarray, tilt_angles: np.ndarray) -> np.ndarray:
    """Transform wrenches (m, 6 h) from axes fixed in space into axes turned by roll and pitch; angles (m, 2 or more) in
    rad.
    """
    (sr, sp), (cr, cp), zero = np.sin(tilt_angles[:, :2]).T, np.cos(tilt_angles[:, :2]).T, np.zeros(len(tilt_angles))
    rotation = np.array([[cp, sp * sr, sp * cr], [zero, cr, -sr], [-sp, cp * sr, cp * cr]])
    return np.einsum("mhi,ijm->mhj", hub_wrenches.reshape(len(hub_wrenches), -1, 3), rotation).reshape(
        hub_wrenches.shape
    )


def inputs_with_moments(
    hub_inputs: HubInputs,
    vehicle: CutVehicle,
    tilt_estimate: TiltEstimate,
    time_step: float,
    pull_bandwidth: float,
    damping_ratio: float = 0.7,
) -> HubInputs:
    """Returns hub inputs with moments that pull roll and pitch towards the filter's estimate. They act as spring and
    damper: natural angular frequency 2 pi times ``pull_bandwidth`` (Hz), damping ratio ``damping_ratio``, inertia of
    the rigid vehicle.
    """
    rows, corner = len(hub_inputs.hubs), 2 * math.pi * pull_bandwidth
    wanted = SampledSignal(tilt_estimate.states, tilt_estimate.period, held=False).sample(0.0, time_step / 2, rows)
    roll, pitch, _ = np.diag(rigid_vehicle(vehicle).inertia)
    pull = (roll * corner**2, 2 * damping_ratio * roll * corner, pitch * corner**2, 2 * damping_ratio * pitch * corner)
    return replace(hub_inputs, guide=np.hstack([wanted, np.zeros((rows, 2))]), pull=pull)
