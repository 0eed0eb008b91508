"""Verdict on a recording's run (accepted, rejected, or to be stabilised first) with its reason, and comparison of
measured channels with the run.

The concept is that of the pitch plane (``models.drift.score``), with roll and pitch: the artificial moment divided by
the inertia term (inertia of the rigid vehicle times the chassis' angular acceleration), the size of the angles, and
their uncertainty. A true run, which only a virtual measurement has, adds damage and angle errors. Measured channels
that are no inputs are compared with the run: error by frequency, damage, time of trust. A channel that disagrees
rejects the run, whatever its other figures are.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.core.finding import Finding
from models.drift import score
from models.drift.score import (
    DOUBTFUL_INNOVATION_LIMIT,
    AcceptanceLimits,
    RunErrors,
    RunFigures,
    StabilisedRunVerdict,
    low_pass,
    root_mean_square,
)
from models.fatigue.damage import WOEHLER_SLOPE, damage_ratio, pseudo_damage
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal
from models.systems.measured.section_run import PULL_DAMPING, AttitudeHold, SectionOutcome, SectionRunSettings
from models.systems.measured.sections import SectionChannel
from models.systems.measured.virtual import VirtualMeasurement
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, Z, rigid_vehicle

RUN_LIMITS = AcceptanceLimits(artificial_share=0.1)
"""Default limits of the verdict. A stabilising moment of 5 Hz, which is 12 % of the inertia term, takes 5 %
off the damage of engine mounts on a rough road; a moment of 0.7 Hz is 2 % of that term and takes 1 % off.
"""
LARGEST_DISAGREEMENT = 0.15
"""Largest rms error of a check channel divided by its rms, both without means and known noise: a gain wrong by 5 % and
a delay of 2 ms at 10 Hz together stay below it.
"""
LARGEST_NOISE_SHARE = 1 / 3
"""Largest noise of a check channel divided by its rms; a noisier channel is not compared."""
FREQUENCY_BANDS = (0.0, 0.5, 4.0, 20.0, 80.0, math.inf)
"""Bounds (Hz) of the frequency bands: drift and slow motion, body on its springs, wheels and engine, stiff mounts,
above.
"""
SEGMENT_LENGTH = 8.0
"""Length (s) of the segments whose spectra are averaged."""
STRETCH_LENGTH, STRETCH_ERROR_LIMIT = 1.0, 0.5
"""Length (s) of a stretch of a channel, and the rms error divided by the channel's rms above which a stretch is not
trusted.
"""
WORDS_FOR_SPATIAL_VEHICLE = {
    "I pitch''": "what turns the chassis",
    "the measured pitch": "measured roll and pitch",
    "pitch wrong": "roll or pitch wrong",
    "pitch known": "roll or pitch known",
    "pitch of": "roll or pitch of",
}
"""Words of verdicts on the pitch plane (``models.drift.score``), and the words for a spatial vehicle."""
EFFECTS_OF_STABILISER = {"kalman": {"kalman_filter"}, "prescribed": {"prescribed_pitch"}, "none": set[str]()}
"""Names that ``models.drift.score`` uses for each stabiliser method."""


@dataclass(frozen=True)
class FrequencyBand:
    """A frequency band from ``low`` to ``high`` (Hz), with the rms of the measured values and the rms of the error in
    this band, in the channel's unit.
    """

    low: float
    high: float
    measured: float
    error: float


@dataclass(frozen=True)
class ChannelComparison:
    """Comparison of a measured check channel with the run.

    offset : mean of the error; bands : rms without means by frequency band; explained_variance : share of the measured
    variance that the run explains, 1 at best; damage : damage of the run divided by that of the channel, by slope, NaN
    where the channel never moves; trusted_time : time (s) until the error of a stretch of ``STRETCH_LENGTH`` s exceeds
    ``STRETCH_ERROR_LIMIT`` of the channel's rms, infinite if never.
    """

    signal: MeasuredSignal
    answer: SectionChannel
    offset: float
    bands: tuple[FrequencyBand, ...]
    explained_variance: float
    damage: dict[float, float]
    trusted_time: float


def channels_to_compare(run_settings: SectionRunSettings) -> tuple[tuple[MeasuredSignal, SectionChannel], ...]:
    """Returns pairs of a measured signal and the run's channel of the same quantity, for check signals and
    accelerations.

    The run has no channel for strains and for sensors of unknown place.
    """
    outside = [s for s in run_settings.recording.signals if s.check or s.quantity == "acceleration"]
    return tuple(
        (s, a) for s in outside if _same_axes(run_settings, s) for a in run_settings.sections.answers if a.measures(s)
    )


def _same_axes(run_settings: SectionRunSettings, signal: MeasuredSignal) -> bool:
    """Whether the run computes a signal's quantity in the axes of the signal."""
    if signal.at in run_settings.vehicle.hubs and signal.quantity in ("force", "moment"):
        return signal.frame == run_settings.sections.frame
    return signal.frame != "inertial" or signal.quantity == "angle"


