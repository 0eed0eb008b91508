"""Runner of blocks of work on any executor; finished blocks are stored, and a run resumes with identical bits.

A job is called with a block and gives named arrays. It must depend on the block alone, so that the result does not
depend on who computes which block, or when. ``arrays_by_block`` gives the arrays of all blocks in their order, and
holds no more of them than are under way. ``run_paths`` cuts numbered paths into blocks of fixed size and puts the
arrays, whose first axis is the paths, together.
"""

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import closing, nullcontext
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.whole_files import DISK_FULL_ERRORS, write_error_phrase
from models.ensemble.store import ArraysByName, BlockStore

PATHS_PER_BLOCK = 50
"""Number of paths per block: half a second of work of the pitch plane over 60 s, which a killed run may lose."""
BLOCKS_AHEAD = 64
"""Most blocks that are computed or waiting at once, so that memory stays bounded; two per worker of a cluster that has
more workers."""
NAMED_FAILURE_COUNT = 5
"""Most failed blocks that a message names."""
MOST_WORKER_LOSSES, AMONG_OTHERS = 4, 2
"""Number of times that a block may lose its worker before it fails, and number of these among other blocks; afterwards
the block is computed alone, to tell whether it is to blame."""


T = TypeVar("T")
"""Type of a block of work."""


