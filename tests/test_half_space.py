"""Influence numbers against integrals, limits and symmetries; the convolution against the plain sum."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from models.contact.half_space import CellConvolution, cell_offsets, influence_of_rectangle
from models.contact.material import STEEL, Material, MaterialPair

PAIR = MaterialPair(STEEL, Material(E=7e10, nu=0.4))  # all nine numbers differ from zero
DX, DY = 0.5e-3, 0.3e-3


def kernel(x, y):
    """Boussinesq's and Cerruti's displacements by a point force, (3, 3), as Johnson (1985) has them."""
    r, nu, k = np.hypot(x, y), PAIR.nu, PAIR.mismatch
    return np.array(
        [
            [(1 - nu) / r + nu * x * x / r**3, nu * x * y / r**3, -k * x / r**2],
            [nu * x * y / r**3, (1 - nu) / r + nu * y * y / r**3, -k * y / r**2],
            [k * x / r**2, k * y / r**2, (1 - nu) / r],
        ]
    ) / (np.pi * PAIR.G)


@pytest.mark.parametrize(("x", "y"), [(0.7e-3, 0.4e-3), (-0.6e-3, 0.0), (0.25e-3, -0.9e-3)])
def test_numbers_are_the_integrals(x, y):
    for i in range(3):
        for j in range(3):

            def at(v, u, i=i, j=j):
                return kernel(x - u, y - v)[i, j]

            truth = dblquad(at, -DX / 2, DX / 2, -DY / 2, DY / 2, epsabs=1e-24, epsrel=1e-9)[0]
            scale = (DX * DY) ** 0.5 / PAIR.G
            assert influence_of_rectangle(x, y, DX, DY, PAIR)[i, j] == pytest.approx(truth, abs=1e-9 * scale)


def test_the_middle_of_a_square():
    """Love (1929): u_z = 4 (1 - nu) / (pi G) s ln(1 + sqrt 2) p in the middle of a square of side s."""
    truth = 4 * (1 - PAIR.nu) / (np.pi * PAIR.G) * DX * np.log(1 + 2**0.5)
    assert influence_of_rectangle(0.0, 0.0, DX, DX, PAIR)[2, 2] == pytest.approx(truth, rel=1e-14, abs=0.0)


def test_far_away_a_cell_is_a_point():
    far = influence_of_rectangle(40e-3, 30e-3, DX, DY, PAIR)
    assert far == pytest.approx(kernel(40e-3, 30e-3) * DX * DY, rel=1e-4, abs=0.0)  # (DX / r)^2 is 1e-4


def test_a_rectangle_is_the_sum_of_its_halves():
    parts = sum(influence_of_rectangle(0.1e-3 + s * DX / 4, 0.2e-3, DX / 2, DY, PAIR) for s in (1, -1))
    assert influence_of_rectangle(0.1e-3, 0.2e-3, DX, DY, PAIR) == pytest.approx(parts, abs=1e-14 * DX / PAIR.G)


def test_convolution_is_the_plain_sum():
    rng = np.random.default_rng(1)
    rows, columns = 4, 7
    numbers = (
        influence_of_rectangle(cell_offsets(columns, DX), cell_offsets(rows, DY)[:, None], DX, DY, PAIR) * PAIR.G / DX
    )
    values = rng.normal(size=(rows, columns, 3))
    plain = np.zeros_like(values)
    for row in range(rows):
        for column in range(columns):
            for r in range(rows):
                for c in range(columns):
                    plain[row, column] += numbers[rows - 1 + row - r, columns - 1 + column - c] @ values[r, c]
    assert CellConvolution(numbers)(values) == pytest.approx(
        plain, abs=1e-13
    )  # rounding of sums of 28 numbers of size 1
