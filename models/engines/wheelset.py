"""A wheelset on rails whose equations of motion an engine writes: what is the same in every engine.

The engine has the body, its joints, its weight and the primary suspension as elements of its own; both rails act by a
callback about the compiled forces. All that follows from accelerations and paths (rest, linearisation, critical speed,
limit cycle) is that of ``rail.equations``, of which this takes the rates and the march from the engine.
"""

from abc import ABC, abstractmethod

import numpy as np

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.rail.equations import LIMIT, ROLL, YAW, Body, Equations, Y, Z
from models.rail.joint_forces import JOINTS, from_joints, rates_of, to_joints


def leaning(weight: float, body: Body) -> Array:
    """A weight's parts (3,) along the track's axes by its part square to the track, on the track of these numbers."""
    return weight * np.array([0.0, body.lean, 1.0])


class EngineWheelset(Equations, ABC):
    """A wheelset that travels at a speed in an engine; parameters and answers as those of ``Equations``."""

    @abstractmethod
    def accelerations(self, q: Array, v: Array) -> Array:
        """Accelerations (5,) of the joints by the engine at positions and rates (5,)."""

    @abstractmethod
    def marched(self, q: Array, v: Array, steps: int, step: float) -> Array:
        """Positions and rates (steps + 1, 10) by the engine's RK4, start included; RunFailed unless they are finite."""

    def rates(self, state: Array) -> Array:
        """Rates (10,) of a state (10,) by the engine."""
        joints = to_joints(np.asarray(state, float))
        return rates_of(joints, self.accelerations(joints[:JOINTS], joints[JOINTS:]))

    def _marched(self, state: Array, count: int, step: float, every: int) -> tuple[Array, Array]:
        """States by the engine's RK4, and the contacts of those that are kept."""
        joints = to_joints(state)
        states = from_joints(self.marched(joints[:JOINTS], joints[JOINTS:], count, step))
        away = ~(np.abs(states[:, [Y, Z, ROLL, YAW]]).sum(axis=1) < LIMIT)
        if away.any():
            raise RunFailed(self.ENGINE, "the wheelset leaves the track", (int(np.argmax(away)) - 1) * step)
        return states[::every], self.at(states[::every])[1]
