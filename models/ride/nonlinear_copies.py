"""Monte Carlo of a vehicle whose springs are bent: many copies, each on a random road of its own, stepped in time.

Motion is small, as in ``spatial_linear``, but for the bent springs, whose forces are taken as they are. The classical
Runge-Kutta method reads the road at half steps; curves have corners, so its error falls with the square of the step.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.ride.excitation import Excitation
from models.ride.linear_vehicle import LinearVehicle
from models.ride.road_path import check_rates, road_path
from models.ride.statistical_linearisation import bent, statistically_linear
from models.vehicles.curve import Curve
from models.vehicles.spatial import PartOutput, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import Gains, linearise

REACH, STEEPEST = 0.25, 0.5
"""Step times the fastest rate, at most: of the replaced vehicle, and of the one with its springs as steep as they get.
Deviations of a quarter car are then too large by 0.05 to 0.1 %, by the covariance of the steps themselves."""
BLOCK = 200
"""Steps between two portions of road."""
EVERY = 4
"""Steps from one reading of the outputs to the next, which know of each other anyway."""
POWERS = np.arange(1, 5)[:, None, None]
"""Of the outputs that are averaged."""
SETTLE = 9.0
"""Slowest rate times the time that copies, begun at rest, run before they count."""
HELD = 1e-6
"""Share of the largest decay rate below which a motion counts as one that nothing pulls back."""


@dataclass(frozen=True)
class Copies:
    """Outputs of the copies in time: per copy (copies, p) the means of y, y^2, y^3 and y^4 over the counted time.

    step (s) of the runs, ``duration`` (s) that counts.
    """

    names: tuple[str, ...]
    moments: np.ndarray
    step: float
    duration: float

    @property
    def mean(self) -> np.ndarray:
        """Means (p,)."""
        return self.moments[0].mean(axis=0)

    @property
    def mean_error(self) -> np.ndarray:
        """Their standard errors (p,), from the scatter of the copies, which do not depend on each other."""
        return self.moments[0].std(axis=0, ddof=1) / len(self.moments[0]) ** 0.5

    @property
    def variance(self) -> np.ndarray:
        """Variances (p,) about the means."""
        return self._own().mean(axis=0)

    @property
    def error(self) -> np.ndarray:
        """Their standard errors (p,), likewise."""
        return self._own().std(axis=0, ddof=1) / len(self.moments[0]) ** 0.5

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (p,)."""
        return np.sqrt(self.variance)

    @property
    def kurtosis(self) -> np.ndarray:
        """Fourth moment about the mean by the square of the variance (p,): 3 for a Gaussian output."""
        first, second, third, fourth = self.moments.mean(axis=1)
        central = fourth - 4 * first * third + 6 * first**2 * second - 3 * first**4
        return central / self.variance**2

    def z(self, deviation: np.ndarray) -> np.ndarray:
        """How many standard errors (p,) the variance lies above that of these standard deviations (p,)."""
        return (self.variance - deviation**2) / self.error

    def _own(self) -> np.ndarray:
        """Each copy's mean square about the mean of all (copies, p)."""
        first, second = self.moments[:2]
        return second - 2 * self.mean * first + self.mean**2


def copies_in_time(vehicle: SpatialVehicle, excitation: Excitation, speed: float, duration: float, *,
                   copies: int = 500, seed: int = 0, longest: float | None = None) -> Copies:  # fmt: skip
    """Run the copies for ``duration`` (s) after they have forgotten their beginning.

    longest : largest step (s); by itself it comes from the fastest rates.
    Raises InputError for damped tyres on a road whose heights have no rates.
    """
    check_rates(vehicle, excitation)
    springs = bent(vehicle)
    plain = linearise(vehicle, speed, {s.name: (s.stiffness, s.damping) for s in springs})
    own = _rates(statistically_linear(vehicle, excitation, speed).vehicle)
    steepest = _rates(linearise(vehicle, speed, {s.name: _steepest(s) for s in springs}))
    decay = abs(own.real)
    slowest = decay[decay > HELD * decay.max()].min()
    road = road_path(excitation, speed, longest or min(REACH / abs(own).max(), STEEPEST / abs(steepest).max()))
    settling, counted = int(np.ceil(SETTLE / slowest / road.step)), int(np.ceil(duration / road.step))
    laws = _Laws(vehicle, plain, springs, speed)
    x, sums, seen = np.zeros((2 * len(plain.mass), copies)), np.zeros((4, len(plain.outputs), copies)), 0
    for number, portion in enumerate(road.blocks(BLOCK, copies, seed)):
        if number == 0:
            x[: len(plain.mass)] = _standing(plain, portion[0])
        for i in range(BLOCK):
            if (done := number * BLOCK + i) == settling + counted:
                return Copies(tuple(o.name for o in plain.outputs), sums.swapaxes(1, 2) / seen, road.step,
                              counted * road.step)  # fmt: skip
            rate, force = laws.rate(x, portion[2 * i])
            if done >= settling and (done - settling) % EVERY == 0:
                sums += laws.outputs(x, rate, portion[2 * i], force) ** POWERS
                seen += 1
            x = laws.stepped(x, rate, portion[2 * i + 1], portion[2 * i + 2], road.step)
    raise AssertionError("roads have no end")


