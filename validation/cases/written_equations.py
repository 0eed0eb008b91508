"""Cars by their plain equations beside both engines: accelerations at random, whole paths, and every law in them."""

from pathlib import Path

from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.free_vehicle import CARRIER
from models.vehicles.spatial_linear import preloads
from validation.common.checks import largest_relative_difference
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.spatial.written_equations import (
    bristles_gap,
    cut_cars,
    hub_gap,
    hub_path_gap,
    inside_gap,
    report_gap,
    rolling_cars,
    rolling_gap,
    rolling_path_gap,
)

TITLE = "Cars by plain equations that share no force with the engines"
SYSTEM: System = "rolling-vehicle"
ENGINES = ("mujoco", "exudyn")
STATES, QUICK_STATES = 100, 12
INSTANT_BOUND, PATH_BOUND, LAW_BOUND = 1e-12, 1e-10, 1e-12
INDEPENDENCE_NOTE = (
    "the description alone is shared: mass matrix, kinematics, preloads and every force are written twice"
)
DURATION, QUICK_DURATION = 1.0, 0.02
"""s, in full and in quick: the plain equations of a car on tyres take about 20 s for each."""


def measure(quick: bool, folder: Path) -> CaseAnswer:
    """Rows of both systems; quick: fewer states, paths of some steps."""
    states, duration = (QUICK_STATES, QUICK_DURATION) if quick else (STATES, DURATION)
    return [*_laws(states), *_hubs(states, duration), *_rolling(states, duration)], {}


def _row(id: str, quantity: str, largest_error: float, unit: str, bound: float) -> Row:
    """Row that compares the plain equations with another implementation of the same laws."""
    return Observed(f"written.{id}", SYSTEM, quantity, largest_error, unit).at_most(bound, INDEPENDENCE_NOTE, "native")


def _laws(states: int) -> list[Row]:
    """Rows on the tyre's law, and on the preloads in the design position."""
    rows = [
        _row(
            "bristles",
            f"largest difference of the creep forces of {states} random patches, over the load",
            bristles_gap(states),
            "1",
            LAW_BOUND,
        )
    ]
    for name, car in rolling_cars().items():
        preloads_of = preloads(car.vehicle)
        plain = preloads_at_rest(car.vehicle, CARRIER)
        gap = max(
            largest_relative_difference(other, list(known.values()))
            for known, other in zip(preloads_of, plain, strict=True)
        )
        rows.append(
            _row(
                f"preloads.{name}",
                f"largest difference of the preloads and static loads of {name}, over the largest",
                gap,
                "1",
                LAW_BOUND,
            )
        )
    return rows


def _hubs(states: int, duration: float) -> list[Row]:
    """Rows on vehicles that are cut at their wheels and driven by hub forces."""
    rows = []
    for name, car in cut_cars().items():
        for engine in ("reference", *ENGINES):
            what = (
                f"largest difference of {name}'s accelerations on hub forces and on a road "
                f"in {engine}, {states} random states"
            )
            rows.append(
                _row(f"hubs.{engine}.{name}", what, hub_gap(car, engine, states), "of the largest", INSTANT_BOUND)
            )
        what = f"largest difference of {name}'s section forces, wrenches and holding moments at random states"
        rows.append(_row(f"hubs.inside.{name}", what, inside_gap(car, 4), "of the largest", INSTANT_BOUND))
        for kind, rough in (("road", True), ("noise", False)):
            what = f"largest difference of {name}'s coordinates and rates in MuJoCo, {duration:g} s of {kind}"
            rows.append(
                _row(
                    f"hubs.{kind}.{name}", what, hub_path_gap(car, "mujoco", duration, rough), "m, rad, 1/s", PATH_BOUND
                )
            )
    return rows


def _rolling(states: int, duration: float) -> list[Row]:
    """Rows: cars on rolling tyres."""
    rows = []
    for name, car in rolling_cars().items():
        for engine in ENGINES:
            what = f"largest difference of {name}'s accelerations on tyres in {engine}, {states} random states"
            gap = rolling_gap(car, engine, states)
            rows.append(_row(f"tyres.{engine}.{name}", what, gap, "of the largest", INSTANT_BOUND))
        what = (
            f"largest difference of the tyre reports and ledgers of {name} at random states, over the largest of each"
        )
        rows.append(_row(f"tyres.reports.{name}", what, report_gap(car, states), "1", INSTANT_BOUND))
        what = f"largest difference of {name}'s positions and rates in MuJoCo, {duration:g} s of a turn on a rough road"
        gap = rolling_path_gap(car, "mujoco", duration)
        rows.append(_row(f"tyres.path.{name}", what, gap, "m, rad, 1/s", PATH_BOUND))
    return rows
