"""Many ellipses at once: from creepages to the strips' own numbers, through the march, and back to forces.

Strips of all ellipses are lined up and marched in full blocks, so that no lane is empty but at the very end.
"""

import math

import numpy as np

from models.contact.fastsim_kernels import (
    BEFORE,
    BOUND,
    CENTRE,
    LANES,
    MIDDLE,
    PLAIN,
    RATE,
    ROWS,
    SECOND_ORDER,
    SLID,
    SUM_T,
    SUM_X,
    SUM_Y,
    V0,
    V1,
    U,
    advance,
    cut,
    march_plain,
    march_second_order,
)
from models.contact.inputs import NOTHING
from models.machine.compiled import compiled, lean

A, B, LOAD, MU, XI_X, XI_Y, SPIN, L1, L2, L3 = range(10)
"""Columns of contacts; L1 to L3 are the flexibilities (m^3/N) along x, along y and in spin."""
Y, HALF, SPREAD, PART = range(4)
"""Rows of the strips: y/b, half length by a, that by the bound in the strip's middle, share of the load per bound."""
PER_SLIP, ROOM = 3, ROWS * LANES
"""Numbers of a rigid slip; of all lanes."""
ONE, THREE, BLENDED = 0, 1, 2
OF_X, OF_SPIN, AGAINST, REACH, GROWTH = 0.5, 0.52, 0.86, 1.9, 1.3
SPIN_BY_RATIO, REACH_BY_RATIO, RATIOS = 0.6, 0.45, (0.1, 10.0)
"""Of the blend: what xi_x and spin count by xi_y, how much of it lateral creepage against spin takes away, the reach at
which the one flexibility has its main part and the power of its beginning; then powers of a/b in the second and the
fourth, within ``RATIOS``. Calibrated on 910 contacts of the exact theory, 250 of them with lateral creepage against
spin, and held against others (validation case ``contact_price``)."""
SLIDING, MOST = 8.0, 100.0
"""Square of the reach at which creepage without spin slides all over; exponents beyond which nothing changes."""


@compiled
def forces(contacts, strips, cells, middle, kind, march, answers):
    """Fill ``answers`` (n, 4) with fx, fy (N), mz (N m) and the share of the area that sticks.

    contacts : (n, 10), columns as above; strips, cells, middle : a net from ``fastsim_grid``; kind : of flexibility;
    march : PLAIN or SECOND_ORDER. A contact without load or friction has zeros all over.
    """
    slips, lanes = np.empty((len(contacts), PER_SLIP)), np.empty(ROOM)
    forces_within(contacts, strips, cells, middle, kind, march, slips, lanes, answers)


@lean
def forces_within(contacts, strips, cells, middle, kind, march, slips, lanes, answers):
    """``forces`` that makes no array: slips (n, PER_SLIP) and lanes (ROOM,) are room to work in."""
    for c in range(len(contacts)):
        rigid_slip(contacts[c], cells.shape[1], middle, kind, slips[c])
        answers[c, 0] = answers[c, 1] = answers[c, 2] = answers[c, 3] = 0.0
    m = strips.shape[1]
    for first in range(0, len(contacts) * m, LANES):
        count = min(LANES, len(contacts) * m - first)
        _fill(lanes, first, count, contacts, strips, slips)
        if march == SECOND_ORDER:
            march_second_order(lanes, cells)
        else:
            march_plain(lanes, cells)
        _collect(lanes, first, count, contacts, strips, slips, answers)
    area = 0.0
    for s in range(m):  # summed as the slipping cells are, so that nothing is left where all slip
        area += strips[HALF, s] * cells.shape[1]
    for c in range(len(contacts)):
        if touches(contacts[c]):
            answers[c, 3] = 1.0 - answers[c, 3] / area


@lean
def touches(contact):
    """Whether there is anything that friction could hold."""
    return contact[MU] * contact[LOAD] > NOTHING


