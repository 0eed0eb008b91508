"""How much vehicle and how much road does a question need: error of every output by model and road, beside its cost."""

import csv
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.machine.seconds import cost
from models.ride.covariance import stationary
from models.ride.excited import excited
from models.ride.sweep import Sweep, sweep
from models.systems.ride.of_scene import check_linear, excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import wheels
from models.vehicles.vehicle_file import load_vehicle

SYSTEM = "ride"
Progress = Callable[[str, float], None]
ROADS = {
    "one track": ("equal", "delayed"),
    "two tracks, axles independent": ("modelled", "uncorrelated"),
    "two tracks, delay": ("modelled", "delayed"),
}
"""Roads by how much they know: left and right, front and rear."""
REPEATS = 5
"""Timings of a point, interleaved."""


class Options(Strict):
    """[options] of this study."""

    simpler: list[str] = Field(
        ["quarter_car", "half_car", "seven_freedoms"],
        description="vehicles to compare with the scene's, simplest first",
    )


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Refuse a varying speed and vehicles that share no output with the scene's."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    full = {output.name for output in vehicle_of(scene).outputs}
    for vehicle in (vehicle_of(scene), *_simpler(scene)):
        check_linear(scene, vehicle)
    for i, vehicle in enumerate(_simpler(scene)):
        if not full & {output.name for output in vehicle.outputs}:
            place, name = f"options.simpler.{i}", _options(scene).simpler[i]
            raise InputError(scene.file, place, name, "has no output of the same name as the scene's vehicle")


def run(scene: RideScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Compare; saves ``errors.csv`` and a figure."""
    from studies.ride_figures import detail_figure

    check(scene, engines)
    assert scene.speeds is not None
    full = vehicle_of(scene)
    models = _named([*_simpler(scene), full])
    found = {}
    for i, (name, vehicle) in enumerate(models.items()):
        progress(name, i / len(models))
        found[name] = _swept(scene, vehicle, scene.speeds.all())
    names = [output.name for output in full.outputs]
    truth = list(found.values())[-1].deviation[-1]
    errors = {
        (model, road): _errors(swept, j, truth, names)
        for model, swept in found.items()
        for j, road in enumerate(_roads(models[model]))
    }
    costs = _costs(scene, models)
    _save(errors, names, folder / "errors.csv")
    middle = {name: float(np.median(own)) for name, own in costs.items()}
    detail_figure(errors, names, middle, scene.title, folder / "detail.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": _answer(errors, names),
        "table": _table(errors, names, costs, full),
    }


def _options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _simpler(scene: RideScene) -> list[SpatialVehicle]:
    given = enumerate(_options(scene).simpler)
    return [load_vehicle(name, scene.folder, scene.file, f"options.simpler.{i}") for i, name in given]


def _named(vehicles: list[SpatialVehicle]) -> dict[str, SpatialVehicle]:
    """Models by their number of freedoms, and by their file where two have the same."""
    counts = [len(vehicle.coordinates()) for vehicle in vehicles]
    return {
        f"{n} freedoms" + (f" of {vehicle.name}" if counts.count(n) > 1 else ""): vehicle
        for n, vehicle in zip(counts, vehicles, strict=True)
    }


def _roads(vehicle: SpatialVehicle) -> list[str]:
    """Roads that differ for a vehicle: one without a width knows one track, one without a length no delay."""
    if any(wheel.y for wheel in wheels(vehicle)):
        return list(ROADS)
    return ["one track"]


def _swept(scene: RideScene, vehicle: SpatialVehicle, speeds: np.ndarray) -> Sweep:
    roads = {road: excitation_of(scene, wheels(vehicle), ROADS[road]) for road in _roads(vehicle)}
    return sweep(linear_vehicle(vehicle), roads, list(speeds))


def _errors(found: Sweep, case: int, truth: np.ndarray, names: list[str]) -> np.ndarray:
    """Largest relative error over the speeds (outputs,), nan for an output that the model does not have."""
    out = np.full(len(names), np.nan)
    for i, name in enumerate(names):
        if name in found.outputs:
            own = found.deviation[case, :, found.outputs.index(name)]
            both = np.isfinite(own) & np.isfinite(truth[:, i]) & (truth[:, i] > 0)
            gaps = own[both] / truth[both, i] - 1.0
            out[i] = gaps[np.argmax(np.abs(gaps))] if len(gaps) else np.nan
    return out


def _costs(scene: RideScene, models: dict[str, SpatialVehicle]) -> dict[str, list[float]]:
    """Seconds of one covariance at one speed, of interleaved runs."""
    assert scene.speeds is not None
    speed = float(scene.speeds.all()[0])
    systems = {
        name: excited(linear_vehicle(vehicle)(speed), excitation_of(scene, wheels(vehicle)), speed)
        for name, vehicle in models.items()
    }
    seconds: dict[str, list[float]] = {name: [] for name in systems}
    for _ in range(REPEATS):
        for name, system in systems.items():
            start = time.perf_counter()
            stationary(system)
            seconds[name].append(time.perf_counter() - start)
    return seconds


Errors = dict[tuple[str, str], np.ndarray]


def _save(errors: Errors, names: list[str], path: Path) -> None:
    """A row per output, a column per model and road, relative; empty where a model has no such output."""
    with path.open("x", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["output", *(f"{model}, {road} [-]" for model, road in errors)])
        for name, *row in zip(names, *errors.values(), strict=True):
            writer.writerow([name, *("" if np.isnan(value) else repr(float(value)) for value in row)])


def _answer(errors: Errors, names: list[str]) -> dict[str, Any]:
    return {
        f"{model}, {road}": {
            name: None if np.isnan(value) else float(value) for name, value in zip(names, values, strict=True)
        }
        for (model, road), values in errors.items()
    }


def _table(errors: Errors, names: list[str], costs: dict[str, list[float]], full: SpatialVehicle) -> list[str]:
    """The largest error of each model and road, by kind of output."""
    kinds = {output.name: output.kind for output in full.outputs}
    shown = list(dict.fromkeys(kinds.values()))
    width = max(len(f"{model}, {road}") for model, road in errors) + 2
    lines = [
        "  largest error of a standard deviation over all speeds, against the full vehicle on two tracks with delay",
        f"    {'':<{width}}{'cost, median and range':>30}" + "".join(f"{kind:>22}" for kind in shown),
    ]
    for (model, road), values in errors.items():
        worst = []
        for kind in shown:
            own = [value for name, value in zip(names, values, strict=True) if kinds[name] == kind]
            own = [value for value in own if np.isfinite(value)]
            worst.append(f"{100 * max(own, key=abs):+.1f} %" if own else "-")
        columns = "".join(f"{w:>22}" for w in worst)
        lines.append(f"    {f'{model}, {road}':<{width}}{cost(costs[model]):>30}{columns}")
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("ride_detail")
