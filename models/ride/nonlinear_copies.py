"""Monte Carlo of a vehicle whose springs are bent: many copies, each on a random road of its own, stepped in time.

Motion is small, as in ``spatial_linear``, but for the bent springs, whose forces are taken as they are. The classical
Runge-Kutta method reads the road at half steps; curves have corners, so its error falls with the square of the step.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.compiled import njit
from models.ride.excitation import Excitation
from models.ride.linear_vehicle import LinearVehicle
from models.ride.road_path import road_path
from models.ride.statistical_linearisation import bent, statistically_linear
from models.vehicles.curve import Curve
from models.vehicles.spatial import PartOutput, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import Gains, linearise

REACH = 0.25
"""Fastest rate of the vehicle with its springs as steep as they get, times the step, at most."""
BLOCK = 200
"""Steps between two portions of road."""
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

    longest : largest step (s); by itself the step is REACH over the fastest rate.
    """
    springs = bent(vehicle)
    plain = linearise(vehicle, speed, {s.name: (s.stiffness, s.damping) for s in springs})
    fastest = abs(_rates(linearise(vehicle, speed, {s.name: _steepest(s) for s in springs}))).max()
    own = abs(_rates(statistically_linear(vehicle, excitation, speed).vehicle).real)
    slowest = own[own > HELD * own.max()].min()
    road = road_path(excitation, speed, longest or REACH / float(fastest))
    settling, counted = int(np.ceil(SETTLE / slowest / road.step)), int(np.ceil(duration / road.step))
    laws = _laws(vehicle, plain, springs)
    state, sums = np.zeros((copies, 2 * len(plain.mass))), np.zeros((4, copies, len(plain.outputs)))
    done = 0
    for portion in road.blocks(BLOCK, copies, seed):
        steps = min(BLOCK, settling + counted - done)
        met = np.ascontiguousarray(np.moveaxis(portion[: 2 * steps + 1], 2, 0))
        _march(state, met, road.step, min(steps, max(0, settling - done)), sums, *laws)
        done += steps
        if done == settling + counted:
            break
    return Copies(tuple(o.name for o in plain.outputs), sums / counted, road.step, counted * road.step)


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


def _laws(vehicle: SpatialVehicle, plain: LinearVehicle, springs: tuple[SpringDamper, ...]) -> tuple[np.ndarray, ...]:
    """What the march wants: accelerations by state, road and bent forces, travels, laws, outputs."""
    n = len(plain.mass)
    watched = replace(vehicle, outputs=tuple(PartOutput(s.name, "travel", s.name) for s in springs))
    speed = 1.0  # travels do not depend on it
    rows = np.array([o.displacement for o in linearise(watched, speed).outputs]).reshape(-1, n)
    by_state = np.linalg.solve(plain.mass, np.hstack([-plain.stiffness, -plain.damping]))
    by_road = np.linalg.solve(plain.mass, np.hstack([plain.road_stiffness, plain.road_damping]))
    outputs = np.array([np.concatenate([o.displacement, o.rate, o.acceleration, o.road, o.road_rate])
                        for o in plain.outputs])  # fmt: skip
    read = np.array([[float(isinstance(o, PartOutput) and o.kind == "force" and o.part == s.name) for s in springs]
                     for o in vehicle.outputs]).reshape(len(plain.outputs), -1)  # fmt: skip
    friction = np.array([(s.friction, s.friction_rate) for s in springs]).reshape(-1, 2)
    travel, rate = (_hinges([getattr(s, name) for s in springs]) for name in ("travel_force", "rate_force"))
    return (by_state, by_road, np.linalg.solve(plain.mass, -rows.T), rows, travel, rate, friction,
            np.hstack([outputs, read]))  # fmt: skip


def _hinges(curves: list[Curve | None]) -> np.ndarray:
    """Offset, first slope, then corners and bends in turn (springs, 2 + 2 corners), filled up with bends of 0."""
    known = [curve.hinges() if curve else (0.0, 0.0, (), ()) for curve in curves]
    out = np.zeros((len(curves), 2 + 2 * max((len(corners) for _, _, corners, _ in known), default=0)))
    for row, (offset, slope, corners, bends) in zip(out, known, strict=True):
        row[:2] = offset, slope
        row[2 : 2 + 2 * len(corners)] = np.column_stack([corners, bends]).ravel()
    return out


@njit(cache=True, error_model="numpy")
def _law(hinges, x):
    """Force of a curve in the form of ``_hinges``."""
    force = hinges[0] + hinges[1] * x
    for i in range(2, len(hinges), 2):
        force += hinges[i + 1] * max(x - hinges[i], 0.0)
    return force


@njit(cache=True, error_model="numpy")
def _accelerate(x, road, by_state, by_road, by_force, rows, travel, rate, friction, force, out):
    """Rates (2 n,) of the state x = (q, q') into ``out``, bent forces (springs,) into ``force``."""
    n = len(x) // 2
    for s in range(len(force)):
        d, v = 0.0, 0.0
        for j in range(n):
            d += rows[s, j] * x[j]
            v += rows[s, j] * x[n + j]
        force[s] = _law(travel[s], d) + _law(rate[s], v)
        if friction[s, 0] != 0.0:
            force[s] += friction[s, 0] * np.tanh(v / friction[s, 1])
    for i in range(n):
        a = 0.0
        for j in range(2 * n):
            a += by_state[i, j] * x[j]
        for j in range(len(road)):
            a += by_road[i, j] * road[j]
        for s in range(len(force)):
            a += by_force[i, s] * force[s]
        out[i], out[n + i] = x[n + i], a


@njit(cache=True, error_model="numpy")
def _march(state, met, h, skipped, sums, by_state, by_road, by_force, rows, travel, rate, friction, outputs):
    """Move every copy along its road ``met`` (copies, 2 steps + 1, 2 w); add powers of outputs after ``skipped``."""
    size, n, count, wheels = state.shape[1], state.shape[1] // 2, len(rows), met.shape[2]
    k1, k2, k3, k4, at = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    force, unused, seen = np.empty(count), np.empty(count), np.empty(outputs.shape[1])
    for c in range(len(state)):
        x = state[c]
        for step in range(met.shape[1] // 2):
            road = met[c, 2 * step]
            _accelerate(x, road, by_state, by_road, by_force, rows, travel, rate, friction, force, k1)
            if step >= skipped:
                seen[:size], seen[size : size + n], seen[size + n : size + n + wheels] = x, k1[n:], road
                seen[size + n + wheels :] = force
                for p in range(len(outputs)):
                    y = 0.0
                    for j in range(len(seen)):
                        y += outputs[p, j] * seen[j]
                    sums[0, c, p] += y
                    sums[1, c, p] += y**2
                    sums[2, c, p] += y**3
                    sums[3, c, p] += y**4
            half = met[c, 2 * step + 1]
            for j in range(size):
                at[j] = x[j] + h / 2 * k1[j]
            _accelerate(at, half, by_state, by_road, by_force, rows, travel, rate, friction, unused, k2)
            for j in range(size):
                at[j] = x[j] + h / 2 * k2[j]
            _accelerate(at, half, by_state, by_road, by_force, rows, travel, rate, friction, unused, k3)
            for j in range(size):
                at[j] = x[j] + h * k3[j]
            _accelerate(at, met[c, 2 * step + 2], by_state, by_road, by_force, rows, travel, rate, friction, unused, k4)
            for j in range(size):
                x[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j])
