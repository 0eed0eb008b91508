"""Rolling wheels at low speed in Exudyn: steps and force calls of explicit and implicit integrators."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.contact.inputs import Array
from models.core.errors import Refused, RunFailed
from models.engines.contact_bridge import RailWheels, linearised_wheels
from models.engines.contact_bridge_exudyn import RailWheelSystem, WheelForceFunctions
from models.engines.stability import LONG_RUN, longest_stable_step
from validation.common.rows import Observed, Row, System, Table, behaviour_row

SYSTEM: System = "rolling-vehicle"
DURATION = 0.2
"""Duration of the runs (s), more than two periods of the suspension."""
SPEEDS = (1.0, 0.1, 0.05, 0.0)
METHODS = ("GeneralizedAlpha", "TrapezoidalIndex2")
STEP_RATIO = 20
"""Implicit step divided by the longest stable explicit step, at 1 m/s."""
STEPS = {1.0: (1e-3, 2e-3, 4e-3), 0.1: (1e-3, 4e-3), 0.05: (1e-3, 4e-3), 0.0: (1e-3, 4e-3)}


@dataclass(frozen=True)
class SlowWheelsRun:
    """A run with a slow wheel: speed (m/s), integrator, step (s), numbers of steps and force calls, and error divided
    by the largest remaining displacement."""

    speed: float
    method: str
    step: float
    steps: int
    calls: int
    error: float


def wheel_and_start(rolling_speed: float) -> tuple[RailWheels, tuple[Array, Array]]:
    """A wheel with FASTSIM at a speed (m/s), and the displaced positions and rates from which it is released."""
    return RailWheels(1, speed=rolling_speed), (np.array([1e-4, 1e-4, 0.0, 1e-4]), np.zeros(4))


def counting_calls(
    counted_function: Callable[..., Any], call_total: list[int], increment_per_call: int = 1
) -> Callable[..., Any]:
    """Returns the function wrapped so that every call adds ``increment_per_call`` to ``call_total[0]``."""

    def counted(*arguments: Any) -> Any:
        call_total[0] += increment_per_call
        return counted_function(*arguments)

    return counted


def end_positions(
    rolling_speed: float, integrator_name: str, step_count: int, with_force_slopes: bool = True
) -> tuple[Array, int]:
    """Simulate a released wheel: returns final positions and number of force calls. Raises RunFailed or Refused if the
    integrator cannot take the steps."""
    (wheels, start), calls = wheel_and_start(rolling_speed), [0]
    forces = WheelForceFunctions(wheels)
    slopes = forces.slopes if with_force_slopes and integrator_name in METHODS else None
    rolling = RailWheelSystem(wheels, counting_calls(forces.of, calls), force_slopes=slopes)
    return rolling.run(*start, step_count, DURATION / step_count, integrator_name)[: wheels.size], calls[0]


def longest_step(rolling_speed: float) -> float:
    """Longest stable step (s) of the explicit RK44 for a wheel at a speed (m/s)."""
    return longest_stable_step("RK44", 1e-3, LONG_RUN * 1e-3, linearised_wheels(wheel_and_start(rolling_speed)[0]))


def runs(rolling_speed: float, implicit_time_steps: tuple[float, ...]) -> list[SlowWheelsRun]:
    """Runs of a wheel at a speed (m/s): an explicit run near its longest stable step, and implicit runs with several
    steps (s). Errors are relative to an explicit run with half the step."""
    coarse = int(np.ceil(1.05 * DURATION / longest_step(rolling_speed)))
    true, _ = end_positions(rolling_speed, "RK44", 2 * coarse)
    done = []
    for method, count in [("RK44", coarse)] + [
        (name, round(DURATION / step)) for name in METHODS for step in implicit_time_steps
    ]:
        end, calls = end_positions(rolling_speed, method, count)
        error = float(np.abs(end - true).max() / np.abs(true).max())
        done.append(SlowWheelsRun(rolling_speed, method, DURATION / count, count, calls, error))
    return done


def rows(is_quick: bool) -> tuple[list[Row], list[SlowWheelsRun]]:
    """Report rows and runs: errors of implicit integrators at 1 m/s, and the refusals where a step cannot be taken."""
    done = runs(1.0, (STEP_RATIO * longest_step(1.0), *(() if is_quick else STEPS[1.0])))
    if not is_quick:
        done += [run for speed in SPEEDS[1:] for run in runs(speed, STEPS[speed])]
    explicit = done[0]
    implicit = [next(run for run in done if run.method == method) for method in METHODS]
    judged = [
        Observed(
            f"contact_bridges.low-speed.{run.method}",
            SYSTEM,
            f"relative error in Exudyn at 1 m/s after {DURATION:g} s, {run.method} with slopes in "
            f"steps of {1e3 * run.step:.2g} ms ({run.calls} force calls; RK44 needs {explicit.calls})",
            run.error,
            "of what is left",
        ).at_most(
            1e-3,
            f"{STEP_RATIO} times the explicit limit and of second order: a twentieth of the suspension's shortest "
            "period",
            "closed form",
        )
        for run in implicit
    ]
    why = "the slopes of sliding let Newton's method leap from slip to slip; an explicit step is beyond its limit"
    for name, method, with_slopes, expected in (
        ("slopes by differences", "GeneralizedAlpha", False, "raised"),
        ("explicit", "RK44", True, "refused"),
    ):
        try:
            end_positions(0.1, method, 200, with_slopes)
            said = "an answer"
        except (Refused, RunFailed) as error:
            said = "refused" if isinstance(error, Refused) else "raised"
        what = f"Exudyn at 0.1 m/s in steps of 1 ms, {method}, {name}"
        row = f"contact_bridges.low-speed.{name.replace(' ', '-')}"
        judged.append(behaviour_row(row, SYSTEM, what, said, expected, why, "none"))
    return judged, done


def table(saved_runs: list[dict[str, Any]]) -> Table:
    """Table of steps, force calls and errors of all runs."""
    lines = tuple(
        (
            f"{run['speed']:g}",
            run["method"],
            f"{1e3 * run['step']:.3g}",
            str(run["steps"]),
            str(run["calls"]),
            f"{run['error']:.1e}",
        )
        for run in saved_runs
    )
    note = (
        f"One wheel pulled aside by 0.1 mm and let go, {DURATION:g} s; error of its place by the largest "
        "displacement left, against RK44 at half its step. Implicit methods with the linear theory's slopes."
    )
    return Table(
        "Steps and force calls at low speed in Exudyn",
        note,
        ("speed [m/s]", "method", "step [ms]", "steps", "force calls", "error"),
        lines,
    )
