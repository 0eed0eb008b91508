"""Tyres whose slip angle lags behind the motion of the wheel by a relaxation length: first-order, across the wheel.

With a = tan of the slip angle that the tyre has taken up, and u, v the speeds of the wheel's centre along and across,

    sigma a' = v - |u| a,

which holds at rest too: there the tyre is a spring. It is solved exactly over half a step with the speeds before the
step and over the other half with those after it; the step between takes the forces at a in its middle: order two, and
stable at rest for steps below ``longest_stable_step``. Below ``FADING_SPEED`` a damper across the wheel fades in,
without which a vehicle would rock on these springs. Source: J. E. Bernard, C. L. Clover, Tire modeling for low-speed
and high-speed calculations, SAE 950311 (recalled, not checked). Along the wheel slip does not lag.
"""

import math
from typing import NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE, NOT_FOUND, end_status
from models.brake.plane_chain import ChainPoint, chain_point_velocity
from models.brake.plane_step import advance_one_step
from models.brake.plane_vehicle import GRAVITY
from models.brake.samples import compiled_samples
from models.brake.surfaces import fill_surfaces_under_wheels, surfaces_of_rows
from models.brake.wheel_step import SLOWEST_SPEED, phi_1
from models.machine.compiled import inlined, njit

FADING_SPEED = 1.0
"""Speed (m/s) along the wheel below which a damper across it fades in."""
DAMPING = 0.7
"""Damping ratio of the damper across a wheel at rest that bears its share of the mass."""


class TyreLag(NamedTuple):
    """Tyres with lagging slip angles, each (W,): relaxation lengths (m), and tangents of the slip angles, which are
    updated in place.
    """

    length: np.ndarray
    angle: np.ndarray


@njit(cache=True, error_model="numpy")
def lagging_slip(slip_tangent, speed_along, speed_across, duration, relaxation_length):
    """Tangent of the lagging slip angle after a time (s) at constant speeds along and across the wheel (m/s), with
    a relaxation length (m).
    """
    return (
        slip_tangent
        + (speed_across - abs(speed_along) * slip_tangent)
        * phi_1(-abs(speed_along) * duration / relaxation_length)
        * duration
        / relaxation_length
    )


@inlined
def advance_lagging_slip(
    wheel_index, speed_along, speed_across, duration, cornering_coefficient, tyre_lag, slip_tangents
):
    """Advance the lagging slip angle of wheel i by a time (s) at speeds along and across it (m/s). Its tangent with
    the damper's part goes into ``slip_tangents`` (W,); cornering_coefficient : see ``VehicleOnRoad``.

    An angle that is NaN starts at its steady value for these speeds.
    """
    i = wheel_index
    length = tyre_lag.length[i]
    if math.isnan(tyre_lag.angle[i]):
        tyre_lag.angle[i] = speed_across / max(abs(speed_along), SLOWEST_SPEED)
    tyre_lag.angle[i] = lagging_slip(tyre_lag.angle[i], speed_along, speed_across, duration, length)
    fade = max(1.0 - abs(speed_along) / FADING_SPEED, 0.0)
    rate = math.sqrt(max(cornering_coefficient, SLOWEST_SPEED) * GRAVITY * length)
    slip_tangents[i] = tyre_lag.angle[i] + fade * fade * speed_across * 2.0 * DAMPING / rate


def longest_stable_step(cornering_coefficient: float, damping_rate: float, relaxation_length: float) -> float:
    """Longest stable step (s) of a vehicle at rest on tyres with a relaxation length (m).

    cornering_coefficient : largest cornering coefficient (1/rad); damping_rate : rate (m/s^2) at which side forces of
    slope 1 at 1 m/s damp its liveliest motion, g of a point mass. With w^2 = slope lively / length and c = 2 DAMPING w
    sqrt(lively / g), the step is v' = v - h (w^2 y + c v), y' = y + h v', whose roots lie within 1 where (h w)^2 + 2 h
    c < 4.
    """
    w, spread = (
        math.sqrt(max(cornering_coefficient, SLOWEST_SPEED) * damping_rate / relaxation_length),
        2.0 * DAMPING * math.sqrt(damping_rate / GRAVITY),
    )
    return (math.sqrt(spread**2 + 4.0) - spread) / w


@njit(cache=True, error_model="numpy")
def advance_all_lagging_slips(vehicle_state, duration, steer_angles, vehicle, tyre_lag, slip_tangents):
    """Advance the lagging slip angles of all wheels by a time (s), and fill ``slip_tangents`` (W,): see
    ``advance_lagging_slip``.
    """
    plane = vehicle.plane
    for i in range(tyre_lag.angle.size):
        k = plane.unit[i]
        vx, vy = chain_point_velocity(
            ChainPoint(k, plane.place[i, 0], plane.place[i, 1]), vehicle_state[0], vehicle_state[1], plane.arm_lengths
        )
        c, s = math.cos(vehicle_state[0, 2 + k] + steer_angles[i]), math.sin(vehicle_state[0, 2 + k] + steer_angles[i])
        advance_lagging_slip(i, c * vx + s * vy, c * vy - s * vx, duration, vehicle.slope, tyre_lag, slip_tangents)


@njit(cache=True, error_model="numpy")
def advance_lagging(vehicle_motion, brake_torques, time_step, steer_angles, vehicle, tyre_lag):
    """Advance a vehicle on tyres with relaxation by n steps, as ``advance`` does; its ``TyreLag`` is updated in
    place.
    """
    surfaces, time = surfaces_of_rows(np.empty((4, vehicle_motion.turning.size))), 0.0
    for n in range(brake_torques.shape[0] - 1):
        fill_surfaces_under_wheels(vehicle_motion.state, time_step, vehicle, surfaces)
        advance_all_lagging_slips(vehicle_motion.state, 0.5 * time_step, steer_angles, vehicle, tyre_lag, surfaces.lag)
        used = advance_one_step(
            vehicle_motion,
            brake_torques[n : n + 2],
            time_step,
            steer_angles,
            vehicle.slope * 9.81 * time_step,
            vehicle,
            surfaces,
        )
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < time_step:
            return AT_REST, time
        advance_all_lagging_slips(vehicle_motion.state, 0.5 * time_step, steer_angles, vehicle, tyre_lag, surfaces.lag)
        status = end_status(vehicle_motion, vehicle.plane)
        if status != FINE:
            return status, time
    return FINE, time


compiled_lagging_samples = compiled_samples(advance_lagging, "by_lagging_steps")
"""Compiled samples of a vehicle on tyres with relaxation, as ``by_steps``: after its arguments comes a ``TyreLag``."""
