"""Random legal braking scenes, each of which must end at rest or at a limit of the vehicle.

Drawn are surface, levels and split of friction, mass, inertia, height, axles, wheels, brakes, chambers, procedure and
steering, controller, step, lag of tyres, a trailer, or a vehicle on its suspension. Every number lies where a user's
may lie; which way the vehicle goes under it is not known beforehand.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

SURFACES = ("dry", "wet", "snow", "ice")
CONTROLLERS = ("none", "none", "slip_bang_bang", "acceleration_phases", "five_phase", "slip_pi")


@dataclass(frozen=True)
class Draw:
    """Random generator of numbers and choices for scenes."""

    generator: np.random.Generator

    def within(self, lower_limit: float, upper_limit: float) -> float:
        """A random number, uniformly distributed between two limits."""
        return float(self.generator.uniform(lower_limit, upper_limit))

    def integer(self, lower_limit: int, upper_limit: int) -> int:
        """A random integer from lower_limit to upper_limit - 1."""
        return int(self.generator.integers(lower_limit, upper_limit))

    def choice(self, *choices: Any) -> Any:
        """A random element of ``choices``, all equally likely."""
        return self.generator.choice(choices).item()

    def chance(self, probability: float) -> bool:
        """True with a given probability."""
        return bool(self.generator.random() < probability)


def random_stop(seed: int, scene_number: int) -> dict[str, Any]:
    """Table of a random braking scene; equal arguments give equal scenes."""
    draw = Draw(np.random.default_rng([seed, scene_number]))
    kind = draw.choice("straight", "straight", "split", "j_turn", "j_turn", "turn")
    table: dict[str, Any] = {
        "title": f"stop {scene_number}",
        "system": "braking",
        "procedures": {"stop": procedure(draw, kind)},
        "road": road(draw),
        "tyres": {"scale": {name: draw.within(0.7, 1.3) for name in SURFACES}},
        "brakes": brakes(draw),
        "controller": {"kind": draw.choice(*CONTROLLERS)},
        "run": {"sample": draw.choice(0.002, 0.0055, 0.01), "substeps": draw.integer(1, 9), "duration": 400.0},
    }
    if draw.chance(0.5):
        table["pressure"] = {
            "fill": draw.within(0.02, 0.3),
            "empty": draw.within(0.02, 0.3),
            "delay": draw.choice(0.0, 0.004, 0.012),
        }
    if draw.chance(0.15):
        return table | {"vehicle": {"file": "r19_free", "spin_inertia": draw.within(0.5, 2.0)}}
    table |= {"vehicle": {"override": vehicle(draw)}}
    if draw.chance(0.75):
        table["load_transfer"] = {"front": draw.within(0.2, 0.8)}
    if draw.chance(0.2):
        table["relaxation"] = {"front": draw.within(0.2, 0.8), "rear": draw.within(0.2, 0.8)}
    if draw.chance(0.25):
        table["trailer"] = trailer(draw)
    return table


def procedure(random_draws: Draw, procedure_kind: str) -> dict[str, Any]:
    """Scene table of a random procedure: kind of stop, speed, and steering or radius."""
    options: dict[str, Any] = {"kind": procedure_kind, "speed": random_draws.within(2.0, 25.0)}
    if procedure_kind == "split":
        options["right"] = random_draws.choice(*SURFACES)
    if procedure_kind == "turn":
        options |= {
            "radius": random_draws.choice(-1.0, 1.0) * random_draws.within(60.0, 200.0),
            "speed": random_draws.within(2.0, 7.0),
        }
    if procedure_kind == "j_turn" and random_draws.chance(0.5):
        options["steer"] = random_draws.within(-0.05, 0.05)
    elif procedure_kind == "j_turn":
        options["steering"] = [
            [0.0, 0.0],
            [0.5, random_draws.within(-0.05, 0.05)],
            [1.5, random_draws.within(-0.05, 0.05)],
        ]
    return options


def road(random_draws: Draw) -> dict[str, Any]:
    """Scene table of a random road with one to three surfaces in succession."""
    starts = [0.0, 12.0, 25.0][: random_draws.integer(1, 4)]
    return {"stretches": [{"x": x, "left": random_draws.choice(*SURFACES)} for x in starts]}


def brakes(random_draws: Draw) -> dict[str, Any]:
    """Scene table of random brake characteristics of the axles, with hysteresis, and a random supply pressure."""
    table: dict[str, Any] = {"supply": random_draws.within(3.0, 10.0)}
    for axle in ("front", "rear", "trailer"):
        rising, push_out = random_draws.within(400.0, 3000.0), random_draws.within(0.0, 0.8)
        table[axle] = {
            "gradient": rising,
            "push_out": push_out,
            "release": push_out * random_draws.within(0.5, 1.0),
            "falling": rising * random_draws.within(1.0, 1.3),
        }
    return table


def axle(random_draws: Draw, axle_position: float) -> dict[str, float]:
    """Scene table of an axle at x (m) with random track, wheel radius and spin inertia."""
    return {
        "x": axle_position,
        "track": random_draws.within(1.7, 2.1),
        "radius": random_draws.within(0.35, 0.55),
        "spin_inertia": random_draws.within(3.0, 30.0),
    }


def vehicle(random_draws: Draw) -> dict[str, Any]:
    """Scene table of a random truck, light or laden, low enough that a friction of 1 does not overturn it."""
    mass = random_draws.within(1500.0, 16000.0)
    return {
        "mass": mass,
        "yaw_inertia": mass * random_draws.within(2.0, 5.0),
        "height": random_draws.within(0.3, 1.3),
        "front": axle(random_draws, random_draws.within(1.3, 2.2)),
        "rear": axle(random_draws, random_draws.within(-2.4, -1.4)),
    }


def trailer(random_draws: Draw) -> dict[str, Any]:
    """Scene table of a random drawbar trailer."""
    mass = random_draws.within(1500.0, 9000.0)
    axles = {
        "front": axle(random_draws, random_draws.within(1.5, 2.4)),
        "rear": axle(random_draws, random_draws.within(-2.4, -1.5)),
    }
    return {
        "mass": mass,
        "yaw_inertia": mass * random_draws.within(2.0, 4.0),
        "height": random_draws.within(0.5, 1.1),
        "drawbar": random_draws.within(1.5, 3.0),
        "drawbar_mass": random_draws.within(300.0, 800.0),
        "drawbar_inertia": random_draws.within(150.0, 600.0),
        "hook": random_draws.within(-4.0, -2.8),
        **{name: {**axle_table, "roll_share": 0.5} for name, axle_table in axles.items()},
    }
