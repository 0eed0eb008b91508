"""Roads of which two tracks were measured, and one that was made: the fit of mean and roll process to each."""

import math
from typing import Any

import numpy as np
from scipy.signal import lfilter

from models.core.noise import normal
from models.road.fitted import FittedRoad, fit
from models.road.measured_tracks import MeasuredTracks, read_tracks
from models.road.shape_filter import ShapeFilter
from models.road.two_track import road_of_level
from validation.common.rows import Row, System, Table, finding, not_run, within
from validation.common.scenes import COURSE, data_folder

SYSTEM: System = "ride"
SEED = 41
"""Of the road that is made, measured and fitted again."""
HALF_TRACK = 0.7
DATA = {"belgian_block.crg": (None, None), COURSE: (100.0, 404.8), "Horstwalde.crg": (None, None)}
"""Measured roads and the section (m) of each that is looked at."""


def made(length: float) -> tuple[list[Row], dict[str, Any]]:
    """A road made from the two filters, exactly at its stations, and fitted: the filters must come back."""
    road, step = road_of_level(HALF_TRACK), 0.05
    noise = normal(SEED, 0, round(length / step), 2)
    mean, roll = (_passed(f, noise[:, i], step) for i, f in enumerate((road.mean, road.roll)))
    tracks = MeasuredTracks(mean + HALF_TRACK * roll, mean - HALF_TRACK * roll, step, HALF_TRACK, "made")
    fitted = fit(tracks, min(200.0, length / 4.5))
    rows = []
    for name, true, found in (("mean", road.mean, fitted.mean), ("roll", road.roll, fitted.roll)):
        if found is None:
            raise RuntimeError("a roll process that was put in was not found")
        for what, error, ratio in (
            ("corner", found.corner_error, found.filter.corner / true.corner),
            ("intensity", found.intensity_error, found.filter.intensity / true.intensity),
        ):
            rows.append(
                within(
                    f"ride_road.fit.{name}.{what}",
                    SYSTEM,
                    f"{what} of the {name} process fitted to {length / 1e3:g} km of made road over the true one",
                    ratio,
                    "",
                    1.0,
                    4.0 * error + 0.02,
                    "four of the fit's own standard errors, and 2 % for sampling at 5 cm and the window's width",
                    "closed form",
                )
            )
    return rows, _found(tracks, fitted)


def _passed(f: ShapeFilter, noise: np.ndarray, step: float) -> np.ndarray:
    """Samples of a first-order process from unit noise, exact at the stations, stationary from the first on."""
    kept = math.exp(-f.corner * step)
    driven = noise * math.sqrt((1.0 - kept**2) * f.intensity / (2.0 * f.corner))
    driven[0] = noise[0] * math.sqrt(f.intensity / (2.0 * f.corner))
    return np.asarray(lfilter([1.0], [1.0, -kept], driven))


def measured() -> tuple[list[Row], list[dict[str, Any]]]:
    """What measured roads are, and what cannot be told from them."""
    data = data_folder()
    if data is None:
        return [not_run("ride_road.measured", SYSTEM, "measured two-track roads", "TWINRIG_DATA names no folder")], []
    rows, found = [], []
    for name, (first, last) in DATA.items():
        tracks = read_tracks(data / name, first=first, last=last)
        fitted = fit(tracks)
        if name == "belgian_block.crg":
            rows.append(_correlation_row(tracks))
        found.append(_found(tracks, fitted))
        why = f"{tracks.length:.4g} m; " + "; ".join(fitted.notes)
        rows.append(
            finding(
                f"ride_road.measured.{name.split('.')[0]}",
                SYSTEM,
                f"{name}: rms of ln(measured / fitted) spectrum of the mean process",
                fitted.mean.residual,
                "",
                "",
                why,
            )
        )
    return rows, found


def _correlation_row(tracks: MeasuredTracks) -> Row:
    found = float(np.corrcoef(tracks.left, tracks.right)[0, 1])
    return within(
        "ride_road.measured.correlation",
        SYSTEM,
        f"{tracks.name}: correlation of the two tracks",
        found,
        "",
        -0.38,
        0.01,
        "as another reader of the file found",
        "published",
    )


def _found(tracks: MeasuredTracks, fitted: FittedRoad) -> dict[str, Any]:
    """What the figure and the table need."""
    found = fitted.spectra
    some = np.unique(np.geomspace(1, len(found.wavenumber), 160).astype(int)) - 1
    fits = [
        None
        if one is None
        else [
            one.filter.corner,
            one.corner_error,
            one.filter.intensity,
            one.intensity_error,
            one.residual,
            one.resolved,
        ]
        for one in (fitted.mean, fitted.roll)
    ]
    return {
        "name": tracks.name,
        "length": tracks.length,
        "half_track": tracks.half_track,
        "fits": fits,
        "wavenumber": found.wavenumber[some].tolist(),
        "left": found.left[some].tolist(),
        "coherency": found.coherency[some].tolist(),
        "chance": found.chance_coherency(),
        "notes": fitted.notes,
    }


def _verdict(resolved: bool, residual: float) -> str:
    if residual > math.log(2.0):
        return "not of first order"
    return "first order" if resolved else "a level only"


def fits_table(found: list[dict[str, Any]]) -> Table:
    """Both processes of every road, with what is not known."""
    rows = []
    for one in found:
        for process, values in zip(("mean", "roll"), one["fits"], strict=True):
            if values is None:
                rows.append((one["name"], f"{one['length']:.5g}", process, "none", "none", "", "same heights twice"))
                continue
            corner, corner_error, q, q_error, residual, resolved = values
            said = f"{corner:.3g} ({100 * corner_error:.0f} %)" if resolved else "not told"
            unit = "m" if process == "mean" else "1/m"
            rows.append(
                (
                    one["name"],
                    f"{one['length']:.5g}",
                    process,
                    said,
                    f"{q:.3g} {unit} ({100 * q_error:.0f} %)",
                    f"{math.exp(residual):.2f}",
                    _verdict(resolved, residual),
                )
            )
    note = (
        "First-order filters by least squares on logarithms of spectra; in brackets the relative standard error. "
        "The factor is the rms of measured over fitted density."
    )
    heads = ("road", "length [m]", "process", "corner [rad/m]", "intensity", "factor", "what it is")
    return Table("Mean and roll process fitted to two tracks", note, heads, tuple(rows))
