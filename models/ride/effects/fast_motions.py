"""Fast motions of the vehicle, such as wheel hop or an engine on its mounts: they follow the rest and the road."""

from dataclasses import replace
from functools import partial
from math import pi
from typing import Any

import numpy as np

from models.ride.choice.held import Effect, Held, holds, of_vehicle
from models.ride.operating_point import poles
from models.vehicles.spatial_linear import linearise

APART = 1.15
"""Motions whose rates differ by less than this factor go together."""

PLACE = "vehicle.file"
COST = "a state or two per motion, and the step limit, which is that of the fastest one"
leave_out = of_vehicle


def found(held: Held) -> list[Effect]:
    """One effect per group of motions of like rate but the slowest; each goes after all that are faster."""
    if held.scene.speeds is None:
        return []
    speeds = held.scene.speeds.all()
    rates = np.sort(abs(poles(linearise(held.vehicle, float(speeds[len(speeds) // 2])))))
    groups = [group for group in np.split(rates, 1 + np.flatnonzero(rates[1:] > APART * rates[:-1])) if group[-1] > 0]
    out: list[Effect] = []
    for slower, group in zip(groups[-2::-1], groups[:0:-1], strict=True):
        fastest = float(np.sqrt(slower[-1] * group[0]))
        name = f"motions at {_hertz(group)}"
        said = f"what is faster than {fastest / (2 * pi):.4g} Hz is where the rest and the road have it in the mean"
        out.append(Effect(name, partial(_without, fastest=fastest), said, why="for the fastest go first", singular=True,
                          after=tuple(effect.name for effect in out), last=True))  # fmt: skip
    return out


def _hertz(rates: np.ndarray) -> str:
    low, high = (f"{rate / (2 * pi):.3g}" for rate in (rates[0], rates[-1]))
    return f"{low} Hz" if low == high else f"{low} to {high} Hz"


def _without(held: Held, fastest: float) -> Held:
    return replace(held, fastest=min(held.fastest, fastest))


def named(scene: Any) -> bool:
    """Whether a scene's vehicle has it."""
    return holds(scene, found)
