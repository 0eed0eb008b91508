"""How an answer differs from the recorded one: exit code, channels that are gone or new, values, message."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from validation.replay.answers import Answer


@dataclass
class Difference:
    """What differs, a sentence each: ``wrong`` fails a replay, ``other`` (messages, new channels) is told."""

    wrong: list[str] = field(default_factory=list)
    other: list[str] = field(default_factory=list)


def difference(before: Answer, now: Answer, bound: float, renamed: Mapping[str, str]) -> Difference:
    """Of an answer from a recorded one.

    bound : largest change of a number by the largest one of its channel; 0 asks for the same bits. renamed : earlier
    names of channels to later ones; a channel that is in another file now is looked for by its name.
    """
    told = Difference()
    if before.codes != now.codes:
        told.wrong.append(f"exit codes {before.codes} are {now.codes}: {now.message.strip()[-200:]}")
    if before.message != now.message:
        told.other.append(f"message {before.message.strip()[:200]!r} is {now.message.strip()[:200]!r}")
    matched = set()
    for name, array in before.arrays.items():
        if (later := _later(name, now.arrays, renamed)) is None:
            told.wrong.append(f"{name} is gone")
            continue
        matched.add(later)
        if text := _changed(array, now.arrays[later], bound):
            (told.other if array.dtype.kind == "U" else told.wrong).append(f"{name}: {text}")
    told.other += [f"{name} is new" for name in now.arrays if name not in matched]
    return told


def _later(name: str, arrays: Mapping[str, np.ndarray], renamed: Mapping[str, str]) -> str | None:
    """Name of a channel in later arrays: its own, its new one, or that of the same channel in the only other file."""
    if (own := renamed.get(name, name)) in arrays:
        return own
    channel = own.partition(": ")[2]
    others = [other for other in arrays if other.partition(": ")[2] == channel]
    return others[0] if len(others) == 1 else None


def _changed(before: np.ndarray, now: np.ndarray, bound: float) -> str:
    """What changed of an array, "" if nothing beyond the bound."""
    if before.dtype.kind == now.dtype.kind == "U" and before.size == now.size == 1:
        return "" if before == now else f"{before} is {now}"
    if before.shape != now.shape or before.dtype != now.dtype:
        return f"{before.dtype} {before.shape} is {now.dtype} {now.shape}"
    if before.tobytes() == now.tobytes():
        return ""
    if before.dtype.kind != "f" or not bound:
        return "other values" if before.size > 1 else f"{before} is {now}"
    known = np.isfinite(before)
    if not np.array_equal(before[~known], now[~known], equal_nan=True) or not np.isfinite(now[known]).all():
        return "numbers are finite elsewhere"
    share = abs(before - now)[known].max(initial=0.0) / max(abs(before)[known].max(initial=0.0), 1e-300)
    return "" if share <= bound else f"a number changed by {share:.2g} of the largest"