class PathBlocks(NamedTuple):
    """Division of an ensemble's paths into blocks: ``paths_per_block`` each, at most ``blocks_ahead`` blocks computed
    at once."""

    paths_per_block: int = PATHS_PER_BLOCK
    blocks_ahead: int = BLOCKS_AHEAD

    def count(self, path_count: int) -> int:
        """Number of blocks for a number of paths."""
        return -(-path_count // self.paths_per_block)

    def block(self, block_number: int, path_count: int) -> range:
        """Numbers of the paths in a block."""
        return range(block_number * self.paths_per_block, min((block_number + 1) * self.paths_per_block, path_count))


DEFAULT_BLOCKS = PathBlocks()
"""Default division of paths into blocks."""


class PathJob(Protocol):
    """Protocol of a computation that an ensemble repeats for each path; it must survive pickling."""

    def __call__(self, path_numbers: range, /) -> ArraysByName:
        """Named arrays with the results of these paths; their first axis runs over the paths."""
        ...

    def facts(self) -> dict[str, Any]:
        """All inputs that determine the result of the job: numbers, text, arrays, and dictionaries of these."""
        ...


class PathFailed(RuntimeError):
    """Error for a path that could not be computed, with its number, so that the message can name the path."""

    def __init__(self, path_number: int, reason: str) -> None:
        super().__init__(path_number, reason)

    def __str__(self) -> str:
        """Number of the path and reason, as text."""
        return f"path {self.args[0]}: {self.args[1]}"


@dataclass(frozen=True)
class EnsembleProgress:
    """Progress of an ensemble: finished and all paths, paths per second, seconds left (infinite at first)."""

    done: int
    paths: int
    rate: float
    seconds_left: float

    def __str__(self) -> str:
        """Finished paths, rate and time left, as text."""
        left = f", {self.seconds_left:.0f} s left" if self.rate else ""
        return f"{self.done} of {self.paths} paths, {self.rate:.3g} per second{left}"


@dataclass(frozen=True)
class _Failure:
    """Failure that a worker returns instead of results, since many exceptions cannot be sent between processes."""

    reason: str
    disk_is_full: bool = False
    worker_is_gone: bool = False
    error: InputError | RunFailed | None = None


@dataclass
class _MemoryStore:
    """Store of finished blocks in memory only."""

    blocks: dict[int, ArraysByName] = field(default_factory=dict)

    def has(self, block_number: int) -> bool:
        return block_number in self.blocks

    def save(self, block_number: int, arrays: ArraysByName) -> None:
        self.blocks[block_number] = arrays

    def load(self, block_number: int) -> ArraysByName:
        return self.blocks.pop(block_number)


@dataclass
class _PathCounter:
    """Counter of finished paths that reports the progress and the time left."""

    paths: int
    done: int
    report: Callable[[EnsembleProgress], None]
    start_time: float = field(default_factory=time.perf_counter)
    done_at_start: int = 0

    def __post_init__(self) -> None:
        self.done_at_start = self.done
        self.report(EnsembleProgress(self.done, self.paths, 0.0, math.inf if self.done < self.paths else 0.0))

    def add(self, path_count: int) -> None:
        self.done += path_count
        rate = (self.done - self.done_at_start) / (time.perf_counter() - self.start_time)
        self.report(EnsembleProgress(self.done, self.paths, rate, (self.paths - self.done) / rate))


def run_paths(
    path_job: PathJob,
    path_count: int,
    store_folder: Path | None = None,
    executor: Executor | None = None,
    path_blocks: PathBlocks = DEFAULT_BLOCKS,
    report_progress: Callable[[EnsembleProgress], None] = lambda state: None,
    replacement_of_failed: Callable[[range, str], ArraysByName] | None = None,
) -> ArraysByName:
    """Arrays of all paths 0 to ``path_count`` - 1 by name; bitwise identical on any executor and after interruptions.

    The arguments are those of ``arrays_by_block``.
    """
    arrays = list(
        arrays_by_block(
            path_job, path_count, store_folder, executor, path_blocks, report_progress, replacement_of_failed
        )
    )
    return {name: np.concatenate([block[name] for block in arrays]) for name in arrays[0]}


def arrays_by_block(
    path_job: PathJob,
    path_count: int,
    store_folder: Path | None = None,
    executor: Executor | None = None,
    path_blocks: PathBlocks = DEFAULT_BLOCKS,
    report_progress: Callable[[EnsembleProgress], None] = lambda state: None,
    replacement_of_failed: Callable[[range, str], ArraysByName] | None = None,
) -> Generator[ArraysByName]:
    """Generator of the arrays of each block of paths 0 to ``path_count`` - 1, in order and as early as possible.

    store_folder : keeps every finished block; one that holds blocks of the same job is resumed, one of another job is
    an InputError that names the difference; None keeps them in memory until they are given. executor : a process pool
    (``process_pool``), a Dask cluster (``dask_workers``), a thread pool; None computes here. A block that fails does
    not stop the others, and one that loses its worker is computed again: RunFailed then names the blocks and paths
    that are left, and what is finished is kept. A full disk ends it at once, with RunFailed. replacement_of_failed :
    (paths, reason) -> what stands for a block that failed, in place of RunFailed; it is not kept: resuming tries again.
    """
    facts = {"paths": path_count, "paths per block": path_blocks.paths_per_block, **path_job.facts()}
    count, block = path_blocks.count(path_count), partial(path_blocks.block, path_count=path_count)
    store = _MemoryStore() if store_folder is None else BlockStore(store_folder)
    with nullcontext() if isinstance(store, _MemoryStore) else store.reserved_folder(facts):
        failed = dict[int, str]()
        counted = _PathCounter(path_count, sum(len(block(i)) for i in range(count) if store.has(i)), report_progress)
        missing = ((i, block(i)) for i in range(count) if not store.has(i))
        answers = _answers_of_blocks(path_job, missing, executor, path_blocks.blocks_ahead)
        with closing(answers):  # an interrupt drops at once what waits
            blocks_given = 0
            while blocks_given < count:
                if store.has(blocks_given) and not failed:
                    yield store.load(blocks_given)
                    blocks_given += 1
                elif replacement_of_failed is not None and (store.has(blocks_given) or blocks_given in failed):
                    yield (
                        replacement_of_failed(block(blocks_given), failed[blocks_given])
                        if blocks_given in failed
                        else store.load(blocks_given)
                    )
                    blocks_given += 1
                elif not _store_next_answer(answers, store, failed, counted):
                    break
        if failed and replacement_of_failed is None:
            raise _failed_blocks_error({i: (block(i), reason) for i, reason in failed.items()}, store_folder)


def values_in_order(
    block_function: Callable[[T], Any],
    blocks: Iterator[T],
    executor: Executor | None = None,
    block_store: BlockStore | None = None,
    blocks_ahead: int = BLOCKS_AHEAD,
) -> Generator[tuple[T, Any]]:
    """Generator of pairs of a block and the function's value, in the order of the blocks and as early as possible.

    The blocks are read as they are needed, ``blocks_ahead`` of them at most. block_store : keeps what is finished, of a
    folder that the caller has claimed, and takes named arrays alone; what it has is not computed. Raises RunFailed for
    the first block that fails.
    """
    values_by_index: BlockStore | _MemoryStore = _MemoryStore() if block_store is None else block_store
    numbered, blocks_by_index, block_index = enumerate(blocks), dict[int, T](), 0
    for block_index, block in numbered:
        blocks_by_index[block_index] = block
        if not values_by_index.has(block_index):
            break
        yield blocks_by_index.pop(block_index), values_by_index.load(block_index)

    def unfinished_blocks() -> Iterator[tuple[int, T]]:
        for i, block in chain([*blocks_by_index.items()], numbered):
            blocks_by_index[i] = block
            if not values_by_index.has(i):
                yield i, block

    with closing(_answers_of_blocks(block_function, unfinished_blocks(), executor, blocks_ahead)) as answers:
        for i, _, answer in answers:
            if isinstance(answer, _Failure):
                raise (_disk_full_error if answer.disk_is_full else _lost_workers_error)(
                    f"block {i}: {answer.reason}", values_by_index
                )
            _save_block(values_by_index, i, answer)
            while block_index in blocks_by_index and values_by_index.has(block_index):
                yield blocks_by_index.pop(block_index), values_by_index.load(block_index)
                block_index += 1
    for i in sorted(blocks_by_index):
        yield blocks_by_index[i], values_by_index.load(i)


def block_results(
    block_function: Callable[[T], Any], blocks: Iterable[T], executor: Executor | None = None
) -> list[Any]:
    """List of the function's values for a few blocks, in the order of the blocks.

    Raises what the function raises for the first block that fails: InputError and RunFailed as they are, by whatever
    executor; any other error is a RunFailed where an executor computes.
    """
    if executor is None:
        return [block_function(block) for block in blocks]
    with closing(_answers_of_blocks(block_function, iter(enumerate(blocks)), executor, BLOCKS_AHEAD)) as answers:
        answers_by_index = {i: answer for i, _, answer in answers}
    ordered = [answers_by_index[i] for i in sorted(answers_by_index)]
    for answer in ordered:
        if isinstance(answer, _Failure):
            raise answer.error or RunFailed("ensemble", answer.reason)
    return ordered


def _store_next_answer(
    block_answers: Iterator[tuple[int, range, ArraysByName | _Failure]],
    block_store: BlockStore | _MemoryStore,
    failed_blocks: dict[int, str],
    path_counter: _PathCounter,
) -> bool:
    """Store the next block that is finished, or record why it failed; returns False when no block is left."""
    i, block, answer = next(block_answers, (-1, range(0), _Failure("")))
    if i < 0:
        return False
    if isinstance(answer, _Failure):
        if answer.disk_is_full:
            raise _disk_full_error(answer.reason, block_store)
        if answer.worker_is_gone:
            raise _lost_workers_error(answer.reason, block_store)
        failed_blocks[i] = answer.reason
        return True
    _save_block(block_store, i, answer)
    path_counter.add(len(block))
    return True


def _failed_blocks_error(failed_blocks: dict[int, tuple[range, str]], store_folder: Path | None) -> RunFailed:
    """RunFailed that lists the failed blocks and paths."""
    failure_texts = [
        f"block {i} (paths {block[0]} to {block[-1]}): {reason}" for i, (block, reason) in failed_blocks.items()
    ]
    folder_hint = "" if store_folder is None else f"; the finished blocks are kept in {store_folder}: resume there"
    further_text = (
        (f"; {len(failed_blocks) - NAMED_FAILURE_COUNT} more blocks")
        if len(failed_blocks) > NAMED_FAILURE_COUNT
        else ""
    )
    return RunFailed("ensemble", "; ".join(failure_texts[:NAMED_FAILURE_COUNT]) + further_text + folder_hint)


def _answers_of_blocks(
    block_function: Callable[[T], ArraysByName],
    unfinished_blocks: Iterator[tuple[int, T]],
    executor: Executor | None,
    blocks_ahead: int,
) -> Generator[tuple[int, T, ArraysByName | _Failure]]:
    """Generator of blocks and their results or failures, in order of completion; at most ``blocks_ahead`` blocks are
    computed at once, and none is begun ``blocks_ahead`` or more after the first unfinished one."""
    if executor is None:
        yield from ((i, block, _compute_block(block_function, block)) for i, block in unfinished_blocks)
        return
    blocks_ahead = blocks_ahead if blocks_ahead == 1 else max(blocks_ahead, 2 * getattr(executor, "width", 0))
    queue, single_blocks = deque(islice(unfinished_blocks, blocks_ahead)), deque[tuple[int, T]]()
    lost, waiting = Counter[int](), dict[Future, tuple[int, T]]()
    try:
        while queue or single_blocks or waiting:
            while (queue and _may_begin(queue[0][0], waiting, single_blocks, blocks_ahead)) or (
                single_blocks and not waiting
            ):
                i, block = (queue or single_blocks).popleft()
                waiting[_submitted_block(executor, block_function, block)] = i, block
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                i, block = waiting.pop(future)
                error = _future_error(future)
                died = _worker_died(error)
                if died:
                    lost[i] += 1
                if died and lost[i] < MOST_WORKER_LOSSES:
                    (single_blocks if lost[i] >= AMONG_OTHERS else queue).appendleft((i, block))
                else:
                    yield i, block, future.result() if error is None else _failure_of(error)
            queue.extend(islice(unfinished_blocks, max(blocks_ahead - len(queue), 0)))
    finally:
        for future in waiting:
            future.cancel()


def _may_begin(
    block_number: int,
    running_blocks: dict[Future, tuple[int, T]],
    single_blocks: Collection[tuple[int, T]],
    blocks_ahead: int,
) -> bool:
    """Whether block ``block_number`` may be started now: fewer than ``blocks_ahead`` are running, and it is less than
    ``blocks_ahead`` after the first unfinished one."""
    first = min((other_index for other_index, _ in (*running_blocks.values(), *single_blocks)), default=block_number)
    return len(running_blocks) < blocks_ahead and block_number < first + blocks_ahead


def _future_error(future: Future) -> BaseException | None:
    """Exception of a future, or None; the future of a lost cluster counts as cancelled."""
    try:
        return future.exception()
    except CancelledError as error:
        return error


def _worker_died(block_error: BaseException | None) -> bool:
    """Whether an error means that the block's worker died; Dask has its own exception for that."""
    return isinstance(block_error, BrokenExecutor) or type(block_error).__name__ == "KilledWorker"


def _save_block(block_store: BlockStore | _MemoryStore, block_number: int, arrays: ArraysByName) -> None:
    """Save the arrays of a block; RunFailed if the disk is full, since every other block would fail, too."""
    try:
        block_store.save(block_number, arrays)
    except OSError as error:
        if error.errno not in DISK_FULL_ERRORS:
            raise
        raise _disk_full_error(write_error_phrase(error), block_store) from None


def _disk_full_error(reason: str, block_store: BlockStore | _MemoryStore) -> RunFailed:
    """RunFailed for a full disk, with advice on how to resume."""
    folder_hint = (
        f"; the finished blocks are kept in {block_store.folder}: make room and resume"
        if isinstance(block_store, BlockStore)
        else ""
    )
    return RunFailed("ensemble", f"{reason}{folder_hint}")


def _lost_workers_error(reason: str, block_store: BlockStore | _MemoryStore) -> RunFailed:
    """RunFailed for lost workers, with advice on how to resume."""
    folder_hint = (
        (f"; the finished blocks are kept in {block_store.folder}: resume there")
        if isinstance(block_store, BlockStore)
        else ""
    )
    return RunFailed("ensemble", f"{reason}{folder_hint}")


def _submitted_block(executor: Executor, block_function: Callable[[T], ArraysByName], block_input: T) -> Future:
    """Future of a block on an executor; a failed future if the pool has lost its workers."""
    try:
        return executor.submit(_compute_block, block_function, block_input)
    except BrokenExecutor as error:
        lost: Future = Future()
        lost.set_exception(error)
        return lost


def _compute_block(block_function: Callable[[T], ArraysByName], block_input: T) -> ArraysByName | _Failure:
    """Arrays of one block, computed in the worker; a failure is returned instead of raised."""
    try:
        arrays = block_function(block_input)
    except Exception as error:
        return _failure_of(error)
    if not isinstance(block_input, range):
        return arrays
    short = [name for name, values in arrays.items() if len(values) != len(block_input)]
    return _Failure(f"{short[0]!r} has not one row per path") if short else arrays


def _failure_of(error: BaseException) -> _Failure:
    """The ``_Failure`` that describes an exception in a worker."""
    if _worker_died(error):
        return _Failure("its worker died: killed, or out of memory")
    if isinstance(error, CancelledError) or type(error).__name__ == "FutureCancelledError":
        return _Failure("the cluster is gone: its scheduler ended, or cannot be reached any more", worker_is_gone=True)
    full = isinstance(error, OSError) and error.errno in DISK_FULL_ERRORS
    message = str(error) if full or isinstance(error, PathFailed | RunFailed) else f"{type(error).__name__}: {error}"
    return _Failure(message, full, error=error if isinstance(error, InputError | RunFailed) else None)
