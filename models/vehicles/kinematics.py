"""Kinematics of a vehicle for small coordinates: displacements of points and rotations of bodies, exact to second
order."""

from functools import lru_cache

import numpy as np

from models.core.errors import InputError
from models.vehicles.spatial import FREEDOMS, PARALLEL, Body, SpatialVehicle, Vector

SpringEnd = tuple[str | None, Vector]
"""End of a spring: a body, None for the ground, and a point (m) that is fixed to it, in the design position."""
UNIT_AXES = np.eye(3)
"""Unit matrix, whose rows are the axes x, y, z."""
ROTATION_GENERATORS = np.array([np.cross(unit, UNIT_AXES).T for unit in UNIT_AXES])
"""Generators (3, 3, 3) of rotations about the axes: e_i x v = ROTATION_GENERATORS[i] @ v."""


class Kinematics:
    """Displacements of a vehicle's points as functions of small coordinates, exact to second order.

    A body moves by its own coordinates after those of the bodies it rides on, so that an outer turn also turns every
    inner motion: d2p / dq_a dq_b = e_a x dp/dq_b for an outer (or the same) turn a about e_a, 0 for an outer shift.
    """

    def __init__(self, vehicle: SpatialVehicle) -> None:
        _check_parallel(vehicle)
        self._bodies = {body.name: body for body in vehicle.bodies}
        self._index = {coordinate: i for i, coordinate in enumerate(vehicle.coordinates())}
        self.size = len(self._index)
        bodies = ((body.name, body.parent, body.position, body.freedoms) for body in vehicle.bodies)
        self._shifts = _displacement_cache(tuple(bodies))

    def coordinate(self, body_name: str, freedom: str) -> np.ndarray:
        """Row (n,) that selects a coordinate from all coordinates q; zeros if the body does not have it."""
        row = np.zeros(self.size)
        if (body_name, freedom) in self._index:
            row[self._index[body_name, freedom]] = 1.0  # type: ignore[index]
        return row

    def shift(self, body: str | None, point: Vector) -> np.ndarray:
        """Displacement (3, n) of a point (m) of a body per coordinate, read-only; zeros on the ground, None."""
        x, y, z = point
        place = body, (x, y, z)
        if place not in self._shifts:
            self._shifts[place] = self._shift_of(*place)
            self._shifts[place].flags.writeable = False
        return self._shifts[place]

    def _shift_of(self, body_name: str | None, point: Vector) -> np.ndarray:
        columns = np.zeros((3, self.size))
        for rider, freedom, i in self._motions(body_name):
            along = FREEDOMS.index(freedom)
            columns[:, i] = (
                UNIT_AXES[along] if along < 3 else ROTATION_GENERATORS[along - 3] @ np.subtract(point, rider.position)
            )
        return columns

    def turn(self, body: str) -> np.ndarray:
        """Small rotation (3, n) of a body (rad) per coordinate."""
        columns = np.zeros((3, self.size))
        for _, freedom, i in self._motions(body):
            along = FREEDOMS.index(freedom)
            if along >= 3:
                columns[:, i] = UNIT_AXES[along - 3]
        return columns

    def second_derivatives(self, body_name: str | None, point: Vector) -> np.ndarray:
        """Second derivatives (3, n, n) of a point's displacement (m) with respect to the coordinates."""
        first = self.shift(body_name, point)
        second = np.zeros((3, self.size, self.size))
        motions = self._motions(body_name)
        for k, (_, freedom, outer) in enumerate(motions):
            along = FREEDOMS.index(freedom)
            if along >= 3:
                for _, _, inner in motions[k:]:
                    second[:, outer, inner] = second[:, inner, outer] = ROTATION_GENERATORS[along - 3] @ first[:, inner]
        return second

    def turned_axis(self, frame_body: str | None, axis: Vector) -> np.ndarray:
        """Change (3, n) of an axis fixed in a body, per coordinate; zeros for an axis fixed in space, None."""
        return (
            np.zeros((3, self.size))
            if frame_body is None
            else -np.tensordot(axis, ROTATION_GENERATORS, 1) @ self.turn(frame_body)
        )

    def travel_second_derivatives(
        self, first_end: SpringEnd, second_end: SpringEnd, axis: Vector, frame_body: str | None
    ) -> np.ndarray:
        """Second derivatives (n, n) of the travel axis . (second point - first point) with respect to the coordinates;
        the axis is fixed in ``frame_body``, a body or space."""
        ends, second = (
            self.shift(*second_end) - self.shift(*first_end),
            self.second_derivatives(*second_end) - self.second_derivatives(*first_end),
        )
        total = np.tensordot(axis, second, 1)
        if frame_body is None:
            return total
        mixed, (x, y, z) = self.turned_axis(frame_body, axis).T @ ends, self._bodies[frame_body].position
        beyond = x + axis[0], y + axis[1], z + axis[2]
        bent = self.second_derivatives(frame_body, beyond) - self.second_derivatives(frame_body, (x, y, z))
        return np.asarray(total + mixed + mixed.T + np.tensordot(np.subtract(second_end[1], first_end[1]), bent, 1))

    def _motions(self, body_name: str | None) -> list[tuple[Body, str, int]]:
        """Coordinates that move a body, from the ground outwards: (body that has the coordinate, freedom, index)."""
        if body_name is None:
            return []
        rider = self._bodies[body_name]
        coordinates = [(rider, f, self._index[rider.name, f]) for f in FREEDOMS if f in rider.freedoms]
        return self._motions(rider.parent) + coordinates


@lru_cache(maxsize=16)
def _displacement_cache(
    bodies: tuple[tuple[str, str | None, Vector, tuple[str, ...]], ...],
) -> dict[SpringEnd, np.ndarray]:
    """Cache of points' displacements (3, n), shared by all vehicles with the same ``bodies``: name, parent, position
    and freedoms."""
    return {}


def _check_parallel(vehicle: SpatialVehicle) -> None:
    """Raise InputError for features of the vehicle that the linear equations do not support."""
    turned = next((body.name for body in vehicle.bodies if body.axes != PARALLEL), None)
    if turned is not None:
        raise InputError(vehicle.name, f"bodies[{turned}].axes", None, "must be parallel to the vehicle's axes")
