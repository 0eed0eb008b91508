"""Preloads against statics: written without the vehicle's kinematics, stiffness or forces."""

from dataclasses import replace

import numpy as np
import pytest

from models.multibody.numbers import GRAVITY, Handling
from models.systems.handling.run import build_in_engine
from models.vehicles.spatial_linear import static_preloads
from models.vehicles.vehicle_file import load_vehicle

pytestmark = pytest.mark.grounds("closed form")
R19 = replace(load_vehicle("r19_free"), gravity=GRAVITY)
LOPSIDED = replace(
    R19,
    bodies=(
        replace(R19.bodies[0], mass=1.3 * R19.bodies[0].mass),
        *R19.bodies[1:-1],
        replace(R19.bodies[-1], mass=40.0 + R19.bodies[-1].mass),
    ),
)


@pytest.mark.parametrize("vehicle", [R19, LOPSIDED], ids=["r19", "lopsided"])
@pytest.mark.parametrize("axis", [None, 0, 1], ids=["force", "pitch", "roll"])
def test_loads_of_the_tyres_balance_the_weight_and_its_moments(vehicle, axis):
    """Sums of a dozen products, to their rounding."""

    def lever(point):
        return 1.0 if axis is None else point[axis]

    loads = static_preloads(vehicle).tyres
    borne = sum(loads[tyre.name] * lever(tyre.point) for tyre in vehicle.tyres)
    weight = sum(body.mass * GRAVITY * lever(body.position) for body in vehicle.bodies)
    scale = sum(body.mass * GRAVITY for body in vehicle.bodies)
    assert borne == pytest.approx(weight, abs=1e-10 * scale)


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_a_car_that_stands_on_its_preloads_stays_at_rest(engine):
    """A spring's preload that is 1 % off moves its wheel by a good part of 1 % of g times the masses' ratio."""
    car = Handling(LOPSIDED)
    q, v = car.straight(0.0)
    assert np.abs(build_in_engine(engine, car).acceleration(0.0, q, v)).max() < 1e-8 * GRAVITY
