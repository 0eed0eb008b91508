"""Compiled parts of Kalker's theory of 1983: fit on the coarse grid, strips of the fine one, march along them."""

import math
from typing import NamedTuple

import numpy as np

from models.contact.distance_kernels import row_at, value_along_row, value_and_slopes
from models.contact.inputs import Array
from models.machine.compiled import compiled

PARABOLIC, ELLIPTIC = 0, 1
"""Shape of the pressure over the depth d - h: proportional, as in the theory, or to its root, as by Hertz."""
DISPLACEMENT, GRADIENT = 0, 1
"""Quantity that the least squares fit."""
POINTS_PER_MESH = 3
"""Number of points per coarse cell and axis at which the pressure is summed to the load."""
LEAST_STIFFNESS_SHARE = 0.2
"""Least stiffness 1/W as a share of depth over mean displacement; a Hertzian contact has about 1.2. A flat or ringlike
bottom leaves the fit undefined, and this bound keeps it positive."""
PairOfNumbers = tuple[float, float]


class PatchSurface(NamedTuple):
    """A patch at a depth: padded heights, first node and spacing along x and y, rectangle x0, x1, y0, y1 about it,
    depth and least distance (m)."""

    padded: Array
    origin: PairOfNumbers
    step: PairOfNumbers
    box: tuple[float, float, float, float]
    depth: float
    low: float


class FineGrid(NamedTuple):
    """Strips of a patch: y, low and high end in x (s,) and width (m); pressure (s, n) in the cells from the leading
    edge back (Pa)."""

    y: Array
    low_x: Array
    high_x: Array
    width: float
    pressure: Array


@compiled
def overlap_pressure(surface, height, pressure_shape):
    """W times the pressure at a height: depth - height (parabolic), or the elliptic root function with the same value
    at the bottom."""
    over = surface.depth - height
    if over <= 0.0:
        return 0.0
    return over if pressure_shape == PARABOLIC else math.sqrt(over * (surface.depth - surface.low))


@compiled
def cell_sizes(rectangle, cell_count):
    """Cell sizes dx, dy (m) of a grid of cells x cells over a rectangle."""
    return (rectangle[1] - rectangle[0]) / cell_count, (rectangle[3] - rectangle[2]) / cell_count


@compiled
def coarse_cells(surface, cell_count, pressure_shape):
    """Height, W p and covered share of every cell of the coarse grid (cells, cells), rows along y. The share of a mesh
    that the contact covers, for a straight edge: it makes meshes enter and leave without a jump.
    """
    shape = cell_count, cell_count
    height, pressure, cover = np.empty(shape), np.empty(shape), np.empty(shape)
    padded, origin, step, box, depth, _ = surface
    dx, dy = cell_sizes(box, cell_count)
    for j in range(cell_count):
        v = (box[2] + (j + 0.5) * dy - origin[1]) / step[1]
        for i in range(cell_count):
            u = (box[0] + (i + 0.5) * dx - origin[0]) / step[0]
            h, slope_x, slope_y = value_and_slopes(padded, u, v)
            fall = abs(slope_x) * dx / step[0] + abs(slope_y) * dy / step[1]
            height[j, i], pressure[j, i] = h, overlap_pressure(surface, h, pressure_shape)
            share = 0.5 + (depth - h) / fall if fall > 0.0 else (1.0 if h < depth else 0.0)
            cover[j, i] = min(max(share, 0.0), 1.0)
    return height, pressure, cover


@compiled
def pressure_resultant(surface, point_count, pressure_shape):
    """Integral of W p over the rectangle (m^3), by the midpoint rule with points x points points."""
    total, (padded, origin, step, box, _, _) = 0.0, surface
    dx, dy = cell_sizes(box, point_count)
    for j in range(point_count):
        row = row_at(padded, (box[2] + (j + 0.5) * dy - origin[1]) / step[1])
        for i in range(point_count):
            height = value_along_row(row, (box[0] + (i + 0.5) * dx - origin[0]) / step[0])
            total += overlap_pressure(surface, height, pressure_shape)
    return total * dx * dy


@compiled
def corner_integral(x, y):
    """Integral of 1/r over the rectangle from the origin to (x, y), signed (Boussinesq; Johnson, section 3.3)."""
    along = x * math.asinh(y / abs(x)) if x != 0.0 else 0.0
    across = y * math.asinh(x / abs(y)) if y != 0.0 else 0.0
    return along + across


