"""FASTSIM with friction that falls with the speed of slip: kernels of its own, so that constant friction pays nothing.

Friction is taken at the rigid slip of the point: exact where all slides, and no loop in which slip and friction chase
one another, which would have more than one end. A sticking cell is asked for less than it could hold.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import BEFORE, BOUND, CENTRE, MIDDLE, RATE, advance, cut
from models.contact.fastsim_many import (
    HALF,
    LOAD,
    MU,
    PART,
    PER_SLIP,
    SPIN,
    SPREAD,
    XI_X,
    XI_Y,
    A,
    B,
    Y,
    rigid_slip,
    touches,
)
from models.machine.compiled import compiled


@compiled
def forces_falling(contacts, strips, cells, middle, kind, floor, decay, answers):
    """As ``fastsim_many.forces`` with the second-order march, and friction that falls."""
    n, m = cells.shape[1], strips.shape[1]
    slip, tractions = np.empty(PER_SLIP), np.empty((3, n))
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
            strip_falling(contact, strips[:, s], cells, slip, floor, decay, tractions)
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
def strip_falling(contact, strip, cells, slip, floor, decay, answers):
    """Tractions by the bound in the strip's middle, along x and y, and slip or not, in ``answers`` (3, cells)."""
    y, half, spread = strip[Y], strip[HALF], strip[SPREAD]
    u, v0 = spread * (slip[0] - slip[2] * contact[B] * y), spread * slip[1]
    v1 = spread * slip[2] * contact[A] * half
    along, across, turn = (
        contact[XI_X] - contact[SPIN] * contact[B] * y,
        contact[XI_Y],
        contact[SPIN] * contact[A] * half,
    )
    change, last = -2.0 / cells.shape[1], 0.0
    px = py = slips = 0.0
    for i in range(cells.shape[1]):
        v = v0 + v1 * cells[MIDDLE, i]
        here = _left(along, across + turn * cells[CENTRE, i], floor, decay)
        middle = _left(along, across + turn * cells[MIDDLE, i], floor, decay)
        g = here * cells[BOUND, i]
        if i == 0:
            px, py, slips = cut(-0.5 * u, -0.5 * v, g)
        else:
            rate = cells[RATE, i] / middle
            px, py, slips = advance(px, py, slips, u, v, v1 * change, g, last * cells[BEFORE, i], rate)
        last = here
        answers[0, i], answers[1, i], answers[2, i] = px, py, slips


@compiled
def _left(along, across, floor, decay):
    """Share of the friction that is left at a slip."""
    return floor + (1.0 - floor) * math.exp(-decay * math.sqrt(along * along + across * across))
