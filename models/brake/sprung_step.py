"""Time steps of a braked vehicle on its suspension: one source text, for engines called from Python or in compiled
code.

Each step (s) the wheels are exact under the torques that they have, with loads and slip angles in the middle of the
step, to which half a step by the accelerations leads; the engine then marches the whole step by its own Runge-Kutta
method around the compiled forces, the tyres' mean ones held at their contacts and turned with their wheels.

Springs and loads are as they are, tyres' forces as held. The table of numbers is that of ``models.multibody.forces``,
then what the wheels hold, see ``SprungWheelForces``. What the road has beside the moment that speeds up a
wheel's turning is on the chassis, or on the towed body that carries the wheel: brakes hold on to it, and locked wheels
do.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE, FOLDED
from models.brake.plane_records import TURNING_ROW, WheelStates, report_of
from models.brake.plane_step import fill_tyre_report, set_slip_angle, time_of_rest
from models.brake.surfaces import WheelSurfaces, fill_surfaces_under_wheels
from models.brake.wheel_step import BrakedWheel, WheelStepInput
from models.machine.compiled import closure_with_unique_name, inlined, lean, njit
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody.forces import (
    AXLE,
    CARRYING,
    COUNT,
    HEADER,
    JOINTS,
    LEDGER,
    OF_TYRES,
    OF_WAVES,
    PASSING,
    PER_TYRE,
    PRESS,
    REPORTED,
    ROLLING,
    SLIP_Y,
    TYRES,
    WAVES,
    WAY,
    add_creep_forces,
    find_contact,
    finish_forces,
    start_forces,
    workspace_size,
)
from models.multibody.moving_vehicle import WheelContact
from models.multibody.tree import PER_LINK, add_body_moment, dot, three_from, times

VALUES_PER_WHEEL = 4
"""Number of values that stay constant over a step for each wheel."""


class SprungWheelForces(NamedTuple):
    """Wheel quantities that are constant over a step, each (W,): steer angle (rad), mean forces on the tyre along and
    across it (N), and the mean moment that accelerates the wheel's rotation (N m).
    """

    steer: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray
    moment: np.ndarray


class WheelContacts(NamedTuple):
    """Motion and loads of the wheels, each (W,): speeds of their centres along them and of their contacts across them
    (m/s), loads (N).
    """

    along: np.ndarray
    across: np.ndarray
    load: np.ndarray


class WheelData(NamedTuple):
    """Data at the wheels: quantities that are constant over a step, the state of each wheel, and the surfaces under
    them.

    The wheels' rates are the changes of the speeds along them, kept from step to step.
    """

    wheel_forces: SprungWheelForces
    wheels: WheelStates
    surfaces: WheelSurfaces


@lean
def wheel_forces_of(force_table):
    """``SprungWheelForces`` of views of the last numbers in a table for compiled force functions."""
    wheels = int(force_table[TYRES])
    rows = array(beyond(start(force_table), int(force_table[COUNT])), (VALUES_PER_WHEEL, wheels))
    return SprungWheelForces(rows[0], rows[1], rows[2], rows[3])


@lean
def forces_and_contacts(force_table, q, v, force_sum, wheel_contacts):
    """Add all forces on the vehicle to ``force_sum`` (n,), with constant wheel forces, and fill the
    ``WheelContacts``.
    """
    wheel = WheelContact(
        array(doubles(10), (10,)),
        array(doubles(4), (4,)),
        array(doubles(WAY), (WAY,)),
        array(doubles(REPORTED), (REPORTED,)),
    )
    wheel_geometry, ledger, creeping = wheel.way, array(doubles(LEDGER), (LEDGER,)), array(doubles(3), (3,))
    vehicle = start_forces(force_table, q, v, force_sum, doubles(workspace_size(force_table)), ledger)
    waves, wheel_forces = force_table[int(force_table[OF_WAVES]) :], wheel_forces_of(force_table)
    creeping[2], tyres = 0.0, beyond(start(force_table), int(force_table[OF_TYRES]))
    for i in range(int(force_table[TYRES])):
        tyre_row = row(tyres, PER_TYRE, i)
        find_contact(tyre_row, waves, int(force_table[WAVES]), wheel_forces.steer[i], 0.0, vehicle, wheel)
        wheel_contacts.along[i] = dot(three_from(wheel_geometry, PASSING), three_from(wheel_geometry, ROLLING))
        wheel_contacts.across[i], wheel_contacts.load[i] = wheel.report[SLIP_Y], wheel.report[PRESS]
        creeping[0], creeping[1] = wheel_forces.force_x[i], wheel_forces.force_y[i]
        add_creep_forces(tyre_row, creeping, vehicle, wheel)
        carrying = row(vehicle.tree.links, PER_LINK, int(tyre_row[CARRYING]))
        add_body_moment(carrying, vehicle.tree.ground, times(three_from(wheel_geometry, AXLE), -wheel_forces.moment[i]))
    finish_forces(force_table, vehicle)


@lean
def add_vehicle_forces(force_table, q, v, force_sum):
    """Add all forces on the vehicle to ``force_sum`` (n,), with constant wheel forces."""
    w = int(force_table[TYRES])
    motion = array(doubles(3 * w), (3, w))
    forces_and_contacts(force_table, q, v, force_sum, WheelContacts(motion[0], motion[1], motion[2]))


@lean
def forces_from_pointers(force_table, time, q, v, force_sum):
    """Add the vehicle's forces, with constant wheel forces, to ``force_sum``. For callbacks of engines: all arguments
    but the time are pointers to doubles; the time is not used.
    """
    head = array(force_table, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    add_vehicle_forces(
        array(force_table, (int(head[COUNT]) + VALUES_PER_WHEEL * w,)),
        array(q, (n,)),
        array(v, (n,)),
        array(force_sum, (n,)),
    )


@lean
def set_forces_from_block(memory_block, t, coordinate_count):
    """Set the generalised forces f of ``forces_from_pointers``. All data are in one block of doubles at an address: f,
    q and v (n,), then the table.
    """
    f = at(memory_block)
    array(f, (coordinate_count,))[:] = 0.0
    forces_from_pointers(
        beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f
    )


@lean
def set_slip_angles(wheel_contacts, regularising_speed, lagging_slips, table_angles, wheels):
    """Set slip angles and loads of the ``WheelStates`` from their ``WheelContacts``; regularising_speed (m/s) : see
    ``plane_step``; lag (W,) of ``WheelSurfaces``; angles of the tyres' tables.
    """
    for i in range(wheel_contacts.load.size):
        set_slip_angle(
            i,
            wheel_contacts.along[i],
            wheel_contacts.across[i],
            regularising_speed,
            lagging_slips,
            table_angles,
            wheels,
        )
        wheels.load[i] = wheel_contacts.load[i]


@lean
def store_mean_forces(at_wheels, torques_before, torques_after, time_step, vehicle_motion, vehicle):
    """Compute the tyres' mean forces over a step (s) between brake torques (W,) in N m, store them as the wheels'
    constant forces, and fill the report.

    at_wheels : ``WheelData`` with speeds at the start and their rates, and what ``set_slip_angles`` takes.
    """
    wheel_forces, wheels, plane, report = (
        at_wheels.wheel_forces,
        at_wheels.wheels,
        vehicle.plane,
        report_of(vehicle_motion.report),
    )
    for i in range(torques_before.size):
        speed, wheel = wheels.start[i], BrakedWheel(plane.radius[i], plane.spin_inertia[i], vehicle_motion.turning[i])
        step_input = WheelStepInput(
            speed, speed + time_step * wheels.rate[i], torques_before[i], torques_after[i], time_step
        )
        fill_tyre_report(i, step_input, wheel, vehicle.tables, wheels, at_wheels.surfaces, report)
        wheel_forces.force_x[i], wheel_forces.force_y[i] = report.force_x[i], report.force_y[i]
        wheel_forces.moment[i] = wheel.inertia * (report.turning[i] - wheel.turning) / time_step


OVER, GAVE_UP = 6, 7
"""Further ends of a sample: the vehicle turns over; the engine gives up."""
LARGEST_LEAN = 0.5
"""Roll or pitch angle (rad) beyond which the vehicle turns over."""
PLANE_COORDINATE_COUNT = 3
"""Number of the first coordinates: x, y and heading of the vehicle."""


class TrainUnits(NamedTuple):
    """The vehicle and its trailers as units in the plane.

    turns (U - 1,) : numbers of the yaw coordinates of each trailer relative to the unit before it; lean_coordinates
    (L,) : numbers of the roll and pitch coordinates; motion (2, 2 + U) : position of the first unit and headings of
    all, and their rates.
    """

    turns: np.ndarray
    lean_coordinates: np.ndarray
    motion: np.ndarray


@lean
def fill_unit_values(coordinate_values, hinge_columns, unit_values):
    """Fill values (2 + U,) for the ``TrainUnits`` from values for all coordinates (n,): positions, rates or
    accelerations.
    """
    for a in range(PLANE_COORDINATE_COUNT):
        unit_values[a] = coordinate_values[a]
    for k in range(hinge_columns.size):
        unit_values[PLANE_COORDINATE_COUNT + k] = (
            unit_values[PLANE_COORDINATE_COUNT + k - 1] + coordinate_values[hinge_columns[k]]
        )


@inlined
def status_at_end(q, train_units, jackknife_angle):
    """FINE, or how positions (n,) end a run: the vehicle turns over, or a train jackknifes."""
    status = FINE
    for k in range(train_units.turns.size):
        if not abs(q[train_units.turns[k]]) <= jackknife_angle:
            status = FOLDED
    for k in range(train_units.lean_coordinates.size):
        if not abs(q[train_units.lean_coordinates[k]]) <= LARGEST_LEAN:
            status = OVER
    return status


class SprungStepData(NamedTuple):
    """Data that a step of a vehicle on its suspension needs in addition to the data of a plane step.

    force_table : the table, at whose end is what the wheels hold; contacts : of the state whose ``add_vehicle_forces``
    (n,) were taken;
    middle_state (2, n) : state in the middle of a step; rates (n,) : accelerations; liveliness : see
    ``EngineSprungVehicle``; engine : its model; units : ``TrainUnits``; lag : of ``models.brake.sprung_relaxation``,
    empty where tyres answer at once.
    """

    force_table: np.ndarray
    wheel_data: WheelData
    contacts: WheelContacts
    forces: np.ndarray
    middle_state: np.ndarray
    rates: np.ndarray
    liveliness: float
    engine: Any
    units: TrainUnits
    lag: Any = ()


@inlined
def relax(wheel_contacts, half_step, cornering_coefficient, contact_lag, surfaces):
    """Do nothing: these tyres have no lag. ``models.brake.sprung_relaxation`` replaces this function for tyres that
    lag."""


def accelerate(engine_model: Any, q: np.ndarray, v: np.ndarray, accelerations: np.ndarray) -> None:
    """Fill ``accelerations`` (n,) with the accelerations of a ``FreeModel``; engines replace this function by their
    own.
    """
    accelerations[:] = engine_model.acceleration(0.0, q, v)


def march(engine_model: Any, q: np.ndarray, v: np.ndarray) -> bool:
    """Advance positions and rates (n,) by one step of the engine; returns whether it succeeded. Other engines replace
    this function.
    """
    q[:], v[:] = np.split(engine_model.march(q, v, 1, engine_model.step)[-1], 2)
    return True


def advance(vehicle_motion, brake_torques, time_step, steer_angles, vehicle, engine_run):
    """Advance a vehicle on its suspension by n steps, as ``models.brake.advance.advance`` does in the plane; the state
    (2, n) holds all coordinates and their rates.

    A run begins with accelerations of zero. The engine's step is ``time_step``. At its start the speeds along the
    wheels are taken to change as they did in the last one.
    """
    angles, known, contacts, middle = (
        vehicle.tables.angles,
        engine_run.wheel_data,
        engine_run.contacts,
        engine_run.middle_state,
    )
    wheels, units = known.wheels, engine_run.units
    q, v, turning, accelerations = (
        vehicle_motion.state[0],
        vehicle_motion.state[1],
        vehicle_motion.turning,
        vehicle_motion.accelerations,
    )
    rates, turns, plane = engine_run.rates, units.turns, units.motion
    regular, half, time = vehicle.slope * engine_run.liveliness * time_step, 0.5 * time_step, 0.0
    if not accelerations.any():
        wheels.rate[:] = 0.0
    known.wheel_forces.steer[:] = steer_angles
    for n in range(brake_torques.shape[0] - 1):
        torques_before, torques_after = brake_torques[n], brake_torques[n + 1]
        fill_unit_values(q, turns, plane[0])
        fill_unit_values(v, turns, plane[1])
        fill_surfaces_under_wheels(plane, time_step, vehicle, known.surfaces)
        engine_run.forces[:] = 0.0
        forces_and_contacts(engine_run.force_table, q, v, engine_run.forces, contacts)
        wheels.start[:] = contacts.along
        relax(contacts, half, vehicle.slope, engine_run.lag, known.surfaces)
        set_slip_angles(contacts, regular, known.surfaces.lag, angles, wheels)
        store_mean_forces(known, torques_before, 0.5 * (torques_before + torques_after), half, vehicle_motion, vehicle)
        accelerate(engine_run.engine, q, v, rates)
        fill_unit_values(rates, turns, accelerations)
        rest_time = time_of_rest(plane[1], turning, accelerations, time_step, vehicle.plane)
        if rest_time >= 0.0:
            q += rest_time * v + 0.5 * rest_time**2 * rates
            v[:PLANE_COORDINATE_COUNT], turning[:] = 0.0, 0.0
            for k in range(turns.size):
                v[turns[k]] = 0.0
            if rest_time < time_step:
                return AT_REST, time + rest_time
        else:
            middle[0], middle[1] = q + half * v + 0.5 * half**2 * rates, v + half * rates
            engine_run.forces[:] = 0.0
            forces_and_contacts(engine_run.force_table, middle[0], middle[1], engine_run.forces, contacts)
            wheels.rate[:] = (contacts.along - wheels.start) / half
            set_slip_angles(contacts, regular, known.surfaces.lag, angles, wheels)
            store_mean_forces(known, torques_before, torques_after, time_step, vehicle_motion, vehicle)
            if not march(engine_run.engine, q, v):
                return GAVE_UP, time
            turning[:] = vehicle_motion.report[TURNING_ROW]
        time += time_step
        status = status_at_end(q, units, vehicle.plane.jackknife_angle)
        if status != FINE:
            return status, time
    return FINE, time


def advance_with(**engine_functions: Callable[..., Any]) -> Callable[..., Any]:
    """Function ``advance`` in which an engine's functions replace this module's default ones; see ``samples.moved``."""
    return FunctionType(advance.__code__, globals() | engine_functions, "advance")


def compiled(cache_name: str, **engine_functions: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled version of ``advance_with``, for an engine's compiled functions."""
    return njit(cache=True, error_model="numpy")(closure_with_unique_name(advance_with(**engine_functions), cache_name))
