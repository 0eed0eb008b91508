"""FASTSIM's grid of cells on an ellipse of semi-axes 1: strips with exact ends, and the traction bound normalised to
the load.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from models.contact.fastsim_records import GridStrips, StripCells
from models.contact.inputs import Array

BoundShape = Literal["intermediate", "parabolic", "elliptic"]
POWERS: dict[BoundShape, float] = {"intermediate": 0.75, "parabolic": 1.0, "elliptic": 0.5}
"""Powers of 1 - (x/a)^2 - (y/b)^2 in the traction bound; the first is calibrated on 1120 contacts of the exact theory:
its forces are as near as with 0.8 and its moments a sixth nearer.
"""
STRIPS_PER_CELL_LIMIT = 3
"""Largest ratio of the number of strips to the number of cells along a strip."""
ROUNDING_FACTOR = 1.0 + 2e-15
"""Factor on a bound that covers rounding: a traction's component along a unit vector stays below the enlarged bound."""


@dataclass(frozen=True, eq=False)
class FastsimGrid:
    """FASTSIM's grid of one ellipse in dimensionless form, as tables of doubles.

    strips : (4, strips), rows as the fields of ``GridStrips``
    cells : (5, cells), rows as the fields of ``StripCells``
    middle : pressure in the middle of the ellipse times a b / N
    """

    strips: Array
    cells: Array
    middle: float

    @property
    def records(self) -> tuple[GridStrips, StripCells]:
        """Strips and cells of the grid as records with named fields."""
        y, half, spread, part = self.strips
        centre, bound, middle, before, rate = self.cells
        return GridStrips(y, half, spread, part), StripCells(centre, bound, middle, before, rate, self.middle)


def count_of_strips(axis_ratios: Array, cell_count: int) -> Array:
    """Number of strips of a grid with ``cell_count`` cells per strip, for ellipses of a/b = ``axis_ratios``: even, and
    at least ``cell_count``.

    Under spin the traction turns about a pole, within a distance of a: strips of a narrow ellipse must not be wider.
    An even number, because a strip through the pole of pure spin would stand for both its sides.
    """
    wanted = cell_count * np.clip((0.5 / axis_ratios) ** 0.6, 1.0, STRIPS_PER_CELL_LIMIT)
    return 2 * np.ceil(wanted / 2.0 - 1e-9).astype(int)


def grids_of_ratios(
    axis_ratios: Array, cell_count: int, bound_shape: BoundShape
) -> Iterator[tuple[Array, FastsimGrid]]:
    """Pairs of indices and grid: the contacts among axis ratios a/b = ``axis_ratios`` (n,) that share a grid, and that
    grid.
    """
    strips = count_of_strips(axis_ratios, cell_count)
    for count in np.unique(strips):
        yield np.flatnonzero(strips == count), ellipse_grid(cell_count, int(count), bound_shape)


@lru_cache(maxsize=256)
def ellipse_grid(cell_count: int, strip_count: int, bound_shape: BoundShape) -> FastsimGrid:
    """FASTSIM's grid of ``strip_count`` strips of equal width with ``cell_count`` cells each; cells of a strip have
    equal lengths.

    Pressure is sampled at the cells' centres and scaled so that its sum over all cells is the load exactly.
    """
    y = (strip_count - 1.0 - 2.0 * np.arange(strip_count)) / strip_count  # mirrored in y to the last digit
    half = np.sqrt((1.0 - y) * (1.0 + y))
    edges = np.linspace(1.0, -1.0, cell_count + 1)
    centre = (edges[:-1] + edges[1:]) / 2.0
    middle = np.append((1.0 + centre[0]) / 2.0, edges[1:-1])
    across, height = _bounding_pressure(y, bound_shape), _bounding_pressure(centre, bound_shape)
    before = np.append(0.0, height[:-1]) * ROUNDING_FACTOR
    along = np.array([centre, height, middle, before, 0.125 / _bounding_pressure(middle, bound_shape)])
    share = across * half
    carried = share.sum() * height.sum()
    return FastsimGrid(
        np.array([y, half, half / across, share / carried]), along, cell_count * strip_count / (4.0 * carried)
    )


def _bounding_pressure(position: Array, bound_shape: BoundShape) -> Array:
    """Ratio of the pressure that bounds the traction, at the distance ``position`` from the centre (in semi-axes), to
    that in the centre.
    """
    return ((1.0 - position) * (1.0 + position)) ** POWERS[bound_shape]
