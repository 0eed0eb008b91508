"""Newton's and Euler's laws for a whole car whose locked wheels slide: the forces on its bodies by mu N alone."""

from dataclasses import replace

import numpy as np
import pytest

from models.multibody.numbers import GRAVITY, Handling, TyreParameters
from models.systems.handling.run import build_in_engine
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial_linear import static_preloads
from models.vehicles.vehicle_file import load_vehicle

pytestmark = pytest.mark.grounds("closed form")
R19 = replace(load_vehicle("r19_free"), drags=())
SLIDING = np.array([14.0, 4.0, 0.0])
"""Velocity (m/s) of all bodies, aside, too; none of them turns."""


@pytest.fixture(scope="module")
def car():
    return Handling(R19, TyreParameters(cells=11, fixed=tuple(tyre.name for tyre in R19.tyres)))


def forces_on(car):
    """Force (N) and moment about the origin of space (N m): tyres push and slide where they touch, weights pull.

    Each tyre bears its load at rest, which statics tells (test_loads_at_rest), and rubs against the sliding.
    """
    loads = static_preloads(replace(R19, gravity=GRAVITY)).tyres
    against = -SLIDING / np.linalg.norm(SLIDING)
    parts = [
        (np.array([*tyre.point[:2], 0.0]), loads[tyre.name] * (car.tyres.friction * against + [0.0, 0.0, 1.0]))
        for tyre in R19.tyres
    ]
    parts += [(np.array(body.position), np.array([0.0, 0.0, -GRAVITY * body.mass])) for body in car.vehicle.bodies]
    return np.array([sum(force for _, force in parts), sum(np.cross(place, force) for place, force in parts)])


def momentum_rates(car, a):
    """Rates of momentum and of angular momentum about the origin by accelerations (n,) of bodies that do not turn."""
    motion, rates = Kinematics(car.vehicle), np.zeros((2, 3))
    for body in car.vehicle.bodies:
        push = body.mass * motion.shift(body.name, body.position) @ a
        rates += [push, np.cross(body.position, push) + np.array(body.inertia) @ motion.turn(body.name) @ a]
    return rates


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_momentum_changes_by_the_forces_on_the_car(car, engine):
    """To the rounding of sums of 20 bodies, and of a brush that slides everywhere."""
    q, v = car.straight(SLIDING[0])
    v[1] = SLIDING[1]
    rates, acting = momentum_rates(car, build_in_engine(engine, car).acceleration(0.0, q, v)), forces_on(car)
    assert np.abs(acting[0, :2]).min() > 1000.0
    assert np.abs(rates - acting).max() < 1e-8 * np.abs(acting).max()
