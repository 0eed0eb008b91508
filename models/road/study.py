"""The study road of the drift experiments, and its hills alone, in closed form.

Heights are positive down. The road is flat at height 0 up to s = 0 and fades in over 40 m, so that a
vehicle in static equilibrium at s = 0 meets it without a jump in height, slope or curvature.
"""

import math

import numpy as np

from models.core.errors import InputError
from models.road.profile import SineProfile

STUDY_GD = 2.4e-3
"""Roughness level of the study road: one-sided displacement density at 0.1 waves per metre, m^3."""
FADE_IN_LENGTH = 40.0
"""Length (m) over which the study road fades in from the flat."""
HILL_AMPLITUDES = np.array([1.2, 0.6, 0.2])
"""Amplitudes (m) of the study road's hills."""
HILL_LENGTHS = np.array([400.0, 150.0, 60.0])
"""Wavelengths (m) of the study road's hills."""


def hills_road() -> SineProfile:
    """Road with hills only: amplitudes 1.2, 0.6, 0.2 m at wavelengths 400, 150, 60 m, all with phase 0 at s = 0."""
    return SineProfile(HILL_AMPLITUDES, 2.0 * math.pi / HILL_LENGTHS, np.zeros(3), FADE_IN_LENGTH, "hills")


def study_road(gd: float = STUDY_GD) -> SineProfile:
    """Road with hills and 60 waves of roughness from 0.05 to 2 waves per metre, with fixed phases.

    Parameters
    ----------
    gd : one-sided displacement density at 0.1 waves per metre, m^3, falling with the square of the
        spatial frequency; 0 leaves the hills. The amplitudes grow with sqrt(gd): a road 25 % rougher in
        height has 1.25^2 times the density.

    Raises
    ------
    InputError : gd is negative or not finite
    """
    if not (math.isfinite(gd) and gd >= 0.0):
        raise InputError("", "gd", gd, "must be a finite density in m^3, 0 or more")
    hills = hills_road()
    amplitude, wavenumber = road_waves(gd, 0.05, 2.0, 60)
    return SineProfile(
        np.concatenate([amplitude, hills.amplitude]),
        np.concatenate([wavenumber, hills.wavenumber]),
        np.concatenate([golden_phases(60), hills.phase]),
        FADE_IN_LENGTH,
        f"study, Gd = {gd:g} m^3",
    )


def road_waves(
    gd: float, lowest_spatial_frequency: float, highest_spatial_frequency: float, wave_count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes (m) and wavenumbers (rad/m) of a road with the one-sided density gd (n / 0.1)^-2.

    Each wave stands for one of ``wave_count`` bins between ``lowest_spatial_frequency`` and
    ``highest_spatial_frequency`` (waves per metre), spaced by equal ratios, at the bin's geometric mean n: amplitude =
    sqrt(2 Gd(n) dn). For a density that falls with n^-2 this keeps the power of every bin exactly, because (e2 - e1) /
    (e1 e2) = 1/e1 - 1/e2.
    """
    edges = np.geomspace(lowest_spatial_frequency, highest_spatial_frequency, wave_count + 1)
    n = np.sqrt(edges[:-1] * edges[1:])
    return np.sqrt(2.0 * gd * (n / 0.1) ** -2 * np.diff(edges)), 2.0 * math.pi * n


def golden_phases(wave_count: int) -> np.ndarray:
    """Phases 2 pi frac(i (sqrt(5) - 1) / 2), i = 1 .. wave_count, rad: evenly spread without random numbers."""
    return 2.0 * math.pi * np.modf(np.arange(1, wave_count + 1) * (math.sqrt(5.0) - 1.0) / 2.0)[0]
