"""Fits of the road model's mean and roll process to measured roads of two tracks and to a generated road.

Spectra and coherency are drawn in the manner of Rill's Fig. 3.
"""

import math
from typing import Any

import numpy as np
from scipy.signal import lfilter

from models.core.noise import normal_samples
from models.road.fitted import FittedRoad, fit_road
from models.road.iso8608 import level_of_class
from models.road.isotropic import isotropic_road_like
from models.road.measured_tracks import MeasuredTracks, read_tracks
from models.road.shape_filter import ShapeFilter
from models.road.two_track import road_of_level
from validation.common.rows import Observed, Row, System, Table, not_run
from validation.common.scenes import COURSE_FILE, data_folder

SYSTEM: System = "ride"
SEED = 41
"""Seed of the generated road, which is sampled and fitted again."""
HALF_TRACK = 0.7
MEASURED_SECTIONS = {"belgian_block.crg": (None, None), COURSE_FILE: (100.0, 404.8), "Horstwalde.crg": (None, None)}
"""Files of measured roads, and first and last station (m) of the section that is fitted."""


def generated_road_rows(road_length: float) -> tuple[list[Row], dict[str, Any]]:
    """Rows and data: parameters of the mean and roll process fitted to a road that is generated from them, divided by
    their true values; road_length : of the road, m."""
    road, step = road_of_level(HALF_TRACK), 0.05
    noise = normal_samples(SEED, 0, round(road_length / step), 2)
    mean, roll = (_first_order_samples(f, noise[:, i], step) for i, f in enumerate((road.mean, road.roll)))
    tracks = MeasuredTracks(mean + HALF_TRACK * roll, mean - HALF_TRACK * roll, step, HALF_TRACK, "made")
    fitted = fit_road(tracks, min(200.0, road_length / 4.5))
    if fitted.roll is None:
        raise RuntimeError("a roll process that was put in was not found")
    rows = [
        Observed(
            f"ride_road.fit.{name}.{filter_parameter}",
            SYSTEM,
            f"ratio of {filter_parameter} of the {name} process fitted to {road_length / 1e3:g} km of made road to the "
            "true value",
            getattr(process.filter, filter_parameter) / getattr(true, filter_parameter),
            "",
        ).within(
            1.0,
            4.0 * getattr(process, f"{filter_parameter}_error") + 0.02,
            "four of the fit's own standard errors, and 2 % for sampling at 5 cm and the window's width",
            "closed form",
        )
        for name, true, process in (("mean", road.mean, fitted.mean), ("roll", road.roll, fitted.roll))
        for filter_parameter in ("corner", "intensity")
    ]
    return rows, _figure_numbers(tracks, fitted)


def _first_order_samples(shape_filter: ShapeFilter, unit_noise: np.ndarray, station_spacing: float) -> np.ndarray:
    """Samples (n,) of a stationary first-order process at stations ``station_spacing`` m apart, from unit noise (n,);
    exact."""
    decay = math.exp(-shape_filter.corner * station_spacing)
    driven = unit_noise * math.sqrt((1.0 - decay**2) * shape_filter.intensity / (2.0 * shape_filter.corner))
    driven[0] = unit_noise[0] * math.sqrt(shape_filter.intensity / (2.0 * shape_filter.corner))
    return lfilter([1.0], [1.0, -decay], driven)


def measured_road_rows() -> tuple[list[Row], list[dict[str, Any]]]:
    """Rows and figure data: properties of measured roads, and fits of the road model to them."""
    data = data_folder()
    if data is None:
        return [not_run("ride_road.measured", SYSTEM, "measured two-track roads", "TWINRIG_DATA names no folder")], []
    rows, shown = [], []
    for name, (first_station, last_station) in MEASURED_SECTIONS.items():
        tracks = read_tracks(data / name, first_station=first_station, last_station=last_station)
        fitted = fit_road(tracks)
        if name == "belgian_block.crg":
            rows.append(
                Observed(
                    "ride_road.measured.correlation",
                    SYSTEM,
                    f"{tracks.name}: correlation of the two tracks",
                    float(np.corrcoef(tracks.left, tracks.right)[0, 1]),
                    "",
                ).within(-0.38, 0.01, "as another reader of the file found", "published")
            )
        shown.append(_figure_numbers(tracks, fitted))
        why = f"{tracks.length:.4g} m; " + "; ".join(fitted.notes)
        rows.append(
            Observed(
                f"ride_road.measured.{name.split('.')[0]}",
                SYSTEM,
                f"{name}: rms of ln(measured / fitted) spectrum of the mean process",
                fitted.mean.log_residual,
                "",
            ).beside("", why)
        )
    return rows, shown


