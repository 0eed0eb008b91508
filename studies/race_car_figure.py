"""Figure of the race car: predicted channels with bands beside measured ones, and errors of simpler vehicles."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.drawing.figures import BLUE, DARK, SKY, VERMILION, add_heading, save, subplots

if TYPE_CHECKING:
    from models.identification.held_out import IdentifiedVehicle

SECONDS_SHOWN = 60.0
"""Length (s) of the shown part of the prediction."""


def draw_race_car_figure(
    full_vehicle: "IdentifiedVehicle",
    identified_vehicles: dict[str, "IdentifiedVehicle"],
    title: str,
    figure_path: Path,
) -> Path:
    """Save a figure of the channels over time with their prediction bands, and of the errors of all vehicles; returns
    its path."""
    problem = full_vehicle.bands.problem
    clock_times = problem.clock.times
    shown = clock_times <= clock_times[0] + SECONDS_SHOWN
    figure, axes = subplots(len(problem.channels) + 1, 1, figsize=(8.0, 9.6))
    for axis, channel, row, half in zip(
        axes, problem.channels, full_vehicle.bands.predicted, full_vehicle.bands.half_width, strict=False
    ):
        low, high = row - half, row + half
        axis.fill_between(
            clock_times[shown], low[shown], high[shown], color=SKY, alpha=0.5, linewidth=0, label="band of 95 %"
        )
        axis.plot(clock_times[shown], row[shown], color=VERMILION, linewidth=0.9, label="predicted")
        axis.plot(clock_times[shown], channel.values[shown], color=DARK, linewidth=0.9, label="measured")
        unit = channel.unit.replace("^2", "²")
        axis.set(title=channel.name.capitalize(), ylabel=f"[{unit}]", xlabel="time [s]")
    names = [channel.name for channel in problem.channels]
    vehicles = {"chosen": full_vehicle, **identified_vehicles}
    for i, (name, identified_vehicle) in enumerate(vehicles.items()):
        bar_positions = np.arange(len(names)) + 0.25 * i
        axes[-1].bar(
            bar_positions,
            100.0 * identified_vehicle.bands.relative_error(),
            0.22,
            color=(BLUE, VERMILION, SKY)[i % 3],
            label=name,
        )
    axes[-1].set_xticks(np.arange(len(names)) + 0.25, names)
    axes[-1].set(ylabel="error [% of rms]", title="What simpler vehicles lose")
    axes[-1].legend()
    axes[0].legend(ncols=3)
    add_heading(figure, title, {})
    return save(figure, figure_path)
