"""Many paths on any executor: progress, finished blocks kept, resumed with the same bits.

A job is called with a range of path numbers and gives named arrays whose first axis is these paths. It must
depend on the numbers alone, so that the result does not depend on who computes which block, or when. The paths are
cut into blocks of fixed size; each finished block is saved whole, and all of them are put together in the order of
their numbers.
"""

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Generator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import closing, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np

from models.core.errors import RunFailed
from models.core.whole_files import FULL, reason_of
from models.ensemble.store import Arrays, Store

BLOCK = 50
"""Paths per block: half a second of work of the pitch plane over 60 s, which a killed run may lose."""
AHEAD = 64
"""Blocks under way at once, so that the memory for results on their way stays bounded."""
TOLD = 5
"""Failed blocks that a message names."""
LIVES = 3
"""Times that a block may lose its worker: among others, again among others, and alone, where it is to blame."""


class Blocks(NamedTuple):
    """How an ensemble's paths are cut into blocks: ``size`` paths per block, of which at most ``ahead`` are under way
    at once."""

    size: int = BLOCK
    ahead: int = AHEAD

    def cut(self, paths: int) -> list[range]:
        """Path numbers of each block."""
        return [range(first, min(first + self.size, paths)) for first in range(0, paths, self.size)]


BLOCKS = Blocks()
"""As paths are cut where nothing else is asked for."""


class Job(Protocol):
    """The computation that an ensemble repeats for each path; it must survive pickling to run in other processes."""

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
    """Progress of an ensemble: paths done of all, paths per second, seconds left (infinite before the first block)."""

    done: int
    paths: int
    rate: float
    left: float

    def __str__(self) -> str:
        left = f", {self.left:.0f} s left" if self.rate else ""
        return f"{self.done} of {self.paths} paths, {self.rate:.3g} per second{left}"


@dataclass(frozen=True)
class _Failure:
    """Failure that a worker returns in place of its answer: many exceptions do not survive the way between
    processes."""

    reason: str
    full: bool = False


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


def run_paths(
    job: Job,
    paths: int,
    folder: Path | None = None,
    executor: Executor | None = None,
    blocks: Blocks = BLOCKS,
    progress: Callable[[Progress], None] = lambda state: None,
    lost: Callable[[range, str], Arrays] | None = None,
) -> Arrays:
    """Arrays of all paths 0 to ``paths`` - 1, the same bits on any executor, in any order and after any interruption.

    folder : keeps every finished block; one that holds blocks of the same job is resumed, one of another job is
    an InputError that names the difference; None keeps them in memory. executor : a process pool
    (``processes``), a Dask cluster (``cluster``), a thread pool; None computes here. A block that fails does
    not stop the others, and one that loses its worker is computed again: RunFailed then names the blocks and paths
    that are left, and what is finished is kept. A full disk ends it at once, with RunFailed. lost : (paths, reason)
    -> what stands for a block that failed, in place of RunFailed; it is not kept, so that resuming tries again.
    """
    facts = {"paths": paths, "paths per block": blocks.size, **job.facts()}
    cut = blocks.cut(paths)
    store = _Memory() if folder is None else Store(folder)
    with nullcontext() if isinstance(store, _Memory) else store.claimed(facts):
        failed = _compute(job, cut, store, executor, progress, blocks.ahead)
        if failed and lost is None:
            told = [f"block {i} (paths {cut[i][0]} to {cut[i][-1]}): {reason}" for i, reason in failed.items()]
            kept = "" if folder is None else f"; the finished blocks are kept in {folder}: resume there"
            more = f"; {len(failed) - TOLD} more blocks" if len(failed) > TOLD else ""
            raise RunFailed("ensemble", "; ".join(told[:TOLD]) + more + kept)
        arrays = [lost(cut[i], failed[i]) if lost and i in failed else store.load(i) for i in range(len(cut))]
        return {name: np.concatenate([block[name] for block in arrays]) for name in arrays[0]}


def _compute(
    job: Job,
    cut: list[range],
    store: Store | _Memory,
    executor: Executor | None,
    progress: Callable[[Progress], None],
    ahead: int,
) -> dict[int, str]:
    """Compute and save the missing blocks; returns the reasons of those that failed."""
    missing = [i for i in range(len(cut)) if not store.has(i)]
    paths = sum(map(len, cut))
    done = before = paths - sum(len(cut[i]) for i in missing)
    start, failed = time.perf_counter(), dict[int, str]()
    progress(Progress(done, paths, 0.0, math.inf if missing else 0.0))
    with closing(_answers(job, cut, missing, executor, ahead)) as answers:  # an interrupt drops at once what waits
        for i, answer in answers:
            if isinstance(answer, _Failure) and answer.full:
                raise _full(answer.reason, store)
            if isinstance(answer, _Failure):
                failed[i] = answer.reason
                continue
            _keep(store, i, answer)
            done += len(cut[i])
            rate = (done - before) / (time.perf_counter() - start)
            progress(Progress(done, paths, rate, (paths - done) / rate))
    return failed


def _answers(
    job: Job, cut: list[range], missing: list[int], executor: Executor | None, ahead: int
) -> Generator[tuple[int, Arrays | _Failure]]:
    """Blocks and their answers, as they come."""
    if executor is None:
        yield from ((i, _attempt(job, cut[i])) for i in missing)
        return
    queue, alone, lost, waiting = deque(missing), deque[int](), Counter[int](), dict[Future, int]()
    try:
        while queue or alone or waiting:
            while (queue and len(waiting) < ahead) or (alone and not waiting):
                i = (queue or alone).popleft()
                waiting[_submitted(executor, job, cut[i])] = i
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                error, i = future.exception(), waiting.pop(future)
                lost[i] += isinstance(error, BrokenExecutor)
                if isinstance(error, BrokenExecutor) and lost[i] < LIVES:
                    (alone if lost[i] == LIVES - 1 else queue).append(i)
                else:
                    yield i, future.result() if error is None else _said(error)
    finally:
        for future in waiting:
            future.cancel()


def _keep(store: Store | _Memory, block: int, arrays: Arrays) -> None:
    """Save a block; RunFailed where the disk is full, which no other block would change."""
    try:
        store.save(block, arrays)
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise _full(reason_of(error), store) from None


def _full(reason: str, store: Store | _Memory) -> RunFailed:
    kept = f"; the finished blocks are kept in {store.folder}: make room and resume" if isinstance(store, Store) else ""
    return RunFailed("ensemble", f"{reason}{kept}")


def _submitted(executor: Executor, job: Job, paths: range) -> Future:
    """Future of a block of paths; of a pool that has lost its workers, a failed future."""
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
    full = isinstance(error, OSError) and error.errno in FULL
    said = str(error) if full or isinstance(error, PathFailed | RunFailed) else f"{type(error).__name__}: {error}"
    return _Failure(said, full)
