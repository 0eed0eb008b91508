"""How much a vehicle moves while it speeds up, brakes and stands, and how wrong it is to take each speed alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.ride.varying_speed import VaryingSpeed, quasi_stationary, varying_speed
from models.systems.ride.of_scene import check_linear, excitation_of, linear_vehicle, told_by, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial_linear import wheels

SYSTEM = "ride"
Progress = Callable[[str, float], None]
SPEEDS = 90
"""Speeds at which the quasi-stationary answer is computed, from standstill on; straight between them."""
ANY = 1.0
"""m/s: the matrices of vehicles that this study takes are the same at every speed."""


class Options(Strict):
    """[options] of this study."""

    outputs: list[str] = Field(default_factory=list, description="outputs to draw; accelerations, tyre forces if none")


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Refuse constant speeds, which are another study's, a vehicle whose matrices change, unknown outputs."""
    if scene.drive is None:
        raise InputError(scene.file, "study", scene.study, "runs along a drive; at constant speeds use ride")
    vehicle = vehicle_of(scene)
    check_linear(scene, vehicle)
    if vehicle.side_forces or vehicle.drags:
        allowed = "has side forces or drag, which change with the speed: this study takes matrices that do not"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    names = tuple(output.name for output in vehicle.outputs)
    for i, name in enumerate(_options(scene).outputs):
        if name not in names:
            raise InputError(scene.file, f"options.outputs.{i}", name, "is no output of the vehicle", names)


def run(scene: RideScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Follow the drive with the linear vehicle of the first engine; saves ``drive.nc`` and a figure."""
    from studies.ride_figures import drive_figure

    check(scene, engines)
    assert scene.drive is not None
    vehicle, engine = vehicle_of(scene), engines[0]
    progress(f"drive, linear vehicle of {engine}", 0.1)
    linear, road = linear_vehicle(vehicle, engine)(ANY), excitation_of(scene, wheels(vehicle))
    with told_by(scene):
        first = varying_speed(linear, road, scene.drive.profile(scene.file), weightings=scene.weighting)
        progress("each speed by itself", 0.4)
        speeds = np.linspace(0.0, first.speed.max(), SPEEDS)
        each = quasi_stationary(linear, road, speeds, weightings=scene.weighting)
    alone = np.column_stack([np.interp(first.speed, speeds, column) for column in each.T])
    own = _units(scene)
    units = [unit for _, unit in own] + ["m/s^2"] * len(scene.weighting)
    _save(scene, first, alone, units, folder / "drive.nc")
    names = [output.name for output in vehicle.outputs]
    shown = [o.name for o in vehicle.outputs if o.kind in ("acceleration", "tyre force")]
    shown = _options(scene).outputs or shown or names
    drive_figure(first, alone, shown, {o.name: (o.kind, u) for o, u in own}, scene.title, folder / "drive.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": _answer(first, alone),
        "table": [f"  linear vehicle of {engine}", *_table(first, alone, units)],
    }


def _options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _units(scene: RideScene) -> list[tuple[Any, str]]:
    vehicle = vehicle_of(scene)
    linear = linear_vehicle(vehicle)(ANY)
    return [(output, own.unit) for output, own in zip(vehicle.outputs, linear.outputs, strict=True)]


def _save(scene: RideScene, found: VaryingSpeed, alone: np.ndarray, units: list[str], path: Path) -> None:
    import xarray as xr

    from models.core.result import provenance, write

    axes = ("time", "output")
    data = xr.Dataset(
        {
            "deviation": (axes, found.deviation),
            "quasi_stationary": (axes, alone),
            "speed": ("time", found.speed, {"units": "m/s"}),
            "path": ("time", found.path, {"units": "m"}),
        },
        {"time": ("time", found.time, {"units": "s"}), "output": list(found.names)},
    )
    data["unit"] = ("output", units)
    data.attrs = {"title": scene.title, **{key: str(value) for key, value in provenance().items()}}
    write(data, path)


def _gaps(found: VaryingSpeed, alone: np.ndarray) -> np.ndarray:
    """Error (N, p) of the quasi-stationary answer by the largest deviation of the drive; 0 where there is none."""
    both = np.isfinite(alone) & np.isfinite(found.deviation)
    largest = np.where(both, found.deviation, 0.0).max(axis=0)
    gaps = np.where(both, alone, 0.0) - np.where(both, found.deviation, 0.0)
    return gaps / np.where(largest > 0, largest, 1.0)


def _answer(found: VaryingSpeed, alone: np.ndarray) -> dict[str, Any]:
    gaps = _gaps(found, alone)
    finite = np.isfinite(found.deviation).all(axis=0)
    worst = [float(gaps[np.abs(gaps[:, i]).argmax(), i]) if finite[i] else None for i in range(len(finite))]
    return {
        name: {"largest error of the quasi-stationary answer": value}
        for name, value in zip(found.names, worst, strict=True)
    }


def _table(found: VaryingSpeed, alone: np.ndarray, units: list[str]) -> list[str]:
    """Largest deviation of each output, and where taking each speed by itself is most wrong."""
    heads = [f"{name} [{unit}]" for name, unit in zip(found.names, units, strict=True)]
    width = max(map(len, heads))
    lines = [f"    {'':<{width}}{'largest':>12}{'at [s]':>8}   each speed by itself is most wrong, % of the largest"]
    gaps = _gaps(found, alone)
    for i, name in enumerate(heads):
        own = found.deviation[:, i]
        if not np.isfinite(own).all():
            lines.append(f"    {name:<{width}}{found.status[i]:>12}")
            continue
        top, worst = int(own.argmax()), int(np.abs(gaps[:, i]).argmax())
        lines.append(
            f"    {name:<{width}}{own[top]:>12.4g}{found.time[top]:>8.2f}   by {100 * gaps[worst, i]:+.1f} % "
            f"at {found.time[worst]:.2f} s, {found.speed[worst]:.1f} m/s"
        )
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("ride_drive")
