"""The contact kernel as a C function: its numbers, what it refuses, and that C can call it."""

import ctypes
import shutil
import subprocess
import threading

import numpy as np
import pytest
from numba.core.runtime import _nrt_python as nrt
from numba.core.runtime import rtsys

from models.contact import kernel as k
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_approach, by_load
from models.contact.kernel_pointer import C_EXAMPLE_PATH, C_HEADER_PATH, ContactPointer, contact_pointer
from models.contact.linear_theory import linear_creep_forces
from models.contact.material import STEEL, Material, MaterialPair
from models.core.errors import InputError

PAIR = MaterialPair(STEEL, Material(E=2.0e11, nu=0.29))
GOOD = (1.1, 1.7, 8e4, 0.3, 1e-3, -5e-4, 0.3)
DOUBLES = ctypes.POINTER(ctypes.c_double)


def call(
    how: ContactPointer, given: int, values: tuple[float, ...], pair: MaterialPair = PAIR
) -> tuple[int, np.ndarray]:
    inputs, outputs = np.array([*values, pair.G, pair.nu]), np.full(k.OUTPUT_COUNT, 7.0)
    status = how.call(given, *(array.ctypes.data_as(DOUBLES) for array in (how.net, inputs, outputs)))
    return status, outputs


@pytest.mark.parametrize("cells", [3, 11, 21, 40])
def test_numbers_are_those_of_the_package(cells):
    rng, how = np.random.default_rng(cells), contact_pointer(cells)
    for _ in range(40):
        A, B, load = *10 ** rng.uniform(-1.5, 2.5, 2), 10 ** rng.uniform(-3.0, 5.5)
        mu, motion = rng.uniform(0.01, 0.6), (*rng.normal(0.0, 3e-3, 2), rng.normal(0.0, 0.5))
        hertz = by_load(A, B, load, PAIR)
        creep = fastsim(RollingEllipse(hertz.a, hertz.b, load, mu, *motion), PAIR, cells=cells)
        inputs = {
            k.BY_LOAD: (A, B, load),
            k.BY_APPROACH: (A, B, hertz.approach),
            k.AXES_BY_LOAD: (hertz.a, hertz.b, load),
            k.AXES_BY_APPROACH: (hertz.a, hertz.b, hertz.approach),
        }
        for given, shape in inputs.items():
            status, out = call(how, given, (*shape, mu, *motion))
            assert status == k.FINE
            unit = mu * load * np.array([1.0, 1.0, max(hertz.a, hertz.b)])
            # the same operations but for the order in which axes, load and approach follow from one another
            np.testing.assert_allclose(out[:3] / unit, np.array([creep.fx, creep.fy, creep.mz]) / unit, atol=1e-13)
            np.testing.assert_allclose(out[3:7], [hertz.a, hertz.b, hertz.approach, load], rtol=1e-13)
            share = out.view(k.OUTPUT_RECORD)[0].stick
            assert share == pytest.approx(creep.stick, abs=1.0 / cells**2 if given else 1e-12)


def test_zero_cells_are_the_linear_theory():
    assert contact_pointer(0).net.dtype == float
    status, out = call(contact_pointer(0), k.BY_APPROACH, (1.1, 1.7, 5e-5, *GOOD[3:]))
    hertz = by_approach(1.1, 1.7, 5e-5, PAIR)
    assert status == k.FINE
    np.testing.assert_allclose(out[:3], linear_creep_forces(hertz.a, hertz.b, *GOOD[4:], PAIR), rtol=1e-13)


@pytest.mark.parametrize("given", range(4))
@pytest.mark.parametrize("pressing", [0.0, -0.0, -1e-6, -1e9])
def test_nothing_presses_and_nothing_comes_out(given, pressing):
    status, out = call(contact_pointer(), given, (1.1, 1.7, pressing, *GOOD[3:]))
    assert status == k.FINE
    assert (out == 0.0).all()


def test_without_friction_there_is_pressure_alone():
    status, out = call(contact_pointer(), k.BY_LOAD, (*GOOD[:3], 0.0, *GOOD[4:]))
    assert status == k.FINE
    assert (out[:3] == 0.0).all()
    assert out.view(k.OUTPUT_RECORD)[0].load == GOOD[2]


@pytest.mark.parametrize("place", range(7))
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_refused(place, bad):
    for given in range(4):
        for pressing in (GOOD[2], -1.0):  # a gap does not hide it
            values = [*GOOD[:2], pressing, *GOOD[3:]]
            values[place] = bad
            status, out = call(contact_pointer(), given, tuple(values))
            assert status == k.NOT_FINITE
            assert np.isnan(out).all()


