"""Kalker's simplified theory of 1983 for a contact patch in plain Python, for comparison with
``models.contact.simplified_kernels``.

Cubic convolution is a Hermite spline whose slopes are central differences (scipy has such splines, and their roots);
sums over the half-space are convolutions with ``half_space.influence``; fits are numpy's weighted covariances; the
march runs on complex numbers. Units, axes and signs are those of ``models.contact``.
"""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq
from scipy.signal import convolve2d

from models.contact.half_space import Z, cell_offsets, influence_of_rectangle
from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.simplified_kernels import LEAST_STIFFNESS_SHARE, POINTS_PER_MESH
from models.contact.simplified_theory import SimplifiedOptions

Box = tuple[float, float, float, float]


def hermite_spline(node_positions: Array, padded_values: Array) -> CubicHermiteSpline:
    """Cubic spline along the first axis through values at equally spaced nodes; ``padded_values`` contains the values
    and an extra value at each end."""
    return CubicHermiteSpline(
        node_positions,
        padded_values[1:-1],
        (padded_values[2:] - padded_values[:-2]) / (node_positions[2] - node_positions[0]),
    )


def extrapolated_rows(values_in_rows: Array) -> Array:
    """The rows with an extra row at each end, extrapolated by the parabola through the three outermost rows."""
    return np.concatenate(
        [
            [3 * values_in_rows[0] - 3 * values_in_rows[1] + values_in_rows[2]],
            values_in_rows,
            [3 * values_in_rows[-1] - 3 * values_in_rows[-2] + values_in_rows[-3]],
        ]
    )


@dataclass(frozen=True, eq=False)
class PlainBodies:
    """Undeformed distance of two bodies: nodes x (nx,) and y (ny,), heights (ny, nx) in m, and position of the lowest
    point (m)."""

    x: Array
    y: Array
    heights: Array
    bottom: tuple[float, float]

    @cached_property
    def padded(self) -> Array:
        """Heights with one extrapolated node added on every side."""
        return extrapolated_rows(extrapolated_rows(self.heights).T).T

    def line(self, y: float, derivative_order: int = 0) -> CubicHermiteSpline:
        """Spline over x of the undeformed distance at a position y, or of its y derivative of an order."""
        return hermite_spline(self.x, hermite_spline(self.y, self.padded)(y, derivative_order))

    def at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Undeformed distance (m) and its slopes in x and y, each (ny, nx), on the grid of x (nx,) and y (ny,)."""
        lines, steep = [self.line(each) for each in y], [self.line(each, 1) for each in y]
        return np.array([f(x) for f in lines]), np.array([f(x, 1) for f in lines]), np.array([f(x) for f in steep])

    @cached_property
    def low(self) -> float:
        """Undeformed distance (m) at the lowest point."""
        return float(self.line(self.bottom[1])(self.bottom[0]))

    @cached_property
    def valleys(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """For lines across x and across y: their positions (two per node spacing, and one through the lowest point),
        and the square root of each line's least distance above the lowest point."""
        swapped = PlainBodies(self.y, self.x, self.heights.T, self.bottom[::-1])
        return swapped._valley(), self._valley()

    def _valley(self) -> tuple[Array, Array]:
        lines = np.linspace(self.y[0], self.y[-1], 2 * self.y.size - 1)
        least = np.array([_lowest_value(self.line(y)) for y in lines])
        order = np.argsort(np.append(lines, self.bottom[1]), kind="stable")
        roots = np.append(np.sqrt(np.maximum(least - self.low, 0.0)), 0.0)
        return np.append(lines, self.bottom[1])[order], roots[order]

    def box(self, patch_depth: float) -> Box:
        """Rectangle x0, x1, y0, y1 (m) around the area below a depth (m); the distance must rise to all sides from its
        lowest point."""
        root, ends = math.sqrt(patch_depth - self.low), list[float]()
        for (lines, roots), bottom in zip(self.valleys, self.bottom, strict=True):
            before, after = lines <= bottom, lines >= bottom
            ends += [np.interp(root, roots[before][::-1], lines[before][::-1])]
            ends += [np.interp(root, roots[after], lines[after])]
        return ends[0], ends[1], ends[2], ends[3]


