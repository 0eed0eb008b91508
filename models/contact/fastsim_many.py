"""FASTSIM for many ellipses at once: from creepages to the rigid slip of their strips, through the march, and back to
forces.

Strips of all ellipses are lined up and marched in full blocks, so that no lane is empty but at the very end.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import (
    PLAIN,
    SECOND_ORDER,
    advance_traction,
    cut_to_bound,
    march_plain,
    march_second_order,
)
from models.contact.fastsim_records import BLOCK, CONTACT, FORCES, LANE_COUNT, SLIP, MarchWorkspace, cells_in, strips_in
from models.contact.inputs import NEGLIGIBLE_BOUND
from models.machine.compiled import compiled, lean

A, B, LOAD, MU = range(4)
"""Indices of the first fields of CONTACT, for callers that keep contacts in a table of doubles."""
ONE_FLEXIBILITY, THREE_FLEXIBILITIES, BLENDED = 0, 1, 2
X_WEIGHT, SPIN_WEIGHT, OPPOSING_SPIN_SHARE, BLEND_REACH, BLEND_POWER = 0.5, 0.52, 0.86, 1.9, 1.3
"""Constants of the blend of flexibilities: weights of xi_x and of spin, where xi_y has 1; how much of it lateral
creepage against spin takes away; the reach at which the one flexibility has its main part, and the power of its
beginning. With those below, calibrated on 910 contacts of the exact theory, 250 of them with lateral creepage against
spin, and compared with others (validation case ``contact_price``).
"""
SPIN_BY_RATIO, REACH_BY_RATIO, RATIOS = 0.6, 0.45, (0.1, 10.0)
"""Further constants of the blend: powers of a/b, within ``RATIOS``, in the weight of spin and in the
reach.
"""
SLIDING_SQUARE, LARGEST_BLEND_EXPONENT = 8.0, 100.0
"""Square of the ratio of the linear theory's traction to the bound at which creepage without spin makes the whole area
slide, and exponent beyond which nothing changes.
"""


@compiled
def fill_contact_forces(contacts, grid_strips, strip_cells, flexibility_kind, march_kind, forces_out):
    """Fill ``forces_out`` with the creep forces of many contacts, FORCES (n,).

    contacts : CONTACT (n,); grid_strips, strip_cells : a net from ``fastsim_grid``; flexibility_kind : of flexibility;
    march_kind : PLAIN or SECOND_ORDER. A contact without load or friction has zeros all over.
    """
    workspace = MarchWorkspace(np.empty(len(contacts), SLIP), np.empty(1, BLOCK))
    fill_contact_forces_in_place(
        contacts, grid_strips, strip_cells, flexibility_kind, march_kind, workspace, forces_out
    )


@lean
def fill_contact_forces_in_place(
    contacts, grid_strips, strip_cells, flexibility_kind, march_kind, workspace, forces_out
):
    """Creep forces as by ``fill_contact_forces``, without allocating arrays; workspace : ``MarchWorkspace`` for
    intermediate values.
    """
    slips, block, m = workspace.slips, workspace.blocks[0], grid_strips.y.size
    for c in range(len(contacts)):
        slip, answer = slips[c], forces_out[c]
        slip.x, slip.y, slip.spin = rigid_slip(contacts[c], strip_cells, flexibility_kind)
        answer.fx = answer.fy = answer.mz = answer.stick = 0.0
    for first in range(0, len(contacts) * m, LANE_COUNT):
        count = min(LANE_COUNT, len(contacts) * m - first)
        _fill_block(block, first, count, contacts, grid_strips, slips)
        if march_kind == SECOND_ORDER:
            march_second_order(block, strip_cells)
        else:
            march_plain(block, strip_cells)
        _collect_forces(block, first, count, contacts, grid_strips, forces_out)
    area = 0.0
    for s in range(m):  # summed as the slipping cells are, so that nothing is left where all slip
        area += grid_strips.half[s] * strip_cells.centre.size
    for c in range(len(contacts)):
        if transmits_force(contacts[c]):
            forces_out[c].stick = 1.0 - forces_out[c].stick / area


@lean
def transmits_force(contact):
    """Whether the contact has load and friction, so that tangential forces can be transmitted."""
    return contact.mu * contact.load > NEGLIGIBLE_BOUND


@lean
def rigid_slip(contact, strip_cells, flexibility_kind):
    """Rigid slip (x, y, spin) of a contact's creepages, in the form that the march needs.

    The traction by the bound in the ellipse's middle that each creepage builds up over one cell of the middle strip,
    were there no slip; the third one is that of spin per metre.
    """
    if not transmits_force(contact):
        return 0.0, 0.0, 0.0
    bound = contact.mu * strip_cells.peak * contact.load / (contact.a * contact.b)
    k1, k2, k3 = traction_stiffnesses(contact, bound, flexibility_kind)
    step = 2.0 * contact.a / (strip_cells.centre.size * bound)
    return k1 * contact.xi_x * step, k2 * contact.xi_y * step, k3 * contact.spin * step


@lean
def traction_stiffnesses(contact, traction_bound, flexibility_kind):
    """Inverses (N/m^3) of the flexibilities along x, along y and in spin."""
    k1, k2, k3 = 1.0 / contact.l1, 1.0 / contact.l2, 1.0 / contact.l3
    part = blend_weight(contact, traction_bound, flexibility_kind)[0]
    if part == 0.0:
        return k1, k2, k3
    mean = 1.0 / mean_flexibility(contact, contact.spin * math.sqrt(contact.a * contact.b), flexibility_kind)
    return k1 + part * (mean - k1), k2 + part * (mean - k2), k3 + part * (mean - k3)


@lean
def blend_weight(contact, traction_bound, flexibility_kind):
    """Weight, 0 to 1, of the common mean flexibility against three separate ones, and the weight's derivatives with
    respect to xi_x, xi_y and spin sqrt(a b).

    The weight grows with x, y and z, ratios of the linear theory's tractions to the bound. Lateral creepage that
    opposes spin contributes less: the pole about which the rigid slip turns then lies in the patch, and much of the
    area near it still sticks while the remaining area slides. A second term brings the weight to 1 where the whole area
    slides, so that force and slip have the same direction.
    """
    if flexibility_kind != BLENDED:
        return 1.0 if flexibility_kind == ONE_FLEXIBILITY else 0.0, 0.0, 0.0, 0.0
    ratio, unit = math.log(min(max(contact.a / contact.b, RATIOS[0]), RATIOS[1])), contact.a / traction_bound
    of_x, of_y, of_z = unit / contact.l1, unit / contact.l2, unit / contact.l3
    x, y, z = of_x * contact.xi_x, of_y * contact.xi_y, of_z * contact.spin * math.sqrt(contact.a * contact.b)
    turns = SPIN_WEIGHT * math.exp(SPIN_BY_RATIO * ratio)
    square = (X_WEIGHT * x) ** 2 + y * y + (turns * z) ** 2 + 2.0 * OPPOSING_SPIN_SHARE * y * turns * z
    if square == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    level = 1.0 / (1.0 + z * z)
    slides = min((x * x + y * y) * level / SLIDING_SQUARE, LARGEST_BLEND_EXPONENT)
    grown = min(
        (math.sqrt(square) / (BLEND_REACH * math.exp(REACH_BY_RATIO * ratio))) ** BLEND_POWER, LARGEST_BLEND_EXPONENT
    )
    exponent = grown + slides**3
    remaining = math.exp(-exponent)
    steep, more = remaining * BLEND_POWER * grown / square, remaining * 6.0 * slides**2 * level
    return (
        -math.expm1(-exponent),
        of_x * x * (steep * X_WEIGHT**2 + more / SLIDING_SQUARE),
        of_y * (steep * (y + OPPOSING_SPIN_SHARE * turns * z) + more * y / SLIDING_SQUARE),
        of_z * (steep * turns * (turns * z + OPPOSING_SPIN_SHARE * y) - more * slides * z),
    )


@lean
def mean_flexibility(contact, scaled_spin, flexibility_kind):
    """Common flexibility (m^3/N) for all creepages; ``scaled_spin`` = spin sqrt(a b) is the third of them.

    That of 1982 weights by their sizes and divides by their root mean square, which makes up to sqrt(3) times too much
    of mixed ones; the blend's is the mean weighted by their squares.
    """
    x, y, z = abs(contact.xi_x), abs(contact.xi_y), abs(scaled_spin)
    most = max(x, max(y, z))
    if most == 0.0:
        return contact.l1
    x, y, z = x / most, y / most, z / most
    square = x * x + y * y + z * z
    if flexibility_kind == ONE_FLEXIBILITY:
        return (x * contact.l1 + y * contact.l2 + z * contact.l3) / math.sqrt(square)
    return (x * x * contact.l1 + y * y * contact.l2 + z * z * contact.l3) / square


@lean
def strip_slip(contact, grid_strips, strip_index, contact_slip):
    """Rigid slip (u, v0, v1) of strip s from that of its contact: the traction that would build up over one cell
    without sliding, in units of the bound in the strip's middle: u along x, and v0 + v1 t along y at position t.
    """
    spread = grid_strips.spread[strip_index]
    return (
        spread * (contact_slip.x - contact_slip.spin * contact.b * grid_strips.y[strip_index]),
        spread * contact_slip.y,
        spread * contact_slip.spin * contact.a * grid_strips.half[strip_index],
    )


@lean
def _fill_block(strip_block, first_strip, strip_count, contacts, grid_strips, contact_slips):
    """Put the rigid slips of ``strip_count`` strips, from strip ``first_strip`` on, into the lanes of a BLOCK; further
    lanes get zero slip.
    """
    c, s = first_strip // grid_strips.y.size, first_strip % grid_strips.y.size
    for j in range(LANE_COUNT):
        if j >= strip_count:
            strip_block.u[j] = strip_block.v0[j] = strip_block.v1[j] = 0.0
            continue
        strip_block.u[j], strip_block.v0[j], strip_block.v1[j] = strip_slip(
            contacts[c], grid_strips, s, contact_slips[c]
        )
        s += 1
        if s == grid_strips.y.size:
            c, s = c + 1, 0


@lean
def _collect_forces(strip_block, first_strip, strip_count, contacts, grid_strips, forces_out):
    """Add what ``strip_count`` strips carry to the forces of their contact ellipses, and their slipping cells, each
    with its length, to the slip areas.
    """
    c, s = first_strip // grid_strips.y.size, first_strip % grid_strips.y.size
    for j in range(strip_count):
        contact, answer = contacts[c], forces_out[c]
        if transmits_force(contact):
            sums = strip_block.sum_x[j], strip_block.sum_y[j], strip_block.sum_t[j]
            add_strip(contact, grid_strips, s, sums, answer)
            answer.stick += grid_strips.half[s] * strip_block.slid[j]
        s += 1
        if s == grid_strips.y.size:
            c, s = c + 1, 0


@lean
def add_strip(contact, grid_strips, strip_index, strip_sums, contact_forces):
    """Add the forces of strip s to those of its contact, from the strip's sums of q_x, q_y and t q_y over its cells."""
    part, (x, y, turn) = contact.mu * contact.load * grid_strips.part[strip_index], strip_sums
    contact_forces.fx += part * x
    contact_forces.fy += part * y
    contact_forces.mz += part * (
        contact.a * grid_strips.half[strip_index] * turn - contact.b * grid_strips.y[strip_index] * x
    )


