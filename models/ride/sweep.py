"""Variances of all outputs over cases of correlation and speeds, by the fast route where it is exact enough."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from models.ride.covariance import FINITE, Covariance, hits, stationary, verdicts
from models.ride.delayed_system import DelayedSystem
from models.ride.excited import excited
from models.ride.marginal import ACCURACY, Growth, Unstable
from models.ride.modal import Shared, modal
from models.ride.weighting import weighted
from models.road.excitation import Excitation
from models.vehicles.linear_vehicle import LinearVehicle

LOSS = 1e-9
"""Largest relative error that the fast route may suspect of itself; it overstates it ten to a thousand times."""


@dataclass(frozen=True)
class Sweep:
    """variance (cases, speeds, outputs), inf where there is none, with status and reason for each.

    ``direct``: how many of the points went the direct way, by the reason for which the fast one was not taken.
    """

    cases: tuple[str, ...]
    speeds: np.ndarray
    outputs: tuple[str, ...]
    variance: np.ndarray
    status: np.ndarray
    reason: np.ndarray
    direct: Mapping[str, int]

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (cases, speeds, outputs)."""
        return np.sqrt(self.variance)

    def of(self, case: str, output: str) -> np.ndarray:
        """Standard deviation of one output over the speeds."""
        return self.deviation[self.cases.index(case), :, self.outputs.index(output)]


def sweep(
    vehicle: Callable[[float], LinearVehicle],
    excitations: Mapping[str, Excitation],
    speeds: Sequence[float] | np.ndarray,
    filters: Mapping[str, str] | None = None,
    accuracy: float = ACCURACY,
    fast: bool = True,
) -> Sweep:
    """Stationary variances of a vehicle, given as a function of the speed (m/s), on each road at each speed.

    filters : weightings by output, as ``weighted`` takes them. fast : False sends every point the direct way.
    Raises Unstable.
    """
    shared = Shared()
    direct: dict[str, int] = {}
    names: tuple[str, ...] = ()
    shape = (len(excitations), len(speeds))
    found = np.empty(shape, object)
    for j, speed in enumerate(speeds):
        at_speed = vehicle(speed)
        for i, excitation in enumerate(excitations.values()):
            plain = excited(at_speed, excitation, speed)
            system = weighted(plain, filters or {})
            states = len(plain.A) - len(plain.B) * len(excitation.F)
            point = _quick(system, states, excitation, speed, shared, accuracy) if fast else ASKED
            if isinstance(point, str):
                direct[point] = direct.get(point, 0) + 1
                exact = _stationary(system, speed, accuracy)
                point = exact.variance, exact.status, exact.reason
            found[i, j], names = point, system.names
    variance, status, reason = (np.array([[point[part] for point in row] for row in found]) for part in range(3))
    return Sweep(tuple(excitations), np.array(speeds), names, variance, status, reason, direct)


def _stationary(system: DelayedSystem, speed: float, accuracy: float) -> Covariance:
    """The direct answer; a vehicle that is unstable is told with its speed."""
    try:
        return stationary(system, accuracy)
    except Unstable as error:
        raise Unstable(error.growth, error.frequency, speed) from None


ASKED = "asked for"
"""Reason of a direct answer that was wanted."""


def _quick(
    system: DelayedSystem, states: int, excitation: Excitation, speed: float, shared: Shared, accuracy: float
) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]] | str:
    """Variance, status and reason of every output by the fast route, or why it cannot be trusted here."""
    quick = modal(system, states, excitation.F, speed, shared)
    if isinstance(quick, str):
        return quick
    D = hits(system)[1]
    none = Growth(np.zeros(len(system.C)), np.zeros(len(system.C), int))
    status, reason = verdicts(D, quick.variance, quick.floor, none, quick.fastest, accuracy)
    finite = np.array([found == FINITE for found in status])
    if (quick.loss[finite] > LOSS).any():
        return "terms cancel"
    return np.where(finite, quick.variance, np.inf), status, reason
