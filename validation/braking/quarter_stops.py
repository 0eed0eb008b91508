"""A quarter vehicle braked to a stop by a constant torque: by twinrig, by other integration schemes, and exactly.

Explicit Euler and Runge-Kutta 4 take wheel and vehicle together. The literal scheme is the paper's as it is written:
the wheel exact over a step with the secant slope F(s) / s, the vehicle by the tyre's force at the start of the step.
None of them knows a locked state; slips beyond 1 have the force of 1, below 0 the opposite one.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from models.brake.plane_vehicle import GRAVITY
from models.brake.quarter import QuarterStop, QuarterVehicle, stop_of_quarter_vehicle
from models.brake.surfaces import UNIFORM_ROAD
from models.machine.compiled import njit
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import StackedTyreTables, TyreTable, cell_and_share, stacked_tables

EULER, RK4, LITERAL = "explicit Euler", "RK4", "paper's, literal"
SCHEMES = (EULER, RK4, LITERAL)
SLOWEST_SPEED = 1e-6
"""Speed (m/s) below which slip is computed as at this speed."""
SETTLED_RATE = 1e-11
"""Rate of the slip divided by its initial rate at which the slip counts as constant."""
LONGEST_TIME_RATIO = 3.0


class QuarterCar(NamedTuple):
    """A quarter vehicle: mass (kg), radius (m) and inertia (kg m^2) of its wheel."""

    mass: float
    radius: float
    inertia: float


class FrictionCurve(NamedTuple):
    """Friction coefficients mu (n,) at slips (n,), linear between them."""

    slips: np.ndarray
    mu: np.ndarray


class FrictionChange(NamedTuple):
    """A road whose friction curve changes at a position (m)."""

    before: FrictionCurve
    after: FrictionCurve
    position: float = math.inf


@njit(cache=True, error_model="numpy")
def force_at(speed, spin, quarter_car, friction_curve):
    """Longitudinal tyre force (N) and slip of a wheel with angular velocity ``spin`` (rad/s), whose centre
    moves at ``speed`` (m/s)."""
    speed, mu = max(speed, SLOWEST_SPEED), friction_curve.mu
    slip = (speed - quarter_car.radius * spin) / speed
    cell, share = cell_and_share(friction_curve.slips, min(abs(slip), 1.0))
    return math.copysign(quarter_car.mass * GRAVITY * (mu[cell] + share * (mu[cell + 1] - mu[cell])), slip), slip


@njit(cache=True, error_model="numpy")
def rates(speed, spin, brake_torque, quarter_car, friction_curve):
    """Time derivatives of the vehicle's speed (m/s^2) and of the wheel's angular velocity (rad/s^2); the brake holds a
    wheel that does not turn."""
    force, _ = force_at(speed, spin, quarter_car, friction_curve)
    brake = brake_torque if spin > 0.0 else min(brake_torque, quarter_car.radius * force)
    return -force / quarter_car.mass, (quarter_car.radius * force - brake) / quarter_car.inertia


@njit(cache=True, error_model="numpy")
def literal_paper_step(speed, spin, brake_torque, quarter_car, friction_curve, step):
    """Vehicle speed (m/s) and wheel's angular velocity (rad/s) after a step (s) of the scheme as printed in the
    paper."""
    mass, radius, inertia = quarter_car
    force, slip = force_at(speed, spin, quarter_car, friction_curve)
    secant = force / slip if abs(slip) > 1e-12 else mass * GRAVITY * friction_curve.mu[1] / friction_curve.slips[1]
    decay = secant * radius * radius / (inertia * max(speed, SLOWEST_SPEED))
    settled = (
        (speed - brake_torque * speed / (radius * secant)) / radius
        if secant > 0.0
        else spin - brake_torque / inertia * step
    )
    return speed - step * force / mass, max(settled + (spin - settled) * math.exp(-decay * step), 0.0)


@njit(cache=True, error_model="numpy")
def step_of_scheme(scheme, speed, spin, brake_torques, quarter_car, friction_curve, step):
    """Vehicle speed (m/s) and wheel's angular velocity (rad/s) after a step (s) of a scheme (0 Euler, 1 RK4, 2 the
    paper's), with brake torques (N m) at the step's start and end."""
    torque_at_start, torque_at_end = brake_torques
    middle = 0.5 * (torque_at_start + torque_at_end)
    if scheme == 2:
        return literal_paper_step(speed, spin, middle, quarter_car, friction_curve, step)
    a, b = rates(speed, spin, torque_at_start, quarter_car, friction_curve)
    if scheme == 0:
        return speed + step * a, spin + step * b
    a2, b2 = rates(speed + 0.5 * step * a, spin + 0.5 * step * b, middle, quarter_car, friction_curve)
    a3, b3 = rates(speed + 0.5 * step * a2, spin + 0.5 * step * b2, middle, quarter_car, friction_curve)
    a4, b4 = rates(speed + step * a3, spin + step * b3, torque_at_end, quarter_car, friction_curve)
    return speed + step / 6.0 * (a + 2.0 * a2 + 2.0 * a3 + a4), spin + step / 6.0 * (b + 2.0 * b2 + 2.0 * b3 + b4)


@njit(cache=True, error_model="numpy")
def march(scheme, speed, spin, brake_torques, quarter_car, friction_change, step):
    """Stopping distance (m), number of steps and remaining speed (m/s) by a scheme (0 Euler, 1 RK4, 2 the paper's).
    brake_torques (n + 1,): N m at the ends of the steps (s); the number of steps is -1 if the vehicle does not stop.

    speed (m/s), spin (rad/s) : at the start; friction_change : a ``FrictionChange``.
    """
    x = 0.0
    for n in range(brake_torques.size - 1):
        curve = friction_change.before if x < friction_change.position else friction_change.after
        speed_after, turning = step_of_scheme(
            scheme, speed, spin, (brake_torques[n], brake_torques[n + 1]), quarter_car, curve, step
        )
        if speed_after <= 0.0:
            return x + 0.5 * speed * step * speed / (speed - speed_after), n + 1, 0.0
        x += 0.5 * step * (speed + speed_after)
        speed, spin = speed_after, max(turning, 0.0)
    return x, -1, speed


def stop_by_scheme(
    scheme: int,
    quarter_car: QuarterVehicle,
    brake_torques: np.ndarray,
    friction_change: FrictionChange,
    speed: float,
    time_step: float,
) -> tuple[float, int, float]:
    """Stopping distance (m), number of steps and remaining speed (m/s), by a scheme, of a quarter vehicle that starts
    with a rolling wheel at a speed (m/s)."""
    numbers = QuarterCar(quarter_car.mass, quarter_car.radius, quarter_car.spin_inertia)
    distance, steps, left = march(
        scheme, speed, speed / quarter_car.radius, brake_torques, numbers, friction_change, time_step
    )
    return distance, steps, left


def stopping_distance(
    scheme: str, quarter_car: QuarterVehicle, tyre_table: TyreTable, brake_torque: float, speed: float, time_step: float
) -> tuple[float, float]:
    """Stopping distance (m) and remaining speed (m/s) by one of SCHEMES under a constant brake torque (N m), from a
    speed (m/s) with a rolling wheel.

    A scheme may chatter or creep for ever. The run ends after LONGEST_TIME_RATIO times the time that the torque alone
    would take; then the distance until that time is returned. The remaining speed is 0 after a stop.
    """
    step_limit = int(LONGEST_TIME_RATIO * speed * quarter_car.mass * quarter_car.radius / (brake_torque * time_step))
    curve = FrictionCurve(tyre_table.slips, tyre_table.mu_x[0, 0])
    distance, _, left = stop_by_scheme(
        SCHEMES.index(scheme),
        quarter_car,
        np.full(step_limit + 1, brake_torque),
        FrictionChange(curve, curve),
        speed,
        time_step,
    )
    return distance, left


def exact_distance(quarter_car: QuarterVehicle, tyre_table: TyreTable, brake_torque: float, speed: float) -> float:
    """Exact stopping distance (m), to a relative accuracy of 1e-9, under a constant torque (N m) from a speed (m/s)
    with a rolling wheel.

    In a stretched time q, dt = u dq, the slip has an equation of its own, s' = -(r^2 / J) (F - T / r) - (1 - s) F / m,
    and ln u falls by F / m: no speed stands in a denominator. Once the slip has settled, or is 1, the force is
    constant and the rest u^2 m / (2 F).
    """
    nodes, forces = tyre_table.slips, quarter_car.mass * GRAVITY * tyre_table.mu_x[0, 0]
    m, r, inertia = quarter_car.mass, quarter_car.radius, quarter_car.spin_inertia

    def rates_in(stretched_time: float, state: np.ndarray) -> list[float]:
        force = float(np.interp(state[0], nodes, forces))
        return [
            -(r * r / inertia) * (force - brake_torque / r) - (1.0 - state[0]) * force / m,
            -force / m,
            math.exp(2.0 * state[1]),
        ]

    def settled(stretched_time: float, state: np.ndarray) -> float:
        return float(
            min(rates_in(stretched_time, state)[0] / (r * brake_torque / inertia) - SETTLED_RATE, 1.0 - state[0])
        )

    settled.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        rates_in, (0.0, 1e9), [0.0, math.log(speed), 0.0], "DOP853", rtol=1e-12, atol=1e-14, events=settled
    )
    slip, log_speed, distance = solution.y[:, -1]
    return float(distance + math.exp(2.0 * log_speed) * m / (2.0 * np.interp(slip, nodes, forces)))


FRONT_WHEEL = QuarterVehicle(mass=16900.0 / GRAVITY, radius=0.5, spin_inertia=13.35)
"""A front wheel of the paper's truck with the mass that it carries while braking."""
PAPER_STEP = 5.5e-3
"""Time step of the paper (s)."""


@cache
def friction_table(surface_name: str, friction_scale: float = 1.0) -> tuple[TyreTable, StackedTyreTables]:
    """Tyre table of a surface, as an object and in the form for compiled functions."""
    tyre = table_of_surface(surface_name, friction_scale)
    return tyre, stacked_tables([tyre])


def steady_torque(quarter_car: QuarterVehicle, tyre_table: TyreTable, slip: float) -> tuple[float, float]:
    """Tyre force (N) at a slip, and brake torque (N m) at which this slip stays constant."""
    force = quarter_car.mass * GRAVITY * float(np.interp(slip, tyre_table.slips, tyre_table.mu_x[0, 0]))
    return force, quarter_car.steady_torque(slip, force)


def constant_torque_stop(
    quarter_car: QuarterVehicle,
    tyre_table: tuple[TyreTable, StackedTyreTables],
    brake_torque: float,
    speed: float,
    time_step: float = PAPER_STEP,
    extra_time: float = 0.0,
    rim_turning: float | None = None,
) -> QuarterStop:
    """Stop of a quarter vehicle under a constant brake torque (N m), by twinrig. The run lasts ``extra_time`` (s)
    longer than a stop would take with the smaller of two forces: torque / radius, and locked-wheel friction.
    """
    least_force = min(
        brake_torque / quarter_car.radius, quarter_car.mass * GRAVITY * float(tyre_table[0].mu_x[0, 0, -1])
    )
    steps = (
        math.ceil((1.25 * speed * quarter_car.mass / least_force + 0.5 + extra_time) / time_step)
        if brake_torque > 0.0
        else 1000
    )
    return stop_of_quarter_vehicle(
        quarter_car, tyre_table[1], UNIFORM_ROAD, np.full(steps + 1, brake_torque), time_step, speed, rim_turning
    )