def _figure_numbers(measured_tracks: MeasuredTracks, fitted_road: FittedRoad) -> dict[str, Any]:
    """Numbers of a fitted road that are saved for the figure and the table."""
    spectra = fitted_road.spectra
    drawn_rows = np.unique(np.geomspace(1, len(spectra.wavenumber), 160).astype(int)) - 1
    fits = [
        fit
        and [
            fit.filter.corner,
            fit.corner_error,
            fit.filter.intensity,
            fit.intensity_error,
            fit.log_residual,
            fit.corner_is_resolved,
        ]
        for fit in (fitted_road.mean, fitted_road.roll)
    ]
    return {
        "name": measured_tracks.name,
        "length": measured_tracks.length,
        "half_track": measured_tracks.half_track,
        "fits": fits,
        **{key: getattr(spectra, key)[drawn_rows].tolist() for key in ("wavenumber", "left", "coherency")},
        "chance": spectra.chance_coherency(),
        "notes": fitted_road.notes,
    }


def _verdict_text(is_resolved: bool, relative_residual: float) -> str:
    if relative_residual > math.log(2.0):
        return "not of first order"
    return "first order" if is_resolved else "a level only"


def fits_table(fitted_roads: list[dict[str, Any]]) -> Table:
    """Table of the fitted mean and roll process of every road, with standard errors."""
    rows = []
    for road in fitted_roads:
        for process, unit, values in zip(("mean", "roll"), ("m", "1/m"), road["fits"], strict=True):
            columns = ["none", "none", "", "same heights twice"]
            if values is not None:
                corner, corner_error, q, q_error, residual, resolved = values
                columns = [
                    f"{corner:.3g} ({100 * corner_error:.0f} %)" if resolved else "not told",
                    f"{q:.3g} {unit} ({100 * q_error:.0f} %)",
                    f"{math.exp(residual):.2f}",
                    _verdict_text(resolved, residual),
                ]
            rows.append((road["name"], f"{road['length']:.5g}", process, *columns))
    note = (
        "First-order filters by least squares on logarithms of spectra; in brackets the relative standard error. "
        "The factor is the rms of measured over fitted density."
    )
    heads = ("road", "length [m]", "process", "corner [rad/m]", "intensity", "factor", "what it is")
    return Table("Mean and roll process fitted to two tracks", note, heads, tuple(rows))


def coherency_figure(half_track: float, measured_roads: list[dict[str, Any]]) -> tuple[str, Any]:
    """Figure of road spectra over the wavenumber (left), and of the coherency of both tracks (right); measured roads
    are thin lines. Returns caption and figure."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    road, k = road_of_level(half_track), np.geomspace(0.02, 100.0, 300)
    isotropic = isotropic_road_like(road, half_track)
    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.8))
    left.fill_between(
        k,
        level_of_class("C") / 2 / k**2,
        level_of_class("C") * 2 / k**2,
        color="0.92",
        zorder=0,
        label="ISO 8608 class C, limits halved",
    )
    left.loglog(k, road.spectrum(k, half_track), "k", lw=2, label="track: mean and roll process")
    left.loglog(k, road.mean.spectrum(k), "k--", label="mean process")
    left.loglog(k, half_track**2 * road.roll.spectrum(k), "k:", label="roll process, times b²")
    right.semilogx(k, road.coherency(k, half_track, -half_track), "k", lw=2, label="mean and roll process")
    right.semilogx(k, isotropic.coherency(k, 2 * half_track), "k-.", label="isotropic, same track spectrum")
    for i, shown in enumerate(measured_roads):
        thin = {"color": f"C{i}", "lw": 0.8}
        left.loglog(shown["wavenumber"], shown["left"], label=_road_label(shown), **thin)
        if shown["fits"][1] is not None:
            right.semilogx(shown["wavenumber"], shown["coherency"], label=_road_label(shown), **thin)
            right.axhline(shown["chance"], ls=(0, (1, 3)), **thin)
    left.set(
        title="Left track: two-sided density [m³]", xlabel="wavenumber [rad/m]", xlim=(0.02, 100), ylim=(1e-10, 1e-1)
    )
    right.set(title="Coherency of left and right [-]", xlabel="wavenumber [rad/m]", xlim=(0.02, 100), ylim=(0, 1.05))
    for axis in (left, right):
        axis.legend(fontsize=7.5, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    add_heading(
        figure, "A road of mean and roll process: both tracks move together in long waves and part in short ones"
    )
    caption = (
        f"Tracks {2 * half_track:g} m apart with the values read from the paper; its vehicle and measurements are "
        "not recoverable. Dotted levels: what chance alone shows in 95 % of the windowed estimates."
    )
    return caption, figure


def _road_label(fitted_road: dict[str, Any]) -> str:
    name, length = fitted_road["name"].removesuffix(".crg").replace("_", " "), fitted_road["length"]
    return f"{name}, {length:.3g} m" if length < 999 else f"{name}, {length / 1e3:.3g} km"
