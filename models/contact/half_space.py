"""Displacements of two elastic half-spaces under tractions that are constant on each cell of a regular grid.

Boussinesq and Cerruti (Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6; Kalker, Three-Dimensional Elastic Bodies
in Rolling Contact, 1990, section 4.2): a traction p on body 1 and -p on body 2 displaces body 1 relative to body 2 by

    u_i(x, y) = sum over cells of A_ij(x - x', y - y') p_j,

with A in closed form below. Far from its cell an influence number falls as 1/distance, so a sum over a whole grid is a
convolution, done by the fast Fourier transform on a grid padded with zeros to twice its size: exact but for rounding.
"""

import numpy as np
from scipy import fft

from models.contact.inputs import Array
from models.contact.material import MaterialPair

X, Y, Z = 0, 1, 2
"""Indices of the axes in the results of ``influence_of_rectangle``."""


def influence_of_rectangle(x: Array, y: Array, dx: float, dy: float, material_pair: MaterialPair) -> Array:
    """Relative displacement (m) of the two bodies at a point, caused by a unit traction (1 Pa) on a rectangle dx by dy
    (m).

    x, y : (...) coordinates of the point from the rectangle's centre (m), broadcast against each other.
    Returns (..., 3, 3): [i, j] is the displacement of body 1 relative to body 2 along i by a traction along j that acts
    on body 1 and with opposite sign on body 2; along z both are counted into their own body, so that pressure
    and approach are positive. ``material_pair.mismatch`` (Kalker's K) couples z with x and y; it is zero for equal
    bodies.
    """
    primitives = sum(
        sign_x * sign_y * _corner_integrals(x + sign_x * dx / 2, y + sign_y * dy / 2)
        for sign_x in (1, -1)
        for sign_y in (1, -1)
    )
    x_part, y_part, cross, x_slope, y_slope = np.moveaxis(np.asarray(primitives), -1, 0)
    nu, mismatch = material_pair.nu, material_pair.mismatch
    numbers = np.array(
        [
            [(1 - nu) * x_part + y_part, nu * cross, -mismatch * x_slope],
            [nu * cross, x_part + (1 - nu) * y_part, -mismatch * y_slope],
            [mismatch * x_slope, mismatch * y_slope, (1 - nu) * (x_part + y_part)],
        ]
    ) / (np.pi * material_pair.G)
    return np.moveaxis(numbers, (0, 1), (-2, -1))


def _corner_integrals(x: Array, y: Array) -> Array:
    """Integrals from the origin to (x, y) of y^2/r^3, x^2/r^3, xy/r^3, x/r^2 and y/r^2, (..., 5).

    Terms that depend on x alone or on y alone are left out: they cancel between the corners.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    r = np.hypot(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(x == 0, 0.0, x * np.arcsinh(y / np.abs(x)))
        across = np.where(y == 0, 0.0, y * np.arcsinh(x / np.abs(y)))
        logarithm = np.where(r == 0, 0.0, np.log(r))
    angle_x, angle_y = np.where(x == 0, 0.0, x * _arc_tangent(y, x)), np.where(y == 0, 0.0, y * _arc_tangent(x, y))
    return np.stack([along, across, -r, y * logarithm + angle_x, x * logarithm + angle_y], axis=-1)


def _arc_tangent(opposite: Array, adjacent: Array) -> Array:
    """Arc tangent (rad) of opposite / adjacent; pi/2 where adjacent is zero."""
    return np.arctan2(opposite * np.sign(adjacent), np.abs(adjacent))


class CellConvolution:
    """Sum over all cells of kernel times values, for a kernel known at every offset between two cells.

    kernel : (2 ny - 1, 2 nx - 1, out, in), offset zero in its centre.
    """

    def __init__(self, kernel: Array) -> None:
        self.cells = ((kernel.shape[0] + 1) // 2, (kernel.shape[1] + 1) // 2)
        self._size = tuple(fft.next_fast_len(n, real=True) for n in kernel.shape[:2])
        shifted = np.zeros((*self._size, *kernel.shape[2:]))
        shifted[: kernel.shape[0], : kernel.shape[1]] = kernel
        shifted = np.roll(shifted, (1 - self.cells[0], 1 - self.cells[1]), axis=(0, 1))
        self._spectrum = fft.rfft2(np.moveaxis(shifted, (0, 1), (-2, -1)), workers=1)

    def __call__(self, cell_values: Array) -> Array:
        """Sums (ny, nx, out) over all cells of kernel times values (ny, nx, in)."""
        spectrum = fft.rfft2(np.moveaxis(cell_values, -1, 0), self._size, workers=1)
        sums = fft.irfft2(np.einsum("ijyx,jyx->iyx", self._spectrum, spectrum), self._size, workers=1)
        return np.moveaxis(sums[:, : self.cells[0], : self.cells[1]], 0, -1)


def cell_offsets(cell_count: int, cell_size: float) -> Array:
    """All differences (m) between the centres of two cells in a row of ``cell_count`` cells of length ``cell_size``
    (m): (2 cells - 1,), ascending.
    """
    return np.arange(1 - cell_count, cell_count) * cell_size
