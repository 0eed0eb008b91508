"""The paper's example of ten minutes of noisy gyro rates: its parameters, table and figure, and a recording's
figure."""

import math

import numpy as np

from models.sensors.inertial_unit import angle_random_walk_of
from validation.common.rows import Drawn, Saved, Table

TEN_MINUTES, SAMPLING_RATE, RATE_DEVIATION = 600.0, 1000.0, 0.1
"""Duration (s), sampling rate (Hz) and standard deviation (rad/s) of each rate sample in the paper's example."""


def tables(case_data: Saved) -> list[Table]:
    """Table of the rms angle errors over time in the ten-minute example; none where it was not measured."""
    if not case_data["ten minutes"]:
        return []
    rms, walk = case_data["ten minutes"]["rms"], math.degrees(angle_random_walk_of(RATE_DEVIATION, SAMPLING_RATE))
    rows = tuple((f"{t}", f"{rms[t]:.2f}", f"{walk * t**0.5:.2f}") for t in (1, 10, 60, 300, 600))
    note = (
        f"0.1 rad/s on each sample of 1 kHz, {case_data['ten minutes']['count']} paths; samples are held "
        "(Stratonovich)."
    )
    return [Table("The ten-minute example", note, ("time [s]", "rms angle per axis [deg]", "s sqrt(t) [deg]"), rows)]


def draw(case_data: Saved) -> Drawn:
    """Figures of the attitude errors as in the paper's Figure 2, and of a recorded minute in a real car, where they
    were measured."""
    from models.drawing.figures import BLUE, COLUMN_WIDTH, add_heading, subplots

    figures = []
    if case_data["ten minutes"]:
        figure, axes = subplots(1, 3, figsize=(COLUMN_WIDTH, 3.0), sharey=True)
        paths, walk = (
            np.array(case_data["ten minutes"]["paths"]),
            math.degrees(angle_random_walk_of(RATE_DEVIATION, SAMPLING_RATE)),
        )
        seconds = np.arange(paths.shape[1])
        for i, axis in enumerate(axes):
            axis.plot(seconds, paths[:, :, i].T, color=BLUE, linewidth=0.6)
            for sign in (1, -1):
                axis.plot(
                    seconds, sign * walk * seconds**0.5, color="black", linestyle=":", label="s sqrt(t)" * (sign > 0)
                )
            axis.set(title=f"about global {'xyz'[i]} [deg]", xlabel="time [s]")
        axes[0].legend(loc="upper left")
        add_heading(figure, "Error of the attitude from noisy rates, 8 paths: 0.1 rad/s at 1 kHz")
        figures.append(("Error angles of the ten-minute example, as in the paper's Figure 2.", figure))
    if case_data["recording"]:
        figure, axis = subplots(figsize=(6, 3.2))
        axis.plot(0.2 * np.arange(len(case_data["recording"]["off"])), case_data["recording"]["off"])
        axis.set(title="angle between gyro and camera [deg]", xlabel="time [s]")
        add_heading(figure, "A minute in a real car: attitude from the gyro alone")
        figures.append(("Attitude from a telephone's gyro against its camera's pose (comma2k19).", figure))
    return figures
