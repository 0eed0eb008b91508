"""Forces of both rails as forces of a wheelset's joints, for engines that count coordinates joint by joint.

Joints, from the track to the wheelset: sliding along y and along z, yaw about z, roll about the axle's own x, spin
about the axle. The rate of the last is the wheelset's spin against axes that do not spin: the spin of ``equations`` is
more by yaw' sin roll. The track moves along x with the speed of travel, so that x is no coordinate.

The compiled functions find all numbers in one table: a head, the contact's numbers, FASTSIM's strips and cells.
"""

import math

import numpy as np
from numba import carray

from models.contact.inputs import Array
from models.machine.compiled import njit
from models.machine.stack import at, beyond
from models.rail.equations import ANGLE, LIMIT, ROLL, ROLL_RATE, SPIN, STATES, Y_RATE, YAW, YAW_RATE, Z_RATE, Y, Z
from models.rail.wheel_forces import REPORTED, Rails, room_for, wheel_forces

JOINTS = 5
SPEED, LAW, MIDDLE, NUMBERS, STRIPS, CELLS, HEADER = range(7)
"""Head of the table: speed (m/s), creep law, FASTSIM's middle; count of the numbers, of strips and of cells."""
PER_STRIP, PER_CELL = 4, 5
"""Rows of the strips and of the cells, see ``fastsim_grid``."""
_POSITIONS, _RATES = [Y, Z, YAW, ROLL, ANGLE], [Y_RATE, Z_RATE, YAW_RATE, ROLL_RATE, SPIN]


def table(speed: float, body: Array, rails: Rails) -> Array:
    """What the compiled functions read, from ``Equations.parameters``."""
    numbers, strips, cells = rails.numbers, rails.strips, rails.cells
    head = [speed, rails.law, rails.middle, numbers.size, strips.shape[1], cells.shape[1]]
    return np.concatenate((head, numbers, strips.ravel(), cells.ravel()))


def to_joints(states: Array) -> Array:
    """Positions and rates of the joints (..., 10) of states (..., 10)."""
    found = states[..., _POSITIONS + _RATES]
    found[..., -1] -= states[..., YAW_RATE] * np.sin(states[..., ROLL])
    return found


def from_joints(joints: Array) -> Array:
    """States (..., 10) of positions and rates of the joints (..., 10)."""
    states = np.empty(joints.shape)
    states[..., _POSITIONS + _RATES] = joints
    states[..., SPIN] += states[..., YAW_RATE] * np.sin(states[..., ROLL])
    return states


def rates_of(joints: Array, accelerations: Array) -> Array:
    """Rates (10,) of the state by positions and rates (10,) and accelerations (5,) of the joints."""
    out = np.empty(STATES)
    out[_POSITIONS], out[_RATES] = joints[JOINTS:], accelerations
    roll, yaw_rate, roll_rate = joints[3], joints[JOINTS + 2], joints[JOINTS + 3]
    out[SPIN] += accelerations[2] * math.sin(roll) + yaw_rate * roll_rate * math.cos(roll)
    return out


@njit(cache=True, error_model="numpy")
def joint_forces(numbers, q, v, f):
    """Add the joints' forces (N, N m) to ``f`` (5,); all four are pointers to doubles.

    Not a number where the wheelset has left the track: engines do not ask before they go on.
    """
    head = carray(numbers, (HEADER,))
    strips, cells = int(head[STRIPS]), int(head[CELLS])
    first = HEADER + int(head[NUMBERS])
    contact = carray(beyond(numbers, HEADER), (int(head[NUMBERS]),))
    net = carray(beyond(numbers, first), (PER_STRIP, strips))
    along = carray(beyond(numbers, first + PER_STRIP * strips), (PER_CELL, cells))
    y, z, yaw, roll, _ = carray(q, (JOINTS,))
    y_rate, z_rate, yaw_rate, roll_rate, spin = carray(v, (JOINTS,))
    out = carray(f, (JOINTS,))
    if not abs(y) + abs(z) + abs(yaw) + abs(roll) < LIMIT:
        out[:] = np.nan
        return
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    axle_x, axle_y, axle_z = -sy * cr, cy * cr, sr
    velocity = np.array([head[SPEED], y_rate, z_rate])
    turning = np.array([cy * roll_rate + axle_x * spin, sy * roll_rate + axle_y * spin, yaw_rate + axle_z * spin])
    force, moment, report = np.zeros(3), np.zeros(3), np.empty((0, REPORTED))
    rails = Rails(contact, net, along, head[MIDDLE], int(head[LAW]))
    wheel_forces(y, z, roll, yaw, velocity, turning, rails, force, moment, report, room_for(contact))
    out[0] += force[1]
    out[1] += force[2]
    out[2] += moment[2]
    out[3] += cy * moment[0] + sy * moment[1]
    out[4] += axle_x * moment[0] + axle_y * moment[1] + axle_z * moment[2]


@njit(cache=True, error_model="numpy")
def set_joint_forces(block):
    """``joint_forces`` in one block of doubles at an address: f, q and v (5,), and the table; f is cleared before."""
    f = at(block)
    carray(f, (JOINTS,))[:] = 0.0
    joint_forces(beyond(f, 3 * JOINTS), beyond(f, JOINTS), beyond(f, 2 * JOINTS), f)
