"""Frequencies at which spectra of a vehicle on a road are summed, and the road's waves there at many speeds at once."""

from collections.abc import Sequence

import numpy as np

from models.ride.weighting import WEIGHTINGS
from models.road.excitation import Excitation

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
PER_DECADE = 8
"""Panels of ``NODES`` Gauss points per decade."""
AROUND = np.array([-30.0, -10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0, 30.0])
"""Edges of panels about a resonance, in half-widths."""
TURN, LAST = 8.0, 30
"""Radians by which waves turn between axles within a panel, and panels so narrow; beyond them axles count as meeting
roads that know nothing of one another, for sums over quick turns vanish."""


def frequencies(rates: np.ndarray, delay: float, ends: tuple[float, float]) -> tuple[np.ndarray, ...]:
    """Angular frequencies (w,) in rad/s from 0 to the last end, weights (w,) of a sum that stands for the integral,
    and where axles count as ``apart`` (w,).

    rates : of the vehicle's motions, 1/s; delay : the longest one between axles, s; ends : of the panels that are equal
    on a logarithmic axis; the first one goes on to 0.
    """
    low, high = ends
    swinging = rates[rates.imag > 0]
    near = (swinging.imag[:, None] - swinging.real[:, None] * AROUND).ravel()
    late = TURN / delay * np.arange(1, LAST + 1) if delay > 0 else np.array([np.inf])
    inner = np.concatenate([near, late])
    even = np.geomspace(low, high, max(2, round(PER_DECADE * np.log10(high / low))))
    edges = np.unique(np.concatenate([[0.0], even, inner[(inner > low) & (inner < high)]]))
    half = np.diff(edges) / 2
    omega = (edges[:-1, None] + half[:, None] * (1 + NODES)).ravel()
    return omega, (half[:, None] * WEIGHTS).ravel(), omega > late[-1]


def filtered(excitation: Excitation, speeds: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """States (v, w, m, k) of an axle's filter by unit noise, without delay, at speeds (v,) and frequencies (w,)."""
    corners, V = np.linalg.eig(excitation.F)
    driven = np.linalg.solve(V, excitation.G + 0j)
    waves = 1j * omega[:, None] - speeds[:, None, None] * corners
    return speeds[:, None, None, None] ** 0.5 * (V @ (driven / waves[..., None]))


def at_axles(
    each: np.ndarray, excitation: Excitation, speeds: np.ndarray, omega: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Input of all axles (v, w, axles m, noises): that of one axle (v, w, m, k), each after its delay.

    Axles that are ``apart`` (w,), or independent, have noises of their own, axles k; all others share the first k.
    """
    (m, k), axles = each.shape[2:], len(excitation.lengths)
    alone = apart | excitation.independent
    out = np.zeros((*each.shape[:2], axles * m, (axles if alone.any() else 1) * k), complex)
    for i, length in enumerate(excitation.lengths):
        late = each * np.exp(-1j * omega * length / speeds[:, None])[..., None, None] if length else each
        rows = out[:, :, i * m : (i + 1) * m]
        rows[:, ~alone, :, :k] = late[:, ~alone]
        if alone.any():
            rows[:, alone, :, i * k : (i + 1) * k] = late[:, alone]
    return out


def weighting_factors(weightings: Sequence[str], omega: np.ndarray) -> np.ndarray:
    """Factors (q, w) of weightings by their names, 1 for "", at angular frequencies (rad/s)."""
    frequency = omega / (2 * np.pi)
    return np.array([WEIGHTINGS[name].response(frequency) if name else np.ones(len(omega)) for name in weightings])
