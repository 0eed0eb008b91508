"""Tyre tables: exact at nodes, bounded, slopes per cell; curves, `.tir` and CSV files that fill them."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.tyre.magic_formula import (
    NAMED_SURFACES,
    PACEJKA,
    Burckhardt,
    MagicFormulaCurve,
    graded_nodes,
    product_factors,
    table_by_similarity,
    table_of_surface,
)
from models.tyre.tyre_source import table_of_named_tyre
from models.tyre.tyre_table import (
    TableCell,
    TyreTable,
    cell_and_share,
    lateral_adhesion,
    longitudinal_adhesion,
    stacked_tables,
)


def small(peak=0.8):
    """Two loads, three angles, three slips: every figure of its own."""
    mu_x = (
        np.array(
            [
                [[0.0, 0.8, 0.6], [0.0, 0.7, 0.5]],
                [[0.0, 0.5, 0.45], [0.0, 0.4, 0.42]],
                [[0.0, 0.1, 0.2], [0.0, 0.12, 0.19]],
            ]
        )
        * peak
        / 0.8
    )
    g = np.array([[1.0, 0.6, 0.1], [1.0, 0.7, 0.2], [1.0, 0.9, 0.5]])
    h = np.array([[0.0, 0.0], [0.7, 0.6], [0.65, 0.62]]) * peak / 0.8
    return TyreTable(np.array([0.0, 0.1, 0.4]), np.array([0.0, 0.2, 1.0]), np.array([1e4, 3e4]), mu_x, g, h, "small")


def at(tables, number, angle, load, slip):
    """mu_x and mu_y by the compiled functions."""
    cells = TableCell(*cell_and_share(tables.angles, angle), *cell_and_share(tables.loads, load))
    k, w = cell_and_share(tables.slips, slip)
    mu = [longitudinal_adhesion(number, cells, node, tables.mu_x) for node in (k, min(k + 1, tables.slips.size - 1))]
    return (1 - w) * mu[0] + w * mu[1], lateral_adhesion(number, cells, k, w, tables.g, tables.h)


@pytest.mark.grounds("closed form")
def test_exact_at_nodes_linear_between_constant_beyond():
    table = small()
    tables = stacked_tables([table])
    for i, angle in enumerate(table.angles):
        for j, load in enumerate(table.loads):
            for k, slip in enumerate(table.slips):
                assert at(tables, 0, angle, load, slip) == (table.mu_x[i, j, k], table.g[i, k] * table.h[i, j])
    # the middle of a cell is the mean of its eight corners, and mu_y that of g times that of h
    x, y = at(tables, 0, 0.25, 2e4, 0.6)
    assert x == pytest.approx(table.mu_x[1:, :, 1:].mean(), rel=1e-14)
    assert y == pytest.approx(table.g[1:, 1:].mean() * table.h[1:].mean(), rel=1e-14)
    assert at(tables, 0, 1.5, 9e9, 1.0) == at(tables, 0, 0.4, 3e4, 1.0)
    assert at(tables, 0, 0.2, 1.0, 0.3) == at(tables, 0, 0.2, 1e4, 0.3)


def test_the_union_of_nodes_loses_nothing():
    ice, nodes = NAMED_SURFACES["ice"], (np.array([1e4]), np.array([0, 0.03, 0.25]), np.array([0, 0.15, 1.0]))
    one, other = small(), table_by_similarity(lambda k, _: ice[0](k), lambda k, _: ice[1](k), *nodes)
    both = stacked_tables([one, other])
    rng = np.random.default_rng(5)
    for angle, load, slip in rng.uniform((0, 5e3, 0), (0.5, 4e4, 1), (60, 3)):
        for number, table in enumerate((one, other)):
            # g and h lie between nodes of the union as between their own: equal to rounding
            assert at(both, number, angle, load, slip) == pytest.approx(
                at(stacked_tables([table]), 0, angle, load, slip), rel=1e-13, abs=1e-15
            )
            x, y = table.friction([angle], [slip], load)
            assert (x[0, 0], y[0, 0]) == pytest.approx(at(both, number, angle, load, slip), rel=1e-13, abs=1e-15)


def test_slopes_are_those_of_the_cell():
    tables = stacked_tables([small()])
    for low, high in ((0.0, 0.2), (0.2, 1.0)):
        ends = [at(tables, 0, 0.05, 1.5e4, slip)[0] for slip in (low, high)]
        inner = [at(tables, 0, 0.05, 1.5e4, low + share * (high - low))[0] for share in (0.1, 0.9)]
        assert (inner[1] - inner[0]) / 0.8 == pytest.approx(ends[1] - ends[0], rel=1e-12)


@pytest.mark.grounds("closed form")
def test_both_formulas_as_their_books_write_them():
    """Pacejka's with the bracket (1 - E) B k + E atan(B k), Burckhardt's with the exponential written out."""
    k = np.array([0.0, 0.01, 0.07, 0.3, 0.9, 1.7])
    D, B, C, E = 0.935, 8.86, 1.19, -1.21
    bracket = (1.0 - E) * B * k + E * np.arctan(B * k)
    assert MagicFormulaCurve(D, B, C, E)(k) == pytest.approx(D * np.sin(C * np.arctan(bracket)), rel=1e-13)
    least = np.array([0.0, 0.01, 0.07, 0.3, 0.9, 1.0])
    wanted = 0.857 * (1.0 - np.exp(-33.822 * least)) - 0.347 * least
    assert Burckhardt(0.857, 33.822, 0.347)(k) == pytest.approx(wanted, rel=1e-13)


@pytest.mark.grounds("closed form")
def test_nodes_grow_as_a_geometric_series():
    nodes = graded_nodes(2.0, 0.05, 31)
    assert nodes + 0.05 == pytest.approx(0.05 * 41.0 ** (np.arange(31) / 30.0), rel=1e-13)


@pytest.mark.grounds("closed form")
def test_friction_across_as_a_product_by_least_squares():
    """g is the slope of the best line through the origin, over the loads, of mu_y by h; h is mu_y without slip."""
    mu = np.random.default_rng(4).uniform(0.1, 1.0, (3, 4, 5))
    g, h = product_factors(mu)
    assert np.array_equal(h, mu[:, :, 0]) and np.array_equal(g[0], g[1])
    for a in (1, 2):
        best = [np.linalg.lstsq(mu[a, :, :1], mu[a, :, k], rcond=None)[0][0] for k in range(5)]
        assert g[a] == pytest.approx(best, rel=1e-12)


@pytest.mark.grounds("closed form")
def test_towards_no_angle_a_table_has_the_slope_of_its_formula():
    """Across the wheel friction begins with the slope B C D; with a slip k it is mu(k) / k by it, to the angle's first
    order."""
    for name in ("dry", "ice/rear"):
        across, table = PACEJKA[name][1], table_of_surface(name)
        steepest = across.B * across.C * across.D
        assert table.cornering == pytest.approx(steepest, rel=2e-3)  # a secant over the first cell of angles
        assert table.g[0, 1:] == pytest.approx(across(table.slips[1:]) / table.slips[1:] / steepest, rel=1e-6)
        along = PACEJKA[name][0](table.slips)
        assert table.mu_x[0, 0] == pytest.approx(along, rel=1e-12)


def between(table, exact):
    """Largest distance (x, y) of a table from its curves between nodes, and its largest resultant."""
    angles = np.concatenate((np.linspace(0, 0.25, 181), np.linspace(0.26, np.pi / 2, 90)))
    slips = np.concatenate((np.linspace(0, 0.25, 173), np.linspace(0.26, 1, 61)))
    x, y = table.friction(angles, slips, 1e4)
    tangent = np.tan(angles)[:, None]
    total = np.maximum(np.hypot(slips, tangent), 1e-300)
    want_x, want_y = exact[0](total) * slips / total, exact[1](total) * tangent / total
    return np.abs(x - want_x).max(), np.abs(y - want_y).max(), np.hypot(x, y).max()


@pytest.mark.parametrize("name", PACEJKA)
@pytest.mark.grounds("closed form")
def test_magic_formulas_are_met_between_nodes_and_never_above_their_peak(name):
    table, curves = table_of_surface(name), PACEJKA[name]
    off_x, off_y, most = between(table, curves)
    assert off_x < 1e-4 and off_y < 1e-4  # of mu: what the nodes promise
    assert most <= max(curve.D for curve in curves)
    assert table.mu_x.max() == pytest.approx(curves[0].D, abs=1e-4)


@pytest.mark.grounds("closed form")
def test_one_curve_for_both_directions_is_not_above_its_peak():
    table = table_of_surface("dry asphalt")
    # nodes are capped at the peak; between them g times h bulges by 4e-6 of it
    assert between(table, NAMED_SURFACES["dry asphalt"])[2] <= table.mu_x.max() * (1 + 1e-5)
    x = table.friction([0.0], [0.17], 1e4)[0][0, 0]
    assert x == pytest.approx(1.2801 * (1 - np.exp(-23.99 * 0.17)) - 0.52 * 0.17, abs=1e-4)


@pytest.mark.grounds("closed form")
def test_friction_falls_with_the_load_as_asked():
    table = table_of_surface("dry", load=2e4, friction_loss=0.1)
    slips, angles = np.array([0.12]), np.array([0.1])
    x, y = (np.array([table.friction(angles, slips, load)[i][0, 0] for load in (5e3, 2e4, 3e4, 4e4)]) for i in (0, 1))
    assert x / x[1] == pytest.approx([1.075, 1.0, 0.95, 0.9], rel=1e-12)
    assert y / y[1] == pytest.approx([1.075, 1.0, 0.95, 0.9], rel=1e-12)
    half = table.scaled(0.5).friction(angles, slips, 3e4)
    assert (half[0][0, 0], half[1][0, 0]) == pytest.approx((x[2] / 2, y[2] / 2), rel=1e-12)


@pytest.mark.grounds("closed form")
def test_front_and_rear_differ():
    assert table_of_named_tyre("dry", is_rear=True).h.max() == pytest.approx(0.961, abs=1e-4)
    assert table_of_named_tyre("dry").mu_x.max() == pytest.approx(1.20, abs=1e-4) and table_of_named_tyre(
        "ice"
    ).h.max() == pytest.approx(0.162, abs=1e-4)
    assert table_of_surface("dry").h.max() == pytest.approx(0.935, abs=1e-4)
    assert table_of_surface("dry/rear").h.max() == pytest.approx(0.961, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"slips": np.array([0.0, 0.2, 0.9])}, "slips = 0.9"),
        ({"angles": np.array([0.0, 0.4, 0.1])}, "rise strictly"),
        ({"loads": np.array([0.0, 1.0])}, "loads"),
        ({"g": np.full((3, 3), np.nan)}, "g = nan"),
        ({"mu_x": np.full((3, 2, 3), 0.1)}, "at slip 0"),
        ({"h": np.full((3, 2), 0.1)}, "at slip angle 0"),
        ({"h": np.array([[0.0, 0.0], [0.7, 0.6], [0.65, 0.62]]) * 5}, "0 to 3"),
        ({"g": np.array([[1.0, 1.0, 1.0]] * 3)}, "slip angle 5.73 deg, load 10000 N, slip 0.2 = 0.86"),
    ],
)
def test_what_no_tyre_can_have_is_told(change, said):
    from dataclasses import replace

    with pytest.raises(InputError, match=said):
        replace(small(), **change)


def test_a_surface_that_is_none_is_told():
    with pytest.raises(InputError, match="did you mean 'snow'"):
        table_of_surface("snw")
    with pytest.raises(InputError, match="fall = 1"):
        table_of_surface("dry", friction_loss=1.0)
