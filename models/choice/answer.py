"""What a run of any scene answered, as numbers that two runs can be compared by, and what it cost."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from models.errors import InputError

Cases = tuple[np.ndarray, ...]
"""One quantity in every case of a scene (procedure, manoeuvre, speed, creepage): its path (n,), or one number (1,)."""
HARDLY = 1e-3
"""Of the largest case: changes of a smaller one are relative to this share."""
ROUNDING, NOTHING = 1e-10, 1e-15
"""Of the largest value in a unit, and in SI units: what moves less does not move at all, but for rounding."""
SCALARS = {"rms": lambda path: np.sqrt(np.mean(path**2)), "max": lambda path: np.abs(path).max()}
"""Words that make a number of a path, as in "rms f1"."""


@dataclass(frozen=True)
class Quantity:
    """Its unit and its values in every case."""

    unit: str
    cases: Cases


@dataclass(frozen=True)
class Answer:
    """Quantities by name; CPU seconds of the march alone; counts, which repeat: "steps", "calls" of the right-hand
    side, "states", and "terms", where a call goes through any beside them (cells of contact nets, waves of roads)."""

    quantities: dict[str, Quantity]
    counts: dict[str, int]
    seconds: float = field(compare=False)

    def of(self, name: str, file: str = "") -> Quantity:
        """A quantity, or "rms" or "max" of one; InputError for what there is not."""
        word, _, rest = name.partition(" ")
        if name not in self.quantities and word in SCALARS and rest in self.quantities:
            path = self.quantities[rest]
            return Quantity(path.unit, tuple(np.array([SCALARS[word](one)]) for one in path.cases))
        if name not in self.quantities:
            raise InputError(file, "quantities", name, "no such quantity in this scene, whose own are, each also with "
                             "'rms' or 'max' before it if it is a path", tuple(self.quantities))  # fmt: skip
        return self.quantities[name]


def sizes(full: Sequence[np.ndarray]) -> np.ndarray:
    """What changes are relative to, case by case: the standard deviation of a path, the magnitude of a number.

    A case that hardly moves beside the others is held to what it is of them.
    """
    own = np.array([np.std(one) if len(one) > 1 else abs(float(one[0])) for one in full])
    return np.maximum(own, HARDLY * own.max(initial=0.0))


def rounding(answer: Answer, unit: str) -> float:
    """Size up to which a quantity of a unit does not move, but for rounding."""
    alike = [abs(case).max(initial=0.0) for one in answer.quantities.values() if one.unit == unit for case in one.cases]
    return max(NOTHING, ROUNDING * float(max(alike, default=0.0)))


def less(one: Cases, full: Cases) -> Cases:
    """Differences of two runs at the times that both have: the longer step's, every so many of the shorter one's.

    Raises InputError where the runs have no common times, as those that end by themselves.
    """
    found = []
    for a, b in zip(one, full, strict=True):
        few, many = sorted((len(a), len(b)))
        if few != many and (few < 2 or (many - 1) % (few - 1)):
            raise InputError("", "quantities", None, "paths of runs that end by themselves cannot be compared: ask for "
                             "'rms' or 'max' of them, or for another number")  # fmt: skip
        every = [(len(path) - 1) // max(few - 1, 1) or 1 for path in (a, b)]
        found.append(a[:: every[0]] - b[:: every[1]])
    return tuple(found)


def added(*changes: Cases) -> Cases:
    """Sum of differences, at the times that all have."""
    found = []
    for parts in zip(*changes, strict=True):
        few = min(map(len, parts))
        found.append(np.sum([part[:: (len(part) - 1) // max(few - 1, 1) or 1] for part in parts], axis=0))
    return tuple(found)


def relative(change: Cases, size: np.ndarray) -> float:
    """Largest relative change of all cases: rms of a path's difference, or a number's, by its size."""
    moved = np.array([float(np.sqrt(np.mean(one**2))) for one in change])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(size > 0.0, moved / size, np.where(moved > 0.0, np.inf, 0.0))
    return float(share.max()) if np.isfinite(moved).all() else np.inf
