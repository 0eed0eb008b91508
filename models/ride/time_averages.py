"""How far averages over a time lie from what they estimate: standard errors of one run of a stationary vehicle.

Samples of a run know of each other, so that their number says nothing. With the output's two-sided density S over the
angular frequency, R its Fourier transform and T the time,

    var(mean of y)   = integral of S(w) (sin(w T / 2) / (w T / 2))^2,
    var(mean of y^2) = 2 / T integral of R^2 = 4 pi / T integral of S^2,

the second for a Gaussian output of zero mean and a time long beside its memory (M. S. Bartlett).
"""

import numpy as np

from models.ride.frequency import spectra
from models.road.excitation import Excitation
from models.vehicles.linear_vehicle import LinearVehicle

HIGHEST = 60.0
"""Hz up to which the densities are summed: beyond, the outputs of vehicles have next to nothing."""
PER_LOBE = 8
"""Frequencies for each lobe, 1 / T, of the first integral."""
TOGETHER = 2000


def standard_errors(
    vehicle: LinearVehicle, excitation: Excitation, speed: float, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors (p,) of an output's mean, and of its mean square, over a time of ``duration`` (s)."""
    step = 2.0 * np.pi / duration / PER_LOBE
    omega = step * (np.arange(int(2.0 * np.pi * HIGHEST / step)) + 0.5)
    parts = np.array_split(omega, -(-len(omega) // TOGETHER))
    density = np.concatenate([spectra(vehicle, excitation, speed, part) for part in parts])
    mean = 2.0 * step * np.sinc(omega * duration / (2.0 * np.pi)) ** 2 @ density
    square = 8.0 * np.pi / duration * step * (density**2).sum(axis=0)
    return np.sqrt(mean), np.sqrt(square)
