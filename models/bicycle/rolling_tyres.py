"""Whipple's bicycle for an engine: bodies behind joints, and compiled forces of both tyres and of the steering control.

Bodies and coordinates are those of ``bicycle_of_four_bodies``; the table is laid out as ``models.multibody.forces``
reads it, with the control's numbers in place of a car's.

Each tyre is that of handling (``models.tyre.bristles``) on the wheel's lowest point, R from its centre in its plane:
its load N = N0 + k (R cos lean - height) - c (its rate), N0 the load at rest, has the potential N^2 / 2 k. Stiffness s
scales a tyre so that it tends to ideal rolling: C = s C0, k = s^2 k0 and the width b0 / s, so that the side slip, the
trail and the patch's moment of turning all vanish as 1 / s.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from pydantic import Field

from models.bicycle.four_bodies import COUNT, FRONT, LEAN, PITCH, REAR, STEER, bicycle_of_four_bodies
from models.bicycle.whipple import NO_CONTROL, SteeringControl, Whipple
from models.contact.fastsim_many import LOAD, MU, A, B
from models.core.errors import InputError
from models.core.strict import Strict, quantity
from models.engines.free_vehicle import LoadedVehicle
from models.machine.compiled import lean
from models.machine.stack import array, at, beyond, doubles, row, start
from models.multibody import forces, tree
from models.multibody.forces import (
    DISSIPATED,
    LEDGER,
    POTENTIAL,
    PRESS,
    REPORTED,
    STEER_POWER,
    add_creep_forces,
    finish_forces,
    start_forces,
    workspace_size,
)
from models.multibody.moving_vehicle import WheelContact, carried_velocity
from models.multibody.tree import cross, dot, plus, put_three, three_from, times
from models.tyre.bristles import FIRST_FLEXIBILITY, cornering_stiffness_factor, patch_grid, tyre_forces
from models.vehicles.free_vehicle import joint_table
from models.vehicles.spatial import SpatialVehicle

WHEEL_COUNT = 2
(GAIN, FEEDBACK_SPEED_LIMIT, FRICTION, DRY_FRICTION, DRY_RATE, SPEED_GAIN, SPEED_BIAS, CONTROL_COUNT) = range(8)
"""Indices of the control's parameters in their section of the table of numbers, with gains multiplied; CONTROL_COUNT
is their number.
"""


class BicycleTyre(Strict):
    """[tyres]: tyre parameters of both wheels; ideally rolling wheels are the limit of infinite stiffness."""

    cornering: float = quantity("1/rad", "side force by slip angle and load", default=20.0)
    vertical: float = quantity("N/m", "vertical stiffness", default=2e5)
    damping: float = quantity("N s/m", "vertical damping", default=200.0, zero=True)
    half_width: float = quantity("m", "half the width of the patch", default=5e-3)
    friction: float = quantity("-", "coefficient of friction", default=1.0)
    cells: int = Field(default=9, ge=3, le=200, description="of the patch's net per strip")
    stiffness: float = quantity("-", "how many times as stiff: s C, s^2 k, half width by s", default=1.0)


UNCHANGED_TYRE = BicycleTyre()
"""Default bicycle tyre, with the usual values of all parameters."""


@dataclass(frozen=True, eq=False)
class RollingBicycle:
    """The bicycle on its tyres; ``driven`` is the description that engines build. InputError for parameters that only
    the linear equations can handle.
    """

    bicycle: Whipple
    tyre: BicycleTyre = UNCHANGED_TYRE
    control: SteeringControl = NO_CONTROL
    vehicle: SpatialVehicle = field(init=False)
    numbers: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        for name in ("rear_wheel", "body", "front_frame", "front_wheel"):
            bike_part = getattr(self.bicycle, name)
            needed = {
                "mass": bike_part.mass,
                "Ixx": bike_part.Ixx,
                **({"Iyy": bike_part.Iyy} if name.endswith("wheel") else {}),
            }
            for key, value in needed.items():
                if not value > 0.0:
                    allowed = "must be above 0 in engines, whose every body has inertia; linear equations take 0"
                    raise InputError("", f"{name}.{key}", value, allowed)
        object.__setattr__(self, "vehicle", bicycle_of_four_bodies(self.bicycle))
        object.__setattr__(self, "numbers", _table(self))

    @property
    def driven(self) -> LoadedVehicle:
        """Description from which an engine builds the bicycle."""
        gravity = np.array([0.0, 0.0, -self.bicycle.gravity])
        return LoadedVehicle(self.vehicle, gravity, self.numbers, bicycle_forces, set_bicycle_forces)

    def report(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reports (n, 2, REPORTED) of the tyres and energy ledgers (n, LEDGER), columns of ``models.multibody.forces``,
        at positions and rates (n, 9).
        """
        tyres, ledgers = np.empty((len(q), WHEEL_COUNT, REPORTED)), np.empty((len(q), LEDGER))
        read_bicycle(self.numbers, np.ascontiguousarray(q), np.ascontiguousarray(v), tyres, ledgers)
        return tyres, ledgers

    def loads(self) -> tuple[float, float]:
        """Static wheel loads (N) of the rear and the front wheel."""
        b, g = self.bicycle, self.bicycle.gravity
        mass = b.rear_wheel.mass + b.body.mass + b.front_frame.mass + b.front_wheel.mass
        moment = b.body.mass * b.body.x + b.front_frame.mass * b.front_frame.x + b.front_wheel.mass * b.wheelbase
        front = g * moment / b.wheelbase
        return g * mass - front, front


