"""Brakes and controllers: hysteresis of the brake, air supply, limit cycle of the five-phase controller, stops without
locked wheels, substeps."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import ttest_ind

from models.brake.brake import PAPER_BRAKES, PAPER_FRONT_BRAKE, Brake, brakes_of_wheels, torques_of_pressures
from models.brake.controller import SAMPLING_PERIOD
from models.brake.controllers import CONTROLLERS
from models.brake.controllers.five_phase import FivePhase
from models.brake.controllers.five_phase_cycle import (
    WheelAtConstantSpeed,
    limit_cycle,
    mean_cycle_of_sampled_controller,
)
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, plane_of_truck
from models.brake.pressure import APPLY, RELEASE, BrakeChambers, advance_by_valves, air_at_rest
from models.systems.braking.march import BrakingPath, braked_vehicle_on_tyres
from models.systems.braking.stop_report import StopHistory
from models.tyre.magic_formula import table_of_surface
from validation.braking.five_phase_exact import exact_cycle
from validation.braking.quarter_stops import FRONT_WHEEL
from validation.braking.sampled_quarter import reference_distance, twinrig_distance
from validation.common.rows import Observed, Row, System, Table, behaviour_row

TITLE = "Brakes and controllers of anti-lock braking"
SYSTEM: System = "anti-lock"
SEED = 22
LINEAR_BRAKE = Brake(push_out=0.0, release=0.0, rising=1500.0, falling=1500.0)
HYSTERETIC_BRAKE = Brake(push_out=0.75, release=0.5, rising=1500.0, falling=1800.0)
FIVE_PHASE_CONTROLLERS = {
    "deep": FivePhase(1, e1=40.0, e2=60.0, e3=40.0, e4=10.0, e5=150.0, falling=60.0, fast=20.0, slow=15.0),
    "shallow": FivePhase(1, e1=20.0, e2=30.0, e3=20.0, e4=2.0, e5=60.0, falling=60.0, fast=40.0, slow=8.0),
}
"""Five-phase controllers with deep and with shallow slip cycles."""
LOCK_FREE_SPEED = 15.0 / 3.6
"""Speed (m/s) above which no wheel may lock but briefly: UN Regulation 13, annex 13; not checked against its text."""
LONGEST_LOCK = 0.1
"""Longest time (s) for which a wheel may lock above ``LOCK_FREE_SPEED``."""
SUBSTEP_COUNTS = (1, 2, 4, 8)
CONTROLLER_NAMES = tuple(CONTROLLERS)[1:]
"""Names of the anti-lock controllers, without the first entry of CONTROLLERS, which applies the brakes fully."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of hysteresis, supply and limit cycle; a full run also has stops of the truck, substeps, and an ensemble of
    stops."""
    rows = [*_hysteresis_rows(), _air_supply_row(), *_limit_cycle_rows("shallow")]
    if quick:
        return rows, {}
    rows += _limit_cycle_rows("deep")
    stops = {
        f"{on}, {speed:g} m/s, {name}": stop_results(on, name, speed)
        for on in ("ice", "snow", "dry")
        for speed in (11.11, 22.2)
        for name in CONTROLLER_NAMES
    }
    return [*rows, *_stop_rows(stops), *_substep_rows(), *_ice_stop_ensemble_rows()], {"stops": stops}


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the truck's straight stops by controller."""
    if "stops" not in case_data:
        return []
    shown = (("distance", 2), ("time", 2), ("used", 3), ("locked", 0))
    rows = [
        (name, *(f"{stop_figures[key]:.{digits}f}" for key, digits in shown))
        for name, stop_figures in case_data["stops"].items()
    ]
    return [
        Table(
            "Straight stops by controller",
            "Utilisation: ratio of the mean deceleration above 15 km/h to that of the tyre's "
            "peak on all wheels; on the dry road the front brakes at their 8 bar bound it, not the tyres. "
            "Speed of the vehicle given, 4 substeps.",
            ("stop", "distance in m", "time in s", "utilisation", "longest lock above 15 km/h in ms"),
            tuple(rows),
        )
    ]


