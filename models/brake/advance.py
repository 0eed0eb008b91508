"""One sample of the laboratory method: the vehicle's steps under the torques that its brakes have meanwhile."""

import math

from models.brake.plane_step import LOAD, LOCKED, REPORTED, TURNING, step_on
from models.brake.surfaces import even, under_wheels
from models.machine.compiled import inlined, lean
from models.machine.stack import array, doubles

FINE, AT_REST, NOT_FOUND, PITCHED, ROLLED, FOLDED = range(6)
"""How a sample ended: still moving; standing; loads not found; an axle without load; both wheels of a side without
load; a hinge of the train beyond its limit."""

MOST_PARTS = 64
"""Into how many parts a step is cut at most, of a vehicle so slow that its side forces answer faster than the step."""


@inlined
def ended(state, plane, report):
    """Whether a step leaves the vehicle FINE, or how it has ended: of units of two axles, loads and angles of hinges.

    One wheel may lift; what balance takes is that the two of a side, or of an axle, do.
    """
    status = FINE
    for first in range(0, report.shape[0] - 3, 4):
        a, b = report[first, LOAD] > 0.0, report[first + 1, LOAD] > 0.0
        c, d = report[first + 2, LOAD] > 0.0, report[first + 3, LOAD] > 0.0
        if not (a or b) or not (c or d):
            status = PITCHED
        elif not (a or c) or not (b or d):
            status = ROLLED
    for k in range(1, plane.masses.size):
        if abs(state[0, 2 + k] - state[0, 1 + k]) > plane.fold:
            status = FOLDED
    return status


@inlined
def parts_of(state, regular):
    """How many parts of a step keep the speed ``regular`` (m/s), below which slip angles are too small, below that of
    the vehicle: otherwise it would yield sideways, and yaw on split friction, by as much too far."""
    speed = math.hypot(state[1, 0], state[1, 1])
    return 1 if speed == 0.0 else int(min(math.ceil(regular / speed), MOST_PARTS))


@lean
def in_parts(parts, state, turning, torque0, torque1, step, steer, surface, regular, plane, tables, found, report):
    """``step_on`` in equal parts of a step; the report is their mean, and of times locked the sum."""
    wheels, piece, time = turning.size, step / parts, 0.0
    ends, sums = array(doubles(2 * wheels), (2, wheels)), array(doubles(wheels * REPORTED), (wheels, REPORTED))
    sums[:] = 0.0
    for k in range(parts):
        for i in range(wheels):
            for side in range(2):
                ends[side, i] = torque0[i] + (torque1[i] - torque0[i]) * (k + side) / parts
        used = step_on(
            state, turning, ends[0], ends[1], piece, steer, surface, regular / parts, plane, tables, found, report
        )
        if used < 0.0:
            return used
        time += used
        for i in range(wheels):
            for c in range(REPORTED):
                sums[i, c] += report[i, c]
        if used < piece:
            return time
    for i in range(wheels):
        for c in range(REPORTED):
            if c != TURNING:
                report[i, c] = sums[i, c] if c == LOCKED else sums[i, c] / parts
    return step


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
        regular = slope * 9.81 * step
        parts = parts_of(state, regular)
        if parts <= 1:
            used = step_on(
                state, turning, torques[n], torques[n + 1], step, steer, surface, regular, plane, tables, found, report
            )
        else:
            used = in_parts(
                parts,
                state,
                turning,
                torques[n],
                torques[n + 1],
                step,
                steer,
                surface,
                regular,
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
        status = ended(state, plane, report)
        if status != FINE:
            return status, time
    return FINE, time
