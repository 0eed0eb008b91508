"""A recording: measured signals in SI units on one clock, which every check, run and page reads."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import numpy as np

from models.core.finding import Finding
from models.measured.channel import SAMPLES_PER_BLOCK
from models.measured.columns import SampleFile, SamplesInMemory
from models.measured.signal import MeasuredSignal

Progress = Callable[[str, float], None]
"""Function that is called with a text on the present work and the completed share."""


def report_no_progress(*arguments: Any) -> None:
    """A progress function that does nothing."""


@dataclass(frozen=True)
class Recording:
    """Measured signals on one clock, in SI units.

    period : s; count : samples, the first at t = 0. start : when that was, None if no file says. findings : from
    reading and bringing onto one clock (gaps, repeated times, jitter, drift between clocks). comment : of the files.
    """

    signals: tuple[MeasuredSignal, ...]
    columns: SampleFile | SamplesInMemory
    period: float
    start: datetime | None = None
    comment: str = ""
    findings: tuple[Finding, ...] = field(default=())

    @property
    def count(self) -> int:
        """Number of samples of every signal."""
        return self.columns.count

    @property
    def duration(self) -> float:
        """Time (s) of the last sample; the first is at 0."""
        return self.period * (self.count - 1)

    def find_signals(self, quantity: str, location: str = "", component: str = "") -> tuple[MeasuredSignal, ...]:
        """Signals of a quantity, limited to a location or component if given, in the order of the channel map."""
        return tuple(
            s
            for s in self.signals
            if s.quantity == quantity and location in ("", s.at) and component in ("", s.component)
        )

    def samples(self, signal: MeasuredSignal) -> np.ndarray:
        """All samples (count,) of one signal in SI units; NaN where nothing was measured."""
        return self.columns.read(signal.name)

    def blocks(
        self, signals: tuple[MeasuredSignal, ...], block_length: int = SAMPLES_PER_BLOCK
    ) -> Iterator[tuple[int, np.ndarray]]:
        """Index of the first sample, and samples (n, signals), of each block of these signals."""
        names = tuple(s.name for s in signals)
        for first in range(0, self.count, block_length):
            yield first, self.columns.block(names, first, block_length)

    def changed(self, change_samples: Callable[[MeasuredSignal, np.ndarray], np.ndarray]) -> "Recording":
        """A copy of the recording with changed samples. ``change_samples`` returns a signal's new samples (count,), in
        SI units, from its present ones, NaN where nothing was measured. The copy is stored in a new file beside the old
        one."""
        assert isinstance(self.columns, SampleFile)
        path = self.columns.path.with_stem(f"{self.columns.path.stem}_changed")
        path.with_suffix(".json").unlink(missing_ok=True)
        columns = SampleFile(path, self.columns.names, self.count)
        for signal in self.signals:
            columns.put((signal.name,), 0, change_samples(signal, self.samples(signal))[:, None])
        columns.close(self.count)
        return replace(self, columns=columns)