@compiled
def normal_displacement(pressure, dx, dy, contact_modulus):
    """Normal displacement (m) of both bodies together at the centres of the grid cells, by a pressure (Pa) on each
    cell."""
    cells = pressure.shape[0]
    edges = np.empty((cells + 1, cells + 1))
    for j in range(cells + 1):
        for i in range(cells + 1):
            edges[j, i] = corner_integral((i - 0.5) * dx, (j - 0.5) * dy)
    influence = np.empty((cells, 2 * cells - 1))  # by rows apart, and columns apart from 1 - cells on
    for j in range(cells):
        for i in range(2 * cells - 1):
            k = abs(i - cells + 1)
            influence[j, i] = edges[j + 1, k + 1] - edges[j + 1, k] - edges[j, k + 1] + edges[j, k]
    sums = np.zeros((cells, cells))
    for row in range(cells):
        for column in range(cells):
            p = pressure[row, column]
            if p > 0.0:
                for j in range(cells):
                    k, first = abs(j - row), cells - 1 - column
                    for i in range(cells):
                        sums[j, i] += influence[k, first + i] * p
    return sums / (math.pi * contact_modulus)


@compiled
def covariances(displacements, heights, covered_shares):
    """Weighted mean of u; weighted sums (not divided) for the covariance of u and h and the variance of u. The covered
    shares are the weights."""
    mean_u, mean_h = weighted_mean(displacements, covered_shares), weighted_mean(heights, covered_shares)
    both = square = 0.0
    for k in range(displacements.size):
        du = displacements.flat[k] - mean_u
        both += covered_shares.flat[k] * du * (heights.flat[k] - mean_h)
        square += covered_shares.flat[k] * du * du
    return mean_u, both, square


@compiled
def weighted_mean(cell_values, cell_weights):
    """Weighted mean of values of any shape. Loops compile ten times as fast as array expressions."""
    total = weight = 0.0
    for k in range(cell_values.size):
        total += cell_weights.flat[k] * cell_values.flat[k]
        weight += cell_weights.flat[k]
    return total / weight


@compiled
def slope_products(u, h, covered_shares, dx, dy, along_y):
    """Weighted sums over neighbouring cells: products of the slopes of u and h, and squares of the slopes of u."""
    product = square = 0.0
    for down in range(2 if along_y else 1):
        right, step = 1 - down, dy if down else dx
        for j in range(u.shape[0] - down):
            for i in range(u.shape[1] - right):
                w = covered_shares[j, i] * covered_shares[j + down, i + right]
                du, dh = (u[j + down, i + right] - u[j, i]) / step, (h[j + down, i + right] - h[j, i]) / step
                product += w * du * dh
                square += w * du * du
    return product, square


@compiled
def coarse_fit(surface, cell_count, pressure_shape, fit_kind, contact_modulus):
    """Stiffness 1/W (Pa/m), rigid approach (m) and integral of W p over the area, for one patch at a penetration depth.

    The approach is the mean of u + h weighted by the pressure: the work of the pressure by the load.
    """
    height, pressure, cover = coarse_cells(surface, cell_count, pressure_shape)
    dx, dy = cell_sizes(surface.box, cell_count)
    u = normal_displacement(pressure, dx, dy, contact_modulus)
    mean_u, both, square = covariances(u, height, cover)
    if fit_kind == GRADIENT:
        both, square = slope_products(u, height, cover, dx, dy, True)
    least = LEAST_STIFFNESS_SHARE * (surface.depth - surface.low) / mean_u
    stiffness = max(-both / square, least) if square > 0.0 else least
    total = pressure_resultant(surface, POINTS_PER_MESH * cell_count, pressure_shape)
    approach = stiffness * weighted_mean(u, pressure) + weighted_mean(height, pressure)
    return stiffness, approach, total


@compiled
def tangential_displacement(traction, dx, dy, nu):
    """Displacement (2, cells, cells) times pi G at the cells' centres, by a traction of this shape (Cerruti)."""
    cells = traction.shape[1]
    corners = np.empty((3, cells + 1, cells + 1))  # integrals of y^2/r^3, x^2/r^3 and xy/r^3 from the origin
    for j in range(cells + 1):
        y = (j - 0.5) * dy
        for i in range(cells + 1):
            x = (i - 0.5) * dx
            corners[0, j, i], corners[1, j, i] = x * math.asinh(y / abs(x)), y * math.asinh(x / abs(y))
            corners[2, j, i] = -math.hypot(x, y)
    influence = np.empty((3, cells, 2 * cells - 1))  # along x, along y, across; by rows apart and columns as above
    for j in range(cells):
        for i in range(2 * cells - 1):
            k = abs(i - cells + 1)
            whole = corners[:, j + 1, k + 1] - corners[:, j + 1, k] - corners[:, j, k + 1] + corners[:, j, k]
            influence[0, j, i] = (1.0 - nu) * whole[0] + whole[1]
            influence[1, j, i] = whole[0] + (1.0 - nu) * whole[1]
            influence[2, j, i] = nu * whole[2] if i >= cells - 1 else -nu * whole[2]
    sums = np.zeros((2, cells, cells))
    for row in range(cells):
        for column in range(cells):
            px, py = traction[0, row, column], traction[1, row, column]
            for j in range(cells):
                k, first, side = abs(j - row), cells - 1 - column, 1.0 if j >= row else -1.0
                for i in range(cells):
                    across = side * influence[2, k, first + i]
                    sums[0, j, i] += influence[0, k, first + i] * px + across * py
                    sums[1, j, i] += across * px + influence[1, k, first + i] * py
    return sums


