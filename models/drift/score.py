"""Scores of a stabilised run: cost of the stabilisation, errors relative to the true run, and a verdict.

Two kinds of figures are kept apart, because an engineer has only one of them.

`RunFigures` needs the run alone: the artificial moment, that is the part of I pitch'' that no suspension force
explains, and what the run cost. `RunErrors` needs the true run, which only a virtual measurement has: pseudo-damage of
the body-frame section forces, rms error of these forces, pitch error. The vertical suspension force is kept among them
as a warning: f3 = f1 - m1 g + m1 z1'' holds at every pitch, so it calls a tumbling vehicle good."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.result import Result
from models.core.strict import Strict
from models.fatigue.damage import WOEHLER_SLOPE, damage_ratio
from models.vehicles.pitch_plane import PitchPlaneParameters

JUDGED_BAND = 15.0
"""Upper edge (Hz) of the frequency band in which the artificial moment is judged: what bends a chassis."""
BUTTERWORTH_ORDER = 4
"""Order of the Butterworth low-pass, run forwards and backwards (``scipy.signal.sosfiltfilt``): no phase shift, -6 dB
at JUDGED_BAND."""
TUMBLING_PITCH = 0.5
"""Pitch (rad) beyond which a vehicle counts as tumbled, since no road is that steep."""
MEASURED_PITCH_EFFECTS = ("prescribed_pitch", "prescribed_heave_and_pitch", "kalman_filter")
"""Names of the effects that guide the pitch to a measured pitch."""
LEVELLING_EFFECTS = ("pitch_spring", "high_pass")
"""Names of the effects that hold the pitch near zero, whatever the road does."""

INNOVATION_CONFIDENCE = 0.999
"""Probability of the chi-square band in which a correct filter's innovations lie."""

DOUBTFUL_INNOVATION_LIMIT = 2.0
"""Mean of the normalised innovation squared from which on the measurements of a filter of roll and pitch are doubted: 1
is right, and noise that is estimated is right to a third. An axle force 0.5 % too large, which takes a third off the
damage along the vehicle, makes 2."""

FEWEST_ROWS, COARSEST_SPACING = 100, 5e-3
"""Least number of rows and largest row spacing (s) for a balance of moments over each step: a quarter of a wave at 50
Hz."""

VerdictWord = Literal["accepted", "accepted with doubt", "rejected", "stabilise"]
"""Words of a verdict on a run."""


class AcceptanceLimits(Strict):
    """[options.limits]: from where on a run is not good enough; chosen by whoever uses its forces."""

    damage_error: float = Field(default=0.05, gt=0, description="largest |damage ratio - 1| of any section force")
    pitch_error: float = Field(default=0.02, gt=0, description="largest pitch error, rad")
    artificial_share: float = Field(
        default=0.15,
        gt=0,
        description="rms of the artificial moment by that of I pitch'' and of the artificial "
        "vertical force by that of m3 z3'', both up to 15 Hz",
    )


@dataclass(frozen=True)
class RunFigures:
    """Figures of a stabilised run that need no true run: moments and forces of the stabiliser, pitch, cost.

    Attributes
    ----------
    moment_rms, moment_max : artificial moment in N m, all frequencies
    moment_share, moment_share_band : its rms divided by that of I pitch'', over all frequencies and up to JUDGED_BAND
    force_share_band : the same for the vertical force on the chassis, by m3 z3''
    pitch_max : largest |pitch| in rad
    seconds, force_calls, steps : what it cost
    """

    moment_rms: float
    moment_max: float
    moment_share: float
    moment_share_band: float
    force_share_band: float
    pitch_max: float
    seconds: float
    force_calls: int
    steps: int


@dataclass(frozen=True)
class RunErrors:
    """Errors of a stabilised run relative to the true run.

    Attributes
    ----------
    damage : pseudo-damage divided by the true one, per body-frame section force (``section_forces``), with the
        exponent and the residue convention of models/fatigue/damage.py
    force_rms : rms error of each section force in N
    vertical_damage : the same ratio for the vertical forces f3, f4: blind to the pitch, never judged
    pitch_max, pitch_rms : pitch error in rad; heave_max : error of the chassis' heave in m
    """

    damage: dict[str, float]
    force_rms: dict[str, float]
    vertical_damage: dict[str, float]
    pitch_max: float
    pitch_rms: float
    heave_max: float


