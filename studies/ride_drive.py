"""Standard deviations of a vehicle along a drive at varying speed, and the error of the quasi-stationary solution."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.ride.varying_speed import VaryingSpeedDeviations
from models.systems import run as run_scene
from models.systems.ride.of_scene import check_linear, vehicle_of
from models.systems.ride.readings import quasi_stationary_errors
from models.systems.ride.scene import RideScene

SYSTEM = "ride"
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    outputs: list[str] = Field(default_factory=list, description="outputs to draw; accelerations, tyre forces if none")


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for constant speeds, for a vehicle whose matrices change with the speed, and for unknown
    outputs."""
    if scene.drive is None:
        raise InputError(scene.file, "study", scene.study, "runs along a drive; at constant speeds use ride")
    vehicle = vehicle_of(scene)
    check_linear(scene, vehicle)
    if vehicle.side_forces or vehicle.drags:
        allowed = "has side forces or drag, which change with the speed: this study takes matrices that do not"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    names = tuple(output.name for output in vehicle.outputs)
    for i, name in enumerate(_study_options(scene).outputs):
        if name not in names:
            raise InputError(scene.file, f"options.outputs.{i}", name, "is no output of the vehicle", names)


def run(
    scene: RideScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute standard deviations along the drive with the linear vehicle of the first engine; saves ``drive.nc`` and a
    figure, and returns the summary."""
    from studies.ride_figures import FigureHeading, drive_figure

    check(scene, engines)
    vehicle, engine = vehicle_of(scene), engines[0]
    report_progress(f"drive, linear vehicle of {engine}, and each speed by itself", 0.1)
    result = run_scene(scene, engine, error=scene.error)
    result.save(output_folder / "drive.nc")
    drive, quasi_stationary, units = result.detail, result["quasi_stationary"], result["unit"].tolist()
    kinds = {output.name: (output.kind, unit) for output, unit in zip(vehicle.outputs, units, strict=False)}
    shown = [name for name, (kind, _) in kinds.items() if kind in ("acceleration", "tyre force")]
    shown = _study_options(scene).outputs or shown or list(kinds)
    drive_figure(
        drive, quasi_stationary, shown, kinds, FigureHeading(scene.title, {engine: result}), output_folder / "drive.png"
    )
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": {engine: result},
        "answer": _summary_of_drive(drive, quasi_stationary),
        "table": [f"  linear vehicle of {engine}", *_table_lines(drive, quasi_stationary, units)],
    }


def _study_options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _summary_of_drive(varying_speed: VaryingSpeedDeviations, quasi_stationary_deviations: np.ndarray) -> dict[str, Any]:
    gaps = quasi_stationary_errors(varying_speed, quasi_stationary_deviations)
    finite = np.isfinite(varying_speed.deviation).all(axis=0)
    worst = [float(gaps[np.abs(gaps[:, i]).argmax(), i]) if finite[i] else None for i in range(len(finite))]
    return {
        name: {"largest error of the quasi-stationary answer": value}
        for name, value in zip(varying_speed.names, worst, strict=True)
    }


def _table_lines(
    varying_speed: VaryingSpeedDeviations, quasi_stationary_deviations: np.ndarray, units: list[str]
) -> list[str]:
    """Lines for the screen: each output's largest standard deviation along the drive, and the largest error of the
    quasi-stationary solution, which takes each speed as constant."""
    heads = [f"{name} [{unit}]" for name, unit in zip(varying_speed.names, units, strict=True)]
    width = max(map(len, heads))
    lines = [f"    {'':<{width}}{'largest':>12}{'at [s]':>8}   each speed by itself is most wrong, % of the largest"]
    gaps = quasi_stationary_errors(varying_speed, quasi_stationary_deviations)
    for i, name in enumerate(heads):
        deviation = varying_speed.deviation[:, i]
        if not np.isfinite(deviation).all():
            lines.append(f"    {name:<{width}}{varying_speed.status[i]:>12}")
            continue
        top, worst = int(deviation.argmax()), int(np.abs(gaps[:, i]).argmax())
        lines.append(
            f"    {name:<{width}}{deviation[top]:>12.4g}{varying_speed.time[top]:>8.2f}   "
            f"by {100 * gaps[worst, i]:+.1f} % at {varying_speed.time[worst]:.2f} s, "
            f"{varying_speed.speed[worst]:.1f} m/s"
        )
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ride_drive")
