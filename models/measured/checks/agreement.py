"""Agreement of hub forces with inertial signals through the vehicle's response, by cross spectra.

Expected readings are the vehicle's response to all measured forces. What a channel, or all channels of a hub or a
file, accounts for is set against what is left of the readings when all others are taken off: where the two correlate
best is the time by which that channel is late, and their ratio, in least squares, the factor by which it is wrong. The
one fault that leaves least unexplained is taken out, and the search begins anew, until none is worth its name.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any, Literal

import numpy as np

from models.measured.signal import MeasuredSignal

FaultKind = Literal["late", "factor", "swapped", "crossed", "lever"]
"""Kinds of measurement faults that the search can find."""
LEAST_VEHICLE_ERROR = 0.03
"""Least relative error of an expected reading that is attributed to the vehicle file."""
LARGEST_DELAY, DELAY_SPACING = 0.25, 5e-4
"""Largest delay (s) searched, and spacing (s) of the trial delays before a parabola through the best three."""
TRIAL_DELAYS = DELAY_SPACING * np.arange(
    -round(LARGEST_DELAY / DELAY_SPACING), round(LARGEST_DELAY / DELAY_SPACING) + 1
)
"""Trial delays (s)."""
LEAST_CHI_SQUARE_FALL = 40.0
"""Fall of chi square that one more parameter must bring: by chance it occurs once in 10^9."""
SMALL_DELAY, SMALL_FACTOR, SMALL_LEVER = 5e-4, 0.01, 0.01
"""Delay (s), relative error of a factor, and lever (m) below which a fault is harmless and not reported."""
LEAST_EXPLAINED_SHARE = 0.35
"""Share of the unexplained power of some reading that a fault must explain: springs 20 % stiffer than in the file, or
dampers 30 % weaker, leave a sixth of the readings unexplained, and wrong delays explain up to a third of that."""
FAULT_COUNT_LIMIT = 8
"""Most faults that are searched for."""
SMALLEST_FLOAT = float(np.finfo(float).tiny)
SMOOTHED_LINE_COUNT = 9
"""Number of spectral lines over which the unexplained power is averaged."""


@dataclass(frozen=True)
class SignalGroup:
    """Signals that share a fault. forces : whether they are hub forces rather than readings; member_indices : their
    indices among the forces or the readings."""

    name: str
    forces: bool
    member_indices: tuple[int, ...]


@dataclass(frozen=True)
class MeasurementFault:
    """One measurement fault with its kind and size. late : delay in s; factor : ratio of recorded to true value;
    swapped (hubs) and crossed (two channels) : share of the motion left unexplained as mapped; lever : height (m) above
    the hub of the point to which moments refer.

    error : standard error of the size from random errors alone; for swapped and crossed, the unexplained share after
    correction. chi_square_fall : decrease of chi square. exchanged_hubs : hubs, each with the one whose channels it
    has.
    """

    kind: FaultKind
    name: str
    signals: tuple[MeasuredSignal, ...]
    size: float
    error: float
    chi_square_fall: float
    exchanged_hubs: tuple[tuple[str, str], ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the signals with the fault."""
        return tuple(signal.name for signal in self.signals)


