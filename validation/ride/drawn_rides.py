"""Random ride scenes: vehicles, roads, quantities and tolerances.

Linear vehicles have stiff and irrelevant parts; nonlinear ones have dampers with curves, bump stops and friction.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from models.advice.ride_choice.in_time import CopiesInTime, in_time
from models.advice.ride_choice.reduced import FullScene
from models.ride.covariance import FINITE, stationary_covariance
from models.systems.ride.omissions import wheels_of
from models.systems.ride.reduced_scene import ReducedScene
from models.systems.ride.scene import build
from models.vehicles.spatial import Body, Curve, PointOutput, SpatialVehicle, SpringDamper
from models.vehicles.vehicle_file import load_vehicle
from validation.ride.rides import changed_vehicle

VEHICLES = ("quarter_car", "half_car", "half_car", "seven_freedoms")
NONLINEAR_VEHICLES, TOLERANCES = ("quarter_car", "quarter_car", "half_car"), (0.02, 0.02, 0.05, 0.01)
"""Shipped vehicles, and tolerances, that random scenes with nonlinear springs take in turn."""
SEED, RUN_DURATION, COPIES = 2211, 8.0, 48
UPWARD = (0.0, 0.0, 1.0)
_load_vehicle = cache(load_vehicle)


@dataclass(frozen=True)
class LinearRide:
    """A random linear ride scene, its speed (m/s), the outputs that must stay accurate, and the relative tolerance."""

    scene: ReducedScene
    speed: float
    quantities: tuple[str, ...]
    tolerance: float


@dataclass(frozen=True)
class NonlinearRide:
    """A random ride scene with nonlinear springs, the outputs that must stay accurate, and the relative tolerance."""

    scene: ReducedScene
    quantities: tuple[str, ...]
    tolerance: float

    def prepared_in_time(self, copy_count: int = COPIES, seed: int = 1) -> CopiesInTime:
        """The random scene prepared for runs in time, with ``copy_count`` Monte Carlo copies."""
        options = {"copies": copy_count, "lasting": RUN_DURATION, "seed": seed}
        return in_time(replace(self.scene, ride_scene=self.scene.ride_scene.model_copy(update={"options": options})))


class RandomNumbers:
    """Generator of the random numbers of a ride scene, for a seed."""

    def __init__(self, seed: int | list[int]) -> None:
        self.random = np.random.default_rng(seed)

    def log_uniform(self, lower_limit: float, upper_limit: float) -> float:
        """Random number between two positive limits, uniform in its logarithm."""
        return float(np.exp(self.random.uniform(np.log(lower_limit), np.log(upper_limit))))


def random_linear_ride(seed: int, tolerance: float | None = None, with_details: bool = True) -> LinearRide:
    """The random linear ride scene of a seed; the tolerance is random from 0.5 to 10 % by default.

    with_details : a vehicle as multibody programs hold it, every wheel on a stiff bushing and a light part on stiff
    mounts; else each of them in about half of the scenes, and soft at times.
    """
    draw = RandomNumbers(seed)
    rng = draw.random
    name = str(rng.choice(VEHICLES))
    vehicle = _random_vehicle(changed_vehicle(_load_vehicle(name), seed), draw, with_details)
    cutoff = draw.log_uniform(20.0, 200.0) if rng.random() < 0.4 else None
    speed = float(rng.uniform(8.0, 40.0))
    scene = _ride_scene("drawn", name, {} if cutoff is None else {"cutoff": cutoff}, speed, vehicle)
    ride = stationary_covariance(FullScene(scene, speed).full.system)
    silent = 1e-9 * max(abs(v) for v in ride.variance if np.isfinite(v))
    finite_names = [
        n for n, s, v in zip(ride.names, ride.status, ride.variance, strict=True) if s == FINITE and v > silent
    ]
    count = min(len(finite_names), int(rng.integers(1, 3)))
    drawn_quantities = tuple(map(str, rng.choice(finite_names, count, replace=False)))
    return LinearRide(scene, speed, drawn_quantities, tolerance or draw.log_uniform(0.005, 0.1))


def _ride_scene(
    scene_title: str, vehicle_file: str, road_table: dict[str, float], speed: float, vehicle: SpatialVehicle
) -> ReducedScene:
    table = {
        "title": scene_title,
        "system": "ride",
        "vehicle": {"file": vehicle_file},
        "road": road_table,
        "speeds": {"values": [speed]},
    }
    return ReducedScene(build(table, "drawn"), vehicle)


def _random_vehicle(vehicle: SpatialVehicle, random_numbers: RandomNumbers, with_details: bool) -> SpatialVehicle:
    """Random variant of a vehicle: changed wheel masses and dampers, damped tyres in three of five variants, sometimes
    a stiff fore-aft bushing at each wheel and a small body on a mount."""
    rng, log_uniform, wheels = random_numbers.random, random_numbers.log_uniform, wheels_of(vehicle)
    light, firm = log_uniform(0.15, 1.2), log_uniform(0.5, 4.0)
    damping = log_uniform(30.0, 400.0) if rng.random() < 0.6 else 0.0
    bodies = [replace(b, mass=light * b.mass) if b.name in wheels else b for b in vehicle.bodies]
    springs = [replace(s, damping=firm * s.damping) for s in vehicle.springs]
    outputs = list(vehicle.outputs)
    if with_details or rng.random() < 0.4:
        k, lean = log_uniform(1e6 if with_details else 3e5, 2e7), rng.uniform(0.02, 0.15)
        axis = (float(np.cos(lean)), 0.0, float(np.sin(lean)))
        for i, body in enumerate(bodies):
            if body.name in wheels:
                bodies[i], position = replace(body, freedoms=("x", "z")), body.position
                c = 0.1 * float(np.sqrt(k * body.mass))
                springs.append(SpringDamper(f"{body.name} bush", "body", body.name, position, position, axis, k, c))
    if with_details or rng.random() < 0.6:
        chassis = next(b for b in bodies if b.name == "body")
        m = chassis.mass * log_uniform(0.002, 0.02 if with_details else 0.15)
        position = (chassis.position[0] + float(rng.uniform(-1, 1)), *chassis.position[1:])
        k = m * (2 * np.pi * log_uniform(20.0 if with_details else 3.0, 200.0)) ** 2
        bodies.append(Body("part", m, position, ("z",)))
        springs.append(SpringDamper("part", "part", "body", position, position, UPWARD, k, 0.2 * float(np.sqrt(k * m))))
        if not with_details:
            outputs.append(PointOutput("part", "acceleration", "part", position, UPWARD))
    tyres = tuple(replace(tyre, damping=damping) for tyre in vehicle.tyres)
    return replace(vehicle, bodies=tuple(bodies), springs=tuple(springs), tyres=tyres, outputs=tuple(outputs))


def random_nonlinear_ride(scene_number: int) -> NonlinearRide:
    """The random ride scene with nonlinear springs for a number, which seeds it."""
    draw = RandomNumbers([SEED, scene_number])
    name = NONLINEAR_VEHICLES[scene_number % len(NONLINEAR_VEHICLES)]
    vehicle = load_vehicle(name)
    springs = tuple(_nonlinear_spring(spring, draw) for spring in vehicle.springs)
    level, speed = draw.log_uniform(1e-5, 1.5e-4), float(draw.random.uniform(10.0, 35.0))
    drawn_quantities = draw.random.choice([output.name for output in vehicle.outputs], 2, replace=False)
    scene = _ride_scene(f"bent {scene_number}", name, {"level": level}, speed, replace(vehicle, springs=springs))
    return NonlinearRide(scene, tuple(map(str, drawn_quantities)), TOLERANCES[scene_number % len(TOLERANCES)])


def _nonlinear_spring(spring: SpringDamper, random_numbers: RandomNumbers) -> SpringDamper:
    """The spring with a digressive damper that is harder in rebound, two bump stops, and friction, each with high
    probability."""
    c, rebound, digressive = spring.damping, random_numbers.log_uniform(1.0, 2.5), random_numbers.log_uniform(0.3, 1.0)
    curve = Curve(
        (-1.0, -0.2, 0.0, 0.2, 1.0),
        (-c * rebound * (0.2 + 0.8 * digressive), -0.2 * c * rebound, 0.0, 0.2 * c, c * (0.2 + 0.8 * digressive)),
    )
    gap, hard = random_numbers.log_uniform(0.02, 0.08), random_numbers.log_uniform(2e4, 2e5)
    stops = Curve((-gap - 0.05, -gap, gap, gap + 0.05), (-0.05 * hard, 0.0, 0.0, 0.05 * hard))
    friction = random_numbers.log_uniform(5.0, 80.0)
    bent, stopped, dry = random_numbers.random.random(3) < (0.8, 0.7, 0.7)
    bent = bent or not (stopped or dry)
    return replace(
        spring,
        rate_force=curve if bent else None,
        damping=0.0 if bent else c,
        travel_force=stops if stopped else None,
        friction=friction if dry else 0.0,
    )
