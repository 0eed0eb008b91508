"""Normal contact of two half-spaces with a given undeformed distance: contact area and pressure, without friction.

    gap = distance + u_z(pressure) - approach;   gap = 0 where pressure > 0, pressure = 0 where gap > 0.

Solved by conjugate gradients on the changing contact area (Polonsky and Keer, Wear 231, 1999, 206-219). The problem is
convex, so a pressure that meets all conditions is the answer: ``NormalSolution.residual`` is the proof.

Error of the cells (validation case ``contact_exact``): with 63 cells along each axis of a Hertzian ellipse the approach
is off by 0.003 %, the greatest pressure by 0.02 %, both of order 2, the area by a part of the cells along its edge.
"""

from dataclasses import dataclass

import numpy as np

from models.contact.half_space import CellConvolution, Z, cell_offsets, influence_of_rectangle
from models.contact.inputs import Array, checked_number, checked_quantity
from models.contact.material import MaterialPair
from models.core.errors import InputError, RunFailed

CONTACT_TOLERANCE = 1e-9
"""Largest violation of a contact condition, as a share of the greatest elastic displacement."""
ITERATION_LIMIT = 2000
LARGEST_CELL, LARGEST_APPROACH = 0.1, 0.1
"""Largest cell size and approach (m) that are accepted; larger ones are usually in mm."""
LARGEST_UNEVENNESS = 4e-3
"""Largest difference between the steps of a grid, as a share of their mean."""


@dataclass(frozen=True)
class PressureGrid:
    """A contact pressure on a regular grid of cells.

    pressure : (ny, nx) in Pa, zero outside the contact. x, y : (nx,), (ny,) centres of the cells (m), evenly spaced.
    """

    pressure: Array
    x: Array
    y: Array

    def __post_init__(self) -> None:
        shape = (np.size(self.y), np.size(self.x))
        if np.shape(self.pressure) != shape or min(shape) < 2:
            raise InputError(
                "",
                "pressure",
                list(np.shape(self.pressure)),
                f"must have the shape (ny, nx) of y and x = {shape}, two cells or more each",
            )
        checked_quantity("pressure", self.pressure, "a pressure in Pa, zero or more", 0.0)
        for name, nodes in (("x", self.x), ("y", self.y)):
            steps = np.diff(checked_quantity(name, nodes, "a place in m"))
            if not (steps.min() > 0.0 and np.ptp(steps) <= LARGEST_UNEVENNESS * steps.mean()):
                raise InputError("", name, None, "must ascend in even steps (m)")

    @property
    def dx(self) -> float:
        """Length of a cell along x (m)."""
        return float(self.x[1] - self.x[0])

    @property
    def dy(self) -> float:
        """Width of a cell along y (m)."""
        return float(self.y[1] - self.y[0])

    @property
    def contact(self) -> Array:
        """Whether each cell is in contact, (ny, nx) bool."""
        return self.pressure > 0

    @property
    def load(self) -> float:
        """Resultant force of the pressure (N)."""
        return float(self.pressure.sum() * self.dx * self.dy)

    @property
    def area(self) -> float:
        """Area of the cells in contact (m^2)."""
        return float(np.count_nonzero(self.contact) * self.dx * self.dy)


@dataclass(frozen=True)
class NormalSolution(PressureGrid):
    """Solution of the normal contact problem: pressure, approach and gap.

    approach : rigid approach of the bodies from first touch at distance 0 (m).
    gap : (ny, nx) distance between the deformed surfaces (m).
    residual : largest of |gap| in contact and -gap outside, as a part of the greatest elastic displacement.
    iterations : of the conjugate gradients.
    """

    approach: float
    gap: Array
    residual: float
    iterations: int


def cell_centres(cell_count: int, cell_size: float) -> Array:
    """Positions (m) of the centres of ``cell_count`` cells of size ``cell_size`` (m), symmetric about zero."""
    return (np.arange(cell_count) - (cell_count - 1) / 2) * cell_size


AVERAGING_POINTS = 8
"""Number of points along each axis of a cell over which Hertz' pressure is averaged."""


def hertzian_pressure_grid(a: float, b: float, load: float, cell_count: int) -> PressureGrid:
    """Hertzian pressure on an ellipse with semi-axes a, b (m): means over ``cell_count`` x ``cell_count`` cells, scaled
    to the load (N).
    """
    inner = (np.arange(cell_count * AVERAGING_POINTS) + 0.5) / (cell_count * AVERAGING_POINTS) * 2 - 1
    height = np.sqrt(np.maximum(1 - inner[:, None] ** 2 - inner**2, 0)).reshape(
        cell_count, AVERAGING_POINTS, cell_count, AVERAGING_POINTS
    )
    pressure, dx, dy = height.mean((1, 3)), 2 * a / cell_count, 2 * b / cell_count
    return PressureGrid(
        pressure * load / (pressure.sum() * dx * dy), cell_centres(cell_count, dx), cell_centres(cell_count, dy)
    )


