"""Consequences of findings on a recording for the section forces: a run as recorded is compared with a run in which the
finding is corrected.

A finding with a size can be corrected: a late channel is shifted, a wrong factor divided out, a spike removed. The lost
samples of a gap are unknown; instead the gap's bridge is changed by its standard deviation. The difference of both runs
is the effect of the finding on every section force, as rms and as damage. Of a long recording
``LONGEST_RERUN_DURATION`` s are run, about the time where the finding is worst.
"""

import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.finding import LISTED_FINDINGS, Finding
from models.drift.score import StabilisedRunVerdict, root_mean_square
from models.fatigue.damage import WOEHLER_SLOPE, damage_ratio
from models.measured.checks.spikes import spike_positions
from models.measured.columns import SampleFile
from models.measured.gaps import LONGEST_BRIDGED_GAP, filled_samples
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.sections import SectionChannel

LONGEST_RERUN_DURATION = 30.0
"""Longest part (s) of a recording that is run for a finding."""
FORCE_LIMITS, DAMAGE_LIMITS = (0.05, 0.15), (0.05, 0.25)
"""Limits of the change of a section force: rms of the change divided by the rms of the force without its mean, and
|damage ratio - 1|. Up to the first number the run is accepted, beyond the second it is rejected, between them accepted
with doubt. 5 % of an amplitude are 28 % of damage of slope 5."""
NEGLIGIBLE_FORCE_SHARE = 0.02
"""Rms of a section force divided by the largest rms in the same unit, below which the force is not compared."""
SETTLING_DURATION = 1.0
"""Time (s) at the beginning of a run that is not compared, in which the run settles."""
SamplesBySignal = dict[MeasuredSignal, np.ndarray]
RunRecording = Callable[[Recording, Path], SectionOutcome]


@dataclass(frozen=True)
class Consequence:
    """Effect of a finding on the section force that it changes most. force : rms of the change divided by the rms of
    the force; damage : damage as recorded divided by damage with the finding corrected. Where unknown, both are NaN and
    section_force is empty.
    """

    finding: Finding
    section_force: str = ""
    force: float = np.nan
    damage: float = np.nan

    @property
    def grade(self) -> int:
        """Grade of the consequence: 0 harmless, 1 doubtful or unknown, 2 not acceptable."""
        if not self.section_force:
            return 1
        return max(
            sum(abs(value) > bound for bound in bounds)
            for value, bounds in ((self.force, FORCE_LIMITS), (self.damage - 1.0, DAMAGE_LIMITS))
        )

    def __str__(self) -> str:
        """Returns the consequence with its figures as a sentence."""
        where = f"'{self.finding.check}' at {self.finding.place or 'the recording'}"
        if not self.section_force:
            return f"{where}: what it does to the section forces is not known"
        return (
            f"{where}: changes {self.section_force} by {self.force:.1%} of its rms, its damage is "
            f"{self.damage:.3g} times"
        )


def consequences(
    findings: Iterable[Finding],
    recording: Recording,
    run_recording: RunRecording,
    force_channels: Sequence[SectionChannel],
    work_folder: Path,
) -> tuple[Consequence, ...]:
    """Compute the consequence of every doubt. run_recording : function that simulates a recording in a folder;
    force_channels : channels of the section forces that are compared.
    """
    shutil.rmtree(work_folder, ignore_errors=True)
    outcome_of_start = dict[int, SectionOutcome]()

    def consequence(finding_number: int, finding: Finding) -> Consequence:
        signals = [s for s in recording.signals if s.name in finding.signals]
        correction = CORRECTION_OF_CHECK.get(finding.check)
        if correction is None or not signals:
            return Consequence(finding)
        first, count = _window_of_finding(finding, recording)
        samples = {s: recording.columns.read(s.name, first, count) for s in recording.signals}
        corrected = samples | correction(finding, signals, samples, recording.period)
        start_folder, corrected_folder = work_folder / f"from {first}", work_folder / str(finding_number)
        try:
            if first not in outcome_of_start:
                outcome_of_start[first] = run_recording(
                    samples_as_recording(recording, samples, start_folder), start_folder
                )
            corrected_recording = samples_as_recording(recording, corrected, corrected_folder)
            corrected_outcome = run_recording(corrected_recording, corrected_folder)
        except (InputError, RunFailed):
            return Consequence(finding)
        return _consequence_of_most_changed_force(finding, outcome_of_start[first], corrected_outcome, force_channels)

    return tuple(consequence(number, finding) for number, finding in enumerate(_distinct_doubts(findings)))


