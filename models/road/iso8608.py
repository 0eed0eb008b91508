"""Random roads of the ISO 8608 classes, as sums of sines with phases drawn from a seed.

The standard gives the **one-sided** displacement density Gd(n), in m^3 over the spatial frequency n in
waves per metre: the variance of the height is its integral over positive n alone. A class is named by
the geometric mean of Gd at n0 = 0.1 waves per metre; Gd(n) = Gd(n0) (n / n0)^-2 (ISO 8608:2016, 5.2 and
Annex C). Some texts give two-sided densities, half as high at each n and standing at -n as well.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from models.core.errors import InputError

if TYPE_CHECKING:
    from models.road.profile import SineProfile

DENSITY_OF_CLASS = {name: 16e-6 * 4.0**i for i, name in enumerate("ABCDEFGH")}
"""Geometric mean of the one-sided density Gd(0.1 waves per metre) of each ISO 8608 class, m^3; the upper limit of a
class is twice that."""

FACTOR_TO_ONE_SIDED = {"one-sided": 1.0, "two-sided": 2.0}
"""Factor from a density as it was stated, one-sided or two-sided, to the one-sided density of the same road."""


def iso8608_road(
    road_class: str,
    seed: int = 0,
    *,
    n_min: float = 0.011,
    n_max: float = 2.83,
    waves: int = 100,
    level_convention: str = "one-sided",
    window_length: float = 40.0,
) -> "SineProfile":
    """Random road at the geometric mean of an ISO 8608 class.

    Parameters
    ----------
    road_class : "A" to "H"
    seed : of the phases, 0 or more; the same seed gives the same road everywhere
    n_min, n_max : band in waves per metre; the defaults are the standard's own limits
    waves : number of sines, one per bin of equal ratio
    level_convention : "one-sided" (the standard): amplitude_i = sqrt(2 Gd(n_i) dn_i), so that sum amplitude^2 / 2 is
        the integral of Gd over the band. "two-sided" reads the same figure as a density that stands at
        -n as well: the variance is doubled, every amplitude sqrt(2) times as high.
    window_length : fade-in from the flat at s = 0, m

    Raises
    ------
    InputError : unknown class or level, a band, a seed or a number of waves that is not possible
    """
    _check_class(road_class, level_convention)
    road = rough_road(
        DENSITY_OF_CLASS[road_class] * FACTOR_TO_ONE_SIDED[level_convention], seed, n_min, n_max, waves, window_length
    )
    name = f"ISO 8608 class {road_class} ({level_convention}), seed {seed}"
    from models.road.profile import SineProfile

    return SineProfile(road.amplitude, road.wavenumber, road.phase, road.window_length, name)


def level_of_class(road_class: str, level_convention: str = "one-sided") -> float:
    """Level S0 (m) of an ISO 8608 class: the density at its geometric mean is S0 / Omega^2, **two-sided** over Omega in
    rad/m.

    One-sided Gd(n) = Gd(0.1) (n / 0.1)^-2 over waves per metre is 2 pi 0.01 Gd(0.1) / Omega^2 over Omega = 2 pi n,
    half of it two-sided. ``level_convention`` says how the standard's figure is read, see :func:`iso8608_road`. Raises
    InputError for an unknown class or level.
    """
    _check_class(road_class, level_convention)
    return math.pi * 0.1**2 * DENSITY_OF_CLASS[road_class] * FACTOR_TO_ONE_SIDED[level_convention]


def class_at_level(density_level: float) -> str:
    """Text with the ISO 8608 class of a road of density S0 / Omega^2 (S0 in m, two-sided over rad/m), and the
    convention used."""
    if density_level <= 0.0:
        return "smooth"
    class_number = math.log(
        density_level / level_of_class("A"), 4.0
    )  # whole numbers: means; halves: the limits between classes
    name = list(DENSITY_OF_CLASS)[min(max(round(class_number), 0), len(DENSITY_OF_CLASS) - 1)]
    return f"{density_level / level_of_class(name):.2f} times the mean of ISO 8608 class {name}, one-sided"


def rough_road(
    gd: float, seed: int, n_min: float, n_max: float, waves: int, window_length: float = 40.0
) -> "SineProfile":
    """Random road with the **one-sided** density gd (n / 0.1)^-2 (gd in m^3) over n in waves per metre; other
    parameters as in :func:`iso8608_road`."""
    _check_band(gd, seed, n_min, n_max, waves)
    from models.road.profile import SineProfile
    from models.road.study import road_waves

    amplitude, wavenumber = road_waves(gd, n_min, n_max, waves)
    name = f"Gd = {gd:g} m^3 (one-sided), seed {seed}"
    return SineProfile(amplitude, wavenumber, random_phases(seed, waves), window_length, name)


def random_phases(seed: int, waves: int) -> np.ndarray:
    """Random phases in [0, 2 pi), rad, shape (waves,), from the Philox counter with ``seed`` as its key.

    Made from the raw 64-bit words, not by a distribution of numpy, whose stream may change between
    versions: a road named by its seed has to stay the same road.
    """
    words = np.random.Philox(key=seed).random_raw(waves)
    return 2.0 * math.pi * 2.0**-53 * (words >> np.uint64(11)).astype(float)


def _check_class(road_class: str, level_convention: str) -> None:
    """Refuse a class or level convention that the standard does not know."""
    if road_class not in DENSITY_OF_CLASS:
        raise InputError("", "road class", road_class, "must be a class of ISO 8608", tuple(DENSITY_OF_CLASS))
    if level_convention not in FACTOR_TO_ONE_SIDED:
        raise InputError(
            "", "level", level_convention, "must say how the density is to be read", tuple(FACTOR_TO_ONE_SIDED)
        )


def _check_band(gd: float, seed: int, n_min: float, n_max: float, waves: int) -> None:
    """Refuse a density, seed, band or number of waves that is not possible."""
    if not (math.isfinite(gd) and gd >= 0.0):
        raise InputError("", "gd", gd, "must be a finite density in m^3, 0 or more")
    if not (math.isfinite(n_max) and 0.0 < n_min < n_max):
        raise InputError("", "n_min, n_max", (n_min, n_max), "must be 0 < n_min < n_max, in waves per metre")
    if waves < 1:
        raise InputError("", "waves", waves, "must be a whole number, 1 or more")
    if not 0 <= seed < 2**128:
        raise InputError("", "seed", seed, "must be a whole number, 0 or more and below 2^128")
