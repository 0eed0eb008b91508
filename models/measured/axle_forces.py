"""Checks of measured vertical axle forces against the vehicle that they carry: sign, unit, weight, balance, order,
start.

Both kinds of input go through here: a file of wheel forces of a pitch-plane scene, and a recording on that vehicle.
"""

import numpy as np

from models.core.finding import Finding, FindingWeight
from models.core.time_series import sparse_record_warning
from models.measured.axle_balance import (
    GRAVITY,
    NEGLIGIBLE_IMBALANCE_SHARE,
    STEEPEST_GRADE,
    AxleForces,
    SteadyResidual,
    equilibrium_residual,
)
from models.measured.ratios import WrongFactor, cause_and_sentence, missing_load_sentence

FINDING_NAMES = ("weight", "balance", "sign", "unit", "swapped", "start", "times", "copied", "spikes", "clipped")
"""Names of all findings on axle forces, with those on the samples of a file."""
LARGE_IMBALANCE_SHARE = 0.05
"""Share of imbalance beyond which the forces belong to another vehicle or have another unit, if they move the vehicle
far."""
LARGEST_HEAVE = 1.0
"""Largest height (m) of a vehicle above or below a level road."""
IMPOSSIBLE_FORCE_RATIO = 1e6
"""Ratio of a wheel force to the vehicle's weight above which the force is a mark for no value, or the file is
damaged."""
EXPLANATION_ERROR = 0.02
"""Relative difference of a mean force from the prediction of an explanation up to which the explanation holds."""
START_FORCE_ERROR = 0.05
"""Share of the static load by which an axle's first force may differ from the load."""
COMMON_ROAD_BAND = 1.0, 25.0
"""Frequency band (Hz) in which both axles feel the same road one after the other."""
AXLE_LAG_RANGE = 0.02, 2.0
"""Delays (s) possible between the axles of a vehicle."""
LEAST_REPETITION_CORRELATION = 0.3
"""Correlation above which one axle's force counts as a repetition of the other's."""
COPIED_RESIDUAL_SHARE = 1e-3
"""Relative rms difference of both axles' scaled variations up to which one channel counts as a copy of the other."""
FILE_REMEDIES: dict[WrongFactor, str] = {
    "sign": "forces up on the wheels are positive; turn its sign",
    "unit": "correct the unit in its header",
    "gain": "check its calibration factor",
    "size": "check its calibration factor and the vehicle's parameters",
}
"""Remedies for signals whose meaning is given by the column of a file, not by a channel map."""


def check_axle_forces(axle_forces: AxleForces) -> list[Finding]:
    """Findings on the axles' forces. If one finding explains a fault, no other finding names it."""
    largest = float(np.abs(axle_forces.forces).max())
    if largest > IMPOSSIBLE_FORCE_RATIO * axle_forces.static_loads.sum():
        text = (
            f"A wheel force of {largest:.4g} N is none of a vehicle that weighs {axle_forces.static_loads.sum():.4g} N."
        )
        return [_axle_error_finding(axle_forces, "weight", text, largest, "N")]
    for look in (
        _sparse_finding,
        _common_mistake_findings,
        _wrong_mean_findings,
        _imbalance_findings,
        _start_in_motion_finding,
    ):
        findings = look(axle_forces)
        if findings:
            return findings + _constant_axle_finding(axle_forces)
    return _constant_axle_finding(axle_forces) + _copied_finding(axle_forces) + _axle_order_finding(axle_forces) or [
        _weight_finding(axle_forces)
    ]


