"""FASTSIM's kernels and the contact kernel against plain Python, at random contacts of every shape, slip and option.

Each of these functions, 1 % off, fails here: the march and its sums, flexibilities and their blend, friction that
falls, derivatives, one call from Python, and the kernel that goes from curvatures to forces.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from models.contact import kernel as k
from models.contact.fastsim import FastsimEllipse as Call
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.fastsim_derivatives import creep_force_derivatives
from models.contact.fields import fastsim_fields
from models.contact.kernel_pointer import contact_pointer
from models.contact.linear_theory import fastsim_flexibilities, kalker_coefficients
from models.contact.material import STEEL, FallingFriction, Material, MaterialPair
from validation.contact import plain_fastsim as plain

pytestmark = pytest.mark.grounds("plain counterpart")
PAIR = MaterialPair(STEEL, Material(E=2.0e11, nu=0.29))
NAMES = ("a", "b", "load", "mu", "xi_x", "xi_y", "spin")
PROGRAMS = [
    plain.FastsimSettings(9, *each)
    for each in (
        ("intermediate", "blended", "second-order"),
        ("parabolic", "one", "second-order"),
        ("elliptic", "three", "second-order"),
        ("intermediate", "one", "plain"),
        ("elliptic", "blended", "plain"),
    )
]
CLOSE = 1e-12
"""Of mu N, and of mu N times the longer semi-axis: some thousand operations, each right to rounding."""


def named(program):
    return f"{program.bound}-{program.flexibilities}-{program.march}"


def drawn(seed, count, widest=30.0):
    """Contacts from slow creepage to full sliding, a/b from 1/widest to widest."""
    draw, ellipses = np.random.default_rng(seed), []
    for _ in range(count):
        ratio, size = widest ** draw.uniform(-1.0, 1.0), draw.uniform(3e-3, 8e-3)
        a, b, load, mu = size * ratio**0.5, size / ratio**0.5, draw.uniform(2e4, 1.2e5), draw.uniform(0.1, 0.6)
        c11, c22, c23, _ = plain.coefficients(ratio, PAIR.nu)
        most = 10.0 ** draw.uniform(-1.5, 1.0) * mu * load / (PAIR.G * size**2)
        motion = most * draw.normal(size=3) / (c11, c22, c23 * size)
        ellipses.append(plain.PlainEllipse(a, b, load, mu, *motion, plain.flexibilities(a, b, PAIR.G, PAIR.nu)))
    return ellipses


def given(ellipses):
    return RollingEllipse(*(np.array([getattr(each, name) for each in ellipses]) for name in NAMES))


def units(ellipse):
    return ellipse.mu * ellipse.load * np.array([1.0, 1.0, max(ellipse.a, ellipse.b)])


def options(program):
    return {name: getattr(program, name) for name in ("cells", "bound", "flexibilities", "march")}


@pytest.mark.parametrize("ratio", [1e-4, 0.03, 0.13, 0.85, 1.0, 3.7, 12.0, 34.0, 300.0])
@pytest.mark.parametrize("nu", [0.0, 0.1, 0.28, 0.5])
def test_coefficients(ratio, nu):
    computed = kalker_coefficients(ratio, nu)
    expected = plain.coefficients(ratio, nu)
    assert [computed.c11, computed.c22, computed.c23, computed.c33] == pytest.approx(expected, rel=1e-12)
    pair = MaterialPair(Material(E=2e11, nu=nu), Material(E=2e11, nu=nu))
    expected = plain.flexibilities(5e-3, 5e-3 / ratio, pair.G, nu)
    assert fastsim_flexibilities(5e-3, 5e-3 / ratio, pair) == pytest.approx(expected, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("program", PROGRAMS, ids=named)
def test_forces_of_many_contacts(program):
    """Contacts of several nets in one call; their strips fill more than one block of lanes."""
    ellipses = drawn(1, 8)
    computed = fastsim(given(ellipses), PAIR, **options(program))
    for i, ellipse in enumerate(ellipses):
        expected, _ = plain.fastsim(ellipse, program)
        forces = np.array([computed.fx[i], computed.fy[i], computed.mz[i]])
        assert np.abs((forces - expected[:3]) / units(ellipse)).max() <= CLOSE
        assert computed.stick[i] == pytest.approx(expected[3], abs=1e-12)


@pytest.mark.parametrize("program", [PROGRAMS[0], PROGRAMS[3]], ids=named)
def test_one_call_and_its_cells(program):
    for ellipse in drawn(2, 4):
        expected, tractions = plain.fastsim(ellipse, program)
        numbers = [getattr(ellipse, name) for name in NAMES]
        call = Call(ellipse.a / ellipse.b, PAIR, **options(program))
        assert np.abs((np.array(call(ellipse.a, *numbers[2:])) - expected[:3]) / units(ellipse)).max() <= CLOSE
        cells = fastsim_fields(RollingEllipse(*numbers), PAIR, **options(program))
        assert np.abs(cells.px + 1j * cells.py - tractions).max() <= CLOSE * np.abs(tractions).max()


def test_another_march_and_spin_of_the_other_sign_are_seen():
    """Faults of the kind that these tests are for: the march of 1982, and a sign."""
    ellipse = drawn(1, 1)[0]
    forces = [plain.fastsim(each, PROGRAMS[k])[0] for each, k in ((ellipse, 0), (ellipse, 3))]
    forces.append(plain.fastsim(replace(ellipse, spin=-ellipse.spin), PROGRAMS[0])[0])
    assert np.hypot(*(forces[1] - forces[0])[:2]) > 1e-3 * units(ellipse)[0]
    assert np.hypot(*(forces[2] - forces[0])[:2]) > 1e-2 * units(ellipse)[0]


def test_friction_that_falls():
    law = FallingFriction(floor=0.4, decay=0.6, speed=20.0)
    ellipses, program = drawn(3, 6), PROGRAMS[0]
    ellipses = [replace(each, xi_x=30.0 * each.xi_x) for each in ellipses]  # slip of up to some m/s
    computed = fastsim(given(ellipses), PAIR, cells=9, falling=law)
    shares = []
    for i, ellipse in enumerate(ellipses):
        expected, tractions = plain.fastsim(ellipse, program, lambda slip: 0.4 + 0.6 * math.exp(-0.6 * 20.0 * slip))
        forces = np.array([computed.fx[i], computed.fy[i], computed.mz[i]])
        assert np.abs((forces - expected[:3]) / units(ellipse)).max() <= CLOSE
        assert computed.stick[i] == pytest.approx(expected[3], abs=1e-12)
        cells = fastsim_fields(RollingEllipse(*(getattr(ellipse, name) for name in NAMES)), PAIR, cells=9, falling=law)
        assert np.abs(cells.px + 1j * cells.py - tractions).max() <= CLOSE * np.abs(tractions).max()
        shares.append(np.hypot(*forces[:2]) / units(ellipse)[0])
    assert min(shares) < 0.7  # the law takes part


@pytest.mark.parametrize("flexible", ["blended", "one"])
def test_derivatives_are_differences_of_the_plain_march(flexible):
    """By central differences; the contacts are drawn so that no cell begins to slip or stick within a step."""
    ellipses, step, program = drawn(4, 4, 4.0), 1e-6, plain.FastsimSettings(7, flexibilities=flexible)
    computed = creep_force_derivatives(given(ellipses), PAIR, cells=7, flexibilities=flexible)
    for i, ellipse in enumerate(ellipses):
        assert np.abs((computed.forces[i] - plain.fastsim(ellipse, program)[0][:3]) / units(ellipse)).max() <= CLOSE
        scale = np.abs([ellipse.xi_x, ellipse.xi_y, ellipse.spin, ellipse.load])
        for j, name in enumerate(("xi_x", "xi_y", "spin", "load")):
            ends = []
            for sign in (1.0, -1.0):
                moved = replace(ellipse, **{name: getattr(ellipse, name) + sign * step * scale[j]})
                if name == "load":  # Hertz: the axes grow as the cube root, the flexibilities with them
                    grown = (moved.load / ellipse.load) ** (1.0 / 3.0)
                    longer = tuple(grown * each for each in ellipse.flexible)
                    moved = replace(moved, a=grown * ellipse.a, b=grown * ellipse.b, flexible=longer)
                ends.append(plain.fastsim(moved, program)[0][:3])
            slope = (ends[0] - ends[1]) / (2.0 * step)
            off = np.abs(slope - computed.slopes[i, :, j] * scale[j]) / units(ellipse)
            assert off.max() <= 1e-7, (i, name)  # rounding by the step, 1e-9, and its square times curvatures of 1e3


def called(how, kind, values):
    """Status and outputs of the kernel as a C function."""
    inputs, outputs = np.array([*values, PAIR.G, PAIR.nu]), np.empty(k.OUTPUT_COUNT)
    doubles = how.call.argtypes[1]
    status = how.call(kind, *(array.ctypes.data_as(doubles) for array in (how.net, inputs, outputs)))
    return status, outputs


@pytest.mark.parametrize("cells", [0, 9])
def test_the_kernel_from_curvatures_to_forces(cells):
    """All four ways to give the ellipse; without cells the linear theory."""
    draw, how, elastic = np.random.default_rng(5), contact_pointer(cells), PAIR.G / (1.0 - PAIR.nu)
    for ellipse in drawn(6, 4):
        small, large = sorted(10.0 ** draw.uniform(-1.0, 1.5, 2))
        major, minor, approach = plain.hertz_ellipse(small, large, elastic, ellipse.load)
        a, b = (major, minor) if draw.random() < 0.5 else (minor, major)
        A, B = (small, large) if a > b else (large, small)
        flexible = plain.flexibilities(a, b, PAIR.G, PAIR.nu)
        grown = (ellipse.a * ellipse.b / (a * b)) ** 0.5
        motion = ellipse.xi_x * grown**2, ellipse.xi_y * grown**2, ellipse.spin * grown**3
        ellipse = plain.PlainEllipse(a, b, ellipse.load, ellipse.mu, *motion, flexible)
        expected = plain.fastsim(ellipse, plain.FastsimSettings(cells))[0] if cells else linear(ellipse)
        unit = units(ellipse) * max(1.0, np.abs(expected[:3] / units(ellipse)).max())
        shapes = (A, B, ellipse.load), (A, B, approach), (a, b, ellipse.load), (a, b, approach)
        for kind, shape in enumerate(shapes):
            status, out = called(how, kind, (*shape, ellipse.mu, *motion))
            assert status == k.FINE
            assert np.abs((out[:3] - expected[:3]) / unit).max() <= 1e-8
            assert out[3:7] == pytest.approx([a, b, approach, ellipse.load], rel=1e-10)
            assert out[7] == pytest.approx(expected[3], abs=1e-12)


def linear(ellipse):
    """Kalker 1967, all of the area sticking."""
    c11, c22, c23, c33 = plain.coefficients(ellipse.a / ellipse.b, PAIR.nu)
    matrix = [
        [c11, 0, 0],
        [0, c22, c23 * ellipse.mean_semi_axis],
        [0, -c23 * ellipse.mean_semi_axis, c33 * ellipse.mean_semi_axis**2],
    ]
    forces = -PAIR.G * ellipse.mean_semi_axis**2 * np.array(matrix) @ [ellipse.xi_x, ellipse.xi_y, ellipse.spin]
    return np.append(forces, 1.0)