def brake_hysteresis_loop(
    brake: Brake, low_pressure: float, high_pressure: float, point_count: int = 2000
) -> tuple[np.ndarray, np.ndarray]:
    """Pressures (bar) and torques (N m) of one hysteresis loop, from high to low pressure and back, after a first rise
    from zero."""
    path = np.concatenate(
        (np.linspace(high_pressure, low_pressure, point_count), np.linspace(low_pressure, high_pressure, point_count))
    )
    return path, torques_of_pressures(path, brakes_of_wheels(brake))


def hysteresis_loop_area(brake: Brake, low_pressure: float, high_pressure: float) -> float:
    """Area (N m bar) of the hysteresis loop by the closed form of its polygon, whose four corners lie on the lines of
    rising and falling pressure."""
    most = brake.rising * (high_pressure - brake.push_out)
    least = brake.falling * max(low_pressure - brake.release, 0.0)
    a, b = brake.release + most / brake.falling, brake.push_out + least / brake.rising
    end = max(low_pressure, brake.release)
    down = most * (high_pressure - a) + 0.5 * (most + least) * (a - end)
    return down - least * (b - end) - 0.5 * (least + most) * (high_pressure - b)


def _hysteresis_rows() -> list[Row]:
    """Rows: area and sense of the brake's hysteresis loop, and its torque below the push-out pressure."""
    worst, sense = 0.0, True
    for brake in (HYSTERETIC_BRAKE, PAPER_FRONT_BRAKE):
        for low in (0.0, 2.5):
            p, t = brake_hysteresis_loop(brake, low, 4.5)
            worst = max(worst, abs(-np.trapezoid(t, p) / hysteresis_loop_area(brake, low, 4.5) - 1.0))
            sense = sense and bool((np.diff(p) * np.diff(t) >= 0.0).all()) and t.min() >= 0.0
    rise = torques_of_pressures(np.linspace(0.0, 0.75, 100), brakes_of_wheels(HYSTERETIC_BRAKE))
    return [
        Observed(
            "braking_controllers.loop",
            SYSTEM,
            "relative difference of the area of the brake's hysteresis loop, whole and partial, from its closed form",
            worst,
            "",
        ).at_most(1e-3, "two lines and a hold between them", "closed form"),
        behaviour_row(
            "braking_controllers.push_out",
            SYSTEM,
            "brake torque at and below the push-out pressure",
            "some" if rise.any() else "none",
            "none",
            "the springs hold the shoes back",
        ),
        behaviour_row(
            "braking_controllers.sense",
            SYSTEM,
            "brake torque as the pressure falls and rises",
            "never reversed" if sense else "reversed",
            "never reversed",
            "friction loses work on every loop",
        ),
    ]


def _air_supply_row() -> Row:
    """Row: pressure that remains at the fifth brake stroke when the supply is cut off, compared with a closed form."""
    volumes, reservoir = np.array([1.2, 1.2, 1.6, 1.6]), 40.0
    chambers = BrakeChambers(np.full(4, 0.15), np.full(4, 0.1), 8.0, volumes, reservoir)
    air, ends = air_at_rest(chambers, SAMPLING_PERIOD), np.empty((5, 4))
    for stroke in range(5):
        for valve in (APPLY,) if stroke == 4 else (APPLY, RELEASE):
            for _ in range(500):
                advance_by_valves(np.full(4, valve), SAMPLING_PERIOD, air, chambers, PAPER_BRAKES, ends)
    left = 8.0 * (reservoir / (reservoir + volumes.sum())) ** 5
    return Observed(
        "braking_controllers.strokes",
        SYSTEM,
        "relative difference of the chamber pressure at the fifth full stroke from p (V / (V + v))^5",
        float(np.abs(air.pressure / left - 1.0).max()),
        "",
    ).at_most(1e-6, "p V of reservoir and chambers together is kept but for what is let out", "closed form")


