"""Runs of a manoeuvre in an engine: forces and slips of the tyres, energies, and motion in axes of the vehicle."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import (
    Estimate,
    RunSeries,
    grid_error,
    not_estimated,
    reference_size,
    step_errors,
    summed_error,
    with_stated_errors,
)
from models.core.errors import RunFailed
from models.core.resolved import check_resolved
from models.core.result import Channel, Result, result
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.error_control import NO_ESTIMATE
from models.engines.free_vehicle import FreeModel, LoadedVehicle, PlainModel, free_model
from models.engines.native_parts import joint_parts
from models.engines.towed_springs import shared_numbers, towed_division
from models.multibody import forces as at
from models.multibody.numbers import Control, Handling
from models.systems.handling.assumptions import assumptions
from models.systems.handling.limits import check_step, check_upright
from models.systems.handling.scene import HandlingScene
from models.vehicles.free_vehicle import chassis_of
from models.vehicles.spatial import JointElement
from models.vehicles.spatial_linear import design_mass_matrix

if TYPE_CHECKING:
    from models.multibody.plain.rolling import PlainRolling

REFERENCE_ENGINE = "reference"
"""Name of the independent reference: plain equations that share no force with the engines. It takes half a minute for
every simulated second.
"""
STEP_ERROR_ORDER, CELL_ERROR_ORDER = 3.0, 2.0
"""Orders of convergence with which errors are estimated: in the time step (Runge-Kutta 4, lowered by wheels that lock
and land), and in the cells of the tyre patch.
"""
UNIT_OF_CHANNEL = {"speed": "m/s", "side speed": "m/s", "yaw rate": "rad/s", "load": "N", "fx": "N", "fy": "N"}
"""Channels whose error is stated, with their units."""
ROW_STRIDE_OF_CELL_ERROR = 50
"""Every n-th row of a drive is used to compare creep forces on grids of different numbers of cells; this is n."""
MOST_CELLS, CELLS_KEY = 200, "tyres.cells"
"""Most cells per strip of a tyre patch, and the scene key of their number."""
REPEATED_PART_START = 0.4
"""Share of a manoeuvre after which part of it is repeated in half the time step, where a longer step is impossible."""
STANDSTILL_SHARE = 1e-6
"""Force divided by the load at rest, or speed divided by the initial speed, below which a channel is only rounding."""
TYRE_CHANNELS = {
    "load": (at.PRESS, "N", "of the tyre on the road"),
    "fx": (at.FX, "N", "creep force along the wheel"),
    "fy": (at.FY, "N", "creep force to its left"),
    "mz": (at.MZ, "N m", "creep moment"),
    "slip_x": (at.SLIP_X, "m/s", "slip along"),
    "slip_y": (at.SLIP_Y, "m/s", "slip to the left"),
    "tread": (at.TREAD, "m/s", "speed of the tread through the contact"),
    "steer": (at.ANGLE, "rad", "steer angle"),
    "power": (at.POWER, "W", "of the creep forces"),
}
"""Channels of every tyre: column in the tyre's report, unit, meaning."""

POINT_BELOW_CENTRE_TEXT = "of the place below the chassis' centre, left positive"
MOTION_CHANNELS = {
    "forward speed": ("m/s", "of the place below the chassis' centre"),
    "yaw rate": ("rad/s", "left positive"),
    "lateral acceleration": ("m/s^2", POINT_BELOW_CENTRE_TEXT),
    "side slip": ("rad", POINT_BELOW_CENTRE_TEXT),
}
"""Channels of the car's motion, with the names of measured channels: unit, meaning."""


