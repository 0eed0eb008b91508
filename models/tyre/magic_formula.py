"""Tyre friction by Pacejka's magic formula and by Burckhardt's formula on named surfaces, and tyre tables filled from
them.

mu = D sin(C atan(B k - E (B k - atan(B k)))) of the slip k, along and across the wheel. Slipping in both directions the
tyre takes k = hypot(s, tan(slip angle)) on either curve, and each component its share of that. H. B. Pacejka, Tyre and
vehicle dynamics, ch. 4 (there with each curve's slip made comparable first).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models.core.errors import InputError
from models.tyre.tyre_table import TyreTable

Friction = Callable[[np.ndarray, float], np.ndarray]
"""Function that returns the friction coefficient, 0 or more, at slips from 0 on (tan of the slip angle, across) under a
load (N)."""


def graded_nodes(last_node: float, grading_offset: float, node_count: int) -> np.ndarray:
    """Nodes of a table from 0 to ``last_node`` with spacings that grow in proportion to x + ``grading_offset``."""
    nodes = grading_offset * np.expm1(np.linspace(0.0, np.log1p(last_node / grading_offset), node_count))
    nodes[-1] = last_node
    return nodes


ANGLE_NODES, SLIP_NODES = graded_nodes(np.pi / 2.0, 0.03, 261), graded_nodes(1.0, 0.02, 201)
"""Nodes of slip angle (rad) and of slip (-) between which tables follow the magic formula's surfaces to 1e-4 of the
friction coefficient."""


def table_by_similarity(
    friction_along: Friction,
    friction_across: Friction,
    loads: np.ndarray,
    angles: np.ndarray = ANGLE_NODES,
    slips: np.ndarray = SLIP_NODES,
    table_name: str = "",
) -> TyreTable:
    """Tyre table from a friction curve along the wheel and another across it, combined by similarity.

    g is the mean over the loads, weighted by h squared: exact if all loads share one shape of the curve across. Where
    both together would be above the largest node of either, which falls short of the curve's peak, they are that.
    """
    tangent = np.tan(angles)[:, None]
    total = np.hypot(slips, tangent)
    safe = np.maximum(total, 1e-300)
    mu_x = np.stack([friction_along(total, load) * slips / safe for load in loads], axis=1)
    mu_y = np.stack([friction_across(total, load) * tangent / safe for load in loads], axis=1)
    g, h = product_factors(mu_y)
    g[0] = _limit_at_zero_angle(friction_across, slips, loads)
    excess = np.maximum(np.hypot(mu_x, g[:, None, :] * h[:, :, None]) / max(mu_x.max(), mu_y.max()), 1.0)
    return TyreTable(angles, slips, loads, mu_x / excess, g / excess.max(axis=1), h, table_name)


def product_factors(mu_y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Factors g (a, s) and h (a, f) whose product approximates the lateral friction mu_y (a, f, s) over slip angles,
    loads and slips: h is mu_y at slip 0, and g the best fit for all loads.

    At slip angle 0, where h is 0, g is that of the next angle.
    """
    h = mu_y[:, :, 0].copy()
    square = (h * h).sum(axis=1)[:, None]
    g = np.divide((mu_y * h[:, :, None]).sum(axis=1), square, out=np.ones_like(mu_y[:, 0, :]), where=square > 0.0)
    if len(g) > 1:
        g[0] = g[1]
    return g, h


