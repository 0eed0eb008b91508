"""Derivatives of FASTSIM's forces with respect to creepages, spin and load, by differentiating its march exactly.

A sticking traction changes as the sum that it is. A slipping one keeps its size and only turns, so its derivative is
that of its angle: with phi the angle of -w, psi from there to the traction, and z = |w| step / g,

    d angle = d phi + (sin psi' / sin psi) d psi - sin psi' dz,

psi' being psi after the step. The load enters through the scale alone: forces divided by mu N depend on creepages by
N/(a b) and nothing else, so its derivative follows from the others (Euler's theorem).
"""

import math
from dataclasses import dataclass

import numpy as np

from models.contact.fastsim import (
    FLEXIBILITY_KINDS,
    FlexibilityChoice,
    RollingEllipse,
    check_fastsim_choices,
    contact_records,
)
from models.contact.fastsim_grid import BoundShape, grids_of_ratios
from models.contact.fastsim_kernels import (
    LARGEST_EXPONENT,
    NEGLIGIBLE_SLIP,
    advance_traction,
    cut_to_bound,
    turning_slip_point,
)
from models.contact.fastsim_many import (
    ONE_FLEXIBILITY,
    add_strip,
    blend_weight,
    mean_flexibility,
    rigid_slip,
    traction_stiffnesses,
    transmits_force,
)
from models.contact.fastsim_records import FORCES
from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.machine.compiled import compiled


@dataclass(frozen=True)
class CreepForceDerivatives:
    """Creep forces with their derivatives.

    forces : (..., 3) of fx, fy (N), mz (N m). slopes : (..., 3, 4), of each to xi_x, xi_y, spin (1/m) and load (N).
    """

    forces: Array
    slopes: Array


def creep_force_derivatives(
    ellipse: RollingEllipse,
    material_pair: MaterialPair,
    *,
    cells: int = 21,
    bound: BoundShape = "intermediate",
    flexibilities: FlexibilityChoice = "blended",
    axes_grow_with_load: bool = True,
) -> CreepForceDerivatives:
    """Creep forces of FASTSIM with the second-order march, and their derivatives; the same parameters and errors as
    ``fastsim``.

    axes_grow_with_load : whether the semi-axes grow with the load, as its cube root (Hertz, bodies of given shape), or
    stay

    They are those of the march itself but for the size of its jumps, where a cell begins to stick or slip. Without
    load or friction all are zero.
    """
    check_fastsim_choices(cells, bound, flexibilities, "second-order")
    contacts, shape = contact_records(ellipse, material_pair)
    forces, slopes = np.zeros((len(contacts), 3)), np.zeros((len(contacts), 3, 4))
    for rows, net in grids_of_ratios(contacts["a"] / contacts["b"], cells, bound):
        net_forces, net_slopes = np.zeros(rows.size, FORCES), np.zeros((rows.size, 3, 3))
        _fill_force_derivatives(contacts[rows], *net.records, FLEXIBILITY_KINDS[flexibilities], net_forces, net_slopes)
        forces[rows] = np.column_stack([net_forces[name] for name in ("fx", "fy", "mz")])
        slopes[rows, :, :3] = net_slopes
    touching = (contacts["load"] > 0.0) & (contacts["mu"] > 0.0)
    motion = np.column_stack([contacts[name][touching] for name in ("xi_x", "xi_y", "spin")])
    moving = slopes[touching, :, :3] * motion[:, None]
    if axes_grow_with_load:  # fx / N is a function of xi N^(-1/3) and spin, mz / N^(4/3) as well
        change = forces[touching] * np.array([1.0, 1.0, 4.0 / 3.0]) - moving[:, :, :2].sum(axis=2) / 3.0
    else:
        change = forces[touching] - moving.sum(axis=2)
    slopes[touching, :, 3] = change / contacts["load"][touching, None]
    return CreepForceDerivatives(forces.reshape(*shape, 3), slopes.reshape(*shape, 3, 4))


@compiled
def _fill_force_derivatives(contacts, grid_strips, strip_cells, flexibility_kind, forces_out, force_derivatives):
    """Fill FORCES (n,), without the sticking share, and their derivatives (n, 3, 3) with respect to the creepages."""
    sums, moved, total, scale = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for c in range(len(contacts)):
        contact = contacts[c]
        if not transmits_force(contact):
            continue
        slip = rigid_slip(contact, strip_cells, flexibility_kind)
        _rigid_slip_derivatives(contact, strip_cells, flexibility_kind, scale)
        total[:] = 0.0
        for s in range(grid_strips.y.size):
            _fill_strip_sums(contact, grid_strips, s, strip_cells, slip, sums, moved)
            add_strip(contact, grid_strips, s, (sums[0], sums[1], sums[2]), forces_out[c])
            part = contact.mu * contact.load * grid_strips.part[s]
            arm, off = contact.a * grid_strips.half[s], contact.b * grid_strips.y[s]
            for k in range(3):  # loops, as array expressions take seconds to compile
                total[0, k] += part * moved[0, k]
                total[1, k] += part * moved[1, k]
                total[2, k] += part * (arm * moved[2, k] - off * moved[0, k])
        for f in range(3):
            for k in range(3):
                force_derivatives[c, f, k] = (
                    total[f, 0] * scale[0, k] + total[f, 1] * scale[1, k] + total[f, 2] * scale[2, k]
                )


