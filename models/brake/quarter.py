"""A quarter vehicle: one wheel that bears all of a mass, braked by a torque that is given over time.

It is the plane's vehicle with a single wheel under its centre of mass, so that it runs through the same step as the
truck: what stopping distances and times of locking show of the one holds for the other.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pydantic import model_validator

from models.brake.plane_records import motion_of, report_of
from models.brake.plane_step import advance_one_step
from models.brake.plane_vehicle import GRAVITY, PlaneVehicle
from models.brake.surfaces import RoadSurfaces, VehicleOnRoad, fill_surfaces_under_wheels, surfaces_of_rows
from models.core.errors import InputError, RunFailed
from models.core.strict import Strict, quantity
from models.machine.compiled import njit
from models.tyre.tyre_table import StackedTyreTables

LEAST_SLIP_ANGLE_SPEED = 0.1
"""Speed (m/s) that replaces lower speeds in slip angles; without lateral motion they are zero."""


class QuarterPath(NamedTuple):
    """Motion of a quarter vehicle at the ends of its steps, each (n,): time (s), position (m), speed (m/s), rotational
    speed of the wheel (rad/s), and the time (s) within the step for which the wheel was locked.
    """

    time: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    turning: np.ndarray
    locked: np.ndarray


class QuarterVehicle(Strict):
    """A quarter vehicle: one wheel, and the vehicle mass that it carries."""

    mass: float = quantity("kg", "of vehicle and wheel together")
    radius: float = quantity("m", "of the wheel")
    spin_inertia: float = quantity("kg m^2", "of the wheel about its axle")

    @model_validator(mode="after")
    def _holds_its_wheel(self) -> "QuarterVehicle":
        least_mass = self.spin_inertia / self.radius**2
        if self.mass <= least_mass:
            raise ValueError(f"mass must be above {least_mass:.4g} kg: J / r^2 of the wheel, which cannot be lighter")
        return self

    @property
    def plane(self) -> PlaneVehicle:
        """The quarter vehicle as a ``PlaneVehicle`` for compiled functions: one unit with one wheel at its centre."""
        zeros, unit = np.zeros(1, dtype=np.int64), np.ones(1)
        return PlaneVehicle(
            self.mass * unit,
            unit,
            np.zeros((1, 1)),
            zeros,
            zeros.copy(),
            np.zeros((1, 2)),
            self.radius * unit,
            self.spin_inertia * unit,
            self.mass * GRAVITY * unit,
            np.zeros(1),
            np.zeros(1),
            0,
        )

    def steady_torque(self, slip: float, tyre_force: float) -> float:
        """Brake torque (N m) that keeps a slip constant while the tyre gives a longitudinal force (N)."""
        return tyre_force * (self.radius + self.spin_inertia * (1.0 - slip) / (self.mass * self.radius))


@dataclass(frozen=True, eq=False)
class QuarterStop:
    """Motion of a braked quarter vehicle, and the index of the step in which it came to rest, or -1."""

    path: QuarterPath
    step_of_rest: int

    @property
    def distance(self) -> float:
        """Distance (m) from the start to the end of the path."""
        return float(self.path.position[-1] - self.path.position[0])

    @property
    def release_time(self) -> float:
        """Time (s) at which the wheel turned again after its last lock; NaN if it never did."""
        time, locked = self.path.time, self.path.locked
        locked_rows = np.flatnonzero(locked > 0.0)
        if locked_rows.size == 0 or self.path.turning[locked_rows[-1]] == 0.0:
            return float("nan")
        return float(time[locked_rows[-1] - 1] + locked[locked_rows[-1]])


@njit(cache=True, error_model="numpy")
def march_quarter_vehicle(wheel_motion, brake_torques, time_step, vehicle, quarter_path):
    """Advance one wheel's ``wheel_motion`` in steps (s) under torques (n + 1, 1) in N m at the steps' ends; see
    ``advance``.

    path is filled from its second place on. Returns the step in which the vehicle came to rest, -1 if in none, -2 if
    loads were not found; a vehicle that rests is left to its torques like one that moves.
    """
    rest_step, straight, surfaces = -1, np.zeros(1), surfaces_of_rows(np.empty((4, 1)))
    for n in range(brake_torques.shape[0] - 1):
        fill_surfaces_under_wheels(wheel_motion.state, time_step, vehicle, surfaces)
        used = advance_one_step(
            wheel_motion, brake_torques[n : n + 2], time_step, straight, LEAST_SLIP_ANGLE_SPEED, vehicle, surfaces
        )
        if used < 0.0:
            return -2
        if used < time_step and rest_step < 0:
            rest_step = n + 1
        quarter_path.time[n + 1], quarter_path.position[n + 1] = (
            quarter_path.time[n] + time_step,
            wheel_motion.state[0, 0],
        )
        quarter_path.speed[n + 1], quarter_path.turning[n + 1] = wheel_motion.state[1, 0], wheel_motion.turning[0]
        quarter_path.locked[n + 1] = report_of(wheel_motion.report).locked[0] if used == time_step else 0.0
    return rest_step


def stop_of_quarter_vehicle(
    quarter_vehicle: QuarterVehicle,
    tyre_tables: StackedTyreTables,
    road: RoadSurfaces,
    brake_torques: np.ndarray,
    time_step: float,
    start_speed: float,
    start_spin_speed: float | None = None,
) -> QuarterStop:
    """Straight braking of a quarter vehicle from a speed (m/s) under torques (n + 1,) in N m at the steps' ends (s),
    linear between.

    start_spin_speed : rad/s at the start, that of rolling if not given. Raises InputError for a torque below 0 or no
    number.
    """
    if not (np.isfinite(brake_torques).all() and (brake_torques >= 0.0).all()):
        raise InputError(
            "", "torques", float(np.min(brake_torques)), "must be numbers from 0 on: a brake opposes turning"
        )
    state, path = np.zeros((2, 3)), QuarterPath(*np.zeros((5, brake_torques.size)))
    state[1, 0] = start_speed
    spin = np.array([start_speed / quarter_vehicle.radius if start_spin_speed is None else start_spin_speed])
    path.speed[0], path.turning[0] = start_speed, spin[0]
    vehicle = VehicleOnRoad(quarter_vehicle.plane, np.zeros(1, dtype=np.int64), 0.0, tyre_tables, road)
    ends = np.ascontiguousarray(brake_torques, dtype=float)[:, None]
    rest_step = march_quarter_vehicle(motion_of(state, spin), ends, time_step, vehicle, path)
    if rest_step == -2 or not all(np.isfinite(path_array).all() for path_array in path):
        raise RunFailed("braking", "no loads were found", float(path.time.max()))
    return QuarterStop(path, rest_step)
