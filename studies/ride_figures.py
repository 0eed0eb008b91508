"""Figures of the ride studies: standard deviations over speed, spectra, roads, and drives."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.core.told import Results
from models.drawing.figures import (
    BLUE,
    COLUMN_WIDTH,
    DARK,
    GREY,
    LABELS,
    PINK,
    SKY,
    SMALL_TEXT,
    VERMILION,
    add_heading,
    legend_below,
    panels,
    save,
    subplots,
    wrapped_text,
)
from models.drawing.figures import COLOURS as ENGINES
from models.ride.frequency import one_sided_densities
from models.ride.statistical_linearisation import ERROR_GRADES
from models.ride.sweep import VarianceSweep
from models.ride.varying_speed import VaryingSpeedDeviations
from models.road.excitation import RoadExcitation
from models.road.fitted import FittedRoad
from models.road.isotropic import isotropic_road_like
from models.road.two_track import TwoTrackRoad
from models.systems.ride.nonlinear import EngineRide, NonlinearRide
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle

CORRELATION_COLOURS = (DARK, BLUE, SKY, VERMILION, PINK)
"""Colours of the cases of road correlation: as in the scene, then two for the axles and two for the tracks."""
CORRELATION_STYLES = ("-", "--", ":", "--", ":")


class FigureHeading(NamedTuple):
    """Title of a figure, and the results whose warnings are printed below it."""

    title: str
    shown_results: Results


def body_acceleration_figure(
    point_positions: Sequence[float],
    sweep_of_points: VarianceSweep,
    speed_sweep: VarianceSweep,
    vehicle: SpatialVehicle,
    speed: float,
    heading: FigureHeading,
    figure_path: Path,
) -> None:
    """Save a figure of the standard deviation of the body's vertical acceleration in each case of road correlation:
    along the body at a speed (m/s), and over speed for the output nearest to the middle of the axles."""
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.0))
    name = _name_of_middle_acceleration(vehicle)
    for i, case in enumerate(sweep_of_points.cases):
        left.plot(
            point_positions,
            sweep_of_points.deviation[i, 0],
            CORRELATION_STYLES[i],
            color=CORRELATION_COLOURS[i],
            label=case,
        )
        if name:
            right.plot(
                speed_sweep.speeds[:-1],
                speed_sweep.of(case, name)[:-1],
                CORRELATION_STYLES[i],
                color=CORRELATION_COLOURS[i],
            )
    for x in vehicle.axles:
        left.axvline(x, color="0.8", zorder=0)
    left.set(xlabel="x forward [m]  (grey: axles)", title=f"Vertical acceleration along the body, {speed:g} m/s")
    right.set(xlabel="speed [m/s]", title=f"At {name!r} over speed" if name else "")
    for axis in (left, right):
        axis.set(ylabel="standard deviation [m/s²]", ylim=(0, None))
        _note_if_no_finite_curve(axis)
    legend_below(figure, left, column_count=2)
    _save_figure(figure, heading, ": which correlations of the road matter where", figure_path)


def _name_of_middle_acceleration(vehicle: SpatialVehicle) -> str:
    """Name of the vertical acceleration output nearest to the middle of the axles, "" if there is none."""
    middle = (vehicle.axles[0] + vehicle.axles[-1]) / 2
    points = [o for o in vehicle.outputs if o.kind == "acceleration" and getattr(o, "axis", None) == (0.0, 0.0, 1.0)]
    heaviest = max(vehicle.bodies, key=lambda body: body.mass).name
    points = [o for o in points if o.body == heaviest] or points
    return min(points, key=lambda o: abs(o.point[0] - middle)).name if points else ""


NO_FINITE_VARIANCE = "\n(no finite variance)"


def outputs_figure(
    speed_sweep: VarianceSweep,
    kind_and_unit: Sequence[tuple[str, str]],
    static_loads: Mapping[str, float],
    heading: FigureHeading,
    figure_path: Path,
) -> None:
    """Save a figure of the outputs' standard deviations over speed on the scene's road, with a panel for each kind and
    unit in ``kind_and_unit``; tyre forces are divided by their ``static_loads`` (N)."""
    groups = list(dict.fromkeys(kind_and_unit))
    figure, axes = panels(len(groups), min(2, len(groups)), 3.4)
    for axis, (kind, si) in zip(axes, groups, strict=True):
        unit, factor = _shown_unit(si)
        axis_label = "deviation / static load [-]" if kind == "tyre force" else f"standard deviation [{unit}]"
        names = [
            name for name, unit_of in zip(speed_sweep.outputs, kind_and_unit, strict=True) if unit_of == (kind, si)
        ]
        curves = {
            name: factor * speed_sweep.of(speed_sweep.cases[0], name)[:-1] / static_loads.get(name, 1.0)
            for name in names
        }
        for label, values in _distinct_curves(curves).items():
            axis.plot(
                speed_sweep.speeds[:-1],
                values,
                label=label if np.isfinite(values).any() else label + NO_FINITE_VARIANCE,
            )
        if not np.isfinite(list(curves.values())).any():
            axis.set(xlim=(0, speed_sweep.speeds.max()), yticks=[])
        axis.set(xlabel="speed [m/s]", ylabel=axis_label, ylim=(0, None), title=kind.capitalize())
        _note_if_no_finite_curve(axis)
        _legend_under_panel(axis)
    _save_figure(figure, heading, ": standard deviations over speed", figure_path)


def _note_if_no_finite_curve(axis: Axes) -> None:
    """Write "no finite variance" into a panel in which no curve is finite, as for forces under white noise."""
    if not any(np.isfinite(line.get_ydata()).any() for line in axis.lines if line.get_transform() == axis.transData):
        axis.text(0.5, 0.5, "no finite variance", transform=axis.transAxes, ha="center")
        axis.set_yticks([])


def _unit_text(unit: str) -> str:
    return unit.replace("^2", "²")


def _squared_unit(unit: str) -> str:
    """Text of the square of a unit, with brackets around a unit of several symbols."""
    return f"{unit}²" if unit.isalpha() else f"({_unit_text(unit)})²"


def _shown_unit(unit: str) -> tuple[str, float]:
    """Unit in which an SI quantity is plotted (mm for m), and the factor that converts SI values to it."""
    return ("mm", 1e3) if unit == "m" else (_unit_text(unit), 1.0)


def _distinct_curves(curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Curves by name; coinciding curves, mostly of left and right, become one curve with both names."""
    groups: list[tuple[list[str], np.ndarray]] = []
    for name, values in curves.items():
        for names, known in groups:
            largest = np.max(known, where=np.isfinite(known), initial=0.0)
            if np.allclose(values, known, rtol=1e-6, atol=1e-6 * largest, equal_nan=True):
                names.append(name)
                break
        else:
            groups.append(([name], values))
    return {"\n= ".join(names): values for names, values in groups}