@dataclass(frozen=True)
class StabilisedRunVerdict:
    """Verdict on a stabilised run: a word and its reason."""

    word: VerdictWord
    reason: str


def figures_of_run(run: Result, vehicle_parameters: PitchPlaneParameters) -> RunFigures:
    """Figures of a run that need no true run, such as its artificial moment; raises InputError unless its rows are on a
    uniform, fine grid.

    The artificial moment is the mean over each step of I pitch'' less the suspension's moment, so it counts whatever
    acts on the chassis beside its springs and dampers, by whichever effect, in whichever engine.
    """
    row_spacing = _row_spacing(run)
    inertia, heave = (
        vehicle_parameters.I * np.diff(run["pitch_rate"]) / row_spacing,
        vehicle_parameters.m3 * np.diff(run["z3_rate"]) / row_spacing,
    )
    moment = inertia - _step_means(_natural_moment(run, vehicle_parameters), row_spacing)
    force = heave - _step_means(vehicle_parameters.m3 * vehicle_parameters.g - run["f3"] - run["f4"], row_spacing)
    band = {
        name: low_pass(values, row_spacing)
        for name, values in (("moment", moment), ("inertia", inertia), ("force", force), ("heave", heave))
    }
    counts = run.counts()
    return RunFigures(
        moment_rms=root_mean_square(moment),
        moment_max=float(np.abs(moment).max()),
        moment_share=_rms_ratio(moment, inertia),
        moment_share_band=_rms_ratio(band["moment"], band["inertia"]),
        force_share_band=_rms_ratio(band["force"], band["heave"]),
        pitch_max=float(np.abs(run["pitch"]).max()),
        seconds=float(run.data.attrs["seconds"]),
        force_calls=counts.get("force calls", 0),
        steps=counts.get("steps", 0),
    )


def errors_of_run(run: Result, true_run: Result, woehler_slope: float = WOEHLER_SLOPE) -> RunErrors:
    """Errors of a run relative to the true run, with rows at the same times; ``woehler_slope`` is the Woehler exponent.

    Raises InputError if the rows lie at different times, or if a load of the truth never turns.
    """
    if len(run.times) != len(true_run.times) or np.abs(run.times - true_run.times).max() > 1e-9:
        raise InputError("", "times", None, "the run and the true one need rows at the same times")
    loads, true = (section_forces(forces["f3"], forces["f4"], forces["pitch"]) for forces in (run, true_run))
    pitch = run["pitch"] - true_run["pitch"]
    return RunErrors(
        damage={name: damage_ratio(loads[name], true[name], woehler_slope) for name in SECTION_FORCE_CHANNELS},
        force_rms={name: root_mean_square(loads[name] - true[name]) for name in SECTION_FORCE_CHANNELS},
        vertical_damage={name: damage_ratio(run[name], true_run[name], woehler_slope) for name in ("f3", "f4")},
        pitch_max=float(np.abs(pitch).max()),
        pitch_rms=root_mean_square(pitch),
        heave_max=float(np.abs(run["z3"] - true_run["z3"]).max()),
    )


def verdict_on_run(
    run_figures: RunFigures, run_errors: RunErrors, effect_names: Iterable[str], acceptance_limits: AcceptanceLimits
) -> StabilisedRunVerdict:
    """Verdict on a virtual measurement with a true run, by damage, pitch error and artificial moment.

    ``accepted``: all within the limits. ``stabilise``: a run without any stabiliser (none of MEASURED_PITCH_EFFECTS or
    LEVELLING_EFFECTS among the scene's ``effect_names``) that is outside them but has not tumbled. ``rejected``: all
    else.
    """
    if run_figures.pitch_max > TUMBLING_PITCH:
        return _tumbling_verdict(run_figures)
    wrong = [
        *_exceeded_limits(run_errors, acceptance_limits),
        *_stabiliser_burden_sentences(run_figures, acceptance_limits),
    ]
    if not wrong:
        return StabilisedRunVerdict("accepted", f"damage ratios within {acceptance_limits.damage_error:.0%} of 1")
    stabilised = not set(effect_names).isdisjoint((*MEASURED_PITCH_EFFECTS, *LEVELLING_EFFECTS))
    return StabilisedRunVerdict("rejected" if stabilised else "stabilise", "; ".join(wrong))


