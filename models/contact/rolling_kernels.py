"""Compiled loops of the exact rolling theory over the cells of a contact: sweeps, the coupling within strips, steps of
GMRES.
"""

import numpy as np

from models.machine.compiled import njit


@njit(cache=True, fastmath=True, nogil=True)
def gauss_seidel_sweep(traction, rigid_slip, reversed_kernel, bound, relaxation_factor):
    """Relax the tractions of all cells once, in place, by Gauss-Seidel, strip by strip, each from its leading edge
    back.

    traction, rigid_slip : (2, ny, nx) traction in units of G and rigid slip; bound : (ny, nx), zero outside the
    contact;
    reversed_kernel : (3, 2 ny - 1, 2 nx - 1), xx, xy and yy, reversed in both axes so that its rows run beside the
    traction's.
    """
    rows, columns = bound.shape
    own_x, own_y = reversed_kernel[0, rows - 1, columns - 1], reversed_kernel[2, rows - 1, columns - 1]
    for row in range(rows):
        for column in range(columns - 1, -1, -1):
            if bound[row, column] <= 0:
                continue
            slip_x, slip_y = rigid_slip[0, row, column], rigid_slip[1, row, column]
            first = columns - 1 - column
            for line in range(rows):
                k = rows - 1 - row + line
                for i in range(columns):
                    p_x, p_y = traction[0, line, i], traction[1, line, i]
                    cross = reversed_kernel[1, k, first + i]
                    slip_x += reversed_kernel[0, k, first + i] * p_x + cross * p_y
                    slip_y += cross * p_x + reversed_kernel[2, k, first + i] * p_y
            p_x, p_y = traction[0, row, column], traction[1, row, column]
            new_x, new_y = cell_traction(slip_x - own_x * p_x, slip_y - own_y * p_y, own_x, own_y, bound[row, column])
            traction[0, row, column] = p_x + relaxation_factor * (new_x - p_x)
            traction[1, row, column] = p_y + relaxation_factor * (new_y - p_y)


@njit(cache=True, nogil=True)
def cell_traction(slip_x, slip_y, self_slip_x, self_slip_y, bound):
    """Traction of one cell whose slip is (slip_x + self_slip_x p_x, slip_y + self_slip_y p_y): it sticks, or slides
    with the traction opposite to the slip.

    In slip p = -slip / (own + l) with l > 0 such that |p| = bound: Newton's iteration on 1/|p|, monotone from l = 0.
    """
    p_x, p_y = -slip_x / self_slip_x, -slip_y / self_slip_y
    length = np.hypot(p_x, p_y)
    shift = 0.0
    while length > bound * (1 + 1e-14):
        slope = p_x * p_x / (self_slip_x + shift) + p_y * p_y / (self_slip_y + shift)
        increase = length * length * (length - bound) / (bound * slope)
        if increase <= 1e-15 * shift:
            break
        shift += increase
        p_x, p_y = -slip_x / (self_slip_x + shift), -slip_y / (self_slip_y + shift)
        length = np.hypot(p_x, p_y)
    return p_x, p_y


@njit(cache=True, fastmath=True, nogil=True)
def factorise_matrices(matrices, row_spans):
    """Replace each matrix (many, n, n) by its LU factors, in place: L with unit diagonal, and U.

    row_spans (many, 2) : first row of each that is not the unit matrix's, and one beyond its last. Without pivoting,
    which a matrix with a positive definite symmetric part does not need.
    """
    for which in range(len(matrices)):
        start, stop = row_spans[which]
        for pivot in range(start, stop - 1):
            for row in range(pivot + 1, stop):
                part = matrices[which, row, pivot] / matrices[which, pivot, pivot]
                if part != 0.0:
                    matrices[which, row, pivot] = part
                    for column in range(pivot + 1, stop):
                        matrices[which, row, column] -= part * matrices[which, pivot, column]


@njit(cache=True, fastmath=True, nogil=True)
def solve_factorised(factors, row_spans, right_sides):
    """Solutions (many, n) of the linear systems in ``factors`` for right-hand sides (many, n)."""
    solution = right_sides.copy()
    for which in range(len(factors)):
        start, stop = row_spans[which]
        for row in range(start + 1, stop):
            part = 0.0
            for column in range(start, row):
                part += factors[which, row, column] * solution[which, column]
            solution[which, row] -= part
        for row in range(stop - 1, start - 1, -1):
            part = 0.0
            for column in range(row + 1, stop):
                part += factors[which, row, column] * solution[which, column]
            solution[which, row] = (solution[which, row] - part) / factors[which, row, row]
    return solution


@njit(cache=True, nogil=True)
def rotate_column(column, rotations, residual_components):
    """Apply Givens' rotations to a new column (count + 1,) of GMRES, so that the system stays triangular; returns the
    column (count,).

    rotations (most, 2) : cosine and sine of the rotations, of which the last is added; residual_components (most + 1,)
    : what the residual was turned to, its last component the residual's size.
    """
    count = len(column) - 1
    for i in range(count - 1):
        low, high = column[i], column[i + 1]
        column[i], column[i + 1] = (
            rotations[i, 0] * low + rotations[i, 1] * high,
            rotations[i, 0] * high - rotations[i, 1] * low,
        )
    size = np.hypot(column[count - 1], column[count])
    rotations[count - 1, 0], rotations[count - 1, 1] = column[count - 1] / size, column[count] / size
    column[count - 1] = size
    residual_components[count], residual_components[count - 1] = (
        -rotations[count - 1, 1] * residual_components[count - 1],
        rotations[count - 1, 0] * residual_components[count - 1],
    )
    return column[:count]


@njit(cache=True, fastmath=True, nogil=True)
def orthogonalise(basis, row_count, vector):
    """Remove from ``vector`` its components along the first ``row_count`` rows of ``basis``, and write the remainder,
    scaled to length 1, as the next row.

    Returns the components along these ``row_count`` rows and the new one, by modified Gram-Schmidt.
    """
    components = np.zeros(row_count + 1)
    remainder = vector.copy()
    for row in range(row_count):
        part = 0.0
        for i in range(len(remainder)):
            part += basis[row, i] * remainder[i]
        for i in range(len(remainder)):
            remainder[i] -= part * basis[row, i]
        components[row] = part
    square = 0.0
    for i in range(len(remainder)):
        square += remainder[i] * remainder[i]
    components[row_count] = np.sqrt(square)
    for i in range(len(remainder)):
        basis[row_count, i] = remainder[i] / max(components[row_count], 1e-300)
    return components
