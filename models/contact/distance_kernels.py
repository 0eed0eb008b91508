"""Compiled interpolation of an undeformed distance: cubic convolution, which is exact for a quadratic surface.

Values stand on evenly spaced nodes with one more on every side, so that a position of u spacings from the first node
lies in the segment between padded nodes i + 1 and i + 2, where i = floor(u) (Keys, IEEE Trans. ASSP 29, 1981).
"""

import math

import numpy as np

from models.machine.compiled import njit


@njit(cache=True)
def interpolation_weights(position_in_segment):
    """Weights of four neighbouring nodes for the interpolated value at the position ``position_in_segment`` (0 to 1) in
    a segment, and for its slope per spacing.
    """
    value = (
        0.5 * position_in_segment * (-1.0 + position_in_segment * (2.0 - position_in_segment)),
        1.0 + 0.5 * position_in_segment * position_in_segment * (-5.0 + 3.0 * position_in_segment),
        0.5 * position_in_segment * (1.0 + position_in_segment * (4.0 - 3.0 * position_in_segment)),
        0.5 * position_in_segment * position_in_segment * (position_in_segment - 1.0),
    )
    slope = (
        0.5 * (-1.0 + position_in_segment * (4.0 - 3.0 * position_in_segment)),
        0.5 * position_in_segment * (-10.0 + 9.0 * position_in_segment),
        0.5 * (1.0 + position_in_segment * (8.0 - 9.0 * position_in_segment)),
        0.5 * position_in_segment * (3.0 * position_in_segment - 2.0),
    )
    return value, slope


@njit(cache=True)
def segment_of_position(position, segment_count):
    """Index of the segment that contains a position (in spacings), and the position as a share of that segment; clamped
    to the ends.
    """
    i = min(max(math.floor(position), 0), segment_count - 1)
    return i, position - i


@njit(cache=True)
def value_and_slopes(padded_heights, u, v):
    """Interpolated value at u spacings along x (columns) and v along y (rows), and its slopes per spacing along x and
    y.
    """
    i, t = segment_of_position(u, padded_heights.shape[1] - 3)
    j, s = segment_of_position(v, padded_heights.shape[0] - 3)
    wx, sx = interpolation_weights(t)
    wy, sy = interpolation_weights(s)
    value = along_x = along_y = 0.0
    for k in range(4):
        row = slope = 0.0
        for m in range(4):
            row += wx[m] * padded_heights[j + k, i + m]
            slope += sx[m] * padded_heights[j + k, i + m]
        value += wy[k] * row
        along_x += wy[k] * slope
        along_y += sy[k] * row
    return value, along_x, along_y


@njit(cache=True)
def interpolated_values(padded_heights, u, v):
    """Interpolated values at the points (u[k], v[k]), in spacings."""
    heights = np.empty(u.size)
    for k in range(u.size):
        heights[k] = value_and_slopes(padded_heights, u[k], v[k])[0]
    return heights


@njit(cache=True)
def row_at(padded_heights, v):
    """Interpolated row of padded values along x, at v spacings along y."""
    j, s = segment_of_position(v, padded_heights.shape[0] - 3)
    w, _ = interpolation_weights(s)
    return (
        w[0] * padded_heights[j]
        + w[1] * padded_heights[j + 1]
        + w[2] * padded_heights[j + 2]
        + w[3] * padded_heights[j + 3]
    )


@njit(cache=True)
def value_along_row(height_row, u):
    """Interpolated value of a padded row at u spacings along x."""
    i, t = segment_of_position(u, height_row.size - 3)
    w, _ = interpolation_weights(t)
    return w[0] * height_row[i] + w[1] * height_row[i + 1] + w[2] * height_row[i + 2] + w[3] * height_row[i + 3]


@njit(cache=True)
def least_value_of_row(height_row):
    """Least value along a padded row, also between its nodes, and its position in spacings."""
    least, where = np.inf, 0.0
    for i in range(height_row.size - 3):
        a, b, c, d = height_row[i], height_row[i + 1], height_row[i + 2], height_row[i + 3]
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
def minimum_in_segment(cubic_coefficient, quadratic_coefficient, linear_coefficient):
    """Position (0 to 1) in a segment of the minimum of cube t^3 + square t^2 + linear t; 0 if there is no minimum
    inside."""
    root = quadratic_coefficient * quadratic_coefficient - 3.0 * cubic_coefficient * linear_coefficient
    if root <= 0.0:
        return 0.0
    denominator = quadratic_coefficient + math.sqrt(root)
    t = -linear_coefficient / denominator if denominator != 0.0 else 0.0
    return t if 0.0 < t < 1.0 else 0.0


@njit(cache=True)
def valley_course(padded_heights, lines_per_spacing):
    """Least value along x, and its position along x in spacings, on each of ``lines_per_spacing`` lines per spacing
    across y: two arrays (lines,).
    """
    lines = (padded_heights.shape[0] - 3) * lines_per_spacing + 1
    least, where = np.empty(lines), np.empty(lines)
    for k in range(lines):
        least[k], where[k] = least_value_of_row(row_at(padded_heights, k / lines_per_spacing))
    return least, where


@njit(cache=True)
def valley_ends(line_positions, height_roots, bottom_position, level_root):
    """Ends (m) of the valley below the level whose root is ``level_root``: on either side of the bottom, the total
    length of all parts below the level.

    line_positions : positions, one of them the bottom; height_roots : square root of the height above the bottom at
    these, linear between.
    """
    low_length = high_length = 0.0
    for k in range(line_positions.size - 1):
        lower, upper = min(height_roots[k], height_roots[k + 1]), max(height_roots[k], height_roots[k + 1])
        if level_root > lower:
            length = (line_positions[k + 1] - line_positions[k]) * (
                min((level_root - lower) / (upper - lower), 1.0) if upper > lower else 1.0
            )
            if line_positions[k] >= bottom_position:
                high_length += length
            else:
                low_length += length
    return bottom_position - low_length, bottom_position + high_length
