"""Tyre tables from friction curves of pure slip, by similarity.

Slipping in both directions the tyre takes k = hypot(s, tan(slip angle)) on either curve, and each component its share
of that. H. B. Pacejka, Tyre and vehicle dynamics, ch. 4 (there with each curve's slip made comparable first).
"""

from collections.abc import Callable

import numpy as np

from models.tyre.tyre_table import TyreTable

Curve = Callable[[np.ndarray, float], np.ndarray]
"""Friction, from 0 on, at slips from 0 on (tan of the slip angle, across) under a load (N)."""


def graded(end: float, first: float, count: int) -> np.ndarray:
    """Nodes from 0 to ``end`` whose distances grow as x + ``first``."""
    nodes = first * np.expm1(np.linspace(0.0, np.log1p(end / first), count))
    nodes[-1] = end
    return nodes


ANGLES, SLIPS = graded(np.pi / 2.0, 0.03, 261), graded(1.0, 0.02, 201)
"""Nodes (rad; 1) between which the tables of the magic formula's surfaces are met to 1e-4 of mu."""


def by_similarity(
    along: Curve,
    across: Curve,
    loads: np.ndarray,
    angles: np.ndarray = ANGLES,
    slips: np.ndarray = SLIPS,
    name: str = "",
) -> TyreTable:
    """Table of a curve along the wheel and one across it.

    g is the mean over the loads, weighted by h squared: exact if all loads share one shape of the curve across. Where
    both together would be above the largest node of either, which falls short of the curve's peak, they are that.
    """
    tangent = np.tan(angles)[:, None]
    total = np.hypot(slips, tangent)
    safe = np.maximum(total, 1e-300)
    mu_x = np.stack([along(total, load) * slips / safe for load in loads], axis=1)
    both = np.stack([across(total, load) * tangent / safe for load in loads], axis=1)
    g, h = factors(both)
    g[0] = _at_no_angle(across, slips, loads)
    over = np.maximum(np.hypot(mu_x, g[:, None, :] * h[:, :, None]) / max(mu_x.max(), both.max()), 1.0)
    return TyreTable(angles, slips, loads, mu_x / over, g / over.max(axis=1), h, name)


def factors(mu_y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """g (a, s) and h (a, f) of friction across the wheel (a, f, s): h is that at slip 0, and g the best for all loads.

    At slip angle 0, where h is 0, g is that of the next angle.
    """
    h = mu_y[:, :, 0].copy()
    square = (h * h).sum(axis=1)[:, None]
    g = np.divide((mu_y * h[:, :, None]).sum(axis=1), square, out=np.ones_like(mu_y[:, 0, :]), where=square > 0.0)
    if len(g) > 1:
        g[0] = g[1]
    return g, h


def _at_no_angle(across: Curve, slips: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """g at slip angles towards 0: slope of mu_y there with slip over that without."""
    little = np.full(1, 1e-9)
    slope = np.array([across(little, load)[0] / little[0] for load in loads])[:, None]
    secant = np.array([across(slips[1:], load) / slips[1:] for load in loads])
    return np.concatenate(([1.0], (slope * secant).sum(axis=0) / (slope * slope).sum()))