def _table(bicycle: RollingBicycle) -> np.ndarray:
    """Table of all numbers that the bicycle's compiled forces read."""
    c, patch, rows = bicycle.control, patch_grid(bicycle.tyre.cells), joint_table(bicycle.vehicle)
    counts = [len(body.freedoms) for body in bicycle.vehicle.bodies for _ in body.freedoms]
    rows[[REAR, FRONT], tree.KIND] = tree.LOOSE
    positions = {body.name: body.position for body in bicycle.vehicle.bodies}
    points = [
        [joint, *np.subtract(positions[wheel], positions[parent])]
        for joint, wheel, parent in ((PITCH, "rear wheel", "frame"), (STEER, "front wheel", "steering"))
    ]
    control = [c.torque_gain * c.gain, c.until, c.friction, c.dry_friction, c.dry_rate, c.speed_gain, c.speed_bias]
    sections = [np.column_stack([rows, counts]), points, _tyres(bicycle), control, patch.cells, patch.strips]
    flat = [np.asarray(section, float).ravel() for section in sections]
    ends = forces.HEADER + np.cumsum([section.size for section in flat])
    head = np.zeros(forces.HEADER)
    counted = forces.COUNT, forces.JOINTS, forces.POINTS, forces.TYRES, forces.CELLS, forces.STRIPS, forces.MIDDLE
    head[[*counted]] = (
        ends[-1],
        COUNT,
        WHEEL_COUNT,
        WHEEL_COUNT,
        patch.cells.shape[1],
        patch.strips.shape[1],
        patch.middle,
    )
    head[[forces.OF_POINTS, forces.OF_TYRES, forces.OF_KNOTS, forces.OF_CELLS, forces.OF_STRIPS]] = ends[:-1]
    return np.concatenate([head, *flat])


def _tyres(bicycle: RollingBicycle) -> np.ndarray:
    """Parameters (2, PER_TYRE) of both tyres, in the columns of a car's tyres, of which the bicycle needs only some."""
    t, table = bicycle.tyre, np.zeros((WHEEL_COUNT, forces.PER_TYRE))
    vertical, width = t.stiffness**2 * t.vertical, t.half_width / t.stiffness
    wheels = (
        (PITCH, REAR, "rear wheel", bicycle.bicycle.rear_wheel),
        (STEER, FRONT, "front wheel", bicycle.bicycle.front_wheel),
    )
    for i, (joint, spin, name, wheel) in enumerate(wheels):
        load = bicycle.loads()[i]
        if not load > 0.0:
            raise InputError("", name, load, "carries no weight (N): it must press on the road at rest")
        bristles = t.stiffness * t.cornering * vertical / (cornering_stiffness_factor(t.cells) * wheel.radius * width)
        table[i, [forces.KNUCKLE, forces.ROTOR, forces.POINT, forces.STATIC]] = joint, spin, i, load
        table[i, [forces.RADIUS, forces.BRISTLES]] = wheel.radius, bristles
    table[:, forces.HEIGHT] = [body.position[2] for body in bicycle.vehicle.bodies if body.name.endswith("wheel")]
    law = forces.VERTICAL, forces.VISCOUS, forces.HALF_WIDTH, forces.GRIP
    table[:, law] = vertical, t.stiffness * t.damping, width, t.friction
    return table


