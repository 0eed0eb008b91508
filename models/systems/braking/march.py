"""Time integration of a braked vehicle with its controller in the loop, sample by sample, until it stands or the time
is over.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import AT_REST, FATAL_END_STATUSES, FINE, ending_sentence
from models.brake.brake import WheelBrakes
from models.brake.controller import LARGEST_PRESSURE, RELEASE, SAMPLING_PERIOD, Command, Controller, Sample, is_steady
from models.brake.plane_records import PlaneMotion, WheelReport
from models.brake.plane_vehicle import PlaneVehicle
from models.brake.port.ask import STATES_WITH_SLOW_APPLY, VALVE_STATES, checked_command
from models.brake.port.sensors import SensedController
from models.brake.pressure import BrakeChambers, air_at_rest
from models.brake.samples import (
    BrakeCommands,
    BrakeSystem,
    RecordedRow,
    SampleRecord,
    compiled_plane_samples,
    empty_row,
    rows_in_one,
)
from models.brake.surfaces import UNIFORM_ROAD, RoadSurfaces, VehicleOnRoad, check_step_distance
from models.core.errors import RunFailed
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables

LARGEST_SAMPLE_BATCH = 1024
"""Most samples that are computed at a time where the controller's command is constant."""


@dataclass(frozen=True, eq=False)
class BrakingPath:
    """Record of a braking run at every controller sample, the start included.

    times (n,) : s; states (n, 2, 2 + U) : positions and rates of the coordinates; turning, pressures, torques (n, W) :
    angular speeds of the wheels (rad/s), brake pressures (bar), brake torques (N m); reports : forces, loads and slips
    in the last time step of every sample, each (n - 1, W); ended_at_rest : whether the vehicle stands at the end;
    coordinates : names of the coordinates, the first three always x, y (m) and heading (rad); clock : report of the
    real-time clock on overruns, if the run kept to one.
    """

    times: np.ndarray
    states: np.ndarray
    turning: np.ndarray
    pressures: np.ndarray
    torques: np.ndarray
    reports: WheelReport
    ended_at_rest: bool
    coordinates: tuple[str, ...] = ()
    clock: str = ""


class StartState(NamedTuple):
    """State from which a run begins: positions and rates of the coordinates (2, 2 + U), and angular speeds of the
    wheels (W,) in rad/s.
    """

    state: np.ndarray
    turning: np.ndarray


