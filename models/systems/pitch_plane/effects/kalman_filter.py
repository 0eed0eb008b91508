"""A moment that pulls the pitch towards a Kalman filter's estimate from measured angle and rate.

The filter runs before the simulation, on the scene's parameters and forces (``pitch_filter``), also across gaps of the
measurement. Two moments then act in the simulation. The first corrects the error of the model's inertia by the filter's
estimate: its share of the suspension's moment. The second pulls the pitch to the estimate,
(I + J) (wc^2 (estimate - pitch) + 2 zeta wc (its rate - pitch rate)) with J of the wheels, wc = 2 pi bandwidth: a
native rotational spring and damper, and a moment over time. So no estimate is differentiated, the forces stay
functions of time and state alone, and every engine gets the very same estimate.
"""

import math
import pickle
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from models.core.assumptions import Assumption, Watched
from models.core.errors import InputError
from models.core.result import Result
from models.core.signals import SampledSignal, Smooth
from models.core.steps import step_divides
from models.core.strict import Strict, quantity
from models.core.tables import RADIANS, RADIANS_PER_SECOND
from models.drift.growth import pitch_spring, rigid_pitch
from models.drift.innovations import FilterConsistency, consistency
from models.engines.assembly import Assembly, Channels
from models.systems.pitch_plane.sampling import check_end
from models.vehicles.description import PitchSpring

if TYPE_CHECKING:
    from models.systems.pitch_plane.pitch_filter import PitchEstimate, PitchMeasurement

NEEDS = ("wheel_forces",)
EXCLUDES = ("pitch_spring", "high_pass", "prescribed_pitch", "prescribed_heave_and_pitch")
AFTER = ("wheel_forces", "force_noise")
COST = "a filter over all samples before the run, about 0.1 ms each; one native spring-damper and one moment over time"
EXAMPLE = {"file": "pitch.csv", "force_deviation": 8.0, "pitch_deviation": 0.5}
COUNTS = {
    "exudyn": {"native items": 2, "callbacks": 1},
    "mujoco": {"native items": 1, "callbacks": 1},
    "all": {"channels": 10},
}

CHANNELS = (
    "kalman_moment",
    "inertia_moment",
    "pitch_estimate",
    "pitch_rate_estimate",
    "pitch_deviation",
    "pitch_rate_deviation",
    "inertia_share",
    "kalman_used",
    "kalman_missed",
    "kalman_surprise",
)


PULL_BANDWIDTH = 3.0
"""Default bandwidth (Hz) of the moment towards the estimate. It is above the filter's bandwidth, (q/r)^(1/4) = 1.2 Hz
at 0.2 % of force noise and an angle of 0.1 degree white at 1 kHz, so that the vehicle follows the filter's corrections.
It is not larger, as faster motion of the estimate is noise: the moment's rms grows from 0.4 % of I pitch'' at 3 Hz to
1.4 % at 8 Hz.
"""


INNOVATION_LIMIT = 4.0
"""Largest mean of the normalised innovation squared at which a run is made: errors twice as large as stated. A right
filter has 1; a filter that trusts a model with 5 % wrong inertia has 1.1 to 1.3."""