def paired_channels(
    recording: Recording, run_outcome: SectionOutcome, signal: MeasuredSignal, section_channel: SectionChannel
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns times (n,) in s of a run, and measured and computed values (n,) of a channel."""
    computed, skip = run_outcome.samples(section_channel), round(run_outcome.period / recording.period)
    measured = recording.columns.read(signal.name, 0, (len(computed) - 1) * skip + 1)[::skip]
    return run_outcome.period * np.arange(len(computed)), measured, computed


def compare_channel(
    recording: Recording,
    run_outcome: SectionOutcome,
    signal: MeasuredSignal,
    section_channel: SectionChannel,
    woehler_exponents: tuple[float, ...] = (3.0, 5.0, 8.0),
) -> ChannelComparison:
    """Compare a measured signal with the run's channel over the time of the run; woehler_exponents : Woehler
    exponents.
    """
    _, measured, computed = paired_channels(recording, run_outcome, signal, section_channel)
    known = np.isfinite(measured)
    if not known.any():
        return ChannelComparison(
            signal, section_channel, math.nan, (), math.nan, dict.fromkeys(woehler_exponents, math.nan), math.inf
        )
    error, size = computed - measured, float(np.std(measured[known]))
    offset, true = (
        float(np.mean(error[known])),
        {slope: pseudo_damage(measured[known], slope) for slope in woehler_exponents},
    )
    return ChannelComparison(
        signal,
        section_channel,
        offset,
        _rms_by_band(measured, error, run_outcome.period),
        1.0 - float(np.var(error[known])) / size**2 if size > 0 else math.nan,
        {
            slope: pseudo_damage(computed[known], slope) / damage if damage > 0 else math.nan
            for slope, damage in true.items()
        },
        _trusted_time(error - offset, size, run_outcome.period),
    )


def _rms_by_band(
    measured_values: np.ndarray, error_values: np.ndarray, sample_period: float
) -> tuple[FrequencyBand, ...]:
    """Rms of measured values and of errors by frequency band, from averaged spectra of overlapping segments under a
    Hann window. Segments with gaps are left out.
    """
    length = min(round(SEGMENT_LENGTH / sample_period), len(error_values))
    window = np.hanning(length + 1)[:-1]
    power, used = np.zeros((2, length // 2 + 1)), 0
    for first in range(0, len(error_values) - length + 1, max(length // 2, 1)):
        both = np.stack([each[first : first + length] for each in (measured_values, error_values)])
        if np.isfinite(both).all():
            power += np.abs(np.fft.rfft((both - both.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
            used += 1
    if used == 0:
        return ()
    power *= 2.0 / (used * length * np.sum(window**2))  # mean squares, from both halves of the spectrum
    frequencies, bands = np.fft.rfftfreq(length, sample_period), []
    for low, high in pairwise(FREQUENCY_BANDS):
        inside = (frequencies >= low) & (frequencies < high)
        if inside.any():
            bands.append(FrequencyBand(low, min(high, 0.5 / sample_period), *np.sqrt(power[:, inside].sum(axis=1))))
    return tuple(bands)


def _trusted_time(error_values: np.ndarray, signal_size: float, sample_period: float) -> float:
    """Time (s) of the first stretch whose rms error exceeds ``STRETCH_ERROR_LIMIT`` of ``signal_size``; infinite if
    there is none.
    """
    length = max(round(STRETCH_LENGTH / sample_period), 1)
    whole = error_values[: len(error_values) // length * length].reshape(-1, length)
    rms = np.sqrt(np.nanmean(np.where(np.isfinite(whole), whole, 0.0) ** 2, axis=1))
    beyond = np.flatnonzero(rms > STRETCH_ERROR_LIMIT * signal_size)
    return float(beyond[0] * length * sample_period) if len(beyond) else math.inf


def judge_run(
    run_settings: SectionRunSettings,
    run_outcome: SectionOutcome,
    verdict_limits: AcceptanceLimits = RUN_LIMITS,
    trusted_time: float | None = None,
    channel_comparisons: Sequence[ChannelComparison] = (),
    noise_by_quantity: Mapping[str, float] | None = None,
) -> StabilisedRunVerdict:
    """Judge a recording's run without knowledge of the true run.

    trusted_time : predicted time (s) for which a free run can be trusted, None if not known; channel_comparisons :
    comparisons of check channels with the run; noise_by_quantity : standard deviation of the white noise of each
    channel, by name, in SI.
    """
    shares = {
        channel.signal.name: channel_disagreement(channel, (noise_by_quantity or {}).get(channel.signal.name, 0.0))
        for channel in channel_comparisons
    }
    off = {name: share for name, share in shares.items() if not share <= LARGEST_DISAGREEMENT}
    if off:
        told = ", ".join(f"{name} by {share:.0%}" for name, share in off.items())
        return StabilisedRunVerdict(
            "rejected", f"channels that were not put in disagree (at most {LARGEST_DISAGREEMENT:.0%}): {told}"
        )
    verdict = score.verdict_without_true_run(
        figures_of_run(run_outcome, run_settings.vehicle),
        EFFECTS_OF_STABILISER[run_settings.hold.method],
        run_outcome.period * (run_outcome.done - 1),
        verdict_limits,
        trusted_time,
        pitch_uncertainty=angle_uncertainty(run_settings.vehicle, run_settings.hold, run_settings.recording.period),
    )
    return _worded_for_spatial_vehicle(verdict)


def filter_doubts(run_outcome: SectionOutcome) -> tuple[Finding, ...]:
    """Returns doubts where the innovations of the stabiliser's filter are too large, or biased."""
    if not run_outcome.normalised_innovation > DOUBTFUL_INNOVATION_LIMIT:
        return tuple(
            Finding("filter", "doubt", "recording", f"{text[0].upper()}{text[1:]}.")
            for text in run_outcome.filter_objections
        )
    text = (
        f"The filter's innovations squared are {run_outcome.normalised_innovation:.3g} times what the noise of "
        "forces and angles "
        "allows: a channel is off by a little (gain, offset, delay, a spike, a held value, a load that is not in "
        "the vehicle file), and forces along the vehicle, which small angles make, may be wrong by much."
    )
    return (Finding("filter", "doubt", "recording", text, run_outcome.normalised_innovation, "1"),)


def judge_beside_truth(
    run_outcome: SectionOutcome,
    true_measurement: VirtualMeasurement,
    attitude_hold: AttitudeHold,
    verdict_limits: AcceptanceLimits = RUN_LIMITS,
    woehler_exponent: float = WOEHLER_SLOPE,
) -> StabilisedRunVerdict:
    """Judge a run on a virtual measurement by comparison with the true run; woehler_exponent : Woehler exponent."""
    figures = (
        figures_of_run(run_outcome, true_measurement.vehicle),
        errors_of_run(run_outcome, true_measurement, woehler_exponent),
    )
    return _worded_for_spatial_vehicle(
        score.verdict_on_run(*figures, EFFECTS_OF_STABILISER[attitude_hold.method], verdict_limits)
    )


def _worded_for_spatial_vehicle(verdict: StabilisedRunVerdict) -> StabilisedRunVerdict:
    """Returns the verdict with words for the pitch plane replaced by words for a spatial vehicle."""
    reason = verdict.reason
    for plane, space in WORDS_FOR_SPATIAL_VEHICLE.items():
        reason = reason.replace(plane, space)
    return StabilisedRunVerdict(verdict.word, reason)


def figures_of_run(run_outcome: SectionOutcome, vehicle: CutVehicle) -> RunFigures:
    """Figures of a run that need no true run (stabilising moment, its share, tilt), for roll or pitch, whichever is
    worse; costs are 0.
    """
    inertia, chassis = np.diag(rigid_vehicle(vehicle).inertia), vehicle.chassis
    tilt = max(float(np.abs(run_outcome.samples(f"{chassis} {name}")).max()) for name in ("roll", "pitch"))
    figures = list[RunFigures]()
    for i, name in enumerate(("roll", "pitch")):
        moment, rate = run_outcome.samples(f"stabiliser {name}"), run_outcome.samples(f"{chassis} {name} rate")
        moment, turning = 0.5 * (moment[1:] + moment[:-1]), inertia[i] * np.diff(rate) / run_outcome.period
        shares = (
            _rms_ratio(moment, turning),
            _rms_ratio(low_pass(moment, run_outcome.period), low_pass(turning, run_outcome.period)),
        )
        figures.append(RunFigures(root_mean_square(moment), float(np.abs(moment).max()), *shares, 0.0, tilt, 0.0, 0, 0))
    return max(figures, key=lambda each: each.moment_share_band)


def _rms_ratio(part_values: np.ndarray, total_values: np.ndarray) -> float:
    """Root mean square of some values divided by that of all; 1 or 0 where all of them are 0."""
    return (
        root_mean_square(part_values) / root_mean_square(total_values)
        if root_mean_square(total_values) > 0
        else float(root_mean_square(part_values) > 0)
    )


def angle_uncertainty(vehicle: CutVehicle, attitude_hold: AttitudeHold, sample_period: float) -> float:
    """Twice the standard deviation (rad) of roll or pitch in a stabilised run; 0 for a free run.

    A moment I (w^2 (measured - angle) + 2 z w (measured rate - rate)) passes white noise of the angle with the factor
    period w / (4 z) on its variance, noise of the rate with period z / w, and noise of the hub forces' moments, as
    acceleration, with period / (4 z w^3). A filter before it can only reduce this. An enforced angle has the noise of
    its low-pass, 2 x bandwidth x period of its variance. At the start, which is as measured, the noise is larger.
    """
    if attitude_hold.method == "none":
        return 0.0
    if attitude_hold.method == "prescribed":
        return 2.0 * attitude_hold.angle * math.sqrt(min(2.0 * attitude_hold.smoothing * sample_period, 1.0))
    corner = 2.0 * math.pi * attitude_hold.bandwidth
    pushed = np.diag(
        rigid_vehicle(vehicle).turning(
            np.tile(np.repeat([attitude_hold.force, attitude_hold.moment], 3), len(vehicle.hubs))
        )
    )[:2]
    each = (
        attitude_hold.angle**2 * corner / (4 * PULL_DAMPING)
        + attitude_hold.rate**2 * PULL_DAMPING / corner
        + float(pushed.max()) / (4 * PULL_DAMPING * corner**3)
    )
    return 2.0 * math.sqrt(sample_period * each)


def errors_of_run(
    run_outcome: SectionOutcome, true_measurement: VirtualMeasurement, woehler_exponent: float = WOEHLER_SLOPE
) -> RunErrors:
    """Errors of a run relative to the true run, at the times of the run's answers: of section forces in springs, mounts
    and bars, and of angles.
    """
    every, chassis = round(run_outcome.period / true_measurement.step), true_measurement.vehicle.chassis
    loads, states = (
        true_measurement.run.elements[::every][: run_outcome.done],
        true_measurement.run.states[::every][: run_outcome.done],
    )
    damage, force = dict[str, float](), dict[str, float]()
    for element, load in zip(true_measurement.vehicle.elements, loads.T, strict=True):
        computed = run_outcome.samples(f"{element.name} {'M' if element.unit != 'N' else 'F'}")
        damage[element.name] = damage_ratio(computed, load, woehler_exponent)
        force[element.name] = root_mean_square(computed - load)
    roll, pitch, height = (
        np.abs(run_outcome.samples(f"{chassis} {name}") - states[:, i])
        for name, i in (("roll", ROLL), ("pitch", PITCH), ("z", Z))
    )
    tilt = np.maximum(roll, pitch)
    return RunErrors(damage, force, {}, float(tilt.max()), root_mean_square(tilt), float(height.max()))


def channel_disagreement(compared_channel: ChannelComparison, noise_deviation: float = 0.0) -> float:
    """Rms error of a check channel divided by the channel's rms, after its noise (standard deviation) is removed from
    both.

    0 for a channel that is more than a third noise, as it cannot contradict the run. Unknown noise, NaN, counts as 0.
    """
    noise_deviation = 0.0 if math.isnan(noise_deviation) else noise_deviation
    error, whole = (sum(getattr(band, name) ** 2 for band in compared_channel.bands) for name in ("error", "measured"))
    if whole <= 0.0 or noise_deviation > LARGEST_NOISE_SHARE * math.sqrt(whole):
        return 0.0
    return math.sqrt(max(error - noise_deviation**2, 0.0) / (whole - noise_deviation**2))
