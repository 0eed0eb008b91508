"""Tyres whose slip angle lags behind the motion of the wheel by a relaxation length: first-order, across the wheel.

With a = tan of the slip angle that the tyre has taken up, and u, v the speeds of the wheel's centre along and across,

    sigma a' = v - |u| a,

which holds at rest too: there the tyre is a spring. It is solved exactly over half a step with the speeds before the
step and over the other half with those after it; the step between takes the forces at a in its middle: order two, and
stable at rest for steps below 2 / w0, w0 = sqrt(slope g / sigma). Below ``SLOW`` a damper across the wheel fades in,
without which a vehicle would rock on these springs. Source: J. E. Bernard, C. L. Clover, Tire modeling for low-speed
and high-speed calculations, SAE 950311 (recalled, not checked). Along the wheel slip does not lag.
"""

import math

import numpy as np

from models.brake.advance import AT_REST, FINE, NOT_FOUND, ended
from models.brake.plane_chain import point
from models.brake.plane_step import step_on
from models.brake.samples import compiled
from models.brake.surfaces import under_wheels
from models.brake.wheel_step import SLOWEST, phi_1
from models.machine.compiled import njit

SLOW = 1.0
"""Speed (m/s) along the wheel below which the damper fades in."""
DAMPING = 0.7
"""Damping ratio at rest, of a wheel that bears its share of the mass."""


@njit(cache=True, error_model="numpy")
def taken_up(a, u, v, time, length):
    """tan of the slip angle after a time (s) at constant speeds u, v (m/s) with a relaxation length (m)."""
    return a + (v - abs(u) * a) * phi_1(-abs(u) * time / length) * time / length


@njit(cache=True, error_model="numpy")
def lag_on(state, time, steer, plane, slope, length, lag, surface):
    """Move ``lag`` (W,) on by a time (s), and fill the fourth column of ``surface`` with it and the damper's part.

    What is NaN begins as if the speeds had been there for ever.
    """
    for i in range(lag.size):
        k = plane.unit[i]
        vx, vy = point(k, plane.place[i, 0], plane.place[i, 1], state[0], state[1], plane.reach)
        c, s = math.cos(state[0, 2 + k] + steer[i]), math.sin(state[0, 2 + k] + steer[i])
        u, v = c * vx + s * vy, c * vy - s * vx
        if math.isnan(lag[i]):
            lag[i] = v / max(abs(u), SLOWEST)
        lag[i] = taken_up(lag[i], u, v, time, length[i])
        fade = max(1.0 - abs(u) / SLOW, 0.0)
        surface[i, 3] = lag[i] + fade * fade * v * 2.0 * DAMPING / math.sqrt(max(slope, SLOWEST) * 9.81 * length[i])


@njit(cache=True, error_model="numpy")
def advance_lagging(state, turning, torques, step, steer, slope, plane, kind, road, tables, found, report, length, lag):
    """``advance`` with tyres of relaxation lengths (W,) in m; ``lag`` (W,) is moved in place."""
    surface, time = np.empty((turning.size, 4)), 0.0
    for n in range(torques.shape[0] - 1):
        under_wheels(state, step, plane, kind, road, surface)
        lag_on(state, 0.5 * step, steer, plane, slope, length, lag, surface)
        used = step_on(
            state,
            turning,
            torques[n],
            torques[n + 1],
            step,
            steer,
            surface,
            slope * 9.81 * step,
            plane,
            tables,
            found,
            report,
        )
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < step:
            return AT_REST, time
        lag_on(state, 0.5 * step, steer, plane, slope, length, lag, surface)
        status = ended(state, plane, report)
        if status != FINE:
            return status, time
    return FINE, time


by_lagging_steps = compiled(advance_lagging, "by_lagging_steps")
"""``by_steps`` with such tyres: after its arguments come ``length`` and ``lag``."""
