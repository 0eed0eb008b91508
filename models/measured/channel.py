"""A measurement file as its format describes it: channels, their groups of one clock each, and samples block by
block."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Protocol

import numpy as np

from models.core.finding import Finding

SAMPLES_PER_BLOCK = 60_000
"""Samples of a block: a minute at 1 kHz."""


@dataclass(frozen=True)
class Channel:
    """One channel, with names and units as the file gives them."""

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

    first : index of the first one. times (n,) : s since ``Source.start``, as in the file, whatever their order;
    values (n, channels) : in the file's units, NaN where nothing was measured.
    """

    first: int
    times: np.ndarray
    values: np.ndarray


class Source(Protocol):
    """An open measurement file; each format in ``models.measured.formats`` has its own implementation."""

    @property
    def path(self) -> Path:
        """Path of the file."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """All channels that hold numbers over time; no two have the same name."""

    @property
    def start(self) -> datetime | None:
        """Date and time at time 0, with time zone; None where the file does not give them."""

    @property
    def comment(self) -> str:
        """Comment in the file; its lines are separated by line ends."""

    @property
    def noticed(self) -> tuple[Finding, ...]:
        """Findings on opening the file: cut off, repeated names, channels left out, how numbers are written."""

    def blocks(self, names: Sequence[str], length: int = SAMPLES_PER_BLOCK, first: int = 0) -> Iterator[SampleBlock]:
        """Blocks of at most ``length`` samples of channels of one group, from sample ``first`` on.

        Raises InputError that names the file and the byte, line or sample where it cannot be read.
        """
        ...
