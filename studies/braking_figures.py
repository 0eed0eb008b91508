"""Figures of a braking stop: speeds, slips, pressures and torques over time, and the path on the road's surfaces."""

from pathlib import Path as File
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from models.brake.plane_chain import ChainPoint, chain_point_position
from models.brake.plane_vehicle import PlaneVehicle
from models.core.told import Results
from models.drawing.figures import (
    BLUE,
    COLUMN_WIDTH,
    DARK,
    GREEN,
    ORANGE,
    PINK,
    SKY,
    SMALL_TEXT,
    VERMILION,
    add_heading,
    save,
    subplot_mosaic,
)
from models.systems.braking.measured_pressures import MeasuredPressures
from models.systems.braking.of_scene import plane_of, surfaces_of_stretch, vehicle_of
from models.systems.braking.plan import controller_text
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import SLOWEST_SLIP_SPEED, StopHistory, wheel_names

WHEEL_COLOURS = (BLUE, SKY, VERMILION, ORANGE, GREEN, "#66c2a5", PINK, "#e7b5d1")
GROUND_COLOURS = {"dry": "#9a9a9a", "wet": "#7f9bb3", "snow": "#eceff1", "ice": "#cfe8f3"}
OTHER_SURFACE_COLOUR = "#e8dcc8"
"""Colour of a road surface that the user defined."""
OUTLINE_OVERHANG, HALF_WIDTH = 1.2, 1.1
"""Length (m) of a vehicle's drawn outline beyond its axles, which is chosen, and half of its width (m)."""


def stop_figure(
    scene: BrakingScene,
    procedure_name: str,
    results_by_engine: Results,
    figure_path: File,
    measured_pressures: MeasuredPressures | None = None,
) -> File:
    """Save a figure of the first engine's stop: speeds, slips, pressures and torques over time, and the path from
    above. Lateral motion is added if there is any; body roll and pitch and wheel loads if the vehicle has a
    suspension."""
    procedure, stop = scene.procedures[procedure_name], StopHistory(next(iter(results_by_engine.values())).detail)
    leaves_straight, lean = _moves_laterally(stop), stop.lean
    rows: list[Any] = [["speeds", "slips"], ["pressures", "torques"]]
    rows += ([["angles", "across"]] if leaves_straight else []) + ([["lean", "loads"]] if lean is not None else [])
    figure, axes = subplot_mosaic([*rows, ["road", "road"]], figsize=(COLUMN_WIDTH, 2.3 * (len(rows) + 1) + 0.4))
    _plot_speeds(axes["speeds"], stop, stop.path.turning * plane_of(scene).radius, measured_pressures)
    slips = np.where(stop.speed[:-1, None] > SLOWEST_SLIP_SPEED, stop.path.reports.slip, np.nan)
    _plot_wheel_curves(axes["slips"], stop.times[1:], slips, "Slip of each wheel (above 1 m/s)", "slip [-]")
    _plot_wheel_curves(axes["pressures"], stop.times, stop.path.pressures, "Pressure in each chamber", "pressure [bar]")
    _plot_wheel_curves(axes["torques"], stop.times, stop.path.torques / 1e3, "Torque of each brake", "torque [kN m]")
    if leaves_straight:
        _plot_angles(axes["angles"], stop)
        axes["across"].plot(stop.times[1:], stop.lateral_acceleration, color=DARK, lw=0.8)
        axes["across"].set(xlabel="time [s]", ylabel="acceleration [m/s²]", title="Lateral acceleration")
    if lean is not None:
        _plot_roll_and_pitch(axes["lean"], stop.times, lean)
        _plot_wheel_curves(
            axes["loads"], stop.times[1:], stop.path.reports.load / 1e3, "Load of each wheel", "load [kN]"
        )
    draw_path_from_above(axes["road"], scene, procedure_name, stop)
    handles, labels = axes["speeds"].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    distance, time = stop.vehicle_results()["stopping distance [m]"], stop.times[-1]
    distance_text, time_text = f"{distance:.2f}\N{NO-BREAK SPACE}m", f"{time:.2f}\N{NO-BREAK SPACE}s"
    ended = (
        f"stands after {distance_text} and {time_text}" if stop.path.ended_at_rest else f"still moves at {time_text}"
    )
    controller = controller_text(scene).replace("{procedure}", procedure_name)
    add_heading(
        figure,
        f"{scene.title}: {readable_name(procedure_name)} from {procedure.speed:g} m/s, "
        f"{READER_SPELLINGS.get(controller, controller)}; {ended}",
        results_by_engine,
    )
    return save(figure, figure_path)


