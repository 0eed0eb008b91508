"""Spectra of a vehicle's outputs on a random road, and variances as integrals over them: independent of the covariance
equation.

Transfer functions come from the dynamic stiffness K + i w D - w^2 M, frequency by frequency; the road is put in front
as a factor. The integrand of a delay, f(w) e^(i w tau), is smooth but for its oscillation: f is interpolated by
Legendre polynomials on panels, and the product with the oscillation is integrated exactly (Filon's idea, through
spherical Bessel functions), so that panels need not follow the delay. They are halved until halving changes nothing.

Roads that no finite filter makes, isotropic or measured ones, are given by the densities of the heights under the
wheels; between these and those of the outputs stand the transfer functions alone.

Averages of one run over a time T lie from what they estimate as far as the densities S over the angular frequency say,
for samples of a run know of each other, so that their number says nothing:

    var(mean of y)   = integral of S(w) (sin(w T / 2) / (w T / 2))^2,
    var(mean of y^2) = 4 pi / T integral of S^2,

the second for a Gaussian output of zero mean and a time long beside its memory (M. S. Bartlett).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.special import eval_legendre, spherical_jn

from models.ride.marginal import UnstableVehicle
from models.road.excitation import RoadExcitation
from models.vehicles.linear_vehicle import LinearVehicle, eigenvalues

GAUSS_POINTS = 16
"""Count of Gauss points of a panel."""
LOWEST_RATIO, HIGHEST_RATIO = 0.02, 1e12
"""Ratios of the ends of the first and of the last panel to the lowest and the highest frequency of vehicle and road.
Not lower: near zero the stiffness of a free vehicle is only rounding, so that the first panel is not halved for ever
either."""
PANEL_TOLERANCE = 1e-11
"""Relative change of a variance by halving a panel above which the panel is halved again; MOST_PANELS panels at
most."""
MOST_PANELS = 1500
MACHINE_EPSILON = float(np.finfo(float).eps)
GROWTH_SHARE = 1e-6
"""Share of the fastest rate below which a growth rate counts as rounding: a Jordan pair of zeros comes out at the root
of rounding."""
SILENCE_SHARE = 1e-24
"""Share of its terms' squares below which an output is zero by symmetry, so that its value is only rounding."""

WeightingNames = Mapping[str, Callable[[np.ndarray], np.ndarray]]
"""Weighting of each output by name: its complex factor as a function of the frequency in Hz."""


@dataclass(frozen=True)
class QuadratureResult:
    """Result of the integration: variance (p,), its estimated relative error (p,), and the number of frequencies
    used."""

    variance: np.ndarray
    error: np.ndarray
    frequencies: int


def transfer_functions(linear_vehicle: LinearVehicle, angular_frequencies: np.ndarray) -> np.ndarray:
    """Transfer functions (n, p, w) from heights under the wheels to outputs at angular frequencies (n,) in rad/s, from
    the dynamic stiffness."""
    s = 1j * np.asarray(angular_frequencies, float)[:, None, None]
    stiffness = linear_vehicle.stiffness + s * linear_vehicle.damping + s**2 * linear_vehicle.mass
    motion = np.linalg.solve(stiffness, linear_vehicle.road_stiffness + s * linear_vehicle.road_damping)
    read = linear_vehicle.read
    rows = read.displacement_factors + s * read.rate_factors + s**2 * read.acceleration_factors
    return rows @ motion + read.road_factors + s * read.road_rate_factors


def road_transfer(road_excitation: RoadExcitation, speed: float, angular_frequencies: np.ndarray) -> np.ndarray:
    """Transfer functions (a, n, w, k), in m / sqrt(1/s), from the road's noise to the heights under the wheels, one
    axle after the other, without delays."""
    s = 1j * np.asarray(angular_frequencies, float)[:, None, None]
    shape = s * np.eye(len(road_excitation.F)) - speed * road_excitation.F
    filtered = np.linalg.solve(shape, speed**0.5 * road_excitation.G.astype(complex)[None])
    return np.array([heights @ filtered for heights in road_excitation.heights])


