"""Hard cases of braked wheels and trucks: standstill, locking, falling friction, very small and large friction, invalid
controllers.

Every implementation carries the chassis by itself; tyres and wheels are the same compiled ones.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.brake import Brake
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.quarter import stop_of_quarter_vehicle
from models.brake.surfaces import UNIFORM_ROAD, RoadStretch, check_step_distance, road_of_stretches
from models.core.errors import InputError
from models.tyre.tyre_table import stacked_tables
from validation.braking import braked_trucks as trucks
from validation.braking import braked_wheels as wheels
from validation.braking.braked_wheels import DRY, piecewise_linear_friction
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord


def refusal_case(run_case: Callable[[], Any]) -> wheels.Error:
    """Case: ``run_case`` must raise a refusal. Error: infinite if it returns."""

    def error(engine_name: str, work_folder: Path) -> float:
        run_case()
        return np.inf

    return error


def inconsistent_brake() -> None:
    """Builds a brake whose release pressure is above its push-out pressure; raises InputError."""
    try:
        Brake(push_out=0.5, release=0.7, rising=1000.0, falling=1000.0)
    except ValueError as error:
        raise InputError("", "release", 0.7, str(error)) from None


def constant_slip_case(
    case_name: str, difficulty: str, error_function: wheels.Error, tolerance: float = 1e-6
) -> HardCase:
    """Hard case of a wheel at constant slip, judged by the stopping distance m v^2 / (2 F)."""
    return HardCase(case_name, difficulty, "m v^2 / (2 F)", "", tolerance, "the step in which it stops", error_function)


def failure_case(case_name: str, difficulty: str, error_function: wheels.Error) -> HardCase:
    """Hard case in which every implementation must raise an error during the run."""
    return HardCase(
        case_name,
        difficulty,
        "fails, and says when",
        "",
        0.0,
        "exact",
        error_function,
        dict.fromkeys(IMPLEMENTATIONS, "raised"),
    )


LINEAR_FRICTION = piecewise_linear_friction((0.0, 0.0), (1.0, 0.9))
REFUSED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "refused")
CASES = (
    constant_slip_case(
        "light braking to a stop",
        "slip has the speed in its denominator, which ends at 0",
        wheels.constant_slip_case(DRY, 0.02),
        1e-7,
    ),
    constant_slip_case(
        "light braking to a stop, 20 ms",
        "50 time constants of the wheel in a step",
        wheels.constant_slip_case(DRY, 0.004, 2e-2),
    ),
    constant_slip_case(
        "table of a single cell", "slip 0 and 1 are its only nodes", wheels.constant_slip_case(LINEAR_FRICTION, 0.5)
    ),
    constant_slip_case(
        "slip that settles on a node",
        "the slope of friction jumps there",
        wheels.constant_slip_case(piecewise_linear_friction((0.0, 0.0), (0.05, 0.5), (0.2, 0.8), (1.0, 0.6)), 0.05),
    ),
    HardCase(
        "from rolling, 20 ms",
        "the wheel slows down within two steps",
        "the exact way",
        "",
        5e-4,
        "asked for",
        wheels.rolling_start_case(DRY, 0.05, 2e-2),
    ),
    HardCase(
        "torque just above the peak",
        "falls off along falling friction, slowly at first",
        "the exact way",
        "",
        5e-4,
        "asked for",
        wheels.locking_torque_error,
    ),
    HardCase(
        "torque exactly at the peak",
        "no slip beyond it is stable",
        "between the ways of peak and sliding",
        "",
        1e-6,
        "the step in which it stops",
        wheels.peak_torque_error,
    ),
    HardCase(
        "locked from the start",
        "the rate of slip is 0 / 0 at the end",
        "v^2 / (2 mu g)",
        "",
        1e-9,
        "asked for",
        wheels.locked_wheel_error,
    ),
    HardCase(
        "friction changes under a locked wheel",
        "within a step",
        "its closed form",
        "",
        1e-4,
        "the step of the change takes its share of the way",
        wheels.changing_friction_error,
    ),
    HardCase(
        "friction from 1e-6 to 1.5, locked",
        "bounded by next to nothing",
        "mu g t",
        "",
        1e-6,
        "rounding of the speed",
        wheels.friction_range_error,
    ),
    HardCase(
        "standstill under brakes",
        "friction would push it back",
        "does not move",
        "m, m/s",
        0.0,
        "exact",
        wheels.standing_vehicle_error,
    ),
    HardCase(
        "wheel thrown backwards", "slip above 1", "rolls", "", 1e-6, "25 time constants", wheels.backwards_spin_error
    ),
    HardCase(
        "brake lets go on a step's end",
        "locked until then, by an explicit state",
        "rolls",
        "",
        1e-6,
        "60 time constants once it grips",
        wheels.released_brake_error,
    ),
    HardCase(
        "truck sliding sideways, locked",
        "slip angles of 58 degrees",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        trucks.energy_gain_case((5.0, 8.0, 0.0), 2e4),
    ),
    HardCase(
        "truck spinning on ice",
        "wheels go forwards and backwards",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        trucks.energy_gain_case((8.0, 0.0, 3.0), 2e4),
    ),
    HardCase(
        "truck on even friction",
        "rounding left and right",
        "does not yaw",
        "m, rad, rad/s",
        0.0,
        "exact",
        trucks.asymmetry_on_even_friction,
    ),
    HardCase(
        "truck on split friction in a mirror",
        "sides exchanged",
        "mirror image",
        "m, rad",
        1e-12,
        "rounding",
        trucks.mirrored_truck_error,
    ),
    HardCase(
        "train that jackknifes, locked",
        "the drawbar folded under it",
        "gains no energy",
        "",
        1e-12,
        "rounding",
        trucks.jackknifed_train_error,
    ),
    HardCase(
        "tyres that lag, at standstill",
        "the tyre is a spring there",
        "stays at rest",
        "m, m/s",
        0.0,
        "exact",
        trucks.motion_after_rest_on_lagging_tyres,
    ),
    HardCase(
        "wheel exactly on the line",
        "of split friction",
        "as on the left surface",
        "m",
        0.0,
        "exact",
        wheels.surface_line_error,
    ),
    HardCase(
        "no friction on one side",
        "wheels without any force",
        "mu g t / 2",
        "",
        1e-4,
        "it has begun to yaw",
        trucks.split_friction_error,
    ),
    HardCase(
        "slope of friction changes within a step",
        "from dry on to wet, 20 ms",
        "m v^2 / (2 F)",
        "",
        1e-4,
        "the wheel takes up another slip",
        wheels.surface_change_error,
    ),
    HardCase(
        "valves open for ever",
        "all wheels lock",
        "comes to rest",
        "m/s, rad/s",
        0.0,
        "exact",
        trucks.rest_error_of_scene(run={"duration": 10.0}),
    ),
    HardCase(
        "pressure below push-out",
        "hysteresis would pull it below 0",
        "no torque",
        "N m",
        0.0,
        "exact",
        trucks.torque_below_push_out,
    ),
    HardCase(
        "slow wheel at the edge of locking",
        "a little less load, and it stands within the step",
        "comes to rest",
        "m/s, rad/s",
        0.0,
        "exact",
        trucks.rest_error_of_scene(**trucks.J_TURN_AT_LOCKING_LIMIT),
    ),
    HardCase(
        "one wheel of four lifted",
        "the plane's loads follow its accelerations",
        "statics of three wheels",
        "N, N m",
        1e-9,
        "rounding",
        trucks.load_sharing_error,
        is_without_engine=True,
    ),
    failure_case("truck that rolls over", "both wheels of a side bear nothing", trucks.overturning_truck_error),
    failure_case(
        "299 bar of a supply of 6",
        "more than there is",
        trucks.impossible_command_case(6.0, pressures=np.full(4, 299.0)),
    ),
    failure_case("truck that lifts its rear wheels", "the plane has no lift-off", trucks.lifting_truck_error),
    failure_case(
        "controller answers not a number",
        "would spread to every state",
        trucks.impossible_command_case(pressures=np.array([1.0, np.nan, 1.0, 1.0])),
    ),
    failure_case(
        "controller answers for three wheels",
        "of four",
        trucks.impossible_command_case(valves=np.ones(3, dtype=np.int64)),
    ),
    failure_case("controller answers nothing", "neither valves nor pressures", trucks.impossible_command_case()),
    *(
        HardCase(name, "a number from senseless input", "refused", "", 0.0, "exact", refusal_case(run), REFUSED)
        for name, run in (
            (
                "torque that drives the wheel",
                lambda: stop_of_quarter_vehicle(
                    wheels.QUARTER, stacked_tables([DRY]), UNIFORM_ROAD, np.full(3, -1.0), wheels.STEP, wheels.SPEED
                ),
            ),
            ("table that ends before it locks", lambda: piecewise_linear_friction((0.0, 0.0), (0.9, 0.8))),
            ("table with friction at no slip", lambda: piecewise_linear_friction((0.0, 0.1), (1.0, 0.8))),
            (
                "stretches shorter than a step",
                lambda: check_step_distance(
                    road_of_stretches([RoadStretch(0.0, 0, 0), RoadStretch(1.0, 1, 1), RoadStretch(1.01, 0, 0)]), 0.1
                ),
            ),
            ("brake that lets go too early", inconsistent_brake),
            ("vehicle lighter than its wheels", lambda: plane_of_truck(PAPER_TRUCK.model_copy(update={"mass": 100.0}))),
            (
                "roll shares that do not add up",
                lambda: plane_of_truck(
                    PAPER_TRUCK.model_copy(update={"front": PAPER_TRUCK.front.model_copy(update={"roll_share": 0.5})})
                ),
            ),
        )
    ),
)
