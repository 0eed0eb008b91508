"""Random scenes of braking that are legal: every one of them has to end at rest, or by a limit of the vehicle.

Drawn are surface, levels and split of friction, mass, inertia, height, axles, wheels, brakes, chambers, procedure and
steering, controller, step, lag of tyres, a trailer, or a vehicle on its suspension. Every number lies where a user's
may lie; which way the vehicle goes under it is not known beforehand.
"""

from typing import Any

import numpy as np

SURFACES = ("dry", "wet", "snow", "ice")
CONTROLLERS = ("none", "none", "slip_bang_bang", "acceleration_phases", "five_phase", "slip_pi")


def random_stop(seed: int, number: int) -> dict[str, Any]:
    """Table of one scene, the same for the same two numbers."""
    draw = np.random.default_rng([seed, number])
    kind = str(draw.choice(["straight", "straight", "split", "j_turn", "j_turn", "turn"]))
    table: dict[str, Any] = {
        "title": f"stop {number}",
        "system": "braking",
        "procedures": {"stop": procedure(draw, kind)},
        "road": road(draw),
        "tyres": {"scale": {name: float(draw.uniform(0.7, 1.3)) for name in SURFACES}},
        "brakes": brakes(draw),
        "controller": {"kind": str(draw.choice(CONTROLLERS))},
        "run": {
            "sample": float(draw.choice([0.002, 0.0055, 0.01])),
            "substeps": int(draw.integers(1, 9)),
            "duration": 400.0,
        },
    }
    if draw.random() < 0.5:
        table["pressure"] = {
            "fill": float(draw.uniform(0.02, 0.3)),
            "empty": float(draw.uniform(0.02, 0.3)),
            "delay": float(draw.choice([0.0, 0.004, 0.012])),
        }
    if draw.random() < 0.15:
        return table | {"vehicle": {"file": "r19_free", "spin_inertia": float(draw.uniform(0.5, 2.0))}}
    table |= {"vehicle": {"override": vehicle(draw)}}
    if draw.random() < 0.75:
        table["load_transfer"] = {"front": float(draw.uniform(0.2, 0.8))}
    if draw.random() < 0.2:
        table["relaxation"] = {"front": float(draw.uniform(0.2, 0.8)), "rear": float(draw.uniform(0.2, 0.8))}
    if draw.random() < 0.25:
        table["trailer"] = trailer(draw)
    return table


def procedure(draw: np.random.Generator, kind: str) -> dict[str, Any]:
    """What the driver does."""
    own: dict[str, Any] = {"kind": kind, "speed": float(draw.uniform(2.0, 25.0))}
    if kind == "split":
        own["right"] = str(draw.choice(SURFACES))
    if kind == "turn":
        own |= {
            "radius": float(draw.choice([-1.0, 1.0]) * draw.uniform(60.0, 200.0)),
            "speed": float(draw.uniform(2.0, 7.0)),
        }
    if kind == "j_turn" and draw.random() < 0.5:
        own["steer"] = float(draw.uniform(-0.05, 0.05))
    elif kind == "j_turn":
        own["steering"] = [[0.0, 0.0], [0.5, float(draw.uniform(-0.05, 0.05))], [1.5, float(draw.uniform(-0.05, 0.05))]]
    return own


def road(draw: np.random.Generator) -> dict[str, Any]:
    """One to three stretches."""
    starts = [0.0, 12.0, 25.0][: int(draw.integers(1, 4))]
    return {"stretches": [{"x": x, "left": str(draw.choice(SURFACES))} for x in starts]}


def brakes(draw: np.random.Generator) -> dict[str, Any]:
    """Loops of the axles, and the supply."""
    table: dict[str, Any] = {"supply": float(draw.uniform(3.0, 10.0))}
    for axle in ("front", "rear", "trailer"):
        rising, push_out = float(draw.uniform(400.0, 3000.0)), float(draw.uniform(0.0, 0.8))
        table[axle] = {
            "gradient": rising,
            "push_out": push_out,
            "release": push_out * float(draw.uniform(0.5, 1.0)),
            "falling": rising * float(draw.uniform(1.0, 1.3)),
        }
    return table


def axle(draw: np.random.Generator, x: float) -> dict[str, float]:
    """Wheels of an axle."""
    return {
        "x": x,
        "track": float(draw.uniform(1.7, 2.1)),
        "radius": float(draw.uniform(0.35, 0.55)),
        "spin_inertia": float(draw.uniform(3.0, 30.0)),
    }


def vehicle(draw: np.random.Generator) -> dict[str, Any]:
    """A truck, light or laden, low enough that friction of 1 does not turn it over."""
    mass = float(draw.uniform(1500.0, 16000.0))
    return {
        "mass": mass,
        "yaw_inertia": mass * float(draw.uniform(2.0, 5.0)),
        "height": float(draw.uniform(0.3, 1.3)),
        "front": axle(draw, float(draw.uniform(1.3, 2.2))),
        "rear": axle(draw, float(draw.uniform(-2.4, -1.4))),
    }


def trailer(draw: np.random.Generator) -> dict[str, Any]:
    """A drawbar trailer."""
    mass = float(draw.uniform(1500.0, 9000.0))
    axles = {"front": axle(draw, float(draw.uniform(1.5, 2.4))), "rear": axle(draw, float(draw.uniform(-2.4, -1.5)))}
    return {
        "mass": mass,
        "yaw_inertia": mass * float(draw.uniform(2.0, 4.0)),
        "height": float(draw.uniform(0.5, 1.1)),
        "drawbar": float(draw.uniform(1.5, 3.0)),
        "drawbar_mass": float(draw.uniform(300.0, 800.0)),
        "drawbar_inertia": float(draw.uniform(150.0, 600.0)),
        "hook": float(draw.uniform(-4.0, -2.8)),
        **{name: {**own, "roll_share": 0.5} for name, own in axles.items()},
    }
