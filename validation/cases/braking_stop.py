"""A quarter vehicle braked to a stop: stopping distances compared with the exact ones and with other integration
schemes, locked wheels, standstill."""

import math
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.plane_vehicle import GRAVITY
from models.brake.quarter import QuarterStop, QuarterVehicle, stop_of_quarter_vehicle
from models.brake.surfaces import UNIFORM_ROAD
from models.tyre.magic_formula import NAMED_SURFACES
from validation.braking.quarter_stops import (
    FRONT_WHEEL,
    LONGEST_TIME_RATIO,
    PAPER_STEP,
    SCHEMES,
    constant_torque_stop,
    exact_distance,
    friction_table,
    steady_torque,
    stopping_distance,
)
from validation.common.rows import Observed, Row, System, Table

TITLE = "Braking to a stop"
SYSTEM: System = "anti-lock"
HEADLINE_CASES = {
    "ice, 3 % slip": ("ice", 0.03, 11.11),
    "dry, 6 % slip": ("dry", 0.06, 22.22),
    "ice, light": ("ice", 0.003, 11.11),
    "dry, light": ("dry", 0.004, 22.22),
}
"""Surface, steady slip and initial speed (m/s) of each headline case."""
FURTHER_CASES = {
    "snow": ("snow", 0.04, 13.9, 1.0, 1.0),
    "snow, light": ("snow", 0.004, 13.9, 1.0, 1.0),
    "wet": ("wet", 0.05, 22.22, 1.0, 1.0),
    "wet, light": ("wet", 0.003, 22.22, 1.0, 1.0),
    "slow": ("dry", 0.03, 3.0, 1.0, 1.0),
    "fast": ("dry", 0.03, 40.0, 1.0, 1.0),
    "light vehicle": ("ice", 0.02, 11.11, 0.2, 1.0),
    "heavy vehicle": ("ice", 0.02, 11.11, 5.0, 1.0),
    "light wheel": ("wet", 0.03, 11.11, 1.0, 0.1),
    "heavy wheel": ("wet", 0.03, 11.11, 1.0, 4.0),
}
"""Surface, steady slip, initial speed (m/s), and factors of mass and of spin inertia of each further case."""
DISTANCE_ERROR_BOUND = 5e-4
"""Largest relative error of a stopping distance that is asked for."""
SWEEP_STEPS = {True: (PAPER_STEP, 2e-2), False: (1e-4, 5e-4, 1e-3, 2e-3, PAPER_STEP, 1e-2, 2e-2)}
"""Steps (s) of the sweep over brake torques, for a quick run (True) and a full run (False)."""
SMALLEST_STEP_IN_FIGURE = 5e-4
"""Smallest of the sweep's steps (s) that the figure shows."""
FULL_SWEEP_SURFACES = ("dry", "wet", "snow", "ice")
"""Surfaces on which the sweep takes every brake torque at every step."""
TORQUE_LEVELS, TORQUE_LEVEL_SELECTION = np.linspace(0.0, 1.5, 16), slice(None, None, 5)
"""Brake torques of the sweep divided by the locking torque; and the selection of these levels for the quick run, and
for other surfaces in steps below the paper's."""
SLOW_START_SPEED = 0.5
"""Initial speed (m/s) of the sweep with steps below 1 ms, which would otherwise take many steps."""
STANDSTILL_SECONDS = 2.0
"""Time (s) for which the simulation goes on after a stop, to see that the vehicle stays at rest."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of all stops. A quick run has the four headline cases, and a sweep with two steps on two surfaces."""
    steps = tuple(step for step in SWEEP_STEPS[quick] if step >= SMALLEST_STEP_IN_FIGURE)
    curves = {
        name: _stopping_distance_errors(*headline_arguments, steps)
        for name, headline_arguments in HEADLINE_CASES.items()
    }
    rows = [row for name, curve in curves.items() for row in _headline_case_rows(name, curve)]
    if not quick:
        rows += [
            _stopping_distance_row(name, *headline_arguments) for name, headline_arguments in FURTHER_CASES.items()
        ]
    rows += [
        _torque_sweep_row(
            ("ice", "dry") if quick else tuple(NAMED_SURFACES),
            TORQUE_LEVELS[TORQUE_LEVEL_SELECTION] if quick else TORQUE_LEVELS,
            SWEEP_STEPS[quick],
        ),
        _locked_wheel_row(),
        _wheel_release_row(),
        _friction_level_row(9 if quick else 25),
    ]
    return rows, {"curves": curves, "steps": steps}


