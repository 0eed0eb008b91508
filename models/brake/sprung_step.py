"""Time steps of a braked vehicle on its suspension: one source text, for engines called from Python or in compiled
code.

Each step (s) the wheels are exact under the torques that they have, with loads and slip angles in the middle of the
step, to which half a step by the accelerations leads; the engine then marches the whole step by its own Runge-Kutta
method around the compiled forces, the tyres' mean ones held at their contacts and turned with their wheels.

Springs and loads are as they are, tyres' forces as held. The table of numbers is that of ``models.multibody.forces``,
then what the wheels hold, see ``WheelForces``. What the road has beside the moment that speeds up a
wheel's turning is on the chassis, or on the towed body that carries the wheel: brakes hold on to it, and locked wheels
do.
"""

from collections.abc import Callable
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FINE, FOLDED
from models.brake.plane_records import TURNING_ROW, Wheels, report_of
from models.brake.plane_step import set_slip_angle, time_of_rest, tyre
from models.brake.surfaces import Surfaces, under_wheels
from models.brake.wheel_step import StepInput, Wheel
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


class WheelForces(NamedTuple):
    """Wheel quantities that are constant over a step, each (W,): steer angle (rad), mean forces on the tyre along and
    across it (N), and the mean moment that accelerates the wheel's rotation (N m).
    """

    steer: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray
    moment: np.ndarray


class Contacts(NamedTuple):
    """Motion and loads of the wheels, each (W,): speeds of their centres along them and of their contacts across them
    (m/s), loads (N).
    """

    along: np.ndarray
    across: np.ndarray
    load: np.ndarray


class AtWheels(NamedTuple):
    """Data at the wheels: quantities that are constant over a step, the state of each wheel, and the surfaces under
    them.

    The wheels' rates are the changes of the speeds along them, kept from step to step.
    """

    wheel_forces: WheelForces
    wheels: Wheels
    surfaces: Surfaces


@lean
def wheel_forces_of(table):
    """``WheelForces`` of views of the last numbers in a table for compiled force functions."""
    wheels = int(table[TYRES])
    rows = array(beyond(start(table), int(table[COUNT])), (VALUES_PER_WHEEL, wheels))
    return WheelForces(rows[0], rows[1], rows[2], rows[3])


@lean
def forces_and_contacts(table, q, v, force_sum, contacts):
    """Add all forces on the vehicle to ``force_sum`` (n,), with constant wheel forces, and fill the ``Contacts``."""
    wheel = WheelContact(
        array(doubles(10), (10,)),
        array(doubles(4), (4,)),
        array(doubles(WAY), (WAY,)),
        array(doubles(REPORTED), (REPORTED,)),
    )
    wheel_geometry, ledger, creeping = wheel.way, array(doubles(LEDGER), (LEDGER,)), array(doubles(3), (3,))
    vehicle = start_forces(table, q, v, force_sum, doubles(workspace_size(table)), ledger)
    waves, wheel_forces = table[int(table[OF_WAVES]) :], wheel_forces_of(table)
    creeping[2], tyres = 0.0, beyond(start(table), int(table[OF_TYRES]))
    for i in range(int(table[TYRES])):
        tyre_row = row(tyres, PER_TYRE, i)
        find_contact(tyre_row, waves, int(table[WAVES]), wheel_forces.steer[i], 0.0, vehicle, wheel)
        contacts.along[i] = dot(three_from(wheel_geometry, PASSING), three_from(wheel_geometry, ROLLING))
        contacts.across[i], contacts.load[i] = wheel.report[SLIP_Y], wheel.report[PRESS]
        creeping[0], creeping[1] = wheel_forces.force_x[i], wheel_forces.force_y[i]
        add_creep_forces(tyre_row, creeping, vehicle, wheel)
        carrying = row(vehicle.tree.links, PER_LINK, int(tyre_row[CARRYING]))
        add_body_moment(carrying, vehicle.tree.ground, times(three_from(wheel_geometry, AXLE), -wheel_forces.moment[i]))
    finish_forces(table, vehicle)


@lean
def forces(table, q, v, force_sum):
    """Add all forces on the vehicle to ``force_sum`` (n,), with constant wheel forces."""
    w = int(table[TYRES])
    motion = array(doubles(3 * w), (3, w))
    forces_and_contacts(table, q, v, force_sum, Contacts(motion[0], motion[1], motion[2]))


