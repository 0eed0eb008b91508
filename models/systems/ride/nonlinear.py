"""Rides of nonlinear vehicles: statistical linearisation, Monte Carlo copies in time, and runs in an engine.

All nonlinear laws are included, and gravity where the vehicle has it. Where tyres may lift, the results of copies and
engines hold: the statistically linearised vehicle keeps its tyres on the road.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import with_assumptions
from models.core.discretisation import RunSeries, with_estimated_errors
from models.core.result import Channel, Result, result
from models.core.strict import Strict, quantity
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.spatial_protocol import INTEGRATORS, SpatialModel, build
from models.ensemble.runner import EnsembleProgress as Done
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.store import ArraysByName
from models.ensemble.workers import Crew
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.nonlinear_copies import CopyStatistics, copies_in_time, longest_resolving_step
from models.ride.road_path import RoadPath, check_rates, road_path
from models.ride.statistical_linearisation import StatisticallyLinear, statistically_linear
from models.road.excitation import RoadExcitation
from models.systems.ride.assumptions import assumptions
from models.systems.ride.errors_in_time import with_error_of_copies
from models.systems.ride.of_scene import excitation_of, linear_vehicle
from models.systems.ride.scene import RideScene
from models.systems.ride.watched import MotionInRun, SpectralMotion, checked_speeds, watched_vehicle
from models.vehicles.linear_vehicle import LinearOutput
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, static_preloads, wheels

LONGEST_TIME_STEP = 2e-3
"""Longest time step (s) of runs in engines; stiff springs need a shorter step."""
Progress = Callable[[str, float], None]


class RunSampling(Strict):
    """Settings of runs in time: number and length of copies, time step, speeds and seed."""

    beside: list[float] = Field(default_factory=list, description="speeds in m/s for Monte Carlo; the middle if none")
    copies: int = Field(default=200, ge=2, le=100_000, description="of the vehicle, each on a road of its own")
    lasting: float = quantity("s", "length of each copy after it has forgotten its beginning", default=10.0)
    speed: float | None = quantity("m/s", "of the engines' runs and tables; the middle one if not given", default=None)
    step: float | None = quantity("s", "longest step of the engines' runs; 2 ms if not given", default=None)
    driven: float = quantity("s", "length of the engines' runs", default=30.0)
    skipped: float = quantity("s", "left out at their beginning", default=4.0, zero=True)
    seed: int = Field(default=1, ge=0, lt=2**64, description="of all roads in time")

    def shown(self, speeds: np.ndarray) -> float:
        """Speed (m/s) of runs in engines: the requested speed, else the middle one of ``speeds``."""
        return self.speed or float(speeds[len(speeds) // 2])


@dataclass(frozen=True)
class NonlinearRide:
    """Results of a nonlinear ride. small_motion (speeds, outputs) : standard deviations with slopes at rest;
    linearised_vehicles : by statistical linearisation, one per speed; copies : Monte Carlo copies by speed (m/s).

    shown : the statistically linearised vehicle at the speed of runs in engines; tyres_may_lift : whether tyres may
    lift, which only Monte Carlo copies do here.
    """

    speeds: np.ndarray
    small_motion: np.ndarray
    linearised_vehicles: list[StatisticallyLinear]
    copies: dict[float, CopyStatistics]
    shown: StatisticallyLinear
    tyres_may_lift: bool = False

    def quantity_by_speed(self, quantity_name: str) -> np.ndarray:
        """Returns a quantity of the statistically linearised vehicles, by its name, shape (speeds, outputs)."""
        return np.array([getattr(linearised, quantity_name) for linearised in self.linearised_vehicles])

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviations (speeds, outputs) by statistical linearisation."""
        return np.array([linearised.covariance.deviation for linearised in self.linearised_vehicles])


