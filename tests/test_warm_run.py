"""What a run loads and compiles, by counts: seconds of imports and kernels belong to the machine."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
UNUSED = (
    "dask",
    "distributed",
    "pint",
    "control",
    "matplotlib.pyplot",
    "scipy.interpolate",
    "scipy.signal",
    "scipy.stats",
)
"""Modules that a run of one vehicle on the study road has no use for; each takes 0.1 s or more to import."""
RUN = """
import json, sys
sys.argv = ["twinrig", "run", "study_road", "--engine", "reference", "--no-error", "--set", "run.duration=0.1",
            "--out", "out"]
try:
    from studies.command_line import main
    main()
finally:
    print(json.dumps([name for name, module in sys.modules.items() if module is not None]))
"""


def last_line(code, folder, **more):
    """What a fresh process, with ``more`` in its environment, prints last, read as JSON."""
    plain = os.environ | {"PYTHONPATH": str(ROOT)} | more
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=plain, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_a_run_imports_only_what_it_uses(tmp_path):
    loaded = last_line(RUN, tmp_path)
    assert {"xarray", "numba", "matplotlib.figure", "h5netcdf"} <= set(loaded), "or the list below proves nothing"
    assert [name for name in UNUSED if name in loaded] == []
    assert "exudyn" not in loaded and "mujoco" not in loaded, "engines that were not asked for"


def test_what_is_left_out_can_be_let_in_again():
    """A library that is there already stays, and what is let in is imported as ever."""
    code = """
import json, sys, colorsys
from models.machine.left_out import hide_libraries, show_libraries
hide_libraries("wave", "colorsys")
try:
    import wave
    refused = False
except ImportError:
    refused = True
kept = sys.modules["colorsys"] is colorsys
show_libraries("wave", "colorsys", "chunk")
import wave
print(json.dumps([refused, kept, wave.__name__]))
"""
    assert last_line(code, ROOT) == [True, True, "wave"]


def test_nothing_is_left_out_that_this_process_has_looked_for_already():
    """A notebook that labels arrays and then calls the command: xarray keeps what it has seen of dask."""
    code = """
import json, sys, xarray
from models.machine.left_out import OF_LABELS, hide_libraries
hide_libraries(*OF_LABELS)
print(json.dumps([name for name in OF_LABELS if name in sys.modules and sys.modules[name] is None]))
"""
    assert last_line(code, ROOT) == []


def test_units_are_read_where_a_run_left_their_library_out():
    code = """
import json
from models.machine.left_out import hide_libraries
hide_libraries("pint")
from models.measured.units import factor_to_si
print(json.dumps(factor_to_si("kN", "force", "", "")))
"""
    assert last_line(code, ROOT) == 1000.0


@pytest.mark.parametrize("kernel", ["coefficient_at", "_tabulated_coefficient", "_narrow_asymptote", "_long_asymptote"])
def test_linear_creep_compiles_each_of_kalkers_functions_once(coefficients, kernel):
    """Numbers that are written out in a call would give a function each: five times the compilation, 8 s of 20."""
    assert coefficients[kernel] == 1


@pytest.fixture(scope="module")
def coefficients(tmp_path_factory):
    """Signatures by function, of the linear creep forces of a wheelset, compiled where nothing is kept."""
    code = """
import json, os
from numba import njit
from models.contact import linear_theory
from models.rail.wheel_forces import _linear_forces
linear = njit(lambda a, b, motion, shear, poisson: _linear_forces(a, b, motion, shear, poisson))
linear(5e-3, 4e-3, (1e-4, 1e-4, 0.1), 8e10, 0.28)
names = ("coefficient_at", "_tabulated_coefficient", "_narrow_asymptote", "_long_asymptote")
print(json.dumps({name: len(getattr(linear_theory, name).signatures) for name in names}))
"""
    return last_line(code, ROOT, NUMBA_CACHE_DIR=str(tmp_path_factory.mktemp("kept")))
