"""Tables of the rolling radius difference of a wheelset over its lateral displacement.

The difference dr is the rolling radius of the right wheel less that of the left one; the displacement y is positive to
the right, so that dr rises with y where a wheelset steers back to the middle. Between two rows dr is a straight line;
two rows at one displacement are a jump. A table is measured, written down, or worked out from profiles here.

Where profiles first touch is found without load, with the roll that lets both wheels touch, and without yaw.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.inputs import Array, checked_quantity
from models.contact.wheel_on_rail import WheelAndRail, WheelsetPose, lowest_point, touching_pose
from models.core.errors import InputError
from models.core.tables import METRES, read_table

TABLE_COLUMNS = {"y": METRES, "dr": METRES}
"""Columns of a file: displacement to the right, and rolling radius of the right wheel minus that of the left one."""
FEWEST_ROWS = 3
"""Smallest count of rows of a table."""


@dataclass(frozen=True, eq=False)
class RollingRadiusTable:
    """Rolling radius difference over lateral displacement: displacements (n,), rising but for pairs that are jumps, and
    differences (n,), in one unit of length.

    source : the file, for messages. Descending rows are turned round. Raises InputError for values that are not finite,
    fewer than three rows, rows out of order, and three rows at one displacement.
    """

    displacements: Array
    differences: Array
    source: str = ""

    def __post_init__(self) -> None:
        y, dr = (
            checked_quantity(name, getattr(self, name), "finite lengths") for name in ("displacements", "differences")
        )
        if y.ndim != 1 or y.shape != dr.shape or y.size < FEWEST_ROWS:
            shapes = [list(y.shape), list(dr.shape)]
            raise InputError(
                self.source, "table", shapes, f"must be two columns of {FEWEST_ROWS} rows or more, as long"
            )
        if y[0] > y[-1]:
            y, dr = y[::-1], dr[::-1]
        self._check_order(y)
        repeated = np.append(False, (np.diff(y) == 0.0) & (np.diff(dr) == 0.0))
        object.__setattr__(self, "displacements", y[~repeated])
        object.__setattr__(self, "differences", dr[~repeated])

    def _check_order(self, displacements: Array) -> None:
        steps = np.diff(displacements)
        back = np.flatnonzero(steps < 0.0)
        if back.size:
            i = int(back[0]) + 1
            before = f"comes after {displacements[i - 1]:g}"
            allowed = f"{before}: displacements must rise (or fall) from row to row; sort the table"
            raise InputError(self.source, f"displacement, row {i + 1}", float(displacements[i]), allowed)
        thrice = np.flatnonzero((steps[1:] == 0.0) & (steps[:-1] == 0.0))
        if thrice.size:
            i = int(thrice[0])
            allowed = "stands in three rows: two rows at one displacement are a jump, three have no meaning"
            raise InputError(self.source, f"displacement, row {i + 3}", float(displacements[i]), allowed)

    @cached_property
    def potential(self) -> Array:
        """Integral (n,) of the difference from the first row on, in the square of the table's unit."""
        y, dr = self.displacements, self.differences
        return np.append(0.0, np.cumsum(np.diff(y) * (dr[1:] + dr[:-1]) / 2.0))

    @property
    def displacement_range(self) -> tuple[float, float]:
        """First and last displacement of the table."""
        return float(self.displacements[0]), float(self.displacements[-1])

    def section(self, lowest_displacement: float, highest_displacement: float) -> tuple[Array, Array]:
        """Displacements and differences of the section of the table from ``lowest_displacement`` to
        ``highest_displacement``, including both ends.
        """
        y, dr = self.displacements, self.differences
        first_row, last_row = (
            int(np.searchsorted(y, lowest_displacement, "right")),
            int(np.searchsorted(y, highest_displacement, "left")),
        )
        end_differences = self.difference(lowest_displacement, "right"), self.difference(highest_displacement, "left")
        return np.array([lowest_displacement, *y[first_row:last_row], highest_displacement]), np.array(
            [end_differences[0], *dr[first_row:last_row], end_differences[1]]
        )

    def difference(self, displacement: float, side_of_jump: Any = "right") -> float:
        """Rolling radius difference at a displacement; at a jump, the value on the given side of the jump."""
        i, share = self._row_and_fraction(displacement, side_of_jump)
        dr = self.differences
        return float(dr[i] + share * (dr[i + 1] - dr[i]))

    def integral(self, displacement: float) -> float:
        """Integral of the difference from the first row to a displacement, in the square of the table's unit."""
        i, share = self._row_and_fraction(displacement, "right")
        y, dr = self.displacements, self.differences
        step = share * (y[i + 1] - y[i])
        return float(self.potential[i] + step * (dr[i] + 0.5 * share * (dr[i + 1] - dr[i])))

    def _row_and_fraction(self, displacement: float, side_of_jump: Any) -> tuple[int, float]:
        """Index of the row before a displacement, and the fraction of the way from that row to the next."""
        y = self.displacements
        i = int(np.clip(np.searchsorted(y, displacement, side_of_jump) - 1, 0, y.size - 2))
        width = y[i + 1] - y[i]
        return i, float((displacement - y[i]) / width) if width > 0.0 else 0.0

    def without_every_second_row(self) -> "RollingRadiusTable":
        """The table without every second row, but with both ends; it serves to estimate the error of the spacing."""
        kept_rows = np.unique(np.append(np.arange(0, self.displacements.size, 2), self.displacements.size - 1))
        return replace(self, displacements=self.displacements[kept_rows], differences=self.differences[kept_rows])