def linearised_result(
    scene: RideScene,
    vehicle: SpatialVehicle,
    run_sampling: RunSampling,
    report_progress: Progress,
    estimate_error: bool = False,
) -> Result:
    """Compute standard deviations by small motion and by statistical linearisation at all speeds, and by Monte Carlo
    copies at some; the result's detail is ``NonlinearRide``.

    estimate_error : whether errors are estimated, by further copies in longer steps.
    """
    assert scene.speeds is not None
    speeds, road = scene.speeds.all(), excitation_of(scene, wheels(vehicle))
    linear, on_road, start_time = linear_vehicle(vehicle), vehicle.with_tyres(pushes_only=False), time.process_time()
    small, replaced = [], []
    for i, speed in enumerate(speeds):
        report_progress("statistical linearisation", 0.3 * i / len(speeds))
        small.append(stationary_covariance(vehicle_with_road(linear(speed), road, speed)).deviation)
        replaced.append(statistically_linear(on_road, road, speed))
    shown = run_sampling.shown(speeds)
    compared_speeds = run_sampling.beside or [shown]
    copies = _copies_by_speed(scene, CopiesJob(vehicle, road, tuple(compared_speeds), run_sampling), report_progress)
    at_shown = statistically_linear(on_road, road, shown)
    linear_runs = NonlinearRide(speeds, np.array(small), replaced, copies, at_shown, vehicle.lifts)
    by_speed = {"deviation": linear_runs.deviation, "small_motion": linear_runs.small_motion}
    by_speed |= {field_name: linear_runs.quantity_by_speed(field_name) for field_name in ("mean", "left_out")}
    of_copies = {"deviation": "deviation", "mean": "mean", "variance_error": "error", "kurtosis": "kurtosis"}
    channels = {name: Channel(("speed", "output"), values) for name, values in by_speed.items()}
    channels |= {
        f"copies_{name}": Channel(
            ("speed_of_copies", "output"), [getattr(copies_at_speed, field_name) for copies_at_speed in copies.values()]
        )
        for name, field_name in of_copies.items()
    }
    labelled = result(
        scene,
        channels,
        {
            "speed": Channel("speed", speeds, "m/s"),
            "output": Channel("output", list(at_shown.covariance.names)),
            "unit": Channel("output", [output.unit for output in at_shown.vehicle.outputs]),
            "speed_of_copies": Channel("speed_of_copies", list(copies), "m/s"),
        },
        engine="reference",
        counts={"iterations": sum(len(copies_at_speed.gain_changes) for copies_at_speed in replaced)},
        seconds=time.process_time() - start_time,
        detail=linear_runs,
        **({"tyres": "lift in copies alone"} if vehicle.lifts else {}),
    )
    motion = _motion_of_equivalents(vehicle, road, speeds, replaced)
    with_assumptions(labelled, assumptions(scene, vehicle, motion, gains_replace_curves=not vehicle.lifts))
    if not estimate_error:
        return labelled
    known = (
        {}
        if vehicle.lifts
        else {speed: _equivalent_at_speed(on_road, road, speed, speeds, replaced) for speed in copies}
    )
    return with_error_of_copies(labelled, vehicle, road, known, copies, run_sampling.seed)


@dataclass(frozen=True)
class CopiesJob:
    """Job for worker processes (see ``models.ensemble.runner``) whose path i is all Monte Carlo copies at the i-th
    speed (m/s).
    """

    vehicle: SpatialVehicle
    road: RoadExcitation
    speeds: tuple[float, ...]
    sampling: RunSampling

    def __call__(self, paths: range) -> ArraysByName:
        """Returns the fields of ``CopyStatistics`` as arrays, with the speed as their first axis."""
        copies_of_speeds = [self._copies_at_speed(self.speeds[i]) for i in paths]
        return {
            name: np.array([getattr(copies_at_speed, name) for copies_at_speed in copies_of_speeds])
            for name in CopyStatistics.__dataclass_fields__
        }

    def _copies_at_speed(self, speed: float) -> CopyStatistics:
        s = self.sampling
        return copies_in_time(self.vehicle, self.road, speed, s.lasting, copy_count=s.copies, seed=s.seed)

    def facts(self) -> dict[str, Any]:
        """Returns no facts, as the blocks of this job are not stored."""
        return {}