@dataclass(frozen=True, eq=False)
class BrakedVehicle:
    """A vehicle with brakes and tyres on a road, ready to run.

    kind (W,) : which tyre each wheel has; steer (W,) : rad, or in its place steering : such angles by time (s),
    evaluated in the middle of each sample; engine : ``models.engines.braking.EngineChassis`` if an engine is to carry
    the chassis.
    sprung : ``models.brake.sprung.SprungVehicle`` of a vehicle on its suspension, which its engine then integrates.
    """

    plane: PlaneVehicle
    kind: np.ndarray
    tables: StackedTyreTables
    slope: float
    road: RoadSurfaces
    brakes: WheelBrakes
    chambers: BrakeChambers
    steer: np.ndarray
    substeps: int = 4
    sample: float = SAMPLING_PERIOD
    speed_given: bool = True
    switch_time: float = 0.0
    engine: Any = None
    relaxation: np.ndarray | None = None
    sprung: Any = None
    steering: Callable[[float], np.ndarray] | None = None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the vehicle, in the order of its states."""
        if self.sprung is not None:
            return tuple(self.sprung.names)
        return ("x", "y", *(f"heading_{k}" for k in range(self.plane.masses.size)))

    def rolling(self, speed: float) -> StartState:
        """Returns the start state of steady rolling along x at a speed (m/s)."""
        state = np.zeros((2, len(self.coordinates)))
        state[1, 0] = speed
        return StartState(state, speed / self.plane.radius)

    def run(
        self, controller: Controller, start_or_speed: float | StartState, longest_duration: float = 60.0
    ) -> BrakingPath:
        """Run the vehicle from a start state, or from steady rolling along x at a speed (m/s), for at most
        ``longest_duration`` (s).

        The brake switch closes at ``switch_time``; until then all valves release, whatever valve states the controller
        commands. Raises RunFailed, which names the time and whose ``partial`` is the path until then.
        """
        start_state, wheels = (
            start_or_speed if isinstance(start_or_speed, StartState) else self.rolling(start_or_speed),
            self.plane.wheels,
        )
        check_step_distance(self.road, self.sample / self.substeps * float(np.hypot(*start_state.state[1, :2])))
        current_row = empty_row(start_state.state.shape[1], wheels)
        current_row.state[:], current_row.turning[:] = start_state.state, start_state.turning
        commands = BrakeCommands(
            np.ones(1, dtype=np.int64), np.full(wheels, RELEASE), np.full(wheels, math.nan), self.steer.copy()
        )
        steady = self.steering is None and is_steady(controller)
        samples_at_once = int(min(longest_duration / self.sample + 2.0, LARGEST_SAMPLE_BATCH)) if steady else 1
        record = SampleRecord(
            current_row.all_values,
            np.empty((samples_at_once, current_row.all_values.size)),
            np.zeros(1, dtype=np.int64),
            longest_duration - 1e-9,
        )
        states = STATES_WITH_SLOW_APPLY if self.chambers.slow.size else VALVE_STATES
        beyond = (
            LARGEST_PRESSURE if isinstance(controller, SensedController) else 0.0
        )  # noise of a sensor may exceed the supply
        motion = current_row.motion(np.zeros(2 + self.plane.masses.size))
        rows, status = [current_row.all_values[None].copy()], FINE
        try:
            for number, (status, time, speed, supply) in enumerate(self._moving(commands, record, current_row, motion)):
                if status in FATAL_END_STATUSES:
                    raise RunFailed("braking", ending_sentence(status, self.plane, motion), time)
                _move_rows(rows, record)
                if status == AT_REST or time >= record.end_time:
                    break
                braked = time >= self.switch_time - 1e-9
                commands.samples[0] = samples_at_once if braked else 1
                known = speed if self.speed_given else math.nan
                rims = np.abs(current_row.turning) * self.plane.radius
                sample = Sample(number, round(time * 1e9), rims, braked, supply, known)
                _write_command(commands, checked_command(controller, sample, states, max(beyond, supply)), braked)
                if self.steering is not None:
                    commands.steer[:] = self.steering(time + 0.5 * self.sample)
        except RunFailed as error:
            _move_rows(rows, record)
            error.partial = _braking_path(rows, current_row, False, self.coordinates)
            raise
        return _braking_path(rows, current_row, status == AT_REST, self.coordinates)

    @property
    def on_road(self) -> VehicleOnRoad:
        """Vehicle, tyre tables and road in the form that compiled functions take."""
        return VehicleOnRoad(self.plane, self.kind, self.slope, self.tables, self.road)

    def _moving(
        self, commands: BrakeCommands, sample_record: SampleRecord, sample_row: RecordedRow, motion: PlaneMotion
    ) -> Iterator[tuple[int, float, float, float]]:
        """Returns the iterator that integrates the motion sample by sample from the state in ``sample_row`` and
        ``motion``; it yields status, time (s), speed (m/s) and supply pressure (bar).
        """
        air = air_at_rest(self.chambers, self.sample)._replace(pressure=sample_row.pressure, torque=sample_row.torque)
        torques = np.zeros((self.substeps + 1, self.plane.wheels))
        braking = BrakeSystem(air, self.chambers, self.brakes, torques)
        go, arguments = compiled_plane_samples, [commands, sample_record, self.sample, braking, motion, self.on_road]
        if self.relaxation is not None:
            from models.brake.relaxation import TyreLag, compiled_lagging_samples

            # straight ahead tyres begin without slip angles, whatever the wheels are steered, in a turn as in a steady
            # one
            angle = np.full(self.plane.wheels, np.nan if sample_row.state[1, 1:].any() else 0.0)
            go, arguments = compiled_lagging_samples, [*arguments, TyreLag(self.relaxation, angle)]
        moving: Iterator[tuple[int, float, float, float]] = (go if self.engine is None else self.engine.moving)(
            *arguments
        )
        return moving


def braked_vehicle_on_tyres(
    plane_vehicle: PlaneVehicle,
    tyres: Sequence[TyreTable],
    brakes: WheelBrakes,
    chambers: BrakeChambers,
    road: RoadSurfaces = UNIFORM_ROAD,
    **other_fields: Any,
) -> BrakedVehicle:
    """Build a braked vehicle whose wheels point straight ahead, by default all with the same kind of tyre.

    tyres : tyre tables, surface by surface and kind by kind; other_fields : further fields of ``BrakedVehicle``.
    """
    zeros = np.zeros(plane_vehicle.wheels)
    slope = max(tyre.cornering for tyre in tyres)
    vehicle_fields = {
        "kind": zeros.astype(int),
        "steer": zeros,
        "tables": stacked_tables(tyres),
        "slope": slope,
        **other_fields,
    }
    return BrakedVehicle(plane=plane_vehicle, road=road, brakes=brakes, chambers=chambers, **vehicle_fields)


def _write_command(commands: BrakeCommands, command: Command, brake_switch_closed: bool) -> None:
    """Write a controller's command into ``commands`` for the next sample; valves release until the brake switch
    closes.
    """
    if command.pressures is not None:
        commands.pressures[:] = command.pressures
    else:
        commands.valves[:] = command.valves if brake_switch_closed else RELEASE
        commands.pressures[0] = math.nan


def _move_rows(recorded_rows: list[np.ndarray], sample_record: SampleRecord) -> None:
    """Append a copy of the recorded rows to ``recorded_rows``, and empty the record."""
    recorded_rows.append(sample_record.rows[: sample_record.uncollected_count[0]].copy())
    sample_record.uncollected_count[0] = 0


def _braking_path(
    recorded_rows: list[np.ndarray], last_row: RecordedRow, stands_at_end: bool, coordinate_names: tuple[str, ...]
) -> BrakingPath:
    all_of = rows_in_one(recorded_rows, last_row)
    return BrakingPath(
        all_of.time[:, 0],
        all_of.state,
        all_of.turning,
        all_of.pressure,
        all_of.torque,
        WheelReport(*np.moveaxis(all_of.report[1:], 1, 0)),
        stands_at_end,
        coordinate_names,
    )
