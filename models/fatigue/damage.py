"""Pseudo-damage of a load history: the sum over rainflow cycles of a power of their range.

Convention: ASTM E1049-85, section 5.4.4: what is left open at the end, the residue, counts as half cycles. Other
conventions differ by a third on a drifting signal, so figures are comparable only under the same one. The Woehler
exponent ``slope`` is 5 unless another is named.
"""

import math

import numpy as np

from models.core.errors import InputError

WOEHLER_SLOPE = 5.0
"""Default Woehler exponent."""
COUNTING_CONVENTION = "rainflow after ASTM E1049-85, residue as half cycles"
"""Convention of cycle counting, as text."""


REST_RANGE_SHARE = 1e-9
"""Ratio of a load's variation to its magnitude below which it counts as constant: a thousand times the rounding of a
run."""


def turning_points(load: np.ndarray) -> np.ndarray:
    """Turning points of a load history (n,), with its first and last value, as rainflow counting needs them."""
    load = np.asarray(load, dtype=float)
    steps = np.diff(load)
    moving = np.flatnonzero(steps)
    turns = moving[1:][np.sign(steps[moving[1:]]) != np.sign(steps[moving[:-1]])]
    return load[np.concatenate(([0], turns, [len(load) - 1]))]


def checked_load(load: np.ndarray) -> np.ndarray:
    """The load history (n,) as doubles; raises InputError if it is empty, masked, not finite, or not
    one-dimensional."""
    if np.ma.is_masked(load):
        raise InputError(
            "",
            "load",
            None,
            f"{np.ma.count_masked(load)} of {np.size(load)} samples are masked: leave them out or fill them",
        )
    load_array = np.asarray(load)
    if load_array.ndim != 1 or load_array.dtype.kind not in "biuf":
        raise InputError(
            "", "load", f"{load_array.ndim}-dimensional, {load_array.dtype}", "must be one row of real numbers"
        )
    load = load_array.astype(float)
    if not len(load) or not np.isfinite(load).all():
        fault = f"{np.count_nonzero(~np.isfinite(load))} of {len(load)} samples are not finite"
        raise InputError("", "load", None, f"{fault}: damage needs at least one sample, and all of them finite")
    return load


def damage_sum(cycle_ranges: np.ndarray, cycle_counts: np.ndarray, woehler_slope: float) -> float:
    """Pseudo-damage: sum of count times range^slope over cycles (c,); raises InputError for an invalid slope, or a sum
    too large for a double."""
    if not (math.isfinite(woehler_slope) and woehler_slope > 0.0):
        raise InputError("", "slope", woehler_slope, "must be a Woehler exponent above 0")
    with np.errstate(over="ignore"):
        damage = float(np.sum(cycle_counts * cycle_ranges**woehler_slope))
    if not math.isfinite(damage):
        raise InputError(
            "",
            "load",
            float(cycle_ranges.max()),
            f"has a range whose power {woehler_slope:g} is beyond all numbers: use another unit",
        )
    return damage


def pseudo_damage(load_history: np.ndarray, woehler_slope: float = WOEHLER_SLOPE) -> float:
    """Pseudo-damage of a load history (n,): sum of count times range^slope over its rainflow cycles, in the load's unit
    to the power ``woehler_slope``.

    A load that never turns has none. Raises InputError for a load without a sample, or with one that is not
    finite: damage of a broken run is not a number to compare; for a slope that is not above 0; and where the damage
    is too large for a number.
    """
    from models.fatigue.rainflow_cycles import rainflow_cycles

    spans, _, counts = rainflow_cycles(turning_points(checked_load(load_history)))
    return damage_sum(spans, counts, woehler_slope)


def damage_ratio(load_history: np.ndarray, true_load: np.ndarray, woehler_slope: float = WOEHLER_SLOPE) -> float:
    """Pseudo-damage of a load (n,) divided by that of the true load (m,); raises InputError if the true load never
    varies."""
    true_damage = pseudo_damage(true_load, woehler_slope)
    if true_damage == 0.0 or np.ptp(true_load) <= REST_RANGE_SHARE * np.abs(true_load).max():
        raise InputError("", "true load", None, "never varies, so it does no damage to which another could be compared")
    return pseudo_damage(load_history, woehler_slope) / true_damage
