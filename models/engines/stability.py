"""Largest stable step of an explicit integrator, computed from the vehicle before a run.

A step that is too long does not always show: a mode that grows by a tenth per step leaves a short run
finite, of sane size and wrong. So each fixed-step integrator is written here as the matrix that takes
the state (q, q') of the linearised vehicle over one step, and a step is refused if any mode would grow
over the run. The vehicle itself never grows: its springs and dampers are passive. Zero eigenvalues (a
free vehicle) and weakly damped modes, which a first-order method lets grow a little, are allowed.

The matrices were derived and then compared with the ones measured from the engines, column by column
over five steps (tests/test_guards.py); they agree to 1e-10. They hold about zero pitch, where the vehicle
is stiffest: a tilt shortens the struts' arms. What is not linear is left to the guard that follows every run.
"""

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from models.core.errors import Refused
from models.engines.assembly import Assembly, Settings
from models.vehicles.description import PlaneVehicle, mass_damping_stiffness

LinearMatrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Matrices (n, n) of a linear vehicle: mass, damping, stiffness, the damping that the engine knows (without callbacks),
and the part of the latter on single joints (tyres, pitch springs)."""

ALLOWED_GROWTH = 2.0
"""Factor by which a mode may grow over a run. Rounding moves the double eigenvalue 1 of a free vehicle by 1e-7, which
is 1.06 over 10 minutes at 1 kHz; a step 3 % above RK4's limit passes 2 after seven steps."""

LONG_RUN = 1000
"""Number of steps for which a stated step limit must hold: in a run of eight even RK4 at 4.1 ms does not double."""

TAYLOR = {1: ("ExplicitEuler",), 2: ("ExplicitMidpoint",), 3: ("RK33",), 4: ("RK44", "RK4")}
"""Runge-Kutta methods, by order, whose number of stages is their order: the stability polynomial is the Taylor
polynomial of exp."""
RK67_SEVENTH = -2.2652475842503 / math.factorial(7)
"""Coefficient of z^7 of Exudyn's seven stages of order six, measured from one step (residual 1e-15)."""


def stability_polynomial(integrator: str) -> list[float] | None:
    """Coefficients of the stability polynomial R(z) of a Runge-Kutta method, lowest power first; None for other
    methods."""
    for order, names in TAYLOR.items():
        if integrator in names:
            return [1 / math.factorial(k) for k in range(order + 1)]
    if integrator == "RK67":
        return [*(1 / math.factorial(k) for k in range(7)), RK67_SEVENTH]
    return None


def linearised_matrices(vehicle: PlaneVehicle, prescribed_coordinates: Collection[int] = ()) -> LinearMatrices:
    """The vehicle's matrices about zero pitch, without the ``prescribed_coordinates`` coordinates: pitch springs as
    beyond their dead bands, and tyres on the road."""
    known = replace(vehicle, struts=tuple(strut for strut in vehicle.struts if not strut.pushes_only))
    taut = tuple(replace(spring, dead_band=0.0) for spring in vehicle.pitch_springs)
    mass, damping, stiffness = mass_damping_stiffness(replace(vehicle, pitch_springs=taut))
    native, joint = mass_damping_stiffness(known)[1], mass_damping_stiffness(replace(known, struts=known.tyres))[1]
    kept = [i for i in range(len(mass)) if i not in prescribed_coordinates]
    pick = np.ix_(kept, kept)
    return mass[pick], damping[pick], stiffness[pick], native[pick], joint[pick]


def first_order(linear_matrices: LinearMatrices) -> np.ndarray:
    """State matrix A (2n, 2n) of y' = A y, where y = (q, q')."""
    mass, damping, stiffness, *_ = linear_matrices
    n = len(mass)
    inverse = np.diag(1 / mass.diagonal())
    return np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])


def step_matrix(integrator: str, time_step: float, linear_matrices: LinearMatrices) -> np.ndarray | None:
    """Matrix (2n, 2n) that advances (q, q') by one step (s); None for integrators that are stable with any step.

    That is so for generalised-alpha, the trapezoidal rule and MuJoCo's ``discrete``, which are implicit in
    position and velocity, and for adaptive integrators, which shorten their own steps.
    """
    polynomial = stability_polynomial(integrator)
    if polynomial is not None:
        z = time_step * first_order(linear_matrices)
        out = np.zeros_like(z)
        for coefficient in reversed(polynomial):
            out = out @ z + coefficient * np.eye(len(z))
        return out
    if integrator == "VelocityVerlet":
        return _verlet(time_step, linear_matrices)
    *_, native, joint = linear_matrices
    alone = np.diag(native.diagonal())
    within_trees = alone.copy()  # between coordinates of one body, not across branches
    within_trees[2:, 2:] = native[2:, 2:]
    implicit = {"Euler": joint, "implicit": within_trees, "implicitfast": alone}
    return _semi_implicit(time_step, linear_matrices, implicit[integrator]) if integrator in implicit else None


