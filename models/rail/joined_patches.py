"""Exact normal contact of one wheel with all its contact patches on a common half-space, laid along the rail's contour.

Each patch approaches along its own normal by the cosine of its lean times the vertical approach, which all have in
common. Heights are those over each patch's own plane; lengths along the contour keep the patches apart. That bends one
half-space around the rail's head: exact for one patch, and as good for several as their leans are alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label

from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.normal_problem import cell_centres, solve_normal
from models.contact.patches import Patch, Rectangle
from models.contact.simplified_theory import PatchPressure
from models.core.errors import InputError, RunFailed

CELLS_X, CELLS_Y, MOST_CELLS_Y = 36, 24, 180
"""Count of cells along x, along y over the narrowest patch, and largest count along y."""
GRID_MARGINS = (1.4, 2.0, 3.0)
"""Ratios of the sides of the grid to those of the areas that the simplified theory finds, tried in turn."""
UNKNOWN_HEIGHT = 1e-3
"""Height (m) of the undeformed surfaces over each other where it is not known."""
SOLUTION_PRECISION, MOST_ITERATIONS = 1e-6, 30
"""Relative precision of the vertical load and of the approach; largest count of iterations."""


@dataclass(frozen=True)
class PatchShare:
    """Load that one patch carries, and where it acts.

    load : N, along its normal. x, y : centre of pressure from its place (m). area : m^2. box : sides x0, x1, y0, y1 of
    the rectangle about the area, along the rail and along its contour (m). peak : Pa. piece : number of the piece of
    the contact area in which the patch has its peak; patches that have grown together are of one piece.
    """

    load: float
    x: float
    y: float
    area: float
    box: Rectangle
    peak: float
    piece: int


def exact_patch_shares(
    patches: Sequence[Patch],
    approximate_patches: Sequence[PatchPressure],
    load: float,
    approach: float,
    material_pair: MaterialPair,
    cell_factor: float = 1.0,
) -> tuple[list[PatchShare], float]:
    """Loads and areas of the patches of a wheel under a total vertical load (N), and the vertical approach (m).

    approximate_patches : the patches in contact by the simplified theory, whose areas place the grid; approach : theirs
    (m); cell_factor : how many times as large as usual the cells are. Raises InputError if the contact reaches the edge
    of the grid."""
    for margin in GRID_MARGINS[:-1]:
        try:
            return _patch_shares_on_grid(
                patches, approximate_patches, load, approach, material_pair, margin, cell_factor
            )
        except InputError:  # the contact reaches the edge of the grid
            continue
    return _patch_shares_on_grid(
        patches, approximate_patches, load, approach, material_pair, GRID_MARGINS[-1], cell_factor
    )


def _patch_shares_on_grid(
    patches: Sequence[Patch],
    approximate_patches: Sequence[PatchPressure],
    load: float,
    approach: float,
    material_pair: MaterialPair,
    grid_margin: float,
    cell_factor: float,
) -> tuple[list[PatchShare], float]:
    x, y = _grid_around(approximate_patches, grid_margin, cell_factor)
    cosines = np.cos([patch.lean for patch in patches])
    heights = np.array([_heights_on_grid(patch, x, y) for patch in patches])
    leading = float(np.cos(max(approximate_patches, key=lambda pressure_of_patch: pressure_of_patch.load).patch.lean))
    cell, normal_load = (x[1] - x[0]) * (y[1] - y[0]), load / leading
    has_equal_normals = bool((cosines == leading).all())  # the heights are then the same at any approach
    for _ in range(MOST_ITERATIONS):
        lowered = heights + approach * (leading - cosines)[:, None, None]
        owner = np.argmin(lowered, axis=0)
        solved = solve_normal(lowered.min(axis=0), x[1] - x[0], y[1] - y[0], material_pair, load=normal_load)
        forces = np.array([solved.pressure[owner == k].sum() * cell for k in range(len(patches))])
        vertical, reached = float(forces @ cosines), solved.approach / leading
        close = abs(vertical / load - 1.0) < SOLUTION_PRECISION and (
            has_equal_normals or abs(reached / approach - 1.0) < SOLUTION_PRECISION
        )
        normal_load, approach = normal_load * load / vertical, reached
        if close:
            pieces, _ = label(solved.contact, np.ones((3, 3)))
            return [
                _pressure_share(solved.pressure * (owner == k), x, y, patch.contour_position, cell, pieces)
                for k, patch in enumerate(patches)
            ], approach
    raise RunFailed("joined patches", "the patches' shares of the load were not found")


def _grid_around(
    approximate_patches: Sequence[PatchPressure], grid_margin: float, cell_factor: float
) -> tuple[Array, Array]:
    """Cell centres (m) of a grid around all patches, along x and along the contour."""
    x0, x1 = min(patch.box[0] for patch in approximate_patches), max(patch.box[1] for patch in approximate_patches)
    y0 = min(patch.box[2] + patch.patch.contour_position for patch in approximate_patches)
    y1 = max(patch.box[3] + patch.patch.contour_position for patch in approximate_patches)
    high = grid_margin * (y1 - y0)
    narrowest = min(patch.box[3] - patch.box[2] for patch in approximate_patches)
    rows = round(min(round(CELLS_Y * high / narrowest), MOST_CELLS_Y) / cell_factor)
    columns = round(CELLS_X / cell_factor)
    x_centres = (x0 + x1) / 2.0 + cell_centres(columns, grid_margin * (x1 - x0) / columns)
    return x_centres, (y0 + y1) / 2.0 + cell_centres(rows, high / rows)


def _heights_on_grid(patch: Patch, x: Array, y: Array) -> Array:
    """Heights (ny, nx) of a patch along its normal, at the grid's points on the common contour."""
    known, across = patch.distance, y - patch.contour_position
    is_inside = (across >= known.y[0]) & (across <= known.y[-1])
    heights = np.full((y.size, x.size), UNKNOWN_HEIGHT)
    heights[is_inside] = known.at(np.clip(x, known.x[0], known.x[-1])[None, :], across[is_inside][:, None])
    return heights


def _pressure_share(
    pressure: Array, x: Array, y: Array, contour_position: float, cell_area: float, piece_labels: Array
) -> PatchShare:
    """``PatchShare`` of a patch whose origin is at a position on the contour (m); ``pressure`` (Pa) is zero outside
    this patch."""
    total = float(pressure.sum())
    if total == 0.0:
        return PatchShare(0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0), 0.0, 0)
    box = (*_outer_edges(x, pressure.sum(axis=0) > 0.0), *_outer_edges(y, pressure.sum(axis=1) > 0.0))
    return PatchShare(
        total * cell_area,
        float((pressure.sum(axis=0) @ x) / total),
        float((pressure.sum(axis=1) @ y) / total) - contour_position,
        float(np.count_nonzero(pressure) * cell_area),
        box,
        float(pressure.max()),
        int(piece_labels.flat[np.argmax(pressure)]),
    )


def _outer_edges(cell_positions: Array, is_inside: Array) -> tuple[float, float]:
    """Positions (m) of the outer edges of the first and the last cell that are inside."""
    half = (cell_positions[1] - cell_positions[0]) / 2.0
    return float(cell_positions[is_inside][0] - half), float(cell_positions[is_inside][-1] + half)
