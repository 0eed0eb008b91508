"""Random scenes of braking that are legal: every one of them has to end at rest, or by a limit of the vehicle.

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
    """Plain numbers and names, drawn one after the other."""

    random: np.random.Generator

    def within(self, low: float, high: float) -> float:
        """A random number, uniform between low and high."""
        return float(self.random.uniform(low, high))

    def integer(self, low: int, end: int) -> int:
        """A random integer from low to below the end."""
        return int(self.random.integers(low, end))

    def choice(self, *choices: Any) -> Any:
        """A random element of ``choices``, all equally likely."""
        return self.random.choice(choices).item()

    def chance(self, share: float) -> bool:
        """True in a share of the draws."""
        return bool(self.random.random() < share)


def random_stop(seed: int, number: int) -> dict[str, Any]:
    """Table of one scene, the same for the same two numbers."""
    draw = Draw(np.random.default_rng([seed, number]))
    kind = draw.choice("straight", "straight", "split", "j_turn", "j_turn", "turn")
    table: dict[str, Any] = {
        "title": f"stop {number}",
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


def procedure(draw: Draw, kind: str) -> dict[str, Any]:
    """A random procedure of the driver, as a table of a scene."""
    options: dict[str, Any] = {"kind": kind, "speed": draw.within(2.0, 25.0)}
    if kind == "split":
        options["right"] = draw.choice(*SURFACES)
    if kind == "turn":
        options |= {"radius": draw.choice(-1.0, 1.0) * draw.within(60.0, 200.0), "speed": draw.within(2.0, 7.0)}
    if kind == "j_turn" and draw.chance(0.5):
        options["steer"] = draw.within(-0.05, 0.05)
    elif kind == "j_turn":
        options["steering"] = [[0.0, 0.0], [0.5, draw.within(-0.05, 0.05)], [1.5, draw.within(-0.05, 0.05)]]
    return options


def road(draw: Draw) -> dict[str, Any]:
    """One to three stretches."""
    starts = [0.0, 12.0, 25.0][: draw.integer(1, 4)]
    return {"stretches": [{"x": x, "left": draw.choice(*SURFACES)} for x in starts]}


def brakes(draw: Draw) -> dict[str, Any]:
    """Loops of the axles, and the supply."""
    table: dict[str, Any] = {"supply": draw.within(3.0, 10.0)}
    for axle in ("front", "rear", "trailer"):
        rising, push_out = draw.within(400.0, 3000.0), draw.within(0.0, 0.8)
        table[axle] = {
            "gradient": rising,
            "push_out": push_out,
            "release": push_out * draw.within(0.5, 1.0),
            "falling": rising * draw.within(1.0, 1.3),
        }
    return table


def axle(draw: Draw, x: float) -> dict[str, float]:
    """Wheels of an axle."""
    return {
        "x": x,
        "track": draw.within(1.7, 2.1),
        "radius": draw.within(0.35, 0.55),
        "spin_inertia": draw.within(3.0, 30.0),
    }


def vehicle(draw: Draw) -> dict[str, Any]:
    """A truck, light or laden, low enough that friction of 1 does not turn it over."""
    mass = draw.within(1500.0, 16000.0)
    return {
        "mass": mass,
        "yaw_inertia": mass * draw.within(2.0, 5.0),
        "height": draw.within(0.3, 1.3),
        "front": axle(draw, draw.within(1.3, 2.2)),
        "rear": axle(draw, draw.within(-2.4, -1.4)),
    }


def trailer(draw: Draw) -> dict[str, Any]:
    """A drawbar trailer."""
    mass = draw.within(1500.0, 9000.0)
    axles = {"front": axle(draw, draw.within(1.5, 2.4)), "rear": axle(draw, draw.within(-2.4, -1.5))}
    return {
        "mass": mass,
        "yaw_inertia": mass * draw.within(2.0, 4.0),
        "height": draw.within(0.5, 1.1),
        "drawbar": draw.within(1.5, 3.0),
        "drawbar_mass": draw.within(300.0, 800.0),
        "drawbar_inertia": draw.within(150.0, 600.0),
        "hook": draw.within(-4.0, -2.8),
        **{name: {**axle_table, "roll_share": 0.5} for name, axle_table in axles.items()},
    }