@lean
def rigid_slip(contact, cells, middle, kind, slip):
    """Fill ``slip`` (3,) with what the march needs.

    The traction by the bound in the ellipse's middle that each creepage builds up over one cell of the middle strip,
    were there no slip; the third one is that of spin per metre.
    """
    a, b, load, mu = contact[A], contact[B], contact[LOAD], contact[MU]
    if not touches(contact):
        slip[:] = 0.0
        return
    bound = mu * middle * load / (a * b)
    k1, k2, k3 = stiffness(contact, bound, kind)
    step = 2.0 * a / (cells * bound)
    slip[0], slip[1], slip[2] = k1 * contact[XI_X] * step, k2 * contact[XI_Y] * step, k3 * contact[SPIN] * step


@lean
def stiffness(contact, bound, kind):
    """Inverses of the flexibilities along x, along y and in spin (N/m^3)."""
    k1, k2, k3 = 1.0 / contact[L1], 1.0 / contact[L2], 1.0 / contact[L3]
    part = blend(contact, bound, kind)[0]
    if part == 0.0:
        return k1, k2, k3
    mean = 1.0 / mean_flexibility(contact, contact[SPIN] * math.sqrt(contact[A] * contact[B]), kind)
    return k1 + part * (mean - k1), k2 + part * (mean - k2), k3 + part * (mean - k3)


@lean
def blend(contact, bound, kind):
    """Part of the one flexibility, 0 to 1, and its derivatives to xi_x, xi_y and spin sqrt(a b).

    It grows with x, y and z, the reach of the linear theory's tractions by the bound. Lateral creepage against spin
    reaches less: the pole about which the rigid slip turns lies in the patch then, and near it much still sticks when
    the rest slides. A second term ends the blend where all slides, so that force and slip have one direction there.
    """
    if kind != BLENDED:
        return 1.0 if kind == ONE else 0.0, 0.0, 0.0, 0.0
    ratio, unit = math.log(min(max(contact[A] / contact[B], RATIOS[0]), RATIOS[1])), contact[A] / bound
    of_x, of_y, of_z = unit / contact[L1], unit / contact[L2], unit / contact[L3]
    x, y, z = of_x * contact[XI_X], of_y * contact[XI_Y], of_z * contact[SPIN] * math.sqrt(contact[A] * contact[B])
    turns = OF_SPIN * math.exp(SPIN_BY_RATIO * ratio)
    square = (OF_X * x) ** 2 + y * y + (turns * z) ** 2 + 2.0 * AGAINST * y * turns * z
    if square == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    level = 1.0 / (1.0 + z * z)
    slides = min((x * x + y * y) * level / SLIDING, MOST)
    grown = min((math.sqrt(square) / (REACH * math.exp(REACH_BY_RATIO * ratio))) ** GROWTH, MOST)
    whole = grown + slides**3
    left = math.exp(-whole)
    steep, more = left * GROWTH * grown / square, left * 6.0 * slides**2 * level
    return (
        -math.expm1(-whole),
        of_x * x * (steep * OF_X**2 + more / SLIDING),
        of_y * (steep * (y + AGAINST * turns * z) + more * y / SLIDING),
        of_z * (steep * turns * (turns * z + AGAINST * y) - more * slides * z),
    )


@lean
def mean_flexibility(contact, turn, kind):
    """One flexibility for all creepages, ``turn`` = spin sqrt(a b) the third.

    That of 1982 weights by their sizes and divides by their root mean square, which makes up to sqrt(3) times too much
    of mixed ones; the blend's is the mean weighted by their squares.
    """
    x, y, z = abs(contact[XI_X]), abs(contact[XI_Y]), abs(turn)
    most = max(x, max(y, z))
    if most == 0.0:
        return contact[L1]
    x, y, z = x / most, y / most, z / most
    square = x * x + y * y + z * z
    if kind == ONE:
        return (x * contact[L1] + y * contact[L2] + z * contact[L3]) / math.sqrt(square)
    return (x * x * contact[L1] + y * y * contact[L2] + z * z * contact[L3]) / square


