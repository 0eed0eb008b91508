"""Hertz's contact compared with the closed form in many decimal digits, from thin lines to the circle, and the input
that is refused."""

from collections.abc import Callable
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.hertz import HertzContact, by_approach, by_load
from models.contact.material import STEEL, Material, MaterialPair
from models.core.errors import InputError
from validation.common.rows import Observed, Row, System, Table, behaviour_row

TITLE = "Hertz: two smooth bodies touch on an ellipse"
SYSTEM: System = "contact"
DECIMAL_DIGITS = 60
RELATIVE_TOLERANCE = 1e-10
NORMAL_LOAD = 1e5
PEAK_PRESSURE, SHORT_SEMI_AXIS = Decimal(10) ** 9, Decimal(1) / 1000
"""Peak pressure (Pa) and short semi-axis (m) of the contacts compared."""
MATERIAL_PAIR = MaterialPair(STEEL, Material(E=7e10, nu=0.33))
"""Steel on aluminium: the combined modulus is exact for any two materials as long as there is no friction."""
NEARLY_CIRCULAR_AXIS_RATIOS = tuple(1.0 - 10.0**-k for k in range(1, 16))
AXIS_RATIOS = tuple(float(g) for g in 10.0 ** np.linspace(-6, 0, 49))
"""Ratios of the short to the long semi-axis of the contacts compared."""
TITLES_OF_QUANTITIES = {"long": "longer semi-axis", "short": "shorter semi-axis", "p0": "largest pressure"}
BOUND_REASON = (
    "K and E by the arithmetic-geometric mean in 60 decimal digits, which leaves 30 where K - E cancels: no digit "
    "and no integral shared with the code"
)


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows for axes, pressure, approach and load over all axis ratios, for one published contact, and for refusals; a
    quick run is the same."""
    errors = _largest_errors((*AXIS_RATIOS, *NEARLY_CIRCULAR_AXIS_RATIOS))
    rows = [
        Observed(
            f"contact_hertz.{name}",
            SYSTEM,
            f"largest relative error of {TITLES_OF_QUANTITIES.get(name, name)}, axis ratios 1e-6 to 1e6",
            max(worst),
            "",
        ).at_most(RELATIVE_TOLERANCE, BOUND_REASON, "closed form")
        for name, worst in errors.items()
    ]
    return rows + _published_rows() + _refusal_rows(), {
        "ratio": [*AXIS_RATIOS, *NEARLY_CIRCULAR_AXIS_RATIOS],
        "errors": errors,
    }


def exact_contact(axis_ratio: float) -> dict[str, Decimal]:
    """Exact semi-axes, curvatures, pressure, load and approach (60 decimal digits) of a contact with a given ratio of
    short to long semi-axis."""
    with localcontext(prec=DECIMAL_DIGITS):
        g, modulus = Decimal(axis_ratio), Decimal(MATERIAL_PAIR.modulus)
        k, e = _elliptic_integrals(g)
        if axis_ratio == 1.0:
            flat = steep = _pi() * PEAK_PRESSURE / (4 * SHORT_SEMI_AXIS * modulus)
        else:
            scale = PEAK_PRESSURE * g * g / (modulus * (1 - g * g) * SHORT_SEMI_AXIS)
            flat, steep = scale * (k - e), scale * (e / (g * g) - k)
        return {
            "short": SHORT_SEMI_AXIS,
            "long": SHORT_SEMI_AXIS / g,
            "p0": PEAK_PRESSURE,
            "approach": PEAK_PRESSURE * SHORT_SEMI_AXIS * k / modulus,
            "flat": flat,
            "steep": steep,
            "load": 2 * _pi() * PEAK_PRESSURE * SHORT_SEMI_AXIS**2 / (3 * g),
        }


def _elliptic_integrals(axis_ratio: Decimal) -> tuple[Decimal, Decimal]:
    """Complete elliptic integrals K and E at the modulus sqrt(1 - g^2), where g is the axis ratio and M the
    arithmetic-geometric mean: K = pi / (2 M(1, g)), E = K (1 - sum 2^(n-1) c_n^2)."""
    a, b, total, weight = Decimal(1), axis_ratio, (1 - axis_ratio * axis_ratio) / 2, Decimal(1) / 2
    while abs(a - b) > Decimal(10) ** (4 - DECIMAL_DIGITS) * a:
        weight, c = 2 * weight, (a - b) / 2
        a, b = (a + b) / 2, (a * b).sqrt()
        total += weight * c * c
    k = _pi() / (2 * a)
    return k, k * (1 - total)


def _pi() -> Decimal:
    """The number pi by the method of Gauss and Legendre."""
    a, b, t, p = Decimal(1), 1 / Decimal(2).sqrt(), Decimal(1) / 4, Decimal(1)
    for _ in range(7):
        a, b, t, p = (a + b) / 2, (a * b).sqrt(), t - p * ((a - b) / 2) ** 2, 2 * p
    return (a + b) ** 2 / (4 * t)


def _largest_errors(axis_ratios: tuple[float, ...]) -> dict[str, list[float]]:
    """Largest relative error of every quantity at each axis ratio. The contacts are computed from the load and from the
    approach, with the long axis along x and along y."""
    truth = [exact_contact(g) for g in axis_ratios]
    flat, steep, load, approach = (
        np.array([float(computed[name]) for computed in truth]) for name in ("flat", "steep", "load", "approach")
    )
    touching = [
        by_load(flat, steep, load, MATERIAL_PAIR),
        by_approach(flat, steep, approach, MATERIAL_PAIR),
        _exchange_axes(by_load(steep, flat, load, MATERIAL_PAIR)),
        _exchange_axes(by_approach(steep, flat, approach, MATERIAL_PAIR)),
    ]
    named = {"a": "long", "b": "short", "p0": "p0", "approach": "approach", "load": "load"}
    return {
        name: [
            max(float(abs(Decimal(float(getattr(computed, field)[i])) / exact[name] - 1)) for computed in touching)
            for i, exact in enumerate(truth)
        ]
        for field, name in named.items()
    }


def _exchange_axes(hertz_contact: HertzContact) -> HertzContact:
    """The contact with the axes x and y exchanged."""
    return HertzContact(
        hertz_contact.b,
        hertz_contact.a,
        hertz_contact.p0,
        hertz_contact.approach,
        hertz_contact.load,
        hertz_contact.B,
        hertz_contact.A,
    )


def _published_rows() -> list[Row]:
    """Rows: comparison with a contact that another program computed on a grid, and scaling of the axes with the
    load."""
    touching, eight = (by_load(1 / 0.92, 1 / 0.6, load, MaterialPair()) for load in (1e5, 8e5))
    why = "CONTACT, half-space solved on cells of 0.25 mm, that is 1/29 of an axis"
    return [
        Observed(
            "contact_hertz.contact.p0",
            SYSTEM,
            "largest pressure of a wheel on a rail at 100 kN",
            float(touching.p0),
            "Pa",
        ).within(1.22674e9, 1e6, why, "native"),
        Observed(
            "contact_hertz.contact.approach",
            SYSTEM,
            "approach of a wheel to a rail at 100 kN",
            float(touching.approach),
            "m",
        ).within(1.04996e-4, 1e-8, why, "native"),
        Observed(
            "contact_hertz.scaling",
            SYSTEM,
            "ratio of the axes at eight times the load to the axes at the load",
            float(eight.a / touching.a),
            "",
        ).within(2.0, 1e-14, "axes go with the cube root of the load", "closed form"),
    ]


def _refusal_rows() -> list[Row]:
    """Rows: zero and negative loads give zero, and input that is no Hertzian contact is refused."""
    nothing = [by_load(1.0, 2.0, load, MATERIAL_PAIR) for load in (0.0, -1.0, -1e6)] + [
        by_approach(1.0, 2.0, -1e-3, MATERIAL_PAIR)
    ]
    exact = all(
        value == 0.0
        for nothing_solved in nothing
        for value in (
            nothing_solved.a,
            nothing_solved.b,
            nothing_solved.p0,
            nothing_solved.approach,
            nothing_solved.load,
        )
    )
    why = "a silent number would be wrong"
    asked: dict[str, Callable[[], object]] = {
        "flat": lambda: by_load(0.0, 1.0, NORMAL_LOAD, MATERIAL_PAIR),
        "concave": lambda: by_load(1.0, -0.1, NORMAL_LOAD, MATERIAL_PAIR),
        "not finite": lambda: by_load(1.0, np.nan, NORMAL_LOAD, MATERIAL_PAIR),
        "radius in mm": lambda: by_load(1 / 920, 1 / 600, NORMAL_LOAD, MATERIAL_PAIR),
        "modulus in MPa": lambda: Material(E=2.1e5, nu=0.28),
        "approach in mm": lambda: by_approach(1.0, 1.0, 0.1, MATERIAL_PAIR),
        "shapes": lambda: by_load([1.0, 2.0], [1.0, 2.0, 3.0], NORMAL_LOAD, MATERIAL_PAIR),
        "friction of steel on aluminium": MATERIAL_PAIR.require_likeness,
    }
    rows = [
        behaviour_row(
            f"contact_hertz.refused.{name.replace(' ', '_')}",
            SYSTEM,
            f"a contact is refused: {name}",
            _outcome_of_computation(ask),
            "refused",
            why,
        )
        for name, ask in asked.items()
    ]
    return [
        behaviour_row(
            "contact_hertz.nothing",
            SYSTEM,
            "contact forces without load, with a negative load and across a gap",
            "zero" if exact else "not zero",
            "zero",
            "nothing touches: exactly zero, no number near it",
        ),
        *rows,
    ]


def _outcome_of_computation(compute_contact: Callable[[], object]) -> str:
    """ "refused" if a computation raises InputError, else "accepted"."""
    try:
        compute_contact()
    except InputError:
        return "refused"
    return "accepted"


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the largest relative errors by range of the axis ratio."""
    ratio = np.array(case_data["ratio"])
    ranges = {"1e-6 to 1e-4": (0.0, 1e-4), "1e-4 to 0.1": (1e-4, 0.1), "0.1 to 0.9": (0.1, 0.9), "0.9 to 1": (0.9, 1.0)}
    rows = tuple(
        (
            title,
            *(
                f"{np.array(errors)[(ratio > low) & (ratio <= high)].max():.1e}"
                for errors in case_data["errors"].values()
            ),
        )
        for title, (low, high) in ranges.items()
    )
    note = (
        f"Worst relative error against {DECIMAL_DIGITS} digits, driven by load and by approach, the long axis along x "
        "and along y."
    )
    return [Table("Hertz: relative error by the ratio of axes", note, ("axes", *case_data["errors"]), rows)]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the semi-axes over the ratio of curvatures, and the errors over the axis ratio."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    curvature = np.geomspace(1e-4, 1e4, 201)
    touching = by_load(curvature, 1.0, NORMAL_LOAD, MaterialPair())
    for values, name in ((touching.a, "a, along x"), (touching.b, "b, along y")):
        left.loglog(curvature, values * 1e3, label=name)
    left.set(title="Steel, 100 kN, B = 1 1/m", xlabel="ratio of curvatures A/B [-]", ylabel="semi-axis [mm]")
    left.legend()
    ratio = np.array(case_data["ratio"])
    for name, errors in case_data["errors"].items():
        right.loglog(
            ratio[: len(AXIS_RATIOS)], np.maximum(errors[: len(AXIS_RATIOS)], 1e-17), ".", markersize=4, label=name
        )
    right.axhline(RELATIVE_TOLERANCE, color="black", linestyle=":", label="allowed")
    right.set(title="Relative error against 60 digits [-]", xlabel="short axis / long axis [-]", ylim=(3e-18, 1e-9))
    right.legend(loc="center", ncols=3)
    add_heading(figure, "Hertzian contact loses no digits from a thin line to the circle")
    return [("Semi-axes of Hertz's ellipse and their error.", figure)]