def _lowest_value(spline: CubicHermiteSpline) -> float:
    """Smallest value of a spline between its first and last node."""
    turning = spline.derivative().roots(extrapolate=False)
    return float(min(spline(spline.x).min(), spline(turning[np.isfinite(turning)]).min(initial=np.inf)))


def interval_midpoints(lower_end: float, upper_end: float, interval_count: int) -> Array:
    """Midpoints (interval_count,) of equal intervals between two ends."""
    return lower_end + (np.arange(interval_count) + 0.5) * (upper_end - lower_end) / interval_count


def pressure_from_heights(
    patch_depth: float, lowest_height: float, heights: Array, solver_options: SimplifiedOptions
) -> Array:
    """Pressure times flexibility W (m) at heights (m), for a contact whose area lies below a depth (m)."""
    over = np.maximum(patch_depth - heights, 0.0)
    return over if solver_options.shape == "parabolic" else np.sqrt(over * (patch_depth - lowest_height))


def surface_displacement(
    tractions: Array, cell_size: tuple[float, float], material_pair: MaterialPair, component_indices: Array
) -> Array:
    """Surface displacement (m) on a square grid due to a traction component (Pa) on it. component_indices: indices of
    the displacement and traction components."""
    n = len(tractions)
    kernel = influence_of_rectangle(
        cell_offsets(n, cell_size[0]), cell_offsets(n, cell_size[1])[:, None], *cell_size, material_pair
    )[(..., *component_indices)]
    return convolve2d(kernel, tractions, mode="valid")


@dataclass(frozen=True)
class PlainPatch:
    """A contact patch whose area lies below a depth (m): integral of flexibility W times pressure (m^3), stiffness 1/W
    (Pa/m), approach (m), bounding box (m), and covered share of each cell."""

    depth: float
    volume: float
    stiffness: float
    approach: float
    box: Box
    coverage: Array

    @property
    def load(self) -> float:
        """Normal load (N) of the patch."""
        return self.stiffness * self.volume


def patch_at_depth(
    bodies: PlainBodies, patch_depth: float, material_pair: MaterialPair, solver_options: SimplifiedOptions
) -> PlainPatch:
    """The contact patch below a depth (m), with its stiffness fitted on the coarse grid."""
    box, n = bodies.box(patch_depth), solver_options.net
    step = (box[1] - box[0]) / n, (box[3] - box[2]) / n
    height, slope_x, slope_y = bodies.at(interval_midpoints(*box[:2], n), interval_midpoints(*box[2:], n))
    cover = np.clip(0.5 + (patch_depth - height) / (np.abs(slope_x) * step[0] + np.abs(slope_y) * step[1]), 0.0, 1.0)
    pressure = pressure_from_heights(patch_depth, bodies.low, height, solver_options)
    u = surface_displacement(pressure, step, material_pair, np.array([Z, Z]))
    least = LEAST_STIFFNESS_SHARE * (patch_depth - bodies.low) / np.average(u, weights=cover)
    stiffness = max(-1.0 / fitted_slopes(height[None], u[None], cover, step, solver_options, True), least)
    approach = float(np.average(stiffness * u + height, weights=pressure))
    m = POINTS_PER_MESH * n
    fine = pressure_from_heights(
        patch_depth,
        bodies.low,
        bodies.at(interval_midpoints(*box[:2], m), interval_midpoints(*box[2:], m))[0],
        solver_options,
    )
    return PlainPatch(
        patch_depth, float(fine.sum() * step[0] * step[1] / POINTS_PER_MESH**2), stiffness, approach, box, cover
    )