def _front_wheel_at_constant_speed(spin_inertia: float = FRONT_WHEEL.spin_inertia) -> WheelAtConstantSpeed:
    """A front wheel on dry road whose vehicle keeps its speed."""
    return WheelAtConstantSpeed(
        11.11, FRONT_WHEEL.mass * GRAVITY, FRONT_WHEEL.radius, spin_inertia, LINEAR_BRAKE, table_of_surface("dry")
    )


def _limit_cycle_rows(controller_name: str) -> list[Row]:
    """Rows: period and friction utilisation of a five-phase controller's limit cycle, compared with exact values."""
    cycle, (period, used) = (
        limit_cycle(_front_wheel_at_constant_speed(), FIVE_PHASE_CONTROLLERS[controller_name]),
        exact_cycle(_front_wheel_at_constant_speed(), FIVE_PHASE_CONTROLLERS[controller_name]),
    )
    wrong = exact_cycle(
        _front_wheel_at_constant_speed(FRONT_WHEEL.spin_inertia * 1.001), FIVE_PHASE_CONTROLLERS[controller_name]
    )[0]
    return [
        Observed(
            f"braking_controllers.period_{controller_name}",
            SYSTEM,
            f"relative difference of the period of the five-phase limit cycle from the exact period, {controller_name}",
            cycle.period / period - 1.0,
            "",
        ).at_most(1e-4, "frozen speed; every switch is located", "closed form"),
        Observed(
            f"braking_controllers.utilisation_{controller_name}",
            SYSTEM,
            f"difference of the limit cycle's mean friction, as a share of the peak, from the exact mean, "
            f"{controller_name}",
            cycle.utilisation - used,
            "",
        ).at_most(1e-3, "as above", "closed form"),
        behaviour_row(
            f"braking_controllers.planted_{controller_name}",
            SYSTEM,
            f"a planted error of 0.1 % in the spin inertia is noticed in the period, {controller_name}",
            "told" if abs(cycle.period / wrong - 1.0) > 1e-4 else "missed",
            "told",
            "a planted fault",
        ),
        Observed(
            f"braking_controllers.sampled_{controller_name}",
            SYSTEM,
            "relative difference of the period with samples of 5.5 ms from the period of the "
            f"continuous controller, {controller_name}",
            mean_cycle_of_sampled_controller(
                _front_wheel_at_constant_speed(),
                replace(FIVE_PHASE_CONTROLLERS[controller_name]),
                cycle_count=5,
                skipped_cycle_count=3,
            ).period
            / cycle.period
            - 1.0,
            "",
        ).beside(0.0, "each switch comes up to a sample late", "native"),
    ]


def truck_stop(surface_name: str, controller_name: str, start_speed: float) -> BrakingPath:
    """The paper's truck braked to a stop on a surface by a controller with its default parameters."""
    chambers = BrakeChambers(np.full(4, 0.15), np.full(4, 0.1), 8.0)
    return braked_vehicle_on_tyres(
        plane_of_truck(PAPER_TRUCK), [table_of_surface(surface_name)], PAPER_BRAKES, chambers
    ).run(CONTROLLERS[controller_name](4), start_speed)


def stop_results(surface_name: str, controller_name: str, start_speed: float) -> dict[str, float]:
    """Results of one straight stop of the truck: distance (m), time (s); above 15 km/h also the friction utilisation
    and the longest wheel lock (ms)."""
    path = truck_stop(surface_name, controller_name, start_speed)
    speeds = StopHistory(path).speed
    last = int(np.argmax(speeds < LOCK_FREE_SPEED))
    used = (
        (start_speed**2 - speeds[last] ** 2)
        / (2.0 * path.states[last, 0, 0])
        / GRAVITY
        / table_of_surface(surface_name).mu_x.max()
    )
    return {
        "distance": float(path.states[-1, 0, 0]),
        "time": float(path.times[-1]),
        "used": float(used),
        "locked": 1e3
        * SAMPLING_PERIOD
        * max(_longest_true_sequence(wheel > 0.0) for wheel in path.reports.locked[:last].T),
        "stands": float(path.ended_at_rest),
    }


