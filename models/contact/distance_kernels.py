"""Compiled interpolation of an undeformed distance: cubic convolution, which is exact for a quadratic surface.

Values stand on evenly spaced nodes with one more on every side, so that a position of u spacings from the first node
lies in the segment between padded nodes i + 1 and i + 2, where i = floor(u) (Keys, IEEE Trans. ASSP 29, 1981).
"""

import math

import numpy as np

from models.machine.compiled import njit


@njit(cache=True)
def interpolation_weights(t):
    """Weights of four neighbouring nodes for the interpolated value at the position ``t`` (0 to 1) in a segment, and
    for its slope per spacing.
    """
    value = (
        0.5 * t * (-1.0 + t * (2.0 - t)),
        1.0 + 0.5 * t * t * (-5.0 + 3.0 * t),
        0.5 * t * (1.0 + t * (4.0 - 3.0 * t)),
        0.5 * t * t * (t - 1.0),
    )
    slope = (
        0.5 * (-1.0 + t * (4.0 - 3.0 * t)),
        0.5 * t * (-10.0 + 9.0 * t),
        0.5 * (1.0 + t * (8.0 - 9.0 * t)),
        0.5 * t * (3.0 * t - 2.0),
    )
    return value, slope


@njit(cache=True)
def segment_of_position(position, segments):
    """Index of the segment that contains a position (in spacings), and the position as a share of that segment; clamped
    to the ends.
    """
    i = min(max(math.floor(position), 0), segments - 1)
    return i, position - i


@njit(cache=True)
def value_and_slopes(padded, u, v):
    """Interpolated value at u spacings along x (columns) and v along y (rows), and its slopes per spacing along x and
    y.
    """
    i, t = segment_of_position(u, padded.shape[1] - 3)
    j, s = segment_of_position(v, padded.shape[0] - 3)
    wx, sx = interpolation_weights(t)
    wy, sy = interpolation_weights(s)
    value = along_x = along_y = 0.0
    for k in range(4):
        row = slope = 0.0
        for m in range(4):
            row += wx[m] * padded[j + k, i + m]
            slope += sx[m] * padded[j + k, i + m]
        value += wy[k] * row
        along_x += wy[k] * slope
        along_y += sy[k] * row
    return value, along_x, along_y


@njit(cache=True)
def values(padded, u, v):
    """Interpolated values at the points (u[k], v[k]), in spacings."""
    heights = np.empty(u.size)
    for k in range(u.size):
        heights[k] = value_and_slopes(padded, u[k], v[k])[0]
    return heights


@njit(cache=True)
def row_at(padded, v):
    """Interpolated row of padded values along x, at v spacings along y."""
    j, s = segment_of_position(v, padded.shape[0] - 3)
    w, _ = interpolation_weights(s)
    return w[0] * padded[j] + w[1] * padded[j + 1] + w[2] * padded[j + 2] + w[3] * padded[j + 3]


@njit(cache=True)
def value_along_row(row, u):
    """Interpolated value of a padded row at u spacings along x."""
    i, t = segment_of_position(u, row.size - 3)
    w, _ = interpolation_weights(t)
    return w[0] * row[i] + w[1] * row[i + 1] + w[2] * row[i + 2] + w[3] * row[i + 3]


@njit(cache=True)
def least_of_row(row):
    """Least value along a padded row, also between its nodes, and its position in spacings."""
    least, where = np.inf, 0.0
    for i in range(row.size - 3):
        a, b, c, d = row[i], row[i + 1], row[i + 2], row[i + 3]
        for t in (
            0.0,
            minimum_in_segment(
                (-a + 3.0 * b - 3.0 * c + d) / 2.0, (2.0 * a - 5.0 * b + 4.0 * c - d) / 2.0, (c - a) / 2.0
            ),
            1.0,
        ):
            w, _ = interpolation_weights(t)
            value = w[0] * a + w[1] * b + w[2] * c + w[3] * d
            if value < least:
                least, where = value, i + t
    return least, where


@njit(cache=True)
def minimum_in_segment(cube, square, linear):
    """Position (0 to 1) in a segment of the minimum of cube t^3 + square t^2 + linear t; 0 if there is no minimum
    inside."""
    root = square * square - 3.0 * cube * linear
    if root <= 0.0:
        return 0.0
    denominator = square + math.sqrt(root)
    t = -linear / denominator if denominator != 0.0 else 0.0
    return t if 0.0 < t < 1.0 else 0.0


@njit(cache=True)
def valley(padded, finer):
    """Least value along x, and its position along x in spacings, on each of ``finer`` lines per spacing across y: two
    arrays (lines,).
    """
    lines = (padded.shape[0] - 3) * finer + 1
    least, where = np.empty(lines), np.empty(lines)
    for k in range(lines):
        least[k], where[k] = least_of_row(row_at(padded, k / finer))
    return least, where


@njit(cache=True)
def valley_ends(lines, roots, bottom, root):
    """Ends (m) of the valley below the level whose root is ``root``: on either side of the bottom, the total length of
    all parts below the level.

    lines : positions, one of them the bottom; roots : square root of the height above the bottom at these, linear
    between.
    """
    low_length = high_length = 0.0
    for k in range(lines.size - 1):
        lower, upper = min(roots[k], roots[k + 1]), max(roots[k], roots[k + 1])
        if root > lower:
            length = (lines[k + 1] - lines[k]) * (min((root - lower) / (upper - lower), 1.0) if upper > lower else 1.0)
            if lines[k] >= bottom:
                high_length += length
            else:
                low_length += length
    return bottom - low_length, bottom + high_length
