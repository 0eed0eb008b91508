"""Figure of a manoeuvre: path, motion, slip angles, wheel loads, and tyre forces in their friction circle."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from models.core.told import Results
from models.drawing.figures import heading, save
from models.systems.handling.run import Drive

TYRES = ("#0072b2", "#56b4e9", "#d55e00", "#e69f00")


def manoeuvre_figure(runs: Results, title: str, path: Path) -> Path:
    """Six panels over time, or over the path, of the first run; one colour for each tyre."""
    drive: Drive = next(iter(runs.values())).detail
    figure, axes = plt.subplots(2, 3, figsize=(13, 7))
    start = f"from {drive.velocity()[0, 0]:g} m/s, friction {drive.handling.tyres.friction:g}"
    heading(figure, f"{title}: {start}", runs)
    _path(axes[0, 0], drive)
    _motion(axes[0, 1], drive)
    for axis, values, label, name in (
        (axes[0, 2], np.degrees(drive.slip_angles()), "slip angle [deg]", "Slip angles"),
        (axes[1, 0], drive["load"] / 1e3, "load [kN]", "Wheel loads"),
        (axes[1, 1], drive["mz"], "moment [N m]", "Aligning moments"),
    ):
        for i, tyre in enumerate(drive.handling.vehicle.tyres):
            axis.plot(drive.run.times, values[:, i], color=TYRES[i % 4], label=tyre.name)
        axis.set(xlabel="time [s]", ylabel=label, title=name)
    axes[0, 2].legend(ncols=2)
    _circle(axes[1, 2], drive)
    return save(figure, path)


def _path(axis: plt.Axes, drive: Drive) -> None:
    x, y, yaw = drive.path.T
    axis.plot(x, y, color="#222222")
    x, y_few, yaw = drive.path[:: max(1, len(x) // 8)].T
    arrows: dict[str, Any] = {"angles": "xy", "scale": 14, "width": 5e-3, "color": "#009e73", "zorder": 3}
    axis.quiver(x, y_few, np.cos(yaw), np.sin(yaw), **arrows)
    axis.set(xlabel="x [m]", ylabel="y [m]", title="Path on the road, and where the car points")
    low, high = y.min(), y.max()
    axis.set_ylim(low - 0.25 * (high - low) - 0.5, high + 0.25 * (high - low) + 0.5)


def _motion(axis: plt.Axes, drive: Drive) -> None:
    time = drive.run.times
    axis.plot(time, drive.velocity()[:, 2], color="#0072b2", label="yaw rate [rad/s]")
    axis.plot(time, drive.lateral_acceleration() / 10.0, color="#d55e00", label="lateral acceleration [10 m/s²]")
    axis.plot(time, drive["steer"][:, 0] * 10.0, color="#222222", ls=":", label="steer angle [0.1 rad]")
    axis.set(xlabel="time [s]", ylabel="see legend", title="Motion of the car")
    axis.legend()


def _circle(axis: plt.Axes, drive: Drive) -> None:
    """Forces of each tyre by mu N: inside of the unit circle."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axis.plot(np.cos(turn), np.sin(turn), color="#222222", lw=0.8)
    bound = np.where(drive["load"] > 0.0, drive.grip(), 1.0)
    for i, (side, ahead) in enumerate(zip((drive["fy"] / bound).T, (drive["fx"] / bound).T, strict=True)):
        axis.plot(side, ahead, color=TYRES[i % 4], lw=0.9)
    axis.set(
        xlabel="side force / mu N",
        ylabel="force ahead / mu N",
        aspect="equal",
        title="Tyre forces in the friction circle",
    )
