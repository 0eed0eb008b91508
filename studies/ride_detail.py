"""Necessary detail of vehicle and road model: error of every output by vehicle and road model, and computing time."""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.strict import Strict, read
from models.core.told import derived_result
from models.core.whole_files import write_whole
from models.machine.seconds import seconds_text
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.systems import run as run_scene
from models.systems.ride.of_scene import check_linear, excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.readings import largest_deviation_errors
from models.systems.ride.run import SweepPoints
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import wheels
from models.vehicles.vehicle_file import load_vehicle

SYSTEM = "ride"
ReportProgress = Callable[[str, float], None]
ROADS_BY_KNOWLEDGE = {
    "one track": ("equal", "delayed"),
    "two tracks, axles independent": ("modelled", "uncorrelated"),
    "two tracks, delay": ("modelled", "delayed"),
}
"""Road models by name, from the simplest: correlation of left and right, and of front and rear."""
TIMING_REPEATS = 5
"""Number of interleaved timings of each vehicle."""
ErrorsByModel = dict[tuple[str, str], np.ndarray]
"""For each (vehicle model, road model), the largest relative error of every output (outputs,)."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    simpler: list[str] = Field(
        ["quarter_car", "half_car", "seven_freedoms"],
        description="vehicles to compare with the scene's, simplest first",
    )


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a varying speed, and for vehicles that have no output in common with the scene's."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    full, simpler = vehicle_of(scene), _simpler_vehicles(scene)
    for vehicle in (full, *simpler):
        check_linear(scene, vehicle)
    names = {output.name for output in full.outputs}
    for i, vehicle in enumerate(simpler):
        if not names & {output.name for output in vehicle.outputs}:
            key_path, name = f"options.simpler.{i}", _study_options(scene).simpler[i]
            raise InputError(scene.file, key_path, name, "has no output of the same name as the scene's vehicle")


def run(
    scene: RideScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compare vehicle and road models with the scene's; saves ``errors.nc`` and ``.csv``, and a figure; returns the
    summary."""
    from studies.ride_figures import FigureHeading, model_error_figure

    check(scene, engines)
    full, plain = vehicle_of(scene), scene.model_copy(update={"weighting": {}})
    models, results = _vehicles_by_name([*_simpler_vehicles(scene), full]), dict[str, Result]()
    for i, (name, vehicle) in enumerate(models.items()):
        report_progress(name, i / len(models))
        roads = {road: ROADS_BY_KNOWLEDGE[road] for road in _road_names(vehicle)}
        points = SweepPoints(correlations=roads)
        results[name] = run_scene(plain, "reference", vehicle=vehicle, points=points, error=scene.error)
    sweeps = {name: run.detail for name, run in results.items()}
    names = [output.name for output in full.outputs]
    truth = list(sweeps.values())[-1].deviation[-1]
    errors = {
        (model, road): largest_deviation_errors(sweep, i, truth, names)
        for model, sweep in sweeps.items()
        for i, road in enumerate(sweep.cases)
    }
    costs = _computing_times(scene, models)
    _save_errors(scene, errors, names, results, output_folder)
    middle = {name: float(np.median(seconds)) for name, seconds in costs.items()}
    model_error_figure(errors, names, middle, FigureHeading(scene.title, results), output_folder / "detail.png")
    answer = {
        f"{model}, {road}": {
            name: None if np.isnan(value) else float(value) for name, value in zip(names, values, strict=True)
        }
        for (model, road), values in errors.items()
    }
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": results,
        "answer": answer,
        "table": _table_lines(errors, costs, full),
    }


def _study_options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _simpler_vehicles(scene: RideScene) -> list[SpatialVehicle]:
    """The simpler vehicles that the options name, read from their files."""
    names = enumerate(_study_options(scene).simpler)
    return [load_vehicle(name, scene.folder, scene.file, f"options.simpler.{i}") for i, name in names]


def _vehicles_by_name(simpler_vehicles: list[SpatialVehicle]) -> dict[str, SpatialVehicle]:
    """Vehicles by names such as "7 freedoms"; the file's name is added if several vehicles have the same number of
    freedoms."""
    counts = [len(vehicle.coordinates()) for vehicle in simpler_vehicles]
    return {
        f"{n} freedoms" + (f" of {vehicle.name}" if counts.count(n) > 1 else ""): vehicle
        for n, vehicle in zip(counts, simpler_vehicles, strict=True)
    }


def _road_names(vehicle: SpatialVehicle) -> list[str]:
    """Names of the road models that differ for a vehicle: all, or only "one track" if all wheels are in the middle."""
    return list(ROADS_BY_KNOWLEDGE) if any(wheel.y for wheel in wheels(vehicle)) else ["one track"]


def _computing_times(scene: RideScene, vehicle_models: dict[str, SpatialVehicle]) -> dict[str, list[float]]:
    """Computing times (s) of the covariance at one speed, TIMING_REPEATS for each vehicle, in turns."""
    assert scene.speeds is not None
    speed = float(scene.speeds.all()[0])
    systems = {
        name: vehicle_with_road(linear_vehicle(vehicle)(speed), excitation_of(scene, wheels(vehicle)), speed)
        for name, vehicle in vehicle_models.items()
    }
    seconds: dict[str, list[float]] = {name: [] for name in systems}
    for _ in range(TIMING_REPEATS):
        for name, system in systems.items():
            start = time.perf_counter()
            stationary_covariance(system)
            seconds[name].append(time.perf_counter() - start)
    return seconds


def _save_errors(
    scene: RideScene,
    relative_errors: ErrorsByModel,
    output_names: list[str],
    deviation_results: Mapping[str, Result],
    output_folder: Path,
) -> None:
    """Save relative errors: a row per output, a column per vehicle and road model; empty if a vehicle lacks the
    output."""
    heads = [f"{model}, {road}" for model, road in relative_errors]
    saved = result(
        scene,
        {
            "error": Channel(
                ("output", "model"), np.array([*relative_errors.values()]).T, "1", "relative, largest over speeds"
            )
        },
        {"output": Channel("output", output_names), "model": Channel("model", heads)},
        engine="reference",
    )
    derived_result(saved, deviation_results, "the deviations of which they are ratios").save(
        output_folder / "errors.nc"
    )
    table = saved.data["error"].to_pandas().rename(columns=lambda head: f"{head} [-]")
    write_whole(output_folder / "errors.csv", table.to_csv())


def _table_lines(
    relative_errors: ErrorsByModel, computing_times: dict[str, list[float]], full_vehicle: SpatialVehicle
) -> list[str]:
    """Lines for the screen: the largest error of each vehicle model on each road model, with a column per kind of
    output."""
    kinds = np.array([output.kind for output in full_vehicle.outputs])
    shown = list(dict.fromkeys(kinds.tolist()))
    width = max(len(f"{model}, {road}") for model, road in relative_errors) + 2
    lines = [
        "  largest error of a standard deviation over all speeds, against the full vehicle on two tracks with delay",
        f"    {'':<{width}}{'cost, median and range':>30}" + "".join(f"{kind:>22}" for kind in shown),
    ]
    for (model, road), values in relative_errors.items():
        of_kinds = [values[(kinds == kind) & np.isfinite(values)] for kind in shown]
        worst = [f"{100 * max(of_kind, key=abs):+.1f} %" if len(of_kind) else "-" for of_kind in of_kinds]
        columns = "".join(f"{text:>22}" for text in worst)
        lines.append(f"    {f'{model}, {road}':<{width}}{seconds_text(computing_times[model]):>30}{columns}")
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ride_detail")
