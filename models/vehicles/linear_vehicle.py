"""Linear equations of motion of a vehicle on a road, from which every ride analysis starts, whoever has linearised
them."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class WheelPosition:
    """Position of a wheel on the road: x (m) forward, y (m) to the left, and the number of its axle, 0 the
    frontmost."""

    name: str
    x: float
    y: float
    axle: int


@dataclass(frozen=True)
class LinearOutput:
    """Output quantity of a linear vehicle: a linear function of the vehicle's motion and of the road.

    acceleration_factors, rate_factors, displacement_factors (n,): of q'', q', q. road_factors, road_rate_factors (w,):
    of the heights under the wheels (m) and of their rates (m/s). ``kind`` says what it is ("acceleration", "travel",
    "force", ...).
    """

    name: str
    unit: str
    kind: str
    acceleration_factors: np.ndarray
    rate_factors: np.ndarray
    displacement_factors: np.ndarray
    road_factors: np.ndarray
    road_rate_factors: np.ndarray


class OutputRows(NamedTuple):
    """Factors of all outputs of a linear vehicle as matrices, each row that of one ``LinearOutput``: (p, n), and (p, w)
    for those of the road."""

    acceleration_factors: np.ndarray
    rate_factors: np.ndarray
    displacement_factors: np.ndarray
    road_factors: np.ndarray
    road_rate_factors: np.ndarray


@dataclass(frozen=True)
class LinearVehicle:
    """Linear equations of motion of a vehicle, M q'' + D q' + K q = R z + S z', with road heights z (w,) under the
    wheels (m, up).

    mass, damping, stiffness (n, n); road_stiffness R (n, w) in N/m, road_damping S (n, w) in N s/m. ``coordinates``
    names the n freedoms as (body, freedom). ``source`` says who linearised ("analytic", "exudyn", "mujoco") and where.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    road_stiffness: np.ndarray
    road_damping: np.ndarray
    coordinates: tuple[tuple[str, str], ...]
    wheels: tuple[WheelPosition, ...]
    outputs: tuple[LinearOutput, ...]
    source: str = "analytic"

    @property
    def axles(self) -> tuple[float, ...]:
        """Positions x (m) of the axles, the front one first."""
        places = {wheel.axle: wheel.x for wheel in self.wheels}
        return tuple(places[i] for i in sorted(places))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(output.name for output in self.outputs)

    @cached_property
    def read(self) -> OutputRows:
        """``OutputRows`` with the factors of all outputs."""
        return OutputRows(
            *(np.array([getattr(output, factor) for output in self.outputs]) for factor in OutputRows._fields)
        )


def eigenvalues(vehicle: LinearVehicle) -> np.ndarray:
    """Eigenvalues (2 n,) of a linear vehicle in 1/s in order of increasing magnitude; of a conjugate pair, the
    eigenvalue with negative imaginary part comes first."""
    n = len(vehicle.mass)
    motion = np.linalg.solve(vehicle.mass, np.hstack([-vehicle.stiffness, -vehicle.damping]))
    values = np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), motion]))
    return values[np.lexsort((values.imag, np.round(np.abs(values), 6)))]


def eigenvalue_shifts(unloaded_vehicle: LinearVehicle, loaded_vehicle: LinearVehicle) -> np.ndarray:
    """Complex change (1/s) of each eigenvalue (2 n,) of the unloaded vehicle by the load.

    Eigenvalues of both vehicles are paired such that the sum of all distances is smallest.
    """
    from scipy.optimize import linear_sum_assignment

    before, after = eigenvalues(unloaded_vehicle), eigenvalues(loaded_vehicle)
    rows, columns = linear_sum_assignment(np.abs(before[:, None] - after[None, :]))
    return after[columns] - before[rows]
