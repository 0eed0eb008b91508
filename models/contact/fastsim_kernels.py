"""Compiled marches of FASTSIM, many strips side by side.

A strip is marched from its leading edge in its own scale: position t from 1 to -1, traction q relative to the bound in
the middle of the strip, so that the bound g(t) is the same for all strips. What a strip has of its own is three
numbers: the traction that the rigid slip would build up over one cell were there no slip at all, along x (``u``) and
along y (``v0 + v1 t``).

Lanes stand side by side in one flat array with a constant stride. All loops over them have a constant length and no
branch, which lets the compiler put them into vector registers: a march is a chain of a root and a division per cell,
and only strips side by side keep the processor busy meanwhile.
"""

import math

from models.machine.compiled import compiled, njit

LANES = 24
"""Strips that are marched at once; the last ones may be empty."""
U, V0, V1, SUM_X, SUM_Y, SUM_T, SLID, QX, QY, SLIPS = range(10)
"""Rows of the lanes: the three inputs; sums over the cells of q_x, q_y, t q_y and of slipping cells; the state."""
ROWS = 10
CENTRE, BOUND, MIDDLE, BEFORE, RATE = range(5)
"""Rows of the cells, each about the step that ends in its centre: t there, g there, t in the middle of the step, g
where it starts (more by a rounding), 1/(8 g) in its middle."""
PLAIN, SECOND_ORDER = 0, 1

LONGEST = 50.0
"""exp(-50) of an angle is nothing; larger exponents would overflow."""
STILL = 1e-60
"""Square of a rigid slip per cell that turns no traction."""


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def lateness(z):
    """Where on a step a turning rigid slip counts, in steps after the middle: coth(4 z)/2 - 1/(8 z), within 0.04.

    A traction that forgets as exp(-8 z) follows the slip at the end of a long step and at the middle of a short one;
    with it the step is right for a slip that turns evenly, however stiff. A concave function, so the least of lines.
    """
    return min(min(0.5 * z, 0.12 + 0.2 * z), 0.47)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def advance(px, py, slips, u, v, turn, g, before, rate):
    """Traction in the next cell, and 1 if it slips there or 0, by the second-order march.

    px, py : traction before, on the bound ``before`` if ``slips`` is 1; u, v : rigid slip in the middle of the step, as
    traction; turn : change of v over it; g : bound in the next cell; rate : 1 / 8 of 1 / bound in the middle

    While a strip slips, with rigid slip w and bound g constant over the step, the angle psi between traction and -w
    obeys psi' = -(|w| / g) sin psi, so tan(psi / 2) shrinks by exp(-|w| step / g). The half angle is kept as the sides
    ``aside`` and ``over`` of a triangle: no trigonometry, one root and one division in all, and an exponential as an
    eighth power, right to z^4 / 12000 of itself. A flag tells whether a strip slips: a traction that equals the bound
    within a tolerance may stick. Where a strip begins to slip, the traction is cut back to the bound.
    """
    x, y = px - u, py - v
    v += turn * lateness((abs(u) + abs(v)) * rate)  # |w| well enough, without its root
    square, slip = x * x + y * y, u * u + v * v
    turns = slips * slip > STILL
    size = math.sqrt(slip if turns else square)
    h = min(size * rate, LONGEST)
    grown = 1.0 + h * (1.0 + h * (0.5 + h * (1.0 / 6.0)))
    grown *= grown
    grown *= grown
    grown *= grown
    aside = px * v - py * u
    over = grown * (before * size - (px * u + py * v))
    cosine, sine = over * over - aside * aside, (over + over) * aside
    sticks = square <= g * g
    scale = g / (size * (over * over + aside * aside) if turns else size)
    qx = x if sticks else scale * (sine * v - cosine * u if turns else x)
    qy = y if sticks else scale * (-sine * u - cosine * v if turns else y)
    return qx, qy, 0.0 if sticks else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def cut(x, y, g):
    """Traction held to the bound g, and 1 if it had to be or 0."""
    size = math.sqrt(x * x + y * y)
    sticks = size <= g
    part = 1.0 if sticks else g / size
    return part * x, part * y, 0.0 if sticks else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def march_second_order(lanes, cells):
    """March with half a first step and the exact rotation of a slipping traction; fills sums and states."""
    _clear(lanes)
    for j in range(LANES):
        u, v = lanes[U * LANES + j], lanes[V0 * LANES + j] + lanes[V1 * LANES + j] * cells[MIDDLE, 0]
        x, y, slips = cut(-0.5 * u, -0.5 * v, cells[BOUND, 0])
        _keep(lanes, j, cells[CENTRE, 0], x, y, slips)
    change = -2.0 / cells.shape[1]
    for i in range(1, cells.shape[1]):
        t, g, middle = cells[CENTRE, i], cells[BOUND, i], cells[MIDDLE, i]
        before, rate = cells[BEFORE, i], cells[RATE, i]
        for j in range(LANES):
            u, v1 = lanes[U * LANES + j], lanes[V1 * LANES + j]
            v = lanes[V0 * LANES + j] + v1 * middle
            x, y, slips = lanes[QX * LANES + j], lanes[QY * LANES + j], lanes[SLIPS * LANES + j]
            x, y, slips = advance(x, y, slips, u, v, v1 * change, g, before, rate)
            _keep(lanes, j, t, x, y, slips)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def march_plain(lanes, cells):
    """March of 1982: a whole step into each cell, then the traction is cut back to the bound; fills sums and states."""
    _clear(lanes)
    for i in range(cells.shape[1]):
        t, g = cells[CENTRE, i], cells[BOUND, i]
        for j in range(LANES):
            x = lanes[QX * LANES + j] - lanes[U * LANES + j]
            y = lanes[QY * LANES + j] - (lanes[V0 * LANES + j] + lanes[V1 * LANES + j] * t)
            x, y, slips = cut(x, y, g)
            _keep(lanes, j, t, x, y, slips)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def _keep(lanes, j, t, x, y, slips):
    """A cell's traction into state and sums."""
    lanes[QX * LANES + j] = x
    lanes[QY * LANES + j] = y
    lanes[SLIPS * LANES + j] = slips
    lanes[SUM_X * LANES + j] += x
    lanes[SUM_Y * LANES + j] += y
    lanes[SUM_T * LANES + j] += t * y
    lanes[SLID * LANES + j] += slips


@compiled
def _clear(lanes):
    """Sums and states of all lanes to zero."""
    for j in range(SUM_X * LANES, ROWS * LANES):
        lanes[j] = 0.0
