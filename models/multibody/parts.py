"""Compiled forces of springs, dampers and anti-roll bars between points of a free vehicle.

A part's travel is how far its second point lies beyond its first along an axis that the carrier or a towed body has,
and for a bar a share of a coordinate, less what it is at rest; its force draws both together.
"""

import math

import numpy as np

from models.machine.compiled import lean
from models.machine.stack import beyond, row
from models.multibody.tree import (
    PER_LINK,
    PER_SPOT,
    PUSH,
    RATE,
    TURNING,
    TWISTED,
    WHERE,
    add_three,
    cross,
    dot,
    plus,
    three_from,
    times,
    vector_in_carrier_axes,
)
from models.vehicles.spatial import Curve

(
    STIFFNESS,
    DAMPING,
    HELD,
    FRICTION,
    FRICTION_RATE,
    REST,
    ADDED_COORDINATE,
    ADDED_GAIN,
    FIRST_POINT,
    SECOND_POINT,
    AXIS,
    ON_TRAVEL,
    ON_RATE,
    FRAME,
    PER_PART,
) = (*range(11), 13, 14, 15, 16)
"""Indices of the numbers of a spring or bar, as ``SpringDamper`` has them; its travel at rest; a coordinate that adds
to its travel (-1: none), and by how much; its points; its axis; where the table has its curves (0: nowhere), count,
offset, slope, corners and bends; the last coordinate of the body in which its axis is fixed (0: the carrier)."""


@lean
def add_part_forces(parameter_table, first_index, part_count, links, force_points, q, v, generalised_forces):
    """Add the forces of all springs, dampers and bars to the points they act on, or to ``generalised_forces`` for a
    coordinate that adds to a travel. Returns their energy (J) and power (W).

    parameter_table : pointer to the table; first_index, part_count : of the parts there. What keeps a part's axis takes
    up the couple of its two forces: a towed body by its link."""
    energy = power = 0.0
    for i in range(part_count):
        e = row(beyond(parameter_table, first_index), PER_PART, i)
        from_spot, to_spot, axis = (
            row(force_points, PER_SPOT, int(e[FIRST_POINT])),
            row(force_points, PER_SPOT, int(e[SECOND_POINT])),
            three_from(e, AXIS),
        )
        frame, apart = int(e[FRAME]), plus(three_from(to_spot, WHERE), times(three_from(from_spot, WHERE), -1.0))
        if frame > 0:
            axis = vector_in_carrier_axes(row(links, PER_LINK, frame), e, AXIS)
        travel = dot(axis, apart) - e[REST]
        rate = dot(axis, plus(three_from(to_spot, RATE), times(three_from(from_spot, RATE), -1.0)))
        if frame > 0:
            rate += dot(apart, cross(three_from(row(links, PER_LINK, frame), TURNING), axis))
        coordinate = int(e[ADDED_COORDINATE])
        if coordinate >= 0:
            travel, rate = travel + e[ADDED_GAIN] * q[coordinate], rate + e[ADDED_GAIN] * v[coordinate]
        spring, other = e[HELD] + e[STIFFNESS] * travel, e[DAMPING] * rate
        if e[FRICTION] != 0.0:
            other += e[FRICTION] * math.tanh(rate / e[FRICTION_RATE])
        if e[ON_TRAVEL] != 0.0:
            other += curve_force(beyond(parameter_table, int(e[ON_TRAVEL])), travel)
        if e[ON_RATE] != 0.0:
            other += curve_force(beyond(parameter_table, int(e[ON_RATE])), rate)
        energy += (e[HELD] + 0.5 * e[STIFFNESS] * travel) * travel
        power -= other * rate
        if coordinate >= 0:
            generalised_forces[coordinate] -= (spring + other) * e[ADDED_GAIN]
        force = times(axis, spring + other)
        add_three(from_spot, PUSH, force)
        add_three(to_spot, PUSH, times(force, -1.0))
        if frame > 0:
            add_three(row(links, PER_LINK, frame), TWISTED, cross(apart, force))
    return energy, power


@lean
def curve_force(curve_numbers_pointer, travel_or_rate):
    """Force of a piecewise linear curve at an argument. ``curve_numbers_pointer`` points to the curve: count, offset,
    slope, then corners and changes of slope."""
    head = row(curve_numbers_pointer, 3, 0)
    hinges, force = row(curve_numbers_pointer, int(head[0]), 0), head[1] + head[2] * travel_or_rate
    for i in range(3, len(hinges), 2):
        force += hinges[i + 1] * max(travel_or_rate - hinges[i], 0.0)
    return force


def curve_numbers(curve: Curve) -> np.ndarray:
    """Numbers of a piecewise linear force curve, in the order in which ``curve_force`` reads them."""
    offset, slope, corners, bends = curve.hinges()
    pairs = [value for pair in zip(corners, bends, strict=True) for value in pair]
    return np.array([3 + len(pairs), offset, slope, *pairs])
