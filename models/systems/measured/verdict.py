"""What a run of a recording is worth: accepted, rejected, or to be stabilised first, with the threshold that says so.

The concept is that of the pitch plane (``models.drift.score``), with both angles of a vehicle in space: the artificial
moment by what turns the chassis, the angles, and what the measurement leaves unknown of them. A true run, which only a
virtual measurement has, adds damage and angle errors. Channels that were measured but not put in are compared with
what the run says of them; one that disagrees rejects the run, whatever its own figures are.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from models.core.finding import Finding
from models.drift import score
from models.drift.score import SURPRISED, Errors, Limits, Own, Verdict, low_pass, rms
from models.fatigue.damage import SLOPE, damage_ratio
from models.systems.measured.comparison import Compared
from models.systems.measured.section_run import DAMPING, Hold, Outcome
from models.systems.measured.virtual import VirtualMeasurement
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, Z, rigid

LIMITS = Limits(artificial_share=0.1)
"""From where on a run is not good enough. A pull of 5 Hz, whose moment is 12 % of what turns the chassis, takes 5 % off
the damage of engine mounts on a rough road; one of 0.7 Hz 2 % of it and 1 %."""
DISAGREES = 0.15
"""Rms of the error of a check channel by its own, both without means and without what is known to be noise: a gain
wrong by 5 % and a delay of 2 ms at 10 Hz together stay below it."""
LOUD = 1 / 3
"""Part of a check channel that may be noise."""
WORDS = {
    "I pitch''": "what turns the chassis",
    "the measured pitch": "measured roll and pitch",
    "pitch wrong": "roll or pitch wrong",
    "pitch known": "roll or pitch known",
    "pitch of": "roll or pitch of",
}
"""What ``score`` says of the pitch plane, and what it means here."""
EFFECTS = {"kalman": {"kalman_filter"}, "prescribed": {"prescribed_pitch"}, "none": set[str]()}
"""Methods of holding a run, by the names that ``score`` has for them."""


def judge(
    run: Outcome,
    vehicle: CutVehicle,
    hold: Hold,
    sampled: float,
    limits: Limits = LIMITS,
    trusted: float | None = None,
    compared: Sequence[Compared] = (),
    noise: Mapping[str, float] | None = None,
) -> Verdict:
    """The verdict of an engineer, who has no true run.

    sampled : s, sampling period of the recording. trusted : s, predicted for a free run (``trust``), None if not known.
    compared : check channels beside the run; noise : name -> standard deviation of the white noise of each, in SI.
    """
    shares = {own.signal.name: disagreement(own, (noise or {}).get(own.signal.name, 0.0)) for own in compared}
    off = {name: share for name, share in shares.items() if not share <= DISAGREES}
    found = score.blind_verdict(
        own_figures(run, vehicle),
        EFFECTS[hold.method],
        run.period * (run.done - 1),
        limits,
        trusted,
        uncertainty=uncertainty(vehicle, hold, sampled),
    )
    if not off:
        return _in_space(found)
    told = ", ".join(f"{name} by {share:.0%}" for name, share in off.items())
    return Verdict("rejected", f"channels that were not put in disagree (at most {DISAGREES:.0%}): {told}")


def surprised(run: Outcome) -> tuple[Finding, ...]:
    """Doubts where the filter that held a run was surprised by its measurements, or calls them biased."""
    if not run.surprise > SURPRISED:
        return tuple(Finding("filter", "doubt", "recording", f"{text[0].upper()}{text[1:]}.") for text in run.doubts)
    text = (
        f"The filter's innovations squared are {run.surprise:.3g} times what the noise of forces and angles "
        "allows: a channel is off by a little (gain, offset, delay, a spike, a held value, a load that is not in "
        "the vehicle file), and forces along the vehicle, which small angles make, may be wrong by much."
    )
    return (Finding("filter", "doubt", "recording", text, run.surprise, "1"),)


def judge_beside_truth(
    run: Outcome, true: VirtualMeasurement, hold: Hold, limits: Limits = LIMITS, slope: float = SLOPE
) -> Verdict:
    """The verdict on a run of a virtual measurement, beside the true one."""
    found = errors(run, true, slope)
    return _in_space(score.verdict(own_figures(run, true.vehicle), found, EFFECTS[hold.method], limits))


def _in_space(found: Verdict) -> Verdict:
    """A verdict in the words of a vehicle that rolls, too."""
    reason = found.reason
    for plane, space in WORDS.items():
        reason = reason.replace(plane, space)
    return replace(found, reason=reason)


def own_figures(run: Outcome, vehicle: CutVehicle) -> Own:
    """Figures of a run by itself, of roll or pitch, whichever is worse; cost is not among them (0)."""
    inertia, chassis = np.diag(rigid(vehicle).inertia), vehicle.chassis
    axes = [
        _axis(_named(run, f"stabiliser {name}"), _named(run, f"{chassis} {name} rate"), inertia[i], run.period)
        for i, name in enumerate(("roll", "pitch"))
    ]
    worse = max(axes, key=lambda own: own.moment_share_band)
    tilt = max(float(np.abs(_named(run, f"{chassis} {name}")).max()) for name in ("roll", "pitch"))
    return replace(worse, pitch_max=tilt)


def _axis(moment: np.ndarray, rate: np.ndarray, inertia: float, period: float) -> Own:
    """Artificial moment (n,), N m, beside the inertia times what the rate (n,), rad/s, changes by."""
    moment, turning = 0.5 * (moment[1:] + moment[:-1]), inertia * np.diff(rate) / period
    held, whole = low_pass(moment, period), low_pass(turning, period)
    return Own(
        moment_rms=rms(moment),
        moment_max=float(np.abs(moment).max()),
        moment_share=_share(moment, turning),
        moment_share_band=_share(held, whole),
        force_share_band=0.0,
        pitch_max=0.0,
        seconds=0.0,
        force_calls=0,
        steps=0,
    )


def _share(part: np.ndarray, whole: np.ndarray) -> float:
    return rms(part) / rms(whole) if rms(whole) > 0 else float(rms(part) > 0)


def uncertainty(vehicle: CutVehicle, hold: Hold, period: float) -> float:
    """Twice the standard deviation (rad) of the angle, roll or pitch, of a run that is held; 0 of a free one.

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
    pushed = np.diag(rigid(vehicle).turning(np.tile(np.repeat([hold.force, hold.moment], 3), len(vehicle.hubs))))[:2]
    each = (
        hold.angle**2 * corner / (4 * DAMPING)
        + hold.rate**2 * DAMPING / corner
        + float(pushed.max()) / (4 * DAMPING * corner**3)
    )
    return 2.0 * math.sqrt(period * each)