@compiled
def strip_tractions(strip_rigid_slip, strip_cells, march_kind, friction_shares, tractions):
    """Fill ``tractions`` (3, cells) of a strip: tractions along x and y in units of the bound in its middle, and 1
    where it slips.

    strip_rigid_slip : of the strip, see ``strip_slip``; friction_shares : (2, cells), share of the friction that is
    left in the cells' centres and in the middles of the steps there.
    """
    (u, v0, v1), change, share_before = strip_rigid_slip, -2.0 / strip_cells.centre.size, 0.0
    x = y = slips = 0.0
    for i in range(strip_cells.centre.size):
        v, g = v0 + v1 * strip_cells.middle[i], friction_shares[0, i] * strip_cells.bound[i]
        if march_kind == PLAIN:
            x, y, slips = cut_to_bound(x - u, y - v0 - v1 * strip_cells.centre[i], g)
        elif i == 0:
            x, y, slips = cut_to_bound(-0.5 * u, -0.5 * v, g)
        else:
            bound = g, share_before * strip_cells.start_bound[i], strip_cells.rate[i] / friction_shares[1, i]
            x, y, slips = advance_traction((x, y, slips), (u, v, v1 * change), bound)
        share_before = friction_shares[0, i]
        tractions[0, i], tractions[1, i], tractions[2, i] = x, y, slips