def spectra_figure(
    linear_vehicle: LinearVehicle, excitation: RoadExcitation, speed: float, heading: FigureHeading, figure_path: Path
) -> None:
    """Save a figure of the one-sided spectral densities of accelerations and tyre forces over frequency at a speed
    (m/s); no figure if all are 0."""
    frequency = np.geomspace(0.1, 100.0, 800)
    densities = one_sided_densities(linear_vehicle, excitation, speed, frequency)
    moving_kinds = {output.kind for i, output in enumerate(linear_vehicle.outputs) if densities[:, i].any()}
    shown = [kind for kind in ("acceleration", "tyre force") if kind in moving_kinds]
    if not shown:
        return
    figure, axes = subplots(1, len(shown), figsize=(COLUMN_WIDTH, 4.2), squeeze=False)
    units = {"acceleration": "(m/s²)²/Hz", "tyre force": "N²/Hz"}
    for axis, kind in zip(axes[0], shown, strict=True):
        curves = {
            output.name: densities[:, i] for i, output in enumerate(linear_vehicle.outputs) if output.kind == kind
        }
        for label, values in _distinct_curves(curves).items():
            axis.loglog(frequency, values, label=label)
        axis.set(xlabel="frequency [Hz]", ylabel=f"one-sided density [{units[kind]}]", title=kind.capitalize())
        top = max(values.max() for values in curves.values())
        axis.set_ylim(1e-6 * top, 2 * top)
        _legend_under_panel(axis)
    _save_figure(figure, heading, f": spectra at {speed:g} m/s", figure_path)


def road_figure(
    road: TwoTrackRoad, half_track: float, fitted_road: FittedRoad | None, heading: FigureHeading, figure_path: Path
) -> None:
    """Save a figure of the spectrum of the left track and the coherency of both tracks: of the road model, measured if
    ``fitted_road`` is given, and of an isotropic road. half_track : half of the track width (m)."""
    wavenumber = np.geomspace(0.02, 100.0, 300)
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.0))
    if fitted_road is not None:
        spectra = fitted_road.spectra
        left.loglog(spectra.wavenumber, spectra.left, color=GREY, linewidth=0.8, label="measured")
        right.semilogx(spectra.wavenumber, spectra.coherency, color=GREY, linewidth=0.8, label="measured")
        right.axhline(spectra.chance_coherency(), color=GREY, linestyle=":", label="what chance alone shows (95 %)")
    left.loglog(wavenumber, road.spectrum(wavenumber, half_track), "k", label="mean and roll process")
    right.semilogx(wavenumber, road.coherency(wavenumber, half_track, -half_track), "k", label="mean and roll process")
    if road.mean.cutoff is None:
        isotropic_road = isotropic_road_like(road, half_track)
        right.semilogx(
            wavenumber,
            isotropic_road.coherency(wavenumber, 2 * half_track),
            "k--",
            label="isotropic, same track spectrum",
        )
    left.set(xlabel="wavenumber [rad/m]", ylabel="two-sided density [m³]", title="Spectrum of the left track")
    right.set(xlabel="wavenumber [rad/m]", ylabel="coherency [-]", ylim=(0, 1.05), title="Left and right track")
    legend_below(figure, left, right, column_count=3)
    _save_figure(figure, heading, ": the road", figure_path)


