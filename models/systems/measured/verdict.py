"""Verdict on a recording's run: accepted, rejected, or to be stabilised first, with the threshold that says so.

A measured channel that was not put in is held beside what the run says of it: error by frequency, damage, trust.

The concept is that of the pitch plane (``models.drift.score``), with both angles of a vehicle in space: the artificial
moment by what turns the chassis, the angles, and what the measurement leaves unknown of them. A true run, which only a
virtual measurement has, adds damage and angle errors. Channels that were measured but not put in are compared with
what the run says of them; one that disagrees rejects the run, whatever its own figures are.
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
    Limits,
    RunErrors,
    RunFigures,
    Verdict,
    low_pass,
    root_mean_square,
)
from models.fatigue.damage import WOEHLER_SLOPE, damage_ratio, pseudo_damage
from models.measured.recording import Recording
from models.measured.signal import Signal
from models.systems.measured.section_run import PULL_DAMPING, AttitudeHold, SectionOutcome, SectionRun
from models.systems.measured.sections import SectionChannel
from models.systems.measured.virtual import VirtualMeasurement
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, Z, rigid_vehicle

RUN_LIMITS = Limits(artificial_share=0.1)
"""From where on a run is not good enough. A pull of 5 Hz, whose moment is 12 % of what turns the chassis, takes 5 % off
the damage of engine mounts on a rough road; one of 0.7 Hz 2 % of it and 1 %."""
LARGEST_DISAGREEMENT = 0.15
"""Rms of the error of a check channel by its own, both without means and without what is known to be noise: a gain
wrong by 5 % and a delay of 2 ms at 10 Hz together stay below it."""
LARGEST_NOISE_SHARE = 1 / 3
"""Part of a check channel that may be noise."""
FREQUENCY_BANDS = (0.0, 0.5, 4.0, 20.0, 80.0, math.inf)
"""Hz: drift and slow motion, the body on its springs, wheels and engine, what stiff mounts pass on, the rest."""
SEGMENT_LENGTH = 8.0
"""s, of the stretches whose spectra are averaged."""
STRETCH_LENGTH, STRETCH_ERROR_LIMIT = 1.0, 0.5
"""s; part of a channel's own rms: a stretch this long with a larger error is not to be trusted."""
WORDS_OF_SCORE = {
    "I pitch''": "what turns the chassis",
    "the measured pitch": "measured roll and pitch",
    "pitch wrong": "roll or pitch wrong",
    "pitch known": "roll or pitch known",
    "pitch of": "roll or pitch of",
}
"""What ``score`` says of the pitch plane, and what it means here."""
EFFECTS_OF_HOLD = {"kalman": {"kalman_filter"}, "prescribed": {"prescribed_pitch"}, "none": set[str]()}
"""Methods of holding a run, by the names that ``score`` has for them."""


@dataclass(frozen=True)
class Band:
    """A frequency band from ``low`` to ``high`` (Hz), with the rms of the measured values and of the error in it, in
    the channel's unit.
    """

    low: float
    high: float
    measured: float
    error: float


@dataclass(frozen=True)
class ChannelComparison:
    """Comparison of one check channel with the run.

    offset : mean of the error; bands : of all but that; explained_variance : part of the measured variance that the run
    gives, 1 at best; damage : of the run divided by that of the channel, by slope, NaN where the channel never moves;
    trusted_time : s until the error of a stretch of ``STRETCH_LENGTH`` s exceeds ``STRETCH_ERROR_LIMIT`` of the
    channel's rms, infinite if never.
    """

    signal: Signal
    answer: SectionChannel
    offset: float
    bands: tuple[Band, ...]
    explained_variance: float
    damage: dict[float, float]
    trusted_time: float


def channels_to_compare(job: SectionRun) -> tuple[tuple[Signal, SectionChannel], ...]:
    """Every measured channel that the run is compared with, and the run's channel for it: channels named as checks, and
    accelerations.

    The run has none for strains and for sensors of unknown place.
    """
    outside = [s for s in job.recording.signals if s.check or s.quantity == "acceleration"]
    return tuple((s, a) for s in outside if _same_axes(job, s) for a in job.sections.answers if a.measures(s))


def _same_axes(job: SectionRun, signal: Signal) -> bool:
    """Whether the run computes a signal's quantity in the axes of the signal."""
    if signal.at in job.vehicle.hubs and signal.quantity in ("force", "moment"):
        return signal.frame == job.sections.frame
    return signal.frame != "inertial" or signal.quantity == "angle"


