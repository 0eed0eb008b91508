"""Example controller of the port: slip control by two thresholds, in Python as in ``client_example.c``."""

import numpy as np

from models.brake.controller import Command, Sample


class Example:
    """Controller that releases above 15 % slip, applies below 8 %, and keeps its last command between them; needs the
    vehicle's speed.
    """

    def __init__(self, wheels: int) -> None:
        self._valves = np.ones(wheels, dtype=np.int64)

    def sample(self, sample: Sample) -> Command:
        """Commands with the states of the valves for a sample."""
        slip = 1.0 - sample.wheels / max(sample.speed, 0.1)
        self._valves[slip > 0.15] = -1
        self._valves[slip < 0.08] = 1
        return Command(valves=self._valves.copy())
