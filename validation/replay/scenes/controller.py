"""A controller that releases a wheel that slips."""

import numpy as np

from models.brake.controller import Command


class Releases:
    """Holds no state; ``below``: rim speed by the fastest one's, under which a wheel slips."""

    def __init__(self, wheels, below=0.8):
        self.below = below

    def sample(self, given):
        """States of the valves."""
        slow = np.asarray(given.wheels) < self.below * np.max(given.wheels)
        return Command(valves=np.where(slow, -1, 1))
