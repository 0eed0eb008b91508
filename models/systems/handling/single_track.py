"""Closed form of a steady turn by the linear single-track model: the limit of the full vehicle at small slip.

Each axle has the cornering stiffness C of its tyres and the half length a of their patch. A brush that does not slide
has the side force -C (s_y + t phi) and the moment C t s_y - D phi about its normal, s_y the lateral slip, phi its
turning over its way, t = 3 pi a / 32 its trail and D = C b^2 / 5 for its half width b. With v the lateral velocity at
the centre of mass, r the yaw rate and u the speed, an axle at x from it slides by s_y = (v + x r) / u - delta and
turns by phi = r / u. Equilibrium of side forces and of moments is linear in v and r.

A towed body heads by the angle theta to the left of the vehicle. In a steady turn its axle slides like an axle that is
steered by theta. Forces and inertia of the body and of all that it tows are in balance about its hitch, which is an
equation for each of these angles.
"""

from dataclasses import dataclass

import numpy as np

from models.multibody.forces import BRISTLES, HALF_WIDTH, RADIUS, STATIC, STEERED, VERTICAL
from models.multibody.numbers import Handling
from models.vehicles.spatial import SpatialVehicle, hitch_of


@dataclass(frozen=True)
class SteadyTurnGains:
    """Steady turn per rad of steer angle: yaw rate (rad/s) and lateral velocity (m/s) at the common centre of mass.

    ``understeer`` is the gradient K (s^2/m) of delta = (L + K u^2) r / u, L the wheelbase of the towing vehicle;
    ``towed_headings`` : angles of the towed bodies to the left of the towing vehicle, in the order of ``towed``,
    per rad of steer angle.
    """

    yaw_gain: float
    lateral_velocity_gain: float
    understeer: float
    towed_headings: tuple[float, ...] = ()


def steady_turn_gains(handling_model: Handling, speed: float) -> SteadyTurnGains:
    """Solve the steady turn of the linear single-track model at a speed (m/s), with the static wheel loads."""
    vehicle = handling_model.vehicle
    mass = sum(body.mass for body in vehicle.bodies)
    centre = sum(body.mass * body.position[0] for body in vehicle.bodies) / mass
    size = 2 + len(vehicle.towed)
    matrix, steered = np.zeros((size, size)), np.zeros(size)
    for body in vehicle.bodies:
        by_force, _ = _force_balances(vehicle, body.name, body.position[0], centre)
        matrix[:, 1] -= body.mass * speed * by_force
    for i, tyre in enumerate(vehicle.tyres):
        n = handling_model.tyre_numbers(i)
        a = np.sqrt(n[RADIUS] * n[STATIC] / n[VERTICAL])
        c = 8.0 / 3.0 * a**2 * n[HALF_WIDTH] * n[BRISTLES]
        trail, turning = 3.0 * np.pi / 32.0 * a, n[HALF_WIDTH] ** 2 / 5.0
        heading = [-float(name == vehicle.towed_under(tyre.body)) for name in vehicle.towed]
        slip = np.array([1.0 / speed, (tyre.point[0] - centre) / speed, *heading])
        turn = np.eye(size)[1] / speed
        by_force, by_moment = _force_balances(vehicle, tyre.body, tyre.point[0], centre)
        matrix += c * np.outer(by_moment, trail * slip - turning * turn) - c * np.outer(by_force, slip + trail * turn)
        steered += n[STEERED] * c * (trail * by_moment - by_force)
    side, yaw, *headings = np.linalg.solve(matrix, steered).tolist()
    coordinates = [tyre.point[0] for tyre in vehicle.tyres if vehicle.towed_under(tyre.body) is None]
    wheelbase = max(coordinates) - min(coordinates)
    return SteadyTurnGains(yaw, side, float((speed / yaw - wheelbase) / speed**2), tuple(headings))


def _force_balances(
    vehicle: SpatialVehicle, body_name: str, force_x: float, centre_x: float
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients with which a side force on a body at x (m), and a moment about the vertical, enter the equilibrium
    equations; two arrays (2 + towed,).

    The equations are those of side forces, of moments about the centre of mass at ``centre_x`` (m), and of moments
    about the hitch of each towed body.
    """
    chain = vehicle.chain(body_name)
    behind = np.array([float(name in chain) for name in vehicle.towed])
    hitches = np.array([vehicle.body(hitch_of(name)).position[0] for name in vehicle.towed])
    return np.array([1.0, force_x - centre_x, *(behind * (force_x - hitches))]), np.array([0.0, 1.0, *behind])
