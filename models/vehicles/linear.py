"""Mass, damping and stiffness matrices of a described vehicle, linearised about zero pitch."""

import numpy as np

from models.vehicles.description import Point, Vehicle


def matrices(vehicle: Vehicle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, D, K of M q'' + D q' + K q = f, each (n, n) in the order of ``vehicle.coordinates()``.

    Units kg, N s/m and N/m for heave rows; pitch rows are moments (N m). Gravity is not in K, nor a spring with
    a dead band, which is slack about zero pitch. Tyres that can lift are on the road.
    """
    coordinates = vehicle.coordinates()
    inertias = {(body.name, "z"): body.mass for body in vehicle.bodies}
    inertias |= {(body.name, "pitch"): body.pitch_inertia or 0.0 for body in vehicle.bodies}
    mass = np.diag([inertias[coordinate] for coordinate in coordinates])
    damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
    for strut in vehicle.struts:
        row = _vertical(strut.upper, coordinates) - _vertical(strut.lower, coordinates)
        damping += strut.damping * np.outer(row, row)
        stiffness += strut.stiffness * np.outer(row, row)
    for spring in (spring for spring in vehicle.pitch_springs if not spring.dead_band):
        at = coordinates.index((spring.body, "pitch"))
        damping[at, at] += spring.damping
        stiffness[at, at] += spring.stiffness
    return mass, damping, stiffness


def _vertical(point: Point, coordinates: tuple[tuple[str, str], ...]) -> np.ndarray:
    """Row that turns small coordinates into the vertical displacement of a point: z - x pitch."""
    row = np.zeros(len(coordinates))
    for i, (body, kind) in enumerate(coordinates):
        if body == point.body:
            row[i] = 1.0 if kind == "z" else -point.x
    return row
