"""Check of mean vertical forces against the static loads and the weight: sign, unit and calibration."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg import null_space

from models.core.finding import Finding
from models.measured import axle_forces
from models.measured.axle_balance import axle_forces_of
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.response import component_index
from models.measured.checks.spectra import windowed_means
from models.measured.ratios import NEGLIGIBLE_MEAN_LOAD_SHARE, cause_and_sentence, missing_load_sentence
from models.measured.signal import MeasuredSignal
from models.multibody.cut_kernel import WRENCH
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle, rigid_vehicle

CHECK_NAME = "weight"
STATIC_LOAD_ERROR = 1e-3
"""Relative difference of a hub's load from the vehicle file that a correct vehicle may have: tilt alone takes 0.1 %."""
NEGLIGIBLE_LOAD_SHARE = 0.005
"""Share of a load below which an error is not reported."""
CONFIRMED_ERROR_SHARE = 0.35
"""Largest ratio of a factor's error, as the motion shows it, to the excess of the mean for which the excess is an
offset."""
MOMENT_STANDARD_DEVIATIONS = 4.0
"""Number of standard deviations by which a mean moment must differ from the one that the motion requires."""
LEAST_CHI_SQUARE_FALL = 25.0
"""Fall of chi square that a wrong channel must bring."""


@dataclass(frozen=True)
class EquilibriumResidual:
    """Residual (e,) of the equilibrium of mean forces: vertical force (N), moments about x and y (N m), and conditions
    from elasticity alone. load_columns (e, h) : residual that an excess of one whole load at each hub would cause.
    inverse_covariance (e, e) : of the residual's covariance."""

    residual: np.ndarray
    load_columns: np.ndarray
    inverse_covariance: np.ndarray

    def fit(self, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Generalised least-squares fit of columns (e, p) to the residual: their factors (p,), the covariance of these,
        and the fall of chi square."""
        normal = columns.T @ self.inverse_covariance @ columns
        share = np.linalg.solve(normal, columns.T @ self.inverse_covariance @ self.residual)
        return share, np.linalg.inv(normal), float(share @ normal @ share)


def check(checked_recording: CheckedRecording) -> list[Finding]:
    """Findings on mean vertical forces compared with the weight. Sizes are shares of the load in %, or the ratio of
    recorded to true value where sign or unit is wrong."""
    if checked_recording.pitch_plane_parameters is not None:
        forces = axle_forces_of(checked_recording.recording, checked_recording.pitch_plane_parameters)
        return axle_forces.check_axle_forces(forces) if forces else []
    vehicle, of_hub = (
        checked_recording.vehicle,
        {checked_recording.corrected_hub(s): s for s in checked_recording.vertical_force_signals().values()},
    )
    if vehicle is None or set(of_hub) != set(vehicle.hubs):
        text = "Not compared with the weight: this needs a vehicle in space and the vertical force of every hub."
        return [Finding(CHECK_NAME, "note", "", text)]
    signals = tuple(of_hub[hub] for hub in vehicle.hubs)
    numbers, means = (
        _component_indices(checked_recording, vehicle),
        windowed_means(_force_columns(checked_recording, vehicle)),
    )
    loads, static_loads = means[0][[numbers.index(WRENCH * i + 2) for i in range(len(signals))]], vehicle.loads
    coarse = [
        _wrong_sign_or_unit_finding(checked_recording, *each) for each in zip(signals, loads, static_loads, strict=True)
    ]
    if any(coarse):
        return [finding for finding in coarse if finding]
    return [
        _single_channel_error(checked_recording, _equilibrium_of_means(vehicle, numbers, *means), signals, static_loads)
    ]


def mean_hub_moments(checked_recording: CheckedRecording) -> np.ndarray:
    """Mean moments (2,) of the hub forces about x and y, N m, that the measured rates of roll and pitch contradict.
    They come from offsets, gains, or a load missing in the vehicle file. Both are 0 if they may be chance, or are
    unknown."""
    vehicle, none = checked_recording.vehicle, np.zeros(2)
    if (
        vehicle is None
        or checked_recording.frame == "inertial"
        or not _angular_acceleration_readers(checked_recording, vehicle)
    ):
        return none
    balanced = _equilibrium_of_means(
        vehicle,
        _component_indices(checked_recording, vehicle),
        *windowed_means(_force_columns(checked_recording, vehicle)),
    )
    residual, deviations = balanced.residual[1:3], np.sqrt(np.diag(np.linalg.inv(balanced.inverse_covariance)))[1:3]
    return residual if (np.abs(residual) > MOMENT_STANDARD_DEVIATIONS * deviations).any() else none


def _force_columns(checked_recording: CheckedRecording, vehicle: CutVehicle) -> list[Callable[[], np.ndarray]]:
    """Functions that read all hub forces, and the angular accelerations of roll and pitch."""
    forces: list[Callable[[], np.ndarray]] = [
        partial(checked_recording.recording.samples, s) for s in checked_recording.forces
    ]
    return forces + _angular_acceleration_readers(checked_recording, vehicle)


def _angular_acceleration_readers(
    checked_recording: CheckedRecording, vehicle: CutVehicle
) -> list[Callable[[], np.ndarray]]:
    """Functions that read the angular accelerations of roll and pitch from the chassis' gyros; empty if a gyro is
    missing."""
    recording = checked_recording.recording

    def slope(gyro: MeasuredSignal) -> np.ndarray:
        return np.gradient(recording.samples(gyro), recording.period)

    gyros = [recording.find_signals("angular rate", vehicle.chassis, axis)[:1] for axis in ("roll", "pitch")]
    return [partial(slope, gyro) for (gyro,) in gyros] if all(gyros) else []


def _component_indices(checked_recording: CheckedRecording, vehicle: CutVehicle) -> list[int]:
    """Indices (k,) of the measured components among the components of all hubs."""
    return [
        component_index(s, vehicle.hubs.index(checked_recording.corrected_hub(s))) for s in checked_recording.forces
    ]


def _wrong_sign_or_unit_finding(
    checked_recording: CheckedRecording, signal: MeasuredSignal, mean_load: float, static_load: float
) -> Finding | None:
    """Finding on a vertical force whose mean shows a wrong sign or unit; None if it shows none."""
    kind, text = (
        ("size", missing_load_sentence(signal.name, mean_load, static_load))
        if abs(mean_load) < NEGLIGIBLE_MEAN_LOAD_SHARE * static_load and checked_recording.has_negligible_mean(signal)
        else cause_and_sentence(
            mean_load / static_load, signal, f"the {static_load:.0f} N that rest on {signal.at} on average"
        )
    )
    if kind == "gain":
        return None
    return Finding(
        CHECK_NAME if kind == "size" else kind, "error", signal.name, text, mean_load / static_load, "1", (signal.name,)
    )


def _equilibrium_of_means(
    vehicle: CutVehicle, component_indices: list[int], centre: np.ndarray, spread: np.ndarray
) -> EquilibriumResidual:
    """Equilibrium from mean signals (k,), or (k + 2,) with the mean angular accelerations of roll and pitch, whose
    inertia moments are then taken into account."""
    whole, hubs = rigid_vehicle(vehicle), len(vehicle.hubs)
    unit = np.eye(WRENCH * hubs)[component_indices]
    turning = whole.moments(unit)[:, :2].T
    vertical = unit[:, 2::WRENCH].T
    lift = np.vstack([np.ones(hubs), whole.arms[:, 1], -whole.arms[:, 0]])
    elastic = null_space(lift).T
    rows = np.vstack([vertical.sum(axis=0), turning, elastic @ vertical])
    if len(centre) > len(component_indices):
        turned = np.zeros((len(rows), 2))
        turned[1:3] = -whole.inertia[:2, :2]
        rows = np.hstack([rows, turned])
    rest = np.concatenate([[whole.mass * GRAVITY, 0.0, 0.0], elastic @ vehicle.loads])
    columns = np.vstack([lift, elastic]) * vehicle.loads
    covariance = np.diag(np.diag(rows @ spread @ rows.T)) + STATIC_LOAD_ERROR**2 * columns @ columns.T
    return EquilibriumResidual(rows @ centre - rest, columns, np.linalg.inv(covariance))


def _single_channel_error(
    checked_recording: CheckedRecording,
    equilibrium: EquilibriumResidual,
    signals: tuple[MeasuredSignal, ...],
    static_loads: np.ndarray,
) -> Finding:
    """Finding on an offset or a wrong factor of one channel, or on a weight that differs from the vehicle file."""
    names, weight = tuple(s.name for s in signals), float(static_loads.sum())
    single = [equilibrium.fit(equilibrium.load_columns[:, [i]]) for i in range(len(signals))]
    worst = max(range(len(signals)), key=lambda i: single[i][2])
    force, error, fall = equilibrium.fit(np.eye(len(equilibrium.residual))[:, :3])
    sure = [float(uncertainty[0, 0]) ** 0.5 for _, uncertainty, _ in single]
    share, uncertainty = float(single[worst][0][0]), sure[worst]
    excess, known = float(force[0]) / weight, float(error[0, 0]) ** 0.5 / weight
    if (
        single[worst][2] > LEAST_CHI_SQUARE_FALL
        and abs(share) > max(NEGLIGIBLE_LOAD_SHARE, 4 * uncertainty)
        and single[worst][2] > fall - LEAST_CHI_SQUARE_FALL
    ):
        signal, size = signals[worst], share * static_loads[worst]
        if _motion_confirms_factor(checked_recording, signal, share):
            return _offset_finding(signal, size, uncertainty * static_loads[worst])
        _, text = cause_and_sentence(
            1 + share, signal, f"the {static_loads[worst]:.0f} N that rest on {signal.at} on average"
        )
        text += (
            f" The mean is known to {2 * uncertainty:.2%} (95 %), and what is too much acts at this hub alone; an "
            f"offset of {size:+.3g} N would do the same."
        )
        return Finding("gain", "doubt", signal.name, text, 100 * share, "%", (signal.name,))
    if fall > LEAST_CHI_SQUARE_FALL and max(abs(excess), float(np.abs(force[1:]).max()) / weight) > max(
        NEGLIGIBLE_LOAD_SHARE, 4 * known
    ):
        text = (
            f"The mean vertical forces carry {force[0]:+.0f} N ({excess:+.2%}, +-{2 * known:.2%} at 95 %) more than "
            f"the vehicle file weighs, with moments of {force[1]:+.0f} N m in roll and {force[2]:+.0f} N m in pitch: "
            "enter the load that was on board into the vehicle file, or check the calibration of all wheels."
        )
        return Finding(CHECK_NAME, "doubt", "", text, 100 * excess, "%", names)
    text = (
        f"The mean vertical forces carry the vehicle's weight of {weight:.0f} N to {excess:+.2%} (+-{2 * known:.2%} "
        f"at 95 %); a channel that is wrong by {max(100 * NEGLIGIBLE_LOAD_SHARE, 500 * max(sure)):.2g} % would be seen."
    )
    return Finding(CHECK_NAME, "note", "", text, 100 * excess, "%", names)


def _motion_confirms_factor(
    checked_recording: CheckedRecording, signal: MeasuredSignal, suggested_error: float
) -> bool:
    """Whether the vehicle's motion shows that a channel's factor is right, although the mean suggests an error of this
    share."""
    if checked_recording.agreement_and_faults is None or any(
        signal in f.signals for f in checked_recording.faults if f.kind == "factor"
    ):
        return False
    ratio, error = checked_recording.agreement_and_faults[0].factor_of_force(signal)
    return 4 * error < abs(suggested_error) and abs(ratio - 1) < CONFIRMED_ERROR_SHARE * abs(suggested_error)


def _offset_finding(signal: MeasuredSignal, force_offset: float, offset_uncertainty: float) -> Finding:
    """Finding on a constant error (N) of one channel."""
    zero = force_offset / (signal.sign * signal.factor)
    word = "much" if force_offset > 0 else "little"
    text = (
        f"{signal.name} reads {abs(force_offset):.3g} N too {word} (+-{2 * offset_uncertainty:.2g} N at 95 %) on "
        "average, while its "
        f"factor is right by the motion of the vehicle: an offset; give it zero = {signal.zero + zero:.4g} in the "
        "channel map."
    )
    return Finding("offset", "doubt", signal.name, text, force_offset, "N", (signal.name,))
