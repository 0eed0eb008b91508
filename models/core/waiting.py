"""Progress of a long run for a bar that someone may watch; nothing is computed unless someone does."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

SHARES_OF_MARCHES: list[Callable[[], float]] = []
"""Shares of the marches that are under way, the innermost last."""


@contextmanager
def marching(share: Callable[[], float]) -> Iterator[None]:
    """Context of a running simulation; share : function that returns the completed fraction, 0 to 1. Another thread may
    call it at any time."""
    SHARES_OF_MARCHES.append(share)
    try:
        yield
    finally:
        SHARES_OF_MARCHES.remove(share)
