"""Tyres that relax on a braked vehicle on its suspension: a closed form, limits, and plain code."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.systems.braking.march import BrakingPath as Run
from models.tyre.magic_formula import table_of_surface
from validation.braking import plain_sprung as whole
from validation.braking.sprung_box import box, braked_vehicle, car, steady_torques
from validation.common.rows import Observed, Row, System

TITLE = "Relaxing tyres on the suspension"
SYSTEM: System = "anti-lock"
ENGINES = ("mujoco", "exudyn")
SLICK = 1e-6
"""Friction divided by that of a wet road: the car keeps its course whatever its wheels are steered."""
SPEED, STEER = 20.0, 0.02
TURNING = (200.0, 200.0, 100.0, 100.0)
"""Torques (N m) at which no wheel locks."""


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """A quick share in Exudyn, whose steps need no compiling; both engines and the stiff limit in the full one."""
    engines = ENGINES[1:] if quick else ENGINES
    vehicles = ("car",) if quick else tuple(whole.VEHICLES)
    rows = [_rise_row(engine) for engine in engines] + [_short_row("exudyn")]
    rows += [_reference_row(vehicle, engine, 0.05 if quick else 0.2) for vehicle in vehicles for engine in engines]
    if not quick:
        rows.append(_stiff_row())
    return rows, {}


def _rise_row(engine: str) -> Row:
    return Observed(
        f"braking_relaxation.rise.{engine}",
        SYSTEM,
        "difference of the slip angles of wheels that are turned at once from 1 - exp(-u t / sigma)",
        rise_apart(engine),
        "of the angle in the end",
    ).at_most(2e-6, "first order by the way; what friction of a millionth leaves of the course", "closed form")


def rise_apart(engine: str, samples: int = 20) -> float:
    """Largest error of the rise of the slip angle's tangent, against its exponential, after a steer step at constant
    speed."""
    slick = table_of_surface("wet").scaled(SLICK)
    vehicle = replace(braked_vehicle(car(), slick, engine, STEER), relaxation=whole.RELAXATION_LENGTHS)
    path = vehicle.run(steady_torques(*4 * (0.0,)), SPEED, samples * vehicle.sample - 1e-6)
    distances = SPEED * np.cos(STEER) * (path.times[1:] - 0.5 * vehicle.sample)
    risen = np.tan(path.reports.slip_angle[:, :2]) / -np.tan(STEER)
    return float(np.abs(risen - (1.0 - np.exp(-distances[:, None] / whole.RELAXATION_LENGTHS[:2]))).max())


def turn(engine: str | None, length: float, stiffer: float | None = None, duration: float = 0.2) -> Run:
    """A braked turn of the car, or of the box with suspension ``stiffer`` times as stiff, on tyres with a relaxation
    length (m, 0 for none). Without an engine the vehicle is plane."""
    vehicle = car() if stiffer is None else box(stiffer, 0.01)
    torques, substeps = steady_torques(*TURNING), 2 if stiffer is None else 4
    vehicle_on_tyres = braked_vehicle(vehicle, table_of_surface("wet"), engine, 0.015, substeps=substeps)
    return replace(vehicle_on_tyres, relaxation=np.full(4, length) if length else None).run(torques, 10.0, duration)


def _short_row(engine: str) -> Row:
    return Observed(
        "braking_relaxation.short",
        SYSTEM,
        "ratio of the shift of a braked turn's end by a relaxation length of 0.2 m to the shift by 0.1 m",
        short_ratio(engine),
        "",
    ).within(2.0, 0.05, "to first order in the length, whose limit is a tyre that answers at once", "closed form")


def short_ratio(engine: str) -> float:
    """Ratio of how far the final position and heading (m, rad) move by a relaxation length of 0.2 m to how far by 0.1
    m."""
    none, short, long = (turn(engine, length).states[-1, 0, :3] for length in (0.0, 0.1, 0.2))
    return float(np.abs(long - none).max() / np.abs(short - none).max())


def _reference_row(vehicle: str, engine: str, duration: float) -> Row:
    path = whole.run(whole.VEHICLES[vehicle](), engine, duration, lags=True)
    return Observed(
        f"braking_relaxation.reference.{vehicle}.{engine}",
        SYSTEM,
        f"difference of {duration:g} s of a stop in {engine} from plain code: {vehicle}, relaxing tyres, slip control",
        whole.path_difference(path, whole.plain_run(vehicle, duration, lags=True)),
        "m, rad, per s",
    ).at_most(1e-10, "the same steps in plain code, whose lag is an exponential of a matrix", "native")


def _stiff_row() -> Row:
    apart = []
    for stiffer in (1.0, 100.0):
        ends = [turn(engine, 0.3, stiffer, 2.0).states[-1, 0, :2] for engine in ("mujoco", None)]
        apart.append(float(np.hypot(*(ends[1] - ends[0]))))
    return Observed(
        "braking_relaxation.stiff",
        SYSTEM,
        "ratio of how far the box on relaxing tyres ends a braked turn from the plane vehicle with springs 100 times "
        "as stiff to how far it does with its usual ones",
        apart[1] / apart[0],
        "",
    ).at_most(
        0.1,
        "springs 100 and dampers 10 times as stiff: deflections fall to 1 %, the times that they take to a tenth",
        "shared kernel",
    )
