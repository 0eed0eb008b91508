"""Faults planted in a braked vehicle, and the checks that see them.

Compiled code cannot be patched, so faults are planted in its inputs: the vehicle's parameters, tyre tables, brakes,
signals. The fault of a tyre force taken at the start of a step is planted by running another integration scheme.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from models.brake import brake, plane_vehicle
from models.brake.advance import advance
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, PlaneVehicle
from models.brake.port import sensors
from models.brake.quarter import QuarterPath, QuarterStop
from models.brake.surfaces import UNIFORM_ROAD, RoadStretch, RoadSurfaces, road_of_stretches
from models.tyre import tyre_table
from validation.braking import braked_wheels as wheels
from validation.braking import quarter_stops as stops
from validation.braking.braked_truck import RollingTruck, on_road
from validation.braking.quarter_stops import LITERAL, exact_distance, stopping_distance
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch

SPLIT_ROAD, STEP = road_of_stretches([RoadStretch(0.0, 1, 0)]), 5.5e-3


def _truck_after_first_step(road_surfaces: RoadSurfaces, steer: float = 0.0) -> RollingTruck:
    """The truck after a time step with all wheels locked, or, if steered, with rolling wheels. On SPLIT_ROAD the left
    side is dry and the right side ice; else the road is ice."""
    tables = tyre_table.stacked_tables([stops.friction_table("ice")[0], stops.friction_table("dry")[0]])
    truck = RollingTruck(
        on_road(plane_vehicle.plane_of_truck(PAPER_TRUCK), tables, road_surfaces),
        10.0,
        steer=steer,
        advance_step=advance,
    )
    if not steer:
        truck.turning[:] = 0.0
    truck.on(np.full(4, 0.0 if steer else 1e5), STEP)
    return truck


DRY = stops.friction_table("dry")[0]
LIGHT_TORQUE = stops.steady_torque(stops.FRONT_WHEEL, DRY, 0.004)[1]
"""Brake torque (N m) of light braking, at a slip of 0.4 % on dry road."""


def _light_stop_error() -> float:
    """Relative difference of a quarter vehicle's stopping distance from the exact one, for light braking on dry
    road."""
    return abs(
        stops.constant_torque_stop(stops.FRONT_WHEEL, stops.friction_table("dry"), LIGHT_TORQUE, 11.11).distance
        / _exact_distance()
        - 1.0
    )


@cache
def _exact_distance() -> float:
    """Exact stopping distance (m) of the quarter vehicle for light braking on dry road."""
    return exact_distance(stops.FRONT_WHEEL, DRY, LIGHT_TORQUE, 11.11)


def _load_transfer_error() -> float:
    """Relative difference of the front wheels' loads from W (b + mu h) / (2 L), with all wheels locked on even
    friction."""
    report = _truck_after_first_step(UNIFORM_ROAD).report
    slide = float(stops.friction_table("ice")[0].mu_x[0, 0, -1])
    base = 1.42 + 2.19
    wanted = 5640.0 * GRAVITY * (2.19 + slide * 1.2) / (2.0 * base)
    return float(np.abs(report.load[:2] / wanted - 1.0).max())


def _split_friction_error() -> float:
    """Relative difference of the yaw acceleration from the one by the reported forces' moment, with all wheels locked
    and the left side dry."""
    truck = _truck_after_first_step(SPLIT_ROAD)
    x, y = np.array([1.42, 1.42, -2.19, -2.19]), np.array([0.95, -0.95, 0.9, -0.9])
    moment = float(x @ truck.report.force_y - y @ truck.report.force_x)
    return float(abs(truck.state[1, 2] / (STEP * moment / 25000.0) - 1.0))


def _left_turn_sign_error() -> float:
    """Error of the signs in a left turn: 1 if the truck does not yaw to the left, plus 1 if its left side is not
    unloaded."""
    truck = _truck_after_first_step(UNIFORM_ROAD, 0.05)
    return float(not truck.state[1, 2] > 0.0) + float(not truck.report.load[0] < truck.report.load[1])


def _split_road_sign_error() -> float:
    """Error of the sign on a road that is dry on the left: 1 if the braked truck does not yaw to the left, else 0."""
    return float(not _truck_after_first_step(SPLIT_ROAD).state[1, 2] > 0.0)


def _hysteresis_area_error() -> float:
    """Relative error of the area of a brake's hysteresis loop from 0 to 5 bar and back, against the closed form."""
    brakes = brake.brakes_of_wheels(brake.Brake(push_out=0.8, release=0.3, rising=1400.0, falling=1500.0))
    pressures = np.concatenate((np.linspace(0.0, 5.0, 401), np.linspace(5.0, 0.0, 401)))
    torques = brake.torques_of_pressures(pressures, brakes)
    top, released_torque = 1400.0 * 4.2, 1500.0
    left = 0.3 + top / released_torque
    wanted = 0.5 * top * (left - 0.3) + top * (5.0 - left) - 0.5 * top * 4.2
    return float(abs(-np.trapezoid(torques, pressures) / wanted - 1.0))