def model_error_figure(
    relative_errors: Mapping[tuple[str, str], np.ndarray],
    output_names: Sequence[str],
    computing_times: Mapping[str, float],
    heading: FigureHeading,
    figure_path: Path,
) -> None:
    """Save a coloured table of the errors of all outputs by vehicle and road model, with the computing time (s) of a
    covariance."""
    share = 0.66 * COLUMN_WIDTH / len(relative_errors)
    heads = [
        wrapped_text(f"{model}\n{1e3 * computing_times[model]:.2g} ms\n{road}", share, SMALL_TEXT)
        for model, road in relative_errors
    ]
    values = 100 * np.array(list(relative_errors.values())).T
    figure, axis = subplots(figsize=(COLUMN_WIDTH, 0.3 * len(output_names) + 2.2))
    picture = axis.imshow(values, cmap="RdBu_r", vmin=-60, vmax=60, aspect="auto")
    for i, j in np.ndindex(values.shape):
        if np.isfinite(values[i, j]):
            dark = abs(values[i, j]) > 40
            axis.text(
                j,
                i,
                _signed_text(float(values[i, j])),
                ha="center",
                va="center",
                fontsize=SMALL_TEXT,
                color="w" if dark else "k",
            )
    axis.set_xticks(range(len(heads)), heads, fontsize=SMALL_TEXT)
    axis.set_yticks(range(len(output_names)), output_names)
    axis.grid(visible=False)
    figure.colorbar(picture, label="error [%]", extend="both")
    what_is_shown = "largest error of each standard deviation [%], and the time of one covariance"
    _save_figure(figure, heading, f"\n{what_is_shown.capitalize()}", figure_path)


def _signed_text(percent: float) -> str:
    """Text of a percentage as a whole number with its sign; no sign for zero."""
    return f"{percent:+.0f}" if round(percent) else "0"


def drive_figure(
    varying_speed: VaryingSpeedDeviations,
    steady_deviations: np.ndarray,
    drawn_outputs: Sequence[str],
    kind_and_unit: Mapping[str, tuple[str, str]],
    heading: FigureHeading,
    figure_path: Path,
) -> None:
    """Save a figure of the standard deviations along a drive (dashed: quasi-stationary), with the speed below them."""
    groups = list(dict.fromkeys(kind_and_unit[name] for name in drawn_outputs))
    heights = [3.0] * len(groups) + [1.3]
    figure, axes = subplots(
        len(heights), 1, figsize=(COLUMN_WIDTH, sum(heights) + 0.8), sharex=True, height_ratios=heights, squeeze=False
    )
    for axis, (kind, unit) in zip(axes[:, 0], groups, strict=False):
        columns = {
            name: varying_speed.names.index(name) for name in drawn_outputs if kind_and_unit[name] == (kind, unit)
        }
        pairs = {
            name: np.concatenate([varying_speed.deviation[:, i], steady_deviations[:, i]])
            for name, i in columns.items()
        }
        for label, both_curves in _distinct_curves(pairs).items():
            exact, quasi = np.split(both_curves, 2)
            if not np.isfinite(exact).all():  # what is left at standstill is rounding
                axis.plot([], label=label + NO_FINITE_VARIANCE)
                continue
            (line,) = axis.plot(varying_speed.time, exact, label=label)
            axis.plot(varying_speed.time, quasi, "--", color=line.get_color(), linewidth=0.8)
        axis.set(ylabel=f"standard deviation [{_unit_text(unit)}]", title=kind.capitalize(), ylim=(0, None))
        _legend_under_panel(axis, 0.03)
    axes[-1, 0].plot(varying_speed.time, varying_speed.speed, color="0.3")
    axes[-1, 0].set(xlabel="time [s]", ylabel="speed [m/s]", ylim=(0, None))
    _save_figure(figure, heading, "\nSolid: exact; dashed: each speed taken by itself", figure_path)


DRAWN_OUTPUT_LIMIT = 12
"""Largest number of outputs in a figure."""