def _longest_true_sequence(truth_values: np.ndarray) -> int:
    """Length of the longest uninterrupted sequence of true values."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], truth_values, [False])).astype(int)))
    return int((ends[1::2] - ends[::2]).max(initial=0))


def _stop_rows(results_of_stops: dict[str, dict[str, float]]) -> list[Row]:
    """Rows: longest wheel lock of all stops, and whether all stops end at rest."""
    return [
        Observed(
            "braking_controllers.locks",
            SYSTEM,
            f"longest time for which a wheel locks above 15 km/h in {len(results_of_stops)} stops of four controllers",
            max(stop_figures["locked"] for stop_figures in results_of_stops.values()),
            "ms",
        ).at_most(1e3 * LONGEST_LOCK, "ice, snow and dry at 11.11 and 22.2 m/s; only briefly", "published"),
        behaviour_row(
            "braking_controllers.stands",
            SYSTEM,
            f"how {len(results_of_stops)} stops of four controllers end",
            "at rest" if all(stop_figures["stands"] for stop_figures in results_of_stops.values()) else "moving",
            "at rest",
            "below 1.5 m/s all brakes are applied",
        ),
    ]


def _substep_rows() -> list[Row]:
    """Rows: stopping distance on snow and dry road by number of substeps, compared with the independent reference."""
    rows = []
    for on, speed in (("snow", 13.9), ("dry", 22.22)):
        tight = reference_distance(FRONT_WHEEL, PAPER_FRONT_BRAKE, on, CONTROLLERS["slip_bang_bang"](1), speed)
        for n in SUBSTEP_COUNTS:
            distance = twinrig_distance(FRONT_WHEEL, PAPER_FRONT_BRAKE, on, CONTROLLERS["slip_bang_bang"](1), speed, n)
            rows.append(
                Observed(
                    f"braking_controllers.stop_{on}_{n}",
                    SYSTEM,
                    "relative difference of a quarter vehicle's stopping distance from the "
                    f"reference, sampled controller on {on}, {n} substeps",
                    distance / tight - 1.0,
                    "",
                ).at_most(1e-2, "DOP853 at 1e-10 with locking as an event", "native")
            )
    return rows


def _ice_stop_ensemble_rows(run_count: int = 24, fine_substep_count: int = 32) -> list[Row]:
    """Rows: two ensembles of stops on ice from slightly varied speeds, with different numbers of substeps. Single stops
    on ice do not repeat."""
    random = np.random.default_rng(SEED)
    speeds = 11.11 * (1.0 + random.uniform(-0.002, 0.002, (2, run_count)))
    distances = [
        np.array(
            [
                twinrig_distance(FRONT_WHEEL, PAPER_FRONT_BRAKE, "ice", CONTROLLERS["slip_bang_bang"](1), speed, n)
                for speed in some
            ]
        )
        for some, n in zip(speeds, (4, fine_substep_count), strict=True)
    ]
    level = float(ttest_ind(*distances, equal_var=False).pvalue)
    return [
        Observed(
            "braking_controllers.ice_mean",
            SYSTEM,
            f"relative difference of the mean stopping distance on ice of {run_count} runs with 4 substeps "
            f"from {run_count} others with {fine_substep_count}",
            float(distances[0].mean() / distances[1].mean() - 1.0),
            "",
        ).at_most(1e-2, "speeds drawn within 0.2 %; on ice single runs do not repeat", "shared kernel"),
        Observed(
            "braking_controllers.ice_level",
            SYSTEM,
            "chance of a larger difference between the mean stopping distances on ice if the true means are the same",
            level,
            "",
        ).beside("above 0.05: no difference is shown", "Welch's test", "none"),
        Observed(
            "braking_controllers.ice_scatter",
            SYSTEM,
            "standard deviation of the stopping distance on ice",
            float(distances[0].std(ddof=1)),
            "m",
        ).beside(float(distances[1].std(ddof=1)), "4 substeps beside more", "none"),
    ]
