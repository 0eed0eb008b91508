"""Compiled evaluation of piecewise polynomials and their derivatives, and linear interpolation of samples."""

import numpy as np

from models.machine.compiled import njit


@njit(cache=True)
def piecewise_values(coefficients, sampling_period, start_time, time_step, sample_count, derivative_count):
    """Values of a piecewise polynomial at the times start_time + i step, followed by its derivatives up to the order
    ``derivative_count``: shape (sample_count, columns (derivatives + 1)).

    coefficients : (degree + 1, pieces, columns), lowest power first, in the time since each piece's start;
    the pieces lie ``sampling_period`` (s) apart from t = 0 on, and the outer ones go on beyond their ends.
    """
    powers, pieces, columns = coefficients.shape
    values_out = np.empty((sample_count, columns * (derivative_count + 1)))
    for row in range(sample_count):
        time = start_time + row * time_step
        piece = min(max(int(np.floor(time / sampling_period + 1e-9)), 0), pieces - 1)
        since = time - piece * sampling_period
        for order in range(derivative_count + 1):
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
def interpolated_rows(samples, row_indices, period_fractions):
    """Samples interpolated linearly, shape (m, columns): between row ``row_indices`` (m,) of ``samples`` (n, columns)
    and the next row, at the ``period_fractions`` (m,) of a period."""
    rows, columns = samples.shape
    values_out = np.empty((len(row_indices), columns))
    for i in range(len(row_indices)):
        row = row_indices[i]
        next_row = min(row + 1, rows - 1)
        for column in range(columns):
            values_out[i, column] = samples[row, column] + period_fractions[i] * (
                samples[next_row, column] - samples[row, column]
            )
    return values_out
