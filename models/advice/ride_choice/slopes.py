"""Sensitivities of a vehicle's output variances to its parameters: first-order changes where a parameter is a few per
cent off.

A parameter moves outputs by heights by dH = dC q + ddirect - (C / Z) (dZ q - dB): products of what the vehicle does
without it and of differences of matrices, so that one sum over frequencies serves all parameters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from models.advice.ride_choice.response import OutputFactors, Response
from models.vehicles.linear_vehicle import LinearVehicle


@dataclass(frozen=True)
class Shifts:
    """Changes of a vehicle's matrices with each of p parameters: of stiffness, damping and mass (p, n, n), of forces by
    road heights and their rates (p, n, wheels), of output factors of q, q', q'' (p, q, n), and of output factors of
    heights and their rates.
    """

    stiffness: tuple[np.ndarray, ...]
    by_heights: tuple[np.ndarray, ...]
    by_motion: tuple[np.ndarray, ...]
    by_road: tuple[np.ndarray, ...]

    @classmethod
    def from_vehicles(
        cls, vehicle: LinearVehicle, shifted_vehicles: Sequence[LinearVehicle], output_rows: Sequence[int]
    ) -> "Shifts":
        """Matrices of the other vehicles less those of ``vehicle``, for the outputs with these row indices."""
        matrices, *changed_matrices = (
            [*_matrices_and_readings(linear_vehicle, output_rows)] for linear_vehicle in (vehicle, *shifted_vehicles)
        )
        changes = [
            np.array([linear_vehicle[i] for linear_vehicle in changed_matrices]) - matrix
            for i, matrix in enumerate(matrices)
        ]
        return cls(tuple(changes[:3]), tuple(changes[3:5]), tuple(changes[5:8]), tuple(changes[8:]))

    def only(self, is_present: np.ndarray) -> "Shifts":
        """The same changes of matrices, with zeros for parameters whose ``is_present`` (p,) is false."""
        parts = (self.stiffness, self.by_heights, self.by_motion, self.by_road)
        return Shifts(
            *(tuple(matrix_changes * is_present[:, None, None] for matrix_changes in matrices) for matrices in parts)
        )


def _matrices_and_readings(vehicle: LinearVehicle, output_rows: Sequence[int]) -> Iterator[np.ndarray]:
    """Matrices of a vehicle, then factors of its outputs, in the order of the fields of ``Shifts``."""
    read = OutputFactors.of_rows(vehicle, output_rows)
    yield from (vehicle.stiffness, vehicle.damping, vehicle.mass, vehicle.road_stiffness, vehicle.road_damping)
    yield from (*read.by_motion, *read.by_road)


class Sensitivity:
    """First-order changes of variances at speeds (v,) by parameters. They follow from road heights (v, w, wheels, k),
    weights (w, q) of the sum over frequencies, and N (n, r) from the response's coordinates to those of the vehicle
    whose parameters are off.
    """

    def __init__(self, response: Response, heights: np.ndarray, weights: np.ndarray, N: np.ndarray) -> None:
        outputs = response.H @ heights
        met = 2.0 * weights[..., None] * (heights @ outputs.conj().mT).mT  # (v, w, q, wheels)
        q, back = response.coordinates()
        r = N.shape[1]
        adjoint = np.concatenate([back, np.ones((*back.shape[:2], 1))], axis=2)  # (w, q, r + 1)
        products = _by_outputs(np.concatenate([met @ q.mT, met], axis=3))  # with coordinates, then with heights
        sums = [_frequency_sums(adjoint * response.s[:, None, None] ** k, products) for k in range(3)]
        self.by_force = [N @ each[:, :, :r, :r] @ N.T for each in sums]
        self.by_column = [N @ each[:, :, :r, r:] for each in sums[:2]]
        self.by_row = [each[:, :, r, :r] @ N.T for each in sums]
        self.by_road = [each[:, :, r, r:] for each in sums[:2]]

    def slopes(self, shifts: Shifts, is_inertial: np.ndarray) -> np.ndarray:
        """First-order changes of variances (v, q, p) by each matrix change. A change of mass counts only for parameters
        that are ``is_inertial`` (p,).
        """
        stiffness = (*shifts.stiffness[:2], shifts.stiffness[2] * is_inertial[:, None, None])
        forces = [(self.by_force, stiffness, -1.0), (self.by_column, shifts.by_heights, 1.0)]
        outputs = [(self.by_row, shifts.by_motion), (self.by_road, shifts.by_road)]
        total = np.zeros((*self.by_road[0].shape[:2], len(is_inertial)))
        for sums, matrix_changes, sign in forces:
            for sensitivity, matrices in zip(sums, matrix_changes, strict=True):
                if matrices.any():
                    total += sign * np.tensordot(sensitivity, matrices, ((2, 3), (1, 2)))
        for sums, matrix_changes in outputs:
            for sensitivity, matrices in zip(sums, matrix_changes, strict=True):
                if matrices.any():
                    total += np.einsum("vqj,pqj->vqp", sensitivity, matrices)
        return total


def _by_outputs(complex_products: np.ndarray) -> np.ndarray:
    """Real, then imaginary parts (v, q, 2 w, j) of complex products (v, w, q, j)."""
    return np.concatenate([complex_products.real, complex_products.imag], axis=1).transpose(0, 2, 1, 3).copy()


def _frequency_sums(adjoint_responses: np.ndarray, products: np.ndarray) -> np.ndarray:
    """Real part (v, q, i, j) of the sums over frequencies w of products of complex ``adjoint_responses`` (w, q, i) and
    of ``products`` from ``_by_outputs``.
    """
    left = np.concatenate([adjoint_responses.real, -adjoint_responses.imag]).transpose(1, 2, 0)  # (q, i, 2 w)
    return np.asarray(left @ products)