READER_SPELLINGS = {
    "j_turn": "J-turn",
    "slip_bang_bang": "slip bang-bang",
    "acceleration_phases": "acceleration phases",
    "slip_pi": "slip PI",
}
"""Spellings of procedures and controllers for readers."""


def readable_name(raw_name: str) -> str:
    """Name of a procedure or controller for titles and labels, in its usual spelling or with spaces."""
    return READER_SPELLINGS.get(raw_name, raw_name.replace("_", " "))


LATERAL_MOTION_LIMIT = 0.05
"""Angle (degrees) and lateral acceleration (m/s^2) up to which a stop is straight and lateral motion is not drawn."""


def _moves_laterally(stop: StopHistory) -> bool:
    """Whether yaw, side slip or lateral acceleration during the stop is large enough to be drawn."""
    moving = stop.speed > SLOWEST_SLIP_SPEED
    sideways = np.degrees(stop.path.states[:, 0, 2]), np.degrees(stop.side_slip[moving]), stop.lateral_acceleration
    return any(np.abs(values).max(initial=0.0) > LATERAL_MOTION_LIMIT for values in sideways)


def _plot_speeds(
    axis: Axes, stop: StopHistory, rim_speeds: np.ndarray, measured_pressures: MeasuredPressures | None
) -> None:
    for i, (name, values) in enumerate(zip(wheel_names(rim_speeds.shape[1]), rim_speeds.T, strict=True)):
        axis.plot(stop.times, values, color=WHEEL_COLOURS[i], lw=0.8, label=name)
    if measured_pressures is not None and measured_pressures.speeds is not None:
        for i, values in enumerate(measured_pressures.speeds.T):
            axis.plot(
                measured_pressures.times,
                values,
                color=WHEEL_COLOURS[i],
                lw=1.4,
                ls=":",
                label="measured" if i == 0 else None,
            )
    axis.plot(stop.times, stop.speed, color=DARK, lw=1.6, label="vehicle")
    axis.set(xlabel="time [s]", ylabel="speed [m/s]", title="Speed of the vehicle and of each rim")


def _plot_wheel_curves(
    axis: Axes, times: np.ndarray, values_of_wheels: np.ndarray, title: str, axis_label: str
) -> None:
    for i, (name, row) in enumerate(zip(wheel_names(values_of_wheels.shape[1]), values_of_wheels.T, strict=True)):
        axis.plot(times, row, color=WHEEL_COLOURS[i], lw=0.8, label=name)
    axis.set(xlabel="time [s]", ylabel=axis_label, title=title)


def _plot_roll_and_pitch(axis: Axes, times: np.ndarray, roll_and_pitch: np.ndarray) -> None:
    """Plot roll and pitch of the body (n, 2) in rad over times (n,) in s."""
    for values, colour, label in zip(
        np.degrees(roll_and_pitch).T, WHEEL_COLOURS[::2], ("roll, to the right", "pitch, nose down"), strict=False
    ):
        axis.plot(times, values, color=colour, label=label)
    axis.set(xlabel="time [s]", ylabel="angle [deg]", title="Roll and pitch of the body")
    axis.legend(fontsize=SMALL_TEXT)


def _plot_angles(axis: Axes, stop: StopHistory) -> None:
    """Plot the yaw and side-slip angles over time and, for a train, the hitch angle."""
    axis.plot(stop.times, np.degrees(stop.path.states[:, 0, 2]), color=BLUE, label="yaw")
    slip = np.where(stop.speed > SLOWEST_SLIP_SPEED, np.degrees(stop.side_slip), np.nan)
    axis.plot(stop.times, slip, color=VERMILION, label="side slip")
    if (hitch := stop.hitch) is not None:
        axis.plot(stop.times, np.degrees(hitch), color=PINK, label="hitch")
    axis.set(xlabel="time [s]", ylabel="angle [deg]", title="Angles to the direction of travel")
    axis.legend(fontsize=SMALL_TEXT)


