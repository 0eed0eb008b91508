"""Faults that a virtual measurement adds to the true signals: gain, bias, delay, noise, quantisation, dropouts.

Nothing that is not named acts. An amount is given to a channel, to all channels of a transducer (what a signal is
``at``) or to all of a quantity; the closest name counts. Every channel has its own stream of noise, so that a further
channel changes none of the others.
"""

from collections.abc import Iterable
from zlib import crc32

import numpy as np
from pydantic import Field

from models.core.errors import InputError, suggestion_phrase
from models.core.noise import DROPOUTS, TRANSDUCERS, normal_samples
from models.core.strict import Strict, quantity
from models.measured.signal import MeasuredSignal

Amounts = dict[str, float]
"""Amounts of a fault in SI units, by name of a channel, a transducer or a quantity."""
FAULT_AMOUNTS = ("gain", "bias", "delay", "noise")
"""Names of the faults that have an amount for each signal."""
FULL_SCALE_RATIO = 1.25
"""Ratio of a quantised channel's full scale to its largest value: an amplifier is not driven to its limit."""


class Quantisation(Strict):
    """[virtual.quantisation]: values are rounded to the steps of a converter."""

    bits: int = Field(ge=2, le=32, description="of the converter; its range is 1.25 times a channel's largest value")
    channels: list[str] = Field(default=[], description="channels, transducers or quantities; none named: all")


class Dropouts(Strict):
    """[virtual.dropouts]: a transducer falls silent, with all its channels at once."""

    rate: float = quantity("1/s", "mean number of dropouts of each transducer")
    length: float = quantity("s", "of a dropout")
    channels: list[str] = Field(default=[], description="channels, transducers or quantities; none named: all")


class SimulatedFaults(Strict):
    """[virtual.faults]: faults that are added to each channel's true signal; a fault that is not named is absent."""

    gain: Amounts = Field(default={}, description="relative error of the factor, 0.02 for 2 % too much")
    bias: Amounts = Field(default={}, description="added, in SI")
    delay: Amounts = Field(default={}, description="s, by which a channel is late")
    noise: Amounts = Field(default={}, description="standard deviation of white noise on every sample, in SI")
    quantisation: Quantisation | None = Field(default=None, description="rounding to the steps of a converter")
    dropouts: Dropouts | None = Field(default=None, description="gaps, all channels of a transducer at once")


def amount_of_fault(fault_amounts: Amounts, signal: MeasuredSignal) -> float:
    """Amount of a fault for a signal in a scene: the value for its channel, else for its transducer, else for its
    quantity, else 0."""
    return next((fault_amounts[name] for name in _names_of_signal(signal) if name in fault_amounts), 0.0)


def check_faults(
    faults: SimulatedFaults, signals: Iterable[MeasuredSignal], scene_path: str = "", key_path: str = "virtual.faults"
) -> None:
    """Raise InputError for a fault with a name that no signal has, a negative noise or a negative delay."""
    known = tuple(dict.fromkeys(name for signal in signals for name in _names_of_signal(signal)))
    amounts, lists = {kind: getattr(faults, kind) for kind in FAULT_AMOUNTS}, (faults.quantisation, faults.dropouts)
    named = [(kind, name) for kind, listed in amounts.items() for name in listed]
    for kind, listed in zip(("quantisation", "dropouts"), lists, strict=True):
        named += [(f"{kind}.channels", name) for name in listed.channels] if listed else []
    for kind, name in named:
        if name not in known:
            wrong = f"no such channel, transducer or quantity{suggestion_phrase(name, known)}"
            raise InputError(scene_path, f"{key_path}.{kind}", name, wrong)
    for kind in ("noise", "delay"):
        for name, value in amounts[kind].items():
            if value < 0:
                raise InputError(scene_path, f"{key_path}.{kind}.{name}", value, "must be 0 or more")


