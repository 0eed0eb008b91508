"""Whether the steps of a run were short enough for its springs and mounts: half of them, for a while, tells.

A run reads its road or its forces at half steps. What changes faster between them is not resolved but mistaken for
something slower, which no state of the run shows: one that reads twice as often does.
"""

from collections.abc import Callable

import numpy as np

from models.core.errors import RunFailed
from models.engines.cut_vehicle import HubRun

WINDOW = 1.0
"""s: time of the start over which the run is repeated."""
ALLOWED = 0.02
"""Change of an element's force by half the step, by the largest of it: 94 % of a fourth-order error."""
LEAST = 1e-3
"""Share of the largest force of all elements that counts as the largest of one that hardly carries anything."""


def check_halved(engine: str, run: HubRun, names: list[str], again: Callable[[float, int], HubRun]) -> None:
    """Raise RunFailed where the steps were too long; again : (step in s, steps) -> the same run with these.

    A vehicle that has no springs, mounts or bars has nothing that a step could be too long for.
    """
    if not names:
        return
    step = float(run.times[1] - run.times[0])
    rows = min(len(run.times) - 1, max(2, round(WINDOW / step)))
    fine = again(step / 2.0, 2 * rows).elements[::2]
    largest = np.abs(fine).max(axis=0)
    changes = np.abs(fine - run.elements[: rows + 1]).max(axis=0) / np.maximum(largest, LEAST * largest.max())
    worst = int(changes.argmax())
    if not changes[worst] <= ALLOWED:
        raise RunFailed(
            engine,
            f"steps of {step:g} s are too long: half of them change the force of "
            f"{names[worst]!r} by {changes[worst]:.2g} of its largest; use a smaller step",
        )
