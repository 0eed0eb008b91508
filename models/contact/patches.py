"""Contact patches: the valleys of an undeformed distance, each of which makes a separate area of contact.

A distance with several valleys is cut between them, along straight lines through the ridges: first along y, where
patches of wheel and rail lie side by side, then along x. The cuts follow from the distance alone. They do not move
with the load, so nothing jumps when two areas of contact grow together.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from models.contact.distance_kernels import valley_ends
from models.contact.inputs import Array
from models.contact.simplified_kernels import PatchSurface
from models.contact.undeformed_distance import UndeformedDistance
from models.core.errors import InputError

LEAST_RIDGE_HEIGHT = 1e-6
"""Height (m) of a ridge above which it separates two valleys; lower ones count as roughness of one valley."""
NO_DEPTH = 1e-12
"""Depth (m) of a valley within its sides up to which it counts as none."""
CutParts = tuple[Array, Array]
Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Patch:
    """One valley of an undeformed distance; one contact patch can arise in it.

    cut : which sides (low x, high x, low y, high y) touch another valley. lean : angle (rad) between the patch's normal
    and the direction in which the bodies approach, which is that of the load. contour_position : position (m) of its y
    = 0 along the contour, from which distances between patches follow.
    """

    distance: UndeformedDistance
    cut: tuple[bool, bool, bool, bool] = (False, False, False, False)
    lean: float = 0.0
    contour_position: float = 0.0

    @cached_property
    def bottom(self) -> tuple[float, float, float]:
        """Position x, y of the valley's least distance (m), and that distance (m)."""
        lines, least, where = self.distance.valley_y
        k = int(np.argmin(least))
        x, y = float(where[k]), float(lines[k])
        for _ in range(3):  # the parabola through three lines, in turn
            x = _parabola_minimum(self.distance, x, y, 0)
            y = _parabola_minimum(self.distance, x, y, 1)
        return x, y, float(self.distance.at(np.array(x), np.array(y)))

    @property
    def low(self) -> float:
        """Smallest distance (m) between the undeformed surfaces in the patch; at a smaller depth there is no
        contact.
        """
        return self.bottom[2]

    @cached_property
    def edge(self) -> float:
        """Depth (m) at which the area {h < depth} reaches a side of the grid that is not a border to another valley."""
        x, y = self.distance.valley_x[1], self.distance.valley_y[1]
        sides = (x[0], x[-1], y[0], y[-1])
        return float(min((side for side, cut in zip(sides, self.cut, strict=True) if not cut), default=np.inf))

    @cached_property
    def lines(self) -> tuple[CutParts, CutParts]:
        """Grid lines along x and along y, with the square root of the least height above the bottom on each, which is
        linear for a paraboloid.
        """
        tables = []
        for (lines, least, _), bottom in zip(
            (self.distance.valley_x, self.distance.valley_y), self.bottom, strict=False
        ):
            k, roots = int(np.searchsorted(lines, bottom)), np.sqrt(np.maximum(least - self.low, 0.0))
            tables.append((np.insert(lines, k, bottom), np.insert(roots, k, 0.0)))
        return tables[0], tables[1]

    def surface(self, depth: float) -> PatchSurface:
        """``PatchSurface`` of the patch at a depth (m), for compiled functions."""
        known = self.distance
        origin = float(known.x[0]), float(known.y[0])
        return PatchSurface(known.padded, origin, (known.dx, known.dy), self.box(depth), depth, self.low)

    def box(self, depth: float) -> Rectangle:
        """Rectangle x0, x1, y0, y1 (m) about the area {h < depth} of the patch, continuous in the depth.

        Each side lies as far from the bottom as the lengths of the valley below the depth add up to on that side: that
        is the bounding box of an area in one piece, and it cannot jump to a dip that opens beyond a low ridge.
        Raises InputError if the area reaches a side of the distance, or if the least distance lies there.
        """
        if depth > self.edge:
            if self.edge - self.low <= NO_DEPTH:
                raise no_bottom_error()
            raise InputError(
                "",
                "distance",
                None,
                f"contact at a depth of {depth:.3g} m reaches the edge of the area "
                "over which the undeformed distance is known: give a larger area",
            )
        root = np.sqrt(max(depth - self.low, 0.0))
        (x, rx), (y, ry) = self.lines
        return (*valley_ends(x, rx, self.bottom[0], root), *valley_ends(y, ry, self.bottom[1], root))


