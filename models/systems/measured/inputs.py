"""Inputs of a vehicle from a recording: hub forces and angles at samples, and interpolated at half steps.

Every number depends on the samples about it alone, never on where a block begins: a run in blocks reads the same bits
as a run in one piece. Between samples hub forces follow the cubic through the four about it: a straight line takes 1 to
2 % off the damage of bushes at 500 Hz. Gaps of at most ``LONGEST_BRIDGED_GAP`` s in a hub force are bridged (see
``gaps``) and reported; longer ones are refused. Gaps in angles and rates are left to the filter; before angles are
enforced their gaps are bridged, too.
"""

from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.core.piecewise import interpolated_rows
from models.core.signals import Smooth
from models.core.smoothing import low_passed
from models.measured.gaps import bridged_signals
from models.measured.recording import Recording
from models.measured.signal import HUB_COMPONENTS, MeasuredSignal
from models.multibody.cut_kernel import FRAMES, WRENCH
from models.vehicles.cut_vehicle import CutVehicle

ANGLE_SIGNALS = tuple(product(("angle", "angular rate"), ("roll", "pitch")))
SPLINE_WINDOW, SPLINE_OVERLAP = 4096, 96
"""Output samples per window of a spline, and samples on either side that are included; farther samples have weights
below 1e-30."""


@dataclass(frozen=True)
class StepGrid:
    """Time steps of a run in relation to the samples of a recording. step : time step (s); period : sampling period
    (s).

    A half step is ``half_step_ratio`` of a sampling period; output samples are ``steps_per_output`` steps and
    ``samples_per_output`` samples of the recording apart.
    """

    step: float
    period: float

    @property
    def half_step_ratio(self) -> Fraction:
        """Ratio of half a step to the sampling period."""
        return Fraction(self.step / (2 * self.period)).limit_denominator(1000)

    @property
    def steps_per_output(self) -> int:
        """Number of time steps between output samples."""
        return max(round(self.period / self.step), 1)

    @property
    def samples_per_output(self) -> int:
        """Number of samples of the recording between output samples."""
        return max(round(self.step / self.period), 1)

    def check(self, named_file: str = "") -> None:
        """Raise InputError unless the time step is a multiple of the sampling period, or the period of the step."""
        ratio = max(self.step / self.period, self.period / self.step)
        if abs(ratio - round(ratio)) > 1e-9 * ratio:
            fitting = f"must be a part or a multiple of the recording's period of {self.period:g} s"
            raise InputError(named_file, "run.step", self.step, fitting)

    def rows(self, sample_rows: np.ndarray, half_step_count: int) -> np.ndarray:
        """Interpolates ``sample_rows`` (n, columns) linearly at half steps 0 .. count - 1 after the first sample."""
        return interpolated_rows(sample_rows, *self._samples_before(half_step_count))

    def cubic_rows(self, sample_rows: np.ndarray, half_step_count: int) -> np.ndarray:
        """Interpolates ``sample_rows`` (n, columns) at half steps 0 .. count - 1 after the second sample, by the cubic
        through the two samples before and the two after each half step."""
        at, u = self._samples_before(half_step_count)
        weights = (
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        )
        return np.asarray(sum(weight[:, None] * sample_rows[at + i] for i, weight in enumerate(weights)))

    def _samples_before(self, half_step_count: int) -> tuple[np.ndarray, np.ndarray]:
        """Index of the last sample at or before each half step, and the fraction of the sampling period since then."""
        numerator, denominator = self.half_step_ratio.numerator, self.half_step_ratio.denominator
        place = np.arange(half_step_count) * numerator
        return place // denominator, (place % denominator) / denominator


