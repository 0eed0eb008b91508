"""One wheel through one step: exact between the nodes of its tyre table, with an explicit locked state.

With the speed u of its centre changing at a constant rate over the step, J w' = r F(s) - T and s = (u - r w) / u give

    s' = -(r^2 / (J u)) (F(s) - T / r) + (1 - s) u' / u

of which F is linear in s from node to node: with u in the denominators at its mean, each piece is an exponential and
the time of its end a logarithm. The force that the vehicle takes over the step is the mean one,

    F = (J (w1 - w0) / h + T) / r,

so that no momentum is lost. The paper's scheme (exact wheel, start-of-step force on the vehicle) is up to 58 % off in
the stopping distance of light braking. A wheel that has stopped stays so while T >= r F(1).
"""

import math

from models.machine.compiled import lean
from models.tyre.tyre_table import along, place

SLOWEST = 1e-9
"""Speed (m/s) below which a wheel's centre is taken to have this one: slip has no meaning at rest."""
MOST_PIECES = 100_000


@lean
def phi_1(z):
    """(exp(z) - 1) / z."""
    return math.expm1(z) / z if abs(z) > 1e-5 else 1.0 + z / 2.0 + z * z / 6.0


@lean
def passed(way, rate, decay, time):
    """Integral over a time of what covers a way with a rate that decays as exp(-decay t)."""
    z = decay * time
    return time * way * (0.5 + z / 12.0) if abs(z) < 0.01 else (rate * time - way) / decay


@lean
def node(k, slips):
    """Slip at node k; at -k the opposite one."""
    return slips[k] if k >= 0 else -slips[-k]


@lean
def node_force(k, grip, mu_x):
    """Force (N) at slip node k, at -k the opposite one. grip: two tables, share of the second, cells, load."""
    first, second, share, i, p, j, q, load = grip
    mu = along(first, i, p, j, q, abs(k), mu_x)
    if share > 0.0:
        mu += share * (along(second, i, p, j, q, abs(k), mu_x) - mu)
    return load * mu if k >= 0 else -load * mu


@lean
def roll(slip, left, kappa, fade, held, grip, slips, mu_x):
    """A wheel at a slip from -1 to 1 for at most ``left`` seconds or until it leaves them.

    kappa : r^2 / (J u) in 1/(N s); fade : u' / u in 1/s; held : T / r in N. Returns the time used, slip then and
    integral of the slip (s).
    """
    last, used, area, turned = slips.size - 1, 0.0, 0.0, 0
    cell = place(slips, abs(slip))[0]
    if slip < 0.0:
        cell = -cell - 1
    low, high = node_force(cell, grip, mu_x), node_force(cell + 1, grip, mu_x)
    for _ in range(MOST_PIECES):
        bottom, top = node(cell, slips), node(cell + 1, slips)
        slope = (high - low) / (top - bottom)
        rate = kappa * (held - high - slope * (slip - top)) + (1.0 - slip) * fade
        target, turn = (top, 1) if rate > 0.0 else (bottom, -1)
        if rate != 0.0 and target == slip:
            if turned == -turn:  # either cell sends it into the other one: by rounding, it rests on their node
                return left, slip, area + slip * (left - used)
            cell, turned = cell + turn, turn
            if cell == last or cell < -last:
                return used, slip, area
            if turn > 0:
                low, high = high, node_force(cell + 1, grip, mu_x)
            else:
                low, high = node_force(cell, grip, mu_x), low
            continue
        decay = kappa * slope + fade
        time = _way(decay, rate, target - slip)
        if used + time >= left:
            some = left - used
            way = rate * some * phi_1(-decay * some)
            end = min(slip + way, target) if turn > 0 else max(slip + way, target)  # not beyond it by rounding
            return left, end, area + some * slip + passed(way, rate, decay, some)
        area += time * slip + passed(target - slip, rate, decay, time)
        used, slip, turned = used + time, target, 0
    return used, math.nan, area


@lean
def _way(decay, rate, way):
    """Time in which a rate that decays as exp(-decay t) covers a way of its sign; infinite if it never does."""
    if rate == 0.0:
        return math.inf
    share = decay * way / rate
    if share >= 1.0:
        return math.inf
    if abs(share) < 1e-9:
        return way / rate * (1.0 + 0.5 * share)
    return -math.log1p(-share) / decay


@lean
def wheel_step(u0, u1, w0, torque0, torque1, step, radius, inertia, grip, slips, mu_x):
    """A wheel whose centre goes from speed u0 to u1, both from 0 on, while the brake's torque goes from one to another.

    w0 : speed of turning (rad/s), negative if against the direction of u. Torques in N m, from 0 on, linear in time.
    Returns the speed of turning at the end, the mean force (N, positive if it brakes the vehicle), the mean slip, for
    which slips below -1 count as -1, and the time (s) for which the wheel was locked.
    """
    u0, u1 = max(u0, SLOWEST), max(u1, 0.0)
    mean = max(0.5 * (u0 + u1), SLOWEST)
    kappa, fade, last = radius * radius / (inertia * mean), (u1 - u0) / (step * mean), slips.size - 1
    sliding = node_force(last, grip, mu_x)
    gain, now, impulse, area, locked = (torque1 - torque0) / step, 0.0, 0.0, 0.0, 0.0
    slip = 1.0 - radius * w0 / u0
    if slip > 1.0:  # it turns backwards: road and brake both stop that
        stops = sliding * radius + 0.5 * (torque0 + torque1)
        if stops * step <= -inertia * w0:
            return w0 + stops * step / inertia, sliding, slip, 0.0
        now = -inertia * w0 / stops
        impulse, area, slip = sliding * now, now, 1.0
    freed = False
    while now < step:
        left, torque = step - now, torque0 + gain * now
        held = 0.5 * (torque + torque1) / radius
        if slip >= 1.0 and not freed and max(torque / radius, held) >= sliding:
            free = now + (radius * sliding - torque) / gain if torque1 < radius * sliding else step
            impulse += sliding * (free - now)
            area += free - now
            locked += free - now
            now, slip, freed = free, 1.0, True
            continue
        u = u0 + (u1 - u0) * now / step
        start = u * (1.0 - slip) / radius
        ahead, gain_on = radius * start - 2.0 * u, -radius * (radius * sliding + held * radius) / inertia
        gain_on -= 2.0 * (u1 - u0) / step
        if slip < -1.0 or (slip == -1.0 and gain_on > 0.0):  # it turns twice as fast as it rolls: friction is steady
            used = min(left, -ahead / gain_on) if gain_on < 0.0 else left
            now += used
            impulse -= sliding * used
            area -= used
            if now >= step:
                turned = start - radius * (sliding + held) * used / inertia
                return turned, impulse / step, area / step, locked
            slip, freed = -1.0, False
            continue
        used, slip, part = roll(min(slip, 1.0), left, kappa, fade, held, grip, slips, mu_x)
        if used == 0.0:  # by rounding alone: neither what lies beyond nor this takes it
            used = left
        now += used
        end = (u0 + (u1 - u0) * now / step) * (1.0 - slip) / radius
        impulse += inertia * (end - start) / radius + held * used
        area += part
        freed = False
        if not slip <= 1.0:
            return math.nan, math.nan, math.nan, math.nan
    return u1 * (1.0 - slip) / radius, impulse / step, area / step, locked
