"""A vehicle's outputs by the heights under its wheels at frequencies, from its motions, and how parameters move them.

With Z q = B u the dynamic stiffness and y = C q + direct u, the compliance is Z^-1 = Q (s - A)^-1 B_g + compliance of
what only springs hold. In the motions of A it is a sum of fractions 1 / (s - rate) and a polynomial in s = i w.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.advice.ride_choice.reduced import ReducedVehicle
from models.vehicles.linear_vehicle import LinearVehicle

RESPONSE_DIFFERENCE = 1e-7
"""Share of the largest response by which motions and the solve may differ at the frequency that is looked at."""


class OutputFactors(NamedTuple):
    """Factors of the requested outputs: of the motion q, q', q'' (q, n), and of heights and their rates (q, wheels)."""

    by_motion: tuple[np.ndarray, np.ndarray, np.ndarray]
    by_road: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of(cls, vehicle: LinearVehicle, rows: Sequence[int]) -> "OutputFactors":
        """Factors of the vehicle's outputs with these rows."""
        read, at = vehicle.read, list(rows)
        return cls(
            (read.displacement_factors[at], read.rate_factors[at], read.acceleration_factors[at]),
            (read.road_factors[at], read.road_rate_factors[at]),
        )


class Response:
    """Transfer functions H (w, q, wheels) from road heights to outputs at frequencies (w,) in rad/s."""

    def __init__(self, vehicle: ReducedVehicle, rows: Sequence[int], omega: np.ndarray) -> None:
        self.vehicle, self.s, self.read = vehicle, 1j * omega, OutputFactors.of(vehicle.linear, rows)
        self.by_heights = vehicle.linear.road_stiffness, vehicle.linear.road_damping
        self.motions = self._fractions()
        self.H = self._modal_product(self.read.by_motion, self.by_heights) + polynomial(self.read.by_road, self.s)

    def coordinates(self) -> tuple[np.ndarray, np.ndarray]:
        """Transfer functions (w, n, wheels) from heights to coordinates, and (w, q, n) from forces on coordinates to
        outputs.
        """
        one = np.eye(len(self.vehicle.linear.mass))
        return self._modal_product([one], self.by_heights), self._modal_product(self.read.by_motion, [one])

    def _fractions(self) -> np.ndarray | None:
        """Partial fractions 1 / (s - rate) (w, modes). None where the equations must be solved: without modes, or where
        both differ at the frequency with the largest response.
        """
        modes = self.vehicle.modes
        if modes is None:
            return None
        fractions = 1.0 / (self.s[:, None] - modes.rates)
        at = [int(abs(fractions).max(axis=1).argmax())]
        one = [np.eye(len(self.vehicle.linear.mass))]
        by_motions = self._sum_over_modes(fractions[at], one, self.by_heights, self.s[at])
        by_solve = self._product_by_solving(one, self.by_heights, self.s[at])
        same = abs(by_motions - by_solve).max() <= RESPONSE_DIFFERENCE * abs(by_solve).max()
        return fractions if same else None

    def _modal_product(self, left: Sequence[np.ndarray], right: Sequence[np.ndarray]) -> np.ndarray:
        """Product (w, i, j) of a polynomial in s of rows, the compliance, and a polynomial of columns."""
        if self.motions is None:
            return self._product_by_solving(left, right, self.s)
        return self._sum_over_modes(self.motions, left, right, self.s)

    def _sum_over_modes(
        self, fractions: np.ndarray, left: Sequence[np.ndarray], right: Sequence[np.ndarray], s: np.ndarray
    ) -> np.ndarray:
        states, modes = self.vehicle.states, self.vehicle.modes
        assert modes is not None
        to_motions, of_motions = modes.W @ states.B, states.Q @ modes.V
        rows = sum((part @ of_motions) * modes.rates**i for i, part in enumerate(left))
        columns = sum((to_motions @ part) * modes.rates[:, None] ** i for i, part in enumerate(right))
        each = rows.T[:, :, None] * columns[:, None, :]
        whole = (fractions @ each.reshape(len(each), -1)).reshape(len(s), *each.shape[1:])
        return np.asarray(whole + polynomial(self._remaining_polynomial(left, right), s))

    def _remaining_polynomial(self, left: Sequence[np.ndarray], right: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Coefficients, by power of s, of the polynomial that remains besides the partial fractions: s^k (s - A)^-1 =
        A^k (s - A)^-1 + sum s^(k-1-j) A^j.

        The motions have no part in it, so that what vanishes does so without rounding.
        """
        states, powers = self.vehicle.states, len(left) + len(right) - 1
        moved = [states.Q @ np.linalg.matrix_power(states.A, j) @ states.B for j in range(powers - 1)]
        rest = [np.zeros((len(left[0]), right[0].shape[1])) for _ in range(powers)]
        for i, row in enumerate(left):
            for j, column in enumerate(right):
                if not row.any() or not column.any():
                    continue
                rest[i + j] += row @ states.direct @ column
                for k in range(i + j):
                    rest[k] += row @ moved[i + j - 1 - k] @ column
        return rest

    def _product_by_solving(self, left: Sequence[np.ndarray], right: Sequence[np.ndarray], s: np.ndarray) -> np.ndarray:
        """The product of ``_modal_product``, by solving the equations at every frequency."""
        linear = self.vehicle.linear
        Z = polynomial((linear.stiffness, linear.damping, linear.mass), s)
        return np.asarray(polynomial(left, s) @ np.linalg.solve(Z, polynomial(right, s)))


def polynomial(coefficients: Sequence[np.ndarray], s: np.ndarray) -> np.ndarray:
    """Values (w, i, j) of a polynomial with coefficients (i, j), by power of s, at s (w,)."""
    total = np.zeros((len(s), *coefficients[0].shape), complex)
    for power, coefficient in enumerate(coefficients):
        if coefficient.any():
            total += s[:, None, None] ** power * coefficient
    return total
