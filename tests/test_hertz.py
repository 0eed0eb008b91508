"""Hertz: the closed form in many digits, limits that can be done by hand, refusals; and pairs of materials."""

import numpy as np
import pytest

from models.contact.hertz import axis_ratio_and_integrals, by_approach, by_axes, by_load, elliptic_integrals
from models.contact.material import STEEL, Material, MaterialPair
from models.contact.simplified_theory import solve_rolling_contact
from models.core.errors import InputError
from models.core.strict import read
from models.systems.contact.run import interpenetration_contact
from validation.cases.contact_hertz import exact_contact, measure

PAIR = MaterialPair()


def test_every_row_of_the_case_passes(tmp_path):
    rows, _ = measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []


@pytest.mark.grounds("published")
def test_the_truth_is_johnson_s_circle():
    """The many-digit side by formulas of its own: p0 = (6 N E*^2 / (pi^3 R^2))^(1/3), a = (3 N R / (4 E*))^(1/3)."""
    circle = {name: float(value) for name, value in exact_contact(1.0).items()}
    radius = 1 / (2 * circle["flat"])
    modulus = MaterialPair(STEEL, Material(E=7e10, nu=0.33)).modulus
    rounding = 1e-14  # of a power of 1/3 of a number of size 1e27
    assert circle["long"] == pytest.approx((0.75 * circle["load"] * radius / modulus) ** (1 / 3), rel=rounding)
    cube = 6 * circle["load"] * modulus**2 / (np.pi**3 * radius**2)
    assert circle["p0"] == pytest.approx(cube ** (1 / 3), rel=rounding)
    assert circle["approach"] == pytest.approx(circle["long"] ** 2 / radius, rel=rounding)


def test_truth_passes_smoothly_into_the_circle():
    """K - E over e^2 has no step where the circle's own formula takes over."""
    near, circle = exact_contact(1 - 1e-12), exact_contact(1.0)
    assert float(near["flat"] / circle["flat"] - 1) == pytest.approx(-1.25e-12, rel=1e-3, abs=0.0)  # D's own slope: 5/4


@pytest.mark.grounds("closed form")
def test_a_line_contact_is_that_of_cylinders():
    """Far from the ends a cylinder has s^2 = 4 N' R / (pi E*) and p0 = 2 N' / (pi s), N' the load per length."""
    contact = by_load(1e-9, 1.0, 1e5, PAIR)
    per_length = contact.p0 * np.pi * contact.b / 2  # in the middle
    assert contact.b**2 == pytest.approx(4 * per_length * 0.5 / (np.pi * PAIR.modulus), rel=1e-6)  # s^2/l^2 is left out


@pytest.mark.grounds("closed form")
def test_gap_is_the_paraboloid_under_the_pressure():
    """Displacement by Boussinesq, integrated over rays from the point, against approach - A x^2 - B y^2."""
    contact = by_load(1.0, 3.0, 1e5, PAIR)
    theta = (np.arange(400) + 0.5) * np.pi / 200
    for x, y in ((0.0, 0.0), (0.5 * contact.a, 0.0), (0.0, 0.6 * contact.b), (0.4 * contact.a, -0.5 * contact.b)):
        cos, sin = np.cos(theta) / contact.a, np.sin(theta) / contact.b
        p, q = cos**2 + sin**2, x / contact.a * cos + y / contact.b * sin
        r = 1 - (x / contact.a) ** 2 - (y / contact.b) ** 2
        whole = q * q + p * r
        # along each ray the integral of sqrt(r - 2 q s - p s^2) from 0 to the edge, in closed form
        edge = (np.pi / 2 - np.arcsin(q / np.sqrt(whole))) * whole / (2 * p**1.5) - q * np.sqrt(r) / (2 * p)
        lifted = contact.p0 * edge.mean() * 2 * np.pi / (np.pi * PAIR.modulus)
        assert lifted == pytest.approx(contact.approach - 1.0 * x**2 - 3.0 * y**2, rel=1e-12)


def test_arrays_broadcast_and_numbers_stay_numbers():
    many = by_load(np.array([[1.0], [2.0]]), 1.5, [1e3, 1e4, 1e5], PAIR)
    assert many.a.shape == many.load.shape == many.B.shape == (2, 3)
    one = by_load(2.0, 1.5, 1e4, PAIR)
    assert isinstance(one.a, float) and one.a == many.a[1, 1] and one.approach == many.approach[1, 1]
    assert by_load(np.empty(0), 1.0, 1.0, PAIR).p0.shape == (0,)


def test_a_spring_that_hardens():
    """dN/d(approach) = 3/2 N / approach at given curvatures; smooth through lift-off."""
    approach = np.array([-1e-5, 0.0, 1e-12, 1e-4])
    load = by_approach(1.0, 2.0, approach, PAIR).load
    assert (load[:2] == 0.0).all() and load[2] == pytest.approx(load[3] * 1e-12, rel=1e-12)  # (1e-8)^(3/2)