@dataclass(frozen=True, eq=False)
class SimulatedDrive:
    """A simulated drive. run : times, positions and rates; tyres (m, w, REPORTED) : forces and slips of each tyre;
    ledger (m, LEDGER) : energies and powers; seconds : CPU time of the run.
    """

    handling: Handling
    run: Trajectory
    tyres: np.ndarray
    ledger: np.ndarray
    seconds: float = 0.0

    def __getitem__(self, tyre_channel: str) -> np.ndarray:
        """Returns a tyre channel (m, w) by its name in TYRE_CHANNELS, with a column for each tyre."""
        return self.tyres[:, :, TYRE_CHANNELS[tyre_channel][0]]

    @property
    def path(self) -> np.ndarray:
        """Path (m, 3) of the chassis on the road: x, y (m) and yaw (rad)."""
        return self.run.positions[:, :3]

    def velocity(self) -> np.ndarray:
        """Velocities (m, 3) of the point below the chassis' centre: forward and to the left (m/s), and yaw rate
        (rad/s).
        """
        yaw, rates = self.run.positions[:, 2], self.run.rates
        chassis_position = chassis_of(self.handling.given).position
        speed_along = np.cos(yaw) * rates[:, 0] + np.sin(yaw) * rates[:, 1] - rates[:, 2] * chassis_position[1]
        speed_across = np.cos(yaw) * rates[:, 1] - np.sin(yaw) * rates[:, 0] + rates[:, 2] * chassis_position[0]
        return np.column_stack([speed_along, speed_across, rates[:, 2]])

    def lateral_acceleration(self) -> np.ndarray:
        """Lateral acceleration (m,) in m/s^2 of the point below the chassis' centre, positive to the left."""
        speed_along, speed_across, turning = self.velocity().T
        return np.gradient(speed_across, self.run.times) + speed_along * turning

    def motion(self) -> dict[str, np.ndarray]:
        """Returns the channels of MOTION_CHANNELS, each (m,), by name."""
        speed_along, speed_across, turning = self.velocity().T
        return dict(
            zip(
                MOTION_CHANNELS,
                (speed_along, turning, self.lateral_acceleration(), np.arctan2(speed_across, speed_along)),
                strict=True,
            )
        )

    def slip_angles(self) -> np.ndarray:
        """Slip angles (m, w) in rad: direction in which each wheel's contact moves relative to the wheel's plane,
        positive to the right.
        """
        return np.arctan2(-self["slip_y"], np.abs(self["tread"] + self["slip_x"]))

    def largest_tyre_forces(self) -> np.ndarray:
        """Largest horizontal force (m, w) of each tyre in N: friction times load."""
        return self.handling.tyres.friction * self["load"]

    def friction_used(self) -> np.ndarray:
        """Utilised friction (m, w): horizontal force of each tyre divided by friction times load, 0 in the air."""
        return np.hypot(self["fx"], self["fy"]) / np.where(
            self.largest_tyre_forces() > 0.0, self.largest_tyre_forces(), 1.0
        )

    def power(self) -> np.ndarray:
        """Power (m,) in W of all work on the vehicle: dampers, drag and pushes, driver's torques, steering, and
        creep forces of the tyres.
        """
        ledger = self.ledger
        power = ledger[:, at.DISSIPATED] + ledger[:, at.TORQUE_POWER] + ledger[:, at.STEER_POWER]
        return power + self["power"].sum(axis=1)


def run(scene: HandlingScene, engine: str, manoeuvre: str | None = None, error: bool = False) -> Result:
    """Run a manoeuvre, by default the first, in "exudyn", "mujoco" or "reference"; the result's detail is the
    SimulatedDrive.

    error : whether the error of time steps and cells is estimated, by further runs. Raises RunFailed where the vehicle
    turns over, the step is too long or the motion is not finite.
    """
    name = manoeuvre or next(iter(scene.manoeuvres))
    driven_manoeuvre, handling, adaptive = scene.manoeuvres[name], scene.handling(name), scene.adaptive(engine, name)
    if adaptive is not None:
        run = drive_result(scene, engine, name, drive_run_adaptive(engine, handling, driven_manoeuvre.speed, adaptive))
        return not_estimated(run, NO_ESTIMATE) if error else run
    drive = drive_run(engine, handling, driven_manoeuvre.speed, driven_manoeuvre.duration, scene.run.step)
    labelled = drive_result(scene, engine, name, drive)
    return _with_error(labelled, drive, driven_manoeuvre.speed) if error else labelled


def drive_result(scene: HandlingScene, engine: str, manoeuvre_name: str, simulated_drive: SimulatedDrive) -> Result:
    """Returns the result of a simulated manoeuvre, with the assumptions that the drive breaks."""
    vehicle = simulated_drive.handling.vehicle
    channels = {
        key: Channel(("time", "coordinate"), getattr(simulated_drive.run, key), "m, rad" + per)
        for key, per in (("positions", ""), ("rates", ", per s"))
    }
    channels |= {
        key: Channel(("time", "tyre"), simulated_drive[key], *unit_and_source)
        for key, (_, *unit_and_source) in TYRE_CHANNELS.items()
    }
    channels |= {
        name: Channel("time", values, *MOTION_CHANNELS[name]) for name, values in simulated_drive.motion().items()
    }
    axes = {
        "time": Channel("time", scene.start_time(manoeuvre_name) + simulated_drive.run.times, "s"),
        "coordinate": Channel("coordinate", [".".join(coordinate) for coordinate in vehicle.coordinates()]),
        "tyre": Channel("tyre", [tyre.name for tyre in vehicle.tyres]),
    }
    counts, seconds = simulated_drive.run.counts, simulated_drive.seconds
    labelled = result(
        scene,
        channels,
        axes,
        engine=engine,
        counts=counts,
        seconds=seconds,
        detail=simulated_drive,
        manoeuvre=manoeuvre_name,
    )
    return with_assumptions(labelled, assumptions(simulated_drive.handling))


