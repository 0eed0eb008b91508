"""One random scene whose stated error is held against a much finer run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.core.discretisation import Estimate
from models.core.errors import InputError, RunFailed


@dataclass(frozen=True)
class Sample:
    """One test of a stated error. name : scene with its random values; told : errors that the result states, by
    channel, empty where it states none; true : root mean square error against the truth, for the same channels and
    units.

    calls, extra_calls : force evaluations (cells, frequencies) of the run and of its estimate.
    """

    name: str
    engine: str
    told: Mapping[str, Estimate]
    true: Mapping[str, float]
    calls: float
    extra_calls: float

    @property
    def printed(self) -> str:
        """Name of the channel whose error is printed: the one with the largest share (``Estimate.share``)."""
        return max(self.told, key=lambda channel: self.told[channel].share)

    @property
    def ratio(self) -> float:
        """Ratio of the true to the stated error of the printed channel."""
        return self.true[self.printed] / self.told[self.printed].error


def drawn_samples(
    sample_count: int, seed: int | Sequence[int], draw: Callable[[np.random.Generator], Sample | None]
) -> Iterator[Sample]:
    """Samples from ``draw``, ``sample_count`` of them; it is called again where a scene is refused, a run fails, or it
    gives nothing.
    """
    random, samples_made = np.random.default_rng(seed), 0
    while samples_made < sample_count:
        try:
            sample = draw(random)
        except (InputError, RunFailed):
            continue
        if sample is not None:
            samples_made += 1
            yield sample