def _sparse_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding on a long record of which a run uses very little, and whose sampling is too coarse for wheel motion."""
    text = sparse_record_warning(len(axle_forces.forces), axle_forces.period, axle_forces.duration)
    if not text:
        return []
    return [Finding("times", "doubt", "wheel forces", text, axle_forces.period, "s", axle_forces.names)]


def _common_mistake_findings(axle_forces: AxleForces) -> list[Finding]:
    """Findings on one common mistake that explains the imbalance at both axles to within a few per cent."""
    p = axle_forces.parameters
    if p.g == 0:
        return []
    if axle_forces.is_unloaded.any():
        text = " ".join(
            missing_load_sentence(axle[0].name, mean, load)
            for axle, mean, load, empty in zip(
                axle_forces.signals,
                axle_forces.mean_forces,
                axle_forces.static_loads,
                axle_forces.is_unloaded,
                strict=True,
            )
            if empty
        )
        return [
            _axle_error_finding(
                axle_forces,
                "weight",
                text,
                100 * (axle_forces.mean_forces.sum() / axle_forces.static_loads.sum() - 1),
                "%",
            )
        ]
    wheels = np.array([p.m1, p.m2]) * p.g
    missing, lacks = (
        axle_forces.static_loads - axle_forces.mean_forces,
        100 * (axle_forces.mean_forces.sum() / axle_forces.static_loads.sum() - 1),
    )
    if _is_near(missing, wheels, axle_forces.static_loads) and not _is_near(
        missing, 0 * wheels, axle_forces.static_loads
    ):
        text = (
            f"The wheel forces lack {missing[0]:.4g} N in front and {missing[1]:.4g} N at the rear on average, the "
            f"weight of the wheels ({wheels[0]:.4g} N and {wheels[1]:.4g} N): they were measured above the wheels. Add "
            "it, with the wheels' inertia force if they move."
        )
        return [_axle_error_finding(axle_forces, "weight", text, lacks, "%")]
    if _is_near(axle_forces.mean_forces, axle_forces.static_loads / 2, axle_forces.static_loads / 2):
        text = (
            f"The wheel forces are half the static loads of the axles "
            f"({axle_forces.static_loads[0]:.5g} N and {axle_forces.static_loads[1]:.5g} N): "
            "they are of one wheel of each axle. Add those of the other."
        )
        return [_axle_error_finding(axle_forces, "weight", text, -50.0, "%")]
    return _exchanged_finding(axle_forces)


def _is_near(mean_values: np.ndarray, expected_values: np.ndarray, scale: np.ndarray) -> bool:
    """Whether values differ from the wanted ones by less than half of EXPLANATION_ERROR of a scale."""
    return bool((np.abs(mean_values - expected_values) < EXPLANATION_ERROR * scale / 2).all())


def _exchanged_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding that the two axles' forces fit the static loads only if they are exchanged."""
    as_is, crossed = (
        np.abs(each / axle_forces.static_loads - 1).max()
        for each in (axle_forces.mean_forces, axle_forces.mean_forces[::-1])
    )
    if (
        crossed > EXPLANATION_ERROR
        or as_is < 3 * crossed
        or not equilibrium_residual(axle_forces).is_beyond_uncertainty[1]
    ):
        return []
    text = (
        f"Front and rear are exchanged: {axle_forces.mean_forces[0]:.5g} N in front and "
        f"{axle_forces.mean_forces[1]:.5g} N at "
        "the rear on "
        f"average, where {axle_forces.static_loads[0]:.5g} N and {axle_forces.static_loads[1]:.5g} N rest. Exchange "
        "their "
        "columns, or a and b of "
        "the vehicle."
    )
    return [_axle_error_finding(axle_forces, "swapped", text, 100 * float(as_is), "%")]


def _wrong_mean_findings(axle_forces: AxleForces) -> list[Finding]:
    """Findings on axles whose mean force alone shows a wrong sign or unit, or would move the vehicle farther than any
    road does."""
    findings, far = [], _travels_too_far(axle_forces, equilibrium_residual(axle_forces)).any()
    for axle, mean, load in zip(
        axle_forces.signals,
        axle_forces.mean_forces,
        axle_forces.static_loads if axle_forces.parameters.g else (),
        strict=False,
    ):
        for_axle = f"the {load:.5g} N that rest on it on average"
        ratio, names = float(mean / load), tuple(s.name for s in axle)
        kind, text = cause_and_sentence(ratio, axle[0], for_axle, axle_forces.remedies)
        if kind in ("sign", "unit") or (kind == "size" and far):
            check_axle_forces = "weight" if kind == "size" else kind
            findings.append(Finding(check_axle_forces, "error", axle[0].at, text, ratio, "1", names))
    return findings


