"""Hub forces with the engines' native springs, mounts and bars: Exudyn and MuJoCo compared with compiled forces and
with written-out equations."""

import time
from pathlib import Path

from models.engines.cut_vehicle import native_share
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.spatial.cars import r19, rough_car, twin
from validation.spatial.native_builds import (
    NATIVE_ENGINES,
    difference_from_equations,
    hub_model,
    native_acceleration_difference,
    random_states,
    trajectory_difference,
)

TITLE = "Springs, mounts and bars of the engines' own under hub forces"
SYSTEM: System = "drift"
STATE_COUNT, STEP_COUNT = 100, 1000
QUICK_STATE_COUNT, QUICK_STEP_COUNT = 10, 50
TIMING_ROUNDS, TIMED_STEP_COUNT = 5, 1000
"""Number of interleaved timing rounds for the ratio of computing times, and number of steps of each timed run."""


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of three cars; a quick run has the shipped car and a tenth of the states."""
    cars = (
        {"r19_free": r19()} if quick else {"r19_free": r19(), "twin": cut_at_hubs(twin(), "body"), "rough": rough_car()}
    )
    rows = [row for name, car in cars.items() for row in _agreement_rows(name, car, quick)]
    return [*rows, *([] if quick else _time_ratio_rows(r19()))], {}


def _agreement_rows(car_name: str, car: CutVehicle, quick: bool) -> list[Row]:
    """Rows on one car: accelerations, states and numbers of native elements, compared with compiled forces."""
    states, steps = (
        random_states(car, QUICK_STATE_COUNT if quick else STATE_COUNT),
        QUICK_STEP_COUNT if quick else STEP_COUNT,
    )
    where = f"{len(states)} states, any heading, roll and pitch to 0.3 rad, {car_name}"
    rows = [
        Observed(
            f"native_builds.equations_{car_name}",
            SYSTEM,
            "largest difference of the accelerations by compiled forces from written-out equations, "
            f"no hub forces, {where}",
            difference_from_equations(car, states),
            "1",
        ).at_most(1e-12, "of each coordinate's largest; rounding of stiff bushes leaves 6e-14", "native")
    ]
    for engine in NATIVE_ENGINES:
        rows += [
            Observed(
                f"native_builds.accelerations_{car_name}_{engine}",
                SYSTEM,
                f"largest difference of the accelerations with {engine}'s springs from compiled forces, {where}",
                native_acceleration_difference(engine, car, states),
                "1",
            ).at_most(1e-12, "of each coordinate's largest; the hub forces alone are shared", "native"),
            Observed(
                f"native_builds.path_{car_name}_{engine}",
                SYSTEM,
                f"largest difference of the states with {engine}'s springs from compiled forces, "
                f"{steps} steps of 1 ms, {car_name}",
                trajectory_difference(engine, car, steps),
                "m, rad, 1/s",
            ).at_most(1e-10, "same tableau, same step", "native"),
            _native_element_count_row(car_name, car, engine),
        ]
    return rows


def _native_element_count_row(car_name: str, car: CutVehicle, engine_name: str) -> Row:
    """Row: number of springs, mounts and bars that are native elements of an engine."""
    share = native_share(engine_name, car)
    shared = "; ".join(f"{element}: {why}" for element, why in share.reasons.items()) or "nothing but hub forces"
    return Observed(
        f"native_builds.count_{car_name}_{engine_name}",
        SYSTEM,
        f"number of springs, mounts and bars of {car_name} that are native elements in {engine_name}",
        len(share.elements),
        "elements",
    ).within(len(car.elements), 0, f"all have stiffness and damping that every engine has; shared: {shared}", "native")


def _time_ratio_rows(car: CutVehicle) -> list[Row]:
    """Rows, without a verdict: computing time of a step with native springs divided by that with compiled forces."""
    rows = []
    for engine, usual in (("exudyn", 3.0), ("mujoco", 1.2)):
        models = {route: hub_model(engine, car, route, TIMED_STEP_COUNT) for route in ("native", "compiled")}
        best: dict[str, float] = {}
        for _ in range(TIMING_ROUNDS):
            for route, built in models.items():
                begun = time.process_time()
                built.run()
                best[route] = min(best.get(route, float("inf")), time.process_time() - begun)
        ratio = best["native"] / best["compiled"]
        quantity = f"ratio of seconds of a step in {engine} with springs of its own to those with compiled forces"
        why = "the machine decides; a second tree for the mounts" if engine == "exudyn" else "the machine decides"
        rows.append(
            Observed(f"native_builds.seconds_{engine}", SYSTEM, quantity, ratio, "1").beside(usual, why, "none")
        )
    return rows
