"""Linear theory of rolling contact: forces at creepages so small that nothing slips (Kalker 1967).

    Fx = -G ab C11 xi_x,    Fy = -G ab C22 xi_y - G (ab)^(3/2) C23 spin,
    Mz = G (ab)^(3/2) C23 xi_y - G (ab)^2 C33 spin,

with coefficients C of the ratio a/b and Poisson's ratio alone, and the flexibilities that make a bed of springs answer
small creepages with the same forces (Kalker, Vehicle System Dynamics 11 (1982) 1). Signs as in ``models.contact``.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.inputs import Array, broadcast_together, checked_quantity
from models.contact.material import MaterialPair
from models.machine.compiled import njit

SHORT_AXIS_RATIOS = np.arange(1.0, 11.0) / 10.0
TABLE_AXIS_RATIOS = np.concatenate((SHORT_AXIS_RATIOS, 1.0 / SHORT_AXIS_RATIOS[-2::-1]))
"""Axis ratios a/b of the table of coefficients."""
COEFFICIENTS_PATH = Path(__file__).with_name("kalker_coefficients.csv")
KALKER_TABLE = np.loadtxt(COEFFICIENTS_PATH, delimiter=",", skiprows=1, usecols=range(1, 13)).reshape(
    TABLE_AXIS_RATIOS.size, 4, 3
)
"""Table of Kalker's coefficients [ratio, C11 C22 C23 C33, nu = 0, 1/4, 1/2]: Kalker, Three-Dimensional Elastic Bodies
in Rolling Contact (1990), table E.3; C33 as recalled, and confirmed by the exact theory of ``rolling_problem`` as the
others are.
"""
LOGARITHMS_OF_TABLE = np.log(KALKER_TABLE)
SLOPES_OF_LOGARITHMS = np.gradient(LOGARITHMS_OF_TABLE, np.log(TABLE_AXIS_RATIOS), axis=0, edge_order=2)
INTERPOLATED_POWERS = np.array([-1.0, -1.0, -1.0, 0.75])
"""Powers of the coefficients C11, C22, C23, C33 that are nearly parabolas of nu; 1/C33 is none where a/b is large."""
LONG_RATIOS = np.array([10.0, 20.0, 50.0, 100.0])
LONG_C33 = np.array([[0.787, 0.527, 0.236], [0.781, 0.489, 0.170], [0.776, 0.456, 0.116], [0.775, 0.440, 0.0913]])
"""Coefficient C33 [ratio, nu = 0, 1/4, 1/2] of long patches by ``rolling_operator`` with every cell sticking, as the
validation case ``contact_coefficients`` computes it: 24 and 48 rows of cells ten times as long as wide, extrapolated by
second order. Twice as many cells change it by 2 % at most. The asymptote of the table's last row is 12 % too large at
a/b = 20 and 20 % at 100, for nu = 1/4.
"""
NARROW_FADING, LONG_FADING = 1.5, 0.75
"""Powers of the slenderness with which the difference from the asymptotes vanishes below and above the table."""
LONG_PATCH_SPIN_FACTOR = 25.0
"""Largest value of (L2/L3 - 1) (a/b)^2. Spin meets a stiffer bed than lateral creepage, so that the power of small
tractions,

    8/3 a^2 b xi_y^2 / L2 + pi/4 a^3 b (1/L3 - 1/L2) xi_y spin + 8/15 a^2 b^3 spin^2 / L3,

could become negative where L2/L3 - 1 is beyond 3 b/a: with Kalker's coefficients from a/b = 15 on. With this bound,
which they reach at a/b = 10.5, that is far off, and so it is on 21 cells up to a/b = 900.
"""
LARGEST_PATCH = 0.5
"""Largest sqrt(ab) in m that is accepted: a larger one is usually in mm."""


@dataclass(frozen=True)
class KalkerCoefficients:
    """Kalker's coefficients of creepage and spin, dimensionless, of the common shape of ratio and nu; C32 is -C23."""

    c11: Array
    c22: Array
    c23: Array
    c33: Array