@lean
def forces_from_pointers(table, time, q, v, force_sum):
    """Add the vehicle's forces, with constant wheel forces, to ``force_sum``. For callbacks of engines: all arguments
    but the time are pointers to doubles; the time is not used.
    """
    head = array(table, (HEADER,))
    n, w = int(head[JOINTS]), int(head[TYRES])
    forces(
        array(table, (int(head[COUNT]) + VALUES_PER_WHEEL * w,)), array(q, (n,)), array(v, (n,)), array(force_sum, (n,))
    )


@lean
def set_forces_from_block(block, t, n):
    """Set the generalised forces f of ``forces_from_pointers``. All data are in one block of doubles at an address: f,
    q and v (n,), then the table.
    """
    f = at(block)
    array(f, (n,))[:] = 0.0
    forces_from_pointers(beyond(f, 3 * n), t, beyond(f, n), beyond(f, 2 * n), f)


@lean
def set_slip_angles(contacts, regularising_speed, lag, angles, wheels):
    """Set slip angles and loads of the ``Wheels`` from their ``Contacts``; regularising_speed (m/s) : see
    ``plane_step``; lag (W,) of ``Surfaces``; angles of the tyres' tables.
    """
    for i in range(contacts.load.size):
        set_slip_angle(i, contacts.along[i], contacts.across[i], regularising_speed, lag, angles, wheels)
        wheels.load[i] = contacts.load[i]


@lean
def store_mean_forces(known, torques_before, torques_after, step, motion, vehicle):
    """Compute the tyres' mean forces over a step (s) between brake torques (W,) in N m, store them as the wheels'
    constant forces, and fill the report.

    known : ``AtWheels`` with speeds at the start and their rates, and what ``set_slip_angles`` takes.
    """
    wheel_forces, wheels, plane, report = known.wheel_forces, known.wheels, vehicle.plane, report_of(motion.report)
    for i in range(torques_before.size):
        speed, wheel = wheels.start[i], Wheel(plane.radius[i], plane.spin[i], motion.turning[i])
        step_input = StepInput(speed, speed + step * wheels.rate[i], torques_before[i], torques_after[i], step)
        tyre(i, step_input, wheel, vehicle.tables, wheels, known.surfaces, report)
        wheel_forces.force_x[i], wheel_forces.force_y[i] = report.force_x[i], report.force_y[i]
        wheel_forces.moment[i] = wheel.inertia * (report.turning[i] - wheel.turning) / step


OVER, GAVE_UP = 6, 7
"""Further ends of a sample: the vehicle turns over; the engine gives up."""
UPRIGHT = 0.5
"""Roll or pitch angle (rad) beyond which the vehicle turns over."""
PLANE = 3
"""Number of the first coordinates: x, y and heading of the vehicle."""


class Units(NamedTuple):
    """The vehicle and its trailers as units in the plane.

    turns (U - 1,) : numbers of the yaw coordinates of each trailer relative to the unit before it; lean_coordinates
    (L,) : numbers of the roll and pitch coordinates; motion (2, 2 + U) : position of the first unit and headings of
    all, and their rates.
    """

    turns: np.ndarray
    lean_coordinates: np.ndarray
    motion: np.ndarray


@lean
def to_units(coordinate_values, hinge_columns, plane):
    """Fill values (2 + U,) for the ``Units`` from values for all coordinates (n,): positions, rates or
    accelerations.
    """
    for a in range(PLANE):
        plane[a] = coordinate_values[a]
    for k in range(hinge_columns.size):
        plane[PLANE + k] = plane[PLANE + k - 1] + coordinate_values[hinge_columns[k]]


@inlined
def status_at_end(q, units, fold):
    """FINE, or how positions (n,) end a run: the vehicle turns over, or a train jackknifes."""
    status = FINE
    for k in range(units.turns.size):
        if not abs(q[units.turns[k]]) <= fold:
            status = FOLDED
    for k in range(units.lean_coordinates.size):
        if not abs(q[units.lean_coordinates[k]]) <= UPRIGHT:
            status = OVER
    return status


class OnEngine(NamedTuple):
    """Data that a step of a vehicle on its suspension needs in addition to the data of a plane step.

    numbers : the table, at whose end is what the wheels hold; contacts : of the state whose ``forces`` (n,) were taken;
    middle (2, n) : state in the middle of a step; rates (n,) : accelerations; liveliness : see
    ``EngineSprungVehicle``; engine : its model; units : ``Units``; lag : of ``models.brake.sprung_relaxation``, empty
    where tyres answer at once.
    """

    numbers: np.ndarray
    known: AtWheels
    contacts: Contacts
    forces: np.ndarray
    middle: np.ndarray
    rates: np.ndarray
    liveliness: float
    engine: Any
    units: Units
    lag: Any = ()


