"""What accuracy costs: error over computing work of every integrator, cheapest settings, and loss by default settings.

Another system that is integrated in time joins by a problem in ``validation/price/problems`` and its name in
``COST_PROBLEMS``. Ride is not integrated in time and has separate methods.
"""

import os
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path

from models.advice.price import runner
from models.advice.price.problem import Setting, WorkPrecisionProblem
from models.engines.assembly import Assembly
from models.ensemble.workers import process_pool
from models.systems.pitch_plane.scene import assembly_of_scene
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table, behaviour_row, not_run
from validation.common.scenes import on_paper_road
from validation.price import ride, speed, split
from validation.price.figure import draw as draw_figure
from validation.price.force_calls import counted_calls
from validation.price.problems import (
    braking_stop,
    contact_alone,
    force_excited,
    free_vehicle,
    inertial_unit,
    road_excited,
    wheelset,
)
from validation.price.rows import rows_of
from validation.price.tables import tables as cost_tables

TITLE = "What accuracy costs"
SYSTEM: System = "cost"
MakeCostProblem = Callable[[bool], WorkPrecisionProblem]
COST_PROBLEMS: tuple[MakeCostProblem, ...] = (
    road_excited.problem,
    force_excited.problem,
    partial(wheelset.problem, speed=20.0),
    braking_stop.problem,
    inertial_unit.problem,
)
FURTHER_COST_PROBLEMS: tuple[MakeCostProblem, ...] = (
    force_excited.noisy_problem,
    force_excited.prescribed_pitch_problem,
    free_vehicle.problem,
    partial(wheelset.problem, speed=5.0),
    partial(wheelset.problem, speed=1.0),
    contact_alone.problem,
)
"""Problems of a full run in addition to those of COST_PROBLEMS."""
TIMING_ROUNDS = {True: 1, False: 15}
"""Number of interleaved timing rounds, for a quick run (True) and a full run (False), of settings whose computing time
decides something."""
SHORTEST_TIMED_RUN = {True: 0.004, False: 0.005}
"""A short run is repeated until its timing takes so many seconds, for a quick run (True) and a full run (False)."""
CALLBACK_RATIOS = {
    "all compiled to no forces": "ratio of every force in a compiled callback to the same model without forces",
    "to no callback": "ratio of native springs with a compiled callback for the road to the same without callback",
    "to no forces": "ratio of native springs and a compiled callback for the road to the bodies without any force",
}
"""Ratios of computing times, with the two models that each compares."""
COUNTED_RUN_DURATION = 0.2
"""Length (s) of the runs in which force calls are also counted from outside the engine."""
COINCIDING_CURVES = {
    "rk4": ("exudyn RK44 = mujoco RK4 = reference RK4", "the same tableau at the same step"),
    "implicit": ("mujoco implicit = mujoco implicitfast", "they differ in Coriolis terms, which are absent here"),
}
"""Work-precision curves that must coincide on the road, and the reason."""
SECONDS_REASON = "a target about seconds, which are reported and never gated"


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of all problems, of the force calls, and of two claims about speed; a quick run has five of the eleven
    problems, and a part of their settings."""
    rounds = TIMING_ROUNDS[quick]
    if quick:
        priced, (beside, data) = (
            [_cost_problem_rows(True, rounds, make) for make in COST_PROBLEMS],
            _further_costs(True, rounds),
        )
    else:
        priced, (beside, data) = _costs_in_processes(rounds)
    rows = [row for problem_rows, _ in priced for row in problem_rows]
    return rows + _coinciding_curve_rows(priced[0][1]) + beside, {"problems": [saved for _, saved in priced], **data}


def _further_costs(quick: bool, round_count: int) -> CaseAnswer:
    """Rows and data of costs that the common runner does not measure: ride, parts of a step, force calls, claims about
    speed."""
    road = assembly_of_scene(road_excited.scene())
    rows, prices = ride.measure_routes(quick, round_count, SHORTEST_TIMED_RUN[True])
    twice, least, duration = 2 * round_count, 2 * SHORTEST_TIMED_RUN[quick], road_excited.DURATION
    data: Saved = {
        "ride": prices,
        "split": [] if quick else split.measure(round_count, SHORTEST_TIMED_RUN[quick]),
        "callback": {name: speed.callback_cost(road, duration, name, twice, least) for name in ("RK4", "Euler")},
        "real time": speed.real_time_factors(road, duration, twice, least),
    }
    settings = dict.fromkeys(
        _setting_at_1_ms(setting) for setting in road_excited.settings(quick) if setting.method != "DVERK6"
    )
    return rows + split.rows(data["split"]) + _force_call_rows([*settings], road) + _target_speed_rows(data), data


def _cost_problem_rows(quick: bool, round_count: int, make_problem: MakeCostProblem) -> CaseAnswer:
    """Rows and saved data of one cost problem, which is a model with a range of integrators and settings."""
    problem = make_problem(quick)
    measured = runner.measure(problem, quick, round_count, SHORTEST_TIMED_RUN[quick])
    return rows_of(problem, measured, quick), asdict(measured)


def _costs_in_processes(round_count: int) -> tuple[list[CaseAnswer], CaseAnswer]:
    """Rows and data of all cost problems and of the further costs, computed by at most two processes."""
    with process_pool(min(2, os.cpu_count() or 1)) as pool:
        first, *other_problems = COST_PROBLEMS + FURTHER_COST_PROBLEMS
        road, beside = (
            pool.submit(_cost_problem_rows, False, round_count, first),
            pool.submit(_further_costs, False, round_count),
        )
        priced = [*pool.map(partial(_cost_problem_rows, False, round_count), other_problems[::-1])][::-1]
        return [road.result(), *priced], beside.result()


def _coinciding_curve_rows(saved_road_problem: Saved) -> list[Row]:
    """Rows: work-precision curves that must coincide on the road, and methods that Exudyn names but does not have."""
    road = runner.points_from_saved(saved_road_problem)
    groups = [" = ".join(sorted(group)) for group in road.coinciding_curves()]
    rows = [
        behaviour_row(
            f"price.road.coincide.{name}",
            SYSTEM,
            "work-precision curves that agree to 1 % at every common setting",
            group if group in groups else "; ".join(groups),
            group,
            why,
            "native",
        )
        for name, (group, why) in COINCIDING_CURVES.items()
    ]
    return rows + [
        behaviour_row(
            "price.road.status.DVERK6",
            SYSTEM,
            "behaviour of the solver DVERK6 in Exudyn",
            p.status,
            "refused",
            "Exudyn names the method but has not implemented it",
        )
        for p in road.points
        if p.setting.method == "DVERK6"
    ]


def _setting_at_1_ms(solver_setting: Setting) -> Setting:
    """The setting of a fixed-step method with a step of 1 ms; settings of adaptive methods are unchanged."""
    return (
        solver_setting
        if solver_setting.adaptive
        else road_excited.setting(solver_setting.engine, solver_setting.method, 1e-3)
    )


def _force_call_rows(solver_settings: list[Setting], assembly: Assembly) -> list[Row]:
    """Rows: number of force calls that each engine reports, compared with calls counted from outside."""
    rows = []
    for engine, how in (("exudyn", "calls of one load"), ("mujoco", "MuJoCo's own timers")):
        pairs = [
            counted_calls(engine, assembly, road_excited.settings_of(counted_setting, COUNTED_RUN_DURATION))
            for counted_setting in solver_settings
            if counted_setting.engine == engine
        ]
        what = (
            f"largest difference between force calls counted from outside ({how}) and those reported, {len(pairs)} runs"
        )
        rows.append(
            Observed(
                f"price.road.counts.{engine}",
                SYSTEM,
                what,
                max(abs(outside - stated) for outside, stated in pairs),
                "calls",
            ).within(
                0,
                0,
                "exact; the one evaluation before the first step of methods that start from accelerations is left out",
                "native",
            )
        )
    return rows


def _target_speed_rows(case_data: Saved) -> list[Row]:
    """Rows on target speeds, reported with their intervals and without a verdict."""
    rows = [
        Observed(
            "price.callback.gap",
            SYSTEM,
            "MuJoCo RK4: difference between every force in a compiled callback and native springs",
            case_data["callback"]["RK4"]["gap"],
            "m, rad, m/s, rad/s",
        ).at_most(1e-12, "the same forces at the same stages, written twice", "native")
    ]
    for integrator, figures in case_data["callback"].items():
        for key, words in CALLBACK_RATIOS.items():
            ratio, low, high = figures[key]
            name = f"price.callback.{integrator}.{key.replace(' ', '-')}"
            what = f"MuJoCo {integrator}, {words}, paired seconds, 95 % interval {low:.3f} to {high:.3f}"
            rows.append(Observed(name, SYSTEM, what, ratio, "times").aim(1.2, SECONDS_REASON))
    return rows + [_real_time_row(key, case_data["real time"][key]) for key in ("with table", "without table")]


def _real_time_row(speed_key: str, real_time_factors: tuple[float, float, float] | None) -> Row:
    """Row: real-time factor of the reference, with its interval."""
    name = f"price.real-time.{speed_key.replace(' ', '-')}"
    what = f"reference RK4 at 1 ms, {speed_key.replace('table', 'making its road table')}"
    if real_time_factors is None:
        return not_run(name, SYSTEM, what, "other work of the machine hid the difference")
    factor, low, high = real_time_factors
    quantity = f"{what}, 95 % interval {low:,.0f} to {high:,.0f}"
    return Observed(name, SYSTEM, quantity, factor, "times real time").aim(1000.0, SECONDS_REASON, "at least")


def tables(case_data: Saved) -> list[Table]:
    """Tables of cheapest settings, losses, curves, failures and parts of a step for every problem, and of the methods
    of ride."""
    tables = [
        table
        for saved in case_data["problems"]
        for table in (*cost_tables(runner.points_from_saved(saved)), *split.table(case_data["split"], saved["key"]))
    ]
    return [*tables, ride.table(case_data["ride"])]


def draw(case_data: Saved) -> Drawn:
    """Plot error over work for every problem, and for the methods of ride."""
    problems = map(runner.points_from_saved, case_data["problems"])
    return [*((_caption(measured), draw_figure(measured)) for measured in problems), ride.draw(case_data["ride"])]


def _caption(measured_points: runner.WorkPrecisionPoints) -> str:
    """Caption of a figure of error over work."""
    return (
        f"{measured_points.title}: error over work and over seconds. Reference: {measured_points.reference}. "
        "Colour is the engine, marker the method, line its order (solid from 4 up, dashed 2, dotted 1). "
        f"{measured_points.note}"
    )