def _copies_by_speed(
    scene: RideScene, copies_job: CopiesJob, report_study_progress: Progress
) -> dict[float, CopyStatistics]:
    """Compute Monte Carlo copies by the scene's worker processes; returns them by speed (m/s)."""

    def report_progress(finished_blocks: Done) -> None:
        report_study_progress(
            f"Monte Carlo at {finished_blocks.done} of {finished_blocks.paths} speeds",
            0.3 + 0.4 * finished_blocks.done / finished_blocks.paths,
        )

    with Crew.of(scene, default_workers=1).at_work(len(copies_job.speeds)) as pool:
        arrays = run_paths(copies_job, len(copies_job.speeds), None, pool, PathBlocks(1), report_progress)
    return {
        speed: CopyStatistics(tuple(names.tolist()), moments, float(step), float(duration), int(settling))
        for speed, names, moments, step, duration, settling in zip(
            copies_job.speeds, *(arrays[name] for name in CopyStatistics.__dataclass_fields__), strict=True
        )
    }


def _equivalent_at_speed(
    vehicle: SpatialVehicle,
    road: RoadExcitation,
    speed: float,
    speeds: np.ndarray,
    linearised_vehicles: list[StatisticallyLinear],
) -> StatisticallyLinear:
    """Returns the statistically linearised vehicle at a speed (m/s), from ``linearised_vehicles`` if it is
    one of ``speeds``.
    """
    matching = np.flatnonzero(np.isclose(speeds, speed))
    return linearised_vehicles[matching[0]] if len(matching) else statistically_linear(vehicle, road, speed)


def _motion_of_equivalents(
    vehicle: SpatialVehicle, road: RoadExcitation, speeds: np.ndarray, linearised_vehicles: list[StatisticallyLinear]
) -> SpectralMotion:
    """Returns the Gaussian motion of the parts of statistically linearised vehicles; springs move about their mean
    travels.
    """
    known = dict(zip(speeds.tolist(), linearised_vehicles, strict=True))
    chosen = checked_speeds(speeds)
    means = {
        f"travel {name}": np.array([known[speed].springs[name].travel for speed in chosen])
        for name in linearised_vehicles[0].springs
    }
    return SpectralMotion(vehicle, lambda speed: known[speed].vehicle, road, chosen, means)


def engine_result(
    scene: RideScene,
    engine: str,
    vehicle: SpatialVehicle,
    run_sampling: RunSampling,
    estimate_error: bool = False,
    road_heights: np.ndarray | None = None,
) -> Result:
    """Run the vehicle in an engine over a random road, at the speed of ``Sampling.shown``; the result's detail is
    ``EngineRide``.

    estimate_error : whether the error of the steps is estimated, by runs in longer steps on the same road; road_heights
    : a road in place of the drawn one, as ``RoadPath.wheel_heights_and_rates`` has it.
    """
    assert scene.speeds is not None
    speed, road = run_sampling.shown(scene.speeds.all()), excitation_of(scene, wheels(vehicle))
    path = road_path(road, speed, min(run_sampling.step or LONGEST_TIME_STEP, longest_resolving_step(vehicle, speed)))
    start_time, row_interval, skipped = (
        time.process_time(),
        max(1, round(2.0 * LONGEST_TIME_STEP / path.step)),
        run_sampling.skipped,
    )
    if road_heights is None:
        road_heights = path.wheel_heights_and_rates(int(np.ceil(run_sampling.driven / path.step)), run_sampling.seed)
    ride = ride_over_heights(engine, vehicle, path, road_heights, skipped_time=skipped, steps_per_output=row_interval)
    labelled = result(
        scene,
        {"output_value": Channel(("time", "output"), ride.outputs)},
        {
            "time": Channel("time", ride.times, "s"),
            "output": Channel("output", list(ride.names)),
            "unit": Channel("output", [output.unit for output in linearise(vehicle, speed).outputs]),
        },
        engine=engine,
        counts={"steps": len(ride.run.positions) - 1},
        seconds=time.process_time() - start_time,
        detail=ride,
        speed=speed,
        step=path.step,
    )
    recorded_rows, watched = ride.rows, watched_vehicle(linearise(vehicle, speed), vehicle, speed)
    motion = MotionInRun(
        watched, ride.run.positions[recorded_rows], ride.run.rates[recorded_rows], road_heights[2 * recorded_rows]
    )
    with_assumptions(labelled, assumptions(scene, vehicle, motion))
    return _with_error_of_steps(labelled, engine, vehicle, path, road_heights, skipped) if estimate_error else labelled