def _standing(plain: LinearVehicle, road: np.ndarray) -> np.ndarray:
    """Positions (n, copies) at rest on a road (2 w, copies): vehicles dropped onto it from metres ring for long."""
    heights = road[: plain.road_stiffness.shape[1]]
    return np.linalg.lstsq(plain.stiffness, plain.road_stiffness @ heights, rcond=1e-12)[0]


def _rates(linear: LinearVehicle) -> np.ndarray:
    """Eigenvalues (1/s)."""
    n = len(linear.mass)
    own = np.linalg.solve(linear.mass, np.hstack([-linear.stiffness, -linear.damping]))
    return np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), own]))


def _steepest(spring: SpringDamper) -> Gains:
    """Stiffness (N/m) and damping (N s/m) where its curves are steepest."""
    travel, rate = (_slopes(curve).max() for curve in (spring.travel_force, spring.rate_force))
    return spring.stiffness + travel, spring.damping + rate + spring.friction / spring.friction_rate


def _slopes(curve: Curve | None) -> np.ndarray:
    if curve is None:
        return np.zeros(1)
    _, slope, _, bends = curve.hinges()
    return slope + np.cumsum([0.0, *bends])


class _Laws:
    """Motion of many copies at once; states (2 n, copies) are positions, then rates."""

    def __init__(self, vehicle: SpatialVehicle, plain: LinearVehicle, springs: tuple[SpringDamper, ...],
                 speed: float) -> None:  # fmt: skip
        n = len(plain.mass)
        watched = replace(vehicle, outputs=tuple(PartOutput(s.name, "travel", s.name) for s in springs))
        self.rows = np.array([o.displacement for o in linearise(watched, speed).outputs]).reshape(-1, n)
        forced = (-plain.stiffness, -plain.damping, plain.road_stiffness, plain.road_damping, -self.rows.T)
        self.motion = np.linalg.solve(plain.mass, np.hstack(forced))
        read = np.array([[float(isinstance(o, PartOutput) and o.kind == "force" and o.part == s.name) for s in springs]
                         for o in vehicle.outputs]).reshape(len(plain.outputs), -1)  # fmt: skip
        self.read = np.hstack([[np.concatenate([o.displacement, o.rate, o.road, o.road_rate, o.acceleration])
                                for o in plain.outputs], read])  # fmt: skip
        self.by_travel = _Hinges([s.travel_force for s in springs])
        self.by_rate = _Hinges([s.rate_force for s in springs])
        self.friction, self.friction_rate = np.array([(s.friction, s.friction_rate) for s in springs]).reshape(-1, 2).T

    def rate(self, x: np.ndarray, road: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rates (2 n, copies) of the state on a road (2 w, copies), and the bent forces (springs, copies), N."""
        q, v = x[: len(x) // 2], x[len(x) // 2 :]
        slip = self.rows @ v
        force = self.by_travel(self.rows @ q) + self.by_rate(slip)
        if self.friction.any():
            force += self.friction[:, None] * np.tanh(slip / self.friction_rate[:, None])
        return np.concatenate([v, self.motion @ np.concatenate([x, road, force])]), force

    def stepped(self, x: np.ndarray, k1: np.ndarray, half: np.ndarray, whole: np.ndarray, h: float) -> np.ndarray:
        """The state after a step h (s) of the classical Runge-Kutta method with the road at its half and its end."""
        k2 = self.rate(x + h / 2 * k1, half)[0]
        k3 = self.rate(x + h / 2 * k2, half)[0]
        k4 = self.rate(x + h * k3, whole)[0]
        return np.asarray(x + h / 6 * (k1 + 2 * (k2 + k3) + k4))

    def outputs(self, x: np.ndarray, rate: np.ndarray, road: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Outputs (p, copies)."""
        return np.asarray(self.read @ np.concatenate([x, road, rate[len(x) // 2 :], force]))


class _Hinges:
    """Curves as offset, first slope, corners and bends, filled up with bends of 0."""

    def __init__(self, curves: list[Curve | None]) -> None:
        known = [curve.hinges() if curve else (0.0, 0.0, (), ()) for curve in curves]
        most = max((len(corners) for _, _, corners, _ in known), default=0)
        self.offset, self.slope = np.zeros((2, len(known), 1))
        self.corners, self.bends = np.zeros((2, most, len(known), 1))
        for i, (offset, slope, corners, bends) in enumerate(known):
            self.offset[i], self.slope[i] = offset, slope
            self.corners[: len(corners), i, 0], self.bends[: len(bends), i, 0] = corners, bends

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Forces (springs, copies) at arguments of this shape."""
        bent = (self.bends * np.maximum(x - self.corners, 0.0)).sum(axis=0)
        return np.asarray(self.offset + self.slope * x + bent)
