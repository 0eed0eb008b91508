"""Compiled forces of springs between the ground and a body on a chain of joints, as generalised forces of the joints.

For engines: all arguments but the time are pointers to doubles, see ``models.engines.free_vehicle``. The table is a
head (numbers of joints and springs), the joints as in ``models.multibody.cut_mechanics``, then the springs.
"""

import math

import numpy as np

from models.machine.compiled import compiled
from models.machine.stack import array, at, beyond, doubles
from models.multibody.cut_mechanics import (
    PER_JOINT,
    PER_MOTION,
    ROTATES,
    add_wrench,
    joint_velocity,
    move_bodies,
    point_position,
)
from models.multibody.tree import dot, plus, three_from, times
from models.vehicles.free_vehicle import joint_table, last_coordinate_and_joint
from models.vehicles.spatial import FREEDOMS, SpatialVehicle
from validation.adams_joints.mechanism import Spring

HEAD_NUMBERS, NUMBERS_PER_SPRING = 2, 10
COORDINATE, STIFFNESS, DAMPING, FREE_LENGTH, GROUND, ARM = 0, 1, 2, 3, 4, 7
"""Positions in a spring's row: number of the joint coordinate on which it acts (-1: it acts between two points),
stiffness (N/m), damping (N s/m), free length (m), its point on the ground (m), its point on the body relative to the
last joint (m)."""
_NONE = (0.0, 0.0, 0.0)


def spring_table(vehicle: SpatialVehicle, springs: list[Spring]) -> np.ndarray:
    """Parameters of the springs and of the chain of joints as one array for ``spring_forces``. The springs' points are
    in the vehicle's axes; a torsion spring acts on the last coordinate."""
    chain = joint_table(vehicle)
    kinds = chain[:, 0].astype(int)
    rows = np.column_stack([chain[:, 1], kinds >= FREEDOMS.index("rx"), kinds % 3, chain[:, 2:]])
    last_body, origin = last_coordinate_and_joint(vehicle, vehicle.bodies[-1].name)
    laws = [
        [
            last_body if spring.is_rotational else -1,
            spring.stiffness,
            spring.damping,
            spring.free_length,
            *spring.ground_point,
            *(spring.body_point - origin),
        ]
        for spring in springs
    ]
    return np.concatenate([[len(rows), len(laws)], rows.ravel(), np.array(laws).ravel()])


@compiled
def spring_forces(parameter_table, t, q, v, force_sum):
    """Add the springs' generalised forces (N, N m) to ``force_sum`` (n,), at joint coordinates q and rates v (n,)."""
    head = array(parameter_table, (HEAD_NUMBERS,))
    n, count = int(head[0]), int(head[1])
    if count == 0:
        return
    chain = array(beyond(parameter_table, HEAD_NUMBERS), (n, PER_JOINT))
    springs = array(beyond(parameter_table, HEAD_NUMBERS + n * PER_JOINT), (count, NUMBERS_PER_SPRING))
    joint_positions, rate, force_view = array(q, (n,)), array(v, (n,)), array(force_sum, (n,))
    m = array(doubles((n + 1) * PER_MOTION), (n + 1, PER_MOTION))
    move_bodies(chain, joint_positions, rate, m)
    for i in range(count):
        law = springs[i]
        j = int(law[COORDINATE])
        if j >= 0:
            force_view[j] -= law[STIFFNESS] * (joint_positions[j] - law[FREE_LENGTH]) + law[DAMPING] * rate[j]
            continue
        tip = point_position(m[n], springs[i], ARM)
        offset = plus(tip, times(three_from(law, GROUND), -1.0))
        length = math.sqrt(dot(offset, offset))
        if length == 0.0:  # no line, hence no force along it
            continue
        direction, speed = times(offset, 1.0 / length), 0.0
        for k in range(n):
            speed += dot(direction, joint_velocity(chain[k, ROTATES], m[k + 1], tip)) * rate[k]
        push = -law[STIFFNESS] * (length - law[FREE_LENGTH]) - law[DAMPING] * speed
        add_wrench(chain, m, n - 1, tip, times(direction, push), _NONE, force_view)


@compiled
def set_spring_forces(block_address, t, coordinate_count):
    """Set the generalised forces of the springs in a block of doubles at an address: forces, coordinates and rates
    (n,), then the parameter table."""
    f = at(block_address)
    array(f, (coordinate_count,))[:] = 0.0
    spring_forces(beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f)
