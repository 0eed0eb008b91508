"""The undeformed distance of two bodies: the distance of opposite surface points while the bodies just touch.

A function h(x, y) >= 0 over a rectangle, kept as values on even nodes with a cubic interpolation that is exact for
quadratic surfaces. It comes from a formula (``from_function``), from measured or computed values (``from_arrays``),
from curvatures (``quadratic``) or from two profiles (``models.contact.wheel_on_rail``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.contact.distance_kernels import interpolated_values, valley_course
from models.contact.inputs import Array, checked_quantity
from models.core.errors import InputError

NODE_COUNT = 97
"""Number of nodes along each axis of a computed distance: 48 spacings on each side of the centre."""
LARGEST_UNEVENNESS = 2e-3
"""Largest deviation of a node from its even position, as a share of a step, at which nodes count as even; rounding in a
file causes as much.
"""
LARGEST_CONTACT = 1.0
"""Largest position and height (m) that is accepted: no contact is so large, and larger ones are usually in mm."""


@dataclass(frozen=True, eq=False)
class UndeformedDistance:
    """Undeformed distance of two surfaces on evenly spaced nodes.

    x : (nx,) and y : (ny,) nodes (m), ascending, the axes of the package. height : (ny, nx) distance (m), rows along y.
    The approach of the bodies counts from distance zero, whether or not the least height is zero.
    """

    x: Array
    y: Array
    height: Array

    @property
    def dx(self) -> float:
        """Spacing of the nodes along x (m)."""
        return float(self.x[-1] - self.x[0]) / (self.x.size - 1)

    @property
    def dy(self) -> float:
        """Spacing of the nodes along y (m)."""
        return float(self.y[-1] - self.y[0]) / (self.y.size - 1)

    @property
    def curvatures(self) -> tuple[float, float]:
        """Second derivatives (1/m) of the distance along x and along y at x = y = 0, from differences over four node
        spacings.
        """
        second_differences = []
        for x, y in ((4.0 * self.dx, 0.0), (0.0, 4.0 * self.dy)):
            low, here, high = self.at(np.array([-x, 0.0, x]), np.array([-y, 0.0, y]))
            second_differences.append(float((low - 2.0 * here + high) / (x + y) ** 2))
        return second_differences[0], second_differences[1]

    @cached_property
    def padded(self) -> Array:
        """Heights (m) with an extra node on every side, extrapolated by the parabola through the three outermost."""
        return _extrapolated_rows(_extrapolated_rows(self.height).T).T.copy()

    def at(self, x: Array, y: Array) -> Array:
        """Distance (m) at points x, y (m), broadcast; raises InputError outside the nodes."""
        x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
        for name, points, nodes in (("x", x, self.x), ("y", y, self.y)):
            if points.size and not (nodes[0] <= points.min() and points.max() <= nodes[-1]):
                raise InputError("", name, None, f"must lie from {nodes[0]:g} to {nodes[-1]:g} m, where h is known")
        u, v = (x.ravel() - self.x[0]) / self.dx, (y.ravel() - self.y[0]) / self.dy
        return interpolated_values(self.padded, u, v).reshape(x.shape)

    @cached_property
    def valley_y(self) -> tuple[Array, Array, Array]:
        """Lines y (m), the least height on each (m), and the x of that height (m): the course of the valley across
        y.
        """
        return self._valley(self.padded, self.y, self.x, self.dx)

    @cached_property
    def valley_x(self) -> tuple[Array, Array, Array]:
        """Lines x (m), the least height on each (m), and the y of that height (m): the course of the valley across
        x.
        """
        return self._valley(np.ascontiguousarray(self.padded.T), self.x, self.y, self.dy)

    @staticmethod
    def _valley(
        padded_heights: Array, valley_coordinates: Array, other_coordinates: Array, node_spacing: float
    ) -> tuple[Array, Array, Array]:
        """Lines along one axis (m), the least height on each (m), and its position (m) on the other axis."""
        finer = 2
        least, where = valley_course(padded_heights, finer)
        return (
            np.linspace(valley_coordinates[0], valley_coordinates[-1], least.size),
            least,
            other_coordinates[0] + where * node_spacing,
        )

    def part(self, x_nodes: slice, y_nodes: slice) -> "UndeformedDistance":
        """The undeformed distance restricted to some of its nodes."""
        return UndeformedDistance(self.x[x_nodes], self.y[y_nodes], self.height[y_nodes, x_nodes])


def from_function(
    height_formula: Callable[[Array, Array], Array],
    x_range: tuple[float, float],
    y_range: tuple[float, float],
    node_count: int = NODE_COUNT,
) -> UndeformedDistance:
    """Undeformed distance from a formula ``height(x, y)`` in m, of arrays in m, over the rectangle x[0]..x[1],
    y[0]..y[1].

    Raises InputError for an empty rectangle and for a formula without a finite answer of the right shape.
    """
    for name, (first, last) in (("x", x_range), ("y", y_range)):
        if not (np.isfinite([first, last]).all() and first < last):
            raise InputError("", name, [first, last], "must be two finite bounds in m, the lower first")
    nodes_x, nodes_y = np.linspace(*x_range, node_count), np.linspace(*y_range, node_count)
    heights = checked_quantity("height", height_formula(nodes_x[None, :], nodes_y[:, None]), "finite everywhere (m)")
    try:
        heights = np.broadcast_to(heights, (node_count, node_count))
    except ValueError:
        raise InputError("", "height", list(heights.shape), "must give one distance per point") from None
    return from_arrays(nodes_x, nodes_y, heights)


def from_arrays(x: Array, y: Array, height: Array) -> UndeformedDistance:
    """Undeformed distance from values: x (nx,), y (ny,) even ascending nodes (m), height (ny, nx) (m), rows along y.

    Raises InputError for a wrong shape, uneven nodes, fewer than four of them, or values that are not finite.
    """
    nodes = {
        name: checked_quantity(
            name, array, f"places in m within +-{LARGEST_CONTACT:g}", -LARGEST_CONTACT, LARGEST_CONTACT
        )
        for name, array in (("x", x), ("y", y))
    }
    height = checked_quantity(
        "height", height, f"finite everywhere, in m within +-{LARGEST_CONTACT:g}", -LARGEST_CONTACT, LARGEST_CONTACT
    )
    for name, array in nodes.items():
        if array.ndim != 1 or array.size < 4:
            raise InputError("", name, list(array.shape), "must have the shape (n,) with n of 4 or more")
        even = np.linspace(array[0], array[-1], array.size)
        if not np.abs(array - even).max() < LARGEST_UNEVENNESS * (even[1] - even[0]):
            raise InputError("", name, None, "must ascend in even steps (m)")
    shape = (nodes["y"].size, nodes["x"].size)
    if height.shape != shape:
        raise InputError("", "height", list(height.shape), f"must have the shape (ny, nx) = {shape}, rows along y")
    return UndeformedDistance(nodes["x"], nodes["y"], height.copy())


def quadratic(
    A: float, B: float, x_half_length: float, y_half_length: float, node_count: int = NODE_COUNT
) -> UndeformedDistance:
    """Undeformed distance of Hertz' theory, A x^2 + B y^2 (A and B in 1/m), over -x..x and -y..y (m)."""
    return from_function(
        lambda u, v: A * u**2 + B * v**2, (-x_half_length, x_half_length), (-y_half_length, y_half_length), node_count
    )


def _extrapolated_rows(table_rows: Array) -> Array:
    """The rows of a table with one more at each end, extrapolated by the parabola through the three nearest rows."""
    first = 3.0 * (table_rows[0] - table_rows[1]) + table_rows[2]
    last = 3.0 * (table_rows[-1] - table_rows[-2]) + table_rows[-3]
    return np.vstack([first, table_rows, last])