def read_rolling_radii(table_path: str | Path) -> RollingRadiusTable:
    """Rolling radius table from a CSV file with the columns ``y`` and ``dr``, each in m, cm or mm as its heading says;
    converted to m.

    InputError names the line that is wrong.
    """
    table = read_table(table_path, TABLE_COLUMNS, least_row_count=FEWEST_ROWS)
    return RollingRadiusTable(table["y"], table["dr"], str(table_path))


def rolling_radii_of(
    right_wheel_and_rail: WheelAndRail,
    left_wheel_and_rail: WheelAndRail,
    lateral_displacements: Array,
    report_progress: Callable[[float], Any] = lambda share: None,
) -> RollingRadiusTable:
    """Rolling radius table of two wheels on their rails; the left wheel is described as a mirrored right one.

    lateral_displacements : (n,) m, ascending. Displacements at the ends at which not both wheels touch are left out.
    report_progress : called with the completed share. Raises InputError where fewer than three are left.
    """
    shifts = checked_quantity(
        "displacements", lateral_displacements, "lateral displacements in m from -0.03 to 0.03", -0.03, 0.03
    )
    rows = []
    for k, shift in enumerate(shifts.tolist()):
        report_progress(k / shifts.size)
        try:
            rows.append((shift, *_rolling_radii(right_wheel_and_rail, left_wheel_and_rail, shift)))
        except InputError:
            if rows and shift > 0.0:
                break
            rows = []
    if len(rows) < FEWEST_ROWS:
        raise InputError("", "displacements", None, "both wheels touch their rails at fewer than three of them")
    y, of_right, of_left = np.array(rows).T
    return RollingRadiusTable(y, of_right - of_left)


def _rolling_radii(
    right_wheel_and_rail: WheelAndRail, left_wheel_and_rail: WheelAndRail, lateral_shift: float
) -> tuple[float, float]:
    """Rolling radii (m) of both wheels where they first touch, at a displacement (m) to the right."""
    pose = touching_pose(right_wheel_and_rail, lateral_shift, 0.0, left_wheel_and_rail)
    return rolling_radius(right_wheel_and_rail, pose), rolling_radius(
        left_wheel_and_rail, WheelsetPose(-lateral_shift, 0.0, -pose.roll, pose.fall)
    )


def rolling_radius(wheel_and_rail: WheelAndRail, wheelset_pose: WheelsetPose) -> float:
    """Rolling radius (m) of a wheel at the point nearest to its rail."""
    across = float(
        (
            wheelset_pose.rotation.T
            @ (lowest_point(wheel_and_rail, wheelset_pose) - wheel_and_rail.axle_centre(wheelset_pose))
        )[1]
    )
    return float(wheel_and_rail.wheelset.radius + wheel_and_rail.wheel.curve(across - wheel_and_rail.wheelset.arm))
