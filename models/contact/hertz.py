"""Hertz' theory: two smooth convex bodies pressed together without friction touch on an ellipse.

Source: Johnson, Contact Mechanics (1985), section 4.2. With the short semi-axis s, the long one l, g = s/l and
e^2 = 1 - g^2, the complete elliptic integrals

    B = int cos^2 / sqrt(1 - e^2 sin^2) = (E - g^2 K) / e^2,    D = int sin^2 / sqrt(1 - e^2 sin^2) = (K - E) / e^2

(0 to pi/2) give the curvature along the short axis p0 B / (E* s), the one along the long axis g^2 D / B times as
large, and the approach p0 s (B + D) / E*. The same in K and E loses all digits towards the circle; B and D are
computed here as sums of positive terms (Bulirsch, Numerische Mathematik 7 (1965) 78, his cel2), and lose none.

The theory holds for contact that is small against the radii of both bodies, and for elastic material: that the
pressure stays below three times the yield stress in shear is for the user to see.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.contact.inputs import LARGEST_APPROACH, LARGEST_LOAD, Array, broadcast_together, checked_quantity
from models.contact.material import MaterialPair
from models.core.errors import InputError
from models.machine.compiled import njit

LEAST_CURVATURE = 0.01
"""Least curvature (1/m) that is accepted for the larger one, a radius of 50 m: a smaller one is usually in 1/mm."""
LEAST_AXIS, LARGEST_AXIS = 1e-30, 1e3
"""Smallest and largest semi-axis (m) that are accepted."""


@dataclass(frozen=True)
class HertzContact:
    """Hertzian contact of two bodies; every field has the common shape of the inputs.

    Where nothing touches, axes, pressure, approach and load are exactly zero.

    a, b : semi-axes along x and y (m); p0 : largest pressure (Pa), 3/2 of the mean; approach : of distant points (m);
    load : N; A, B : curvatures of the undeformed distance A x^2 + B y^2 (1/m).
    """

    a: Array
    b: Array
    p0: Array
    approach: Array
    load: Array
    A: Array
    B: Array


def by_load(A: Any, B: Any, load: Any, material_pair: MaterialPair) -> HertzContact:
    """Hertzian contact from curvatures under a given load.

    A, B : curvatures (1/m), above 0; load : N, compression positive; arrays of any shapes that broadcast. A load of
    zero or less makes no contact. Raises InputError for a curvature that is not above zero, a number that is not
    finite, magnitudes that are none in SI, or shapes that do not fit together.
    """
    load = checked_quantity("load", load, f"a load in N, at most {LARGEST_LOAD:g}", maximum=LARGEST_LOAD)
    A, B, load = broadcast_together(**_checked_curvatures(A, B), load=np.maximum(load, 0.0))
    ratio, cosine, sine = axis_ratios_and_integrals(np.minimum(A, B) / np.maximum(A, B))
    area = 1.5 * load * cosine / (math.pi * material_pair.modulus * np.maximum(A, B))  # l s^2
    return _hertz_contact(A, B, load, np.cbrt(area * ratio), ratio, cosine + sine, material_pair)


def by_approach(A: Any, B: Any, approach: Any, material_pair: MaterialPair) -> HertzContact:
    """Hertzian contact of bodies that have approached each other by ``approach`` (m) since first touching; zero or less
    means a gap.

    Otherwise as ``by_load``.
    """
    allowed = f"an approach in m, at most {LARGEST_APPROACH:g}"
    approach = np.maximum(checked_quantity("approach", approach, allowed, maximum=LARGEST_APPROACH), 0.0)
    A, B, approach = broadcast_together(**_checked_curvatures(A, B), approach=approach)
    ratio, cosine, sine = axis_ratios_and_integrals(np.minimum(A, B) / np.maximum(A, B))
    short = np.sqrt(approach * cosine / (np.maximum(A, B) * (cosine + sine)))
    load = 2.0 / 3.0 * math.pi * material_pair.modulus * approach * short / (ratio * (cosine + sine))
    return _hertz_contact(A, B, load, short, ratio, cosine + sine, material_pair)


def by_axes(
    a: float, b: float, material_pair: MaterialPair, *, load: float | None = None, approach: float | None = None
) -> HertzContact:
    """Hertzian contact with known semi-axes a, b (m) under a load (N) or at an approach (m), which must be above 0; all
    plain numbers.

    The curvatures follow from both: the same axes under twice the load are those of bodies curved twice as much.
    Raises InputError as ``by_load`` does.
    """
    a, b = (
        float(checked_quantity(name, value, "a semi-axis in m, above 0", LEAST_AXIS, LARGEST_AXIS))
        for name, value in (("a", a), ("b", b))
    )
    if (load is None) == (approach is None):
        raise InputError("", "load", load, "give either the load (N) or the approach (m)")
    short, g = min(a, b), min(a, b) / max(a, b)
    cosine, sine = elliptic_integrals(g)
    if approach is not None:
        approach = float(
            checked_quantity("approach", approach, "an approach in m, above 0", LEAST_AXIS, LARGEST_APPROACH)
        )
        load = 2.0 / 3.0 * math.pi * a * b * approach * material_pair.modulus / (short * (cosine + sine))
    load = float(checked_quantity("load", load, "a load in N, above 0", LEAST_AXIS, LARGEST_LOAD))
    curvature = 1.5 * load / (math.pi * a * b) * cosine / (material_pair.modulus * short)
    second_curvature = curvature * g * g * sine / cosine
    return by_load(*((second_curvature, curvature) if a >= b else (curvature, second_curvature)), load, material_pair)


def _checked_curvatures(A: Any, B: Any) -> dict[str, Array]:
    """Both curvatures (1/m) as arrays; raises InputError where they do not make a Hertzian contact."""
    curvatures = {
        name: checked_quantity(name, value, "a curvature in 1/m, at most 1e12", maximum=1e12)
        for name, value in (("A", A), ("B", B))
    }
    for name, value in curvatures.items():
        if (value <= 0.0).any():
            raise InputError(
                "",
                name,
                float(value.min()),
                "must be above 0: bodies that are flat to each other in one "
                "direction, conform or interpenetrate do not touch on an ellipse; compute them as "
                "non-Hertzian contact",
            )
    A, B = broadcast_together(**curvatures)
    flattest = float(np.maximum(A, B).min(initial=np.inf))
    if flattest < LEAST_CURVATURE:
        raise InputError(
            "",
            "A, B",
            flattest,
            f"the larger of both must be {LEAST_CURVATURE:g} 1/m or more; radii are in m, not in mm",
        )
    return curvatures


def _hertz_contact(
    A: Array,
    B: Array,
    load: Array,
    short_axis: Array,
    axis_ratio: Array,
    curvature_sum: Array,
    material_pair: MaterialPair,
) -> HertzContact:
    """Hertzian contact from its short semi-axis (m); all results are zero where this axis is. ``curvature_sum`` is K =
    B + D.
    """
    long = short_axis / axis_ratio
    area = math.pi * short_axis * long
    p0 = np.divide(1.5 * load, area, out=np.zeros_like(area), where=area > 0.0)
    along = A <= B  # the long axis lies along the smaller curvature
    a, b = np.where(along, long, short_axis), np.where(along, short_axis, long)
    fields = (a, b, p0, p0 * short_axis * curvature_sum / material_pair.modulus, load, A, B)
    return HertzContact(*(field[()] for field in fields))  # numbers from numbers


def axis_ratios_and_integrals(curvature_ratios: Array) -> tuple[Array, Array, Array]:
    """Results of ``axis_ratio_and_integrals`` for an array of curvature ratios: three arrays of the same shape."""
    ratio_and_integrals = _axis_ratios_and_integrals(np.ascontiguousarray(curvature_ratios).ravel()).reshape(
        3, *curvature_ratios.shape
    )
    return ratio_and_integrals[0], ratio_and_integrals[1], ratio_and_integrals[2]


@njit(cache=True)
def _axis_ratios_and_integrals(curvature_ratios: Array) -> Array:
    results = np.empty((3, curvature_ratios.size))
    for i in range(curvature_ratios.size):
        results[0, i], results[1, i], results[2, i] = axis_ratio_and_integrals(curvature_ratios[i])
    return results


@njit(cache=True)
def axis_ratio_and_integrals(curvature_ratio: float) -> tuple[float, float, float]:
    """Ratio g of the short to the long semi-axis of a Hertzian ellipse, and the elliptic integrals B and D at this g.

    curvature_ratio : the smaller by the larger, above 0 and up to 1. Newton's method for ln(g^2 D / B) as a function of
    ln g, whose slope 1 + C (1/D + g^2/B), C = (D - B)/e^2, stays between 1.5 and 2.
    """
    g = curvature_ratio ** (2.0 / 3.0)
    for _ in range(50):
        cosine, sine = elliptic_integrals(g)
        e2 = (1.0 - g) * (1.0 + g)
        third = (sine - cosine) / e2 if e2 > 1e-4 else math.pi / 16.0
        slope = 1.0 + third * (1.0 / sine + g * g / cosine)
        step = math.log(g * g * sine / cosine / curvature_ratio) / slope
        g = min(g * math.exp(-step), 1.0)
        if abs(step) < 1e-9:  # the next step would be the square of this
            break
    return (g, *elliptic_integrals(g))


@njit(cache=True)
def elliptic_integrals(axis_ratio: float) -> tuple[float, float]:
    """Elliptic integrals B and D (formulas in this module's docstring) at g = sqrt(1 - e^2), 0 < g <= 1, exact to
    rounding.
    """
    other, mean = axis_ratio, 1.0
    a_b, b_b, a_d, b_d = 1.0, 0.0, 0.0, 1.0  # the integrands as (a cos^2 + b sin^2) / sqrt(...)
    while True:
        a_b, b_b = a_b + b_b / mean, 2.0 * (b_b + a_b * other)
        a_d, b_d = a_d + b_d / mean, 2.0 * (b_d + a_d * other)
        before, mean = mean, mean + other
        if not abs(before - other) > 1e-8 * before:  # the error is the square of this; what is no number ends here too
            scale = math.pi / (4.0 * mean)
            return scale * (a_b + b_b / mean), scale * (a_d + b_d / mean)
        other = 2.0 * math.sqrt(before * other)
