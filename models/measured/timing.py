"""When the samples of one group were taken: sorted, repeated ones dropped, gaps, jitter and rate found."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from models.errors import InputError
from models.measured.finding import Finding, Weight

GAP = 1.5
"""Periods: two samples farther apart have a gap between them."""
SHUFFLED = 10.0
"""Periods: a sample that is late by no more was only written late; a clock that goes back farther began anew."""
EVEN = 0.01
"""Of a period: samples as near to an even clock are on it; farther off, the clock jitters."""
JITTER = 0.1
"""Of a period: a standard deviation of the steps that is worth a doubt."""


Say = Callable[[str, Weight, str, float, str, Iterable[float]], None]


@dataclass(frozen=True)
class Timing:
    """Times of a group's samples.

    times (n,) : s, strictly rising. order (n,) : which sample of the file each is; None where every one is in its
    place. period : s, the median step. findings : what was found and how it was dealt with.
    """

    times: np.ndarray
    order: np.ndarray | None
    period: float
    findings: tuple[Finding, ...]

    @property
    def rate(self) -> float:
        """Hz."""
        return 1.0 / self.period

    @property
    def end(self) -> float:
        """Time (s) of the last sample."""
        return float(self.times[-1])


def timing(times: np.ndarray, place: str, signals: tuple[str, ...] = ()) -> Timing:
    """Timing of samples (n,) in the order of the file ``place``; InputError for fewer than two different times."""
    findings, whole = list[Finding](), len(times)

    def say(check: str, weight: Weight, text: str, size: float, unit: str, at: Iterable[float]) -> None:
        findings.append(Finding(check, weight, place, f"{place}: {text}.", size, unit, signals, tuple(map(float, at))))

    keep, order = np.arange(whole), None
    steps = np.diff(times)
    rising = steps[steps > 0]
    if not len(rising):
        raise InputError(place, "time", None, "two samples or more at different times are needed")
    period = float(f"{np.median(rising):.9g}")
    if (steps < 0).any():
        deepest, at = -float(steps.min()), int(np.argmax(steps < -SHUFFLED * period))
        if deepest > SHUFFLED * period:
            keep = keep[: at + 1]
            say("time", "error", f"the clock goes back by {deepest:.6g} s at {times[at]:.6g} s: there are two "
                "measurements in the file, which must be taken apart; what follows is left out", deepest, "s",
                (times[at + 1], times[at]))  # fmt: skip
        else:
            say("time", "doubt", f"{np.count_nonzero(steps < 0)} times are earlier than the one before them, by up to "
                f"{deepest:.3g} s; the samples are put in order", deepest, "s", times[[at, at + 1]])
        keep = keep[np.argsort(times[keep], kind="stable")]
        order = keep
    again = np.diff(times[keep]) == 0
    if again.any():
        first = float(times[keep][1:][again][0])
        say("time", "doubt", f"{np.count_nonzero(again)} times are there more than once, the first at {first:.6g} s; "
            "of each the first sample is taken", float(np.count_nonzero(again)), "samples", (first, first))
        keep = keep[np.concatenate(([True], ~again))]
        order = keep
    own = times[keep]
    _gaps(own, period, say)
    _jitter(own, period, say)
    return Timing(own, order, period, tuple(findings))


def _gaps(times: np.ndarray, period: float, say: Say) -> None:
    steps = np.diff(times)
    wide = np.flatnonzero(steps > GAP * period)
    if len(wide):
        longest = wide[np.argmax(steps[wide])]
        lost = float(np.sum(steps[wide] - period))
        say("clock gaps", "note", f"{len(wide)} gap(s) in its clock, {lost:.4g} s in all, the longest from "
            f"{times[longest]:.6g} to {times[longest + 1]:.6g} s ({steps[longest]:.4g} s); nothing was measured there",
            float(steps[longest]), "s", times[[longest, longest + 1]])  # fmt: skip


def _jitter(times: np.ndarray, period: float, say: Say) -> None:
    steps = np.diff(times)
    own = steps[steps <= GAP * period] - period
    spread = float(own.std())
    if spread > EVEN * period:
        weight: Weight = "doubt" if spread > JITTER * period else "note"
        say("jitter", weight, f"the clock jitters: its steps of {1e3 * period:.6g} ms have a standard deviation of "
            f"{1e3 * spread:.3g} ms ({spread / period:.1%}); the times of the file are believed",
            spread, "s", times[[0, -1]])  # fmt: skip