def _limit_at_zero_angle(friction_across: Friction, slips: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Limit of the factor g for slip angles towards 0: ratio of the slope of lateral friction at a slip to that without
    slip."""
    little = np.full(1, 1e-9)
    slope = np.array([friction_across(little, load)[0] / little[0] for load in loads])[:, None]
    secant = np.array([friction_across(slips[1:], load) / slips[1:] for load in loads])
    return np.concatenate(([1.0], (slope * secant).sum(axis=0) / (slope * slope).sum()))


@dataclass(frozen=True)
class Burckhardt:
    """Burckhardt's friction formula, the same curve for both directions: mu = c1 (1 - exp(-c2 s)) - c3 s at slip s.

    c1 is what friction tends to, c2 how fast, c3 how much it falls up to slip 1; beyond that it stays.
    """

    c1: float
    c2: float
    c3: float

    def __call__(self, slip: np.ndarray) -> np.ndarray:
        """Friction coefficients mu at slips from 0 on."""
        clipped_slip = np.minimum(slip, 1.0)
        return -self.c1 * np.expm1(-self.c2 * clipped_slip) - self.c3 * clipped_slip


BURCKHARDT = {
    "dry asphalt": Burckhardt(1.2801, 23.99, 0.52),
    "wet asphalt": Burckhardt(0.857, 33.822, 0.347),
    "dry concrete": Burckhardt(1.1973, 25.168, 0.5373),
    "dry cobble": Burckhardt(1.3713, 6.4565, 0.6691),
    "wet cobble": Burckhardt(0.4004, 33.708, 0.1204),
    "packed snow": Burckhardt(0.1946, 94.129, 0.0646),
    "smooth ice": Burckhardt(0.05, 306.39, 0.0),
}
"""Coefficients of Burckhardt's formula by surface, after M. Burckhardt, Fahrwerktechnik: Radschlupf-Regelsysteme
(1993), as many texts quote them; recalled, not checked against the book."""


@dataclass(frozen=True)
class MagicFormulaCurve:
    """Pacejka's magic formula for a single curve: D its peak, B its stiffness, C its shape, E its curvature."""

    D: float
    B: float
    C: float
    E: float

    def __call__(self, slip: np.ndarray) -> np.ndarray:
        """Friction coefficients mu at slips from 0 on."""
        bent = self.B * slip
        return self.D * np.sin(self.C * np.arctan(bent - self.E * (bent - np.arctan(bent))))


PACEJKA = {
    "dry": (MagicFormulaCurve(1.20, 11.7, 1.69, 0.377), MagicFormulaCurve(0.935, 8.86, 1.19, -1.21)),
    "wet": (MagicFormulaCurve(1.06, 12.0, 1.80, 0.313), MagicFormulaCurve(0.885, 10.7, 1.07, -2.14)),
    "snow": (MagicFormulaCurve(0.407, 10.2, 1.96, 0.651), MagicFormulaCurve(0.383, 19.1, 0.550, -2.10)),
    "ice": (MagicFormulaCurve(0.172, 31.1, 1.77, 0.710), MagicFormulaCurve(0.162, 28.4, 1.48, -1.18)),
    "dry/rear": (MagicFormulaCurve(1.20, 11.1, 1.69, 0.362), MagicFormulaCurve(0.961, 9.30, 1.19, -1.11)),
    "wet/rear": (MagicFormulaCurve(1.07, 11.5, 1.80, 0.300), MagicFormulaCurve(0.911, 11.3, 1.07, -1.97)),
    "snow/rear": (MagicFormulaCurve(0.409, 9.71, 1.96, 0.624), MagicFormulaCurve(0.394, 20.0, 0.550, -1.93)),
    "ice/rear": (MagicFormulaCurve(0.173, 29.5, 1.77, 0.681), MagicFormulaCurve(0.167, 30.0, 1.48, -1.08)),
}
"""Magic formulas along and across, front and rear tyre of a passenger car, by surface: K. Berntorp, B. Olofsson, K.
Lundahl, L. Nielsen, Models and methodology for optimal trajectory generation in safety-critical road-vehicle
manoeuvres, Vehicle System Dynamics 52 (2014), as retyped in a public repository; the attribution is recalled, not
checked."""

PureSlipCurve = Callable[[np.ndarray], np.ndarray]
NAMED_SURFACES: dict[str, tuple[PureSlipCurve, PureSlipCurve]] = {
    **PACEJKA,
    **{k: (c, c) for k, c in BURCKHARDT.items()},
}
"""Friction curves along and across the wheel for all surfaces that have a name."""


def table_of_surface(
    surface_name: str, friction_scale: float = 1.0, load: float = 1e4, friction_loss: float = 0.0
) -> TyreTable:
    """Tyre table of one of ``NAMED_SURFACES``, its friction times ``friction_scale`` at a load (N).

    friction_loss : share of its friction that the tyre has lost at twice that load; 0 for none. It is linear in the
    load from a quarter of it to twice it, and constant beyond.
    """
    if surface_name not in NAMED_SURFACES:
        raise InputError("", "surface", surface_name, "no such surface", tuple(NAMED_SURFACES))
    law_along, across = NAMED_SURFACES[surface_name]
    if not 0.0 <= friction_loss < 1.0:
        raise InputError(surface_name, "fall", friction_loss, "must be from 0 to below 1")
    loads = load * np.array([0.25, 1.0, 2.0]) if friction_loss > 0.0 else np.array([load])

    def load_factor(wheel_load: float) -> float:
        return friction_scale * (1.0 - friction_loss * (wheel_load / load - 1.0))

    return table_by_similarity(
        lambda k, load_there: load_factor(load_there) * law_along(k),
        lambda k, load_there: load_factor(load_there) * across(k),
        loads,
        table_name=surface_name,
    )