def fitted_slopes(
    displacements: Array,
    tractions: Array,
    cell_coverage: Array,
    cell_size: tuple[float, float],
    solver_options: SimplifiedOptions,
    by_height: bool = False,
) -> float:
    """Slope of displacements u (k, n, n) over tractions p by weighted least squares, common to all k components, or
    with differences of u and p between neighbouring cells. by_height: p is fitted over u, also with differences along
    y."""
    if solver_options.fit == "displacement":
        parts = np.array(
            [
                np.cov(a.ravel(), b.ravel(), aweights=cell_coverage.ravel(), ddof=0)
                for a, b in zip(displacements, tractions, strict=True)
            ]
        )
        products, squares = parts[:, 0, 1].sum(), parts[:, 1, 1].sum()
    else:
        products = squares = 0.0
        for axis, size in ((2, cell_size[0]), (1, cell_size[1]))[: 2 if by_height else 1]:
            weight = cell_coverage.take(range(1, cell_coverage.shape[axis - 1]), axis - 1) * cell_coverage.take(
                range(cell_coverage.shape[axis - 1] - 1), axis - 1
            )
            du, dp = np.diff(displacements, axis=axis) / size, np.diff(tractions, axis=axis) / size
            products, squares = products + np.sum(weight * du * dp), squares + np.sum(weight * dp * dp)
    return float(squares / products if by_height else products / squares)


def patch_at_approach(
    bodies: PlainBodies, approach: float, material_pair: MaterialPair, solver_options: SimplifiedOptions
) -> PlainPatch:
    """The contact patch at a rigid approach (m) of the bodies."""
    over = approach - bodies.low

    def residual(depth_fraction: float) -> float:
        return (
            patch_at_depth(bodies, bodies.low + depth_fraction * over, material_pair, solver_options).approach
            - approach
        )

    return patch_at_depth(
        bodies, bodies.low + brentq(residual, 0.2, 1.0, xtol=1e-15) * over, material_pair, solver_options
    )


@dataclass(frozen=True, eq=False)
class Strips:
    """Strips of a contact area along rolling: positions y and ends in x, each (strips,), and width (m); pressure
    (strips, cells) in Pa from the leading edge back."""

    y: Array
    lower_x: Array
    upper_x: Array
    width: float
    pressure: Array


def strips(bodies: PlainBodies, patch: PlainPatch, cell_count: int, solver_options: SimplifiedOptions) -> Strips:
    """Strips of a patch, between the two points at which the undeformed distance equals the depth. Strips too short to
    contain a node or a midpoint between nodes are left out, as twinrig searches contact at these points."""
    box, ends = patch.box, []
    for y in interval_midpoints(*box[2:], cell_count):
        line = bodies.line(float(y))
        places = line.solve(patch.depth, extrapolate=False)
        looked = np.linspace(bodies.x[0], bodies.x[-1], 2 * bodies.x.size - 1)
        if places.size and (line(looked) < patch.depth).any():
            ends.append((y, places.min(), places.max(), line))
    y, low, high = (np.array([each[k] for each in ends]) for k in range(3))
    rows = [each[3](interval_midpoints(b, a, cell_count)) for each, a, b in zip(ends, low, high, strict=True)]
    pressure = pressure_from_heights(patch.depth, bodies.low, np.array(rows), solver_options)
    width = (box[3] - box[2]) / cell_count
    carried = np.sum(pressure * (high - low)[:, None] * width / cell_count)
    return Strips(y, low, high, width, pressure * patch.load / carried)


def strip_tractions(
    patch_strips: Strips, mu: float, flexibility: float, creepages_and_spin: tuple[float, float, float]
) -> tuple[Array, Array]:
    """Complex tractions (strips, cells) in Pa by the march along each strip, and whether each cell slips.
    creepages_and_spin: creepages xi_x, xi_y, spin (1/m)."""
    xi_x, xi_y, spin = creepages_and_spin
    tractions, slips = np.zeros(patch_strips.pressure.shape, complex), np.zeros(patch_strips.pressure.shape, bool)
    for s, (y, low, high) in enumerate(zip(patch_strips.y, patch_strips.lower_x, patch_strips.upper_x, strict=True)):
        n = patch_strips.pressure.shape[1]
        dx, p, slipping, before = (high - low) / n, 0j, False, 0.0
        for i, bound in enumerate(mu * patch_strips.pressure[s]):
            x, go = high - (i + 0.5) * dx, dx if i else 0.5 * dx
            rigid = complex(xi_x - spin * y, xi_y + spin * (x + 0.5 * go)) / flexibility
            trial = p - rigid * go
            if abs(trial) <= bound:
                p, slipping = trial, False
            elif slipping:
                psi = cmath.phase(p / -rigid)
                shrunk = math.exp(-abs(rigid) * go / (0.5 * (before + bound)))
                p = bound * -rigid / abs(rigid) * cmath.exp(2j * math.atan(math.tan(0.5 * psi) * shrunk))
            else:
                p, slipping = bound * trial / abs(trial), True
            tractions[s, i], slips[s, i], before = p, slipping, bound
    return tractions, slips


