"""Friction by Pacejka's magic formula on four surfaces, and tyre tables filled from it.

mu = D sin(C atan(B k - E (B k - atan(B k)))) of the slip k, along and across the wheel. Slipping in both directions the
tyre takes k = hypot(s, tan(slip angle)), and each component its share of that (similarity). H. B. Pacejka, Tyre and
vehicle dynamics, ch. 4.
"""

from dataclasses import dataclass

import numpy as np

from models.braking.tyre_table import TyreTable
from models.errors import InputError, nearest

ANGLES = np.deg2rad([0, 0.25, 0.5, 0.75, 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 13, 16, 20, 25, 30, 40, 50, 60, 70, 80, 90])
SLIPS = np.concatenate((np.linspace(0.0, 0.1, 101)[:-1], np.linspace(0.1, 0.3, 81)[:-1], np.linspace(0.3, 1.0, 71)))
"""Nodes at which mu is met to 1e-4 between them."""


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


SURFACES = {
    "dry": (Curve(1.20, 11.7, 1.69, 0.377), Curve(0.935, 8.86, 1.19, -1.21)),
    "wet": (Curve(1.06, 12.0, 1.80, 0.313), Curve(0.885, 10.7, 1.07, -2.14)),
    "snow": (Curve(0.407, 10.2, 1.96, 0.651), Curve(0.383, 19.1, 0.550, -2.10)),
    "ice": (Curve(0.172, 31.1, 1.77, 0.710), Curve(0.162, 28.4, 1.48, -1.18)),
}
"""Along and across, front tyre of a passenger car: K. Berntorp, B. Olofsson, K. Lundahl, L. Nielsen, Models and
methodology for optimal trajectory generation in safety-critical road-vehicle manoeuvres, Vehicle System Dynamics 52
(2014), as retyped in a public repository; the attribution is recalled, not checked."""


def surface(name: str, scale: float = 1.0, load: float = 1e4) -> TyreTable:
    """Table of one of ``SURFACES``, its friction times ``scale``; independent of the load."""
    if name not in SURFACES:
        raise InputError("", "surface", name, "no such surface" + nearest(name, tuple(SURFACES)), tuple(SURFACES))
    return filled(*SURFACES[name], scale=scale, load=load, name=name)


def filled(along: Curve, across: Curve, *, scale: float = 1.0, load: float = 1e4, angles: np.ndarray = ANGLES,
           slips: np.ndarray = SLIPS, name: str = "") -> TyreTable:  # fmt: skip
    """Table of two magic formulas at given nodes; at a right angle to the wheel, tan is cut at 1e3."""
    tangent = np.minimum(np.tan(np.minimum(angles, 1.5697)), 1e3)[:, None]
    total = np.hypot(slips, tangent)
    safe = np.maximum(total, 1e-12)
    mu_x = np.maximum(scale * along(total) * slips / safe, 0.0)
    pure = np.maximum(scale * across(tangent[:, 0]), 0.0)
    both = np.maximum(scale * across(total) * tangent / safe, 0.0)
    g = np.divide(both, pure[:, None], out=np.ones_like(both), where=pure[:, None] > 0.0)
    g[0] = _at_no_angle(across, slips)
    return TyreTable(angles, slips, np.array([load]), mu_x[:, None, :], g, pure[:, None], name)


def _at_no_angle(across: Curve, slips: np.ndarray) -> np.ndarray:
    """g at slip angles towards 0: slope of mu_y there with slip over that without."""
    stiffness = across.D * across.C * across.B
    return np.divide(across(slips), stiffness * slips, out=np.ones_like(slips), where=slips > 0.0)
