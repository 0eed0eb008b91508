"""What happens inside a contact area, cell by cell."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Fields:
    """Pressure and tractions in the cells of one contact area; every array has one and the same shape.

    x, y : centres of the cells (m). dx, dy : their sizes (m). pressure, px, py : Pa, tractions on the wheel.
    slips : whether the cell slips. inside : whether it belongs to the contact area.
    """

    x: np.ndarray
    y: np.ndarray
    dx: np.ndarray
    dy: np.ndarray
    pressure: np.ndarray
    px: np.ndarray
    py: np.ndarray
    slips: np.ndarray
    inside: np.ndarray
