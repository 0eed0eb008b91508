"""One controller sample of the braked vehicle in the plane: its time steps under the torques of its brakes."""

import math

import numpy as np

from models.brake.plane_chain import ChainPoint, Direction, fill_velocity_rows
from models.brake.plane_records import PlaneMotion, WheelReport, report_of
from models.brake.plane_step import advance_one_step
from models.brake.plane_vehicle import PlaneVehicle
from models.brake.surfaces import fill_surfaces_under_wheels, is_uniform, surfaces_of_rows
from models.machine.compiled import inlined, lean
from models.machine.stack import array, doubles

FINE, AT_REST, NOT_FOUND, PITCHED_OVER, ROLLED_OVER, FOLDED = range(6)
"""How a sample ended: still moving; standing; wheel loads not solved; an axle without load; both wheels of a side
without load; a hinge of the train beyond its limit.
"""

STEP_PART_LIMIT = 64
"""Largest number of parts into which a step is cut where the vehicle is so slow that its side forces respond faster
than the step.
"""


@inlined
def end_status(vehicle_motion, plane_vehicle):
    """FINE, or the way in which a step ends the run: an axle or a side of a two-axle unit without load, or a hinge
    beyond its limit angle.

    One lifted wheel does not end the run. It ends when both wheels of a side, or of an axle, lift.
    """
    status, load, headings = FINE, report_of(vehicle_motion.report).load, vehicle_motion.state[0, 2:]
    for first in range(0, load.size - 3, 4):
        a, b = load[first] > 0.0, load[first + 1] > 0.0
        c, d = load[first + 2] > 0.0, load[first + 3] > 0.0
        if not (a or b) or not (c or d):
            status = PITCHED_OVER
        elif not (a or c) or not (b or d):
            status = ROLLED_OVER
    for k in range(1, plane_vehicle.masses.size):
        if abs(headings[k] - headings[k - 1]) > plane_vehicle.jackknife_angle:
            status = FOLDED
    return status


@inlined
def count_of_step_parts(vehicle_state, regularising_speed):
    """Number of equal parts into which to cut a step, so that the part's ``regularising_speed`` (m/s) is at most the
    vehicle's speed.

    Slip angles are too small below ``regularising_speed``: the vehicle would slip sideways, and yaw on split friction,
    too far.
    """
    speed = math.hypot(vehicle_state[1, 0], vehicle_state[1, 1])
    return 1 if speed == 0.0 else int(min(math.ceil(regularising_speed / speed), STEP_PART_LIMIT))


@inlined
def advance_in_parts(part_count, vehicle_motion, brake_torques, time_step, steer_angles, vehicle, surfaces):
    """Advance the vehicle by a step in ``part_count`` equal parts; returns the time (s) that passed, or -1 where wheel
    loads were not solved. The report holds means over the parts, but the sum of the times locked.
    """
    rows, piece, time, regular = (
        vehicle_motion.report,
        time_step / part_count,
        0.0,
        vehicle.slope * 9.81 * time_step / part_count,
    )
    ends, sums = array(doubles(brake_torques.size), brake_torques.shape), array(doubles(rows.size), rows.shape)
    sums[:] = 0.0
    for k in range(part_count):
        for i in range(brake_torques.shape[1]):
            for side in range(2):
                ends[side, i] = (
                    brake_torques[0, i] + (brake_torques[1, i] - brake_torques[0, i]) * (k + side) / part_count
                )
        used = advance_one_step(vehicle_motion, ends, piece, steer_angles, regular, vehicle, surfaces)
        if used < 0.0:
            return used
        time += used
        for c in range(rows.shape[0]):
            for i in range(rows.shape[1]):
                sums[c, i] += rows[c, i]
        if used < piece:
            return time
    report, locked = report_of(rows), report_of(sums).locked
    for c in range(rows.shape[0]):
        for i in range(rows.shape[1]):
            rows[c, i] = sums[c, i] / part_count
    for i in range(locked.size):
        report.locked[i], report.turning[i] = locked[i], vehicle_motion.turning[i]
    return time_step


@lean
def advance(vehicle_motion, brake_torques, time_step, steer_angles, vehicle):
    """Advance a ``PlaneMotion`` by n steps (s) under torques (n + 1, W) in N m at the steps' ends, which come from
    ``pressure``.

    steer_angles (W,): rad; vehicle: ``VehicleOnRoad``. Returns how it ended and the time (s) that passed.
    """
    wheels, time = vehicle_motion.turning.size, 0.0
    surfaces = surfaces_of_rows(array(doubles(4 * wheels), (4, wheels)))
    for n in range(brake_torques.shape[0] - 1):
        if n == 0 or not is_uniform(vehicle.road):
            fill_surfaces_under_wheels(vehicle_motion.state, time_step, vehicle, surfaces)
        regular = vehicle.slope * 9.81 * time_step
        parts = count_of_step_parts(vehicle_motion.state, regular)
        if parts <= 1:
            used = advance_one_step(
                vehicle_motion, brake_torques[n : n + 2], time_step, steer_angles, regular, vehicle, surfaces
            )
        else:
            used = advance_in_parts(
                parts, vehicle_motion, brake_torques[n : n + 2], time_step, steer_angles, vehicle, surfaces
            )
        if used < 0.0:
            return NOT_FOUND, time
        time += used
        if used < time_step:
            return AT_REST, time
        status = end_status(vehicle_motion, vehicle.plane)
        if status != FINE:
            return status, time
    return FINE, time


