"""FASTSIM with friction that falls with the speed of slip, in separate compiled functions, so that constant friction
costs no more.

Friction is taken at the rigid slip of the point: exact where all slides, and no loop in which slip and friction chase
one another, which would have more than one end. A sticking cell is asked for less than it could hold.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import SECOND_ORDER
from models.contact.fastsim_many import add_strip, rigid_slip, strip_slip, strip_tractions, transmits_force
from models.contact.fastsim_records import SLIP
from models.machine.compiled import compiled


@compiled
def fill_forces_with_falling_friction(contacts, grid_strips, strip_cells, flexibility_kind, friction_law, forces_out):
    """Fill FASTSIM's forces of many contacts, FORCES (n,), by the second-order march with falling friction;
    friction_law : of ``FallingFriction``.
    """
    n, area, slip = strip_cells.centre.size, 0.0, np.empty(1, SLIP)[0]
    friction_shares, tractions = np.empty((2, n)), np.empty((3, n))
    for s in range(grid_strips.y.size):
        area += grid_strips.half[s]
    for c in range(len(contacts)):
        contact, answer = contacts[c], forces_out[c]
        answer.fx = answer.fy = answer.mz = answer.stick = 0.0
        if not transmits_force(contact):
            continue
        slip.x, slip.y, slip.spin = rigid_slip(contact, strip_cells, flexibility_kind)
        for s in range(grid_strips.y.size):
            fill_friction_shares(contact, grid_strips, s, strip_cells, friction_law, friction_shares)
            strip_tractions(
                strip_slip(contact, grid_strips, s, slip), strip_cells, SECOND_ORDER, friction_shares, tractions
            )
            x = y = turn = stuck = 0.0
            for i in range(n):
                x += tractions[0, i]
                y += tractions[1, i]
                turn += strip_cells.centre[i] * tractions[1, i]
                stuck += 1.0 - tractions[2, i]
            add_strip(contact, grid_strips, s, (x, y, turn), answer)
            answer.stick += grid_strips.half[s] * stuck / (n * area)


@compiled
def fill_friction_shares(contact, grid_strips, strip_index, strip_cells, friction_law, friction_shares):
    """Fill ``friction_shares`` (2, cells) of strip s with the remaining share of friction at each point's rigid slip,
    as ``strip_tractions`` expects it.
    """
    along = contact.xi_x - contact.spin * contact.b * grid_strips.y[strip_index]
    across, turn = contact.xi_y, contact.spin * contact.a * grid_strips.half[strip_index]
    for i in range(strip_cells.centre.size):
        friction_shares[0, i] = _friction_share(along, across + turn * strip_cells.centre[i], friction_law)
        friction_shares[1, i] = _friction_share(along, across + turn * strip_cells.middle[i], friction_law)


@compiled
def _friction_share(slip_along, slip_across, friction_law):
    """Ratio of the friction coefficient at a slip (along, across) to the coefficient without slip."""
    floor, decay = friction_law
    return floor + (1.0 - floor) * math.exp(-decay * math.sqrt(slip_along * slip_along + slip_across * slip_across))
