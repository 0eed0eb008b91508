"""Ride scenes with bent springs, drawn at random: dampers, stops and friction, roads, quantities, copies."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.advice.ride_choice.in_time import InTime, in_time
from models.systems.ride.reduced_scene import Held
from models.systems.ride.scene import build
from models.vehicles.curve import Curve
from models.vehicles.spatial import SpatialVehicle, SpringDamper
from models.vehicles.vehicle_file import load_vehicle

VEHICLES = ("quarter_car", "quarter_car", "half_car")
TOLERANCES = (0.02, 0.02, 0.05, 0.01)
"""Drawn scenes take these in turn."""
SEED, LASTING, COPIES = 2211, 8.0, 48


@dataclass(frozen=True)
class Bent:
    """One scene: what it holds, what must stay right, how right, and its copies' seed."""

    held: Held
    quantities: tuple[str, ...]
    tolerance: float

    def opened(self, copies: int = COPIES, seed: int = 1) -> InTime:
        """As it is run, with so many copies."""
        options = {"copies": copies, "lasting": LASTING, "seed": seed}
        return in_time(replace(self.held, scene=self.held.scene.model_copy(update={"options": options})))


def drawn_bent(number: int) -> Bent:
    """The scene of a number."""
    draw = np.random.default_rng([SEED, number])

    def between(low: float, high: float) -> float:
        return float(np.exp(draw.uniform(np.log(low), np.log(high))))

    name = VEHICLES[number % len(VEHICLES)]
    vehicle = load_vehicle(name)
    springs = tuple(_bent(spring, draw, between) for spring in vehicle.springs)
    table = {
        "title": f"bent {number}",
        "system": "ride",
        "vehicle": {"file": name},
        "road": {"level": between(1e-5, 1.5e-4)},
        "speeds": {"values": [float(draw.uniform(10.0, 35.0))]},
    }
    asked = draw.choice(_outputs(vehicle), 2, replace=False)
    held = Held(build(table, "drawn"), replace(vehicle, springs=springs))
    return Bent(held, tuple(map(str, asked)), TOLERANCES[number % len(TOLERANCES)])


def _outputs(vehicle: SpatialVehicle) -> list[str]:
    return [output.name for output in vehicle.outputs]


def _bent(spring: SpringDamper, draw: np.random.Generator, between: Callable[[float, float], float]) -> SpringDamper:
    """A digressive damper that is harder in rebound, stops at both ends, and friction: each in most of the springs."""
    c, rebound, digressive = spring.damping, between(1.0, 2.5), between(0.3, 1.0)
    curve = Curve(
        (-1.0, -0.2, 0.0, 0.2, 1.0),
        (-c * rebound * (0.2 + 0.8 * digressive), -0.2 * c * rebound, 0.0, 0.2 * c, c * (0.2 + 0.8 * digressive)),
    )
    gap, hard = between(0.02, 0.08), between(2e4, 2e5)
    stops = Curve((-gap - 0.05, -gap, gap, gap + 0.05), (-0.05 * hard, 0.0, 0.0, 0.05 * hard))
    friction = between(5.0, 80.0)
    bent, stopped, dry = draw.random(3) < (0.8, 0.7, 0.7)
    return replace(
        spring,
        rate_force=curve if bent or not (stopped or dry) else None,
        damping=0.0 if bent or not (stopped or dry) else c,
        travel_force=stops if stopped else None,
        friction=friction if dry else 0.0,
    )
