"""A measurement file as its format describes it: channels, groups of channels with one clock, and samples block by
block."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Protocol

import numpy as np

from models.core.finding import Finding

SAMPLES_PER_BLOCK = 60_000
"""Number of samples per block: a minute at 1 kHz."""


@dataclass(frozen=True)
class FileChannel:
    """One channel of a measurement file, with name and unit as in the file."""

    name: str
    unit: str
    comment: str
    group: int
    count: int
    period: float | None
    resolution: float = 0.0
    family: str = ""


@dataclass(frozen=True)
class SampleBlock:
    """Successive samples of some channels of one group.

    first : index of the first one. times (n,) : s since ``MeasurementSource.start``, as in the file, whatever their
    order; values (n, channels) : in the file's units, NaN where nothing was measured.
    """

    first: int
    times: np.ndarray
    values: np.ndarray


class MeasurementSource(Protocol):
    """Protocol of an open measurement file; each format in ``models.measured.formats`` has its own implementation."""

    @property
    def path(self) -> Path:
        """Path of the file."""

    @property
    def channels(self) -> tuple[FileChannel, ...]:
        """All channels that hold numbers over time, with distinct names."""

    @property
    def start(self) -> datetime | None:
        """Date and time at time 0, with time zone; None where the file does not give them."""

    @property
    def comment(self) -> str:
        """Comment in the file, with line ends between its lines."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings from opening the file: cut off, repeated names, channels left out, notation of numbers."""

    def blocks(
        self, channel_names: Sequence[str], block_length: int = SAMPLES_PER_BLOCK, first_sample: int = 0
    ) -> Iterator[SampleBlock]:
        """Blocks of at most ``block_length`` samples of channels of one group, from sample ``first_sample`` on.

        Raises InputError that names the file and the byte, line or sample where it cannot be read.
        """
        ...