@compiled
def tangential_fit(displacements, traction, covered_shares, dx, dy, fit_kind):
    """Flexibility W_1 = W_2 (m/Pa) from the least-squares fit u = W p + a, u and p both (2, cells, cells); 0 if no fit
    is possible.

    Both directions are fitted together, weighted by the covered shares, by DISPLACEMENT or by its GRADIENT along x.
    """
    both = square = 0.0
    for k in range(2):
        if fit_kind == GRADIENT:
            product, size = slope_products(traction[k], displacements[k], covered_shares, dx, dy, False)
        else:
            _, product, size = covariances(traction[k], displacements[k], covered_shares)
        both += product
        square += size
    return both / square if square > 0.0 and both > 0.0 else 0.0


@compiled
def normal_displacement_sums(x, y, loads, at_x, at_y):
    """Sum of force / r at points; times 1 / (pi E*) it is the normal displacement by loads (N) of another patch.

    All arguments are flat: loads at x, y, points at_x, at_y (m).
    """
    sums = np.zeros(at_x.size)
    for k in range(at_x.size):
        for m in range(x.size):
            if loads[m] > 0.0:
                sums[k] += loads[m] / math.hypot(x[m] - at_x[k], y[m] - at_y[k])
    return sums


@compiled
def tangential_displacement_sums(x, y, tangential_loads, at_x, at_y, nu):
    """Tangential displacements (2, points) times pi G at points, by tangential loads (2, n) (Cerruti; Johnson, section
    3.6)."""
    sums = np.zeros((2, at_x.size))
    for k in range(at_x.size):
        for m in range(x.size):
            u, v = at_x[k] - x[m], at_y[k] - y[m]
            r = math.hypot(u, v)
            along = nu * (u * tangential_loads[0, m] + v * tangential_loads[1, m]) / r**3
            sums[0, k] += (1.0 - nu) * tangential_loads[0, m] / r + u * along
            sums[1, k] += (1.0 - nu) * tangential_loads[1, m] / r + v * along
    return sums