@dataclass(frozen=True)
class MotionAgreement:
    """Measured cross spectra of hub forces and inertial readings, compared with the vehicle's response, at frequencies
    (f,) in Hz.

    cross_spectra (f, k, c) : mean of reading times conj(force); forces (f, c, c); reading_powers (f, k). response
    (f, k, c) : of the vehicle, with every correction so far. independent_averages : independent ones in each mean.
    noise_powers (k,) : power of the readings' white noise in every line.
    """

    frequencies: np.ndarray
    force_signals: tuple[MeasuredSignal, ...]
    reading_signals: tuple[MeasuredSignal, ...]
    forces: np.ndarray
    cross_spectra: np.ndarray
    reading_powers: np.ndarray
    response: np.ndarray
    independent_averages: float
    noise_powers: np.ndarray

    @cached_property
    def hubs(self) -> tuple[str, ...]:
        """Names of the hubs at which the forces act."""
        return tuple(dict.fromkeys(s.at for s in self.force_signals))

    @cached_property
    def force_indices(self) -> dict[tuple[str, str, str], int]:
        """Index of each force, by its hub, quantity and component."""
        return {(s.at, s.quantity, s.component): i for i, s in enumerate(self.force_signals)}

    @cached_property
    def predicted_powers(self) -> np.ndarray:
        """Spectral powers (frequencies, signals) of the readings that the measured forces predict."""
        return np.einsum("fkc,fkc->fk", self._expected_times_forces, self.response.conj()).real

    @property
    def residual_powers(self) -> np.ndarray:
        """Powers (f, k) of the residual: the measured readings less the prediction."""
        shared = np.einsum("fkc,fkc->fk", self.cross_spectra, self.response.conj()).real
        return np.maximum(self.reading_powers - 2 * shared + self.predicted_powers, 0.0)

    @property
    def unexplained_shares(self) -> np.ndarray:
        """Square root (k,) of the share of each reading's power, without noise, that the forces do not explain."""
        noise = len(self.frequencies) * self.noise_powers
        share = (self.residual_powers.sum(axis=0) - noise) / np.maximum(
            self.reading_powers.sum(axis=0) - noise, noise + SMALLEST_FLOAT
        )
        return np.sqrt(np.maximum(share, 0.0))

    def median_unexplained(self) -> float:
        """Median over the readings of the unexplained share of motion."""
        return float(np.median(self.unexplained_shares))

    @property
    def unexplained_rms(self) -> float:
        """Root mean square over the readings of the unexplained share of motion."""
        return float(np.sqrt(np.mean(self.unexplained_shares**2)))

    @property
    def weights(self) -> np.ndarray:
        """Weights (f, k) of the frequencies: inverse of the smoothed unexplained power, so that a line that no force
        explains counts little."""
        kernel = np.ones(SMOOTHED_LINE_COUNT) / SMOOTHED_LINE_COUNT
        known = LEAST_VEHICLE_ERROR**2 * np.maximum(self.predicted_powers, 1e-3 * self.predicted_powers.mean(axis=0))
        padded = np.pad(
            self.residual_powers + known, ((SMOOTHED_LINE_COUNT // 2, SMOOTHED_LINE_COUNT // 2), (0, 0)), mode="edge"
        )
        smooth = [np.convolve(row, kernel, "valid") for row in padded.T]
        return self.independent_averages / np.maximum(np.stack(smooth, axis=1), SMALLEST_FLOAT)

    def search_faults(self) -> tuple["MotionAgreement", tuple[MeasurementFault, ...]]:
        """The ``MotionAgreement`` after correction of all faults that the search finds, and these faults, the worst
        first.
        """
        agreement, faults = self, list[MeasurementFault]()
        while len(faults) < FAULT_COUNT_LIMIT:
            worst_fault = max(agreement._explaining_faults(), key=lambda fault: fault.chi_square_fall, default=None)
            if worst_fault is None:
                break
            faults.append(worst_fault)
            agreement = agreement.corrected_for(worst_fault)
        return agreement, tuple(faults)

    def corrected_for(self, fault: MeasurementFault) -> "MotionAgreement":
        """The agreement after correction: the response divided by a force's or multiplied by a reading's fault."""
        response = self.response.copy()
        if fault.kind == "swapped":
            target_hub = dict(fault.exchanged_hubs)
            order = [
                self.force_indices[target_hub.get(s.at, s.at), s.quantity, s.component] for s in self.force_signals
            ]
            return replace(self, response=response[:, :, order])
        if fault.kind == "crossed":
            return self._with_channels_exchanged(fault.signals)
        if fault.kind == "lever":
            hubs = tuple(dict.fromkeys(s.at for s in fault.signals))
            return replace(self, response=response + fault.size * self._height_derivatives(hubs))
        turn = 2j * np.pi * self.frequencies
        fault_factor = np.exp(-turn * fault.size) if fault.kind == "late" else np.full(len(turn), fault.size, complex)
        forces, index = self._indices_of(fault.signals)
        response[index] *= (1 / fault_factor if forces else fault_factor)[:, None, None]
        return replace(self, response=response)

    def _indices_of(self, signals: tuple[MeasuredSignal, ...]) -> tuple[bool, Any]:
        """Whether the signals are forces, and the index of their rows or columns in the response (f, k, c)."""
        forces = signals[0] in self.force_signals
        pick = [(self.force_signals if forces else self.reading_signals).index(s) for s in signals]
        return forces, (slice(None), slice(None), pick) if forces else (slice(None), pick)

    def _explaining_faults(self) -> Iterator[MeasurementFault]:
        """Every single fault whose correction would reduce the residual and whose size is large enough to be named."""
        weights = self.weights
        for group in self.signal_groups():
            for fault in (*self._delay_faults(group, weights), *self._factor_faults(group, weights)):
                if self._is_worth_correcting(self.corrected_for(fault), weights):
                    yield fault
        yield from self._swapped_hub_faults(weights)
        yield from self._exchanged_channel_faults(weights)
        yield from self._moment_point_faults(weights)

    def signal_groups(self) -> Iterator[SignalGroup]:
        """Groups of signals that may share a fault, small ones first: each signal, each hub, sensor and file, all
        readings."""
        for forces, signals in ((True, self.force_signals), (False, self.reading_signals)):
            keys = [[s.name for s in signals], [f"all channels of {s.at}" for s in signals]]
            if not forces:
                keys += [[f"all {s.quantity} channels" for s in signals], ["all inertial channels"] * len(signals)]
            keys.append([f"all channels of {s.file}" for s in signals])
            seen = set[tuple[int, ...]]()
            for names in keys:
                for name in dict.fromkeys(names):
                    of_name = tuple(i for i, other in enumerate(names) if other == name)
                    if of_name not in seen and not (forces and len(of_name) == len(signals)):
                        seen.add(of_name)
                        yield SignalGroup(name, forces, of_name)

    @cached_property
    def _expected_times_forces(self) -> np.ndarray:
        """Cross spectra (f, k, c): predicted readings times conj(forces)."""
        return self.response @ self.forces

    @cached_property
    def _delay_factors(self) -> np.ndarray:
        """Phase factors exp(i omega t), shape (t, f), of all trial delays t."""
        return np.exp(2j * np.pi * np.outer(TRIAL_DELAYS, self.frequencies))

    def cross_and_own_power(self, signal_group: SignalGroup) -> tuple[np.ndarray, np.ndarray]:
        """Cross power (f, k) of a group's prediction with the readings less other predictions, and its own power."""
        pick = list(signal_group.member_indices)
        if signal_group.forces:
            response, group_forces = self.response[:, :, pick], self.forces[:, pick][:, :, pick]
            remainder = (
                self.cross_spectra[:, :, pick] - self._expected_times_forces[:, :, pick] + response @ group_forces
            )
            return np.einsum("fkc,fkc->fk", remainder, response.conj()), _power_spectrum(response, group_forces)
        cross, power = np.zeros((2, *self.reading_powers.shape), complex)
        response = self.response[:, pick]
        cross[:, pick] = np.einsum("fkc,fkc->fk", self.cross_spectra[:, pick], response.conj())
        power[:, pick] = np.einsum("fkc,fkc->fk", self._expected_times_forces[:, pick], response.conj())
        return cross, power.real

    def delay_of_group(self, signal_group: SignalGroup, frequency_weights: np.ndarray) -> tuple[float, float, float]:
        """Delay (s) of a group of signals, its standard error (infinite if unknown), and the fall of chi square."""
        cross, power = self.cross_and_own_power(signal_group)
        line = (frequency_weights * (cross.conj() if signal_group.forces else cross)).sum(axis=1)
        likely = (self._delay_factors @ line).real
        best = int(np.argmax(likely[1:-1])) + 1
        late = float(TRIAL_DELAYS[best] + DELAY_SPACING * _parabola_vertex(*likely[best - 1 : best + 2]))
        turn = 2j * np.pi * self.frequencies
        fall = 2 * float((np.exp(turn * late) @ line - line.sum()).real)
        steep = 2 * float((np.abs(turn) ** 2 @ (frequency_weights * power)).sum())
        return late, steep**-0.5 if steep > 0 else float("inf"), fall

    def _delay_faults(self, signal_group: SignalGroup, frequency_weights: np.ndarray) -> Iterator[MeasurementFault]:
        late, error, fall = self.delay_of_group(signal_group, frequency_weights)
        if fall > LEAST_CHI_SQUARE_FALL and abs(late) > max(SMALL_DELAY, 4 * error):
            yield MeasurementFault("late", signal_group.name, self._signals_of_group(signal_group), late, error, fall)

    def _factor_faults(self, signal_group: SignalGroup, frequency_weights: np.ndarray) -> Iterator[MeasurementFault]:
        cross, power = ((frequency_weights * part).sum() for part in self.cross_and_own_power(signal_group))
        ratio = float(cross.real / power) if power > 0 else 0.0
        if ratio == 0.0:
            return
        fall, error = float(power) * (ratio - 1) ** 2, float(2 * power) ** -0.5
        factor = 1 / ratio if signal_group.forces else ratio
        if fall > LEAST_CHI_SQUARE_FALL and abs(ratio - 1) > max(SMALL_FACTOR, 4 * error):
            yield MeasurementFault(
                "factor",
                signal_group.name,
                self._signals_of_group(signal_group),
                factor,
                error * abs(factor / ratio),
                fall,
            )

    def _moment_point_faults(self, frequency_weights: np.ndarray) -> Iterator[MeasurementFault]:
        """Faults of hub moments that refer to a point above or below the hub: at one hub, at two, or equally at all."""
        for some in (self.hubs, *combinations(self.hubs, 2), *((hub,) for hub in self.hubs)):
            signals = tuple(
                s for s in self.force_signals if s.at in some and s.quantity == "moment" and s.component in "xy"
            )
            levers = self._height_derivatives(some)
            power = float((frequency_weights * _power_spectrum(levers, self.forces)).sum())
            if not power > 0:
                continue
            rest = self.cross_spectra - self._expected_times_forces
            size = float((frequency_weights * np.einsum("fkc,fkc->fk", rest, levers.conj()).real).sum()) / power
            fault = MeasurementFault("lever", " and ".join(some), signals, size, (2 * power) ** -0.5, power * size**2)
            large = fault.chi_square_fall > LEAST_CHI_SQUARE_FALL and abs(size) > max(SMALL_LEVER, 4 * fault.error)
            if large and self._is_worth_correcting(self.corrected_for(fault), frequency_weights):
                yield fault

    def _height_derivatives(self, hub_names: tuple[str, ...]) -> np.ndarray:
        """Change of the response (f, k, c) per metre of height of the point about which hub moments are given.

        About a point r above the hub a force adds (r Fy, -r Fx) to the moments about it, which the response undoes.
        """
        out = np.zeros_like(self.response)
        for hub in hub_names:
            for axis, other, sign in (("x", "y", -1.0), ("y", "x", 1.0)):
                moment, force = (
                    self.force_indices.get((hub, "moment", axis)),
                    self.force_indices.get((hub, "force", other)),
                )
                if moment is not None and force is not None:
                    out[:, :, force] += sign * self.response[:, :, moment]
        return out

    def _swapped_hub_faults(self, frequency_weights: np.ndarray) -> Iterator[MeasurementFault]:
        """Faults in which hubs have exchanged their channels: two hubs, or two pairs of hubs."""
        pairs = list(combinations(self.hubs, 2))
        twice = [(a, b) for a, b in combinations(pairs, 2) if not set(a) & set(b)]
        chi_square = float((frequency_weights * self.residual_powers).sum())
        for exchanged in (*((pair,) for pair in pairs), *twice):
            fault = self._exchange_fault(exchanged)
            if fault is not None:
                corrected = self.corrected_for(fault)
                fall = chi_square - float((frequency_weights * corrected.residual_powers).sum())
                if fall > LEAST_CHI_SQUARE_FALL and corrected.residual_powers.sum() < self.residual_powers.sum():
                    yield replace(
                        fault, size=self.unexplained_rms, error=corrected.unexplained_rms, chi_square_fall=fall
                    )

    def _exchanged_channel_faults(self, frequency_weights: np.ndarray) -> Iterator[MeasurementFault]:
        """Faults in which two channels are exchanged with each other."""
        for pair, other in self._channel_exchanges():
            fall = self._certain_improvement(other, frequency_weights)
            if fall:
                yield MeasurementFault(
                    "crossed",
                    " and ".join(s.name for s in pair),
                    pair,
                    self.unexplained_rms,
                    other.unexplained_rms,
                    fall,
                )

    def undetectable_exchanges(self) -> list[tuple[MeasuredSignal, ...]]:
        """Pairs of forces or moments along one axis whose exchange this recording could not reveal."""
        alike = ((pair, other) for pair, other in self._channel_exchanges() if len({s.component for s in pair}) == 1)
        return [
            pair
            for pair, other in alike
            if pair[0] in self.force_signals and not other._certain_improvement(self, other.weights)
        ]

    def _channel_exchanges(self) -> Iterator[tuple[tuple[MeasuredSignal, ...], "MotionAgreement"]]:
        """Pairs of channels of one quantity with a common place or axis, each with the agreement after their
        exchange."""
        for side in (self.force_signals, self.reading_signals):
            for pair in combinations(side, 2):
                what, at, axis = (len({getattr(s, key) for s in pair}) for key in ("quantity", "at", "component"))
                if what == 1 and (at == 1 or axis == 1):
                    yield pair, self._with_channels_exchanged(pair)

    def _certain_improvement(self, corrected_agreement: "MotionAgreement", frequency_weights: np.ndarray) -> float:
        """Fall of chi square from this agreement to the corrected one; 0 if it is not significant or explains too
        little of every reading."""
        fall = float((frequency_weights * (self.residual_powers - corrected_agreement.residual_powers)).sum())
        return (
            fall
            if fall > LEAST_CHI_SQUARE_FALL and self._is_worth_correcting(corrected_agreement, frequency_weights)
            else 0.0
        )

    def _with_channels_exchanged(self, channel_pair: tuple[MeasuredSignal, ...]) -> "MotionAgreement":
        """The agreement with two channels exchanged; both are forces, or both are readings."""
        response = self.response.copy()
        response[self._indices_of(channel_pair)[1]] = self.response[self._indices_of(channel_pair[::-1])[1]]
        return replace(self, response=response)

    def _exchange_fault(self, exchanged_hubs: tuple[tuple[str, str], ...]) -> MeasurementFault | None:
        """The fault that describes exchanged pairs of hubs; None if the hubs have different channels."""
        both = tuple(way for a, b in exchanged_hubs for way in ((a, b), (b, a)))
        signals = tuple(s for s in self.force_signals if s.at in dict(both))
        keys = {(s.at, s.quantity, s.component) for s in signals}
        if {(dict(both)[at], quantity, component) for at, quantity, component in keys} != keys:
            return None
        return MeasurementFault(
            "swapped", " and ".join(f"{a} with {b}" for a, b in exchanged_hubs), signals, 0.0, 0.0, 0.0, both
        )

    def detectable_sizes(self) -> dict[str, tuple[float, float]]:
        """By signal name: smallest detectable delay (s) and smallest detectable relative error of the factor of this
        signal alone."""
        weights, square = self.weights, (2 * np.pi * self.frequencies) ** 2
        rest, smallest = LEAST_EXPLAINED_SHARE * self._unexplained_power(weights), {}
        with np.errstate(divide="ignore", invalid="ignore"):
            for group in (group for group in self.signal_groups() if len(group.member_indices) == 1):
                power = weights * self.cross_and_own_power(group)[1]
                late, wrong = square @ power, power.sum(axis=0)
                smallest[group.name] = (
                    _smallest_significant_size(late, rest, SMALL_DELAY),
                    _smallest_significant_size(wrong, rest, SMALL_FACTOR),
                )
        return smallest

    def factor_of_force(self, signal: MeasuredSignal) -> tuple[float, float]:
        """Ratio of a force's recorded to true value as the vehicle's motion shows it, and its standard error."""
        group = SignalGroup(signal.name, True, (self.force_signals.index(signal),))
        cross, power = ((self.weights * part).sum() for part in self.cross_and_own_power(group))
        return (float(power / cross.real), float(2 * power) ** -0.5) if power > 0 else (1.0, float("inf"))

    def _unexplained_power(self, frequency_weights: np.ndarray) -> np.ndarray:
        """Weighted power (k,) of each reading that neither the forces nor noise explain."""
        return np.maximum((frequency_weights * (self.residual_powers - self.noise_powers)).sum(axis=0), 0.0)

    def _is_worth_correcting(self, corrected_agreement: "MotionAgreement", frequency_weights: np.ndarray) -> bool:
        """Whether a correction removes much of the residual of at least one reading, not only a little of every one."""
        return bool(
            np.any(
                ((self.residual_powers - corrected_agreement.residual_powers) * frequency_weights).sum(axis=0)
                > LEAST_EXPLAINED_SHARE * self._unexplained_power(frequency_weights)
            )
        )

    def _signals_of_group(self, signal_group: SignalGroup) -> tuple[MeasuredSignal, ...]:
        return tuple(
            (self.force_signals if signal_group.forces else self.reading_signals)[i]
            for i in signal_group.member_indices
        )


def _smallest_significant_size(fault_power: np.ndarray, residual_power: np.ndarray, least_size: float) -> float:
    """Smallest significant size of a fault, if each reading's residual (k,) falls by ``fault_power`` times its
    square.
    """
    if not fault_power.sum() > 0:
        return float("inf")
    return max(
        least_size,
        float((LEAST_CHI_SQUARE_FALL / fault_power.sum()) ** 0.5),
        float(np.nanmin((residual_power / fault_power) ** 0.5)),
    )


def _power_spectrum(response: np.ndarray, force_spectra: np.ndarray) -> np.ndarray:
    """Power (f, k) of the readings that forces (f, c, c) cause through a response (f, k, c)."""
    return np.einsum("fkc,fkc->fk", response @ force_spectra, response.conj()).real


def _parabola_vertex(value_before: float, value_between: float, value_after: float) -> float:
    """Position of the vertex of the parabola through three values at -1, 0 and 1."""
    bend = value_before - 2 * value_between + value_after
    return 0.5 * (value_before - value_after) / bend if bend < 0 else 0.0