def kalker_coefficients(axis_ratio: Any, nu: Any) -> KalkerCoefficients:
    """Kalker's creepage and spin coefficients for axis ratios and Poisson's ratios.

    axis_ratio : a/b, from 1e-9 to 1e9; nu : Poisson's ratio, 0 to 1/2; arrays of shapes that broadcast. Raises
    InputError.

    Between the nodes of the table ln C is a cubic of ln(a/b), and 1/C (of C33 the power 3/4) a parabola of nu. Below
    a/b = 0.1 and above 10 Kalker's asymptotes for slender patches hold, times a factor that makes them meet the table
    and goes to 1 with the slenderness: good to 3 %, seen from 1/30 to 30. C33 above 10 has nodes of its own up to 100,
    good to 10 %; beyond, their last slope goes on, which nothing was held against.
    """
    axis_ratio = checked_quantity("ratio", axis_ratio, "a ratio a/b of semi-axes from 1e-9 to 1e9", 1e-9, 1e9)
    axis_ratio, nu = broadcast_together(
        ratio=axis_ratio, nu=checked_quantity("nu", nu, "a Poisson's ratio from 0 to 0.5", 0.0, 0.5)
    )
    values_of_each = _coefficients_of_each(axis_ratio.flatten(), nu.flatten()).reshape(4, *axis_ratio.shape)
    return KalkerCoefficients(*(values[()] for values in values_of_each))


def linear_creep_forces(
    a: Any, b: Any, xi_x: Any, xi_y: Any, spin: Any, material_pair: MaterialPair
) -> tuple[Array, Array, Array]:
    """Creep forces Fx, Fy (N) and moment Mz (N m) on the wheel by the linear theory, in which nothing slips.

    a, b : semi-axes (m), zero where nothing touches; xi_x, xi_y : creepages (1); spin : 1/m; arrays of shapes that
    broadcast. Friction does not enter: the forces have no bound. Raises InputError, also for too unlike a pair.
    """
    material_pair.require_likeness()
    a, b = _checked_axes(a, b)
    spin = checked_quantity("spin", spin, "a spin in 1/m")
    xi_x, xi_y = (checked_quantity(name, value, "a creepage") for name, value in (("xi_x", xi_x), ("xi_y", xi_y)))
    a, b, xi_x, xi_y, spin = broadcast_together(a=a, b=b, xi_x=xi_x, xi_y=xi_y, spin=spin)
    ratio = np.divide(a, b, out=np.ones_like(a), where=(a > 0.0) & (b > 0.0))  # 1 where nothing touches
    c, area = kalker_coefficients(ratio, material_pair.nu), a * b
    fy = -material_pair.G * (area * c.c22 * xi_y + area**1.5 * c.c23 * spin)
    mz = material_pair.G * (area**1.5 * c.c23 * xi_y - area**2 * c.c33 * spin)
    return -material_pair.G * area * c.c11 * xi_x, fy, mz


def fastsim_flexibilities(a: Any, b: Any, material_pair: MaterialPair) -> tuple[Array, Array, Array]:
    """Flexibilities L1, L2, L3 (m^3/N) of the simplified theory for xi_x, xi_y and spin: ratios of displacement to
    traction.

    L1 = 8 a / (3 G C11), L2 = 8 a / (3 G C22), L3 = pi a sqrt(a/b) / (4 G C23) (Kalker 1982), and beyond a/b = 10.5
    as much more of L3 as passive tractions ask for (``LONG_PATCH_SPIN_FACTOR``): 14 % at a/b = 20, 17 % from 50 on. a,
    b : semi-axes (m) of shapes that broadcast; zero where nothing touches, and zero comes out. Raises InputError, also
    for too unlike a pair.
    """
    material_pair.require_likeness()
    a, b = _checked_axes(a, b)
    answer = _flexibilities_of_each(a.flatten(), b.flatten(), material_pair.G, material_pair.nu).reshape(3, *a.shape)
    return answer[0][()], answer[1][()], answer[2][()]


