"""A car that brakes with a caravan, both on suspensions: statics, locked wheels, independently written equations, slip
control, and planted faults."""

from pathlib import Path
from typing import Any

import numpy as np

from models.brake.controllers.slip import SlipBangBang
from models.systems.braking.stop_report import StopHistory
from models.tyre.magic_formula import table_of_surface
from validation.braking import plain_sprung as whole
from validation.braking import sprung_train as train
from validation.braking.sprung_box import braked_vehicle, constant_friction, steady_torques
from validation.common.rows import Observed, Row, System, behaviour_row
from validation.spatial.towing import give_towed_wheels_car_heading, static_loads

TITLE = "Braking with a trailer on the suspension"
SYSTEM: System = "anti-lock"
ENGINE_NAMES = ("mujoco", "exudyn")
QUICK_DURATION, FULL_DURATION = 0.05, 1.0
"""Duration (s) of a stop, in the quick and in the full run."""
STATICS_TOLERANCE = 1e-3
"""Relative tolerance of the closed form of a caravan that brakes alone. The closed form has no pitch; a pitch of 2.7
mrad moves the centre of mass, half a metre above the ball, forward by 5e-4 of its lever arm."""
ROUNDING_REASON = "another algorithm in plain code; they differ by rounding"


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of axle loads, and of accelerations and stops. A quick run has one engine; a full run also has locked
    wheels, slip control, planted faults, and more vehicles in Exudyn and MuJoCo."""
    vehicles, engines = (("caravan",), ENGINE_NAMES[:1]) if quick else (tuple(whole.TRAINS), ENGINE_NAMES)
    rows = [_axle_loads_row()]
    rows += [_acceleration_row(vehicle, engine) for vehicle in vehicles for engine in engines]
    rows += [
        _stop_row(vehicle, engine, QUICK_DURATION if quick else FULL_DURATION)
        for vehicle in vehicles[:2]
        for engine in engines
    ]
    if not quick:
        rows += [_locked_wheels_row(), *_caravan_brakes_rows(), *_slip_control_rows(), *_planted_fault_rows()]
    return rows, {}


def _axle_loads_row() -> Row:
    """Row: axle loads of car and caravan on the suspension, compared with statics."""
    car = whole.towing_car()
    path = braked_vehicle(car, constant_friction(0.1)).run(steady_torques(*6 * (0.0,)), 2.0, 0.05)
    front, rear, axle, _ = static_loads(car.handling)
    loads = path.reports.load[-1].reshape(3, 2).sum(axis=1)
    return Observed(
        "braking_trailer.loads",
        SYSTEM,
        "loads of the three axles of car and caravan that roll, over those by their levers, less 1",
        float(np.abs(loads / np.array([front, rear, axle]) - 1.0).max()),
        "",
    ).at_most(1e-9, "statics of two bodies on a ball and three axles; rounding of a linear system", "closed form")


def _acceleration_row(vehicle_name: str, engine_name: str) -> Row:
    """Row: accelerations of a train at random states in an engine, compared with plain code."""
    accelerations = whole.accelerations(whole.TRAINS[vehicle_name](), engine_name)
    return Observed(
        f"braking_trailer.accelerations.{vehicle_name.replace(' ', '_')}.{engine_name}",
        SYSTEM,
        f"largest difference of the {vehicle_name}'s accelerations in {engine_name} from plain code at "
        f"{whole.STATE_COUNT} states of "
        "any heading",
        whole.relative_difference(accelerations, whole.plain_accelerations(vehicle_name)),
        "by the largest",
    ).at_most(1e-12, ROUNDING_REASON, "native")


def _stop_row(vehicle_name: str, engine_name: str, duration: float) -> Row:
    """Row: course of a stop of a train in an engine, compared with plain code."""
    path = whole.run(whole.TRAINS[vehicle_name](), engine_name, duration)
    return Observed(
        f"braking_trailer.stop.{vehicle_name}.{engine_name}",
        SYSTEM,
        f"largest difference of {duration:g} s of a stop of the {vehicle_name} in {engine_name} from plain code, "
        "slip controller "
        "of all wheels on split and changing friction",
        whole.path_difference(path, whole.plain_run(vehicle_name, duration)),
        "m, rad, per s",
    ).at_most(1e-10, "the same steps, in another code from the valves to the bodies", "native")


def _locked_wheels_row() -> Row:
    """Row: stopping distance of car and caravan with all wheels locked, compared with the closed form."""
    stopping_way, wanted = train.locked_stop_and_closed_form()
    return Observed(
        "braking_trailer.locked",
        SYSTEM,
        "way of a stop of car and caravan with all wheels locked, over v^2 / (2 mu g), less 1",
        abs(stopping_way / wanted - 1.0),
        "",
    ).at_most(1e-3, "wheels lock within a millisecond, and the car leans ahead by less than one", "closed form")


def _caravan_brakes_rows() -> list[Row]:
    """Rows: deceleration, axle load and ball force while the caravan brakes alone, compared with the closed form."""
    errors = train.caravan_errors()
    quantities = {
        "deceleration": (errors.deceleration, "deceleration of a train whose caravan brakes alone, wheels locked"),
        "load": (errors.axle_load, "load of the axle of a caravan that brakes alone"),
        "pull": (errors.ball_force, "force at the ball of a caravan that brakes alone"),
    }
    return [
        Observed(f"braking_trailer.alone.{key}", SYSTEM, f"{what} / closed form - 1", abs(float(error)), "").at_most(
            STATICS_TOLERANCE, "moments about the ball and momentum of both; springs lean by 2.7 mrad", "closed form"
        )
        for key, (error, what) in quantities.items()
    ]


def _slip_control_rows() -> list[Row]:
    """Rows: stop on ice with slip control of all six wheels, compared with locked wheels."""
    ice, speed = table_of_surface("ice"), 11.11
    vehicle = braked_vehicle(whole.towing_car(), ice, substeps=4, gradient=150.0)
    controlled, locked = (
        StopHistory(vehicle.run(controller, speed))
        for controller in (SlipBangBang(wheels=6), steady_torques(*6 * (1e5,)))
    )
    distances = [stop.vehicle_results()["stopping distance [m]"] for stop in (controlled, locked)]
    return [
        Observed(
            "braking_trailer.ice.locks",
            SYSTEM,
            "longest time for which a wheel of car or caravan locks above 15 km/h on ice, bang-bang slip controller",
            float(controlled.lock_times().longest_lock.max()),
            "s",
        ).at_most(0.1, "the controller holds the wheels", "none"),
        Observed(
            "braking_trailer.ice.distance",
            SYSTEM,
            "stopping distance of car and caravan on ice with the slip controller, over that with locked wheels",
            distances[0] / distances[1],
            "",
        ).at_most(1.0, "ice has its largest friction at a slip of some per cent", "none"),
    ]


def _planted_fault_rows() -> list[Row]:
    """Rows: faults planted in the force table that Exudyn and MuJoCo share must be caught."""
    pulled = train.relative_difference(train.caravan_run(train.plant_brakes_on_car), train.caravan_closed_form())
    turned = whole.towing_car.__wrapped__()
    give_towed_wheels_car_heading(turned.handling)
    apart = whole.relative_difference(whole.accelerations(turned, "exudyn", 5), whole.plain_accelerations("caravan", 5))
    seen = {
        "brakes": (
            "brakes of the caravan hold on to the car, by the load of its axle",
            abs(pulled.axle_load) > STATICS_TOLERANCE,
        ),
        "heading": ("wheels of the caravan keep to the car's heading, by plain code", apart > 1e-12),
    }
    return [
        behaviour_row(
            f"braking_trailer.fault.{name}",
            SYSTEM,
            f"planted: {what}",
            "caught" if caught else "missed",
            "caught",
            "both engines share the force: they agree on it",
        )
        for name, (what, caught) in seen.items()
    ]
