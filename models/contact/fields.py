"""What happens inside a contact area, cell by cell, and FASTSIM's cells: its march with nothing summed up."""

from dataclasses import dataclass

import numpy as np

from models.contact.fastsim import KINDS, MARCHES, Flexibilities, March, check_choices, contacts_of
from models.contact.fastsim_grid import Bound, grid, strips_of
from models.contact.fastsim_kernels import BOUND, CENTRE
from models.contact.fastsim_many import HALF, PER_SLIP, SPREAD, A, B, Y, rigid_slip, strip_tractions
from models.contact.inputs import Array
from models.contact.material import Falling, Pair
from models.core.errors import InputError


@dataclass(frozen=True)
class Fields:
    """Pressure and tractions in the cells of one contact area; every array has one and the same shape.

    x, y : centres of the cells (m). dx, dy : their sizes (m). pressure, px, py : Pa, tractions on the wheel.
    slips : whether the cell slips. inside : whether it belongs to the contact area.
    """

    x: Array
    y: Array
    dx: Array
    dy: Array
    pressure: Array
    px: Array
    py: Array
    slips: Array
    inside: Array


def fastsim_fields(
    a: float,
    b: float,
    load: float,
    mu: float,
    xi_x: float,
    xi_y: float,
    spin: float,
    pair: Pair,
    *,
    cells: int = 21,
    bound: Bound = "intermediate",
    flexibilities: Flexibilities = "blended",
    march: March = "second-order",
    falling: Falling | None = None,
) -> Fields:
    """Pressure, traction and slip of one ellipse, plain numbers, as ``fastsim`` marches them.

    Arrays of the shape (strips, cells in a strip), each strip from its leading edge back. The pressure is that of the
    bound: Hertz's only if it is elliptic. Raises InputError as ``fastsim`` does.
    """
    check_choices(cells, bound, flexibilities, march, falling)
    contacts, shape = contacts_of(a, b, load, mu, xi_x, xi_y, spin, pair)
    if shape:
        raise InputError("", "a, b, load, mu, xi_x, xi_y, spin", list(shape), "must be plain numbers: one ellipse")
    contact = contacts[0]
    net = grid(cells, int(strips_of(contact[A] / contact[B], cells)), bound)
    slip = np.zeros(PER_SLIP)
    rigid_slip(contact, cells, net.middle, KINDS[flexibilities], slip)
    y, half, spread = (net.strips[row][:, None] for row in (Y, HALF, SPREAD))
    relative, left = np.zeros((3, y.size, cells)), np.ones((2, cells))
    if falling is not None:
        from models.contact.fastsim_falling import friction_left
    for k, strip in enumerate(net.strips.T):
        if falling is not None:
            friction_left(contact, strip, net.cells, *falling.law, left)
        strip_tractions(contact, strip, net.cells, slip, MARCHES[march], left, relative[:, k])
    peak = max(load, 0.0) * net.middle / (contact[A] * contact[B]) * half / spread
    scale, shape = mu * peak, (y.size, cells)
    whole = np.ones(shape)
    return Fields(
        contact[A] * half * net.cells[CENTRE],
        contact[B] * y * whole,
        2 * contact[A] * half / cells * whole,
        2 * contact[B] / y.size * whole,
        peak * net.cells[BOUND],
        scale * relative[0],
        scale * relative[1],
        relative[2] > 0,
        whole * peak > 0,
    )