def verdict_with_consequences(
    verdict: StabilisedRunVerdict, consequences: Sequence[Consequence]
) -> StabilisedRunVerdict:
    """Returns the verdict on a run, lowered from "accepted" if findings change the section forces too much."""
    worst = max((consequence.grade for consequence in consequences), default=0)
    if verdict.word != "accepted" or worst == 0:
        return verdict
    reason = "; ".join(consequence_texts(consequence for consequence in consequences if consequence.grade == worst))
    bounds = (
        f"accepted up to {FORCE_LIMITS[0]:.0%} and {DAMAGE_LIMITS[0]:.0%}, rejected beyond "
        f"{FORCE_LIMITS[1]:.0%} and {DAMAGE_LIMITS[1]:.0%}"
    )
    return StabilisedRunVerdict("rejected" if worst > 1 else "accepted with doubt", f"{reason} ({bounds})")


def consequence_texts(consequences: Iterable[Consequence]) -> list[str]:
    """Texts on the consequences. Of more than LISTED_FINDINGS by the same check only the worst is described, with their
    number.
    """
    by_check: dict[str, list[Consequence]] = {}
    for consequence in consequences:
        by_check.setdefault(consequence.finding.check, []).append(consequence)
    out = list[str]()
    for alike in by_check.values():
        worst = max(alike, key=lambda each: (each.grade, np.nan_to_num(abs(each.force))))
        out += [f"{worst}, the worst of {len(alike)}"] if len(alike) > LISTED_FINDINGS else map(str, alike)
    return out


def _distinct_doubts(findings: Iterable[Finding]) -> list[Finding]:
    """Returns the doubts among findings, without repetitions of the same check on the same channels."""
    doubts = [finding for finding in findings if finding.weight == "doubt"]
    first = {(finding.check, finding.signals or finding.place): finding for finding in reversed(doubts)}
    return list(reversed(first.values()))


def _window_of_finding(finding: Finding, recording: Recording) -> tuple[int, int]:
    """First sample and number of samples of the part of a recording that is run for a finding."""
    count = min(recording.count, round(LONGEST_RERUN_DURATION / recording.period) + 1)
    middle = finding.times[0] if finding.times else 0.0
    first = min(max(round((middle - LONGEST_RERUN_DURATION / 2) / recording.period), 0), recording.count - count)
    return first, count


def samples_as_recording(recording: Recording, samples_by_signal: SamplesBySignal, columns_folder: Path) -> Recording:
    """Write samples of signals into columns in ``columns_folder``, and return them as a recording."""
    columns_folder.mkdir(parents=True, exist_ok=True)
    count = len(next(iter(samples_by_signal.values())))
    columns = SampleFile(columns_folder / "samples.columns", tuple(s.name for s in recording.signals), count)
    columns.write(0, np.column_stack([samples_by_signal[s] for s in recording.signals]))
    return Recording(recording.signals, columns, recording.period)


