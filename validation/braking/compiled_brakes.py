"""Calls of single compiled laws of the braked wheel (tyre, road, relaxation, suspension), for comparison with plain
code."""

import numpy as np

from models.brake.plain.suspension import ConstantWheelForces
from models.brake.plain.tyre import BrakedStep, WheelMotion, WheelSurface
from models.brake.plane_records import REPORT_SIZE, WHEEL_QUANTITY_COUNT, WheelReport, WheelStates
from models.brake.plane_step import fill_tyre_report as compiled_tyre
from models.brake.plane_step import set_slip_angle
from models.brake.plane_vehicle import PAPER_TRUCK, PlaneVehicle, plane_of_truck
from models.brake.relaxation import TyreLag
from models.brake.relaxation import advance_all_lagging_slips as compiled_lag_on
from models.brake.sprung import SprungVehicle
from models.brake.sprung_step import VALUES_PER_WHEEL
from models.brake.surfaces import UNIFORM_ROAD, RoadSurfaces, VehicleOnRoad, new_wheel_surfaces
from models.brake.surfaces import fill_surfaces_under_wheels as compiled_under_wheels
from models.brake.wheel_step import BrakedWheel, WheelStepInput
from models.engines.braking_sprung import driven_vehicle
from models.engines.free_vehicle import FreeModel, free_model
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import (
    StackedTyreTables,
    TableCell,
    cell_and_share,
    lateral_adhesion,
    longitudinal_adhesion,
    stacked_tables,
)

PAPER_PLANE: PlaneVehicle = plane_of_truck(PAPER_TRUCK)
DRY_TABLES = stacked_tables([table_of_surface("dry")])


def tyre(
    tyre_tables: StackedTyreTables,
    surface: WheelSurface,
    wheel_motion: WheelMotion,
    load: float,
    braked_step: BrakedStep,
) -> np.ndarray:
    """Report (7,) of a tyre after a step, by compiled code: the same values as by
    ``models.brake.plain.tyre.tyre_report``.
    """
    wheels, report, surfaces_below = (
        WheelStates(*np.zeros((WHEEL_QUANTITY_COUNT, 1))),
        np.empty((REPORT_SIZE, 1)),
        new_wheel_surfaces(1),
    )
    surfaces_below.first[0], surfaces_below.second[0], surfaces_below.share[0] = (
        surface.first,
        surface.second,
        surface.share,
    )
    wheels.start[0], wheels.load[0] = wheel_motion.start, load
    forward_speed = wheel_motion.forward_speed if wheel_motion.start >= 0.0 else -wheel_motion.forward_speed
    set_slip_angle(
        0, forward_speed, wheel_motion.across, wheel_motion.least_speed, surfaces_below.lag, tyre_tables.angles, wheels
    )
    step_input = WheelStepInput(
        wheel_motion.start,
        wheel_motion.start + braked_step.step * wheel_motion.rate,
        *braked_step.torques,
        braked_step.step,
    )
    compiled_tyre(
        0,
        step_input,
        BrakedWheel(braked_step.radius, braked_step.inertia, braked_step.turning),
        tyre_tables,
        wheels,
        surfaces_below,
        WheelReport(*report),
    )
    return report[:, 0]


def friction(
    tyre_tables: StackedTyreTables, table_index: int, slip_angle: float, load: float, slip: float
) -> tuple[float, float]:
    """Friction coefficients mu_x and mu_y, by compiled code, of a tyre table at a slip angle (rad), a load (N) and a
    slip."""
    cells, (s, w) = (
        TableCell(*cell_and_share(tyre_tables.angles, slip_angle), *cell_and_share(tyre_tables.loads, load)),
        cell_and_share(tyre_tables.slips, slip),
    )
    mu_below, mu_above = (
        longitudinal_adhesion(table_index, cells, k, tyre_tables.mu_x)
        for k in (s, min(s + 1, tyre_tables.slips.size - 1))
    )
    return mu_below + w * (mu_above - mu_below), lateral_adhesion(
        table_index, cells, s, w, tyre_tables.g, tyre_tables.h
    )


def under_wheels(
    road: RoadSurfaces, truck_state: np.ndarray, time_step: float, surface_kinds: np.ndarray
) -> np.ndarray:
    """Surfaces under the truck's four wheels during a step (s) from a state (2, 3), by compiled code: number of the
    first surface, of the second, and share of the second (4, 3)."""
    surfaces_below = new_wheel_surfaces(4)
    compiled_under_wheels(
        truck_state, time_step, VehicleOnRoad(PAPER_PLANE, surface_kinds, 0.0, DRY_TABLES, road), surfaces_below
    )
    return np.column_stack((surfaces_below.first, surfaces_below.second, surfaces_below.share))


def lag_on(
    truck_state: np.ndarray,
    time_step: float,
    steer_angles: np.ndarray,
    cornering_slope: float,
    relaxation_lengths: np.ndarray,
    slip_lags: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Lagging slip angles of the truck's tyres after a time step and those used within the step (4,), rad, by compiled
    code. Arguments as in ``validation.braking.plain_relaxation.lag_on``."""
    lags_after, lagging = slip_lags.copy(), np.zeros(4)
    truck_on_road = VehicleOnRoad(PAPER_PLANE, np.zeros(4, dtype=np.int64), cornering_slope, DRY_TABLES, UNIFORM_ROAD)
    compiled_lag_on(
        truck_state, time_step, steer_angles, truck_on_road, TyreLag(relaxation_lengths, lags_after), lagging
    )
    return lags_after, lagging


def engine_model(vehicle: SprungVehicle, engine: str) -> FreeModel:
    """Model of a vehicle on its suspension in an engine that calls the compiled forces. ``wheel_force_views`` of its
    table gives access to the quantities that are constant at each wheel during a step."""
    return free_model(engine, driven_vehicle(vehicle, engine))


def wheel_force_views(parameter_table: np.ndarray, wheel_count: int = 4) -> ConstantWheelForces:
    """Views into a model's parameter table on the quantities that are constant at each wheel during a step (steer
    angles, forces, spin moments); writing to them changes the table."""
    rows = parameter_table[-wheel_count * VALUES_PER_WHEEL :].reshape(VALUES_PER_WHEEL, wheel_count)
    return ConstantWheelForces(rows[0], rows[1:3].T, rows[3])
