"""Loops of the exact rolling problem against what they stand for: a solved system, a root, a sweep written out."""

import numpy as np
import pytest
from scipy.optimize import brentq

from models.contact.material import MaterialPair
from models.contact.rolling_kernels import (
    cell_traction,
    factorise_matrices,
    gauss_seidel_sweep,
    orthogonalise,
    rotate_column,
    solve_factorised,
)
from models.contact.rolling_operator import SlipOperator, gmres

pytestmark = pytest.mark.grounds("plain counterpart")


def test_factors_of_many_systems_and_their_solutions():
    """Blocks of two systems, positive definite in their symmetric part; the unit matrix around them stays."""
    draw, spans = np.random.default_rng(1), np.array([[1, 6], [0, 7]])
    systems = np.array([np.eye(7), np.eye(7)])
    for system, (start, stop) in zip(systems, spans, strict=True):
        skewed = draw.normal(size=(stop - start, stop - start))
        system[start:stop, start:stop] = skewed @ skewed.T + np.eye(stop - start) + skewed - skewed.T
    factors, wanted = systems.copy(), draw.normal(size=(2, 7))
    factorise_matrices(factors, spans)
    for made, system in zip(factors, systems, strict=True):
        assert (np.tril(made, -1) + np.eye(7)) @ np.triu(made) == pytest.approx(system, abs=1e-12)
    solved = np.linalg.solve(systems, wanted[..., None])[..., 0]
    assert solve_factorised(factors, spans, wanted) == pytest.approx(solved, rel=1e-10)


def test_steps_of_gmres():
    draw = np.random.default_rng(2)
    system, wanted = np.eye(9) + 0.3 * draw.normal(size=(9, 9)), draw.normal(size=9)
    solved = gmres(lambda x: system @ x, lambda x: 0.5 * x, wanted, 1e-12, 9)
    assert solved == pytest.approx(np.linalg.solve(system, wanted), rel=1e-9)


def test_a_vector_beside_a_basis_and_its_turned_components():
    """The new row is orthogonal and of length 1, all rows give the vector back; rotations leave numpy's triangle."""
    draw, count = np.random.default_rng(3), 3
    basis = np.zeros((5, 6))
    basis[:count] = np.linalg.qr(draw.normal(size=(6, count)))[0].T
    vector = draw.normal(size=6)
    components = orthogonalise(basis, count, vector)
    assert basis[: count + 1] @ basis[: count + 1].T == pytest.approx(np.eye(count + 1), abs=1e-12)
    assert components @ basis[: count + 1] == pytest.approx(vector, rel=1e-12)
    columns = np.triu(draw.normal(size=(4, 3)), -1)
    turns, left = np.zeros((3, 2)), np.array([1.7, 0.0, 0.0, 0.0])
    triangle = np.zeros((3, 3))
    for k in range(3):
        triangle[: k + 1, k] = rotate_column(columns[: k + 2, k].copy(), turns, left)
    expected = np.linalg.qr(columns)[1]
    assert np.abs(triangle) == pytest.approx(np.abs(expected), rel=1e-12)
    least = np.linalg.lstsq(columns, 1.7 * np.eye(4)[0], rcond=None)
    assert np.linalg.solve(triangle, left[:3]) == pytest.approx(least[0], rel=1e-10)
    assert left[3] ** 2 == pytest.approx(least[1][0], rel=1e-10)


def rubbed(slip, own, bound):
    """Traction (2,) of a cell that sticks, or opposite to the slip that it leaves."""
    if np.hypot(*(slip / own)) <= bound:
        return -slip / own
    shift = brentq(lambda more: np.hypot(*(slip / (own + more))) - bound, 0.0, 1e3, xtol=1e-15)
    return -slip / (own + shift)


def test_one_cell_sticks_or_slips():
    draw = np.random.default_rng(4)
    for slip, bound in zip(draw.normal(size=(30, 2)), draw.uniform(0.05, 3.0, 30), strict=True):
        computed = cell_traction(*slip, 0.8, 1.3, bound)
        assert computed == pytest.approx(tuple(rubbed(slip, np.array([0.8, 1.3]), bound)), rel=1e-10)


def test_a_sweep_takes_one_cell_after_the_other():
    """From the leading edge back, each with the slip that all others leave it then; cells outside stay."""
    draw, relaxation = np.random.default_rng(5), 0.7
    operator = SlipOperator(5, 4, 1e-3, 1.5e-3, MaterialPair())
    rigid, bound = draw.normal(0.0, 1.0, (4, 5, 2)), draw.uniform(0.2, 3.0, (4, 5))
    bound[0, :2] = 0.0
    traction = draw.normal(0.0, 0.3, (4, 5, 2)) * (bound > 0.0)[..., None]
    computed = np.ascontiguousarray(np.moveaxis(traction, -1, 0))
    gauss_seidel_sweep(
        computed, np.ascontiguousarray(np.moveaxis(rigid, -1, 0)), operator.reversed_kernel, bound, relaxation
    )
    for row in range(4):
        for column in range(4, -1, -1):
            if bound[row, column] > 0.0:
                before, own = traction[row, column], operator.own_slip
                slip = (rigid + operator(traction))[row, column] - own * before
                traction[row, column] += relaxation * (rubbed(slip, own, bound[row, column]) - before)
    assert np.moveaxis(computed, 0, -1) == pytest.approx(traction, rel=1e-9, abs=1e-12)