def _with_error(run_result: Result, simulated_drive: SimulatedDrive, start_speed: float) -> Result:
    """Returns the result with stated errors of its motion and tyre forces, estimated by runs in longer time steps and
    with other numbers of cells.
    """
    rerun, fine = (
        ManoeuvreRerun(run_result.data.attrs["engine"], simulated_drive, start_speed),
        principal_series(simulated_drive),
    )
    still = {"N": STANDSTILL_SHARE * max(simulated_drive.handling.held.tyres.values())}
    moving = {
        name: values
        for name, values in fine.channels.items()
        if np.abs(values).max() > still.get(UNIT_OF_CHANNEL[name], STANDSTILL_SHARE * start_speed)
    }
    by_step, method_text = step_errors(RunSeries(fine.times, moving), rerun, STEP_ERROR_ORDER, rerun.step)
    by_net = rerun.by_cells(list(moving))
    estimates = {
        name: replace(summed_error(by_step[name], by_net[name]), unit=UNIT_OF_CHANNEL[name]) for name in moving
    }
    return with_stated_errors(run_result, estimates, f"{method_text}, and other nets of the patch")


@dataclass(frozen=True, eq=False)
class ManoeuvreRerun:
    """Repeats a drive in an engine, from the same initial speed (m/s), with another time step or another number of
    cells per tyre patch.
    """

    engine: str
    drive: SimulatedDrive
    speed: float

    @property
    def step(self) -> float:
        """Time step (s) of the drive that is repeated."""
        return float(self.drive.run.times[1])

    @cached_property
    def in_double_step(self) -> RunSeries:
        """Time series of the manoeuvre in twice the time step; raises RunFailed."""
        return self._series_on_cells(self.drive.handling.tyres.cells, 2.0)

    def _series_on_cells(self, cell_count: int, step_factor: float) -> RunSeries:
        handling, steps = self.drive.handling, int((len(self.drive.run.times) - 1) / step_factor)
        changed = handling.changed(tyres=replace(handling.tyres, cells=cell_count))
        step = step_factor * self.step
        if steps < 1:
            raise RunFailed(self.engine, f"a step of {step:g} s outlasts the manoeuvre")
        return principal_series(drive_run(self.engine, changed, self.speed, steps * step, step))

    def __call__(self, step_factor: float, run_share: float) -> RunSeries:
        """Repeat the manoeuvre in twice the time step, or a share of it in half the step; returns its time series (see
        ``models.core.discretisation.Rerun``)."""
        if step_factor > 2.0:
            raise RunFailed(self.engine, "still longer steps are left out: fewer cells tell more")
        if step_factor > 1.0:
            return self.in_double_step
        run, handling, step = self.drive.run, self.drive.handling, step_factor * self.step
        first = round(min(REPEATED_PART_START, 1.0 - run_share) * (len(run.times) - 1))
        count = max(2, round(run_share * (len(run.times) - 1) / step_factor))
        later = _manoeuvre_from(handling, run.times[first])
        model = build_in_engine(self.engine, later, Settings("RK4", step, count * step))
        path = model.run(run.positions[first], run.rates[first])
        return principal_series(drive_of_fixed_steps(later, path, self.engine), run.times[first])

    def by_cells(self, channel_names: list[str]) -> dict[str, Estimate]:
        """Estimate the errors that the cells of the tyre patches cause in channels, by a run with a third of the cells.

        The error does not fall evenly with the number of cells. The ratio of the error to the difference of both runs
        is estimated from creep forces at the same states, compared with creep forces on twice as many cells.
        """
        cells = self.drive.handling.tyres.cells
        other_cells, finer = max(3, cells // 3) if cells > 3 else 6, 2 * cells
        try:
            base, coarse = self.in_double_step, self._series_on_cells(other_cells, 2.0)
        except RunFailed:
            base, coarse = principal_series(self.drive), self._series_on_cells(other_cells, 1.0)
        creep_forces, forces_on_other, forces_on_more = (
            self._creep_forces(count) for count in (cells, other_cells, finer)
        )
        force_difference, error = (
            np.linalg.norm(creep_forces - forces_on_other),
            np.linalg.norm(creep_forces - forces_on_more) / (1.0 - 0.5**CELL_ERROR_ORDER),
        )
        share, estimates = error / force_difference if force_difference > 0.0 else 0.0, dict[str, Estimate]()
        for name in channel_names:
            values = base.channels[name]
            gap = share * float(np.sqrt(np.mean((values - coarse.channels[name]) ** 2)))
            net = grid_error(gap, reference_size(values), UNIT_OF_CHANNEL[name], cells, CELL_ERROR_ORDER, MOST_CELLS)
            estimates[name] = replace(net, of=CELLS_KEY)
        return estimates

    def _creep_forces(self, cell_count: int) -> np.ndarray:
        """Creep forces (m, w, 2) in N at every n-th state of the drive, computed with another number of cells."""
        run, handling = self.drive.run, self.drive.handling
        numbers = handling.changed(tyres=replace(handling.tyres, cells=cell_count)).numbers
        sampled_times, positions, rates = (
            np.ascontiguousarray(run_array[::ROW_STRIDE_OF_CELL_ERROR])
            for run_array in (run.times, run.positions, run.rates)
        )
        report = np.empty((len(sampled_times), len(handling.vehicle.tyres), at.REPORTED))
        at.fill_reports(numbers, sampled_times, positions, rates, report, np.empty((len(sampled_times), at.LEDGER)))
        return report[:, :, [at.FX, at.FY]]


def principal_series(simulated_drive: SimulatedDrive, start_time: float = 0.0) -> RunSeries:
    """Time series of the channels whose error is estimated, for a drive that begins at ``start_time`` (s)."""
    motion = dict(zip(UNIT_OF_CHANNEL, simulated_drive.velocity().T, strict=False))
    return RunSeries(
        start_time + simulated_drive.run.times,
        motion | {name: simulated_drive[name] for name in UNIT_OF_CHANNEL if name in TYRE_CHANNELS},
    )


def _manoeuvre_from(handling_model: Handling, start_time: float) -> Handling:
    """Returns the manoeuvre with its controls and external forces shifted, so that time 0 is ``start_time`` (s)."""

    def shifted_control(control: Control) -> Control:
        return tuple((time - start_time, value) for time, value in control)

    controls_then = handling_model.controls
    controls = replace(
        controls_then,
        steer=shifted_control(controls_then.steer),
        brake=shifted_control(controls_then.brake),
        drive=shifted_control(controls_then.drive),
    )
    return handling_model.changed(
        controls=controls,
        pushes=tuple(replace(push, size=shifted_control(push.size)) for push in handling_model.pushes),
    )


def build_in_engine(engine: str, handling_model: Handling, solver_settings: Settings | None = None) -> FreeModel:
    """Build the vehicle in "exudyn" or "mujoco", or as the plain equations of "reference". solver_settings :
    integrator, step and duration, needed for runs only.
    """
    if engine == REFERENCE_ENGINE:
        return PlainModel(
            engine,
            _plain_equations(handling_model).acceleration,
            len(handling_model.vehicle.coordinates()),
            solver_settings,
        )
    division, full_forces = towed_division(handling_model, engine), driven_model(handling_model)
    parts = (*full_forces.parts, *division.native)
    return free_model(
        engine, replace(full_forces, numbers=shared_numbers(handling_model, division), parts=parts), solver_settings
    )


def _plain_equations(handling_model: Handling) -> "PlainRolling":
    """Returns the plain equations of the vehicle, which share no code with the engines."""
    from models.multibody.plain.rolling import PlainRolling

    return PlainRolling(handling_model)


def driven_model(handling_model: Handling) -> LoadedVehicle:
    """Returns what an engine builds of the car: bodies, elements along joint coordinates, and all compiled forces with
    their parameters.
    """
    parts = joint_parts(handling_model.vehicle)
    return LoadedVehicle(
        handling_model.vehicle, handling_model.gravity, handling_model.numbers, at.forces, at.set_forces, parts
    )


def drive_run(
    engine: str, handling_model: Handling, start_speed: float, duration: float, time_step: float = 1e-3
) -> SimulatedDrive:
    """Simulate a manoeuvre from straight rolling at a speed (m/s) for a duration (s). Raises RunFailed where the
    vehicle turns over, the step (s) is too long or the motion is not finite.
    """
    model = build_in_engine(engine, handling_model, Settings("RK4", time_step, duration))
    start_time = time.process_time()
    with _failing_as_turnover(handling_model, engine):
        path = model.run(*handling_model.straight(start_speed))
    return drive_of_fixed_steps(handling_model, path, engine, time.process_time() - start_time)


def drive_run_adaptive(
    engine: str, handling_model: Handling, start_speed: float, solver_settings: Settings
) -> SimulatedDrive:
    """Simulate a manoeuvre as ``drive_run`` does, by an integrator of "exudyn" or "reference" that chooses its own time
    steps.
    """
    from models.engines.free_vehicle_adaptive import march_adaptively

    model, start_time = build_in_engine(engine, handling_model), time.process_time()
    with _failing_as_turnover(handling_model, engine):
        path = march_adaptively(model, *handling_model.straight(start_speed), solver_settings)
    return drive_with_reports(handling_model, path, engine, time.process_time() - start_time)


@contextmanager
def _failing_as_turnover(handling_model: Handling, engine: str) -> Iterator[None]:
    """Context in which a failed run says that the car turned over, where that is the reason: engines cannot integrate
    the motion that follows.
    """
    try:
        yield
    except RunFailed as error:
        if error.state is not None:
            check_upright(handling_model, np.array([error.time]), error.state[None], engine)
        raise


def drive_of_fixed_steps(
    handling_model: Handling, trajectory: Trajectory, engine: str = "", run_seconds: float = 0.0
) -> SimulatedDrive:
    """Returns the drive of a run in fixed steps, with the tyres' forces and slips. Raises RunFailed where the steps are
    too long for the tyres or the motion.
    """
    drive = drive_with_reports(handling_model, trajectory, engine, run_seconds)
    check_step(drive, engine)
    check_resolved(
        engine, trajectory.times, trajectory.positions, trajectory.rates, design_mass_matrix(handling_model.vehicle)
    )
    return drive


def drive_with_reports(
    handling_model: Handling, trajectory: Trajectory, engine: str = "", run_seconds: float = 0.0
) -> SimulatedDrive:
    """Returns the drive of a run, with the tyres' forces and slips. Raises RunFailed where a tyre's force is not
    finite, or the car turns over.
    """
    report, ledger = _reports_of_run(handling_model, trajectory, engine)
    if not np.isfinite(report).all():
        raise RunFailed(engine, "a tyre's force is not finite: use a smaller step")
    check_upright(handling_model, trajectory.times, trajectory.positions, engine)
    return SimulatedDrive(handling_model, trajectory, report, ledger, run_seconds)


def _reports_of_run(handling_model: Handling, trajectory: Trajectory, engine: str) -> tuple[np.ndarray, np.ndarray]:
    """Forces and slips of the tyres (m, w, REPORTED), and energies and powers (m, LEDGER) of a run; in the reference
    from its own equations.
    """
    if engine == REFERENCE_ENGINE:
        return _plain_equations(handling_model).report(trajectory.times, trajectory.positions, trajectory.rates)
    count, tyres = len(trajectory.times), len(handling_model.vehicle.tyres)
    report, ledger = np.empty((count, tyres, at.REPORTED)), np.empty((count, at.LEDGER))
    states = np.ascontiguousarray(trajectory.positions), np.ascontiguousarray(trajectory.rates)
    at.fill_reports(handling_model.numbers, trajectory.times, *states, report, ledger)
    for element in handling_model.vehicle.joint_elements:
        travel, rate = (joint_travel(handling_model, element, values) for values in states)
        ledger[:, at.POTENTIAL] += (element.preload + 0.5 * element.stiffness * travel) * travel
        ledger[:, at.DISSIPATED] -= element.damping * rate**2
    return report, ledger


def joint_travel(handling_model: Handling, joint_element: JointElement, coordinate_values: np.ndarray) -> np.ndarray:
    """Displacement d (m,) of a joint element from positions (m, n), or its rate from rates."""
    coordinates = handling_model.vehicle.coordinates()
    columns = [coordinates.index(coordinate) for coordinate in joint_element.coordinates]
    return np.asarray(coordinate_values[..., columns] @ np.array(joint_element.factors))