def _checked_axes(a: Any, b: Any) -> tuple[Array, ...]:
    """Semi-axes (m) as arrays of one shape; raises InputError for negative or too large ones."""
    a, b = (
        checked_quantity(name, value, "a semi-axis in m, zero or more", 0.0) for name, value in (("a", a), ("b", b))
    )
    a, b = broadcast_together(a=a, b=b)
    checked_quantity(
        "sqrt(a b)", np.sqrt(a * b), f"at most {LARGEST_PATCH:g} m; axes are in m, not in mm", 0.0, LARGEST_PATCH
    )
    return a, b


@njit(cache=True)
def _coefficients_of_each(axis_ratio: Array, nu: Array) -> Array:
    answer = np.empty((4, axis_ratio.size))
    for i in range(axis_ratio.size):
        for kind in range(4):
            answer[kind, i] = coefficient_at(kind, axis_ratio[i], nu[i])
    return answer


@njit(cache=True)
def _flexibilities_of_each(a: Array, b: Array, shear_modulus: float, nu: float) -> Array:
    answer = np.empty((3, a.size))
    for i in range(a.size):
        answer[0, i], answer[1, i], answer[2, i] = flexibilities_at(a[i], b[i], shear_modulus, nu)
    return answer


@njit(cache=True)
def flexibilities_at(a: float, b: float, shear_modulus: float, nu: float) -> tuple[float, float, float]:
    """Flexibilities L1, L2, L3 (m^3/N) of one patch, ``shear_modulus`` : shear modulus G (Pa); for compiled callers,
    nothing is checked.
    """
    if a <= 0.0 or b <= 0.0:
        return 0.0, 0.0, 0.0
    unit = a / shear_modulus
    along = across = turning = 0.0
    for kind in range(3):  # a loop, as numba compiles one function for each number that is written out
        c = coefficient_at(kind, a / b, nu)
        if kind == 0:
            along = 8.0 * unit / (3.0 * c)
        elif kind == 1:
            across = 8.0 * unit / (3.0 * c)
        else:
            turning = math.pi * unit * math.sqrt(a / b) / (4.0 * c)
    return along, across, max(turning, across / (1.0 + LONG_PATCH_SPIN_FACTOR * (b / a) ** 2))


@njit(cache=True)
def coefficient_at(coefficient_index: int, axis_ratio: float, nu: float) -> float:
    """Kalker's coefficient C11, C22, C23 or C33 (kind 0 to 3) of one patch; for compiled callers, nothing is
    checked.
    """
    inner = min(max(axis_ratio, TABLE_AXIS_RATIOS[0]), TABLE_AXIS_RATIOS[-1])
    coefficient = _tabulated_coefficient(coefficient_index, inner, nu)
    if inner == axis_ratio:
        return coefficient
    if axis_ratio < 1.0:
        excess = coefficient / _narrow_asymptote(coefficient_index, inner, nu) - 1.0
        return _narrow_asymptote(coefficient_index, axis_ratio, nu) * (
            1.0 + excess * (axis_ratio / inner) ** NARROW_FADING
        )
    excess = coefficient / _long_asymptote(coefficient_index, inner, nu) - 1.0
    return _long_asymptote(coefficient_index, axis_ratio, nu) * (1.0 + excess * (inner / axis_ratio) ** LONG_FADING)


