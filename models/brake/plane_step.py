"""One step of a braked vehicle in the plane: wheels exact, their mean forces to the vehicle, loads solved.

A half step gives the state in the middle, and the whole step takes its slip angles, loads and friction there: order
two. Loads follow from accelerations and these from the tyres' forces under the loads; the whole step finds the fixed
point to ``CLOSE``. Below ``regular``, the speed at which cornering stiffness is as fast as the step, slip angles are
those of that speed.
"""

import math
from typing import NamedTuple

import numpy as np

from models.brake.plane_chain import ALONE, factor, headings, inertia, rows, solve
from models.brake.wheel_step import wheel_step
from models.machine.compiled import inlined, lean
from models.machine.stack import array, doubles
from models.tyre.tyre_table import across, place

CLOSE = 1e-7
"""What is left of the accelerations' error (m/s^2, and rad/s^2 times 1 m) when the loads are taken to be found."""
HALF_ROUNDS, PATIENCE, WINDOW, MOST_WINDOWS = 1, 12, 16, 1000
"""Rounds of a half step, to whose loads those of the step before are close enough for order two; rounds after which
Anderson's method gives way to means; rounds between two looks at their progress; such windows without an answer."""
SPREAD = 1e-3
"""Width (m/s^2, and rad/s^2 times 1 m) to which a jump is closed in where loads have an answer only as a mean: some
newtons of the load of a truck's wheel."""
NEARLY = 0.98
"""Slip from which on the direction of the force goes over to that of a locked tyre: without a jump, which would leave
some loads without an answer."""
FORCE_X, FORCE_Y, LOAD, SLIP, SLIP_ANGLE, LOCKED, TURNING = range(7)
"""Columns of what each wheel reports: mean forces on it (N) in its own axes, load (N), mean slip, slip angle (rad),
time locked (s), speed of turning at the end (rad/s)."""
REPORTED = 7
KNOWN = 19
(
    START,
    RATE,
    ALONG,
    ASIDE,
    ANGLE,
    CELL,
    PART,
    BASE,
    TURNED,
    RADIUS,
    SPIN,
    FIRST,
    SECOND,
    SHARE,
    LAGGED,
    COSINE,
    SINE,
    SIDE,
    BORNE,
) = range(KNOWN)
"""Columns of what is known of each wheel: speed of its centre along it at the start, what its rate has besides the
accelerations, speeds along and across it where slip angles are taken, slip angle with its cell and part in the tables,
load besides the accelerations, speed of turning at the start, radius, inertia, tables and the share of the second, tan
of a slip angle that lags (NaN if it does not), cosine and sine of the angle by which it is steered, place to the left
(m), load (N)."""


class Frame(NamedTuple):
    """What a step's rounds have in common, for W wheels and n coordinates, of which those from ``free`` on are free.

    along, across (W, n): see ``rows``; press (W, n): load by accelerations; known (W, 19): see above; units (U, 2): see
    ``headings``; mass (n, n): the factor of the mass matrix; right (n,): forces besides the tyres' ones; tried (3, n):
    what a round gave, what the one before gave, and by how much that was off.
    """

    along: np.ndarray
    across: np.ndarray
    press: np.ndarray
    known: np.ndarray
    units: np.ndarray
    mass: np.ndarray
    right: np.ndarray
    tried: np.ndarray
    free: int


@inlined
def times(row, vector):
    """Scalar product."""
    total = 0.0
    for a in range(row.size):
        total += row[a] * vector[a]
    return total


@inlined
def moved_to(row, place):
    """Copy a row: an assignment of arrays would make one."""
    for a in range(row.size):
        place[a] = row[a]


@inlined
def begin(turning, surface, plane, known):
    """Fill what is known of the wheels and stays so for a whole step."""
    for i in range(turning.size):
        known[i, TURNED], known[i, RADIUS], known[i, SPIN] = turning[i], plane.radius[i], plane.spin[i]
        known[i, SIDE] = plane.place[i, 1]
        for c in range(3):
            known[i, FIRST + c] = surface[i, c]
        known[i, LAGGED] = surface[i, 3] if surface.shape[1] > 3 else math.nan


