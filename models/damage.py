"""Pseudo-damage of a load signal: rainflow cycles, each counted with a power of its range.

Convention: ASTM E1049-85, section 5.4.4 (library ``rainflow``): what is left open at the end, the residue,
counts as half cycles. Other conventions differ by a third on a drifting signal, so figures are comparable only
under the same one. The Woehler exponent ``slope`` is 5 unless another is named.
"""

import numpy as np

SLOPE = 5.0
"""Woehler exponent used where none is named."""
CONVENTION = "rainflow after ASTM E1049-85, residue as half cycles"


def turning_points(load: np.ndarray) -> np.ndarray:
    """The values of ``load`` (n,) at which it turns, with its first and last one: all that rainflow reads."""
    load = np.asarray(load, dtype=float)
    steps = np.diff(load)
    moving = np.flatnonzero(steps)
    turns = moving[1:][np.sign(steps[moving[1:]]) != np.sign(steps[moving[:-1]])]
    return load[np.concatenate(([0], turns, [len(load) - 1]))]


def pseudo_damage(load: np.ndarray, slope: float = SLOPE) -> float:
    """Sum of count times range^slope over the rainflow cycles of ``load`` (n,); unit: that of the load, to ``slope``.

    Raises ValueError if the load holds a value that is not finite: damage of a broken run is not a number to
    compare.
    """
    from rainflow import extract_cycles

    if not np.isfinite(load).all():
        raise ValueError("the load holds a value that is not finite")
    return float(sum(count * span**slope for span, _, count, _, _ in extract_cycles(turning_points(load).tolist())))


def damage_ratio(load: np.ndarray, truth: np.ndarray, slope: float = SLOPE) -> float:
    """Pseudo-damage of a load by that of the true one."""
    return pseudo_damage(load, slope) / pseudo_damage(truth, slope)
