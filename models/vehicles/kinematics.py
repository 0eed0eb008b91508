"""First and second derivatives of a point of a body by the coordinates, in the design position."""

import numpy as np

from models.vehicles.spatial import FREEDOMS, Body, SpatialVehicle, Vector

UNIT = np.eye(3)
TURN = np.array([np.cross(unit, UNIT).T for unit in UNIT])
"""(3, 3, 3): e_i x v = TURN[i] @ v."""


class Kinematics:
    """Where the points of a vehicle go when its coordinates are small: exact to second order.

    A body moves by its own coordinates after those of the bodies it rides on, so that an outer turn also turns every
    inner motion: d2p / dq_a dq_b = e_a x dp/dq_b for an outer (or the same) turn a about e_a, 0 for an outer shift.
    """

    def __init__(self, vehicle: SpatialVehicle) -> None:
        self._bodies = {body.name: body for body in vehicle.bodies}
        self._index = {coordinate: i for i, coordinate in enumerate(vehicle.coordinates())}
        self.size = len(self._index)

    def coordinate(self, body: str, freedom: str) -> np.ndarray:
        """Row (n,) that picks one coordinate out of q, zeros where the body does not have it."""
        row = np.zeros(self.size)
        if (body, freedom) in self._index:
            row[self._index[body, freedom]] = 1.0  # type: ignore[index]
        return row

    def shift(self, body: str | None, point: Vector) -> np.ndarray:
        """(3, n): displacement of a point (m) by the coordinates; zeros on the ground, None."""
        columns = np.zeros((3, self.size))
        for rider, freedom, i in self._motions(body):
            along = FREEDOMS.index(freedom)
            columns[:, i] = UNIT[along] if along < 3 else TURN[along - 3] @ np.subtract(point, rider.position)
        return columns

    def turn(self, body: str) -> np.ndarray:
        """(3, n): small rotation of a body (rad) by the coordinates."""
        columns = np.zeros((3, self.size))
        for _, freedom, i in self._motions(body):
            along = FREEDOMS.index(freedom)
            if along >= 3:
                columns[:, i] = UNIT[along - 3]
        return columns

    def bend(self, body: str | None, point: Vector) -> np.ndarray:
        """(3, n, n): second derivatives of a point (m) by the coordinates."""
        first = self.shift(body, point)
        second = np.zeros((3, self.size, self.size))
        motions = self._motions(body)
        for k, (_, freedom, outer) in enumerate(motions):
            along = FREEDOMS.index(freedom)
            if along >= 3:
                for _, _, inner in motions[k:]:
                    second[:, outer, inner] = second[:, inner, outer] = TURN[along - 3] @ first[:, inner]
        return second

    def _motions(self, body: str | None) -> list[tuple[Body, str, int]]:
        """Coordinates that move a body, from the ground outwards: (the body that has it, freedom, index)."""
        if body is None:
            return []
        rider = self._bodies[body]
        own = [(rider, f, self._index[rider.name, f]) for f in FREEDOMS if f in rider.freedoms]
        return self._motions(rider.parent) + own
