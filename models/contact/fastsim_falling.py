"""FASTSIM with friction that falls with the speed of slip, in separate compiled functions, so that constant friction
costs no more.

Friction is taken at the rigid slip of the point: exact where all slides, and no loop in which slip and friction chase
one another, which would have more than one end. A sticking cell is asked for less than it could hold.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import SECOND_ORDER
from models.contact.fastsim_many import add_strip, rigid_slip, strip_slip, strip_tractions, touches
from models.contact.fastsim_records import SLIP
from models.machine.compiled import compiled


@compiled
def forces_falling(contacts, strips, cells, kind, law, answers):
    """Fill FASTSIM's forces of many contacts, FORCES (n,), by the second-order march with falling friction; law : of
    ``Falling``.
    """
    n, area, slip = cells.centre.size, 0.0, np.empty(1, SLIP)[0]
    friction_shares, tractions = np.empty((2, n)), np.empty((3, n))
    for s in range(strips.y.size):
        area += strips.half[s]
    for c in range(len(contacts)):
        contact, answer = contacts[c], answers[c]
        answer.fx = answer.fy = answer.mz = answer.stick = 0.0
        if not touches(contact):
            continue
        slip.x, slip.y, slip.spin = rigid_slip(contact, cells, kind)
        for s in range(strips.y.size):
            fill_friction_shares(contact, strips, s, cells, law, friction_shares)
            strip_tractions(strip_slip(contact, strips, s, slip), cells, SECOND_ORDER, friction_shares, tractions)
            x = y = turn = stuck = 0.0
            for i in range(n):
                x += tractions[0, i]
                y += tractions[1, i]
                turn += cells.centre[i] * tractions[1, i]
                stuck += 1.0 - tractions[2, i]
            add_strip(contact, strips, s, (x, y, turn), answer)
            answer.stick += strips.half[s] * stuck / (n * area)


@compiled
def fill_friction_shares(contact, strips, s, cells, law, friction_shares):
    """Fill ``friction_shares`` (2, cells) of strip s with the remaining share of friction at each point's rigid slip,
    as ``strip_tractions`` expects it.
    """
    along = contact.xi_x - contact.spin * contact.b * strips.y[s]
    across, turn = contact.xi_y, contact.spin * contact.a * strips.half[s]
    for i in range(cells.centre.size):
        friction_shares[0, i] = _friction_share(along, across + turn * cells.centre[i], law)
        friction_shares[1, i] = _friction_share(along, across + turn * cells.middle[i], law)


@compiled
def _friction_share(along, across, law):
    """Ratio of the friction coefficient at a slip (along, across) to the coefficient without slip."""
    floor, decay = law
    return floor + (1.0 - floor) * math.exp(-decay * math.sqrt(along * along + across * across))
