"""What happens inside a contact area, cell by cell, and FASTSIM's cells: its march with nothing summed up."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from models.contact.fastsim import KINDS, MARCHES, Flexibilities, March, check_choices, contacts_of
from models.contact.fastsim_grid import Bound, grid, strips_of
from models.contact.fastsim_kernels import BEFORE, BOUND, CENTRE, MIDDLE, PLAIN, RATE, advance, cut
from models.contact.fastsim_many import HALF, PER_SLIP, SPREAD, A, B, Y, rigid_slip
from models.contact.inputs import Array
from models.contact.material import Falling, Pair
from models.core.errors import InputError
from models.machine.compiled import compiled


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
    relative = np.zeros((3, y.size, cells))
    if falling is None:
        for strip in range(y.size):
            _strip(contact, net.strips[:, strip], net.cells, slip, MARCHES[march], relative[:, strip])
    else:
        from models.contact.fastsim_falling import strip_falling

        for strip in range(y.size):
            strip_falling(contact, net.strips[:, strip], net.cells, slip, *falling.law, relative[:, strip])
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


@compiled
def _strip(own: Any, strip: Any, cells: Any, slip: Any, march: int, found: Any) -> None:
    """Traction by the bound in the strip's middle, along x and y, and slip or not, in ``found`` (3, cells)."""
    half, spread = strip[HALF], strip[SPREAD]
    u, v0 = spread * (slip[0] - slip[2] * own[B] * strip[Y]), spread * slip[1]
    v1 = spread * slip[2] * own[A] * half
    x = y = slips = 0.0
    for i in range(cells.shape[1]):
        if march == PLAIN:
            x, y, slips = cut(x - u, y - v0 - v1 * cells[CENTRE, i], cells[BOUND, i])
        elif i == 0:
            x, y, slips = cut(-0.5 * u, -0.5 * (v0 + v1 * cells[MIDDLE, 0]), cells[BOUND, 0])
        else:
            x, y, slips = advance(
                x,
                y,
                slips,
                u,
                v0 + v1 * cells[MIDDLE, i],
                -2.0 / cells.shape[1] * v1,
                cells[BOUND, i],
                cells[BEFORE, i],
                cells[RATE, i],
            )
        found[0, i], found[1, i], found[2, i] = x, y, slips
