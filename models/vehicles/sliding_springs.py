"""Replacement of joint elements along slides by spring-dampers between points, for systems that have no joint elements.

A body slides along the axes of what carries it. So the sum of its slides is the travel of a spring between it and its
carrier along an axis fixed there, and the difference of two slides on one carrier that of a spring between both bodies.
"""

from dataclasses import replace

import numpy as np

from models.core.errors import InputError
from models.vehicles.spatial import FREEDOMS, JointElement, SpatialVehicle, SpringDamper


def sliding_springs(vehicle: SpatialVehicle) -> SpatialVehicle:
    """The vehicle with equivalent spring-dampers in place of all joint elements. Raises InputError if one cannot be
    replaced."""
    springs = tuple(_spring_along_slides(vehicle, element) for element in vehicle.joint_elements)
    return replace(vehicle, springs=(*vehicle.springs, *springs), joint_elements=())


def _spring_along_slides(vehicle: SpatialVehicle, element: JointElement) -> SpringDamper:
    bodies = tuple(dict.fromkeys(body for body, _ in element.coordinates))
    carriers = {vehicle.body(body).parent for body in bodies}
    slides = all(not freedom.startswith("r") for _, freedom in element.coordinates)
    rows = [_translation_factors(element, body) for body in bodies]
    paired = len(bodies) == 1 or (len(bodies) == 2 and np.array_equal(rows[0], -rows[1]))
    carrier = carriers.pop()
    if element.inertia or not slides or not paired or carriers or carrier is None:
        said = "is neither along slides of one body nor along the difference of two: this system has no other springs"
        raise InputError(vehicle.name, element.name, None, f"{said}; handling and the closed form of ride have them")
    length = float(np.linalg.norm(rows[0]))
    if len(bodies) == 1:
        (body,), axis = bodies, rows[0] / length
        ends: tuple[str, str] = (carrier, body)
        points = (vehicle.body(body).position,) * 2
    else:
        (second, first), axis = bodies, rows[0] / length
        ends, points = (first, second), (vehicle.body(first).position, vehicle.body(second).position)
    x, y, z = axis.tolist()
    gains = element.stiffness * length**2, element.damping * length**2
    return SpringDamper(element.name, *ends, *points, (x, y, z), *gains, frame=carrier)


def _translation_factors(element: JointElement, body_name: str) -> np.ndarray:
    """Factors (3,) of a joint element for the translations of one body."""
    row = np.zeros(3)
    for (name, freedom), factor in zip(element.coordinates, element.factors, strict=True):
        if name == body_name:
            row[FREEDOMS.index(freedom) % 3] += factor
    return row
