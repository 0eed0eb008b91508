"""Run of a procedure of a braking scene in an engine, and its result."""

import time
from dataclasses import replace

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.systems.braking.assumptions import assumptions
from models.systems.braking.errors import RepeatedRuns, with_error
from models.systems.braking.march import BrakedVehicle, BrakingPath, StartState
from models.systems.braking.of_scene import suspended_in_engine
from models.systems.braking.procedures import controlled_run, controller_commands, engines_of, vehicle_and_start_state
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import wheel_names

REPORT_CHANNELS = {"force_x": "N", "force_y": "N", "load": "N", "slip": "1", "slip_angle": "rad"}
"""Channels of the wheels in the last time step of every controller sample, with their units."""


def run(scene: BrakingScene, engine: str = "", *, procedure: str = "", error: bool = False) -> Result:
    """Run a procedure of the scene, by default the first, with the scene's controller or with what is connected to the
    port. The result's detail is its ``BrakingPath``.

    engine : by default the usual engine for the vehicle; error : whether the error of the time steps is estimated, by
    further runs. Assumptions are always checked. Raises InputError, Refused, or RunFailed, whose ``partial`` is the
    result until then, None where nothing was recorded.
    """
    name = procedure or next(iter(scene.procedures))
    (engine,) = engines_of(scene, (engine,) if engine else ())
    vehicle, start = vehicle_and_start_state(scene, name)
    vehicle = vehicle_in_engine(vehicle, engine)
    assumed, begun = assumptions(scene, name, vehicle), time.perf_counter()
    try:
        path = controlled_run(scene, name, vehicle, start, engine)
    except RunFailed as failure:
        if failure.partial is not None:
            seconds = time.perf_counter() - begun
            failure.partial = with_assumptions(_labelled_result(scene, name, engine, failure.partial, seconds), assumed)
        raise
    stop = with_assumptions(_labelled_result(scene, name, engine, path, time.perf_counter() - begun), assumed)

    return with_error(stop, scene, _repeated_runs(scene, name, vehicle, start, engine)) if error else stop


def vehicle_in_engine(vehicle: BrakedVehicle, engine: str) -> BrakedVehicle:
    """Returns the vehicle with the engine that integrates its motion. For a plane vehicle "reference" means its own
    equations.
    """
    if vehicle.sprung is not None:
        return replace(vehicle, engine=suspended_in_engine(engine, vehicle.sprung))
    if engine == "reference":
        return vehicle
    from models.engines.braking import EngineChassis

    return replace(vehicle, engine=EngineChassis(engine, vehicle.plane))


def _repeated_runs(
    scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle, start_state: StartState, engine: str
) -> RepeatedRuns:
    """Returns functions that repeat the procedure in other time steps, and the controller's commands, without a log."""
    if scene.port is not None:
        scene = scene.model_copy(update={"port": scene.port.model_copy(update={"log": None})})

    def rerun(steps_per_sample: int, end_time: float) -> BrakingPath:
        shorter = scene.model_copy(update={"run": scene.run.model_copy(update={"duration": end_time})})
        return controlled_run(shorter, procedure_name, replace(vehicle, substeps=steps_per_sample), start_state, engine)

    def commands_for_speeds(
        braking_path: BrakingPath, wheel_turning_speeds: np.ndarray, speeds: np.ndarray
    ) -> np.ndarray:
        return controller_commands(
            scene,
            procedure_name,
            vehicle,
            braking_path.times[:-1],
            np.abs(wheel_turning_speeds) * vehicle.plane.radius,
            speeds,
        )

    return RepeatedRuns(rerun, commands_for_speeds)


def _labelled_result(
    scene: BrakingScene, procedure_name: str, engine: str, braking_path: BrakingPath, run_seconds: float
) -> Result:
    """Returns the result of a procedure: motion of each coordinate; turning, brake pressure, torque, forces, load and
    slips of each wheel.
    """
    units = ", ".join("rad" if coordinate.split()[-1][0] in "hr" else "m" for coordinate in braking_path.coordinates)
    rates = ", ".join(f"{unit}/s" for unit in units.split(", "))
    moving, wheel = ("time", "coordinate"), ("time", "wheel")
    channels = {
        "positions": Channel(moving, braking_path.states[:, 0], units),
        "rates": Channel(moving, braking_path.states[:, 1], rates),
        "turning": Channel(wheel, braking_path.turning, "rad/s"),
        "pressure": Channel(wheel, braking_path.pressures, "bar"),
        "torque": Channel(wheel, braking_path.torques, "N m"),
    }
    start_row = np.full((1, braking_path.turning.shape[1]), np.nan)
    channels |= {
        procedure_name: Channel(wheel, np.concatenate((start_row, getattr(braking_path.reports, procedure_name))), unit)
        for procedure_name, unit in REPORT_CHANNELS.items()
    }
    samples = len(braking_path.times) - 1
    return result(
        scene,
        channels,
        {
            "time": Channel("time", braking_path.times, "s"),
            "coordinate": Channel("coordinate", list(braking_path.coordinates)),
            "wheel": Channel("wheel", list(wheel_names(braking_path.turning.shape[1]))),
        },
        engine=engine,
        counts={"samples": samples, "steps": samples * scene.run.substeps},
        seconds=run_seconds,
        detail=braking_path,
        title=f"{scene.title}: {procedure_name}",
        stands=int(braking_path.ended_at_rest),
    )