def _torque_below_push_out() -> float:
    """Torque (N m) of the paper's front brake at 0.7 bar, below its push-out pressure; it should be 0."""
    return float(brake.brake_torque(0, 0.7, 0.0, brake.brakes_of_wheels(brake.PAPER_FRONT_BRAKE)))


def _table_node_error() -> float:
    """Difference between the stacked friction table at its nodes and the tyre's own table."""
    tables = tyre_table.stacked_tables([DRY])
    return float(np.abs(np.interp(DRY.slips, tables.slips, tables.mu_x[0, 0, 0]) - DRY.mu_x[0, 0]).max())


def _constant_slip_distance_error() -> float:
    """Relative difference of a quarter vehicle's stopping distance at constant slip from m v^2 / (2 F)."""
    return float(wheels.constant_slip_case(wheels.DRY, 0.02)("reference", Path()))


def _converter_error() -> float:
    """Relative difference between the largest error of a ramp converted to 12 bits and half a code."""
    ramp = np.linspace(0.0, 30.0, 100_001)
    channels = sensors.SensorChannels(sensors.SensorConversion(bits=12, range=30.0), ramp.size, 0)
    return float(abs(np.abs(channels(0, ramp) - ramp).max() / (0.5 * 30.0 / (2**12 - 1)) - 1.0))


CHECKS = {
    "light stop": Check("stopping distance, light braking, exact", "relative", 5e-4, _light_stop_error),
    "slip that stays": Check(
        "stopping distance at a slip that stays, closed form", "relative", 1e-6, _constant_slip_distance_error
    ),
    "code": Check("largest error of converted signals, half a code", "relative", 1e-3, _converter_error),
    "transfer": Check("front loads of the locked truck, closed form", "relative", 1e-6, _load_transfer_error),
    "split": Check("yaw acceleration on split friction by its moment", "relative", 1e-6, _split_friction_error),
    "turns left": Check("sign of yaw and roll in a left turn", "", 0.5, _left_turn_sign_error),
    "pulls left": Check("sign of yaw on split friction", "", 0.5, _split_road_sign_error),
    "loop": Check("area of a brake's loop, closed form", "relative", 1e-3, _hysteresis_area_error),
    "push-out": Check("torque below push-out", "N m", 1e-9, _torque_below_push_out),
    "nodes": Check("tables at the tyre's own nodes", "", 1e-12, _table_node_error),
}


