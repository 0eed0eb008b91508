"""FASTSIM: signs and units, limits, laws that always hold, refusals; ``test_plain_fastsim`` judges its numbers."""

import math

import numpy as np
import pytest

from models.contact import hertz
from models.contact.fastsim import FastsimEllipse, RollingEllipse, fastsim
from models.contact.fastsim_derivatives import creep_force_derivatives
from models.contact.fastsim_grid import POWERS, ellipse_grid
from models.contact.fields import fastsim_fields
from models.contact.linear_theory import fastsim_flexibilities, kalker_coefficients
from models.contact.material import FallingFriction, MaterialPair
from models.core.errors import InputError
from validation.cases import fastsim as case
from validation.contact.fuzzed_creepage import COMPUTED_OPTIONS, moment_bound, random_contacts, worst_violation

PAIR = MaterialPair()
AT = {"a": 6e-3, "b": 4e-3, "load": 80e3, "mu": 0.3, "xi_x": 1e-3, "xi_y": -5e-4, "spin": 0.3}
STREAM = 500
"""Of the tests: the case draws from streams 0 and 100 on."""


def test_signs():
    """Forces oppose creepage; spin to the left pushes to the right as the linear theory has it: Fy = -C23 spin."""
    still = {**AT, "xi_x": 0.0, "xi_y": 0.0, "spin": 0.0}
    assert fastsim(RollingEllipse(**{**still, "xi_x": 1e-4}), PAIR).fx < 0
    aside = fastsim(RollingEllipse(**{**still, "xi_y": 1e-4}), PAIR)
    assert aside.fy < 0 < aside.mz
    turned = fastsim(RollingEllipse(**{**still, "spin": 0.1}), PAIR)
    assert turned.fy < 0 and turned.mz < 0 and abs(turned.fx) < 1e-9


def test_eight_times_the_load_doubles_the_radius():
    small, large = (hertz.by_load(1.1, 1.1, load, PAIR) for load in (1e4, 8e4))
    assert large.a == pytest.approx(2 * small.a, rel=1e-12)
    ellipses = [RollingEllipse(h.a, h.b, h.load, 0.3, s * 1e-3, 0.0, 0.2) for h, s in ((small, 1), (large, 2))]
    forces = [fastsim(ellipse, PAIR) for ellipse in ellipses]
    assert forces[1].fx == pytest.approx(8 * forces[0].fx, rel=1e-12)


def test_a_call_is_the_function():
    one = FastsimEllipse(AT["a"] / AT["b"], PAIR)
    found = fastsim(RollingEllipse(**AT), PAIR)
    values = [AT[name] for name in ("a", "load", "mu", "xi_x", "xi_y", "spin")]
    assert one(*values) == pytest.approx((found.fx, found.fy, found.mz), rel=1e-12)
    for place, bad in ((0, 0.0), (1, math.nan), (2, -0.1), (4, math.inf)):
        with pytest.raises(InputError):
            one(*values[:place], bad, *values[place + 1 :])