def _verlet(time_step: float, linear_matrices: LinearMatrices) -> np.ndarray:
    """Matrix (3n, 3n) that advances (q, q', q'') by one step of Exudyn's velocity Verlet.

    The acceleration at the end of a step uses the velocity at its middle, and the next step begins with this
    acceleration, which is therefore part of the state. A single step looks stable up to 5.6 ms, two are stable only up
    to 2.7 ms.
    """
    a = first_order(linear_matrices)
    n = len(a) // 2
    q, v, first = (np.eye(3 * n)[i * n : (i + 1) * n] for i in range(3))
    after = q + time_step * v + 0.5 * time_step**2 * first
    second = a[n:, :n] @ after + a[n:, n:] @ (v + 0.5 * time_step * first)
    return np.vstack([after, v + 0.5 * time_step * (first + second), second])


def _semi_implicit(time_step: float, linear_matrices: LinearMatrices, implicit_damping: np.ndarray) -> np.ndarray:
    """Matrix (2n, 2n) of one step of MuJoCo's single-step integrators: new velocities, with the part
    ``implicit_damping`` (n, n) of the damping taken implicitly, then positions from these."""
    mass, damping, stiffness, *_ = linear_matrices
    n = len(mass)
    q, v = np.eye(2 * n)[:n], np.eye(2 * n)[n:]
    after = v - time_step * np.linalg.solve(mass + time_step * implicit_damping, stiffness @ q + damping @ v)
    return np.vstack([q + time_step * after, after])


def log_growth(integrator: str, time_step: float, duration: float, linear_matrices: LinearMatrices) -> float:
    """Natural logarithm of the factor by which the fastest growing mode grows over a run; 0 if none grows."""
    matrix = step_matrix(integrator, time_step, linear_matrices)
    if matrix is None:
        return 0.0
    radius = float(np.abs(np.linalg.eigvals(matrix)).max())
    return max(0.0, duration / time_step * math.log(radius)) if math.isfinite(radius) else math.inf


def longest_stable_step(
    integrator: str, unstable_step: float, duration: float, linear_matrices: LinearMatrices
) -> float:
    """Longest step (s), to four digits, at which no mode grows over the run; the search starts at an unstable step."""
    allowed, stable = math.log(ALLOWED_GROWTH), unstable_step / 2
    while log_growth(integrator, stable, duration, linear_matrices) > allowed and stable > 1e-12 * unstable_step:
        stable /= 2
    unstable = 2 * stable
    while unstable - stable > 1e-5 * stable:
        middle = 0.5 * (stable + unstable)
        if log_growth(integrator, middle, duration, linear_matrices) > allowed:
            unstable = middle
        else:
            stable = middle
    return stable


def check_step(engine: str, assembly: Assembly, run_settings: Settings) -> None:
    """Raise Refused for a step with which a mode of the vehicle would grow; the message gives the limit and the fastest
    pole."""
    linear = linearised_matrices(assembly.vehicle, assembly.guided)
    grown = log_growth(run_settings.integrator, run_settings.step, run_settings.duration, linear)
    if grown <= math.log(ALLOWED_GROWTH):
        return
    longest = longest_stable_step(
        run_settings.integrator, run_settings.step, max(run_settings.duration, LONG_RUN * run_settings.step), linear
    )
    scale = 10.0 ** (math.floor(math.log10(longest)) - 2)  # three digits, rounded down: a limit that is named must hold
    raise Refused(
        engine,
        f"step {run_settings.step:g} s exceeds the stability limit {math.floor(longest / scale) * scale:g} s of "
        f"{run_settings.integrator} for this vehicle (fastest pole {_fastest_pole_text(linear)}): an error would grow "
        f"1e{grown / math.log(10):.0f}-fold over the run; shorten the step",
    )


def _fastest_pole_text(linear_matrices: LinearMatrices) -> str:
    """Text of the vehicle's eigenvalue with the largest magnitude, in 1/s."""
    poles = np.linalg.eigvals(first_order(linear_matrices))
    pole = complex(poles[np.abs(poles).argmax()])
    real = 0.0 if abs(pole.real) < 1e-9 * abs(pole) else pole.real
    swing = "" if abs(pole.imag) < 1e-9 * abs(pole) else f" +- {abs(pole.imag):.4g}i"
    return f"{real:.4g}{swing} 1/s"
