"""Several contact patches in the theory of 1983: each has a separate grid and stiffness, the half-space is common.

What the springs are made like is the displacement of the half-space by the pressure of all patches. With p* = W_3 p of
each, the conditions u^H + h = delta are fitted in the meshes of patch k by

    sum over m of cov(u*_k, u*_km) / W_m = -cov(u*_k, h_k),    delta_k = mean(sum over m of u*_km / W_m + h_k),

u*_km the displacement in patch k by p*_m and u*_k their sum. For one patch this is the fit of ``simplified_theory``.
Far apart the others' displacement is even and leaves the covariances; two patches that have grown together are what one
net over both would be. The depths are such that all patches have the same approach. A patch that carries nothing is its
bottom, which the others push.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.patches import Patch
from models.contact.simplified_kernels import (
    GRADIENT,
    LEAST_STIFFNESS_SHARE,
    POINTS_PER_MESH,
    cell_sizes,
    coarse_cells,
    covariances,
    normal_displacement,
    normal_displacement_sums,
    pressure_resultant,
    slope_products,
    tangential_displacement_sums,
)
from models.core.errors import RunFailed

PATCHES_TOLERANCE = 1e-11
"""Relative error of approach and load at which the iteration of several patches ends."""
ROOT_SEARCH_SETTINGS = (("hybr", 0.3, 1.0), ("lm", 0.05, 1.0), ("hybr", 0.05, 1.15), ("hybr", 0.3, 0.9))
"""Root finder, first step and ratio of the start to the given one, tried in turn: where a patch only just touches
beside a large one the fit has kinks, at which a single search may stop.
"""


@dataclass(frozen=True, eq=False)
class CoarseGrid:
    """Coarse grid of one patch, rows along y; for a patch without load it has a single point, the bottom.

    x, y : meshes along the common contour (m). height : h (m). pressure : W p (m). cover : covered shares. step :
    dx, dy of a mesh (m). volume : W times the load (m^3).
    """

    x: Array
    y: Array
    height: Array
    pressure: Array
    cover: Array
    step: tuple[float, float]
    volume: float

    @property
    def forces(self) -> Array:
        """Products of W and the load of every grid cell, as a flat array (m^3)."""
        return (self.pressure * (self.volume / self.pressure.sum())).ravel()


def coarse_grid(patch: Patch, depth: float, cell_count: int, pressure_shape: int) -> CoarseGrid:
    """Coarse grid of a patch at a depth (m), with ``cell_count`` x ``cell_count`` cells."""
    x, y, low = patch.bottom
    nothing = np.zeros((1, 1))
    empty = CoarseGrid(
        nothing + x, nothing + y + patch.contour_position, nothing + low, nothing, nothing, (0.0, 0.0), 0.0
    )
    if depth <= low:
        return empty
    surface, box = patch.surface(depth), patch.box(depth)
    height, pressure, cover = coarse_cells(surface, cell_count, pressure_shape)
    volume = float(pressure_resultant(surface, POINTS_PER_MESH * cell_count, pressure_shape))
    if not (volume > 0.0 and pressure.sum() > 0.0):  # so shallow that rounding leaves nothing of it
        return empty
    dx, dy = cell_sizes(box, cell_count)
    middles = np.arange(cell_count) + 0.5
    y, x = np.meshgrid(box[2] + middles * dy + patch.contour_position, box[0] + middles * dx, indexing="ij")
    return CoarseGrid(x, y, height, pressure, cover, (dx, dy), volume)


def solve_common_approach(
    coarse_grids: Sequence[CoarseGrid],
    material_pair: MaterialPair,
    fit_kind: int,
    least_distances: Array,
    depths: Array,
) -> tuple[Array, Array]:
    """Stiffnesses 1/W (Pa/m) of patches at given depths (m), zero for patches without load, and their approaches
    (m).
    """
    loaded = [k for k, net in enumerate(coarse_grids) if net.volume > 0.0]
    displacements = {
        (k, m): _displacement_by(coarse_grids[m], net, material_pair)
        for k, net in enumerate(coarse_grids)
        for m in loaded
    }
    products, right = np.zeros((len(loaded), len(loaded))), np.zeros(len(loaded))
    for i, k in enumerate(loaded):
        total = np.sum([displacements[k, m] for m in loaded], axis=0)
        products[i] = [_fit_product(coarse_grids[k], total, displacements[k, m], fit_kind) for m in loaded]
        right[i] = -_fit_product(coarse_grids[k], total, coarse_grids[k].height, fit_kind)
    stiffness = np.zeros(len(coarse_grids))
    if loaded:
        least = (
            LEAST_STIFFNESS_SHARE * (depths - least_distances)[loaded] / [np.mean(displacements[k, k]) for k in loaded]
        )
        stiffness[loaded] = np.maximum(np.linalg.lstsq(products, right, rcond=None)[0], least)
    raised_heights = [
        sum((stiffness[m] * displacements[k, m] for m in loaded), coarse_grids[k].height)
        for k in range(len(coarse_grids))
    ]
    approach = [
        (net.pressure * u).sum() / net.pressure.sum() if net.volume > 0.0 else float(u[0, 0]) + depth - low
        for net, u, depth, low in zip(coarse_grids, raised_heights, depths, least_distances, strict=True)
    ]
    return stiffness, np.array(approach)


def _displacement_by(loaded_grid: CoarseGrid, target_grid: CoarseGrid, material_pair: MaterialPair) -> Array:
    """Normal displacement (m) at the points of one grid caused by W times the pressure of another grid, or of
    itself.
    """
    if loaded_grid is target_grid:
        return normal_displacement(loaded_grid.pressure, *loaded_grid.step, material_pair.modulus)
    sums = normal_displacement_sums(
        loaded_grid.x.ravel(), loaded_grid.y.ravel(), loaded_grid.forces, target_grid.x.ravel(), target_grid.y.ravel()
    )
    return sums.reshape(target_grid.x.shape) / (np.pi * material_pair.modulus)


def _fit_product(grid: CoarseGrid, first_field: Array, second_field: Array, fit_kind: int) -> float:
    """Scalar product of two displacement fields for the least-squares fit: of their slopes, or of their deviations from
    the mean.
    """
    if fit_kind == GRADIENT:
        return float(slope_products(first_field, second_field, grid.cover, *grid.step, True)[0])
    return float(covariances(first_field, second_field, grid.cover)[1])


def solve_depths(
    patches: Sequence[Patch],
    start_values: Array,
    load: float | None,
    material_pair: MaterialPair,
    coded_options: tuple[int, int, int],
) -> tuple[Array, Array, Array]:
    """Depths (m) of patches followed by the common rigid approach (m), their stiffnesses (Pa/m) and loads (N).

    start_values : depths and approach near the answer, the approach the answer itself if there is no load. load : N
    along the common direction. coded_options : cells of a net, shape and kind of fit.
    """
    lows, along = np.array([patch.low for patch in patches]), np.cos([patch.lean for patch in patches])
    zero, (cells, shape, kind) = np.append(lows, lows.min()), coded_options
    unit = float(start_values[-1] - lows.min())

    def state(depths_and_approach: Array) -> tuple[Array, Array, Array, Array]:
        *depths, approach = answer = zero + unit * depths_and_approach
        nets = [coarse_grid(patch, float(d), cells, shape) for patch, d in zip(patches, depths, strict=True)]
        stiffness, reached = solve_common_approach(nets, material_pair, kind, lows, answer[:-1])
        loads = stiffness * [net.volume for net in nets]
        last = (approach - start_values[-1]) / unit if load is None else loads @ along / load - 1.0
        return np.append((reached - approach * along) / unit, last), answer, stiffness, loads

    for method, factor, share in ROOT_SEARCH_SETTINGS:
        solved = root(
            lambda over: state(over)[0],
            share * (start_values - zero) / unit,
            method=method,
            options={"xtol": 1e-14, "factor": factor},
        )
        off, answer, stiffness, loads = state(solved.x)
        if np.abs(off).max() <= PATCHES_TOLERANCE:
            return answer, stiffness, loads
    raise RunFailed("simplified theory", f"patches at an approach near {answer[-1]:.4g} m did not settle")


def displacement_by_others(
    coarse_grids: Sequence[CoarseGrid], tractions: Sequence[Array], grid_index: int, material_pair: MaterialPair
) -> Array:
    """Tangential displacement (2, cells, cells) in m of grid k caused by the tractions (2, cells, cells) in Pa on all
    other grids.
    """
    result, target = np.zeros_like(tractions[grid_index]), coarse_grids[grid_index]
    for m, (source, traction) in enumerate(zip(coarse_grids, tractions, strict=True)):
        if m != grid_index:
            forces = traction.reshape(2, -1) * (source.step[0] * source.step[1])
            positions = source.x.ravel(), source.y.ravel(), target.x.ravel(), target.y.ravel()
            result += tangential_displacement_sums(*positions[:2], forces, *positions[2:], material_pair.nu).reshape(
                result.shape
            ) / (np.pi * material_pair.G)
    return result