def _stopping_distance_errors(
    surface_name: str, steady_slip: float, start_speed: float, time_steps: tuple[float, ...]
) -> dict[str, Any]:
    """Errors of twinrig's and of other integration schemes over the step: relative error of the stopping distance, and
    the remaining speed (m/s) if a scheme does not stop."""
    tyre, _ = both = friction_table(surface_name)
    force, torque = steady_torque(FRONT_WHEEL, tyre, steady_slip)
    true = exact_distance(FRONT_WHEEL, tyre, torque, start_speed)
    distances = {
        "ours": [
            (constant_torque_stop(FRONT_WHEEL, both, torque, start_speed, step).distance, 0.0) for step in time_steps
        ]
    }
    distances |= {
        key: [stopping_distance(key, FRONT_WHEEL, tyre, torque, start_speed, step) for step in time_steps]
        for key in SCHEMES
    }
    steadily = constant_torque_stop(
        FRONT_WHEEL, both, torque, start_speed, rim_turning=(1.0 - steady_slip) * start_speed / FRONT_WHEEL.radius
    ).distance
    return {
        "exact": true,
        "steady": steadily / (FRONT_WHEEL.mass * start_speed**2 / (2.0 * force)) - 1.0,
        "errors": {key: [(distance / true - 1.0, left) for distance, left in ends] for key, ends in distances.items()},
        "at": time_steps.index(PAPER_STEP),
    }


def _headline_case_rows(case_name: str, error_curves: dict[str, Any]) -> list[Row]:
    """Rows of a headline case: error of the stopping distance, and that of other integration schemes."""
    key, at = f"braking_stop.{case_name.replace(', ', '.').replace(' %', '').replace(' ', '.')}", error_curves["at"]
    errors = {scheme: curves[at] for scheme, curves in error_curves["errors"].items()}
    ours, _ = errors.pop("ours")
    why = f"asked for; the exact distance is {error_curves['exact']:.6f} m, from the slip's own equation to 1e-9"
    rows = [
        Observed(
            f"{key}.distance",
            SYSTEM,
            f"relative error of the stopping distance of a wheel that rolls first, {case_name}, steps of 5.5 ms",
            ours,
            "",
        ).at_most(DISTANCE_ERROR_BOUND, why, "closed form"),
        Observed(
            f"{key}.steady",
            SYSTEM,
            f"relative error of the stopping distance at constant slip, {case_name}, steps of 5.5 ms",
            error_curves["steady"],
            "",
        ).at_most(1e-7, "m v^2 / (2 F); exact in each step but the last, at rest", "closed form"),
    ]
    for scheme, (error, left) in errors.items():
        note = (
            f", and still rolls at {left:.2g} m/s in {LONGEST_TIME_RATIO:g} times the time of stopping" if left else ""
        )
        rows.append(
            Observed(
                f"{key}.{scheme.split()[-1].lower()}",
                SYSTEM,
                f"relative error of the stopping distance with {scheme}, {case_name}, steps of 5.5 ms{note}",
                100.0 * error,
                "%",
            ).beside(f"{100.0 * ours:.1e} % of ours", "the same vehicle, torque and table", "closed form")
        )
    return rows


def _stopping_distance_row(
    case_name: str,
    surface_name: str,
    steady_slip: float,
    start_speed: float,
    mass_factor: float,
    spin_inertia_factor: float,
) -> Row:
    """Row of a further case: error of the stopping distance."""
    quarter = QuarterVehicle(
        mass=mass_factor * FRONT_WHEEL.mass,
        radius=FRONT_WHEEL.radius,
        spin_inertia=spin_inertia_factor * FRONT_WHEEL.spin_inertia,
    )
    tyre, _ = both = friction_table(surface_name)
    torque = steady_torque(quarter, tyre, steady_slip)[1]
    error = (
        constant_torque_stop(quarter, both, torque, start_speed).distance
        / exact_distance(quarter, tyre, torque, start_speed)
        - 1.0
    )
    return Observed(
        f"braking_stop.further.{case_name.replace(', ', '.').replace(' ', '-')}",
        SYSTEM,
        f"relative error of the stopping distance, {case_name} ({surface_name}, {100 * steady_slip:g} % slip, "
        f"{start_speed:g} "
        "m/s), steps of 5.5 ms",
        error,
        "",
    ).at_most(DISTANCE_ERROR_BOUND, "as the four above", "closed form")