RUNGE_KUTTA_ORDER, STEPS_BETWEEN_ROWS = 4, 16
"""Order of the classical Runge-Kutta method; number of steps between the rows by which its errors are estimated."""
REPEATED_SHARE, FIRST_ROW_SHARE = 0.9, 0.1
"""Share of a run that is repeated in longer steps, and latest beginning of its compared rows as a share of the run."""


def _with_error_of_steps(
    run_result: Result,
    engine: str,
    vehicle: SpatialVehicle,
    road_path: RoadPath,
    road_heights: np.ndarray,
    skipped_time: float,
) -> Result:
    """Returns the result with the errors of its outputs, estimated by runs in longer time steps on the same road."""
    names, units = [str(name) for name in run_result["output"]], run_result["unit"].tolist()
    steps = len(road_heights) // 2
    first = STEPS_BETWEEN_ROWS * int(min(skipped_time / road_path.step, FIRST_ROW_SHARE * steps) / STEPS_BETWEEN_ROWS)

    def series(ride: EngineRide, begin_time: float) -> RunSeries:
        known = ~np.isnan(ride.outputs).any(axis=0)
        return RunSeries(
            begin_time + ride.times, {name: ride.outputs[:, i] for i, name in enumerate(names) if known[i]}
        )

    def rerun(step_factor: float, run_share: float) -> RunSeries:
        longer, stride = (
            replace(road_path, half_step=step_factor * road_path.half_step),
            max(1, round(STEPS_BETWEEN_ROWS / step_factor) if step_factor <= 2.0 else 8),
        )
        count = int(REPEATED_SHARE * run_share * steps / step_factor)
        read = road_heights[:: round(step_factor)] if step_factor >= 1.0 else _road_at_half_spacing(road_heights)
        begin = first * road_path.step
        ride = ride_over_heights(
            engine, vehicle, longer, read[: 2 * count + 1], skipped_time=begin, steps_per_output=stride
        )
        return series(ride, begin)

    outputs = outputs_at_other_steps(
        engine, vehicle, road_path, road_heights, run_result.detail.run, np.arange(first, steps + 1, STEPS_BETWEEN_ROWS)
    )
    fine = series(outputs, first * road_path.step)._replace(units=dict(zip(names, units, strict=True)))
    return with_estimated_errors(run_result, fine, rerun, RUNGE_KUTTA_ORDER, road_path.step)


def _road_at_half_spacing(road_heights: np.ndarray) -> np.ndarray:
    """Returns road heights at half the spacing, interpolated linearly."""
    halved = np.repeat(road_heights, 2, axis=0)[:-1]
    halved[1::2] = (road_heights[:-1] + road_heights[1:]) / 2.0
    return halved


