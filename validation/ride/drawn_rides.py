"""Ride scenes drawn at random: vehicles with stiff and with irrelevant parts, roads, quantities, tolerances."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from models.advice.ride_choice.reduced import Whole
from models.ride.covariance import FINITE, stationary
from models.systems.ride.reduced_scene import Held
from models.systems.ride.scene import RideScene, build
from models.vehicles.spatial import Body, PointOutput, SpatialVehicle, SpringDamper
from models.vehicles.vehicle_file import load_vehicle
from validation.ride.ride_twins import twin

VEHICLES = ("quarter_car", "half_car", "half_car", "seven_freedoms")


@dataclass(frozen=True)
class Drawn:
    """One scene: what it holds, its speed (m/s), the outputs that must stay right, and how right."""

    held: Held
    speed: float
    quantities: tuple[str, ...]
    tolerance: float


def drawn(seed: int, tolerance: float | None = None, detailed: bool = True) -> Drawn:
    """The scene of a seed; tolerance from 0.5 to 10 % where none is given.

    detailed : a vehicle as multibody programs hold it, every wheel on a stiff bushing and a light part on stiff mounts;
    else each of them in about half of the scenes, and soft at times.
    """
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    name = str(rng.choice(VEHICLES))
    vehicle = _vehicle(twin(_loaded(name), seed), rng, between, detailed)
    cutoff = between(20.0, 200.0) if rng.random() < 0.4 else None
    road = {} if cutoff is None else {"cutoff": cutoff}
    speed = float(rng.uniform(8.0, 40.0))
    held = Held(_scene(name, road, speed), vehicle)
    found = stationary(Whole(held, speed).full.system)
    silent = 1e-9 * max(abs(v) for v in found.variance if np.isfinite(v))
    told = [n for n, s, v in zip(found.names, found.status, found.variance, strict=True) if s == FINITE and v > silent]
    count = min(len(told), int(rng.integers(1, 3)))
    asked = tuple(str(n) for n in rng.choice(told, count, replace=False))
    return Drawn(held, speed, asked, tolerance or between(0.005, 0.1))


@cache
def _loaded(name: str) -> SpatialVehicle:
    return load_vehicle(name)


def _scene(name: str, road: dict[str, float], speed: float) -> RideScene:
    table = {"title": "drawn", "system": "ride", "vehicle": {"file": name}, "road": road, "speeds": {"values": [speed]}}
    return build(table, "drawn")


def _vehicle(
    vehicle: SpatialVehicle, rng: np.random.Generator, between: Callable[[float, float], float], detailed: bool
) -> SpatialVehicle:
    """Light wheels, firm dampers, damped tyres in three of five; a fore-aft bushing and a part on mounts at times."""
    wheels = {tyre.body for tyre in vehicle.tyres}
    light, firm = between(0.15, 1.2), between(0.5, 4.0)
    damping = between(30.0, 400.0) if rng.random() < 0.6 else 0.0
    bodies = [replace(b, mass=light * b.mass) if b.name in wheels else b for b in vehicle.bodies]
    springs = [replace(s, damping=firm * s.damping) for s in vehicle.springs]
    outputs = list(vehicle.outputs)
    if detailed or rng.random() < 0.4:
        k, lean = between(1e6 if detailed else 3e5, 2e7), rng.uniform(0.02, 0.15)
        for i, body in enumerate(bodies):
            if body.name in wheels:
                bodies[i] = replace(body, freedoms=("x", "z"))
                axis = (float(np.cos(lean)), 0.0, float(np.sin(lean)))
                springs.append(
                    SpringDamper(
                        f"{body.name} bush",
                        "body",
                        body.name,
                        body.position,
                        body.position,
                        axis,
                        k,
                        0.1 * float(np.sqrt(k * body.mass)),
                    )
                )
    if detailed or rng.random() < 0.6:
        own = next(b for b in bodies if b.name == "body")
        m = own.mass * between(0.002, 0.02 if detailed else 0.15)
        at = (own.position[0] + float(rng.uniform(-1, 1)), own.position[1], own.position[2])
        k = m * (2 * np.pi * between(20.0 if detailed else 3.0, 200.0)) ** 2
        bodies.append(Body("part", m, at, ("z",)))
        up = (0.0, 0.0, 1.0)
        springs.append(SpringDamper("part", "part", "body", at, at, up, k, 0.2 * float(np.sqrt(k * m))))
        if not detailed:
            outputs.append(PointOutput("part", "acceleration", "part", at, up))
    tyres = tuple(replace(tyre, damping=damping) for tyre in vehicle.tyres)
    return replace(vehicle, bodies=tuple(bodies), springs=tuple(springs), tyres=tyres, outputs=tuple(outputs))
