"""Isotropic random roads (Dodds and Robson 1973): the same statistics in every direction, so that a single track
defines them.

The covariance of two heights depends on their distance r alone: R(r), the autocovariance of a track. Two parallel
tracks a distance d apart then have the cross-covariance R(sqrt(x^2 + d^2)), and the cross density

    S(Omega, d) = 1 / (2 pi) int R(sqrt(x^2 + d^2)) cos(Omega x) dx = int Phi(sqrt(Omega^2 + k^2)) cos(k d) dk,

Phi being the two-dimensional density, the Hankel transform of R. For a track of the density
g / (a^2 + Omega^2)^(w / 2), sigma = sqrt(a^2 + Omega^2), it is S(Omega) times the coherency

    2 (sigma d / 2)^(w / 2) K_(w / 2)(sigma d) / Gamma(w / 2),        sigma d K_1(sigma d) for w = 2,

K the modified Bessel function of the second kind: all falls exponentially with the distance over the wavelength.
No finite filter has such a cross density: these roads are for the frequency route.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.road.iso8608 import level_of_class
from models.road.two_track import TwoTrackRoad
from models.vehicles.linear_vehicle import WheelPosition


@dataclass(frozen=True)
class DensityTerm:
    """Term of a track's spectral density, level / (corner^2 + Omega^2)^(waviness / 2), two-sided, with its cross
    density in closed form.

    level : in m^3 (rad/m)^(waviness), S0 in m for waviness 2; corner in rad/m, 0 or more; waviness above 1
    """

    level: float
    corner: float = 0.0
    waviness: float = 2.0

    def __post_init__(self) -> None:
        """Raise InputError for what is no density."""
        if not (math.isfinite(self.level) and math.isfinite(self.corner) and self.corner >= 0.0):
            raise InputError("", "corner", self.corner, "must be 0 or more, in rad/m, and the level finite")
        if not (math.isfinite(self.waviness) and self.waviness > 1.0):
            raise InputError("", "waviness", self.waviness, "must be above 1: else the heights have no variance")

    def density(self, wavenumber: np.ndarray, track_distance: float) -> np.ndarray:
        """Cross density (m^3) of tracks ``track_distance`` (m) apart, or the density of one track at distance 0;
        infinite where wavenumber and corner are both 0.
        """
        from scipy.special import gamma, kv

        sigma, order = np.hypot(self.corner, wavenumber), self.waviness / 2.0
        with np.errstate(divide="ignore"):
            track = self.level * sigma**-self.waviness
        x = np.asarray(sigma * abs(track_distance))
        coherency = np.ones(x.shape)
        is_distant = x > 1e-8  # below, the coherency is 1 to rounding
        coherency[is_distant] = 2.0 * (x[is_distant] / 2.0) ** order * kv(order, x[is_distant]) / gamma(order)
        return track * coherency


@dataclass(frozen=True)
class IsotropicRoad:
    """Random road with the same statistics in all directions; its track density is the sum of several terms
    ``DensityTerm``."""

    parts: tuple[DensityTerm, ...]

    def spectrum(self, wavenumber: np.ndarray) -> np.ndarray:
        """Two-sided spectral density (m^3) of any track over the wavenumber (rad/m)."""
        return self.cross_spectrum(wavenumber, 0.0)

    def cross_spectrum(self, wavenumber: np.ndarray, track_distance: float) -> np.ndarray:
        """Two-sided cross density (m^3) of two tracks ``track_distance`` (m) apart; real."""
        return np.sum([density_part.density(wavenumber, track_distance) for density_part in self.parts], axis=0)

    def coherency(self, wavenumber: np.ndarray, track_distance: float) -> np.ndarray:
        """Coherency of two tracks ``track_distance`` (m) apart: ratio of their cross density to the density of one
        track.
        """
        return self.cross_spectrum(wavenumber, track_distance) / self.spectrum(wavenumber)


def isotropic_road_like(two_track_road: TwoTrackRoad, lateral_position: float) -> IsotropicRoad:
    """Isotropic road with the same spectrum as the two-track road has on its track at y (m). Raises InputError
    unless both processes of that road are of first order."""
    if two_track_road.mean.cutoff is not None or two_track_road.roll.cutoff is not None:
        raise InputError(
            "", "cutoff", two_track_road.mean.cutoff or two_track_road.roll.cutoff, "is not known to isotropic roads"
        )
    shares = ((two_track_road.mean, 1.0), (two_track_road.roll, lateral_position * lateral_position))
    return IsotropicRoad(
        tuple(
            DensityTerm(share * f.intensity / (2.0 * math.pi), f.corner) for f, share in shares if share * f.intensity
        )
    )


def isotropic_class(
    road_class: str, corner_wavenumber: float = 0.0, level_convention: str = "one-sided"
) -> IsotropicRoad:
    """Isotropic road at the mean of an ISO 8608 class, levelled off below the corner (rad/m)."""
    return IsotropicRoad((DensityTerm(level_of_class(road_class, level_convention), corner_wavenumber),))


def cross_spectrum_of(
    covariance: Callable[[float], float], wavenumber: Sequence[float], track_distance: float
) -> np.ndarray:
    """Cross density (m^3) of two tracks by numerical integration, for any autocovariance R(r) in m^2 of a track;
    wavenumbers above 0 (rad/m).

    Its error is about 1e-12 m times R(distance), whatever the density itself.
    """
    from scipy.integrate import quad

    scale = covariance(abs(track_distance))

    def density_at(single_wavenumber: float) -> float:
        integral = quad(
            lambda x: covariance(math.hypot(x, track_distance)) / scale,
            0.0,
            math.inf,
            weight="cos",
            wvar=single_wavenumber,
            epsabs=1e-12,
            limlst=500,
        )
        return float(integral[0]) * scale / math.pi

    return np.array([density_at(k) for k in wavenumber])


def spectral_matrix(
    road: IsotropicRoad | TwoTrackRoad, wheels: Sequence[WheelPosition], wavenumber: np.ndarray
) -> np.ndarray:
    """Densities (k, w, w) in m^3 of the heights under the wheels, rear axles delayed, over k wavenumbers (rad/m).

    Entry ij is 1/(2 pi) int E[z_i(s) z_j(s + a)] exp(-i Omega a) da = S_ij exp(i Omega (x_j - x_i)): a response with
    the transfer functions H_i has the density sum_ij conj(H_i) S_ij H_j.
    """
    matrices = np.empty((len(wavenumber), len(wheels), len(wheels)), complex)
    for i, first in enumerate(wheels):
        for j, second_wheel in enumerate(wheels):
            if isinstance(road, TwoTrackRoad):
                side = road.cross_spectrum(wavenumber, first.y, second_wheel.y)
            else:
                side = road.cross_spectrum(wavenumber, first.y - second_wheel.y)
            matrices[:, i, j] = side * np.exp(1j * wavenumber * (second_wheel.x - first.x))
    return matrices
