"""A prescribed pitch at index 1, by hand: what differentiating a constraint loses, and what puts it back.

With G = (0, 0, 0, 1) the guided vehicle is M q'' = F + G' A under g = G q - beta(t) = 0, an equation of index 3 in
its multiplier A. Differentiated twice the constraint reads G q'' = beta'', and at every instant accelerations and
multiplier solve one linear system (index 1), so that any integrator can follow:

    [ M  -G' ] [ q'' ]   [   F    ]
    [ G   0  ] [  A  ] = [ wanted ],    wanted = beta''.

But g'' = 0 alone keeps whatever the start or the integrator leaves in g and g': g(t) = g(0) + g'(0) t. Baumgarte
wants beta'' - 2 alpha g' - alpha^2 g instead, so that g dies out; projection moves q and q' back onto the constraint
after each step, along M^-1 G', which the same system gives with wanted = -g.
"""

import numpy as np

from models.engines.assembly import Assembly
from models.engines.reference import derivative_of
from models.vehicles.linear import matrices
from models.vehicles.pitch_plane_equations import numbers

DIRECTION = np.array([[0.0, 0.0, 0.0, 1.0]])
"""G: the pitch alone is prescribed."""


class IndexOne:
    """The guided vehicle with its constraint differentiated twice.

    alpha : Baumgarte's rate in 1/s, 0 for none; projected : whether each step ends on the constraint
    """

    def __init__(self, assembly: Assembly, alpha: float = 0.0, projected: bool = False) -> None:
        self.assembly, self.alpha, self.projected = assembly, alpha, projected
        self._mass = matrices(assembly.vehicle)[0]
        self._solve = np.linalg.inv(np.block([[self._mass, -DIRECTION.T], [DIRECTION, np.zeros((1, 1))]]))
        self._free = derivative_of("force", assembly.vehicle.geometry)
        self._p = numbers(assembly.parameters, assembly.vehicle)

    def run(self, step: float, duration: float) -> np.ndarray:
        """States (n + 1, 8) by classical Runge-Kutta from the assembly's initial state, on the constraint or not."""
        assert self.assembly.input is not None
        count = round(duration / step)
        inputs = self.assembly.input.sample(0.0, step / 2, 2 * count + 1)
        states = np.empty((count + 1, 8))
        y = states[0] = self.assembly.initial
        for i in range(count):
            first, middle, last = inputs[2 * i : 2 * i + 3]
            k1 = self._rate(y, first)
            k2 = self._rate(y + 0.5 * step * k1, middle)
            k3 = self._rate(y + 0.5 * step * k2, middle)
            k4 = self._rate(y + step * k3, last)
            y = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            states[i + 1] = y = self._back(y, last) if self.projected else y
        return states

    def _rate(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """y' (8,) under the input u = (f1, f2, beta, beta', beta'')."""
        dy = self._free(y, u[:2].copy(), self._p)
        wanted = u[4] - 2 * self.alpha * (y[7] - u[3]) - self.alpha**2 * (y[3] - u[2])
        dy[4:] = (self._solve @ np.append(self._mass @ dy[4:], wanted))[:4]
        return dy

    def _back(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """The nearest state on the constraint, by the distance that kinetic energy defines."""
        along = self._solve[:4, 4]
        return y - np.concatenate((along * (y[3] - u[2]), along * (y[7] - u[3])))


def gap_law(times: np.ndarray, start: float, rate: float, alpha: float = 0.0) -> np.ndarray:
    """Gap g (n,) in rad of g'' + 2 alpha g' + alpha^2 g = 0 from g(0) = start (rad) and g'(0) = rate (rad/s)."""
    return (start + (rate + alpha * start) * times) * np.exp(-alpha * times)
