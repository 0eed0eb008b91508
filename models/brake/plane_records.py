"""Records that a time step of a vehicle in the plane reads and writes: its motion and its wheels, W of them, with n
coordinates.

Compiled functions pass few arrays on, and name their rows where they are read: two dozen arrays that are passed
everywhere double the time of compiling.
"""

from typing import NamedTuple

import numpy as np

from models.brake.surfaces import WheelSurfaces
from models.machine.compiled import inlined


class WheelReport(NamedTuple):
    """Forces, loads and slips of the wheels, (W,) each for a step, or (samples, W) for a run.

    force_x, force_y : mean forces on the wheel in its own axes (N); load : N; slip : the mean one; slip_angle : rad;
    locked : time (s) for which the wheel was locked; turning : speed of turning at the end (rad/s).
    """

    force_x: np.ndarray
    force_y: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    slip_angle: np.ndarray
    locked: np.ndarray
    turning: np.ndarray


REPORT_SIZE = len(WheelReport._fields)
"""Number of values that a wheel reports."""
TURNING_ROW = WheelReport._fields.index("turning")
"""Index of the report's row with rotational speeds, for code that also runs in Python, where ``report_of`` gives no
``WheelReport``.
"""


@inlined
def report_of(rows):
    """``WheelReport`` of views of the rows (7, W), for compiled functions; in Python, use ``Report(*rows)``."""
    return WheelReport(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6])


class PlaneMotion(NamedTuple):
    """State of a vehicle in the plane, updated in place by every step.

    state (2, n) : positions and rates; turning (W,) : rotational speeds of the wheels, rad/s; accelerations (2 + U,) :
    of the last step, the start values of the search in the next one; report (7, W) : the rows of the last step's
    ``WheelReport``.
    """

    state: np.ndarray
    turning: np.ndarray
    accelerations: np.ndarray
    report: np.ndarray


def motion_of(vehicle_state: np.ndarray, wheel_turning: np.ndarray) -> PlaneMotion:
    """A ``PlaneMotion`` with zero accelerations and an empty report, from positions and rates (2, n), and the wheels'
    rotational speeds (W,) in rad/s.
    """
    return PlaneMotion(
        vehicle_state, wheel_turning, np.zeros(vehicle_state.shape[1]), np.zeros((REPORT_SIZE, wheel_turning.size))
    )


class WheelStates(NamedTuple):
    """State and geometry of each wheel within a time step, each (W,).

    start : speed of its centre along the wheel at the start (m/s); rate : rate of this speed without the part due to
    the coordinates' accelerations (m/s^2); along, aside : speeds of its centre along it, not negative, and across it,
    for the slip angle; angle : slip angle (rad); cell, share : position of the angle in the tables; static_load : load
    (N) without the part due to accelerations, load : with it; cosine, sine : of its steer angle.
    """

    start: np.ndarray
    rate: np.ndarray
    along: np.ndarray
    aside: np.ndarray
    angle: np.ndarray
    cell: np.ndarray
    share: np.ndarray
    static_load: np.ndarray
    load: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray


WHEEL_QUANTITY_COUNT = len(WheelStates._fields)
"""Number of values in ``WheelStates`` for each wheel."""


@inlined
def wheels_of(rows):
    """``WheelStates`` of views of the rows (11, W), for compiled functions; in Python, use ``Wheels(*rows)``."""
    return WheelStates(
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8], rows[9], rows[10]
    )


class StepWorkspace(NamedTuple):
    """Arrays shared by all iterations within a time step.

    rows_along, rows_across, load_rows (W, n) : see ``plane_chain.fill_velocity_rows``, and load by accelerations;
    heading_vectors (U, 2) : see ``fill_headings``; mass_matrix (n, n) : the factor of the mass matrix; right_side (n,)
    : forces besides the tyres' forces; out,
    response_before, residual_before (n,) : accelerations from the last iteration, from the one before, and the residual
    of the latter.
    """

    wheels: WheelStates
    surfaces: WheelSurfaces
    report: WheelReport
    rows_along: np.ndarray
    rows_across: np.ndarray
    load_rows: np.ndarray
    heading_vectors: np.ndarray
    mass_matrix: np.ndarray
    right_side: np.ndarray
    response: np.ndarray
    response_before: np.ndarray
    residual_before: np.ndarray
