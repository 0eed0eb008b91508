"""What the equations of the pitch-plane vehicle take for granted."""

import math

from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.engines.assembly import Assembly

PRINCIPAL = ("z3", "pitch", "f1", "f2", "f3", "f4")
"""Channels whose error is told."""
SMALL = 0.3
"""rad: where sines are taken for angles, the pitch may be so large: 1.5 % of the sine."""
PUSHES = 1.0
"""N: a tyre that pulls by less is at its edge."""


def assumptions(assembly: Assembly) -> list[Assumption]:
    """What the equations of this scene take for granted."""
    listed = []
    if assembly.mode in ("free", "road") and not any(tyre.pushes_only for tyre in assembly.vehicle.tyres):
        listed.append(
            Assumption(
                "tyres press",
                "linear tyres stay on the road",
                "name the effect lift_off, whose tyres only push",
                _wheel_forces,
                "N",
                least=-PUSHES,
            )
        )
    if assembly.vehicle.geometry == "linear":
        listed.append(
            Assumption(
                "small angles",
                "the pitch is so small that its sine is itself",
                'use vehicle.geometry = "exact"',
                lambda run: {"chassis": run["pitch"]},
                "rad",
                -SMALL,
                SMALL,
            )
        )
    listed.append(
        Assumption(
            "upright",
            "the chassis pitches by less than a right angle",
            "stabilise the run, or end it before",
            lambda run: {"chassis": run["pitch"]},
            "rad",
            -math.pi / 2,
            math.pi / 2,
        )
    )
    return listed


def _wheel_forces(run: Result) -> Watched:
    return {"front wheel": run["f1"], "rear wheel": run["f2"]}
