"""Another machine: five times as slow as this one and busy, by what its clocks say.

``begin`` must be called by a fresh process, before anything of the project is imported there.
"""

import random
import time


class Clock:
    """Told seconds of a clock: of each stretch between two readings from once to nine times as many."""

    def __init__(self, real, seed):
        self.real, self.draw = real, random.Random(seed)
        self.last = self.told = real()

    def __call__(self):
        now = self.real()
        self.told += (now - self.last) * self.draw.uniform(1.0, 9.0)
        self.last = now
        return self.told


def begin():
    """From now on this process reads such clocks."""
    time.perf_counter, time.process_time = Clock(time.perf_counter, 1), Clock(time.process_time, 2)


def rows(case, quick, folder, fewer=None):
    """Id, status and reason of all rows of a case, with other values ``fewer`` of its module's constants, by name."""
    return answer(case, quick, folder, fewer)[0]


def answer(case, quick, folder, fewer=None):
    """Id, status and reason of all rows of a case, and the case's data."""
    from contextlib import ExitStack
    from importlib import import_module
    from unittest.mock import patch

    module = import_module(f"validation.cases.{case}")
    with ExitStack() as within:
        for name, value in (fewer or {}).items():
            within.enter_context(patch.object(module, name, value))
        judged_rows, data = module.measure(quick, folder)
    return [(row.id, row.status, row.reason) for row in judged_rows], data


def judged(kind):
    """The row that a tenth of a second of ``kind`` by the true clock gives, judged by the clock that is told."""
    from validation.common.rows import Observed

    clock = getattr(time, kind)
    start, real = clock(), clock.real()
    while clock.real() < real + 0.1:
        clock()
    seconds = 10.0 * (clock() - start)
    return Observed("planted.seconds", "cost", "seconds of a tenth of one, times ten", seconds, "s").at_most(
        1.5, "", "none"
    )
