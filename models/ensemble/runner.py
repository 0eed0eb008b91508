"""Many paths on any executor: progress, finished blocks kept, resumed with the same bits.

A job is called with a range of path numbers and gives named arrays whose first axis is these paths. It must
depend on the numbers alone, so that the result does not depend on who computes which block, or when. The paths are
cut into blocks of fixed size; each finished block is saved whole, and all of them are put together in the order of
their numbers.
"""

import ctypes
import math
import os
import signal
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from models.ensemble.store import Arrays, Store
from models.errors import InputError, RunFailed

BLOCK = 50
"""Paths per block: half a second of work of the pitch plane over 60 s, which a killed run may lose."""
AHEAD = 64
"""Blocks under way at once, so that the memory for results on their way stays bounded."""
TOLD = 5
"""Failed blocks that a message names."""

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Options of glibc's mallopt, from its malloc.h."""
KEPT_MEMORY = 1 << 28
"""Bytes that a worker keeps for its next array."""


class Job(Protocol):
    """What an ensemble computes; it must survive pickling to run in other processes."""

    def __call__(self, paths: range) -> Arrays:
        """Named arrays of these paths, first axis len(paths)."""
        ...

    def facts(self) -> dict[str, Any]:
        """Everything that the result depends on: numbers, text, arrays, and dictionaries of these."""
        ...


class PathFailed(RuntimeError):
    """A path that could not be computed, by its number; a job raises it, so that the message can name the path."""

    def __init__(self, path: int, reason: str) -> None:
        super().__init__(path, reason)

    def __str__(self) -> str:
        return f"path {self.args[0]}: {self.args[1]}"


@dataclass(frozen=True)
class Progress:
    """How far an ensemble is: paths done of all, paths per second, seconds left (infinite before the first block)."""

    done: int
    paths: int
    rate: float
    left: float

    def __str__(self) -> str:
        left = f", {self.left:.0f} s left" if self.rate else ""
        return f"{self.done} of {self.paths} paths, {self.rate:.3g} per second{left}"


@dataclass(frozen=True)
class _Failure:
    """What a worker says instead of an answer: many exceptions do not survive the way between processes."""

    reason: str


@dataclass
class _Memory:
    """Blocks that are not saved anywhere."""

    blocks: dict[int, Arrays] = field(default_factory=dict)

    def has(self, block: int) -> bool:
        return block in self.blocks

    def save(self, block: int, arrays: Arrays) -> None:
        self.blocks[block] = arrays

    def load(self, block: int) -> Arrays:
        return self.blocks.pop(block)


def run_paths(job: Job, paths: int, folder: Path | None = None, executor: Executor | None = None,
              block: int = BLOCK, progress: Callable[[Progress], None] = lambda state: None) -> Arrays:  # fmt: skip
    """Arrays of all paths 0 to ``paths`` - 1, the same bits on any executor, in any order and after any interruption.

    folder : keeps every finished block; one that holds blocks of the same job is resumed, one of another job is
    an InputError that names the difference; None keeps them in memory. executor : a process pool
    (``processes``), a Dask cluster (``cluster``), a thread pool; None computes here. A block that fails does
    not stop the others: RunFailed then names the blocks and paths, and what is finished is kept.
    """
    store: Store | _Memory = _Memory()
    if folder is not None:
        store = Store(folder)
        store.claim({"paths": paths, "paths per block": block, **job.facts()})
    cut = [range(first, min(first + block, paths)) for first in range(0, paths, block)]
    failed = _compute(job, cut, store, executor, progress)
    if failed:
        kept = "" if folder is None else f"; the finished blocks are kept in {folder}: resume there"
        more = f"; {len(failed) - TOLD} more blocks" if len(failed) > TOLD else ""
        raise RunFailed("ensemble", "; ".join(failed[:TOLD]) + more + kept)
    return _together([store.load(i) for i in range(len(cut))])