class RecordingInputs:
    """Hub forces and angles of a recording that drive a run; check signals are left out."""

    def __init__(self, recording: Recording, vehicle: CutVehicle, angles_are_enforced: bool = False) -> None:
        """Read a recording; ``angles_are_enforced`` : whether gaps in the angles are bridged as well. Raises InputError
        for missing forces, or forces with long gaps.
        """
        self.recording, self.vehicle, self.findings = recording, vehicle, list[Finding]()
        used: dict[tuple[str, str, str], MeasuredSignal] = {
            (s.quantity, s.component, s.at): s for s in reversed(recording.signals) if not s.check
        }
        self.hubs = [used.get((what, axis, hub)) for hub in vehicle.hubs for _, what, axis, _ in HUB_COMPONENTS]
        self.angles = [used.get((what, axis, vehicle.chassis)) for what, axis in ANGLE_SIGNALS]
        self.yaw = used.get(("angular rate", "yaw", vehicle.chassis))
        self._check()
        self._bridges = dict[MeasuredSignal, tuple[np.ndarray, np.ndarray]]()
        for signal in (*self.hubs, *(self.angles[:2] if angles_are_enforced else [])):
            if signal is not None:
                values, gaps, findings = bridged_signals(recording, signal)
                self.findings += findings
                if gaps:
                    lost = np.concatenate([np.arange(gap.first, gap.end) for gap in gaps])
                    self._bridges[signal] = lost, values[lost]

    @property
    def frame(self) -> str:
        """Frame of the hub forces: "hub", "body" or "inertial"."""
        return next(signal.frame for signal in self.hubs if signal is not None)

    @property
    def used_signals(self) -> tuple[MeasuredSignal, ...]:
        """Signals of hub forces, angles and rates that the run uses."""
        return tuple(signal for signal in (*self.hubs, *self.angles, self.yaw) if signal is not None)

    def wrenches(self, first_sample: int, sample_count: int) -> np.ndarray:
        """Hub forces and moments (count, 6 h) in N and N m at samples from ``first_sample`` on; components that were
        not measured are 0.
        """
        return self._signal_block(self.hubs, first_sample, sample_count, 0.0)

    def wrenches_with_neighbours(self, first_sample: int, sample_count: int) -> np.ndarray:
        """Hub forces as from ``wrenches``, with one more sample before and two after; beyond its ends the recording is
        mirrored in its end point.
        """
        before, after = max(1 - first_sample, 0), max(first_sample + sample_count + 2 - self.recording.count, 0)
        known = self.wrenches(first_sample - 1 + before, sample_count + 3 - before)
        return np.pad(known, ((before, after), (0, 0)), mode="reflect", reflect_type="odd")

    def tilt(self, first_sample: int, sample_count: int) -> np.ndarray:
        """Measured roll, pitch (rad) and their rates (rad/s), shape (n, 4), NaN where not measured. Gyro rates are
        converted to rates of the angles.
        """
        tilt = self._signal_block(self.angles, first_sample, sample_count, np.nan)
        if any(signal is not None and signal.frame != "inertial" for signal in self.angles[2:]):
            known = np.isfinite(tilt[:, 2:])
            roll, pitch, p, q = np.nan_to_num(tilt).T
            r = np.nan_to_num(self._signal_block([self.yaw], first_sample, sample_count, 0.0)[:, 0])
            rates = np.column_stack(
                [p + (q * np.sin(roll) + r * np.cos(roll)) * np.tan(pitch), q * np.cos(roll) - r * np.sin(roll)]
            )
            tilt[:, 2:] = np.where(known, rates, np.nan)
        return tilt

    def _signal_block(
        self, signals: list[MeasuredSignal | None], first_sample: int, sample_count: int, missing_value: float
    ) -> np.ndarray:
        """Samples (n, signals) from ``first_sample`` on, with bridged gaps, and ``missing_value`` for signals that are
        None.
        """
        out = np.full((min(sample_count, self.recording.count - first_sample), len(signals)), missing_value)
        for i, signal in enumerate(signals):
            if signal is not None:
                out[:, i] = self.recording.columns.read(signal.name, first_sample, sample_count)
                if signal in self._bridges:
                    lost, values = self._bridges[signal]
                    inside = (lost >= first_sample) & (lost < first_sample + len(out))
                    out[lost[inside] - first_sample, i] = values[inside]
        return out

    def _check(self) -> None:
        for hub, signals in zip(self.vehicle.hubs, zip(*[iter(self.hubs)] * WRENCH, strict=True), strict=True):
            if signals[2] is None:
                raise InputError("", "files.channels", None, f"no vertical force is put in at the hub {hub!r}")
            without = [name for signal, (name, *_) in zip(signals, HUB_COMPONENTS, strict=True) if signal is None]
            if without:
                text = f"{', '.join(without)} of the hub {hub} were not measured and are taken as 0."
                self.findings.append(Finding("components", "doubt", hub, text))
        frames = {signal.frame for signal in self.hubs if signal is not None}
        if len(frames) > 1 or not frames <= set(FRAMES):
            text = f"hub forces must all be in one frame of {', '.join(FRAMES)}: these are in"
            raise InputError("", "files.channels", None, f"{text} {', '.join(sorted(frames))}")


class PrescribedAngles:
    """Roll and pitch of a recording that are enforced in a run: smoothed, then interpolated by quintic splines in fixed
    windows of samples.
    """

    def __init__(
        self, recording_inputs: RecordingInputs, step_grid: StepGrid, smoothing_bandwidth: float, named_file: str = ""
    ) -> None:
        """Smooth the angles by a low-pass of ``smoothing_bandwidth`` (Hz) over the recording. Raises InputError where
        an angle is missing.
        """
        angles = recording_inputs.tilt(0, recording_inputs.recording.count)[:, :2]
        if not np.isfinite(angles).all():
            raise InputError(named_file, "stabilise.method", "prescribed", "needs roll and pitch, measured throughout")
        self.angles, self.grid = (
            low_passed(angles, step_grid.period, smoothing_bandwidth, named_file, "stabilise.smoothing"),
            step_grid,
        )
        self._window_length = SPLINE_WINDOW * step_grid.samples_per_output
        self._rows_per_window = int(self._window_length / step_grid.half_step_ratio)

    def rows(self, first_sample: int, half_step_count: int) -> np.ndarray:
        """Roll, pitch, their rates and accelerations (count, 6) in rad, rad/s, rad/s^2 at half steps after sample
        ``first_sample``.
        """
        first_row, out, done, period = (
            int(first_sample / self.grid.half_step_ratio),
            np.empty((half_step_count, 6)),
            0,
            self.grid.period,
        )
        while done < half_step_count:
            window, offset = divmod(first_row + done, self._rows_per_window)
            row_count = min(self._rows_per_window - offset, half_step_count - done)
            window_start = window * self._window_length
            start = max(window_start - SPLINE_OVERLAP, 0)
            samples = self.angles[start : window_start + self._window_length + SPLINE_OVERLAP + 1]
            spline = Smooth(samples, period, derivatives=2, degree=5)
            rows = spline.sample((window_start - start) * period, self.grid.step / 2, self._rows_per_window)
            out[done : done + row_count] = rows[offset : offset + row_count]
            done += row_count
        return out
