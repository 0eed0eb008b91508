"""Progress of a long simulation for a progress bar; nothing is computed unless a bar is shown."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

PROGRESS_FUNCTIONS: list[Callable[[], float]] = []
"""Functions that return the completed share of each running simulation, the innermost simulation last."""


@contextmanager
def report_simulation_progress(completed_share: Callable[[], float]) -> Iterator[None]:
    """Context of a running simulation; ``completed_share`` is a function that returns the completed share, 0 to 1.
    Another thread may call it at any time."""
    PROGRESS_FUNCTIONS.append(completed_share)
    try:
        yield
    finally:
        PROGRESS_FUNCTIONS.remove(completed_share)
