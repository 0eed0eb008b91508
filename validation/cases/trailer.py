"""A car on its suspension that tows a trailer: static loads, steady turns, circles, energy, agreement of engines, and a
planted fault."""

from pathlib import Path

import numpy as np

from models.multibody.numbers import Handling, TyreParameters
from models.road.plane_waves import plane_waves
from models.systems.handling.energy import drive_energy, unaccounted_energy
from models.systems.handling.run import SimulatedDrive, drive_run
from models.vehicles.spatial import SpatialVehicle
from validation.common.rows import CaseAnswer, Observed, Row, System, behaviour_row
from validation.spatial.towing import circle_error, give_towed_wheels_car_heading, static_load_error, towed_turn
from validation.spatial.trains import caravan, train, train_without_tie
from validation.spatial.written_equations import TURN_CONTROLS

TITLE = "A car with a trailer on its suspension"
SYSTEM: System = "rolling-vehicle"
VEHICLE_TRAINS = {"caravan": caravan, "train": train}
VEHICLE_TRAINS_IN_STEADY_TURN = {"caravan": caravan, "train": train_without_tie}
SPEED, TURN_SPEED = 22.0, 15.0
"""Speeds (m/s) on the rough road, and in the steady turn."""
STEADY_TURN_TOLERANCE = 1e-3


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on static loads and engines; a full run also has turns, a circle, energy, and a planted fault."""
    rows = [_static_loads_row(), *(_engine_agreement_row(name, 0.05 if quick else 1.0) for name in VEHICLE_TRAINS)]
    if not quick:
        rows += [
            *(row for name in VEHICLE_TRAINS for row in _steady_turn_rows(name)),
            _steady_circle_row(),
            _energy_row(),
            _planted_fault_row(),
        ]
    return rows, {}


def _rough_turn(engine_name: str, vehicle: SpatialVehicle, duration: float) -> SimulatedDrive:
    """A turn on a rough road, steered, braked and driven."""
    return drive_run(
        engine_name, Handling(vehicle, TyreParameters(), TURN_CONTROLS, plane_waves(4e-6, seed=3)), SPEED, duration
    )


def _static_loads_row() -> Row:
    """Row: static loads on ball and axles, compared with the levers' closed form."""
    return Observed(
        "trailer.loads",
        SYSTEM,
        "static loads on the caravan's ball and on all three axles, over those by their levers, less 1",
        static_load_error(),
        "",
    ).at_most(1e-9, "statics of two bodies on a ball and three axles; rounding of a linear system", "closed form")


def _engine_agreement_row(train_name: str, duration: float) -> Row:
    """Row: a turn on a rough road in Exudyn and MuJoCo."""
    first, second = (_rough_turn(engine, VEHICLE_TRAINS[train_name](), duration).run for engine in ("mujoco", "exudyn"))
    gap = max(np.abs(first.positions - second.positions).max(), np.abs(first.rates - second.rates).max())
    return Observed(
        f"trailer.engines.{train_name}",
        SYSTEM,
        f"{duration:g} s of a turn of the {train_name} on a rough road: positions and rates of the two engines",
        float(gap),
        "m, rad, m/s, rad/s",
    ).at_most(1e-10, "the same tableau, step and forces around two engines' own trees: rounding alone", "shared kernel")


def _steady_turn_rows(train_name: str) -> list[Row]:
    """Rows: yaw gain and articulation of a train in a steady turn, compared with closed forms."""
    errors = towed_turn(VEHICLE_TRAINS_IN_STEADY_TURN[train_name](), TURN_SPEED)
    why = "linear tyres, with trail and turning slip; a body that is towed balances about its hitch"
    return [
        Observed(
            f"trailer.turn.{train_name}",
            SYSTEM,
            f"yaw gain of a steady turn of small slip of the {train_name} at {TURN_SPEED:g} m/s, "
            "over the closed form's, less 1",
            errors.yaw_rate,
            "",
        ).at_most(STEADY_TURN_TOLERANCE, why, "closed form"),
        Observed(
            f"trailer.heading.{train_name}",
            SYSTEM,
            f"headings of what is towed in it beside the car, less the closed form's, per rad of steer ({train_name})",
            float(np.abs(errors.towed_headings).max()),
            "rad/rad",
        ).at_most(STEADY_TURN_TOLERANCE, why, "closed form"),
    ]


def _steady_circle_row() -> Row:
    """Row: angle between caravan and car in a slow circle, compared with rolling without side slip."""
    return Observed(
        "trailer.circle",
        SYSTEM,
        "angle between caravan and car in a circle at 3 m/s / that of axles that roll without side slip - 1",
        circle_error(),
        "",
    ).at_most(0.03, "a patch that turns on its way pulls 3 pi a / 32 behind its centre: 1 % of 3 m", "closed form")


def _energy_row() -> Row:
    """Row: error of the energy balance in a turn with the caravan."""
    drive = _rough_turn("mujoco", caravan(), 0.4)
    return Observed(
        "trailer.ledger",
        SYSTEM,
        "error of the energy balance of a turn with the caravan, relative to its total energy",
        float(np.abs(unaccounted_energy(drive)).max() / drive_energy(drive)[0]),
        "",
    ).at_most(1e-7, "Simpson's rule over springs, dampers, tyres, drag, brakes and steering", "closed form")


def _planted_fault_row() -> Row:
    """Row: wheels of the caravan that keep to the car's heading are detected by the steady turn."""
    errors = towed_turn(caravan(), TURN_SPEED, give_towed_wheels_car_heading)
    seen = abs(errors.yaw_rate) > STEADY_TURN_TOLERANCE or np.abs(errors.towed_headings).max() > STEADY_TURN_TOLERANCE
    return behaviour_row(
        "trailer.fault",
        SYSTEM,
        "planted: wheels of the caravan keep to the car's heading, by the steady turn",
        "caught" if seen else "missed",
        "caught",
        "both engines share the force: they agree on it",
    )
