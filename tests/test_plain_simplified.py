"""Kalker's theory of 1983 against plain Python, from the distance's nodes to the forces; loads of other patches.

The bodies are smooth ones of which the bottom is known: it lies in a node, or the distance is a quadratic one.
"""

import ctypes
from functools import cache

import numpy as np
import pytest

from models.contact import kernel as k
from models.contact.distance_kernels import least_value_of_row
from models.contact.kernel_pointer import ContactPointer, contact_pointer
from models.contact.kernel_simplified import distance_table
from models.contact.material import MaterialPair
from models.contact.patches import Patch
from models.contact.simplified_kernels import (
    FineGrid,
    coarse_tractions,
    covariances,
    normal_displacement_sums,
    slope_products,
    tangential_displacement_sums,
)
from models.contact.simplified_theory import SimplifiedOptions, solve_normal_contact, solve_rolling_contact
from models.contact.undeformed_distance import from_arrays
from validation.contact import plain_simplified as plain

pytestmark = pytest.mark.grounds("plain counterpart")
PAIR, MU, CELLS, APPROACH = MaterialPair(), 0.3, 9, 6e-5
X, Y = np.linspace(-0.028, 0.03, 59), np.linspace(-0.03, 0.026, 57)
CLOSE = 1e-8
"""Of load and mu N: the approach is met to 1e-11, roots of splines to 1e-12."""
MOTIONS = ((6e-4, -4e-4, 0.15), (-2e-3, 1e-3, -0.6))
"""The first sticks in part, the second slides and turns."""
HEIGHTS = {
    "leaning": (lambda x, y: 1e-5 + 1.1 * (x - 3e-4) ** 2 + 1.9 * (y + 2e-4) ** 2, (3e-4, -2e-4)),
    "uneven": (
        lambda x, y: 0.9 * x**2 + 900.0 * x**4 + 0.8 * y**2 + 300.0 * np.maximum(y - 3e-3, 0.0) ** 3,
        (0.0, 0.0),
    ),
}
OPTIONS = (SimplifiedOptions(), SimplifiedOptions(net=9, shape="parabolic", fit="gradient"))


@cache
def bodies(name):
    """The package's distance and the plain one."""
    height, bottom = HEIGHTS[name]
    heights = height(X[None, :], Y[:, None])
    return from_arrays(X, Y, heights), plain.PlainBodies(X, Y, heights, bottom)


@cache
def expected(name, options):
    """The plain patch at the approach, and what comes out of both motions."""
    pressed = plain.patch_at_approach(bodies(name)[1], APPROACH, PAIR, options)
    return pressed, [plain.roll(bodies(name)[1], pressed, MU, motion, PAIR, CELLS, options) for motion in MOTIONS]


@pytest.mark.parametrize("name", HEIGHTS)
def test_distances_between_the_nodes(name):
    """Values anywhere, the least on each line and where it lies, the rectangle about a depth."""
    distance, counterpart = bodies(name)
    x, y = np.random.default_rng(1).uniform(-0.02, 0.02, (2, 20))
    values = [float(counterpart.line(v)(u)) for u, v in zip(x, y, strict=True)]
    assert distance.at(x, y) == pytest.approx(values, rel=1e-10)
    valleys = (distance.valley_x, distance.valley_y)
    for (lines, least, _), (places, roots), bottom in zip(
        valleys, counterpart.valleys, counterpart.bottom, strict=True
    ):
        own = np.delete(roots, np.searchsorted(lines, bottom, side="right"))  # without the line through the bottom
        assert places.size == lines.size + 1
        assert np.sqrt(np.maximum(least - counterpart.low, 0.0)) == pytest.approx(own, abs=1e-9)
    assert Patch(distance).box(5e-5) == pytest.approx(counterpart.box(5e-5), rel=1e-9)


def test_the_least_of_a_row_and_its_place():
    row = np.random.default_rng(2).normal(size=20)
    line = plain.hermite_spline(np.arange(18.0), row)
    turning = line.derivative().roots(extrapolate=False)
    places = np.append(turning, line.x)
    k = np.argmin(line(places))
    assert least_value_of_row(row) == pytest.approx((float(line(places[k])), places[k]), rel=1e-10)


@pytest.mark.parametrize("options", OPTIONS, ids=lambda each: each.fit)
@pytest.mark.parametrize("name", HEIGHTS)
def test_load_and_forces_of_the_package(name, options):
    pressed = solve_normal_contact(bodies(name)[0], PAIR, approach=APPROACH, simplified_options=options)
    truth, rolled = expected(name, options)
    assert pressed.load == pytest.approx(truth.load, rel=CLOSE)
    assert pressed.patches[0].stiffness == pytest.approx(truth.stiffness, rel=CLOSE)
    by_load = solve_normal_contact(bodies(name)[0], PAIR, load=truth.load, simplified_options=options)
    assert by_load.approach == pytest.approx(APPROACH, rel=CLOSE)
    for motion, (forces, flexibility) in zip(MOTIONS, rolled, strict=True):
        computed = solve_rolling_contact(pressed, MU, *motion, cell_count=CELLS)
        unit = MU * truth.load * np.array([1.0, 1.0, 5e-3])
        assert np.abs((np.array([computed.fx, computed.fy, computed.mz]) - forces[:3]) / unit).max() <= CLOSE
        assert computed.stick_share == pytest.approx(forces[3], abs=1e-9)
        assert computed.flexibilities[0] == pytest.approx(flexibility, rel=CLOSE, abs=0.0)