def nonlinear_figure(nonlinear_sweep: NonlinearRide, heading: FigureHeading, figure_path: Path) -> None:
    """Save a figure of each output's standard deviation over speed by small motion, statistical linearisation and Monte
    Carlo copies; open marks show where statistical linearisation states a large error."""
    outputs = nonlinear_sweep.shown.vehicle.outputs
    figure, axes = _figure_with_few_panels(min(len(outputs), DRAWN_OUTPUT_LIMIT))
    left = nonlinear_sweep.quantity_by_speed("left_out")
    for i, (axis, output) in enumerate(zip(axes, outputs, strict=False)):
        unit, factor = _shown_unit(output.unit)
        axis.plot(
            nonlinear_sweep.speeds,
            factor * nonlinear_sweep.small_motion[:, i],
            "--",
            color=GREY,
            label="slopes at rest (small motion)",
        )
        curve_label = "statistical linearisation" + (", tyres on the road" if nonlinear_sweep.tyres_may_lift else "")
        deviation, poor = factor * nonlinear_sweep.deviation[:, i], left[:, i] > ERROR_GRADES[-1][0]
        axis.plot(nonlinear_sweep.speeds, deviation, color=CORRELATION_COLOURS[1], label=curve_label)
        curve_label = "no longer good by its own measure"
        axis.plot(
            nonlinear_sweep.speeds[poor],
            deviation[poor],
            "o",
            color=CORRELATION_COLOURS[1],
            fillstyle="none",
            label=curve_label,
        )
        for j, (speed, copies) in enumerate(nonlinear_sweep.copies.items()):
            spread = copies.error[i] / copies.deviation[i]  # two standard errors of the deviation
            axis.errorbar(
                [speed],
                [factor * copies.deviation[i]],
                [factor * spread],
                fmt="s",
                color=VERMILION,
                markersize=4,
                capsize=3,
                label=""
                if j
                else "Monte Carlo, 2 standard errors" + (", tyres lift" if nonlinear_sweep.tyres_may_lift else ""),
            )
        axis.set(
            xlabel="speed [m/s]", ylabel=f"standard deviation [{unit}]", ylim=(0, None), title=output.name.capitalize()
        )
    legend_below(figure, *axes, column_count=2)
    _save_figure(figure, heading, "\nStandard deviations over speed", figure_path)


def engine_spectra_figure(
    runs_by_engine: Mapping[str, EngineRide],
    linear_vehicle: LinearVehicle,
    road_excitation: RoadExcitation,
    speed: float,
    heading: FigureHeading,
    figure_path: Path,
) -> None:
    """Save a figure of the spectra of the engines' runs, by Welch's method, and of the statistically linearised
    vehicle."""
    frequency = np.geomspace(0.3, 40.0, 300)
    expected = one_sided_densities(linear_vehicle, road_excitation, speed, frequency)
    first = next(iter(runs_by_engine.values()))
    shown = [i for i in range(len(linear_vehicle.outputs)) if np.isfinite(first.outputs[:, i]).all()][
        :DRAWN_OUTPUT_LIMIT
    ]
    figure, axes = _figure_with_few_panels(len(shown))
    for axis, i in zip(axes, shown, strict=True):
        for (engine, run), (line, width) in zip(runs_by_engine.items(), (("-", 2.2), ("--", 1.0)), strict=False):
            f, density = run.densities(frequency[-1])
            label = f"{LABELS[engine]}, nonlinear in time"
            axis.loglog(f, density[:, i], line, linewidth=width, color=ENGINES[engine], label=label)
        axis.loglog(frequency, expected[:, i], "k", label="statistical linearisation")
        output, top = linear_vehicle.outputs[i], expected[:, i].max()
        unit = f"one-sided density [{_squared_unit(output.unit)}/Hz]"
        axis.set(xlabel="frequency [Hz]", ylabel=unit, title=output.name.capitalize(), ylim=(1e-5 * top, 5 * top))
    legend_below(figure, axes[0], column_count=3)
    _save_figure(figure, heading, f"\nSpectra at {speed:g} m/s", figure_path)


def _figure_with_few_panels(panel_count: int) -> tuple[Figure, list[Axes]]:
    """Figure and axes of small panels, two or three side by side."""
    figure, axes = panels(panel_count, 2 if panel_count in (1, 2, 4) else 3, 2.6)
    figure.set_figheight(figure.get_figheight() + 0.8)  # for title and legend
    return figure, axes


def _legend_under_panel(axis: Axes, relative_drop: float = 0.18) -> None:
    """Put the legend below a panel, ``relative_drop`` times the panel's height lower to leave room for the label."""
    axis.legend(fontsize=SMALL_TEXT, loc="upper center", bbox_to_anchor=(0.5, -relative_drop), ncols=2)


def _save_figure(figure: Figure, heading: FigureHeading, title_ending: str, figure_path: Path) -> None:
    add_heading(figure, heading.title + title_ending, heading.shown_results)
    save(figure, figure_path)