def _compute(job: Job, cut: list[range], store: Store | _Memory, executor: Executor | None,
             progress: Callable[[Progress], None]) -> list[str]:  # fmt: skip
    """Compute and save the missing blocks; returns what failed."""
    missing = [i for i in range(len(cut)) if not store.has(i)]
    paths = sum(map(len, cut))
    done = before = paths - sum(len(cut[i]) for i in missing)
    start, failed = time.perf_counter(), []
    progress(Progress(done, paths, 0.0, math.inf if missing else 0.0))
    with closing(_answers(job, cut, missing, executor)) as answers:  # an interrupt drops at once what waits
        for i, answer in answers:
            if isinstance(answer, _Failure):
                failed.append(f"block {i} (paths {cut[i][0]} to {cut[i][-1]}): {answer.reason}")
                continue
            store.save(i, answer)
            done += len(cut[i])
            rate = (done - before) / (time.perf_counter() - start)
            progress(Progress(done, paths, rate, (paths - done) / rate))
    return failed


def _answers(job: Job, cut: list[range], missing: list[int],
             executor: Executor | None) -> Generator[tuple[int, Arrays | _Failure]]:  # fmt: skip
    """Blocks and their answers, as they come."""
    if executor is None:
        yield from ((i, _attempt(job, cut[i])) for i in missing)
        return
    queue, waiting = iter(missing), dict[Future, int]()

    def submit(blocks: Iterable[int]) -> None:
        for i in blocks:
            waiting[_submitted(executor, job, cut[i])] = i

    submit(islice(queue, AHEAD))
    try:
        while waiting:
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                error = future.exception()
                yield waiting.pop(future), future.result() if error is None else _said(error)
                submit(islice(queue, 1))
    finally:
        for future in waiting:
            future.cancel()


def _submitted(executor: Executor, job: Job, paths: range) -> Future:
    """A block on its way; on a pool that has lost its workers, a future that says so."""
    try:
        return executor.submit(_attempt, job, paths)
    except BrokenExecutor as error:
        lost: Future = Future()
        lost.set_exception(error)
        return lost


def _attempt(job: Job, paths: range) -> Arrays | _Failure:
    """One block, in the worker."""
    try:
        arrays = job(paths)
    except Exception as error:
        return _said(error)
    short = [name for name, values in arrays.items() if len(values) != len(paths)]
    return _Failure(f"{short[0]!r} has not one row per path") if short else arrays


def _said(error: BaseException) -> _Failure:
    if isinstance(error, BrokenExecutor):
        return _Failure("its worker died: killed, or out of memory")
    return _Failure(str(error) if isinstance(error, PathFailed | RunFailed) else f"{type(error).__name__}: {error}")


def _together(blocks: list[Arrays]) -> Arrays:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


THREADS = "OPENBLAS_NUM_THREADS"
"""How many threads numpy takes in a process, read when it is first imported there."""


def processes(workers: int) -> ProcessPoolExecutor:
    """A process pool whose workers start fresh: engines and compilers keep threads that no fork survives.

    They start here, with Ctrl-C held back, which they inherit: one that struck a worker while it imports would break
    the pool, and the process that keeps the blocks could wait for it for ever.
    """
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_prepare_worker)
    with _interrupts_held(), one_thread_each():
        for _ in range(workers):
            pool.submit(os.getpid)
    return pool


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes that start within the block compute linear algebra in a thread of their own.

    Threads of several processes that wait for one another on the same cores make small matrices ten times slower.
    """
    before = os.environ.get(THREADS)
    os.environ[THREADS] = before or "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[THREADS]


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Keep Ctrl-C waiting until the end of the block, where the system can."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare_worker() -> None:
    """Leave Ctrl-C to the process that keeps the blocks, and keep freed memory.

    The C library otherwise returns every array of some megabytes to the system and gets fresh pages for the next
    one: a third of the time of a path of 60,000 steps. What a worker keeps is what one path needs, some 20 MB.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        for option in (M_TRIM_THRESHOLD, M_MMAP_THRESHOLD):
            mallopt(option, KEPT_MEMORY)


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of a Dask scheduler, such as ``tcp://host:8786``, where the same twinrig must be installed.

    Raises InputError where the extra ``cluster`` is not installed or nobody answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError("", "cluster", address, "needs Dask: pip install 'twinrig[cluster]'") from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError("", "cluster", address, f"no Dask scheduler answers there: {reason}") from None
    with client:
        yield client.get_executor()
