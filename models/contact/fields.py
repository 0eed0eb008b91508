"""What happens inside a contact area, cell by cell."""

from dataclasses import dataclass

from models.contact.inputs import Array


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