@njit(cache=True)
def _tabulated_coefficient(coefficient_index: int, axis_ratio: float, nu: float) -> float:
    """Kalker's coefficient from the table: cubic Hermite interpolation of ln C in ln(a/b), then the parabola of a power
    of C through nu = 0, 1/4, 1/2.
    """
    i = 0
    while i < TABLE_AXIS_RATIOS.size - 2 and TABLE_AXIS_RATIOS[i + 1] <= axis_ratio:
        i += 1
    width = math.log(TABLE_AXIS_RATIOS[i + 1] / TABLE_AXIS_RATIOS[i])
    t = math.log(axis_ratio / TABLE_AXIS_RATIOS[i]) / width
    rise, low, high = t * t * (3.0 - 2.0 * t), t * (1.0 - t) ** 2 * width, t * t * (t - 1.0) * width
    power, power_mean = INTERPOLATED_POWERS[coefficient_index], 0.0
    for k, weight in enumerate(_parabola_weights(nu)):
        logarithm = (1.0 - rise) * LOGARITHMS_OF_TABLE[i, coefficient_index, k] + rise * LOGARITHMS_OF_TABLE[
            i + 1, coefficient_index, k
        ]
        logarithm += (
            low * SLOPES_OF_LOGARITHMS[i, coefficient_index, k]
            + high * SLOPES_OF_LOGARITHMS[i + 1, coefficient_index, k]
        )
        power_mean += weight * math.exp(power * logarithm)
    return power_mean ** (1.0 / power)


@njit(cache=True)
def _parabola_weights(nu: float) -> tuple[float, float, float]:
    """Weights of the values at nu = 0, 1/4 and 1/2 for quadratic interpolation in nu."""
    s = 4.0 * nu
    return (1.0 - s) * (1.0 - s / 2.0), s * (2.0 - s), s * (s - 1.0) / 2.0


@njit(cache=True)
def _narrow_asymptote(coefficient_index: int, axis_ratio: float, nu: float) -> float:
    """Asymptote of a coefficient for patches much shorter than wide, a/b = g to 0 (Kalker 1990, table E.3, first
    row).
    """
    if coefficient_index == 0:
        return math.pi**2 / (4.0 * (1.0 - nu))
    if coefficient_index == 1:
        return math.pi**2 / 4.0
    if coefficient_index == 2:
        return math.pi * math.sqrt(axis_ratio) / (3.0 * (1.0 - nu)) * (1.0 + nu * (math.log(16.0 / axis_ratio) - 5.0))
    return math.pi**2 / (16.0 * (1.0 - nu) * axis_ratio)


@njit(cache=True)
def _long_asymptote(coefficient_index: int, axis_ratio: float, nu: float) -> float:
    """Asymptote of a coefficient for patches much longer than wide, b/a = g to 0 (the same table, last row)."""
    wide = 2.0 * math.log(4.0 * axis_ratio)
    divisor, two, three = wide - 2.0 * nu, (1.0 - nu) * wide + 2.0 * nu, (1.0 - nu) * wide - 2.0 + 4.0 * nu
    if coefficient_index == 0:
        return 2.0 * math.pi * axis_ratio / divisor * (1.0 + (3.0 - math.log(4.0)) / divisor)
    if coefficient_index == 1:
        return 2.0 * math.pi * axis_ratio / two * (1.0 + (1.0 - nu) * (3.0 - math.log(4.0)) / two)
    if coefficient_index == 2:
        return 2.0 * math.pi * axis_ratio**1.5 / (3.0 * three)
    i = min(max(int(np.searchsorted(LONG_RATIOS, axis_ratio)) - 1, 0), LONG_RATIOS.size - 2)
    t = math.log(axis_ratio / LONG_RATIOS[i]) / math.log(LONG_RATIOS[i + 1] / LONG_RATIOS[i])
    power, power_mean = INTERPOLATED_POWERS[3], 0.0  # ln C33 is linear in ln(a/b) between its nodes and on beyond
    for k, weight in enumerate(_parabola_weights(nu)):
        power_mean += weight * (LONG_C33[i, k] ** (1.0 - t) * LONG_C33[i + 1, k] ** t) ** power
    return power_mean ** (1.0 / power)
