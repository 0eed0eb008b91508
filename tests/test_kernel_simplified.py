"""The theory of 1983 as a compiled kernel: the package's numbers, a status where it has none, and FASTSIM's limit."""

import ctypes

import numpy as np
import pytest

from models.contact import kernel as k
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_approach
from models.contact.kernel_pointer import contact_pointer
from models.contact.kernel_simplified import distance_table
from models.contact.material import MaterialPair
from models.contact.simplified_theory import solve_normal_contact, solve_rolling_contact
from models.contact.undeformed_distance import from_function, quadratic
from models.core.errors import InputError

PAIR, SIZE = MaterialPair(), (-0.03, 0.03)
ELLIPSE = quadratic(1.1, 1.7, 0.03, 0.03, 61)
SHAPES = {
    "ellipse": ELLIPSE,
    "flattened": from_function(lambda x, y: 0.6 * x**2 + 3e3 * y**4 + 0.2 * y**2, SIZE, SIZE, 61),
    "leaning": from_function(lambda x, y: 1e-5 + (x**2 + y**2) * (1.3 + 25.0 * y), SIZE, SIZE, 61),
}


def solved(bodies, approach, mu, motion, cells=9, given=k.BY_APPROACH):
    how, outputs = contact_pointer(cells, bodies), np.empty(k.OUTPUT_COUNT)
    inputs = np.array([0.0, 0.0, approach, mu, *motion, PAIR.G, PAIR.nu])
    places = (array.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for array in (how.net, inputs, outputs))
    return how.call(given, *places), outputs.view(k.OUTPUT_RECORD)[0]


@pytest.mark.parametrize("name", SHAPES)
def test_numbers_are_those_of_the_package(name):
    bodies, rng = SHAPES[name], np.random.default_rng(3)
    for approach in (1.2e-5, 4e-5, 1.1e-4):
        motion = rng.normal(0.0, [2e-3, 2e-3, 0.5])
        pressed = solve_normal_contact(bodies, PAIR, approach=approach)
        rolled = solve_rolling_contact(pressed, 0.3, *motion, cell_count=9)
        status, out = solved(bodies, approach, 0.3, motion)
        assert status == k.FINE
        # both settle to 1e-11 or better, by different methods
        found = [out.fx, out.fy, out.load, 1e2 * out.mz]
        expected = [rolled.fx, rolled.fy, pressed.load, 1e2 * rolled.mz]
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * pressed.load)
        assert out.stick == pytest.approx(rolled.stick_share, abs=1e-9)
        x0, x1, y0, y1 = pressed.patches[0].box
        np.testing.assert_allclose([out.a, out.b], [(x1 - x0) / 2.0, (y1 - y0) / 2.0], rtol=1e-9)


def test_an_ellipse_is_near_to_fastsim():
    # two theories of one contact: loads 1 % apart, forces up to a tenth of mu N where part of it slips
    hertz, worst = by_approach(1.1, 1.7, 8e-5, PAIR), 0.0
    for motion in ((5e-4, 0.0, 0.0), (0.0, 1e-3, 0.0), (1e-3, 1e-3, 0.2), (0.0, 0.0, 0.5)):
        creep = fastsim(RollingEllipse(hertz.a, hertz.b, hertz.load, 0.3, *motion), PAIR, cells=21)
        status, out = solved(ELLIPSE, 8e-5, 0.3, motion, cells=21)
        assert status == k.FINE
        assert out.load == pytest.approx(hertz.load, rel=0.01)
        worst = max(worst, np.hypot(out.fx - creep.fx, out.fy - creep.fy) / (0.3 * hertz.load))
    assert 1e-3 < worst < 0.1


def test_full_sliding_is_friction():
    _, out = solved(ELLIPSE, 8e-5, 0.3, (0.5, 0.0, 0.0))
    assert out.fx == pytest.approx(-0.3 * out.load, rel=1e-9)
    assert out.stick == 0.0


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"given": k.BY_LOAD}, k.NOT_KNOWN),
        ({"approach": float("nan")}, k.NOT_FINITE),
        ({"approach": 2e-3}, k.NOT_PLAUSIBLE),
        ({"mu": -1.0}, k.NOT_PLAUSIBLE),
    ],
)
def test_a_status_where_there_is_no_answer(changed, expected):
    # at 2 mm the contact reaches the edge of the distance
    status, out = solved(ELLIPSE, **{"approach": 5e-5, "mu": 0.3, "motion": (1e-3, 0.0, 0.0), **changed})
    assert status == expected
    assert np.isnan(out.tolist()).all()


@pytest.mark.parametrize("approach", [-1e-3, 0.0, 1e-5, 1.0000001e-5])
def test_bodies_apart_and_all_but_apart(approach):
    status, out = solved(SHAPES["leaning"], approach, 0.3, (1e-3, 0.0, 0.0))
    assert status == k.FINE
    assert np.isfinite(out.tolist()).all()
    assert 0.0 <= out.load < 1.0
    assert abs(out.fx) <= 0.3 * out.load


def test_distances_that_are_none():
    two = from_function(lambda x, y: x**2 + 400.0 * (y**2 - 4e-4) ** 2, SIZE, SIZE, 61)
    with pytest.raises(InputError, match="2 valleys"):
        distance_table(two)
    with pytest.raises(InputError, match="cells"):
        distance_table(ELLIPSE, 2)
