"""Friction by Pacejka's magic formula on four surfaces, and tyre tables filled from it.

mu = D sin(C atan(B k - E (B k - atan(B k)))) of the slip k, along and across the wheel. H. B. Pacejka, Tyre and vehicle
dynamics, ch. 4.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.tyre import burckhardt
from models.tyre.similarity import ANGLES, SLIPS, by_similarity
from models.tyre.tyre_table import TyreTable


@dataclass(frozen=True)
class Curve:
    """One magic formula: D its peak, B its stiffness, C its shape, E its curvature."""

    D: float
    B: float
    C: float
    E: float

    def __call__(self, slip: np.ndarray) -> np.ndarray:
        """mu at slips from 0 on."""
        bent = self.B * slip
        return self.D * np.sin(self.C * np.arctan(bent - self.E * (bent - np.arctan(bent))))


PACEJKA = {
    "dry": (Curve(1.20, 11.7, 1.69, 0.377), Curve(0.935, 8.86, 1.19, -1.21)),
    "wet": (Curve(1.06, 12.0, 1.80, 0.313), Curve(0.885, 10.7, 1.07, -2.14)),
    "snow": (Curve(0.407, 10.2, 1.96, 0.651), Curve(0.383, 19.1, 0.550, -2.10)),
    "ice": (Curve(0.172, 31.1, 1.77, 0.710), Curve(0.162, 28.4, 1.48, -1.18)),
    "dry/rear": (Curve(1.20, 11.1, 1.69, 0.362), Curve(0.961, 9.30, 1.19, -1.11)),
    "wet/rear": (Curve(1.07, 11.5, 1.80, 0.300), Curve(0.911, 11.3, 1.07, -1.97)),
    "snow/rear": (Curve(0.409, 9.71, 1.96, 0.624), Curve(0.394, 20.0, 0.550, -1.93)),
    "ice/rear": (Curve(0.173, 29.5, 1.77, 0.681), Curve(0.167, 30.0, 1.48, -1.08)),
}
"""Along and across, front and rear tyre of a passenger car: K. Berntorp, B. Olofsson, K. Lundahl, L. Nielsen, Models
and methodology for optimal trajectory generation in safety-critical road-vehicle manoeuvres, Vehicle System Dynamics 52
(2014), as retyped in a public repository; the attribution is recalled, not checked."""

Pure = Callable[[np.ndarray], np.ndarray]
SURFACES: dict[str, tuple[Pure, Pure]] = {**PACEJKA, **{k: (c, c) for k, c in burckhardt.SURFACES.items()}}
"""All surfaces that have a name, along and across."""


def surface(name: str, scale: float = 1.0, load: float = 1e4, fall: float = 0.0) -> TyreTable:
    """Table of one of ``SURFACES``, its friction times ``scale`` at a load (N).

    fall : share of its friction that the tyre has lost at twice that load; 0 for none. It is linear in the load from a
    quarter of it to twice it, and constant beyond.
    """
    if name not in SURFACES:
        raise InputError("", "surface", name, "no such surface", tuple(SURFACES))
    return filled(*SURFACES[name], scale=scale, load=load, fall=fall, name=name)


def filled(
    along: Pure,
    across: Pure,
    *,
    scale: float = 1.0,
    load: float = 1e4,
    fall: float = 0.0,
    angles: np.ndarray = ANGLES,
    slips: np.ndarray = SLIPS,
    name: str = "",
) -> TyreTable:
    """Table of two curves of pure slip at given nodes; see ``surface`` for its friction under other loads."""
    if not 0.0 <= fall < 1.0:
        raise InputError(name, "fall", fall, "must be from 0 to below 1")
    loads = load * np.array([0.25, 1.0, 2.0]) if fall > 0.0 else np.array([load])

    def times(own: float) -> float:
        return scale * (1.0 - fall * (own / load - 1.0))

    return by_similarity(
        lambda k, own: times(own) * along(k), lambda k, own: times(own) * across(k), loads, angles, slips, name
    )