@inlined
def relax(contacts, half, slope, lag, surfaces):
    """Do nothing: these tyres have no lag. ``models.brake.sprung_relaxation`` replaces this function for tyres that
    lag."""


def accelerate(engine: Any, q: np.ndarray, v: np.ndarray, accelerations: np.ndarray) -> None:
    """Fill ``accelerations`` (n,) with the accelerations of a ``FreeModel``; engines replace this function by their
    own.
    """
    accelerations[:] = engine.acceleration(0.0, q, v)


def march(engine: Any, q: np.ndarray, v: np.ndarray) -> bool:
    """Advance positions and rates (n,) by one step of the engine; returns whether it succeeded. Other engines replace
    this function.
    """
    q[:], v[:] = np.split(engine.march(q, v, 1, engine.step)[-1], 2)
    return True


def advance(motion, torques, step, steer, vehicle, course):
    """Advance a vehicle on its suspension by n steps, as ``models.brake.advance.advance`` does in the plane; the state
    (2, n) holds all coordinates and their rates.

    A run begins with accelerations of zero. The engine's step is ``step``. At its start the speeds along the wheels are
    taken to change as they did in the last one.
    """
    angles, known, contacts, middle = vehicle.tables.angles, course.known, course.contacts, course.middle
    wheels, units = known.wheels, course.units
    q, v, turning, accelerations = motion.state[0], motion.state[1], motion.turning, motion.accelerations
    rates, turns, plane = course.rates, units.turns, units.motion
    regular, half, time = vehicle.slope * course.liveliness * step, 0.5 * step, 0.0
    if not accelerations.any():
        wheels.rate[:] = 0.0
    known.wheel_forces.steer[:] = steer
    for n in range(torques.shape[0] - 1):
        torques_before, torques_after = torques[n], torques[n + 1]
        to_units(q, turns, plane[0])
        to_units(v, turns, plane[1])
        under_wheels(plane, step, vehicle, known.surfaces)
        course.forces[:] = 0.0
        forces_and_contacts(course.numbers, q, v, course.forces, contacts)
        wheels.start[:] = contacts.along
        relax(contacts, half, vehicle.slope, course.lag, known.surfaces)
        set_slip_angles(contacts, regular, known.surfaces.lag, angles, wheels)
        store_mean_forces(known, torques_before, 0.5 * (torques_before + torques_after), half, motion, vehicle)
        accelerate(course.engine, q, v, rates)
        to_units(rates, turns, accelerations)
        rest_time = time_of_rest(plane[1], turning, accelerations, step, vehicle.plane)
        if rest_time >= 0.0:
            q += rest_time * v + 0.5 * rest_time**2 * rates
            v[:PLANE], turning[:] = 0.0, 0.0
            for k in range(turns.size):
                v[turns[k]] = 0.0
            if rest_time < step:
                return AT_REST, time + rest_time
        else:
            middle[0], middle[1] = q + half * v + 0.5 * half**2 * rates, v + half * rates
            course.forces[:] = 0.0
            forces_and_contacts(course.numbers, middle[0], middle[1], course.forces, contacts)
            wheels.rate[:] = (contacts.along - wheels.start) / half
            set_slip_angles(contacts, regular, known.surfaces.lag, angles, wheels)
            store_mean_forces(known, torques_before, torques_after, step, motion, vehicle)
            if not march(course.engine, q, v):
                return GAVE_UP, time
            turning[:] = motion.report[TURNING_ROW]
        time += step
        status = status_at_end(q, units, vehicle.plane.jackknife_angle)
        if status != FINE:
            return status, time
    return FINE, time


def advance_with(**replacements: Callable[..., Any]) -> Callable[..., Any]:
    """Function ``advance`` in which an engine's functions replace this module's default ones; see ``samples.moved``."""
    return FunctionType(advance.__code__, globals() | replacements, "advance")


def compiled(name: str, **replacements: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled version of ``advance_with``, for an engine's compiled functions."""
    return njit(cache=True, error_model="numpy")(closure_with_unique_name(advance_with(**replacements), name))
