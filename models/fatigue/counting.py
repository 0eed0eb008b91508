"""Counts of a section force as fatigue groups use them: pseudo-damage, level crossings, range pairs.

Conventions: rainflow after ASTM E1049-85 with the residue as half cycles (``models.fatigue.damage``). Level
crossings: how often the load rises through a level, from below it to it or beyond. Range pairs: how many rainflow
cycles, open ones as half, have at least a range.
"""

from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.fatigue.damage import checked_load, damage_sum, turning_points
from models.fatigue.rainflow_cycles import rainflow_cycles

LEVEL_COUNT, RANGE_COUNT = 64, 64
"""Number of levels and of ranges of a counted load: equal parts of the interval from its smallest to its largest
value."""


@dataclass(frozen=True)
class CountedLoad:
    """Results of fatigue counting of one load: pseudo-damage, level crossings, range pairs.

    damage : by slope, in the load's unit to the slope; levels (l,), crossings (l,); ranges (r,), pairs_of_range (r,)
    with at least that range; smallest_load, largest_load : the load's extremes; mean.
    """

    damage: dict[float, float]
    levels: np.ndarray
    crossings: np.ndarray
    ranges: np.ndarray
    pairs_of_range: np.ndarray
    smallest_load: float
    largest_load: float
    mean: float


def counted_load(load: np.ndarray, woehler_slopes: tuple[float, ...] = (3.0, 5.0, 8.0)) -> CountedLoad:
    """``CountedLoad`` of a load history (n,), for Woehler exponents ``woehler_slopes``; raises InputError for an empty
    load, or one that is not finite."""
    load = checked_load(load)
    turns = turning_points(load)
    spans, _, counts = rainflow_cycles(turns)
    smallest, greatest = float(load.min()), float(load.max())
    levels = np.linspace(smallest, greatest, LEVEL_COUNT + 1)
    ranges = np.linspace(0.0, greatest - smallest, RANGE_COUNT + 1)[1:]
    return CountedLoad(
        {slope: damage_sum(spans, counts, slope) for slope in woehler_slopes},
        levels,
        level_crossings(turns, levels),
        ranges,
        range_pairs(spans, counts, ranges),
        smallest,
        greatest,
        float(load.mean()),
    )


def level_crossings(load: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Number of upward crossings of each level (l,), in any order, by a load (n,) or its turning points; raises
    InputError for a level that is NaN, and as ``counted_load``."""
    load, given_levels = checked_load(load), np.asarray(levels, float)
    if np.isnan(given_levels).any():
        raise InputError("", "levels", None, "must be numbers")
    levels, index_of_level = np.unique(given_levels, return_inverse=True)
    rising = load[1:] > load[:-1]
    first_level = np.searchsorted(levels, load[:-1][rising], side="right")  # the first level above the start
    ended = np.searchsorted(levels, load[1:][rising], side="right")  # one beyond the last level reached
    change = np.bincount(first_level, minlength=len(levels) + 1) - np.bincount(ended, minlength=len(levels) + 1)
    return np.cumsum(change)[: len(levels)][index_of_level]


def range_pairs(cycle_ranges: np.ndarray, cycle_counts: np.ndarray, counted_ranges: np.ndarray) -> np.ndarray:
    """Number of cycles with at least each range (r,), from the ranges ``cycle_ranges`` (c,) and counts (c,) of the
    rainflow cycles."""
    order = np.argsort(cycle_ranges)
    cycles_above = np.concatenate((np.cumsum(cycle_counts[order][::-1])[::-1], [0.0]))
    return cycles_above[np.searchsorted(cycle_ranges[order], counted_ranges * (1 - 1e-12), side="left")]