@pytest.mark.parametrize(
    ("given", "place", "value"),
    [
        (k.BY_LOAD, 0, 0.0),
        (k.BY_LOAD, 1, -1.0),
        (k.BY_LOAD, 2, 1e11),
        (k.BY_APPROACH, 2, 0.06),
        (k.BY_LOAD, 3, -0.1),
        (k.BY_LOAD, 3, 11.0),
        (k.BY_LOAD, 4, 11.0),
        (k.BY_LOAD, 5, -11.0),
        (k.BY_LOAD, 6, 2e9),
        (k.BY_LOAD, 0, 1e-300),
        (k.AXES_BY_LOAD, 0, 0.0),
        (k.AXES_BY_LOAD, 0, 2e3),
        (k.AXES_BY_APPROACH, 1, -1e-3),
        (k.BY_LOAD, 0, 1e13),
    ],
)
def test_what_is_out_of_range_is_refused(given, place, value):
    values = [*((5e-3, 4e-3) if given >= k.AXES_BY_LOAD else GOOD[:2]), 1e-5 if given % 2 else GOOD[2], *GOOD[3:]]
    values[place] = value
    status, out = call(contact_pointer(), given, tuple(values))
    assert status == k.NOT_PLAUSIBLE
    assert np.isnan(out).all()
    assert call(contact_pointer(), 4, GOOD)[0] == call(contact_pointer(), -1, GOOD)[0] == k.NOT_KNOWN


@pytest.mark.parametrize("cells", [2, -1, 2.5, True, 10**6])
def test_a_number_of_cells_that_is_none(cells):
    with pytest.raises(InputError, match="cells"):
        contact_pointer(cells)


def test_nothing_is_allocated_and_threads_agree():
    how, runs = contact_pointer(), [[], []]
    motions = [(*GOOD[:4], 1e-3 * np.sin(i), 1e-3 * np.cos(i), 0.01 * i) for i in range(300)]
    nrt.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    threads = [
        threading.Thread(target=lambda own=own: own.extend(call(how, k.BY_LOAD, m)[1] for m in motions)) for own in runs
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    after = rtsys.get_allocation_stats()
    nrt.memsys_disable_stats()
    assert (after.alloc, after.mi_alloc) == (before.alloc, before.mi_alloc)
    alone = np.array([call(how, k.BY_LOAD, m)[1] for m in motions])
    assert all(np.array_equal(np.array(run), alone) for run in runs)


def test_header_says_what_the_kernel_does():
    text = C_HEADER_PATH.read_text()
    words = {
        "BY_LOAD": k.BY_LOAD,
        "BY_APPROACH": k.BY_APPROACH,
        "AXES_BY_LOAD": k.AXES_BY_LOAD,
        "FINE": k.FINE,
        "AXES_BY_APPROACH": k.AXES_BY_APPROACH,
        "NOT_FINITE": k.NOT_FINITE,
        "NOT_PLAUSIBLE": k.NOT_PLAUSIBLE,
        "NOT_KNOWN": k.NOT_KNOWN,
    }
    assert all(f"TWINRIG_{word} = {number}" in text for word, number in words.items())


def test_c_program_calls_the_kernel(tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler here")
    library = tmp_path / "example.so"
    subprocess.run(
        [
            compiler,
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-O2",
            "-shared",
            "-fPIC",
            "-o",
            library,
            C_EXAMPLE_PATH,
            "-lm",
        ],
        check=True,
        timeout=60,
    )
    creepage_for = ctypes.CDLL(str(library)).creepage_for
    creepage_for.restype = ctypes.c_double
    creepage_for.argtypes = [ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_double] * 3]
    how, load, mu, force = contact_pointer(), 8e4, 0.3, 15e3
    found = creepage_for(how.address, how.net_address, load, mu, force)
    shear = MaterialPair(Material(E=82.03e9 * 2.56, nu=0.28), Material(E=82.03e9 * 2.56, nu=0.28))
    hertz = by_load(0.5 / 0.46, 0.5 / 0.3, load, shear)
    # sixty halvings of 0.1 end at the last digit of the creepage
    ellipse = RollingEllipse(hertz.a, hertz.b, load, mu, 0.0, found, 0.0)
    assert fastsim(ellipse, shear).fy == pytest.approx(-force, rel=1e-12)
    assert np.isnan(creepage_for(how.address, how.net_address, load, mu, 1.01 * mu * load))
    assert np.isnan(creepage_for(how.address, how.net_address, float("nan"), mu, force))
