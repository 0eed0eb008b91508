"""Figures of a wheelset on straight track: eigenvalues over speed, paths, creep forces and their power."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from models.rail import wheel_forces as wf
from models.rail.equations import Path as Motion
from models.rail.equations import Y
from models.rail.linear import klingel
from models.rail.wheelset import Wheelset
from studies.figures import COLOURS, LABELS, plt, save

MARKS = {"reference": "-", "exudyn": "x", "mujoco": "+"}
"""The reference as a line, both engines as marks upon it."""
SHOWN = 1.0
"""Seconds of creep forces that are drawn, the last ones."""


def stability_figure(linear: Mapping[str, Any], wheelset: Wheelset, title: str, path: Path) -> None:
    """Growth and wavelength of the hunting motion over the speed, and the root locus of its eigenvalue."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4.2))
    for engine, one in linear.items():
        style, hunting = {"color": COLOURS[engine], "label": LABELS[engine]}, one.hunting
        left.plot(one.speeds, one.values.real.max(axis=1), MARKS[engine], **style)
        middle.plot(one.speeds, 2.0 * np.pi * one.speeds / hunting.imag, MARKS[engine], **style)
        right.plot(hunting.real, hunting.imag / (2.0 * np.pi), MARKS[engine], **style)
    first = next(iter(linear.values()))
    left.axhline(0.0, color="0.6", linewidth=0.8)
    if first.critical is not None:
        left.axvline(first.critical, color="0.6", linestyle=":")
        left.annotate(f"{first.critical:.4g} m/s", (first.critical, 0.0), (-4, 8), textcoords="offset points",
                      ha="right")  # fmt: skip
    middle.axhline(klingel(wheelset), color="0.6", linestyle=":")
    middle.annotate("Klingel's, without suspension", (first.speeds[-1], klingel(wheelset)), (0, -12),
                    textcoords="offset points", ha="right")  # fmt: skip
    right.axvline(0.0, color="0.6", linewidth=0.8)
    for i in np.unique(np.linspace(0, len(first.speeds) - 1, 6).astype(int)):
        at = first.hunting[i]
        if np.isfinite(at):
            right.annotate(f"{first.speeds[i]:g} m/s", (at.real, at.imag / (2.0 * np.pi)), (-6, 0),
                           textcoords="offset points", ha="right", va="center", fontsize=8)  # fmt: skip
    left.set(xlabel="speed [m/s]", ylabel="largest real part [1/s]", title="Growth of the least stable motion")
    middle.set(xlabel="speed [m/s]", ylabel="wavelength [m]", title="Wavelength of hunting")
    right.set(xlabel="real part [1/s]", ylabel="frequency [Hz]", title="Root locus of hunting over the speed")
    right.margins(x=0.2)
    middle.margins(y=0.2)
    left.legend()
    figure.suptitle(f"{title}\nlinear creep, all motions of the wheelset", fontsize=11)
    save(figure, path)


def paths_figure(paths: Mapping[str, Mapping[float, Motion]], title: str, path: Path) -> None:
    """Lateral displacement over time, a panel per speed; below, how far the engines are from the first one."""
    name, first = next(iter(paths.items()))
    figure, axes = plt.subplots(2, len(first), figsize=(6.2 * len(first), 5.6), squeeze=False, sharex="col",
                                height_ratios=(2, 1))  # fmt: skip
    for k, (speed, own) in enumerate(first.items()):
        top, below = axes[:, k]
        for engine, other in paths.items():
            every = slice(None) if engine == name else slice(40 * (1 + list(paths).index(engine)), None, 150)
            mark = "-" if engine == name else MARKS[engine]
            top.plot(own.times[every], 1e3 * other[speed].states[every, Y], mark, color=COLOURS[engine],
                     label=LABELS[engine])  # fmt: skip
            if engine != name:
                gap = np.abs(other[speed].states - own.states).max(axis=1)
                below.semilogy(own.times, np.maximum(gap, 1e-17), color=COLOURS[engine], linewidth=0.7,
                               label=f"{LABELS[engine]} from {LABELS[name]}")  # fmt: skip
        top.set(ylabel="lateral displacement [mm]", title=f"{speed:g} m/s")
        below.set(xlabel="time [s]", ylabel="largest difference\nof a state [SI]")
    axes[0, 0].legend(loc="upper right", ncols=3)
    if len(paths) > 1:
        axes[1, 0].legend(loc="lower right", ncols=2)
    figure.suptitle(f"{title}: the same path in every implementation", fontsize=11)
    save(figure, path)


def creep_figure(paths: Mapping[float, Motion], title: str, path: Path) -> None:
    """Creep forces on each wheel and their power in the last second of every path."""
    figure, axes = plt.subplots(3, len(paths), figsize=(6.2 * len(paths), 7.0), squeeze=False, sharex="col")
    for k, (speed, own) in enumerate(paths.items()):
        last = own.times >= own.times[-1] - SHOWN
        times, contacts = own.times[last], own.contacts[last]
        each = contacts.shape[1] // 2
        for wheel, (side, colour) in enumerate((("right wheel", "#0072b2"), ("left wheel", "#d55e00"))):
            of = contacts[:, wheel * each : (wheel + 1) * each].sum(axis=1)
            for axis, column in zip(axes[:, k], (wf.FX, wf.FY, wf.POWER), strict=True):
                axis.plot(times, of[:, column], color=colour, label=side)
        axes[0, k].set(ylabel="along the track [N]", title=f"{speed:g} m/s")
        axes[1, k].set(ylabel="across [N]")
        axes[2, k].set(ylabel="power [W]", xlabel="time [s]")
        axes[2, k].axhline(0.0, color="0.6", linewidth=0.8)
    axes[0, 0].legend(loc="upper right", ncols=2)
    largest = max(float(own.contacts[:, :, wf.POWER].max()) for own in paths.values())
    figure.suptitle(f"{title}\ncreep forces on the wheels and their power, at any time {largest:.3g} W or less",
                    fontsize=11)  # fmt: skip
    save(figure, path)
