"""A drawbar trailer of two axles, behind a truck or with a prescribed motion of its hook.

The drawbar turns about the hook and carries the front axle at its end, where its own centre of mass is; there the
trailer's body turns on it, and the rear axle is fixed to the body. Loads under both axles follow from the acceleration
of the body. The hook bears no load, and its force is taken to act at the ground: at a height h it would shift F h by
the wheelbase from one axle to the other.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from models.brake.plane_chain import fill_headings, fill_mass_matrix
from models.brake.plane_records import motion_of, report_of
from models.brake.plane_step import advance_one_step
from models.brake.plane_vehicle import (
    GRAVITY,
    PlaneVehicle,
    Truck,
    TruckAxle,
    check_wheels,
    plane_of_truck,
    wheel_fields_of_plane,
)
from models.brake.surfaces import UNIFORM_ROAD, VehicleOnRoad, fill_surfaces_under_wheels, surfaces_of_rows
from models.core.errors import InputError
from models.core.strict import quantity
from models.machine.compiled import njit
from models.tyre.tyre_table import StackedTyreTables


class Trailer(Truck):
    """A drawbar trailer: body with axles ahead of and behind its centre of mass, and drawbar."""

    drawbar: float = quantity("m", "from the hook to the front axle")
    drawbar_mass: float = quantity("kg", "of the drawbar with the front axle")
    drawbar_inertia: float = quantity("kg m^2", "of both about the vertical through the front axle")
    hook: float = Field(default=-3.5, description="m, of the hook ahead of the truck's centre of mass", lt=0.0)
    fold: float = Field(
        default=math.pi / 2.0,
        gt=0.0,
        le=math.pi,
        description="rad, of the drawbar against the "
        "truck, and of the body against it: beyond it a train jackknifes, and a run ends",
    )


def plane_of_trailer(trailer: Trailer, with_load_transfer: bool = True) -> PlaneVehicle:
    """``PlaneVehicle`` of a trailer whose hook has a prescribed motion; the hook's position is the first two
    coordinates.
    """
    reach = np.array([[-trailer.drawbar, 0.0], [-trailer.drawbar, -trailer.front.x]])
    parts: list[Any] = [
        *_units_of_train(trailer),
        reach,
        *_trailer_wheels(trailer, 0, with_load_transfer),
        1,
        trailer.fold,
        np.arange(2),
    ]
    return PlaneVehicle(*parts)


def plane_of_train(truck: Truck, trailer: Trailer, with_load_transfer: bool = True) -> PlaneVehicle:
    """``PlaneVehicle`` of a truck with a drawbar trailer on its hook: eight wheels."""
    truck_records, reach = plane_of_truck(truck, with_load_transfer), np.zeros((3, 3))
    reach[1:, 0], reach[1:, 1], reach[2, 2] = trailer.hook, -trailer.drawbar, -trailer.front.x
    units = (np.concatenate((a, b)) for a, b in zip(truck_records[:2], _units_of_train(trailer), strict=True))
    wheel_fields = (
        np.concatenate((a, b))
        for a, b in zip(truck_records[3:11], _trailer_wheels(trailer, 1, with_load_transfer), strict=True)
    )
    parts: list[Any] = [*units, reach, *wheel_fields, 0, trailer.fold, np.arange(3)]
    return PlaneVehicle(*parts)


def _units_of_train(trailer: Trailer) -> tuple[np.ndarray, np.ndarray]:
    """Masses (kg) and yaw inertias (kg m^2) of the drawbar and the trailer's body."""
    return (np.array([trailer.drawbar_mass, trailer.mass]), np.array([trailer.drawbar_inertia, trailer.yaw_inertia]))


def _trailer_wheels(trailer: Trailer, drawbar_unit: int, with_load_transfer: bool) -> tuple[np.ndarray, ...]:
    """Unit and group of each wheel of a trailer, then the results of ``wheel_fields_of_plane``; the front wheels belong
    to the drawbar, which is unit ``drawbar_unit``.
    """
    check_wheels(trailer, trailer.mass + trailer.drawbar_mass)
    wheel_positions, radius, spin, static, by_x, by_y = wheel_fields_of_plane(trailer, with_load_transfer)
    wheel_positions[:2, 0] = 0.0
    static[:2] += trailer.drawbar_mass * GRAVITY / 2.0
    unit = np.array([drawbar_unit, drawbar_unit, drawbar_unit + 1, drawbar_unit + 1])
    return unit, np.full(4, drawbar_unit + 1), wheel_positions, radius, spin, static, by_x, by_y


