"""Samples that compare the error stated by a run of a random scene with the true error, from a much finer run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.core.discretisation import Estimate
from models.core.errors import InputError, RunFailed


@dataclass(frozen=True)
class Sample:
    """Comparison of the stated and the true error of a run. name : scene with its random values; stated_errors : errors
    that the result states, by channel, empty if it states none; true_errors : root mean square error against a finer
    run, for the same channels and units.

    calls, extra_calls : force evaluations (cells, frequencies) of the run and of its estimate.
    """

    name: str
    engine: str
    stated_errors: Mapping[str, Estimate]
    true_errors: Mapping[str, float]
    calls: float
    extra_calls: float

    @property
    def printed_channel(self) -> str:
        """Name of the channel whose stated error is printed: it has the largest relative error (``Estimate.share``)."""
        return max(self.stated_errors, key=lambda channel: self.stated_errors[channel].share)

    @property
    def ratio(self) -> float:
        """Ratio of the true to the stated error of the channel whose error is printed."""
        return self.true_errors[self.printed_channel] / self.stated_errors[self.printed_channel].error


def random_samples(
    sample_count: int, seed: int | Sequence[int], draw_sample: Callable[[np.random.Generator], Sample | None]
) -> Iterator[Sample]:
    """Yield ``sample_count`` samples made by ``draw_sample`` from a random generator; ``draw_sample`` is called again
    if a scene is refused, a run fails, or it returns None.
    """
    generator, samples_made = np.random.default_rng(seed), 0
    while samples_made < sample_count:
        try:
            sample = draw_sample(generator)
        except (InputError, RunFailed):
            continue
        if sample is not None:
            samples_made += 1
            yield sample
