"""What several test files share: an empty folder to work in, the command, a new file among a system's effects, a slow
machine; and the order in which the long tests begin.
"""

import gc
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import wraps
from importlib import import_module
from multiprocessing import get_context

import pytest

import models  # noqa: F401  before any test imports numpy: it sets the threads of linear algebra

gc.set_threshold(100_000, 20, 50)  # compiling makes many objects that stay: a twelfth of its time went to counting them
SEPARATE_FILES = ("test_cases", "test_saved_results")
"""Files whose tests share nothing that takes long to make: each of their tests may be run by another process."""
LONGEST_FIRST = (
    "stated_errors",
    "price",
    "recommendation",
    "test_robust_runs",
    "written_equations",
    "test_planted_faults",
    "choice_linear",
    "kalman",
    "test_told_ride",
    "test_cluster",
    "ensemble",
    "absent",
    "hard_cases",
    "effect_prices",
    "drift_solvers",
    "braking_limits",
    "contact_exact",
    "measured_drive",
    "fastsim",
    "adams_joints",
    "braking_port",
)
"""Cases and files that take a minute and more in full, the longest first."""


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(config, items):
    """Keep the tests of a file together where processes share them (``--dist loadgroup``), and begin with the longest
    ones, so that no process works alone at the end."""

    def rank(item):
        name = item.callspec.id if item.path.stem == "test_cases" and hasattr(item, "callspec") else item.path.stem
        return LONGEST_FIRST.index(name) if name in LONGEST_FIRST else len(LONGEST_FIRST)

    for item in items:
        if item.path.stem not in SEPARATE_FILES:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))
    if config.option.markexpr == "full":
        items.sort(key=rank)


@pytest.fixture(autouse=True, scope="session")
def tolerance_rules():
    """Refuse an expected figure so small that ``pytest.approx`` would take anything near 0 for it: without ``abs`` it
    allows 1e-12."""
    plain = pytest.approx

    def checked(expected, rel=None, abs=None, nan_ok=False):
        if abs is None and isinstance(expected, float) and expected != 0.0:
            assert not -1e-10 < expected < 1e-10, f"{expected}: give abs, too"
        return plain(expected, rel=rel, abs=abs, nan_ok=nan_ok)

    pytest.approx = checked
    yield
    pytest.approx = plain


@pytest.fixture(autouse=True, scope="session")
def figure_rules():
    """Hold every figure that a test saves, or puts into a page, to the rules of figures."""
    from figure_rules import faults
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    def held(canvas_type, method):
        written = getattr(canvas_type, method)

        @wraps(written)  # matplotlib passes the options that are in the signature
        def checked(canvas, *args, **options):
            with pytest.MonkeyPatch.context() as within:  # the rules draw the figure, which asks for the same once more
                within.setattr(canvas_type, method, written)
                broken = faults(canvas.figure)
            assert not broken, "\n".join(broken)
            return written(canvas, *args, **options)

        return checked

    with pytest.MonkeyPatch.context() as patch:
        for canvas_type, method in ((FigureCanvasAgg, "print_png"), (FigureCanvasSVG, "print_svg")):
            patch.setattr(canvas_type, method, held(canvas_type, method))
        yield


@pytest.fixture(scope="session")
def elsewhere():
    """Function that calls another one on another machine, slow and busy by its clocks."""
    from slow_machine import begin

    with ProcessPoolExecutor(1, get_context("spawn"), begin) as machine:
        yield lambda *asked: machine.submit(*asked).result()


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """A new folder, which is the current one during the test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def twinrig(empty_folder):
    """Function that runs ``twinrig ARGS`` within this process, in an empty folder, and returns its exit code."""
    from studies import command_line

    def run(*args):
        with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
            patch.setattr(sys, "argv", ["twinrig", *args])
            command_line.main()
        return ended.value.code

    return run


@pytest.fixture
def new_file(tmp_path, monkeypatch):
    """Put a file among the effects of a system, in a folder of its own."""
    from models.core.systems import SYSTEMS

    def put(system, name, text):
        package = SYSTEMS[system].effects
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.setattr(import_module(package), "__path__", [*import_module(package).__path__, str(tmp_path)])
        monkeypatch.setitem(sys.modules, f"{package}.{name}", None)  # to be taken away again
        del sys.modules[f"{package}.{name}"]

    return put