def _truck_patch(**change_of_parameter: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """Patch that changes parameters of every truck: name -> function of the original array."""
    return attribute_patch(
        "models.brake.plane_vehicle:plane_of_truck",
        lambda real: lambda *arguments: _changed_plane(real(*arguments), change_of_parameter),
    )


def _changed_plane(
    plane_vehicle: PlaneVehicle, change_of_parameter: dict[str, Callable[[np.ndarray], np.ndarray]]
) -> PlaneVehicle:
    parts: dict[str, Any] = {
        name: change_field(getattr(plane_vehicle, name)) for name, change_field in change_of_parameter.items()
    }
    return plane_vehicle._replace(**parts)


def _brakes_patch(change_brakes: Callable[[Any], Any]) -> Patch:
    return attribute_patch(
        "models.brake.brake:brakes_of_wheels", lambda real: lambda *arguments: change_brakes(real(*arguments))
    )


def _force_of_step_start(original_function: Any) -> Any:
    """Fault: the vehicle's speed is integrated with the tyre force at the start of each step."""

    def stop(
        quarter_car: Any, tyre: Any, torque: float, speed: float, *further_arguments: Any, **keyword_arguments: Any
    ) -> Any:
        distance = stopping_distance(LITERAL, quarter_car, tyre[0], torque, speed, STEP)[0]
        zeros = np.zeros(2)
        return QuarterStop(QuarterPath(zeros, np.array([0.0, distance]), np.array([speed, 0.0]), zeros, zeros), 1)

    return stop


def _tables_patch(change_friction: Callable[[np.ndarray], np.ndarray]) -> Patch:
    def stacked(original_function: Any) -> Any:
        def with_changed_friction(tyre_tables: Any) -> Any:
            made = original_function(tyre_tables)
            return made._replace(mu_x=np.ascontiguousarray(change_friction(made.mu_x)))

        return with_changed_friction

    return attribute_patch("models.tyre.tyre_table:stacked_tables", stacked)


def _mirrored_steering(original_function: Any) -> Any:
    """Fault: steer angles, and thus the slip angles of steered wheels, have the opposite sign."""
    return lambda motion, torques, step, steer, vehicle: original_function(motion, torques, step, -steer, vehicle)


def _spin_inertia_patch(factor: float) -> Patch:
    """Fault: the spin inertia of the quarter vehicle's wheel is changed in the time step, but not in the closed
    form."""

    def change(original_property: Any) -> Any:
        return property(
            lambda truck: _changed_plane(original_property.fget(truck), {"spin_inertia": lambda spin: factor * spin})
        )

    return attribute_patch("models.brake.quarter:QuarterVehicle.plane", change)


def _coarser_conversion(original_function: Any) -> Any:
    """Fault: a signal is converted with one bit less than stated."""
    return lambda table, *further: original_function(table.model_copy(update={"bits": table.bits - 1}), *further)


FAULTS = (
    CampaignFault(
        "force of the start of the step",
        "step",
        attribute_patch("validation.braking.quarter_stops:constant_torque_stop", _force_of_step_start),
    ),
    CampaignFault("load transfer with the other sign", "vehicle", _truck_patch(load_per_x_acceleration=np.negative)),
    CampaignFault("roll transfer with the other sign", "vehicle", _truck_patch(load_per_y_acceleration=np.negative)),
    CampaignFault("left and right swapped", "vehicle", _truck_patch(place=lambda p: p * np.array([1.0, -1.0]))),
    CampaignFault("track halved", "vehicle", _truck_patch(place=lambda p: p * np.array([1.0, 0.5]))),
    CampaignFault("yaw inertia 1 % too large", "vehicle", _truck_patch(inertias=lambda inertia: 1.01 * inertia)),
    CampaignFault(
        "height of the centre of mass 1 % too large",
        "vehicle",
        _truck_patch(
            load_per_x_acceleration=lambda transfer: 1.01 * transfer,
            load_per_y_acceleration=lambda transfer: 1.01 * transfer,
        ),
    ),
    CampaignFault("spin inertia 1 % too large", "wheel", _spin_inertia_patch(1.01)),
    CampaignFault(
        "slip angle with the other sign",
        "tyre",
        attribute_patch("validation.faults.braking:advance", _mirrored_steering),
    ),
    CampaignFault(
        "conversion with a bit less",
        "port",
        attribute_patch("models.brake.port.sensors:SensorChannels", _coarser_conversion),
    ),
    CampaignFault("front and rear swapped", "vehicle", _truck_patch(place=lambda p: p * np.array([-1.0, 1.0]))),
    CampaignFault(
        "hysteresis without a width", "brake", _brakes_patch(lambda brake: brake._replace(release=brake.push_out))
    ),
    CampaignFault(
        "hysteresis reversed",
        "brake",
        _brakes_patch(lambda brake: brake._replace(release=brake.push_out, push_out=brake.release)),
    ),
    CampaignFault(
        "push-out pressure ignored", "brake", _brakes_patch(lambda brake: brake._replace(push_out=0.0 * brake.push_out))
    ),
    CampaignFault(
        "falling pressure by the rising gradient",
        "brake",
        _brakes_patch(lambda brake: brake._replace(falling=brake.rising)),
    ),
    CampaignFault("friction read one node late", "tyre", _tables_patch(lambda mu: np.roll(mu, 1, axis=3) * (mu > 0.0))),
    CampaignFault("friction 1 % too large", "tyre", _tables_patch(lambda mu: 1.01 * mu)),
)

CAMPAIGN = Campaign("planted.braking", "braking", "anti-lock", CHECKS, FAULTS)