def mean_tractions(patch_strips: Strips, tractions: Array, grid_box: Box, cell_count: int) -> Array:
    """Mean tractions (2, n, n) in Pa in the cells of the coarse grid, weighted by the area that its cells and the
    strips' cells have in common."""
    across = _common_lengths(
        patch_strips.y - 0.5 * patch_strips.width,
        patch_strips.y + 0.5 * patch_strips.width,
        np.linspace(*grid_box[2:], cell_count + 1),
    )
    cells = (
        patch_strips.upper_x[:, None]
        - np.arange(tractions.shape[1] + 1)
        * (patch_strips.upper_x - patch_strips.lower_x)[:, None]
        / tractions.shape[1]
    )
    along = np.array([_common_lengths(row[1:], row[:-1], np.linspace(*grid_box[:2], cell_count + 1)) for row in cells])
    mean = (
        np.einsum("sj,sik,si->jk", across, along, tractions)
        * cell_count**2
        / ((grid_box[1] - grid_box[0]) * (grid_box[3] - grid_box[2]))
    )
    return np.array([mean.real, mean.imag])


def fitted_flexibility(
    patch: PlainPatch,
    patch_strips: Strips,
    tractions: Array,
    material_pair: MaterialPair,
    solver_options: SimplifiedOptions,
) -> float:
    """Tangential flexibility W_1 = W_2 (m/Pa), fitted to the displacements that the tractions cause."""
    n, box = solver_options.net, patch.box
    step = (box[1] - box[0]) / n, (box[3] - box[2]) / n
    p = mean_tractions(patch_strips, tractions, box, n)
    u = np.array(
        [sum(surface_displacement(p[m], step, material_pair, np.array([k, m])) for m in range(2)) for k in range(2)]
    )
    return fitted_slopes(u, p, patch.coverage, step, solver_options)


def _common_lengths(interval_starts: Array, interval_ends: Array, segment_edges: Array) -> Array:
    """Lengths (m, n) that m intervals and the n segments between edges (n + 1,) have in common."""
    return np.maximum(
        np.minimum(interval_ends[:, None], segment_edges[1:])
        - np.maximum(interval_starts[:, None], segment_edges[:-1]),
        0.0,
    )


def roll(
    bodies: PlainBodies,
    patch: PlainPatch,
    mu: float,
    creepages_and_spin: tuple[float, float, float],
    material_pair: MaterialPair,
    cell_count: int,
    solver_options: SimplifiedOptions,
) -> tuple[Array, float]:
    """Rolling contact of a patch: forces fx, fy (N), moment mz (N m) and share of the area that sticks (4,), and
    tangential flexibility W_1 (m/Pa)."""
    net = strips(bodies, patch, cell_count, solver_options)
    first, _ = strip_tractions(net, mu, 1.0 / patch.stiffness, creepages_and_spin)
    flexibility = fitted_flexibility(patch, net, first, material_pair, solver_options)
    p, slips = strip_tractions(net, mu, flexibility, creepages_and_spin)
    area = ((net.upper_x - net.lower_x) / cell_count * net.width)[:, None] * np.ones(cell_count)
    x = np.array([interval_midpoints(b, a, cell_count) for a, b in zip(net.lower_x, net.upper_x, strict=True)])
    force, turn = np.sum(p * area), np.sum((x * p.imag - net.y[:, None] * p.real) * area)
    return np.array([force.real, force.imag, turn, np.sum(area[~slips]) / np.sum(area)]), flexibility
