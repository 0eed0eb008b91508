"""Hertz' pressure on a grid of cells, as the exact theory of rolling takes it."""

import numpy as np

from models.contact.normal_problem import Pressed, centres

PARTS = 8
"""Points along each axis of a cell over which the pressure is averaged."""


def hertzian(a: float, b: float, load: float, cells: int) -> Pressed:
    """Pressure of an ellipse with semi-axes a, b (m), the mean of each of ``cells`` x ``cells`` cells, scaled to the
    load (N).
    """
    inner = (np.arange(cells * PARTS) + 0.5) / (cells * PARTS) * 2 - 1
    height = np.sqrt(np.maximum(1 - inner[:, None] ** 2 - inner**2, 0)).reshape(cells, PARTS, cells, PARTS)
    pressure, dx, dy = height.mean((1, 3)), 2 * a / cells, 2 * b / cells
    return Pressed(pressure * load / (pressure.sum() * dx * dy), centres(cells, dx), centres(cells, dy))