@pytest.mark.parametrize("options", OPTIONS, ids=lambda each: each.fit)
@pytest.mark.parametrize("name", HEIGHTS)
def test_load_and_forces_of_the_kernel(name, options):
    how = ContactPointer(
        contact_pointer(0).address, distance_table(bodies(name)[0], CELLS, options), contact_pointer(0).call
    )
    truth, rolled = expected(name, options)
    for motion, (forces, _) in zip(MOTIONS, rolled, strict=True):
        inputs = np.array([0.0, 0.0, APPROACH, MU, *motion, PAIR.G, PAIR.nu])
        outputs = np.empty(k.OUTPUT_COUNT)
        doubles = ctypes.POINTER(ctypes.c_double)
        places = (array.ctypes.data_as(doubles) for array in (how.net, inputs, outputs))
        assert how.call(k.BY_APPROACH, *places) == k.FINE
        out = outputs.view(k.OUTPUT_RECORD)[0]
        unit = MU * truth.load * np.array([1.0, 1.0, 5e-3])
        assert np.abs((outputs[:3] - forces[:3]) / unit).max() <= CLOSE
        x0, x1, y0, y1 = truth.box
        assert [out.a, out.b, out.approach, out.load] == pytest.approx(
            [(x1 - x0) / 2.0, (y1 - y0) / 2.0, APPROACH, truth.load], rel=CLOSE
        )
        assert out.stick == pytest.approx(forces[3], abs=1e-9)


def test_sums_of_the_fits():
    """A factor common to both sums of a fit would leave its slope; numpy tells each sum."""
    u, h, cover = np.random.default_rng(4).uniform(0.2, 1.0, (3, 5, 5))
    spread = np.cov(u.ravel(), h.ravel(), aweights=cover.ravel(), ddof=0) * cover.sum()
    mean = np.average(u, weights=cover)
    assert covariances(u, h, cover) == pytest.approx((mean, spread[0, 1], spread[0, 0]), rel=1e-12)
    products, squares = np.zeros(2), np.zeros(2)
    for axis, step in ((1, 0.3), (0, 0.7)):
        first, second = (np.delete(cover, place, axis) for place in (-1, 0))
        du, dh = (np.diff(each, axis=axis) / step for each in (u, h))
        products[axis], squares[axis] = np.sum(first * second * du * dh), np.sum(first * second * du**2)
    assert slope_products(u, h, cover, 0.3, 0.7, False) == pytest.approx((products[1], squares[1]), rel=1e-12)
    assert slope_products(u, h, cover, 0.3, 0.7, True) == pytest.approx((products.sum(), squares.sum()), rel=1e-12)


def test_tractions_of_the_meshes():
    """By the areas in common; a factor common to all of them would leave the fit."""
    draw, box = np.random.default_rng(6), (-4e-3, 5e-3, -3e-3, 3e-3)
    low, high = draw.uniform(-4e-3, 0.0, 7), draw.uniform(1e-3, 5e-3, 7)
    net = plain.interval_midpoints(*box[2:], 7), low, high, 6e-3 / 7, np.ones((7, 6))
    tractions = draw.normal(size=(7, 6, 2))
    expected = plain.mean_tractions(plain.Strips(*net), tractions[..., 0] + 1j * tractions[..., 1], box, 5)
    assert coarse_tractions(FineGrid(*net), tractions, box, 5) == pytest.approx(expected, rel=1e-10, abs=1e-14)


def test_loads_press_and_drag_the_surface_beside_them():
    """Boussinesq and Cerruti: u = F / r and ((1 - nu) F + nu (F.e) e) / r, e from the load to the place."""
    draw = np.random.default_rng(3)
    loads, places = draw.uniform(-1.0, 1.0, (2, 5)), draw.uniform(2.0, 4.0, (2, 7))
    force, both = draw.uniform(0.5, 1.0, 5), draw.normal(size=(2, 5))
    away = places[:, :, None] - loads[:, None, :]
    r = np.linalg.norm(away, axis=0)
    assert normal_displacement_sums(*loads, force, *places) == pytest.approx((force / r).sum(axis=1), rel=1e-12)
    unit = away / r
    dragged = ((1.0 - PAIR.nu) * both[:, None] + PAIR.nu * unit * np.einsum("ipl,il->pl", unit, both)) / r
    assert tangential_displacement_sums(*loads, both, *places, PAIR.nu) == pytest.approx(dragged.sum(axis=2), rel=1e-12)
