"""One step of a force-excited vehicle without its absolute heave, with the derivatives of that same step.

The step is the reference's compiled Runge-Kutta, and its derivatives are central differences of it: the nonlinear
step itself with all its substeps, without a second copy of the equations that could differ.
They are good to 1e-9, because states differ by 1e-5 about values near one, and forces and 1/I enter linearly.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba.extending import register_jitable

from models.engines.assembly import Assembly
from models.engines.reference import compiled, march_of
from models.engines.stability import first_order, linearised

KEPT = np.array([0, 1, 3, 4, 5, 7])
"""Where (z1, z2, pitch) and their rates stand in the state (8,)."""
RELATIVE = np.eye(8)[KEPT]
RELATIVE[0:2, 2] = RELATIVE[3:5, 6] = -1.0
"""Matrix (6, 8) that turns a state into (z1 - z3, z2 - z3, pitch) and their rates."""
INERTIA = 5
"""Where the pitch inertia stands among the parameters."""
NUDGES = np.array([1.0, *[1e-5] * 6, 1e-2, *[1e3] * 4])
"""Half widths of the differences: none, then m, rad, m/s and rad/s, share of 1/I, N."""
REACH = 0.7
"""Longest substep by the time constant of the fastest pole: RK4 then errs by 1e-3 of that mode a step."""

_RESPONDING: dict[tuple, Any] = {}


@dataclass
class PitchStep:
    """Steps of ``period`` (s) through the forces of an assembly: step number i starts at i period, ``count`` in all."""

    assembly: Assembly
    period: float
    count: int
    _substeps: int = field(init=False)

    def __post_init__(self) -> None:
        own, signal = self.assembly, self.assembly.input
        assert signal is not None
        pole = np.abs(np.linalg.eigvals(first_order(linearised(own.vehicle, ())))).max()
        n = self._substeps = math.ceil(self.period * pole / REACH)
        self._rows = (0, 0, 1) if signal.held else (1, 2, 2)
        per_step, ends = n * self._rows[2], 0 if signal.held else 1
        self._inputs = signal.sample(0.0, self.period / per_step, self.count * per_step + ends)
        falling = np.ones(per_step) if signal.held else np.linspace(1.0, 0.0, per_step + 1)
        self._hats = np.column_stack([falling, 1.0 - falling])
        self._p = own.parameters.array()
        self._respond = responding(own.mode, own.vehicle.geometry)

    def advance(self, x: np.ndarray, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Over one step from x (7,): x after it, and its derivatives.

        x : (z1 - z3, z2 - z3, pitch), their rates, and the share by which 1/I is above the assembly's
        They are those to x, (7, 7), and to the two force samples at the step's start and at its end, (7, 2) per N.
        A held sample acts on the step after it alone; a spline counts as the polyline through its samples.
        """
        first = number * self._substeps * self._rows[2]
        inputs = self._inputs[first : first + len(self._hats)]
        found = self._respond(x, self.period / self._substeps, self._substeps, inputs, self._rows, self._p, self._hats)
        return found[:, 0].copy(), found[:, 1:8], found[:, 8:10], found[:, 10:]


def responding(mode: str, geometry: str) -> Any:
    """The compiled step of one mode with its derivatives, made when first asked for.

    (x, step, count, inputs, rows, p, hats) -> (7, 12): x after it, its columns d/dx (7), d/d(first force sample) (2)
    and d/d(last one) (2). step to p are those of the reference's march; hats (rows, 2) say how the first and the
    last sample share in each row of the inputs.
    """
    key = (mode, geometry)  # the march goes in as Python: numba cannot cache what encloses compiled code
    if key not in _RESPONDING:
        _RESPONDING[key] = _compile(register_jitable(march_of(*key).py_func), key)
    return _RESPONDING[key]


def _compile(march: Any, key: tuple) -> Any:
    def respond(x, step, count, inputs, rows, p, hats):
        states, found, own = np.empty((count + 1, 8)), np.zeros((7, 12)), p.copy()
        for column in range(12):
            for sign in (1.0, -1.0):
                y, pushed, nudge = np.zeros(8), inputs, sign * NUDGES[column]
                y[KEPT] = x[:6]
                own[INERTIA] = p[INERTIA] / (1.0 + x[6] + (nudge if column == 7 else 0.0))
                if 0 < column < 7:
                    y[KEPT[column - 1]] += nudge
                elif column > 7:
                    pushed = inputs.copy()
                    pushed[:, (column - 8) % 2] += nudge * hats[:, (column - 8) // 2]
                march(y, step, count, pushed, rows, own, states)
                end, share = states[count], 0.5 / (nudge if column > 0 else 1.0)
                for row in range(6):
                    heave = end[2] if row < 2 else end[6] if 2 < row < 5 else 0.0
                    found[row, column] += share * (end[KEPT[row]] - heave)
        found[6, 0], found[6, 7] = x[6], 1.0
        return found

    return compiled(respond, ("pitch_step", *key))