def broken_plausibility_rules(quarter_stop: QuarterStop, wheel_radius: float, is_braked: bool) -> list[str]:
    """Names of the rules of plausibility that a simulated stop breaks."""
    path, speed = quarter_stop.path, quarter_stop.path.speed
    rim = wheel_radius * path.turning
    broken = {
        "no number": not all(np.isfinite(path_field).all() for path_field in path),
        "turns backwards": rim.min() < 0.0,
        "turns faster than it rolls": (rim - speed).max() > 1e-12 * speed[0],
        "does not stop": is_braked and quarter_stop.step_of_rest < 0,
        "creeps": quarter_stop.step_of_rest >= 0
        and bool(
            np.abs(speed[quarter_stop.step_of_rest :]).max() > 0.0
            or np.ptp(path.position[quarter_stop.step_of_rest :]) > 0.0
        ),
    }
    return [name for name, wrong in broken.items() if wrong]


def _torque_sweep_row(surface_names: tuple[str, ...], torque_levels: np.ndarray, time_steps: tuple[float, ...]) -> Row:
    """Row: number of stops of the sweep over brake torques that break a rule of plausibility."""
    wrong, runs = list[str](), 0
    for on, step in product(surface_names, time_steps):
        tyre = friction_table(on)
        lock = float(tyre[0].mu_x.max()) * FRONT_WHEEL.mass * GRAVITY * FRONT_WHEEL.radius
        speed = 11.11 if step >= 1e-3 else SLOW_START_SPEED
        for level in (
            torque_levels if on in FULL_SWEEP_SURFACES or step >= PAPER_STEP else torque_levels[TORQUE_LEVEL_SELECTION]
        ):
            faults = broken_plausibility_rules(
                constant_torque_stop(FRONT_WHEEL, tyre, level * lock, speed, step, STANDSTILL_SECONDS),
                FRONT_WHEEL.radius,
                bool(level),
            )
            wrong += [f"{on}, {level:g} of lock, {1e3 * step:g} ms: {', '.join(faults)}"] if faults else []
            runs += 1
    some = f" (below {1e3 * PAPER_STEP:g} ms every fifth level, but on {', '.join(FULL_SWEEP_SURFACES)} all)"
    some = "" if set(surface_names) <= set(FULL_SWEEP_SURFACES) else some
    what = (
        f"wrong stops of {runs} from 11.11 m/s, in steps below 1 ms from {SLOW_START_SPEED:g}: {len(surface_names)} "
        "surfaces, "
        f"brakes from 0 to 1.5 of lock, steps of {1e3 * min(time_steps):g} to {1e3 * max(time_steps):g} ms{some}, "
        f"watched for {STANDSTILL_SECONDS:g} s of standstill; wrong is no number, a wheel speed outside 0 to v / r, no "
        "stop, "
        f"or any motion after it: {'; '.join(wrong[:3])}"
    )
    return Observed("braking_stop.sweep", SYSTEM, what.removesuffix(": "), len(wrong), "runs").within(
        0, 0, "asked for: v = 0 exactly at the end, and less than 1 mm/s after it", "none"
    )


def _locked_wheel_row() -> Row:
    """Row: largest relative error of the stopping distance of a locked wheel, over all surfaces."""
    errors = []
    for on in NAMED_SURFACES:
        tyre = friction_table(on)
        torque = 2.0 * FRONT_WHEEL.mass * GRAVITY * FRONT_WHEEL.radius * float(tyre[0].mu_x.max())
        distance = constant_torque_stop(FRONT_WHEEL, tyre, torque, 11.11, rim_turning=0.0).distance
        errors.append(abs(distance * 2.0 * GRAVITY * float(tyre[0].mu_x[0, 0, -1]) / 11.11**2 - 1.0))
    return Observed(
        "braking_stop.locked",
        SYSTEM,
        "relative difference of the stopping distance with locked wheels from v^2 / (2 mu g) on "
        f"{len(NAMED_SURFACES)} surfaces",
        max(errors),
        "",
    ).at_most(1e-9, "asked for", "closed form")


