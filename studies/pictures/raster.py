"""Triangles to pixels: the nearest surface wins at every pixel, colours run straight between corners."""

import math

import numpy as np

from models.compiled import njit


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
        left, right = max(0, math.ceil(min(x0, x1, x2))), min(width - 1, math.floor(max(x0, x1, x2)))
        top, bottom = max(0, math.ceil(min(y0, y1, y2))), min(height - 1, math.floor(max(y0, y1, y2)))
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                one = ((column - x0) * (y2 - y0) - (x2 - x0) * (row - y0)) / area
                two = ((x1 - x0) * (row - y0) - (column - x0) * (y1 - y0)) / area
                zero = 1.0 - one - two
                if zero < 0.0 or one < 0.0 or two < 0.0:
                    continue
                here = zero * near[k, 0] + one * near[k, 1] + two * near[k, 2]
                if here > nearest[row, column]:
                    nearest[row, column] = here
                    for i in range(3):
                        image[row, column, i] = (
                            zero * colours[k, 0, i] + one * colours[k, 1, i] + two * colours[k, 2, i]
                        )


def halved(image: np.ndarray) -> np.ndarray:
    """Image (h, w, 3) from one of twice the size: smooth edges."""
    height, width = image.shape[0] // 2, image.shape[1] // 2
    return image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3))
