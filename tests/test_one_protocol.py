"""Every system's models answer to one protocol: what they say of accelerations is what their runs do."""

from collections.abc import Callable

import numpy as np
import pytest

from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.catalogue import RECOMMENDED
from models.engines.cut_vehicle import build
from models.engines.model import Model
from models.engines.protocol import build as in_plane
from models.engines.spatial_protocol import INTEGRATORS
from models.engines.spatial_protocol import build as in_space
from models.systems.handling.run import build_in_engine as on_tyres
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.vehicle_file import load_vehicle
from validation.absence import bare_cars
from validation.cases.ride_engines import shipped_vehicle_or_twin
from validation.hard_cases import setups
from validation.spatial.cars import static_forces

STEP, STEPS = 1e-4, 4
BOUND = 1e-3
"""Of a difference over two steps, by the largest acceleration: modes of 30 1/s leave 2e-6, wheels on tyres 1e-4."""


def plane(engine: str) -> tuple[Model, Trajectory]:
    raised = 1e-3 * np.array([1.0, 2.0, 3.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    model = in_plane(engine, setups.vehicle(start_state=raised), Settings(RECOMMENDED[engine], STEP, STEPS * STEP))
    return model, model.run()


def ride(engine: str) -> tuple[Model, Trajectory]:
    vehicle = shipped_vehicle_or_twin("quarter_car")
    model = in_space(engine, vehicle, Settings(INTEGRATORS[engine], STEP, STEPS * STEP))
    return model, model.run(np.array([1e-3, 2e-3]), np.zeros(2))


def hub_forces(engine: str) -> tuple[Model, Trajectory]:
    vehicle = cut_at_hubs(load_vehicle("r19_free"), "body")
    model = build(engine, vehicle, static_forces(vehicle, 2 * STEPS + 1), STEP, STEPS * STEP)
    moved = 1e-3 * np.random.default_rng(1).standard_normal((2, vehicle.size))
    return model, model.run(*moved)


def handling(engine: str) -> tuple[Model, Trajectory]:
    car, q, v = bare_cars.start_state()
    model = on_tyres(engine, car, Settings("RK4", STEP, STEPS * STEP))
    return model, model.run(q, v)


CASES = [
    *((plane, engine) for engine in ("reference", "exudyn", "mujoco")),
    *((ride, engine) for engine in INTEGRATORS),
    *((hub_forces, engine) for engine in ("reference", "plain", "exudyn", "mujoco")),
    *((handling, engine) for engine in ("reference", "exudyn", "mujoco")),
]


@pytest.mark.parametrize(("system", "engine"), CASES)
def test_accelerations_are_the_slopes_of_the_run(system: Callable[[str], tuple[Model, Trajectory]], engine: str):
    model, run = system(engine)
    slope = (run.rates[3] - run.rates[1]) / (2.0 * STEP)
    found = model.acceleration(2.0 * STEP, run.positions[2], run.rates[2])
    size = np.abs(slope).max()
    assert size > 0.01
    assert np.abs(found - slope).max() < BOUND * size
    assert np.abs(1.01 * found - slope).max() > BOUND * size  # 1 % too much would be seen
    assert model.plan()["degrees of freedom"] == run.positions.shape[1]
    assert {"native items", "callbacks"} < set(model.plan())