def paired_channels(
    recording: Recording, run: SectionOutcome, signal: Signal, answer: SectionChannel
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) in s of a run, and the measured and the computed values (n,) of one channel."""
    computed, skip = run.samples(answer), round(run.period / recording.period)
    measured = recording.columns.read(signal.name, 0, (len(computed) - 1) * skip + 1)[::skip]
    return run.period * np.arange(len(computed)), measured, computed


def compare(
    recording: Recording,
    run: SectionOutcome,
    signal: Signal,
    answer: SectionChannel,
    slopes: tuple[float, ...] = (3.0, 5.0, 8.0),
) -> ChannelComparison:
    """Compare a measured channel with the run's channel over the time of the run."""
    _, measured, computed = paired_channels(recording, run, signal, answer)
    known = np.isfinite(measured)
    if not known.any():
        return ChannelComparison(signal, answer, math.nan, (), math.nan, dict.fromkeys(slopes, math.nan), math.inf)
    error, size = computed - measured, float(np.std(measured[known]))
    offset, true = float(np.mean(error[known])), {slope: pseudo_damage(measured[known], slope) for slope in slopes}
    return ChannelComparison(
        signal,
        answer,
        offset,
        _rms_by_band(measured, error, run.period),
        1.0 - float(np.var(error[known])) / size**2 if size > 0 else math.nan,
        {
            slope: pseudo_damage(computed[known], slope) / damage if damage > 0 else math.nan
            for slope, damage in true.items()
        },
        _trusted_time(error - offset, size, run.period),
    )


