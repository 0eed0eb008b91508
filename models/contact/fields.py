"""Fields of pressure, traction and slip inside a contact area, cell by cell."""

from dataclasses import dataclass

import numpy as np

from models.contact.fastsim import (
    FLEXIBILITY_KINDS,
    MARCH_KINDS,
    FlexibilityChoice,
    MarchChoice,
    RollingEllipse,
    check_fastsim_choices,
    contact_records,
)
from models.contact.fastsim_grid import BoundShape, count_of_strips, ellipse_grid
from models.contact.fastsim_many import rigid_slip, strip_slip, strip_tractions
from models.contact.fastsim_records import SLIP
from models.contact.inputs import Array
from models.contact.material import FallingFriction, MaterialPair
from models.core.errors import InputError


@dataclass(frozen=True)
class ContactFields:
    """Pressure and tractions in the cells of one contact area; all arrays have the same shape.

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
    ellipse: RollingEllipse,
    material_pair: MaterialPair,
    *,
    cells: int = 21,
    bound: BoundShape = "intermediate",
    flexibilities: FlexibilityChoice = "blended",
    march: MarchChoice = "second-order",
    falling: FallingFriction | None = None,
) -> ContactFields:
    """Pressure, traction and slip in the cells of one ellipse (inputs are plain numbers), as ``fastsim`` computes them.

    Arrays of the shape (strips, cells in a strip), each strip from its leading edge back. The pressure is that of the
    bound: Hertz's only if it is elliptic. Raises InputError as ``fastsim`` does.
    """
    check_fastsim_choices(cells, bound, flexibilities, march, falling)
    contacts, shape = contact_records(ellipse, material_pair)
    if shape:
        raise InputError("", "a, b, load, mu, xi_x, xi_y, spin", list(shape), "must be plain numbers: one ellipse")
    contact = contacts[0]
    a, b = contact["a"], contact["b"]
    net = ellipse_grid(cells, int(count_of_strips(a / b, cells)), bound)
    strips, along = net.records
    slip = np.array([rigid_slip(contact, along, FLEXIBILITY_KINDS[flexibilities])], SLIP)[0]
    y, half, spread = (row[:, None] for row in (strips.y, strips.half, strips.spread))
    relative, friction_shares = np.zeros((3, y.size, cells)), np.ones((2, cells))
    if falling is not None:
        from models.contact.fastsim_falling import fill_friction_shares
    for k in range(y.size):
        if falling is not None:
            fill_friction_shares(contact, strips, k, along, falling.law, friction_shares)
        strip_tractions(
            strip_slip(contact, strips, k, slip), along, MARCH_KINDS[march], friction_shares, relative[:, k]
        )
    peak = max(contact["load"], 0.0) * net.middle / (a * b) * half / spread
    scale, ones = contact["mu"] * peak, np.ones((y.size, cells))
    return ContactFields(
        a * half * along.centre,
        b * y * ones,
        2 * a * half / cells * ones,
        2 * b / y.size * ones,
        peak * along.bound,
        scale * relative[0],
        scale * relative[1],
        relative[2] > 0,
        ones * peak > 0,
    )