def spectral_densities(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    angular_frequencies: np.ndarray,
    weighting_filters: WeightingNames | None = None,
) -> np.ndarray:
    """Two-sided spectral densities (n, p) of the outputs over the angular frequency (rad/s); their integral over
    positive and negative frequencies is the variance."""
    parts = _weighted_transfer(linear_vehicle, angular_frequencies, weighting_filters or {}) @ road_transfer(
        road_excitation, speed, angular_frequencies
    )
    if road_excitation.independent:
        return (abs(parts) ** 2).sum(axis=(0, 3)) / (2 * np.pi)
    delays = np.array(road_excitation.lengths) / speed
    delayed_parts = parts * np.exp(-1j * delays[:, None] * angular_frequencies)[:, :, None, None]
    return (abs(delayed_parts.sum(axis=0)) ** 2).sum(axis=2) / (2 * np.pi)


def one_sided_densities(
    linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float, frequencies: np.ndarray
) -> np.ndarray:
    """One-sided spectral densities (n, p) of the outputs over the frequency (Hz)."""
    return 4 * np.pi * spectral_densities(linear_vehicle, road_excitation, speed, 2 * np.pi * frequencies)


def _weighted_transfer(
    linear_vehicle: LinearVehicle, angular_frequencies: np.ndarray, weighting_filters: WeightingNames
) -> np.ndarray:
    """Transfer functions (n, p, w) from road heights to outputs, in which weighted outputs replace the unweighted
    ones."""
    transfer = transfer_functions(linear_vehicle, angular_frequencies)
    for i, output in enumerate(linear_vehicle.outputs):
        if output.name in weighting_filters:
            transfer[:, i] *= weighting_filters[output.name](angular_frequencies / (2 * np.pi))[:, None]
    return transfer


def variances_by_quadrature(
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    weighting_filters: WeightingNames | None = None,
) -> QuadratureResult:
    """Variances of the outputs as integrals of their spectra over all frequencies; inf where an integral diverges.

    Outputs with a weighting are replaced by their weighted ones.

    The error holds what halving the panels changes, the tail beyond the last one, and what a last digit of the
    largest stiffness of each motion changes: that is much for places of a vehicle that is free to drive away. Raises
    Unstable: an integral over frequencies is finite then, and means nothing.
    """
    _check_stable(linear_vehicle)

    def panel_integrals(panel_edges: np.ndarray, stable_vehicle: LinearVehicle = linear_vehicle) -> np.ndarray:
        """Contributions (panels, p) to the variances from the frequency interval in each row of ``panel_edges``."""
        centre, half = panel_edges.mean(axis=1), np.diff(panel_edges, axis=1)[:, 0] / 2
        omega = (centre[:, None] + half[:, None] * LEGENDRE_NODES).ravel()
        parts = _weighted_transfer(stable_vehicle, omega, weighting_filters or {}) @ road_transfer(
            road_excitation, speed, omega
        )
        parts = parts.reshape(len(parts), len(centre), GAUSS_POINTS, *parts.shape[2:])
        return _panel_integrals(parts, centre, half, road_excitation, speed)

    frequencies = _panel_edges(linear_vehicle, road_excitation, speed)
    edges = np.column_stack([frequencies[:-1], frequencies[1:]])
    first = panel_integrals(edges)
    stiffness = linear_vehicle.stiffness
    largest = np.sqrt(abs(stiffness).max(axis=1, initial=0.0))
    digit = MACHINE_EPSILON * np.outer(largest, largest) * np.cos(np.arange(stiffness.size)).reshape(stiffness.shape)
    nudged = panel_integrals(edges, replace(linear_vehicle, stiffness=stiffness + digit))
    rounding = 10 * abs((nudged - first).sum(axis=0))  # one draw of many
    weighted_gains = abs(_weighted_transfer(linear_vehicle, frequencies[1:], weighting_filters or {})) @ abs(
        road_transfer(road_excitation, speed, frequencies[1:])
    )
    terms = np.einsum("ambk,ambk,m->b", weighted_gains, weighted_gains, frequencies[1:])
    total = abs(first).sum(axis=0)
    limit = np.maximum(PANEL_TOLERANCE * np.maximum(total, SILENCE_SHARE * terms), rounding)
    variance, error, panels_used = _halve_panels(panel_integrals, edges, first, limit)
    error += abs(first[-1]) + rounding  # beyond the last panel lies as much as in it
    known = np.divide(error, variance, out=np.zeros(len(total)), where=variance > 0)
    diverges = (abs(first[[0, -1]]) > 0.1 * total).any(axis=0)
    return QuadratureResult(np.where(diverges, np.inf, variance), known, panels_used * GAUSS_POINTS)


