"""Workers for repeated computations: processes of this machine, which are replaced if they die, or a Dask cluster.

The pool of this machine is that of the standard library, with fresh workers in place of dead ones. Two libraries were
measured beside it. Workers of loky 3.7 outlive a parent that is killed, and Ctrl-C while they start breaks its pool. A
local cluster of Dask 2026.8 with nannies takes 4.7 s of the processor to start two workers, where this takes 0.4 s, and
passes Ctrl-C on to the command as an error.
"""

import ctypes
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

from models.core.errors import InputError
from models.ensemble.store import checksum_of_sources, named_files
from models.machine.left_out import show_libraries

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Options of glibc's mallopt, from its malloc.h."""
KEPT_MEMORY_BYTES = 1 << 28
"""Freed memory (bytes) that a worker keeps for its next array."""


class ReplacingProcessPool(Executor):
    """Process pool that replaces workers that have died, and ends its workers when an error ends the pool.

    A pool of the standard library is lost with the first worker that is killed; and where its parent is killed, its
    workers wait for ever. These end as soon as the far end of their pipe is closed, by whatever closes it.
    """

    def __init__(self, worker_count: int) -> None:
        self._workers, self._context = worker_count, get_context("spawn")
        self._theirs, self._ours = self._context.Pipe(duplex=False)
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        """A new pool whose workers were all started at once while Ctrl-C is blocked, a setting that they inherit.

        One that struck a worker while it imports would break the pool, and the process that keeps the blocks could
        wait for it for ever.
        """
        pool = ProcessPoolExecutor(
            self._workers, mp_context=self._context, initializer=_prepare_worker, initargs=(self._theirs,)
        )
        with _interrupts_blocked():
            for _ in range(self._workers):
                pool.submit(os.getpid)
        return pool

    def submit(self, function: Callable, /, *args: Any, **options: Any) -> Future:
        """Submit a function to the pool, as in any executor; if workers have died, new ones execute it."""
        try:
            return self._pool.submit(function, *args, **options)
        except BrokenExecutor:
            self._pool.shutdown(wait=False)
            self._pool = self._started()
            return self._pool.submit(function, *args, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Shut the pool down, as any executor does."""
        self._pool.shutdown(wait, cancel_futures=cancel_futures)
        self._ours.close()
        self._theirs.close()

    def __exit__(self, error_type: Any, error: Any, trace: Any) -> None:
        if error_type is not None:
            self._ours.close()  # nobody waits for what is not wanted any more
        self.shutdown(cancel_futures=error_type is not None)


def process_pool(worker_count: int) -> ReplacingProcessPool:
    """A pool of freshly started processes, since threads of engines and compilers do not survive a fork."""
    return ReplacingProcessPool(worker_count)


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Context in which Ctrl-C is delayed to the end, where the operating system allows it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _prepare_worker(pipe: Connection) -> None:
    """Prepare a worker process: it ignores Ctrl-C, ends with the process that stores the blocks, and keeps freed
    memory."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_exit_with_parent, args=(pipe,), daemon=True).start()
    keep_freed_memory()


def keep_freed_memory() -> None:
    """Make this process reuse freed memory for its next arrays, where the C library allows it.

    It otherwise returns every array of some megabytes to the system and gets fresh pages for the next one: a third of
    the time of a path of 60,000 steps, and almost half where Dask has set it to return still smaller ones. What a
    worker keeps is what one path needs, some 20 MB.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        for option in (M_TRIM_THRESHOLD, M_MMAP_THRESHOLD):
            mallopt(option, KEPT_MEMORY_BYTES)


def _exit_with_parent(pipe: Connection) -> None:
    """End this process when the other end of the pipe is closed, also by the death of the parent process."""
    with suppress(EOFError, OSError):
        pipe.recv_bytes()
    os._exit(1)


DEFAULT_WORKER_COUNT = 2
"""Number of worker processes by default, at most one per core; no result depends on it."""
SCHEDULER_SCHEMES = ("tcp", "tls", "ws", "wss", "ucx", "inproc")
"""Schemes of the address of a Dask scheduler."""
SCHEDULER_TIMEOUT = "10s"
"""Time within which a scheduler must respond."""


@dataclass(frozen=True)
class Crew:
    """Choice of workers for repeated computations: ``workers`` processes of this machine, or all workers of the Dask
    scheduler at the address ``cluster``."""

    workers: int
    cluster: str | None = None

    @classmethod
    def given(
        cls,
        worker_count: int | None = None,
        cluster_address: str | None = None,
        default_workers: int = DEFAULT_WORKER_COUNT,
    ) -> "Crew":
        """The requested workers; without a request, ``default_workers`` processes but at most one per core."""
        return cls(worker_count or min(default_workers, os.cpu_count() or 1), cluster_address)

    @classmethod
    def of(cls, scene: Any, default_workers: int = DEFAULT_WORKER_COUNT) -> "Crew":
        """The workers that a scene requests: its keys ``workers`` and ``cluster``, or the default."""
        return cls.given(scene.workers, scene.cluster, default_workers)

    @contextmanager
    def at_work(self, block_count: int, *used_paths: Path) -> Iterator[Executor | None]:
        """Context with the executor for a number of blocks; None where this process computes alone.

        used_paths : files and folders that the workers read or write, too; InputError where those of a cluster do not
        see them, or where ``dask_workers`` has something to refuse.
        """
        if self.cluster is not None:
            with dask_workers(self.cluster, *used_paths) as executor:
                yield executor
        elif (workers := min(self.workers, block_count)) > 1:
            with process_pool(workers) as executor:
                yield executor
        else:
            yield None


def folders_for_workers(scene: Any) -> tuple[Path, ...]:
    """The folder of a scene whose files the workers read; empty if the scene names no file."""
    folder = Path(scene.folder)
    return (folder,) if named_files(scene.table(), folder) else ()


@contextmanager
def dask_workers(scheduler_address: str, *used_paths: Path) -> Iterator[Executor]:
    """Context with the workers of a Dask scheduler, such as ``tcp://host:8786``, as an executor; the same twinrig must
    be installed there.

    Certificates of a ``tls://`` address are those of Dask's configuration. Raises InputError where the extra
    ``cluster`` is not installed, nobody answers, no worker has joined, or one cannot compute the same: with other
    sources, with several threads (engines share their callbacks within a process), or without sight of ``used_paths``.
    """
    show_libraries("dask")
    try:
        from distributed import Client
    except ImportError:
        raise InputError("", "cluster", scheduler_address, "needs Dask: pip install 'twinrig[cluster]'") from None
    scheme, separator, host = scheduler_address.partition("://")
    if not separator or not host:
        raise InputError("", "cluster", scheduler_address, "must read SCHEME://HOST:PORT, for example tcp://host:8786")
    if scheme not in SCHEDULER_SCHEMES:
        raise InputError("", "cluster", scheme, "is no way to reach a scheduler", SCHEDULER_SCHEMES)
    try:
        client = Client(scheduler_address, timeout=SCHEDULER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError("", "cluster", scheduler_address, f"no Dask scheduler answers there: {reason}") from None
    with client:
        _check_workers(client, scheduler_address, used_paths)
        from models.ensemble.dask_worker import WorkerSetup

        client.register_plugin(WorkerSetup())
        yield ClusterExecutor(client)


class ClusterExecutor(Executor):
    """Executor for a Dask client that sends a job to the cluster only once, and for each block only its path numbers.

    A job is the result of a task, so that the scheduler can make it again where the workers that had it are gone.
    width : workers at its beginning.
    """

    def __init__(self, dask_client: Any) -> None:
        self._client, self._executor, self.width = dask_client, dask_client.get_executor(), len(dask_client.nthreads())
        self._jobs: dict[int, tuple[Any, Any]] = {}

    def submit(self, function: Callable, /, *args: Any, **options: Any) -> Future:
        """Submit a function of a job and a block, or any other function; returns its future."""
        if len(args) == 2:
            job, block = args
            if id(job) not in self._jobs:
                self._jobs[id(job)] = job, self._client.submit(_identity, job, pure=False)
            args = self._jobs[id(job)][1], block
        return self._executor.submit(function, *args, **options)


def _identity(cluster_job: Any) -> Any:
    """The job itself: the task by which a cluster stores it."""
    return cluster_job


class _WorkerState(NamedTuple):
    """State of a cluster worker: checksum of its sources, number of threads, and paths that it cannot access."""

    sources: str
    threads: int
    missing_paths: list[str]


def _worker_state(used_paths: tuple[Path, ...], dask_worker: Any = None) -> _WorkerState:
    """State of the cluster worker on which this function runs, for these paths; Dask prescribes the name of the second
    argument."""
    missing = [str(path) for path in used_paths if not path.exists()]
    return _WorkerState(checksum_of_sources(Path(__file__).parents[1]), dask_worker.state.nthreads, missing)


def _check_workers(dask_client: Any, scheduler_address: str, used_paths: tuple[Path, ...]) -> None:
    """Raise InputError if a cluster has no worker, or one that would not compute the same results."""
    absolute = tuple(path.resolve() for path in used_paths)
    try:
        workers = dask_client.run(_worker_state, absolute)
    except (ImportError, AttributeError) as error:
        allowed = f"its workers have no twinrig, or another one: {error}"
        raise InputError("", "cluster", scheduler_address, allowed) from None
    if not workers:
        raise InputError(
            "", "cluster", scheduler_address, "no worker has joined this scheduler: start one, dask worker ADDRESS"
        )
    checksum = checksum_of_sources(Path(__file__).parents[1])
    for worker, worker_state in workers.items():
        if worker_state.sources != checksum:
            allowed = "has another version of twinrig: install the same one on every machine"
        elif worker_state.threads != 1:
            threads = f"has {worker_state.threads} threads, which would share an engine's callbacks"
            allowed = f"{threads}: start it with --nthreads 1"
        elif worker_state.missing_paths:
            allowed = f"does not see {', '.join(worker_state.missing_paths)}: use a folder that all machines share"
        else:
            continue
        raise InputError("", "cluster", scheduler_address, f"the worker {worker} {allowed}")
