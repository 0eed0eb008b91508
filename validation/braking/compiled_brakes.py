"""Laws of the braked wheel by compiled code, each called alone: what the plain ones are compared with."""

import numpy as np

from models.brake.plain.suspension import WheelForces
from models.brake.plain.tyre import BrakedStep, Surface, WheelMotion
from models.brake.plane_records import KNOWN, REPORT_SIZE, Report, Wheels
from models.brake.plane_step import slide
from models.brake.plane_step import tyre as compiled_tyre
from models.brake.plane_vehicle import PAPER_TRUCK, Plane, plane_of_truck
from models.brake.relaxation import Lag
from models.brake.relaxation import lag_on as compiled_lag_on
from models.brake.sprung import Sprung
from models.brake.sprung_step import HELD
from models.brake.surfaces import UNIFORM_ROAD, OnRoad, Road, surfaces
from models.brake.surfaces import under_wheels as compiled_under_wheels
from models.brake.wheel_step import StepInput, Wheel
from models.engines.braking_sprung import driven
from models.engines.free_vehicle import FreeModel, free_model
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import (
    TableCell,
    Tables,
    cell_and_share,
    lateral_adhesion,
    longitudinal_adhesion,
    stacked_tables,
)

PAPER_PLANE: Plane = plane_of_truck(PAPER_TRUCK)
DRY_TABLES = stacked_tables([table_of_surface("dry")])


def tyre(tables: Tables, surface: Surface, motion: WheelMotion, load: float, braked: BrakedStep) -> np.ndarray:
    """Compiled tyre step; its values (7,) are those of ``models.brake.plain.tyre.tyre``."""
    wheels, report, below = Wheels(*np.zeros((KNOWN, 1))), np.empty((REPORT_SIZE, 1)), surfaces(1)
    below.first[0], below.second[0], below.share[0] = surface.first, surface.second, surface.share
    wheels.start[0], wheels.load[0] = motion.start, load
    ahead = motion.forward_speed if motion.start >= 0.0 else -motion.forward_speed
    slide(0, ahead, motion.across, motion.least_speed, below.lag, tables.angles, wheels)
    given = StepInput(motion.start, motion.start + braked.step * motion.rate, *braked.torques, braked.step)
    compiled_tyre(
        0, given, Wheel(braked.radius, braked.inertia, braked.turning), tables, wheels, below, Report(*report)
    )
    return report[:, 0]


def friction(tables: Tables, table_index: int, angle: float, load: float, slip: float) -> tuple[float, float]:
    """mu_x and mu_y of one of the tables at a slip angle (rad), a load (N) and a slip."""
    cells, (s, w) = (
        TableCell(*cell_and_share(tables.angles, angle), *cell_and_share(tables.loads, load)),
        cell_and_share(tables.slips, slip),
    )
    below, above = (
        longitudinal_adhesion(table_index, cells, k, tables.mu_x) for k in (s, min(s + 1, tables.slips.size - 1))
    )
    return below + w * (above - below), lateral_adhesion(table_index, cells, s, w, tables.g, tables.h)


def under_wheels(road: Road, state: np.ndarray, step: float, kinds: np.ndarray) -> np.ndarray:
    """First table, second table and share of the second (4, 3) under the truck's wheels, for a state (2, 3) and a step
    (s)."""
    below = surfaces(4)
    compiled_under_wheels(state, step, OnRoad(PAPER_PLANE, kinds, 0.0, DRY_TABLES, road), below)
    return np.column_stack((below.first, below.second, below.share))


def lag_on(
    state: np.ndarray, time: float, steer: np.ndarray, slope: float, length: np.ndarray, lag: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Compiled counterpart of ``validation.braking.plain_relaxation.lag_on``: lagging slip angles of the truck's tyres
    after a step."""
    after, lagging = lag.copy(), np.zeros(4)
    truck_on_road = OnRoad(PAPER_PLANE, np.zeros(4, dtype=np.int64), slope, DRY_TABLES, UNIFORM_ROAD)
    compiled_lag_on(state, time, steer, truck_on_road, Lag(length, after), lagging)
    return after, lagging


def in_engine(vehicle: Sprung, engine: str) -> FreeModel:
    """A vehicle on its suspension in an engine that calls the compiled forces. ``wheel_forces_in`` of its table gives
    access to the quantities held constant at its wheels."""
    return free_model(engine, driven(vehicle, engine))


def wheel_forces_in(numbers: np.ndarray, wheels: int = 4) -> WheelForces:
    """Views into a table of numbers on the quantities that are constant at each wheel during a step; writing to them
    changes the table."""
    rows = numbers[-wheels * HELD :].reshape(HELD, wheels)
    return WheelForces(rows[0], rows[1:3].T, rows[3])