class HookPull(NamedTuple):
    """Motion of a trailer behind its hook: states (n + 1, 2, 2 + U), positions and rates at the steps' ends, and the
    mean forces (n, 2) in N on the hook from the vehicle, in the ground's axes.
    """

    states: np.ndarray
    forces: np.ndarray


def trailer_behind_hook(
    plane_trailer: PlaneVehicle,
    tyre_tables: StackedTyreTables,
    start_state: np.ndarray,
    hook_velocities: np.ndarray,
    time_step: float,
    cornering_coefficient: float,
    brake_torques: np.ndarray,
) -> HookPull:
    """Motion of a trailer behind a hook with prescribed velocities (n + 1, 2) in m/s at the steps' ends; step (s).

    start_state (2, 2 + U) : positions and rates at the start; cornering_coefficient : see ``VehicleOnRoad``;
    brake_torques
    (W,) : of its brakes, N m. Raises InputError.
    """
    if not plane_trailer.has_prescribed_hook:
        raise InputError("", "plane", "no hook", "must be of a trailer whose hook is prescribed")
    pull = HookPull(np.empty((len(hook_velocities), *start_state.shape)), np.empty((len(hook_velocities) - 1, 2)))
    turning = np.hypot(*start_state[1, :2]) / plane_trailer.radius
    motion = motion_of(start_state.copy(), turning)
    vehicle = VehicleOnRoad(
        plane_trailer, np.zeros(plane_trailer.wheels, dtype=np.int64), cornering_coefficient, tyre_tables, UNIFORM_ROAD
    )
    constant = np.tile(np.asarray(brake_torques, float), (2, 1))
    if not _march_trailer(motion, np.ascontiguousarray(hook_velocities), time_step, constant, vehicle, pull):
        raise InputError("", "hook", None, "no loads were found: its motion is too wild for the trailer")
    return pull


@njit(cache=True, error_model="numpy")
def _march_trailer(trailer_motion, hook_velocities, time_step, brake_torques, vehicle, hook_pull):
    """Integrate the trailer's motion into ``hook_pull``; returns whether wheel loads were solved in every step."""
    plane, state, report, accelerations = (
        vehicle.plane,
        trailer_motion.state,
        report_of(trailer_motion.report),
        trailer_motion.accelerations,
    )
    size, straight, states, forces = (
        accelerations.size,
        np.zeros(trailer_motion.turning.size),
        hook_pull.states,
        hook_pull.forces,
    )
    mass, (right, row_along, across), units = np.empty((size, size)), np.empty((3, size)), np.empty((size - 2, 2))
    states[0], surfaces = state, surfaces_of_rows(np.empty((4, trailer_motion.turning.size)))
    fill_surfaces_under_wheels(state, time_step, vehicle, surfaces)
    for n in range(hook_velocities.shape[0] - 1):
        accelerations[:2] = (hook_velocities[n + 1] - hook_velocities[n]) / time_step
        if (
            advance_one_step(
                trailer_motion,
                brake_torques,
                time_step,
                straight,
                vehicle.slope * GRAVITY * time_step,
                vehicle,
                surfaces,
            )
            < 0.0
        ):
            return False
        states[n + 1] = state
        fill_headings(0.5 * (states[n, 0] + state[0]), units)
        fill_mass_matrix(units, 0.5 * (states[n, 1] + state[1]), plane, mass, right, row_along, across)
        forces[n] = (mass @ accelerations - right)[:2]
        for i in range(plane.unit.size):
            psi = 0.5 * (states[n, 0, 2 + plane.unit[i]] + state[0, 2 + plane.unit[i]])
            fx, fy = report.force_x[i], report.force_y[i]
            forces[n, 0] -= np.cos(psi) * fx - np.sin(psi) * fy
            forces[n, 1] -= np.sin(psi) * fx + np.cos(psi) * fy
    return True


CHOSEN_TRAILER = Trailer(
    mass=4500.0,
    yaw_inertia=15000.0,
    height=1.2,
    drawbar=2.5,
    drawbar_mass=700.0,
    drawbar_inertia=500.0,
    hook=-3.5,
    front=TruckAxle(x=2.0, track=1.8, radius=0.5, spin_inertia=27.0, roll_share=0.5),
    rear=TruckAxle(x=-2.0, track=1.8, radius=0.5, spin_inertia=27.0, roll_share=0.5),
)
"""An unladen trailer of two axles behind the paper's truck. All of it is chosen: the paper prints no trailer data."""
