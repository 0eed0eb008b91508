"""Tyres with a relaxation length on a braked vehicle on its suspension, compared with a closed form, limits, and
independently written code."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.systems.braking.march import BrakingPath
from models.tyre.magic_formula import table_of_surface
from validation.braking import plain_sprung as whole
from validation.braking.sprung_box import box, braked_vehicle, car, steady_torques
from validation.common.rows import Observed, Row, System

TITLE = "Relaxing tyres on the suspension"
SYSTEM: System = "anti-lock"
ENGINE_NAMES = ("mujoco", "exudyn")
SLIPPERY_FRICTION_FACTOR = 1e-6
"""Friction of the slippery road divided by that of a wet road: so low that steered wheels do not turn the car."""
STEER_STEP_SPEED, STEER_STEP_ANGLE = 20.0, 0.02
"""Speed (m/s) and steer angle (rad) of the steer step."""
BRAKE_TORQUES = (200.0, 200.0, 100.0, 100.0)
"""Brake torques (N m) of the four wheels, at which no wheel locks."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of relaxing tyres. A quick run has the car in Exudyn only, whose steps need no compiling; a full run also
    has MuJoCo and the limit of a stiff suspension."""
    engines = ENGINE_NAMES[1:] if quick else ENGINE_NAMES
    vehicles = ("car",) if quick else tuple(whole.VEHICLES)
    rows = [_slip_rise_row(engine) for engine in engines] + [_short_relaxation_row("exudyn")]
    rows += [
        _stop_against_plain_code_row(vehicle, engine, 0.05 if quick else 0.2)
        for vehicle in vehicles
        for engine in engines
    ]
    if not quick:
        rows.append(_stiff_suspension_row())
    return rows, {}


def _slip_rise_row(engine_name: str) -> Row:
    """Row: rise of the slip angles after a steer step, compared with an exponential in the distance."""
    return Observed(
        f"braking_relaxation.rise.{engine_name}",
        SYSTEM,
        "difference of the slip angles of wheels that are turned at once from 1 - exp(-u t / sigma)",
        slip_rise_error(engine_name),
        "of the angle in the end",
    ).at_most(2e-6, "first order by the way; what friction of a millionth leaves of the course", "closed form")


def slip_rise_error(engine_name: str, sample_count: int = 20) -> float:
    """Largest error of the rise of the slip angle's tangent after a steer step at constant speed, compared with its
    exponential."""
    slick = table_of_surface("wet").scaled(SLIPPERY_FRICTION_FACTOR)
    vehicle = replace(braked_vehicle(car(), slick, engine_name, STEER_STEP_ANGLE), relaxation=whole.RELAXATION_LENGTHS)
    path = vehicle.run(steady_torques(*4 * (0.0,)), STEER_STEP_SPEED, sample_count * vehicle.sample - 1e-6)
    distances = STEER_STEP_SPEED * np.cos(STEER_STEP_ANGLE) * (path.times[1:] - 0.5 * vehicle.sample)
    risen = np.tan(path.reports.slip_angle[:, :2]) / -np.tan(STEER_STEP_ANGLE)
    return float(np.abs(risen - (1.0 - np.exp(-distances[:, None] / whole.RELAXATION_LENGTHS[:2]))).max())


def braked_turn(
    engine_name: str | None, relaxation_length: float, stiffness_factor: float | None = None, duration: float = 0.2
) -> BrakingPath:
    """Braked turn of the car, or of the box whose suspension is ``stiffness_factor`` times as stiff, on tyres with a
    relaxation length (m, 0 for none). Without an engine the vehicle moves in the plane, without a suspension."""
    vehicle = car() if stiffness_factor is None else box(stiffness_factor, 0.01)
    torques, substeps = steady_torques(*BRAKE_TORQUES), 2 if stiffness_factor is None else 4
    vehicle_on_tyres = braked_vehicle(vehicle, table_of_surface("wet"), engine_name, 0.015, substeps=substeps)
    return replace(vehicle_on_tyres, relaxation=np.full(4, relaxation_length) if relaxation_length else None).run(
        torques, 10.0, duration
    )


def _short_relaxation_row(engine_name: str) -> Row:
    """Row: the end of a braked turn shifts in proportion to a short relaxation length."""
    return Observed(
        "braking_relaxation.short",
        SYSTEM,
        "ratio of the shift of a braked turn's end by a relaxation length of 0.2 m to the shift by 0.1 m",
        relaxation_shift_ratio(engine_name),
        "",
    ).within(2.0, 0.05, "to first order in the length, whose limit is a tyre that answers at once", "closed form")


def relaxation_shift_ratio(engine_name: str) -> float:
    """Ratio of two shifts of a braked turn's final position and heading (m, rad): the shift by a relaxation length of
    0.2 m divided by the shift by 0.1 m."""
    none, short, long = (braked_turn(engine_name, length).states[-1, 0, :3] for length in (0.0, 0.1, 0.2))
    return float(np.abs(long - none).max() / np.abs(short - none).max())


def _stop_against_plain_code_row(vehicle_name: str, engine_name: str, duration: float) -> Row:
    """Row: a stop on relaxing tyres in an engine, compared with independently written plain code."""
    path = whole.run(whole.VEHICLES[vehicle_name](), engine_name, duration, with_lags=True)
    return Observed(
        f"braking_relaxation.reference.{vehicle_name}.{engine_name}",
        SYSTEM,
        f"difference of {duration:g} s of a stop in {engine_name} from plain code: {vehicle_name}, relaxing tyres, "
        "slip control",
        whole.path_difference(path, whole.plain_run(vehicle_name, duration, with_lags=True)),
        "m, rad, per s",
    ).at_most(1e-10, "the same steps in plain code, whose lag is an exponential of a matrix", "native")


def _stiff_suspension_row() -> Row:
    """Row: a stiffer suspension brings the braked turn closer to that of the vehicle in the plane."""
    apart = []
    for stiffer in (1.0, 100.0):
        ends = [braked_turn(engine, 0.3, stiffer, 2.0).states[-1, 0, :2] for engine in ("mujoco", None)]
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