@compiled
def fine_strips(surface, line_count, cell_count, pressure_shape):
    """``FineGrid`` of a patch, with the product W p in place of the pressure.

    Each of ``line_count`` lines gives one strip per interval in which h < depth, its ends where the interpolation
    passes the depth.
    """
    (padded, origin, step, box, depth, _), looks = surface, 2
    width = (box[3] - box[2]) / line_count
    first = max(int((box[0] - origin[0]) / step[0] * looks) - 1, 0)
    last = min(int((box[1] - origin[0]) / step[0] * looks) + 2, (padded.shape[1] - 3) * looks)
    most = line_count * (1 + (last - first) // 2)
    y, low_x, high_x = np.empty(most), np.empty(most), np.empty(most)
    count = 0
    for k in range(line_count):
        centre = box[2] + (k + 0.5) * width
        row = row_at(padded, (centre - origin[1]) / step[1])
        inside = value_along_row(row, first / looks) < depth
        start = first / looks
        for m in range(first + 1, last + 1):
            now = value_along_row(row, m / looks) < depth
            if now and not inside:
                start = depth_crossing(row, depth, m / looks, (m - 1) / looks)
            if inside and (not now or m == last):
                end = depth_crossing(row, depth, (m - 1) / looks, m / looks) if not now else m / looks
                y[count], low_x[count], high_x[count] = centre, origin[0] + start * step[0], origin[0] + end * step[0]
                count += 1
            inside = now
    pressure = np.empty((count, cell_count))
    for s in range(count):
        row = row_at(padded, (y[s] - origin[1]) / step[1])
        length = (high_x[s] - low_x[s]) / cell_count
        for i in range(cell_count):
            h = value_along_row(row, (high_x[s] - (i + 0.5) * length - origin[0]) / step[0])
            pressure[s, i] = overlap_pressure(surface, h, pressure_shape)
    return FineGrid(y[:count].copy(), low_x[:count].copy(), high_x[:count].copy(), width, pressure)


@compiled
def depth_crossing(height_row, depth, inner, outer):
    """Position where the row's height equals the depth, between points below and not below it (false position, Illinois
    rule)."""
    at_inner, at_outer = value_along_row(height_row, inner) - depth, value_along_row(height_row, outer) - depth
    middle, kept = outer, 0
    for _ in range(30):
        middle = inner - at_inner * (outer - inner) / (at_outer - at_inner)
        height = value_along_row(height_row, middle) - depth
        if abs(height) < 1e-13 * (at_outer - at_inner) or abs(outer - inner) < 1e-12:
            break
        if height < 0.0:
            inner, at_inner = middle, height
            at_outer *= 0.5 if kept < 0 else 1.0
            kept = -1
        else:
            outer, at_outer = middle, height
            at_inner *= 0.5 if kept > 0 else 1.0
            kept = 1
    return middle


@compiled
def march_strips(fine_net, mu, flexibility, creepages, traction):
    """FASTSIM along the strips of a ``FineGrid``, for creepages and spin ``creepages``; fills the tractions (s, n, 2).

    Returns fx, fy (N), mz (N m, about x = y = 0), the area that sticks and the whole area (m^2). The march is the
    second-order one: half a first step, and the exact turning of a slipping traction.
    """
    (y, low_x, high_x, width, pressure), (xi_x, xi_y, spin) = fine_net, creepages
    fx = fy = mz = stuck = area = 0.0
    cells = pressure.shape[1]
    for s in range(y.size):
        length = (high_x[s] - low_x[s]) / cells
        px = py = before = 0.0
        slips = False
        for i in range(cells):
            x = high_x[s] - (i + 0.5) * length
            go, middle = (length, x + 0.5 * length) if i > 0 else (0.5 * length, x + 0.25 * length)
            u, v = go * (xi_x - spin * y[s]) / flexibility, go * (xi_y + spin * middle) / flexibility
            bound = mu * pressure[s, i]
            px, py, slips = traction_after_step(px, py, u, v, bound, 0.5 * (before + bound), slips)
            before = bound
            traction[s, i, 0], traction[s, i, 1] = px, py
            cell = length * width
            fx += px * cell
            fy += py * cell
            mz += (x * py - y[s] * px) * cell
            stuck += 0.0 if slips else cell
            area += cell
    return fx, fy, mz, stuck, area


@compiled
def traction_after_step(px, py, slip_x, slip_y, traction_bound, middle_bound, is_slipping):
    """Traction after a step, and whether it slips; a cell that sticks loses the rigid slip from its traction.

    A traction that continues to slip stays on the bound and turns against the slip: with psi between the two,
    tan(psi/2) shrinks by exp(-|slip| / middle_bound), where ``middle_bound`` is the bound in the middle of the step.
    """
    x, y = px - slip_x, py - slip_y
    size = math.hypot(x, y)
    if size <= traction_bound:
        return x, y, False
    slip, before = math.hypot(slip_x, slip_y), math.hypot(px, py)
    if is_slipping and slip > 0.0 and before > 0.0 and middle_bound > 0.0:
        cosine, sine = -(px * slip_x + py * slip_y) / (before * slip), (px * slip_y - py * slip_x) / (before * slip)
        shrunk = math.exp(-slip / middle_bound)
        over, aside = (1.0 + cosine, shrunk * sine) if cosine > 0.0 else (sine, shrunk * (1.0 - cosine))
        square = over * over + aside * aside
        if square > 0.0:
            cosine, sine = (over * over - aside * aside) / square, 2.0 * over * aside / square
        x, y, size = -cosine * slip_x + sine * slip_y, -cosine * slip_y - sine * slip_x, slip
    return traction_bound * x / size, traction_bound * y / size, True


@compiled
def coarse_tractions(fine_net, traction, rectangle, cell_count):
    """Mean tractions (2, cells, cells) on the coarse grid; each strip cell counts by its overlap with the coarse
    cell."""
    (y, low_x, high_x, width, _), sums = fine_net, np.zeros((2, cell_count, cell_count))
    dx, dy = cell_sizes(rectangle, cell_count)
    steps = traction.shape[1]
    for s in range(y.size):
        length = (high_x[s] - low_x[s]) / steps
        bottom, top = (y[s] - 0.5 * width - rectangle[2]) / dy, (y[s] + 0.5 * width - rectangle[2]) / dy
        for j in range(max(int(bottom), 0), min(int(top) + 1, cell_count)):
            high = max(min(top, j + 1.0) - max(bottom, 1.0 * j), 0.0)
            for i in range(steps):
                right = (high_x[s] - i * length - rectangle[0]) / dx
                left = right - length / dx
                for k in range(max(int(left), 0), min(int(right) + 1, cell_count)):
                    share = high * max(min(right, k + 1.0) - max(left, 1.0 * k), 0.0)
                    sums[0, j, k] += share * traction[s, i, 0]
                    sums[1, j, k] += share * traction[s, i, 1]
    return sums
