"""Linear theory: the table beside the exact theory, smooth joints, signs, units, flexibilities, refusals."""

import os
from pathlib import Path

import numpy as np
import pytest

from models.contact.linear_theory import (
    KALKER_TABLE,
    TABLE_AXIS_RATIOS,
    coefficient_at,
    fastsim_flexibilities,
    flexibilities_at,
    kalker_coefficients,
    linear_creep_forces,
)
from models.contact.material import STEEL, Material, MaterialPair
from models.core.errors import InputError
from validation.cases import contact_coefficients as case

PAIR = MaterialPair()
A, B = 5e-3, 3e-3


def stacked(ratio, nu):
    c = kalker_coefficients(ratio, nu)
    return np.stack([c.c11, c.c22, c.c23, c.c33], axis=-1)


def test_every_row_of_the_case_passes(tmp_path):
    rows, data = case.measure(True, tmp_path)
    assert [row.id for row in rows if row.status in ("failed", "not run")] == []
    assert case.tables(data)


@pytest.mark.grounds("published")
def test_nodes_are_the_published_ones():
    assert stacked(TABLE_AXIS_RATIOS[:, None], np.array([0.0, 0.25, 0.5])) == pytest.approx(
        np.moveaxis(KALKER_TABLE, 1, 2), rel=1e-14
    )
    folder = Path(os.environ.get("TWINRIG_DATA", ""))
    if not (folder / "kalker_coefficients.csv").is_file():
        pytest.skip("TWINRIG_DATA does not name the folder of the published table")
    published = np.loadtxt(folder / "kalker_coefficients.csv", delimiter=",", skiprows=2)
    found = stacked(np.round(TABLE_AXIS_RATIOS, 5)[:, None], np.array([0.0, 0.25, 0.5]))
    assert np.abs(found.reshape(-1, 4) / published[:, 2:] - 1).max() < 1e-5  # the file's a/b has five decimals


def test_bodies_without_lateral_contraction_know_no_direction():
    """At nu = 0 the equations along x and y are the same: C11 = C22, between and beyond the nodes too."""
    c = kalker_coefficients(np.geomspace(1e-4, 1e4, 101), 0.0)
    assert c.c11 == pytest.approx(c.c22, rel=1e-12)


@pytest.mark.parametrize("nu", [0.0, 0.1, 0.28, 0.5])
def test_no_step_and_no_kink_between_pieces(nu):
    """Values meet at every node and at both ends of the table; slopes in log-log stay within what the table shows."""
    for joint in TABLE_AXIS_RATIOS:
        below, above = stacked(joint * (1 - 1e-9), nu), stacked(joint * (1 + 1e-9), nu)
        assert above == pytest.approx(below, rel=1e-8)  # 2e-9 times slopes of up to 1.5
    ratio = np.geomspace(1e-3, 1e3, 601)
    slopes = np.gradient(np.log(stacked(ratio, nu)), np.log(ratio), axis=0)
    assert np.abs(np.diff(slopes, axis=0)).max() < 0.12  # 0.23 of ln(a/b) apart; the joint at 10 is the worst


@pytest.mark.parametrize("nu", [0.0, 0.28, 0.5])
def test_every_coefficient_is_positive_to_the_ends(nu):
    found = stacked(np.geomspace(1e-9, 1e9, 181), nu)
    assert np.isfinite(found).all() and (found > 0).all()


@pytest.mark.grounds("closed form")
def test_narrow_patches_are_strips():
    """a/b to 0: each strip is a rolling cylinder, C11 = pi^2 / (4 (1 - nu)) and C22 = pi^2 / 4 (Carter)."""
    c = kalker_coefficients(1e-8, 0.3)
    assert (c.c11, c.c22) == pytest.approx((np.pi**2 / 2.8, np.pi**2 / 4), rel=1e-9)


def test_signs_and_units_of_the_forces():
    """Each creepage by itself, from the formulas by hand; forces on the wheel oppose the slip."""
    c, g, size = kalker_coefficients(A / B, STEEL.nu), STEEL.G, (A * B) ** 0.5
    along, across, turn = -g * size**2 * c.c11, -g * size**2 * c.c22, g * size**3 * c.c23
    assert linear_creep_forces(A, B, 1e-5, 0, 0, PAIR) == pytest.approx((along * 1e-5, 0, 0))
    assert linear_creep_forces(A, B, 0, 1e-5, 0, PAIR) == pytest.approx((0, across * 1e-5, turn * 1e-5))
    assert linear_creep_forces(A, B, 0, 0, 1e-3, PAIR) == pytest.approx((0, -turn * 1e-3, -g * size**4 * c.c33 * 1e-3))
    assert linear_creep_forces(A, B, 0, 0, 0, PAIR) == linear_creep_forces(0, 0, 1, 1, 1, PAIR) == (0.0, 0.0, 0.0)


