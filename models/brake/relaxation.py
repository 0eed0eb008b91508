"""Tyres whose slip angle lags behind the motion of the wheel by a relaxation length: first-order, across the wheel.

With a = tan of the slip angle that the tyre has taken up, and u, v the speeds of the wheel's centre along and across,

    sigma a' = v - |u| a,

which holds at rest too: there the tyre is a spring. It is solved exactly over half a step with the speeds before the
step and over the other half with those after it; the step between takes the forces at a in its middle: order two, and
stable at rest for steps below ``longest_step``. Below ``FADING_SPEED`` a damper across the wheel fades in, without
which a vehicle would rock on these springs. Source: J. E. Bernard, C. L. Clover, Tire modeling for low-speed
and high-speed calculations, SAE 950311 (recalled, not checked). Along the wheel slip does not lag.
"""

import math
from typing import NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE, NOT_FOUND, end_status
from models.brake.plane_chain import ChainPoint, velocity
from models.brake.plane_step import step_on
from models.brake.plane_vehicle import GRAVITY
from models.brake.samples import compiled
from models.brake.surfaces import surfaces_of, under_wheels
from models.brake.wheel_step import SLOWEST_SPEED, phi_1
from models.machine.compiled import inlined, njit

FADING_SPEED = 1.0
"""Speed (m/s) along the wheel below which a damper across it fades in."""
DAMPING = 0.7
"""Damping ratio of the damper across a wheel at rest that bears its share of the mass."""


class Lag(NamedTuple):
    """Tyres with lagging slip angles, each (W,): relaxation lengths (m), and tangents of the slip angles, which are
    updated in place.
    """

    length: np.ndarray
    angle: np.ndarray


@njit(cache=True, error_model="numpy")
def lagging_slip(a, u, v, time, length):
    """Tangent of the lagging slip angle after a time (s) at constant speeds u along and v across the wheel (m/s), with
    a relaxation length (m).
    """
    return a + (v - abs(u) * a) * phi_1(-abs(u) * time / length) * time / length


@inlined
def advance_lagging_slip(i, u, v, time, slope, lag, lagging):
    """Advance the lagging slip angle of wheel i by a time (s) at speeds u along and v across it (m/s). Its tangent with
    the damper's part goes into ``lagging`` (W,); slope : see ``OnRoad``.

    An angle that is NaN starts at its steady value for these speeds.
    """
    length = lag.length[i]
    if math.isnan(lag.angle[i]):
        lag.angle[i] = v / max(abs(u), SLOWEST_SPEED)
    lag.angle[i] = lagging_slip(lag.angle[i], u, v, time, length)
    fade = max(1.0 - abs(u) / FADING_SPEED, 0.0)
    rate = math.sqrt(max(slope, SLOWEST_SPEED) * GRAVITY * length)
    lagging[i] = lag.angle[i] + fade * fade * v * 2.0 * DAMPING / rate


def longest_step(slope: float, lively: float, length: float) -> float:
    """Longest stable step (s) of a vehicle at rest on tyres with a relaxation length (m).

    slope : largest cornering coefficient (1/rad); lively : rate (m/s^2) at which side forces of slope 1 at 1 m/s damp
    its liveliest motion, g of a point mass. With w^2 = slope lively / length and c = 2 DAMPING w sqrt(lively / g), the
    step is v' = v - h (w^2 y + c v), y' = y + h v', whose roots lie within 1 where (h w)^2 + 2 h c < 4.
    """
    w, spread = math.sqrt(max(slope, SLOWEST_SPEED) * lively / length), 2.0 * DAMPING * math.sqrt(lively / GRAVITY)
    return (math.sqrt(spread**2 + 4.0) - spread) / w


@njit(cache=True, error_model="numpy")
def lag_on(state, time, steer, vehicle, lag, lagging):
    """Advance the lagging slip angles of all wheels by a time (s), and fill ``lagging`` (W,): see
    ``advance_lagging_slip``.
    """
    plane = vehicle.plane
    for i in range(lag.angle.size):
        k = plane.unit[i]
        vx, vy = velocity(ChainPoint(k, plane.place[i, 0], plane.place[i, 1]), state[0], state[1], plane.reach)
        c, s = math.cos(state[0, 2 + k] + steer[i]), math.sin(state[0, 2 + k] + steer[i])
        advance_lagging_slip(i, c * vx + s * vy, c * vy - s * vx, time, vehicle.slope, lag, lagging)


@njit(cache=True, error_model="numpy")
def advance_lagging(motion, torques, step, steer, vehicle, lag):
    """Advance a vehicle on tyres with relaxation by n steps, as ``advance`` does; its ``Lag`` is updated in place."""
    surfaces, time = surfaces_of(np.empty((4, motion.turning.size))), 0.0
    for n in range(torques.shape[0] - 1):
        under_wheels(motion.state, step, vehicle, surfaces)
        lag_on(motion.state, 0.5 * step, steer, vehicle, lag, surfaces.lag)
        used = step_on(motion, torques[n : n + 2], step, steer, vehicle.slope * 9.81 * step, vehicle, surfaces)
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < step:
            return AT_REST, time
        lag_on(motion.state, 0.5 * step, steer, vehicle, lag, surfaces.lag)
        status = end_status(motion, vehicle.plane)
        if status != FINE:
            return status, time
    return FINE, time


by_lagging_steps = compiled(advance_lagging, "by_lagging_steps")
"""Compiled samples of a vehicle on tyres with relaxation, as ``by_steps``: after its arguments comes a ``Lag``."""