@dataclass(frozen=True)
class EngineRide:
    """A ride in an engine: states at every time step (``run``), and outputs (m, p) at ``times`` (m,) in s from the
    first output on.

    Outputs are linear functions (of ``spatial_linear``) of the engine's positions, rates and accelerations, as is right
    for small motion. The force of a nonlinear spring is not linear in these: it is NaN. ``rows`` (m,) : numbers of the
    steps at which outputs are computed.
    """

    names: tuple[str, ...]
    run: Trajectory
    times: np.ndarray
    outputs: np.ndarray
    rows: np.ndarray

    def output_values(self, output_name: str) -> np.ndarray:
        """Returns the values (m,) of an output, by its name."""
        return self.outputs[:, self.names.index(output_name)]

    @property
    def output_interval(self) -> float:
        """Time (s) between rows of outputs."""
        return float(self.times[1] - self.times[0])

    def densities(self, highest_frequency: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies (f,) in Hz, and one-sided power spectral densities (f, p) of the outputs by Welch's method.

        They end at ``highest_frequency`` (Hz), and begin where windows of 4 s no longer leak.
        """
        from scipy.signal import welch

        f, density = welch(self.outputs, 1 / self.output_interval, nperseg=round(4 / self.output_interval), axis=0)
        shown = (f > 0.4) & (f <= highest_frequency)
        return f[shown], density[shown]


def drive_over_road(
    engine: str,
    vehicle: SpatialVehicle,
    road: RoadPath,
    duration: float,
    *,
    road_seed: int = 0,
    skipped_time: float = 0.0,
    steps_per_output: int = 1,
) -> EngineRide:
    """Simulate a ride in an engine over a random road, from rest for about ``duration`` (s). Outputs begin after
    ``skipped_time`` (s) and are ``steps_per_output`` steps apart.

    Raises InputError for damped tyres on a road whose heights have no rates.
    """
    table = road.wheel_heights_and_rates(int(np.ceil(duration / road.step)), road_seed)
    return ride_over_heights(engine, vehicle, road, table, skipped_time=skipped_time, steps_per_output=steps_per_output)


def ride_over_heights(
    engine: str,
    vehicle: SpatialVehicle,
    road: RoadPath,
    road_heights: np.ndarray,
    *,
    skipped_time: float = 0.0,
    steps_per_output: int = 1,
) -> EngineRide:
    """Simulate a ride in an engine over the road heights in ``road_heights``, otherwise as ``drive_over_road``."""
    check_rates(vehicle, road.excitation)
    steps = len(road_heights) // 2
    model = _engine_model(engine, vehicle, road, road_heights)
    run = model.run()
    recorded_steps = np.arange(int(np.ceil(skipped_time / road.step - 1e-9)), steps + 1, steps_per_output)
    return _outputs_at_steps(model, vehicle, road, road_heights, run, recorded_steps)


def _engine_model(engine: str, vehicle: SpatialVehicle, road: RoadPath, road_heights: np.ndarray) -> SpatialModel:
    settings = Settings(INTEGRATORS[engine], road.step, len(road_heights) // 2 * road.step)
    return build(engine, vehicle, settings, road.speed, road_heights)


def outputs_at_other_steps(
    engine: str,
    vehicle: SpatialVehicle,
    road: RoadPath,
    road_heights: np.ndarray,
    trajectory: Trajectory,
    step_indices: np.ndarray,
) -> EngineRide:
    """Computes the outputs of an engine's run at other steps, ``step_indices`` (m,)."""
    return _outputs_at_steps(
        _engine_model(engine, vehicle, road, road_heights), vehicle, road, road_heights, trajectory, step_indices
    )


def _outputs_at_steps(
    engine_model: SpatialModel,
    vehicle: SpatialVehicle,
    road: RoadPath,
    road_heights: np.ndarray,
    trajectory: Trajectory,
    step_indices: np.ndarray,
) -> EngineRide:
    """Computes the outputs of a run at the steps ``step_indices`` (m,) with a built model."""
    linear = linearise(vehicle, road.speed)
    accelerations = np.array(
        [
            engine_model.acceleration(i * road.step, trajectory.positions[i], trajectory.rates[i], road_heights[2 * i])
            for i in step_indices
        ]
    )
    rows = np.column_stack(
        [
            accelerations,
            trajectory.rates[step_indices],
            trajectory.positions[step_indices],
            road_heights[2 * step_indices],
        ]
    )
    outputs = rows @ np.array([factors_of_output(output) for output in linear.outputs]).T
    bent = {spring.name for spring in vehicle.springs if spring.is_nonlinear}
    pushing = {tyre.name for tyre in vehicle.tyres if tyre.pushes_only}
    for spec, output, values in zip(vehicle.outputs, linear.outputs, outputs.T, strict=True):
        if spec.kind == "force" and spec.part in bent:
            values[:] = np.nan
        elif spec.kind == "tyre force" and spec.tyre in pushing:
            elastic = rows @ factors_of_output(
                replace(
                    output, rate_factors=0.0 * output.rate_factors, road_rate_factors=0.0 * output.road_rate_factors
                )
            )
            load = static_preloads(vehicle).tyres[spec.tyre]
            values[:] = np.maximum(np.minimum(load + values, 2.0 * (load + elastic)), 0.0) - load
    return EngineRide(
        linear.names, trajectory, step_indices * road.step - step_indices[0] * road.step, outputs, step_indices
    )


def factors_of_output(output: LinearOutput) -> np.ndarray:
    """Returns the factors (3 n + 2 w,) of an output: of accelerations, rates, positions, road heights and their rates,
    in this order.
    """
    return np.concatenate(
        [
            output.acceleration_factors,
            output.rate_factors,
            output.displacement_factors,
            output.road_factors,
            output.road_rate_factors,
        ]
    )
