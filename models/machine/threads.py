"""Number of threads of linear algebra: one per process, since matrices are small and several processes share the
cores."""

import os
import sys

VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables that libraries of linear algebra read when they are loaded."""


def use_one_thread() -> None:
    """Give linear algebra one thread in this process and its child processes, unless the user has set a number.

    Threads that wait for one another on busy cores make products of small matrices several times slower. A library
    that is loaded already, as where a script imports numpy first, is told directly.
    """
    if any(name in os.environ for name in VARIABLES):
        return
    os.environ.update(dict.fromkeys(VARIABLES[:2], "1"))
    if "numpy" in sys.modules:
        from threadpoolctl import threadpool_limits

        threadpool_limits(1, "blas")
