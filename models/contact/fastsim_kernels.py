"""Compiled marches of FASTSIM along strips of cells, many strips side by side.

A strip is marched from its leading edge in its own scale: position t from 1 to -1, traction q relative to the bound in
the middle of the strip, so that the bound g(t) is the same for all strips. What a strip has of its own is three
numbers: the traction that the rigid slip would build up over one cell were there no slip at all, along x (``u``) and
along y (``v0 + v1 t``).

Lanes stand side by side in one flat array with a constant stride. All loops over them have a constant length and no
branch, which lets the compiler put them into vector registers: a march is a chain of a root and a division per cell,
and only strips side by side keep the processor busy meanwhile.
"""

import math

from models.contact.fastsim_records import LANE_COUNT
from models.machine.compiled import compiled, njit

PLAIN, SECOND_ORDER = 0, 1

LARGEST_EXPONENT = 50.0
"""Largest exponent: exp(-50) of an angle is negligible; larger exponents would overflow."""
NEGLIGIBLE_SLIP = 1e-60
"""Square of a rigid slip per cell that is too small to change the direction of a traction."""


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def turning_slip_point(step_exponent):
    """Point in a step at which a turning rigid slip is evaluated, in steps after the step's middle: a piecewise linear
    approximation, within 0.04, of coth(4 z)/2 - 1/(8 z).

    A traction that forgets as exp(-8 z) follows the slip at the end of a long step and at the middle of a short one;
    with it the step is right for a slip that turns evenly, however stiff. A concave function, so the least of lines.
    """
    return min(min(0.5 * step_exponent, 0.12 + 0.2 * step_exponent), 0.47)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def advance_traction(traction, slip, traction_bound):
    """Traction in the next cell by the second-order march, and 1 if the cell slips, else 0.

    traction : along x and y before, and whether it slips (1), being on the bound, or not (0); slip : rigid slip along x
    and y in the middle of the step, as traction, and the change of the second over it; traction_bound : in the next
    cell, where the step starts, and 1 / 8 of 1 / bound in its middle

    While a strip slips, with rigid slip w and bound g constant over the step, the angle psi between traction and -w
    obeys psi' = -(|w| / g) sin psi, so tan(psi / 2) shrinks by exp(-|w| step / g). The half angle is kept as the sides
    ``aside`` and ``over`` of a triangle: no trigonometry, one root and one division in all, and an exponential as an
    eighth power, right to z^4 / 12000 of itself. A flag tells whether a strip slips: a traction that equals the bound
    within a tolerance may stick. Where a strip begins to slip, the traction is cut back to the bound.
    """
    px, py, slips = traction
    u, v, turn = slip
    g, before, rate = traction_bound
    x, y = px - u, py - v
    v += turn * turning_slip_point((abs(u) + abs(v)) * rate)  # |w| well enough, without its root
    square, speed = x * x + y * y, u * u + v * v
    turns = slips * speed > NEGLIGIBLE_SLIP
    size = math.sqrt(speed if turns else square)
    h = min(size * rate, LARGEST_EXPONENT)
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
def cut_to_bound(traction_x, traction_y, bound):
    """Traction (x, y), shortened to the bound g if it exceeds the bound, and 1 if it was shortened, else 0."""
    size = math.sqrt(traction_x * traction_x + traction_y * traction_y)
    sticks = size <= bound
    part = 1.0 if sticks else bound / size
    return part * traction_x, part * traction_y, 0.0 if sticks else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def march_second_order(strip_block, strip_cells):
    """March the strips of a BLOCK with half a first step and the exact rotation of a slipping traction; fills its sums
    and states.
    """
    _clear_block(strip_block)
    for j in range(LANE_COUNT):
        u, v = strip_block.u[j], strip_block.v0[j] + strip_block.v1[j] * strip_cells.middle[0]
        x, y, slips = cut_to_bound(-0.5 * u, -0.5 * v, strip_cells.bound[0])
        _store_traction(strip_block, j, strip_cells.centre[0], x, y, slips)
    change = -2.0 / strip_cells.centre.size
    for i in range(1, strip_cells.centre.size):
        t, g, middle = strip_cells.centre[i], strip_cells.bound[i], strip_cells.middle[i]
        bound = g, strip_cells.start_bound[i], strip_cells.rate[i]
        for j in range(LANE_COUNT):
            u, v1 = strip_block.u[j], strip_block.v1[j]
            v = strip_block.v0[j] + v1 * middle
            traction = strip_block.qx[j], strip_block.qy[j], strip_block.slips[j]
            x, y, slips = advance_traction(traction, (u, v, v1 * change), bound)
            _store_traction(strip_block, j, t, x, y, slips)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def march_plain(strip_block, strip_cells):
    """March the strips of a BLOCK as in 1982: a whole step into each cell, then the traction is cut back to the bound;
    fills its sums and states.
    """
    _clear_block(strip_block)
    for i in range(strip_cells.centre.size):
        t, g = strip_cells.centre[i], strip_cells.bound[i]
        for j in range(LANE_COUNT):
            x = strip_block.qx[j] - strip_block.u[j]
            y = strip_block.qy[j] - (strip_block.v0[j] + strip_block.v1[j] * t)
            x, y, slips = cut_to_bound(x, y, g)
            _store_traction(strip_block, j, t, x, y, slips)


@njit(cache=True, error_model="numpy", fastmath={"contract"}, inline="always")
def _store_traction(strip_block, lane, cell_position, traction_x, traction_y, slips):
    """Store a cell's traction as the state of lane j, and add it to the lane's sums."""
    strip_block.qx[lane] = traction_x
    strip_block.qy[lane] = traction_y
    strip_block.slips[lane] = slips
    strip_block.sum_x[lane] += traction_x
    strip_block.sum_y[lane] += traction_y
    strip_block.sum_t[lane] += cell_position * traction_y
    strip_block.slid[lane] += slips


@compiled
def _clear_block(strip_block):
    """Set sums and states of all lanes of a BLOCK to zero."""
    for j in range(LANE_COUNT):
        strip_block.sum_x[j] = strip_block.sum_y[j] = strip_block.sum_t[j] = strip_block.slid[j] = 0.0
        strip_block.qx[j] = strip_block.qy[j] = strip_block.slips[j] = 0.0