@compiled
def ellipse_forces(load_and_creepages, unit_ellipse, strip_table, cell_table, coded_choices):
    """Creep forces fx, fy (N) and moment mz (N m) of one ellipse with the shape of ``unit_ellipse``; NaN for invalid
    input.

    load_and_creepages : a (m), load, mu, xi_x, xi_y, spin; unit_ellipse : b, l1, l2, l3 at a = 1 m; strip_table,
    cell_table : a net's tables;
    coded_choices : the net's peak, kind of flexibility, march. Python hands plain arrays and numbers over in a fraction
    of the time of records.
    """
    (a, load, mu, xi_x, xi_y, spin), (peak, kind, march) = load_and_creepages, coded_choices
    if not (mu >= 0.0 and (a > 0.0 or load <= 0.0)):
        return math.nan, math.nan, math.nan
    contacts, answers = np.empty(1, CONTACT), np.empty(1, FORCES)
    contact, answer = contacts[0], answers[0]
    contact.a, contact.b, contact.load, contact.mu = a, a * unit_ellipse[0], load, mu
    contact.xi_x, contact.xi_y, contact.spin = xi_x, xi_y, spin
    contact.l1, contact.l2, contact.l3 = a * unit_ellipse[1], a * unit_ellipse[2], a * unit_ellipse[3]
    fill_contact_forces(contacts, strips_in(strip_table), cells_in(cell_table, peak), kind, march, answers)
    bad = 0.0 * (load + mu + xi_x + xi_y + spin)  # zero, or NaN where one of them is not finite
    return answer.fx + bad, answer.fy + bad, answer.mz + bad
