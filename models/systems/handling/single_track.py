"""The plane single-track vehicle of small slip, written down: the limit of the whole vehicle in a steady turn.

Each axle has the cornering stiffness C of its tyres and the half length a of their patch. A brush that does not slide
has the side force -C (s_y + t phi) and the moment C t s_y - D phi about its normal, s_y the lateral slip, phi its
turning over its way, t = 3 pi a / 32 its trail and D = C b^2 / 5 for its half width b. With v the lateral velocity at
the centre of mass, r the yaw rate and u the speed, an axle at x from it slides by s_y = (v + x r) / u - delta and
turns by phi = r / u. Equilibrium of side forces and of moments is linear in v and r.
"""

from dataclasses import dataclass

import numpy as np

from models.multibody.forces import BRISTLES, HALF_WIDTH, RADIUS, STATIC, STEERED, VERTICAL
from models.multibody.numbers import Handling


@dataclass(frozen=True)
class SteadyTurn:
    """Yaw rate (rad/s) and lateral velocity at the centre of mass (m/s) per rad of steer.

    ``understeer`` is the gradient K (s^2/m) of delta = (L + K u^2) r / u.
    """

    yaw_gain: float
    side_gain: float
    understeer: float


def steady_turn(handling: Handling, speed: float) -> SteadyTurn:
    """Closed form of the vehicle at a speed (m/s), at its static wheel loads."""
    free = handling.vehicle
    mass = sum(body.mass for body in free.bodies)
    centre = sum(body.mass * body.position[0] for body in free.bodies) / mass
    matrix, steered = np.array([[0.0, -mass * speed], [0.0, 0.0]]), np.zeros(2)
    for i, tyre in enumerate(free.tyres):
        n = handling.tyre_numbers(i)
        a = np.sqrt(n[RADIUS] * n[STATIC] / n[VERTICAL])
        c = 8.0 / 3.0 * a**2 * n[HALF_WIDTH] * n[BRISTLES]
        trail, turning, x = 3.0 * np.pi / 32.0 * a, n[HALF_WIDTH] ** 2 / 5.0, tyre.point[0] - centre
        slip = np.array([1.0, x]) / speed
        force = -c * (slip + np.array([0.0, trail / speed]))
        moment = c * (trail * slip - np.array([0.0, turning / speed]))
        matrix += np.array([force, x * force + moment])
        steered += n[STEERED] * c * np.array([-1.0, -x + trail])
    side, yaw = np.linalg.solve(matrix, steered)
    wheelbase = max(t.point[0] for t in free.tyres) - min(t.point[0] for t in free.tyres)
    return SteadyTurn(float(yaw), float(side), float((speed / yaw - wheelbase) / speed**2))
