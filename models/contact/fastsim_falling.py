"""FASTSIM with friction that falls with the speed of slip: kernels of its own, so that constant friction pays nothing.

Friction is taken at the rigid slip of the point: exact where all slides, and no loop in which slip and friction chase
one another, which would have more than one end. A sticking cell is asked for less than it could hold.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import CENTRE, MIDDLE, SECOND_ORDER
from models.contact.fastsim_many import (
    HALF,
    LOAD,
    MU,
    PART,
    PER_SLIP,
    SPIN,
    XI_X,
    XI_Y,
    A,
    B,
    Y,
    rigid_slip,
    strip_tractions,
    touches,
)
from models.machine.compiled import compiled


@compiled
def forces_falling(contacts, strips, cells, middle, kind, floor, decay, answers):
    """As ``fastsim_many.forces`` with the second-order march, and friction that falls."""
    n, m = cells.shape[1], strips.shape[1]
    slip, left, tractions = np.empty(PER_SLIP), np.empty((2, n)), np.empty((3, n))
    area = 0.0
    for s in range(m):
        area += strips[HALF, s]
    for c in range(len(contacts)):
        contact = contacts[c]
        answers[c] = 0.0
        if not touches(contact):
            continue
        rigid_slip(contact, n, middle, kind, slip)
        limit = contact[MU] * contact[LOAD]
        for s in range(m):
            friction_left(contact, strips[:, s], cells, floor, decay, left)
            strip_tractions(contact, strips[:, s], cells, slip, SECOND_ORDER, left, tractions)
            x = y = turn = stuck = 0.0
            for i in range(n):
                x += tractions[0, i]
                y += tractions[1, i]
                turn += cells[CENTRE, i] * tractions[1, i]
                stuck += 1.0 - tractions[2, i]
            part, half = limit * strips[PART, s], strips[HALF, s]
            answers[c, 0] += part * x
            answers[c, 1] += part * y
            answers[c, 2] += part * (contact[A] * half * turn - contact[B] * strips[Y, s] * x)
            answers[c, 3] += half * stuck / (n * area)


@compiled
def friction_left(contact, strip, cells, floor, decay, left):
    """Fill ``left`` (2, cells) as ``strip_tractions`` reads it: at the rigid slip of the points."""
    along = contact[XI_X] - contact[SPIN] * contact[B] * strip[Y]
    across, turn = contact[XI_Y], contact[SPIN] * contact[A] * strip[HALF]
    for i in range(cells.shape[1]):
        left[0, i] = _left(along, across + turn * cells[CENTRE, i], floor, decay)
        left[1, i] = _left(along, across + turn * cells[MIDDLE, i], floor, decay)


@compiled
def _left(along, across, floor, decay):
    """Share of the friction that is left at a slip."""
    return floor + (1.0 - floor) * math.exp(-decay * math.sqrt(along * along + across * across))
