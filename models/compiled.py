"""Compiling with numba, its machine code kept on disk where several processes may write at the same time.

numba numbers the files of a function's signatures from its index. Two processes that compile two signatures at once
then write the same file, and each later loads the other's machine code: a wrong answer without a word. Here every
file has a name of its own; if an entry of the index is lost, the function is compiled again.
"""

from collections.abc import Callable
from typing import Any
from uuid import uuid4

import numba


def njit(**options: Any) -> Callable[[Callable], Any]:
    """``numba.njit`` with these options; with ``cache=True`` its files are safe from other processes."""
    return lambda function: _kept_apart(numba.njit(**options)(function))


def _kept_apart(compiled: Any) -> Any:
    """The compiled function, the files of its signatures named after nobody's count."""
    file = getattr(compiled._cache, "_cache_file", None)  # there is none where nothing is kept
    if file is not None:
        stem = file._index_name.removesuffix(".nbi")
        file._data_name = lambda number: f"{stem}.{uuid4().hex[:12]}.nbc"
    return compiled