@inlined
def settle(positions, rates, steer, regular, starts, plane, angles, frame, found):
    """Fill the frame at a state; ``starts`` at the start of the step, whose speeds along the wheels it keeps."""
    units = frame.units
    headings(positions, units)
    for i in range(plane.unit.size):
        known, along, aside, g, k = frame.known[i], frame.along[i], frame.across[i], plane.group[i], plane.unit[i]
        known[BASE] = plane.static[i]
        if plane.by_x[i] != 0.0 or plane.by_y[i] != 0.0:
            ahead, left = rows(g, 0.0, 0.0, units[g, 0], units[g, 1], units, rates, plane.reach, along, aside)
            for a in range(frame.right.size):
                frame.press[i, a] = plane.by_x[i] * along[a] + plane.by_y[i] * aside[a]
            known[BASE] += plane.by_x[i] * ahead + plane.by_y[i] * left
        if starts:
            before, same = frame.known[i - 1], i > 0 and steer[i] == steer[i - 1]
            known[COSINE] = before[COSINE] if same else math.cos(steer[i])
            known[SINE] = before[SINE] if same else math.sin(steer[i])
        c = units[k, 0] * known[COSINE] - units[k, 1] * known[SINE]
        s = units[k, 1] * known[COSINE] + units[k, 0] * known[SINE]
        ahead, _ = rows(k, plane.place[i, 0], plane.place[i, 1], c, s, units, rates, plane.reach, along, aside)
        u, v = times(along, rates), times(aside, rates)
        if starts:
            known[START] = u
        forwards = u if known[START] >= 0.0 else -u
        known[RATE], known[ALONG] = ahead + v * rates[2 + k], max(forwards, 0.0)
        if not math.isnan(known[LAGGED]):
            v = known[LAGGED] * max(forwards, regular)
        known[ASIDE], known[ANGLE] = v, math.atan2(abs(v), max(forwards, regular))
        known[CELL], known[PART] = place(angles, known[ANGLE])
    inertia(
        units, rates, plane.masses, plane.inertias, plane.reach, frame.mass, frame.right, frame.tried[0], frame.tried[1]
    )
    for a in range(frame.free, frame.right.size):
        for b in range(frame.free):
            frame.right[a] -= frame.mass[a, b] * found[b]
    factor(frame.mass, frame.free)


@inlined
def tyre(known, rate, load, torque0, torque1, step, tables, report):
    """Fill the report (7,) of a wheel whose centre's speed along it changes at a ``rate`` (m/s^2)."""
    _, slips, loads, mu_x, g, h = tables
    start, v, sign = known[START], known[ASIDE], 1.0 if known[START] >= 0.0 else -1.0
    first, second, share = int(known[FIRST]), int(known[SECOND]), known[SHARE]
    c, p = int(known[CELL]), known[PART]
    j, q = place(loads, load)
    grip = (first, second, share, c, p, j, q, load)
    w, force, slip, locked = wheel_step(
        sign * start,
        sign * (start + step * rate),
        sign * known[TURNED],
        torque0,
        torque1,
        step,
        known[RADIUS],
        known[SPIN],
        grip,
        slips,
        mu_x,
    )
    k, part = place(slips, abs(slip))
    side = across(first, c, p, j, q, k, part, g, h)
    if share > 0.0:
        side += share * (across(second, c, p, j, q, k, part, g, h) - side)
    side *= load
    if slip > NEARLY and (known[ALONG] > 0.0 or v != 0.0):  # a locked tyre's force is against the way it slides
        total, speed = math.hypot(force, side), math.hypot(known[ALONG], v)
        part = min((slip - NEARLY) / (1.0 - NEARLY), 1.0)
        force += part * (total * known[ALONG] / speed - force)
        side += part * (total * abs(v) / speed - side)
    report[FORCE_X], report[FORCE_Y] = -sign * force, -math.copysign(side, v) if v != 0.0 else 0.0
    report[LOAD], report[SLIP], report[SLIP_ANGLE] = load, slip, math.copysign(known[ANGLE], v)
    report[LOCKED], report[TURNING] = locked, sign * w


