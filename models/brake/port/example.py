"""The controller that the examples of the port are: slip bang-bang, in Python as in ``client_example.c``."""

import numpy as np

from models.brake.controller import Command, Sample


class Example:
    """Releases above 15 % slip, applies below 8 %, and between them goes on with what it did; needs the given speed."""

    def __init__(self, wheels: int) -> None:
        self._valves = np.ones(wheels, dtype=np.int64)

    def sample(self, sample: Sample) -> Command:
        """States of the valves."""
        slip = 1.0 - sample.wheels / max(sample.speed, 0.1)
        self._valves[slip > 0.15] = -1
        self._valves[slip < 0.08] = 1
        return Command(valves=self._valves.copy())