def test_power_is_never_positive():
    """The form Fx xi_x + Fy xi_y + Mz spin is -G times a square: C11, C22, C33 > 0 are enough, C23 cancels."""
    creepages = np.random.default_rng(1).normal(size=(3, 1000)) * [[1e-4], [1e-4], [1e-2]]
    fx, fy, mz = linear_creep_forces(A, B, *creepages, PAIR)
    assert (fx * creepages[0] + fy * creepages[1] + mz * creepages[2] < 0).all()


def test_scaling_with_size():
    """Twice the patch: four times the force by creepage, eight times by spin, sixteen times the spin moment."""
    one, two = (linear_creep_forces(k * A, k * B, 1e-5, 0, 1e-3, PAIR) for k in (1, 2))
    assert [y / x for x, y in zip(one, two, strict=True)] == pytest.approx([4, 8, 16])


@pytest.mark.grounds("closed form")
def test_a_bed_of_springs_answers_with_the_same_forces():
    """Integral over the ellipse of the traction that grows from the leading edge in every strip."""
    l1, l2, l3 = fastsim_flexibilities(A, B, PAIR)
    y = np.polynomial.legendre.leggauss(200)
    half, weight = A * np.sqrt(1 - y[0] ** 2), B * y[1]
    creepage = -np.sum(weight * 2 * half**2)  # (half - x) xi over the strip
    spin = -np.sum(weight * (2 / 3) * half**3)  # (half^2 - x^2)/2 phi
    rough = 1e-6  # 200 points and the square root at both ends
    assert linear_creep_forces(A, B, 1e-5, 0, 0, PAIR)[0] == pytest.approx(creepage * 1e-5 / l1, rel=rough)
    assert linear_creep_forces(A, B, 0, 1e-5, 0, PAIR)[1] == pytest.approx(creepage * 1e-5 / l2, rel=rough)
    assert linear_creep_forces(A, B, 0, 0, 1e-3, PAIR)[1] == pytest.approx(spin * 1e-3 / l3, rel=rough)


def test_compiled_callers_get_the_same():
    assert flexibilities_at(A, B, PAIR.G, PAIR.nu) == fastsim_flexibilities(A, B, PAIR)
    assert coefficient_at(3, 2.2, 0.3) == kalker_coefficients(2.2, 0.3).c33
    assert fastsim_flexibilities(np.zeros((2, 1)), [1.0, 0.0, 1e-3], PAIR)[2].tolist() == [[0.0] * 3] * 2


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: kalker_coefficients(0.0, 0.3), r"ratio = 0.0: must be a ratio a/b"),
        (lambda: kalker_coefficients([1.0, -2.0], 0.3), r"ratio\[1\] = -2.0"),
        (lambda: kalker_coefficients(1.0, 0.6), r"nu = 0.6: must be a Poisson's ratio from 0 to 0.5"),
        (lambda: linear_creep_forces(5.0, 3.0, 0, 0, 0, PAIR), r"at most 0.5 m; axes are in m, not in mm"),
        (lambda: linear_creep_forces(-1e-3, 3e-3, 0, 0, 0, PAIR), r"a = -0.001: must be a semi-axis in m"),
        (lambda: linear_creep_forces(A, B, np.nan, 0, 0, PAIR), r"xi_x = nan: must be a creepage"),
        (lambda: linear_creep_forces(A, B, 0, 0, np.inf, PAIR), r"spin = inf: must be a spin in 1/m"),
        (lambda: linear_creep_forces([A, A], B, [1e-3] * 3, 0, 0, PAIR), r"no common shape: .*xi_x \(3,\)"),
        (lambda: fastsim_flexibilities(A, B, MaterialPair(STEEL, Material(E=7e10, nu=0.33))), "too unlike"),
        (lambda: linear_creep_forces(A, B, 0, 0, 0, MaterialPair(STEEL, Material(E=7e10, nu=0.33))), "too unlike"),
    ],
)
def test_what_cannot_be_used_says_what_is_expected(call, words):
    with pytest.raises(InputError, match=words):
        call()
