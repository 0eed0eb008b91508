"""A braked vehicle on its suspension compared with the independent reference: every force law, accelerations, and
stops."""

from pathlib import Path
from typing import Any

import numpy as np

from validation.braking import plain_brakes as laws
from validation.braking import plain_sprung as whole
from validation.braking.plain_relaxation import braked_turn_difference
from validation.common.rows import Observed, Row, System

TITLE = "Braking beside the independent reference"
SYSTEM: System = "anti-lock"
ENGINE_NAMES = ("mujoco", "exudyn")
QUICK_DURATION, FULL_DURATION = 0.05, 1.0
"""Duration (s) of a stop, in the quick and in the full run."""
FORCE_LAW_COMPARISONS = {
    "friction": (
        laws.friction_of_random_states,
        1e-12,
        "difference of the friction by stacked tables from each table on its nodes",
    ),
    "tyre": (
        laws.tyre_reports,
        1e-12,
        "difference of the forces, slips and rate of a braked wheel over a step from plain code",
    ),
    "road": (
        laws.random_surfaces,
        1e-12,
        "difference of the surfaces, and their shares, under wheels that pass seams and lines from plain code",
    ),
    "pressure": (
        laws.torques_by_commands,
        1e-12,
        "difference of pressures, torques and supply along random commands from plain code",
    ),
    "relaxation": (laws.slip_lags, 1e-12, "difference of slip angles that lag by a relaxation length from plain code"),
}
"""For each force law: the function that evaluates both implementations at random states, the tolerance, and the
compared quantity."""
ROUNDING_REASON = "another algorithm in plain code; they differ by rounding"


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the force laws, accelerations, steady circles and stops. A quick run has the car in one engine and a
    short stop; a full run has all vehicles in Exudyn and MuJoCo."""
    vehicles, engines = (("car",), ENGINE_NAMES[:1]) if quick else (tuple(whole.VEHICLES), ENGINE_NAMES)
    rows = [_force_law_row(name) for name in FORCE_LAW_COMPARISONS]
    rows += [_acceleration_row(vehicle, engine) for vehicle in vehicles for engine in engines]
    rows += [_relaxing_turn_row(), *(_steady_circle_row(vehicle) for vehicle in vehicles)]
    rows += [
        _stop_row(vehicle, engine, QUICK_DURATION if quick else FULL_DURATION)
        for vehicle in vehicles
        for engine in engines
    ]
    return rows, {}


def _force_law_row(law_name: str) -> Row:
    """Row: largest difference of a force law from the reference's at random states."""
    both, bound, what = FORCE_LAW_COMPARISONS[law_name]
    return Observed(
        f"braking_reference.{law_name}", SYSTEM, what, laws.largest_difference(*both()), "by the largest"
    ).at_most(bound, ROUNDING_REASON, "native")


def _acceleration_row(vehicle_name: str, engine_name: str) -> Row:
    """Row: accelerations of a vehicle at random states in an engine, compared with the reference."""
    accelerations = whole.accelerations(whole.VEHICLES[vehicle_name](), engine_name)
    return Observed(
        f"braking_reference.accelerations.{vehicle_name}.{engine_name}",
        SYSTEM,
        f"largest difference of the {vehicle_name}'s accelerations in {engine_name} from plain code at "
        f"{whole.STATE_COUNT} states of any heading",
        whole.relative_difference(accelerations, whole.plain_accelerations(vehicle_name)),
        "by the largest",
    ).at_most(1e-12, ROUNDING_REASON, "native")


def _relaxing_turn_row() -> Row:
    """Row: end of a braked turn on relaxing tyres, compared with Newton's and Euler's equations."""
    return Observed(
        "braking_reference.relaxing_turn",
        SYSTEM,
        "difference at the end of a braked turn of the truck on ice from Newton's and Euler's "
        "equations, tyres that relax over 0.3 m, 8 steps in a sample",
        braked_turn_difference(0.3, 8),
        "m",
    ).at_most(
        3e-5, "order two: 47 and 11 micrometres at 4 and 8 steps; a length 1 % wrong moves the law's row", "native"
    )


def _steady_circle_row(vehicle_name: str) -> Row:
    """Row: steady circle of a vehicle compared with the reference."""
    computed, plain = whole.steady_circle_pair(whole.VEHICLES[vehicle_name]())
    return Observed(
        f"braking_reference.turn.{vehicle_name}",
        SYSTEM,
        f"largest difference of a steady circle of the {vehicle_name} from plain code: steer angles, state "
        "and yaw, 30 m at 8 m/s",
        float(np.nan_to_num(np.abs(computed - plain).max(), nan=np.inf)),
        "rad, m, per s",
    ).at_most(1e-10, "the same equations, solved to rounding", "native")


def _stop_row(vehicle_name: str, engine_name: str, duration: float) -> Row:
    """Row: course of a stop in an engine compared with the reference."""
    path = whole.run(whole.VEHICLES[vehicle_name](), engine_name, duration)
    return Observed(
        f"braking_reference.stop.{vehicle_name}.{engine_name}",
        SYSTEM,
        f"largest difference of {duration:g} s of a stop of the {vehicle_name} in {engine_name} from plain "
        "code, slip controller on split and changing friction",
        whole.path_difference(path, whole.plain_run(vehicle_name, duration)),
        "m, rad, per s",
    ).at_most(1e-10, "the same steps, in another code from the valves to the bodies", "native")