@lean
def share_out(known):
    """Loads of vehicles of two axles of which a wheel would lift: it bears none, and the statics of the others hold.

    The other wheel of its axle bears the axle's load, and the other axle what this one cannot take of the roll moment.
    An axle that would lift leaves all its load to the other one. Beyond balance, both wheels of a side bear none.
    """
    for first in range(0, known.shape[0] - 3, 4):
        front, rear = known[first : first + 2, BORNE], known[first + 2 : first + 4, BORNE]
        width, behind = known[first, SIDE] - known[first + 1, SIDE], known[first + 2, SIDE] - known[first + 3, SIDE]
        ahead, back, moved, moved_back = front[0] + front[1], rear[0] + rear[1], front[1] - front[0], rear[1] - rear[0]
        ahead, back = max(ahead + min(back, 0.0), 0.0), max(back + min(ahead, 0.0), 0.0)
        kept, kept_back = min(max(moved, -ahead), ahead), min(max(moved_back, -back), back)
        more, more_back = (moved_back - kept_back) * behind / width, (moved - kept) * width / behind
        kept, kept_back = min(max(kept + more, -ahead), ahead), min(max(kept_back + more_back, -back), back)
        front[0], front[1] = 0.5 * (ahead - kept), 0.5 * (ahead + kept)
        rear[0], rear[1] = 0.5 * (back - kept_back), 0.5 * (back + kept_back)


@inlined
def respond(found, torque0, torque1, step, tables, frame, out, report):
    """Fill ``out`` (n,) with the accelerations by the tyres' forces if they were ``found``: the map whose fixed point
    is wanted."""
    lifts = False
    for a in range(out.size):
        out[a] = found[a] if a < frame.free else frame.right[a]
    for i in range(torque0.size):
        frame.known[i, BORNE] = frame.known[i, BASE] + times(frame.press[i], found)
        lifts = lifts or frame.known[i, BORNE] < 0.0
    if lifts:
        share_out(frame.known)
    for i in range(torque0.size):
        known, along, aside = frame.known[i], frame.along[i], frame.across[i]
        tyre(known, known[RATE] + times(along, found), known[BORNE], torque0[i], torque1[i], step, tables, report[i])
        for a in range(frame.free, out.size):
            out[a] += along[a] * report[i, FORCE_X] + aside[a] * report[i, FORCE_Y]
    solve(frame.mass, frame.free, out)


@inlined
def stage(torque0, torque1, step, most, tables, frame, found, report):
    """Mean accelerations over a step, into ``found`` (n,): what stands there is where the search begins.

    Anderson's method of depth one for at most so many rounds, of which ``PATIENCE`` that do not settle give way to
    means. Returns what is left of the error: the last change, which the round has made smaller as it did the change
    before.
    """
    left, before, out, out0, off0 = math.inf, 0.0, frame.tried[0], frame.tried[1], frame.tried[2]
    for rounds in range(most):
        respond(found, torque0, torque1, step, tables, frame, out, report)
        change, product, square = 0.0, 0.0, 0.0
        for a in range(out.size):
            off = out[a] - found[a]
            change = max(change, abs(off))
            product += off * (off - off0[a])
            square += (off - off0[a]) ** 2
        left = change * min(change / before, 1.0) if before > 0.0 else change
        done, before = not left > CLOSE or rounds == most - 1, change
        mix = min(max(product / square, -2.0), 0.75) if rounds > 0 and square > 0.0 and not done else 0.0
        for a in range(out.size):
            off0[a] = out[a] - found[a]
            found[a] = out[a] - mix * (out[a] - out0[a])
            out0[a] = out[a]
        if done:
            break
    return left if left <= CLOSE or most < PATIENCE else by_means(torque0, torque1, step, tables, frame, found, report)


@lean
def by_means(torque0, torque1, step, tables, frame, found, report):
    """As ``stage``, where loads jump between two answers and have one only as a mean of them.

    So it is of a slow wheel at the edge of locking: a little less load, and it locks at once; a little more, and it
    rolls within a fraction of the step. Each round moves ``found`` by a share of its change, and the means of all
    reports with it, so that forces and accelerations stay in balance. The share is halved where rounds go to and fro,
    or are thrown back from an edge that they approached, and never grows: forces that fall steeply with load would send
    them to and fro again. The limit is Filippov's solution: the edge itself, locked for a part of the step.
    Source: A. F. Filippov, Differential equations with discontinuous righthand sides (1988); W. R. Mann, Proc. AMS 4
    (1953) 506-510; recalled, not checked.
    """
    wheels, size, share, before, out = torque0.size, found.size, 0.5, math.inf, frame.tried[0]
    means, begun = array(doubles(wheels * REPORTED), (wheels, REPORTED)), array(doubles(size), (size,))
    respond(found, torque0, torque1, step, tables, frame, out, report)
    moved_to(out, found)
    for i in range(wheels):
        moved_to(report[i], means[i])
    for _ in range(MOST_WINDOWS):
        way, net, most, change = 0.0, 0.0, 0.0, 0.0
        moved_to(found, begun)
        for _ in range(WINDOW):
            respond(found, torque0, torque1, step, tables, frame, out, report)
            change = 0.0
            for a in range(size):
                change = max(change, abs(out[a] - found[a]))
                way += share * abs(out[a] - found[a])
            if not change > CLOSE:
                moved_to(out, found)
                return change
            most = max(most, change)
            for a in range(size):
                found[a] += share * (out[a] - found[a])
            for i in range(wheels):
                for c in range(REPORTED):
                    means[i, c] += share * (report[i, c] - means[i, c])
        for a in range(size):
            net += abs(found[a] - begun[a])
        turns, thrown = net < 0.5 * way, change > before
        if (turns and share * change <= SPREAD) or (thrown and share * most <= SPREAD):
            for i in range(wheels):
                moved_to(means[i], report[i])
            return 0.0
        share, before = 0.5 * share if turns or thrown else share, change
    return math.inf


