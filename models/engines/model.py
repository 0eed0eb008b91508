"""The engine protocol that all systems share."""

from typing import Protocol

import numpy as np

from models.core.trajectory import Trajectory


class Model(Protocol):
    """A vehicle in an engine, or as hand-written equations, together with its input and its time integration.

    Ride also needs a linear vehicle (``spatial_protocol``). A braked vehicle, whose wheels take smaller steps than its
    chassis, also needs single steps (``free_vehicle.FreeModel.march``). A wheelset on rails has a state that is not its
    coordinates and their rates, and marches of many lengths about one linearisation: it is
    ``rail.equations.Equations``, for which an engine gives accelerations and marches by a ``FreeModel``.
    """

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) in m/s^2 and rad/s^2 at a time (s), from coordinates and rates (n,)."""
        ...

    def run(self) -> Trajectory:
        """Trajectory over the whole duration; RunFailed unless it is complete, finite and sane."""
        ...

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        ...
