"""Who computes: processes of this machine that outlive one of their number, or a Dask cluster."""

import ctypes
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any

from models.core.errors import InputError
from models.machine.left_out import let_in

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Options of glibc's mallopt, from its malloc.h."""
KEPT_MEMORY = 1 << 28
"""Bytes that a worker keeps for its next array."""


class Processes(Executor):
    """A process pool that starts fresh workers where some have died, and takes them along when it ends in an error.

    A pool of the standard library is lost with the first worker that is killed; and where its parent is killed, its
    workers wait for ever. These end as soon as the far end of their pipe is closed, by whatever closes it.
    """

    def __init__(self, workers: int) -> None:
        self._workers, self._context = workers, get_context("spawn")
        self._theirs, self._ours = self._context.Pipe(duplex=False)
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        """Workers that start at once, with Ctrl-C held back, which they inherit.

        One that struck a worker while it imports would break the pool, and the process that keeps the blocks could
        wait for it for ever.
        """
        pool = ProcessPoolExecutor(
            self._workers, mp_context=self._context, initializer=_prepare_worker, initargs=(self._theirs,)
        )
        with _interrupts_held():
            for _ in range(self._workers):
                pool.submit(os.getpid)
        return pool

    def submit(self, function: Callable, /, *args: Any, **options: Any) -> Future:
        """Submit a function to the pool, as any executor does; fresh workers take it where the old ones have died."""
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

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if kind is not None:
            self._ours.close()  # nobody waits for what is not wanted any more
        self.shutdown(cancel_futures=kind is not None)


def processes(workers: int) -> Processes:
    """Workers that start fresh: engines and compilers keep threads that no fork survives."""
    return Processes(workers)


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


def _prepare_worker(pipe: Connection) -> None:
    """Leave Ctrl-C to the process that keeps the blocks, end with it, and keep freed memory.

    The C library otherwise returns every array of some megabytes to the system and gets fresh pages for the next
    one: a third of the time of a path of 60,000 steps. What a worker keeps is what one path needs, some 20 MB.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with, args=(pipe,), daemon=True).start()
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        for option in (M_TRIM_THRESHOLD, M_MMAP_THRESHOLD):
            mallopt(option, KEPT_MEMORY)


def _end_with(pipe: Connection) -> None:
    """End this process when the pipe's other end is closed, or gone with the process that held it."""
    with suppress(EOFError, OSError):
        pipe.recv_bytes()
    os._exit(1)


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of a Dask scheduler, such as ``tcp://host:8786``, where the same twinrig must be installed.

    Raises InputError where the extra ``cluster`` is not installed or nobody answers.
    """
    let_in("dask")
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