FATAL_END_STATUSES = (NOT_FOUND, PITCHED_OVER, ROLLED_OVER, FOLDED)
"""Ends of a sample after which a run cannot continue."""
BODY_NAMES = ("vehicle", "trailer")
HINGE_NAMES = ("the drawbar against the truck", "the trailer's body against the drawbar")


def ending_sentence(status: int, plane_vehicle: PlaneVehicle, vehicle_motion: PlaneMotion) -> str:
    """Sentence on why a run ended, from the end status and the motion of its last step."""
    if status == FOLDED:
        return _folded_sentence(plane_vehicle, vehicle_motion.state[0, 2:])
    if status == NOT_FOUND:
        return "no loads were found"
    loads = WheelReport(*vehicle_motion.report).load
    first = next(i for i in range(0, plane_vehicle.wheels, 4) if _is_side_or_axle_lifted(loads[i : i + 4]))
    return _tipping_sentence(
        status, plane_vehicle, slice(first, first + 4), _unit_acceleration(plane_vehicle, first, vehicle_motion), loads
    )


def _folded_sentence(plane_vehicle: PlaneVehicle, headings: np.ndarray) -> str:
    """Sentence on the hinge at which a train of vehicles jackknifes, with its angle."""
    angles = np.degrees(np.diff(headings))
    k = int(np.argmax(np.abs(angles)))
    hinge = HINGE_NAMES[k] if angles.size > 1 else HINGE_NAMES[1]
    limit = math.degrees(plane_vehicle.jackknife_angle)
    return f"the train jackknifes: {hinge} at {angles[k]:.1f} deg, limit {limit:g} deg"


def _is_side_or_axle_lifted(unit_wheel_loads: np.ndarray) -> bool:
    """Whether both wheels of a side, or both wheels of an axle, carry no load."""
    is_lifted = unit_wheel_loads <= 0.0
    return bool((is_lifted[0] or is_lifted[3]) and (is_lifted[1] or is_lifted[2]))


def _unit_acceleration(
    plane_vehicle: PlaneVehicle, first_wheel: int, vehicle_motion: PlaneMotion
) -> tuple[float, float]:
    """Longitudinal and lateral acceleration (m/s^2) of the unit whose first wheel is ``first_wheel``, in the unit's
    axes.
    """
    accelerations = vehicle_motion.accelerations
    k, row_along, across = (
        plane_vehicle.load_unit[first_wheel],
        np.zeros(accelerations.size),
        np.zeros(accelerations.size),
    )
    units = np.column_stack((np.cos(vehicle_motion.state[0, 2:]), np.sin(vehicle_motion.state[0, 2:])))
    bias_along, bias_across = fill_velocity_rows(
        ChainPoint(k, 0.0, 0.0), Direction(*units[k]), units, vehicle_motion.state[1], plane_vehicle, row_along, across
    )
    return float(row_along @ accelerations + bias_along), float(across @ accelerations + bias_across)


def _tipping_sentence(
    status: int,
    plane_vehicle: PlaneVehicle,
    unit_wheels: slice,
    unit_accelerations: tuple[float, float],
    wheel_loads: np.ndarray,
) -> str:
    """Sentence on how a vehicle tips over, from moments about the wheels that stay on the road, for quasi-static wheel
    loads.
    """
    body, (deceleration, side_acceleration) = BODY_NAMES[unit_wheels.start // 4], unit_accelerations
    static, by_x, by_y, y = (
        wheel_values[unit_wheels]
        for wheel_values in (
            plane_vehicle.static_loads,
            plane_vehicle.load_per_x_acceleration,
            plane_vehicle.load_per_y_acceleration,
            plane_vehicle.place[:, 1],
        )
    )
    if status == PITCHED_OVER:
        axle = 0 if wheel_loads[unit_wheels][:2].max() <= 0.0 else 2
        limit = -static[axle : axle + 2].sum() / by_x[axle : axle + 2].sum()
        return (
            f"the {body} pitches over: its {'rear' if axle else 'front'} wheels lift off at {deceleration:.2f} m/s^2 "
            f"along it, limit {limit:.2f}"
        )
    pressed = static + by_x * deceleration
    limit = float(np.abs(y) @ pressed / np.abs(by_y @ y))
    side = "left" if wheel_loads[unit_wheels][0] <= 0.0 else "right"
    lift_off = f"its {side} wheels lift off at {side_acceleration:.2f} m/s^2 across it"
    return f"the {body} rolls over: {lift_off}, limit {limit:.2f}"