@lean
def _fill(lanes, first, count, contacts, strips, slips):
    """The strips from number ``first`` on into the lanes; those beyond ``count`` stay at rest."""
    c, s = first // strips.shape[1], first % strips.shape[1]
    for j in range(LANES):
        if j >= count:
            lanes[U * LANES + j] = lanes[V0 * LANES + j] = lanes[V1 * LANES + j] = 0.0
            continue
        spread = strips[SPREAD, s]
        lanes[U * LANES + j] = spread * (slips[c, 0] - slips[c, 2] * contacts[c, B] * strips[Y, s])
        lanes[V0 * LANES + j] = spread * slips[c, 1]
        lanes[V1 * LANES + j] = spread * slips[c, 2] * contacts[c, A] * strips[HALF, s]
        s += 1
        if s == strips.shape[1]:
            c, s = c + 1, 0


@lean
def _collect(lanes, first, count, contacts, strips, slips, answers):
    """Sums of the lanes into the forces of their ellipses, and slipping cells weighted by their length."""
    c, s = first // strips.shape[1], first % strips.shape[1]
    for j in range(count):
        if touches(contacts[c]):
            part, half = contacts[c, MU] * contacts[c, LOAD] * strips[PART, s], strips[HALF, s]
            x = lanes[SUM_X * LANES + j]
            answers[c, 0] += part * x
            answers[c, 1] += part * lanes[SUM_Y * LANES + j]
            arm, off = contacts[c, A] * half, contacts[c, B] * strips[Y, s]
            answers[c, 2] += part * (arm * lanes[SUM_T * LANES + j] - off * x)
            answers[c, 3] += half * lanes[SLID * LANES + j]
        s += 1
        if s == strips.shape[1]:
            c, s = c + 1, 0


@compiled
def strip_tractions(contact, strip, cells, slip, march, left, answers):
    """Tractions by the bound in the strip's middle, along x and y, and slip or not, in ``answers`` (3, cells).

    left : (2, cells), share of the friction that is left in the cells' centres and in the middles of the steps there.
    """
    u, v0 = strip[SPREAD] * (slip[0] - slip[2] * contact[B] * strip[Y]), strip[SPREAD] * slip[1]
    v1, change, before = strip[SPREAD] * slip[2] * contact[A] * strip[HALF], -2.0 / cells.shape[1], 0.0
    x = y = slips = 0.0
    for i in range(cells.shape[1]):
        v, g = v0 + v1 * cells[MIDDLE, i], left[0, i] * cells[BOUND, i]
        if march == PLAIN:
            x, y, slips = cut(x - u, y - v0 - v1 * cells[CENTRE, i], g)
        elif i == 0:
            x, y, slips = cut(-0.5 * u, -0.5 * v, g)
        else:
            rate = cells[RATE, i] / left[1, i]
            x, y, slips = advance(x, y, slips, u, v, v1 * change, g, before * cells[BEFORE, i], rate)
        before = left[0, i]
        answers[0, i], answers[1, i], answers[2, i] = x, y, slips


@compiled
def point(a, load, mu, xi_x, xi_y, spin, by_ratio, l1, l2, l3, strips, cells, middle, kind, march):
    """fx, fy, mz of one ellipse of semi-axes a and a ``by_ratio``, flexibilities a (l1, l2, l3); NaN for bad input."""
    contacts, answers = np.empty((1, 10)), np.empty((1, 4))
    if not (mu >= 0.0 and (a > 0.0 or load <= 0.0)):
        return math.nan, math.nan, math.nan
    own = contacts[0]
    own[A], own[B], own[LOAD], own[MU] = a, a * by_ratio, load, mu
    own[XI_X], own[XI_Y], own[SPIN] = xi_x, xi_y, spin
    own[L1], own[L2], own[L3] = a * l1, a * l2, a * l3
    forces(contacts, strips, cells, middle, kind, march, answers)
    bad = 0.0 * (load + mu + xi_x + xi_y + spin)  # zero, or NaN where one of them is not finite
    return answers[0, 0] + bad, answers[0, 1] + bad, answers[0, 2] + bad
