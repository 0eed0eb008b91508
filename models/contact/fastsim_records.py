"""Records of FASTSIM's compiled functions: contacts and forces row by row, the grid of cells, the workspace.

Records lie in memory as their fields follow, without gaps: a table of doubles becomes an array of records, or rows of a
net, at no cost.
"""

from typing import NamedTuple

import numpy as np

from models.contact.inputs import Array
from models.machine.compiled import inlined
from models.machine.records import record

LANE_COUNT = 24
"""Number of strips that are marched at the same time; the last ones may be empty."""
CONTACT = record("a", "b", "load", "mu", "xi_x", "xi_y", "spin", "l1", "l2", "l3")
"""Record of one elliptic contact: semi-axes (m), load (N), coefficient of friction, creepages and spin (1/m),
flexibilities (m^3/N) along x, along y and in spin.
"""
FORCES = record("fx", "fy", "mz", "stick")
"""Record of creep forces (N) and moment (N m) on the wheel, and share of the area that sticks."""
SLIP = record("x", "y", "spin")
"""Record of a contact's rigid slip, see ``fastsim_many.rigid_slip``."""
BLOCK = np.dtype(
    [
        (name, np.float64, (LANE_COUNT,))
        for name in ("u", "v0", "v1", "sum_x", "sum_y", "sum_t", "slid", "qx", "qy", "slips")
    ],
    align=True,
)
"""Record of the strips that are marched at the same time: rigid slip of each (``fastsim_kernels``); sums over the cells
of q_x, q_y, t q_y and of slipping cells; the state. One record, as the compiler must know that its lanes do not
overlap.
"""


class GridStrips(NamedTuple):
    """Strips of an ellipse, (m,) each: position y/b, ratio of half length to a, ratio of this to the bound in the
    strip's middle, and share of the load per bound.
    """

    y: Array
    half: Array
    spread: Array
    part: Array


class StripCells(NamedTuple):
    """Cells of a strip, (n,) each, for the step that ends in the cell's centre: position t and bound g there, t in the
    middle of the step, g at its start (enlarged by a rounding), and 1/(8 g) in its middle.

    peak : pressure in the middle of the ellipse times a b / N.
    """

    centre: Array
    bound: Array
    middle: Array
    start_bound: Array
    rate: Array
    peak: float


class MarchWorkspace(NamedTuple):
    """Arrays for intermediate values of a march: one SLIP per contact, and one BLOCK."""

    slips: Array
    blocks: Array


@inlined
def strips_in(strip_table):
    """``GridStrips`` as views of a grid's table (4, m)."""
    return GridStrips(strip_table[0], strip_table[1], strip_table[2], strip_table[3])


@inlined
def cells_in(cell_table, peak_pressure):
    """``StripCells`` as views of a grid's table (5, n)."""
    return StripCells(cell_table[0], cell_table[1], cell_table[2], cell_table[3], cell_table[4], peak_pressure)