def _rms_by_band(measured: np.ndarray, error: np.ndarray, period: float) -> tuple[Band, ...]:
    """Rms of the measured values and of the error by frequency band, from averaged spectra of overlapping segments
    under a Hann window. Segments with gaps are left out.
    """
    length = min(round(SEGMENT_LENGTH / period), len(error))
    window = np.hanning(length + 1)[:-1]
    power, used = np.zeros((2, length // 2 + 1)), 0
    for first in range(0, len(error) - length + 1, max(length // 2, 1)):
        both = np.stack([each[first : first + length] for each in (measured, error)])
        if np.isfinite(both).all():
            power += np.abs(np.fft.rfft((both - both.mean(axis=1, keepdims=True)) * window, axis=1)) ** 2
            used += 1
    if used == 0:
        return ()
    power *= 2.0 / (used * length * np.sum(window**2))  # mean squares, from both halves of the spectrum
    frequencies, bands = np.fft.rfftfreq(length, period), []
    for low, high in pairwise(FREQUENCY_BANDS):
        inside = (frequencies >= low) & (frequencies < high)
        if inside.any():
            bands.append(Band(low, min(high, 0.5 / period), *np.sqrt(power[:, inside].sum(axis=1))))
    return tuple(bands)


def _trusted_time(error: np.ndarray, size: float, period: float) -> float:
    """Time (s) at which the rms error of a stretch first exceeds ``STRETCH_ERROR_LIMIT`` of ``size``; infinite if it
    never does.
    """
    length = max(round(STRETCH_LENGTH / period), 1)
    whole = error[: len(error) // length * length].reshape(-1, length)
    rms = np.sqrt(np.nanmean(np.where(np.isfinite(whole), whole, 0.0) ** 2, axis=1))
    beyond = np.flatnonzero(rms > STRETCH_ERROR_LIMIT * size)
    return float(beyond[0] * length * period) if len(beyond) else math.inf


def judge(
    job: SectionRun,
    run: SectionOutcome,
    limits: Limits = RUN_LIMITS,
    trusted: float | None = None,
    compared: Sequence[ChannelComparison] = (),
    noise: Mapping[str, float] | None = None,
) -> Verdict:
    """The verdict on the run of a job that an engineer can give without knowing the true run.

    trusted : time (s) predicted for a free run (``trust``), None if not known. compared : comparisons of check channels
    with the run; noise : standard deviation of the white noise of each channel, by name, in SI.
    """
    shares = {
        channel.signal.name: disagreement(channel, (noise or {}).get(channel.signal.name, 0.0)) for channel in compared
    }
    off = {name: share for name, share in shares.items() if not share <= LARGEST_DISAGREEMENT}
    if off:
        told = ", ".join(f"{name} by {share:.0%}" for name, share in off.items())
        return Verdict(
            "rejected", f"channels that were not put in disagree (at most {LARGEST_DISAGREEMENT:.0%}): {told}"
        )
    verdict = score.blind_verdict(
        figures_of_run(run, job.vehicle),
        EFFECTS_OF_HOLD[job.hold.method],
        run.period * (run.done - 1),
        limits,
        trusted,
        uncertainty=uncertainty(job.vehicle, job.hold, job.recording.period),
    )
    return _in_space(verdict)


def filter_doubts(run: SectionOutcome) -> tuple[Finding, ...]:
    """Doubts because the innovations of the filter that held a run are too large, or because it calls measurements
    biased.
    """
    if not run.normalised_innovation > DOUBTFUL_INNOVATION_LIMIT:
        return tuple(
            Finding("filter", "doubt", "recording", f"{text[0].upper()}{text[1:]}.") for text in run.filter_objections
        )
    text = (
        f"The filter's innovations squared are {run.normalised_innovation:.3g} times what the noise of "
        "forces and angles "
        "allows: a channel is off by a little (gain, offset, delay, a spike, a held value, a load that is not in "
        "the vehicle file), and forces along the vehicle, which small angles make, may be wrong by much."
    )
    return (Finding("filter", "doubt", "recording", text, run.normalised_innovation, "1"),)


def judge_beside_truth(
    run: SectionOutcome,
    true: VirtualMeasurement,
    hold: AttitudeHold,
    limits: Limits = RUN_LIMITS,
    slope: float = WOEHLER_SLOPE,
) -> Verdict:
    """The verdict on a run of a virtual measurement, from its comparison with the true run."""
    figures = figures_of_run(run, true.vehicle), errors_of_run(run, true, slope)
    return _in_space(score.verdict_on_run(*figures, EFFECTS_OF_HOLD[hold.method], limits))


def _in_space(verdict: Verdict) -> Verdict:
    """The verdict with the words for the pitch plane replaced by those for a vehicle that also rolls."""
    reason = verdict.reason
    for plane, space in WORDS_OF_SCORE.items():
        reason = reason.replace(plane, space)
    return Verdict(verdict.word, reason)


def figures_of_run(run: SectionOutcome, vehicle: CutVehicle) -> RunFigures:
    """Figures of a run that need no true run, for roll or pitch, whichever is worse; the cost is left at 0."""
    inertia, chassis = np.diag(rigid_vehicle(vehicle).inertia), vehicle.chassis
    tilt = max(float(np.abs(run.samples(f"{chassis} {name}")).max()) for name in ("roll", "pitch"))
    figures = list[RunFigures]()
    for i, name in enumerate(("roll", "pitch")):
        moment, rate = run.samples(f"stabiliser {name}"), run.samples(f"{chassis} {name} rate")
        moment, turning = 0.5 * (moment[1:] + moment[:-1]), inertia[i] * np.diff(rate) / run.period
        shares = _rms_ratio(moment, turning), _rms_ratio(low_pass(moment, run.period), low_pass(turning, run.period))
        figures.append(RunFigures(root_mean_square(moment), float(np.abs(moment).max()), *shares, 0.0, tilt, 0.0, 0, 0))
    return max(figures, key=lambda each: each.moment_share_band)


def _rms_ratio(values: np.ndarray, total: np.ndarray) -> float:
    return (
        root_mean_square(values) / root_mean_square(total)
        if root_mean_square(total) > 0
        else float(root_mean_square(values) > 0)
    )


def uncertainty(vehicle: CutVehicle, hold: AttitudeHold, period: float) -> float:
    """Twice the standard deviation (rad) of roll or pitch in a run where they are held; 0 for a free run.

    A moment I (w^2 (measured - angle) + 2 z w (measured rate - rate)) lets white noise of the angle through with
    period w / (4 z) of its variance, that of the rate with period z / w, and that of the hub forces' moments, as
    acceleration, with period / (4 z w^3). A filter before it can only leave less. An angle that is enforced has the
    noise of its low-pass, 2 x bandwidth x period of its variance. At the start, which is as measured, it is more.
    """
    if hold.method == "none":
        return 0.0
    if hold.method == "prescribed":
        return 2.0 * hold.angle * math.sqrt(min(2.0 * hold.smoothing * period, 1.0))
    corner = 2.0 * math.pi * hold.bandwidth
    pushed = np.diag(
        rigid_vehicle(vehicle).turning(np.tile(np.repeat([hold.force, hold.moment], 3), len(vehicle.hubs)))
    )[:2]
    each = (
        hold.angle**2 * corner / (4 * PULL_DAMPING)
        + hold.rate**2 * PULL_DAMPING / corner
        + float(pushed.max()) / (4 * PULL_DAMPING * corner**3)
    )
    return 2.0 * math.sqrt(period * each)


def errors_of_run(run: SectionOutcome, true: VirtualMeasurement, slope: float = WOEHLER_SLOPE) -> RunErrors:
    """Errors of a run relative to the true run, at the times of the run's answers: of section forces in springs, mounts
    and bars, and of angles.
    """
    every, chassis = round(run.period / true.step), true.vehicle.chassis
    loads, states = true.run.elements[::every][: run.done], true.run.states[::every][: run.done]
    damage, force = dict[str, float](), dict[str, float]()
    for element, load in zip(true.vehicle.elements, loads.T, strict=True):
        computed = run.samples(f"{element.name} {'M' if element.unit != 'N' else 'F'}")
        damage[element.name] = damage_ratio(computed, load, slope)
        force[element.name] = root_mean_square(computed - load)
    roll, pitch, height = (
        np.abs(run.samples(f"{chassis} {name}") - states[:, i])
        for name, i in (("roll", ROLL), ("pitch", PITCH), ("z", Z))
    )
    tilt = np.maximum(roll, pitch)
    return RunErrors(damage, force, {}, float(tilt.max()), root_mean_square(tilt), float(height.max()))


def disagreement(compared_channel: ChannelComparison, noise: float = 0.0) -> float:
    """Ratio of the rms error of a check channel to the channel's rms, after its noise (standard deviation) is removed
    from both.

    0 of a channel that is more than a third noise: it can contradict nothing. Noise that is not known, NaN, is none.
    """
    noise = 0.0 if math.isnan(noise) else noise
    error, whole = (sum(getattr(band, name) ** 2 for band in compared_channel.bands) for name in ("error", "measured"))
    if whole <= 0.0 or noise > LARGEST_NOISE_SHARE * math.sqrt(whole):
        return 0.0
    return math.sqrt(max(error - noise**2, 0.0) / (whole - noise**2))