class Parameters(Strict):
    """[effects.kalman_filter]: measured pitch, pitch rate or both, deviation of the noise of each measured column,
    and bandwidth of the moment towards the estimate.
    """

    file: str = Field(
        description="CSV with the columns time [s] and pitch [rad] and/or pitch_rate [rad/s]; nose up; "
        "empty or nan where nothing was measured"
    )
    force_deviation: float = quantity("N", "standard deviation of the noise of each force sample")
    pitch_deviation: float | None = quantity("rad", "standard deviation of each measured pitch", default=None)
    rate_deviation: float | None = quantity("rad/s", "standard deviation of each measured pitch rate", default=None)
    start_deviation: float = quantity("rad", "standard deviation of the pitch at the start", default=0.0, zero=True)
    inertia_deviation: float = quantity(
        "",
        "standard deviation of the share by which the chassis' 1/I may be wrong; 0 trusts it",
        default=0.0,
        zero=True,
    )
    bandwidth: float = quantity("Hz", "of the moment that draws the vehicle to the estimate", default=PULL_BANDWIDTH)
    damping_ratio: float = quantity("", "of the same", default=0.7)
    smoother: bool = Field(False, description="use all measurements for every time, later ones too")


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the force-excited vehicle with a moment that pulls its pitch towards the filter's estimate."""
    guide = guide_of(vehicle_assembly, parameters)
    _check_innovations(vehicle_assembly, parameters, guide)
    _check_bandwidth(vehicle_assembly, parameters, guide)
    stiffness, damping = pitch_spring(vehicle_assembly.parameters, parameters.bandwidth, parameters.damping_ratio)
    moment = guide.values @ np.array([[stiffness], [damping]]) + guide.inertia_moment[:, None]
    sprung = vehicle_assembly.with_spring(PitchSpring("chassis", stiffness, damping))
    guided = sprung.with_moment(SampledSignal(moment, guide.period, held=False))
    return replace(
        guided,
        outputs=(*guided.outputs, partial(_guiding_channels, guide, stiffness, damping)),
        doubts=(*guided.doubts, *_filter_objections(parameters, guide)),
        assumptions=(*guided.assumptions, _innovation_assumption(guide)),
    )


@dataclass(frozen=True)
class GuidingEstimate:
    """Estimated pitch that a run follows, at n times ``period`` (s) apart.

    states : (n, 7), states of the filter (``models/systems/pitch_plane/pitch_filter.py``)
    values, deviations : (n, 2), estimated pitch and rate (rad, rad/s) and their standard deviations
    inertia : (n,), share by which 1/I is estimated above the model's; inertia_moment : (n,), moment (N m) that corrects
    this share
    used_values, missed_values : (n,), numbers of measured values used and missed until then
    innovation_sum : (n,), sum of the normalised innovations squared until then
    consistency : test of the filter by all innovations
    """

    period: float
    states: np.ndarray
    values: np.ndarray
    deviations: np.ndarray
    inertia: np.ndarray
    inertia_moment: np.ndarray
    used_values: np.ndarray
    missed_values: np.ndarray
    innovation_sum: np.ndarray
    consistency: FilterConsistency


_LATEST_GUIDE: dict[bytes, GuidingEstimate] = {}
"""Cache of the last estimate, by all inputs on which it depends: the check and the run in every engine use the same."""


def guide_of(vehicle_assembly: Assembly, filter_parameters: Parameters) -> GuidingEstimate:
    """Returns the estimated pitch that a force-excited assembly follows. Raises InputError for an unusable file, and
    RunFailed from the filter.
    """
    from models.systems.pitch_plane.pitch_filter import estimate_pitch

    measured, forces, p_vehicle = (
        _measurement(vehicle_assembly, filter_parameters),
        vehicle_assembly.input,
        vehicle_assembly.parameters,
    )
    assert isinstance(forces, SampledSignal | Smooth)
    signal = type(forces).__name__, forces.values, forces.period, forces.held
    kind = vehicle_assembly.mode, vehicle_assembly.vehicle.geometry, vehicle_assembly.scene.run.duration
    key = pickle.dumps((kind, p_vehicle.array(), vehicle_assembly.initial, signal, measured, filter_parameters))
    if key not in _LATEST_GUIDE:
        estimated = estimate_pitch(
            vehicle_assembly,
            measured,
            filter_parameters.force_deviation,
            start_deviation=filter_parameters.start_deviation,
            inertia_deviation=filter_parameters.inertia_deviation,
            with_smoother=filter_parameters.smoother,
        )
        _LATEST_GUIDE.clear()
        _LATEST_GUIDE[key] = _guiding_estimate(vehicle_assembly, estimated, measured)
    return _LATEST_GUIDE[key]


