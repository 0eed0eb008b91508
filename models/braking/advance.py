"""One sample of the laboratory method: the vehicle's steps under the torques that its brakes have meanwhile."""

from models.braking.plane_step import step_on
from models.braking.surfaces import even, under_wheels
from models.compiled import lean
from models.stack import array, doubles

FINE, AT_REST, NOT_FOUND, LIFTED = range(4)
"""How a sample ended: still moving; standing; loads not found; a wheel without load, which the plane cannot have."""


@lean
def advance(state, turning, torques, step, steer, slope, plane, kind, road, tables, found, report):
    """Go on by the n steps (s) between the torques (n + 1, W) of ``pressure``; all of the state is moved in place.

    state (2, 2 + U), turning (W,): of ``step_on``; steer (W,): rad; slope: largest cornering coefficient of the tables
    (1/rad); found (2 + U,), report (W, 7): of ``step_on``. Returns how it ended and the time (s) that passed.
    """
    surface, time = array(doubles(3 * turning.size), (turning.size, 3)), 0.0
    for n in range(torques.shape[0] - 1):
        if n == 0 or not even(road):
            under_wheels(state, step, plane, kind, road, surface)
        used = step_on(state, turning, torques[n], torques[n + 1], step, steer, surface, slope * 9.81 * step, plane,
                       tables, found, report)  # fmt: skip
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < step:
            return AT_REST, time
        for i in range(turning.size):
            if report[i, 2] <= 0.0:
                return LIFTED, time
    return FINE, time
