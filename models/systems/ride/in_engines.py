"""A vehicle on a random road in time, in both engines: everything nonlinear, gravity where the vehicle has it."""

from dataclasses import dataclass, replace

import numpy as np

from models.engines.protocol import Settings
from models.engines.spatial_protocol import INTEGRATORS, SpatialRun, build
from models.ride.road_path import RoadPath, check_rates
from models.vehicles.linear_vehicle import Output
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, preloads


@dataclass(frozen=True)
class Ride:
    """A run: states at every step, and outputs (m, p) at ``times`` (m,) in s, counted from the first one.

    Outputs are read by the rows of ``spatial_linear`` from the engine's own positions, rates and accelerations; those
    of small motion, which a ride is. The force of a bent spring is no linear function of them: it is left nan.
    """

    names: tuple[str, ...]
    run: SpatialRun
    times: np.ndarray
    outputs: np.ndarray

    def of(self, name: str) -> np.ndarray:
        """One output (m,)."""
        return self.outputs[:, self.names.index(name)]

    @property
    def interval(self) -> float:
        """Time (s) from one row of outputs to the next."""
        return float(self.times[1] - self.times[0])


def ridden(
    engine: str,
    vehicle: SpatialVehicle,
    road: RoadPath,
    duration: float,
    *,
    seed: int = 0,
    path: int = 0,
    skipped: float = 0.0,
    every: int = 1,
) -> Ride:
    """Drive over a road from rest for about ``duration`` (s); outputs ``every`` so many steps after ``skipped`` (s).

    Raises InputError for damped tyres on a road whose heights have no rates.
    """
    check_rates(vehicle, road.excitation)
    steps = int(np.ceil(duration / road.step))
    table = road.table(steps, seed, path)
    settings = Settings(INTEGRATORS[engine], road.step, steps * road.step)
    model = build(engine, vehicle, settings, road.speed, table)
    zero = np.zeros(len(vehicle.coordinates()))
    run = model.run(zero, zero)
    own = linearise(vehicle, road.speed).outputs
    at = np.arange(int(np.ceil(skipped / road.step)), steps + 1, every)
    states = [(run.positions[i], run.rates[i], table[2 * i]) for i in at]
    accelerations = np.array([model.acceleration(*state) for state in states])
    rows = np.column_stack([accelerations, run.rates[at], run.positions[at], table[2 * at]])
    outputs = rows @ np.array([row_of(output) for output in own]).T
    for i, spec in enumerate(vehicle.outputs):
        if spec.kind == "force" and _bent(vehicle, spec.part):
            outputs[:, i] = np.nan
        elif spec.kind == "tyre force" and any(tyre.name == spec.tyre and tyre.pushes_only for tyre in vehicle.tyres):
            elastic = rows @ row_of(replace(own[i], rate=0.0 * own[i].rate, road_rate=0.0 * own[i].road_rate))
            outputs[:, i] = _pushing(outputs[:, i], elastic, preloads(vehicle).tyres[spec.tyre])
    return Ride(tuple(output.name for output in own), run, at * road.step - at[0] * road.step, outputs)


def _pushing(force: np.ndarray, elastic: np.ndarray, load: float) -> np.ndarray:
    """Force of a tyre that only pushes less its load at rest (N), by what a linear one and its spring have."""
    return np.maximum(np.minimum(load + force, 2.0 * (load + elastic)), 0.0) - load


def row_of(output: Output) -> np.ndarray:
    """Factors (3 n + 2 w,) of accelerations, rates, positions, road heights and their rates."""
    return np.concatenate([output.acceleration, output.rate, output.displacement, output.road, output.road_rate])


def _bent(vehicle: SpatialVehicle, part: str) -> bool:
    return any(s.name == part and (s.travel_force or s.rate_force or s.friction) for s in vehicle.springs)
