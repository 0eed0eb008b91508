"""A controller that releases a wheel that slips."""

import numpy as np

from models.brake.controller import Command


class Releases:
    """Controller that releases slipping wheels and else applies. ``below``: ratio of a wheel's rim speed to the fastest
    one's below which it counts as slipping."""

    def __init__(self, wheel_count, below=0.8):
        self.below = below

    def sample(self, sensor_sample):
        """Valve commands of a sample: -1 releases, 1 applies."""
        slow = np.asarray(sensor_sample.wheels) < self.below * np.max(sensor_sample.wheels)
        return Command(valves=np.where(slow, -1, 1))