def _guiding_estimate(
    vehicle_assembly: Assembly, pitch_estimate: "PitchEstimate", pitch_measurement: "PitchMeasurement"
) -> GuidingEstimate:
    from models.systems.pitch_plane.pitch_filter import FILTERED_STATES, INERTIA_SHARE, PITCH, PITCH_RATE
    from models.vehicles.pitch_plane_equations import suspension_loads

    deviations = np.sqrt(pitch_estimate.error_covariances()[:, [PITCH, PITCH_RATE], [PITCH, PITCH_RATE]])
    share, names = pitch_estimate.states[:, INERTIA_SHARE], {PITCH: "pitch", PITCH_RATE: "pitch_rate"}
    relative = np.zeros((8, len(share)))
    relative[FILTERED_STATES] = pitch_estimate.states[:, :6].T
    moment = suspension_loads(relative, vehicle_assembly.parameters, vehicle_assembly.vehicle.geometry)[2]
    fits = consistency(pitch_estimate.innovations, [names[column] for column in pitch_measurement.columns])
    return GuidingEstimate(
        pitch_estimate.period,
        pitch_estimate.states,
        pitch_estimate.states[:, [PITCH, PITCH_RATE]],
        deviations,
        share,
        share * moment,
        np.cumsum(pitch_estimate.used_values),
        np.cumsum(pitch_estimate.missed_values),
        np.nancumsum(pitch_estimate.normalised_innovations),
        fits,
    )


def _measurement(vehicle_assembly: Assembly, filter_parameters: Parameters) -> "PitchMeasurement":
    """Reads the measured pitch and pitch rate of the file, with their standard deviations. Raises InputError for files
    that the filter cannot use.
    """
    from models.core.time_series import read_time_series
    from models.systems.pitch_plane.pitch_filter import PITCH, PITCH_RATE, PitchMeasurement

    scene, key_path = vehicle_assembly.scene, "effects.kalman_filter"
    known = (
        ("pitch", RADIANS, PITCH, filter_parameters.pitch_deviation),
        ("pitch_rate", RADIANS_PER_SECOND, PITCH_RATE, filter_parameters.rate_deviation),
    )
    read_columns = {name: (units, state, deviation) for name, units, state, deviation in known if deviation is not None}
    if not read_columns:
        raise InputError(
            scene.file, key_path, None, "needs pitch_deviation, rate_deviation or both: the columns to read"
        )
    path = scene.path(filter_parameters.file, f"{key_path}.file")
    values, period = read_time_series(
        path, {name: fields[0] for name, fields in read_columns.items()}, gaps_allowed=True
    )
    for name, column in zip(read_columns, values.T, strict=True):
        if not np.isfinite(column).any():
            raise InputError(path, f"column {name!r}", None, "holds no number at all: leave its deviation out")
    check_end(scene, f"{key_path}.file", filter_parameters.file, len(values) * period)
    assert vehicle_assembly.input is not None and vehicle_assembly.input.period is not None
    if not step_divides(*sorted((period, vehicle_assembly.input.period))):
        raise InputError(
            scene.file,
            f"{key_path}.file",
            filter_parameters.file,
            f"is sampled every {period:g} s and the forces every {vehicle_assembly.input.period:g} s: one must be "
            "a multiple of the other",
        )
    return PitchMeasurement(
        values,
        period,
        tuple(fields[1] for fields in read_columns.values()),
        tuple(fields[2] for fields in read_columns.values()),
    )


def _check_innovations(
    vehicle_assembly: Assembly, filter_parameters: Parameters, guiding_estimate: GuidingEstimate
) -> None:
    """Raise InputError where the measurement contradicts wheel forces or model: the mean normalised innovation squared
    is above INNOVATION_LIMIT.
    """
    mean = float(guiding_estimate.innovation_sum[-1] / max(guiding_estimate.used_values[-1], 1))
    if mean > INNOVATION_LIMIT:
        raise InputError(
            vehicle_assembly.scene.file,
            "effects.kalman_filter",
            None,
            f"{filter_parameters.file} contradicts forces and model: the squares of the innovations are {mean:.3g} "
            f"times what the deviations allow (at most {INNOVATION_LIMIT:g}): check sign and unit, or state larger "
            "ones",
        )


def _filter_objections(filter_parameters: Parameters, guiding_estimate: GuidingEstimate) -> tuple[str, ...]:
    """Objections to the measurement or the model, as text, where the filter's innovations are not consistent."""
    if guiding_estimate.consistency.is_consistent:
        return ()
    square = guiding_estimate.consistency.statistics[0]
    largest = guiding_estimate.deviations[:, 0].max()
    known = f"the stated deviation of the pitch, up to {largest:.2g} rad, is not to be relied upon"
    remedy = (
        "the stated deviations are too large: state smaller ones"
        if square.value < square.lower_limit
        else f"check {filter_parameters.file} for a bias, a delay and its unit, the inertia, and the stated deviations"
    )
    return (f"the filter contradicts {filter_parameters.file}: {guiding_estimate.consistency}; {known}; {remedy}",)


