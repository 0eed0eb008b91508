"""What a time run of a scene costs: its states, the step limit of an explicit method, and the calls that follow."""

from dataclasses import dataclass

import numpy as np

from models.advice.ride_choice.reduced import Reduced

STAGES = 4
"""Calls of a step of the classical Runge-Kutta method."""
REACH = np.linspace(0.0, 3.0, 601)[1:]
"""Sizes of step times eigenvalue at which its stability is looked at; on the real axis it ends at 2.785."""


@dataclass(frozen=True)
class Cost:
    """``states`` of vehicle and road filters, without weightings; ``step`` (s), the largest at which the classical
    Runge-Kutta method is stable for the vehicle; ``calls`` of its right-hand side per second of motion at that step.

    The road's own poles do not bound the step: a time run reads heights from a table made beforehand. How fine a step
    must be to resolve the road or a quantity is another question, the same with and without an effect.
    """

    states: int
    step: float
    calls: float

    @property
    def work(self) -> float:
        """Calls times states, per second of motion."""
        return self.calls * self.states


def cost(reduced: Reduced) -> Cost:
    """Cost of a system whose every motion dies out; a motion that grows has no stable step and costs without end."""
    n = reduced.states - len(reduced.excitation.heights) * len(reduced.excitation.F)
    step = stable_step(np.linalg.eigvals(reduced.system.A[:n, :n]))
    return Cost(reduced.states, step, STAGES / step if step else np.inf)


def stable_step(values: np.ndarray) -> float:
    """Largest step (s) with |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for z = step times every eigenvalue (1/s)."""
    values = values[abs(values) > 0]
    z = values[:, None] / abs(values)[:, None] * REACH
    grown = abs(1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4)))) > 1 + 1e-12
    first = np.where(grown.any(axis=1), grown.argmax(axis=1), len(REACH))
    reach = np.where(first > 0, REACH[np.maximum(first, 1) - 1], 0.0)
    return float((reach / abs(values)).min(initial=np.inf))
