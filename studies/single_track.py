"""A car of two axles along a measured drive: what its sensors would show, beside what they did where a file says it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Result
from models.systems.single_track.run import run as run_scene
from models.systems.single_track.scene import SingleTrackScene

SYSTEM = "single-track"
Progress = Callable[[str, float], None]
SHOWN_CHANNELS = {"yaw rate": "rad/s", "lateral acceleration": "m/s²", "side slip": "rad"}


def run(scene: SingleTrackScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Drive it: saves drive.nc and drive.png."""
    progress("the drive", 0.0)
    driven = run_scene(scene, error=scene.error)
    driven.save(folder / "drive.nc")
    figure(driven, scene.title, folder / "drive.png")
    answer = {
        f"rms of {name} [{unit}]": float(np.sqrt(np.mean(driven[name] ** 2))) for name, unit in SHOWN_CHANNELS.items()
    }
    answer |= {f"largest slip angle {axle} [rad]": float(np.abs(driven[f"slip angle {axle}"]).max()) for axle in AXLES}
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": answer,
        "results": {"drive": driven},
        "table": [f"    {name:<36}{value:>12.4g}" for name, value in answer.items()],
    }


AXLES = ("front", "rear")


def figure(driven: Result, title: str, path: Path) -> Path:
    """Steer, the three channels over time, and the side force of each axle by its load over its slip angle."""
    from models.drawing.figures import BLUE, DARK, VERMILION, heading, legend_below, panels, save

    drawing, axes = panels(5, 2, 2.15)
    curves = {"wheels steer": "rad", **SHOWN_CHANNELS}
    for axis, (name, unit) in zip(axes, curves.items(), strict=False):
        axis.plot(driven.times, driven[name], color=DARK, linewidth=0.8)
        axis.set(ylabel=f"{name} [{unit}]", title=name, xlabel="time [s]")
    for axle, colour in zip(AXLES, (BLUE, VERMILION), strict=True):
        used = driven[f"side force {axle}"] / driven[f"load {axle}"]
        axes[4].plot(driven[f"slip angle {axle}"], used, ".", color=colour, markersize=1.5, label=axle)
    axes[4].set(xlabel="slip angle [rad]", ylabel="side force by load [-]", title="Axles")
    legend_below(drawing, axes[4])
    heading(drawing, title, {"drive": driven})
    return save(drawing, path)


if __name__ == "__main__":
    from studies.command_line import study

    study("single_track")