@inlined
def comes_to_rest(rates, turning, found, step, plane):
    """Time (s) within the step at which the vehicle stands, or -1 if it does not.

    Friction takes speed away until there is none, and only the time grid would let it turn round: it stands where its
    kinetic energy along the step is least, if it was about to lose all of its speed in that step anyhow.
    """
    speed, both, rate, mass = 0.0, 0.0, 0.0, 0.0
    for k in range(rates.size - 2):
        mass += plane.masses[k]
    for a in range(rates.size):
        weight = mass if a < 2 else plane.inertias[a - 2]
        speed += weight * rates[a] ** 2
        both += weight * rates[a] * found[a]
        rate += weight * found[a] ** 2
    if speed == 0.0 and not turning.any():
        return 0.0
    if rate == 0.0 or both >= 0.0 or -both > step * rate or speed > 2.25 * step * step * rate:
        return -1.0
    return -both / rate


@lean
def step_on(state, turning, torque0, torque1, step, steer, surface, regular, plane, tables, found, report):
    """One step of ``state`` (2, n), positions and rates, and ``turning`` (W,): speeds of the wheels (rad/s).

    torque0, torque1 : of the brakes (W,) at the step's ends; steer (W,) : angles of the wheels in their units (rad);
    surface (W, 3 or 4) : tables of each wheel, the share of the second, tan of a slip angle that lags; regular : m/s;
    found (n,) : accelerations, those of the step before on entry. Returns the time (s) of the step at which the vehicle
    comes to rest, ``step`` if it does not, -1 if the loads were not found.
    """
    wheels, size = turning.size, 2 + len(plane.units)
    ways, known = array(doubles(3 * wheels * size), (3, wheels, size)), array(doubles(wheels * KNOWN), (wheels, KNOWN))
    units, mass = array(doubles(2 * (size - 2)), (size - 2, 2)), array(doubles(size * size), (size, size))
    some, middle = array(doubles(6 * size), (6, size)), array(doubles(wheels), (wheels,))
    frame = Frame(
        ways[0], ways[1], ways[2], known, units, mass, some[0], some[1:4], 0 if size == ALONE else 2 * plane.hooked
    )
    frame.press[:], frame.tried[:] = 0.0, 0.0
    place0, rate0 = some[4], some[5]
    for a in range(size):
        place0[a], rate0[a] = state[0, a], state[1, a]
    for i in range(wheels):
        middle[i] = 0.5 * (torque0[i] + torque1[i])
    begin(turning, surface, plane, frame.known)
    for half in (True, False):
        settle(state[0], state[1], steer, regular, half, plane, tables[0], frame, found)
        time, last = (0.5 * step, middle) if half else (step, torque1)
        most = HALF_ROUNDS if half else PATIENCE
        if not stage(torque0, last, time, most, tables, frame, found, report) <= (math.inf if half else CLOSE):
            return -1.0
        rest = comes_to_rest(rate0, turning, found, step, plane) if half and not plane.hooked else -1.0
        if rest >= 0.0:
            time = rest
        for a in range(size):
            state[1, a] = rate0[a] + time * found[a]
            state[0, a] = place0[a] + 0.5 * time * (rate0[a] + state[1, a])
        if rest >= 0.0:
            state[1], turning[:] = 0.0, 0.0
            return rest
    for i in range(wheels):
        turning[i] = report[i, TURNING]
    return step
