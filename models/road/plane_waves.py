"""Rough road surface under a vehicle that may leave its lane: an isotropic Gaussian surface as a sum of plane waves."""

import numpy as np

from models.core.errors import InputError
from models.core.noise import ROAD, normal_samples

LONGEST_WAVELENGTH, SHORTEST_WAVELENGTH = 60.0, 0.5
"""Longest and shortest wavelength (m); shorter waves are swallowed by the tyre's contact patch."""
GOLDEN_RATIO = (np.sqrt(5.0) - 1.0) / 2.0


def plane_waves(density_level: float, wave_count: int = 48, seed: int = 0) -> np.ndarray:
    """Plane waves of a rough surface, (wave_count, 4): wave numbers along x and y (rad/m), amplitudes of cosine and
    sine (m).

    density_level : every track has the two-sided density level / Omega^2 (S0 in m), whatever its direction; wave_count
    : of waves, 1 or more, evenly over the logarithm of their length and over directions. A density level / Omega^2 of
    tracks is that of a surface whose variance by wave number k is pi level / k^2. Raises InputError.
    """
    if not (np.isfinite(density_level) and density_level >= 0.0):
        raise InputError("", "level", density_level, "must be 0 or more, in m")
    if isinstance(wave_count, bool) or not isinstance(wave_count, int) or not 1 <= wave_count <= 10_000:
        raise InputError("", "waves", wave_count, "must be a whole number from 1 to 10000")
    edges = np.geomspace(2.0 * np.pi / LONGEST_WAVELENGTH, 2.0 * np.pi / SHORTEST_WAVELENGTH, wave_count + 1)
    number = np.sqrt(edges[:-1] * edges[1:])
    direction = 2.0 * np.pi * np.modf(GOLDEN_RATIO * np.arange(wave_count))[0]
    deviation = np.sqrt(np.pi * density_level * (1.0 / edges[:-1] - 1.0 / edges[1:]))
    amplitudes = deviation[:, None] * normal_samples(seed, 0, wave_count, 2, noise_source=ROAD)
    return np.column_stack([number * np.cos(direction), number * np.sin(direction), amplitudes])