def innovations_are_consistent(filtered_run: Result) -> bool | None:
    """Whether the innovations of a run's Kalman filter are as large as the filter states; None without a filter.

    The mean normalised innovation squared over the whole run, per measured value, lies in the chi-square band of
    INNOVATION_CONFIDENCE. A filter whose model is wrong in a way that it does not allow for lies far above it.
    """
    from scipy.stats import chi2

    if "kalman_surprise" not in filtered_run.data:
        return None
    count = float(filtered_run["kalman_used"][-1])
    low, high = chi2.ppf([0.5 - INNOVATION_CONFIDENCE / 2, 0.5 + INNOVATION_CONFIDENCE / 2], count)
    return bool(low <= filtered_run["kalman_surprise"][-1] <= high)


def stated_pitch_uncertainty(filtered_run: Result) -> float:
    """Uncertainty (rad) that a Kalman filter states for the pitch: twice its largest standard deviation; 0 without a
    filter."""
    return 2.0 * float(filtered_run["pitch_deviation"].max()) if "pitch_deviation" in filtered_run.data else 0.0


def verdict_without_true_run(
    run_figures: RunFigures,
    effect_names: Iterable[str],
    duration: float,
    acceptance_limits: AcceptanceLimits,
    trusted_duration: float | None = None,
    innovations_consistent: bool | None = None,
    pitch_uncertainty: float = 0.0,
) -> StabilisedRunVerdict:
    """Verdict without a true run, from figures of the run alone; damage is not among them.

    ``accepted``: the pitch is held to a measured one (MEASURED_PITCH_EFFECTS), the artificial moment is within its
    limit and the filter, where there is one, is ``innovations_are_consistent`` with its measurement (NIS within its
    band) and its own ``pitch_uncertainty`` (rad) is within the limit of pitch errors; or a free run ends before
    the ``trusted_duration`` time (s) predicted for it. ``stabilise``: a longer free run, or one that is held near zero
    (LEVELLING_EFFECTS): that is wrong on a grade, and nothing in the run shows it. ``rejected``: all else.

    effect_names : names of the scene's effects; duration : of the run in s; ``trusted_duration`` and
    ``innovations_are_consistent`` None: not known.
    """
    named = set(effect_names)
    if run_figures.pitch_max > TUMBLING_PITCH:
        return _tumbling_verdict(run_figures)
    if named.isdisjoint((*MEASURED_PITCH_EFFECTS, *LEVELLING_EFFECTS)):
        return _free_run_verdict(duration, trusted_duration)
    wrong = _stabiliser_burden_sentences(run_figures, acceptance_limits) + (
        ["NIS outside its band"] if innovations_consistent is False else []
    )
    wrong += (
        [f"pitch known to {pitch_uncertainty:.2g} rad only"]
        if pitch_uncertainty > acceptance_limits.pitch_error
        else []
    )
    if wrong:
        return StabilisedRunVerdict("rejected", "; ".join(wrong))
    if named.isdisjoint(MEASURED_PITCH_EFFECTS):
        return StabilisedRunVerdict(
            "stabilise", "held near zero, not to a measured pitch: wrong on a grade, unseen in the run"
        )
    return StabilisedRunVerdict(
        "accepted", f"held to the measured pitch by {run_figures.moment_share_band:.1%} of I pitch''"
    )


def _tumbling_verdict(run_figures: RunFigures) -> StabilisedRunVerdict:
    """Verdict on a run that tumbled: rejected."""
    return StabilisedRunVerdict(
        "rejected", f"tumbled: pitch of {run_figures.pitch_max:.2g} rad; none of its forces mean anything"
    )


def _free_run_verdict(duration: float, trusted_duration: float | None) -> StabilisedRunVerdict:
    """Verdict on a run without stabiliser, by the predicted time (s) for which it can be trusted."""
    if trusted_duration is None:
        return StabilisedRunVerdict("stabilise", "free, and nothing predicts how long it can be trusted")
    if duration <= trusted_duration:
        return StabilisedRunVerdict("accepted", f"free, and trusted for {trusted_duration:.3g} s")
    return StabilisedRunVerdict("stabilise", f"free, and trusted for {trusted_duration:.3g} s of {duration:.3g} s")


