"""Trajectory of a simulated vehicle, as every engine and every system returns it."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Simulated motion: times (m,) in s; states (m, 2 n), that is coordinates of the vehicle (m, rad), then their
    rates; counts of the computing work.

    enforced (m, guided coordinates): force on the chassis (N, down), where its heave is prescribed, and moment
    (N m, nose up); None where nothing is.
    """

    times: np.ndarray
    states: np.ndarray
    enforced: np.ndarray | None = None
    counts: dict[str, int] = field(default_factory=dict)

    @property
    def positions(self) -> np.ndarray:
        """Coordinates (m, n) in m and rad."""
        return self.states[:, : self.states.shape[1] // 2]

    @property
    def rates(self) -> np.ndarray:
        """Rates (m, n) of the coordinates in m/s and rad/s."""
        return self.states[:, self.states.shape[1] // 2 :]

    @property
    def moment(self) -> np.ndarray | None:
        """Moment (m,) in N m that enforces the prescribed pitch."""
        return None if self.enforced is None else self.enforced[:, -1]

    @property
    def force(self) -> np.ndarray | None:
        """Force (m,) in N, positive down, that enforces the prescribed heave; None where only the pitch is
        prescribed."""
        return None if self.enforced is None or self.enforced.shape[1] < 2 else self.enforced[:, 0]
