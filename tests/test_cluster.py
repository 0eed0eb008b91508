"""A Dask cluster as the docs start it: a scheduler and 3 workers in processes of their own, with TLS."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.workers import Crew, dask_workers

ROOT = Path(__file__).parents[1]
TLS = """distributed:
  comm:
    require-encryption: true
    tls:
      ca-file: {folder}/twinrig.pem
      scheduler: {{cert: {folder}/twinrig.pem, key: {folder}/twinrig.key}}
      worker: {{cert: {folder}/twinrig.pem, key: {folder}/twinrig.key}}
      client: {{cert: {folder}/twinrig.pem, key: {folder}/twinrig.key}}
"""


class Slow:
    """A job that takes some time, and notes in a folder which blocks were computed, and by whom."""

    def __init__(self, folder):
        self.folder, self.load = folder, np.arange(200_000)

    def __call__(self, paths):
        time.sleep(0.1)
        (self.folder / f"{paths[0]}-{os.getpid()}").touch()
        return {"x": np.sqrt(np.arange(paths[0], paths[-1] + 1)) + 0.0 * self.load[0]}

    def facts(self):
        return {}


def secured(folder):
    """The environment of processes whose Dask takes the certificate in a folder."""
    words = "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=twinrig -keyout twinrig.key -out twinrig.pem"
    subprocess.run(["openssl", *words.split()], cwd=folder, check=True, capture_output=True)
    (folder / "dask.yaml").write_text(TLS.format(folder=folder))
    return os.environ | {"DASK_CONFIG": str(folder), "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"}


def dask(folder, environment, *words):
    log = (folder / f"{words[0]}.log").open("ab")
    return subprocess.Popen([sys.executable, "-m", "dask", *words], cwd=folder, env=environment, stdout=log, stderr=log)


def started(folder, environment):
    """Scheduler, a worker with one process and one with two."""
    scheduler = dask(
        folder,
        environment,
        *("scheduler", "--protocol", "tls", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"),
        *("--scheduler-file", str(folder / "scheduler.json")),
    )
    file = ("--scheduler-file", str(folder / "scheduler.json"), "--nthreads", "1", "--no-dashboard")
    workers = [dask(folder, environment, "worker", *file, "--nworkers", str(n)) for n in (1, 2)]
    return scheduler, workers


def address_of(folder):
    """What the scheduler writes into its file, once all of it is there."""
    file, end = folder / "scheduler.json", time.monotonic() + 120
    while time.monotonic() < end:
        with suppress(OSError, ValueError):
            return json.loads(file.read_text())["address"]
        time.sleep(0.1)
    raise AssertionError((folder / "scheduler.log").read_text())


def end(processes):
    """Ask processes to end, and kill those that a busy machine has not let end in a minute."""
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.wait(60)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def secure(tmp_path_factory):
    """Address of the cluster, its scheduler, and the folder with its certificate."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl makes the certificate")
    import dask.config
    from distributed import Client

    folder = tmp_path_factory.mktemp("tls")
    scheduler, workers = started(folder, secured(folder))
    tls, both = "distributed.comm.tls", {"cert": f"{folder}/twinrig.pem", "key": f"{folder}/twinrig.key"}
    try:
        address = address_of(folder)
        with dask.config.set({f"{tls}.ca-file": f"{folder}/twinrig.pem", f"{tls}.client": both}):
            with Client(address, timeout="120s", set_as_default=False) as client:
                client.wait_for_workers(3, timeout=300)
            yield address, scheduler, folder
    finally:
        end((*workers, scheduler))


@pytest.mark.full
def test_a_cluster_with_tls_gives_the_same_bits_and_outlives_a_killed_worker(secure, tmp_path):
    address, _, _ = secure
    (tmp_path / "a").mkdir()
    expected = np.sqrt(np.arange(30))
    with Crew(1, address).at_work(10, tmp_path) as pool:
        one, killed = Slow(tmp_path / "a"), []

        def kill(state):
            if state.done >= 9 and not killed:
                killed.append(int(next((tmp_path / "a").iterdir()).name.partition("-")[2]))
                os.kill(killed[0], signal.SIGKILL)

        found = run_paths(one, 30, executor=pool, path_blocks=PathBlocks(3), report_progress=kill)["x"]
    assert killed and np.array_equal(found, expected)
    names = {path.name.partition("-")[2] for path in (tmp_path / "a").iterdir()}
    assert len(names) >= 3


class FreshPages:
    """A job whose arrays of 4 MB come and go; it tells how many fresh pages they took from the system."""

    def __call__(self, paths):
        np.ones(500_000)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for _ in range(50):
            np.ones(500_000)
        return {"pages": np.full(len(paths), float(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before))}

    def facts(self):
        return {}


@pytest.mark.full
@pytest.mark.skipif(sys.platform != "linux", reason="glibc's mallopt alone keeps freed memory")
def test_workers_of_a_cluster_keep_freed_memory(secure, tmp_path):
    """Dask has its workers return memory, after which 50 arrays of 4 MB take 49,000 fresh pages."""
    with Crew(1, secure[0]).at_work(3, tmp_path) as pool:
        assert run_paths(FreshPages(), 6, executor=pool, path_blocks=PathBlocks(1))["pages"].max() < 2_000


@pytest.mark.full
def test_every_repeated_job_runs_on_it_to_the_same_bytes(secure, tmp_path):
    """A sweep and an ensemble of the command, beside those of one worker of this machine."""
    address, _, folder = secure
    environment = os.environ | {"DASK_CONFIG": str(folder), "PYTHONPATH": str(ROOT)}
    short = ("--engine", "reference", "--no-error", "--set", "run.duration=1.0")
    sweep = ("study_road", *short, "--sweep", "vehicle.override.k3=8e4,1e5,1.2e5")
    paths = ("ensemble", *short, "--set", "options.times=[0.5, 1.0]", "--set", "options.paths=120")
    for words, files in ((sweep, ("sweep.csv", "sweep.json")), (paths, ("table.txt",))):
        for name, crew in (("here", ("--workers", "1")), ("there", ("--cluster", address))):
            out = tmp_path / words[0] / name
            command = [sys.executable, "-m", "studies.command_line", "run", *words, *crew, "--out", str(out)]
            done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
        for file in files:
            here, there = ((tmp_path / words[0] / name / file).read_bytes() for name in ("here", "there"))
            assert here == there


@pytest.mark.full
def test_a_killed_scheduler_is_said_and_the_blocks_are_resumed(secure, tmp_path):
    """The last test of this cluster."""
    address, scheduler, _ = secure
    (tmp_path / "a").mkdir()
    job, kept = Slow(tmp_path / "a"), tmp_path / "kept"

    def kill(state):
        if state.done >= 9:
            scheduler.send_signal(signal.SIGKILL)

    with pytest.raises(RunFailed, match=r"cluster is gone.*finished blocks are kept"), dask_workers(address) as pool:
        run_paths(job, 60, kept, pool, PathBlocks(3), kill)
    assert 3 <= len(list(kept.glob("block*.npz"))) < 20
    assert np.array_equal(run_paths(job, 60, kept, path_blocks=PathBlocks(3))["x"], np.sqrt(np.arange(60)))
    with pytest.raises(InputError, match="no Dask scheduler answers"), dask_workers(address):
        pass