def _exceeded_limits(run_errors: RunErrors, acceptance_limits: AcceptanceLimits) -> list[str]:
    """Phrases on the errors relative to the true run that exceed their limits."""
    damage = [
        f"damage of {name} x {ratio:.3g}"
        for name, ratio in run_errors.damage.items()
        if not abs(ratio - 1.0) <= acceptance_limits.damage_error
    ]
    return damage + (
        []
        if run_errors.pitch_max <= acceptance_limits.pitch_error
        else [f"pitch wrong by {run_errors.pitch_max:.2g} rad"]
    )


def _stabiliser_burden_sentences(run_figures: RunFigures, acceptance_limits: AcceptanceLimits) -> list[str]:
    """Phrases on the artificial moment and force of the stabiliser where their shares exceed the limit."""
    shares = {
        "moment": (run_figures.moment_share_band, "I pitch''"),
        "force": (run_figures.force_share_band, "m3 z3''"),
    }
    return [
        f"artificial {name} {share:.0%} of {full_value}"
        for name, (share, full_value) in shares.items()
        if not share <= acceptance_limits.artificial_share
    ]


def root_mean_square(samples: np.ndarray) -> float:
    """Root mean square of an array."""
    return float(np.sqrt(np.mean(np.square(samples))))


def low_pass(samples: np.ndarray, sampling_period: float) -> np.ndarray:
    """Samples (n,) spaced by ``sampling_period`` (s), with frequencies above JUDGED_BAND removed without phase
    shift.
    """
    from scipy.signal import butter, sosfiltfilt

    return sosfiltfilt(butter(BUTTERWORTH_ORDER, JUDGED_BAND, fs=1.0 / sampling_period, output="sos"), samples)


def _rms_ratio(samples: np.ndarray, reference_samples: np.ndarray) -> float:
    """Ratio of the root mean square of ``samples`` to that of ``reference_samples``; 0 where both are 0."""
    size, all_of_it = root_mean_square(samples), root_mean_square(reference_samples)
    return size / all_of_it if all_of_it > 0 else (np.inf if size > 0 else 0.0)


def _step_means(samples: np.ndarray, sampling_period: float) -> np.ndarray:
    """Means (n - 1,) over each step (s) of a sampled signal (n,), by the trapezoidal rule with its end correction,
    order 4."""
    slope = np.gradient(samples, sampling_period, edge_order=2)
    return (samples[1:] + samples[:-1]) / 2.0 - sampling_period / 12.0 * np.diff(slope)


def _natural_moment(run: Result, parameters: PitchPlaneParameters) -> np.ndarray:
    """Pitch moment (n,) in N m on the chassis from suspension forces and body-fixed wheel forces, without the
    stabiliser."""
    moment = run["suspension_moment"]
    if run.data.attrs["mode"] != "force-body":
        return moment
    return moment + np.sin(run["pitch"]) ** 2 * (parameters.b * run["f1"] - parameters.a * run["f2"])


def _row_spacing(run: Result) -> float:
    """Spacing (s) of a run's rows; raises InputError unless they are equally and closely spaced."""
    steps = np.diff(run.times)
    if len(steps) < FEWEST_ROWS or np.ptp(steps) > 1e-6 * steps[0] or steps[0] > COARSEST_SPACING:
        raise InputError(
            "",
            "times",
            None,
            f"the score needs {FEWEST_ROWS} rows or more, equally spaced by {COARSEST_SPACING:g} s "
            "or less: leave run.output_step out",
        )
    return float(steps.mean())


SECTION_FORCE_CHANNELS = ("f3x", "f3z", "f4x", "f4z")
"""Names of the section forces: front (f3) and rear (f4), along the chassis' forward axis (x) and, positive in
compression, along its vertical axis (z)."""


def section_forces(f3: np.ndarray, f4: np.ndarray, pitch: np.ndarray) -> dict[str, np.ndarray]:
    """Body-frame components (N) of the vertical suspension forces f3, f4 (N, compression positive), shape (n,) each.

    pitch in rad, nose up. ``f3x`` is positive forward: with the nose up, an upward force points forward along the
    chassis. ``f3z`` is positive in compression, that is up along the chassis' own vertical.
    """
    sine, cosine = np.sin(pitch), np.cos(pitch)
    return {"f3x": f3 * sine, "f3z": f3 * cosine, "f4x": f4 * sine, "f4z": f4 * cosine}
