"""Cars by independently written equations compared with Exudyn and MuJoCo: accelerations at random states, whole
simulations, and every force law."""

from pathlib import Path

from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.free_vehicle import CARRIER
from models.vehicles.spatial_linear import static_preloads
from validation.common.checks import largest_relative_difference
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.spatial.written_equations import (
    brush_force_difference,
    cut_car_acceleration_difference,
    cut_car_path_difference,
    cut_cars,
    inner_force_difference,
    report_difference,
    rolling_acceleration_difference,
    rolling_cars,
    rolling_path_difference,
)

TITLE = "Cars by plain equations that share no force with the engines"
SYSTEM: System = "rolling-vehicle"
ENGINE_NAMES = ("mujoco", "exudyn")
STATE_COUNT, QUICK_STATE_COUNT = 100, 12
ACCELERATION_TOLERANCE, PATH_TOLERANCE, LAW_TOLERANCE = 1e-12, 1e-10, 1e-12
INDEPENDENCE_NOTE = (
    "the description alone is shared: mass matrix, kinematics, preloads and every force are written twice"
)
DURATION, QUICK_DURATION = 1.0, 0.02
"""Length (s) of a simulation in a full and in a quick run. The independent equations of a car on tyres take about 20 s
for each simulated second."""


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of cars on hub forces and of cars on rolling tyres; a quick run has fewer states and simulates a few
    steps."""
    states, duration = (QUICK_STATE_COUNT, QUICK_DURATION) if quick else (STATE_COUNT, DURATION)
    return [*_force_law_rows(states), *_hub_force_car_rows(states, duration), *_rolling_car_rows(states, duration)], {}


def _plain_equations_row(row_name: str, quantity_name: str, largest_error: float, unit: str, error_bound: float) -> Row:
    """Row that compares the independently written equations with another implementation of the same laws."""
    return Observed(f"written.{row_name}", SYSTEM, quantity_name, largest_error, unit).at_most(
        error_bound, INDEPENDENCE_NOTE, "native"
    )


def _force_law_rows(state_count: int) -> list[Row]:
    """Rows on the creep forces of the tyre, and on the preloads in the design position."""
    rows = [
        _plain_equations_row(
            "bristles",
            f"largest difference of the creep forces of {state_count} random patches, over the load",
            brush_force_difference(state_count),
            "1",
            LAW_TOLERANCE,
        )
    ]
    for name, car in rolling_cars().items():
        preloads_of = static_preloads(car.vehicle)
        plain = preloads_at_rest(car.vehicle, CARRIER)
        gap = max(
            largest_relative_difference(other, list(known.values()))
            for known, other in zip(preloads_of, plain, strict=True)
        )
        rows.append(
            _plain_equations_row(
                f"preloads.{name}",
                f"largest difference of the preloads and static loads of {name}, over the largest",
                gap,
                "1",
                LAW_TOLERANCE,
            )
        )
    return rows


def _hub_force_car_rows(state_count: int, duration: float) -> list[Row]:
    """Rows on vehicles that are cut at their wheels and driven by hub forces."""
    rows = []
    for name, car in cut_cars().items():
        for engine in ("reference", *ENGINE_NAMES):
            what = (
                f"largest difference of {name}'s accelerations on hub forces and on a road "
                f"in {engine}, {state_count} random states"
            )
            rows.append(
                _plain_equations_row(
                    f"hubs.{engine}.{name}",
                    what,
                    cut_car_acceleration_difference(car, engine, state_count),
                    "of the largest",
                    ACCELERATION_TOLERANCE,
                )
            )
        what = f"largest difference of {name}'s section forces, wrenches and holding moments at random states"
        rows.append(
            _plain_equations_row(
                f"hubs.inside.{name}", what, inner_force_difference(car, 4), "of the largest", ACCELERATION_TOLERANCE
            )
        )
        for kind, rough in (("road", True), ("noise", False)):
            what = f"largest difference of {name}'s coordinates and rates in MuJoCo, {duration:g} s of {kind}"
            rows.append(
                _plain_equations_row(
                    f"hubs.{kind}.{name}",
                    what,
                    cut_car_path_difference(car, "mujoco", duration, rough),
                    "m, rad, 1/s",
                    PATH_TOLERANCE,
                )
            )
    return rows


def _rolling_car_rows(state_count: int, duration: float) -> list[Row]:
    """Rows on cars on rolling tyres: accelerations, tyre reports, and simulations."""
    rows = []
    for name, car in rolling_cars().items():
        for engine in ENGINE_NAMES:
            what = f"largest difference of {name}'s accelerations on tyres in {engine}, {state_count} random states"
            gap = rolling_acceleration_difference(car, engine, state_count)
            rows.append(
                _plain_equations_row(f"tyres.{engine}.{name}", what, gap, "of the largest", ACCELERATION_TOLERANCE)
            )
        what = (
            f"largest difference of the tyre reports and ledgers of {name} at random states, over the largest of each"
        )
        rows.append(
            _plain_equations_row(
                f"tyres.reports.{name}", what, report_difference(car, state_count), "1", ACCELERATION_TOLERANCE
            )
        )
        what = f"largest difference of {name}'s positions and rates in MuJoCo, {duration:g} s of a turn on a rough road"
        gap = rolling_path_difference(car, "mujoco", duration)
        rows.append(_plain_equations_row(f"tyres.path.{name}", what, gap, "m, rad, 1/s", PATH_TOLERANCE))
    return rows