def _imbalance_findings(axle_forces: AxleForces) -> list[Finding]:
    """Findings on steady heave and pitch accelerations that a vehicle cannot sustain."""
    motion = equilibrium_residual(axle_forces)
    if not motion.is_beyond_uncertainty.any():
        return []
    beyond = (
        np.abs(motion.shares_of_load) > LARGE_IMBALANCE_SHARE + motion.uncertainties / motion.whole_load_accelerations
    )
    weight: FindingWeight = "error" if (beyond & _travels_too_far(axle_forces, motion)).any() else "doubt"
    excess = np.linalg.solve(
        axle_forces.accelerations_per_newton, np.where(motion.is_beyond_uncertainty, motion.accelerations, 0.0)
    )
    share = excess / axle_forces.static_loads
    told = " and ".join(
        _excess_text(*each)
        for each in zip(("the front axle", "the rear axle"), excess, share, strict=True)
        if abs(each[2]) > NEGLIGIBLE_IMBALANCE_SHARE / 2
    )
    text = (
        f"On average {told} against what rests there: {_motion_text(axle_forces, motion)}. Check calibration, zero "
        "and the "
        "vehicle's masses and a, b; a vehicle that brakes or accelerates has forces along the road, too, which "
        "this model has not."
    )
    kind = "balance" if motion.is_beyond_uncertainty[1] else "weight"
    size = float(motion.shares_of_load[1] if motion.is_beyond_uncertainty[1] else motion.shares_of_load[0])
    return [Finding(kind, weight, "wheel forces", text, 100 * size, "%", axle_forces.names)]


def _travels_too_far(axle_forces: AxleForces, steady_residual: SteadyResidual) -> np.ndarray:
    """Which of the two steady accelerations (2,), heave and pitch, moves the vehicle farther during the run than a road
    does."""
    return steady_residual.is_beyond_uncertainty & (
        np.abs(steady_residual.accelerations) * axle_forces.duration**2 / 2 > [LARGEST_HEAVE, STEEPEST_GRADE]
    )


def _excess_text(axle_name: str, force_excess: float, load_share: float) -> str:
    """Text on the excess of an axle's mean force, in N and as a share of its load."""
    return (
        f"{axle_name} carries {abs(force_excess):.4g} N ({abs(load_share):.2%}) too "
        f"{'much' if force_excess > 0 else 'little'}"
    )


def _motion_text(axle_forces: AxleForces, steady_residual: SteadyResidual) -> str:
    """Text on how far the steady accelerations move the vehicle during the run."""
    risen, turned = steady_residual.accelerations * axle_forces.duration**2 / 2
    parts = (
        [f"{'rises' if risen > 0 else 'falls'} {abs(risen):.3g} m"] if steady_residual.is_beyond_uncertainty[0] else []
    )
    parts += (
        [f"turns {abs(turned):.3g} rad nose {'up' if turned > 0 else 'down'}"]
        if steady_residual.is_beyond_uncertainty[1]
        else []
    )
    return f"a vehicle free to move {' and '.join(parts)} in {axle_forces.duration:g} s"


def _start_in_motion_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding on forces that begin while the vehicle moves, although the run begins at rest."""
    first = axle_forces.forces[0] / axle_forces.static_loads - 1
    last = axle_forces.pitch_motion[1][
        min(len(axle_forces.forces) - 1, round(axle_forces.duration / axle_forces.period))
    ]
    if (
        not axle_forces.starts_at_rest
        or axle_forces.parameters.g == 0
        or np.abs(first).max() < START_FORCE_ERROR
        or abs(last) < max(STEEPEST_GRADE, _pitch_noise(axle_forces))
    ):
        return []
    text = (
        f"The run begins at rest, and the wheel forces {first[0]:+.1%} in front and {first[1]:+.1%} at the rear "
        "off the static loads: they begin in the middle of a motion, or are not of this vehicle, and turn it by "
        f"{last:+.3g} rad in {axle_forces.duration:g} s. Begin where the vehicle stands or drives on a smooth road, or "
        "give its state under [start]."
    )
    return [Finding("start", "doubt", "wheel forces", text, float(last), "rad", axle_forces.names)]


def _pitch_noise(axle_forces: AxleForces) -> float:
    """Four standard deviations (rad) of the pitch that the samples' white noise causes by the end of the run.

    The noise is estimated, as an upper bound, from the third differences of the forces, which are small for smooth
    signals.
    """
    rough = float(np.diff(axle_forces.forces, 3, axis=0).std()) / 20**0.5
    return (
        4
        * (axle_forces.rigid_pitch_body.noise_intensity(rough, axle_forces.period) * axle_forces.duration**3 / 3) ** 0.5
    )


def _constant_axle_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding on an axle whose force never changes while the other one's does."""
    still = np.ptp(axle_forces.forces, axis=0) == 0
    if still.all() or not still.any():
        return []
    axle = axle_forces.signals[int(still.argmax())][0]
    text = f"{axle.name} never changes while the other axle's force does: a dead channel, or one that was filled up."
    return [Finding("balance", "doubt", axle.at, text, 0.0, "N", (axle.name,))]