def _wheel_release_row() -> Row:
    """Row: a locked wheel begins to turn when the falling brake torque reaches that of the sliding friction."""
    errors = []
    for on, step in product(NAMED_SURFACES, (1e-3, PAPER_STEP, 2e-2)):
        tyre, tables = friction_table(on)
        sliding = FRONT_WHEEL.mass * GRAVITY * float(tyre.mu_x[0, 0, -1]) * FRONT_WHEEL.radius
        times = step * np.arange(math.ceil(0.8 / step) + 1)
        braked_stop = stop_of_quarter_vehicle(
            FRONT_WHEEL, tables, UNIFORM_ROAD, np.maximum(sliding * (1.5 - times / 0.8037), 0.0), step, 20.0, 0.0
        )
        errors.append(abs(braked_stop.release_time - 0.5 * 0.8037))
    return Observed(
        "braking_stop.release",
        SYSTEM,
        f"error of the time at which locked wheels turn again under a falling torque, {len(NAMED_SURFACES)} "
        "surfaces, steps of 1, 5.5 and 20 ms",
        max(errors),
        "s",
    ).at_most(1e-3, "asked for: the time at which torque falls to that of sliding", "closed form")


def _friction_level_row(level_count: int) -> Row:
    """Row: the stopping distance falls steadily with rising friction."""
    torque = 3.0 * FRONT_WHEEL.mass * GRAVITY * FRONT_WHEEL.radius
    distances = [
        constant_torque_stop(FRONT_WHEEL, friction_table("ice", float(scale)), torque, 11.11).distance
        for scale in np.geomspace(0.3, 8.0, level_count)
    ]
    return Observed(
        "braking_stop.friction",
        SYSTEM,
        f"levels of friction, of {level_count}, at which a higher level does not shorten the stop, brakes beyond lock",
        sum(b >= a for a, b in pairwise(distances)),
        "",
    ).within(0, 0, "asked for", "none")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the error of the stopping distance by scheme and step."""
    lines = [
        (case, scheme, *(f"{100.0 * error:+.2g}{'*' if left else ''}" for error, left in errors))
        for case, curve in case_data["curves"].items()
        for scheme, errors in curve["errors"].items()
    ]
    note = (
        f"In per cent of the exact distance. *: it does not stop in {LONGEST_TIME_RATIO:g} times its time; "
        "the way until then."
    )
    heads = ("case", "scheme", *(f"{1e3 * step:g} ms" for step in case_data["steps"]))
    return [Table("Stopping distance of a quarter vehicle", note, heads, tuple(lines))]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the error of the stopping distance over the step, in a panel for each headline case."""
    from models.drawing.figures import COLUMN_WIDTH, GREY, add_heading, legend_below, subplots

    figure, axes = subplots(2, 2, figsize=(COLUMN_WIDTH, 5.8), sharex=True, sharey=True)
    milliseconds = 1e3 * np.array(case_data["steps"])
    styles = {"ours": "o-", "explicit Euler": "D:", "RK4": "s--", "paper's, literal": "^-."}
    for ax, (name, curve) in zip(axes.flat, case_data["curves"].items(), strict=True):
        for scheme, style in styles.items():
            errors, left = 100.0 * np.abs(np.transpose(curve["errors"][scheme]))
            label = "exact wheel, mean force (ours)" if scheme == "ours" else scheme
            ax.loglog(milliseconds, np.maximum(errors, 1e-7), style, label=label)
            ax.plot(milliseconds[left > 0.0], errors[left > 0.0], "x", color="black", markersize=9)
        ax.axhline(100.0 * DISTANCE_ERROR_BOUND, color=GREY, linewidth=0.8)
        ax.axvline(1e3 * PAPER_STEP, color=GREY, linewidth=0.8, linestyle=":")
        ax.set(title=name, xlabel="step [ms]", ylabel="error of the stopping distance [%]")
        ax.label_outer()
    add_heading(figure, "Braked to a stop by a constant torque: which step each scheme needs")
    legend_below(figure, axes.flat[0])
    caption = (
        f"Error of the stopping distance over the step; grey: the bound of {100 * DISTANCE_ERROR_BOUND:g} % and the "
        "paper's "
        "step. Crosses: it has not stopped in three times its time. Errors below 1e-7 % are drawn there."
    )
    return [(caption, figure)]
