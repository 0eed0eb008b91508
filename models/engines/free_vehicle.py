"""A free vehicle in an engine: what is the same in every engine.

The engine has the bodies, their joints and weights; all forces come from one compiled kernel of (numbers, time,
positions, rates, forces), the last three pointers to doubles in the order of the vehicle's coordinates, as
``models.handling.forces.forces`` is one. Both engines march by the classical Runge-Kutta method.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from models.engines.spatial_protocol import SpatialRun
from models.vehicles.spatial import SpatialVehicle


@dataclass(frozen=True, eq=False)
class Driven:
    """vehicle : its bodies right before those that ride on them (``vehicles.free_vehicle``); gravity (3,) in m/s^2.

    numbers : table of doubles that the kernel reads; kernel : compiled function that adds to the forces; block :
    compiled function of (address, time, n) that clears and fills the forces of a block f, q, v (n,) and numbers.
    """

    vehicle: SpatialVehicle
    gravity: np.ndarray
    numbers: np.ndarray
    kernel: Any
    block: Any

    @property
    def size(self) -> int:
        """How many coordinates there are."""
        return len(self.vehicle.coordinates())


class FreeModel(Protocol):
    """A free vehicle built in one engine."""

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), positions and rates (n,)."""
        ...

    def run(self, q: np.ndarray, v: np.ndarray, duration: float, step: float) -> SpatialRun:
        """March from positions and rates (n,); states at every step. RunFailed unless all of it is finite."""
        ...
