"""Energy activity of every element of a vehicle: the mean absolute power, in closed form for a Gaussian ride.

L. S. Louca, J. L. Stein and others rank elements by A = mean abs(effort flow) and drop those with the smallest share.
Deflection and rate, and rate and acceleration, of a stationary motion are uncorrelated, so that for Gaussian ones

    spring (2 / pi) k s_u s_v,    damper c s_v^2,    inertia (2 / pi) m s_a s_v.

Activity knows nothing of the question asked, and ranks elements one by one.
"""

import numpy as np

from models.advice.ride_choice.reduced import FullScene
from models.ride.covariance import stationary_covariance
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial import FREEDOMS
from models.vehicles.spatial_linear import slopes_at_rest


def activity_by_element(full_scene: FullScene) -> dict[str, float]:
    """Mean absolute power (W) by element: of springs, dampers, bars and tyres, and of every body's inertia along and
    about each axis.

    A wheel that meets white noise through a damped tyre has an acceleration without variance: its inertia is inf.
    """
    vehicle, system, n, states = (
        full_scene.scene.vehicle,
        full_scene.full.system,
        len(full_scene.linear.mass),
        full_scene.full.states,
    )
    P, A, motion = stationary_covariance(system).P[:states, :states], system.A[:states, :states], Kinematics(vehicle)
    noise, watts = np.hstack([b[n : 2 * n] for b in system.B]), dict[str, float]()

    def elastic(
        element_name: str, k: float, c: float, deflection_row: np.ndarray, road_height_row: np.ndarray | float = 0.0
    ) -> None:
        """Add the watts of a spring and damper whose deflection is ``deflection_row`` of the coordinates less the
        height of the ``road_height_row``.
        """
        u = np.concatenate([deflection_row, np.zeros(states - n)]) - road_height_row
        s_u, s_v = _standard_deviation(u, P), _standard_deviation(u @ A, P)
        if k:
            watts[f"spring {element_name}"] = 2 / np.pi * k * s_u * s_v
        if c:
            watts[f"damper {element_name}"] = c * s_v**2

    for spring in vehicle.springs:
        extension = motion.shift(spring.second_body, spring.second_point) - motion.shift(
            spring.first_body, spring.first_point
        )
        elastic(spring.name, *slopes_at_rest(spring), np.array(spring.axis) @ extension)
    for bar in vehicle.bars:
        risen = motion.shift(bar.left, bar.point_left)[2] - motion.shift(bar.right, bar.point_right)[2]
        elastic(bar.name, bar.stiffness, bar.damping, motion.coordinate(bar.body, "rx") - risen / bar.track)
    for element in vehicle.joint_elements:
        coordinate_factors = zip(element.coordinates, element.factors, strict=True)
        displacement = sum(factor * motion.coordinate(*body_freedom) for body_freedom, factor in coordinate_factors)
        elastic(element.name, element.stiffness, element.damping, np.asarray(displacement))
    heights = np.hstack([np.zeros((len(vehicle.tyres), 2 * n)), *full_scene.excitation.heights])
    for tyre, height in zip(vehicle.tyres, heights, strict=True):
        row = motion.shift(tyre.body, tyre.point)[2]
        elastic(f"tyre {tyre.name}", tyre.stiffness, tyre.damping, row, height)
    for body in vehicle.bodies:
        rows = [*motion.shift(body.name, body.position), *motion.turn(body.name)]
        values = [body.mass] * 3 + list(np.diag(body.inertia))
        for freedom, row, value in zip(FREEDOMS, rows, values, strict=True):
            if row.any() and value:
                s_a = np.inf if abs(row @ noise).max() > 0 else _standard_deviation(row @ A[n : 2 * n], P)
                s_v = _standard_deviation(np.concatenate([np.zeros(n), row, np.zeros(states - 2 * n)]), P)
                watts[f"inertia {body.name} {freedom}"] = 2 / np.pi * value * s_a * s_v
    return watts


def _standard_deviation(state_row: np.ndarray, P: np.ndarray) -> float:
    """Standard deviation of a linear combination ``state_row`` of the states with covariance P."""
    return float(np.sqrt(max(state_row @ P @ state_row, 0.0)))
