"""Forces of both rails as joint forces of a wheelset, for engines whose coordinates are those of joints.

Joints, from the track to the wheelset: sliding along y and along z, yaw about z, roll about the axle's own x, spin
about the axle. The rate of the last is the wheelset's spin against axes that do not spin: the spin of ``equations`` is
more by yaw' sin roll. The track moves along x with the speed of travel, so that x is no coordinate.

The compiled functions find all numbers in one table.
"""

import math

import numpy as np

from models.contact.inputs import Array
from models.machine.compiled import inlined, njit
from models.machine.records import record, records_at_pointer, size_of
from models.machine.stack import array, at, beyond
from models.rail.equations import (
    ANGLE,
    DERAILED_LIMIT,
    ROLL,
    ROLL_RATE,
    SPIN,
    STATE_COUNT,
    Y_RATE,
    YAW,
    YAW_RATE,
    Z_RATE,
    Y,
    Z,
)
from models.rail.profile_contact import PROFILE_COUNTS, RAIL_KNOT_RECORD, WHEEL_NODE_RECORD, LaidProfile, WheelPose
from models.rail.wheel_forces import REPORT_RECORD, WHEELS_RECORD, RailsAndWheels, fill_wheel_forces, workspace_for

JOINTS = 5
TABLE_HEAD = record("speed", "law", "middle", "nodes", "knots", "strips", "cells")
"""Head of the table: speed (m/s), creep law, FASTSIM's middle; counts of the wheel's nodes, of the rail's knots, of
strips and of cells. Then WHEELS, PROFILE_COUNTS, nodes, knots, and FASTSIM's strips and cells."""
HEAD_SIZE, WHEELS_SIZE, PROFILE_SIZE, NODE_SIZE, KNOT_SIZE = (
    size_of(kind) for kind in (TABLE_HEAD, WHEELS_RECORD, PROFILE_COUNTS, WHEEL_NODE_RECORD, RAIL_KNOT_RECORD)
)
PER_STRIP, PER_CELL = 4, 5
"""Count of numbers of a strip and of a cell, see ``fastsim_grid``."""
_POSITIONS, _RATES = [Y, Z, YAW, ROLL, ANGLE], [Y_RATE, Z_RATE, YAW_RATE, ROLL_RATE, SPIN]


def joint_force_table(speed: float, rails: RailsAndWheels) -> Array:
    """Table of the numbers that the compiled joint forces of a wheelset read."""
    strips, cells, (profile, nodes, knots) = rails.strips, rails.cells, rails.profile
    head = [speed, rails.law, rails.middle, nodes.size, knots.size, strips.shape[1], cells.shape[1]]
    parts = (rails.wheels, profile, nodes, knots)
    return np.concatenate((head, *(record_part.view(float) for record_part in parts), strips.ravel(), cells.ravel()))


@inlined
def rails_from_table(table_pointer):
    """``RailsAndWheels`` as views of the table at a pointer to doubles."""
    head = records_at_pointer(table_pointer, 1, TABLE_HEAD)[0]
    nodes, knots, strips, cells = int(head.nodes), int(head.knots), int(head.strips), int(head.cells)
    wheels = beyond(table_pointer, HEAD_SIZE)
    profile = beyond(wheels, WHEELS_SIZE)
    first_node = beyond(profile, PROFILE_SIZE)
    first_knot = beyond(first_node, NODE_SIZE * nodes)
    first_strip = beyond(first_knot, KNOT_SIZE * knots)
    first_cell = beyond(first_strip, PER_STRIP * strips)
    return RailsAndWheels(
        records_at_pointer(wheels, 1, WHEELS_RECORD),
        LaidProfile(
            records_at_pointer(profile, 1, PROFILE_COUNTS),
            records_at_pointer(first_node, nodes, WHEEL_NODE_RECORD),
            records_at_pointer(first_knot, knots, RAIL_KNOT_RECORD),
        ),
        array(first_strip, (PER_STRIP, strips)),
        array(first_cell, (PER_CELL, cells)),
        head.middle,
        int(head.law),
    )


def joints_from_states(wheelset_states: Array) -> Array:
    """Joint positions and rates (..., 10) from a wheelset's states (..., 10)."""
    of_joints = wheelset_states[..., _POSITIONS + _RATES]
    of_joints[..., -1] -= wheelset_states[..., YAW_RATE] * np.sin(wheelset_states[..., ROLL])
    return of_joints


def states_from_joints(joint_states: Array) -> Array:
    """States (..., 10) of a wheelset from joint positions and rates (..., 10)."""
    states = np.empty(joint_states.shape)
    states[..., _POSITIONS + _RATES] = joint_states
    states[..., SPIN] += states[..., YAW_RATE] * np.sin(states[..., ROLL])
    return states


def state_rates(joint_states: Array, joint_accelerations: Array) -> Array:
    """Time derivative (10,) of a wheelset's state, from positions and rates (10,) and accelerations (5,) of the
    joints."""
    state_rate = np.empty(STATE_COUNT)
    state_rate[_POSITIONS], state_rate[_RATES] = joint_states[JOINTS:], joint_accelerations
    roll, yaw_rate, roll_rate = joint_states[3], joint_states[JOINTS + 2], joint_states[JOINTS + 3]
    state_rate[SPIN] += joint_accelerations[2] * math.sin(roll) + yaw_rate * roll_rate * math.cos(roll)
    return state_rate


@njit(cache=True, error_model="numpy")
def joint_forces(table_pointer, t, q, v, forces_out):
    """Add the rails' forces on the joints (N, N m) to ``forces_out`` (5,). For callbacks: all arguments but the time
    are pointers to doubles.

    The forces are NaN where the wheelset has left the track, because engines do not check before they continue.
    """
    rails, speed = rails_from_table(table_pointer), records_at_pointer(table_pointer, 1, TABLE_HEAD)[0].speed
    y, z, yaw, roll, _ = array(q, (JOINTS,))
    y_rate, z_rate, yaw_rate, roll_rate, spin = array(v, (JOINTS,))
    joint_forces_view = array(forces_out, (JOINTS,))
    if not abs(y) + abs(z) + abs(yaw) + abs(roll) < DERAILED_LIMIT:
        joint_forces_view[:] = np.nan
        return
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    axle_x, axle_y, axle_z = -sy * cr, cy * cr, sr
    room = workspace_for(rails.profile)
    wheelset = room.wheelset[0]
    force, moment, velocity, turning = wheelset.force, wheelset.moment, wheelset.velocity, wheelset.turning
    velocity[0], velocity[1], velocity[2] = speed, y_rate, z_rate
    turning[0], turning[1] = cy * roll_rate + axle_x * spin, sy * roll_rate + axle_y * spin
    turning[2] = yaw_rate + axle_z * spin
    for k in range(3):
        force[k] = moment[k] = 0.0
    fill_wheel_forces(WheelPose(y, z, roll, yaw), rails, np.empty(0, REPORT_RECORD), room)
    joint_forces_view[0] += force[1]
    joint_forces_view[1] += force[2]
    joint_forces_view[2] += moment[2]
    joint_forces_view[3] += cy * moment[0] + sy * moment[1]
    joint_forces_view[4] += axle_x * moment[0] + axle_y * moment[1] + axle_z * moment[2]


@njit(cache=True, error_model="numpy")
def set_joint_forces(memory_block, t, coordinate_count):
    """Set ``f`` to the forces of ``joint_forces``. All data lie in one block of doubles at a memory address: f, q and v
    (n,), then the table."""
    f = at(memory_block)
    array(f, (coordinate_count,))[:] = 0.0
    joint_forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)
