"""One random scene whose stated error is held against a much finer run."""

from collections.abc import Mapping
from dataclasses import dataclass

from models.core.discretisation import Estimate


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
        """The channel that the screen names: that of the largest share."""
        return max(self.told, key=lambda channel: self.told[channel].share)

    @property
    def ratio(self) -> float:
        """True error by the stated one, of the printed channel."""
        return self.true[self.printed] / self.told[self.printed].error