def _consequence_of_most_changed_force(
    finding: Finding,
    recorded_outcome: SectionOutcome,
    corrected_outcome: SectionOutcome,
    force_channels: Sequence[SectionChannel],
) -> Consequence:
    """Returns the consequence of a finding for the section force that changes most, without negligibly small forces."""
    first = min(round(SETTLING_DURATION / corrected_outcome.period), corrected_outcome.done // 4)
    pairs = {a: (recorded_outcome.samples(a)[first:], corrected_outcome.samples(a)[first:]) for a in force_channels}
    size = {a: root_mean_square(measured - measured.mean()) for a, (_, measured) in pairs.items()}
    most = {unit: max(size[a] for a in pairs if a.unit == unit) for unit in {a.unit for a in pairs}}
    every = [
        Consequence(
            finding,
            a.name,
            root_mean_square(computed - measured) / size[a],
            damage_ratio(computed, measured, WOEHLER_SLOPE),
        )
        for a, (computed, measured) in pairs.items()
        if size[a] > NEGLIGIBLE_FORCE_SHARE * most[a.unit]
    ]
    return max(every, key=lambda computed: (computed.grade, abs(computed.force)), default=Consequence(finding))


def _read_later(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of signals corrected for a constant delay, or for a clock's drift, which grows from the start on."""
    size, count = finding.size or 0.0, len(next(iter(samples_by_signal.values())))
    later = size * np.arange(count) if finding.check == "drift" else size / sample_period * np.ones(count)
    return {s: _read_at(samples_by_signal[s], later) for s in signals}


def _read_at(sampled_values: np.ndarray, samples_later: np.ndarray) -> np.ndarray:
    """Values (n,) read ``samples_later`` (n,) samples later by a cubic spline; NaN next to an unknown value."""
    from scipy.interpolate import make_interp_spline

    known, places = np.isfinite(sampled_values), np.arange(len(sampled_values))
    if np.count_nonzero(known) < 4:
        return sampled_values
    at = np.clip(places + samples_later, 0, len(sampled_values) - 1)
    spline = make_interp_spline(places[known], sampled_values[known], k=3)
    lost = np.interp(at, places, (~known).astype(float)) > 0
    return np.where(lost, np.nan, spline(np.clip(at, *places[known][[0, -1]])))


def _divided_by_factor(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of signals divided by the factor by which, as the finding says, they are too large."""
    size = finding.size or 0.0
    factor = 1.0 + size / 100 if finding.unit == "%" else size
    return {s: samples_by_signal[s] / factor for s in signals}


def _offset_removed(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of signals less the offset (SI) that the finding states."""
    return {s: samples_by_signal[s] - (finding.size or 0.0) for s in signals}


def _moments_corrected(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of moments moved by the lever (m) that the finding states, with the measured forces across it."""
    force = {(s.at, s.component): s for s in samples_by_signal if s.quantity == "force" and not s.check}
    across = {"x": ("y", -1.0), "y": ("x", 1.0)}
    return {
        s: samples_by_signal[s] + sign * (finding.size or 0.0) * samples_by_signal[force[s.at, axis]]
        for s, (axis, sign) in ((s, across[s.component]) for s in signals)
        if (s.at, axis) in force
    }


def _channels_exchanged(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of two signals, each with those of the other."""
    first, second = signals
    return {first: samples_by_signal[second], second: samples_by_signal[first]}


def _without_spikes(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of signals with spikes of one or two samples replaced by interpolation."""
    out = dict[MeasuredSignal, np.ndarray]()
    for s in signals:
        at, values = spike_positions(samples_by_signal[s])[0], samples_by_signal[s].copy()
        values[np.minimum(np.concatenate((at, at + 1)), len(values) - 1)] = np.nan
        out[s] = filled_samples(values, sample_period, LONGEST_BRIDGED_GAP)[0]
    return out


def _bridge_varied(
    finding: Finding, signals: Sequence[MeasuredSignal], samples_by_signal: SamplesBySignal, sample_period: float
) -> SamplesBySignal:
    """Samples of signals with gaps bridged as for the run, plus or minus the bridge's standard deviation, with the sign
    alternating from gap to gap.
    """
    out = dict[MeasuredSignal, np.ndarray]()
    for s in signals:
        if s.quantity in ("force", "moment"):
            values, gaps = filled_samples(samples_by_signal[s], sample_period, LONGEST_BRIDGED_GAP)
            out[s] = values.copy()
            for number, gap in enumerate(gaps):
                out[s][gap.first : gap.end] += (-1.0) ** number * np.nan_to_num(gap.largest_deviation)
    return out


CORRECTION_OF_CHECK: dict[
    str, Callable[[Finding, Sequence[MeasuredSignal], SamplesBySignal, float], SamplesBySignal]
] = {
    "shift": _read_later,
    "drift": _read_later,
    "gain": _divided_by_factor,
    "sign": _divided_by_factor,
    "unit": _divided_by_factor,
    "offset": _offset_removed,
    "lever": _moments_corrected,
    "exchanged": _channels_exchanged,
    "spikes": _without_spikes,
    "gaps": _bridge_varied,
    "no value": _bridge_varied,
}
"""Function that corrects the samples for a finding, by the name of the check."""