def solve_normal(
    undeformed_distance: Array,
    dx: float,
    dy: float,
    material_pair: MaterialPair,
    *,
    load: float | None = None,
    approach: float | None = None,
) -> NormalSolution:
    """Pressure and contact area of two bodies pressed together without friction.

    Parameters
    ----------
    undeformed_distance : (ny, nx) undeformed distance (m) at the cells' centres; rows are y, columns x. Its zero is
        where the approach counts from. Several separate patches may lie in one grid.
    dx, dy : size of a cell (m)
    material_pair : materials of the two bodies; a mismatch is neglected here (the tractions' effect on the pressure)
    load : normal force (N), or
    approach : rigid approach (m); exactly one of the two

    Raises
    ------
    InputError : a wrong shape or value, or a contact that reaches the edge of the grid
    RunFailed : the contact conditions were not met to ``CONTACT_TOLERANCE``
    """
    undeformed_distance = _checked_distance(undeformed_distance, dx, dy, load, approach)
    rows, columns = undeformed_distance.shape
    x, y = cell_centres(columns, dx), cell_centres(rows, dy)
    if (load is not None and load <= 0) or (approach is not None and not np.any(undeformed_distance < approach)):
        least = float(undeformed_distance.min()) if approach is None else approach
        return NormalSolution(np.zeros(undeformed_distance.shape), x, y, least, undeformed_distance - least, 0.0, 0)
    kernel = influence_of_rectangle(cell_offsets(columns, dx), cell_offsets(rows, dy)[:, None], dx, dy, material_pair)[
        ..., Z, Z
    ]
    displace = CellConvolution(kernel[..., None, None])
    pressure, iterations = _conjugate_gradients(undeformed_distance, displace, load, approach, dx * dy)
    contact = pressure > 0
    if contact[[0, -1]].any() or contact[:, [0, -1]].any():
        raise InputError("", "distance", None, "the contact reaches the edge of the grid: give a larger one")
    displacement = displace(pressure[..., None])[..., 0]  # the conditions are evaluated afresh
    gap = undeformed_distance + displacement
    reached = float(gap[contact].mean()) if approach is None else approach
    gap -= reached
    return NormalSolution(pressure, x, y, reached, gap, _contact_violation(gap, contact, displacement), iterations)


def _checked_distance(
    undeformed_distance: Array, dx: float, dy: float, load: float | None, approach: float | None
) -> Array:
    """The undeformed distance as a numerical array, after checks of all inputs; raises InputError."""
    undeformed_distance = checked_quantity(
        "distance", undeformed_distance, "finite everywhere (m); use a large distance outside the bodies"
    )
    if undeformed_distance.ndim != 2 or min(undeformed_distance.shape) < 2:
        raise InputError(
            "", "distance", list(undeformed_distance.shape), "must have the shape (ny, nx), two cells or more each"
        )
    for name, value in (("dx", dx), ("dy", dy)):
        checked_number(
            name, value, f"the size of a cell in m, above 0 and at most {LARGEST_CELL:g}", 1e-12, LARGEST_CELL
        )
    if (load is None) == (approach is None):
        raise InputError("", "load", load, "give either the load (N) or the approach (m)")
    checked_number("load", 0.0 if load is None else load, "a load in N")
    checked_number(
        "approach", 0.0 if approach is None else approach, "an approach in m", -LARGEST_APPROACH, LARGEST_APPROACH
    )
    return undeformed_distance


def _conjugate_gradients(
    undeformed_distance: Array,
    displacement_by_pressure: CellConvolution,
    load: float | None,
    approach: float | None,
    cell_area: float,
) -> tuple[Array, int]:
    """Pressure (ny, nx) in Pa that satisfies the contact conditions, and the number of iterations."""
    if load is not None:  # even over the grid
        pressure = np.full(undeformed_distance.shape, load / (undeformed_distance.size * cell_area))
    else:  # in proportion to the overlap
        overlap = np.maximum(float(approach or 0.0) - undeformed_distance, 0.0)
        pressure = overlap * (overlap.max() / displacement_by_pressure(overlap[..., None]).max())
    direction, square, restart = np.zeros_like(pressure), 1.0, True
    for iteration in range(1, ITERATION_LIMIT + 1):
        contact = pressure > 0
        displacement = displacement_by_pressure(pressure[..., None])[..., 0]
        gap = undeformed_distance + displacement
        gap -= gap[contact].mean() if approach is None else approach
        if _contact_violation(gap, contact, displacement) < CONTACT_TOLERANCE:
            return pressure, iteration
        before, square = square, float(np.sum(gap[contact] ** 2))
        direction = np.where(contact, gap + (0.0 if restart else square / before) * direction, 0.0)
        response = displacement_by_pressure(direction[..., None])[..., 0]
        if approach is None:
            response -= response[contact].mean()
        step = np.sum(gap[contact] * direction[contact]) / np.sum(response[contact] * direction[contact])
        pressure = np.maximum(pressure - step * direction, 0.0)
        entering = (pressure == 0) & (gap < 0)
        restart = bool(entering.any())
        pressure[entering] -= step * gap[entering]
        if load is not None:
            pressure *= load / (pressure.sum() * cell_area)
    raise RunFailed("normal problem", f"contact conditions not met in {ITERATION_LIMIT} iterations")


def _contact_violation(gap: Array, is_in_contact: Array, displacement: Array) -> float:
    """Largest violation of the contact conditions, as a ratio to the largest displacement."""
    inside, outside = np.abs(gap[is_in_contact]).max(), -gap[~is_in_contact].min(initial=0.0)
    return float(max(inside, outside) / displacement.max())
