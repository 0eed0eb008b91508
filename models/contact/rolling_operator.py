"""Slip of a rolling contact as a linear function of its tractions, and Newton's step for cells that stick or slip."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from models.contact.half_space import CellConvolution, Y, cell_offsets, influence_of_rectangle
from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.rolling_kernels import factorise_matrices, orthogonalise, rotate_column, solve_factorised
from models.core.errors import RunFailed

ROLLING_WEIGHTS = (1.5, -2.0, 0.5)
"""Weights of the displacement u at a cell's centre and at the next two upstream in -dx du/dx: of second order, and
dissipative.
"""
SHIFT_WEIGHTS = (1.0,)
"""Weights of the displacement u itself, divided by dx: a shift without rolling."""
INNER_TOLERANCE = 1e-6
"""Relative residual at which the linear solver of one Newton step stops."""
PRODUCT_LIMIT = 300
"""Largest number of matrix products in one Newton step; 20 to 60 are usual."""


class SlipOperator:
    """Linear operator C from tractions (ny, nx, 2), in units of G, to their contribution to the slip (ny, nx, 2):
    -du/dx in rolling, u/dx in a shift.

    The gradient at a cell's centre is taken from there and from the next two centres upstream, where the material
    comes from. The symmetric part of C then has the symbol (1 - cos)^2 times that of the positive definite A.
    """

    def __init__(
        self,
        column_count: int,
        row_count: int,
        dx: float,
        dy: float,
        material_pair: MaterialPair,
        difference_weights: tuple[float, ...] = ROLLING_WEIGHTS,
    ) -> None:
        x, y = cell_offsets(column_count, dx), cell_offsets(row_count, dy)[:, None]
        ahead = np.append(x, x[-1] + dx * np.arange(1, len(difference_weights)))
        displacement = influence_of_rectangle(ahead, y, dx, dy, material_pair)[..., : Y + 1, : Y + 1] * (
            material_pair.G / dx
        )
        parts = [weight * displacement[:, i : i + len(x)] for i, weight in enumerate(difference_weights)]
        self.kernel = np.sum(parts, axis=0)
        self.rows, self.columns = row_count, column_count
        self._convolution = CellConvolution(self.kernel)

    def __call__(self, traction: Array) -> Array:
        """Slip (ny, nx, 2) caused by tractions (ny, nx, 2) in units of G."""
        return self._convolution(traction)

    @cached_property
    def reversed_kernel(self) -> Array:
        """Kernel (3, 2 ny - 1, 2 nx - 1) in the reversed order that ``rolling_kernels.sweep`` needs."""
        kernel = self.kernel[::-1, ::-1]
        return np.ascontiguousarray(np.stack([kernel[..., 0, 0], kernel[..., 0, 1], kernel[..., 1, 1]]))

    @cached_property
    def own_slip(self) -> Array:
        """Slip (2,) of a cell caused by its own unit traction, along x and y."""
        return np.diag(self.kernel[self.rows - 1, self.columns - 1]).copy()

    @cached_property
    def strip_coupling(self) -> Array:
        """Coupling matrix (nx, 2, nx, 2): slip of each cell of a strip by the traction of each cell of the same
        strip.
        """
        index = np.arange(self.columns)
        return self.kernel[self.rows - 1][index[:, None] - index + self.columns - 1].transpose(0, 2, 1, 3)


LinearMap = Callable[[Array], Array]


def gmres(
    apply_matrix: LinearMap,
    apply_preconditioner: LinearMap,
    right_hand_side: Array,
    tolerance: float,
    product_limit: int,
) -> Array:
    """Solution x with |apply(x) - b| <= tolerance |b| by preconditioned GMRES; b is the right-hand side (n,).

    Raises RunFailed after ``product_limit`` products.

    GMRES (Saad and Schultz, 1986), preconditioned from the right. Its own loops instead of a library's, whose calls of
    threaded linear algebra on short vectors stall on busy cores.
    """
    size = float(np.linalg.norm(right_hand_side))
    if size == 0.0:
        return np.zeros_like(right_hand_side)
    basis, triangle, turns = (
        np.empty((product_limit + 1, right_hand_side.size)),
        np.zeros((product_limit, product_limit)),
        np.empty((product_limit, 2)),
    )
    residual_components = np.append(size, np.zeros(product_limit))
    basis[0] = right_hand_side / size
    for count in range(1, product_limit + 1):
        triangle[:count, count - 1] = rotate_column(
            orthogonalise(basis, count, apply_matrix(apply_preconditioner(basis[count - 1]))),
            turns,
            residual_components,
        )
        if abs(residual_components[count]) <= tolerance * size:
            return apply_preconditioner(
                np.linalg.solve(triangle[:count, :count], residual_components[:count]) @ basis[:count]
            )
    raise RunFailed(
        "linear solver", f"residual {abs(residual_components[product_limit]) / size:.2g} after {product_limit} products"
    )


class FreeTractionSystem:
    """Linear system free (C + stiff) d = free wanted for changes d of traction within the free directions of each cell.

    GMRES, preconditioned by the exact inverse of every strip by itself, whose factors serve any number of right sides.
    """

    def __init__(self, slip_operator: SlipOperator, free_directions: Array, added_stiffness: Array) -> None:
        """free_directions : (ny, nx, 2, 2) projection of each cell's traction onto its free directions. added_stiffness
        : (ny, nx).
        """
        self.operator, self.free, self.stiff = slip_operator, free_directions, added_stiffness[..., None]
        self.scale = 1.0 / (
            slip_operator.own_slip.max() + self.stiff
        )  # a cell near the edge is many times stiffer than others
        self.factors = self._strips()
        inside = np.any(free_directions, axis=(2, 3))
        first, last = inside.argmax(axis=1), inside.shape[1] - inside[:, ::-1].argmax(axis=1)
        self.spans = 2 * np.stack([first, np.where(inside.any(axis=1), last, first)], axis=1)
        factorise_matrices(self.factors, self.spans)

    def _strips(self) -> Array:
        """Matrices (ny, 2 nx, 2 nx) of the system within every strip.

        On the directions that are not free it is 1 + stiff: a one would be lost in the rounding of a large stiffness.
        """
        free, stiff = self.free, self.stiff[..., None]
        rows, columns = free.shape[:2]
        system = np.einsum("riab,ibjc,rjcd->riajd", free, self.operator.strip_coupling, free, optimize=True)
        index = np.arange(columns)
        system[:, index, :, index, :] += np.moveaxis((1.0 + stiff) * np.eye(2) - free, 1, 0)
        return np.ascontiguousarray(system.reshape(rows, 2 * columns, 2 * columns))

    def solve(self, right_hand_side: Array, tolerance: float = INNER_TOLERANCE) -> Array:
        """Change of traction (ny, nx, 2) that produces a change of slip (ny, nx, 2), to a relative residual of
        ``tolerance``."""
        # twice: of a large slip all but normal to a free direction, the first projection leaves rounding aside of it
        right = (self.scale * _cellwise_products(self.free, _cellwise_products(self.free, right_hand_side))).ravel()
        return gmres(self._apply, self._precondition, right, tolerance, PRODUCT_LIMIT).reshape(right_hand_side.shape)

    def _apply(self, flat_traction: Array) -> Array:
        change = flat_traction.reshape(*self.scale.shape[:2], 2)
        return (self.scale * _cellwise_products(self.free, self.operator(change) + self.stiff * change)).ravel()

    def _precondition(self, flat_traction: Array) -> Array:
        scaled = flat_traction.reshape(*self.scale.shape[:2], 2) / self.scale
        return solve_factorised(self.factors, self.spans, scaled.reshape(len(scaled), -1)).ravel()


def _cellwise_products(matrices: Array, vectors: Array) -> Array:
    """Product of each cell's matrix (..., 2, 2) with its vector (..., 2)."""
    return matrices[..., 0] * vectors[..., :1] + matrices[..., 1] * vectors[..., 1:]