def test_extremes_stay_finite():
    """Curvature ratios to 1e-14 and loads from 1e-300 N on: no iteration that fails to end, no NaN."""
    contact = by_load(10.0 ** np.arange(-12, 3.0)[:, None], 1.0, [1e-300, 1e-6, 1e10], PAIR)
    for field in (contact.a, contact.b, contact.p0, contact.approach):
        assert np.isfinite(field).all() and (field > 0).all()


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("curvatures", [1e-200, 1e-8, 0.3, 1 - 1e-9, 1.0])
def test_aspect_solves_its_equation(curvatures):
    g, cosine, sine = axis_ratio_and_integrals(curvatures)
    assert (cosine, sine) == elliptic_integrals(g)
    # ln g is known to 1e-16, g to 460 times that
    assert g * g * sine / cosine == pytest.approx(curvatures, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: by_load(-1.0, 1.0, 1.0, PAIR), r"A = -1.0: must be above 0: .*conform"),
        (lambda: by_load(1.0, 0.0, 1.0, PAIR), r"B = 0.0: must be above 0"),
        (lambda: by_load(1.0, [1.0, np.nan], 1.0, PAIR), r"B\[1\] = nan: must be a curvature in 1/m"),
        (lambda: by_load(1e-3, 2e-3, 1.0, PAIR), r"0.002: the larger of both must be 0.01 1/m or more; radii are in m"),
        (lambda: by_load(1.0, 1.0, np.inf, PAIR), r"load = inf: must be a load in N"),
        (lambda: by_load(1.0, 1.0, "much", PAIR), r"load = 'much': must be a number"),
        (lambda: by_load([1.0, 1.0], 1.0, [1.0, 2.0, 3.0], PAIR), r"no common shape: .*load \(3,\)"),
        (lambda: by_approach(1.0, 1.0, 0.1, PAIR), r"approach = 0.1: must be an approach in m, at most 0.05"),
        (lambda: by_axes(-5e-3, 4e-3, PAIR, load=1e4), r"a = -0.005: must be a semi-axis in m, above 0"),
        (lambda: by_axes(5e-3, 4e-3, PAIR), r"either the load \(N\) or the approach"),
        (lambda: by_axes(5e-3, 4e-3, PAIR, load=1e4, approach=1e-5), r"either the load \(N\) or the approach"),
        (lambda: by_load(1.0, 1.0, "1e4", PAIR), r"load = '1e4': must be a number"),
        (lambda: by_load(1.0, 1.0, np.ma.masked_less([1.0, -1.0], 0.0), PAIR), r"load.*must be a number"),
        (lambda: by_load(1.0, 1.0, np.array([1.0 + 1.0j]), PAIR), r"load.*must be a number"),
        (lambda: MaterialPair(STEEL, 0.28), r"pair.rail = 0.28: must be a Material"),
        (lambda: Material(E=2.1e5, nu=0.28), r"E = 210000.0: must be 1e\+06 or more \(Young's modulus, not in MPa"),
        (lambda: Material(E=2.1e11, nu=0.6), r"nu = 0.6: must be at most 0.5"),
        (lambda: Material(E=float("nan"), nu=0.3), r"E = nan"),
        (lambda: Material(E=2.1e11), r"nu: is missing"),
        (lambda: Material(E=2.1e11, nu=0.3, rho=1.0), r"rho = 1.0: unknown key \(allowed: E, nu\)"),
    ],
)
def test_what_cannot_be_used_says_what_is_expected(call, words):
    with pytest.raises(InputError, match=words):
        call()


@pytest.mark.grounds("closed form")
def test_combined_constants():
    """A pair of equals has its own constants; (1 - nu)/G = 1/E* for any pair (Kalker 1990, section 1.7)."""
    assert (PAIR.G, PAIR.nu, PAIR.mismatch) == (STEEL.G, STEEL.nu, 0.0)
    assert pytest.approx(STEEL.E / (2 * (1 - 0.28**2))) == PAIR.modulus
    unlike = MaterialPair(STEEL, Material(E=7e10, nu=0.33))
    assert (1 - unlike.nu) / unlike.G == pytest.approx(1 / unlike.modulus, rel=1e-14, abs=0.0)
    # Dundurs' constant of steel on aluminium, from his own formula with kappa = 3 - 4 nu
    (one, two), (k1, k2) = (unlike.wheel.G, unlike.rail.G), (3 - 4 * 0.28, 3 - 4 * 0.33)
    dundurs = (two * (k1 - 1) - one * (k2 - 1)) / (two * (k1 + 1) + one * (k2 + 1))
    assert unlike.mismatch == pytest.approx(dundurs * (1 - unlike.nu), rel=1e-13)


def test_unlike_pairs_are_refused_only_where_they_rub():
    unlike, near = MaterialPair(STEEL, Material(E=7e10, nu=0.33)), MaterialPair(Material(E=2.06e11, nu=0.3), STEEL)
    assert by_load(1.0, 1.0, 1e4, unlike).a > 0.0
    near.require_likeness()
    assert near.quasi_identity_error(0.3) == pytest.approx(0.042, abs=1e-3)  # 2 |K| / mu, K = -0.0063
    assert near.quasi_identity_error(0.3) == MaterialPair(near.rail, near.wheel).quasi_identity_error(0.3)
    with pytest.raises(InputError, match=r"too unlike .*K = -0.07"):
        unlike.require_likeness()
    pressed = interpenetration_contact(
        by_load(1.0, 1.0, 1e4, unlike), unlike
    )  # the simplified theory, too, leaves K out
    with pytest.raises(InputError, match=r"too unlike .*K = -0.07"):
        solve_rolling_contact(pressed, 0.3, 1e-3, 0.0, 0.0)


def test_a_material_in_a_file_is_read_as_strictly():
    assert read(Material, {"E": 2.1e11, "nu": 0.28}, "scene.toml", "wheel") == STEEL
    with pytest.raises(InputError, match="Young's modulus"):
        read(Material, {"E": 2.1e5, "nu": 0.28}, "scene.toml", "wheel")
