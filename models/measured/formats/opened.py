"""Functions that the readers of all formats share: channels by name, checked blocks, one kind of error."""

from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from itertools import tee
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding, FindingWeight
from models.measured.channel import SAMPLES_PER_BLOCK, FileChannel, SampleBlock

SampleSpan = tuple[int, int]
"""First sample and number of samples."""
SHOWN_NAME_COUNT = 5
"""Most names of skipped channels that a finding lists."""
START_EXAMPLE = "2026-11-21T08:00:00+00:00"
"""Example of a start time, for messages."""


@dataclass(frozen=True)
class OpenFile(ABC):
    """An open measurement file with known channels. Samples are read on demand, and no file handle stays open between
    reads."""

    path: Path
    channels: tuple[FileChannel, ...]
    start: datetime | None
    comment: str
    findings: tuple[Finding, ...]

    def blocks(
        self, channel_names: Sequence[str], block_length: int = SAMPLES_PER_BLOCK, first_sample: int = 0
    ) -> Iterator[SampleBlock]:
        """Blocks of channels of one group, as specified in ``models.measured.channel.MeasurementSource``."""
        chosen = self._channel_indices(channel_names)
        count = self.channels[chosen[0]].count
        spans = (
            (i, min(block_length, count - i)) for i in range(first_sample, count, block_length)
        )  # a damaged file may claim billions
        return self._checked_blocks(chosen, spans)

    @abstractmethod
    def pieces(
        self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times (n,) in s and values (n, channels) of each span, read by the format's own method; fewer where the file
        ends."""

    def _channel_indices(self, channel_names: Sequence[str]) -> list[int]:
        """Indices of the named channels, which must belong to one group."""
        place = {channel.name: i for i, channel in enumerate(self.channels)}
        for name in channel_names:
            if name not in place:
                raise InputError(self.path, "channel", name, "the file has no such channel", tuple(place))
        chosen = [place[name] for name in channel_names]
        if len({self.channels[i].group for i in chosen}) != 1:
            raise InputError(
                self.path, "channels", list(channel_names), "one or more channels of one sampling rate are needed"
            )
        return chosen

    def _checked_blocks(self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]) -> Iterator[SampleBlock]:
        """Complete blocks, with times that are finite and values that are finite or NaN."""
        names, (mine, theirs) = [self.channels[i].name for i in channel_indices], tee(sample_spans)
        with library_errors_as_input(self.path):
            for (first, count), (times, values) in zip(mine, self.pieces(channel_indices, theirs), strict=True):
                if len(times) != count:
                    ends = f"the data end here, although {first + count} samples or more are announced"
                    raise InputError(self.path, f"sample {first + len(times)}", None, ends)
                self._check_finite(first, ["time"], times[:, None], np.isfinite(times[:, None]))
                self._check_finite(first, names, values, ~np.isinf(values))
                yield SampleBlock(first, times, values)

    def _check_finite(
        self, first_sample: int, channel_names: list[str], values: np.ndarray, is_valid: np.ndarray
    ) -> None:
        """Raise InputError at the first value that is not valid: infinite, or a time that is not finite.

        NaN in a channel means that nothing was measured.
        """
        if not is_valid.all():
            row, column = (int(i[0]) for i in np.nonzero(~is_valid))
            place = f"channel {channel_names[column]!r}, sample {first_sample + row}"
            needed = "a finite value is needed (NaN in a channel says that nothing was measured)"
            raise InputError(self.path, place, float(values[row, column]), needed)


@contextmanager
def library_errors_as_input(measurement_path: Path) -> Iterator[None]:
    """Context in which any exception that a library raises on a damaged file becomes an InputError."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError(measurement_path, "", None, f"the file cannot be read: {error.strerror or error}") from None
    except Exception as error:
        why = f"{type(error).__name__}: {error}".splitlines()[0]
        raise InputError(measurement_path, "", None, f"the file is damaged and cannot be read ({why})") from error


def flaw_finding(measurement_path: Path, severity: FindingWeight, flaw_text: str, finding_place: str = "") -> Finding:
    """Finding on a flaw in a file that could be read nevertheless."""
    return Finding("file", severity, finding_place or measurement_path.name, flaw_text)


@dataclass
class SkippedChannels:
    """Names of channels that a reader skips, grouped by reason; each reason gives a single finding."""

    names: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))

    def add(self, reason: str, channel_name: str) -> None:
        """Record one more channel that is skipped for the reason ``reason``."""
        self.names[reason].append(channel_name)

    def findings(self, measurement_path: Path) -> list[Finding]:
        """One finding per reason, with the names of the skipped channels."""
        more = {
            why: f" and {len(names) - SHOWN_NAME_COUNT} more"
            for why, names in self.names.items()
            if len(names) > SHOWN_NAME_COUNT
        }
        texts = {why: f"{', '.join(names[:SHOWN_NAME_COUNT])}{more.get(why, '')}" for why, names in self.names.items()}
        return [flaw_finding(measurement_path, "note", f"left out, {why}: {text}") for why, text in texts.items()]