@lean
def _tyre_load(tyre_parameters, vehicle, wheel_contact):
    """Apply the load of a tyre at the wheel's lowest point, and fill the ``WheelContact`` for the tyre's creep
    forces.
    """
    patch, slip, way, report, ledger = (
        wheel_contact.patch,
        wheel_contact.slip,
        wheel_contact.way,
        wheel_contact.report,
        vehicle.ledger,
    )
    spot = row(vehicle.tree.spots, tree.PER_SPOT, int(tyre_parameters[forces.POINT]))
    link, spin = (
        row(vehicle.tree.links, tree.PER_LINK, int(tyre_parameters[forces.KNUCKLE])),
        vehicle.rates[int(tyre_parameters[forces.ROTOR])],
    )
    axle, centre = three_from(link, tree.TURNED + 3), three_from(spot, tree.WHERE)
    flat = math.sqrt(1.0 - axle[2] * axle[2])
    arm = times(plus(times(axle, axle[2]), (0.0, 0.0, -1.0)), tyre_parameters[forces.RADIUS] / flat)
    along = times((axle[1], -axle[0], 0.0), 1.0 / flat)
    across = (-along[1], along[0], 0.0)
    turning = plus(plus(three_from(link, tree.TURNING), (0.0, 0.0, vehicle.frame.yaw_rate)), times(axle, spin))
    sliding = plus(plus(three_from(spot, tree.RATE), carried_velocity(vehicle.frame, centre)), cross(turning, arm))
    elastic = max(
        tyre_parameters[forces.STATIC]
        + tyre_parameters[forces.VERTICAL] * (tyre_parameters[forces.RADIUS] * flat - centre[2]),
        0.0,
    )
    load = max(elastic - tyre_parameters[forces.VISCOUS] * sliding[2], 0.0) if elastic > 0.0 else 0.0
    ledger[POTENTIAL] += 0.5 * elastic * elastic / tyre_parameters[forces.VERTICAL]
    ledger[DISSIPATED] += (load - elastic) * sliding[2]
    slip[0], slip[1], slip[2] = dot(sliding, along), dot(sliding, across), turning[2]
    slip[3] = -spin * dot(cross(axle, arm), along)
    patch[A], patch[B] = (
        math.sqrt(tyre_parameters[forces.RADIUS] * load / tyre_parameters[forces.VERTICAL]),
        tyre_parameters[forces.HALF_WIDTH],
    )
    patch[LOAD], patch[MU] = load, tyre_parameters[forces.GRIP]
    patch[FIRST_FLEXIBILITY] = patch[FIRST_FLEXIBILITY + 1] = patch[FIRST_FLEXIBILITY + 2] = (
        1.0 / tyre_parameters[forces.BRISTLES]
    )
    report[PRESS] = load
    report[forces.SLIP_X], report[forces.SLIP_Y], report[forces.TURN] = slip[0], slip[1], slip[2]
    put_three(way, forces.CENTRE, centre)
    put_three(way, forces.DOWN, arm)
    put_three(way, forces.ROLLING, along)
    put_three(way, forces.ACROSS, across)
    put_three(way, forces.NORMAL, (0.0, 0.0, 1.0))
    put_three(way, forces.AXLE, axle)
    put_three(way, forces.LOADING, (0.0, 0.0, load))
    tree.add_body_moment(link, vehicle.tree.ground, cross(arm, (0.0, 0.0, load)))