def errors(run: Outcome, true: VirtualMeasurement, slope: float = SLOPE) -> Errors:
    """What a run is beside the true one, at the answers' times: section forces of springs, mounts and bars, angles."""
    every = round(run.period / true.step)
    loads, states = true.run.elements[::every][: run.done], true.run.states[::every][: run.done]
    damage, force = dict[str, float](), dict[str, float]()
    for i, element in enumerate(true.vehicle.elements):
        found = _named(run, f"{element.name} {'M' if element.unit != 'N' else 'F'}")
        damage[element.name] = damage_ratio(found, loads[:, i], slope)
        force[element.name] = rms(found - loads[:, i])
    off = {
        name: _named(run, f"{true.vehicle.chassis} {name}") - states[:, i]
        for name, i in (("roll", ROLL), ("pitch", PITCH), ("z", Z))
    }
    tilt = np.maximum(np.abs(off["roll"]), np.abs(off["pitch"]))
    return Errors(damage, force, {}, float(tilt.max()), rms(tilt), float(np.abs(off["z"]).max()))


def disagreement(own: Compared, noise: float = 0.0) -> float:
    """Rms of the error of a check channel by that of the channel, its noise (standard deviation) taken off both.

    0 of a channel that is more than a third noise: it can contradict nothing. Noise that is not known, NaN, is none.
    """
    noise = 0.0 if math.isnan(noise) else noise
    error, whole = (sum(getattr(band, name) ** 2 for band in own.bands) for name in ("error", "measured"))
    if whole <= 0.0 or noise > LOUD * math.sqrt(whole):
        return 0.0
    return math.sqrt(max(error - noise**2, 0.0) / (whole - noise**2))


def _named(run: Outcome, name: str) -> np.ndarray:
    """Samples (done,) of the answer of this name."""
    return run.columns.read(name, 0, run.done)
