"""One random scene whose stated error is held against a much finer run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.core.discretisation import Estimate
from models.core.errors import InputError, RunFailed


@dataclass(frozen=True)
class Sample:
    """name : of the scene, with what was drawn; told : what the result says, by channel, empty where it says why there
    is no number; true : root mean square of the difference from the truth, by the same channels and units.

    calls, extra : force evaluations (cells, frequencies) of the run and of its estimate.
    """

    name: str
    engine: str
    told: Mapping[str, Estimate]
    true: Mapping[str, float]
    calls: float
    extra: float

    @property
    def printed(self) -> str:
        """Name of the channel whose error is printed: the one with the largest share (``Estimate.share``)."""
        return max(self.told, key=lambda channel: self.told[channel].share)

    @property
    def ratio(self) -> float:
        """True error by the stated one, of the printed channel."""
        return self.true[self.printed] / self.told[self.printed].error


def drawn(
    count: int, seed: int | Sequence[int], draw: Callable[[np.random.Generator], Sample | None]
) -> Iterator[Sample]:
    """So many samples; ``draw`` is asked anew where a scene is refused, a run fails, or nothing comes of it."""
    random, made = np.random.default_rng(seed), 0
    while made < count:
        try:
            sample = draw(random)
        except (InputError, RunFailed):
            continue
        if sample is not None:
            made += 1
            yield sample