def no_readable_channel_error(measurement_path: Path, findings: Sequence[Finding]) -> InputError:
    """InputError for a file without a readable channel; it includes the findings made so far."""
    reasons = ["no channel of numbers over time is in the file", *(finding.text for finding in findings)]
    return InputError(measurement_path, "channels", None, "; ".join(reasons))


def distinct_names(
    measurement_path: Path, channel_names: Sequence[str], *group_names: Sequence[str]
) -> tuple[list[str], list[Finding]]:
    """Channel names made unique, and findings on the names that occurred more than once.

    A repeated ``Fz`` becomes ``WFT VL/Fz``, ``WFT VR/Fz`` by the first of ``group_names`` (one text per name each) that
    tells all its channels apart, and ``Fz (1)``, ``Fz (2)`` where none does.
    """
    by_group, findings = list(channel_names), list[Finding]()
    repeated = {
        name: [i for i, each in enumerate(channel_names) if each == name]
        for name, n in Counter(channel_names).items()
        if n > 1
    }
    for name, indices in repeated.items():
        for group in [texts for texts in group_names if len({texts[i] for i in indices}) == len(indices)][:1]:
            for i in indices:
                by_group[i] = f"{group[i]}/{name}" if group[i] else name
    unique = _number_repeated(by_group)
    for name, indices in repeated.items():
        weight: FindingWeight = "doubt" if any(unique[i] != by_group[i] for i in indices) else "note"
        text = f"{len(indices)} channels are called {name!r}: they are read as "
        findings.append(
            flaw_finding(measurement_path, weight, text + ", ".join(repr(unique[i]) for i in indices), name)
        )
    return unique, findings


def _number_repeated(channel_names: Sequence[str]) -> list[str]:
    """Channel names, with a number appended to repeated ones."""
    uses, taken, unique = Counter(channel_names), set(channel_names), []
    for name in channel_names:
        if uses[name] > 1:
            numbers = (f"{name} ({k})" for k in range(1, len(channel_names) + len(taken) + 1))
            name = next(text for text in numbers if text not in taken)
            taken.add(name)
        unique.append(name)
    return unique


def start_with_zone(measurement_path: Path, time_text: str) -> tuple[datetime | None, list[Finding]]:
    """Start time from ISO 8601 text; None, with a finding, where the text is no date or has no time zone."""
    try:
        start = datetime.fromisoformat(time_text.strip())
    except ValueError:
        reason = f"is not a date such as {START_EXAMPLE}, and is not used"
    else:
        if start.tzinfo is not None:
            return start, []
        reason = f"names no time zone, and is not used: write it as {START_EXAMPLE}"
    return None, [flaw_finding(measurement_path, "doubt", f"the start {time_text.strip()!r} {reason}")]
