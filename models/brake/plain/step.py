"""Time steps of a braked vehicle on its suspension in plain code: the reference of ``models.brake.sprung_step``.

Half a step by the accelerations at its start leads to its middle, where loads, slip angles and the changes of the
wheels' speeds are read; the mean forces of the whole step follow, and Runge and Kutta's method marches under them.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from models.brake.advance import AT_REST, FINE, FOLDED
from models.brake.plain.road import ground_paths, surfaces_under_wheels, unit_position_in_train
from models.brake.plain.suspension import ConstantWheelForces, PlainSuspension, TyreContact
from models.brake.plain.tyre import BrakedStep, WheelMotion, WheelSurface, tyre_report
from models.brake.surfaces import VehicleOnRoad
from models.multibody.plain.march import march

if TYPE_CHECKING:
    from models.brake.plain.relaxation import LaggingTyres

SPINS, UPRIGHT, OVER = 6, 0.5, 6
"""Column of a wheel's report with its rotational speed; roll or pitch angle (rad) at which the vehicle counts as turned
over, and the status for that.
"""
NEGLIGIBLE_TIME = 1e-5
"""Time (s) of the short step in which freely rolling wheels are evaluated."""


@dataclass(frozen=True, eq=False)
class StepSetting:
    """Data that a vehicle's step needs: its wheels, tyres and road, steer angles (W,) in rad, and the speed
    ``least_speed`` (m/s) that replaces lower speeds in slip angles.
    """

    vehicle_on_road: VehicleOnRoad
    steer: np.ndarray
    least_speed: float


@dataclass(eq=False)
class MovingVehicle:
    """State of a moving vehicle, updated in place: state (2, n), wheel rotation ``turning`` (W,) in rad/s, changes (W,)
    of the speeds along the wheels (m/s^2), reports (W, 7), accelerations (2 + U,) of its units, and the lag of its
    tyres.
    """

    state: np.ndarray
    turning: np.ndarray
    speed_changes: np.ndarray
    report: np.ndarray
    accelerations: np.ndarray
    lag: "LaggingTyres | None" = None


class PlainVehicleSteps:
    """Time steps (s) of a vehicle on its suspension, with given steering and road."""

    def __init__(self, suspended_vehicle: PlainSuspension, course: StepSetting, time_step: float) -> None:
        self.vehicle, self.course, self.step = suspended_vehicle, course, time_step

    def on(self, moving_vehicle: MovingVehicle, brake_torques: np.ndarray) -> tuple[int, float]:
        """Advance the vehicle by a step between torques (2, W) in N m at its start and end; returns how the step
        ended and the time (s) that passed in it.
        """
        half, (q, v) = 0.5 * self.step, moving_vehicle.state
        surfaces, half_step_torques = (
            self._surfaces_under(moving_vehicle.state, self.step),
            np.array([brake_torques[0], brake_torques.mean(axis=0)]),
        )
        contacts = self._contacts(q, v)
        starts = speeds_along_wheels(contacts)
        if moving_vehicle.lag is not None:
            moving_vehicle.lag.reach(np.array([starts, [contact.speed_across for contact in contacts]]), half)
        wheel_forces = self._constant_wheel_forces(moving_vehicle, contacts, starts, surfaces, half_step_torques, half)
        rates = self.vehicle.acceleration(q, v, wheel_forces)
        moving_vehicle.accelerations[:] = self._of_units(rates)
        rest_time = self.time_of_rest(moving_vehicle)
        if rest_time is not None:
            moving_vehicle.state[0] += rest_time * v + 0.5 * rest_time**2 * rates
            moving_vehicle.state[1, [0, 1, 2, *self.vehicle.turns]], moving_vehicle.turning[:] = 0.0, 0.0
            return (AT_REST, rest_time) if rest_time < self.step else (self._end_status(moving_vehicle), self.step)
        contacts = self._contacts(q + half * v + 0.5 * half**2 * rates, v + half * rates)
        moving_vehicle.speed_changes[:] = (speeds_along_wheels(contacts) - starts) / half
        wheel_forces = self._constant_wheel_forces(moving_vehicle, contacts, starts, surfaces, brake_torques, self.step)
        states_after = march(
            lambda _, x, u: self.vehicle.acceleration(x, u, wheel_forces), q.copy(), v.copy(), 1, self.step
        )[-1]
        moving_vehicle.state[:], moving_vehicle.turning[:] = (
            states_after.reshape(2, -1),
            moving_vehicle.report[:, SPINS],
        )
        return self._end_status(moving_vehicle), self.step

    def rolling(self, vehicle_state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,) at a state (2, n) whose wheels roll freely, and the wheels' rotational speeds (W,) in
        rad/s.
        """
        plane, contacts = self.course.vehicle_on_road.plane, self._contacts(vehicle_state[0], vehicle_state[1])
        starts = speeds_along_wheels(contacts)
        no_torques, report = np.zeros((2, starts.size)), np.zeros((starts.size, SPINS + 1))
        moving = MovingVehicle(
            vehicle_state, starts / plane.radius, np.zeros(starts.size), report, np.zeros(2 + plane.masses.size)
        )
        under = self._surfaces_under(vehicle_state, 0.0)
        wheel_forces = self._constant_wheel_forces(moving, contacts, starts, under, no_torques, self.step)
        return self.vehicle.acceleration(vehicle_state[0], vehicle_state[1], wheel_forces), moving.turning

    def _end_status(self, moving_vehicle: MovingVehicle) -> int:
        """Status at the end of a step: the vehicle leans too far, a train folds, or neither."""
        q, fold = moving_vehicle.state[0], self.course.vehicle_on_road.plane.jackknife_angle
        if not np.abs(q[self.vehicle.leans]).max() <= UPRIGHT:
            return OVER
        return FINE if (np.abs(q[self.vehicle.turns]) <= fold).all() else FOLDED

    def _of_units(self, coordinate_values: np.ndarray) -> np.ndarray:
        """Values (2 + U,) for the units, x, y and headings, from values for all coordinates. The heading of a towed
        unit is the sum of the yaw coordinates up to it.
        """
        return np.concatenate(
            (coordinate_values[:2], np.cumsum([coordinate_values[2], *coordinate_values[self.vehicle.turns]]))
        )

    def _surfaces_under(self, vehicle_state: np.ndarray, duration: float) -> list[WheelSurface]:
        """Surfaces under the wheels over a time (s), in which the wheels move on straight lines."""
        plane, (position, rates) = self.course.vehicle_on_road.plane, map(self._of_units, vehicle_state)
        paths = np.empty((plane.wheels, 2, 2))
        for k in range(plane.masses.size):
            is_of_unit = plane.unit == k
            paths[is_of_unit] = ground_paths(
                *unit_position_in_train(position, rates, plane.arm_lengths[k], k), plane.place[is_of_unit], duration
            )
        return surfaces_under_wheels(self.course.vehicle_on_road.road, paths, self.course.vehicle_on_road.kind)

    def _contacts(self, q: np.ndarray, v: np.ndarray) -> list[TyreContact]:
        """Contacts of all tyres at coordinates and rates (n,)."""
        return self.vehicle.contacts(self.vehicle.bodies.move(q, v), self.course.steer)

    def _constant_wheel_forces(
        self,
        moving_vehicle: MovingVehicle,
        tyre_contacts: list[TyreContact],
        start_speeds: np.ndarray,
        wheel_surfaces: list[WheelSurface],
        brake_torques: np.ndarray,
        duration: float,
    ) -> ConstantWheelForces:
        """Wheel forces that are constant over a time (s), from loads and motion at the contacts; fills the wheels'
        reports.
        """
        course = self.course
        for i, contact in enumerate(tyre_contacts):
            motion = WheelMotion(
                start_speeds[i],
                moving_vehicle.speed_changes[i],
                contact.speed_along,
                contact.speed_across,
                course.least_speed,
            )
            if moving_vehicle.lag is not None:
                motion = replace(
                    motion, across=moving_vehicle.lag.across(i, max(motion.forward_speed, course.least_speed))
                )
            radius, inertia = (
                float(course.vehicle_on_road.plane.radius[i]),
                float(course.vehicle_on_road.plane.spin_inertia[i]),
            )
            braked = BrakedStep(
                (brake_torques[0, i], brake_torques[1, i]), duration, radius, inertia, moving_vehicle.turning[i]
            )
            moving_vehicle.report[i] = tyre_report(
                course.vehicle_on_road.tables, wheel_surfaces[i], motion, contact.load, braked
            )
        spun = (
            course.vehicle_on_road.plane.spin_inertia
            * (moving_vehicle.report[:, SPINS] - moving_vehicle.turning)
            / duration
        )
        return ConstantWheelForces(course.steer, moving_vehicle.report[:, :2].copy(), spun)

    def time_of_rest(self, moving_vehicle: MovingVehicle) -> float | None:
        """Time (s) within the step at which the kinetic energy of the plane motion is least, if the vehicle is about to
        stop; else None.
        """
        plane, v, a = (
            self.course.vehicle_on_road.plane,
            self._of_units(moving_vehicle.state[1]),
            moving_vehicle.accelerations,
        )
        weights = np.array([plane.masses.sum(), plane.masses.sum(), *plane.inertias])
        speed, falling, rate = (float(weights @ product) for product in (v * v, -v * a, a * a))
        if speed == 0.0 and not moving_vehicle.turning.any():
            return 0.0
        if rate == 0.0 or falling <= 0.0:
            return None
        stands = falling / rate
        return stands if stands <= self.step and speed <= (1.5 * self.step) ** 2 * rate else None


def speeds_along_wheels(tyre_contacts: list[TyreContact]) -> np.ndarray:
    """Speeds (W,) of the wheels' centres along the wheels (m/s)."""
    return np.array([contact.speed_along for contact in tyre_contacts])