def test_many_are_as_they_are_alone():
    """Contacts of several shapes, whose strips share a block of lanes."""
    given = case.creepage_contacts(("x", "y-spin"), (0.3, 2.0))
    together = fastsim(RollingEllipse(**given), PAIR)
    for i in range(len(given["a"])):
        alone = fastsim(RollingEllipse(**{name: values[i] for name, values in given.items()}), PAIR)
        assert together.fx[i] == pytest.approx(alone.fx, rel=1e-12, abs=1e-9)
        assert together.mz[i] == pytest.approx(alone.mz, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("load", [0.0, -5.0])
def test_no_load_no_force(load):
    found = fastsim(RollingEllipse(**{**AT, "load": load, "a": 0.0, "b": 0.0}), PAIR)
    assert (found.fx, found.fy, found.mz, found.dissipation, found.wear_number) == (0.0,) * 5
    assert not creep_force_derivatives(RollingEllipse(**{**AT, "load": load}), PAIR).slopes.any()


def test_without_creepage_the_slopes_are_those_of_the_linear_theory_and_of_the_bed():
    """Forces by C11, C22 and C23; the moment is that of the bed's tractions, linear along every strip."""
    still = {**AT, "xi_x": 0.0, "xi_y": 0.0, "spin": 0.0}
    found = creep_force_derivatives(RollingEllipse(**still), PAIR)
    assert not found.forces.any() and np.isfinite(found.slopes).all()
    c, ab, (_, l2, l3) = kalker_coefficients(1.5, PAIR.nu), 24e-6, fastsim_flexibilities(AT["a"], AT["b"], PAIR)
    # 21 cells: 0.4 %
    assert found.slopes[0, 0] == pytest.approx(-PAIR.G * ab * c.c11, rel=4e-3)
    assert found.slopes[1, 1] == pytest.approx(-PAIR.G * ab * c.c22, rel=4e-3)
    assert found.slopes[1, 2] == pytest.approx(-PAIR.G * ab**1.5 * c.c23, rel=4e-3)
    assert found.slopes[2, 1] == pytest.approx(math.pi / 4 * AT["a"] ** 2 * ab / l2, rel=4e-3)
    assert found.slopes[2, 2] == pytest.approx(-8 / 15 * ab**2 * AT["b"] / l3, rel=6e-3)  # and 24 strips


@pytest.mark.parametrize(
    "options", [{}, *COMPUTED_OPTIONS, {"falling": FallingFriction(floor=0.4, decay=0.6, speed=20.0)}]
)
def test_the_moment_is_that_of_the_tractions(options):
    """Of every bound, march and kind of flexibility, cell by cell."""
    for scale in (0.1, 1.0, 10.0):
        given = RollingEllipse(**{**AT, **{name: scale * AT[name] for name in ("xi_x", "xi_y", "spin")}})
        found, cells = fastsim(given, PAIR, **options), fastsim_fields(given, PAIR, **options)
        area = cells.dx * cells.dy
        moment = np.sum((cells.x * cells.py - cells.y * cells.px) * area)
        assert found.fx == pytest.approx(np.sum(cells.px * area), rel=1e-11)
        assert abs(found.mz - moment) <= 1e-12 * 24e3 * AT["a"]


def test_the_moment_reaches_the_limit_of_friction_and_no_more():
    """Pure spin that slides all over: 3 pi / 16 mu N a by Hertz's pressure on a circle, 8 / 15 by a parabola."""
    round_patch = {"a": np.full(1, 5e-3), "b": np.full(1, 5e-3), "load": np.full(1, 8e4), "mu": np.full(1, 0.3)}
    for bound, share in (("elliptic", 3 * math.pi / 16), ("parabolic", 8 / 15)):
        most = moment_bound(round_patch, 81, bound)
        assert most == pytest.approx(share * 120, rel=5e-4)
        turning = RollingEllipse(5e-3, 5e-3, 8e4, 0.3, 0.0, 0.0, -1e3)
        spun = fastsim(turning, PAIR, cells=81, bound=bound, flexibilities="one")
        assert (1 - 2e-3) * most <= spun.mz <= (1 + 1e-12) * most


@pytest.mark.parametrize("growing", [True, False])
@pytest.mark.parametrize("kind", ["blended", "one", "three"])
def test_derivatives_are_those_of_the_march(kind, growing):
    given = case.creepage_contacts(tuple(case.CREEPAGE_KINDS), (0.2, 2.0))
    own = (
        creep_force_derivatives(RollingEllipse(**given), PAIR, flexibilities=kind, axes_grow_with_load=growing).slopes[
            ..., 3
        ]
        * case.NORMAL_LOAD
    )
    ends = []
    for share in (1e-6, -1e-6):
        grown = (1 + share) ** (1 / 3) if growing else 1.0
        moved = {**given, "load": given["load"] * (1 + share), "a": given["a"] * grown, "b": given["b"] * grown}
        found = fastsim(RollingEllipse(**moved), PAIR, flexibilities=kind)
        ends.append(np.stack([found.fx, found.fy, found.mz], axis=1))
    off = np.abs((ends[0] - ends[1]) / 2e-6 - own) / case.FORCE_SCALES
    assert np.quantile(off.max(axis=1), 0.95) < 1e-7


def test_falling_friction():
    given = {**AT, "xi_x": 0.05, "xi_y": 0.0, "spin": 0.0}
    law = FallingFriction(floor=0.4, decay=0.6, speed=20.0)
    # all slides at 1 m/s: mu (0.4 + 0.6 exp(-0.6))
    expected = -0.3 * 80e3 * (0.4 + 0.6 * math.exp(-0.6))
    assert fastsim(RollingEllipse(**given), PAIR, falling=law).fx == pytest.approx(expected, rel=1e-9)
    none = fastsim(RollingEllipse(**AT), PAIR, falling=FallingFriction(floor=1.0, decay=1.0, speed=20.0))
    assert none.fx == pytest.approx(fastsim(RollingEllipse(**AT), PAIR).fx, rel=1e-12)


@pytest.mark.parametrize("options", COMPUTED_OPTIONS[:4])
def test_invariants_of_random_contacts(options):
    found = worst_violation(random_contacts(case.SEED, STREAM, 2000), options, PAIR)
    assert max(value for name, value in found.items() if name != "power") <= 1e-12
    assert found["power"] <= (1e-5 if options.get("cells", 21) < 20 else 1e-12)


def test_a_call_takes_whole_numbers_and_names_what_it_does_not_take():
    call = FastsimEllipse(1.5, PAIR)
    assert call(6e-3, 80_000, 0.3, np.float32(0.5), 0, 0) == call(6e-3, 8e4, 0.3, 0.5, 0.0, 0.0)
    for value in ("much", [1e-3], None, math.nan):
        with pytest.raises(InputError, match="xi_y = "):
            call(6e-3, 8e4, 0.3, 0.0, value, 0.0)


@pytest.mark.parametrize(("name", "value"), [("load", 1e-310), ("mu", 1e-300), ("mu", 1e-80)])
def test_next_to_nothing_is_nothing(name, value):
    """A slip by so small a bound, squared, would be beyond all numbers."""
    assert fastsim(RollingEllipse(**{**AT, name: value}), PAIR).fx == 0.0
    assert FastsimEllipse(1.5, PAIR)(6e-3, 1e-310, 0.3, 0.1, 0.1, 1.0)[0] == 0.0
    assert fastsim(RollingEllipse(**{**AT, "xi_x": 1.0}), PAIR).stick == 0.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("a", -1e-3),
        ("a", 600.0),
        ("b", math.nan),
        ("load", math.inf),
        ("mu", -0.1),
        ("mu", 30.0),
        ("xi_x", math.nan),
        ("xi_x", 50.0),
        ("spin", math.inf),
        ("a", 0.0),
        ("xi_y", [1e-3, 2e-3]),
        ("xi_x", "much"),
    ],
)
def test_bad_input_is_named(name, value):
    with pytest.raises(InputError, match=name):
        fastsim(RollingEllipse(**{**AT, "xi_x": [0.0, 1e-3, 2e-3], name: value}), PAIR)


@pytest.mark.parametrize(
    "options", [{"cells": 2}, {"cells": 21.0}, {"bound": "round"}, {"march": "third"}, {"flexibilities": "two"}]
)
def test_an_unknown_option_is_named(options):
    with pytest.raises(InputError, match=next(iter(options))):
        fastsim(RollingEllipse(**AT), PAIR, **options)


@pytest.mark.parametrize("bound", list(POWERS))
def test_the_pressure_of_the_cells_is_the_load(bound):
    strips, cells = ellipse_grid(21, 36, bound).records
    assert strips.part.sum() * cells.bound.sum() == pytest.approx(1.0, rel=1e-14)


def test_every_row_of_the_case_passes(tmp_path):
    rows, data = case.measure(True, tmp_path)
    assert [row.id for row in rows if row.status == "failed"] == []
    assert case.tables(data) and case.draw(data)
