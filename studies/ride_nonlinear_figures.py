"""Figures of the study of bent springs on a random road."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from models.drawing.figures import COLOURS, LABELS, plt, save
from models.ride.frequency import spectra
from models.ride.statistical_linearisation import GRADES
from models.road.excitation import Excitation
from models.systems.ride.in_engines import Ride
from models.vehicles.linear_vehicle import LinearVehicle, Output

if TYPE_CHECKING:
    from studies.ride_nonlinear import Answer

MOST = 12
"""Outputs that a figure shows."""


def deviations_figure(answer: "Answer", outputs: Sequence[Output], title: str, path: Path) -> None:
    """Every output over speed: small motion, statistical linearisation, Monte Carlo; open where no longer good."""
    figure, axes = _panels(min(len(outputs), MOST))
    left = answer.of("left_out")
    for i, (axis, output) in enumerate(zip(axes, outputs, strict=False)):
        factor, unit = (1e3, "mm") if output.unit == "m" else (1.0, output.unit.replace("^2", "²"))
        axis.plot(answer.speeds, factor * answer.small[:, i], "--", color="0.6", label="slopes at rest (small motion)")
        axis.plot(
            answer.speeds,
            factor * answer.deviation[:, i],
            color="#0072b2",
            label="statistical linearisation" + (", tyres on the road" if answer.lifts else ""),
        )
        poor = left[:, i] > GRADES[-1][0]
        axis.plot(
            answer.speeds[poor],
            factor * answer.deviation[poor, i],
            "o",
            color="#0072b2",
            fillstyle="none",
            label="no longer good by its own measure",
        )
        for j, (speed, copies) in enumerate(answer.copies.items()):
            spread = copies.error[i] / copies.deviation[i]  # two standard errors of the deviation
            axis.errorbar(
                [speed],
                [factor * copies.deviation[i]],
                [factor * spread],
                fmt="s",
                color="#d55e00",
                markersize=4,
                capsize=3,
                label="" if j else "Monte Carlo, 2 standard errors" + (", tyres lift" if answer.lifts else ""),
            )
        axis.set(
            xlabel="speed [m/s]", ylabel=f"standard deviation [{unit}]", ylim=(0, None), title=output.name.capitalize()
        )
    axes[0].legend(fontsize=7.5)
    figure.suptitle(f"{title}\nStandard deviations over speed", fontsize=11)
    save(figure, path)


def spectra_figure(
    runs: Mapping[str, Ride], linear: LinearVehicle, road: Excitation, speed: float, title: str, path: Path
) -> None:
    """Spectra of the engines' runs, by Welch's method, over those of the replaced vehicle."""
    from scipy.signal import welch

    frequency = np.geomspace(0.3, 40.0, 300)
    own = 4 * np.pi * spectra(linear, road, speed, 2 * np.pi * frequency)
    first = next(iter(runs.values()))
    shown = [i for i in range(len(linear.outputs)) if np.isfinite(first.outputs[:, i]).all()][:MOST]
    figure, axes = _panels(len(shown))
    for axis, i in zip(axes, shown, strict=False):
        for (engine, run), style in zip(runs.items(), (("-", 2.2), ("--", 1.0)), strict=False):
            f, density = welch(run.outputs[:, i], 1 / run.interval, nperseg=round(4 / run.interval))
            keep = (f > 0.4) & (f <= frequency[-1])  # below, leakage of the windows
            axis.loglog(
                f[keep],
                density[keep],
                style[0],
                linewidth=style[1],
                color=COLOURS[engine],
                label=f"{LABELS[engine]}, nonlinear in time",
            )
        axis.loglog(frequency, own[:, i], "k", label="statistical linearisation")
        name, unit, top = linear.outputs[i].name, linear.outputs[i].unit.replace("^2", "²"), own[:, i].max()
        axis.set(
            xlabel="frequency [Hz]",
            ylabel=f"one-sided density [({unit})²/Hz]",
            title=name.capitalize(),
            ylim=(1e-5 * top, 5 * top),
        )
    axes[0].legend(fontsize=7.5)
    figure.suptitle(f"{title}\nSpectra at {speed:g} m/s", fontsize=11)
    save(figure, path)


def _panels(count: int) -> tuple[plt.Figure, list[plt.Axes]]:
    """A figure of this many panels, two or three beside each other."""
    wide = 2 if count in (1, 2, 4) else 3
    figure, axes = plt.subplots(-(-count // wide), wide, figsize=(4.6 * wide, 3.4 * -(-count // wide)), squeeze=False)
    for axis in axes.ravel()[count:]:
        axis.remove()
    return figure, list(axes.ravel()[:count])
