"""All that is recorded of a moment of a braked vehicle in one row of numbers, so that keeping it is one copy."""

import math
from typing import NamedTuple

import numpy as np

from models.brake.plane_step import REPORTED


class Row(NamedTuple):
    """The row and its parts, which are views of it.

    time (1,): s; state (2, n): positions and rates; turning, pressure, torque (W,): rad/s, bar, N m; report (W, 7):
    see ``plane_step``.
    """

    whole: np.ndarray
    time: np.ndarray
    state: np.ndarray
    turning: np.ndarray
    pressure: np.ndarray
    torque: np.ndarray
    report: np.ndarray


def row(coordinates: int, wheels: int) -> Row:
    """A row of zeros of so many coordinates and wheels."""
    shapes = ((1,), (2, coordinates), *((wheels,),) * 3, (wheels, REPORTED))
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    whole = np.zeros(ends[-1])
    columns = np.split(whole, ends[:-1])
    return Row(whole, *(column.reshape(shape) for column, shape in zip(columns, shapes, strict=True)))


def parts(rows: list[np.ndarray], like: Row) -> list[np.ndarray]:
    """Of blocks of rows that are like one, each part with an axis for the rows before its own."""
    ends = np.cumsum([part.size for part in like[1:]])
    columns = np.split(np.concatenate(rows), ends[:-1], axis=1)
    return [
        np.ascontiguousarray(column).reshape(-1, *part.shape) for column, part in zip(columns, like[1:], strict=True)
    ]