def unit_outlines(scene: BrakingScene) -> list[tuple[int, np.ndarray]]:
    """Outlines of a train's units, as the unit's number and corners (m, 2) in m in its axes: of truck, drawbar and
    trailer, or of a vehicle on its suspension and its towed units, with a line to the hitch."""
    truck, trailer = vehicle_of(scene), scene.trailer
    boxes = [(0, _box_outline(truck.front.x, truck.rear.x))]
    if trailer is not None:
        boxes += [
            (1, np.array([[trailer.drawbar, 0.0], [0.0, 0.0]])),
            (2, _box_outline(trailer.front.x, trailer.rear.x)),
        ]
    if scene.vehicle.file is not None:
        plane = plane_of(scene)
        for k in range(1, plane.masses.size):
            axles = plane.place[plane.unit == k, 0]
            line = np.array([[-plane.arm_lengths[k, k], 0.0], [float(axles.max()) + OUTLINE_OVERHANG, 0.0]])
            boxes += [(k, line), (k, _box_outline(float(axles.max()), float(axles.min())))]
    return boxes


def positions_on_road(
    unit_number: int, corners: np.ndarray, positions: np.ndarray, plane_vehicle: PlaneVehicle
) -> np.ndarray:
    """Positions (m, 2) on the road, in m, of points (m, 2) fixed to a unit of a train. positions (2 + U,) : x, y (m) of
    the vehicle and the yaw angles (rad) of its U units."""
    return np.array(
        [chain_point_position(ChainPoint(unit_number, x, y), positions, plane_vehicle.arm_lengths) for x, y in corners]
    )


def _box_outline(front_position: float, rear_position: float) -> np.ndarray:
    front_end, behind = front_position + OUTLINE_OVERHANG, rear_position - OUTLINE_OVERHANG
    return np.array(
        [
            [front_end, HALF_WIDTH],
            [front_end, -HALF_WIDTH],
            [behind, -HALF_WIDTH],
            [behind, HALF_WIDTH],
            [front_end, HALF_WIDTH],
        ]
    )


def draw_path_from_above(axis: Axes, scene: BrakingScene, procedure_name: str, stop: StopHistory) -> None:
    """Draw the path from above on the road's surfaces, with the vehicle's outline at a few times."""
    x, y = stop.path.states[:, 0, :2].T
    low, high = min(y.min(), 0.0) - 4.0, max(y.max(), 0.0) + 4.0
    plane, drawn = plane_of(scene), unit_outlines(scene)
    behind_it = -float(plane.arm_lengths[-1, :-1].sum())
    first, largest_x = x.min() - 6.0 - behind_it, x.max() + 6.0
    lacking = (
        max(0.2 * (largest_x - first) - (high - low), 0.0) / 2.0
    )  # one scale both ways, in an axis of the usual shape
    low, high = low - lacking, high + lacking
    surfaces_named = set[str]()
    starts = [first] + [s.x for s in scene.road.stretches[1:]] + [largest_x]
    for stretch, begin, end in zip(scene.road.stretches, starts[:-1], starts[1:], strict=True):
        left, right = surfaces_of_stretch(scene.procedures[procedure_name], stretch)
        for surface, bottom, top in ((left, scene.road.line, high), (right, low, scene.road.line)):
            axis.fill_between(
                [max(begin, first), min(end, largest_x)],
                bottom,
                top,
                color=GROUND_COLOURS.get(surface, OTHER_SURFACE_COLOUR),
                lw=0,
                label=None if surface in surfaces_named else surface,
            )
            surfaces_named.add(surface)
    axis.plot(x, y, color=DARK, label="centre of mass")
    units = stop.units
    for i in np.searchsorted(
        stop.distance_travelled, np.linspace(0.0, stop.distance_travelled[-1], 6 - len(drawn) // 2)
    ).clip(0, len(x) - 1):
        for unit, corners in drawn:
            axis.plot(*positions_on_road(unit, corners, units[i], plane).T, color=DARK, lw=0.7)
    axis.set(
        xlabel="x [m]",
        ylabel="y [m]",
        title="Path on the road, from above",
        xlim=(first, largest_x),
        ylim=(low, high),
        aspect="equal",
    )
    axis.grid(False)
    axis.legend(fontsize=SMALL_TEXT, loc="upper left", ncols=4, frameon=True, facecolor="white", framealpha=1.0)