def no_bottom_error() -> InputError:
    """Error for a distance without an inner minimum: it decreases towards one side, or is flat."""
    return InputError(
        "",
        "distance",
        None,
        "has no bottom inside the area over which it is known: it must rise from its least value to all sides",
    )


def separate_patches(undeformed_distance: UndeformedDistance) -> list[Patch]:
    """The valleys of an undeformed distance as patches, in order of ascending y (then x). Every ridge higher than
    ``LEAST_RIDGE_HEIGHT`` separates two of them.
    """
    return [
        Patch(part, (*along_x, *along_y))
        for row, along_y in _parts_between_ridges(undeformed_distance, 1)
        for part, along_x in _parts_between_ridges(row, 0)
    ]


def single_patch_of(undeformed_distance: UndeformedDistance) -> list[Patch]:
    """The undeformed distance treated as a single patch, even if it has several minima."""
    return [Patch(undeformed_distance)]


def _parts_between_ridges(
    undeformed_distance: UndeformedDistance, axis: int
) -> list[tuple[UndeformedDistance, tuple[bool, bool]]]:
    """Parts of the distance, split at ridges along an axis (0: x, 1: y), each with flags on whether its two ends are
    cuts.
    """
    lines, least, _ = undeformed_distance.valley_y if axis else undeformed_distance.valley_x
    nodes, parts, everything = undeformed_distance.y if axis else undeformed_distance.x, [], slice(None)
    inner = [int(np.argmin(np.abs(nodes - lines[k]))) for k in ridge_indices(least)]
    for a, b in pairwise([0, *(k for k in inner if 3 <= k < nodes.size - 3), nodes.size - 1]):
        if b - a >= 3:
            some = slice(a, b + 1)
            part = undeformed_distance.part(everything, some) if axis else undeformed_distance.part(some, everything)
            parts.append((part, (a > 0, b < nodes.size - 1)))
    return parts


def ridge_indices(heights: Array) -> list[int]:
    """Indices of maxima of a line of heights (m) that are more than ``LEAST_RIDGE_HEIGHT`` above the valleys on both
    sides.
    """
    maxima: list[int] = []
    low, top, at = heights[0], heights[0], 0
    climbed = False
    for k, height in enumerate(heights):
        if not climbed:
            low = min(low, height)
            if height > low + LEAST_RIDGE_HEIGHT:
                climbed, top, at = True, height, k
        elif height > top:
            top, at = height, k
        elif height < top - LEAST_RIDGE_HEIGHT:
            if at > 0:
                maxima.append(at)
            climbed, low = False, height
    return maxima


def _parabola_minimum(undeformed_distance: UndeformedDistance, x: float, y: float, axis: int) -> float:
    """Position (m) of the minimum, along an axis, of the parabola through three nearby points; the given position if
    there is none.
    """
    nodes, here, step = (
        (undeformed_distance.y, y, undeformed_distance.dy)
        if axis
        else (undeformed_distance.x, x, undeformed_distance.dx)
    )
    middle = min(max(here, nodes[0] + step / 4), nodes[-1] - step / 4)
    points = middle + np.array([-0.25, 0.0, 0.25]) * step
    left, centre, right = undeformed_distance.at(
        points if not axis else np.full(3, x), np.full(3, y) if not axis else points
    )
    curvature = left - 2.0 * centre + right
    if curvature <= 0.0:
        return here
    moved = middle - 0.125 * step * (right - left) / curvature
    return float(min(max(moved, points[0]), points[2]))