def _check_stable(linear_vehicle: LinearVehicle) -> None:
    """Raise Unstable if a motion grows faster than rounding alone can make a free motion grow."""
    rates = eigenvalues(linear_vehicle)
    worst = rates[rates.real.argmax()]
    if worst.real > GROWTH_SHARE * abs(rates).max():
        raise UnstableVehicle(worst.real, abs(worst.imag) / (2 * np.pi))


def _halve_panels(
    integrate_panels: Callable[[np.ndarray], np.ndarray],
    panel_edges: np.ndarray,
    panel_integrals: np.ndarray,
    largest_change: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Sums (p,) of the integral over all panels, their changes by the last halving, and the number of panels; panels
    are halved until that changes each of their integrals by at most ``largest_change`` (p,)."""
    variance, error = np.zeros_like(largest_change), np.zeros_like(largest_change)
    panels_used, lowest = 2 * len(panel_edges), panel_edges[0, 1] / 64
    while len(panel_edges):
        finer = np.column_stack(
            [panel_edges[:, 0], panel_edges.mean(axis=1), panel_edges.mean(axis=1), panel_edges[:, 1]]
        ).reshape(-1, 2)
        parts = integrate_panels(finer)
        panels_used += len(finer)
        halves = parts.reshape(len(panel_edges), 2, -1).sum(axis=1)
        change = abs(halves - panel_integrals)
        rough = (change > largest_change).any(axis=1) & (panel_edges[:, 1] > lowest) & (panels_used < MOST_PANELS)
        variance += halves[~rough].sum(axis=0)
        error += change[~rough].sum(axis=0)
        panel_edges, panel_integrals = finer[np.repeat(rough, 2)], parts[np.repeat(rough, 2)]
    return variance, error, panels_used


LEGENDRE_NODES, LEGENDRE_WEIGHTS = leggauss(GAUSS_POINTS)
LEGENDRE_DEGREES = np.arange(GAUSS_POINTS)
TO_LEGENDRE = (
    (LEGENDRE_DEGREES[:, None] + 0.5) * eval_legendre(LEGENDRE_DEGREES[:, None], LEGENDRE_NODES) * LEGENDRE_WEIGHTS
)
"""Matrix (degree, node) from values at the Gauss nodes to coefficients of the Legendre polynomials."""


def _panel_integrals(
    delayed_parts: np.ndarray,
    panel_centres: np.ndarray,
    panel_half_widths: np.ndarray,
    road_excitation: RoadExcitation,
    speed: float,
) -> np.ndarray:
    """Contributions (panels, p) to the variances, for outputs that are sums of delayed parts (a, panels, nodes, p, k);
    both signs of the frequency are included."""
    integrals = np.einsum("ambpk,ambpk,b->mp", delayed_parts, delayed_parts.conj(), LEGENDRE_WEIGHTS).real
    for j in range(1, len(delayed_parts)) if not road_excitation.independent else ():
        for i in range(j):
            gap = (road_excitation.lengths[j] - road_excitation.lengths[i]) / speed
            moments = 2 * 1j**LEGENDRE_DEGREES * spherical_jn(LEGENDRE_DEGREES, (panel_half_widths * gap)[:, None])
            weight = np.exp(1j * panel_centres * gap)[:, None] * (moments @ TO_LEGENDRE)
            integrals += 2 * np.einsum("mbpk,mbpk,mb->mp", delayed_parts[i], delayed_parts[j].conj(), weight).real
    return integrals * panel_half_widths[:, None] / np.pi


def _panel_edges(linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float) -> np.ndarray:
    """Edges (rad/s) of the first panels: frequencies that double from nearly 0 to far above all motions, and the
    undamped natural frequencies."""
    squares = abs(np.linalg.eigvals(np.linalg.solve(linear_vehicle.mass, linear_vehicle.stiffness)))
    natural = np.sqrt(squares[squares > 1e-8 * squares.max()])
    corners = speed * abs(np.linalg.eigvals(road_excitation.F))
    marks = np.concatenate([natural, corners[corners > 0]])
    low, high = LOWEST_RATIO * marks.min(), HIGHEST_RATIO * marks.max()
    doublings = np.geomspace(low, high, int(np.ceil(np.log2(high / low))))
    return np.unique(np.concatenate([[0.0], doublings, natural]))


HeightDensities = Callable[[np.ndarray], np.ndarray]
"""Function from wavenumbers (k,) in rad/m to the two-sided densities (k, w, w) of the heights under the wheels, see
models/road/isotropic.py."""
GAUSS_POINTS_PER_PANEL = 10
"""Count of Gauss points per panel; a panel is at most a quarter of an octave wide and half a wave of the longest
delay."""


def output_densities(
    linear_vehicle: LinearVehicle, height_densities: HeightDensities, speed: float, wavenumbers: np.ndarray
) -> np.ndarray:
    """Two-sided spectral densities (k, p) of the outputs over the wavenumber (rad/m), in unit^2 m, at a speed in
    m/s."""
    H = transfer_functions(linear_vehicle, speed * wavenumbers)
    return np.einsum("kpi,kij,kpj->kp", H.conj(), height_densities(wavenumbers), H, optimize=True).real


def variances_over_wavenumbers(
    linear_vehicle: LinearVehicle,
    height_densities: HeightDensities,
    speed: float,
    lowest_wavenumber: float,
    highest_wavenumber: float,
) -> np.ndarray:
    """Variances (p,) of the outputs in unit^2, from wavenumbers between ``lowest_wavenumber`` and
    ``highest_wavenumber`` (rad/m), positive and negative.

    What lies outside is left out: a band limit where that is wanted, an error where it is not.
    """
    wavenumber, weight = signed_wavenumbers(linear_vehicle, lowest_wavenumber, highest_wavenumber)
    return weight @ output_densities(linear_vehicle, height_densities, speed, wavenumber)


def signed_wavenumbers(
    linear_vehicle: LinearVehicle, lowest_wavenumber: float, highest_wavenumber: float
) -> tuple[np.ndarray, np.ndarray]:
    """Positive and negative wavenumbers (k,) in rad/m with absolute values between ``lowest_wavenumber`` and
    ``highest_wavenumber``, and their weights for integration.
    """
    behind = linear_vehicle.axles[0] - linear_vehicle.axles[-1]
    longest = np.pi / behind if behind else np.inf
    edges = [lowest_wavenumber]
    while edges[-1] < highest_wavenumber:
        edges.append(min(edges[-1] + min(0.19 * edges[-1], longest), highest_wavenumber))
    nodes, weights = leggauss(GAUSS_POINTS_PER_PANEL)
    start, half = np.array(edges[:-1]), np.diff(edges) / 2.0
    return ((start + half)[:, None] + half[:, None] * nodes).ravel(), (2.0 * half[:, None] * weights).ravel()


HIGHEST_FREQUENCY = 60.0
"""Frequency (Hz) up to which the densities are summed: beyond, the outputs of vehicles have next to nothing."""
FREQUENCIES_PER_LOBE = 8
"""Count of frequencies in each lobe, 1 / T wide, of the integrand of the mean's variance."""
FREQUENCIES_AT_ONCE = 2000
"""Count of frequencies whose densities are computed at once."""


def standard_errors(
    linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors (p,) of an output's mean, and of its mean square, when averaged over a time of ``duration``
    (s)."""
    step = 2.0 * np.pi / duration / FREQUENCIES_PER_LOBE
    omega = step * (np.arange(int(2.0 * np.pi * HIGHEST_FREQUENCY / step)) + 0.5)
    parts = np.array_split(omega, -(-len(omega) // FREQUENCIES_AT_ONCE))
    density = np.concatenate(
        [spectral_densities(linear_vehicle, road_excitation, speed, omega_part) for omega_part in parts]
    )
    mean = 2.0 * step * np.sinc(omega * duration / (2.0 * np.pi)) ** 2 @ density
    square = 8.0 * np.pi / duration * step * (density**2).sum(axis=0)
    return np.sqrt(mean), np.sqrt(square)
