"""Frequencies at which a vehicle's response spectra are integrated, and the road's waves at these frequencies for many
speeds at once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from models.ride.weighting import WEIGHTINGS
from models.road.excitation import RoadExcitation

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(6)
PER_DECADE = 8
"""Number of integration panels, each with the points GAUSS_NODES, per decade of frequency."""
RESONANCE_EDGES = np.array([-30.0, -10.0, -3.0, -1.0, 0.0, 1.0, 3.0, 10.0, 30.0])
"""Edges of integration panels about a resonance, in half-widths of the resonance."""
PANEL_ANGLE, NARROW_PANELS = 8.0, 30
"""Angle (rad) by which waves turn between axles within a panel, and the number of panels so narrow; above them, axles
count as meeting independent roads, since sums over quick turns vanish.
"""


def frequency_panels(
    motion_rates: np.ndarray, longest_delay: float, frequency_limits: tuple[float, float]
) -> tuple[np.ndarray, ...]:
    """Angular frequencies (w,) in rad/s from 0 to the upper limit, weights (w,) of a sum that approximates the integral
    over them, and whether axles are treated as independent (w,).

    motion_rates : of the vehicle's motions, 1/s; delay : the longest one between axles, s; frequency_limits : of the
    panels that are equal on a logarithmic axis; the first panel extends to 0.
    """
    low, high = frequency_limits
    swinging = motion_rates[motion_rates.imag > 0]
    near = (swinging.imag[:, None] - swinging.real[:, None] * RESONANCE_EDGES).ravel()
    late = PANEL_ANGLE / longest_delay * np.arange(1, NARROW_PANELS + 1) if longest_delay > 0 else np.array([np.inf])
    inner = np.concatenate([near, late])
    even = np.geomspace(low, high, max(2, round(PER_DECADE * np.log10(high / low))))
    edges = np.unique(np.concatenate([[0.0], even, inner[(inner > low) & (inner < high)]]))
    half = np.diff(edges) / 2
    omega = (edges[:-1, None] + half[:, None] * (1 + GAUSS_NODES)).ravel()
    return omega, (half[:, None] * GAUSS_WEIGHTS).ravel(), omega > late[-1]


def filter_states(excitation: RoadExcitation, speeds: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """States (v, w, m, k) of an axle's road filter under unit noise, without delay, at speeds (v,) in m/s and angular
    frequencies (w,) in rad/s.
    """
    corners, V = np.linalg.eig(excitation.F)
    driven = np.linalg.solve(V, excitation.G + 0j)
    waves = 1j * omega[:, None] - speeds[:, None, None] * corners
    return speeds[:, None, None, None] ** 0.5 * (V @ (driven / waves[..., None]))


def at_axles(
    states_of_axle: np.ndarray,
    excitation: RoadExcitation,
    speeds: np.ndarray,
    omega: np.ndarray,
    is_independent: np.ndarray,
) -> np.ndarray:
    """Road filter states (v, w, axles m, noises) of all axles: the states of one axle (v, w, m, k), delayed for each
    axle.

    Axles that are ``is_independent`` (w,), or independent, have noises of their own, axles k; all others share the
    first k.
    """
    (m, k), axles = states_of_axle.shape[2:], len(excitation.lengths)
    has_separate_noise = is_independent | excitation.independent
    states = np.zeros((*states_of_axle.shape[:2], axles * m, (axles if has_separate_noise.any() else 1) * k), complex)
    for i, length in enumerate(excitation.lengths):
        late = (
            states_of_axle * np.exp(-1j * omega * length / speeds[:, None])[..., None, None]
            if length
            else states_of_axle
        )
        rows = states[:, :, i * m : (i + 1) * m]
        rows[:, ~has_separate_noise, :, :k] = late[:, ~has_separate_noise]
        if has_separate_noise.any():
            rows[:, has_separate_noise, :, i * k : (i + 1) * k] = late[:, has_separate_noise]
    return states


@dataclass(frozen=True)
class CornerPair:
    """Two corner frequencies (1/m) of an axle's road filter, whose product contributes to the spectral density."""

    corners: tuple[complex, complex]

    def density(self, speeds: np.ndarray, omega: np.ndarray) -> np.ndarray:
        """Spectral density (v, w) of the pair at speeds (v,) in m/s and angular frequencies (w,) in rad/s; real if both
        corners are the same.
        """
        first, second = (speeds[:, None] * corner for corner in self.corners)
        if self.corners[0] == self.corners[1] and not np.imag(self.corners[0]):
            return np.asarray(speeds[:, None] / (omega**2 + first.real**2))
        return np.asarray(speeds[:, None] / ((1j * omega - first) * (-1j * omega - second.conj())))


