"""Outputs from the spectral densities of the heights under the wheels: for roads that no finite filter makes.

No state and no noise: the transfer functions of the vehicle alone, between the densities of heights and of outputs. It
serves isotropic roads and measured densities; roads of filters have an exact quadrature of their own (frequency.py).
"""

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import leggauss

from models.ride.frequency import transfer
from models.vehicles.linear_vehicle import LinearVehicle

Densities = Callable[[np.ndarray], np.ndarray]
"""From wavenumbers (k,) in rad/m to the two-sided densities (k, w, w) of heights, see models/road/isotropic.py."""
POINTS = 10
"""Gauss points per panel; a panel is at most a quarter of an octave wide and half a wave of the longest delay."""


def output_densities(vehicle: LinearVehicle, road: Densities, speed: float, wavenumber: np.ndarray) -> np.ndarray:
    """Two-sided densities (k, p) of the outputs over the wavenumber (rad/m), in unit^2 m, at a speed in m/s."""
    H = transfer(vehicle, speed * wavenumber)
    return np.einsum("kpi,kij,kpj->kp", H.conj(), road(wavenumber), H, optimize=True).real


def variances(vehicle: LinearVehicle, road: Densities, speed: float, low: float, high: float) -> np.ndarray:
    """Variances (p,) in unit^2 of the outputs, from the wavenumbers ``low`` to ``high`` (rad/m) on both sides of 0.

    What lies outside is left out: a band limit where that is wanted, an error where it is not.
    """
    wavenumber, weight = both_sides(vehicle, low, high)
    return np.asarray(weight @ output_densities(vehicle, road, speed, wavenumber))


def both_sides(vehicle: LinearVehicle, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Wavenumbers (k,) in rad/m from ``low`` to ``high`` and their weights in an integral over both sides of 0."""
    behind = vehicle.axles[0] - vehicle.axles[-1]
    longest = np.pi / behind if behind else np.inf
    edges = [low]
    while edges[-1] < high:
        edges.append(min(edges[-1] + min(0.19 * edges[-1], longest), high))
    nodes, weights = leggauss(POINTS)
    start, half = np.array(edges[:-1]), np.diff(edges) / 2.0
    return ((start + half)[:, None] + half[:, None] * nodes).ravel(), (2.0 * half[:, None] * weights).ravel()