@lean
def _add_steering_torque(table_of_numbers, vehicle):
    """Add the steering torque (N m, to the left) of control and friction, which depends on the speed of the rear
    wheel's centre.
    """
    v = vehicle.rates
    missing = max(
        table_of_numbers[FEEDBACK_SPEED_LIMIT]
        - table_of_numbers[SPEED_GAIN] * abs(vehicle.frame.forward_speed)
        - table_of_numbers[SPEED_BIAS],
        0.0,
    )
    torque = -table_of_numbers[GAIN] * missing * v[LEAN] - table_of_numbers[FRICTION] * v[STEER]
    if table_of_numbers[DRY_FRICTION] != 0.0:
        torque -= table_of_numbers[DRY_FRICTION] * math.tanh(v[STEER] / table_of_numbers[DRY_RATE])
    vehicle.forces[STEER] += torque
    vehicle.ledger[STEER_POWER] = torque * v[STEER]


@lean
def all_bicycle_forces(table_of_numbers, q, v, forces_on_coordinates, report, ledger):
    """Add the forces of tyres and control to ``forces_on_coordinates`` (9,); all arguments are arrays: table, q, v
    (9,), report (2, REPORTED), ledger (LEDGER,).
    """
    vehicle, table = (
        start_forces(table_of_numbers, q, v, forces_on_coordinates, doubles(workspace_size(table_of_numbers)), ledger),
        start(table_of_numbers),
    )
    patches, ways = array(doubles(10 * WHEEL_COUNT), (WHEEL_COUNT, 10)), doubles(forces.WAY * WHEEL_COUNT)
    slips, creeping = (
        array(doubles(4 * WHEEL_COUNT), (WHEEL_COUNT, 4)),
        array(doubles(4 * WHEEL_COUNT), (WHEEL_COUNT, 4)),
    )
    tyres = beyond(table, int(table_of_numbers[forces.OF_TYRES]))
    for i in range(WHEEL_COUNT):
        wheel = WheelContact(patches[i], slips[i], row(ways, forces.WAY, i), report[i])
        _tyre_load(row(tyres, forces.PER_TYRE, i), vehicle, wheel)
    cells = array(beyond(table, int(table_of_numbers[forces.OF_CELLS])), (5, int(table_of_numbers[forces.CELLS])))
    strips = array(beyond(table, int(table_of_numbers[forces.OF_STRIPS])), (4, int(table_of_numbers[forces.STRIPS])))
    tyre_forces(patches, slips, strips, cells, table_of_numbers[forces.MIDDLE], creeping)
    for i in range(WHEEL_COUNT):
        wheel = WheelContact(patches[i], slips[i], row(ways, forces.WAY, i), report[i])
        add_creep_forces(row(tyres, forces.PER_TYRE, i), creeping[i], vehicle, wheel)
        ledger[DISSIPATED] += report[i, forces.POWER]
    _add_steering_torque(table_of_numbers[int(table_of_numbers[forces.OF_KNOTS]) :], vehicle)
    finish_forces(table_of_numbers, vehicle)


@lean
def bicycle_forces(table_of_numbers, t, q, v, forces_on_coordinates):
    """Add the bicycle's forces to ``forces_on_coordinates``. For callbacks of engines: all arguments but the time (s)
    are pointers to doubles.
    """
    report, ledger = array(doubles(WHEEL_COUNT * REPORTED), (WHEEL_COUNT, REPORTED)), array(doubles(LEDGER), (LEDGER,))
    table = array(table_of_numbers, (int(array(table_of_numbers, (forces.HEADER,))[forces.COUNT]),))
    all_bicycle_forces(
        table, array(q, (COUNT,)), array(v, (COUNT,)), array(forces_on_coordinates, (COUNT,)), report, ledger
    )


@lean
def set_bicycle_forces(memory_block, t, coordinate_count):
    """Set the generalised forces f of ``bicycle_forces``. All data are in one block of doubles at an address: f, q and
    v (n,), then the table.
    """
    f = at(memory_block)
    array(f, (coordinate_count,))[:] = 0.0
    bicycle_forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)


@lean
def read_bicycle(table_of_numbers, q, v, reports, ledgers):
    """Fill the reports (m, 2, REPORTED) of the tyres and the ledgers (m, LEDGER) of energy for states (m, 9)."""
    f = array(doubles(COUNT), (COUNT,))
    for i in range(len(q)):
        f[:] = 0.0
        all_bicycle_forces(table_of_numbers, q[i], v[i], f, reports[i], ledgers[i])
