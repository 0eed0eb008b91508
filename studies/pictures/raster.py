"""Triangles to pixels: the nearest surface wins at every pixel, colours run straight between corners."""

import math

import numpy as np

from models.machine.compiled import njit


@njit(cache=True, error_model="numpy")
def within(start, growth, left, right):
    """The part of columns from ``left`` to ``right`` in which start + column * growth is not negative."""
    if growth > 0.0:
        return max(left, -start / growth), right
    if growth < 0.0:
        return left, min(right, -start / growth)
    return left, right if start >= 0.0 else left - 1.0


@njit(cache=True, error_model="numpy")
def paint(corners, near, colours, image, nearest):
    """Paint triangles into ``image`` (h, w, 3) where they lie before what is in ``nearest`` (h, w) already.

    corners (m, 3, 2) : pixels, x to the right, y down; near (m, 3) : inverse distances (1/m), which are linear in
    pixels; colours (m, 3, 3) : red, green, blue from 0 to 1 at each corner.
    """
    height, width = nearest.shape
    for k in range(len(corners)):
        x0, y0 = corners[k, 0]
        x1, y1 = corners[k, 1]
        x2, y2 = corners[k, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        top, bottom = max(0, math.ceil(min(y0, y1, y2))), min(height - 1, math.floor(max(y0, y1, y2)))
        for row in range(top, bottom + 1):
            # Shares of corners 1 and 2 at column 0, and their growth from column to column.
            one, one_on = (-x0 * (y2 - y0) - (x2 - x0) * (row - y0)) / area, (y2 - y0) / area
            two, two_on = ((x1 - x0) * (row - y0) + x0 * (y1 - y0)) / area, -(y1 - y0) / area
            left, right = within(one, one_on, max(0.0, min(x0, x1, x2)), min(width - 1.0, max(x0, x1, x2)))
            left, right = within(two, two_on, left, right)
            left, right = within(1.0 - one - two, -one_on - two_on, left, right)
            for column in range(math.ceil(left), math.floor(right) + 1):
                b, c = one + column * one_on, two + column * two_on
                a = 1.0 - b - c
                here = a * near[k, 0] + b * near[k, 1] + c * near[k, 2]
                if here > nearest[row, column]:
                    nearest[row, column] = here
                    for i in range(3):
                        image[row, column, i] = a * colours[k, 0, i] + b * colours[k, 1, i] + c * colours[k, 2, i]


def halved(image: np.ndarray) -> np.ndarray:
    """Image (h, w, 3) from one of twice the size: smooth edges."""
    return (image[::2, ::2] + image[1::2, ::2] + image[::2, 1::2] + image[1::2, 1::2]) / 4.0
