"""A single-track car along a measured drive: computed sensor channels, beside the measured ones if there are any."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Result
from models.measured.curve import channel_curve
from models.measured.formats import open_source
from models.systems.single_track.run import run as run_scene
from models.systems.single_track.scene import SingleTrackScene

SYSTEM = "single-track"
ReportProgress = Callable[[str, float], None]
SHOWN_CHANNELS = {"yaw rate": "rad/s", "lateral acceleration": "m/s²", "side slip": "rad"}
PANEL_TITLES = {"wheels steer": "Steer angle of the wheels"}
"""Titles of panels for channels whose names are no titles."""


def run(
    scene: SingleTrackScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run the car along the drive; saves ``drive.nc`` and ``drive.png``, and returns the summary."""
    report_progress("the drive", 0.0)
    driven = run_scene(scene, error=scene.error)
    driven.save(output_folder / "drive.nc")
    drive_figure(driven, measured_channels(scene, driven), scene.title, output_folder / "drive.png")
    answer = {
        f"rms of {name} [{unit}]": float(np.sqrt(np.mean(driven[name] ** 2))) for name, unit in SHOWN_CHANNELS.items()
    }
    answer |= {
        f"largest slip angle {axle} [rad]": float(np.abs(driven[f"slip angle {axle}"]).max()) for axle in AXLE_NAMES
    }
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": answer,
        "results": {"drive": driven},
        "table": [f"    {name:<36}{value:>12.4g}" for name, value in answer.items()],
    }


AXLE_NAMES = ("front", "rear")


def measured_channels(scene: SingleTrackScene, computed_drive: Result) -> dict[str, np.ndarray]:
    """Measured values (n,) of the shown channels that the drive's file contains, by name, at the times and in the units
    of the computed drive."""
    source = open_source(scene.path(scene.drive.file, "drive.file"))
    known = [name for name in SHOWN_CHANNELS if name in {channel.name for channel in source.channels}]
    curves = {name: channel_curve(source, name, computed_drive.data[name].attrs["units"]) for name in known}
    return {name: np.interp(computed_drive.times, *time_and_values) for name, time_and_values in curves.items()}


def drive_figure(
    computed_drive: Result, measured_values: Mapping[str, np.ndarray], title: str, figure_path: Path
) -> Path:
    """Save a figure of the steer angle and three channels over time, of each axle's slip angle over time, and of its
    ratio of side force to load over slip angle.

    measured_values : measured values (n,), drawn beside the computed channels of their names.
    """
    from models.drawing.figures import BLUE, DARK, MEASURED_COLOUR, VERMILION, add_heading, legend_below, panels, save

    drawing, axes = panels(6, 2, 2.15)
    curves = {"wheels steer": "rad", **SHOWN_CHANNELS}
    for axis, (name, unit) in zip(axes, curves.items(), strict=False):
        if name in measured_values:
            axis.plot(
                computed_drive.times, measured_values[name], color=MEASURED_COLOUR, linewidth=2.0, label="measured"
            )
        axis.plot(computed_drive.times, computed_drive[name], color=DARK, linewidth=0.8, label="computed")
        axis.set(ylabel=f"[{unit}]", title=PANEL_TITLES.get(name, name.capitalize()), xlabel="time [s]")
    used = {axle: computed_drive[f"side force {axle}"] / computed_drive[f"load {axle}"] for axle in AXLE_NAMES}
    for axle, colour, size in zip(AXLE_NAMES, (BLUE, VERMILION), (4.0, 1.5), strict=True):
        axes[4].plot(computed_drive[f"slip angle {axle}"], used[axle], ".", color=colour, markersize=size, label=axle)
        axes[5].plot(computed_drive.times, computed_drive[f"slip angle {axle}"], color=colour, linewidth=0.8)
    axes[4].set(xlabel="slip angle [rad]", ylabel="[-]", title="Side force / load of each axle")
    axes[5].set(xlabel="time [s]", ylabel="[rad]", title="Slip angle of each axle")
    axes[4].legend(markerscale=3.0)
    legend_below(drawing, *axes[:4])
    add_heading(drawing, title, {"drive": computed_drive})
    return save(drawing, figure_path)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("single_track")
