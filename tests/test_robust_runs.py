"""Runs of many parts outlive what kills them: workers, the process itself; and say so where they cannot.

The job is light and so is what this module imports: every worker that starts imports it, too.
"""

import os
import signal

import numpy as np
import pytest

from models.ensemble import runner
from models.ensemble.runner import run_paths
from models.ensemble.workers import processes
from models.errors import RunFailed


class Suicide:
    """A job whose worker dies at block 0, as one that is out of memory does, until ``times`` have died."""

    def __init__(self, folder, times):
        self.folder, self.times = folder, times

    def __call__(self, paths):
        died = len(list(self.folder.iterdir()))
        if paths[0] == 0 and died < self.times:
            (self.folder / str(died)).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return {"x": np.arange(paths[0], paths[-1] + 1)}

    def facts(self):
        return {}


def test_a_worker_that_dies_is_replaced_and_its_block_computed_again(tmp_path):
    with processes(2) as executor:
        assert np.array_equal(run_paths(Suicide(tmp_path, 1), 9, executor=executor, block=3)["x"], np.arange(9))


def test_a_block_that_kills_every_worker_is_the_only_failure(tmp_path):
    with processes(2) as executor, pytest.raises(RunFailed) as caught:
        run_paths(Suicide(tmp_path, 99), 9, executor=executor, block=3)
    assert str(caught.value) == "ensemble: block 0 (paths 0 to 2): its worker died: killed, or out of memory"
    assert len(list(tmp_path.iterdir())) == runner.LIVES