def measured_samples(
    faults: SimulatedFaults,
    signals: tuple[MeasuredSignal, ...],
    true_values: np.ndarray,
    time_step: float,
    sample_stride: int,
    seed: int,
    path_number: int = 0,
) -> np.ndarray:
    """Measured samples (m, signals): every ``sample_stride``-th row of the true values (n, signals), which are
    ``time_step`` (s) apart, with all faults; NaN where a sample is lost.

    seed and path_number determine the noise: the same ones give the same samples, whoever asks.
    """
    period = time_step * sample_stride
    columns = []
    for signal, true in zip(signals, true_values.T, strict=True):
        late = amount_of_fault(faults.delay, signal)
        values = (1.0 + amount_of_fault(faults.gain, signal)) * _delayed_samples(
            true, time_step, sample_stride, late
        ) + amount_of_fault(faults.bias, signal)
        values = values + amount_of_fault(faults.noise, signal) * _random_stream(
            signal.channel, seed, path_number, len(values), TRANSDUCERS
        )
        if faults.quantisation and _is_named(faults.quantisation.channels, signal):
            values = quantised_values(values, faults.quantisation.bits)
        if faults.dropouts and _is_named(faults.dropouts.channels, signal):
            values[lost_samples(faults.dropouts, signal.at, seed, path_number, len(values), period)] = np.nan
        columns.append(values)
    return np.column_stack(columns)


def quantised_values(true_values: np.ndarray, bits: int) -> np.ndarray:
    """Values (n,) rounded to the steps of a converter with this number of bits, whose range is a little larger than the
    largest value."""
    largest = float(np.abs(true_values).max())
    if largest == 0.0:
        return true_values
    quantum = 2.0 * FULL_SCALE_RATIO * largest / 2**bits
    return quantum * np.rint(true_values / quantum)


def lost_samples(
    dropouts: Dropouts, transducer_name: str, seed: int, path_number: int, sample_count: int, sampling_period: float
) -> np.ndarray:
    """Whether each of ``sample_count`` samples of a transducer is lost (count,); the first and the last one never
    are.
    """
    from scipy.stats import norm

    begins = _random_stream(transducer_name, seed, path_number, sample_count, DROPOUTS) > norm.isf(
        min(dropouts.rate * sampling_period, 1.0)
    )
    length = max(round(dropouts.length / sampling_period), 1)
    lost = np.convolve(begins, np.ones(length))[:sample_count] > 0.5
    lost[[0, -1]] = False
    return lost


def _delayed_samples(true_samples: np.ndarray, time_step: float, sample_stride: int, delay: float) -> np.ndarray:
    """Every ``sample_stride``-th sample of a true signal, delayed by ``delay`` (s); before the start, the value stays
    at the first sample."""
    if delay == 0.0:
        return true_samples[::sample_stride].copy()
    late_times = np.maximum(time_step * sample_stride * np.arange(len(true_samples[::sample_stride])) - delay, 0.0)
    from scipy.interpolate import make_interp_spline

    return np.asarray(make_interp_spline(time_step * np.arange(len(true_samples)), true_samples, k=3)(late_times))


def _random_stream(stream_name: str, seed: int, path_number: int, sample_count: int, source_number: int) -> np.ndarray:
    """Standard normal random samples (count,) that depend only on seed, path_number, source_number and stream_name."""
    return normal_samples(
        seed, (path_number << 32) + crc32(stream_name.encode()), sample_count, 1, noise_source=source_number
    )[:, 0]


def _names_of_signal(signal: MeasuredSignal) -> tuple[str, ...]:
    """Names by which a scene can refer to a signal: its channel, its transducer, its quantity."""
    return signal.channel, signal.at, signal.quantity


def _is_named(listed_names: list[str], signal: MeasuredSignal) -> bool:
    """Whether a list of names includes a signal; an empty list includes all."""
    return not listed_names or not set(listed_names).isdisjoint(_names_of_signal(signal))