def _innovation_assumption(guiding_estimate: GuidingEstimate) -> Assumption:
    """Assumption that the statistics of the innovations are those of a correctly tuned filter."""
    return Assumption(
        "innovations",
        "the filter's innovations are as its model and deviations make them",
        "correct the measured pitch (bias, delay, unit) or the inertia, or state deviations that are true",
        partial(_positions_in_intervals, guiding_estimate.consistency),
        "half widths of a right filter's band",
        -1.0,
        1.0,
    )


def _positions_in_intervals(innovation_statistics: FilterConsistency, run_result: Result) -> Watched:
    """Position of each statistic of the innovations in its interval, from -1 at the lower end to 1 at the upper end."""
    return {
        f.name: np.array([(2.0 * f.value - f.lower_limit - f.upper_limit) / (f.upper_limit - f.lower_limit)])
        for f in innovation_statistics.statistics
    }


def _check_bandwidth(
    vehicle_assembly: Assembly, filter_parameters: Parameters, guiding_estimate: GuidingEstimate
) -> None:
    """Raise InputError for a bandwidth at which the moment acts more slowly than the pitch diverges. Only forces that
    stay vertical make it diverge.
    """
    if vehicle_assembly.mode != "force" or vehicle_assembly.vehicle.geometry != "exact":
        return
    share = math.sqrt(vehicle_assembly.parameters.I / rigid_pitch(vehicle_assembly.parameters).total_inertia)
    growth = share * float(np.sqrt(np.mean(guiding_estimate.values[:, 1] ** 2)))
    if 2 * math.pi * filter_parameters.bandwidth <= growth:
        raise InputError(
            vehicle_assembly.scene.file,
            "effects.kalman_filter.bandwidth",
            filter_parameters.bandwidth,
            f"must be above {growth / (2 * math.pi):.3g} Hz: a pitch error grows at {growth:.3g} 1/s here",
        )


def _guiding_channels(
    guiding_estimate: GuidingEstimate,
    pull_stiffness: float,
    pull_damping: float,
    vehicle_assembly: Assembly,
    times: np.ndarray,
    states: np.ndarray,
) -> Channels:
    """Channels of the moments towards the estimate, and of the estimate, at times (n,) in s of a run with states
    (n, 8).
    """
    grid = guiding_estimate.period * np.arange(len(guiding_estimate.values))
    pitch, rate, pitch_deviation, rate_deviation, inertia, lacking = (
        np.interp(times, grid, column)
        for column in (
            *guiding_estimate.values.T,
            *guiding_estimate.deviations.T,
            guiding_estimate.inertia,
            guiding_estimate.inertia_moment,
        )
    )
    latest = np.clip(np.floor(times / guiding_estimate.period + 1e-6).astype(int), 0, len(grid) - 1)
    moment = pull_stiffness * (pitch - states[:, 3]) + pull_damping * (rate - states[:, 7])
    return {
        "kalman_moment": ("N m", "artificial moment towards the estimated pitch, nose up", moment),
        "inertia_moment": ("N m", "artificial moment that the model's inertia lacks, nose up", lacking),
        "pitch_estimate": ("rad", "estimated pitch, nose up", pitch),
        "pitch_rate_estimate": ("rad/s", "estimated rate of pitch, nose up", rate),
        "pitch_deviation": ("rad", "standard deviation of the estimated pitch", pitch_deviation),
        "pitch_rate_deviation": ("rad/s", "standard deviation of its estimated rate", rate_deviation),
        "inertia_share": ("", "share by which 1/I of the chassis is estimated to exceed the scene's", inertia),
        "kalman_used": (
            "",
            "measured values that the filter has taken in so far",
            guiding_estimate.used_values[latest],
        ),
        "kalman_missed": ("", "measured values so far that were no numbers", guiding_estimate.missed_values[latest]),
        "kalman_surprise": (
            "",
            "sum of the normalised innovations squared so far",
            guiding_estimate.innovation_sum[latest],
        ),
    }