class Filters:
    """An axle's road filter decomposed into its eigenmodes, one per corner frequency, whose products are ``pairs``.
    noises : for each corner, the states (m, k) that unit noises excite through its mode.
    """

    def __init__(self, excitation: RoadExcitation) -> None:
        corners, V = np.linalg.eig(excitation.F)
        driven = np.linalg.solve(V, excitation.G + 0j)
        noise = driven @ driven.conj().T
        keys = dict.fromkeys((a, b) for i, a in enumerate(corners) for j, b in enumerate(corners) if noise[i, j])
        self.pairs = [CornerPair((complex(a), complex(b))) for a, b in keys]
        self.noises = {complex(c): V[:, corners == c] @ driven[corners == c] for c in corners}

    def by_noises(self, gains: Sequence[np.ndarray]) -> dict[complex, list[np.ndarray]]:
        """Gains (w, q, k) from noises to the quantities at every axle, for each corner; ``gains`` (w, q, m) : from the
        filter's states.
        """
        rows = [gain.reshape(-1, gain.shape[2]) for gain in gains]
        return {
            corner: [(row @ noise).reshape(*gain.shape[:2], -1) for row, gain in zip(rows, gains, strict=True)]
            for corner, noise in self.noises.items()
        }


def pair_factors(
    gains: Mapping[complex, Sequence[np.ndarray]], axle_pair: CornerPair, all_independent: bool
) -> tuple[np.ndarray, dict[tuple[int, int], np.ndarray]]:
    """Factors of a corner pair's density in the spectral density of the quantities: (w, q) summed over single axles
    and, unless all are ``all_independent``, for every two axles, before the delay between them. ``gains`` : of
    ``Filters.by_noises``.
    """
    first, second = (gains[corner] for corner in axle_pair.corners)
    axles = range(len(first))
    axle_factor = sum(_noise_product(first[i], second[i]) for i in axles)
    return np.asarray(axle_factor), {} if all_independent else {
        (i, j): 2.0 * _noise_product(first[i], second[j]) for i, j in combinations(axles, 2)
    }


def _noise_product(first_factor: np.ndarray, second_factor: np.ndarray) -> np.ndarray:
    """Product of (w, q, k) with the conjugate of (w, q, k), summed over the noises k: (w, q)."""
    return np.einsum("wqk,wqk->wq", first_factor, second_factor.conj())


def variances(
    gains: Sequence[np.ndarray],
    excitation: RoadExcitation,
    speeds: np.ndarray,
    omega: np.ndarray,
    is_independent: np.ndarray,
) -> np.ndarray:
    """Variances (v, q) of quantities at speeds (v,): sums over frequencies (w,) of the response to the road at all
    axles with their delays.

    gains : (w, q, m) of every axle, of its filter's states, with the root of the weights of the sum. Axles that are
    ``is_independent`` (w,), or independent, know nothing of one another.
    """
    total, near = np.zeros((len(speeds), gains[0].shape[1])), ~is_independent
    late, filters = {}, Filters(excitation)
    by_noises = filters.by_noises(gains)
    for pair in filters.pairs:
        density = pair.density(speeds, omega)
        axle_factor, shared = pair_factors(by_noises, pair, excitation.independent)
        total += (density @ axle_factor).real if np.iscomplexobj(density) else density @ axle_factor.real
        for (i, j), met in shared.items():
            length = excitation.lengths[i] - excitation.lengths[j]
            if length not in late:
                late[length] = np.exp(-1j * omega[near] * (length / speeds[:, None]))
            total += ((density[:, near] * late[length]) @ met[near]).real
    return total


def weighting_factors(weightings: Sequence[str], omega: np.ndarray) -> np.ndarray:
    """Complex gains (q, w) of frequency weightings, by their names, at angular frequencies (rad/s); 1 for the name
    "".
    """
    frequency = omega / (2 * np.pi)
    return np.array([WEIGHTINGS[name].response(frequency) if name else np.ones(len(omega)) for name in weightings])
