"""Ensembles: the same bits on any executor and after any interruption, folders that know whose they are."""

import errno
import math
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest

from models.core import whole_files
from models.core.errors import InputError, RunFailed
from models.core.noise import normal_samples
from models.engines import protocol
from models.ensemble import store, workers
from models.ensemble.runner import PathBlocks, PathFailed, run_paths
from models.ensemble.statistics import deviation_with_error, quantile_with_interval
from models.ensemble.workers import dask_workers, process_pool
from models.systems.pitch_plane.noise_paths import NoisePaths, largest_difference, mujoco_threads, noise_paths
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.scenes import force_scene, road_scene

PATHS, BLOCK = 10, 3
TIMES = np.array([0.0, 0.25, 0.5])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Forces of half a second on the study road, sampled at 1 kHz."""
    made = tmp_path_factory.mktemp("forces")
    write_measurement(simulate(road_scene(duration=0.5), "reference"), made, 1e-3)
    return made


def scene(folder, seed=3, path=0, effects=None, **changes):
    noise = {"force_noise": {"deviation": 30.0, "seed": seed, "path": path}}
    return force_scene(folder, duration=0.5, effects=noise | (effects or {}), **changes)


def job(folder, **changes):
    return noise_paths(scene(folder, **changes), TIMES, drift_off_pitch=2e-4)


@pytest.fixture(scope="module")
def expected(folder):
    return run_paths(job(folder), PATHS)


def same(one, other):
    return set(one) == set(other) and all(np.array_equal(one[key], other[key], equal_nan=True) for key in one)


class Reversed(Executor):
    """Computes what it is given in the wrong order, when the first answer is asked for."""

    def __init__(self):
        self.waiting = []

    def submit(self, function, /, *args):
        future = Future()
        self.waiting.append((future, function, args))
        if len(self.waiting) == math.ceil(PATHS / BLOCK):
            for late, work, values in reversed(self.waiting):
                late.set_result(work(*values))
        return future


@pytest.mark.parametrize(
    "changes",
    [{}, {"interpolation": "held"}, {"interpolation": "smooth"}, {"effects": {"pitch_spring": {"stiffness": 300.0}}}],
    ids=str,
)
def test_a_path_is_the_scene_with_that_number_to_the_last_bit(folder, changes):
    found = run_paths(job(folder, **changes), 3)
    alone = simulate(scene(folder, path=2, **changes), "reference")
    assert np.array_equal(found["states"][2], alone.states[[0, 250, 500]])
    assert not np.array_equal(found["states"][2], found["states"][1])


def test_drift_off_is_the_first_time_beyond_the_threshold(folder, expected):
    noisy, quiet = (
        simulate(scene(folder, path=4, effects=noise), "reference")
        for noise in ({}, {"force_noise": {"deviation": 0.0}})
    )
    far = np.abs(noisy["pitch"] - quiet["pitch"]) > 2e-4
    assert far.any() and expected["drift_off"][4] == noisy.times[far.argmax()]
    never = run_paths(replace(job(folder), threshold=1.0), 2)
    assert np.isinf(never["drift_off"]).all() and np.isnan(never["failed"]).all()


@pytest.mark.parametrize("block", [1, BLOCK, 50])
def test_the_size_of_the_blocks_changes_nothing(folder, expected, block):
    assert same(run_paths(job(folder), PATHS, path_blocks=PathBlocks(block)), expected)


@pytest.mark.parametrize("make", [lambda: ThreadPoolExecutor(2), Reversed], ids=["threads", "reversed"])
def test_threads_and_order_change_nothing(folder, expected, make):
    with make() as executor:
        assert same(run_paths(job(folder), PATHS, executor=executor, path_blocks=PathBlocks(BLOCK)), expected)


def test_processes_change_nothing(folder, expected):
    with process_pool(2) as executor:
        assert same(run_paths(job(folder), PATHS, executor=executor, path_blocks=PathBlocks(BLOCK)), expected)


def test_a_dask_cluster_changes_nothing(folder, expected):
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as local:  # noqa: SIM117
        with dask_workers(local.scheduler_address) as executor:
            assert same(run_paths(job(folder), PATHS, executor=executor, path_blocks=PathBlocks(BLOCK)), expected)


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://127.0.0.1:9", "no Dask scheduler answers"),
        ("tpc://127.0.0.1:8786", "did you mean 'tcp'"),
        ("127.0.0.1:8786", "must read SCHEME://HOST:PORT"),
    ],
)
def test_a_cluster_that_is_not_there_is_named(address, said, monkeypatch):
    monkeypatch.setattr(workers, "SCHEDULER_TIMEOUT", "0.2s")
    with pytest.raises(InputError, match=said), dask_workers(address):
        pass


class ByOrder(NoisePaths):
    """The fault to be seen: noise drawn in the order of the work, as a generator that all paths share would."""

    drawn = 0

    def assembly(self, path):
        ByOrder.drawn += 1
        return super().assembly(ByOrder.drawn)


def test_noise_drawn_by_the_order_of_work_is_seen(folder):
    faulty = ByOrder(**vars(job(folder)))
    one = run_paths(faulty, PATHS, path_blocks=PathBlocks(BLOCK))
    ByOrder.drawn = 0
    with Reversed() as executor:
        assert not same(run_paths(faulty, PATHS, executor=executor, path_blocks=PathBlocks(BLOCK)), one)


def test_progress_counts_paths_and_tells_the_time_left(folder):
    told = []
    run_paths(job(folder), PATHS, path_blocks=PathBlocks(BLOCK), report_progress=told.append)
    assert [state.done for state in told] == [0, 3, 6, 9, 10]
    assert all(state.seconds_left == pytest.approx((10 - state.done) / state.rate) for state in told[1:])
    assert str(told[-1]).startswith("10 of 10 paths")


KILLED = """
import sys, time
from pathlib import Path
sys.path.insert(0, {tests!r})
from test_ensemble import BLOCK, PATHS, PathBlocks, job, run_paths
run_paths(job(Path({forces!r})), PATHS, Path({blocks!r}), path_blocks=PathBlocks(BLOCK), report_progress=lambda state:
time.sleep(0.3))
"""


def test_a_killed_run_resumes_without_losing_a_block(folder, expected, tmp_path):
    """SIGKILL leaves no time to tidy up; sleeping after each block makes sure that it strikes half-way."""
    code = KILLED.format(tests=str(Path(__file__).parent), forces=str(folder), blocks=str(tmp_path))
    child = subprocess.Popen([sys.executable, "-c", code])
    while len(list(tmp_path.glob("block*.npz"))) < 2 and child.poll() is None:
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("block*.npz")}
    assert 2 <= len(kept) < 4
    told = []
    assert same(
        run_paths(job(folder), PATHS, tmp_path, path_blocks=PathBlocks(BLOCK), report_progress=told.append), expected
    )
    assert told[0].done == BLOCK * len(kept)
    assert all(path.stat().st_mtime_ns == when for path, when in kept.items())


class Counted(NoisePaths):
    """Counts its calls, which take longer than to save a block."""

    calls = 0

    def __call__(self, paths):
        Counted.calls += 1
        time.sleep(0.05)
        return super().__call__(paths)


def test_an_interrupt_leaves_the_finished_blocks_and_begins_no_others(folder, expected, tmp_path):
    def stop(state):
        if state.done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), ThreadPoolExecutor(1) as executor:
        run_paths(Counted(**vars(job(folder))), PATHS, tmp_path, executor, PathBlocks(1), stop)
    assert len(list(tmp_path.glob("block*.npz"))) == 2 and Counted.calls < PATHS / 2
    assert same(run_paths(job(folder), PATHS, tmp_path, path_blocks=PathBlocks(1)), expected)


def test_an_interrupt_while_workers_start_reaches_none_of_them():
    """A terminal sends Ctrl-C to all of its processes; one that still imports would die of it and break the pool."""
    others = {child.pid for child in active_children()}
    with process_pool(1) as pool:
        (worker,) = (child for child in active_children() if child.pid not in others)
        os.kill(worker.pid, signal.SIGINT)
        assert pool.submit(abs, -1).result(timeout=60) == 1


def test_a_full_disk_ends_the_run_at_once_and_keeps_what_is_finished(folder, expected, tmp_path, monkeypatch):
    """What was half written is not there; with room again, the run goes on."""
    monkeypatch.setattr(whole_files.os, "fsync", _full_after(3))  # the note and two blocks
    with pytest.raises(RunFailed, match=r"the disk is full.*finished blocks are kept.*make room and resume"):
        run_paths(job(folder), PATHS, tmp_path, path_blocks=PathBlocks(BLOCK))
    monkeypatch.undo()
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert {*kept} == {"job.json", ".lock", "block 000000.npz", "block 000001.npz"}
    assert same(run_paths(job(folder), PATHS, tmp_path, path_blocks=PathBlocks(BLOCK)), expected)
    assert all((tmp_path / name).stat().st_mtime_ns == when for name, when in kept.items() if name != ".lock")


def _full_after(writes):
    left, sync = [writes], os.fsync

    def full(number):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        sync(number)

    return full


def test_two_processes_never_work_in_one_folder(folder, tmp_path):
    with store.exclusive_folder(tmp_path), pytest.raises(InputError, match="another process is at work"):
        run_paths(job(folder), 2, tmp_path)
    (
        tmp_path / whole_files.PARTIAL_NAME.format("block 000000.npz", ended(), ".npz")
    ).touch()  # of a process that was killed
    run_paths(job(folder), 2, tmp_path)
    assert not list(tmp_path.glob("*.part*")) and not list(tmp_path.glob(".*.part*"))


def ended():
    """Number of a process that is no more."""
    with subprocess.Popen([sys.executable, "-c", ""]) as child:
        child.wait()
    return child.pid


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"seed": 4}, "scene.effects.force_noise.seed"),
        ({"parameter_changes": {"k3": 1.1e5}}, "scene.vehicle.override.k3"),
        ({"interpolation": "held"}, "interpolation"),
    ],
    ids=str,
)
def test_the_folder_of_another_job_is_refused_by_name(folder, tmp_path, change, place):
    run_paths(job(folder), 2, tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match="belongs to another job") as caught:
        run_paths(job(folder, **change), 2, tmp_path)
    assert place in str(caught.value) and {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_other_forces_other_equations_and_other_counts_are_refused(folder, tmp_path, monkeypatch):
    own = job(folder)
    run_paths(own, 2, tmp_path)
    louder = replace(own, base=replace(own.base, input=replace(own.base.input, values=2 * own.base.input.values)))
    with pytest.raises(InputError, match="forces"):
        run_paths(louder, 2, tmp_path)
    with pytest.raises(InputError, match="paths = 2"):
        run_paths(own, 3, tmp_path)
    monkeypatch.setattr(store, "_code_checksum", lambda: "changed")
    with pytest.raises(InputError, match="code of models"):
        run_paths(own, 2, tmp_path)


def test_a_damaged_block_is_named(folder, tmp_path):
    run_paths(job(folder), 4, tmp_path, path_blocks=PathBlocks(2))
    damaged = store.BlockStore(tmp_path).path(1)
    content = bytearray(damaged.read_bytes())
    content[200] ^= 1
    damaged.write_bytes(content)
    with pytest.raises(InputError, match=r"block 000001\.npz: is damaged"):
        run_paths(job(folder), 4, tmp_path, path_blocks=PathBlocks(2))


class Broken(NoisePaths):
    """Path 4 cannot be computed."""

    broken = True

    def trajectory(self, path):
        if path == 4 and Broken.broken:
            raise ZeroDivisionError("a fault of the programmer")
        return super().trajectory(path)


def test_a_failure_names_path_and_block_and_loses_no_other(folder, expected, tmp_path):
    faulty = Broken(**vars(job(folder)))
    with ThreadPoolExecutor(2) as executor, pytest.raises(RunFailed) as caught:
        run_paths(faulty, PATHS, tmp_path, executor, PathBlocks(BLOCK))
    assert "block 1 (paths 3 to 5): path 4: ZeroDivisionError: a fault" in str(caught.value)
    assert len(list(tmp_path.glob("block*.npz"))) == 3
    Broken.broken = False
    assert same(run_paths(faulty, PATHS, tmp_path, path_blocks=PathBlocks(BLOCK)), expected)


def test_path_failures_survive_the_way_between_processes():
    import pickle

    assert str(pickle.loads(pickle.dumps(PathFailed(7, "lost")))) == "path 7: lost"


def test_a_path_beyond_all_bounds_is_flagged(folder, monkeypatch):
    """Heave rates of 0.2 m/s are beyond a bound of 0.05: every path fails, none is silently wrong."""
    own = job(folder)
    monkeypatch.setattr(protocol, "SIZE_BOUND", 0.05)
    found = run_paths(own, 2)
    assert np.isnan(found["states"]).all() and (found["failed"] >= 0).all()
    assert np.array_equal(found["drift_off"], found["failed"])


@pytest.mark.parametrize("interpolation", ["linear", "held"])
def test_engines_repeat_the_paths(folder, interpolation):
    """The same tableau on the same samples: rounding apart, and MuJoCo to the bit for 1 and 2 threads."""
    own = scene(folder, interpolation=interpolation)
    reference = run_paths(noise_paths(own, TIMES), 3)
    one, two = (run_paths(mujoco_threads(own, TIMES, thread_count=threads), 3) for threads in (1, 2))
    assert same(one, two)
    assert largest_difference(reference, one, TIMES) < 1e-12
    assert largest_difference(reference, run_paths(noise_paths(own, TIMES, engine="exudyn"), 2), TIMES) < 1e-12
    other = run_paths(noise_paths(scene(folder, seed=4, interpolation=interpolation), TIMES), 3)
    assert largest_difference(reference, other, TIMES) > 1e-6
    assert math.isnan(
        largest_difference(reference | {"drift_off": np.full(3, 0.1)}, other, TIMES)
    )  # only the common start is left


def test_what_cannot_be_an_ensemble_is_refused(folder):
    own = scene(folder)
    silent = force_scene(folder, duration=0.5)
    for wrong, place in (
        (lambda: noise_paths(silent, TIMES), "force_noise"),
        (lambda: noise_paths(own, np.array([0.6])), "times"),
        (lambda: noise_paths(own, np.array([0.2505])), "times"),
        (lambda: noise_paths(own, TIMES, true_states=np.zeros(3)), "truth"),
        (lambda: noise_paths(own.model_copy(update={"engines": {"reference": _adaptive()}}), TIMES), "DOP853"),
    ):
        with pytest.raises(InputError, match=place):
            wrong()


def _adaptive():
    from models.systems.pitch_plane.scene import EngineTable

    return EngineTable(integrator="DOP853")


def test_the_standard_error_of_a_deviation_is_its_scatter():
    """2,000 samples of 100 normal numbers: the errors' mean is within 10 % of the scatter (its own error is 1.6 %)."""
    draws = normal_samples(5, 0, 2000 * 100, 1).reshape(2000, 100)
    found = np.array([deviation_with_error(row) for row in draws])
    assert found[:, 0].std() == pytest.approx(found[:, 1].mean(), rel=0.1)
    assert found[:, 0].mean() == pytest.approx(1.0, abs=0.01)  # E[s] = 1 - 1/(4 n) = 0.9975


