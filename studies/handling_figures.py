"""Figure of a manoeuvre: path, motion, steering, slip angles, wheel loads, and tyre forces in the friction circle."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from models.core.told import Results
from models.drawing.figures import BLUE, DARK, GREEN, ORANGE, SKY, VERMILION, add_heading, legend_below, panels, save
from models.systems.handling.run import SimulatedDrive

TYRE_COLOURS, TYRE_LINES = (BLUE, SKY, VERMILION, ORANGE), ("-", "--", ":", "-.")
"""Colours of four tyres, and line styles of the first four tyres, the next four (of towed bodies) and so on."""


CORNER_NAMES = {
    "fl": "front left",
    "fr": "front right",
    "rl": "rear left",
    "rr": "rear right",
    "cl": "caravan left",
    "cr": "caravan right",
}
"""Readable names of tyres; other tyres are called by their names in the vehicle file."""


def manoeuvre_figure(runs_by_engine: Results, title: str, figure_path: Path) -> Path:
    """Save a figure of the first run of a manoeuvre: path, channels over time, and friction circle, a colour per
    tyre."""
    drive: SimulatedDrive = next(iter(runs_by_engine.values())).detail
    figure, axes = panels(8, 2, 2.15)
    over_time, (path_axis, circle_axis) = [axes[i] for i in (1, 2, 3, 4, 5, 6)], (axes[0], axes[7])
    steer, turning, across, slips, loads, moments = over_time
    _plot_path(path_axis, drive)
    for axis, values, label, name in (
        (steer, np.degrees(drive["steer"][:, :1]), "steer angle [deg]", "Steering of the first tyre"),
        (turning, drive.velocity()[:, 2:3], "yaw rate [rad/s]", "Turning"),
        (across, drive.lateral_acceleration()[:, None], "lateral acceleration [m/s²]", "Acceleration to the side"),
    ):
        axis.plot(drive.run.times, values, color=DARK)
        axis.set(ylabel=label, title=name)
    for axis, values, label, name in (
        (slips, np.degrees(drive.slip_angles()), "slip angle [deg]", "Slip angles"),
        (loads, drive["load"] / 1e3, "load [kN]", "Wheel loads"),
        (moments, drive["mz"], "moment [N m]", "Aligning moments"),
    ):
        for i, tyre in enumerate(drive.handling.vehicle.tyres):
            axis.plot(drive.run.times, values[:, i], label=CORNER_NAMES.get(tyre.name, tyre.name), **_tyre_style(i))
        axis.set(ylabel=label, title=name)
    for axis in over_time:
        axis.set_xlabel("time [s]")
    _plot_friction_circle(circle_axis, drive)
    legend_below(figure, slips)
    start = f"from {drive.velocity()[0, 0]:g} m/s, friction {drive.handling.tyres.friction:g}"
    add_heading(figure, f"{title}: {start}", runs_by_engine)
    return save(figure, figure_path)


def _tyre_style(tyre_number: int) -> dict[str, Any]:
    """Line colour and line style of a tyre by its number."""
    return {"color": TYRE_COLOURS[tyre_number % 4], "linestyle": TYRE_LINES[tyre_number // 4 % 4]}


def _plot_path(axis: Axes, car_drive: SimulatedDrive) -> None:
    x, y, _ = car_drive.path.T
    axis.plot(x, y, color=DARK)
    x, y_few, yaw = car_drive.path[:: max(1, len(x) // 8)].T
    arrows: dict[str, Any] = {"angles": "xy", "scale": 14, "width": 5e-3, "color": GREEN, "zorder": 3}
    axis.quiver(x, y_few, np.cos(yaw), np.sin(yaw), **arrows)
    axis.set(xlabel="x [m]", ylabel="y [m]", title="Path, and where the car points")
    axis.margins(x=0.1)  # arrows are a fourteenth of the panel long
    low, high = y.min(), y.max()
    axis.set_ylim(low - 0.25 * (high - low) - 0.5, high + 0.25 * (high - low) + 0.5)


def _plot_friction_circle(axis: Axes, car_drive: SimulatedDrive) -> None:
    """Plot the horizontal force of each tyre divided by mu N, which lies inside the unit circle."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axis.plot(np.cos(turn), np.sin(turn), color=DARK, lw=0.8)
    bound = np.where(car_drive["load"] > 0.0, car_drive.largest_tyre_forces(), 1.0)
    for i, (side, longitudinal) in enumerate(
        zip((car_drive["fy"] / bound).T, (car_drive["fx"] / bound).T, strict=True)
    ):
        axis.plot(side, longitudinal, **_tyre_style(i), lw=0.9)
    axis.set(
        xlabel="side force / μN [-]",
        ylabel="force ahead / μN [-]",
        aspect="equal",
        title="Tyre forces in the friction circle",
    )
