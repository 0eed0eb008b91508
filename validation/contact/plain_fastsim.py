"""FASTSIM, Hertz' ellipse and Kalker's coefficients in plain Python, for comparison with the compiled contact.

One cell after the other, tractions as complex numbers (real part along x), the slipping traction turned by its angle.
Of ``models.contact`` it takes tables and calibrated constants, and no function. Units, axes and signs are those of
``models.contact``.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, barycentric_interpolate, make_interp_spline
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from models.contact.fastsim_grid import POWERS, STRIPS_PER_CELL_LIMIT, BoundShape
from models.contact.fastsim_many import (
    BLEND_POWER,
    BLEND_REACH,
    OPPOSING_SPIN_SHARE,
    REACH_BY_RATIO,
    SLIDING_SQUARE,
    SPIN_BY_RATIO,
    SPIN_WEIGHT,
    X_WEIGHT,
)
from models.contact.inputs import Array
from models.contact.linear_theory import INTERPOLATED_POWERS as OF_NU
from models.contact.linear_theory import (
    KALKER_TABLE,
    LONG_C33,
    LONG_FADING,
    LONG_PATCH_SPIN_FACTOR,
    LONG_RATIOS,
    NARROW_FADING,
    TABLE_AXIS_RATIOS,
)

LOG_RATIOS = np.log(TABLE_AXIS_RATIOS)
LOGARITHMS = np.log(KALKER_TABLE)
NODES = CubicHermiteSpline(LOG_RATIOS, LOGARITHMS, np.gradient(LOGARITHMS, LOG_RATIOS, axis=0, edge_order=2))
LONG_NODES = make_interp_spline(np.log(LONG_RATIOS), np.log(LONG_C33), k=1)
FrictionFactor = Callable[[float], float]
"""Function of the slip velocity divided by the rolling speed; returns friction divided by friction without slip."""


def coulomb_friction(slip: float) -> float:
    """Friction factor 1 at every slip (Coulomb friction)."""
    return 1.0


@dataclass(frozen=True)
class PlainEllipse:
    """A rolling elliptic contact: semi-axes a along and b across rolling (m), load (N), friction coefficient mu,
    creepages xi_x, xi_y, spin (1/m), flexibilities along x, y and in spin (m^3/N)."""

    a: float
    b: float
    load: float
    mu: float
    xi_x: float
    xi_y: float
    spin: float
    flexible: tuple[float, float, float]

    @property
    def mean_semi_axis(self) -> float:
        """Mean semi-axis sqrt(a b) (m)."""
        return math.sqrt(self.a * self.b)


@dataclass(frozen=True)
class FastsimSettings:
    """Settings of FASTSIM: cells per strip; shape of the traction bound; flexibilities "one", "three" or "blended";
    march "second-order" (first step of half length, turning slip direction) or "plain" (neither)."""

    cells: int
    bound: BoundShape = "intermediate"
    flexibilities: str = "blended"
    march: str = "second-order"


def hertz_ellipse(
    smaller_curvature: float, larger_curvature: float, contact_modulus: float, load: float
) -> tuple[float, float, float]:
    """Long and short semi-axis and approach (m) of Hertz' contact from curvatures (1/m), contact modulus E* (Pa) and
    load (N); Johnson, section 4.2."""

    def ratio_of(log_axis_ratio: float) -> float:
        g2 = math.exp(2.0 * log_axis_ratio)
        k, e = ellipk(1.0 - g2), ellipe(1.0 - g2)
        return math.log((k - e) / (e / g2 - k) * larger_curvature / smaller_curvature)

    g = math.exp(brentq(ratio_of, math.log(1e-6), math.log(0.9999), xtol=1e-15))
    k, e = ellipk(1.0 - g * g), ellipe(1.0 - g * g)
    # curvature along the long axis: p0 short (K - E) / (E* e^2 long^2), p0 = 3 N / (2 pi long short)
    long = (1.5 * load * (k - e) / (math.pi * contact_modulus * (1.0 - g * g) * smaller_curvature)) ** (1.0 / 3.0)
    return long, g * long, 1.5 * load * k / (math.pi * long * contact_modulus)


def coefficients(axis_ratio: float, nu: float) -> Array:
    """Kalker's coefficients C11, C22, C23, C33 (4,) at a/b and Poisson's ratio nu, as in
    ``linear_theory.coefficients``."""
    inner = min(max(axis_ratio, 0.1), 10.0)
    nodes = np.exp(NODES(math.log(inner)))
    answer = np.array([_parabola_in_nu(values, power, nu) for values, power in zip(nodes, OF_NU, strict=True)])
    if inner == axis_ratio:
        return answer
    asymptote, fading = (narrow_coefficients, NARROW_FADING) if axis_ratio < 1.0 else (long_coefficients, LONG_FADING)
    slenderness = min(axis_ratio / inner, inner / axis_ratio)
    return asymptote(axis_ratio, nu) * (1.0 + (answer / asymptote(inner, nu) - 1.0) * slenderness**fading)


def _parabola_in_nu(values_at_nu: Array, interpolation_power: float, nu: float) -> float:
    """Interpolates ``values_at_nu`` at Poisson's ratios 0, 1/4, 1/2 to nu by a parabola through the values raised to a
    power."""
    return float(barycentric_interpolate([0.0, 0.25, 0.5], values_at_nu**interpolation_power, nu)) ** (
        1.0 / interpolation_power
    )


def narrow_coefficients(axis_ratio: float, nu: float) -> Array:
    """Kalker's coefficients C11, C22, C23, C33 (4,) for narrow ellipses, a/b = axis_ratio to 0, by the first row of his
    table E.3 (1990)."""
    across, log_16 = math.pi**2 / (4.0 * (1.0 - nu)), math.log(16.0 / axis_ratio**2)
    spun = math.pi * math.sqrt(axis_ratio) / (3.0 * (1.0 - nu)) * (1.0 + nu * (0.5 * log_16 + math.log(4.0) - 5.0))
    return np.array([across, math.pi**2 / 4.0, spun, across / (4.0 * axis_ratio)])


def long_coefficients(axis_ratio: float, nu: float) -> Array:
    """Kalker's coefficients C11, C22, C23, C33 (4,) for long ellipses, b/a to 0, by the last row of his table E.3
    (1990). C33 is interpolated linearly in logarithms between its nodes, and extrapolated beyond."""
    g, log_16 = 1.0 / axis_ratio, math.log(16.0 * axis_ratio**2)
    rest = 3.0 - math.log(4.0)
    c11 = 2.0 * math.pi / ((log_16 - 2.0 * nu) * g) * (1.0 + rest / (log_16 - 2.0 * nu))
    part = (1.0 - nu) * log_16 + 2.0 * nu
    c22 = 2.0 * math.pi / g * (1.0 + (1.0 - nu) * rest / part) / part
    c23 = 2.0 * math.pi / (3.0 * g * math.sqrt(g)) / ((1.0 - nu) * log_16 - 2.0 + 4.0 * nu)
    return np.array([c11, c22, c23, _parabola_in_nu(np.exp(LONG_NODES(math.log(axis_ratio))), OF_NU[3], nu)])


def flexibilities(a: float, b: float, shear_modulus: float, nu: float) -> tuple[float, float, float]:
    """Flexibilities L1, L2, L3 (m^3/N) by Kalker (1982); L3 is not less than passive tractions require."""
    c11, c22, c23, _ = coefficients(a / b, nu)
    along, across = 8.0 * a / (3.0 * shear_modulus * c11), 8.0 * a / (3.0 * shear_modulus * c22)
    least = across / (1.0 + LONG_PATCH_SPIN_FACTOR * (b / a) ** 2)
    return along, across, max(math.pi * a * math.sqrt(a / b) / (4.0 * shear_modulus * c23), least)


def stiffnesses(ellipse: PlainEllipse, peak_traction: float, flexibility_kind: str) -> Array:
    """Stiffnesses 1/L (Pa/m) of the bed of springs along x, along y and in spin (3,); peak_traction: largest traction
    bound (Pa)."""
    three, creep = (
        1.0 / np.array(ellipse.flexible),
        np.array([ellipse.xi_x, ellipse.xi_y, ellipse.spin * ellipse.mean_semi_axis]),
    )
    if flexibility_kind == "three" or not creep.any():
        return three
    if flexibility_kind == "one":
        return np.full(3, np.linalg.norm(creep) / (np.abs(creep) @ ellipse.flexible))
    square = creep**2
    mean = square.sum() / (square @ ellipse.flexible)
    return three + _flexibility_share(ellipse, creep * ellipse.a * three / peak_traction) * (mean - three)


def _flexibility_share(ellipse: PlainEllipse, scaled_creepages: Array) -> float:
    """Weight (0 to 1) of the common flexibility against the three separate ones, from the scaled creepages (3,)."""
    x, y, z = scaled_creepages
    shape = min(max(ellipse.a / ellipse.b, 0.1), 10.0)
    turns = SPIN_WEIGHT * shape**SPIN_BY_RATIO * z
    rolling = (X_WEIGHT * x) ** 2 + y**2 + turns**2 + 2.0 * OPPOSING_SPIN_SHARE * y * turns
    begun = (math.sqrt(rolling) / (BLEND_REACH * shape**REACH_BY_RATIO)) ** BLEND_POWER
    slides = (x**2 + y**2) / (1.0 + z**2) / SLIDING_SQUARE
    return 1.0 - math.exp(-begun - slides**3)


def fastsim(
    ellipse: PlainEllipse, fastsim_settings: FastsimSettings, friction_factor: FrictionFactor = coulomb_friction
) -> tuple[Array, Array]:
    """FASTSIM: forces fx, fy (N), moment mz (N m) and share of the area that sticks (4,); complex tractions (strips,
    cells) in Pa."""
    a, b, n, power = ellipse.a, ellipse.b, fastsim_settings.cells, POWERS[fastsim_settings.bound]
    strips = 2 * math.ceil(n * min(max((b / (2.0 * a)) ** 0.6, 1.0), STRIPS_PER_CELL_LIMIT) / 2.0 - 1e-9)
    y = b * (strips - 1.0 - 2.0 * np.arange(strips)) / strips
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    x = half[:, None] * (1.0 - (2.0 * np.arange(n) + 1.0) / n)
    area = (2.0 * half / n * 2.0 * b / strips)[:, None] * np.ones(n)
    shape = (1.0 - (x / a) ** 2 - (y[:, None] / b) ** 2) ** power
    peak = ellipse.mu * ellipse.load / np.sum(shape * area)
    k = stiffnesses(ellipse, peak, fastsim_settings.flexibilities)
    rows = [
        _strip_tractions(ellipse, fastsim_settings, (yy, hh), k, peak, friction_factor)
        for yy, hh in zip(y, half, strict=True)
    ]
    p, slips = (np.array([row[i] for row in rows]) for i in range(2))
    force, turn = np.sum(p * area), np.sum((x * p.imag - y[:, None] * p.real) * area)
    return np.array([force.real, force.imag, turn, np.sum(area[~slips]) / np.sum(area)]), p


def _strip_tractions(
    ellipse: PlainEllipse,
    fastsim_settings: FastsimSettings,
    y_and_half_length: tuple[float, float],
    stiffnesses_of_bed: Array,
    peak_traction: float,
    friction_factor: FrictionFactor,
) -> tuple[list[complex], list[bool]]:
    """Complex tractions (Pa) of a strip from the leading to the trailing edge, and whether each cell slips.
    y_and_half_length: its y and half length (m)."""
    (y, half), n, power = y_and_half_length, fastsim_settings.cells, POWERS[fastsim_settings.bound]
    dx, turns = 2.0 * half / n, fastsim_settings.march == "second-order"

    def bound(x: float) -> float:
        slip = complex(ellipse.xi_x - ellipse.spin * y, ellipse.xi_y + ellipse.spin * x)
        return peak_traction * friction_factor(abs(slip)) * (1.0 - (x / ellipse.a) ** 2 - (y / ellipse.b) ** 2) ** power

    p, slipping, tractions, slips = 0j, False, list[complex](), list[bool]()
    for i in range(n):
        x = half - (i + 0.5) * dx
        go = 0.5 * dx if turns and i == 0 else dx
        middle = x + 0.5 * go if turns else x
        rigid = complex(
            stiffnesses_of_bed[0] * ellipse.xi_x - stiffnesses_of_bed[2] * ellipse.spin * y,
            stiffnesses_of_bed[1] * ellipse.xi_y + stiffnesses_of_bed[2] * ellipse.spin * middle,
        )
        trial = p - rigid * go
        if abs(trial) <= bound(x):
            p, slipping = trial, False
        elif turns and slipping and i > 0:
            p = bound(x) * _direction_after_step(p, rigid, stiffnesses_of_bed[2] * ellipse.spin, dx, bound(middle))
        else:
            p, slipping = bound(x) * trial / abs(trial), True
        tractions.append(p)
        slips.append(slipping)
    return tractions, slips


def _direction_after_step(
    start_direction: complex, rigid_slip: complex, spin_slip: float, step_length: float, traction_bound: float
) -> complex:
    """Direction of the traction in a slipping cell after a step. rigid_slip : rigid slip divided by the flexibility at
    mid-step; spin_slip : change of its lateral component per m of x; traction_bound : traction bound (Pa).

    tan(psi/2), psi between traction and -rigid_slip, shrinks by exp(|rigid slip| step / bound), the exponential an
    eighth power of its series and the slip taken a little after the middle, both as ``fastsim_kernels`` says.
    """
    eighth = (abs(rigid_slip.real) + abs(rigid_slip.imag)) * step_length / traction_bound / 8.0
    against = -(rigid_slip - 1j * spin_slip * step_length * min(0.5 * eighth, 0.12 + 0.2 * eighth, 0.47))
    h = min(abs(against) * step_length / traction_bound / 8.0, 50.0)
    grown = (1.0 + h + h**2 / 2.0 + h**3 / 6.0) ** 8
    psi = 2.0 * math.atan(math.tan(cmath.phase(start_direction / against) / 2.0) / grown)
    return against / abs(against) * cmath.exp(1j * psi)
