"""Linear algebra takes one thread in every process, unless the user has set a number."""

import os
import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info

from models.ensemble.workers import process_pool
from models.machine.threads import VARIABLES


def counts():
    """Threads of every library of linear algebra that this process has loaded."""
    import numpy  # noqa: F401
    import scipy.linalg  # noqa: F401

    return [own["num_threads"] for own in threadpool_info() if own["user_api"] == "blas"]


TELL = "from threadpoolctl import threadpool_info; print(max(own['num_threads'] for own in threadpool_info()))"


def told(begin, **settings):
    environment = {name: value for name, value in os.environ.items() if name not in VARIABLES} | settings
    script = f"{begin}\n{TELL}"
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_this_process_and_its_workers():
    assert counts() and set(counts()) == {1}
    with process_pool(1) as pool:
        assert set(pool.submit(counts).result()) == {1}


@pytest.mark.parametrize("begin", ["import numpy, scipy.linalg, models", "import models, numpy, scipy.linalg"])
def test_in_whatever_order_a_script_imports(begin):
    assert told(begin) == 1


@pytest.mark.parametrize("name", VARIABLES[::2])
def test_a_number_that_the_user_has_set(name):
    assert told("import models, numpy", **{name: "2"}) == min(2, os.cpu_count())
