"""Frequency responses of a vehicle's outputs to road heights under its wheels, from its eigenmodes.

With Z q = B u the dynamic stiffness and y = C q + direct u, the compliance is Z^-1 = Q (s - A)^-1 B_g + compliance of
what only springs hold. In the motions of A it is a sum of fractions 1 / (s - rate) and a polynomial in s = i w.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from models.advice.ride_choice.reduced import ReducedVehicle
from models.vehicles.linear_vehicle import LinearVehicle

RESPONSE_DIFFERENCE = 1e-7
"""Share of the largest response by which eigenmodes and the direct solution may differ at the frequency that is
checked.
"""


class OutputFactors(NamedTuple):
    """Factors of a vehicle's requested outputs: of its motion q, q', q'' (q, n), and of road heights and their rates
    (q, wheels).
    """

    by_motion: tuple[np.ndarray, np.ndarray, np.ndarray]
    by_road: tuple[np.ndarray, np.ndarray]

    @classmethod
    def of_rows(cls, vehicle: LinearVehicle, output_rows: Sequence[int]) -> "OutputFactors":
        """Factors of the vehicle's outputs with these row indices."""
        read, row_list = vehicle.read, list(output_rows)
        return cls(
            (read.displacement_factors[row_list], read.rate_factors[row_list], read.acceleration_factors[row_list]),
            (read.road_factors[row_list], read.road_rate_factors[row_list]),
        )


class Response:
    """Transfer functions H (w, q, wheels) from road heights to outputs at angular frequencies (w,) in rad/s."""

    def __init__(self, vehicle: ReducedVehicle, output_rows: Sequence[int], omega: np.ndarray) -> None:
        self.vehicle, self.s, self.read = vehicle, 1j * omega, OutputFactors.of_rows(vehicle.linear, output_rows)
        self.by_heights = vehicle.linear.road_stiffness, vehicle.linear.road_damping
        self.motions = self._fractions()
        self.H = self._modal_product(self.read.by_motion, self.by_heights) + polynomial(self.read.by_road, self.s)

    def coordinates(self) -> tuple[np.ndarray, np.ndarray]:
        """Transfer functions (w, n, wheels) from road heights to coordinates, and (w, q, n) from forces on coordinates
        to outputs.
        """
        unit = np.eye(len(self.vehicle.linear.mass))
        return self._modal_product([unit], self.by_heights), self._modal_product(self.read.by_motion, [unit])

    def _fractions(self) -> np.ndarray | None:
        """Partial fractions 1 / (s - rate) (w, modes). None where the equations must be solved directly: without
        eigenmodes, or where both differ at the frequency with the largest response.
        """
        modes = self.vehicle.modes
        if modes is None:
            return None
        fractions = 1.0 / (self.s[:, None] - modes.rates)
        stiffest = [int(abs(fractions).max(axis=1).argmax())]
        unit = [np.eye(len(self.vehicle.linear.mass))]
        by_motions = self._sum_over_modes(fractions[stiffest], unit, self.by_heights, self.s[stiffest])
        by_solve = self._product_by_solving(unit, self.by_heights, self.s[stiffest])
        agree = abs(by_motions - by_solve).max() <= RESPONSE_DIFFERENCE * abs(by_solve).max()
        return fractions if agree else None

    def _modal_product(
        self, row_coefficients: Sequence[np.ndarray], column_coefficients: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Product (w, i, j) of a polynomial of row vectors in s, the compliance of the vehicle, and a polynomial of
        column vectors in s.
        """
        if self.motions is None:
            return self._product_by_solving(row_coefficients, column_coefficients, self.s)
        return self._sum_over_modes(self.motions, row_coefficients, column_coefficients, self.s)

    def _sum_over_modes(
        self,
        fractions: np.ndarray,
        row_coefficients: Sequence[np.ndarray],
        column_coefficients: Sequence[np.ndarray],
        s: np.ndarray,
    ) -> np.ndarray:
        """Product as from ``_modal_product``, as a sum of partial fractions and a polynomial in s."""
        states, modes = self.vehicle.states, self.vehicle.modes
        assert modes is not None
        to_motions, of_motions = modes.W @ states.B, states.Q @ modes.V
        rows = sum((coefficients @ of_motions) * modes.rates**i for i, coefficients in enumerate(row_coefficients))
        columns = sum(
            (to_motions @ coefficients) * modes.rates[:, None] ** i
            for i, coefficients in enumerate(column_coefficients)
        )
        modal_products = rows.T[:, :, None] * columns[:, None, :]
        sum_of_fractions = (fractions @ modal_products.reshape(len(modal_products), -1)).reshape(
            len(s), *modal_products.shape[1:]
        )
        return np.asarray(
            sum_of_fractions + polynomial(self._remaining_polynomial(row_coefficients, column_coefficients), s)
        )

    def _remaining_polynomial(
        self, row_coefficients: Sequence[np.ndarray], column_coefficients: Sequence[np.ndarray]
    ) -> list[np.ndarray]:
        """Coefficients, by power of s, of the polynomial that remains besides the partial fractions: s^k (s - A)^-1 =
        A^k (s - A)^-1 + sum s^(k-1-j) A^j.

        The motions have no part in it, so that what vanishes does so without rounding.
        """
        states, powers = self.vehicle.states, len(row_coefficients) + len(column_coefficients) - 1
        impulse_terms = [states.Q @ np.linalg.matrix_power(states.A, j) @ states.B for j in range(powers - 1)]
        coefficients = [np.zeros((len(row_coefficients[0]), column_coefficients[0].shape[1])) for _ in range(powers)]
        for i, row in enumerate(row_coefficients):
            for j, column in enumerate(column_coefficients):
                if not row.any() or not column.any():
                    continue
                coefficients[i + j] += row @ states.direct @ column
                for k in range(i + j):
                    coefficients[k] += row @ impulse_terms[i + j - 1 - k] @ column
        return coefficients

    def _product_by_solving(
        self, row_coefficients: Sequence[np.ndarray], column_coefficients: Sequence[np.ndarray], s: np.ndarray
    ) -> np.ndarray:
        """Product as from ``_modal_product``, by solving the equations of motion at every frequency."""
        linear = self.vehicle.linear
        Z = polynomial((linear.stiffness, linear.damping, linear.mass), s)
        return np.asarray(polynomial(row_coefficients, s) @ np.linalg.solve(Z, polynomial(column_coefficients, s)))


def polynomial(coefficients: Sequence[np.ndarray], s: np.ndarray) -> np.ndarray:
    """Values (w, i, j) of a matrix polynomial in s at s (w,), from its ``coefficients`` (i, j) by power of s."""
    total = np.zeros((len(s), *coefficients[0].shape), complex)
    for power, coefficient in enumerate(coefficients):
        if coefficient.any():
            total += s[:, None, None] ** power * coefficient
    return total