def _copied_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding on an axle whose samples equal the other axle's, times a factor."""
    off = axle_forces.forces - axle_forces.mean_forces
    size = np.sqrt(np.mean(off**2, axis=0))
    if not size.all() or np.sqrt(np.mean((off[:, 1] / size[1] - off[:, 0] / size[0]) ** 2)) > COPIED_RESIDUAL_SHARE:
        return []
    text = (
        f"The rear axle's force changes as the front axle's does, times {size[1] / size[0]:.4g}, in every sample: one "
        "channel was written twice, unless both axles were moved alike."
    )
    return [Finding("copied", "doubt", "wheel forces", text, float(size[1] / size[0]), "1", axle_forces.names)]


def _axle_order_finding(axle_forces: AxleForces) -> list[Finding]:
    """Finding on axles that meet the road's unevenness in the wrong order."""
    late, alike, other = _axle_delay(axle_forces)
    if alike < LEAST_REPETITION_CORRELATION or late > 0 or alike < 1.5 * other:
        return []
    text = (
        f"The rear axle feels the road {-late:.3g} s before the front axle (correlation {alike:.2f}): front and "
        "rear are exchanged, or time runs backwards, unless the vehicle drove so."
    )
    return [Finding("swapped", "doubt", "wheel forces", text, late, "s", axle_forces.names)]


def _axle_delay(axle_forces: AxleForces) -> tuple[float, float, float]:
    """Time (s) by which the rear axle's force repeats the front one's, the correlation at that delay, and the best
    correlation with opposite sign; 0 if the forces do not show any of this."""
    n = len(axle_forces.forces)
    frequencies = np.fft.rfftfreq(2 * n, axle_forces.period)
    band = (frequencies > COMMON_ROAD_BAND[0]) & (frequencies < COMMON_ROAD_BAND[1])
    spectra = np.fft.rfft(axle_forces.forces - axle_forces.mean_forces, 2 * n, axis=0) * band[:, None]
    power = np.sqrt(np.prod((np.abs(spectra) ** 2).sum(axis=0)))
    low, high = (round(lag / axle_forces.period) for lag in AXLE_LAG_RANGE)
    if not power > 0 or n < 2 * high:
        return 0.0, 0.0, 0.0
    alike = np.fft.irfft(spectra[:, 0].conj() * spectra[:, 1]) * n / power
    after, before = alike[low : high + 1], alike[-high : -low + 1 or None][::-1]
    best = before if before.max() > after.max() else after
    sign = -1 if best is before else 1
    other = after if best is before else before
    return sign * (low + int(best.argmax())) * axle_forces.period, float(best.max()), float(other.max())


def unchecked_delay_sentence(axle_forces: AxleForces) -> str:
    """Sentence on why these forces alone do not show the delay between the axles, and what would show it; "" for
    constant forces."""
    if not np.ptp(axle_forces.forces, axis=0).any():
        return ""
    late, alike, _ = _axle_delay(axle_forces)
    seen = ""
    if late > 0 and alike >= LEAST_REPETITION_CORRELATION:
        speed = (axle_forces.parameters.a + axle_forces.parameters.b) / late
        seen = f" (the rear repeats the front {late:.3g} s later, which is right for about {speed:.2g} m/s)"
    tells = "the driven speed tells, or a measured pitch (effect kalman_filter)"
    return f"not checked: whether an axle is late{seen}; {tells}"


def _weight_finding(axle_forces: AxleForces) -> Finding:
    """Finding that the mean wheel forces carry the vehicle's weight, with the errors that would be seen."""
    motion = equilibrium_residual(axle_forces)
    whole_load_effects = axle_forces.accelerations_per_newton[1] * axle_forces.static_loads
    text = (
        f"The mean wheel forces carry the vehicle to {motion.shares_of_load[0]:+.2%} of its weight; an error of "
        f"{100 * motion.uncertainties[0] / GRAVITY:.2g} % would be seen, of one axle of "
        f"{100 * abs(motion.uncertainties[1] / whole_load_effects).max():.2g} %."
    )
    return Finding("weight", "note", "", text, 100 * float(motion.shares_of_load[0]), "%", axle_forces.names)


def _axle_error_finding(
    axle_forces: AxleForces, check_name: str, finding_text: str, finding_size: float, unit: str
) -> Finding:
    """A finding of severity "error" on both axles' forces."""
    return Finding(check_name, "error", "wheel forces", finding_text, float(finding_size), unit, axle_forces.names)