@compiled
def _rigid_slip_derivatives(contact, strip_cells, flexibility_kind, slip_scales):
    """Derivatives (3, 3) of the three results of ``rigid_slip`` with respect to xi_x, xi_y and spin."""
    a, c, flexible = contact.a, math.sqrt(contact.a * contact.b), (contact.l1, contact.l2, contact.l3)
    bound = contact.mu * strip_cells.peak * contact.load / (a * contact.b)
    step, creep = 2.0 * a / (strip_cells.centre.size * bound), (contact.xi_x, contact.xi_y, contact.spin * c)
    k, change = traction_stiffnesses(contact, bound, flexibility_kind), np.zeros(3)
    blended = blend_weight(contact, bound, flexibility_kind)
    size = math.sqrt(creep[0] ** 2 + creep[1] ** 2 + creep[2] ** 2)
    mean = mean_flexibility(contact, creep[2], flexibility_kind)
    for j in range(3):
        unit = c if j == 2 else 1.0
        if blended[0] > 0.0 and size > 0.0:
            sign = 1.0 if creep[j] > 0.0 else -1.0 if creep[j] < 0.0 else 0.0
            if flexibility_kind == ONE_FLEXIBILITY:
                d_mean = (sign * flexible[j] - mean * creep[j] / size) / size
            else:
                d_mean = 2.0 * creep[j] * (flexible[j] - mean) / (size * size)
            d_one = -d_mean / (mean * mean)
            for i in range(3):
                change[i] = unit * (blended[1 + j] * (1.0 / mean - 1.0 / flexible[i]) + blended[0] * d_one)
        for i in range(3):
            slip_scales[i, j] = step * (change[i] * creep[i] / (c if i == 2 else 1.0) + (k[i] if i == j else 0.0))


@compiled
def _fill_strip_sums(contact, grid_strips, strip_index, strip_cells, contact_slip, strip_sums, sum_derivatives):
    """Fill the sums of q_x, q_y and t q_y over the cells of strip s, and their derivatives (3, 3) with respect to the
    rigid slip (x, y, spin).
    """
    spread, off, arm = (
        grid_strips.spread[strip_index],
        contact.b * grid_strips.y[strip_index],
        contact.a * grid_strips.half[strip_index],
    )
    u, v0, v1 = (
        spread * (contact_slip[0] - contact_slip[2] * off),
        spread * contact_slip[1],
        spread * contact_slip[2] * arm,
    )
    du, dv0, dv1 = (spread, 0.0, -spread * off), (0.0, spread, 0.0), (0.0, 0.0, spread * arm)
    dx, dy = np.zeros(3), np.zeros(3)
    px = py = slips = 0.0
    change = -2.0 / strip_cells.centre.size
    strip_sums[:] = 0.0
    sum_derivatives[:] = 0.0
    for i in range(strip_cells.centre.size):
        t, mid, g, share = strip_cells.centre[i], strip_cells.middle[i], strip_cells.bound[i], 0.5 if i == 0 else 1.0
        bound = g, strip_cells.start_bound[i], strip_cells.rate[i]
        v = v0 + v1 * mid
        if i == 0:
            x, y, now = cut_to_bound(-0.5 * u, -0.5 * v, g)
        else:
            x, y, now = advance_traction((px, py, slips), (u, v, v1 * change), bound)
        turns = slips * (u * u + v * v) > NEGLIGIBLE_SLIP
        reach = (abs(u) + abs(v)) * strip_cells.rate[i] if turns else 0.0
        late, steep = turning_slip_point(reach), 0.5 if reach < 0.4 else 0.2 if reach < 1.75 else 0.0
        w = v + v1 * change * late
        if turns and now > 0.0:
            kept, pull, size = _rotation_derivatives(px, py, u, w, strip_cells.start_bound[i], strip_cells.rate[i])
        for k in range(3):
            dv = dv0[k] + dv1[k] * mid
            if now == 0.0:
                dx[k] -= share * du[k]
                dy[k] -= share * dv
                continue
            if turns:
                rise = (math.copysign(1.0, u) * du[k] + math.copysign(1.0, v) * dv) * strip_cells.rate[i] * steep
                dw = dv + change * (dv1[k] * late + v1 * rise)
                heading = (u * dw - w * du[k]) / (size * size)
                before = (px * dy[k] - py * dx[k]) / (px * px + py * py)
                angle = heading + kept * (before - heading) - pull * (u * du[k] + w * dw) / size
            else:
                tx, ty = px - share * u, py - share * v
                angle = (tx * (dy[k] - share * dv) - ty * (dx[k] - share * du[k])) / (tx * tx + ty * ty)
            dx[k], dy[k] = -angle * y, angle * x
        px, py, slips = x, y, now
        strip_sums[0], strip_sums[1], strip_sums[2] = strip_sums[0] + px, strip_sums[1] + py, strip_sums[2] + t * py
        for k in range(3):
            sum_derivatives[0, k] += dx[k]
            sum_derivatives[1, k] += dy[k]
            sum_derivatives[2, k] += t * dy[k]


@compiled
def _rotation_derivatives(traction_x, traction_y, slip_x, slip_y, before, rate):
    """Derivatives of the rotation of a slipping traction in ``advance_traction``: sin psi' / sin psi, the derivative of
    psi' with respect to |w|, and |w|.
    """
    size = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    h = min(size * rate, LARGEST_EXPONENT)
    base = 1.0 + h * (1.0 + h * (0.5 + h * (1.0 / 6.0)))
    grown = base**8
    over, aside = before * size - (traction_x * slip_x + traction_y * slip_y), traction_x * slip_y - traction_y * slip_x
    whole = (grown * over) ** 2 + aside * aside
    growth = 8.0 * (1.0 + h * (1.0 + 0.5 * h)) / base * rate if h < LARGEST_EXPONENT else 0.0
    return grown * (over * over + aside * aside) / whole, 2.0 * grown * over * aside / whole * growth, size