def test_the_interval_of_a_quantile_covers_it():
    """Of 1,000 samples of 200 numbers some 950 intervals hold the true median; 4.5 binomial sd of 7 either side."""
    draws = normal_samples(6, 0, 1000 * 200, 1).reshape(1000, 200)
    held = sum(low <= 0 <= high for _, low, high in (quantile_with_interval(row, 0.5) for row in draws))
    assert 920 <= held <= 980
    assert quantile_with_interval(np.array([1.0, 2.0, np.inf, np.inf]), 0.75)[0] == np.inf
    assert quantile_with_interval(np.array([1.0, 2.0, np.inf, np.inf]), 0.5)[0] == 2.0


SHORT = (
    "--set",
    "run.duration=1",
    "--set",
    "options.times=[0.5, 1.0]",
    "--set",
    "options.paths=60",
    "--workers",
    "1",
    "--engine",
    "reference",
)


def test_the_study_resumes_in_its_own_folder(twinrig, tmp_path, capsys):
    assert twinrig("run", "ensemble", *SHORT, "--out", "first") == 0
    said = capsys.readouterr().out
    assert "60 paths of 1 s" in said and "50 %   never" in said
    first, blocks = tmp_path / "first", tmp_path / "first" / "blocks"
    table = (first / "table.txt").read_text()
    lost = (blocks / "block 000001.npz").read_bytes()
    for path in (blocks / "block 000001.npz", first / "ensemble.nc", first / "table.txt"):
        path.unlink()
    assert twinrig("run", "ensemble", *SHORT, "--resume", "first") == 0
    assert (first / "table.txt").read_text() == table and (blocks / "block 000001.npz").read_bytes() == lost
    capsys.readouterr()
    forces = (first / "wheel_forces.csv").stat().st_mtime_ns
    assert twinrig("run", "ensemble", *SHORT, "--set", "options.seed=2", "--resume", "first") == 2
    assert "force_noise.seed" in capsys.readouterr().err and (first / "wheel_forces.csv").stat().st_mtime_ns == forces


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("ensemble", "--resume", "nowhere"), "holds no unfinished run"),
        (("ensemble", "--resume", "nowhere", "--out", "new"), "leave out --out"),
        (("six_runs", "--resume", "nowhere"), "keeps nothing that can be resumed"),
    ],
    ids=str,
)
def test_what_cannot_be_resumed_is_refused(twinrig, args, said, tmp_path, capsys):
    assert twinrig("run", *args) == 2
    assert said in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("seconds", "busy", "said"),
    [
        (70.0, 135.0, ("reported", "reported")),
        (130.0, 250.0, ("missed", "missed")),
        (400.0, 170.0, ("missed", "reported")),
    ],
)
def test_a_slow_machine_misses_aims_and_fails_no_row(seconds, busy, said):
    from validation.cases.ensemble import _large_ensemble_rows

    found = {"path-steps": 6e8, "failed": 0, "seconds": seconds, "busy": busy, "kept": 64.0 * 61 + 16, "bytes": 7e9}
    rows = {row.id: row.status for row in _large_ensemble_rows(found)}
    assert (rows["ensemble.scale.seconds"], rows["ensemble.scale.processor"]) == said
    assert rows["ensemble.scale.memory"] == "missed" and "failed" not in rows.values()
