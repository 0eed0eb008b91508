"""Compiled evaluation of piecewise polynomials and their derivatives, and linear interpolation of samples."""

import numpy as np

from models.machine.compiled import njit


@njit(cache=True)
def evaluate(coefficients, period, start_time, step, sample_count, derivatives):
    """Values of a piecewise polynomial at the times start_time + i step, followed by its derivatives up to the order
    ``derivatives``: shape (sample_count, columns (derivatives + 1)).

    coefficients : (degree + 1, pieces, columns), lowest power first, in the time since each piece's start;
    the pieces lie ``period`` (s) apart from t = 0 on, and the outer ones go on beyond their ends.
    """
    powers, pieces, columns = coefficients.shape
    values_out = np.empty((sample_count, columns * (derivatives + 1)))
    for row in range(sample_count):
        time = start_time + row * step
        piece = min(max(int(np.floor(time / period + 1e-9)), 0), pieces - 1)
        since = time - piece * period
        for order in range(derivatives + 1):
            for column in range(columns):
                value = 0.0
                for power in range(powers - 1, order - 1, -1):
                    factor = 1.0
                    for i in range(order):
                        factor *= power - i
                    value = value * since + factor * coefficients[power, piece, column]
                values_out[row, order * columns + column] = value
    return values_out


@njit(cache=True, nogil=True)
def interpolate(values, index, fraction):
    """Samples interpolated linearly, shape (m, columns): between row ``index`` (m,) of ``values`` (n, columns) and the
    next row, at the ``fraction`` (m,) of a period."""
    rows, columns = values.shape
    values_out = np.empty((len(index), columns))
    for i in range(len(index)):
        row = index[i]
        next_row = min(row + 1, rows - 1)
        for column in range(columns):
            values_out[i, column] = values[row, column] + fraction[i] * (values[next_row, column] - values[row, column])
    return values_out
